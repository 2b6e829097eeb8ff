//! Writing a `.plan` that QGroundControl opens.

use serde_json::{Map, Value, json};

use super::kept::{Written, renumbered, with_object};
use crate::fence::items::{FenceItemProblem, radius};
use crate::fence::{FenceRole, FenceShape};
use crate::formats::Scenario;
use crate::formats::error::{Place, WriteError};
use crate::formats::item::{FileItem, decimal, json_number, jumps_from_indices};
use crate::formats::kept::{Properties, with_kept};
use crate::geodesy::LatLon;
use crate::mission::Autopilot;
use crate::mission::{Command, Frame, MissionItem};

/// The scenario as a `.plan`: mission with planned home, geoFence, rally points. Polygons stand
/// before circles, as the format has a list for each. A complex item that was read from a plan is
/// written as it was where its items are untouched; [`plan_flattened`] names the others.
///
/// # Errors
/// [`WriteError`] where the format cannot hold something: a jump to nowhere, a region that is no
/// fence, a rally point whose altitude is not above home.
pub fn write_plan(scenario: &Scenario) -> Result<String, WriteError> {
    let mut plan = json!({
        "fileType": "Plan",
        "groundStation": "quavd",
        "version": 1,
        "mission": mission(scenario)?,
        "geoFence": fence(scenario)?,
        "rallyPoints": rally(&scenario.rally)?,
    });
    if let (Value::Object(plan), Some(kept)) = (&mut plan, &scenario.kept.plan) {
        with_kept(plan, kept.keys().0);
    }
    Ok(format!("{plan:#}\n"))
}

/// The complex items of the plan that the mission was read from and that a `.plan` written now
/// holds as simple items, because waypoints were inserted in them: a sentence each.
#[must_use]
pub fn plan_flattened(scenario: &Scenario) -> Vec<String> {
    let kept = scenario.kept.plan.iter();
    let lost = kept.flat_map(|kept| kept.flattened(&scenario.mission.items));
    lost.map(|(number, kind)| {
        format!(
            "mission item {number}: the {kind} item has new waypoints inside it, so it is written \
             as the simple items that it stood for; QGroundControl cannot edit it as a {kind} any \
             more"
        )
    })
    .collect()
}

fn mission(scenario: &Scenario) -> Result<Value, WriteError> {
    let vehicle = &scenario.vehicle;
    let kept = scenario.kept.plan.as_ref();
    let own = kept.and_then(|kept| kept.keys().1.get("firmwareType"));
    let firmware = match vehicle.autopilot {
        Autopilot::Unknown => own.cloned().unwrap_or(json!(0)),
        Autopilot::ArduPilot => json!(3),
        Autopilot::Px4 => json!(12),
    };
    let home = match scenario.mission.home {
        Some(home) => {
            json!([home.position.lat(), home.position.lon(), decimal(home.altitude_amsl)])
        }
        None => json!([null, null, null]),
    };
    let items = jumps_from_indices(&scenario.mission, 1)?;
    let simple = |(index, item)| self::item(index, item, None);
    let list: Vec<Value> = match kept {
        None => items.iter().enumerate().map(simple).collect(),
        Some(kept) => {
            let entries = kept.entries(&scenario.mission.items).into_iter();
            let entry = |entry| match entry {
                Written::Complex(first, _, object) => Some(renumbered(object, first)),
                Written::Simple(index, object) => {
                    items.get(index).map(|item| self::item(index, item, object))
                }
            };
            entries.filter_map(entry).collect()
        }
    };
    let mut mission = json!({
        "version": 2,
        "firmwareType": firmware,
        "vehicleType": vehicle.vehicle_type,
        "cruiseSpeed": json_number(vehicle.cruise_speed),
        "hoverSpeed": json_number(vehicle.hover_speed),
        "globalPlanAltitudeMode": 0, // mixed: each item says its own
        "plannedHomePosition": home,
        "items": list,
    });
    if let (Value::Object(mission), Some(kept)) = (&mut mission, kept) {
        with_kept(mission, kept.keys().1);
    }
    Ok(mission)
}

