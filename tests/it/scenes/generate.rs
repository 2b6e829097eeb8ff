//! Scenes like those that people fly in, and worse ones: every family from a seed.

use std::f64::consts::{PI, TAU};

use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::ground::P;
use super::plane::{add, dist, edges, inside, mul, norm, point_to_segment, rotated, sub};
use super::scene::{Known, Region, Scene, Shape};

/// Everywhere on Earth: cities, UTM zone boundaries (Norway's and Svalbard's odd ones too), the
/// equator, the antimeridian, both UPS caps and their edges.
const PLACES: [(f64, f64); 16] = [
    (22.1965, 113.5411),
    (51.97, 5.66),
    (0.0001, 29.9999),
    (-0.0002, 36.0),
    (-33.86, 151.2),
    (-17.0, 179.9995),
    (65.5, -179.9998),
    (48.0, 6.0),
    (60.4, 3.0),
    (78.2, 9.0),
    (83.999, 15.0),
    (84.3, -120.0),
    (89.998, 45.0),
    (-79.999, 100.0),
    (-80.4, 0.0),
    (-89.999, -75.0),
];

/// The buffer that all scenes are made for, metres.
pub(crate) const BUFFER: f64 = 5.0;

fn rng_of(family: &str, seed: u64) -> ChaCha8Rng {
    let salt = family.bytes().fold(seed, |h, b| h.wrapping_mul(1_000_003).wrapping_add(b.into()));
    ChaCha8Rng::seed_from_u64(salt)
}

fn scene(family: &str, seed: u64, rng: &mut ChaCha8Rng, start: P, goal: P) -> Scene {
    Scene {
        name: format!("{family} {seed}"),
        at: *PLACES.choose(rng).unwrap(),
        start,
        goal,
        regions: Vec::new(),
        known: Known::Nothing,
    }
}

fn solid(ring: Vec<P>) -> Region {
    Region { inclusion: false, shape: Shape::Ring(ring) }
}

fn zone(ring: Vec<P>) -> Region {
    Region { inclusion: true, shape: Shape::Ring(ring) }
}

fn disc(centre: P, radius: f64) -> Region {
    Region { inclusion: false, shape: Shape::Disc(centre, radius) }
}

fn rectangle(low: P, high: P) -> Vec<P> {
    vec![low, [high[0], low[1]], high, [low[0], high[1]]]
}

fn placed(ring: &[P], centre: P, angle: f64) -> Vec<P> {
    ring.iter().map(|&p| add(rotated(p, angle), centre)).collect()
}

/// A wall along a line.
fn wall(a: P, b: P, thickness: f64) -> Vec<P> {
    let along = mul(sub(b, a), 1.0 / dist(a, b));
    let side = mul([-along[1], along[0]], thickness / 2.0);
    vec![sub(a, side), sub(b, side), add(b, side), add(a, side)]
}

/// Turns and mirrors a whole scene, so that nothing is aligned with anything.
fn turned(mut scene: Scene, rng: &mut ChaCha8Rng) -> Scene {
    let angle = if rng.random_bool(0.3) { 0.0 } else { rng.random_range(0.0..TAU) };
    let middle = mul(add(scene.start, scene.goal), 0.5);
    let turn = |p: P| rotated(sub(p, middle), angle);
    scene.start = turn(scene.start);
    scene.goal = turn(scene.goal);
    for region in &mut scene.regions {
        match &mut region.shape {
            Shape::Ring(ring) => {
                ring.iter_mut().for_each(|p| *p = turn(*p));
                if rng.random_bool(0.5) {
                    ring.reverse();
                }
            }
            Shape::Disc(centre, _) => *centre = turn(*centre),
        }
    }
    scene
}

/// Whether a place is well clear of all regions.
fn is_open(regions: &[Region], p: P) -> bool {
    let room = BUFFER + 0.5;
    regions.iter().all(|region| match &region.shape {
        Shape::Disc(centre, radius) if region.inclusion => dist(p, *centre) < radius - room,
        Shape::Disc(centre, radius) => dist(p, *centre) > radius + room,
        Shape::Ring(ring) => {
            inside(p, ring) == region.inclusion
                && edges(ring).all(|(a, b)| point_to_segment(p, a, b) > room)
        }
    })
}

/// An open place as near to `wanted` as a random search finds one.
fn open_near(regions: &[Region], wanted: P, rng: &mut ChaCha8Rng) -> P {
    let mut reach = 0.0;
    loop {
        let p = add(wanted, rotated([reach, 0.0], rng.random_range(0.0..TAU)));
        if is_open(regions, p) {
            return p;
        }
        reach += 1.0;
    }
}

