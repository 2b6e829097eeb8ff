//! Fence plan items (`MAV_CMD_NAV_FENCE_*`, 5000 to 5004) to and from a [`FenceSet`].
//!
//! The same items travel over MAVLink and stand in `QGC WPL 110` files, so both read them here.
//! Whatever cannot be used is an error that names the item: a fence that is dropped silently is
//! a fence that is flown through. Repeated vertices and either winding are fine.
//! (MAVLink mission service, "Geofence"; MAV_CMD 5000-5004.)

use crate::fence::{FenceRegion, FenceRole, FenceSet, FenceShape};
use crate::geodesy::{LatLon, PositionError};
use crate::mission::{Command, Frame, MissionItem};
use crate::units::Metres;

/// The largest radius of a fence circle, metres: a fifth of the way round the Earth.
pub const MAX_RADIUS: f64 = 8_000_000.0;

/// A fence read from items, and what its reader should be told.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DecodedFence {
    /// The regions, in the order of the items, and the return point.
    pub fences: FenceSet,
    /// What was read differently from how it may have been meant, a sentence each.
    pub warnings: Vec<String>,
}

/// Why a list of fence items is no fence.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("fence item {index}: {problem}")]
pub struct FenceItemError {
    /// Index of the item in the fence plan, from 0.
    pub index: usize,
    /// What is wrong with it.
    pub problem: FenceItemProblem,
}

/// What is wrong with a fence item.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FenceItemProblem {
    /// A command that does not belong into a fence plan.
    #[error(
        "command {} is not a fence command (5000 to 5004); remove the item, or read the file as a \
         mission",
        .0.0
    )]
    NotAFenceCommand(Command),
    /// A frame in which x and y are not latitude and longitude.
    #[error("frame {} is not a global frame; give the item frame 0 (latitude and longitude)", .0.0)]
    Frame(Frame),
    /// A vertex count that is not a whole number from 3 up.
    #[error(
        "vertex count {0} in param1 is not a whole number of at least 3; draw the polygon again"
    )]
    Count(f32),
    /// Fewer items left than the polygon needs.
    #[error(
        "a polygon of {count} vertices begins here but only {left} items are left; the fence is \
         incomplete, read it or upload it again"
    )]
    Truncated {
        /// Vertices announced.
        count: usize,
        /// Items there are.
        left: usize,
    },
    /// A vertex of another kind or count inside a polygon.
    #[error(
        "command {} with count {count} inside the polygon that begins at item {first} with command \
         {} and count {expected}; draw the polygon again",
        .command.0, .wanted.0
    )]
    ForeignVertex {
        /// The item at which the polygon begins.
        first: usize,
        /// The command found.
        command: Command,
        /// The count found.
        count: f32,
        /// The command of the polygon.
        wanted: Command,
        /// The count of the polygon.
        expected: f32,
    },
    /// A position off the globe.
    #[error("{0}; correct the vertex or centre")]
    Position(#[from] PositionError),
    /// A radius that is not a positive finite number.
    #[error("radius {0} m is not a positive, finite length of at most 8000 km; correct param1")]
    Radius(f64),
    /// A second return point.
    #[error("a second return point, the first is item {first}; keep one of them")]
    SecondReturnPoint {
        /// The item of the first return point.
        first: usize,
    },
    /// More items than a plan can number.
    #[error("more than 65535 items; simplify the fence")]
    TooMany,
}

