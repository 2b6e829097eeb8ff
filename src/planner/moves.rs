//! Challengers for the refinement rounds: the incumbent with its corners moved, towards the
//! chord of their neighbours (which pulls the path taut) or sideways by a shrinking step.

use rand::Rng;

use super::leg_space::LegSpace;
use super::polyline::{distance, turn};
use crate::geodesy::Xy;

/// Turns above this get a second corner to round them with, radians.
const SHARP: f64 = 0.7;

/// The longest sideways step, metres; it shrinks to [`SHORTEST_STEP`].
const LONGEST_STEP: f64 = 30.0;

/// The shortest sideways step, metres.
const SHORTEST_STEP: f64 = 0.1;

/// Halvings when a pull towards the chord is shortened until it is clear.
const HALVINGS: u32 = 10;

/// The incumbent's corners, and where the challenger has them.
#[derive(Debug, Clone, PartialEq)]
pub struct Moves {
    /// The incumbent; sharp corners may have been doubled.
    pub from: Vec<Xy>,
    /// The challenger: one point for each of `from`, the ends alike.
    pub to: Vec<Xy>,
}

/// Moves every interior corner of a path. `progress` runs from 0 to 1 over the rounds.
///
/// A pull goes towards a random point of the chord between the neighbours, as far as both edges
/// to the (unmoved) neighbours stay clear; which of the simultaneous moves fit together is left
/// to QAOA. At most `room` corners result.
#[must_use]
pub fn moves(
    path: &[Xy],
    space: &LegSpace<'_>,
    progress: f64,
    room: usize,
    rng: &mut impl Rng,
) -> Moves {
    let from = with_sharp_corners_doubled(path, space, room);
    let mut to = from.clone();
    let step = LONGEST_STEP * (SHORTEST_STEP / LONGEST_STEP).powf(progress);
    for i in 1..from.len().saturating_sub(1) {
        let (before, here, after) = (from[i - 1], from[i], from[i + 1]);
        let sideways = rng.random_bool(0.2);
        to[i] = if sideways {
            let angle = rng.random_range(0.0..std::f64::consts::TAU);
            here + Xy { x: angle.cos(), y: angle.sin() } * step
        } else {
            let target = before + (after - before) * rng.random_range(0.2..0.8);
            pulled(before, here, after, target, space)
        };
    }
    Moves { from, to }
}

/// The point between `here` and `target` nearest to `target` from which both neighbours are
/// still reached; a small way there, where not even that is clear.
fn pulled(before: Xy, here: Xy, after: Xy, target: Xy, space: &LegSpace<'_>) -> Xy {
    let at = |share: f64| here + (target - here) * share;
    let clear = |point: Xy| space.is_clear(before, point) && space.is_clear(point, after);
    if clear(target) {
        return target;
    }
    let (mut good, mut bad) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(good, bad);
        if clear(at(middle)) { good = middle } else { bad = middle }
    }
    if good > 0.0 { at(good) } else { at(0.5f64.powi(HALVINGS as i32)) }
}

/// Replaces corners that turn sharply by two on their edges, where there is room for more
/// corners and the edges are long enough.
fn with_sharp_corners_doubled(path: &[Xy], space: &LegSpace<'_>, room: usize) -> Vec<Xy> {
    let mut result = Vec::with_capacity(path.len() + 4);
    let mut spare = room.saturating_sub(path.len());
    for (i, &here) in path.iter().enumerate() {
        let (Some(&before), Some(&after)) =
            (i.checked_sub(1).and_then(|k| path.get(k)), path.get(i + 1))
        else {
            result.push(here);
            continue;
        };
        let angle = turn(before, here, after).abs();
        // On an arc of the margin's radius, two tangent points instead of one are this far off.
        let off = space.margin() * (angle / 4.0).tan();
        let (back, ahead) = (distance(before, here), distance(here, after));
        if angle > SHARP && spare > 0 && back > 2.5 * off && ahead > 2.5 * off && off > 0.05 {
            spare -= 1;
            result.push(here + (before - here) * (off / back));
            result.push(here + (after - here) * (off / ahead));
        } else {
            result.push(here);
        }
    }
    result
}
