//! QGroundControl's `.plan`: JSON with a mission, a geoFence and rally points.
//!
//! (QGroundControl developer guide, "Plan File Format".) Optional keys vary between versions, so
//! what is not needed is not required. [`read`] and [`write`] hold one direction each,
//! [`fence`] reads the geoFence, [`complex`] and [`structure_scan`] the items that stand for several
//! without listing them, and [`kept`] holds what is to be written back.

mod complex;
mod fence;
mod kept;
mod read;
mod structure_scan;
#[cfg(test)]
mod tests;
mod write;

pub(super) use kept::KeptPlan;
pub(super) use read::read;
pub use write::{plan_flattened, write_plan};

/// `version` of the mission and fence objects that are read and written.
const OBJECT_VERSION: f64 = 2.0;
