//! The regions grown by the buffer (an inclusion: shrunk), as polygons, for pictures.
//!
//! Edges of the result are never nearer to the region than asked: `geo` rounds corners with
//! chords, which fall short of the arc, so the distance is made up for that.

use geo::algorithm::buffer::{BufferStyle, LineJoin};
use geo::{Area, Buffer, MultiPolygon, Point, Polygon};

use super::outline::Outline;

/// The angle of one chord of a rounded corner, radians.
const CHORD: f64 = 0.05;

/// Made up for the grid that the overlay rounds to, metres.
const GRID: f64 = 1e-3;

/// How far a polygon that stands for a circle may be from it, metres: less than what a proof
/// leaves for rounding.
const ROUND: f64 = 5e-3;

/// A region grown (an obstacle) or shrunk (an inclusion) by `margin` metres. An inclusion that
/// is too narrow for the margin gives no polygon, one with a waist several.
#[must_use]
pub fn buffered(outline: &Outline, margin: f64) -> MultiPolygon {
    match outline {
        // Not left to the overlay, which has no need to take nothing.
        Outline::Solid(rings) if rings.is_empty() => MultiPolygon::new(Vec::new()),
        Outline::Solid(rings) => {
            let polygons = rings.iter().map(|ring| polygon(ring)).collect::<Vec<_>>();
            MultiPolygon::new(polygons).buffer_with_style(rounded(margin))
        }
        Outline::Zone(ring) => {
            let zone = polygon(ring);
            let shrunk = zone.buffer_with_style(rounded(-margin));
            shrunk.0.into_iter().filter(|part| part.unsigned_area() > 0.0).collect()
        }
        Outline::SolidDisc { centre, radius } => disc(Point::from(*centre), radius + margin, true),
        Outline::ZoneDisc { centre, radius } => disc(Point::from(*centre), radius - margin, false),
    }
}

/// A union of inclusions shrunk by `margin` metres.
#[must_use]
pub fn shrunk_union(union: &MultiPolygon, margin: f64) -> MultiPolygon {
    union.buffer_with_style(rounded(-margin))
}

fn polygon(ring: &[geo::Coord]) -> Polygon {
    Polygon::new(ring.iter().copied().collect(), vec![])
}

fn rounded(margin: f64) -> BufferStyle<f64> {
    // A chord of angle φ on radius r comes as near as r·cos(φ/2). `geo` divides a turn into
    // floor(turn / CHORD) chords, at least one: they are up to twice as long as asked.
    BufferStyle::new(margin / CHORD.cos() + GRID).line_join(LineJoin::Round(CHORD))
}

/// So many sides that a regular polygon is nowhere further than [`ROUND`] from its circle.
pub(super) fn sides(radius: f64) -> u32 {
    let sides = std::f64::consts::PI / (2.0 * ROUND / radius).sqrt();
    sides.ceil().clamp(16.0, 65_536.0) as u32
}

/// A regular polygon around (`outside`) or within a circle.
fn disc(centre: Point, radius: f64, outside: bool) -> MultiPolygon {
    if radius <= 0.0 {
        return MultiPolygon::new(Vec::new());
    }
    let sides = sides(radius);
    let step = std::f64::consts::TAU / f64::from(sides);
    let reach = if outside { radius / (step / 2.0).cos() } else { radius };
    let rim = (0..sides).map(|i| {
        let (sin, cos) = (step * f64::from(i)).sin_cos();
        geo::Coord { x: centre.x() + reach * cos, y: centre.y() + reach * sin }
    });
    MultiPolygon::new(vec![Polygon::new(rim.collect(), vec![])])
}

#[cfg(test)]
mod tests {
    use geo::{Distance, Euclidean};
    use proptest::prelude::*;

    use super::*;
    use crate::geodesy::Xy;

    #[test]
    fn a_polygon_of_a_circle_of_any_size_is_next_to_it() {
        for radius in [0.2, 5.0, 700.0, 50_000.0] {
            let centre = Xy { x: 3.0, y: 4.0 };
            let solid = Outline::SolidDisc { centre, radius };
            let zone = Outline::ZoneDisc { centre, radius: radius + 10.0 };
            for grown in [buffered(&solid, 5.0), buffered(&zone, 5.0)] {
                for point in grown.iter().flat_map(|part| part.exterior().points()) {
                    let off = Euclidean.distance(point, Point::from(centre)) - radius - 5.0;
                    assert!(off.abs() < 0.01, "{radius} {off}");
                }
            }
        }
    }

    proptest! {
        #[test]
        fn a_buffered_edge_is_never_nearer_than_asked(
            radii in prop::collection::vec(5.0f64..60.0, 3..12), margin in 0.5f64..30.0,
        ) {
            let n = radii.len() as f64;
            let ring: Vec<Xy> = radii.iter().enumerate().map(|(i, r)| {
                let angle = std::f64::consts::TAU * i as f64 / n;
                Xy { x: r * angle.cos(), y: r * angle.sin() }
            }).collect();
            let original = polygon(&ring);
            let grown = buffered(&Outline::Solid(vec![ring]), margin);
            prop_assert!(!grown.0.is_empty());
            for polygon in &grown {
                for line in polygon.exterior().lines() {
                    let nearest = Euclidean.distance(&line, original.exterior());
                    prop_assert!(nearest >= margin, "{}", nearest);
                }
            }
        }
    }
}
