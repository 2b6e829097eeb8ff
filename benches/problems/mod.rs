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

/// A `.plan` with one leg across a town of so many obstacles: turned rectangles of 15 to 40 m, one on
/// each place of a square grid. Streets may be too narrow; the way round the town never is.
pub(crate) fn town(obstacles: usize) -> Value {
    let rng = &mut ChaCha8Rng::seed_from_u64(obstacles as u64);
    let side = (obstacles as f64).sqrt().ceil();
    let at = |x: f64, y: f64| {
        let latitude = 48.2 + y / 111_200.0;
        [latitude, 16.3 + x / (111_320.0 * latitude.to_radians().cos())]
    };
    let polygons: Vec<Value> = (0..obstacles)
        .map(|k| {
            let centre = |place: f64, rng: &mut ChaCha8Rng| {
                BLOCK * (place + 0.5 + rng.random_range(-0.15..0.15))
            };
            let (x, y) =
                (centre((k as f64 % side).floor(), rng), centre((k as f64 / side).floor(), rng));
            let (wide, high) = (rng.random_range(7.5..20.0), rng.random_range(7.5..20.0));
            let (sin, cos) = rng.random_range(0.0..std::f64::consts::PI).sin_cos();
            let corners = [(-wide, -high), (wide, -high), (wide, high), (-wide, high)];
            let ring: Vec<[f64; 2]> =
                corners.map(|(u, v)| at(x + u * cos - v * sin, y + u * sin + v * cos)).to_vec();
            json!({ "polygon": ring, "inclusion": false, "version": 1 })
        })
        .collect();
    let (start, goal) =
        (at(-30.0, 0.3 * BLOCK * side), at(BLOCK * side + 30.0, 0.7 * BLOCK * side));
    let item = |number: usize, [latitude, longitude]: [f64; 2]| {
        json!({
            "type": "SimpleItem", "autoContinue": true, "command": 16, "doJumpId": number,
            "frame": 3, "params": [0, 0, 0, null, latitude, longitude, 50],
        })
    };
    json!({
        "fileType": "Plan", "groundStation": "quavd", "version": 1,
        "geoFence": { "version": 2, "circles": [], "polygons": polygons },
        "mission": {
            "version": 2, "firmwareType": 12, "vehicleType": 2, "cruiseSpeed": 15, "hoverSpeed": 5,
            "plannedHomePosition": [start[0], start[1], 0],
            "items": [item(1, start), item(2, goal)],
        },
        "rallyPoints": { "version": 2, "points": [] },
    })
}