/// Reads a fence plan. `source` says where it came from in the names of the regions: `None` for
/// the vehicle (`fence items 4-9`), a file's name for a file (`field.txt fence items 4-9`).
///
/// # Errors
/// [`FenceItemError`] names the first item that cannot be used.
pub fn decode_fence(
    items: &[MissionItem],
    source: Option<&str>,
) -> Result<DecodedFence, FenceItemError> {
    let mut decoded = DecodedFence::default();
    let mut return_point_at = None;
    let prefix = source.map(|name| format!("{name} ")).unwrap_or_default();
    let mut index = 0;
    while let Some(item) = items.get(index) {
        let at = |index| move |problem| FenceItemError { index, problem };
        match item.command {
            Command::NAV_FENCE_RETURN_POINT => {
                if let Some(first) = return_point_at.replace(index) {
                    return Err(at(index)(FenceItemProblem::SecondReturnPoint { first }));
                }
                let position = position(item).map_err(at(index))?;
                decoded.fences.return_point = Some((position, item.z));
                index += 1;
            }
            Command::NAV_FENCE_CIRCLE_INCLUSION | Command::NAV_FENCE_CIRCLE_EXCLUSION => {
                let centre = position(item).map_err(at(index))?;
                let radius = radius(f64::from(item.params[0])).map_err(at(index))?;
                let origin = format!("{prefix}fence item {index}");
                warn_of_group(item, &origin, &mut decoded.warnings);
                let shape = FenceShape::Circle { centre, radius };
                decoded.fences.regions.push(FenceRegion {
                    role: role(item),
                    shape,
                    heights: None,
                    origin,
                });
                index += 1;
            }
            Command::NAV_FENCE_POLYGON_VERTEX_INCLUSION
            | Command::NAV_FENCE_POLYGON_VERTEX_EXCLUSION => {
                let count = vertex_count(item).map_err(at(index))?;
                let members = items.get(index..index + count).ok_or_else(|| {
                    at(index)(FenceItemProblem::Truncated { count, left: items.len() - index })
                })?;
                let mut ring = Vec::with_capacity(count);
                for (offset, member) in members.iter().enumerate() {
                    let at_member = at(index + offset);
                    if member.command != item.command || member.params[0] != item.params[0] {
                        return Err(at_member(FenceItemProblem::ForeignVertex {
                            first: index,
                            command: member.command,
                            count: member.params[0],
                            wanted: item.command,
                            expected: item.params[0],
                        }));
                    }
                    ring.push(position(member).map_err(at_member)?);
                }
                let origin = format!("{prefix}fence items {index}-{}", index + count - 1);
                warn_of_group(item, &origin, &mut decoded.warnings);
                let shape = FenceShape::Polygon(distinct_ring(ring));
                decoded.fences.regions.push(FenceRegion {
                    role: role(item),
                    shape,
                    heights: None,
                    origin,
                });
                index += count;
            }
            other => return Err(at(index)(FenceItemProblem::NotAFenceCommand(other))),
        }
    }
    Ok(decoded)
}

/// The fence plan that holds `fences`: the return point first, then the regions in their order.
/// All in frame 0, as ArduPilot hands fences back.
///
/// # Errors
/// [`FenceItemError`] where a region cannot be a fence item (fewer than 3 vertices, a radius that
/// is no length) or there are too many.
pub fn encode_fence(fences: &FenceSet) -> Result<Vec<MissionItem>, FenceItemError> {
    let mut items = Vec::new();
    if let Some((position, altitude)) = fences.return_point {
        items.push(item(Command::NAV_FENCE_RETURN_POINT, 0.0, position, altitude));
    }
    for region in &fences.regions {
        let at = |problem| FenceItemError { index: items.len(), problem };
        match &region.shape {
            FenceShape::Polygon(ring) => {
                // Exact: the largest count is 65535, an f32 holds whole numbers up to 2^24.
                let count = ring.len() as f32;
                if ring.len() < 3 {
                    return Err(at(FenceItemProblem::Count(count)));
                }
                if items.len() + ring.len() > usize::from(u16::MAX) {
                    return Err(at(FenceItemProblem::TooMany));
                }
                let command = match region.role {
                    FenceRole::Inclusion => Command::NAV_FENCE_POLYGON_VERTEX_INCLUSION,
                    FenceRole::Exclusion => Command::NAV_FENCE_POLYGON_VERTEX_EXCLUSION,
                };
                items.extend(ring.iter().map(|vertex| item(command, count, *vertex, 0.0)));
            }
            FenceShape::Circle { centre, radius: metres } => {
                let checked = radius(metres.0).map_err(at)?;
                let command = match region.role {
                    FenceRole::Inclusion => Command::NAV_FENCE_CIRCLE_INCLUSION,
                    FenceRole::Exclusion => Command::NAV_FENCE_CIRCLE_EXCLUSION,
                };
                items.push(item(command, wire_radius(checked, region.role), *centre, 0.0));
            }
        }
    }
    if items.len() > usize::from(u16::MAX) {
        let problem = FenceItemProblem::TooMany;
        return Err(FenceItemError { index: usize::from(u16::MAX), problem });
    }
    for (seq, item) in items.iter_mut().enumerate() {
        item.seq = seq as u16; // at most 65535 items, checked above
    }
    Ok(items)
}

