//! Frames and airspaces: one for each zone that legs of the mission are planned in, without the
//! obstacles that a leg is clear of by its altitudes.

use std::collections::{BTreeMap, HashMap};

use geo::MultiPolygon;

use super::altitudes::Altitudes;
use super::reason::ReplanError;
use super::{Input, Options};
use crate::airspace::{Airspace, AirspaceError, Outline, RegionId};
use crate::fence::{FenceRegion, FenceSet};
use crate::geodesy::{LatLon, LocalFrame, ProjectionError, Xy, Zone};
use crate::mission::Leg;
use crate::planner::leg_space::LegSpace;

/// One zone's part of a mission, for pictures: regions in the zone's local metres.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// The zone.
    pub zone: Zone,
    /// Where its local metres begin: the origin of its [`LocalFrame`].
    pub origin: LatLon,
    /// The regions, by their index in the fence set; a limit around home comes last.
    pub outlines: Vec<Outline>,
    /// Where several inclusions are joined by `any`: what they allow together.
    pub union: Option<MultiPolygon>,
    /// What paths keep from them, local metres.
    pub margin: f64,
}

/// Why a mission has no airspace.
#[derive(Debug, thiserror::Error)]
pub enum FieldError {
    /// A region cannot be used.
    #[error(transparent)]
    Region(#[from] AirspaceError),
    /// A place cannot be projected.
    #[error(transparent)]
    Projection(#[from] ProjectionError),
}

/// A frame with the airspace in it.
#[derive(Debug)]
struct Zoned {
    origin: LatLon,
    frame: LocalFrame,
    /// All regions.
    airspace: Airspace,
    /// The airspace without the obstacles that some leg is clear of by its altitudes.
    reduced: HashMap<Vec<RegionId>, Airspace>,
    /// The largest scale at any end of a leg: see [`LocalFrame::scale_spread`].
    spread: f64,
}

/// The airspace as one leg meets it.
#[derive(Debug)]
pub(super) struct View<'a> {
    pub(super) zone: Zone,
    pub(super) frame: &'a LocalFrame,
    /// The largest scale at any end of a leg: see [`LocalFrame::scale_spread`].
    pub(super) spread: f64,
    /// Without the obstacles that the leg is clear of by its altitudes.
    pub(super) airspace: &'a Airspace,
    /// All regions.
    whole: &'a Airspace,
    cleared: Vec<RegionId>,
}

impl<'a> View<'a> {
    /// The leg's view of the airspace with a buffer in ground metres.
    pub(super) fn leg_space(&self, buffer: f64, from: LatLon, to: LatLon) -> LegSpace<'a> {
        let latitude = if from.lat().abs() > to.lat().abs() { from.lat() } else { to.lat() };
        LegSpace::new(self.airspace, buffer * self.spread, latitude)
    }

    /// The obstacles nearer to a segment than `margin` that the leg is clear of by its altitudes.
    pub(super) fn cleared_near(&self, a: Xy, b: Xy, margin: f64) -> Vec<RegionId> {
        if self.cleared.is_empty() {
            return Vec::new();
        }
        let near = self.whole.obstacles_near(a, b, margin);
        near.into_iter().filter(|region| self.cleared.binary_search(region).is_ok()).collect()
    }
}

/// The frames of a mission's legs.
#[derive(Debug)]
pub(super) struct Fields<'a> {
    zones: BTreeMap<Zone, Zoned>,
    forced: Option<Zone>,
    fences: &'a FenceSet,
    /// The circle around home, where there is one. Its id follows on those of the fences.
    limits: Vec<FenceRegion>,
    pub(super) altitudes: Altitudes,
}

