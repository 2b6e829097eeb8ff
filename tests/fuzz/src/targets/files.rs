//! Files that a user gives.

use std::path::Path;

use quav::config::{Overrides, document};
use quav::formats::{
    Scenario, read_fences, read_mission, read_scenario, write_fence_text, write_geojson, write_kml,
    write_kmz, write_plan, write_waypoints, write_waypoints_fence, write_waypoints_rally,
};
use quav::mission::Mission;

use super::debug;

/// Every file format, told apart by content as everywhere.
pub(super) fn scenario(data: &[u8]) {
    let _ = read_fences("file", data);
    let _ = read_mission("file", data);
    let Ok(scenario) = read_scenario("file", data) else { return };
    assert_numbered(&scenario.mission);
    // What can be written reads back.
    let again = |bytes: &[u8]| read_scenario("file", bytes).expect("quavd reads what it wrote");
    for write in [write_plan, write_geojson, write_kml] {
        if let Ok(text) = write(&scenario) {
            assert_same(&again(text.as_bytes()), &scenario);
        }
    }
    if let Ok(archive) = write_kmz(&scenario) {
        assert_same(&again(&archive), &scenario);
    }
    if let Ok(text) = write_waypoints(&scenario.mission) {
        assert_eq!(debug(&again(text.as_bytes()).mission.items), debug(&scenario.mission.items));
    }
    if let Ok(text) = write_waypoints_fence(&scenario.fences) {
        let fences = again(text.as_bytes()).fences;
        assert_eq!(fences.regions.len(), scenario.fences.regions.len());
    }
    if let Ok(text) = write_fence_text(&scenario.fences) {
        assert_eq!(again(text.as_bytes()).fences.regions.len(), 1);
    }
    again(write_waypoints_rally(&scenario.rally).as_bytes());
}

fn assert_same(one: &Scenario, other: &Scenario) {
    assert_eq!(debug(&one.mission), debug(&other.mission));
    assert_eq!(one.fences.regions.len(), other.fences.regions.len());
    assert_eq!(one.fences.return_point, other.fences.return_point);
    // Of a rally point, most formats have its place only.
    let places = |scenario: &Scenario| -> Vec<_> {
        scenario.rally.iter().map(|item| (item.x, item.y, item.z.to_bits())).collect()
    };
    assert_eq!(places(one), places(other));
}

fn assert_numbered(mission: &Mission) {
    for (index, item) in mission.items.iter().enumerate() {
        assert_eq!(usize::from(item.seq), index);
        assert!(item.params.iter().all(|param| !param.is_infinite()));
    }
}

/// `quavd.toml`.
pub(super) fn configuration(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    if let Err(problems) = document::parse(text, Path::new("/etc/quavd"), &Overrides::new()) {
        assert!(!problems.is_empty());
        let lines = text.lines().count().max(1);
        for problem in problems {
            assert!(problem.line.is_none_or(|line| (1..=lines + 1).contains(&line)), "{problem}");
        }
    }
}
