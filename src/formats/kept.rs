//! What a file holds besides the scenario, kept so that it can be written back: the complex items
//! and unknown keys of a `.plan`, the properties of GeoJSON features and KML placemarks.
//!
//! Nothing here is planned with or judged. What belongs to a mission item is found again in the
//! planned mission by [`aligned`], which knows that planning only inserts.

use std::collections::BTreeMap;

use serde_json::{Map, Value};

use super::item::in_degrees;
use super::plan::KeptPlan;
use crate::mission::{Command, MissionItem};

/// The properties of a feature, or the keys of an object.
pub(super) type Properties = Map<String, Value>;

/// What a file holds besides the scenario.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Kept {
    /// Of a `.plan`.
    pub(super) plan: Option<KeptPlan>,
    /// The mission items as they were read, each with its properties.
    pub(super) items: Vec<(MissionItem, Properties)>,
    /// The rally points likewise.
    pub(super) rally: Vec<(MissionItem, Properties)>,
    /// By the region's origin.
    pub(super) regions: BTreeMap<String, Properties>,
    /// Of home, of the fence's return point, and of the route where that is one line.
    pub(super) home: Properties,
    pub(super) return_point: Properties,
    pub(super) route: Properties,
}

impl Kept {
    /// Takes in what a further file holds about its fences.
    pub fn add_fences_of(&mut self, other: Self) {
        self.regions.extend(other.regions);
        if self.return_point.is_empty() {
            self.return_point = other.return_point;
        }
    }

    /// For each item of `now`, the properties that it had in the file.
    pub(super) fn item_properties(&self, now: &[MissionItem]) -> Vec<Option<&Properties>> {
        by_item(&self.items, now)
    }

    /// For each rally point of `now`, the properties that it had in the file.
    pub(super) fn rally_properties(&self, now: &[MissionItem]) -> Vec<Option<&Properties>> {
        by_item(&self.rally, now)
    }
}

fn by_item<'a>(
    kept: &'a [(MissionItem, Properties)],
    now: &[MissionItem],
) -> Vec<Option<&'a Properties>> {
    let mut found = vec![None; now.len()];
    let original: Vec<MissionItem> = kept.iter().map(|(item, _)| *item).collect();
    for (index, (_, properties)) in aligned(&original, now).into_iter().zip(kept) {
        if let Some(slot) = index.and_then(|index| found.get_mut(index)) {
            *slot = Some(properties);
        }
    }
    found
}

/// An item is looked for among so many that follow the one before: more than any leg is given.
const REACH: usize = 1024;

/// For each item of `original`, in order, where the same item is in `now`; `None` where it was
/// changed or taken out. Sequence numbers, `current` and the targets of jumps do not count, as
/// they move when items are inserted.
pub(super) fn aligned(original: &[MissionItem], now: &[MissionItem]) -> Vec<Option<usize>> {
    let mut next = 0;
    let mut found = Vec::with_capacity(original.len());
    for item in original {
        let rest = now.get(next..).unwrap_or_default();
        let at = rest.iter().take(REACH).position(|other| is_same(item, other));
        found.push(at.map(|at| next + at));
        next += at.map_or(0, |at| at + 1);
    }
    found
}

fn is_same(one: &MissionItem, other: &MissionItem) -> bool {
    let what = |item: &MissionItem| {
        let mut params = item.params.map(f32::to_bits);
        if item.command == Command::DO_JUMP {
            params[0] = 0;
        }
        let place = (in_degrees(item.frame), item.x, item.y, item.z.to_bits());
        (item.command, params, place, item.autocontinue != 0)
    };
    what(one) == what(other)
}

/// `ours` with the keys of `kept` that it does not have.
pub(super) fn with_kept(ours: &mut Properties, kept: &Properties) {
    for (key, value) in kept {
        if !ours.contains_key(key) {
            ours.insert(key.clone(), value.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mission::Frame;

    fn item(seq: u16, x: i32) -> MissionItem {
        MissionItem {
            seq,
            frame: Frame::GLOBAL_RELATIVE_ALT,
            command: Command::NAV_WAYPOINT,
            current: 0,
            autocontinue: 1,
            params: [0.0, 0.0, 0.0, f32::NAN],
            x,
            y: 80_000_000,
            z: 30.0,
        }
    }

    #[test]
    fn items_are_found_behind_inserted_ones_and_missed_where_they_changed() {
        let original = [item(0, 1), item(1, 2), item(2, 3), item(3, 4)];
        let now = [item(0, 1), item(1, 10), item(2, 11), item(3, 2), item(4, 4)];
        assert_eq!(aligned(&original, &now), [Some(0), Some(3), None, Some(4)]);
        assert_eq!(aligned(&original, &[]), [None; 4]);
    }

    #[test]
    fn an_item_that_came_from_a_vehicle_is_the_same_item() {
        let read_back =
            MissionItem { frame: Frame::GLOBAL_RELATIVE_ALT_INT, current: 1, ..item(7, 1) };
        assert_eq!(aligned(&[item(0, 1)], &[read_back]), [Some(0)]);
    }
}
