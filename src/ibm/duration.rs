//! How long a job takes on a QPU, before it is asked for: its estimate, and the cap that it is sent
//! with.

use super::circuit::Circuit;
use super::client::jobs::MAX_COST;
use super::device::Device;
use super::error::IbmError;
use super::metrics::Metrics;
use crate::qaoa::ChainIsing;

/// QPU seconds that a job takes besides its shots (measured by others at 2 on live QPUs).
const JOB_SECONDS: f64 = 2.0;

/// The pause between shots where the backend does not say, seconds.
const REPETITION_DELAY: f64 = 250e-6;

/// A job's cap: this many times its estimate, and never less than the second figure, seconds.
const CAP_FACTOR: f64 = 3.0;
const LEAST_CAP: f64 = 15.0;

/// Seconds of QPU time that a job takes whose circuits take so many seconds each with all shots.
pub(super) fn job_seconds(circuits: usize, each: f64) -> f64 {
    JOB_SECONDS + circuits as f64 * each
}

/// The cap of a job that is estimated at so many seconds.
pub(super) fn cap(estimate: f64) -> u32 {
    (CAP_FACTOR * estimate).max(LEAST_CAP).ceil().min(f64::from(MAX_COST)) as u32
}

/// Seconds of QPU time that one shot of a circuit takes.
#[must_use]
pub fn shot_seconds(device: &Device, circuit: &Circuit) -> f64 {
    let run = Metrics::of(circuit, device).duration.map_or(20e-6, |duration| duration.0 * 1e-9);
    let delay = device.rep_delay().map_or(REPETITION_DELAY, |delay| delay.0 * 1e-9);
    run + delay
}

/// A chain like those that are going to be sent, for an estimate.
pub(super) fn example(qubits: usize) -> Result<ChainIsing, IbmError> {
    let coefficients = |n: usize| (0..n).map(|i| 0.1 + 0.01 * (i % 7) as f64).collect();
    ChainIsing::new(0.0, coefficients(qubits), coefficients(qubits.saturating_sub(1)))
        .map_err(|error| IbmError::Circuit(error.to_string()))
}
