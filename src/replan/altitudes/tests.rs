use proptest::prelude::*;

use super::*;
use crate::fence::{FenceRegion, FenceRole, FenceSet, FenceShape, VehicleRules};
use crate::geodesy::{LatLon, LatLonE7};
use crate::mission::{Autopilot, Frame, Home};
use crate::replan::{Input, Verdict, judge, replan};
use crate::stop::Stop;

const NORTH: f64 = 111_132.0 * 1e-7;

/// A place so many metres north and east of home.
fn place(north: f64, east: f64) -> LatLonE7 {
    let east_scale = NORTH * 47_f64.to_radians().cos();
    let (lat, lon) = ((north / NORTH).round(), (east / east_scale).round());
    LatLonE7 { lat: 470_000_000 + lat as i32, lon: 80_000_000 + lon as i32 }
}

fn item(command: u16, frame: u8, (north, east, z): (f64, f64, f32)) -> MissionItem {
    let LatLonE7 { lat: x, lon: y } = place(north, east);
    MissionItem {
        seq: 0,
        frame: Frame(frame),
        command: Command(command),
        current: 0,
        autocontinue: 1,
        params: [0.0; 4],
        x,
        y,
        z,
    }
}

fn mission(items: impl IntoIterator<Item = MissionItem>) -> Mission {
    let items = items.into_iter().zip(0..).map(|(item, seq)| MissionItem { seq, ..item });
    let position = place(0.0, 0.0).to_degrees().unwrap();
    Mission { home: Some(Home { position, altitude_amsl: 400.0 }), items: items.collect() }
}

/// Two waypoints 400 m apart, over the middle of which a block stands.
fn over(frame: u8, from: f32, to: f32) -> Mission {
    mission([item(16, frame, (0.0, 0.0, from)), item(16, frame, (0.0, 400.0, to))])
}

/// A square obstacle of 40 m.
fn block((north, east): (f64, f64), heights: Option<HeightRange>) -> FenceRegion {
    let corners = [(-20.0, -20.0), (-20.0, 20.0), (20.0, 20.0), (20.0, -20.0)];
    let ring = corners.map(|(n, e)| place(north + n, east + e).to_degrees().unwrap()).to_vec();
    let shape = FenceShape::Polygon(ring);
    FenceRegion { role: FenceRole::Exclusion, shape, heights, origin: "the block".to_owned() }
}

fn fences(regions: Vec<FenceRegion>) -> FenceSet {
    FenceSet { regions, return_point: None }
}

fn tall(reference: HeightReference, top: f64) -> Option<HeightRange> {
    Some(HeightRange::up_to(reference, Metres(top)))
}

const GROUND: HeightReference = HeightReference::Ground;
const SEA: HeightReference = HeightReference::MeanSeaLevel;

fn hovering() -> Options {
    let loiter = LoiterHabit::Hover { circle_radius: Metres(10.0) };
    Options { loiter, ..Options::default() }
}

/// The same where the ground is said to be even to 5 m.
fn even() -> Options {
    let vertical = Vertical { ground_relief: Some(Metres(5.0)), ..Vertical::default() };
    Options { vertical, ..hovering() }
}

fn input<'a>(mission: &'a Mission, fences: &'a FenceSet) -> Input<'a> {
    Input { mission, fences, rally: &[], start: None, autopilot: Autopilot::ArduPilot }
}

fn verdict(mission: &Mission, heights: Option<HeightRange>, options: &Options) -> Verdict {
    let fences = fences(vec![block((0.0, 200.0), heights)]);
    judge(&input(mission, &fences), options).unwrap()
}

fn passes(mission: &Mission, heights: Option<HeightRange>, options: &Options) -> bool {
    let verdict = verdict(mission, heights, options);
    assert_eq!(verdict.is_clear(), verdict.legs.iter().all(|leg| leg.blocker.is_none()));
    let named = verdict.legs.iter().flat_map(|leg| &leg.passed).any(|name| name == "the block");
    assert_eq!(verdict.is_clear(), named, "what is flown over is named");
    verdict.is_clear()
}

