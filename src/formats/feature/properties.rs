//! What the properties of a feature say: its role, numbers, a circle, a mission item.

use serde_json::Value;

use super::order::NumberedItem;
use super::{DEFAULT_ROUTE_ALTITUDE, Feature, Shape};
use crate::fence::items::radius;
use crate::fence::{FenceRole, FenceShape};
use crate::formats::error::Problem;
use crate::formats::item::{FileItem, float, natural};

/// What a feature is, by its properties.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// Nothing said.
    None,
    Start,
    Goal,
    Waypoint,
    Home,
    Rally,
    Return,
    Track,
    /// A mission item, field for field.
    Item,
    Area(FenceRole),
}

/// What the properties say a feature is.
pub(super) fn role(feature: &Feature) -> Result<Role, Problem> {
    if feature.properties.contains_key("command") {
        return Ok(Role::Item);
    }
    let text = |key: &str| {
        feature.properties.get(key).and_then(Value::as_str).map(|text| text.trim().to_lowercase())
    };
    let named = match text("role").as_deref() {
        Some("start") => Role::Start,
        Some("goal") => Role::Goal,
        Some("waypoint") => Role::Waypoint,
        Some("home") => Role::Home,
        Some("rally") => Role::Rally,
        Some("return") => Role::Return,
        Some("track") => Role::Track,
        Some("inclusion") => Role::Area(FenceRole::Inclusion),
        Some("obstacle" | "exclusion") => Role::Area(FenceRole::Exclusion),
        _ => Role::None,
    };
    let fence = match text("fence").as_deref() {
        None => None,
        Some("inclusion") => Some(FenceRole::Inclusion),
        Some("exclusion") => Some(FenceRole::Exclusion),
        Some(other) => {
            return Err(Problem::Value {
                what: "the property fence".to_owned(),
                found: format!("{other:?}"),
                expected: "\"inclusion\" or \"exclusion\"",
            });
        }
    };
    let flag = feature.properties.get("inclusion").and_then(Value::as_bool);
    let flag = flag.map(|inside| if inside { FenceRole::Inclusion } else { FenceRole::Exclusion });
    let area = match named {
        Role::Area(role) => Some(role),
        _ => None,
    };
    let said: Vec<_> = [area, fence, flag].into_iter().flatten().collect();
    match said.split_first() {
        None => Ok(named),
        Some((first, rest)) if rest.iter().all(|other| other == first) => Ok(Role::Area(*first)),
        Some(_) => Err(Problem::Conflict {
            what: "role, fence and inclusion contradict each other".to_owned(),
            advice: "keep one of them",
        }),
    }
}

/// An area that says nothing of itself is an obstacle.
pub(super) fn fence_role(role: Role) -> FenceRole {
    if role == Role::Area(FenceRole::Inclusion) {
        FenceRole::Inclusion
    } else {
        FenceRole::Exclusion
    }
}

/// The circle that a point with `radius` stands for, or any shape with `radius` and `centre`
/// (`[lon, lat]`), whose outline is then only its picture.
pub(super) fn circle(feature: &Feature, role: Role) -> Result<Option<FenceShape>, Problem> {
    let Some(length) = number(feature, "radius")? else { return Ok(None) };
    let fits = matches!(role, Role::None | Role::Area(_));
    let centre = match (feature.properties.get("centre"), &feature.shapes[..]) {
        (Some(Value::Array(centre)), _) if fits => {
            let numbers: Vec<_> = centre.iter().filter_map(Value::as_f64).collect();
            super::position("centre", &numbers)?
        }
        (None, [Shape::Point(centre)]) if fits => *centre,
        _ => return Ok(None),
    };
    let radius = radius(length).map_err(|_| Problem::Value {
        what: "the radius".to_owned(),
        found: format!("{length} m"),
        expected: "positive and at most 8000 km",
    })?;
    Ok(Some(FenceShape::Circle { centre, radius }))
}

/// A mission item from `seq`, `command`, `frame`, `params` and the point; without a point,
/// `params` has all seven.
pub(super) fn numbered_item(feature: &Feature) -> Result<NumberedItem, Problem> {
    let needed = |key: &'static str| {
        number(feature, key)?.ok_or_else(|| Problem::Missing {
            what: format!("{key} though there is a command"),
            advice: "a mission item needs seq, command, frame and params",
        })
    };
    let params = match feature.properties.get("params") {
        Some(Value::Array(params)) => params,
        _ => return Err(wrong_params("missing")),
    };
    let mut values = Vec::with_capacity(7);
    for param in params.iter().take(8) {
        values.push(match param {
            Value::Null => f64::NAN,
            param => param.as_f64().ok_or_else(|| wrong_params(&param.to_string()))?,
        });
    }
    if let [Shape::Point(point)] = feature.shapes[..] {
        values.truncate(4);
        let altitude = match feature.properties.get("altitude") {
            Some(Value::Null) => f64::NAN,
            _ => needed("altitude")?,
        };
        values.extend([point.lat(), point.lon(), altitude]);
    }
    let params = <[f64; 7]>::try_from(values.as_slice())
        .map_err(|_| wrong_params(&format!("{} numbers", params.len())))?;
    let autocontinue = feature.properties.get("autocontinue").and_then(Value::as_bool);
    let item = FileItem {
        command: natural(needed("command")?, u16::MAX, "command")?,
        frame: natural(needed("frame")?, 255, "frame")? as u8, // at most 255
        params,
        autocontinue: autocontinue.unwrap_or(true),
    };
    let seq = natural(needed("seq")?, u16::MAX - 1, "seq")?;
    let properties = feature.properties.clone();
    Ok(NumberedItem { place: feature.place.clone(), seq, item, properties })
}

fn wrong_params(found: &str) -> Problem {
    Problem::Value {
        what: "params".to_owned(),
        found: found.to_owned(),
        expected: "4 numbers with a point, 7 without one (null for unset)",
    }
}

/// A property that must be a number where it is given.
pub(super) fn number(feature: &Feature, key: &str) -> Result<Option<f64>, Problem> {
    match feature.properties.get(key) {
        None | Some(Value::Null) => Ok(None),
        Some(value) => value.as_f64().map(Some).ok_or_else(|| Problem::Value {
            what: format!("the property {key}"),
            found: value.to_string(),
            expected: "a number",
        }),
    }
}

pub(super) fn altitude(feature: &Feature) -> Result<f32, Problem> {
    let altitude = number(feature, "altitude")?.unwrap_or(f64::from(DEFAULT_ROUTE_ALTITUDE));
    float(altitude, || "altitude".to_owned())
}
