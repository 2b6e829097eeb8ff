//! Tests across formats: twins agree, what is written reads back, messages name the place.

use std::path::{Path, PathBuf};

use proptest::prelude::*;

use super::*;
use crate::fence::{FenceRegion, FenceRole, FenceShape};
use crate::geodesy::LatLon;
use crate::mission::{Command, Frame, Home};

/// All files of `fence_examples`, but for its README and pictures.
fn examples() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fence_examples");
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_file() && path.extension().is_some_and(|suffix| suffix != "md"))
        .collect();
    files.sort();
    files
}

fn load(path: &Path) -> Scenario {
    let name = path.file_name().unwrap().to_str().unwrap();
    read_scenario(name, &std::fs::read(path).unwrap()).unwrap_or_else(|error| panic!("{error}"))
}

fn example(name: &str) -> Scenario {
    load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("fence_examples").join(name))
}

/// Equality in which NaN is NaN: the debug form prints every bit that matters.
fn text_of(mission: &Mission) -> String {
    format!("{mission:?}")
}

/// Regions without their names, each ring counter-clockwise, polygons before circles.
fn regions(fences: &FenceSet) -> Vec<(FenceRole, FenceShape)> {
    let plain = |region: &FenceRegion| (region.role, oriented(&region.shape));
    let mut regions: Vec<_> = fences.regions.iter().map(plain).collect();
    regions.sort_by_key(|(_, shape)| matches!(shape, FenceShape::Circle { .. }));
    regions
}

fn oriented(shape: &FenceShape) -> FenceShape {
    let FenceShape::Polygon(ring) = shape else { return shape.clone() };
    let mut ring = ring.clone();
    let next = ring.iter().cycle().skip(1);
    let turn = |(a, b): (&LatLon, &LatLon)| a.lon() * b.lat() - b.lon() * a.lat();
    if ring.iter().zip(next).map(turn).sum::<f64>() < 0.0 {
        ring[1..].reverse();
    }
    FenceShape::Polygon(ring)
}

fn error_of(text: &str) -> String {
    read_scenario("file", text.as_bytes()).unwrap_err().to_string()
}

#[test]
fn every_example_is_read() {
    let files = examples();
    assert!(files.len() >= 12, "{files:?}");
    for file in files {
        let scenario = load(&file);
        let empty = scenario.mission.items.is_empty()
            && scenario.fences.regions.is_empty()
            && scenario.rally.is_empty();
        assert!(!empty, "{}", file.display());
    }
}

#[test]
fn the_geojson_twin_of_a_plan_is_the_same_scenario() {
    for number in 1..=6 {
        let plan = example(&format!("s{number}.plan"));
        let twin = example(&format!("s{number}.geojson"));
        assert_eq!(text_of(&plan.mission), text_of(&twin.mission), "S{number}");
        assert_eq!(regions(&plan.fences), regions(&twin.fences), "S{number}");
        assert!(plan.warnings.is_empty() && twin.warnings.is_empty());
    }
}
