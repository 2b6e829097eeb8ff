//! Writing KML.

use std::fmt::Write as _;

use quick_xml::escape::escape;
use serde_json::{Value, json};

use crate::formats::Scenario;
use crate::formats::error::WriteError;
use crate::formats::feature::{Feature, Shape, features};
use crate::formats::kept::Properties;
use crate::geodesy::LatLon;

/// Corners of the polygon that draws a circle.
const CIRCLE_CORNERS: u32 = 72;

const HEAD: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2">
<Document>
"#;
const TAIL: &str = "</Document>\n</kml>\n";

/// The scenario as KML, one placemark per item, region and rally point, with their properties as
/// `ExtendedData`. A circle is drawn as a polygon around it and read back as the circle.
///
/// # Errors
/// [`WriteError`] where an item has no valid position or a jump leads nowhere.
pub fn write_kml(scenario: &Scenario) -> Result<String, WriteError> {
    let mut text = HEAD.to_owned();
    for feature in features(scenario)? {
        placemark(&mut text, feature);
    }
    text.push_str(TAIL);
    Ok(text)
}

fn placemark(text: &mut String, mut feature: Feature) {
    let radius = feature.properties.get("radius").and_then(Value::as_f64);
    if let (Some(radius), Some(Shape::Point(centre))) = (radius, feature.shapes.first()) {
        let e7 = centre.to_e7();
        let pair = [f64::from(e7.lon) / 1e7, f64::from(e7.lat) / 1e7];
        feature.properties.insert("centre".to_owned(), json!(pair));
        feature.shapes =
            vec![Shape::Polygon { outer: outline(*centre, radius), holes: Vec::new() }];
    }
    let name = name_of(&feature.properties).unwrap_or_default();
    // Writing into a String cannot fail.
    let _ = writeln!(text, "<Placemark><name>{}</name>", escape(&name));
    let _ = write!(text, " <ExtendedData>");
    for (key, value) in &feature.properties {
        let (key, value) = (escape(key.as_str()), plain(value));
        let _ = write!(text, "<Data name=\"{key}\"><value>{}</value></Data>", escape(&value));
    }
    let _ = writeln!(text, "</ExtendedData>");
    match feature.shapes.first() {
        None => {}
        Some(Shape::Point(point)) => {
            let _ = writeln!(text, " <Point>{}</Point>", coordinates(&[*point]));
        }
        Some(Shape::Line(line)) => {
            let _ = writeln!(text, " <LineString>{}</LineString>", coordinates(line));
        }
        Some(Shape::Polygon { outer, .. }) => {
            let mut ring = outer.clone();
            ring.extend(outer.first());
            let _ = writeln!(
                text,
                " <Polygon><outerBoundaryIs><LinearRing>{}</LinearRing></outerBoundaryIs></Polygon>",
                coordinates(&ring)
            );
        }
    }
    text.push_str("</Placemark>\n");
}

/// What a placemark is called by its properties.
pub(super) fn name_of(properties: &Properties) -> Option<String> {
    let name = ["name", "role", "fence", "seq"].iter().find_map(|key| properties.get(*key))?;
    Some(name.as_str().map_or_else(|| name.to_string(), str::to_owned))
}

/// A property as extended data holds it: text as it is, unless that would be read as a number or
/// the like.
fn plain(value: &Value) -> String {
    match value.as_str() {
        Some(text) if is_plain(text) => text.to_owned(),
        _ => value.to_string(),
    }
}

fn is_plain(text: &str) -> bool {
    text == text.trim() && serde_json::from_str::<serde::de::IgnoredAny>(text).is_err()
}

/// Longitude first, rounded to 1e-7 degrees.
fn coordinates(line: &[LatLon]) -> String {
    let mut text = String::from("<coordinates>");
    for (index, position) in line.iter().enumerate() {
        let e7 = position.to_e7();
        let (lon, lat) = (f64::from(e7.lon) / 1e7, f64::from(e7.lat) / 1e7);
        let space = if index == 0 { "" } else { " " };
        let _ = write!(text, "{space}{lon},{lat}");
    }
    text.push_str("</coordinates>");
    text
}

/// The polygon around a circle: a picture for other programs, with the circle inside it, on a
/// sphere of the Earth's mean radius. Vertices beyond the poles or the antimeridian stay at the
/// edge of the map.
fn outline(centre: LatLon, radius: f64) -> Vec<LatLon> {
    let step = std::f64::consts::TAU / f64::from(CIRCLE_CORNERS);
    let angle = radius / (step / 2.0).cos() / 6_371_008.8;
    let north = angle.to_degrees();
    let east = north / centre.lat().to_radians().cos().max(1e-6);
    let corner = |index: u32| {
        let (sin, cos) = (f64::from(index) * step).sin_cos();
        let lat = (centre.lat() + north * sin).clamp(-90.0, 90.0);
        let lon = (centre.lon() + east * cos).clamp(-180.0, 180.0);
        LatLon::new(lat, lon).unwrap_or(centre)
    };
    (0..CIRCLE_CORNERS).map(corner).collect()
}
