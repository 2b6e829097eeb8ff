//! ArduPilot's old fence text: one `latitude longitude` per line, first the point to return to
//! after a breach, then the vertices of the inclusion polygon with the first one repeated at the
//! end. (The new form is `QGC WPL 110`, see [`super::waypoints`].) Old rally text is of the same age: one
//! `RALLY latitude longitude altitude break_altitude land_direction flags` per line.

use std::fmt::Write as _;

use super::error::{Located, Place, Problem, WriteError};
use super::item::{FileItem, place};
use super::{MAX_ITEMS, MAX_VERTICES, Scenario};
use crate::fence::items::distinct_ring;
use crate::fence::{FenceRegion, FenceRole, FenceSet, FenceShape};
use crate::mission::{Command, Frame};

/// Whether a line is two numbers, as every line of this format is.
pub(super) fn is_position(line: &str) -> bool {
    let mut numbers = line.split_whitespace().map(str::parse::<f64>);
    matches!((numbers.next(), numbers.next(), numbers.next()), (Some(Ok(_)), Some(Ok(_)), None))
}

pub(super) fn read(name: &str, text: &str) -> Result<Scenario, Located> {
    let mut points = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let (line, at) = (line.trim(), Place::Line(index + 1));
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        if points.len() > MAX_VERTICES {
            return Err(Problem::TooMany { what: "vertices", limit: MAX_VERTICES }.at(at));
        }
        let numbers: Vec<_> = line.split_whitespace().map(str::parse::<f64>).collect();
        let [Ok(lat), Ok(lon)] = numbers[..] else {
            let problem = Problem::Value {
                what: "this line of fence text".to_owned(),
                found: format!("{line:?}"),
                expected: "a latitude and a longitude in degrees",
            };
            return Err(problem.at(at));
        };
        points.push(place("position", lat, lon).map_err(|problem| problem.at(at))?);
    }
    let mut warnings = Vec::new();
    let closed = |ring: &[_]| ring.len() > 3 && ring.first() == ring.last();
    // Without the return point the first line is the first vertex and the last line repeats it.
    let (return_point, ring) = match points.split_first() {
        Some((_, ring)) if closed(&points) && !closed(ring) => {
            warnings.push(
                "the fence text has no return point: its first line begins the polygon".to_owned(),
            );
            (None, &points[..ring.len() + 1])
        }
        Some((first, ring)) => (Some((*first, 0.0)), ring),
        None => (None, &points[..]),
    };
    if ring.len() < 3 {
        return Err(Problem::Value {
            what: "the number of vertices after the return point".to_owned(),
            found: ring.len().to_string(),
            expected: "at least 3",
        }
        .into());
    }
    if return_point.is_some() && !closed(ring) {
        warnings.push(
            "the fence text does not repeat its first vertex at the end; its first line is taken \
             as the return point, not as a vertex"
                .to_owned(),
        );
    }
    let region = FenceRegion {
        role: FenceRole::Inclusion,
        shape: FenceShape::Polygon(distinct_ring(ring.to_vec())),
        origin: format!("{name} fence polygon"),
    };
    let fences = FenceSet { regions: vec![region], return_point };
    Ok(Scenario { fences, warnings, ..Scenario::default() })
}

/// Whether a line is a rally point in the old text.
pub(super) fn is_rally(line: &str) -> bool {
    line.split_whitespace().next() == Some("RALLY")
}

/// Old rally text. Altitudes are above home; break altitude, landing direction and flags, which
/// say how a fixed wing lands there, are not kept.
pub(super) fn read_rally(text: &str) -> Result<Scenario, Located> {
    let mut scenario = Scenario::default();
    for (index, line) in text.lines().enumerate() {
        let (line, at) = (line.trim(), Place::Line(index + 1));
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let seq = scenario.rally.len();
        if seq >= MAX_ITEMS {
            return Err(Problem::TooMany { what: "rally points", limit: MAX_ITEMS }.at(at));
        }
        let words = line.split_whitespace().skip(1);
        let numbers: Vec<_> = words.map(str::parse::<f64>).collect();
        let (true, [Ok(lat), Ok(lon), Ok(altitude), ..]) = (is_rally(line), &numbers[..]) else {
            let problem = Problem::Value {
                what: "this line of rally text".to_owned(),
                found: format!("{line:?}"),
                expected: "RALLY latitude longitude altitude",
            };
            return Err(problem.at(at));
        };
        place("position", *lat, *lon).map_err(|problem| problem.at(at.clone()))?;
        let item = FileItem {
            command: Command::NAV_RALLY_POINT.0,
            frame: Frame::GLOBAL_RELATIVE_ALT.0,
            params: [0.0, 0.0, 0.0, 0.0, *lat, *lon, *altitude],
            autocontinue: true,
        };
        // Below MAX_ITEMS, so it fits 16 bits.
        scenario.rally.push(item.to_item(seq as u16).map_err(|problem| problem.at(at))?);
    }
    Ok(scenario)
}

/// The fence in the old text: what ArduPilot's first fences could be, one inclusion polygon and a
/// return point (whose altitude the text does not hold).
///
/// # Errors
/// [`WriteError::FenceText`] where the fence is anything else.
pub fn write_fence_text(fences: &FenceSet) -> Result<String, WriteError> {
    let refused = |what: &str| WriteError::FenceText { what: what.to_owned() };
    let [region] = &fences.regions[..] else {
        return Err(refused(&format!("{} regions", fences.regions.len())));
    };
    let ring = match (region.role, &region.shape) {
        (FenceRole::Inclusion, FenceShape::Polygon(ring)) if ring.len() >= 3 => ring,
        (FenceRole::Inclusion, _) => return Err(refused("a circle")),
        (FenceRole::Exclusion, _) => return Err(refused("an exclusion")),
    };
    let Some((return_point, _)) = fences.return_point else {
        return Err(refused("no return point"));
    };
    let mut text = String::new();
    for position in std::iter::once(&return_point).chain(ring).chain(ring.first()) {
        let e7 = position.to_e7();
        let (lat, lon) = (f64::from(e7.lat) / 1e7, f64::from(e7.lon) / 1e7);
        // Writing into a String cannot fail.
        let _ = writeln!(text, "{lat:.7} {lon:.7}");
    }
    Ok(text)
}
