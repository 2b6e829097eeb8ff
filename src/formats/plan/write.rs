//! Writing a `.plan` that QGroundControl opens.

use serde_json::{Map, Value, json};

use crate::fence::items::{FenceItemProblem, radius};
use crate::fence::{FenceRole, FenceShape};
use crate::formats::Scenario;
use crate::formats::error::{Place, WriteError};
use crate::formats::item::{FileItem, decimal, json_number, jumps_from_indices};
use crate::geodesy::LatLon;
use crate::mission::Autopilot;
use crate::mission::{Command, Frame, MissionItem};

/// The scenario as a `.plan`: mission with planned home, geoFence, rally points. Polygons stand
/// before circles, as the format has a list for each.
///
/// # Errors
/// [`WriteError`] where the format cannot hold something: a jump to nowhere, a region that is no
/// fence, a rally point whose altitude is not above home.
pub fn write_plan(scenario: &Scenario) -> Result<String, WriteError> {
    let plan = json!({
        "fileType": "Plan",
        "groundStation": "quavd",
        "version": 1,
        "mission": mission(scenario)?,
        "geoFence": fence(scenario)?,
        "rallyPoints": rally(&scenario.rally)?,
    });
    Ok(format!("{plan:#}\n"))
}

fn mission(scenario: &Scenario) -> Result<Value, WriteError> {
    let vehicle = &scenario.vehicle;
    let firmware = match vehicle.autopilot {
        Autopilot::Unknown => 0,
        Autopilot::ArduPilot => 3,
        Autopilot::Px4 => 12,
    };
    let home = match scenario.mission.home {
        Some(home) => {
            json!([home.position.lat(), home.position.lon(), decimal(home.altitude_amsl)])
        }
        None => json!([null, null, null]),
    };
    let items = jumps_from_indices(&scenario.mission, 1)?;
    Ok(json!({
        "version": 2,
        "firmwareType": firmware,
        "vehicleType": vehicle.vehicle_type,
        "cruiseSpeed": json_number(vehicle.cruise_speed),
        "hoverSpeed": json_number(vehicle.hover_speed),
        "globalPlanAltitudeMode": 0, // mixed: each item says its own
        "plannedHomePosition": home,
        "items": items.iter().enumerate().map(|(index, i)| item(index, i)).collect::<Vec<_>>(),
    }))
}

fn item(index: usize, item: &MissionItem) -> Value {
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