fn building(rng: &mut ChaCha8Rng, size: f64) -> Vec<P> {
    let (w, h) = (size * rng.random_range(0.5..1.0), size * rng.random_range(0.5..1.0));
    let (l, t) = (w * rng.random_range(0.3..0.6), h * rng.random_range(0.3..0.6));
    let ring = match rng.random_range(0..4) {
        0 => vec![[0., 0.], [w, 0.], [w, t], [l, t], [l, h], [0., h]],
        1 => {
            let (a, b) = (w * 0.3, w * 0.7);
            vec![[0., 0.], [w, 0.], [w, h], [b, h], [b, t], [a, t], [a, h], [0., h]]
        }
        _ => rectangle([0., 0.], [w, h]),
    };
    ring.into_iter().map(|p| sub(p, [w / 2.0, h / 2.0])).collect()
}

/// City blocks: `count` buildings, some of them askew, some touching.
pub(crate) fn urban(count: usize, seed: u64) -> Scene {
    let mut rng = rng_of("urban", seed.wrapping_mul(7919).wrapping_add(count as u64));
    let pitch = rng.random_range(38.0..60.0);
    let columns = ((count as f64 * 1.6).sqrt().ceil() as usize).max(2);
    let rows = count.div_ceil(columns);
    let askew = rng.random_bool(0.6);
    let mut regions = Vec::new();
    for k in 0..count {
        let (column, row) = ((k % columns) as f64, (k / columns) as f64);
        let jitter = pitch * 0.15;
        let centre = [
            (column + 0.5) * pitch + rng.random_range(-jitter..jitter),
            (row + 0.5) * pitch + rng.random_range(-jitter..jitter),
        ];
        let size = pitch * rng.random_range(0.5..0.85);
        let angle = if askew { rng.random_range(0.0..TAU) } else { 0.0 };
        regions.push(solid(placed(&building(&mut rng, size), centre, angle)));
    }
    let (width, height) = (columns as f64 * pitch, rows as f64 * pitch);
    if rng.random_bool(0.5) {
        regions.push(zone(rectangle([-60.0, -60.0], [width + 60.0, height + 60.0])));
    }
    let start = [rng.random_range(-20.0..0.1) * 1.0, height * rng.random_range(0.0..1.0)];
    let start = open_near(&regions, start, &mut rng);
    let goal = [width * rng.random_range(0.85..1.02), height * rng.random_range(0.0..1.0)];
    let goal = open_near(&regions, goal, &mut rng);
    let made = scene(&format!("urban-{count}"), seed, &mut rng, start, goal);
    turned(Scene { regions, ..made }, &mut rng)
}

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

/// The outline of a line of some thickness, with mitred corners.
fn ribbon(line: &[P], half: f64) -> Vec<P> {
    let unit = |a: P, b: P| mul(sub(b, a), 1.0 / dist(a, b));
    let n = line.len();
    let side = |sign: f64| -> Vec<P> {
        (0..n)
            .map(|i| {
                let u = if i > 0 { unit(line[i - 1], line[i]) } else { unit(line[0], line[1]) };
                let v = if i + 1 < n { unit(line[i], line[i + 1]) } else { u };
                let bisector = add([-u[1], u[0]], [-v[1], v[0]]);
                let square = norm(bisector).powi(2);
                add(line[i], mul(bisector, sign * 2.0 * half / square))
            })
            .collect()
    };
    let mut ring = side(1.0);
    ring.extend(side(-1.0).into_iter().rev());
    ring
}

