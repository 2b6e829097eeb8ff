//! The points at which a shortest path around obstacles can bend: the corners of the buffered
//! obstacles, rounded by a few points each.
//!
//! A path that keeps a margin `r` from a convex corner turns on an arc of radius `r` around it.
//! The arc is replaced by points on a circle of radius `r / cos(δ/2)`, `δ` apart, so that the
//! edges between neighbours just touch the arc. Where these have no room, `δ` is halved: in a
//! passage that is hardly wide enough the path stays next to the arc. Where they have little, `δ` is
//! halved as well: the edges that lead into such a passage are as tight as those within it.

use super::polyline::{cross, distance};
use crate::airspace::RegionId;
use crate::airspace::space::Boundary;
use crate::geodesy::Xy;

use super::leg_space::LegSpace;

/// The turn between neighbouring points around a corner that is coarsely rounded, radians.
pub const COARSE: f64 = std::f64::consts::FRAC_PI_4;

/// The same for a corner that is finely rounded: arcs are too long by 0.14 %.
pub const FINE: f64 = COARSE / 6.0;

/// Pieces of an arc are halved where their point has no room, down to this, radians.
const FINEST: f64 = COARSE / 16.0;

/// How far the tangents of a run of shallow corners may stand out from it, metres.
const RUN_HEIGHT: f64 = 0.3;

/// Dents narrower than this share of the margin are no place for corners: a path that keeps the
/// margin from both their rims comes in by a fiftieth of it at most.
const NARROW: f64 = 0.4;

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
    /// The region that leaves no room at this corner, where there is one.
    pub hidden_by: Option<RegionId>,
}

/// The corners of one boundary for the margin of a leg, `step` radians apart where there is room
/// and nearer where there is little. Where a part of a turn has no room at all, one corner says
/// which region hides it.
#[must_use]
pub fn corners(
    region: RegionId,
    boundary: &Boundary,
    space: &LegSpace<'_>,
    step: f64,
) -> Vec<Corner> {
    let mut found = Vec::new();
    match boundary {
        Boundary::Disc { centre, radius } => {
            let radius = radius + space.planning_margin() + BEYOND;
            let turn = std::f64::consts::TAU;
            // The points may stand out from a large disc no further than from a run of corners.
            let step = (8.0 * RUN_HEIGHT / radius).sqrt().clamp(FINEST, step);
            Arc { centre: *centre, radius, from: 0.0, turn, region }
                .corners(step, space, &mut found);
        }
        Boundary::Ring(ring) => {
            for arc in ring_arcs(ring, space.planning_margin() + BEYOND, region) {
                arc.corners(step, space, &mut found);
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
    /// Adds the corners of the arc.
    fn corners(&self, step: f64, space: &LegSpace<'_>, found: &mut Vec<Corner>) {
        let count = (self.turn / step).ceil().max(1.0);
        let piece = self.turn / count;
        for k in 0..count as u32 {
            self.piece(self.from + piece * f64::from(k), piece, space, found);
        }
    }

    /// Adds the corner where the tangents at both ends of a piece meet, or those of its halves
    /// where that one has no room. Neighbouring corners see each other along a tangent, so the
    /// pieces may be of different sizes.
    fn piece(&self, from: f64, turn: f64, space: &LegSpace<'_>, found: &mut Vec<Corner>) {
        let (sin, cos) = (from + turn / 2.0).sin_cos();
        let out = Xy { x: cos, y: sin };
        let corner = Corner {
            point: self.centre + out * (self.radius / (turn / 2.0).cos()),
            tangent: Xy { x: -sin, y: cos },
            half_turn: turn / 2.0,
            region: self.region,
            hidden_by: None,
        };
        let margin = space.planning_margin();
        let stands_out = self.radius * (1.0 / (turn / 2.0).cos() - 1.0);
        let room = if turn > FINE { margin + stands_out } else { margin };
        let Some(hider) = space.airspace().blocker(corner.point, corner.point, room) else {
            found.push(corner);
            return;
        };
        let middle = self.centre + out * self.radius;
        // The whole piece of the arc is within this distance of its middle.
        let chord = 2.0 * self.radius * (turn / 4.0).sin();
        let covered = space.airspace().nearest(middle, middle, margin);
        if let Some((_, hider)) = covered.filter(|(distance, _)| distance + chord < margin) {
            found.push(Corner { hidden_by: Some(hider), ..corner });
        } else if turn <= FINEST {
            found.push(Corner { hidden_by: Some(hider), ..corner });
        } else {
            self.piece(from, turn / 2.0, space, found);
            self.piece(from + turn / 2.0, turn / 2.0, space, found);
        }
    }
}

/// The convex turns of a ring whose forbidden side is on the left. Runs of shallow corners (a
/// polygon that stands for a curve) are taken as one turn while their tangents stay close.
fn ring_arcs(ring: &[Xy], margin: f64, region: RegionId) -> Vec<Arc> {
    let ring = &without_dents(ring, NARROW * margin);
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

/// A ring without the vertices of dents whose rims are nearer to each other than `narrow`
/// metres: a coast of a thousand vertices has no more corners than it has headlands.
fn without_dents(ring: &[Xy], narrow: f64) -> Vec<Xy> {
    let mut kept: Vec<Xy> = Vec::with_capacity(ring.len());
    for &vertex in ring {
        while let [.., rim, dent] = kept[..]
            && cross(dent - rim, vertex - dent) <= 0.0
            && distance(rim, vertex) < narrow
        {
            kept.pop();
        }
        kept.push(vertex);
    }
    if kept.len() < 3 { ring.to_vec() } else { kept }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn narrow_dents_have_no_corners_and_wide_ones_have() {
        let toothed = |width: f64| -> Vec<Xy> {
            let mut ring: Vec<Xy> = (0..20)
                .flat_map(|k| {
                    let x = f64::from(k) * width;
                    [Xy { x, y: 0.0 }, Xy { x: x + width / 2.0, y: 1.0 }]
                })
                .collect();
            ring.extend([Xy { x: 20.0 * width, y: 50.0 }, Xy { x: 0.0, y: 50.0 }]);
            ring
        };
        assert!(ring_arcs(&toothed(1.0), 5.0, RegionId(0)).len() <= 5);
        assert!(ring_arcs(&toothed(6.0), 5.0, RegionId(0)).len() > 20);
    }

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
