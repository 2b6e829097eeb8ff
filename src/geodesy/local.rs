//! The planar frame that a leg is planned in: a zone's grid, moved to the leg and scaled to
//! ground metres there, so that nothing in the planner has to know of projections.

use geo::Coord;

use super::position::LatLon;
use super::projection::{Projection, ProjectionError, Utm};
use super::zone::Zone;

/// A point or vector of a [`LocalFrame`]: x east, y north (grid north), in ground metres.
pub type Xy = Coord<f64>;

/// Ground metres around an origin. Distances are exact at the origin and off by the change of
/// the grid's scale elsewhere, which [`LocalFrame::scale_spread`] bounds for given places.
#[derive(Debug)]
pub struct LocalFrame {
    projection: Projection,
    origin: Utm,
    /// Grid metres per ground metre at the origin.
    scale: f64,
}

impl LocalFrame {
    /// The frame of a zone around an origin.
    ///
    /// # Errors
    /// [`ProjectionError`] where the origin cannot be projected into the zone.
    pub fn new(zone: Zone, origin: LatLon) -> Result<Self, ProjectionError> {
        let projection = Projection::new(zone)?;
        let scale = projection.point_scale(origin)?;
        let origin = projection.forward(origin)?;
        Ok(Self { projection, origin, scale })
    }

    /// The zone whose grid this is.
    #[must_use]
    pub fn zone(&self) -> Zone {
        self.projection.zone()
    }

    /// A position's place in the frame.
    ///
    /// # Errors
    /// [`ProjectionError::Forward`] where the position is too far away for the zone.
    pub fn to_local(&self, position: LatLon) -> Result<Xy, ProjectionError> {
        let grid = self.projection.forward(position)?;
        Ok(Xy {
            x: (grid.easting - self.origin.easting) / self.scale,
            y: (grid.northing - self.origin.northing) / self.scale,
        })
    }

    /// The position of a point of the frame.
    ///
    /// # Errors
    /// [`ProjectionError::Inverse`] where the point is no place on the Earth.
    pub fn to_position(&self, point: Xy) -> Result<LatLon, ProjectionError> {
        self.projection.inverse(Utm {
            easting: self.origin.easting + point.x * self.scale,
            northing: self.origin.northing + point.y * self.scale,
        })
    }

    /// Local metres per ground metre at a position: 1 at the origin.
    ///
    /// # Errors
    /// [`ProjectionError::Forward`] where the position is too far away for the zone.
    pub fn relative_scale(&self, position: LatLon) -> Result<f64, ProjectionError> {
        Ok(self.projection.point_scale(position)? / self.scale)
    }

    /// The largest [`LocalFrame::relative_scale`] over some positions, at least 1: a distance of
    /// `d · spread` in the frame is never less than `d` on the ground near them.
    ///
    /// # Errors
    /// [`ProjectionError::Forward`] where a position is too far away for the zone.
    pub fn scale_spread<'a>(
        &self,
        positions: impl IntoIterator<Item = &'a LatLon>,
    ) -> Result<f64, ProjectionError> {
        positions
            .into_iter()
            .try_fold(1.0, |spread: f64, &position| Ok(spread.max(self.relative_scale(position)?)))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geodesy::geodesic_distance;

    proptest! {
        #[test]
        fn local_distances_are_ground_distances_everywhere_on_earth(
            lat in -89.9f64..89.9, lon in -180.0f64..180.0, angle in 0.0f64..std::f64::consts::TAU, radius in 1.0f64..800.0,
        ) {
            let origin = LatLon::new(lat, lon).unwrap();
            let frame = LocalFrame::new(Zone::of(origin), origin).unwrap();
            let point = Xy { x: radius * angle.cos(), y: radius * angle.sin() };
            let position = frame.to_position(point).unwrap();
            let ground = geodesic_distance(origin, position).0;
            prop_assert!((ground - radius).abs() < 2e-5 * radius + 1e-6, "{} {}", ground, radius);
            let back = frame.to_local(position).unwrap();
            prop_assert!((back.x - point.x).hypot(back.y - point.y) < 1e-4);
        }
    }
}
