//! What is measured: Ising problems and scenes, the same in every benchmark.
#![allow(dead_code)]

use quav::qaoa::{ChainIsing, Ising, Scale};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// The paper's layers.
pub(crate) const LAYERS: usize = 5;
/// What engines may use, bytes.
pub(crate) const MEMORY: u64 = 8 << 30;

fn coefficients(count: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    (0..count).map(|_| rng.random_range(-1.0..1.0)).collect()
}

/// An open chain, as the planner makes them.
pub(crate) fn chain(qubits: usize) -> ChainIsing {
    let rng = &mut ChaCha8Rng::seed_from_u64(1);
    let (h, j) = (coefficients(qubits, rng), coefficients(qubits - 1, rng));
    let ising = Ising::from(ChainIsing::new(0.0, h, j).unwrap());
    ising.scaled(Scale::Sigma).ising.to_chain().unwrap()
}

/// A random 3-regular graph: three stubs per qubit, paired at random until no pair is bad.
pub(crate) fn three_regular(qubits: usize) -> Ising {
    let rng = &mut ChaCha8Rng::seed_from_u64(2);
    let couplings = loop {
        let mut stubs: Vec<usize> = (0..3 * qubits).map(|stub| stub / 3).collect();
        stubs.shuffle(rng);
        let mut edges: Vec<(usize, usize)> = stubs
            .chunks_exact(2)
            .map(|pair| (pair[0].min(pair[1]), pair[0].max(pair[1])))
            .collect();
        edges.sort_unstable();
        edges.dedup();
        if edges.len() == 3 * qubits / 2 && edges.iter().all(|(i, j)| i != j) {
            break edges.into_iter().map(|(i, j)| (i, j, rng.random_range(-1.0..1.0))).collect();
        }
    };
    let ising = Ising::new(0.0, coefficients(qubits, rng), couplings).unwrap();
    ising.scaled(Scale::Sigma).ising.into_owned()
}

/// Metres of a city block with its street.
const BLOCK: f64 = 60.0;

/// A corner, metres.
type P = [f64; 2];

/// A turned rectangle by half its sides.
fn rectangle([x, y]: P, wide: f64, high: f64, rng: &mut ChaCha8Rng) -> Vec<P> {
    let (sin, cos) = rng.random_range(0.0..std::f64::consts::PI).sin_cos();
    [(-wide, -high), (wide, -high), (wide, high), (-wide, high)]
        .map(|(u, v)| [x + u * cos - v * sin, y + u * sin + v * cos])
        .to_vec()
}

/// The blocks of a town, one obstacle on each place of a square grid: turned rectangles of 15 to 40 m.
fn blocks(obstacles: usize, rng: &mut ChaCha8Rng) -> (Vec<Vec<P>>, f64) {
    let side = (obstacles as f64).sqrt().ceil();
    let blocks = (0..obstacles).map(|k| {
        let mut centre = |place: f64| BLOCK * (place + 0.5 + rng.random_range(-0.15..0.15));
        let middle = [centre((k as f64 % side).floor()), centre((k as f64 / side).floor())];
        let (wide, high) = (rng.random_range(7.5..20.0), rng.random_range(7.5..20.0));
        rectangle(middle, wide, high, rng)
    });
    (blocks.collect(), BLOCK * side)
}

/// One leg across a town of so many obstacles. Streets may be too narrow; the way round the town
/// never is.
pub(crate) fn town(obstacles: usize) -> Value {
    let (blocks, side) = blocks(obstacles, &mut ChaCha8Rng::seed_from_u64(obstacles as u64));
    mission(&blocks, &[[-30.0, 0.3 * side], [side + 30.0, 0.7 * side]])
}

