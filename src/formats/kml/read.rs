//! Reading KML, in one pass over its XML without recursion.

use std::borrow::Cow;
use std::collections::BTreeMap;

use quick_xml::Reader;
use quick_xml::events::{BytesRef, BytesStart, Event};
use serde_json::{Map, Value};

use super::write::name_of;
use crate::formats::Scenario;
use crate::formats::error::{Located, Place, Problem};
use crate::formats::feature::{Feature, Shape, Want, positions, scenario};
use crate::geodesy::LatLon;

/// Elements inside each other; Google Earth's own files stay below 20.
const MAX_DEPTH: usize = 256;

/// Elements whose obstacles, if any, are not in this file or are no area.
const NOT_READ: [&str; 6] =
    ["NetworkLink", "GroundOverlay", "PhotoOverlay", "Model", "Track", "MultiTrack"];

pub(in crate::formats) fn read(name: &str, text: &str, want: Want) -> Result<Scenario, Located> {
    let mut xml = Reader::from_str(text);
    xml.config_mut().expand_empty_elements = true;
    let mut state = State::default();
    loop {
        let event = xml.read_event();
        // Only looked up for a message.
        let line = || Place::Line(line_at(text, xml.buffer_position()));
        match event.map_err(|error| Problem::Xml(error.to_string()).at(line()))? {
            Event::Start(start) => state.open(&start).map_err(|problem| problem.at(line()))?,
            Event::End(_) => state.close()?,
            Event::Text(content) => state.text.push_str(&lossy(&content)),
            Event::CData(content) => state.text.push_str(&lossy(&content)),
            Event::GeneralRef(reference) => state.text.push_str(&resolved(&reference)),
            Event::Eof if state.path.is_empty() => break,
            Event::Eof => {
                let open = state.path.last().map_or("", String::as_str);
                return Err(Problem::Xml(format!("the file ends inside <{open}>")).at(line()));
            }
            Event::Empty(_)
            | Event::Comment(_)
            | Event::Decl(_)
            | Event::PI(_)
            | Event::DocType(_) => {}
        }
    }
    if !state.is_kml {
        return Err(Problem::UnknownFormat.into());
    }
    let mut read = scenario(name, state.features, want, false)?;
    for (element, count) in state.not_read {
        read.warnings.push(format!(
            "{count} elements <{element}> are not read; if there are obstacles in them, draw them as \
             polygons"
        ));
    }
    Ok(read)
}

fn line_at(text: &str, position: u64) -> usize {
    let position = usize::try_from(position).unwrap_or(usize::MAX).min(text.len());
    text.as_bytes()[..position].iter().filter(|byte| **byte == b'\n').count() + 1
}

