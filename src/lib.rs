//! quavd's library: from a vehicle's mission and fences to a verified, re-planned mission.

pub mod airspace;
pub mod fence;
pub mod formats;
pub mod geodesy;
pub mod mission;
pub mod planner;
pub mod qaoa;
pub mod replan;
pub mod units;
