//! Fences: the areas a vehicle may or may not fly in, whatever they were read from.
//!
//! A [`FenceSet`] is still geographic and unbuffered. Turning it into something a path can be
//! tested against is [`crate::airspace`]'s work. [`items`] reads and writes the fence plan items that
//! vehicles and files hold; [`rules`] is what a vehicle's parameters say about its fence besides;
//! [`height`] is how high a region reaches.

pub mod height;
pub mod items;
pub mod rules;
#[cfg(test)]
pub(crate) mod samples;

pub use height::{HeightRange, HeightReference};
pub use items::{DecodedFence, FenceItemError, decode_fence, encode_fence};
pub use rules::{InclusionRule, Limit, Limits, VehicleRules};

use crate::geodesy::{LatLon, geodesic_distance};
use crate::units::Metres;

/// On which side of its edge a region may be flown in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FenceRole {
    /// Only inside.
    Inclusion,
    /// Only outside: an obstacle or no-fly zone.
    Exclusion,
}

/// The shape of a region.
#[derive(Debug, Clone, PartialEq)]
pub enum FenceShape {
    /// A ring of vertices, not closed (the last is joined to the first), in either winding.
    Polygon(Vec<LatLon>),
    /// A circle on the ground.
    Circle {
        /// Its centre.
        centre: LatLon,
        /// Its radius.
        radius: Metres,
    },
}

impl FenceShape {
    /// Whether a position is inside, as the autopilots tell: by the even-odd rule in degrees, and by
    /// the distance on the ground. For what is said about a region, not for judging a path.
    #[must_use]
    pub fn contains(&self, position: LatLon) -> bool {
        match self {
            Self::Circle { centre, radius } => geodesic_distance(*centre, position) < *radius,
            Self::Polygon(ring) => {
                let edges = ring.iter().zip(ring.iter().cycle().skip(1));
                edges.fold(false, |inside, (a, b)| {
                    let crosses = (a.lat() > position.lat()) != (b.lat() > position.lat())
                        && position.lon()
                            < (b.lon() - a.lon()) * (position.lat() - a.lat())
                                / (b.lat() - a.lat())
                                + a.lon();
                    inside != crosses
                })
            }
        }
    }
}

/// One region, and where it came from so that a message can name it.
#[derive(Debug, Clone, PartialEq)]
pub struct FenceRegion {
    /// Inside or outside.
    pub role: FenceRole,
    /// Its outline.
    pub shape: FenceShape,
    /// How high it reaches; `None`: it counts at all altitudes.
    pub heights: Option<HeightRange>,
    /// What to call it in a message, such as `fence items 4-9` or `city.geojson feature 3`.
    pub origin: String,
}

/// All regions that apply to a mission.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FenceSet {
    /// The regions in the order they were read.
    pub regions: Vec<FenceRegion>,
    /// Where a vehicle that breached the fence goes back to, where one is set, with its altitude.
    pub return_point: Option<(LatLon, f32)>,
}