/// A radius that can be a fence's.
///
/// # Errors
/// [`FenceItemProblem::Radius`] unless it is positive, finite and at most [`MAX_RADIUS`].
pub(crate) fn radius(metres: f64) -> Result<Metres, FenceItemProblem> {
    if metres > 0.0 && metres <= MAX_RADIUS {
        Ok(Metres(metres))
    } else {
        Err(FenceItemProblem::Radius(metres))
    }
}

/// A ring without vertices that repeat the one before, nor the first one at the end. A ring of
/// fewer than three places is a wall: its last vertex is repeated so that it is still a polygon.
pub(crate) fn distinct_ring(mut ring: Vec<LatLon>) -> Vec<LatLon> {
    ring.dedup();
    while ring.len() > 1 && ring.first() == ring.last() {
        ring.pop();
    }
    while let Some(last) = ring.last().copied().filter(|_| ring.len() < 3) {
        ring.push(last);
    }
    ring
}

/// The radius as an `f32`, rounded to the side on which the region forbids no less.
fn wire_radius(radius: Metres, role: FenceRole) -> f32 {
    let nearest = radius.0 as f32;
    match role {
        FenceRole::Exclusion if f64::from(nearest) < radius.0 => nearest.next_up(),
        FenceRole::Inclusion if f64::from(nearest) > radius.0 => nearest.next_down(),
        _ => nearest,
    }
}

fn item(command: Command, param1: f32, position: LatLon, z: f32) -> MissionItem {
    let e7 = position.to_e7();
    MissionItem {
        seq: 0,
        frame: Frame::GLOBAL,
        command,
        current: 0,
        autocontinue: 0,
        params: [param1, 0.0, 0.0, 0.0],
        x: e7.lat,
        y: e7.lon,
        z,
    }
}

fn role(item: &MissionItem) -> FenceRole {
    match item.command {
        Command::NAV_FENCE_POLYGON_VERTEX_INCLUSION | Command::NAV_FENCE_CIRCLE_INCLUSION => {
            FenceRole::Inclusion
        }
        _ => FenceRole::Exclusion,
    }
}

fn position(item: &MissionItem) -> Result<LatLon, FenceItemProblem> {
    if !item.frame.is_global() {
        return Err(FenceItemProblem::Frame(item.frame));
    }
    Ok(item.position()?)
}

fn vertex_count(item: &MissionItem) -> Result<usize, FenceItemProblem> {
    let count = item.params[0];
    if count.fract() == 0.0 && (3.0..=65535.0).contains(&count) {
        Ok(count as usize)
    } else {
        Err(FenceItemProblem::Count(count))
    }
}

/// Inclusion groups (param2): MAVLink would have "inside all zones of one group"; ArduPilot drops
/// the group and PX4 ignores it, so quavd does not follow it either, and says so.
fn warn_of_group(item: &MissionItem, origin: &str, warnings: &mut Vec<String>) {
    let group = item.params[1];
    if role(item) == FenceRole::Inclusion && group != 0.0 && !group.is_nan() {
        warnings.push(format!(
            "{origin}: inclusion group {group} is not followed (autopilots ignore it); every \
             inclusion area counts the same"
        ));
    }
}

#[cfg(test)]
mod tests;
