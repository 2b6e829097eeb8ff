use super::*;

fn waypoint() -> MissionItem {
    MissionItem {
        seq: 0,
        frame: Frame::GLOBAL_RELATIVE_ALT_INT,
        command: Command::NAV_WAYPOINT,
        current: 0,
        autocontinue: 1,
        params: [0.0; 4],
        x: 473_977_420,
        y: 85_455_940,
        z: 50.0,
    }
}

fn plan(items: impl IntoIterator<Item = MissionItem>) -> Vec<MissionItem> {
    items.into_iter().zip(0..).map(|(item, seq)| MissionItem { seq, ..item }).collect()
}

fn fields(autopilot: Autopilot, sent: &[MissionItem], held: &[MissionItem]) -> Vec<Field> {
    let found = differences(autopilot, MissionType::Mission, sent, held);
    found.iter().map(|difference| difference.field).collect()
}

#[test]
fn every_field_that_changed_is_named() {
    let sent = plan([waypoint(), waypoint()]);
    let mut held = sent.clone();
    held[1] = MissionItem {
        seq: 1,
        frame: Frame::GLOBAL_INT,
        command: Command::NAV_LAND,
        current: 1,
        autocontinue: 0,
        params: [1.0, 2.0, 3.0, f32::NAN],
        x: 1,
        y: 2,
        z: 3.0,
    };
    let head = [Field::Command, Field::Frame];
    let params = (0..4).map(Field::Param);
    let tail = [Field::X, Field::Y, Field::Z, Field::Autocontinue];
    let all: Vec<_> = head.into_iter().chain(params).chain(tail).collect();
    assert_eq!(fields(Autopilot::Px4, &sent, &held), all);
    let found = differences(Autopilot::Px4, MissionType::Mission, &sent, &held);
    assert_eq!(found[6].to_string(), "item 1 x: 473977420 sent, 1 held");
}

#[test]
fn one_unit_of_position_is_a_difference_on_either_autopilot() {
    for autopilot in [Autopilot::ArduPilot, Autopilot::Px4] {
        let sent = plan([waypoint(), waypoint()]);
        let mut held = sent.clone();
        held[1].x += 1;
        assert_eq!(fields(autopilot, &sent, &held), [Field::X]);
    }
}

#[test]
fn a_missing_or_added_item_is_a_difference() {
    let sent = plan([waypoint(), waypoint()]);
    let found = differences(Autopilot::Px4, MissionType::Mission, &sent, &sent[..1]);
    assert_eq!(found[0].to_string(), "2 items sent, 1 held");
    assert_eq!(fields(Autopilot::Px4, &sent[..1], &sent), [Field::Count]);
}

#[test]
fn what_ardupilot_is_known_to_do_is_excused() {
    let land = MissionItem { command: Command::NAV_LAND, ..waypoint() };
    let speed = MissionItem {
        command: Command(178),
        frame: Frame::MISSION,
        params: [1.0, 5.0, -1.0, 0.0],
        x: 0,
        y: 0,
        z: 0.0,
        ..waypoint()
    };
    let mut long = waypoint();
    long.params = [1.7, 3.0, 0.0, f32::NAN];
    long.z = 30.123;
    let sent = plan([waypoint(), long, land, speed]);
    let mut held = sent.clone();
    held[0].x = -353_632_621;
    held[0].frame = Frame::GLOBAL;
    held[1].params = [1.0, 0.0, 0.0, 0.0];
    held[1].z = 30.12;
    held[1].frame = Frame::GLOBAL_RELATIVE_ALT;
    held[2].params[3] = 1.0;
    held[2].frame = Frame::GLOBAL_RELATIVE_ALT;
    held[3].frame = Frame::GLOBAL;
    assert_eq!(fields(Autopilot::ArduPilot, &sent, &held), []);
    assert!(!fields(Autopilot::Px4, &sent, &held).is_empty());
}

