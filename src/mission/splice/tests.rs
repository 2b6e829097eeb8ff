//! What inserted waypoints change in a mission, and what they do not.

use proptest::prelude::*;

use super::*;
use crate::mission::legs::{LegKind, LegShape, ReturnTo};
use crate::mission::testing::{
    any_mission, at, bits, execute, item, item_at, jump, mission, place, takeoff, waypoint,
};
use crate::mission::{Autopilot, FlightContext, Frame, legs};

fn legs_of(mission: &Mission) -> Vec<Leg> {
    legs(mission, &FlightContext::default()).unwrap().legs
}

/// The leg that falls through from one item to another.
fn leg(mission: &Mission, from: usize, to: usize) -> usize {
    let ends =
        |leg: &Leg| leg.from.item == Some(from) && leg.to.item == Some(to) && leg.jump.is_none();
    legs_of(mission).iter().position(ends).unwrap()
}

fn detour(mission: &Mission, from: usize, to: usize, waypoints: &[LatLonE7]) -> Detour {
    Detour { leg: leg(mission, from, to), waypoints: waypoints.to_vec() }
}

fn spliced(mission: &Mission, detours: &[Detour]) -> Spliced {
    splice(mission, &legs_of(mission), detours).unwrap()
}

/// Two waypoints between two items.
fn around(items: Vec<MissionItem>, from: usize, to: usize) -> Spliced {
    let mission = mission(items);
    let detour = detour(&mission, from, to, &[place(30, 1), place(30, 2)]);
    spliced(&mission, &[detour])
}

fn commands(spliced: &Spliced) -> Vec<u16> {
    spliced.mission.items.iter().map(|item| item.command.0).collect()
}

#[test]
fn waypoints_are_inserted_before_the_end_of_the_leg() {
    let result = around(vec![takeoff(), waypoint(1, 0), waypoint(2, 0)], 1, 2);
    assert_eq!(result.inserted, [2, 3]);
    assert_eq!(result.new_index_of_old, [0, 1, 4]);
    let places: Vec<_> = result.mission.items.iter().map(MissionItem::e7).collect();
    assert_eq!(places[1..], [place(1, 0), place(30, 1), place(30, 2), place(2, 0)]);
}

#[test]
fn an_inserted_waypoint_is_a_plain_one() {
    let result = around(vec![waypoint(1, 0), item_at(17, 2, 0)], 0, 1);
    let inserted = result.mission.items[1];
    let LatLonE7 { lat: x, lon: y } = place(30, 1);
    let params = [0.0, 0.0, 0.0, f32::NAN];
    let expected = MissionItem { seq: 1, params, ..waypoint(0, 0) };
    assert_eq!(bits(&[inserted]), bits(&[MissionItem { x, y, ..expected }]));
}

#[test]
fn an_inserted_waypoint_has_the_heading_of_its_leg() {
    let north_east = MissionItem { params: [0.0, 0.0, 0.0, 45.0], ..waypoint(2, 0) };
    let result = around(vec![waypoint(1, 0), north_east], 0, 1);
    assert_eq!(result.mission.items[1].params, [0.0, 0.0, 0.0, 45.0]);
}

#[test]
fn the_current_item_stays_current() {
    let current = MissionItem { current: 1, ..waypoint(2, 0) };
    let result = around(vec![waypoint(1, 0), current], 0, 1);
    let flags: Vec<_> = result.mission.items.iter().map(|item| item.current).collect();
    assert_eq!(flags, [0, 0, 0, 1]);
}

#[test]
fn actions_stay_with_the_item_they_follow() {
    let items = vec![waypoint(1, 0), item(178, [0.0; 4]), item(206, [0.0; 4]), waypoint(2, 0)];
    let result = around(items, 0, 3);
    assert_eq!(commands(&result), [16, 178, 206, 16, 16, 16]);
    assert!(result.notes.is_empty());
}

