//! PROJ's conversion between geographic positions and a zone's grid.

use std::fmt;

use proj::Proj;

use super::position::LatLon;
use super::zone::Zone;

/// A point of a zone's grid, in grid metres (not ground metres: see [`Projection::point_scale`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Utm {
    /// Metres east of the zone's false origin.
    pub easting: f64,
    /// Metres north of the zone's false origin.
    pub northing: f64,
}

/// What PROJ would not do.
#[derive(Debug, thiserror::Error)]
pub enum ProjectionError {
    /// The projection could not be set up.
    #[error("PROJ could not set up {zone}: {cause}")]
    Create {
        /// The zone asked for.
        zone: Zone,
        /// PROJ's own words.
        cause: String,
    },
    /// A position cannot be projected into this zone.
    #[error(
        "{position} cannot be projected into {zone}: it is too far away; choose another --zone \
         or remove the item"
    )]
    Forward {
        /// The position.
        position: LatLon,
        /// The zone.
        zone: Zone,
    },
    /// A point of the grid is no place on the Earth.
    #[error("easting {easting:.1}, northing {northing:.1} in {zone} is no position")]
    Inverse {
        /// Metres east.
        easting: f64,
        /// Metres north.
        northing: f64,
        /// The zone.
        zone: Zone,
    },
}

/// The conversion between positions and one zone's grid. Neither `Send` nor `Sync`, as PROJ's
/// contexts are not: it is made in the thread that plans.
pub struct Projection {
    zone: Zone,
    forward: Proj,
    inverse: Proj,
}

impl fmt::Debug for Projection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Projection").field("zone", &self.zone).finish_non_exhaustive()
    }
}

impl Projection {
    /// Sets up the conversion for a zone.
    ///
    /// It is given to PROJ as a pipeline, so that no `proj.db` is opened: that is faster, and a
    /// service without `HOME` would look for one in world-writable places.
    ///
    /// # Errors
    /// [`ProjectionError::Create`] if PROJ refuses.
    pub fn new(zone: Zone) -> Result<Self, ProjectionError> {
        let step = zone.proj_step();
        let open = |pipeline: String| {
            Proj::new(&pipeline)
                .map_err(|cause| ProjectionError::Create { zone, cause: cause.to_string() })
        };
        Ok(Self {
            zone,
            forward: open(format!(
                "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step {step}"
            ))?,
            inverse: open(format!(
                "+proj=pipeline +step +inv {step} +step +proj=unitconvert +xy_in=rad +xy_out=deg"
            ))?,
        })
    }

    /// The zone projected into.
    #[must_use]
    pub fn zone(&self) -> Zone {
        self.zone
    }

    /// A position's place on the grid.
    ///
    /// # Errors
    /// [`ProjectionError::Forward`] where the projection has no finite answer.
    pub fn forward(&self, position: LatLon) -> Result<Utm, ProjectionError> {
        match self.forward.convert((position.lon(), position.lat())) {
            Ok((easting, northing)) if easting.is_finite() && northing.is_finite() => {
                Ok(Utm { easting, northing })
            }
            _ => Err(ProjectionError::Forward { position, zone: self.zone }),
        }
    }

    /// The position of a point of the grid.
    ///
    /// # Errors
    /// [`ProjectionError::Inverse`] where the point is off the projection.
    pub fn inverse(&self, point: Utm) -> Result<LatLon, ProjectionError> {
        let off = || ProjectionError::Inverse {
            easting: point.easting,
            northing: point.northing,
            zone: self.zone,
        };
        let (lon, lat) =
            self.inverse.convert((point.easting, point.northing)).map_err(|_| off())?;
        // PROJ may answer a longitude a hair beyond ±180 next to the antimeridian.
        let lon = if lon > 180.0 {
            lon - 360.0
        } else if lon < -180.0 {
            lon + 360.0
        } else {
            lon
        };
        LatLon::new(lat, lon).map_err(|_| off())
    }

    /// Grid metres per ground metre at a position: 0.9996 on a UTM zone's central meridian,
    /// 0.994 at a pole. Both projections are conformal, so it is the same in all directions.
    ///
    /// Measured along the meridian over 2e-5°, against its radius of curvature
    /// `M = a(1−e²)/(1−e² sin²φ)^{3/2}`; good to about 1e-8.
    ///
    /// # Errors
    /// [`ProjectionError::Forward`] where the position cannot be projected.
    pub fn point_scale(&self, position: LatLon) -> Result<f64, ProjectionError> {
        const HALF_STEP: f64 = 1e-5;
        const A: f64 = 6_378_137.0;
        const E2: f64 = 0.006_694_379_990_141_316;
        let lat = position.lat().clamp(-90.0 + HALF_STEP, 90.0 - HALF_STEP);
        let at = |lat: f64| {
            let here = LatLon::new(lat, position.lon())
                .map_err(|_| ProjectionError::Forward { position, zone: self.zone })?;
            self.forward(here)
        };
        let (low, high) = (at(lat - HALF_STEP)?, at(lat + HALF_STEP)?);
        let grid = (high.easting - low.easting).hypot(high.northing - low.northing);
        let sin = lat.to_radians().sin();
        let meridian_radius = A * (1.0 - E2) / (1.0 - E2 * sin * sin).powf(1.5);
        Ok(grid / (meridian_radius * (2.0 * HALF_STEP).to_radians()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geodesy::geodesic_distance;

    #[derive(serde::Deserialize)]
    struct Reference {
        points: Vec<ReferencePoint>,
    }

    #[derive(serde::Deserialize)]
    struct ReferencePoint {
        lat: f64,
        lon: f64,
        epsg: u32,
        easting: f64,
        northing: f64,
    }

    #[test]
    fn grid_coordinates_agree_with_pyproj_and_come_back_within_a_tenth_of_a_millimetre() {
        let reference: Reference =
            serde_json::from_str(include_str!("../../tests/data/utm.json")).unwrap();
        assert!(reference.points.len() > 10);
        for point in reference.points {
            let zone: Zone = point.epsg.to_string().parse().unwrap();
            let projection = Projection::new(zone).unwrap();
            let position = LatLon::new(point.lat, point.lon).unwrap();
            let grid = projection.forward(position).unwrap();
            assert!((grid.easting - point.easting).abs() < 1e-4, "{position} {grid:?}");
            assert!((grid.northing - point.northing).abs() < 1e-4, "{position} {grid:?}");
            let back = projection.inverse(grid).unwrap();
            assert!(geodesic_distance(position, back).0 < 1e-4, "{position} {back}");
        }
    }

    #[test]
    fn the_scale_is_that_of_the_textbook_on_the_central_meridian_and_at_the_pole() {
        let utm = Projection::new(Zone::Utm { number: 49, south: false }).unwrap();
        let scale = utm.point_scale(LatLon::new(22.0, 111.0).unwrap()).unwrap();
        assert!((scale - 0.9996).abs() < 1e-7, "{scale}");
        let ups = Projection::new(Zone::Ups { south: true }).unwrap();
        let scale = ups.point_scale(LatLon::new(-90.0, 0.0).unwrap()).unwrap();
        assert!((scale - 0.994).abs() < 1e-7, "{scale}");
    }
}
