//! Geographic positions, checked when they are made: what exists is finite and in range.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A position in degrees, WGS 84: latitude within ±90, longitude within ±180, both finite.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(into = "[f64; 2]", try_from = "[f64; 2]")]
pub struct LatLon {
    lat: f64,
    lon: f64,
}

/// Why two numbers are not a position.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PositionError {
    /// A coordinate is NaN or infinite.
    #[error("latitude {lat}, longitude {lon} is not a finite position")]
    NotFinite {
        /// The latitude as given, degrees.
        lat: f64,
        /// The longitude as given, degrees.
        lon: f64,
    },
    /// A coordinate is outside ±90 or ±180 degrees.
    #[error("latitude {lat}, longitude {lon} is outside ±90 and ±180 degrees")]
    OutOfRange {
        /// The latitude as given, degrees.
        lat: f64,
        /// The longitude as given, degrees.
        lon: f64,
    },
}

impl LatLon {
    /// A position from degrees.
    ///
    /// # Errors
    /// [`PositionError`] where a number is not finite or out of range.
    pub fn new(lat: f64, lon: f64) -> Result<Self, PositionError> {
        if !lat.is_finite() || !lon.is_finite() {
            return Err(PositionError::NotFinite { lat, lon });
        }
        if lat.abs() > 90.0 || lon.abs() > 180.0 {
            return Err(PositionError::OutOfRange { lat, lon });
        }
        Ok(Self { lat, lon })
    }

    /// Latitude in degrees, north positive.
    #[must_use]
    pub fn lat(self) -> f64 {
        self.lat
    }

    /// Longitude in degrees, east positive.
    #[must_use]
    pub fn lon(self) -> f64 {
        self.lon
    }

    /// The nearest position that a MAVLink integer pair can hold (1e-7 degrees, 11 mm at most).
    #[must_use]
    pub fn to_e7(self) -> LatLonE7 {
        // In range by construction: 180e7 fits an i32.
        LatLonE7 { lat: (self.lat * 1e7).round() as i32, lon: (self.lon * 1e7).round() as i32 }
    }
}

impl fmt::Display for LatLon {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.7}, {:.7}", self.lat, self.lon)
    }
}

impl From<LatLon> for [f64; 2] {
    fn from(position: LatLon) -> Self {
        [position.lat, position.lon]
    }
}

impl TryFrom<[f64; 2]> for LatLon {
    type Error = PositionError;
    fn try_from([lat, lon]: [f64; 2]) -> Result<Self, PositionError> {
        Self::new(lat, lon)
    }
}

/// A position as MAVLink's `MISSION_ITEM_INT` carries it: degrees times 1e7.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct LatLonE7 {
    /// Latitude, 1e-7 degrees.
    pub lat: i32,
    /// Longitude, 1e-7 degrees.
    pub lon: i32,
}

impl LatLonE7 {
    /// The same position in degrees.
    ///
    /// # Errors
    /// [`PositionError::OutOfRange`] where the integers are no position.
    pub fn to_degrees(self) -> Result<LatLon, PositionError> {
        LatLon::new(f64::from(self.lat) / 1e7, f64::from(self.lon) / 1e7)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_position_outside_the_globe_is_refused() {
        assert!(matches!(LatLon::new(90.1, 0.0), Err(PositionError::OutOfRange { .. })));
        assert!(matches!(LatLon::new(0.0, -180.1), Err(PositionError::OutOfRange { .. })));
        assert!(matches!(LatLon::new(f64::NAN, 0.0), Err(PositionError::NotFinite { .. })));
    }

    #[test]
    fn integers_round_to_the_nearest_tenth_of_a_microdegree() {
        let position = LatLon::new(22.196_514_56, -113.541_103_14).unwrap();
        assert_eq!(position.to_e7(), LatLonE7 { lat: 221_965_146, lon: -1_135_411_031 });
    }
}
