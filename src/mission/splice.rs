//! Puts the waypoints of re-planned legs into a mission and leaves everything else as it was.
//!
//! Where they go is the rule of `insertion` and comes with each leg; how high they are is
//! [`AltitudeProfile`]'s. A waypoint inserted before a returning item makes the way home explicit
//! up to a last straight stretch. Every other item is kept bit for bit but for its sequence number
//! and the sequence numbers that it holds: a `DO_JUMP` goes to the same item as before, not to the
//! waypoints inserted before that item. Unless these are for the leg that it flies itself: see
//! [`JumpInsertion`].
//!
//! The result is not judged here. Its legs are found by [`super::legs()`] as those of any mission.

use std::collections::BTreeMap;
use std::fmt;

use geo::{Distance, Geodesic, Point};

use super::Mission;
use super::altitude::{AltitudeError, AltitudeProfile};
use super::commands::Role;
use super::item::{Command, Frame, MissionItem};
use super::jumps::index_in;
use super::legs::{JumpInsertion, Leg, LegEnd, LegName, number};
use crate::geodesy::{LatLon, LatLonE7, PositionError};

/// The most items a mission can have: `MISSION_COUNT` carries a `u16`.
pub const ITEM_LIMIT: usize = u16::MAX as usize;

/// Waypoints to fly instead of straight along a leg.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Detour {
    /// Index of the leg.
    pub leg: usize,
    /// The waypoints between its ends, in the order in which they are flown.
    pub waypoints: Vec<LatLonE7>,
}

/// A mission with inserted waypoints.
#[derive(Debug, Clone, PartialEq)]
pub struct Spliced {
    /// The mission.
    pub mission: Mission,
    /// The indices in it of the inserted waypoints, rising.
    pub inserted: Vec<usize>,
    /// The index in it of each item of the original.
    pub new_index_of_old: Vec<usize>,
    /// What now happens differently besides the path, in the order of the items.
    pub notes: Vec<SpliceNote>,
}

/// An item of the original that does not do quite the same any more. Indices are of the original.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpliceNote {
    /// A condition that counts on the stretch to the first inserted waypoint only: what it holds
    /// back is dropped if that waypoint is reached before the condition is met.
    Condition {
        /// The item.
        item: usize,
        /// Its command.
        command: Command,
    },
    /// A jump that now goes to new waypoints, and past them another that is always taken.
    ByJump {
        /// The jump.
        jump: usize,
        /// The item that it went to.
        target: usize,
    },
    /// An action behind a jump target: it now runs at the last inserted waypoint.
    Later {
        /// The item.
        item: usize,
        /// Its command.
        command: Command,
    },
}

impl fmt::Display for SpliceNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Condition { item, command } => write!(
                f,
                "mission item {}: condition {} now counts up to the first inserted waypoint only",
                number(item),
                command.0
            ),
            Self::ByJump { jump, target } => write!(
                f,
                "mission item {}: the jump now goes over new waypoints before item {}; a jump that is \
                 always taken leads all else past them",
                number(jump),
                number(target)
            ),
            Self::Later { item, command } => write!(
                f,
                "mission item {}: command {} follows a jump target and now runs at the last \
                 inserted waypoint",
                number(item),
                command.0
            ),
        }
    }
}

/// Why waypoints cannot be put into a mission.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SpliceError {
    /// A detour for a leg that there is not.
    #[error("there is no leg {leg}; the detour was made for another mission")]
    NoSuchLeg {
        /// The leg of the detour.
        leg: usize,
    },
    /// A detour for a leg that can only be judged: one to a takeoff, along a curve, or through
    /// several jumps.
    #[error("the {0} cannot be re-planned, because no waypoint can be put into it alone")]
    Fixed(LegName),
    /// Two detours for legs that are flown through the same waypoints.
    #[error(
        "two legs would need different waypoints before item {}; re-plan only one of them",
        number(*item)
    )]
    SharedWaypoints {
        /// The item that both sets of waypoints would be inserted before.
        item: usize,
    },
    /// A waypoint that is not on the globe.
    #[error("a waypoint of the {leg} is no position: {source}")]
    Waypoint {
        /// The leg.
        leg: LegName,
        /// What is wrong with it.
        source: PositionError,
    },
    /// The altitude of the waypoints is not known.
    #[error("the {leg} cannot be re-planned: {source}")]
    Altitude {
        /// The leg.
        leg: LegName,
        /// What is missing.
        source: AltitudeError,
    },
    /// More items than the mission protocol can count.
    #[error("the mission would have {items} items, more than the {ITEM_LIMIT} that MAVLink counts")]
    TooManyItems {
        /// How many there would be.
        items: usize,
    },
    /// An item whose sequence number is not its index.
    #[error("mission item {} has sequence number {seq} instead of {item}", number(*item))]
    Sequence {
        /// The item.
        item: usize,
        /// Its sequence number.
        seq: u16,
    },
    /// A jump to an item that there is not.
    #[error("mission item {}: jumps to an item that there is not", number(*item))]
    JumpTarget {
        /// The jump.
        item: usize,
    },
}

