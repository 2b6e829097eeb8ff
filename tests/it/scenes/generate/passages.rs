//! Scenes with one long passage, or few, hardly wide enough.

use std::f64::consts::{PI, TAU};

use rand::Rng;
use rand::seq::IndexedRandom;

use super::*;

/// A winding corridor as an inclusion, its width from just over twice the buffer.
pub(crate) fn corridor(seed: u64) -> Scene {
    let mut rng = rng_of("corridor", seed);
    let width = [10.1, 10.2, 10.5, 11.0, 13.0][seed as usize % 5];
    let mut line = vec![[0.0, 0.0]];
    let mut heading = 0.0;
    for k in 0..rng.random_range(4..12) {
        let sharp = if k % 2 == 0 { 1.0 } else { -1.0 };
        heading = f64::clamp(heading + sharp * rng.random_range(0.2..1.6), -1.5, 1.5);
        let step = rng.random_range(35.0..120.0);
        line.push(add(line[line.len() - 1], rotated([step, 0.0], heading)));
    }
    let ring = ribbon(&line, width / 2.0);
    let n = line.len();
    let inwards = |a: P, b: P| add(a, mul(sub(b, a), BUFFER * 2.0 / dist(a, b)));
    let (start, goal) = (inwards(line[0], line[1]), inwards(line[n - 1], line[n - 2]));
    let mut made = scene("corridor", seed, &mut rng, start, goal);
    made.regions = vec![zone(ring)];
    made.known = Known::Solvable;
    turned(made, &mut rng)
}

/// A maze of thin walls, 4 to 7 cells wide.
pub(crate) fn maze(seed: u64) -> Scene {
    maze_of("maze", 4, 7, seed)
}

/// A maze of thin walls, 12 to 24 cells wide.
pub(crate) fn large_maze(seed: u64) -> Scene {
    maze_of("large-maze", 12, 24, seed)
}

fn maze_of(family: &str, least: usize, most: usize, seed: u64) -> Scene {
    let mut rng = rng_of(family, seed);
    let n = rng.random_range(least..=most);
    let thick = 0.5;
    let cell = 2.0 * BUFFER + thick + [0.15, 0.6, 3.0, 8.0][seed as usize % 4];
    // Which walls are gone: to the east and to the north of each cell.
    let mut gone = vec![[false; 2]; n * n];
    let mut seen = vec![false; n * n];
    let mut stack = vec![0usize];
    seen[0] = true;
    while let Some(&at) = stack.last() {
        let (x, y) = (at % n, at / n);
        let mut ways = Vec::new();
        if x + 1 < n && !seen[at + 1] {
            ways.push((at + 1, at, 0));
        }
        if y + 1 < n && !seen[at + n] {
            ways.push((at + n, at, 1));
        }
        if x > 0 && !seen[at - 1] {
            ways.push((at - 1, at - 1, 0));
        }
        if y > 0 && !seen[at - n] {
            ways.push((at - n, at - n, 1));
        }
        match ways.choose(&mut rng) {
            Some(&(next, owner, side)) => {
                gone[owner][side] = true;
                seen[next] = true;
                stack.push(next);
            }
            None => {
                stack.pop();
            }
        }
    }
    // Some more ways, so that there is a choice.
    for _ in 0..n / 2 {
        let (x, y) = (rng.random_range(0..n - 1), rng.random_range(0..n - 1));
        gone[y * n + x][rng.random_range(0..2)] = true;
    }
    let at = |x: usize, y: usize| [x as f64 * cell, y as f64 * cell];
    let mut regions = Vec::new();
    let border = rectangle(at(0, 0), at(n, n));
    regions.extend(edges(&border).map(|(a, b)| {
        let along = mul(sub(b, a), thick / 2.0 / dist(a, b));
        solid(wall(sub(a, along), add(b, along), thick))
    }));
    for y in 0..n {
        for x in 0..n {
            for (side, from) in [(0, at(x + 1, y)), (1, at(x, y + 1))] {
                let inner = if side == 0 { x + 1 < n } else { y + 1 < n };
                if inner && !gone[y * n + x][side] {
                    regions.push(solid(wall(from, at(x + 1, y + 1), thick)));
                }
            }
        }
    }
    let centre = |x: usize, y: usize| add(at(x, y), [cell / 2.0; 2]);
    let mut made = scene(family, seed, &mut rng, centre(0, 0), centre(n - 1, n - 1));
    made.regions = regions;
    made.known = Known::Solvable;
    turned(made, &mut rng)
}

