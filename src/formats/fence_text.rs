//! ArduPilot's old fence text: one `latitude longitude` per line, first the point to return to
//! after a breach, then the vertices of the inclusion polygon with the first one repeated at the
//! end. (The new form is `QGC WPL 110`, see [`super::waypoints`].)

use super::error::{Located, Place, Problem};
use super::item::place;
use super::{MAX_VERTICES, Scenario};
use crate::fence::items::distinct_ring;
use crate::fence::{FenceRegion, FenceRole, FenceSet, FenceShape};

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
        heights: None,
        origin: format!("{name} fence polygon"),
    };
    let fences = FenceSet { regions: vec![region], return_point };
    Ok(Scenario { fences, warnings, ..Scenario::default() })
}
