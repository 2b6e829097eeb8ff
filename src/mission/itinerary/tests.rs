//! Which legs a mission has.

use proptest::prelude::*;

use super::*;
use crate::mission::Frame;
use crate::mission::legs::LegWarning;
use crate::mission::places::place;
use crate::mission::testing::{
    any_mission, at, execute, item, item_at, jump, mission, position, takeoff, waypoint,
};
use crate::mission::{Home, legs};

/// From item, to item, kind, jump.
type Short = (Option<usize>, Option<usize>, LegKind, Option<usize>);

fn short(leg: &Leg) -> Short {
    (leg.from.item, leg.to.item, leg.kind, leg.jump)
}

fn flown(from: usize, to: usize) -> Short {
    (Some(from), Some(to), LegKind::Flown, None)
}

fn jumped(from: usize, to: usize, jump: usize) -> Short {
    (Some(from), Some(to), LegKind::Flown, Some(jump))
}

fn home(from: usize, to: usize) -> Short {
    (Some(from), Some(to), LegKind::Return(ReturnTo::Home), None)
}

fn with(items: Vec<MissionItem>, context: &FlightContext<'_>) -> Result<Vec<Leg>, LegError> {
    legs(&mission(items), context).map(|found| found.legs)
}

fn of(items: Vec<MissionItem>) -> Vec<Leg> {
    with(items, &FlightContext::default()).unwrap()
}

fn shorts(items: Vec<MissionItem>) -> Vec<Short> {
    of(items).iter().map(short).collect()
}

fn refused(items: Vec<MissionItem>) -> LegError {
    with(items, &FlightContext::default()).unwrap_err()
}

#[test]
fn a_mission_that_begins_with_a_takeoff_begins_at_home() {
    let legs = of(vec![takeoff(), waypoint(1, 0), waypoint(2, 0)]);
    assert_eq!(legs.iter().map(short).collect::<Vec<_>>(), [flown(0, 1), flown(1, 2)]);
    assert_eq!(legs[0].from.position, at(0, 0));
    assert_eq!(legs[0].from.altitude.map(|a| a.metres), Some(50.0));
}

#[test]
fn a_mission_that_begins_with_a_takeoff_begins_where_the_vehicle_stands() {
    let context = FlightContext { start: Some(at(7, 7)), ..FlightContext::default() };
    let delayed = vec![item(93, [5.0; 4]), takeoff(), waypoint(1, 0)];
    let legs = with(delayed, &context).unwrap();
    assert_eq!(legs.iter().map(short).collect::<Vec<_>>(), [flown(1, 2)]);
    assert_eq!(legs[0].from.position, at(7, 7));
}

#[test]
fn a_mission_that_begins_with_a_waypoint_begins_there() {
    assert_eq!(shorts(vec![waypoint(1, 0), waypoint(2, 0)]), [flown(0, 1)]);
}

#[test]
fn a_takeoff_needs_a_start() {
    let mission = Mission { home: None, ..mission([takeoff(), waypoint(1, 0)]) };
    let error = legs(&mission, &FlightContext::default()).unwrap_err();
    assert_eq!(error, LegError::StartUnknown { item: 0 });
}

#[test]
fn px4_flies_to_the_place_of_a_takeoff_and_ardupilot_does_not() {
    let items = || vec![item_at(22, 1, 1), waypoint(2, 0)];
    let legs = |autopilot| {
        let legs = with(items(), &FlightContext { autopilot, ..FlightContext::default() });
        legs.unwrap().iter().map(|l| (l.from.position, l.to.position)).collect::<Vec<_>>()
    };
    let (home, place, end) = (at(0, 0), at(1, 1), at(2, 0));
    assert_eq!(legs(Autopilot::ArduPilot), [(home, end)]);
    assert_eq!(legs(Autopilot::Px4), [(home, place), (place, end)]);
    assert_eq!(legs(Autopilot::Unknown), [(home, place), (home, end), (place, end)]);
}

#[test]
fn a_takeoff_at_its_own_place_is_one_start() {
    let legs = of(vec![item_at(22, 0, 0), waypoint(2, 0)]);
    assert_eq!(legs.iter().map(short).collect::<Vec<_>>(), [flown(0, 1)]);
    assert_eq!(legs[0].insert_before, Some(1));
}

