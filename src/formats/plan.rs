//! QGroundControl's `.plan`: JSON with a mission, a geoFence and rally points.
//!
//! (QGroundControl developer guide, "Plan File Format".) Optional keys vary between versions, so
//! what is not needed is not required. [`read`] and [`write`] hold one direction each,
//! [`fence`] reads the geoFence and [`complex`] the items that stand for several.

mod complex;
mod fence;
mod read;
#[cfg(test)]
mod tests;
mod write;

pub(super) use read::read;
pub use write::write_plan;

/// `version` of the mission and fence objects that are read and written.
const OBJECT_VERSION: f64 = 2.0;
