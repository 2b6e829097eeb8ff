//! Random valid fences for property tests, on the grid of 1e-7 degrees that vehicles store.

use proptest::prelude::*;

use crate::fence::items::distinct_ring;
use crate::fence::{FenceRegion, FenceRole, FenceSet, FenceShape};
use crate::geodesy::{LatLon, LatLonE7};
use crate::units::Metres;

/// Any position on the grid of 1e-7 degrees.
pub(crate) fn position() -> impl Strategy<Value = LatLon> {
    (-900_000_000..=900_000_000i32, -1_800_000_000..=1_800_000_000i32)
        .prop_map(|(lat, lon)| LatLonE7 { lat, lon }.to_degrees().unwrap())
}

fn shape() -> impl Strategy<Value = FenceShape> {
    let polygon = prop::collection::vec(position(), 3..8)
        .prop_map(|ring| FenceShape::Polygon(distinct_ring(ring)));
    let circle = (position(), 1u32..80_000).prop_map(|(centre, eighths)| {
        // A multiple of an eighth: exact as the f32 of a fence item.
        FenceShape::Circle { centre, radius: Metres(f64::from(eighths) / 8.0) }
    });
    prop_oneof![polygon, circle]
}

fn region() -> impl Strategy<Value = FenceRegion> {
    let role = prop_oneof![Just(FenceRole::Inclusion), Just(FenceRole::Exclusion)];
    (role, shape()).prop_map(|(role, shape)| FenceRegion {
        role,
        shape,
        heights: None,
        origin: String::new(),
    })
}

/// Any fence, with or without a return point.
pub(crate) fn fence_set() -> impl Strategy<Value = FenceSet> {
    let return_point =
        prop::option::of((position(), (-800..8000i16).prop_map(|z| f32::from(z) / 8.0)));
    (prop::collection::vec(region(), 0..6), return_point)
        .prop_map(|(regions, return_point)| FenceSet { regions, return_point })
}