/// Puts the waypoints of detours into a mission. `legs` are those of this mission.
///
/// # Errors
/// [`SpliceError`], in which case there is no new mission at all.
pub fn splice(mission: &Mission, legs: &[Leg], detours: &[Detour]) -> Result<Spliced, SpliceError> {
    let items = mission.items.as_slice();
    let out_of_sequence =
        items.iter().enumerate().find(|(index, item)| usize::from(item.seq) != *index);
    if let Some((item, &MissionItem { seq, .. })) = out_of_sequence {
        return Err(SpliceError::Sequence { item, seq });
    }
    let insertions = insertions(mission, legs, detours)?;
    let total = items.len() + insertions.values().map(Insertion::len).sum::<usize>();
    if total > ITEM_LIMIT {
        return Err(SpliceError::TooManyItems { items: total });
    }

    let mut spliced = Vec::with_capacity(total);
    let mut inserted = Vec::with_capacity(total - items.len());
    let mut new_index_of_old = Vec::with_capacity(items.len());
    // Jumps that do not go to the item that they went to: by their old index.
    let mut retargeted = Vec::new();
    // Jumps that lead past waypoints: their own index, and the old one of their target.
    let mut past = Vec::new();
    for (index, item) in items.iter().enumerate() {
        if let Some(Insertion { through, by_jump }) = insertions.get(&index) {
            inserted.extend(spliced.len()..spliced.len() + through.len());
            spliced.extend(through);
            if let Some((by, waypoints)) = by_jump {
                past.push((spliced.len(), index));
                spliced.push(always_jump(by.always));
                retargeted.push((by.jump, spliced.len()));
                inserted.extend(spliced.len()..spliced.len() + waypoints.len());
                spliced.extend(waypoints);
            }
        }
        new_index_of_old.push(spliced.len());
        spliced.push(*item);
    }
    for (index, item) in spliced.iter_mut().enumerate() {
        // Within ITEM_LIMIT, checked above.
        item.seq = index as u16;
    }
    for (index, item) in items.iter().enumerate() {
        if let Some((parameter, target)) = held_index(index, item, items.len())? {
            let new = new_index_of_old.get(target).copied().unwrap_or(total);
            // Below 2^16: exact as a float.
            spliced[new_index_of_old[index]].params[parameter] = new as f32;
        }
    }
    for (jump, waypoint) in retargeted {
        spliced[new_index_of_old[jump]].params[0] = waypoint as f32;
    }
    for (jump, target) in past {
        spliced[jump].params[0] = new_index_of_old[target] as f32;
    }
    let notes = insertions.iter().flat_map(|(&before, insertion)| insertion.notes(items, before));
    let notes = notes.collect();
    let mission = Mission { home: mission.home, items: spliced };
    Ok(Spliced { mission, inserted, new_index_of_old, notes })
}

/// A jump that is always taken, its target still to be set.
fn always_jump(always: f32) -> MissionItem {
    MissionItem {
        seq: 0,
        frame: Frame::MISSION,
        command: Command::DO_JUMP,
        current: 0,
        autocontinue: 1,
        params: [0.0, always, 0.0, 0.0],
        x: 0,
        y: 0,
        z: 0.0,
    }
}

/// What is put before one item.
#[derive(Debug, Default)]
struct Insertion {
    /// Waypoints on the way that falls through.
    through: Vec<MissionItem>,
    /// Waypoints that only a jump flies, after those.
    by_jump: Option<(JumpInsertion, Vec<MissionItem>)>,
}

impl Insertion {
    /// How many items it is.
    fn len(&self) -> usize {
        let by_jump = self.by_jump.as_ref().map_or(0, |(_, waypoints)| waypoints.len() + 1);
        self.through.len() + by_jump
    }

    fn notes(&self, items: &[MissionItem], before: usize) -> Vec<SpliceNote> {
        let through = (!self.through.is_empty()).then_some(before);
        let by_jump = self.by_jump.as_ref().map(|(by, _)| by.jump);
        let later = actions_behind(items, before);
        // What holds back actions stands between the start of the stretch and its waypoints: before
        // the end of it, or before the jump.
        let conditions = through.into_iter().chain(by_jump);
        let mut notes: Vec<_> = conditions.flat_map(|end| conditions_before(items, end)).collect();
        notes.extend(by_jump.map(|jump| SpliceNote::ByJump { jump, target: before }));
        notes.extend(later);
        notes
    }
}

/// Which parameter of an item holds the index of an item, and that index; the number of items
/// stands for the end of the mission.
fn held_index(
    index: usize,
    item: &MissionItem,
    items: usize,
) -> Result<Option<(usize, usize)>, SpliceError> {
    /// `MAV_ROI_WPINDEX`: look at the item whose index is in `param2`.
    const ROI_AT_ITEM: f32 = 2.0;
    match item.command {
        Command::DO_JUMP => index_in(item.params[0], items)
            .map(|target| Some((0, target)))
            .ok_or(SpliceError::JumpTarget { item: index }),
        Command::NAV_ROI | Command::DO_SET_ROI if item.params[0] == ROI_AT_ITEM => {
            Ok(index_in(item.params[1], items).map(|target| (1, target)))
        }
        _ => Ok(None),
    }
}

