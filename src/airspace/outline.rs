//! One fence region, projected and made planar. A region is never dropped: what cannot be used
//! is an error that names it, and what is odd (a ring that crosses itself, a ring without area)
//! still bars the way.

use geo::{Area, Buffer, LineString, Polygon};

use super::long_edges::projected;
use crate::fence::{FenceRegion, FenceRole, FenceShape};
use crate::geodesy::{LocalFrame, ProjectionError, Xy};

/// A region in the plane.
#[derive(Debug, Clone, PartialEq)]
pub enum Outline {
    /// An obstacle: simple rings, counter-clockwise, not closed; the inside is forbidden. A
    /// region whose ring crosses itself has one ring for each of its outer outlines.
    Solid(Vec<Vec<Xy>>),
    /// A round obstacle.
    SolidDisc {
        /// Its centre.
        centre: Xy,
        /// Its radius, metres.
        radius: f64,
    },
    /// An inclusion polygon, counter-clockwise where it is simple, not closed. Inside is decided
    /// by the even-odd rule, as ArduPilot and PX4 do, and every edge is a wall.
    Zone(Vec<Xy>),
    /// An inclusion circle.
    ZoneDisc {
        /// Its centre.
        centre: Xy,
        /// Its radius, metres.
        radius: f64,
    },
}

/// A region that cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{origin}: {problem}")]
pub struct AirspaceError {
    /// What the region is called: see [`FenceRegion::origin`].
    pub origin: String,
    /// What is wrong with it.
    pub problem: RegionProblem,
}

/// What is wrong with a region.
#[derive(Debug, thiserror::Error)]
pub enum RegionProblem {
    /// A polygon needs three vertices.
    #[error("a polygon needs at least 3 vertices, this one has {0}; correct or remove it")]
    TooFewVertices(usize),
    /// More vertices than quavd takes.
    #[error(
        "a polygon of {0} vertices is more than the {MAX_VERTICES} that are taken; simplify it"
    )]
    TooManyVertices(usize),
    /// A circle's radius is not a positive number.
    #[error("a circle's radius must be a positive number of metres, this one is {0}")]
    Radius(f64),
    /// It is too far from the leg for the leg's zone.
    #[error(transparent)]
    Projection(#[from] ProjectionError),
    /// The outline of a ring that crosses itself could not be found.
    #[error(
        "its ring crosses itself and its outline could not be found; draw it as simple polygons"
    )]
    NoOutline,
    /// Several inclusions are joined by `any`, and this one crosses itself.
    #[error(
        "its ring crosses itself, which has no meaning with --inclusion any; draw it as simple polygons"
    )]
    CrossingZone,
}

/// The most vertices one polygon may have.
pub const MAX_VERTICES: usize = 200_000;

/// The thickness, in metres, that a ring without area gets so that it is still a wall.
const WALL_THICKNESS: f64 = 1e-3;

