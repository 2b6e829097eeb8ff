//! The rest of a mission that is being flown, as a mission of its own, and the whole again.

use super::item::Command;
use super::{Mission, MissionItem};

/// Why the rest of a mission cannot be taken for a mission of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RemainingError {
    /// There is no such item.
    #[error("the vehicle flies to item {item}, and its mission has {items}")]
    NoSuchItem {
        /// The current item, from 1.
        item: usize,
        /// How many there are.
        items: usize,
    },
    /// The vehicle may come back to what it has flown.
    #[error("item {item} of the mission jumps back to what has been flown")]
    JumpsBack {
        /// The jump, from 1.
        item: usize,
    },
    /// An item that names another by its number.
    #[error("item {item} of the mission points the camera at an item by its number")]
    Numbered {
        /// The item, from 1.
        item: usize,
    },
}

/// `MAV_ROI_WPINDEX`: look at the item whose index is in `param2`.
const ROI_AT_ITEM: f32 = 2.0;

/// The items from `current` on (an index), numbered from 0.
///
/// # Errors
/// [`RemainingError`] where the rest is not complete without what was before it.
pub fn remaining(mission: &Mission, current: usize) -> Result<Mission, RemainingError> {
    let items = mission.items.len();
    let rest = mission.items.get(current..).filter(|rest| !rest.is_empty());
    let rest = rest.ok_or(RemainingError::NoSuchItem { item: current + 1, items })?;
    let moved = |(index, item): (usize, &MissionItem)| {
        let number = current + index + 1;
        let mut params = item.params;
        match item.command {
            Command::DO_JUMP if params[0] < current as f32 => {
                return Err(RemainingError::JumpsBack { item: number });
            }
            Command::DO_JUMP => params[0] -= current as f32,
            Command::NAV_ROI | Command::DO_SET_ROI if params[0] == ROI_AT_ITEM => {
                return Err(RemainingError::Numbered { item: number });
            }
            _ => {}
        }
        Ok(MissionItem { seq: item.seq - current as u16, params, ..*item })
    };
    let items = rest.iter().enumerate().map(moved).collect::<Result<_, _>>()?;
    Ok(Mission { home: mission.home, items })
}

/// The mission up to `current`, followed by a rest that [`remaining`] began with and that may
/// have grown since.
#[must_use]
pub fn rejoined(mission: &Mission, current: usize, rest: &Mission) -> Mission {
    let flown = mission.items.iter().take(current).copied();
    let moved = |item: &MissionItem| {
        let mut item = *item;
        item.seq = item.seq.saturating_add(current as u16);
        if item.command == Command::DO_JUMP {
            item.params[0] += current as f32;
        }
        item
    };
    let items = flown.chain(rest.items.iter().map(moved)).collect();
    Mission { home: mission.home, items }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mission::Frame;

    fn item(seq: u16, command: Command, param1: f32) -> MissionItem {
        MissionItem {
            seq,
            frame: Frame::GLOBAL_RELATIVE_ALT,
            command,
            current: 0,
            autocontinue: 1,
            params: [param1, 0.0, 0.0, 0.0],
            x: 10 + i32::from(seq),
            y: 20,
            z: 30.0,
        }
    }

    fn mission(jump_to: f32) -> Mission {
        let way = |seq| item(seq, Command::NAV_WAYPOINT, 0.0);
        let items = vec![way(0), way(1), way(2), item(3, Command::DO_JUMP, jump_to), way(4)];
        Mission { home: None, items }
    }

    #[test]
    fn the_rest_and_what_was_before_it_make_the_whole_again() {
        for current in 0..=2 {
            let rest = remaining(&mission(2.0), current).unwrap();
            assert_eq!(rest.items.len(), 5 - current);
            assert_eq!(rest.items[3 - current].params[0], 2.0 - current as f32);
            assert!(rest.items.iter().enumerate().all(|(k, item)| usize::from(item.seq) == k));
            assert_eq!(rejoined(&mission(2.0), current, &rest), mission(2.0));
        }
    }

    #[test]
    fn a_rest_that_comes_back_to_what_was_flown_is_refused() {
        let back = remaining(&mission(1.0), 2);
        assert_eq!(back, Err(RemainingError::JumpsBack { item: 4 }));
        let none = remaining(&mission(1.0), 5);
        assert_eq!(none, Err(RemainingError::NoSuchItem { item: 6, items: 5 }));
        let mut looks = mission(2.0);
        looks.items[4] = item(4, Command::DO_SET_ROI, ROI_AT_ITEM);
        assert_eq!(remaining(&looks, 2), Err(RemainingError::Numbered { item: 5 }));
    }
}
