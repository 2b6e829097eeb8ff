//! The two engines against each other, against finite differences, and against their own samples.

use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::angles::Angles;
use super::bits::Bits;
use super::chain::ChainEngine;
use super::engine::{Engine, Sample};
use super::ising::{ChainIsing, Ising};
use super::statevector::{Precision, StatevectorEngine};

const MEMORY: u64 = 1 << 30;

fn chains() -> impl Strategy<Value = ChainIsing> {
    (1_usize..11).prop_flat_map(|qubits| {
        let coefficients = |count: usize| prop::collection::vec(-2.0..2.0_f64, count);
        (coefficients(qubits), coefficients(qubits - 1), -3.0..3.0_f64)
            .prop_map(|(h, j, constant)| ChainIsing::new(constant, h, j).unwrap())
    })
}

fn circuits() -> impl Strategy<Value = Angles> {
    (1_usize..7).prop_flat_map(|layers| {
        let angles = || prop::collection::vec(-1.5..1.5_f64, layers);
        (angles(), angles()).prop_map(|(gammas, betas)| Angles::new(gammas, betas).unwrap())
    })
}

fn engines(chain: &ChainIsing) -> (ChainEngine, StatevectorEngine) {
    let ising = Ising::from(chain.clone());
    let statevector = StatevectorEngine::new(&ising, Precision::Double, MEMORY).unwrap();
    (ChainEngine::new(chain.clone(), MEMORY), statevector)
}

fn frustrated_chain() -> ChainIsing {
    let h = vec![0.3, -0.2, 0.1, 0.4, -0.3, 0.2, 0.1];
    ChainIsing::new(0.0, h, vec![0.5, -0.4, 0.3, 0.2, -0.6, 0.1]).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn both_engines_give_the_same_numbers_on_any_chain(
        chain in chains(),
        angles in circuits(),
        pattern in any::<u16>(),
    ) {
        let (mut exact, mut amplitudes) = engines(&chain);
        let close = |a: f64, b: f64| (a - b).abs() < 1e-9;
        let (e1, g1) = exact.expectation_and_gradient(&angles).unwrap();
        let (e2, g2) = amplitudes.expectation_and_gradient(&angles).unwrap();
        prop_assert!(close(e1, e2), "{} and {}", e1, e2);
        prop_assert!(close(exact.expectation(&angles).unwrap(), e1));
        prop_assert!(close(amplitudes.expectation(&angles).unwrap(), e2));
        for (a, b) in g1.iter().zip(g2.iter()) {
            prop_assert!(close(a, b), "{:?} and {:?}", g1, g2);
        }
        let bits = Bits::from_index(chain.qubits(), usize::from(pattern));
        let p1 = exact.probability(&angles, &bits).unwrap();
        prop_assert!(close(p1, amplitudes.probability(&angles, &bits).unwrap()));
    }

    #[test]
    fn gradients_agree_with_finite_differences(chain in chains(), angles in circuits()) {
        let (mut exact, mut amplitudes) = engines(&chain);
        for engine in [&mut exact as &mut dyn Engine, &mut amplitudes] {
            let (_, gradient) = engine.expectation_and_gradient(&angles).unwrap();
            let step = 1e-5;
            for (index, slope) in gradient.iter().enumerate() {
                let mut at = |shift: f64| {
                    let mut shifted = angles.clone();
                    shifted.iter_mut().skip(index).take(1).for_each(|angle| *angle += shift);
                    engine.expectation(&shifted).unwrap()
                };
                let difference = (at(step) - at(-step)) / (2.0 * step);
                prop_assert!((slope - difference).abs() < 1e-5, "{} and {}", slope, difference);
            }
        }
    }
}

/// Pearson's χ² of the samples over all bitstrings that are expected at least five times.
fn chi_square(engine: &mut dyn Engine, angles: &Angles, shots: u32) -> (f64, usize) {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let samples = engine.sample(angles, shots, &mut rng).unwrap();
    assert_eq!(samples.iter().map(|sample| sample.count).sum::<u32>(), shots);
    assert!(samples.windows(2).all(|pair| pair[0].bits < pair[1].bits));
    let (mut statistic, mut cells) = (0.0, 0);
    for index in 0..1 << engine.qubits() {
        let bits = Bits::from_index(engine.qubits(), index);
        let expected = f64::from(shots) * engine.probability(angles, &bits).unwrap();
        if expected >= 5.0 {
            let sample = samples.iter().find(|sample| sample.bits == bits);
            let seen = sample.map_or(0.0, |sample| f64::from(sample.count));
            statistic += (seen - expected).powi(2) / expected;
            cells += 1;
        }
    }
    (statistic, cells)
}