#[test]
fn only_waypoints_can_be_put_behind_a_takeoff_not_before_it() {
    let context = FlightContext { autopilot: Autopilot::Px4, ..FlightContext::default() };
    let legs = with(vec![item_at(22, 1, 1), waypoint(2, 0)], &context).unwrap();
    assert_eq!(legs[0].kind, LegKind::Takeoff);
    assert_eq!(legs.iter().map(|leg| leg.insert_before).collect::<Vec<_>>(), [None, Some(1)]);
}

#[test]
fn zero_is_here_and_not_the_gulf_of_guinea() {
    let climb = MissionItem { z: 80.0, frame: Frame::GLOBAL, ..item(16, [0.0; 4]) };
    let legs = of(vec![waypoint(1, 0), climb, waypoint(2, 0)]);
    assert_eq!(legs.iter().map(short).collect::<Vec<_>>(), [flown(1, 2)]);
    assert_eq!(legs[0].from.position, at(1, 0));
    assert_eq!(legs[0].from.altitude.map(|a| a.metres), Some(80.0));
}

#[test]
fn a_return_goes_home_and_to_every_rally_point() {
    let rally = [at(5, 5), at(6, 6)];
    let context = FlightContext { rally: &rally, ..FlightContext::default() };
    let legs = with(vec![waypoint(1, 0), waypoint(2, 0), item(20, [0.0; 4])], &context).unwrap();
    let returns: Vec<_> = legs.iter().skip(1).map(|l| (l.kind, l.to.position)).collect();
    let expected = [
        (LegKind::Return(ReturnTo::Home), at(0, 0)),
        (LegKind::Return(ReturnTo::Rally(0)), at(5, 5)),
        (LegKind::Return(ReturnTo::Rally(1)), at(6, 6)),
    ];
    assert_eq!(returns, expected);
    assert!(legs.iter().skip(1).all(|leg| leg.insert_before == Some(2)));
}

#[test]
fn a_return_without_home_is_refused() {
    let mission = Mission { home: None, ..mission([waypoint(1, 0), item(20, [0.0; 4])]) };
    let error = legs(&mission, &FlightContext::default()).unwrap_err();
    assert_eq!(error, LegError::HomeUnknown { item: 1 });
}

#[test]
fn a_home_that_is_moved_is_returned_to_as_well() {
    let set_home = item_at(179, 9, 9);
    let here = item(179, [1.0, 0.0, 0.0, 0.0]);
    let legs = of(vec![waypoint(1, 0), set_home, here, item(20, [0.0; 4])]);
    let homes: Vec<_> = legs.iter().map(|leg| leg.to.position).collect();
    assert_eq!(homes, [at(0, 0), at(9, 9), at(1, 0)]);
}

#[test]
fn a_return_on_the_ground_goes_nowhere() {
    let context = FlightContext { start: Some(at(7, 7)), ..FlightContext::default() };
    let items = vec![item(20, [0.0; 4]), takeoff(), waypoint(1, 0)];
    let starts: Vec<_> =
        with(items, &context).unwrap().iter().map(|leg| leg.from.position).collect();
    assert_eq!(starts, [at(7, 7), at(0, 0)]);
}

#[test]
fn what_comes_after_a_return_is_flown_from_home() {
    let legs = shorts(vec![waypoint(1, 0), item(20, [0.0; 4]), waypoint(2, 0)]);
    assert_eq!(legs, [home(0, 1), flown(1, 2)]);
}

#[test]
fn a_return_may_go_to_the_landing_sequence() {
    let legs = of(vec![
        waypoint(1, 0),
        item(20, [0.0; 4]),
        item_at(189, 3, 3),
        waypoint(4, 0),
        item_at(21, 5, 0),
    ]);
    let sequence = legs.iter().find(|l| l.kind == LegKind::Return(ReturnTo::LandingSequence(2)));
    let sequence = sequence.unwrap();
    assert_eq!((sequence.from.item, sequence.to.item), (Some(0), Some(3)));
    assert_eq!(sequence.insert_before, Some(1));
    assert!(legs.iter().any(|leg| short(leg) == flown(3, 4)));
}

