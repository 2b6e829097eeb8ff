//! What the items of a mission say one by one: where they are, how wide they circle, and whether
//! they are known. How they follow each other is [`super::itinerary`]'s.

use super::commands::{Destination, LoiterHabit, Role, loiter_radius};
use super::item::{Frame, MissionItem};
use super::legs::{LegError, LegWarning};
use crate::geodesy::LatLon;
use crate::units::Metres;

/// The places of the items; the items whose place matters to the path must have a valid one.
pub(super) fn places(items: &[MissionItem]) -> Result<Vec<Option<LatLon>>, LegError> {
    items.iter().enumerate().map(place).collect()
}

pub(super) fn place((index, item): (usize, &MissionItem)) -> Result<Option<LatLon>, LegError> {
    let here = item.x == 0 && item.y == 0;
    match item.command.role() {
        Role::SetHome if item.params[0] == 1.0 => return Ok(None),
        Role::Place(_) | Role::SetHome => {}
        _ => return Ok(None),
    }
    // Zero is "here" where it is latitude and longitude or nothing; elsewhere it is a place.
    if here && (item.frame.is_global() || item.frame == Frame::MISSION) {
        return Ok(None);
    }
    if !item.frame.is_global() {
        return Err(LegError::Frame { item: index, frame: item.frame });
    }
    item.position().map(Some).map_err(|source| LegError::Position { item: index, source })
}

/// The loiter radii of the items, zero where there is none, and which had to be guessed.
pub(super) fn radii(
    items: &[MissionItem],
    habit: LoiterHabit,
) -> Result<(Vec<Metres>, Vec<LegWarning>), LegError> {
    let mut warnings = Vec::new();
    let radius = |(index, item): (usize, &MissionItem)| {
        if item.command.role() != Role::Place(Destination::Loiter) {
            return Ok(Metres::ZERO);
        }
        let radius = loiter_radius(item, habit).unwrap_or_else(|| {
            warnings.push(LegWarning::LoiterRadius { item: index });
            Metres::ZERO
        });
        if radius.0.is_finite() { Ok(radius) } else { Err(LegError::Radius { item: index }) }
    };
    let radii = items.iter().enumerate().map(radius).collect::<Result<_, _>>()?;
    Ok((radii, warnings))
}

pub(super) fn warning((index, item): (usize, &MissionItem)) -> Option<LegWarning> {
    match item.command.role() {
        Role::Place(Destination::Unknown) => {
            Some(LegWarning::UnknownNavigation { item: index, command: item.command })
        }
        Role::Unknown => Some(LegWarning::UnknownCommand { item: index, command: item.command }),
        Role::Entry => Some(LegWarning::EnteredFromAnywhere { item: index }),
        _ => None,
    }
}
