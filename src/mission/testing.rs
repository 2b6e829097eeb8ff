//! Small missions to test with, and an interpreter that executes missions item by item, written
//! without the code that it checks.

use proptest::prelude::*;

use super::{Command, Frame, Home, Mission, MissionItem};
use crate::geodesy::{LatLon, LatLonE7};

pub(super) fn position(lat: f64, lon: f64) -> LatLon {
    LatLon::new(lat, lon).unwrap()
}

/// A place some 111 m times `north` and `east` from the corner of the test area.
pub(super) fn place(north: i32, east: i32) -> LatLonE7 {
    LatLonE7 { lat: 470_000_000 + 10_000 * north, lon: 80_000_000 + 10_000 * east }
}

pub(super) fn at(north: i32, east: i32) -> LatLon {
    place(north, east).to_degrees().unwrap()
}

/// An item without a place.
pub(super) fn item(command: u16, params: [f32; 4]) -> MissionItem {
    MissionItem {
        seq: 0,
        frame: Frame::MISSION,
        command: Command(command),
        current: 0,
        autocontinue: 1,
        params,
        x: 0,
        y: 0,
        z: 0.0,
    }
}

/// An item with a place, 50 m above home.
pub(super) fn item_at(command: u16, north: i32, east: i32) -> MissionItem {
    let LatLonE7 { lat: x, lon: y } = place(north, east);
    let frame = Frame::GLOBAL_RELATIVE_ALT;
    MissionItem { frame, x, y, z: 50.0, ..item(command, [0.0; 4]) }
}

pub(super) fn waypoint(north: i32, east: i32) -> MissionItem {
    item_at(16, north, east)
}

/// A takeoff to 50 m where the vehicle is.
pub(super) fn takeoff() -> MissionItem {
    MissionItem { frame: Frame::GLOBAL_RELATIVE_ALT, z: 50.0, ..item(22, [0.0; 4]) }
}

pub(super) fn jump(target: usize, repeat: f32) -> MissionItem {
    item(177, [target as f32, repeat, 0.0, 0.0])
}

/// A mission with home in the corner of the test area, 400 m above the sea.
pub(super) fn mission(items: impl IntoIterator<Item = MissionItem>) -> Mission {
    let items = items.into_iter().zip(0..).map(|(item, seq)| MissionItem { seq, ..item });
    Mission {
        home: Some(Home { position: at(0, 0), altitude_amsl: 400.0 }),
        items: items.collect(),
    }
}

/// Items in bits, so that NaN equals itself.
pub(super) fn bits(items: &[MissionItem]) -> Vec<([u32; 5], [i64; 7])> {
    let of = |i: &MissionItem| {
        let [a, b, c, d] = i.params.map(f32::to_bits);
        let (seq, command) = (i64::from(i.seq), i64::from(i.command.0));
        let flags = [i.frame.0, i.current, i.autocontinue].map(i64::from);
        let [frame, current, autocontinue] = flags;
        let place = [i.x, i.y].map(i64::from);
        (
            [a, b, c, d, i.z.to_bits()],
            [seq, command, frame, current, autocontinue, place[0], place[1]],
        )
    };
    items.iter().map(of).collect()
}

/// One stop of an executed mission.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stop {
    /// The item of navigation.
    pub(super) item: usize,
    /// The jumps that were taken since the stop before.
    pub(super) jumps: Vec<usize>,
}

/// Executes a mission the way an autopilot does: one item after the other, jumps while they have
/// repeats left, or for ever where these are -1. Ends after `limit` stops.
pub(super) fn execute(items: &[MissionItem], limit: usize) -> Vec<Stop> {
    let mut repeats: Vec<f32> = items.iter().map(|item| item.params[1]).collect();
    let (mut stops, mut counter, mut jumps, mut steps) = (Vec::new(), 0, Vec::new(), 0);
    while let Some(item) = items.get(counter) {
        steps += 1;
        if stops.len() >= limit || steps > 100 * limit {
            break;
        }
        let number = item.command.0;
        let target = match number {
            177 => Some(item.params[0] as usize),
            601 => {
                items.iter().position(|tag| tag.command.0 == 600 && tag.params[0] == item.params[0])
            }
            _ => None,
        };
        match target {
            Some(target) if repeats[counter] > 0.0 || repeats[counter] == -1.0 => {
                if repeats[counter] > 0.0 {
                    repeats[counter] -= 1.0;
                }
                jumps.push(counter);
                counter = target;
                continue;
            }
            _ => {}
        }
        if number <= 95 && number != 80 {
            stops.push(Stop { item: counter, jumps: std::mem::take(&mut jumps) });
        }
        counter += 1;
    }
    stops
}

fn any_item(items: usize) -> impl Strategy<Value = MissionItem> {
    let grid = || (0..40_i32, 0..40_i32);
    let altitude = prop_oneof![Just(0.0_f32), 10.0_f32..120.0];
    let with_place = |commands: Vec<u16>, altitude: BoxedStrategy<f32>| {
        let yaw = prop_oneof![Just(f32::NAN), Just(0.0_f32), 0.0_f32..360.0];
        let frame = prop_oneof![Just(3_u8), Just(6), Just(0), Just(5)];
        (prop::sample::select(commands), grid(), altitude, yaw, frame).prop_map(
            |(command, (north, east), z, yaw, frame)| MissionItem {
                z,
                frame: Frame(frame),
                params: [0.0, 0.0, 0.0, yaw],
                ..item_at(command, north, east)
            },
        )
    };
    let actions = vec![80_u16, 178, 189, 201, 206, 4242, 112, 114, 115];
    prop_oneof![
        6 => with_place(vec![16], altitude.boxed()),
        1 => with_place(vec![16, 17, 18, 19, 31, 94, 40], Just(30.0).boxed()),
        1 => with_place(vec![82, 21, 22, 85], Just(30.0).boxed()),
        1 => prop::sample::select(vec![93_u16, 16, 21]).prop_map(|c| item(c, [0.0; 4])),
        1 => Just(takeoff()),
        1 => Just(item(20, [0.0; 4])),
        4 => prop::sample::select(actions).prop_map(|c| item(c, [3.0; 4])),
        2 => (0..=items, 0_u8..4).prop_map(|(to, repeat)| jump(to, f32::from(repeat))),
        1 => (0_u8..3).prop_map(|tag| item(600, [f32::from(tag), 0.0, 0.0, 0.0])),
        1 => (0_u8..3, 0_u8..4)
            .prop_map(|(tag, repeat)| item(601, [f32::from(tag), f32::from(repeat), 0.0, 0.0])),
    ]
}

/// Missions with everything in them, whose jumps lead somewhere; without `DO_SET_HOME`.
pub(super) fn any_mission() -> impl Strategy<Value = Mission> {
    (0..24_usize).prop_flat_map(|items| prop::collection::vec(any_item(items), items)).prop_map(
        |mut items| {
            let tags: Vec<f32> =
                items.iter().filter(|i| i.command.0 == 600).map(|i| i.params[0]).collect();
            for item in &mut items {
                if item.command.0 == 601 && !tags.contains(&item.params[0]) {
                    item.command = Command(178);
                }
            }
            mission(items)
        },
    )
}
