//! Scenes like those that people fly in, and worse ones: every family from a seed.

mod obstacles;
mod passages;
mod zones;

pub(crate) use obstacles::*;
pub(crate) use passages::*;
pub(crate) use zones::*;

use std::f64::consts::TAU;

use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use quav::fence::InclusionRule;

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
    let special = *PLACES.choose(rng).unwrap();
    let mut dice = rng_of(&format!("place of {family}"), seed);
    Scene {
        name: format!("{family} {seed}"),
        at: if dice.random_bool(0.5) { special } else { anywhere(&mut dice) },
        start,
        goal,
        regions: Vec::new(),
        rule: InclusionRule::All,
        known: Known::Nothing,
    }
}

/// Any place on Earth is as likely as any other.
fn anywhere(rng: &mut ChaCha8Rng) -> (f64, f64) {
    (rng.random_range(-1.0f64..1.0).asin().to_degrees(), rng.random_range(-180.0..180.0))
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
