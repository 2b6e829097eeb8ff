//! Plain geometry of polylines in local metres: lengths, turns, simplification.

use crate::geodesy::Xy;

/// The distance between two points.
#[must_use]
pub fn distance(a: Xy, b: Xy) -> f64 {
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    (dx * dx + dy * dy).sqrt()
}

/// The cross product of two vectors: positive where the second turns left of the first.
#[must_use]
pub fn cross(u: Xy, v: Xy) -> f64 {
    u.x * v.y - u.y * v.x
}

/// The length of a polyline, metres: the paper's `L(P_k)` ("Path Finding").
#[must_use]
pub fn length(path: &[Xy]) -> f64 {
    path.windows(2).map(|edge| distance(edge[0], edge[1])).sum()
}

/// The cumulative turning angle of a polyline, radians: the paper's measure of directional
/// smoothness ("Path Finding"). Edges without length do not turn.
#[must_use]
pub fn turning(path: &[Xy]) -> f64 {
    path.windows(3).map(|corner| turn(corner[0], corner[1], corner[2]).abs()).sum()
}

/// The turn at `b` on the way from `a` to `c`, radians, left positive; 0 next to an edge
/// without length.
#[must_use]
pub fn turn(a: Xy, b: Xy, c: Xy) -> f64 {
    let (u, v) = (b - a, c - b);
    cross(u, v).atan2(u.x * v.x + u.y * v.y)
}

/// The distance of a point from a straight edge.
#[must_use]
pub fn distance_to_edge(point: Xy, a: Xy, b: Xy) -> f64 {
    let along = b - a;
    let square = along.x * along.x + along.y * along.y;
    if square == 0.0 {
        return distance(point, a);
    }
    let t = ((point - a).x * along.x + (point - a).y * along.y) / square;
    distance(point, a + along * t.clamp(0.0, 1.0))
}

/// Drops interior points that lie within `tolerance` metres of the edge that would replace
/// them, where `may_drop(a, c)` agrees to the edge `a`-`c`. The ends stay.
#[must_use]
pub fn simplified(
    path: &[Xy],
    tolerance: f64,
    mut may_drop: impl FnMut(Xy, Xy) -> bool,
) -> Vec<Xy> {
    let mut kept: Vec<Xy> = Vec::with_capacity(path.len());
    let mut dropped: Vec<Xy> = Vec::new();
    for (i, &point) in path.iter().enumerate() {
        if let (Some(&before), Some(&after)) = (kept.last(), path.get(i + 1)) {
            dropped.push(point);
            let near = dropped.iter().all(|&p| distance_to_edge(p, before, after) <= tolerance);
            if near && may_drop(before, after) {
                continue;
            }
            dropped.clear();
        }
        kept.push(point);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(points: &[(f64, f64)]) -> Vec<Xy> {
        points.iter().map(|&(x, y)| Xy { x, y }).collect()
    }

    #[test]
    fn a_right_angle_turns_by_half_pi_and_a_stand_still_not_at_all() {
        let corner = path(&[(0., 0.), (1., 0.), (1., 1.)]);
        assert!((turning(&corner) - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert_eq!(turning(&path(&[(0., 0.), (1., 0.), (1., 0.), (2., 0.)])), 0.0);
    }

    #[test]
    fn simplification_keeps_corners_and_never_drifts() {
        let line = path(&[(0., 0.), (1., 0.), (2., 0.), (2., 1.), (2., 2.)]);
        assert_eq!(simplified(&line, 0.01, |_, _| true), path(&[(0., 0.), (2., 0.), (2., 2.)]));
        // A slow bend: each point is near its neighbours' edge, the sum of them is not.
        let arc: Vec<Xy> = (0..=90)
            .map(|i| f64::from(i).to_radians())
            .map(|a| Xy { x: 10. * a.cos(), y: 10. * a.sin() })
            .collect();
        let simple = simplified(&arc, 0.05, |_, _| true);
        for point in &arc {
            let off = simple
                .windows(2)
                .map(|e| distance_to_edge(*point, e[0], e[1]))
                .fold(f64::MAX, f64::min);
            assert!(off <= 0.05 + 1e-12, "{off}");
        }
        assert_eq!(simplified(&line, 0.01, |_, _| false).len(), line.len());
    }
}