#[test]
fn a_leg_is_clear_of_what_it_is_flown_over_by_the_margin() {
    assert!(passes(&over(10, 50.0, 50.0), tall(GROUND, 40.0), &hovering()), "same ground");
    assert!(!passes(&over(10, 49.9, 60.0), tall(GROUND, 40.0), &hovering()), "one end too low");
    assert!(!passes(&over(10, 50.0, 50.0), None, &hovering()), "no heights");
    assert!(passes(&over(0, 500.0, 600.0), tall(SEA, 490.0), &hovering()), "above sea level");
    assert!(!passes(&over(0, 499.0, 600.0), tall(SEA, 490.0), &hovering()));
    assert!(passes(&over(3, 100.0, 100.0), tall(SEA, 490.0), &hovering()), "by home's altitude");
    assert!(!passes(&over(3, 99.0, 100.0), tall(SEA, 490.0), &hovering()));
}

#[test]
fn heights_above_ground_need_somebody_to_vouch_for_the_ground() {
    let flown = over(3, 60.0, 60.0);
    let unsaid = verdict(&flown, tall(GROUND, 40.0), &hovering());
    assert!(!unsaid.is_clear());
    assert!(unsaid.warnings.iter().any(|w| w.contains("--ground-relief")), "{:?}", unsaid.warnings);
    assert!(passes(&flown, tall(GROUND, 40.0), &even()));
    assert!(passes(&over(3, 55.0, 55.0), tall(GROUND, 40.0), &even()), "40 + 10 + 5");
    assert!(!passes(&over(3, 54.9, 55.0), tall(GROUND, 40.0), &even()));
    assert!(passes(&over(0, 455.0, 455.0), tall(GROUND, 40.0), &even()), "by home's altitude");
    assert!(!passes(&over(0, 454.0, 455.0), tall(GROUND, 40.0), &even()));
}

#[test]
fn a_leg_may_be_flown_under_what_does_not_reach_down() {
    let bridge = |bottom, top| {
        let (bottom, top) = (Some(Metres(bottom)), Some(Metres(top)));
        Some(HeightRange { reference: GROUND, bottom, top })
    };
    assert!(passes(&over(10, 20.0, 30.0), bridge(40.0, 60.0), &hovering()));
    assert!(!passes(&over(10, 20.0, 31.0), bridge(40.0, 60.0), &hovering()));
    assert!(!passes(&over(10, 20.0, 80.0), bridge(40.0, 60.0), &hovering()), "through it");
    assert!(passes(&over(3, 20.0, 25.0), bridge(40.0, 60.0), &even()));
    assert!(!passes(&over(3, 20.0, 26.0), bridge(40.0, 60.0), &even()));
}

#[test]
fn what_cannot_be_compared_bars_the_way_and_says_why() {
    let says = |mission: &Mission, heights, options: &Options, what: &str| {
        let verdict = verdict(mission, heights, options);
        assert!(!verdict.is_clear(), "{what}");
        assert!(verdict.warnings.iter().any(|w| w.contains(what)), "{:?}", verdict.warnings);
    };
    let high = over(3, 300.0, 300.0);
    says(&over(10, 900.0, 900.0), tall(SEA, 490.0), &even(), "above terrain");
    let mut nowhere = high.clone();
    nowhere.home.as_mut().unwrap().altitude_amsl = 0.0;
    says(&nowhere, tall(SEA, 490.0), &even(), "altitude of home");
    for command in [113, 186, 179, 4242] {
        let mut unsure = high.clone();
        unsure.items.push(MissionItem { seq: 2, ..item(command, 3, (0.0, 500.0, 9.0)) });
        says(&unsure, tall(GROUND, 40.0), &even(), "item 3 makes the altitudes");
    }
    says(&over(3, 300.0, 0.0), tall(GROUND, 40.0), &even(), "not known");
    let landing = mission([item(16, 3, (0., 0., 300.)), item(21, 3, (0., 400., 0.))]);
    says(&landing, tall(GROUND, 40.0), &even(), "not known");
    let back = mission([item(16, 3, (0., 400., 300.)), item(20, 2, (0.0, 0.0, 0.0))]);
    says(&back, tall(GROUND, 40.0), &even(), "not known");
}