impl<'a> Fields<'a> {
    /// Projects the fences into every zone that a leg is in.
    pub(super) fn new(
        legs: &[Leg],
        input: &Input<'a>,
        options: &Options,
    ) -> Result<Self, ReplanError> {
        let altitudes = Altitudes::of(input.mission, options)?;
        let limits: Vec<FenceRegion> = match input.mission.home {
            Some(home) => options.rules.limits.circle(home.position).into_iter().collect(),
            None => Vec::new(),
        };
        let fences = input.fences;
        let mut ends: BTreeMap<Zone, Vec<LatLon>> = BTreeMap::new();
        for leg in legs {
            let (from, to) = (leg.from.position, leg.to.position);
            let zone = options.zone.unwrap_or_else(|| Zone::of_leg(from, to));
            ends.entry(zone).or_default().extend([from, to]);
        }
        let mut zones = BTreeMap::new();
        for (zone, ends) in ends {
            let Some(&origin) = ends.first() else { continue };
            let frame = LocalFrame::new(zone, origin)?;
            let spread = frame.scale_spread(&ends)?;
            let airspace = Airspace::with_limits(fences, &limits, &frame, options.inclusion)
                .map_err(FieldError::from)?;
            let reduced = HashMap::new();
            zones.insert(zone, Zoned { origin, frame, airspace, reduced, spread });
        }
        let mut fields = Self { zones, forced: options.zone, fences, limits, altitudes };
        for leg in legs {
            let cleared = fields.cleared(leg);
            if !cleared.is_empty()
                && let Some(zoned) = fields.zones.get_mut(&zone_of(leg, options.zone))
            {
                let Zoned { airspace, reduced, .. } = zoned;
                reduced.entry(cleared).or_insert_with_key(|cleared| airspace.without(cleared));
            }
        }
        Ok(fields)
    }

    /// The obstacles that a leg is clear of by its altitudes, rising.
    fn cleared(&self, leg: &Leg) -> Vec<RegionId> {
        self.altitudes.cleared(leg, self.fences)
    }

    /// The airspace as a leg meets it that [`Fields::new`] was given.
    pub(super) fn of(&self, leg: &Leg) -> Option<View<'_>> {
        let zone = zone_of(leg, self.forced);
        let Zoned { frame, airspace: whole, reduced, spread, .. } = self.zones.get(&zone)?;
        let cleared = self.cleared(leg);
        let airspace = match cleared.is_empty() {
            true => whole,
            false => reduced.get(&cleared)?,
        };
        Some(View { zone, frame, spread: *spread, airspace, whole, cleared })
    }

    /// A region of the fences, or a limit.
    pub(super) fn region(&self, id: RegionId) -> Option<&FenceRegion> {
        let index = id.0 as usize;
        let fences = &self.fences.regions;
        fences.get(index).or_else(|| self.limits.get(index.checked_sub(fences.len())?))
    }

    /// What messages call a region.
    pub(super) fn name(&self, id: RegionId) -> &str {
        self.region(id).map_or("a fence", |region| region.origin.as_str())
    }

    /// What was odd about the regions, once each.
    pub(super) fn warnings(&self) -> Vec<String> {
        self.zones.values().next().map_or_else(Vec::new, |zoned| zoned.airspace.warnings().to_vec())
    }

    /// The zones for pictures.
    pub(super) fn pictured(&self, buffer: f64) -> Vec<Field> {
        self.zones
            .iter()
            .map(|(&zone, zoned)| Field {
                zone,
                origin: zoned.origin,
                outlines: zoned.airspace.outlines().to_vec(),
                union: zoned.airspace.union().cloned(),
                margin: buffer * zoned.spread,
            })
            .collect()
    }
}

/// The obstacles that a leg of the mission is clear of by its altitudes, rising: planning leaves
/// them out of its airspace.
///
/// # Errors
/// As [`super::judge()`].
pub fn cleared(
    leg: &Leg,
    input: &Input<'_>,
    options: &Options,
) -> Result<Vec<RegionId>, ReplanError> {
    Ok(Altitudes::of(input.mission, options)?.cleared(leg, input.fences))
}

fn zone_of(leg: &Leg, forced: Option<Zone>) -> Zone {
    forced.unwrap_or_else(|| Zone::of_leg(leg.from.position, leg.to.position))
}