#[test]
fn waypoints_go_behind_a_jump_that_leaves_and_before_the_target_of_one_that_enters() {
    let left = around(vec![waypoint(1, 0), jump(0, 2.0), waypoint(2, 0)], 0, 2);
    assert_eq!(commands(&left), [16, 177, 16, 16, 16]);
    let entered = vec![waypoint(1, 0), item(178, [0.0; 4]), waypoint(2, 0), jump(1, 2.0)];
    let entered = around(entered, 0, 2);
    assert_eq!(commands(&entered), [16, 16, 16, 178, 16, 177]);
    assert_eq!(entered.mission.items[5].params[0], 3.0);
    assert_eq!(entered.notes, [SpliceNote::Later { item: 1, command: Command(178) }]);
    let tag = item(600, [1.0; 4]);
    let tagged = vec![waypoint(1, 0), tag, waypoint(2, 0), item(601, [1.0; 4])];
    assert_eq!(commands(&around(tagged, 0, 2)), [16, 16, 16, 600, 16, 601]);
    let landing = vec![waypoint(1, 0), item(189, [0.0; 4]), waypoint(2, 0)];
    assert_eq!(commands(&around(landing, 0, 2)), [16, 16, 16, 189, 16]);
}

#[test]
fn a_jump_lands_on_its_item_and_not_on_the_waypoints_before_it() {
    let items = vec![waypoint(1, 0), waypoint(2, 0), waypoint(3, 0), jump(1, 2.0), waypoint(4, 0)];
    let result = around(items, 0, 1);
    assert_eq!(result.new_index_of_old[1], 3);
    assert_eq!(result.mission.items[5].params, [3.0, 2.0, 0.0, 0.0]);
}

#[test]
fn a_jump_to_the_end_still_ends() {
    let result = around(vec![waypoint(1, 0), jump(3, 2.0), waypoint(2, 0)], 0, 2);
    assert_eq!(result.mission.items[1].params[0], 5.0);
}

#[test]
fn a_region_of_interest_at_an_item_follows_it() {
    let roi = item(201, [2.0, 2.0, 0.0, 0.0]);
    let result = around(vec![waypoint(1, 0), roi, waypoint(2, 0)], 0, 2);
    assert_eq!(result.mission.items[1].params, [2.0, 4.0, 0.0, 0.0]);
}

#[test]
fn a_gap_that_is_entered_before_it_is_left_takes_no_waypoints() {
    let items = vec![waypoint(1, 0), item(600, [1.0; 4]), jump(0, 1.0), waypoint(2, 0)];
    let mission = mission(items);
    let detour = detour(&mission, 0, 3, &[place(30, 1)]);
    let error = splice(&mission, &legs_of(&mission), &[detour]).unwrap_err();
    assert!(matches!(error, SpliceError::Fixed(_)));
    assert_eq!(
        error.to_string(),
        "the leg from item 1 to item 4 cannot be re-planned, because no waypoint can be put into \
         it alone"
    );
}

#[test]
fn the_distance_of_a_condition_is_to_the_place_it_was_to() {
    let items = vec![
        waypoint(1, 0),
        item(178, [0.0; 4]),
        item(114, [20.0; 4]),
        item(206, [0.0; 4]),
        waypoint(2, 0),
    ];
    let result = around(items, 0, 4);
    assert_eq!(commands(&result), [16, 178, 16, 16, 114, 206, 16]);
    assert!(result.notes.is_empty());
}

#[test]
fn a_delay_stays_with_its_item_and_is_told_about() {
    let items = vec![waypoint(1, 0), item(112, [20.0; 4]), item(206, [0.0; 4]), waypoint(2, 0)];
    let result = around(items, 0, 3);
    assert_eq!(commands(&result), [16, 112, 206, 16, 16, 16]);
    assert_eq!(result.notes, [SpliceNote::Condition { item: 1, command: Command(112) }]);
}

