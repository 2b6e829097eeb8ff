//! Plans as vehicles hold them.

use quav::fence::{FenceSet, decode_fence, encode_fence};
use quav::formats::{Scenario, write_geojson, write_plan, write_waypoints};
use quav::mission::{
    Autopilot, Command, FlightContext, Frame, LoiterHabit, Mission, MissionItem, legs,
};

use super::debug;

/// A mission as a vehicle may hold it: 37 bytes for each item, as MISSION_ITEM_INT carries it.
pub(super) fn mission(data: &[u8]) {
    let Some((&which, rest)) = data.split_first() else { return };
    let items = items(rest);
    for (autopilot, habit) in [
        (quav::vehicle::Autopilot::ArduPilot, Autopilot::ArduPilot),
        (quav::vehicle::Autopilot::Px4, Autopilot::Px4),
    ] {
        judged(&quav::vehicle::numbering::to_mission(autopilot, &items, None), habit, which);
    }
}

/// The legs of a mission, and every file that it can be written to.
pub(super) fn judged(mission: &Mission, autopilot: Autopilot, which: u8) {
    let start = mission.items.iter().find_map(|item| item.position().ok());
    let start = start.filter(|_| which & 1 == 1);
    let rally: Vec<_> = start.into_iter().collect();
    let loiter = LoiterHabit::default();
    let context = FlightContext { start, rally: &rally, autopilot, loiter };
    if let Ok(flown) = legs(mission, &context) {
        for leg in &flown.legs {
            let _ = (leg.name().to_string(), leg.sweep());
        }
    }
    let scenario = Scenario { mission: mission.clone(), ..Scenario::default() };
    let _ = write_plan(&scenario);
    let _ = write_waypoints(mission);
    let _ = write_geojson(&scenario);
}

/// A fence as a vehicle may hold it.
pub(super) fn fence(data: &[u8]) {
    let Ok(decoded) = decode_fence(&items(data), None) else { return };
    let encoded = encode_fence(&decoded.fences).expect("what was decoded can be encoded");
    let again = decode_fence(&encoded, None).expect("what was encoded can be decoded").fences;
    let plain = |set: &FenceSet| -> Vec<_> {
        set.regions.iter().map(|region| (region.role, region.shape.clone())).collect()
    };
    assert_eq!(plain(&again), plain(&decoded.fences));
    assert_eq!(debug(&again.return_point), debug(&decoded.fences.return_point));
}

pub(super) fn items(data: &[u8]) -> Vec<MissionItem> {
    let item = |(seq, bytes): (usize, &[u8; 37])| {
        let four = |at: usize| [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]];
        let float = |at: usize| f32::from_le_bytes(four(at));
        MissionItem {
            seq: seq as u16,
            params: [float(0), float(4), float(8), float(12)],
            x: i32::from_le_bytes(four(16)),
            y: i32::from_le_bytes(four(20)),
            z: float(24),
            command: Command(u16::from_le_bytes([bytes[30], bytes[31]])),
            frame: Frame(bytes[34]),
            current: bytes[35],
            autocontinue: bytes[36],
        }
    };
    data.as_chunks::<37>().0.iter().enumerate().map(item).collect()
}
