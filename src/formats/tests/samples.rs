//! Random scenarios on the grids that all formats can hold.

use proptest::prelude::*;

use crate::fence::samples::{fence_set, position};
use crate::formats::{Scenario, VehicleHint};
use crate::mission::Autopilot;
use crate::mission::{Command, Frame, Home, Mission, MissionItem};

fn altitude() -> impl Strategy<Value = f32> {
    (-8_000..80_000i32).prop_map(|eighths| eighths as f32 / 8.0)
}

fn param() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => prop::num::f32::NORMAL,
        2 => (-100..100i16).prop_map(f32::from),
        1 => Just(f32::NAN),
        1 => Just(0.0),
        1 => Just(0.1),
    ]
}

/// An item with a place, one with zeros for "here", or a command without a place.
fn item() -> impl Strategy<Value = MissionItem> {
    let placed = (prop::sample::select(vec![0u8, 3, 10]), position())
        .prop_map(|(frame, position)| (frame, position.to_e7().lat, position.to_e7().lon));
    let here = prop::sample::select(vec![0u8, 3, 10]).prop_map(|frame| (frame, 0, 0));
    let unplaced =
        (any::<i32>(), any::<i32>()).prop_map(|(x, y)| (2, x.max(-i32::MAX), y.max(-i32::MAX)));
    let commands =
        prop::sample::select(vec![16u16, 18, 21, 22, 82, 112, 178, 201, 203, 2000, 42_000]);
    (
        prop_oneof![4 => placed, 1 => here, 2 => unplaced],
        commands,
        prop::array::uniform4(param()),
        altitude(),
        any::<bool>(),
    )
        .prop_map(|((frame, x, y), command, params, z, autocontinue)| MissionItem {
            seq: 0,
            frame: Frame(frame),
            command: Command(command),
            current: 0,
            autocontinue: u8::from(autocontinue),
            params,
            x,
            y,
            z,
        })
}

fn items() -> impl Strategy<Value = Vec<MissionItem>> {
    let jumps = prop::collection::vec((any::<prop::sample::Index>(), -1i16..9), 0..3);
    (prop::collection::vec(item(), 0..8), jumps).prop_map(|(mut items, jumps)| {
        let count = items.len();
        for (target, repeats) in jumps.into_iter().take(count) {
            let target = target.index(count) as f32;
            items.push(MissionItem {
                seq: 0,
                frame: Frame::MISSION,
                command: Command::DO_JUMP,
                current: 0,
                autocontinue: 1,
                params: [target, f32::from(repeats), 0.0, 0.0],
                x: 0,
                y: 0,
                z: 0.0,
            });
        }
        number(items)
    })
}

fn rally() -> impl Strategy<Value = Vec<MissionItem>> {
    let point = (position(), altitude()).prop_map(|(position, z)| MissionItem {
        seq: 0,
        frame: Frame::GLOBAL_RELATIVE_ALT,
        command: Command::NAV_RALLY_POINT,
        current: 0,
        autocontinue: 1,
        params: [0.0; 4],
        x: position.to_e7().lat,
        y: position.to_e7().lon,
        z,
    });
    prop::collection::vec(point, 0..3).prop_map(number)
}

fn number(mut items: Vec<MissionItem>) -> Vec<MissionItem> {
    for (seq, item) in items.iter_mut().enumerate() {
        item.seq = seq as u16;
    }
    items
}

/// Any scenario; home and return point are not where zeros mean "unknown".
pub(super) fn scenario() -> impl Strategy<Value = Scenario> {
    let home = prop::option::of(
        (position(), altitude())
            .prop_map(|(position, altitude_amsl)| Home { position, altitude_amsl }),
    );
    (home, items(), fence_set(), rally()).prop_map(|(home, items, fences, rally)| Scenario {
        mission: Mission { home, items },
        fences,
        rally,
        vehicle: VehicleHint { autopilot: Autopilot::ArduPilot, ..VehicleHint::default() },
        kept: crate::formats::Kept::default(),
        warnings: Vec::new(),
    })
}