fn lossy(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// An attribute's value; as it stands where a reference in it is broken.
fn unescaped(value: &str) -> String {
    quick_xml::escape::unescape(value).map_or_else(|_| value.to_owned(), Cow::into_owned)
}

/// The character of `&amp;`, `&#65;` and their like; nothing for an entity that XML does not define.
fn resolved(reference: &BytesRef) -> String {
    if let Ok(Some(character)) = reference.resolve_char_ref() {
        return character.to_string();
    }
    let name = lossy(reference);
    quick_xml::escape::resolve_xml_entity(&name).unwrap_or_default().to_owned()
}

/// Where in the document the reader is, and what it has found.
#[derive(Default)]
struct State {
    path: Vec<String>,
    /// Text of the innermost element since its start tag.
    text: String,
    is_kml: bool,
    features: Vec<Feature>,
    /// How many there are of each element of [`NOT_READ`].
    not_read: BTreeMap<String, usize>,
    placemark: Option<Placemark>,
    placemarks: usize,
}

/// The placemark being read.
struct Placemark {
    /// Length of the path at its start tag.
    depth: usize,
    number: usize,
    name: Option<String>,
    properties: Map<String, Value>,
    /// The name of the `Data` or `SimpleData` element being read.
    data_name: Option<String>,
    shapes: Vec<Shape>,
    outer: Option<Vec<LatLon>>,
    holes: Vec<Vec<LatLon>>,
    /// The text of `altitudeMode` in the polygon being read; `None`: clamped to the ground.
    altitude_mode: Option<String>,
    /// How high the polygons so far reach.
    heights: Heights,
}

/// What is known of the heights of a placemark's polygons.
#[derive(Default)]
enum Heights {
    /// No polygon yet.
    #[default]
    None,
    /// The highest vertex, and the `height_reference` of them all.
    UpTo(f64, &'static str),
    /// Not known, or they differ in what they are measured from.
    Unknown,
}

impl Heights {
    /// Takes in a polygon with the lowest and highest altitude of its vertices.
    fn add(&mut self, mode: Option<&str>, altitudes: Option<(f64, f64)>) {
        let reference = match mode {
            Some("relativeToGround") => Some("ground"),
            Some("absolute") => Some("amsl"),
            _ => None,
        };
        let polygon = match (reference, altitudes) {
            // A vertex on the ground is one whose altitude was not given.
            (Some(reference), Some((low, high))) if low > 0.0 => Some((high, reference)),
            _ => None,
        };
        *self = match (&*self, polygon) {
            (Self::None, Some((high, reference))) => Self::UpTo(high, reference),
            (&Self::UpTo(before, known), Some((high, reference))) if known == reference => {
                Self::UpTo(before.max(high), reference)
            }
            _ => Self::Unknown,
        };
    }
}

impl State {
    fn open(&mut self, start: &BytesStart) -> Result<(), Problem> {
        let name = lossy(start.local_name().as_ref());
        if self.path.len() >= MAX_DEPTH {
            return Err(Problem::TooMany {
                what: "XML elements inside each other",
                limit: MAX_DEPTH,
            });
        }
        self.text.clear();
        if self.path.is_empty() {
            self.is_kml = name == "kml";
        }
        if NOT_READ.contains(&name.as_str()) {
            *self.not_read.entry(name.clone()).or_default() += 1;
        }
        // Geometry outside a placemark is not KML, but an obstacle all the same.
        let geometry = ["Polygon", "LineString", "LinearRing", "Point"].contains(&name.as_str());
        if self.placemark.is_none() && (name == "Placemark" || geometry) {
            self.placemarks += 1;
            self.placemark = Some(Placemark {
                depth: self.path.len(),
                number: self.placemarks,
                name: None,
                properties: Map::new(),
                data_name: None,
                shapes: Vec::new(),
                outer: None,
                holes: Vec::new(),
                altitude_mode: None,
                heights: Heights::None,
            });
        }
        if let (Some(placemark), "Data" | "SimpleData") = (&mut self.placemark, name.as_str()) {
            let attribute = start.try_get_attribute("name").ok().flatten();
            let attribute = attribute.map(|attribute| unescaped(&lossy(&attribute.value)));
            placemark.data_name = attribute;
        }
        self.path.push(name);
        Ok(())
    }

    fn close(&mut self) -> Result<(), Located> {
        // The parser has matched the names of start and end tag.
        let Some(name) = self.path.pop() else { return Ok(()) };
        let text = std::mem::take(&mut self.text);
        let Some(placemark) = &mut self.placemark else { return Ok(()) };
        let open = self.path.get(placemark.depth..).unwrap_or_default();
        let closed = placemark.close(open, &name, &text);
        closed.map_err(|problem| problem.at(placemark.feature().place))?;
        if self.path.len() == placemark.depth {
            let shapes = std::mem::take(&mut placemark.shapes);
            self.features.push(Feature { shapes, ..placemark.feature() });
            self.placemark = None;
        }
        Ok(())
    }
}

impl Placemark {
    fn feature(&self) -> Feature {
        let mut properties = self.properties.clone();
        let given = |key: &&str| properties.contains_key(*key);
        if let Heights::UpTo(top, reference) = self.heights
            && !["height", "max_height", "min_height", "height_reference"].iter().any(given)
        {
            properties.insert("height".to_owned(), top.into());
            properties.insert("height_reference".to_owned(), reference.into());
        }
        // A name that quavd's own writer made of the other properties says nothing.
        let ours = name_of(&properties);
        if let Some(name) = self.name.as_ref().filter(|name| Some(*name) != ours.as_ref()) {
            properties.entry("name").or_insert_with(|| Value::String(name.clone()));
        }
        Feature::named("placemark", self.number, properties, self.name.as_deref())
    }

    /// Takes in the element `name` with its text; `open` are the elements around it, from the
    /// placemark inwards.
    fn close(&mut self, open: &[String], name: &str, text: &str) -> Result<(), Problem> {
        let within = |element: &str| open.iter().any(|open| open == element);
        match (open.last().map_or("", String::as_str), name) {
            ("Placemark", "name") => self.name = Some(text.to_owned()),
            ("Data", "value") | (_, "SimpleData") => {
                if let Some(key) = self.data_name.take() {
                    self.properties.insert(key, value(text.trim()));
                }
            }
            (_, "altitudeMode") => self.altitude_mode = Some(text.trim().to_owned()),
            (_, "coordinates") => {
                let (line, altitudes) = coordinates(text)?;
                let outline = within("LinearRing") && !within("innerBoundaryIs");
                if outline {
                    self.heights.add(self.altitude_mode.as_deref(), altitudes);
                }
                if within("innerBoundaryIs") {
                    self.holes.push(line);
                } else if within("Polygon") {
                    if self.outer.replace(line).is_some() {
                        let what = "a polygon has two outlines".to_owned();
                        return Err(Problem::Conflict { what, advice: "make it two polygons" });
                    }
                } else if within("Point") {
                    self.shapes.extend(line.into_iter().map(Shape::Point));
                } else if within("LinearRing") {
                    self.shapes.push(Shape::Polygon { outer: line, holes: Vec::new() });
                } else {
                    self.shapes.push(Shape::Line(line));
                }
            }
            (_, "Polygon") => {
                let outer = self.outer.take().ok_or_else(|| Problem::Missing {
                    what: "outline of a polygon".to_owned(),
                    advice: "draw it again or delete it",
                })?;
                let holes = std::mem::take(&mut self.holes);
                self.altitude_mode = None;
                self.shapes.push(Shape::Polygon { outer, holes });
            }
            // The mode is that of one geometry, also where several stand in a placemark.
            (_, "Point" | "LineString" | "LinearRing") if !within("Polygon") => {
                self.altitude_mode = None;
            }
            _ => {}
        }
        Ok(())
    }
}

/// A lowest and a highest altitude, metres.
type LowHigh = (f64, f64);

/// `lon,lat[,altitude]` tuples separated by white space: the positions, and their lowest and highest
/// altitude where each of them has one.
fn coordinates(text: &str) -> Result<(Vec<LatLon>, Option<LowHigh>), Problem> {
    let tuple = |(index, tuple): (usize, &str)| {
        let numbers: Result<Vec<f64>, _> = tuple.split(',').map(str::parse).collect();
        numbers.map_err(|_| Problem::Value {
            what: format!("vertex {}", index + 1),
            found: format!("{tuple:?}"),
            expected: "longitude,latitude without a space inside",
        })
    };
    let tuples = text.split_whitespace().enumerate().map(tuple).collect::<Result<Vec<_>, _>>()?;
    let altitudes = tuples.iter().map(|tuple| tuple.get(2).copied().filter(|z| z.is_finite()));
    let altitudes = altitudes.collect::<Option<Vec<f64>>>().filter(|all| !all.is_empty());
    let altitudes = altitudes.map(|all| {
        all.iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &z| (low.min(z), high.max(z)))
    });
    Ok((positions("vertex", tuples.iter().map(Vec::as_slice))?, altitudes))
}

/// Extended data is text; numbers, lists and flags are taken as such.
fn value(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|_| Value::String(text.to_owned()))
}