#[test]
fn after_a_landing_only_a_takeoff_goes_on() {
    let landing = || vec![waypoint(1, 0), item_at(21, 2, 0)];
    let mut stops = landing();
    stops.extend([item(189, [0.0; 4]), waypoint(3, 0), item_at(21, 4, 0)]);
    assert_eq!(shorts(stops), [flown(0, 1), flown(3, 4)]);
    let mut delivers = landing();
    delivers.extend([item(93, [5.0; 4]), takeoff(), waypoint(3, 0)]);
    assert_eq!(shorts(delivers), [flown(0, 1), flown(3, 4)]);
}

#[test]
fn a_landing_where_the_vehicle_is_is_no_leg() {
    assert_eq!(shorts(vec![waypoint(1, 0), waypoint(2, 0), item(21, [0.0; 4])]), [flown(0, 1)]);
}

#[test]
fn a_jump_makes_a_leg_that_can_only_be_judged() {
    let legs =
        of(vec![waypoint(1, 0), waypoint(2, 0), waypoint(3, 0), jump(0, 2.0), waypoint(4, 0)]);
    let expected = [flown(0, 1), flown(1, 2), jumped(2, 0, 3), flown(2, 4)];
    let mut found: Vec<_> = legs.iter().map(short).collect();
    found.sort_by_key(|leg| (leg.0, leg.3.is_none()));
    assert_eq!(found, expected);
    assert!(legs.iter().all(|leg| leg.insert_before.is_some() == leg.jump.is_none()));
}

#[test]
fn a_jump_of_no_repeats_and_one_to_the_end_make_no_leg() {
    assert_eq!(shorts(vec![waypoint(1, 0), waypoint(2, 0), jump(0, 0.0)]), [flown(0, 1)]);
    assert_eq!(shorts(vec![waypoint(1, 0), waypoint(2, 0), jump(3, 9.0)]), [flown(0, 1)]);
}

#[test]
fn a_jump_to_an_action_lands_on_the_place_behind_it() {
    let legs = shorts(vec![waypoint(1, 0), item(178, [0.0; 4]), waypoint(2, 0), jump(1, -1.0)]);
    assert_eq!(legs, [flown(0, 2), jumped(2, 2, 3)]);
}

#[test]
fn a_jump_to_a_jump_follows_both() {
    let legs =
        shorts(vec![waypoint(1, 0), jump(4, 1.0), waypoint(2, 0), jump(1, 1.0), waypoint(3, 0)]);
    for leg in [jumped(0, 4, 1), flown(0, 2), flown(2, 4), jumped(2, 4, 3), jumped(2, 2, 3)] {
        assert!(legs.contains(&leg), "{leg:?} is not in {legs:?}");
    }
}

#[test]
fn a_tag_is_jumped_to_by_its_number() {
    let legs = shorts(vec![
        waypoint(1, 0),
        item(600, [7.0, 0.0, 0.0, 0.0]),
        waypoint(2, 0),
        waypoint(3, 0),
        item(601, [7.0, 1.0, 0.0, 0.0]),
    ]);
    assert_eq!(legs, [flown(0, 2), flown(2, 3), jumped(3, 2, 4)]);
}

#[test]
fn a_jump_to_nowhere_is_refused() {
    assert!(matches!(refused(vec![jump(2, 1.0)]), LegError::JumpTarget { item: 0, .. }));
    for target in [-1.0, 0.5, f32::NAN, f32::INFINITY, 1e9] {
        let jump = item(177, [target, 1.0, 0.0, 0.0]);
        assert!(matches!(refused(vec![jump]), LegError::JumpTarget { item: 0, .. }));
    }
    let tag = item(601, [3.0, 1.0, 0.0, 0.0]);
    assert_eq!(refused(vec![tag]), LegError::JumpTag { item: 0, tag: 3.0 });
}

#[test]
fn a_loiter_is_a_circle_at_both_its_legs() {
    let loiter = MissionItem { params: [1.0, 0.0, -30.0, 0.0], ..item_at(18, 2, 0) };
    let legs = of(vec![waypoint(1, 0), loiter, waypoint(3, 0)]);
    assert_eq!(legs[0].to.circle, Metres(30.0));
    assert_eq!(legs[1].from.circle, Metres(30.0));
    assert_eq!(legs[0].sweep(), Some(Metres(30.0)));
}