#[test]
fn altitudes_rise_with_the_distance_flown() {
    let high = MissionItem { z: 90.0, ..waypoint(4, 0) };
    let mission = mission([waypoint(0, 0), high]);
    let result = spliced(&mission, &[detour(&mission, 0, 1, &[place(1, 0), place(3, 0)])]);
    let altitudes: Vec<_> = result.mission.items.iter().map(|item| item.z).collect();
    assert!((altitudes[1] - 60.0).abs() < 0.01 && (altitudes[2] - 80.0).abs() < 0.01);
}

#[test]
fn altitudes_above_the_sea_and_home_meet_in_the_frame_of_the_end() {
    let sea = MissionItem { frame: Frame::GLOBAL, z: 490.0, ..waypoint(0, 0) };
    let mission = mission([sea, waypoint(2, 0)]);
    let result = spliced(&mission, &[detour(&mission, 0, 1, &[place(1, 0)])]);
    let inserted = result.mission.items[1];
    assert_eq!(inserted.frame, Frame::GLOBAL_RELATIVE_ALT);
    assert!((inserted.z - 70.0).abs() < 0.01);
}

#[test]
fn altitudes_that_cannot_be_compared_are_refused() {
    let sea = MissionItem { frame: Frame::GLOBAL, z: 490.0, ..waypoint(0, 0) };
    let terrain = MissionItem { frame: Frame::GLOBAL_TERRAIN_ALT, ..waypoint(0, 0) };
    let moved = item(179, [1.0, 0.0, 0.0, 0.0]);
    for items in [vec![terrain, waypoint(2, 0)], vec![sea, moved, waypoint(2, 0)]] {
        let mission = mission(items);
        let detour = detour(&mission, 0, mission.items.len() - 1, &[place(1, 0)]);
        let error = splice(&mission, &legs_of(&mission), &[detour]).unwrap_err();
        assert!(matches!(
            error,
            SpliceError::Altitude { source: AltitudeError::MixedReferences { .. }, .. }
        ));
    }
}

#[test]
fn nothing_descends_on_the_way_to_a_landing_or_home() {
    let land = MissionItem { z: 0.0, ..item_at(21, 2, 0) };
    let landing = around(vec![waypoint(1, 0), land], 0, 1);
    let ret = around(vec![waypoint(1, 0), item(20, [0.0; 4])], 0, 1);
    for result in [landing, ret] {
        let heights: Vec<_> = result.mission.items[..3].iter().map(|i| (i.frame, i.z)).collect();
        assert_eq!(heights, [(Frame::GLOBAL_RELATIVE_ALT, 50.0); 3]);
    }
}

#[test]
fn a_takeoff_starts_at_the_height_it_climbs_to() {
    let high = MissionItem { z: 90.0, ..waypoint(4, 0) };
    let mission = mission([takeoff(), high]);
    let result = spliced(&mission, &[detour(&mission, 0, 1, &[place(2, 0)])]);
    assert!((result.mission.items[1].z - 70.0).abs() < 0.01);
}

#[test]
fn the_way_home_is_made_explicit_before_the_return() {
    let result = around(vec![takeoff(), waypoint(5, 0), item(20, [0.0; 4])], 1, 2);
    assert_eq!(commands(&result), [22, 16, 16, 16, 20]);
    let last = *legs_of(&result.mission).last().unwrap();
    assert_eq!((last.from.item, last.to.position), (Some(3), at(0, 0)));
}

#[test]
fn a_jump_leg_and_an_unknown_leg_take_no_detour() {
    let mission = mission([waypoint(1, 0), waypoint(2, 0), jump(0, 1.0)]);
    let legs = legs_of(&mission);
    let jump = legs.iter().position(|leg| leg.jump.is_some()).unwrap();
    let by = |leg| splice(&mission, &legs, &[Detour { leg, waypoints: vec![place(1, 1)] }]);
    assert!(matches!(by(jump), Err(SpliceError::Fixed(_))));
    assert_eq!(by(99), Err(SpliceError::NoSuchLeg { leg: 99 }));
}