/// A perfect maze of thin walls.
pub(crate) fn maze(seed: u64) -> Scene {
    let mut rng = rng_of("maze", seed);
    let n = rng.random_range(4..=7usize);
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
    let mut made = scene("maze", seed, &mut rng, centre(0, 0), centre(n - 1, n - 1));
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

/// Several inclusions that all hold, a round one among them, with ponds.
pub(crate) fn inclusions(seed: u64) -> Scene {
    let mut rng = rng_of("inclusions", seed);
    let mut regions = Vec::new();
    for _ in 0..rng.random_range(2..4) {
        let n = rng.random_range(5..11);
        let ring: Vec<P> = (0..n)
            .map(|k| {
                let angle = TAU * f64::from(k) / f64::from(n);
                rotated([rng.random_range(110.0..420.0), 0.0], angle)
            })
            .collect();
        regions.push(zone(ring));
    }
    if rng.random_bool(0.5) {
        let shape =
            Shape::Disc([rng.random_range(-40.0..40.0), 0.0], rng.random_range(200.0..300.0));
        regions.push(Region { inclusion: true, shape });
    }
    for _ in 0..rng.random_range(3..9) {
        let centre = [rng.random_range(-150.0..150.0), rng.random_range(-150.0..150.0)];
        if norm(centre) > 30.0 {
            regions.push(disc(centre, rng.random_range(5.0..30.0)));
        }
    }
    // Ends as far out as there is room.
    let end = |angle: f64| {
        let direction = rotated([1.0, 0.0], angle);
        let open =
            (0..400).rev().map(|k| mul(direction, f64::from(k))).find(|&p| is_open(&regions, p));
        open.unwrap_or([0.0, 0.0])
    };
    let (start, goal) = (end(2.9), end(0.2));
    let made = scene("inclusions", seed, &mut rng, start, goal);
    turned(Scene { regions, ..made }, &mut rng)
}

/// Poles of 0.4 m, as circles and as tiny polygons, and hardly more room than needed.
pub(crate) fn poles(seed: u64) -> Scene {
    let mut rng = rng_of("poles", seed);
    let spacing = rng.random_range(10.0..15.0);
    let (columns, rows) = (rng.random_range(6..14), rng.random_range(4..10));
    let mut regions = Vec::new();
    for column in 0..columns {
        for row in 0..rows {
            let shift = if column % 2 == 0 { 0.0 } else { spacing / 2.0 };
            let mut jitter = || rng.random_range(-0.8..0.8);
            let centre = [
                f64::from(column) * spacing + jitter(),
                f64::from(row) * spacing + shift + jitter(),
            ];
            if rng.random_bool(0.5) {
                regions.push(disc(centre, 0.2));
            } else {
                let n = rng.random_range(3..9);
                let corner = |k: i32| rotated([0.2, 0.0], TAU * f64::from(k) / f64::from(n));
                regions.push(solid((0..n).map(|k| add(corner(k), centre)).collect()));
            }
        }
    }
    let (width, height) = (f64::from(columns) * spacing, f64::from(rows) * spacing);
    let start = open_near(&regions, [-12.0, height * rng.random_range(0.2..0.8)], &mut rng);
    let goal = open_near(&regions, [width + 8.0, height * rng.random_range(0.2..0.8)], &mut rng);
    let made = scene("poles", seed, &mut rng, start, goal);
    turned(Scene { regions, ..made }, &mut rng)
}

/// Outlines of many vertices: smooth, jagged, and curved coasts.
pub(crate) fn many_vertices(seed: u64) -> Scene {
    let mut rng = rng_of("many-vertices", seed);
    let vertices = [60, 200, 1000][seed as usize % 3];
    let mut regions = Vec::new();
    for k in 0..rng.random_range(2..5) {
        let centre = [70.0 + 130.0 * f64::from(k), rng.random_range(-40.0..40.0)];
        let radius = rng.random_range(25.0..55.0);
        let (lobes, depth) = (f64::from(rng.random_range(2..7)), rng.random_range(0.0..0.35));
        let jagged = if rng.random_bool(0.5) { 0.0 } else { rng.random_range(0.0..0.04) };
        let phase = rng.random_range(0.0..TAU);
        let ring = (0..vertices).map(|i| {
            let angle = TAU * f64::from(i) / f64::from(vertices);
            let noise = if jagged > 0.0 { rng.random_range(-jagged..jagged) } else { 0.0 };
            let r = radius * (1.0 + depth * (lobes * angle + phase).sin() + noise);
            add(centre, rotated([r, 0.0], angle))
        });
        regions.push(solid(ring.collect()));
    }
    let goal = [70.0 + 130.0 * regions.len() as f64, rng.random_range(-30.0..30.0)];
    let goal = open_near(&regions, goal, &mut rng);
    let start = open_near(&regions, [-20.0, 0.0], &mut rng);
    let made = scene("many-vertices", seed, &mut rng, start, goal);
    turned(Scene { regions, ..made }, &mut rng)
}

/// Heaps of rectangles, discs, stars and bow-ties that overlap.
pub(crate) fn heaps(seed: u64) -> Scene {
    let mut rng = rng_of("heaps", seed);
    let mut regions = Vec::new();
    for k in 0..rng.random_range(2..6) {
        let heap = [60.0 + 110.0 * f64::from(k), rng.random_range(-50.0..50.0)];
        for _ in 0..rng.random_range(1..6) {
            let offset = [rng.random_range(-35.0..35.0), rng.random_range(-35.0..35.0)];
            let centre = add(heap, offset);
            let size = rng.random_range(10.0..45.0);
            let angle = rng.random_range(0.0..TAU);
            let ring = match rng.random_range(0..5) {
                0 => {
                    let points = rng.random_range(4..8);
                    (0..2 * points)
                        .map(|i| {
                            let r = if i % 2 == 0 { size } else { size * 0.4 };
                            rotated([r, 0.0], PI * f64::from(i) / f64::from(points))
                        })
                        .collect()
                }
                1 => vec![[-size, -size], [size, size], [size, -size], [-size, size]],
                2 => {
                    regions.push(disc(centre, size));
                    continue;
                }
                _ => building(&mut rng, 2.0 * size),
            };
            regions.push(solid(placed(&ring, centre, angle)));
        }
    }
    let start = open_near(&regions, [-30.0, 0.0], &mut rng);
    let goal = open_near(&regions, [rng.random_range(250.0..600.0), 0.0], &mut rng);
    let made = scene("heaps", seed, &mut rng, start, goal);
    turned(Scene { regions, ..made }, &mut rng)
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

/// Twenty kilometres over a countryside with villages, masts and airfields.
pub(crate) fn long_leg(seed: u64) -> Scene {
    let mut rng = rng_of("long-leg", seed);
    let half = 10_000.0;
    let mut regions = Vec::new();
    for _ in 0..rng.random_range(10..35) {
        let centre = [rng.random_range(-half..half), rng.random_range(-900.0..900.0)];
        match rng.random_range(0..4) {
            0 => regions.push(disc(centre, rng.random_range(0.5..20.0))),
            1 => regions.push(disc(centre, rng.random_range(100.0..700.0))),
            _ => {
                let size = rng.random_range(50.0..800.0);
                let angle = rng.random_range(0.0..TAU);
                regions.push(solid(placed(&building(&mut rng, size), centre, angle)));
            }
        }
    }
    if seed.is_multiple_of(2) {
        let width = rng.random_range(1500.0..3000.0);
        regions.push(zone(rectangle([-half - 50.0, -width], [half + 50.0, width])));
    }
    let start = open_near(&regions, [-half, 0.0], &mut rng);
    let goal = open_near(&regions, [half, 0.0], &mut rng);
    let made = scene("long-leg", seed, &mut rng, start, goal);
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

/// Legs that have no safe path, each for another reason.
pub(crate) fn infeasible(seed: u64) -> Scene {
    let mut rng = rng_of("infeasible", seed);
    let mut made = scene("infeasible", seed, &mut rng, [-100.0, 0.0], [100.0, 0.0]);
    made.known = Known::Infeasible;
    let gap = rng.random_range(0.0..9.8);
    made.regions = match seed % 8 {
        // Four overlapping walls around the goal.
        0 => {
            let ring = rectangle([70.0, -30.0], [130.0, 30.0]);
            edges(&ring).map(|(a, b)| solid(wall(a, add(b, mul(sub(b, a), 0.02)), 2.0))).collect()
        }
        // A courtyard whose gate is too narrow, as one concave obstacle.
        1 => {
            let line = [
                [100. + gap, -40.],
                [150., -40.],
                [150., 40.],
                [60., 40.],
                [60., -40.],
                [100., -40.],
            ];
            vec![solid(ribbon(&line, 0.01))]
        }
        // A ring of discs around the start.
        2 => (0..24)
            .map(|k| {
                let out = rotated([60.0, 0.0], TAU * f64::from(k) / 24.0);
                disc(add(made.start, out), 5.0)
            })
            .collect(),
        // Two inclusions that share no point.
        3 => vec![
            zone(rectangle([-150.0, -50.0], [-20.0, 50.0])),
            zone(rectangle([-10.0, -50.0], [150.0, 50.0])),
        ],
        // An inclusion with a waist.
        4 => {
            let g = gap / 2.0;
            vec![zone(vec![
                [-150., -60.],
                [0., -g],
                [150., -60.],
                [150., 60.],
                [0., g],
                [-150., 60.],
            ])]
        }
        // A wall across an inclusion.
        5 => vec![
            zone(rectangle([-150.0, -80.0], [150.0, 80.0])),
            solid(rectangle([-1.0, -81.0], [1.0, 80.0 - gap])),
        ],
        // The goal in an obstacle.
        6 => vec![solid(rectangle([90.0, -20.0], [140.0, 20.0]))],
        // A round fence around the start only.
        _ => vec![Region { inclusion: true, shape: Shape::Disc(made.start, 80.0 + gap) }],
    };
    turned(made, &mut rng)
}
