//! quavd's library: from a vehicle's mission and fences to a verified, re-planned mission.

pub mod fence;
pub mod geodesy;
pub mod link;
pub mod mission;
pub mod store;
pub mod units;
pub mod vehicle;
