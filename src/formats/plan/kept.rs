//! What a `.plan` holds besides the items that are flown: complex items (survey, corridor scan,
//! structure scan, landing pattern), altitude modes, keys that quavd does not know. Written back
//! with the items that they belong to, as long as these are untouched.

use serde_json::{Map, Value, json};

use super::complex::is_landing_pattern;
use crate::formats::kept::{Properties, aligned, with_kept};
use crate::mission::{Command, MissionItem};

/// The largest plan that is kept besides what is read from it: in memory a document is many times
/// as large as in the file.
const MAX_KEPT_BYTES: usize = 8 << 20;

/// The keys of an item that says its altitude in QGroundControl's own way.
const ALTITUDE_KEYS: [&str; 3] = ["AltitudeMode", "Altitude", "AMSLAltAboveTerrain"];

/// The document of a `.plan` without fence and rally points.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::formats) struct KeptPlan {
    document: Properties,
    mission: Properties,
    entries: Vec<Entry>,
}

/// An entry of the mission's list of items.
#[derive(Debug, Clone, PartialEq)]
struct Entry {
    object: Properties,
    /// What it stands for.
    items: Vec<MissionItem>,
}

/// An entry of the list to be written.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Written<'a> {
    /// One item, with the object that it was read from.
    Simple(usize, Option<&'a Properties>),
    /// A complex item that stands for so many items from an index on; a survey that nobody has
    /// drawn yet stands for none.
    Complex(usize, usize, &'a Properties),
}

impl KeptPlan {
    /// Takes in the text of a plan whose entries stand for so many of `items` each.
    pub(super) fn new(text: &str, counts: &[usize], items: &[MissionItem]) -> Option<Self> {
        if text.len() > MAX_KEPT_BYTES {
            return None;
        }
        let mut document: Properties = serde_json::from_str(text).ok()?;
        for key in ["geoFence", "rallyPoints"] {
            document.remove(key);
        }
        let Some(Value::Object(mut mission)) = document.remove("mission") else { return None };
        let Some(Value::Array(list)) = mission.remove("items") else { return None };
        let mut rest = items;
        let mut entries = Vec::with_capacity(list.len());
        for (entry, &count) in list.into_iter().zip(counts) {
            let (own, others) = rest.split_at_checked(count)?;
            let Value::Object(object) = entry else { return None };
            entries.push(Entry { object, items: own.to_vec() });
            rest = others;
        }
        Some(Self { document, mission, entries })
    }

    /// The document's keys besides its parts, and the mission's besides its items.
    pub(super) fn keys(&self) -> (&Properties, &Properties) {
        (&self.document, &self.mission)
    }

    /// How `now` is written: each item alone, or within the complex item that it came from.
    pub(super) fn entries(&self, now: &[MissionItem]) -> Vec<Written<'_>> {
        let mut simple = vec![None; now.len()];
        let mut complex = vec![None; now.len()];
        // Those that stand for nothing, with the index that they stand before.
        let mut empty = Vec::new();
        let mut next = 0;
        for (entry, found) in self.located(now) {
            if entry.items.is_empty() {
                empty.push((next, &entry.object));
            }
            let Some(first) = found else { continue };
            next = first + entry.items.len();
            if entry.is_complex() {
                if let Some(slot) = complex.get_mut(first) {
                    *slot = Some(entry);
                }
            } else if let Some(slot) = simple.get_mut(first) {
                *slot = Some(&entry.object);
            }
        }
        let mut empty = empty.into_iter().peekable();
        let mut written = Vec::new();
        let mut index = 0;
        loop {
            while let Some((_, object)) = empty.next_if(|(before, _)| *before <= index) {
                written.push(Written::Complex(index, 0, object));
            }
            if index >= now.len() {
                return written;
            }
            if let Some(entry) = complex[index] {
                written.push(Written::Complex(index, entry.items.len(), &entry.object));
                index += entry.items.len();
            } else {
                written.push(Written::Simple(index, simple[index]));
                index += 1;
            }
        }
    }

    /// The complex items that `now` does not hold as they were: their place in the list, from 1,
    /// and their type.
    pub(super) fn flattened(&self, now: &[MissionItem]) -> Vec<(usize, String)> {
        let located = self.located(now).enumerate();
        let lost = located.filter(|(_, (entry, found))| {
            entry.is_complex() && !entry.items.is_empty() && found.is_none()
        });
        lost.map(|(index, (entry, _))| (index + 1, entry.kind())).collect()
    }

    /// Each entry that stands for something, with the index of its first item in `now` where all
    /// its items follow each other there.
    fn located(&self, now: &[MissionItem]) -> impl Iterator<Item = (&Entry, Option<usize>)> {
        let all: Vec<MissionItem> = self.entries.iter().flat_map(|e| &e.items).copied().collect();
        let places = aligned(&all, now);
        let mut begin = 0;
        self.entries.iter().map(move |entry| {
            let own = places.get(begin..begin + entry.items.len()).unwrap_or_default();
            begin += entry.items.len();
            let first = own.first().copied().flatten();
            let follow = first.is_some_and(|first| {
                own.iter().enumerate().all(|(k, place)| *place == Some(first + k))
            });
            // The target of a jump inside would have to be found within QGroundControl's item.
            let jumps = entry.items.iter().any(|item| item.command == Command::DO_JUMP);
            (entry, first.filter(|_| follow && !(entry.is_complex() && jumps)))
        })
    }
}

impl Entry {
    fn is_complex(&self) -> bool {
        self.object.get("type").and_then(Value::as_str) == Some("ComplexItem")
    }

    fn kind(&self) -> String {
        let kind = self.object.get("complexItemType").and_then(Value::as_str);
        kind.unwrap_or("complex").to_owned()
    }
}

/// The complex item with its items numbered from `first` (an index) on.
pub(super) fn renumbered(object: &Properties, first: usize) -> Value {
    let mut object = object.clone();
    let kind = object.get("complexItemType").and_then(Value::as_str).unwrap_or("");
    if !is_landing_pattern(kind)
        && let Some(Value::Object(transect)) = object.get_mut("TransectStyleComplexItem")
        && let Some(Value::Array(items)) = transect.get_mut("Items")
    {
        for (k, item) in items.iter_mut().enumerate() {
            if let Value::Object(item) = item {
                item.insert("doJumpId".to_owned(), json!(first + k + 1));
            }
        }
    }
    Value::Object(object)
}

/// A simple item as it is written, with what its object held besides.
pub(super) fn with_object(item: &mut Map<String, Value>, object: &Properties) {
    // Params 5 to 7 of old items, which stand in `params` now.
    let known = |key: &&String| key.as_str() != "coordinate";
    let same_mode = object.get("AltitudeMode") == item.get("AltitudeMode");
    for key in ALTITUDE_KEYS.iter().filter(|_| !same_mode) {
        if let Some(value) = object.get(*key) {
            item.insert((*key).to_owned(), value.clone());
        }
    }
    let rest: Properties = object
        .iter()
        .filter(|(key, _)| known(key))
        .map(|(key, value)| (key.clone(), value.clone()))
        .collect();
    with_kept(item, &rest);
}