#[test]
fn samples_follow_the_probabilities() {
    let (mut exact, mut amplitudes) = engines(&frustrated_chain());
    for engine in [&mut exact as &mut dyn Engine, &mut amplitudes] {
        let (statistic, cells) = chi_square(engine, &Angles::ramp(4), 200_000);
        // χ² has mean `cells` and deviation √(2 cells): six deviations are far out, and a wrong
        // distribution is further.
        let freedom = cells as f64;
        assert!(cells > 100);
        assert!(statistic < freedom + 6.0 * (2.0 * freedom).sqrt(), "{statistic} of {cells}");
    }
}

#[test]
fn a_seed_fixes_the_samples_and_another_changes_them() {
    let (mut exact, mut amplitudes) = engines(&frustrated_chain());
    for engine in [&mut exact as &mut dyn Engine, &mut amplitudes] {
        let mut draw = |seed: u64| -> Vec<Sample> {
            engine.sample(&Angles::ramp(3), 500, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap()
        };
        assert_eq!(draw(3), draw(3));
        assert_ne!(draw(3), draw(4));
    }
}

#[test]
fn probabilities_of_all_bitstrings_add_up_to_one() {
    let (mut exact, mut amplitudes) = engines(&frustrated_chain());
    for engine in [&mut exact as &mut dyn Engine, &mut amplitudes] {
        let all = (0..1 << 7).map(|index| Bits::from_index(7, index));
        let total: f64 = all.map(|bits| engine.probability(&Angles::ramp(5), &bits).unwrap()).sum();
        assert!((total - 1.0).abs() < 1e-12);
    }
}

#[test]
fn the_number_of_threads_does_not_change_a_bit_of_the_result() {
    let couplings = (0..14).map(|i| (i, (i * 5 + 3) % 14, 0.1 + i as f64 / 20.0));
    let couplings = couplings.filter(|&(i, j, _)| i != j).collect();
    let ising = Ising::new(0.0, vec![0.2; 14], couplings).unwrap();
    let gradient = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut engine = StatevectorEngine::new(&ising, Precision::Double, MEMORY).unwrap();
        pool.install(|| engine.expectation_and_gradient(&Angles::ramp(4)).unwrap())
    };
    assert_eq!(gradient(1), gradient(3));
}

#[test]
fn a_long_chain_is_sampled_and_its_samples_have_the_energy_of_the_expectation() {
    let n = 300;
    let h = (0..n).map(|i| 0.1 * ((i * 7 % 11) as f64 - 5.0)).collect();
    let j = (1..n).map(|i| 0.1 * ((i * 5 % 13) as f64 - 6.0)).collect();
    let chain = ChainIsing::new(0.0, h, j).unwrap();
    let mut engine = ChainEngine::new(chain.clone(), MEMORY);
    let angles = Angles::ramp(4);
    let expectation = engine.expectation(&angles).unwrap();
    let samples = engine.sample(&angles, 2000, &mut ChaCha8Rng::seed_from_u64(5)).unwrap();
    let ising = Ising::from(chain);
    let energies = samples.iter().map(|s| f64::from(s.count) * ising.energy(&s.bits));
    let mean = energies.sum::<f64>() / 2000.0;
    // The mean of 2000 shots deviates by about σ/√2000.
    assert!((mean - expectation).abs() < 6.0 * ising.sigma() / 2000_f64.sqrt());
}

