//! [`Qpu`]: what a quantum processor can do, many circuits at a time, and training with nothing but its
//! shots. How a processor is reached is not known here.
//!
//! # Gradients from shots
//!
//! Each angle is shared by all gates of its layer, so that the two-term parameter-shift rule, which is
//! for one gate of two eigenvalues, does not hold for it; shifting every gate for itself would take some
//! 600 circuits a step at n = 20, p = 5. Here each angle is shifted by ±δ and the derivative is the
//! central difference, 4p circuits a step in one job. With `R` shots and a standard deviation `s` of H in
//! the state (1 over uniform bitstrings, less as training goes on), its standard error is
//! `s / (δ √(2R))` and its bias `δ² L‴/6`: 0.15 s and a few hundredths at δ = 0.15 and R = 1024, which
//! Adam, whose steps go by the sign and steadiness of a slope, averages over some ten steps.

use thiserror::Error;

use super::adam::Adam;
use super::angles::Angles;
use super::engine::{EngineKind, Sample};
use super::ising::{ChainIsing, Ising, Scale};
use super::run::{BestSample, Certificate, QaoaRun};
use super::train::Objective;
use crate::stop::{Stop, Stopped};

/// The shift δ of an angle, radians.
const SHIFT: f64 = 0.15;

/// A circuit to measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QpuCircuit<'a> {
    /// The Hamiltonian that it applies (scaled).
    pub chain: &'a ChainIsing,
    /// Its angles.
    pub angles: &'a Angles,
}

/// How the text of a circuit gets its angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Use {
    /// Each circuit is compiled for its own angles: the fewest gates.
    Sampling,
    /// The circuits are one circuit at different angles: compiled once, so that all of them have the same
    /// gates and, but for the angles, the same errors.
    Training,
}

/// What a circuit was measured to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Distinct bitstrings in ascending order, as they were read.
    pub samples: Vec<Sample>,
    /// The probability of each of them, with readout errors taken out.
    pub probabilities: Vec<f64>,
    /// ⟨H⟩ with readout errors taken out, in units of the chain.
    pub expectation: f64,
    /// ⟨H⟩ as it was read.
    pub raw_expectation: f64,
    /// The standard error of [`Measured::expectation`] from the number of shots.
    pub standard_error: f64,
}

/// Jobs that are going to be wanted, for an estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JobPlan {
    /// How many of this kind.
    pub jobs: usize,
    /// Circuits in each.
    pub circuits: usize,
}

/// What has been used of a QPU.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub struct QpuUse {
    /// The processor.
    pub backend: String,
    /// The qubits that the chains were laid on.
    pub line: Vec<u32>,
    /// Jobs with results.
    pub jobs: usize,
    /// Those of them that an earlier run had submitted and paid for.
    pub picked_up: usize,
    /// Circuits in them.
    pub circuits: usize,
    /// QPU seconds that all jobs were estimated to take, before the first was submitted.
    pub estimated_seconds: f64,
    /// QPU seconds that the service has charged.
    pub charged_seconds: f64,
}

/// Why a QPU gave nothing.
#[derive(Debug, Error)]
#[error("{reason}")]
pub struct QpuError {
    /// What happened and what to do.
    pub reason: String,
    /// Set where it was this side that did not wait any longer.
    pub stopped: Option<Stopped>,
}

/// A quantum processor.
pub trait Qpu: Send {
    /// Makes sure that it can run chains of so many qubits and layers, and estimates what the jobs take.
    /// Nothing is submitted.
    ///
    /// # Errors
    /// [`QpuError`], also where it would take more than is left to use.
    fn prepare(
        &mut self,
        qubits: usize,
        layers: usize,
        shots: u32,
        plan: &[JobPlan],
        stop: &Stop,
    ) -> Result<(), QpuError>;

