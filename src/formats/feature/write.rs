//! From a scenario to features.

use serde_json::{Map, Value, json};

use super::{Feature, Shape};
use crate::fence::{FenceRegion, FenceRole, FenceShape};
use crate::formats::Scenario;
use crate::formats::error::{Place, WriteError};
use crate::formats::item::{FileItem, decimal, holds_degrees, json_number, jumps_from_indices};
use crate::formats::kept::{Properties, with_kept};
use crate::geodesy::LatLon;
use crate::mission::MissionItem;

/// The scenario as features: home, mission items, a track for the eye, regions, return point,
/// rally points; each with the properties that it had where it was read.
pub(in crate::formats) fn features(scenario: &Scenario) -> Result<Vec<Feature>, WriteError> {
    let mut features = Features(Vec::new());
    let kept = &scenario.kept;
    if let Some(home) = scenario.mission.home {
        let altitude = json_number(decimal(home.altitude_amsl));
        let properties = json!({ "role": "home", "altitude_amsl": altitude });
        features.push(properties, Some(&kept.home), vec![Shape::Point(home.position)]);
    }
    let mut track = Vec::new();
    let item_properties = kept.item_properties(&scenario.mission.items);
    for (index, item) in jumps_from_indices(&scenario.mission, 0)?.iter().enumerate() {
        let point = drawn_position(item, Place::MissionItem(index + 1))?;
        track.extend(point);
        let FileItem { command, frame, params, autocontinue } = FileItem::from_item(item);
        let mut properties = json!({
            "seq": index,
            "command": command,
            "frame": frame,
            "autocontinue": autocontinue,
        });
        if point.is_some() {
            properties["params"] = params[..4].iter().copied().map(json_number).collect();
            properties["altitude"] = json_number(params[6]);
        } else {
            properties["params"] = params.map(json_number).to_vec().into();
        }
        let kept = item_properties.get(index).copied().flatten();
        features.push(properties, kept, point.map(Shape::Point).into_iter().collect());
    }
    if track.len() > 1 {
        let track = vec![Shape::Line(track)];
        features.push(json!({ "role": "track" }), Some(&kept.route), track);
    }
    for region in &scenario.fences.regions {
        let (properties, shape) = region_feature(region);
        let kept = kept.regions.get(&region.origin).map(|kept| of_region(kept, region));
        features.push(properties, kept.as_ref(), vec![shape]);
    }
    if let Some((position, altitude)) = scenario.fences.return_point {
        let properties = json!({ "role": "return", "altitude": json_number(decimal(altitude)) });
        features.push(properties, Some(&kept.return_point), vec![Shape::Point(position)]);
    }
    let rally_properties = kept.rally_properties(&scenario.rally);
    for (index, item) in scenario.rally.iter().enumerate() {
        let place = Place::RallyPoint(index + 1);
        let position = item.position().map_err(|error| WriteError::Position { place, error })?;
        let FileItem { frame, params, .. } = FileItem::from_item(item);
        let altitude = json_number(params[6]);
        let properties = json!({ "role": "rally", "frame": frame, "altitude": altitude });
        let kept = rally_properties.get(index).copied().flatten();
        features.push(properties, kept, vec![Shape::Point(position)]);
    }
    Ok(features.0)
}

struct Features(Vec<Feature>);

impl Features {
    fn push(&mut self, properties: Value, kept: Option<&Properties>, shapes: Vec<Shape>) {
        let Value::Object(mut properties) = properties else { return };
        if let Some(kept) = kept {
            with_kept(&mut properties, kept);
        }
        let number = self.0.len() + 1;
        self.0.push(Feature { shapes, ..Feature::named("feature", number, properties, None) });
    }
}

/// Where the item is drawn; `None` where it has no place. Zeros mean "here", not a place in the
/// Gulf of Guinea.
fn drawn_position(item: &MissionItem, place: Place) -> Result<Option<LatLon>, WriteError> {
    if !holds_degrees(item.command, item.frame) || (item.x, item.y) == (0, 0) {
        return Ok(None);
    }
    let position = item.position();
    Ok(Some(position.map_err(|error| WriteError::Position { place, error })?))
}

/// What was kept of a region, without what would contradict it: the hole of an inclusion has the
/// properties of the whole, and a centre is only that of the file's circle.
fn of_region(kept: &Properties, region: &FenceRegion) -> Properties {
    let mut kept = kept.clone();
    let inside = region.role == FenceRole::Inclusion;
    let role = kept.get("role").and_then(Value::as_str).map(|role| role.trim().to_lowercase());
    let contradicts = match role.as_deref() {
        Some("inclusion") => !inside,
        Some("obstacle" | "exclusion") => inside,
        _ => false,
    };
    if contradicts {
        kept.remove("role");
    }
    if kept.get("inclusion").and_then(Value::as_bool).is_some_and(|said| said != inside) {
        kept.remove("inclusion");
    }
    kept.remove("centre");
    if matches!(region.shape, FenceShape::Polygon(_)) {
        kept.remove("radius");
    }
    kept
}

fn region_feature(region: &FenceRegion) -> (Value, Shape) {
    let fence = match region.role {
        FenceRole::Inclusion => "inclusion",
        FenceRole::Exclusion => "exclusion",
    };
    let mut properties = Map::new();
    properties.insert("fence".to_owned(), json!(fence));
    let shape = match &region.shape {
        FenceShape::Polygon(ring) => Shape::Polygon { outer: ring.clone(), holes: Vec::new() },
        FenceShape::Circle { centre, radius } => {
            properties.insert("radius".to_owned(), json_number(radius.0));
            Shape::Point(*centre)
        }
    };
    (Value::Object(properties), shape)
}
