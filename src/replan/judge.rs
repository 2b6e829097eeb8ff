//! The verdict on a mission: every leg, as the vehicle flies it, against every region.

use std::collections::BTreeMap;

use super::altitudes::{Incomparable, LimitFinding};
use super::field::{Field, Fields};
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
    /// The obstacles that it would come too near to if it were not flown over or under them.
    pub passed: Vec<String>,
    /// The altitude limit that it breaks or cannot be judged by.
    pub limit: Option<LimitFinding>,
}

impl LegVerdict {
    /// Whether it keeps the buffer from every region and its altitudes keep the limits.
    #[must_use]
    pub fn is_clear(&self) -> bool {
        self.blocker.is_none() && self.limit.is_none()
    }

    /// Whether it meets a region even without the buffer, or breaks an altitude limit.
    #[must_use]
    pub fn collides(&self) -> bool {
        matches!(self.blocker, Some((_, true))) || self.limit.is_some()
    }
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
    /// Whether every leg keeps the buffer and the altitude limits.
    #[must_use]
    pub fn is_clear(&self) -> bool {
        self.legs.iter().all(LegVerdict::is_clear)
    }

    /// Whether a leg meets an obstacle or leaves an inclusion even without the buffer.
    #[must_use]
    pub fn collides(&self) -> bool {
        self.legs.iter().any(LegVerdict::collides)
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

/// Whether a leg is part of the plain way: no jump by it or to it, no return to anywhere but home.
pub(super) fn is_on_the_way(leg: &Leg) -> bool {
    leg.jump.is_none()
        && !leg.behind_jump
        && matches!(leg.kind, LegKind::Flown | LegKind::Takeoff | LegKind::Return(ReturnTo::Home))
}

/// Judges a mission. An empty mission is clear.
///
/// # Errors
/// [`ReplanError`] where a region cannot be used or the path is not known.
pub fn judge(input: &Input<'_>, options: &Options) -> Result<Verdict, ReplanError> {
    let flown = legs(input.mission, &input.context(options.loiter))?;
    let fields = Fields::new(&flown.legs, input, options)?;
    verdict(&flown, &fields, options)
}

/// The zones of a mission's legs with the fences in them, for a picture of a mission that was
/// judged and not planned.
///
/// # Errors
/// As [`judge`].
pub fn fields(input: &Input<'_>, options: &Options) -> Result<Vec<Field>, ReplanError> {
    let flown = legs(input.mission, &input.context(options.loiter))?;
    let fields = Fields::new(&flown.legs, input, options)?;
    Ok(fields.pictured(options.settings.buffer.0))
}

pub(super) fn verdict(
    flown: &MissionLegs,
    fields: &Fields<'_>,
    options: &Options,
) -> Result<Verdict, ReplanError> {
    let mut verdicts = Vec::with_capacity(flown.legs.len());
    // Why heights did not help where they might have, and how many legs that is so for.
    let mut unused: BTreeMap<Incomparable, usize> = BTreeMap::new();
    let mut warnings: Vec<String> = flown.warnings.iter().map(ToString::to_string).collect();
    for leg in &flown.legs {
        let (verdict, incomparable) = leg_verdict(leg, fields, options)?;
        verdicts.push(verdict);
        if let Some(why) = incomparable {
            *unused.entry(why).or_default() += 1;
        }
        warnings.extend(fields.altitudes.near_limit(leg));
    }
    warnings.extend(fields.warnings());
    warnings.extend(unused.iter().map(|(why, legs)| why.told(*legs)));
    Ok(Verdict { legs: verdicts, warnings })
}

/// How far the vehicle may be from the straight line of a leg, metres.
pub(super) fn reach(leg: &Leg) -> Result<f64, ReplanError> {
    leg.sweep().map(|sweep| sweep.0).ok_or_else(|| {
        ReplanError::unjudged(leg, "it is flown on a curve without a bound; use straight legs")
    })
}

/// The verdict, and why the heights of what bars the way could not be compared, where it has any.
fn leg_verdict(
    leg: &Leg,
    fields: &Fields<'_>,
    options: &Options,
) -> Result<(LegVerdict, Option<Incomparable>), ReplanError> {
    let view =
        fields.of(leg).ok_or_else(|| ReplanError::unjudged(leg, "its zone was not prepared"))?;
    let (from, to) = (leg.from.position, leg.to.position);
    let space = view.leg_space(options.settings.buffer.0, from, to);
    let (a, b) = (view.frame.to_local(from)?, view.frame.to_local(to)?);
    let reach = reach(leg)?;
    let deviation = space.flown_deviation((b.x - a.x).hypot(b.y - a.y));
    let needed = space.margin() + reach * view.spread + deviation;
    // The hull of the circles at the ends lies within the larger circle's reach of the line.
    let region = view.airspace.blocker(a, b, needed);
    let clearance = ((view.airspace.clearance(a, b) - reach * view.spread) / view.spread).max(0.0);
    let heights = region.and_then(|region| fields.region(region)?.heights);
    let incomparable =
        heights.and_then(|heights| fields.altitudes.compare(leg, &heights).incomparable());
    let passed = view.cleared_near(a, b, needed);
    let verdict = LegVerdict {
        leg: *leg,
        length: geodesic_distance(from, to),
        clearance: Metres(clearance),
        blocker: region.map(|region| (fields.name(region).to_owned(), clearance <= 0.0)),
        passed: passed.into_iter().map(|region| fields.name(region).to_owned()).collect(),
        limit: fields.altitudes.limit(leg),
    };
    Ok((verdict, incomparable))
}

/// Whether a leg can be given waypoints.
pub(super) fn can_be_replanned(leg: &Leg) -> bool {
    (leg.insert_before.is_some() || leg.by_jump.is_some())
        && leg.shape == LegShape::Straight
        && matches!(leg.kind, LegKind::Flown | LegKind::Return(_))
}