/// A square spiral with the goal in its middle.
pub(crate) fn spiral(seed: u64) -> Scene {
    let mut rng = rng_of("spiral", seed);
    let turns = rng.random_range(2..=5);
    let lane = 2.0 * BUFFER + 1.0 + [0.2, 1.0, 6.0][seed as usize % 3];
    let mut line = vec![[0.0, 0.0]];
    let mut heading = 0.0;
    for k in 1..=4 * turns {
        let step = lane * f64::from((k + 1) / 2);
        line.push(add(line[line.len() - 1], rotated([step, 0.0], heading)));
        heading += PI / 2.0;
    }
    let regions: Vec<Region> = line.windows(2).map(|w| solid(wall(w[0], w[1], 1.0))).collect();
    let far = lane * f64::from(2 * turns + 2);
    let start = rotated([far, 0.0], rng.random_range(0.0..TAU));
    let goal = [lane / 2.0, lane / 2.0];
    let made = scene("spiral", seed, &mut rng, start, goal);
    turned(Scene { regions, known: Known::Solvable, ..made }, &mut rng)
}

/// Nested dead ends across the straight line.
pub(crate) fn u_trap(seed: u64) -> Scene {
    let mut rng = rng_of("u-trap", seed);
    let depth = rng.random_range(60.0..400.0);
    let half = rng.random_range(30.0..250.0);
    let mut regions = Vec::new();
    for k in 0..rng.random_range(1..=3) {
        let inset = f64::from(k) * rng.random_range(14.0..20.0);
        let (d, h) = (depth - 2.0 * inset, half - inset);
        if d < 20.0 || h < 15.0 {
            break;
        }
        let at = inset;
        let ring = vec![[-d, -h], [at, -h], [at, h], [-d, h]];
        let shape: Vec<Region> = ring.windows(2).map(|w| solid(wall(w[0], w[1], 2.0))).collect();
        // One concave obstacle instead of three that overlap.
        if rng.random_bool(0.5) {
            regions.push(solid(ribbon(&ring, 1.0)));
        } else {
            regions.extend(shape);
        }
        if rng.random_bool(0.4) {
            break;
        }
    }
    let start = open_near(&regions, [-depth * rng.random_range(-0.1..0.9), 0.0], &mut rng);
    let goal = open_near(&regions, [rng.random_range(20.0..200.0), 0.0], &mut rng);
    let made = scene("u-trap", seed, &mut rng, start, goal);
    turned(Scene { regions, ..made }, &mut rng)
}

/// Walls from both sides of a fenced lane.
pub(crate) fn slalom(seed: u64) -> Scene {
    let mut rng = rng_of("slalom", seed);
    let (gates, pitch) = (rng.random_range(4..14), rng.random_range(14.0..60.0));
    let half = rng.random_range(25.0..80.0);
    let length = pitch * f64::from(gates + 1);
    let mut regions = vec![zone(rectangle([0.0, -half], [length, half]))];
    for k in 1..=gates {
        let x = pitch * f64::from(k);
        let gap = [10.1, 12.0, 16.0][rng.random_range(0..3)] + rng.random_range(0.0..0.2);
        let edge = half - gap;
        let (low, high) = if k % 2 == 0 { (-half - 1.0, edge) } else { (-edge, half + 1.0) };
        regions.push(solid(rectangle([x - 0.5, low], [x + 0.5, high])));
    }
    let made = scene("slalom", seed, &mut rng, [6.0, 0.0], [length - 6.0, 0.0]);
    turned(Scene { regions, known: Known::Solvable, ..made }, &mut rng)
}

