//! The zone a leg is planned in: one of the 120 UTM zones, or UPS beyond 84° N and 80° S.

use std::fmt;
use std::str::FromStr;

use super::position::LatLon;
use super::wrapped;

/// A zone of the Universal Transverse Mercator or Universal Polar Stereographic system, WGS 84.
///
/// A leg that crosses a zone's boundary stays in one zone: the projection is exact there too,
/// only its scale is further from 1, and [`super::LocalFrame`] takes the scale out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Zone {
    /// UTM zone 1 to 60; `south` uses the false northing of 10,000 km.
    Utm {
        /// 1 to 60.
        number: u8,
        /// Whether it is the southern half.
        south: bool,
    },
    /// UPS north (EPSG:5041) or south (EPSG:5042).
    Ups {
        /// Whether it is the south pole's.
        south: bool,
    },
}

/// Why a text is not a zone.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "'{text}' is no zone that can be planned in: give auto, or EPSG:32601-32660 (UTM north), \
     EPSG:32701-32760 (UTM south), EPSG:5041 or EPSG:5042 (UPS)"
)]
pub struct ZoneError {
    text: String,
}

impl Zone {
    /// The zone that a position belongs to, with the exceptions for Norway (32V) and Svalbard
    /// (31X to 37X); UPS above 84° N and below 80° S.
    #[must_use]
    pub fn of(position: LatLon) -> Self {
        let (lat, lon) = (position.lat(), position.lon());
        let south = lat < 0.0;
        if !(-80.0..=84.0).contains(&lat) {
            return Self::Ups { south };
        }
        // 180° E is the western edge of zone 1.
        let regular = (((lon + 180.0).rem_euclid(360.0) / 6.0).floor() as u8).min(59) + 1;
        let number = match lon {
            _ if (56.0..64.0).contains(&lat) && (3.0..12.0).contains(&lon) => 32,
            _ if lat < 72.0 => regular,
            _ if (0.0..9.0).contains(&lon) => 31,
            _ if (9.0..21.0).contains(&lon) => 33,
            _ if (21.0..33.0).contains(&lon) => 35,
            _ if (33.0..42.0).contains(&lon) => 37,
            _ => regular,
        };
        Self::Utm { number, south }
    }

    /// The zone of a leg: that of the point half-way, the short way round the Earth.
    #[must_use]
    pub fn of_leg(from: LatLon, to: LatLon) -> Self {
        let mut lon_difference = to.lon() - from.lon();
        if lon_difference > 180.0 {
            lon_difference -= 360.0;
        } else if lon_difference < -180.0 {
            lon_difference += 360.0;
        }
        let lon = wrapped(from.lon() + lon_difference / 2.0);
        LatLon::new(f64::midpoint(from.lat(), to.lat()), lon).map_or(Self::of(from), Self::of)
    }

    /// The zone's EPSG code.
    #[must_use]
    pub fn epsg(self) -> u32 {
        match self {
            Self::Utm { number, south: false } => 32600 + u32::from(number),
            Self::Utm { number, south: true } => 32700 + u32::from(number),
            Self::Ups { south: false } => 5041,
            Self::Ups { south: true } => 5042,
        }
    }

    /// The projection as a PROJ step, metres out of radians. No database is needed for it.
    pub(super) fn proj_step(self) -> String {
        match self {
            Self::Utm { number, south } => {
                format!(
                    "+proj=utm +zone={number}{} +ellps=WGS84",
                    if south { " +south" } else { "" }
                )
            }
            Self::Ups { south } => format!(
                "+proj=stere +lat_0={} +lon_0=0 +k=0.994 +x_0=2000000 +y_0=2000000 +ellps=WGS84",
                if south { -90 } else { 90 }
            ),
        }
    }
}

impl fmt::Display for Zone {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "EPSG:{}", self.epsg())
    }
}

impl FromStr for Zone {
    type Err = ZoneError;

    fn from_str(text: &str) -> Result<Self, ZoneError> {
        let refuse = || ZoneError { text: text.to_owned() };
        let upper = text.trim().to_ascii_uppercase();
        let code: u32 =
            upper.strip_prefix("EPSG:").unwrap_or(&upper).parse().map_err(|_| refuse())?;
        match code {
            32601..=32660 => Ok(Self::Utm { number: (code - 32600) as u8, south: false }),
            32701..=32760 => Ok(Self::Utm { number: (code - 32700) as u8, south: true }),
            5041 => Ok(Self::Ups { south: false }),
            5042 => Ok(Self::Ups { south: true }),
            _ => Err(refuse()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(lat: f64, lon: f64) -> LatLon {
        LatLon::new(lat, lon).unwrap()
    }

    #[test]
    fn zones_follow_the_grid_and_its_exceptions() {
        for (lat, lon, epsg) in [
            (22.2, 113.5, 32649),
            (-33.9, 151.2, 32756),
            (60.4, 5.3, 32632),  // 32V, Norway
            (78.2, 15.6, 32633), // 33X, Svalbard
            (0.0, 180.0, 32601),
            (0.0, -180.0, 32601),
            (10.0, 179.999, 32660),
            (84.1, 0.0, 5041),
            (-80.1, 0.0, 5042),
            (90.0, 0.0, 5041),
        ] {
            assert_eq!(Zone::of(at(lat, lon)).epsg(), epsg, "{lat}, {lon}");
        }
    }

    #[test]
    fn a_leg_over_the_antimeridian_takes_the_short_way_round() {
        assert_eq!(Zone::of_leg(at(-17.0, 179.98), at(-17.0, -179.99)).epsg(), 32760);
        assert_eq!(Zone::of_leg(at(-17.0, -179.98), at(-17.0, 179.99)).epsg(), 32701);
    }

    #[test]
    fn a_zone_reads_back_from_its_epsg_code() {
        for zone in [
            Zone::Utm { number: 1, south: false },
            Zone::Utm { number: 60, south: true },
            Zone::Ups { south: false },
            Zone::Ups { south: true },
        ] {
            assert_eq!(zone.to_string().parse(), Ok(zone));
        }
        assert!("EPSG:4326".parse::<Zone>().is_err());
        assert!("32661".parse::<Zone>().is_err());
    }
}
