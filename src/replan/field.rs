//! Frames and airspaces: one for each zone that legs of the mission are planned in.

use std::collections::BTreeMap;

use geo::MultiPolygon;

use super::Options;
use crate::airspace::{Airspace, AirspaceError, Outline};
use crate::fence::FenceSet;
use crate::geodesy::{LatLon, LocalFrame, ProjectionError, Zone};
use crate::mission::Leg;
use crate::planner::leg_space::LegSpace;

/// One zone's part of a mission, for pictures: regions in the zone's local metres.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// The zone.
    pub zone: Zone,
    /// Where its local metres begin: the origin of its [`LocalFrame`].
    pub origin: LatLon,
    /// The regions, by their index in the fence set.
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
pub(super) struct Zoned {
    origin: LatLon,
    pub(super) frame: LocalFrame,
    pub(super) airspace: Airspace,
    /// The largest scale at any end of a leg: see [`LocalFrame::scale_spread`].
    pub(super) spread: f64,
}

impl Zoned {
    /// A leg's view of the airspace with a buffer in ground metres.
    pub(super) fn leg_space(&self, buffer: f64, from: LatLon, to: LatLon) -> LegSpace<'_> {
        let latitude = if from.lat().abs() > to.lat().abs() { from.lat() } else { to.lat() };
        LegSpace::new(&self.airspace, buffer * self.spread, latitude)
    }
}

/// The frames of a mission's legs.
#[derive(Debug)]
pub(super) struct Fields {
    zones: BTreeMap<Zone, Zoned>,
    forced: Option<Zone>,
}

impl Fields {
    /// Projects the fences into every zone that a leg is in.
    pub(super) fn new(
        legs: &[Leg],
        fences: &FenceSet,
        options: &Options,
    ) -> Result<Self, FieldError> {
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
            let airspace = Airspace::new(fences, &frame, options.inclusion)?;
            zones.insert(zone, Zoned { origin, frame, airspace, spread });
        }
        Ok(Self { zones, forced: options.zone })
    }

    /// The zone of a leg that [`Fields::new`] was given.
    pub(super) fn of(&self, from: LatLon, to: LatLon) -> Option<(Zone, &Zoned)> {
        let zone = self.forced.unwrap_or_else(|| Zone::of_leg(from, to));
        self.zones.get(&zone).map(|zoned| (zone, zoned))
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
