//! Challengers for the refinement rounds: the incumbent with some of its corners moved. Which of
//! the simultaneous moves fit together is left to QAOA.
//!
//! Three kinds of moves: a pull towards the chord of the neighbours (which makes the path taut), a
//! cut that gives a sharp corner a second one, and a step sideways that shrinks from round to
//! round.

use rand::Rng;

use super::polyline::{distance, turn};
use super::trellis::EdgeJudge;
use crate::geodesy::Xy;

/// Turns above this may be cut, radians.
const SHARP: f64 = 0.3;

/// The longest sideways step, metres; it shrinks to [`SHORTEST_STEP`].
const LONGEST_STEP: f64 = 10.0;

/// The shortest sideways step, metres.
const SHORTEST_STEP: f64 = 0.1;

/// Halvings when a move is shortened until it is clear.
const HALVINGS: u32 = 10;

/// How many moves one round decides on at most.
const MOST_MOVES: usize = 10;

/// Moves that change the cost by less than this share of the best gain wait for a later round,
/// and so do those that would lose more than the gain the other way round: next to moves that
/// matter so much more (or less) QAOA could not tell whether to take them.
const TELLING: f64 = 1.0 / 3.0;

/// The incumbent's corners, and where the challenger has them.
#[derive(Debug, Clone, PartialEq)]
pub struct Moves {
    /// The incumbent; corners that may be cut have a station in front of them.
    pub from: Vec<Xy>,
    /// The challenger: one point for each of `from`, the ends alike.
    pub to: Vec<Xy>,
}

/// A move of one corner, by its place in the path.
struct Move {
    corner: usize,
    /// A station on the edge that comes in, from where a cut leaves it.
    cut_from: Option<Xy>,
    to: Xy,
    /// What it changes when it is the only one, metres.
    change: f64,
}

/// Moves some interior corners of a path. `progress` runs from 0 to 1 over the rounds. At most
/// `room` corners result.
#[must_use]
pub fn moves(
    path: &[Xy],
    judge: &EdgeJudge<'_>,
    progress: f64,
    room: usize,
    rng: &mut impl Rng,
) -> Moves {
    let step = LONGEST_STEP * (SHORTEST_STEP / LONGEST_STEP).powf(progress);
    let mut found: Vec<Move> = (1..path.len().saturating_sub(1))
        .filter_map(|corner| random_move(path, corner, judge, step, rng))
        .collect();
    // An edge that nothing moves takes the stations that are left over.
    if found.len() + 2 == path.len() && found.len() > 1 {
        found.swap_remove(rng.random_range(0..found.len()));
    }
    let best = found.iter().map(|m| -m.change).fold(0.0, f64::max);
    // Where nothing gains, those that lose least are offered.
    let least = found.iter().map(|m| m.change).fold(f64::INFINITY, f64::min);
    let (low, high) = if best > 0.0 { (TELLING * best, best) } else { (least, least / TELLING) };
    found.retain(|m| m.change.abs() >= low && m.change <= high);
    while found.len() > MOST_MOVES {
        found.swap_remove(rng.random_range(0..found.len()));
    }
    found.sort_by_key(|m| m.corner);

    let mut spare = room.saturating_sub(path.len());
    let (mut from, mut to) = (Vec::new(), Vec::new());
    let mut found = found.into_iter().peekable();
    for (corner, &here) in path.iter().enumerate() {
        let there = match found.next_if(|m| m.corner == corner) {
            Some(Move { cut_from: Some(_), .. }) if spare == 0 => here,
            Some(m) => {
                if let Some(station) = m.cut_from {
                    spare -= 1;
                    from.push(station);
                    to.push(station);
                }
                m.to
            }
            None => here,
        };
        from.push(here);
        to.push(there);
    }
    Moves { from, to }
}

/// One move of a corner, if it is a clear one.
fn random_move(
    path: &[Xy],
    corner: usize,
    judge: &EdgeJudge<'_>,
    step: f64,
    rng: &mut impl Rng,
) -> Option<Move> {
    let (before, here, after) = (path[corner - 1], path[corner], path[corner + 1]);
    let kind: f64 = rng.random();
    let angle = rng.random_range(0.0..std::f64::consts::TAU);
    let share = rng.random_range(0.1..0.9);
    let sharpness = turn(before, here, after).abs();
    if kind < 0.35 && sharpness > SHARP {
        cut(before, here, after, sharpness, corner, judge)
    } else if kind < 0.85 {
        let target = before + (after - before) * share;
        pulled(before, here, after, target, corner, judge)
    } else {
        let to = here + Xy { x: angle.cos(), y: angle.sin() } * step;
        let change = detour(judge, before, to, after)? - plain(judge, before, here, after);
        Some(Move { corner, cut_from: None, to, change })
    }
}

/// The point between `here` and `target` nearest to `target` from which both neighbours are
/// still reached.
fn pulled(
    before: Xy,
    here: Xy,
    after: Xy,
    target: Xy,
    corner: usize,
    judge: &EdgeJudge<'_>,
) -> Option<Move> {
    let at = |share: f64| here + (target - here) * share;
    let cost = |share: f64| detour(judge, before, at(share), after);
    let mut best = cost(1.0).map(|cost| (1.0, cost));
    let (mut good, mut bad) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        if best.is_some_and(|(share, _)| share >= 1.0) {
            break;
        }
        let middle = f64::midpoint(good, bad);
        match cost(middle) {
            Some(cost) => (good, best) = (middle, Some((middle, cost))),
            None => bad = middle,
        }
    }
    let (share, cost) = best?;
    let change = cost - plain(judge, before, here, after);
    Some(Move { corner, cut_from: None, to: at(share), change })
}

/// Leaves the corner out by an edge across it, as far inside as is clear.
fn cut(
    before: Xy,
    here: Xy,
    after: Xy,
    sharpness: f64,
    corner: usize,
    judge: &EdgeJudge<'_>,
) -> Option<Move> {
    let (back, ahead) = (distance(before, here), distance(here, after));
    // An edge across a corner around an arc of the margin's radius touches the arc's middle when
    // it begins and ends this far from the corner.
    let touching = (sharpness / 2.0).min(1.5).tan() - (sharpness / 4.0).tan();
    let mut off = (judge.space.planning_margin() * touching).min(0.45 * back).min(0.45 * ahead);
    for _ in 0..HALVINGS {
        let station = here + (before - here) * (off / back);
        let to = here + (after - here) * (off / ahead);
        if let Some(cost) = detour(judge, station, to, after) {
            let change = cost - plain(judge, station, here, after);
            return Some(Move { corner, cut_from: Some(station), to, change });
        }
        off *= 0.8;
    }
    None
}

/// The cost of the way over `via`; `None` where it is not clear.
fn detour(judge: &EdgeJudge<'_>, before: Xy, via: Xy, after: Xy) -> Option<f64> {
    let (to, on) = (judge.edge(before, via), judge.edge(via, after));
    (!to.collides && !on.collides).then(|| to.cost() + on.cost())
}

/// The cost of the incumbent's way, collisions as the paper reports them.
fn plain(judge: &EdgeJudge<'_>, before: Xy, here: Xy, after: Xy) -> f64 {
    judge.edge(before, here).cost() + judge.edge(here, after).cost()
}
