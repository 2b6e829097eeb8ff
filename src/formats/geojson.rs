//! GeoJSON (RFC 7946): positions are `[lon, lat]`, rings closed, WGS 84. What the features mean is
//! in [`super::feature`].

use geojson::{GeometryValue, Position};
use serde::Deserialize;
use serde_json::{Map, Value, json};

use super::Scenario;
use super::error::{Located, Problem, WriteError};
use super::feature::{Feature, Shape, Want, features, position, positions, scenario};
use crate::geodesy::LatLon;

#[derive(Deserialize)]
struct FeatureCollection {
    features: Vec<geojson::Feature>,
    /// Before RFC 7946 a file could be in any coordinate reference system.
    crs: Option<Value>,
}

pub(super) fn read(name: &str, text: &str, want: Want) -> Result<Scenario, Located> {
    let broken = |error: serde_json::Error| Problem::Json(error.to_string());
    // Nearly every file is a collection; anything else is one feature or one geometry.
    let collection = match serde_json::from_str::<Kind>(text).map_err(broken)?.kind.as_str() {
        "FeatureCollection" => serde_json::from_str(text).map_err(broken)?,
        "Feature" => {
            let feature = serde_json::from_str(text).map_err(broken)?;
            FeatureCollection { features: vec![feature], crs: None }
        }
        _ => {
            let geometry: geojson::Geometry = serde_json::from_str(text).map_err(broken)?;
            FeatureCollection { features: vec![geometry.into()], crs: None }
        }
    };
    if let Some(crs) = collection.crs.filter(|crs| !is_wgs84(crs)) {
        return Err(Problem::NotSupported {
            what: format!("the coordinates are not WGS 84 but {crs}"),
            advice: "convert the file to EPSG:4326",
        }
        .into());
    }
    let mut read = Vec::with_capacity(collection.features.len());
    for (index, feature) in collection.features.into_iter().enumerate() {
        let properties = feature.properties.unwrap_or_default();
        let mut parsed = Feature::named("feature", index + 1, properties, None);
        if let Some(geometry) = feature.geometry {
            add_shapes(&geometry.value, &mut parsed.shapes)
                .map_err(|problem| problem.at(parsed.place.clone()))?;
        }
        read.push(parsed);
    }
    scenario(name, read, want, true)
}

#[derive(Deserialize)]
struct Kind {
    #[serde(rename = "type")]
    kind: String,
}

fn is_wgs84(crs: &Value) -> bool {
    let text = crs.to_string();
    crs.is_null() || text.contains("CRS84") || text.contains("4326")
}

fn add_shapes(geometry: &GeometryValue, shapes: &mut Vec<Shape>) -> Result<(), Problem> {
    match geometry {
        GeometryValue::Point { coordinates } => {
            shapes.push(Shape::Point(position("position", coordinates.as_slice())?));
        }
        GeometryValue::MultiPoint { coordinates } => {
            shapes.extend(line(coordinates)?.into_iter().map(Shape::Point));
        }
        GeometryValue::LineString { coordinates } => shapes.push(Shape::Line(line(coordinates)?)),
        GeometryValue::MultiLineString { coordinates } => {
            for part in coordinates {
                shapes.push(Shape::Line(line(part)?));
            }
        }
        GeometryValue::Polygon { coordinates } => shapes.push(polygon(coordinates)?),
        GeometryValue::MultiPolygon { coordinates } => {
            for part in coordinates {
                shapes.push(polygon(part)?);
            }
        }
        GeometryValue::GeometryCollection { geometries } => {
            // Nesting is bounded by the JSON parser's own limit of 128.
            for part in geometries {
                add_shapes(&part.value, shapes)?;
            }
        }
    }
    Ok(())
}

fn line(coordinates: &[Position]) -> Result<Vec<LatLon>, Problem> {
    positions("vertex", coordinates.iter().map(Position::as_slice))
}

fn polygon(rings: &[Vec<Position>]) -> Result<Shape, Problem> {
    let Some((outer, holes)) = rings.split_first() else {
        let what = "outline of this polygon".to_owned();
        return Err(Problem::Missing { what, advice: "draw it again or delete it" });
    };
    let holes = holes.iter().map(|hole| line(hole)).collect::<Result<_, _>>()?;
    Ok(Shape::Polygon { outer: line(outer)?, holes })
}

/// The scenario as a GeoJSON feature collection, one feature per item, region and rally point.
/// Rings are written counter-clockwise as RFC 7946 has them.
///
/// # Errors
/// [`WriteError`] where an item has no valid position or a jump leads nowhere.
pub fn write_geojson(scenario: &Scenario) -> Result<String, WriteError> {
    let features: Vec<_> = features(scenario)?.iter().map(feature).collect();
    let mut text = String::from("{\"type\":\"FeatureCollection\",\"features\":[\n");
    for (index, feature) in features.iter().enumerate() {
        text.push_str(if index == 0 { " " } else { ",\n " });
        text.push_str(&feature.to_string());
    }
    text.push_str("\n]}\n");
    Ok(text)
}

fn feature(feature: &Feature) -> Value {
    let geometry = match feature.shapes.first() {
        None => Value::Null,
        Some(Shape::Point(point)) => json!({ "type": "Point", "coordinates": pair(point) }),
        Some(Shape::Line(line)) => {
            let line: Vec<_> = line.iter().map(pair).collect();
            json!({ "type": "LineString", "coordinates": line })
        }
        Some(Shape::Polygon { outer, .. }) => {
            json!({ "type": "Polygon", "coordinates": [closed_ring(outer)] })
        }
    };
    let mut object = Map::new();
    object.insert("type".to_owned(), json!("Feature"));
    object.insert("properties".to_owned(), Value::Object(feature.properties.clone()));
    object.insert("geometry".to_owned(), geometry);
    Value::Object(object)
}

/// Longitude first, rounded to 1e-7 degrees.
fn pair(position: &LatLon) -> [f64; 2] {
    let e7 = position.to_e7();
    [f64::from(e7.lon) / 1e7, f64::from(e7.lat) / 1e7]
}

/// The ring counter-clockwise from its first vertex, with that vertex again at the end.
fn closed_ring(ring: &[LatLon]) -> Vec<[f64; 2]> {
    let mut closed: Vec<_> = ring.iter().map(pair).collect();
    closed.extend(closed.first().copied());
    let twice_area: f64 = closed.windows(2).map(|w| w[0][0] * w[1][1] - w[1][0] * w[0][1]).sum();
    if twice_area < 0.0 {
        closed.reverse();
    }
    closed
}
