//! Scenes with obstacles to go round in the open.

use std::f64::consts::{PI, TAU};

use rand::Rng;

use super::*;

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

/// Twenty kilometres with woods and lakes of up to a thousand vertices between villages.
pub(crate) fn countryside(seed: u64) -> Scene {
    let mut rng = rng_of("countryside", seed);
    let half = 10_000.0;
    let mut regions = Vec::new();
    for _ in 0..rng.random_range(40..80) {
        let centre = [rng.random_range(-half..half), rng.random_range(-1200.0..1200.0)];
        let size = rng.random_range(30.0..350.0);
        if rng.random_bool(0.7) {
            let angle = rng.random_range(0.0..TAU);
            regions.push(solid(placed(&building(&mut rng, size), centre, angle)));
            continue;
        }
        let vertices = [30, 200, 1000][rng.random_range(0..3)];
        let (lobes, depth) = (f64::from(rng.random_range(2..9)), rng.random_range(0.0..0.3));
        let ring = (0..vertices).map(|i| {
            let angle = TAU * f64::from(i) / f64::from(vertices);
            let r = size * (1.0 + depth * (lobes * angle).sin() + rng.random_range(-0.01..0.01));
            add(centre, rotated([r, 0.0], angle))
        });
        regions.push(solid(ring.collect()));
    }
    let start = open_near(&regions, [-half, 0.0], &mut rng);
    let goal = open_near(&regions, [half, 0.0], &mut rng);
    let made = scene("countryside", seed, &mut rng, start, goal);
    turned(Scene { regions, ..made }, &mut rng)
}
