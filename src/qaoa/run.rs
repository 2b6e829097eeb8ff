//! One QAOA run: scale the problem, train (or take given angles), sample, and certify the result against
//! the exact optimum.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::angles::Angles;
use super::bits::Bits;
use super::chain::ChainEngine;
use super::engine::{Engine, EngineChoice, EngineError, EngineKind, Sample};
use super::ising::{Ising, Scale};
use super::statevector::{Precision, StatevectorEngine};
use super::train::{Objective, TrainSettings, Training, train};
use super::viterbi::exact_optimum;
use crate::stop::Stop;

/// Where the angles of a run come from.
#[derive(Debug, Clone, PartialEq)]
pub enum AnglesSource {
    /// Trained from the linear ramp with this many layers.
    Ramp(usize),
    /// Trained from these, for instance the optimum of an earlier run.
    CarriedOver(Angles),
    /// Taken as they are, without training.
    Given(Angles),
}

/// What a run does.
#[derive(Debug, Clone, PartialEq)]
pub struct RunSettings {
    /// Which engine runs the circuit.
    pub engine: EngineChoice,
    /// What is done to the problem before the circuit sees it.
    pub scale: Scale,
    /// Where the angles come from.
    pub angles: AnglesSource,
    /// How they are trained.
    pub train: TrainSettings,
    /// Measurements of the trained circuit.
    pub shots: u32,
    /// Seed of the measurements; the same seed gives the same samples.
    pub seed: u64,
}

impl Default for RunSettings {
    /// The paper's settings: 5 layers, 60 Adam steps, 1024 shots.
    fn default() -> Self {
        Self {
            engine: EngineChoice::Auto,
            scale: Scale::Sigma,
            angles: AnglesSource::Ramp(5),
            train: TrainSettings::default(),
            shots: 1024,
            seed: 0,
        }
    }
}

/// The cheapest sample.
#[derive(Debug, Clone, PartialEq)]
pub struct BestSample {
    /// Its bits.
    pub bits: Bits,
    /// Its energy, in the units of the input.
    pub energy: f64,
    /// Shots that gave it.
    pub count: u32,
}

impl BestSample {
    /// The one of lowest energy; `None` where there are no samples.
    pub(super) fn of(samples: &[Sample], ising: &Ising) -> Option<Self> {
        samples
            .iter()
            .map(|sample| (ising.energy(&sample.bits), sample))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(energy, Sample { bits, count })| Self {
                bits: bits.clone(),
                energy,
                count: *count,
            })
    }
}

/// The exact optimum and how the run compares with it; energies in the units of the input.
#[derive(Debug, Clone, PartialEq)]
pub struct Certificate {
    /// The lowest energy of any bitstring.
    pub exact_optimum: f64,
    /// How far the best sample lies above it; `None` without samples.
    pub gap: Option<f64>,
    /// Probability that one shot is optimal (of up to [`super::viterbi::MAX_OPTIMA`] equal optima).
    pub p_optimum: f64,
}

/// The outcome of a run; energies and losses in the units of the input.
#[derive(Debug, Clone, PartialEq)]
pub struct QaoaRun {
    /// The engine that ran the circuit.
    pub engine: EngineKind,
    /// Number of qubits.
    pub qubits: usize,
    /// The angles that were sampled; they apply to the scaled problem.
    pub angles: Angles,
    /// ⟨H⟩ at those angles.
    pub expectation: f64,
    /// What the training lowered.
    pub objective: Objective,
    /// Whether that was estimated from samples at every step.
    pub loss_is_sampled: bool,
    /// The objective at the start of the training and after each step; one value without training.
    pub loss: Vec<f64>,
    /// ∂⟨H⟩/∂angles, for given angles only.
    pub gradient: Option<Angles>,
    /// Distinct bitstrings in ascending order.
    pub samples: Vec<Sample>,
    /// The cheapest of them; `None` without shots.
    pub best: Option<BestSample>,
    /// Comparison with the exact optimum; `None` where that is out of reach.
    pub certificate: Option<Certificate>,
}

/// Runs QAOA and keeps engines and their workspace from run to run.
#[derive(Debug)]
pub struct Qaoa {
    memory_limit: u64,
    precision: Precision,
    chain: Option<ChainEngine>,
    statevector: Option<StatevectorEngine>,
}

