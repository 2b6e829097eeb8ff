//! Where jumps lead: `DO_JUMP` to an index, `DO_JUMP_TAG` to a `JUMP_TAG`.

use std::collections::HashMap;
use std::rc::Rc;

use super::commands::Role;
use super::item::MissionItem;
use super::legs::LegError;

/// The jumps of a mission, all of which lead somewhere.
#[derive(Debug, Clone, Default)]
pub(super) struct Jumps {
    /// Where each item jumps to; nowhere for most. Jumps to one tag share their list.
    destinations: Vec<Option<Rc<[usize]>>>,
    /// Whether some `DO_JUMP` names the item.
    targets: Vec<bool>,
}

impl Jumps {
    /// Finds the jumps. One that is to be repeated zero times goes nowhere, but its target still
    /// must exist. Where several items have the same tag, a jump may go to any of them.
    ///
    /// # Errors
    /// [`LegError`] for a jump to an item or tag that there is not.
    pub(super) fn of(items: &[MissionItem]) -> Result<Self, LegError> {
        let mut tags: HashMap<u32, Vec<usize>> = HashMap::new();
        for (index, item) in items.iter().enumerate() {
            if item.command.role() == Role::Tag {
                tags.entry(tag_key(item.params[0])).or_default().push(index);
            }
        }
        let tags: HashMap<u32, Rc<[usize]>> =
            tags.into_iter().map(|(tag, items)| (tag, items.into())).collect();
        let mut jumps =
            Self { destinations: vec![None; items.len()], targets: vec![false; items.len()] };
        for (index, item) in items.iter().enumerate() {
            let [named, repeat, ..] = item.params;
            let destinations = match item.command.role() {
                Role::Jump => {
                    let target = index_in(named, items.len()).ok_or(LegError::JumpTarget {
                        item: index,
                        target: named,
                        items: items.len(),
                    })?;
                    if let Some(mark) = jumps.targets.get_mut(target) {
                        *mark = true;
                    }
                    Rc::from([target])
                }
                Role::TagJump => tags
                    .get(&tag_key(named))
                    .cloned()
                    .ok_or(LegError::JumpTag { item: index, tag: named })?,
                _ => continue,
            };
            if repeat != 0.0 {
                jumps.destinations[index] = Some(destinations);
            }
        }
        Ok(jumps)
    }

    /// Where an item may jump to: items, or the end of the mission.
    pub(super) fn destinations(&self, item: usize) -> &[usize] {
        self.destinations.get(item).and_then(Option::as_deref).unwrap_or(&[])
    }

    /// Whether some `DO_JUMP` names the item. A tag is not a target: it shows that by itself.
    pub(super) fn is_target(&self, item: usize) -> bool {
        self.targets.get(item).copied().unwrap_or(false)
    }
}

/// Tags are whole numbers in a float; 0 and −0 are the same.
fn tag_key(tag: f32) -> u32 {
    (tag + 0.0).to_bits()
}

/// The index that a parameter holds, where it holds one: of an item or of the end of the mission.
pub(super) fn index_in(parameter: f32, items: usize) -> Option<usize> {
    // Whole and within u16, so that the cast is exact.
    (parameter.fract() == 0.0 && (0.0..=65_535.0).contains(&parameter))
        .then_some(parameter as usize)
        .filter(|&index| index <= items)
}
