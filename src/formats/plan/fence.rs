//! The geoFence of a `.plan`: polygons and circles, either inclusion or exclusion.

use serde::Deserialize;

use super::read::{Number, check_version, place_with_altitude};
use crate::fence::items::{distinct_ring, radius};
use crate::fence::{FenceRegion, FenceRole, FenceSet, FenceShape};
use crate::formats::error::{Located, Place, Problem};
use crate::formats::item::place;
use crate::formats::{MAX_REGIONS, MAX_VERTICES};
use crate::geodesy::LatLon;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct GeoFence {
    version: Number,
    #[serde(default)]
    polygons: Vec<FencePolygon>,
    #[serde(default)]
    circles: Vec<FenceCircle>,
    breach_return: Option<Vec<Number>>,
    /// Version 1: one inclusion polygon.
    polygon: Option<Vec<Vec<f64>>>,
}

#[derive(Deserialize)]
struct FencePolygon {
    polygon: Vec<Vec<f64>>,
    inclusion: bool,
}

#[derive(Deserialize)]
struct FenceCircle {
    circle: Circle,
    inclusion: bool,
}

#[derive(Deserialize)]
struct Circle {
    center: Vec<f64>,
    radius: f64,
}

pub(super) fn read_fence(
    name: &str,
    fence: GeoFence,
    warnings: &mut Vec<String>,
) -> Result<FenceSet, Located> {
    let GeoFence { version, mut polygons, circles, breach_return, polygon } = fence;
    if let Some(polygon) = polygon {
        if !polygon.is_empty() {
            warnings.push(
                "geoFence polygon 1: a fence of version 1, read as an inclusion area".to_owned(),
            );
            polygons.insert(0, FencePolygon { polygon, inclusion: true });
        }
    } else {
        check_version(version, "the geoFence")?;
    }
    if polygons.len() + circles.len() > MAX_REGIONS {
        return Err(Problem::TooMany { what: "fence regions", limit: MAX_REGIONS }.into());
    }
    if polygons.iter().map(|polygon| polygon.polygon.len()).sum::<usize>() > MAX_VERTICES {
        return Err(Problem::TooMany { what: "fence vertices", limit: MAX_VERTICES }.into());
    }
    let mut fences = FenceSet::default();
    for (index, FencePolygon { polygon, inclusion }) in polygons.iter().enumerate() {
        let here = Place::FencePolygon(index + 1);
        let origin = format!("{name} {here}");
        let ring = ring(polygon).map_err(|problem| problem.at(here))?;
        let shape = FenceShape::Polygon(ring);
        fences.regions.push(FenceRegion { role: role(*inclusion), shape, heights: None, origin });
    }
    for (index, FenceCircle { circle, inclusion }) in circles.iter().enumerate() {
        let here = Place::FenceCircle(index + 1);
        let origin = format!("{name} {here}");
        let shape = read_circle(circle).map_err(|problem| problem.at(here))?;
        fences.regions.push(FenceRegion { role: role(*inclusion), shape, heights: None, origin });
    }
    if let Some(point) = breach_return {
        fences.return_point = place_with_altitude("return point", &point)
            .map_err(|problem| problem.at(Place::ReturnPoint))?;
    }
    Ok(fences)
}

fn role(inclusion: bool) -> FenceRole {
    if inclusion { FenceRole::Inclusion } else { FenceRole::Exclusion }
}

fn ring(vertices: &[Vec<f64>]) -> Result<Vec<LatLon>, Problem> {
    let vertex = |(index, vertex): (usize, &Vec<f64>)| {
        let what = format!("vertex {}", index + 1);
        match vertex[..] {
            [lat, lon, ..] => place(&what, lat, lon),
            _ => Err(Problem::Value {
                what,
                found: format!("{} numbers", vertex.len()),
                expected: "[latitude, longitude]",
            }),
        }
    };
    let ring: Vec<_> = vertices.iter().enumerate().map(vertex).collect::<Result<_, _>>()?;
    if ring.len() < 3 {
        return Err(Problem::Value {
            what: "the number of vertices".to_owned(),
            found: ring.len().to_string(),
            expected: "at least 3; draw the polygon again or delete it",
        });
    }
    Ok(distinct_ring(ring))
}

fn read_circle(circle: &Circle) -> Result<FenceShape, Problem> {
    let [lat, lon, ..] = circle.center[..] else {
        return Err(Problem::Value {
            what: "the centre".to_owned(),
            found: format!("{} numbers", circle.center.len()),
            expected: "[latitude, longitude]",
        });
    };
    let centre = place("centre", lat, lon)?;
    let radius = radius(circle.radius).map_err(|_| Problem::Value {
        what: "the radius".to_owned(),
        found: format!("{} m", circle.radius),
        expected: "positive and at most 8000 km",
    })?;
    Ok(FenceShape::Circle { centre, radius })
}