#[test]
fn a_loiter_where_the_vehicle_is_is_judged_there() {
    let loiter = item(18, [1.0, 0.0, 25.0, 0.0]);
    let legs = of(vec![waypoint(1, 0), loiter, waypoint(3, 0)]);
    assert_eq!(legs[0].kind, LegKind::Stay);
    assert_eq!((legs[0].to.position, legs[0].to.circle), (at(1, 0), Metres(25.0)));
    assert_eq!(legs[1].from.circle, Metres(25.0));
}

#[test]
fn a_single_place_is_judged_too() {
    let legs = of(vec![waypoint(1, 0)]);
    assert_eq!(
        legs.iter().map(short).collect::<Vec<_>>(),
        [(Some(0), Some(0), LegKind::Stay, None)]
    );
}

#[test]
fn a_spline_is_bounded_by_its_length() {
    let legs = of(vec![waypoint(0, 0), item_at(82, 1, 0), waypoint(2, 0)]);
    let LegShape::Curved { within: Some(within), .. } = legs[0].shape else { panic!("{legs:?}") };
    let length = 111.17;
    assert!((within.0 - 1.01 * 16.0 / 27.0 * length).abs() < 0.1, "{within}");
    assert_eq!(legs[0].insert_before, None);
    assert_eq!(legs[1].shape, LegShape::Straight);
}

#[test]
fn a_spline_between_unrelated_altitudes_has_no_bound() {
    let terrain = MissionItem { frame: Frame::GLOBAL_TERRAIN_ALT, ..item_at(82, 1, 0) };
    // The way to the first place, and with it how the spline begins, is not the mission's.
    let legs = of(vec![waypoint(0, 0), terrain]);
    assert!(matches!(legs[0].shape, LegShape::Curved { within: None, .. }));
    assert_eq!(legs[0].sweep(), None);
}

#[test]
fn a_half_circle_arc_is_bounded_by_its_radius() {
    let arc = MissionItem { params: [-180.0, 0.0, 0.0, 0.0], ..item_at(36, 1, 0) };
    let within = of(vec![waypoint(0, 0), arc])[0].sweep().unwrap();
    assert!((within.0 - 1.01 * 111.17 / 2.0).abs() < 0.1, "{within}");
}

#[test]
fn a_place_in_a_local_frame_or_off_the_globe_is_refused() {
    let local = MissionItem { frame: Frame(1), ..item(16, [0.0; 4]) };
    let error = refused(vec![waypoint(0, 0), local]);
    assert_eq!(error, LegError::Frame { item: 1, frame: Frame(1) });
    let off = MissionItem { x: 910_000_000, ..waypoint(0, 0) };
    assert!(matches!(refused(vec![off]), LegError::Position { item: 0, .. }));
    let endless = MissionItem { params: [0.0, 0.0, f32::INFINITY, 0.0], ..item_at(17, 0, 0) };
    assert_eq!(refused(vec![endless]), LegError::Radius { item: 0 });
}

#[test]
fn a_path_that_the_mission_does_not_give_is_refused() {
    for command in [25, 30, 34, 92, 176, 213, 42_702] {
        let error = refused(vec![waypoint(0, 0), item(command, [0.0; 4])]);
        assert_eq!(error, LegError::PathNotGiven { item: 1, command: Command(command) });
    }
}

#[test]
fn what_is_not_known_is_warned_about_in_order() {
    let found = legs(
        &mission([
            item(9999, [0.0; 4]),
            waypoint(0, 0),
            item_at(40, 1, 0),
            item(17, [0.0; 4]),
            item(189, [0.0; 4]),
        ]),
        &FlightContext::default(),
    );
    let expected = [
        LegWarning::UnknownCommand { item: 0, command: Command(9999) },
        LegWarning::UnknownNavigation { item: 2, command: Command(40) },
        LegWarning::LoiterRadius { item: 3 },
        LegWarning::EnteredFromAnywhere { item: 4 },
    ];
    assert_eq!(found.unwrap().warnings, expected);
}

#[test]
fn names_count_items_as_ground_stations_do() {
    let rally = [at(1, 1)];
    let context = FlightContext { rally: &rally, ..FlightContext::default() };
    let legs =
        with(vec![waypoint(1, 0), waypoint(2, 0), item(20, [0.0; 4]), jump(0, 1.0)], &context);
    let names: Vec<_> = legs.unwrap().iter().map(|leg| leg.name().to_string()).collect();
    assert_eq!(names[0], "leg from item 1 to item 2");
    assert_eq!(names[1], "return home from item 2");
    assert_eq!(names[2], "return to rally point 1 from item 2");
    assert!(names.contains(&"leg from item 3 to item 1 by the jump at item 4".to_owned()));
}