#[test]
fn what_ardupilot_is_not_known_to_do_is_not_excused() {
    let mut item = waypoint();
    item.params[0] = 3.0;
    let speed = MissionItem { command: Command(178), params: [1.0, 5.0, -1.0, 0.0], ..waypoint() };
    let sent = plan([waypoint(), item, speed]);
    for (spoil, field) in [
        (
            (|items: &mut Vec<MissionItem>| items[1].params[0] = 4.0) as fn(&mut Vec<_>),
            Field::Param(0),
        ),
        (|items| items[1].z += 0.02, Field::Z),
        (|items| items[1].frame = Frame::GLOBAL, Field::Frame),
        (|items| items[2].params[1] = 6.0, Field::Param(1)),
        (|items| items[2].seq = 7, Field::Seq),
    ] {
        let mut held = sent.clone();
        spoil(&mut held);
        assert_eq!(fields(Autopilot::ArduPilot, &sent, &held), [field]);
    }
}

#[test]
fn an_altitude_is_cut_towards_zero_by_less_than_a_centimetre_and_never_raised() {
    for (sent, held, same) in [
        (30.129, 30.12, true),
        (30.12, 30.11, true), // 30.12 as f32, times 100, is below 3012
        (30.12, 30.129, false),
        (30.12, 30.10, false),
        (-5.128, -5.12, true),
        (-5.12, -5.13, false),
        (0.004, 0.0, true),
        (0.004, -0.004, false),
    ] {
        assert_eq!(cut_to(0.01, sent, held), same, "{sent} -> {held}");
    }
}

#[test]
fn between_two_downloads_nothing_is_excused_but_home_and_current() {
    let earlier = plan([waypoint(), waypoint(), waypoint()]);
    let count = |now: &[MissionItem]| {
        changes(Autopilot::ArduPilot, MissionType::Mission, &earlier, now).len()
    };
    let mut now = earlier.clone();
    now[0].x += 5;
    now[2].current = 1;
    assert_eq!(count(&now), 0);
    for spoil in [
        (|item: &mut MissionItem| item.z -= 0.005) as fn(&mut MissionItem),
        |item| item.params[1] = 5.0,
        |item| item.params[3] = f32::NAN,
        |item| item.frame = Frame::GLOBAL_RELATIVE_ALT,
        |item| item.autocontinue = 0,
    ] {
        let mut now = earlier.clone();
        spoil(&mut now[1]);
        assert_eq!(count(&now), 1);
    }
}

#[test]
fn px4_may_turn_a_yaw_by_a_whole_circle_only() {
    let mut item = waypoint();
    item.params[3] = -90.0;
    let sent = plan([item]);
    let mut held = sent.clone();
    held[0].params[3] = 270.000_03;
    assert_eq!(fields(Autopilot::Px4, &sent, &held), []);
    held[0].params[3] = 90.0;
    assert_eq!(fields(Autopilot::Px4, &sent, &held), [Field::Param(3)]);
}

#[test]
fn a_fence_is_its_commands_positions_and_counts() {
    let vertex = MissionItem {
        command: Command::NAV_FENCE_POLYGON_VERTEX_EXCLUSION,
        params: [3.0, 0.0, 0.0, 0.0],
        ..waypoint()
    };
    let sent = plan([vertex, vertex, vertex]);
    let mut held = sent.clone();
    for item in &mut held {
        item.frame = Frame::GLOBAL;
        item.z = 0.0;
        item.autocontinue = 0;
    }
    let fence = |sent: &[_], held: &[_]| {
        differences(Autopilot::ArduPilot, MissionType::Fence, sent, held).len()
    };
    assert_eq!(fence(&sent, &held), 0);
    held[2].params[0] = 4.0;
    assert_eq!(fence(&sent, &held), 1);
    held[0].x -= 1;
    assert_eq!(fence(&sent, &held), 2, "slot 0 of a fence is no home");
}