    /// Measures every circuit `shots` times, in one job, and waits for it as long as `stop` allows.
    ///
    /// # Errors
    /// [`QpuError`]; a job that is not waited for any longer has been cancelled.
    fn measure(
        &mut self,
        circuits: &[QpuCircuit<'_>],
        shots: u32,
        purpose: Use,
        stop: &Stop,
    ) -> Result<Vec<Measured>, QpuError>;

    /// What has been used until now.
    fn used(&self) -> QpuUse;
}

/// The outcome of a training on a QPU, in units of the chain.
#[derive(Debug, Clone, PartialEq)]
pub struct QpuTraining {
    /// The angles with the lowest loss that was measured.
    pub angles: Angles,
    /// ⟨H⟩ before each step, as measured.
    pub loss: Vec<f64>,
    /// Its standard errors.
    pub loss_errors: Vec<f64>,
}

/// Trains from `start` with gradients from shots, one job a step.
///
/// # Errors
/// [`QpuError`] where a job has no result.
pub fn train_on_qpu(
    qpu: &mut dyn Qpu,
    chain: &ChainIsing,
    start: Angles,
    steps: usize,
    learning_rate: f64,
    shots: u32,
    stop: &Stop,
) -> Result<QpuTraining, QpuError> {
    let mut adam = Adam::new(learning_rate, start.layers());
    let mut best = (f64::INFINITY, start.clone());
    let mut angles = start;
    let (mut loss, mut loss_errors) = (Vec::new(), Vec::new());
    for _ in 0..steps {
        let shifted = shifts(&angles);
        let points: Vec<QpuCircuit<'_>> = std::iter::once(&angles)
            .chain(&shifted)
            .map(|angles| QpuCircuit { chain, angles })
            .collect();
        let measured = qpu.measure(&points, shots, Use::Training, stop)?;
        let expectations: Vec<f64> = measured.iter().map(|point| point.expectation).collect();
        let [here, pairs @ ..] = expectations.as_slice() else { break };
        loss.push(*here);
        loss_errors.extend(measured.first().map(|point| point.standard_error));
        if *here < best.0 {
            best = (*here, angles.clone());
        }
        let mut gradient = Angles::zeros(angles.layers());
        for (slope, pair) in gradient.iter_mut().zip(pairs.chunks_exact(2)) {
            *slope = (pair[0] - pair[1]) / (2.0 * SHIFT);
        }
        adam.step(&mut angles, &gradient);
    }
    Ok(QpuTraining { angles: best.1, loss, loss_errors })
}

/// Circuits of one step of [`train_on_qpu`].
#[must_use]
pub fn circuits_of_a_step(layers: usize) -> usize {
    1 + 4 * layers
}

/// Each angle a little more and a little less, in the order of [`Angles::iter`].
fn shifts(angles: &Angles) -> Vec<Angles> {
    let shifted = |index: usize, by: f64| {
        let mut angles = angles.clone();
        if let Some(angle) = angles.iter_mut().nth(index) {
            *angle += by;
        }
        angles
    };
    (0..2 * angles.layers()).flat_map(|k| [shifted(k, SHIFT), shifted(k, -SHIFT)]).collect()
}

/// What was measured at angles that apply to the scaled problem, in the form of every run. The
/// probability of the optimum is what was measured.
#[must_use]
pub fn run_of(
    ising: &Ising,
    angles: Angles,
    loss: Vec<f64>,
    exact_optimum: Option<f64>,
    measured: Measured,
) -> QaoaRun {
    let best = BestSample::of(&measured.samples, ising);
    let certificate = exact_optimum.map(|exact_optimum| {
        let close = 1e-9 * exact_optimum.abs().max(1.0);
        let optimal =
            |(sample, _): &(&Sample, &f64)| ising.energy(&sample.bits) <= exact_optimum + close;
        let probabilities = measured.samples.iter().zip(&measured.probabilities);
        let p_optimum = probabilities.filter(optimal).fold(0.0, |sum, (_, p)| sum + p);
        let gap = best.as_ref().map(|best| (best.energy - exact_optimum).max(0.0));
        Certificate { exact_optimum, gap, p_optimum }
    });
    QaoaRun {
        engine: EngineKind::Ibm,
        qubits: ising.qubits(),
        angles,
        expectation: ising.scaled(Scale::Sigma).in_input_units(measured.expectation),
        objective: Objective::Mean,
        loss_is_sampled: false,
        loss,
        gradient: None,
        samples: measured.samples,
        best,
        certificate,
    }
}

/// ⟨H⟩ of what was read, with its standard error.
#[must_use]
pub fn sampled_expectation(chain: &ChainIsing, samples: &[Sample]) -> (f64, f64) {
    let shots: f64 = samples.iter().map(|sample| f64::from(sample.count)).sum();
    let ising = Ising::from(chain.clone());
    let energies: Vec<(f64, f64)> = samples
        .iter()
        .map(|sample| (ising.energy(&sample.bits), f64::from(sample.count)))
        .collect();
    let mean = energies.iter().map(|(energy, count)| energy * count).sum::<f64>() / shots;
    let squares = energies.iter().map(|(e, count)| (e - mean).powi(2) * count).sum::<f64>();
    (mean, (squares / shots).sqrt() / shots.sqrt())
}

#[cfg(test)]
pub(crate) mod testing {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::super::chain::ChainEngine;
    use super::super::engine::Engine;
    use super::*;

    /// A QPU without errors.
    pub(crate) struct IdealQpu {
        pub(crate) used: QpuUse,
        pub(crate) rng: ChaCha8Rng,
        /// Jobs after which it fails.
        pub(crate) fails_after: usize,
    }