#[test]
fn a_vehicle_that_may_not_hover_may_be_as_low_as_the_lowest_place() {
    let items = [(0.0, -100.0, 30.0), (0.0, 0.0, 90.0), (0.0, 400.0, 90.0)];
    let climbing = mission(items.map(|at| item(16, 3, at)));
    assert!(passes(&climbing, tall(GROUND, 40.0), &even()));
    let plane = Options { loiter: LoiterHabit::Circle { radius: Metres(60.0) }, ..even() };
    assert!(!passes(&climbing, tall(GROUND, 40.0), &plane));
    assert!(passes(&climbing, tall(GROUND, 14.0), &plane), "15 m below the lowest place");
    let unknown = Options { loiter: LoiterHabit::Unknown, ..even() };
    assert!(!passes(&climbing, tall(GROUND, 40.0), &unknown));
}

#[test]
fn only_the_legs_that_are_too_low_are_given_waypoints() {
    let high = [(0.0, 0.0, 80.0), (0.0, 400.0, 80.0), (0.0, 400.0, 30.0), (0.0, 0.0, 30.0)];
    let flown = mission(high.map(|at| item(16, 3, at)));
    let regions = fences(vec![block((0.0, 200.0), tall(GROUND, 40.0))]);
    let done = replan(&input(&flown, &regions), &even(), &Stop::new(), |_| {}).unwrap();
    assert_eq!(done.legs.len(), 1);
    assert_eq!(done.legs[0].leg.from.item, Some(2));
    assert!(done.inserted.iter().all(|index| *index > 2));
    assert_eq!(done.before.legs[0].passed, ["the block"]);
}

fn limited(changed: &[(&str, f64)]) -> Options {
    let table = [
        ("FENCE_ENABLE", 1.0),
        ("FENCE_TYPE", 15.0),
        ("FENCE_OPTIONS", 0.0),
        ("FENCE_MARGIN", 2.0),
    ];
    let value = |name: &str| {
        changed.iter().chain(&table).find(|(known, _)| *known == name).map(|(_, value)| *value)
    };
    let rules = VehicleRules::read(Autopilot::ArduPilot, value);
    let loiter = hovering().loiter;
    hovering().with_rules(rules, None, loiter)
}

#[test]
fn a_leg_above_or_below_the_altitude_limits_is_found_and_refused() {
    let none = fences(Vec::new());
    let finding = |mission: &Mission, options: &Options| {
        let verdict = judge(&input(mission, &none), options).unwrap();
        let findings: Vec<_> = verdict.legs.iter().filter_map(|leg| leg.limit).collect();
        assert_eq!(verdict.is_clear(), findings.is_empty());
        let planned = replan(&input(mission, &none), options, &Stop::new(), |_| {});
        match (findings.first(), planned) {
            (None, Ok(_)) => String::new(),
            (Some(finding), Err(ReplanError::Altitude { .. })) => finding.to_string(),
            (finding, planned) => panic!("{finding:?}, {planned:?}"),
        }
    };
    let limits = limited(&[("FENCE_ALT_MAX", 100.0), ("FENCE_ALT_MIN", 10.0)]);
    assert_eq!(finding(&over(3, 50.0, 99.9), &limits), "");
    let above = finding(&over(3, 50.0, 100.0), &limits);
    assert!(above.starts_with("is flown at 100.0 m above home"), "{above}");
    assert!(above.contains("FENCE_ALT_MAX (100 m)"), "{above}");
    assert!(finding(&over(0, 450.0, 501.0), &limits).contains("101.0 m above home"));
    assert!(finding(&over(3, 10.0, 50.0), &limits).contains("FENCE_ALT_MIN (10 m)"));
    assert!(finding(&over(10, 50.0, 50.0), &limits).contains("--ground-relief"));
    let vertical = even().vertical;
    let vouched = Options { vertical, ..limits.clone() };
    assert_eq!(finding(&over(10, 50.0, 94.0), &vouched), "");
    assert!(finding(&over(10, 50.0, 95.0), &vouched).contains("100.0 m above home"));
    let near = judge(&input(&over(3, 50.0, 98.5), &none), &limits).unwrap();
    assert!(near.warnings.iter().any(|w| w.contains("within FENCE_MARGIN")), "{:?}", near.warnings);
}

