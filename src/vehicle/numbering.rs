//! A vehicle's list of mission items and quavd's [`Mission`], one from the other.
//!
//! ArduPilot keeps home in slot 0 and counts jump targets from there; PX4 has no such slot.
//! [`Mission`] counts from the first command that is flown. Both directions keep everything else
//! bit by bit.

use super::discovery::Autopilot;
use crate::geodesy::LatLonE7;
use crate::mission::{Command, Frame, Home, Mission, MissionItem};

/// A mission as downloaded from `autopilot`, in quavd's numbering.
///
/// `home` is what the vehicle reports (HOME_POSITION); where it has not, ArduPilot's slot 0
/// serves, unless that is the 0, 0 of a vehicle without a position.
#[must_use]
pub fn to_mission(autopilot: Autopilot, held: &[MissionItem], home: Option<Home>) -> Mission {
    let (slot, items) = match (autopilot, held.split_first()) {
        (Autopilot::ArduPilot, Some((slot, items))) => (Some(slot), items),
        _ => (None, held),
    };
    Mission {
        home: home.or_else(|| slot.and_then(home_of)),
        items: renumbered(items, -home_slots(autopilot)),
    }
}

/// The list to upload to `autopilot` for a mission in quavd's numbering.
///
/// `home_slot` is what the vehicle held in ArduPilot's slot 0 before; without it the mission's
/// home is written there. Frames go as the autopilot understands them: PX4 is sent the `_INT`
/// twins. `current` is 0 for ArduPilot, which takes 2 and 3 there for orders to fly at once.
#[must_use]
pub fn to_vehicle(
    autopilot: Autopilot,
    mission: &Mission,
    home_slot: Option<&MissionItem>,
) -> Vec<MissionItem> {
    let mut items = renumbered(&mission.items, home_slots(autopilot));
    match autopilot {
        Autopilot::ArduPilot => {
            let slot = home_slot.copied().unwrap_or_else(|| slot_of(mission.home));
            items.insert(0, MissionItem { seq: 0, ..slot });
            for item in &mut items {
                item.current = 0;
            }
        }
        Autopilot::Px4 | Autopilot::Other(_) => {
            for item in &mut items {
                item.frame = int_twin(item.frame);
                item.current = u8::from(item.current == 1);
            }
        }
    }
    items
}

/// The altitude to send so that ArduPilot keeps `z`.
///
/// It multiplies by 100 in single precision and cuts to whole centimetres, so that an altitude it
/// has given out itself can come back a centimetre lower (`30.11` as `f32` does not). The next
/// number further from zero makes up for that.
pub(super) fn for_whole_centimetres(z: f32) -> f32 {
    let centimetres = (f64::from(z) * 100.0).round();
    let is_kept = |z: f32| f64::from((z * 100.0).trunc()) == centimetres;
    let is_whole =
        (f64::from(z) * 100.0 - centimetres).abs() <= centimetres.abs() * f64::from(f32::EPSILON);
    if !is_whole || is_kept(z) {
        return z;
    }
    let further = |z: f32| if z < 0.0 { z.next_down() } else { z.next_up() };
    let tried = [further(z), further(further(z))];
    tried.into_iter().find(|&z| is_kept(z)).unwrap_or(z)
}

/// How many items of its own an autopilot keeps before the first command.
fn home_slots(autopilot: Autopilot) -> i32 {
    i32::from(autopilot == Autopilot::ArduPilot)
}

/// The items numbered by their place, counted from `offset` for ArduPilot's slot, their jump
/// targets moved along.
fn renumbered(items: &[MissionItem], offset: i32) -> Vec<MissionItem> {
    let first = offset.max(0);
    items
        .iter()
        .zip(first..)
        .map(|(item, seq)| {
            let mut item = *item;
            // Lists are bounded far below 65536 where they are read.
            item.seq = u16::try_from(seq).unwrap_or(u16::MAX);
            if item.command == Command::DO_JUMP {
                item.params[0] = moved(item.params[0], offset);
            }
            item
        })
        .collect()
}

/// A jump target moved by `offset`, where it is a number of an item at all.
fn moved(target: f32, offset: i32) -> f32 {
    if target.fract() == 0.0 && target.abs() <= f32::from(u16::MAX) {
        target + offset as f32
    } else {
        target
    }
}

fn home_of(slot: &MissionItem) -> Option<Home> {
    if slot.x == 0 && slot.y == 0 {
        return None;
    }
    Some(Home { position: slot.position().ok()?, altitude_amsl: slot.z })
}

fn slot_of(home: Option<Home>) -> MissionItem {
    let e7 = home.map_or(LatLonE7 { lat: 0, lon: 0 }, |home| home.position.to_e7());
    MissionItem {
        seq: 0,
        frame: Frame::GLOBAL,
        command: Command::NAV_WAYPOINT,
        current: 0,
        autocontinue: 1,
        params: [0.0; 4],
        x: e7.lat,
        y: e7.lon,
        z: home.map_or(0.0, |home| home.altitude_amsl),
    }
}

/// The frame under which MISSION_ITEM_INT was specified to carry degrees times 1e7.
fn int_twin(frame: Frame) -> Frame {
    match frame {
        Frame::GLOBAL => Frame::GLOBAL_INT,
        Frame::GLOBAL_RELATIVE_ALT => Frame::GLOBAL_RELATIVE_ALT_INT,
        Frame::GLOBAL_TERRAIN_ALT => Frame::GLOBAL_TERRAIN_ALT_INT,
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_altitude_that_ardupilot_gives_out_is_kept_when_it_is_sent_back() {
        let mut nudged = 0;
        for centimetres in -1_000_000_i32..=1_000_000 {
            for given_out in [centimetres as f32 * 0.01, centimetres as f32 / 100.0] {
                let sent = for_whole_centimetres(given_out);
                assert_eq!((sent * 100.0) as i32, centimetres, "{given_out} sent as {sent}");
                nudged += u32::from(sent != given_out);
            }
        }
        assert!(nudged > 0, "there would be no need for this");
        for not_whole in [30.123, f32::NAN, f32::INFINITY, 0.0] {
            assert_eq!(for_whole_centimetres(not_whole).to_bits(), f32::to_bits(not_whole));
        }
    }
}
