//! Where in the item list waypoints for a stretch may be inserted, so that nothing else in the
//! mission changes.
//!
//! Between the item of navigation that a stretch starts from and the one that ends it there may be
//! other items. They run when the first is reached, while the vehicle is on its way to the next
//! place, and stay with it: waypoints go after them. Except:
//!
//! - after a jump, always: the way that the jump takes must not fly the waypoints;
//! - before anything that is jumped to or entered from elsewhere (a jump target, a tag, the start
//!   of a landing sequence): who comes in there goes straight to the next place as before. Actions
//!   behind such an item then run at the last inserted waypoint instead;
//! - before a `CONDITION_DISTANCE`: it waits for the next place to be near, which is to be the end
//!   of the stretch, not the first inserted waypoint.

use super::commands::Role;
use super::item::{Command, MissionItem};
use super::jumps::Jumps;

/// The item to insert before, for the stretch that falls through from the navigation item before
/// `first` to the one at `end`; `None` where a jump in between comes after something that is
/// itself jumped to.
pub(super) fn insertion_point(
    items: &[MissionItem],
    jumps: &Jumps,
    first: usize,
    end: usize,
) -> Option<usize> {
    let between = items.get(first..end)?;
    let role = |item: &MissionItem| item.command.role();
    let after_jumps = between
        .iter()
        .rposition(|item| role(item).is_jump())
        .map_or(first, |last| first + last + 1);
    let entered = |index: &usize| {
        jumps.is_target(*index)
            || items.get(*index).is_some_and(|item| matches!(role(item), Role::Tag | Role::Entry))
    };
    let before_entries = (first..end).find(entered).unwrap_or(end);
    if after_jumps > before_entries {
        return None;
    }
    let distance = (after_jumps..before_entries)
        .find(|&index| items.get(index).is_some_and(|i| i.command == Command::CONDITION_DISTANCE));
    Some(distance.unwrap_or(before_entries))
}