/// Projects a region and makes it planar. The second value is a warning, where there is one.
///
/// Repeated vertices and either winding are fine. Circles are measured with the scale of their
/// surroundings: an exclusion is never smaller, an inclusion never larger than it is on the ground.
///
/// # Errors
/// [`AirspaceError`] where the region cannot be used.
pub fn outline(
    region: &FenceRegion,
    frame: &LocalFrame,
) -> Result<(Outline, Option<String>), AirspaceError> {
    let fail = |problem| AirspaceError { origin: region.origin.clone(), problem };
    match &region.shape {
        FenceShape::Circle { centre, radius } => {
            if !(radius.0.is_finite() && radius.0 > 0.0) {
                return Err(fail(RegionProblem::Radius(radius.0)));
            }
            let exclusion = region.role == FenceRole::Exclusion;
            let project = || -> Result<(Xy, f64), ProjectionError> {
                let middle = frame.to_local(*centre)?;
                let mut scale = frame.relative_scale(*centre)?;
                for (dx, dy) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
                    let rim = middle + Xy { x: dx, y: dy } * radius.0;
                    let rim_scale = frame.relative_scale(frame.to_position(rim)?)?;
                    scale = if exclusion { scale.max(rim_scale) } else { scale.min(rim_scale) };
                }
                Ok((middle, radius.0 * scale))
            };
            let (centre, radius) = project().map_err(|cause| fail(cause.into()))?;
            Ok(match region.role {
                FenceRole::Exclusion => (Outline::SolidDisc { centre, radius }, None),
                FenceRole::Inclusion => (Outline::ZoneDisc { centre, radius }, None),
            })
        }
        FenceShape::Polygon(vertices) => {
            match vertices.len() {
                0..3 => return Err(fail(RegionProblem::TooFewVertices(vertices.len()))),
                n if n > MAX_VERTICES => return Err(fail(RegionProblem::TooManyVertices(n))),
                _ => {}
            }
            let forbidden = region.role == FenceRole::Exclusion;
            let points =
                projected(vertices, forbidden, frame).map_err(|cause| fail(cause.into()))?;
            if points.len() > MAX_VERTICES {
                return Err(fail(RegionProblem::TooManyVertices(points.len())));
            }
            polygon_outline(region, points).map_err(fail)
        }
    }
}

fn polygon_outline(
    region: &FenceRegion,
    points: Vec<Xy>,
) -> Result<(Outline, Option<String>), RegionProblem> {
    let mut ring = without_repeats(points);
    let simple = is_simple(&ring);
    if simple && signed_area(&ring) < 0.0 {
        ring.reverse();
    }
    let origin = &region.origin;
    match (region.role, simple) {
        (FenceRole::Inclusion, true) => Ok((Outline::Zone(ring), None)),
        (FenceRole::Inclusion, false) => {
            let warning = format!(
                "{origin}: the inclusion ring crosses or touches itself; inside is taken by the \
                 even-odd rule and every edge is a wall"
            );
            Ok((Outline::Zone(ring), Some(warning)))
        }
        (FenceRole::Exclusion, true) => Ok((Outline::Solid(vec![ring]), None)),
        (FenceRole::Exclusion, false) => {
            let rings = shells(&ring)?;
            // What the thickened edges alone would cover, with some allowance for their ends.
            let bare = 4.0 * WALL_THICKNESS * (perimeter(&ring) + 4.0 * WALL_THICKNESS);
            let flat = rings.iter().map(|shell| signed_area(shell)).sum::<f64>() <= bare;
            let warning = if flat {
                format!("{origin}: the ring has no area; it is kept as a wall")
            } else {
                format!("{origin}: the ring crosses or touches itself; all its faces are obstacle")
            };
            Ok((Outline::Solid(rings), Some(warning)))
        }
    }
}

/// The outer outlines of what a ring's edges enclose: every bounded face counts as inside.
///
/// The edges are thickened by a hair and the holes of the result filled, which is the union of
/// all faces with the edges themselves; it works for rings without any area, too.
fn shells(ring: &[Xy]) -> Result<Vec<Vec<Xy>>, RegionProblem> {
    if let [only] = ring {
        let t = WALL_THICKNESS;
        let square = [(-t, -t), (t, -t), (t, t), (-t, t)];
        return Ok(vec![square.iter().map(|&(x, y)| *only + Xy { x, y }).collect()]);
    }
    let (mut low, mut high) = (ring[0], ring[0]);
    for point in ring {
        low = Xy { x: low.x.min(point.x), y: low.y.min(point.y) };
        high = Xy { x: high.x.max(point.x), y: high.y.max(point.y) };
    }
    let extent = (high.x - low.x).max(high.y - low.y);
    // The overlay works on a grid of about 1e-9 of the extent: stay well above it.
    let thickness = WALL_THICKNESS.max(extent * 1e-7);
    let closed: LineString = ring.iter().chain(ring.first()).copied().collect();
    let grown = closed.buffer(thickness);
    let rings: Vec<Vec<Xy>> = grown
        .iter()
        .map(|polygon: &Polygon| {
            let mut shell = without_repeats(polygon.exterior().coords().copied().collect());
            if signed_area(&shell) < 0.0 {
                shell.reverse();
            }
            shell
        })
        .collect();
    let covered = !rings.is_empty()
        && rings.iter().all(|shell| shell.len() >= 3)
        && ring.iter().all(|&vertex| rings.iter().any(|shell| contains(shell, vertex)));
    if covered { Ok(rings) } else { Err(RegionProblem::NoOutline) }
}