impl Qaoa {
    /// Engines may use `memory_limit` bytes.
    #[must_use]
    pub fn new(memory_limit: u64) -> Self {
        Self { memory_limit, precision: Precision::Double, chain: None, statevector: None }
    }

    /// The precision of the statevector engine (`chain` is always in double precision).
    #[must_use]
    pub fn with_precision(self, precision: Precision) -> Self {
        Self { precision, ..self }
    }

    /// One run.
    ///
    /// # Errors
    /// If no engine can run the circuit, or `stop` says so between two steps.
    pub fn run(
        &mut self,
        ising: &Ising,
        settings: &RunSettings,
        stop: &Stop,
    ) -> Result<QaoaRun, EngineError> {
        let scaled = ising.scaled(settings.scale);
        let engine = self.engine(&scaled.ising, settings.engine)?;

        let mut gradient = None;
        let training = match &settings.angles {
            AnglesSource::Ramp(layers) => {
                train(engine, Angles::ramp(*layers), &settings.train, stop)?
            }
            AnglesSource::CarriedOver(start) => {
                train(engine, start.clone(), &settings.train, stop)?
            }
            AnglesSource::Given(angles) => {
                let (expectation, mut slopes) = engine.expectation_and_gradient(angles)?;
                slopes.iter_mut().for_each(|slope| *slope *= scaled.factor);
                gradient = Some(slopes);
                Training { angles: angles.clone(), lowest: expectation, loss: vec![expectation] }
            }
        };
        let Training { angles, lowest, loss } = training;
        let objective = match settings.angles {
            AnglesSource::Given(_) => Objective::Mean,
            _ => settings.train.objective,
        };
        let (expectation, loss_is_sampled) = match objective {
            Objective::Mean => (lowest, false),
            Objective::Cvar { .. } => (engine.expectation(&angles)?, !engine.cvar_is_exact()),
        };
        let mut rng = ChaCha8Rng::seed_from_u64(settings.seed);
        let samples = engine.sample(&angles, settings.shots, &mut rng)?;
        let best = BestSample::of(&samples, ising);

        let certificate = match exact_optimum(ising) {
            None => None,
            Some(optimum) => {
                let mut p_optimum = 0.0;
                for bits in &optimum.bits {
                    p_optimum += engine.probability(&angles, bits)?;
                }
                let gap = best.as_ref().map(|best| (best.energy - optimum.energy).max(0.0));
                Some(Certificate { exact_optimum: optimum.energy, gap, p_optimum })
            }
        };
        Ok(QaoaRun {
            engine: engine.kind(),
            qubits: ising.qubits(),
            angles,
            expectation: scaled.in_input_units(expectation),
            objective,
            loss_is_sampled,
            loss: loss.into_iter().map(|energy| scaled.in_input_units(energy)).collect(),
            gradient,
            samples,
            best,
            certificate,
        })
    }

    fn engine(
        &mut self,
        ising: &Ising,
        choice: EngineChoice,
    ) -> Result<&mut dyn Engine, EngineError> {
        let kind = match choice {
            EngineChoice::Auto if ising.is_chain() => EngineKind::Chain,
            EngineChoice::Auto => EngineKind::Statevector,
            EngineChoice::Only(kind) => kind,
        };
        match (kind, ising.to_chain()) {
            (EngineKind::Chain, Some(chain)) => {
                let engine = match self.chain.take() {
                    None => ChainEngine::new(chain, self.memory_limit),
                    Some(mut engine) => {
                        engine.set_problem(chain);
                        engine
                    }
                };
                Ok(self.chain.insert(engine))
            }
            (EngineKind::Chain, None) => {
                let distant = ising.couplings().iter().find(|&&(i, j, _)| j != i + 1);
                let (i, j) = distant.map_or((0, 0), |&(i, j, _)| (i, j));
                Err(EngineError::NotAChain { i, j })
            }
            (EngineKind::Ibm, _) => Err(EngineError::NoQpu),
            (EngineKind::Statevector, _) => {
                self.statevector = None;
                let engine = StatevectorEngine::new(ising, self.precision, self.memory_limit)?;
                Ok(self.statevector.insert(engine))
            }
        }
    }
}
