//! Airspaces for the tests of the baselines.

use crate::airspace::Airspace;
use crate::fence::{FenceRegion, FenceRole, FenceSet, FenceShape, InclusionRule};
use crate::formats::read_scenario;
use crate::geodesy::{LatLon, LocalFrame, Xy, Zone};
use crate::planner::leg_space::LegSpace;

/// An airspace at a latitude.
pub(super) struct Scene {
    airspace: Airspace,
    latitude: f64,
}

impl Scene {
    /// Four-cornered obstacles, in metres east and north of the origin.
    pub(super) fn new(obstacles: &[[(f64, f64); 4]]) -> Self {
        let origin = LatLon::new(0.001, 111.0).unwrap();
        let frame = LocalFrame::new(Zone::of(origin), origin).unwrap();
        let place = |&(x, y): &(f64, f64)| frame.to_position(Xy { x, y }).unwrap();
        let obstacle = |corners: &[(f64, f64); 4]| FenceRegion {
            role: FenceRole::Exclusion,
            shape: FenceShape::Polygon(corners.iter().map(place).collect()),
            heights: None,
            origin: "obstacle".into(),
        };
        let regions = obstacles.iter().map(obstacle).collect();
        let fences = FenceSet { regions, return_point: None };
        let airspace = Airspace::new(&fences, &frame, InclusionRule::All).unwrap();
        Self { airspace, latitude: origin.lat() }
    }

    pub(super) fn space(&self, margin: f64) -> LegSpace<'_> {
        LegSpace::new(&self.airspace, margin, self.latitude)
    }
}

/// One of the example scenarios, with its start and its goal.
pub(super) fn scenario(name: &str) -> (Scene, Xy, Xy) {
    let path = format!("{}/fence_examples/{name}.plan", env!("CARGO_MANIFEST_DIR"));
    let read = read_scenario(&path, &std::fs::read(&path).unwrap()).unwrap();
    let place = |index: usize| read.mission.items[index].position().unwrap();
    let (from, to) = (place(0), place(1));
    let frame = LocalFrame::new(Zone::of_leg(from, to), from).unwrap();
    let airspace = Airspace::new(&read.fences, &frame, InclusionRule::All).unwrap();
    let ends = (frame.to_local(from).unwrap(), frame.to_local(to).unwrap());
    (Scene { airspace, latitude: from.lat() }, ends.0, ends.1)
}