#[test]
fn legs_that_share_their_waypoints_take_only_one_detour() {
    let rally = [at(5, 5)];
    let mission = mission([waypoint(1, 0), item(20, [0.0; 4])]);
    let context = FlightContext { rally: &rally, ..FlightContext::default() };
    let legs = legs(&mission, &context).unwrap().legs;
    let detours = [0, 1].map(|leg| Detour { leg, waypoints: vec![place(1, 1)] });
    let error = splice(&mission, &legs, &detours).unwrap_err();
    assert_eq!(error, SpliceError::SharedWaypoints { item: 1 });
}

#[test]
fn a_waypoint_off_the_globe_is_refused() {
    let mission = mission([waypoint(1, 0), waypoint(2, 0)]);
    let off = LatLonE7 { lat: 0, lon: 1_800_000_001 };
    let error = splice(&mission, &legs_of(&mission), &[detour(&mission, 0, 1, &[off])]);
    assert!(matches!(error, Err(SpliceError::Waypoint { .. })));
}

#[test]
fn more_items_than_mavlink_counts_are_refused() {
    let mission = mission([waypoint(1, 0), waypoint(2, 0)]);
    let mut waypoints = vec![place(1, 1); ITEM_LIMIT - 2];
    let full = Detour { leg: 0, waypoints: waypoints.clone() };
    assert_eq!(spliced(&mission, &[full]).mission.items.len(), ITEM_LIMIT);
    waypoints.push(place(1, 1));
    let error = splice(&mission, &legs_of(&mission), &[Detour { leg: 0, waypoints }]);
    assert_eq!(error, Err(SpliceError::TooManyItems { items: ITEM_LIMIT + 1 }));
}

#[test]
fn a_mission_out_of_sequence_is_refused() {
    let mut mission = mission([waypoint(1, 0), waypoint(2, 0)]);
    mission.items[1].seq = 7;
    assert_eq!(splice(&mission, &[], &[]), Err(SpliceError::Sequence { item: 1, seq: 7 }));
}

fn ardupilots_legs(mission: &Mission) -> Vec<Leg> {
    let context = FlightContext { autopilot: Autopilot::ArduPilot, ..FlightContext::default() };
    legs(mission, &context).unwrap().legs
}

#[test]
fn a_jump_goes_over_its_own_waypoints_and_all_else_past_them() {
    let items =
        [takeoff(), waypoint(1, 0), waypoint(2, 0), waypoint(3, 0), jump(2, 2.0), waypoint(4, 0)];
    let mission = mission(items);
    let legs = ardupilots_legs(&mission);
    let leg = legs.iter().position(|leg| leg.by_jump.is_some()).unwrap();
    assert_eq!((legs[leg].from.item, legs[leg].to.item), (Some(3), Some(2)));
    let waypoints = vec![place(30, 1), place(30, 2)];
    let result = splice(&mission, &legs, &[Detour { leg, waypoints }]).unwrap();
    let new = &result.mission.items;
    let commands: Vec<_> = new.iter().map(|item| item.command.0).collect();
    assert_eq!(commands, [22, 16, 177, 16, 16, 16, 16, 177, 16]);
    assert_eq!(new[2].params[..2], [5.0, -1.0], "past the waypoints, always");
    assert_eq!(new[7].params[..2], [3.0, 2.0], "to the first of them");
    assert_eq!(result.inserted, [3, 4]);
    assert_eq!(result.notes, [SpliceNote::ByJump { jump: 4, target: 2 }]);
    // The way past them is the leg that it was, and nothing leads to the waypoints but the jump.
    let after = ardupilots_legs(&result.mission);
    let ends = |leg: &&Leg| (leg.from.item, leg.to.item) == (Some(1), Some(5));
    assert_eq!(after.iter().find(ends).unwrap().jump, None);
    let into: Vec<_> = after.iter().filter(|leg| leg.to.item == Some(3)).collect();
    assert_eq!(into.len(), 1, "{into:?}");
    assert_eq!((into[0].from.item, into[0].jump), (Some(6), Some(7)));
}

