use super::*;
use crate::ibm::device::Entangler;
use crate::ibm::lower::{Binding, demand, lower_on};
use crate::ibm::metrics::Metrics;
use crate::ibm::samples::device;
use crate::qaoa::{Angles, ChainIsing};

fn chain(qubits: usize) -> ChainIsing {
    let h = (0..qubits).map(|i| 0.05 * ((i * 7 % 11) as f64 - 5.2)).collect();
    let j = (1..qubits).map(|i| 0.05 * ((i * 5 % 13) as f64 - 6.3)).collect();
    ChainIsing::new(0.0, h, j).unwrap()
}

const ECR: Native = Native { entangler: Entangler::Ecr, has_rx: false };

/// Every simple path, found without any bound, as `visit(qubits)`.
fn every_path(neighbours: &[Vec<usize>], length: usize, visit: &mut dyn FnMut(&[usize])) {
    fn extend(
        neighbours: &[Vec<usize>],
        length: usize,
        path: &mut Vec<usize>,
        visit: &mut dyn FnMut(&[usize]),
    ) {
        if path.len() == length {
            return visit(path);
        }
        for &next in &neighbours[path[path.len() - 1]] {
            if !path.contains(&next) {
                path.push(next);
                extend(neighbours, length, path, visit);
                path.pop();
            }
        }
    }
    for start in 0..neighbours.len() {
        extend(neighbours, length, &mut vec![start], visit);
    }
}

/// The probability that nothing fails, straight from the definition.
fn success(device: &Device, demand: &Demand, path: &[usize]) -> f64 {
    let name = |qubit: usize| PhysicalQubit(qubit as u32);
    let forward =
        |bond: usize| device.coupler(Entangler::Ecr, name(path[bond]), name(path[bond + 1]));
    let backward =
        |bond: usize| device.coupler(Entangler::Ecr, name(path[bond + 1]), name(path[bond]));
    let mut product = 1.0;
    for (place, &qubit) in path.iter().enumerate() {
        let bonds = path.len() - 1;
        let left = place.saturating_sub(1);
        let right = place.min(bonds - 1);
        let direction = |bond: usize| usize::from(forward(bond).is_none());
        let pulses = demand.pulses[place][direction(left)][direction(right)];
        let qubit = device.qubits()[qubit];
        product *= (1.0 - qubit.sx.unwrap().error).powi(pulses as i32);
        product *= 1.0 - qubit.readout.unwrap().error;
        if place < bonds {
            let ecr = forward(place).or(backward(place)).unwrap();
            product *= (1.0 - ecr.error).powi(demand.bonds[place] as i32);
        }
    }
    product
}

#[test]
fn the_line_on_an_eagle_is_the_best_of_all_that_exist() {
    let kyiv = device("kyiv");
    let mut neighbours = vec![Vec::new(); 127];
    for (a, b, _) in kyiv.couplers(Entangler::Ecr) {
        neighbours[a.index()].push(b.index());
        neighbours[b.index()].push(a.index());
    }
    for qubits in [2, 8, 20] {
        let (chain, angles) = (chain(qubits), Angles::ramp(5));
        let demand = demand(ECR, &chain, Binding::Bound(&angles)).unwrap();
        let line = Line::choose(&kyiv, ECR, &demand).unwrap();
        let (mut best, mut count) = (0.0_f64, 0);
        every_path(&neighbours, qubits, &mut |path| {
            best = best.max(success(&kyiv, &demand, path));
            count += 1;
        });
        assert!(line.is_proven_best());
        assert!((line.success() / best - 1.0).abs() < 1e-12, "{} of {best}", line.success());
        // 15,814 lines with the faulty couplers, in two directions.
        assert!(qubits != 20 || (20_000..31_628).contains(&count), "{count}");
        // And the circuit on it is what the demand said.
        let circuit = lower_on(&line, &chain, Binding::Bound(&angles)).unwrap();
        let metrics = Metrics::of(&circuit, &kyiv);
        assert!((metrics.success / line.success() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn the_same_calibration_gives_the_same_line() {
    let kyiv = device("kyiv");
    let demand = demand(ECR, &chain(20), Binding::Inputs(5)).unwrap();
    let line = Line::choose(&kyiv, ECR, &demand).unwrap();
    assert_eq!(Line::choose(&kyiv, ECR, &demand), Ok(line.clone()));
    for bond in line.qubits().windows(2) {
        let coupled = |a, b| kyiv.coupler(Entangler::Ecr, a, b).is_some();
        assert!(coupled(bond[0], bond[1]) || coupled(bond[1], bond[0]));
    }
}

#[test]
fn a_square_lattice_and_longer_chains_have_lines_too() {
    let nighthawk = device("nighthawk");
    let cz = Native { entangler: Entangler::Cz, has_rx: false };
    for qubits in [1, 20, 60] {
        let demand = demand(cz, &chain(qubits), Binding::Inputs(3)).unwrap();
        let line = Line::choose(&nighthawk, cz, &demand).unwrap();
        let mut distinct = line.qubits().to_vec();
        distinct.sort_unstable();
        distinct.dedup();
        assert_eq!(distinct.len(), qubits);
        assert!(qubits > 20 || line.is_proven_best());
    }
}

#[test]
fn a_chain_that_does_not_fit_is_refused_with_the_reason() {
    let kyiv = device("kyiv");
    let choose = |qubits| {
        let demand = demand(ECR, &chain(qubits), Binding::Inputs(1)).unwrap();
        Line::choose(&kyiv, ECR, &demand)
    };
    assert!(matches!(choose(128), Err(LineError::TooFewQubits { wanted: 128, .. })));
    assert!(matches!(choose(127), Err(LineError::NoLine { wanted: 127, .. })));
}