/// Concave obstacles that reach into each other: combs.
pub(crate) fn combs(seed: u64) -> Scene {
    let mut rng = rng_of("combs", seed);
    let lane = 10.0 + [0.15, 0.5, 4.0][seed as usize % 3];
    let teeth = rng.random_range(3..7);
    let tooth = rng.random_range(2.0..6.0);
    let pitch = 2.0 * (lane + tooth);
    let depth = rng.random_range(40.0..120.0);
    // One comb from below, one from above, half a pitch apart: a meander between them.
    let comb = |shift: f64, flip: f64, count: i32| {
        let back = flip * (depth / 2.0 + lane + 3.0);
        let tip = -flip * (depth / 2.0);
        let (left, right) = (-tooth, f64::from(teeth) * pitch + tooth);
        let mut ring = vec![[left, back + flip * 3.0], [left, back]];
        for k in 0..count {
            let x = shift + f64::from(k) * pitch;
            let (a, b) = (x.max(left), x + tooth);
            ring.extend([[a, back], [a, tip], [b, tip], [b, back]]);
        }
        ring.extend([[right, back], [right, back + flip * 3.0]]);
        ring.dedup();
        ring
    };
    let below = comb(0.0, -1.0, teeth + 1);
    let above = comb(lane + tooth, 1.0, teeth);
    let start = [-tooth - 8.0, depth / 2.0 + lane / 2.0 - 1.0];
    let goal = [f64::from(teeth) * pitch + tooth + 8.0, -depth / 2.0];
    let regions = vec![solid(below), solid(above)];
    let start = open_near(&regions, start, &mut rng);
    let goal = open_near(&regions, goal, &mut rng);
    let made = scene("combs", seed, &mut rng, start, goal);
    turned(Scene { regions, ..made }, &mut rng)
}

/// A gate that is hardly wide enough in a long wall.
pub(crate) fn gate(seed: u64) -> Scene {
    let mut rng = rng_of("gate", seed);
    let width = 10.1 + rng.random_range(0.0..0.5);
    let at = rng.random_range(-200.0..200.0);
    let thick = rng.random_range(0.3..30.0);
    let far = 600.0;
    let made = scene("gate", seed, &mut rng, [-80.0, 0.0], [90.0, 10.0]);
    let regions = vec![
        solid(rectangle([0.0, -far], [thick, at - width / 2.0])),
        solid(rectangle([0.0, at + width / 2.0], [thick, far])),
    ];
    turned(Scene { regions, known: Known::Solvable, ..made }, &mut rng)
}

/// A gate of about twice the buffer in the wall around a yard.
pub(crate) fn doubtful_gate(seed: u64) -> Scene {
    let mut rng = rng_of("doubtful-gate", seed);
    let width = 2.0 * BUFFER + rng.random_range(-0.3..0.3);
    let (half, thick) = (rng.random_range(20.0..60.0), rng.random_range(0.3..12.0));
    let at = rng.random_range(0.0..half - width);
    let line = [
        [at + width, -half],
        [half + width, -half],
        [half + width, half],
        [-half, half],
        [-half, -half],
        [at, -half],
    ];
    let start = rotated([3.0 * half, 0.0], rng.random_range(0.0..TAU));
    let made = scene("doubtful-gate", seed, &mut rng, start, [0.0, 0.0]);
    // The outline of the wall cuts its ends square, so that the gate is a straight passage.
    let regions = vec![solid(ribbon(&line, thick / 2.0))];
    turned(Scene { regions, ..made }, &mut rng)
}

/// Along a wall of kilometres to its other side: what is straight to one program is not to another.
pub(crate) fn long_walls(seed: u64) -> Scene {
    let mut rng = rng_of("long-walls", seed);
    let length = rng.random_range(1500.0..6000.0);
    let beside = |share: f64, off: f64| [share * length, off];
    let start = beside(rng.random_range(-0.2..0.2), 10.0 + BUFFER + rng.random_range(0.1..2.0));
    let goal = beside(rng.random_range(0.1..0.4), -10.0 - BUFFER - rng.random_range(0.1..60.0));
    let made = scene("long-walls", seed, &mut rng, start, goal);
    // Both ends are clear whichever line the wall is.
    let slope = made.at.0.abs().min(85.0).to_radians().tan();
    let bulge = length * length * slope / (8.0 * 6.371e6);
    let start = add(start, [0.0, bulge]);
    let goal = sub(goal, [0.0, bulge]);
    let wall = solid(rectangle([-length / 2.0, -10.0], [length / 2.0, 10.0]));
    let known = Known::Solvable;
    turned(Scene { regions: vec![wall], start, goal, known, ..made }, &mut rng)
}
