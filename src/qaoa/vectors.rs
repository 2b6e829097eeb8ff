//! The engines against reference numbers of independent simulators (`tests/data/qaoa_vectors.json`).

use std::collections::BTreeMap;

use serde::Deserialize;

use super::angles::Angles;
use super::chain::ChainEngine;
use super::engine::Engine;
use super::ising::Ising;
use super::statevector::{Precision, StatevectorEngine};
use super::viterbi::exact_optimum;

#[derive(Deserialize)]
struct Vectors {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
struct Case {
    graph: String,
    qubits: usize,
    h: Vec<f64>,
    #[serde(rename = "J")]
    couplings: Vec<(usize, usize, f64)>,
    gammas: Vec<f64>,
    betas: Vec<f64>,
    expectation: f64,
    gradient_gammas: Vec<f64>,
    gradient_betas: Vec<f64>,
    sigma: f64,
    probabilities: BTreeMap<String, f64>,
    ground_state: String,
    ground_energy: f64,
    probability_of_ground_state: f64,
}

impl Case {
    fn ising(&self) -> Ising {
        Ising::new(0.0, self.h.clone(), self.couplings.clone()).unwrap()
    }

    fn check(&self, engine: &mut dyn Engine, tolerance: f64) {
        let close = |found: f64, expected: f64, what: &str| {
            assert!(
                (found - expected).abs() < tolerance,
                "{what} of the {} with {} qubits: {found} instead of {expected}",
                self.graph,
                self.qubits
            );
        };
        let angles = Angles::new(self.gammas.clone(), self.betas.clone()).unwrap();
        close(engine.expectation(&angles).unwrap(), self.expectation, "expectation");
        let (expectation, gradient) = engine.expectation_and_gradient(&angles).unwrap();
        close(expectation, self.expectation, "expectation beside the gradient");
        let slopes = self.gradient_gammas.iter().chain(&self.gradient_betas);
        for (found, &expected) in gradient.iter().zip(slopes) {
            close(found, expected, "gradient");
        }
        for (bits, &expected) in &self.probabilities {
            let bits = bits.parse().unwrap();
            close(engine.probability(&angles, &bits).unwrap(), expected, "probability");
        }
        let ground = self.ground_state.parse().unwrap();
        let probability = engine.probability(&angles, &ground).unwrap();
        close(probability, self.probability_of_ground_state, "probability of the ground state");
    }
}

fn cases() -> Vec<Case> {
    let text = include_str!("../../tests/data/qaoa_vectors.json");
    serde_json::from_str::<Vectors>(text).unwrap().cases
}

#[test]
fn the_chain_engine_agrees_with_the_reference_on_every_chain() {
    let chains: Vec<Case> = cases().into_iter().filter(|case| case.graph == "chain").collect();
    assert_eq!(chains.len(), 5);
    for case in chains {
        let chain = case.ising().to_chain().unwrap();
        case.check(&mut ChainEngine::new(chain, 1 << 30), 1e-9);
    }
}

#[test]
fn the_statevector_engine_agrees_with_the_reference_on_every_graph() {
    for case in cases() {
        for (precision, tolerance) in [(Precision::Double, 1e-9), (Precision::Single, 2e-4)] {
            let mut engine = StatevectorEngine::new(&case.ising(), precision, 1 << 30).unwrap();
            case.check(&mut engine, tolerance);
        }
    }
}

#[test]
fn sigma_and_the_exact_optimum_agree_with_the_reference() {
    for case in cases() {
        let ising = case.ising();
        assert!((ising.sigma() - case.sigma).abs() < 1e-9);
        let optimum = exact_optimum(&ising).unwrap();
        assert!((optimum.energy - case.ground_energy).abs() < 1e-9);
        assert_eq!(optimum.bits[0].to_string(), case.ground_state);
    }
}
