//! Scenes of inclusions, and scenes without a way.

use std::f64::consts::TAU;

use rand::Rng;
use rand::seq::IndexedRandom;

use super::*;

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

/// Inclusions in a row of which one is enough: the way leads from each into the next.
pub(crate) fn unions(seed: u64) -> Scene {
    let mut rng = rng_of("unions", seed);
    let mut regions = Vec::new();
    let mut centres = vec![[0.0, 0.0]];
    for _ in 0..rng.random_range(1..5) {
        let step = rotated([rng.random_range(60.0..110.0), 0.0], rng.random_range(-1.2..1.2));
        centres.push(add(centres[centres.len() - 1], step));
    }
    for &centre in &centres {
        let size = rng.random_range(35.0..75.0);
        if rng.random_bool(0.25) {
            regions.push(Region { inclusion: true, shape: Shape::Disc(centre, size) });
            continue;
        }
        let n = rng.random_range(3..9);
        let first = rng.random_range(0.0..TAU);
        let corner = |k: i32| {
            let out = rotated([size, 0.0], first + TAU * f64::from(k) / f64::from(n));
            add(centre, mul(out, rng.random_range(0.75..1.25)))
        };
        regions.push(zone((0..n).map(corner).collect()));
    }
    for _ in 0..rng.random_range(0..6) {
        let centre = add(*centres.choose(&mut rng).unwrap(), [rng.random_range(-50.0..50.0); 2]);
        let ends = [centres[0], centres[centres.len() - 1]];
        let radius = rng.random_range(0.5..12.0);
        if ends.iter().all(|&end| dist(end, centre) > radius + 2.0 * BUFFER) {
            regions.push(disc(centre, radius));
        }
    }
    let (start, goal) = (centres[0], centres[centres.len() - 1]);
    let made = scene("unions", seed, &mut rng, start, goal);
    turned(Scene { regions, rule: InclusionRule::Any, ..made }, &mut rng)
}

/// A fenced lot full of shapes: there may be a way across, or none.
pub(crate) fn crowded_lot(seed: u64) -> Scene {
    let mut rng = rng_of("crowded-lot", seed);
    let (width, half) = (rng.random_range(80.0..220.0), rng.random_range(20.0..90.0));
    let mut regions = vec![zone(rectangle([-30.0, -half], [width + 30.0, half]))];
    let shapes = (width * half / rng.random_range(250.0..600.0)) as u32;
    for _ in 0..shapes {
        let centre = [rng.random_range(5.0..width - 5.0), rng.random_range(-half..half)];
        let size = rng.random_range(4.0..22.0);
        if rng.random_bool(0.3) {
            regions.push(disc(centre, size / 2.0));
        } else {
            let angle = rng.random_range(0.0..TAU);
            regions.push(solid(placed(&building(&mut rng, size), centre, angle)));
        }
    }
    let start = open_near(&regions, [-15.0, 0.0], &mut rng);
    let goal = open_near(&regions, [width + 15.0, 0.0], &mut rng);
    let made = scene("crowded-lot", seed, &mut rng, start, goal);
    turned(Scene { regions, ..made }, &mut rng)
}

/// A goal in a town behind a ring of buildings that leave no gap wide enough.
pub(crate) fn sealed_yard(seed: u64) -> Scene {
    let mut rng = rng_of("sealed-yard", seed);
    let mut made = urban(60, seed ^ 0x5ea1);
    let radius = rng.random_range(40.0..150.0);
    let size = 12.0;
    // Wherever two neighbours stand, the gap is narrower than twice the buffer.
    let pitch = size + rng.random_range(0.0..9.5);
    let count = (TAU * radius / pitch).ceil();
    for k in 0..count as u32 {
        let angle = TAU * f64::from(k) / count;
        let centre = add(made.goal, rotated([radius, 0.0], angle));
        let square = rectangle([-size / 2.0; 2], [size / 2.0; 2]);
        made.regions.push(solid(placed(&square, centre, angle)));
    }
    made.name = format!("sealed-yard {seed}");
    // The nearest open place may be in the yard.
    made.start = made.goal;
    while dist(made.start, made.goal) < radius + size {
        let away = rotated([2.0 * radius + 30.0, 0.0], rng.random_range(0.0..TAU));
        made.start = open_near(&made.regions, add(made.goal, away), &mut rng);
    }
    made.known = Known::Infeasible;
    made
}
