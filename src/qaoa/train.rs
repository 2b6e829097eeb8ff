//! Training: Adam on ⟨H⟩ with exact gradients (or on CVaR), stopped early where the loss has settled.

use std::fmt;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::adam::Adam;
use super::angles::Angles;
use super::engine::{Engine, EngineError};
use crate::stop::Stop;

/// What a training lowers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Objective {
    /// ⟨H⟩.
    #[default]
    Mean,
    /// The mean of the best measurements ([`super::cvar`]).
    Cvar {
        /// Their share of all, above 0 and at most 1.
        alpha: f64,
        /// Samples of each step, where the engine needs them.
        shots: u32,
        /// Seed of these samples.
        seed: u64,
    },
}

impl fmt::Display for Objective {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mean => f.write_str("mean"),
            Self::Cvar { alpha, .. } => write!(f, "cvar {alpha}"),
        }
    }
}

/// How a circuit is trained. Losses are in the units of the engine's (scaled) problem.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainSettings {
    /// The most Adam steps taken.
    pub steps: usize,
    /// Adam's step size, radians.
    pub learning_rate: f64,
    /// When to stop before `steps`; `None` takes them all.
    pub settled: Option<Settled>,
    /// What is lowered.
    pub objective: Objective,
}

/// The loss has settled once `window` steps in a row have not lowered it by more than `tolerance`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settled {
    /// Steps to wait for an improvement.
    pub window: usize,
    /// Improvement that counts, in units of the scaled problem (its standard deviation is 1).
    pub tolerance: f64,
}

impl Default for TrainSettings {
    /// The paper's settings: 60 steps at 0.1, all of them.
    fn default() -> Self {
        Self { steps: 60, learning_rate: 0.1, settled: None, objective: Objective::Mean }
    }
}

/// The outcome of a training.
#[derive(Debug, Clone, PartialEq)]
pub struct Training {
    /// The angles with the lowest loss that was seen.
    pub angles: Angles,
    /// The loss at those angles.
    pub lowest: f64,
    /// The objective at the start and after each step taken.
    pub loss: Vec<f64>,
}

/// Trains from `start`.
///
/// # Errors
/// Whatever the engine cannot do with a circuit of that many layers; [`EngineError::Stopped`] when
/// `stop` says so between two steps.
pub fn train(
    engine: &mut dyn Engine,
    start: Angles,
    settings: &TrainSettings,
    stop: &Stop,
) -> Result<Training, EngineError> {
    let seed = match settings.objective {
        Objective::Mean => 0,
        Objective::Cvar { seed, .. } => seed,
    };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut adam = Adam::new(settings.learning_rate, start.layers());
    let mut angles = start.clone();
    let mut best = Training { angles: start, lowest: f64::INFINITY, loss: Vec::new() };
    let mut settled_at = f64::INFINITY;
    let mut waited = 0;
    loop {
        stop.check()?;
        let finished = best.loss.len() == settings.steps;
        let (loss, gradient) = match settings.objective {
            Objective::Mean if finished => (engine.expectation(&angles)?, None),
            Objective::Mean => {
                let (loss, gradient) = engine.expectation_and_gradient(&angles)?;
                (loss, Some(gradient))
            }
            Objective::Cvar { alpha, shots, .. } => {
                let (loss, gradient) = engine.cvar_and_gradient(&angles, alpha, shots, &mut rng)?;
                (loss, (!finished).then_some(gradient))
            }
        };
        best.loss.push(loss);
        if loss < best.lowest || best.loss.len() == 1 {
            best.lowest = loss;
            best.angles.clone_from(&angles);
        }
        if let Some(Settled { window, tolerance }) = settings.settled {
            if loss < settled_at - tolerance {
                settled_at = loss;
                waited = 0;
            } else {
                waited += 1;
            }
            if waited >= window.max(1) {
                return Ok(best);
            }
        }
        match gradient {
            Some(gradient) => adam.step(&mut angles, &gradient),
            None => return Ok(best),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::chain::ChainEngine;
    use super::super::ising::ChainIsing;
    use super::*;

    fn engine() -> ChainEngine {
        let chain = ChainIsing::new(0.0, vec![0.4, -0.5, 0.2, 0.1], vec![0.5, -0.3, 0.4]).unwrap();
        ChainEngine::new(chain, 1 << 30)
    }

    #[test]
    fn training_lowers_the_loss_and_keeps_the_whole_curve() {
        let training =
            train(&mut engine(), Angles::ramp(3), &TrainSettings::default(), &Stop::new()).unwrap();
        assert_eq!(training.loss.len(), 61);
        assert!(training.lowest < training.loss[0] - 0.1);
        let lowest = training.loss.iter().copied().fold(f64::INFINITY, f64::min);
        assert_eq!(training.lowest, lowest);
        assert_eq!(engine().expectation(&training.angles).unwrap(), lowest);
    }

    #[test]
    fn carried_over_angles_settle_in_fewer_steps_and_never_end_worse() {
        let first =
            train(&mut engine(), Angles::ramp(3), &TrainSettings::default(), &Stop::new()).unwrap();
        let settings = TrainSettings {
            settled: Some(Settled { window: 3, tolerance: 1e-2 }),
            ..TrainSettings::default()
        };
        let second = train(&mut engine(), first.angles.clone(), &settings, &Stop::new()).unwrap();
        assert!(second.loss.len() < 20);
        assert!(second.lowest <= first.lowest + 1e-12);
    }

    #[test]
    fn no_steps_at_all_only_evaluates_the_start() {
        let settings = TrainSettings { steps: 0, ..TrainSettings::default() };
        let training = train(&mut engine(), Angles::ramp(2), &settings, &Stop::new()).unwrap();
        assert_eq!(training.loss, [training.lowest]);
        assert_eq!(training.angles, Angles::ramp(2));
    }
}
