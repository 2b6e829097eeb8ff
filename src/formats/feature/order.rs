//! Mission items and route points of a file, put in the order in which they are flown.

use super::properties::Role;
use crate::formats::error::{Located, Place, Problem};
use crate::formats::item::{FileItem, index_in, jumps_to_indices};
use crate::formats::kept::Properties;
use crate::geodesy::LatLon;
use crate::mission::MissionItem;

/// A point of a route, before the route is in order.
pub(super) struct RoutePoint {
    pub(super) place: Place,
    pub(super) position: LatLon,
    pub(super) role: Role,
    pub(super) seq: Option<u16>,
    pub(super) altitude: f32,
    pub(super) properties: Properties,
}

/// A mission item of the file, before the mission is in order.
pub(super) struct NumberedItem {
    pub(super) place: Place,
    pub(super) seq: u16,
    pub(super) item: FileItem,
    pub(super) properties: Properties,
}

/// The items in order, each with its properties.
pub(super) fn ordered_items(
    mut items: Vec<NumberedItem>,
) -> Result<Vec<(MissionItem, Properties)>, Located> {
    items.sort_by_key(|item| item.seq);
    for (index, item) in items.iter().enumerate() {
        if usize::from(item.seq) != index {
            let problem = Problem::Value {
                what: "seq".to_owned(),
                found: item.seq.to_string(),
                expected: "0, 1, 2 and so on without a gap or a repetition",
            };
            return Err(problem.at(item.place.clone()));
        }
    }
    let to_item = |item: &NumberedItem| {
        item.item.to_item(item.seq).map_err(|problem| problem.at(item.place.clone()))
    };
    let mut mission = items.iter().map(to_item).collect::<Result<Vec<_>, _>>()?;
    let index_of = |target: f64| index_in(items.len(), target).then_some(target as usize);
    jumps_to_indices(&mut mission, index_of).map_err(|(index, problem)| {
        problem.at(items.get(index).map_or(Place::File, |item| item.place.clone()))
    })?;
    Ok(mission.into_iter().zip(items.into_iter().map(|item| item.properties)).collect())
}

/// The points in order.
pub(super) fn ordered_points(mut points: Vec<RoutePoint>) -> Result<Vec<RoutePoint>, Located> {
    if points.iter().any(|point| point.seq.is_some()) {
        if let Some(point) = points.iter().find(|point| point.seq.is_none()) {
            let what = "seq, though other points of the route have one".to_owned();
            let advice = "give every point a seq, or none";
            return Err(Problem::Missing { what, advice }.at(point.place.clone()));
        }
        points.sort_by_key(|point| point.seq);
    } else {
        // Start first, goal last, the others as they stand in the file.
        points.sort_by_key(|point| match point.role {
            Role::Start => 0,
            Role::Goal => 2,
            _ => 1,
        });
    }
    let last = points.len().saturating_sub(1);
    for (index, point) in points.iter().enumerate() {
        let seq_twice = index > 0 && point.seq.is_some() && point.seq == points[index - 1].seq;
        let misplaced = (point.role == Role::Start && index != 0)
            || (point.role == Role::Goal && index != last);
        if seq_twice || misplaced {
            let what = if seq_twice {
                "its seq stands twice".to_owned()
            } else {
                "a start that is not the first point, or a goal that is not the last".to_owned()
            };
            let advice = "number the points in the order in which they are flown";
            return Err(Problem::Conflict { what, advice }.at(point.place.clone()));
        }
    }
    Ok(points)
}