/// Drops vertices that repeat their predecessor, the closing one included.
fn without_repeats(mut points: Vec<Xy>) -> Vec<Xy> {
    points.dedup();
    while points.len() > 1 && points.first() == points.last() {
        points.pop();
    }
    points
}

/// Twice-signed shoelace area, square metres: positive for a counter-clockwise ring.
#[must_use]
pub fn signed_area(ring: &[Xy]) -> f64 {
    Polygon::new(ring.iter().copied().collect(), vec![]).signed_area()
}

fn perimeter(ring: &[Xy]) -> f64 {
    edges(ring).map(|(a, b)| (b.x - a.x).hypot(b.y - a.y)).sum()
}

/// The edges of a ring that is not closed, the closing edge last.
pub fn edges(ring: &[Xy]) -> impl Iterator<Item = (Xy, Xy)> {
    ring.iter().zip(ring.iter().cycle().skip(1)).map(|(&a, &b)| (a, b))
}

/// Whether a point is inside a ring by the even-odd rule. On the edge, either answer.
#[must_use]
pub fn contains(ring: &[Xy], point: Xy) -> bool {
    edges(ring).fold(false, |inside, (a, b)| inside != crosses_ahead(a, b, point))
}

/// Whether an edge crosses the ray from a point towards positive `x`.
pub(super) fn crosses_ahead(a: Xy, b: Xy, point: Xy) -> bool {
    (a.y > point.y) != (b.y > point.y)
        && point.x < (b.x - a.x) * (point.y - a.y) / (b.y - a.y) + a.x
}