fn item(index: usize, item: &MissionItem, kept: Option<&Properties>) -> Value {
    let FileItem { command, frame, params, autocontinue } = FileItem::from_item(item);
    let mut object = Map::new();
    object.insert("type".to_owned(), json!("SimpleItem"));
    object.insert("doJumpId".to_owned(), json!(index + 1));
    object.insert("command".to_owned(), json!(command));
    object.insert("frame".to_owned(), json!(frame));
    object.insert("params".to_owned(), params.map(json_number).to_vec().into());
    object.insert("autoContinue".to_owned(), json!(autocontinue));
    if let Some(mode) = altitude_mode(Frame(frame)) {
        object.insert("AltitudeMode".to_owned(), json!(mode));
        object.insert("Altitude".to_owned(), json_number(params[6]));
        object.insert("AMSLAltAboveTerrain".to_owned(), Value::Null);
    }
    if let Some(kept) = kept {
        with_object(&mut object, kept);
    }
    Value::Object(object)
}

/// QGroundControl's `AltitudeMode` of a frame with an altitude.
fn altitude_mode(frame: Frame) -> Option<u8> {
    match frame {
        Frame::GLOBAL_RELATIVE_ALT => Some(1),
        Frame::GLOBAL => Some(2),
        Frame::GLOBAL_TERRAIN_ALT => Some(4),
        _ => None,
    }
}

fn fence(scenario: &Scenario) -> Result<Value, WriteError> {
    let mut polygons = Vec::new();
    let mut circles = Vec::new();
    for region in &scenario.fences.regions {
        let unusable = |problem| WriteError::Fence { origin: region.origin.clone(), problem };
        let inclusion = region.role == FenceRole::Inclusion;
        match &region.shape {
            FenceShape::Polygon(ring) if ring.len() < 3 => {
                return Err(unusable(FenceItemProblem::Count(ring.len() as f32)));
            }
            FenceShape::Polygon(ring) => {
                let ring: Vec<_> = ring.iter().map(|vertex| pair(*vertex)).collect();
                polygons.push(json!({ "polygon": ring, "inclusion": inclusion, "version": 1 }));
            }
            FenceShape::Circle { centre, radius: length } => {
                let length = radius(length.0).map_err(unusable)?;
                let circle = json!({ "center": pair(*centre), "radius": json_number(length.0) });
                circles.push(json!({ "circle": circle, "inclusion": inclusion, "version": 1 }));
            }
        }
    }
    let mut fence = json!({ "version": 2, "polygons": polygons, "circles": circles });
    if let Some((position, altitude)) = scenario.fences.return_point {
        let [lat, lon] = pair(position);
        fence["breachReturn"] = json!([lat, lon, json_number(decimal(altitude))]);
    }
    Ok(fence)
}

/// Latitude and longitude, rounded to 1e-7 degrees.
fn pair(position: LatLon) -> [f64; 2] {
    let e7 = position.to_e7();
    [f64::from(e7.lat) / 1e7, f64::from(e7.lon) / 1e7]
}

fn rally(points: &[MissionItem]) -> Result<Value, WriteError> {
    let point = |(index, item): (usize, &MissionItem)| {
        let relative = [Frame::GLOBAL_RELATIVE_ALT, Frame::GLOBAL_RELATIVE_ALT_INT];
        if item.command != Command::NAV_RALLY_POINT || !relative.contains(&item.frame) {
            return Err(WriteError::RallyFrame { number: index + 1, frame: item.frame.0 });
        }
        let position = item
            .position()
            .map_err(|error| WriteError::Position { place: Place::RallyPoint(index + 1), error })?;
        let [lat, lon] = pair(position);
        Ok(json!([lat, lon, json_number(decimal(item.z))]))
    };
    let points = points.iter().enumerate().map(point).collect::<Result<Vec<_>, _>>()?;
    Ok(json!({ "version": 2, "points": points }))
}