#[test]
fn a_jump_of_an_unknown_autopilot_and_one_behind_another_get_no_waypoints() {
    let items = [waypoint(1, 0), waypoint(2, 0), jump(0, 2.0)];
    assert!(legs_of(&mission(items)).iter().all(|leg| leg.by_jump.is_none()));
    let chained = [waypoint(1, 0), waypoint(2, 0), jump(4, 1.0), waypoint(3, 0), jump(0, 1.0)];
    let chained = ardupilots_legs(&mission(chained));
    let both = chained.iter().find(|leg| leg.from.item == Some(1) && leg.to.item == Some(0));
    assert_eq!(both.unwrap().by_jump, None);
}

/// Detours for some of the legs, at most one for each place to insert at, and none whose altitudes
/// are not known.
fn detours(mission: &Mission, legs: &[Leg], chosen: &[usize]) -> Vec<Detour> {
    let mut taken = Vec::new();
    let mut detours = Vec::new();
    for (leg, &count) in chosen.iter().cycle().take(legs.len()).enumerate() {
        let Some(before) = legs[leg].insert_before else { continue };
        if count == 0 || taken.contains(&before) {
            continue;
        }
        let waypoints = (0..count).map(|k| place(60 + leg as i32, k as i32)).collect();
        let detour = Detour { leg, waypoints };
        match splice(mission, legs, std::slice::from_ref(&detour)) {
            Ok(_) => {
                taken.push(before);
                detours.push(detour);
            }
            Err(error) => assert!(matches!(error, SpliceError::Altitude { .. }), "{error}"),
        }
    }
    detours
}

