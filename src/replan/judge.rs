//! The verdict on a mission: every leg, as the vehicle flies it, against every region.

use super::field::{Field, Fields, Zoned};
use super::reason::ReplanError;
use super::{Input, Options};
use crate::geodesy::{LatLon, geodesic_distance};
use crate::mission::legs::{LegKind, LegShape, ReturnTo};
use crate::mission::{Leg, MissionLegs, legs};
use crate::units::Metres;

/// The judgement of one leg.
#[derive(Debug, Clone, PartialEq)]
pub struct LegVerdict {
    /// The leg.
    pub leg: Leg,
    /// The geodesic between its ends.
    pub length: Metres,
    /// The nearest that the vehicle comes to any region's edge, circles and curves included; zero
    /// where it meets one or is on its wrong side. Never more than the truth.
    pub clearance: Metres,
    /// The region that it comes too near to, by its name, and whether it meets it even without
    /// the buffer. `None`: the leg is clear.
    pub blocker: Option<(String, bool)>,
}

/// The judgement of a mission.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// Its legs in the order that they are flown, returns last.
    pub legs: Vec<LegVerdict>,
    /// What was assumed or odd, a sentence each.
    pub warnings: Vec<String>,
}

impl Verdict {
    /// Whether every leg keeps the buffer.
    #[must_use]
    pub fn is_clear(&self) -> bool {
        self.legs.iter().all(|leg| leg.blocker.is_none())
    }

    /// Whether a leg meets an obstacle or leaves an inclusion even without the buffer.
    #[must_use]
    pub fn collides(&self) -> bool {
        self.legs.iter().any(|leg| matches!(leg.blocker, Some((_, true))))
    }

    /// The least clearance of any leg; infinite without regions or legs.
    #[must_use]
    pub fn clearance(&self) -> Metres {
        self.legs.iter().fold(Metres::INFINITY, |least, leg| least.min(leg.clearance))
    }

    /// The length of the way: all legs that follow each other when nothing jumps, the return
    /// home included.
    #[must_use]
    pub fn length(&self) -> Metres {
        self.way().map(|leg| leg.length).sum()
    }

    /// The places along the way.
    #[must_use]
    pub fn places(&self) -> Vec<LatLon> {
        let mut places = Vec::new();
        for verdict in self.way() {
            for position in [verdict.leg.from.position, verdict.leg.to.position] {
                if places.last() != Some(&position) {
                    places.push(position);
                }
            }
        }
        places
    }

    fn way(&self) -> impl Iterator<Item = &LegVerdict> {
        self.legs.iter().filter(|verdict| is_on_the_way(&verdict.leg))
    }
}

/// Whether a leg is part of the plain way: no jump, no return to anywhere but home.
pub(super) fn is_on_the_way(leg: &Leg) -> bool {
    leg.jump.is_none()
        && matches!(leg.kind, LegKind::Flown | LegKind::Takeoff | LegKind::Return(ReturnTo::Home))
}

/// Judges a mission. An empty mission is clear.
///
/// # Errors
/// [`ReplanError`] where a region cannot be used or the path is not known.
pub fn judge(input: &Input<'_>, options: &Options) -> Result<Verdict, ReplanError> {
    let flown = legs(input.mission, &input.context())?;
    let fields = Fields::new(&flown.legs, input.fences, options)?;
    verdict(&flown, &fields, input, options)
}

/// The zones of a mission's legs with the fences in them, for a picture of a mission that was
/// judged and not planned.
///
/// # Errors
/// As [`judge`].
pub fn fields(input: &Input<'_>, options: &Options) -> Result<Vec<Field>, ReplanError> {
    let flown = legs(input.mission, &input.context())?;
    let fields = Fields::new(&flown.legs, input.fences, options)?;
    Ok(fields.pictured(options.settings.buffer.0))
}

pub(super) fn verdict(
    flown: &MissionLegs,
    fields: &Fields,
    input: &Input<'_>,
    options: &Options,
) -> Result<Verdict, ReplanError> {
    let mut verdicts = Vec::with_capacity(flown.legs.len());
    for leg in &flown.legs {
        let (_, zoned) = fields
            .of(leg.from.position, leg.to.position)
            .ok_or_else(|| ReplanError::unjudged(leg, "its zone was not prepared"))?;
        verdicts.push(leg_verdict(leg, zoned, input, options)?);
    }
    let mut warnings: Vec<String> = flown.warnings.iter().map(ToString::to_string).collect();
    warnings.extend(fields.warnings());
    Ok(Verdict { legs: verdicts, warnings })
}

/// How far the vehicle may be from the straight line of a leg, metres.
pub(super) fn reach(leg: &Leg) -> Result<f64, ReplanError> {
    leg.sweep().map(|sweep| sweep.0).ok_or_else(|| {
        ReplanError::unjudged(leg, "it is flown on a curve without a bound; use straight legs")
    })
}

fn leg_verdict(
    leg: &Leg,
    zoned: &Zoned,
    input: &Input<'_>,
    options: &Options,
) -> Result<LegVerdict, ReplanError> {
    let (from, to) = (leg.from.position, leg.to.position);
    let buffer = options.settings.buffer.0;
    let space = zoned.leg_space(buffer, from, to);
    let (a, b) = (zoned.frame.to_local(from)?, zoned.frame.to_local(to)?);
    let reach = reach(leg)?;
    let deviation = space.flown_deviation((b.x - a.x).hypot(b.y - a.y));
    let aside = reach * zoned.spread + deviation;
    // The hull of the circles at the ends lies within the larger circle's reach of the line.
    let region = zoned.airspace.blocker(a, b, space.margin() + aside);
    let clearance =
        ((zoned.airspace.clearance(a, b) - reach * zoned.spread) / zoned.spread).max(0.0);
    let name = |region: crate::airspace::RegionId| {
        input.fences.regions.get(region.0 as usize).map_or_else(String::new, |r| r.origin.clone())
    };
    Ok(LegVerdict {
        leg: *leg,
        length: geodesic_distance(from, to),
        clearance: Metres(clearance),
        blocker: region.map(|region| (name(region), clearance <= 0.0)),
    })
}

/// Whether a leg can be given waypoints.
pub(super) fn can_be_replanned(leg: &Leg) -> bool {
    leg.insert_before.is_some()
        && leg.shape == LegShape::Straight
        && matches!(leg.kind, LegKind::Flown | LegKind::Return(_))
}
