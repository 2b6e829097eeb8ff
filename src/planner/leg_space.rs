//! The airspace as one leg sees it: with the margin that a path has to keep, and with what a
//! long straight edge may deviate from the line that was planned.

use crate::airspace::{Airspace, RegionId};
use crate::geodesy::{EARTH_RADIUS, Xy};

/// An [`Airspace`] with the margin of a leg, all in the metres of the leg's local frame.
#[derive(Debug, Clone, Copy)]
pub struct LegSpace<'a> {
    airspace: &'a Airspace,
    /// What a flown path must keep: the buffer, made up for the frame's change of scale.
    margin: f64,
    /// Metres of deviation per square metre of edge length.
    deviation: f64,
    /// The deviation that an edge of a finished path may have, metres; longer ones are divided.
    edge_deviation: f64,
}

/// What planning keeps beyond the margin, metres: positions are rounded to 1e-7° (at most 8 mm
/// off) before the result is judged.
const ROUNDING: f64 = 0.009;

/// The most pieces that an edge is divided into.
const MOST_PIECES: f64 = 1000.0;

/// The most that an edge of a finished path may deviate, metres.
const MAX_DEVIATION: f64 = 0.01;

impl<'a> LegSpace<'a> {
    /// A leg's view of an airspace: `margin` in local metres, the leg's northernmost or
    /// southernmost latitude in degrees.
    #[must_use]
    pub fn new(airspace: &'a Airspace, margin: f64, latitude: f64) -> Self {
        // What a vehicle flies between two waypoints lies between the geodesic and the rhumb
        // line: over a length L these are apart by L² tan φ / 8R in the middle. The planned line
        // is straight on the map, which is apart from the geodesic by L² x / 8R² at a distance x
        // from the central meridian; 0.15 stands for x/R, far outside any zone.
        let tangent = latitude.abs().min(85.0).to_radians().tan();
        let deviation = (tangent + 0.15) / (8.0 * EARTH_RADIUS);
        Self { airspace, margin, deviation, edge_deviation: MAX_DEVIATION }
    }

    /// The same for planning with edges that are not much longer than `length` metres: they need
    /// not keep more than these deviate.
    #[must_use]
    pub fn with_edges_up_to(mut self, length: f64) -> Self {
        self.edge_deviation = self.flown_deviation(length).min(MAX_DEVIATION);
        self
    }

    /// The airspace.
    #[must_use]
    pub fn airspace(&self) -> &'a Airspace {
        self.airspace
    }

    /// The margin that a flown path must keep, local metres.
    #[must_use]
    pub fn margin(&self) -> f64 {
        self.margin
    }

    /// The margin that planned paths keep, local metres.
    #[must_use]
    pub fn planning_margin(&self) -> f64 {
        self.margin + ROUNDING + self.edge_deviation
    }

    /// How far the vehicle may be from the planned line on a straight edge, metres.
    #[must_use]
    pub fn flown_deviation(&self, length: f64) -> f64 {
        self.deviation * length * length
    }

    /// Into how many pieces a planned edge has to be divided so that it is clear when it is flown
    /// between rounded positions: one, unless it is long and something is near.
    #[must_use]
    pub fn pieces(&self, a: Xy, b: Xy) -> u32 {
        let length = (b.x - a.x).hypot(b.y - a.y);
        let deviation = self.flown_deviation(length);
        if deviation <= self.edge_deviation
            || self.airspace.is_clear(a, b, self.margin + ROUNDING + deviation)
        {
            return 1;
        }
        // The deviation goes with the square of the length.
        (deviation / self.edge_deviation).sqrt().ceil().clamp(1.0, MOST_PIECES) as u32
    }

    /// Whether a planned edge keeps the planning margin.
    #[must_use]
    pub fn is_clear(&self, a: Xy, b: Xy) -> bool {
        self.airspace.is_clear(a, b, self.planning_margin())
    }

    /// The judgement of a final edge: what bars it when it is flown, its deviation included.
    #[must_use]
    pub fn flown_blocker(&self, a: Xy, b: Xy) -> Option<RegionId> {
        let length = (b.x - a.x).hypot(b.y - a.y);
        self.airspace.blocker(a, b, self.margin + self.flown_deviation(length))
    }
}