    impl IdealQpu {
        pub(crate) fn new() -> Self {
            let used = QpuUse { backend: "ideal".to_owned(), ..QpuUse::default() };
            Self { used, rng: ChaCha8Rng::seed_from_u64(1), fails_after: usize::MAX }
        }
    }

    impl Qpu for IdealQpu {
        fn prepare(
            &mut self,
            _qubits: usize,
            _layers: usize,
            _shots: u32,
            _plan: &[JobPlan],
            _stop: &Stop,
        ) -> Result<(), QpuError> {
            Ok(())
        }

        fn measure(
            &mut self,
            circuits: &[QpuCircuit<'_>],
            shots: u32,
            _purpose: Use,
            stop: &Stop,
        ) -> Result<Vec<Measured>, QpuError> {
            if let Err(stopped) = stop.check() {
                return Err(QpuError { reason: stopped.to_string(), stopped: Some(stopped) });
            }
            if self.used.jobs >= self.fails_after {
                return Err(QpuError { reason: "out of order".to_owned(), stopped: None });
            }
            self.used.jobs += 1;
            self.used.circuits += circuits.len();
            let measure = |circuit: &QpuCircuit<'_>| {
                let mut engine = ChainEngine::new(circuit.chain.clone(), 1 << 30);
                let samples = engine.sample(circuit.angles, shots, &mut self.rng).unwrap();
                let (expectation, standard_error) = sampled_expectation(circuit.chain, &samples);
                let share = |sample: &Sample| f64::from(sample.count) / f64::from(shots);
                Measured {
                    probabilities: samples.iter().map(share).collect(),
                    samples,
                    expectation,
                    raw_expectation: expectation,
                    standard_error,
                }
            };
            Ok(circuits.iter().map(measure).collect())
        }

        fn used(&self) -> QpuUse {
            self.used.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::chain::ChainEngine;
    use super::super::engine::Engine;
    use super::super::train::{TrainSettings, train};
    use super::testing::IdealQpu;
    use super::*;

    /// A scaled chain of 8 qubits, like those of the planner.
    fn chain() -> ChainIsing {
        let h = vec![-0.3, 0.12, 0.2, -0.25, 0.1, 0.3, -0.2, 0.15];
        let j = vec![0.25, -0.3, 0.35, 0.2, -0.25, 0.3, 0.2];
        let norm = h.iter().chain(&j).map(|v: &f64| v * v).sum::<f64>().sqrt();
        let scaled = |v: Vec<f64>| v.into_iter().map(|v| v / norm).collect();
        ChainIsing::new(0.0, scaled(h), scaled(j)).unwrap()
    }

    #[test]
    fn the_estimated_gradient_agrees_with_the_exact_one_within_its_error() {
        let chain = chain();
        let angles = Angles::ramp(3);
        let (_, exact) =
            ChainEngine::new(chain.clone(), 1 << 30).expectation_and_gradient(&angles).unwrap();
        let shots = 200_000;
        let shifted = shifts(&angles);
        let points: Vec<_> =
            shifted.iter().map(|angles| QpuCircuit { chain: &chain, angles }).collect();
        let measured =
            IdealQpu::new().measure(&points, shots, Use::Training, &Stop::new()).unwrap();
        for (exact, pair) in exact.iter().zip(measured.chunks_exact(2)) {
            let slope = (pair[0].expectation - pair[1].expectation) / (2.0 * SHIFT);
            // Five standard errors of 1/(δ√2R), and the bias.
            let error = 5.0 / (SHIFT * (2.0 * f64::from(shots)).sqrt());
            assert!((slope - exact).abs() < error + 0.1, "{slope} {exact}");
        }
    }

    #[test]
    fn training_from_shots_comes_near_to_exact_training() {
        let chain = chain();
        let mut engine = ChainEngine::new(chain.clone(), 1 << 30);
        let settings = TrainSettings { steps: 20, ..TrainSettings::default() };
        let exact = train(&mut engine, Angles::ramp(3), &settings, &Stop::new()).unwrap();
        let mut qpu = IdealQpu::new();
        let trained =
            train_on_qpu(&mut qpu, &chain, Angles::ramp(3), 20, 0.1, 1024, &Stop::new()).unwrap();
        assert_eq!((trained.loss.len(), trained.loss_errors.len()), (20, 20));
        assert_eq!((qpu.used.jobs, qpu.used.circuits), (20, 20 * circuits_of_a_step(3)));
        let reached = engine.expectation(&trained.angles).unwrap();
        let start = exact.loss[0];
        let share = (start - reached) / (start - exact.lowest);
        assert!(share > 0.8, "{share} of the way");
    }
}
