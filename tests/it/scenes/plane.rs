//! Plane geometry of the tests: distances, sides, and a grid of walls to ask quickly.

use std::collections::HashMap;

use super::ground::P;

pub(crate) fn sub(a: P, b: P) -> P {
    [a[0] - b[0], a[1] - b[1]]
}

pub(crate) fn add(a: P, b: P) -> P {
    [a[0] + b[0], a[1] + b[1]]
}

pub(crate) fn mul(a: P, s: f64) -> P {
    [a[0] * s, a[1] * s]
}

pub(crate) fn norm(a: P) -> f64 {
    a[0].hypot(a[1])
}

pub(crate) fn dist(a: P, b: P) -> f64 {
    norm(sub(a, b))
}

pub(crate) fn cross(a: P, b: P) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

pub(crate) fn rotated(p: P, angle: f64) -> P {
    let (s, c) = angle.sin_cos();
    [p[0] * c - p[1] * s, p[0] * s + p[1] * c]
}

pub(crate) fn point_to_segment(p: P, a: P, b: P) -> f64 {
    let (d, off) = (sub(b, a), sub(p, a));
    let square = d[0] * d[0] + d[1] * d[1];
    let t = if square == 0.0 { 0.0 } else { (off[0] * d[0] + off[1] * d[1]) / square };
    dist(p, add(a, mul(d, t.clamp(0.0, 1.0))))
}

pub(crate) fn segment_to_segment(a: P, b: P, c: P, d: P) -> f64 {
    let side = |a: P, b: P, c: P| cross(sub(b, a), sub(c, a));
    if side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0 {
        return 0.0;
    }
    [
        point_to_segment(a, c, d),
        point_to_segment(b, c, d),
        point_to_segment(c, a, b),
        point_to_segment(d, a, b),
    ]
    .into_iter()
    .fold(f64::INFINITY, f64::min)
}

/// Where `a`-`b` crosses `c`-`d`, as a share of `a`-`b`.
pub(crate) fn crossing(a: P, b: P, c: P, d: P) -> Option<f64> {
    let (u, v) = (sub(b, a), sub(d, c));
    let across = cross(u, v);
    let (t, s) = (cross(sub(c, a), v) / across, cross(sub(c, a), u) / across);
    ((0.0..=1.0).contains(&t) && (0.0..=1.0).contains(&s)).then_some(t)
}

/// Even-odd.
pub(crate) fn inside(p: P, ring: &[P]) -> bool {
    let mut result = false;
    for (a, b) in edges(ring) {
        if (a[1] > p[1]) != (b[1] > p[1])
            && p[0] < (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]) + a[0]
        {
            result = !result;
        }
    }
    result
}

pub(crate) fn edges(ring: &[P]) -> impl Iterator<Item = (P, P)> + '_ {
    (0..ring.len()).map(|i| (ring[i], ring[(i + 1) % ring.len()]))
}

/// Walls (and discs, as a centre with a radius) by the cells of a grid that they come near.
pub(crate) struct Walls {
    cell: f64,
    reach: f64,
    cells: HashMap<(i64, i64), Vec<u32>>,
    walls: Vec<(P, P, f64)>,
}

impl Walls {
    /// `reach`: the largest distance that will be asked about.
    pub(crate) fn new(walls: Vec<(P, P, f64)>, reach: f64) -> Self {
        let cell = 25.0f64.max(2.0 * reach);
        let mut cells: HashMap<(i64, i64), Vec<u32>> = HashMap::new();
        for (i, &(a, b, radius)) in walls.iter().enumerate() {
            // In short pieces, so that a long slanted wall is not in every cell of its box.
            let pieces = (dist(a, b) / cell).ceil().max(1.0) as i64;
            for piece in 0..pieces {
                let at = |k: i64| add(a, mul(sub(b, a), k as f64 / pieces as f64));
                let (p, q) = (at(piece), at(piece + 1));
                let around = reach + radius;
                let range = |k: usize| {
                    let low = ((p[k].min(q[k]) - around) / cell).floor() as i64;
                    low..=((p[k].max(q[k]) + around) / cell).floor() as i64
                };
                for x in range(0) {
                    for y in range(1) {
                        let held = cells.entry((x, y)).or_default();
                        if held.last() != Some(&(i as u32)) {
                            held.push(i as u32);
                        }
                    }
                }
            }
        }
        Self { cell, reach, cells, walls }
    }

    /// Whether a segment keeps `margin` (up to the reach) from all walls and discs.
    pub(crate) fn are_clear(&self, a: P, b: P, margin: f64) -> bool {
        assert!(margin <= self.reach);
        let key = |p: P| ((p[0] / self.cell).floor() as i64, (p[1] / self.cell).floor() as i64);
        // Every cell that the segment passes: sorted crossings of the grid's lines.
        let mut cuts = vec![0.0, 1.0];
        for k in 0..2 {
            let (low, high) = (a[k].min(b[k]), a[k].max(b[k]));
            let first = (low / self.cell).floor() as i64;
            for line in first..=(high / self.cell).floor() as i64 {
                let t = (line as f64 * self.cell - a[k]) / (b[k] - a[k]);
                if t > 0.0 && t < 1.0 {
                    cuts.push(t);
                }
            }
        }
        cuts.sort_by(f64::total_cmp);
        cuts.windows(2).all(|pair| {
            let middle = add(a, mul(sub(b, a), f64::midpoint(pair[0], pair[1])));
            self.cells.get(&key(middle)).is_none_or(|held| {
                held.iter().all(|&i| {
                    let (c, d, radius) = self.walls[i as usize];
                    let apart = if c == d {
                        point_to_segment(c, a, b) - radius
                    } else {
                        segment_to_segment(a, b, c, d)
                    };
                    apart >= margin
                })
            })
        })
    }
}