#[test]
fn what_an_engine_cannot_do_is_an_error_with_the_figure() {
    use super::engine::{EngineError, EngineKind};
    let (mut exact, mut amplitudes) = engines(&frustrated_chain());
    let engine = EngineKind::Chain;
    assert_eq!(
        exact.expectation(&Angles::ramp(9)),
        Err(EngineError::TooManyLayers { engine, layers: 9, limit: 8 })
    );
    for engine in [&mut exact as &mut dyn Engine, &mut amplitudes] {
        let short = engine.probability(&Angles::ramp(2), &Bits::zeros(3));
        assert_eq!(short, Err(EngineError::BitsLength { found: 3, expected: 7 }));
    }
    let mut tiny = ChainEngine::new(frustrated_chain(), 1 << 10);
    assert!(matches!(tiny.expectation(&Angles::ramp(5)), Err(EngineError::Memory { .. })));
    let large = Ising::new(0.0, vec![1.0; 40], vec![]).unwrap();
    assert!(matches!(
        StatevectorEngine::new(&large, Precision::Double, MEMORY),
        Err(EngineError::Memory { qubits: 40, needed: 35_321_827_819_520, .. })
    ));
}

/// The lowest share `alpha` of a distribution, by its definition.
fn cvar_by_sorting(engine: &mut dyn Engine, ising: &Ising, angles: &Angles, alpha: f64) -> f64 {
    let n = ising.qubits();
    let mut states: Vec<(f64, f64)> = (0..1 << n)
        .map(|index| Bits::from_index(n, index))
        .map(|bits| (ising.energy(&bits), engine.probability(angles, &bits).unwrap()))
        .collect();
    states.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut left, mut sum) = (alpha, 0.0);
    for (energy, probability) in states {
        let taken = probability.min(left);
        sum += taken * energy;
        left -= taken;
    }
    sum / alpha
}

#[test]
fn cvar_from_amplitudes_follows_its_definition_and_its_gradient_finite_differences() {
    let ising = Ising::from(frustrated_chain());
    let rng = &mut ChaCha8Rng::seed_from_u64(1);
    let angles = Angles::ramp(3);
    for (precision, close) in [(Precision::Double, 1e-9), (Precision::Single, 1e-4)] {
        let mut engine = StatevectorEngine::new(&ising, precision, MEMORY).unwrap();
        for alpha in [0.03, 0.25, 1.0] {
            let mut cvar =
                |angles: &Angles| engine.cvar_and_gradient(angles, alpha, 0, rng).unwrap();
            let (value, gradient) = cvar(&angles);
            if precision == Precision::Double {
                for (k, slope) in gradient.iter().enumerate() {
                    let mut at = |step: f64| {
                        let mut moved = angles.clone();
                        moved.iter_mut().skip(k).take(1).for_each(|angle| *angle += step);
                        cvar(&moved).0
                    };
                    let difference = (at(1e-5) - at(-1e-5)) / 2e-5;
                    assert!((slope - difference).abs() < 1e-5, "{alpha} {k} {slope} {difference}");
                }
            }
            let exact = cvar_by_sorting(&mut engine, &ising, &angles, alpha);
            assert!((value - exact).abs() < close, "{alpha} {value} {exact}");
        }
        let (all, slopes) = engine.cvar_and_gradient(&angles, 1.0, 0, rng).unwrap();
        let (mean, plain) = engine.expectation_and_gradient(&angles).unwrap();
        assert!((all - mean).abs() < close);
        assert!(slopes.iter().zip(plain.iter()).all(|(a, b)| (a - b).abs() < 10.0 * close));
    }
}

#[test]
fn cvar_from_samples_comes_near_to_the_exact_one() {
    let (mut exact, mut amplitudes) = engines(&frustrated_chain());
    let rng = &mut ChaCha8Rng::seed_from_u64(6);
    for layers in [2, 4] {
        let angles = Angles::ramp(layers);
        for alpha in [0.1, 0.5] {
            let (value, gradient) = amplitudes.cvar_and_gradient(&angles, alpha, 0, rng).unwrap();
            let (estimate, slopes) = exact.cvar_and_gradient(&angles, alpha, 400_000, rng).unwrap();
            assert!((value - estimate).abs() < 0.01, "{value} {estimate}");
            for (a, b) in gradient.iter().zip(slopes.iter()) {
                assert!((a - b).abs() < 0.05, "{layers} {alpha}: {gradient:?} {slopes:?}");
            }
        }
    }
}