/// Whether no two edges meet but at the vertex that they share: a sweep over the edges in the
/// order of their left ends, against those whose x-range is still open.
fn is_simple(ring: &[Xy]) -> bool {
    use geo::line_intersection::{LineIntersection, line_intersection};

    let n = ring.len();
    if n < 3 {
        return false;
    }
    let lines: Vec<geo::Line> = edges(ring).map(|(a, b)| geo::Line::new(a, b)).collect();
    let left = |i: usize| lines[i].start.x.min(lines[i].end.x);
    let right = |i: usize| lines[i].start.x.max(lines[i].end.x);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| left(i).total_cmp(&left(j)));
    let mut open: Vec<usize> = Vec::new();
    for &i in &order {
        open.retain(|&j| right(j) >= left(i));
        for &j in &open {
            let neighbours = (i + 1) % n == j || (j + 1) % n == i;
            match line_intersection(lines[i], lines[j]) {
                None => {}
                // Neighbours share one end point, and nothing else.
                Some(LineIntersection::SinglePoint { is_proper: false, .. })
                    if neighbours && n > 3 => {}
                Some(LineIntersection::SinglePoint { .. }) if neighbours && n == 3 => {}
                Some(_) => return false,
            }
        }
        open.push(i);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geodesy::{LatLon, Zone};
    use crate::units::Metres;

    fn frame() -> LocalFrame {
        let origin = LatLon::new(22.2, 113.5).unwrap();
        LocalFrame::new(Zone::of(origin), origin).unwrap()
    }

    fn region(role: FenceRole, local: &[(f64, f64)]) -> FenceRegion {
        let frame = frame();
        let ring = local.iter().map(|&(x, y)| frame.to_position(Xy { x, y }).unwrap()).collect();
        FenceRegion {
            role,
            shape: FenceShape::Polygon(ring),
            heights: None,
            origin: "fence item 7".into(),
        }
    }

    fn solids(local: &[(f64, f64)]) -> (Vec<Vec<Xy>>, Option<String>) {
        match outline(&region(FenceRole::Exclusion, local), &frame()).unwrap() {
            (Outline::Solid(rings), warning) => (rings, warning),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn either_winding_and_repeated_vertices_give_the_same_simple_ring() {
        let (ring, warning) = solids(&[(0., 0.), (10., 0.), (10., 10.), (0., 10.)]);
        assert_eq!((ring.len(), ring[0].len(), warning), (1, 4, None));
        let (turned, warning) =
            solids(&[(0., 0.), (0., 10.), (10., 10.), (10., 10.), (10., 0.), (0., 0.)]);
        assert_eq!((turned[0].len(), warning), (4, None));
        assert!(signed_area(&ring[0]) > 99.0 && signed_area(&turned[0]) > 99.0);
    }

    #[test]
    fn both_faces_of_a_bow_tie_are_obstacle() {
        let (rings, warning) = solids(&[(0., 0.), (10., 10.), (10., 0.), (0., 10.)]);
        assert!(warning.unwrap().contains("crosses"));
        for point in [Xy { x: 1., y: 5. }, Xy { x: 9., y: 5. }] {
            assert!(rings.iter().any(|ring| contains(ring, point)), "{point:?}");
        }
        assert!(!rings.iter().any(|ring| contains(ring, Xy { x: 5., y: 9. })));
    }

    #[test]
    fn a_face_with_winding_number_zero_is_obstacle_too() {
        // A pentagram's middle, and a ring that loops back around an inner face.
        let star: Vec<(f64, f64)> = (0..5)
            .map(|i| (f64::from(i * 2) * std::f64::consts::TAU / 5.0).sin_cos())
            .map(|(s, c)| (10.0 * s, 10.0 * c))
            .collect();
        let (rings, _) = solids(&star);
        assert!(rings.iter().any(|ring| contains(ring, Xy { x: 0.0, y: 0.0 })));
    }

    #[test]
    fn a_ring_without_area_is_a_wall() {
        for flat in [
            vec![(0., 0.), (20., 0.), (10., 0.)],
            vec![(0., 0.), (20., 0.), (0., 0.)],
            vec![(3., 3.), (3., 3.), (3., 3.)],
        ] {
            let (rings, warning) = solids(&flat);
            assert!(warning.unwrap().contains("wall"));
            assert!(rings.iter().any(|ring| contains(ring, Xy { x: flat[0].0, y: flat[0].1 })));
        }
    }

    #[test]
    fn what_cannot_be_used_is_an_error_with_its_name() {
        let two = region(FenceRole::Exclusion, &[(0., 0.), (1., 0.)]);
        let error = outline(&two, &frame()).unwrap_err();
        assert!(error.to_string().starts_with("fence item 7: a polygon needs at least 3"));
        for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let circle = FenceRegion {
                role: FenceRole::Exclusion,
                shape: FenceShape::Circle {
                    centre: LatLon::new(22.2, 113.5).unwrap(),
                    radius: Metres(radius),
                },
                heights: None,
                origin: "circle".into(),
            };
            assert!(outline(&circle, &frame()).is_err(), "{radius}");
        }
    }

    #[test]
    fn a_triangle_is_simple_and_a_spike_is_not() {
        assert!(is_simple(&[Xy { x: 0., y: 0. }, Xy { x: 1., y: 0. }, Xy { x: 0., y: 1. }]));
        let spike = [(0., 0.), (10., 0.), (10., 10.), (20., 10.), (10., 10.), (0., 10.)];
        let spike: Vec<Xy> = spike.iter().map(|&(x, y)| Xy { x, y }).collect();
        assert!(!is_simple(&spike));
    }
}
