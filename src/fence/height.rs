//! How high a region reaches.
//!
//! A height is only as good as what it is measured from. Obstacles on a map are measured from the
//! ground that they stand on, charted airspace from mean sea level, and neither is what a mission
//! is flown above. Whether they can be compared at all is decided where legs are judged
//! ([`crate::replan`]); a region whose heights cannot be compared counts at all altitudes.

use crate::units::Metres;

/// What the heights of a region are measured from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HeightReference {
    /// The ground at the region.
    Ground,
    /// Mean sea level.
    MeanSeaLevel,
}

/// How high a region reaches, and how low.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeightRange {
    /// What both ends are measured from.
    pub reference: HeightReference,
    /// Its lower end; `None`: it reaches down to the ground.
    pub bottom: Option<Metres>,
    /// Its upper end; `None`: it has no end.
    pub top: Option<Metres>,
}

impl HeightRange {
    /// From the ground up to a height.
    #[must_use]
    pub fn up_to(reference: HeightReference, top: Metres) -> Self {
        Self { reference, bottom: None, top: Some(top) }
    }
}
