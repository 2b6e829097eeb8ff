//! The exact answer, found another way than quavd's: a visibility graph over all points at which
//! a shortest path may bend, every vertex of every region rounded finely. All that is left out are
//! lines that do not run along the round that they end on: nobody who pulls a thread tight gets those.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::ground::P;
use super::plane::{Walls, add, cross, dist, edges, inside, mul, norm, rotated, sub};
use super::scene::{Scene, Shape};

/// The turn between neighbouring points around a vertex, radians: the path is too long by less
/// than `STEP²/12` of its turns, 3e-4.
const STEP: f64 = 0.06;

/// How far a line may be off the tangent where it ends on a round: half a step is what a tight
/// thread needs.
const OFF_TANGENT: f64 = 1.5 * STEP;

/// A point at which a path may bend, with the direction of the round that it is on.
#[derive(Clone, Copy)]
struct Bend {
    at: P,
    along: Option<P>,
}

impl Bend {
    fn may_be_reached_along(&self, line: P) -> bool {
        self.along.is_none_or(|along| cross(along, line).abs() <= OFF_TANGENT.sin() * norm(line))
    }
}

/// The length of the shortest path that keeps `margin` metres from everything, and `None` where
/// there is none. With `bound`, only paths up to that length are looked for.
pub(crate) fn shortest(scene: &Scene, margin: f64, bound: Option<f64>) -> Option<f64> {
    let walls = Walls::new(scene.walls(), margin);
    let zones = scene.zones();
    let in_zones = |p: P| {
        if scene.is_union() && !zones.iter().any(|zone| inside(p, zone)) {
            return false;
        }
        scene.regions.iter().all(|region| match &region.shape {
            _ if region.inclusion && scene.is_union() => true,
            Shape::Disc(centre, radius) if region.inclusion => dist(p, *centre) <= radius - margin,
            Shape::Ring(ring) if region.inclusion => inside(p, ring),
            Shape::Ring(ring) => !inside(p, ring),
            Shape::Disc(..) => true,
        })
    };
    let threshold = margin - 1e-6;
    let within =
        |p: P| bound.is_none_or(|bound| dist(scene.start, p) + dist(p, scene.goal) <= bound + 1e-6);
    let mut points = [scene.start, scene.goal].map(|at| Bend { at, along: None }).to_vec();
    if points.iter().any(|end| !in_zones(end.at) || !walls.are_clear(end.at, end.at, threshold)) {
        return None;
    }
    points.extend(
        bends(scene, margin)
            .into_iter()
            .filter(|bend| within(bend.at) && in_zones(bend.at))
            .filter(|bend| walls.are_clear(bend.at, bend.at, threshold)),
    );

    let mut done = vec![false; points.len()];
    let mut open = BinaryHeap::new();
    let bits = |value: f64| value.to_bits(); // in the order of the values: none is negative
    open.push(Reverse((0, 0, 0u32, 0u32)));
    while let Some(Reverse((_, so_far, at, from))) = open.pop() {
        let (so_far, at, from) = (f64::from_bits(so_far), at as usize, from as usize);
        if done[at] || (at != from && !walls.are_clear(points[from].at, points[at].at, threshold)) {
            continue;
        }
        done[at] = true;
        if at == 1 {
            return Some(so_far);
        }
        for next in 1..points.len() {
            if done[next] {
                continue;
            }
            let line = sub(points[next].at, points[at].at);
            if ![at, next].iter().all(|&end| points[end].may_be_reached_along(line)) {
                continue;
            }
            let longer = so_far + norm(line);
            let estimate = longer + dist(points[next].at, scene.goal);
            if bound.is_none_or(|bound| estimate <= bound) {
                open.push(Reverse((bits(estimate), bits(longer), next as u32, at as u32)));
            }
        }
    }
    None
}

/// The points around every vertex and disc, `margin` away from it, on the outside of its turn.
fn bends(scene: &Scene, margin: f64) -> Vec<Bend> {
    let mut points = Vec::new();
    let mut arc = |centre: P, radius: f64, from: P, turn: f64| {
        let count = (turn.abs() / STEP).ceil().max(1.0);
        let reach = radius / (turn / count / 2.0).cos();
        for k in 0..count as u32 {
            let out = rotated(from, turn * (f64::from(k) + 0.5) / count);
            points.push(Bend { at: add(centre, mul(out, reach)), along: Some([-out[1], out[0]]) });
        }
    };
    if scene.is_union() {
        // Where two zones meet their edge may stick out into the room.
        for meeting in scene.union_edge().1 {
            arc(meeting, margin, [1.0, 0.0], std::f64::consts::TAU);
        }
    }
    for region in &scene.regions {
        match &region.shape {
            Shape::Disc(..) if region.inclusion => {}
            Shape::Disc(centre, radius) => {
                arc(*centre, radius + margin, [1.0, 0.0], std::f64::consts::TAU);
            }
            Shape::Ring(ring) => {
                let sides: Vec<(P, P)> = edges(ring).filter(|(a, b)| a != b).collect();
                for (k, (_, vertex)) in sides.iter().enumerate() {
                    let unit = |(a, b): (P, P)| mul(sub(b, a), 1.0 / dist(a, b));
                    let (u, v) = (unit(sides[k]), unit(sides[(k + 1) % sides.len()]));
                    let turn = cross(u, v).atan2(u[0] * v[0] + u[1] * v[1]);
                    // Outside is on the right of a left turn and on the left of a right turn.
                    let out = if turn >= 0.0 { [u[1], -u[0]] } else { [-u[1], u[0]] };
                    assert!((norm(out) - 1.0).abs() < 1e-9);
                    arc(*vertex, margin, out, turn);
                }
            }
        }
    }
    points
}
