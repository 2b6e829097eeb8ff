//! GeoJSON features and KML placemarks are the same thing in two syntaxes: a shape with
//! properties. This file holds that common form; [`read`] makes a scenario of features
//! ([`properties`] says what each is, [`heights`] how high, [`order`] in which order they are flown),
//! [`write`] the reverse.
//!
//! Properties that are read (in KML: `ExtendedData`):
//!
//! | property | on | meaning |
//! |---|---|---|
//! | `role` | point | `start`, `goal`, `waypoint`, `home`, `rally`, `return` (of the fence) |
//! | `role` | area | `obstacle` or `exclusion` (the default), `inclusion` |
//! | `fence` | area | `inclusion` or `exclusion`; the same as `role` |
//! | `inclusion` | area | `true` or `false`; the same again |
//! | `radius` | point | metres: the point is a circle |
//! | `height`, `max_height` | obstacle | its upper end, metres; the larger where both are given |
//! | `min_height` | obstacle | its lower end, metres; without it, it stands on the ground |
//! | `height_reference` | obstacle | what these are above: `ground` (the default) or `amsl` |
//! | `seq` | point | place in the order of the route |
//! | `altitude` | point | metres above home (default [`DEFAULT_ROUTE_ALTITUDE`]) |
//! | `name` | all | what messages call it |
//!
//! A line, or points, are a route: the first is a takeoff and home, the others are waypoints, in
//! `MAV_FRAME_GLOBAL_RELATIVE_ALT`. A point with `command`, `frame` and `params` is that mission
//! item. A line with role `track` is a picture of the route and not read.

mod heights;
mod order;
mod properties;
mod read;
#[cfg(test)]
mod tests;
mod write;

use serde_json::{Map, Value};

use super::error::{Place, Problem};
use super::item::place;
use crate::geodesy::LatLon;

pub(super) use read::scenario;
pub(super) use write::features;

/// Altitude above home of a route that does not say one, metres: QGroundControl's default.
pub const DEFAULT_ROUTE_ALTITUDE: f32 = 50.0;

/// The longest name that a message shows, characters.
const MAX_NAME: usize = 60;

/// A GeoJSON feature or KML placemark.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Feature {
    pub(super) place: Place,
    pub(super) properties: Map<String, Value>,
    pub(super) shapes: Vec<Shape>,
}

/// One shape of a feature; a multi-shape is several.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shape {
    Point(LatLon),
    Line(Vec<LatLon>),
    Polygon { outer: Vec<LatLon>, holes: Vec<Vec<LatLon>> },
}

/// What a file is read for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Want {
    /// Mission, fences and rally points.
    Everything,
    /// Fences only: lines and points are left out with a warning.
    Fences,
}

impl Feature {
    /// A feature named after its properties, or `name`.
    pub(super) fn named(
        kind: &'static str,
        number: usize,
        properties: Map<String, Value>,
        name: Option<&str>,
    ) -> Self {
        let name = name.or_else(|| properties.get("name").and_then(Value::as_str));
        let name = name.map(printable).filter(|name| !name.is_empty());
        Self { place: Place::Feature { kind, number, name }, properties, shapes: Vec::new() }
    }
}

/// A name fit for one line of a message.
fn printable(name: &str) -> String {
    let words: Vec<_> = name.split_whitespace().collect();
    words.join(" ").chars().filter(|c| !c.is_control()).take(MAX_NAME).collect()
}

/// Checked positions from `[lon, lat, ...]` lists.
pub(super) fn positions<'a>(
    what: &str,
    coordinates: impl IntoIterator<Item = &'a [f64]>,
) -> Result<Vec<LatLon>, Problem> {
    let position = |(index, coordinate)| position(&format!("{what} {}", index + 1), coordinate);
    coordinates.into_iter().enumerate().map(position).collect()
}

/// A checked position from `[lon, lat, ...]`.
pub(super) fn position(what: &str, coordinate: &[f64]) -> Result<LatLon, Problem> {
    match *coordinate {
        [lon, lat, ..] => place(what, lat, lon),
        _ => Err(Problem::Value {
            what: what.to_owned(),
            found: format!("{} numbers", coordinate.len()),
            expected: "longitude and latitude",
        }),
    }
}