#[test]
fn the_circle_around_home_is_kept_whatever_the_rule_for_inclusions() {
    let flown = over(3, 50.0, 50.0);
    let around =
        |north, east| FenceRegion { role: FenceRole::Inclusion, ..block((north, east), None) };
    let wide = FenceShape::Circle {
        centre: place(0.0, 200.0).to_degrees().unwrap(),
        radius: Metres(900.0),
    };
    let areas = fences(vec![FenceRegion { shape: wide, ..around(0.0, 0.0) }, around(0.0, 900.0)]);
    let judged = |radius, union| {
        let options = limited(&[("FENCE_RADIUS", radius), ("FENCE_OPTIONS", union)]);
        judge(&input(&flown, &areas), &options).unwrap().legs[0].blocker.clone()
    };
    assert_eq!(judged(410.0, 2.0), None);
    let name = "the circle of FENCE_RADIUS (404 m) around home".to_owned();
    assert_eq!(judged(404.0, 2.0), Some((name, false)));
    assert!(judged(300.0, 2.0).unwrap().1);
    assert_eq!(judged(410.0, 0.0).unwrap().0, "the block", "inside both areas");
}

#[test]
fn limits_around_a_home_that_moves_or_is_not_known_are_a_refusal() {
    let none = fences(Vec::new());
    let options = limited(&[("FENCE_RADIUS", 900.0)]);
    let refused = |mission: &Mission| match judge(&input(mission, &none), &options) {
        Err(error @ ReplanError::Limit { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    };
    let mut moved = over(3, 50.0, 50.0);
    moved.items.push(MissionItem { seq: 2, ..item(179, 3, (0.0, 500.0, 9.0)) });
    assert!(refused(&moved).contains("item 3 moves home"));
    assert!(refused(&Mission { home: None, ..over(3, 50.0, 50.0) }).contains("home is not known"));
}

#[test]
fn the_larger_of_buffer_and_fence_margin_is_kept() {
    assert_eq!(limited(&[]).settings.buffer, Metres(5.0));
    let wide = limited(&[("FENCE_MARGIN", 8.0)]);
    assert_eq!(wide.settings.buffer, Metres(8.0));
    assert!(wide.rules.applied.last().unwrap().contains("FENCE_MARGIN of 8 m"));
}

/// Metres between a point and a block's square, measured without the code under test.
fn gap(block: (f64, f64), north: f64, east: f64) -> f64 {
    let outside = |d: f64| (d.abs() - 20.0).max(0.0);
    outside(north - block.0).hypot(outside(east - block.1))
}

fn local(position: LatLon) -> (f64, f64) {
    let e7 = position.to_e7();
    let east_scale = NORTH * 47_f64.to_radians().cos();
    (f64::from(e7.lat - 470_000_000) * NORTH, f64::from(e7.lon - 80_000_000) * east_scale)
}

type Block = ((f64, f64), f64, f64);

/// The first point of a flight through these items, judged clear, that is too near to a block.
fn too_near(items: &[MissionItem], blocks: &[Block], relief: f64) -> Option<String> {
    for pair in items.windows(2) {
        let ((n0, e0), (n1, e1)) =
            (local(pair[0].position().unwrap()), local(pair[1].position().unwrap()));
        for step in 0..=200 {
            let t = f64::from(step) / 200.0;
            let (north, east) = (n0 + (n1 - n0) * t, e0 + (e1 - e0) * t);
            let z = f64::from(pair[0].z) + f64::from(pair[1].z - pair[0].z) * t;
            for &(at, bottom, top) in blocks {
                // The worst ground there can be under the block.
                let clear = z - relief >= top + 9.99 || z + relief <= bottom - 9.99;
                if !clear && gap(at, north, east) < 4.9 {
                    return Some(format!(
                        "{north:.1} {east:.1} at {z:.1} by {at:?} {bottom} to {top}"
                    ));
                }
            }
        }
    }
    None
}

fn scene() -> impl Strategy<Value = (Vec<Block>, Vec<(f64, f64, f32)>)> {
    let block = ((-60.0..60.0_f64, 80.0..320.0_f64), 0.0..60.0_f64, 1.0..60.0_f64)
        .prop_map(|(at, bottom, height)| (at, bottom, bottom + height));
    let start = (-90.0..90.0_f64, -50.0..20.0_f64, 5.0..120.0_f32);
    let end = (-90.0..90.0_f64, 380.0..450.0_f64, 5.0..120.0_f32);
    let flight = prop_oneof![
        (start.clone(), end.clone()).prop_map(|(a, b)| vec![a, b]),
        (start.clone(), end, start).prop_map(|(a, b, c)| vec![a, b, c]),
    ];
    (prop::collection::vec(block, 1..4), flight)
}

fn with_blocks(blocks: &[Block]) -> FenceSet {
    let region = |&(at, bottom, top): &Block| {
        let (bottom, top) = (Some(Metres(bottom)), Some(Metres(top)));
        block(at, Some(HeightRange { reference: GROUND, bottom, top }))
    };
    fences(blocks.iter().map(region).collect())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn no_leg_that_is_judged_clear_comes_near_to_an_obstacle(
        (blocks, flight) in scene(), relief in 0.0..20.0_f64,
    ) {
        let flown = mission(flight.iter().map(|&at| item(16, 3, at)));
        let regions = with_blocks(&blocks);
        let vertical = Vertical { ground_relief: Some(Metres(relief)), ..Vertical::default() };
        let options = Options { vertical, ..hovering() };
        let verdict = judge(&input(&flown, &regions), &options).unwrap();
        if verdict.is_clear() {
            prop_assert_eq!(too_near(&flown.items, &blocks, relief), None);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn no_planned_mission_comes_near_to_an_obstacle((blocks, flight) in scene()) {
        let flown = mission(flight.iter().map(|&at| item(16, 3, at)));
        let regions = with_blocks(&blocks);
        match replan(&input(&flown, &regions), &even(), &Stop::new(), |_| {}) {
            Ok(planned) => prop_assert_eq!(too_near(&planned.mission.items, &blocks, 5.0), None),
            Err(error) => prop_assert!(error.is_no_path(), "{}", error),
        }
    }
}

#[test]
fn the_way_back_by_a_jump_is_led_round_an_obstacle() {
    let places = [(0.0, 0.0, 30.0), (250.0, 200.0, 30.0), (0.0, 400.0, 30.0)];
    let mut items: Vec<MissionItem> = places.map(|at| item(16, 3, at)).to_vec();
    items.push(MissionItem { params: [0.0, 3.0, 0.0, 0.0], ..item(177, 2, (0.0, 0.0, 0.0)) });
    items.push(item(16, 3, (0.0, 700.0, 30.0)));
    let patrol = mission(items);
    let regions = fences(vec![block((0.0, 200.0), None)]);
    let stop = Stop::new();
    let planned = replan(&input(&patrol, &regions), &hovering(), &stop, |_| {}).unwrap();
    assert_eq!(planned.legs.len(), 1);
    assert!(planned.after.is_clear());
    let new = &planned.mission.items;
    let first = planned.inserted[0];
    assert_eq!(new[first - 1].params[..2], [(first + planned.inserted.len()) as f32, -1.0]);
    let back: Vec<MissionItem> = [new.len() - 3]
        .into_iter()
        .chain(planned.inserted.clone())
        .chain([first + planned.inserted.len()])
        .map(|index| new[index])
        .collect();
    assert_eq!(too_near(&back, &[((0.0, 200.0), 0.0, 1e4)], 0.0), None);
    assert_eq!(planned.after.length(), planned.before.length(), "the way itself is as it was");
    // Again there is nothing to do.
    let again = replan(&input(&planned.mission, &regions), &hovering(), &stop, |_| {}).unwrap();
    assert!(!again.is_changed());
    // An autopilot that is not known may not know that jump either.
    let unknown = Input { autopilot: Autopilot::Unknown, ..input(&patrol, &regions) };
    let refused = replan(&unknown, &hovering(), &stop, |_| {}).unwrap_err();
    assert!(refused.to_string().contains("by the jump at item 4"), "{refused}");
}