/// The waypoints to insert, by the item they are inserted before.
fn insertions(
    mission: &Mission,
    legs: &[Leg],
    detours: &[Detour],
) -> Result<BTreeMap<usize, Insertion>, SpliceError> {
    let moves_home = mission.items.iter().any(|item| item.command.role() == Role::SetHome);
    let home = mission.home.filter(|_| !moves_home).map(|home| home.altitude_amsl);
    let mut insertions: BTreeMap<usize, Insertion> = BTreeMap::new();
    for detour in detours.iter().filter(|detour| !detour.waypoints.is_empty()) {
        let leg = *legs.get(detour.leg).ok_or(SpliceError::NoSuchLeg { leg: detour.leg })?;
        let before = match (leg.insert_before, leg.by_jump) {
            (Some(before), _) => before,
            (None, Some(by)) => by.target,
            (None, None) => return Err(SpliceError::Fixed(leg.name())),
        };
        let end = mission.items.get(before).ok_or(SpliceError::NoSuchLeg { leg: detour.leg })?;
        let waypoints = waypoints(&leg, end, &detour.waypoints, home)?;
        let insertion = insertions.entry(before).or_default();
        match (leg.insert_before, leg.by_jump) {
            (None, Some(by)) if insertion.by_jump.is_none() => {
                insertion.by_jump = Some((by, waypoints));
            }
            (Some(_), _) if insertion.through.is_empty() => insertion.through = waypoints,
            _ => return Err(SpliceError::SharedWaypoints { item: before }),
        }
    }
    Ok(insertions)
}

/// The items that fly along a detour.
///
/// A plain waypoint has no hold time and the vehicle's own acceptance radius. Its heading is that
/// of the leg's end, where that is a waypoint, because the vehicle flies a leg with the heading of
/// its end; else NaN, which PX4 reads as its usual heading. ArduPilot takes NaN there
/// (`AP_Mission::sanity_check_params`) and has no heading in a waypoint.
fn waypoints(
    leg: &Leg,
    before: &MissionItem,
    detour: &[LatLonE7],
    home: Option<f32>,
) -> Result<Vec<MissionItem>, SpliceError> {
    let profile = AltitudeProfile::between(leg.from.altitude, leg.to.altitude, home)
        .map_err(|source| SpliceError::Altitude { leg: leg.name(), source })?;
    let places = detour
        .iter()
        .map(|place| place.to_degrees())
        .collect::<Result<Vec<LatLon>, _>>()
        .map_err(|source| SpliceError::Waypoint { leg: leg.name(), source })?;
    let heading = match before.command {
        Command::NAV_WAYPOINT => before.params[3],
        _ => f32::NAN,
    };
    let item = |(place, fraction): (&LatLonE7, f64)| {
        let altitude = profile.at(fraction);
        MissionItem {
            seq: 0,
            frame: altitude.frame,
            command: Command::NAV_WAYPOINT,
            current: 0,
            autocontinue: 1,
            params: [0.0, 0.0, 0.0, heading],
            x: place.lat,
            y: place.lon,
            z: altitude.metres,
        }
    };
    Ok(detour.iter().zip(fractions(&leg.from, &places, &leg.to)).map(item).collect())
}

/// The fraction of the whole distance at which each place is passed.
fn fractions(from: &LegEnd, places: &[LatLon], to: &LegEnd) -> Vec<f64> {
    let point = |position: LatLon| Point::new(position.lon(), position.lat());
    let ends = places.iter().copied().chain([to.position]);
    let passed: Vec<f64> = ends
        .scan((point(from.position), 0.0), |(last, distance), position| {
            *distance += Geodesic.distance(*last, point(position));
            *last = point(position);
            Some(*distance)
        })
        .collect();
    let total = passed.last().copied().unwrap_or(0.0);
    let fraction = |distance: f64| if total > 0.0 { distance / total } else { 0.0 };
    passed.into_iter().take(places.len()).map(fraction).collect()
}

/// The conditions of a stretch that ends at an item: those back to the last item of navigation.
fn conditions_before(items: &[MissionItem], end: usize) -> Vec<SpliceNote> {
    let role = |index: &usize| items[*index].command.role();
    let first = (0..end).rev().find(|i| role(i).is_navigation()).map_or(0, |i| i + 1);
    (first..end)
        .filter(|index| role(index) == Role::Condition)
        .map(|item| SpliceNote::Condition { item, command: items[item].command })
        .collect()
}

/// The actions behind an insertion, up to the next item of navigation.
fn actions_behind(items: &[MissionItem], before: usize) -> Vec<SpliceNote> {
    let role = |index: &usize| items[*index].command.role();
    let held = |index: &usize| items[*index].command == Command::CONDITION_DISTANCE;
    (before..items.len())
        .take_while(|index| !role(index).is_navigation() && !held(index))
        .filter(|index| matches!(role(index), Role::Action | Role::Condition | Role::SetHome))
        .map(|item| SpliceNote::Later { item, command: items[item].command })
        .collect()
}

#[cfg(test)]
mod tests;
