//! Positions on the Earth (WGS 84) and their projection to a plane in ground metres.
//!
//! [`position`] holds geographic positions. Integers of 1e-7 degrees ([`LatLonE7`]) are what a
//! flight controller stores and flies; [`LatLon`] is the same place in degrees.

pub mod position;

pub use position::{LatLon, LatLonE7, PositionError};
