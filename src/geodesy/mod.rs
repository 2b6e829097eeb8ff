//! Positions on the Earth (WGS 84) and their projection to a plane in ground metres.
//!
//! - [`position`]: geographic positions, in degrees or as the integers a flight controller flies;
//! - [`zone`]: which UTM or UPS zone a leg is planned in;
//! - [`projection`]: PROJ's conversion between positions and a zone's grid;
//! - [`local`]: the planar frame that planning happens in, in ground metres.
//!
//! Only `projection` talks to PROJ. Nothing here knows of missions or fences.

pub mod local;
pub mod position;
pub mod projection;
pub mod zone;

pub use local::{LocalFrame, Xy};
pub use position::{LatLon, LatLonE7, PositionError};
pub use projection::{Projection, ProjectionError, Utm};
pub use zone::{Zone, ZoneError};

use geo::{Distance, Geodesic, Point};

use crate::units::Metres;

/// A longitude, or a difference of two, as one from -180 to 180 degrees.
#[must_use]
pub(crate) fn wrapped(longitude: f64) -> f64 {
    (longitude + 540.0).rem_euclid(360.0) - 180.0
}

/// Mean radius of the Earth, metres.
pub(crate) const EARTH_RADIUS: f64 = 6_371_009.0;

/// The length of the geodesic between two positions on the WGS 84 ellipsoid (Karney 2013).
///
/// This is what every reported length is made of: it depends on no projection.
#[must_use]
pub fn geodesic_distance(from: LatLon, to: LatLon) -> Metres {
    Metres(Geodesic.distance(Point::new(from.lon(), from.lat()), Point::new(to.lon(), to.lat())))
}