#[test]
fn a_mission_of_endless_branches_is_refused() {
    // From each of 600 places, by way of a block of jumps, to each of them.
    let places = (0..600).flat_map(|k| [waypoint(k, 0), jump(1200, 1.0)]);
    let block = (0..600).map(|k| jump(2 * k, 1.0));
    let error = legs(&mission(places.chain(block)), &FlightContext::default()).unwrap_err();
    assert!(matches!(error, LegError::TooManyLegs { .. }));
}

#[test]
fn a_long_plain_mission_is_followed() {
    let items = (0..65_000).map(|k| waypoint(k % 100, k / 100));
    let found = legs(&mission(items), &FlightContext::default()).unwrap();
    assert_eq!(found.legs.len(), 64_999);
}

#[test]
fn legs_across_the_antimeridian_and_the_equator_have_their_own_ends() {
    let at = |lat: i32, lon: i32| MissionItem { x: lat, y: lon, ..waypoint(0, 0) };
    let legs = of(vec![at(-10_000, 1_799_990_000), at(10_000, -1_799_990_000)]);
    assert_eq!(legs[0].from.position, position(-0.001, 179.999));
    assert_eq!(legs[0].to.position, position(0.001, -179.999));
}

/// Where the vehicle is at each stop of an executed mission, judged by the plainest rules; ends at
/// the first landing or return.
fn executed_stretches(mission: &Mission) -> Vec<(LatLon, LatLon, bool)> {
    let home = mission.home.map(|Home { position, .. }| position).unwrap();
    let (mut here, mut stretches, mut jumped) = (None, Vec::new(), false);
    for stop in execute(&mission.items, 60) {
        let item = &mission.items[stop.item];
        jumped |= !stop.jumps.is_empty();
        let place = (item.x != 0 || item.y != 0).then(|| item.position().unwrap());
        match (item.command.0, here) {
            (20, Some(here)) => {
                stretches.push((here, home, jumped));
                break;
            }
            (20, None) => jumped = false,
            (22, None) => here = Some(place.unwrap_or(home)),
            (21 | 85, here) => {
                stretches.extend(here.zip(place).map(|(from, to)| (from, to, jumped)));
                break;
            }
            (_, Some(from)) if place.is_some() => {
                stretches.extend(place.map(|to| (from, to, jumped)));
                here = place;
            }
            (_, None) => here = place,
            _ => {}
        }
        if place.is_some() {
            jumped = false;
        }
    }
    stretches
}

proptest! {
    #[test]
    fn every_stretch_that_is_flown_is_a_leg(mission in any_mission()) {
        let context = FlightContext { autopilot: Autopilot::Px4, ..FlightContext::default() };
        let found = legs(&mission, &context).unwrap().legs;
        for (from, to, jumped) in executed_stretches(&mission) {
            prop_assert!(from == to || found.iter().any(|leg| {
                leg.from.position == from
                    && leg.to.position == to
                    && leg.jump.is_some() == jumped
            }), "{from} to {to}, jumped {jumped}, is not in {found:#?}");
        }
    }

    #[test]
    fn every_place_is_in_a_leg(mission in any_mission()) {
        let found = legs(&mission, &FlightContext::default()).unwrap().legs;
        for (index, item) in mission.items.iter().enumerate() {
            let Some(place) = place((index, item)).unwrap() else { continue };
            prop_assert!(found.iter().any(|leg| {
                [leg.from, leg.to].iter().any(|end| end.position == place)
            }), "item {index}");
        }
    }

    #[test]
    fn waypoints_go_where_nothing_else_is_flown(mission in any_mission()) {
        for leg in legs(&mission, &FlightContext::default()).unwrap().legs {
            let Some(before) = leg.insert_before else { continue };
            let first = leg.from.item.map_or(0, |item| item + 1);
            // A landing sequence is entered from before the return.
            if matches!(leg.kind, LegKind::Return(ReturnTo::LandingSequence(_))) {
                continue;
            }
            prop_assert!(first <= before && before < mission.items.len());
            let earlier = &mission.items[first..before];
            prop_assert!(earlier.iter().all(|item| !item.command.role().is_navigation()));
        }
    }
}