proptest! {
    #[test]
    fn without_detours_nothing_changes(mission in any_mission()) {
        let result = splice(&mission, &legs_of(&mission), &[]).unwrap();
        prop_assert_eq!(bits(&result.mission.items), bits(&mission.items));
        prop_assert_eq!(result.mission.home, mission.home);
        prop_assert_eq!(result.new_index_of_old, (0..mission.items.len()).collect::<Vec<_>>());
        prop_assert!(result.inserted.is_empty() && result.notes.is_empty());
    }

    #[test]
    fn every_item_is_kept_but_for_the_numbers_of_items(
        mission in any_mission(),
        chosen in prop::collection::vec(0..4_usize, 1..8),
    ) {
        let legs = legs_of(&mission);
        let result = splice(&mission, &legs, &detours(&mission, &legs, &chosen)).unwrap();
        let new = &result.mission.items;
        prop_assert!(new.iter().zip(0..).all(|(item, seq)| item.seq == seq));
        prop_assert_eq!(new.len(), mission.items.len() + result.inserted.len());
        prop_assert!(result.new_index_of_old.windows(2).all(|pair| pair[0] < pair[1]));
        let end = new.len();
        for (old, &now) in mission.items.iter().zip(&result.new_index_of_old) {
            prop_assert!(!result.inserted.contains(&now));
            let mut back = MissionItem { seq: old.seq, ..new[now] };
            if old.command == Command::DO_JUMP {
                let target = old.params[0] as usize;
                let expected = result.new_index_of_old.get(target).copied().unwrap_or(end);
                prop_assert_eq!(back.params[0], expected as f32);
                back.params[0] = old.params[0];
            }
            prop_assert_eq!(bits(&[back]), bits(&[*old]));
        }
    }

    /// The whole promise: executed item by item, jumps and repeats included, the new mission makes
    /// the stops of the old one in the same order, and between two of them flies the waypoints of
    /// exactly the leg that it falls through.
    #[test]
    fn the_new_mission_flies_the_old_one_with_its_detours(
        mission in any_mission(),
        chosen in prop::collection::vec(0..4_usize, 1..8),
    ) {
        let legs = legs_of(&mission);
        let detours = detours(&mission, &legs, &chosen);
        let result = splice(&mission, &legs, &detours).unwrap();
        let mut expected = Vec::new();
        let mut last = None;
        for stop in execute(&mission.items, 80) {
            let detour = detours.iter().find(|detour| {
                let before = legs[detour.leg].insert_before.unwrap();
                let first = last.map_or(0, |item: usize| item + 1);
                stop.jumps.is_empty() && (first..=stop.item).contains(&before)
            });
            expected.extend(detour.iter().flat_map(|detour| detour.waypoints.iter().copied()));
            expected.push(mission.items[stop.item].e7());
            last = Some(stop.item);
        }
        let flown: Vec<_> = execute(&result.mission.items, expected.len())
            .iter()
            .map(|stop| result.mission.items[stop.item].e7())
            .collect();
        prop_assert_eq!(flown, expected);
    }

    /// The same promise for the legs that a jump flies: whoever takes the jump flies its waypoints,
    /// nobody else does, and all else is as before.
    #[test]
    fn waypoints_for_a_jump_are_flown_by_that_jump_alone(
        mission in any_mission(),
        chosen in prop::collection::vec(0..4_usize, 1..8),
    ) {
        let legs = ardupilots_legs(&mission);
        let mut detours: Vec<Detour> = Vec::new();
        for (leg, &count) in chosen.iter().cycle().take(legs.len()).enumerate() {
            let Some(by) = legs[leg].by_jump.filter(|_| count > 0) else { continue };
            let taken = |detour: &Detour| legs[detour.leg].by_jump.unwrap().target == by.target;
            let waypoints = (0..count).map(|k| place(60 + leg as i32, k as i32)).collect();
            let detour = Detour { leg, waypoints };
            if !detours.iter().any(taken)
                && splice(&mission, &legs, std::slice::from_ref(&detour)).is_ok()
            {
                detours.push(detour);
            }
        }
        let result = splice(&mission, &legs, &detours).unwrap();
        let new = &result.mission.items;
        prop_assert_eq!(new.len(), mission.items.len() + result.inserted.len() + detours.len());
        let mut expected = Vec::new();
        for stop in execute(&mission.items, 80) {
            for jump in &stop.jumps {
                let of = |detour: &&Detour| legs[detour.leg].by_jump.unwrap().jump == *jump;
                expected.extend(detours.iter().find(of).iter().flat_map(|d| d.waypoints.clone()));
            }
            expected.push(mission.items[stop.item].e7());
        }
        let flown: Vec<_> =
            execute(new, expected.len()).iter().map(|stop| new[stop.item].e7()).collect();
        prop_assert_eq!(flown, expected);
    }

    #[test]
    fn the_legs_that_keep_straight_are_legs_of_the_new_mission(
        mission in any_mission(),
        chosen in prop::collection::vec(0..4_usize, 1..8),
    ) {
        let legs = legs_of(&mission);
        let detours = detours(&mission, &legs, &chosen);
        let result = splice(&mission, &legs, &detours).unwrap();
        let changed: Vec<_> = detours.iter().map(|detour| legs[detour.leg].insert_before).collect();
        let new = legs_of(&result.mission);
        for leg in legs.iter().filter(|leg| !changed.contains(&leg.insert_before)) {
            // A return that goes on in a landing sequence passes two places to insert at.
            let plain = leg.shape == LegShape::Straight
                && matches!(leg.kind, LegKind::Flown | LegKind::Return(ReturnTo::Home));
            if !plain && mission.items.iter().any(|i| i.command == Command::DO_LAND_START) {
                continue;
            }
            prop_assert!(new.iter().any(|other| {
                (other.from.position, other.to.position) == (leg.from.position, leg.to.position)
            }), "{} is gone", leg.name());
        }
    }
}
