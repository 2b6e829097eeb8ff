//! The points at which a shortest path around obstacles can bend: the corners of the buffered
//! obstacles, rounded by a few points each.
//!
//! A path that keeps a margin `r` from a convex corner turns on an arc of radius `r` around it.
//! The arc is replaced by points on a circle of radius `r / cos(δ/2)`, `δ` apart, so that the
//! edges between neighbours just touch the arc.

use super::polyline::{cross, distance};
use crate::airspace::RegionId;
use crate::airspace::space::Boundary;
use crate::geodesy::Xy;

use super::leg_space::LegSpace;

/// The turn between neighbouring points around a corner, where there is room, radians.
const COARSE: f64 = std::f64::consts::FRAC_PI_4;

/// The finest turn, taken where the coarser points have no room.
const FINE: f64 = COARSE / 16.0;

/// How far the tangents of a run of shallow corners may stand out from it, metres.
const RUN_HEIGHT: f64 = 0.3;

/// What corners keep beyond the margin, metres: their edges would else just touch it, and be
/// clear or not as the last bit of a rounding has it.
const BEYOND: f64 = 1e-3;

/// A point where a path may bend around a boundary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Where.
    pub point: Xy,
    /// The direction of a path that goes round the boundary with it on the left; unit vector.
    pub tangent: Xy,
    /// Paths come and leave within this angle of the tangent (or of its opposite), radians.
    pub half_turn: f64,
    /// The region that it goes round.
    pub region: RegionId,
}

/// The corners of one boundary for the margin of a leg; only those that are clear themselves.
#[must_use]
pub fn corners(region: RegionId, boundary: &Boundary, space: &LegSpace<'_>) -> Vec<Corner> {
    let mut found = Vec::new();
    match boundary {
        Boundary::Disc { centre, radius } => {
            let reach = radius + space.planning_margin() + BEYOND;
            let arc = Arc {
                centre: *centre,
                radius: reach,
                from: 0.0,
                turn: std::f64::consts::TAU,
                region,
            };
            // The points may stand out from a large disc no further than from a run of corners.
            let coarse = (8.0 * RUN_HEIGHT / reach).sqrt().clamp(FINE, COARSE);
            arc.push_points(coarse, space, &mut found);
        }
        Boundary::Ring(ring) => {
            for arc in ring_arcs(ring, space.planning_margin() + BEYOND, region) {
                arc.push_points(COARSE, space, &mut found);
            }
        }
    }
    found
}

/// A turn around a point (a vertex, or the centre that stands for a run of shallow vertices).
struct Arc {
    centre: Xy,
    radius: f64,
    /// Direction from the centre at the beginning, radians.
    from: f64,
    /// How far it goes on, counter-clockwise, radians.
    turn: f64,
    region: RegionId,
}

impl Arc {
    /// Adds the points of the arc, finer ones where the coarse ones have no room.
    fn push_points(&self, coarse: f64, space: &LegSpace<'_>, found: &mut Vec<Corner>) {
        let mut step = coarse;
        loop {
            let count = (self.turn / step).ceil().max(1.0);
            let half_turn = self.turn / count / 2.0;
            let points: Vec<Corner> = (0..count as u32)
                .map(|k| {
                    let (sin, cos) = (self.from + half_turn * f64::from(2 * k + 1)).sin_cos();
                    let out = Xy { x: cos, y: sin };
                    Corner {
                        point: self.centre + out * (self.radius / half_turn.cos()),
                        tangent: Xy { x: -sin, y: cos },
                        half_turn,
                        region: self.region,
                    }
                })
                .collect();
            let before = found.len();
            found.extend(points.iter().filter(|corner| space.is_clear(corner.point, corner.point)));
            if found.len() - before == points.len() || step <= FINE {
                return;
            }
            found.truncate(before);
            step /= 2.0;
        }
    }
}

/// The convex turns of a ring whose forbidden side is on the left. Runs of shallow corners (a
/// polygon that stands for a curve) are taken as one turn while their tangents stay close.
fn ring_arcs(ring: &[Xy], margin: f64, region: RegionId) -> Vec<Arc> {
    let n = ring.len();
    let direction = |i: usize| {
        let edge = ring[(i + 1) % n] - ring[i % n];
        edge / distance(edge, Xy { x: 0.0, y: 0.0 }).max(f64::MIN_POSITIVE)
    };
    let turn_at = |i: usize| {
        let (before, after) = (direction(i + n - 1), direction(i));
        cross(before, after).atan2(before.x * after.x + before.y * after.y)
    };
    let mut arcs = Vec::new();
    let mut i = 0;
    while i < n {
        let first_turn = turn_at(i);
        if first_turn <= 1e-9 {
            i += 1;
            continue;
        }
        // Take in the next vertices while the run stays convex, shallow and close to the
        // intersection of its outer tangents.
        let (mut last, mut turn) = (i, first_turn);
        while last + 1 < n {
            let next = turn_at(last + 1);
            let span = distance(ring[i], ring[last + 1]);
            if next <= 1e-9 || turn + next > COARSE || (turn + next) * span / 8.0 > RUN_HEIGHT {
                break;
            }
            last += 1;
            turn += next;
        }
        let before = direction(i + n - 1);
        let centre = if last == i {
            ring[i]
        } else {
            // Where the run's first and last tangent meet: a single corner in its place.
            let after = direction(last);
            let along = cross(ring[last] - ring[i], after) / cross(before, after);
            ring[i] + before * along
        };
        // The arc begins on the right-hand side of the edge that comes in.
        arcs.push(Arc { centre, radius: margin, from: (-before.x).atan2(before.y), turn, region });
        i = last + 1;
    }
    arcs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_is_rounded_at_its_four_corners_with_the_obstacle_on_the_left() {
        let square = [(0., 0.), (10., 0.), (10., 10.), (0., 10.)].map(|(x, y)| Xy { x, y });
        let arcs = ring_arcs(&square, 5.0, RegionId(0));
        assert_eq!(arcs.len(), 4);
        for arc in &arcs {
            assert!((arc.turn - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        }
        // The corner at the origin is gone round from the west to the south.
        assert!((arcs[0].from.abs() - std::f64::consts::PI).abs() < 1e-12);
    }

    #[test]
    fn a_hole_has_no_convex_corner_and_a_fine_curve_few_arcs() {
        let hole = [(0., 10.), (10., 10.), (10., 0.), (0., 0.)].map(|(x, y)| Xy { x, y });
        assert!(ring_arcs(&hole, 5.0, RegionId(0)).is_empty());
        let curve: Vec<Xy> = (0..1000)
            .map(|i| (f64::from(i) * std::f64::consts::TAU / 1000.0).sin_cos())
            .map(|(sin, cos)| Xy { x: 50.0 * cos, y: 50.0 * sin })
            .collect();
        let arcs = ring_arcs(&curve, 5.0, RegionId(0));
        assert!((16..60).contains(&arcs.len()), "{}", arcs.len());
        for arc in arcs {
            let out = distance(arc.centre, Xy { x: 0.0, y: 0.0 }) - 50.0;
            assert!((0.0..RUN_HEIGHT * 1.5).contains(&out), "{out}");
        }
    }
}
