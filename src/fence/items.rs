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
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geodesy::LatLonE7;

    fn vertex(command: Command, count: f32, lat: i32, lon: i32) -> MissionItem {
        let place = LatLonE7 { lat, lon }.to_degrees().unwrap();
        item(command, count, place, 0.0)
    }

    fn triangle(command: Command) -> Vec<MissionItem> {
        [(0, 0), (0, 9000), (9000, 0)].map(|(lat, lon)| vertex(command, 3.0, lat, lon)).to_vec()
    }

    const EXCLUSION: Command = Command::NAV_FENCE_POLYGON_VERTEX_EXCLUSION;
    const INCLUSION: Command = Command::NAV_FENCE_POLYGON_VERTEX_INCLUSION;

    #[test]
    fn two_polygons_of_the_same_kind_and_size_stay_two() {
        let items = [triangle(EXCLUSION), triangle(EXCLUSION)].concat();
        let decoded = decode_fence(&items, None).unwrap();
        let origins: Vec<_> = decoded.fences.regions.iter().map(|r| r.origin.as_str()).collect();
        assert_eq!(origins, ["fence items 0-2", "fence items 3-5"]);
    }

    #[test]
    fn a_polygon_cut_short_is_an_error_at_its_first_item() {
        let items = [triangle(EXCLUSION), triangle(EXCLUSION)[..2].to_vec()].concat();
        let error = decode_fence(&items, None).unwrap_err();
        let problem = FenceItemProblem::Truncated { count: 3, left: 2 };
        assert_eq!(error, FenceItemError { index: 3, problem });
    }

    #[test]
    fn a_count_that_lies_is_an_error_at_the_item_that_shows_it() {
        for count in [f32::NAN, f32::INFINITY, -3.0, 0.0, 2.0, 3.5, 1e9] {
            let mut items = triangle(EXCLUSION);
            items[0].params[0] = count;
            let error = decode_fence(&items, None).unwrap_err();
            assert_eq!(error.index, 0, "{count}");
            assert!(matches!(error.problem, FenceItemProblem::Count(_)), "{error}");
        }
        let mut items = triangle(EXCLUSION);
        items[1].params[0] = 4.0;
        assert!(decode_fence(&items, None).unwrap_err().to_string().starts_with("fence item 1:"));
    }

    #[test]
    fn a_vertex_of_another_kind_inside_a_polygon_is_an_error() {
        let mut items = triangle(EXCLUSION);
        items[2].command = INCLUSION;
        let error = decode_fence(&items, None).unwrap_err();
        assert_eq!(error.index, 2);
        assert!(matches!(error.problem, FenceItemProblem::ForeignVertex { first: 0, .. }));
    }

    #[test]
    fn a_position_off_the_globe_is_an_error_naming_the_vertex() {
        let mut items = triangle(INCLUSION);
        items[2].x = 900_000_001;
        let error = decode_fence(&items, None).unwrap_err();
        assert_eq!(error.index, 2);
        assert!(matches!(error.problem, FenceItemProblem::Position(_)));
    }

    #[test]
    fn a_radius_that_is_no_length_is_an_error() {
        for radius in [0.0, -5.0, f32::NAN, f32::INFINITY, 9e6] {
            let items = [vertex(Command::NAV_FENCE_CIRCLE_EXCLUSION, radius, 1, 2)];
            let error = decode_fence(&items, None).unwrap_err();
            assert!(matches!(error.problem, FenceItemProblem::Radius(_)), "{radius}: {error}");
        }
    }

    #[test]
    fn a_mission_command_or_local_frame_or_second_return_point_is_an_error() {
        let waypoint = vertex(Command::NAV_WAYPOINT, 0.0, 1, 2);
        assert!(matches!(
            decode_fence(&[waypoint], None).unwrap_err().problem,
            FenceItemProblem::NotAFenceCommand(Command::NAV_WAYPOINT)
        ));
        let mut local = triangle(EXCLUSION);
        local[1].frame = Frame(1);
        assert_eq!(decode_fence(&local, None).unwrap_err().index, 1);
        let point = vertex(Command::NAV_FENCE_RETURN_POINT, 0.0, 1, 2);
        let error = decode_fence(&[point, point], None).unwrap_err();
        assert_eq!(error.problem, FenceItemProblem::SecondReturnPoint { first: 0 });
    }

    #[test]
    fn a_group_is_left_out_with_a_warning() {
        let mut items = triangle(INCLUSION);
        items.iter_mut().for_each(|item| item.params[1] = 2.0);
        let decoded = decode_fence(&items, Some("field.txt")).unwrap();
        assert_eq!(decoded.fences.regions.len(), 1);
        assert!(decoded.warnings[0].starts_with("field.txt fence items 0-2: inclusion group 2"));
    }

    #[test]
    fn a_repeated_closing_vertex_is_dropped() {
        let corners = [(0, 0), (0, 9000), (9000, 0), (0, 0)];
        let items = corners.map(|(lat, lon)| vertex(EXCLUSION, 4.0, lat, lon));
        let decoded = decode_fence(&items, None).unwrap();
        let FenceShape::Polygon(ring) = &decoded.fences.regions[0].shape else { panic!() };
        assert_eq!(ring.len(), 3);
    }

    #[test]
    fn a_ring_of_fewer_than_three_places_stays_a_polygon() {
        let [a, b] = [1, 2].map(|lat| LatLonE7 { lat, lon: 0 }.to_degrees().unwrap());
        assert_eq!(distinct_ring(vec![a, a, b, b, a, a]), [a, b, b]);
        assert_eq!(distinct_ring(vec![a, b, b]), [a, b, b]);
        assert_eq!(distinct_ring(vec![a, a, a, a]), [a, a, a]);
    }

    #[test]
    fn a_radius_is_rounded_to_the_side_that_forbids_no_less() {
        assert!(f64::from(wire_radius(Metres(30.3), FenceRole::Exclusion)) >= 30.3);
        assert!(f64::from(wire_radius(Metres(30.3), FenceRole::Inclusion)) <= 30.3);
        assert_eq!(wire_radius(Metres(30.5), FenceRole::Exclusion), 30.5);
    }

    proptest! {
        #[test]
        fn what_is_encoded_decodes_to_the_same_fence(fences in crate::fence::samples::fence_set()) {
            let items = encode_fence(&fences).unwrap();
            let again = decode_fence(&items, None).unwrap().fences;
            prop_assert_eq!(again.return_point, fences.return_point);
            let plain = |set: &FenceSet| -> Vec<_> {
                set.regions.iter().map(|r| (r.role, r.shape.clone())).collect()
            };
            prop_assert_eq!(plain(&again), plain(&fences));
        }

        #[test]
        fn no_list_of_items_makes_the_decoder_panic(
            raw in prop::collection::vec(
                (4999u16..5006, 0u8..12, any::<f32>(), any::<i32>(), any::<i32>(), 0usize..5),
                0..12,
            )
        ) {
            let items: Vec<_> = raw.into_iter().map(|(command, frame, value, x, y, small)| {
                let param1 = [3.0, 4.0, 5.0, 2.5, value][small];
                MissionItem {
                    seq: 0, frame: Frame(frame), command: Command(command), current: 0,
                    autocontinue: 0, params: [param1, value, value, value], x, y, z: value,
                }
            }).collect();
            let _ = decode_fence(&items, None);
        }
    }
}