/// A hundred legs over the crossings of a town of so many obstacles.
pub(crate) fn hundred_legs(obstacles: usize) -> Value {
    let rng = &mut ChaCha8Rng::seed_from_u64(obstacles as u64);
    let (blocks, side) = blocks(obstacles, rng);
    // Blocks leave at least 3 m around a crossing; those that leave less than 10 m do not count.
    let is_open = |p: P| blocks.iter().flatten().all(|&[x, y]| (x - p[0]).hypot(y - p[1]) > 10.0);
    let mut places: Vec<P> = Vec::new();
    while places.len() < 101 {
        let mut crossing = || BLOCK * (rng.random_range(0.0..side) / BLOCK).round();
        let place = [crossing(), crossing()];
        let is_far = |last: &P| {
            (BLOCK..10.0 * BLOCK).contains(&(last[0] - place[0]).hypot(last[1] - place[1]))
        };
        if is_open(place) && places.last().is_none_or(is_far) {
            places.push(place);
        }
    }
    mission(&blocks, &places)
}

/// Twenty kilometres over a countryside of so many buildings.
pub(crate) fn long_leg(obstacles: usize) -> Value {
    let rng = &mut ChaCha8Rng::seed_from_u64(obstacles as u64);
    let buildings: Vec<Vec<P>> = (0..obstacles)
        .map(|_| {
            let middle = [rng.random_range(0.0..20_000.0), rng.random_range(-2000.0..2000.0)];
            let (wide, high) = (rng.random_range(5.0..30.0), rng.random_range(5.0..30.0));
            rectangle(middle, wide, high, rng)
        })
        .collect();
    mission(&buildings, &[[-300.0, 0.0], [20_300.0, 0.0]])
}

/// A leg past so many lakes, whose rough shores have a thousand vertices each.
pub(crate) fn lakes(lakes: usize) -> Value {
    let rng = &mut ChaCha8Rng::seed_from_u64(lakes as u64);
    let shores: Vec<Vec<P>> = (0..lakes)
        .map(|k| {
            let (x, y) = (300.0 + 260.0 * k as f64, rng.random_range(-60.0..60.0));
            let (radius, lobes) = (rng.random_range(60.0..110.0), rng.random_range(2.0f64..8.0));
            let shore = (0..1000).map(|k| {
                let angle = std::f64::consts::TAU * f64::from(k) / 1000.0;
                let wave = 0.25 * (lobes.round() * angle).sin() + rng.random_range(-0.01..0.01);
                let (sin, cos) = angle.sin_cos();
                [x + radius * (1.0 + wave) * cos, y + radius * (1.0 + wave) * sin]
            });
            shore.collect()
        })
        .collect();
    mission(&shores, &[[0.0, 0.0], [300.0 + 260.0 * lakes as f64, 0.0]])
}

/// A `.plan` with obstacles and waypoints, metres east and north of a place.
fn mission(obstacles: &[Vec<P>], waypoints: &[P]) -> Value {
    let at = |&[x, y]: &P| {
        let latitude = 48.2 + y / 111_200.0;
        [latitude, 16.3 + x / (111_320.0 * latitude.to_radians().cos())]
    };
    let polygons: Vec<Value> = obstacles
        .iter()
        .map(|ring| {
            let ring: Vec<[f64; 2]> = ring.iter().map(at).collect();
            json!({ "polygon": ring, "inclusion": false, "version": 1 })
        })
        .collect();
    let items: Vec<Value> = waypoints
        .iter()
        .enumerate()
        .map(|(k, place)| {
            let [latitude, longitude] = at(place);
            json!({
                "type": "SimpleItem", "autoContinue": true, "command": 16, "doJumpId": k + 1,
                "frame": 3, "params": [0, 0, 0, null, latitude, longitude, 50],
            })
        })
        .collect();
    let home = at(&waypoints[0]);
    json!({
        "fileType": "Plan", "groundStation": "quavd", "version": 1,
        "geoFence": { "version": 2, "circles": [], "polygons": polygons },
        "mission": {
            "version": 2, "firmwareType": 12, "vehicleType": 2, "cruiseSpeed": 15, "hoverSpeed": 5,
            "plannedHomePosition": [home[0], home[1], 0], "items": items,
        },
        "rallyPoints": { "version": 2, "points": [] },
    })
}
