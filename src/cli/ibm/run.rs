//! `quavd ibm run`: `quavd qaoa` on a QPU.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use serde_json::json;

use super::super::options::state_directory;
use super::super::qaoa::{document, read, summary};
use super::super::{CliError, memory};
use super::account::AccountArgs;
use super::target::no_chain;
use crate::ibm::client::backends::BackendChoice;
use crate::planner::QpuTraining;
use crate::qaoa::qpu::{
    JobPlan, Qpu, QpuCircuit, QpuError, Use, circuits_of_a_step, run_of, train_on_qpu,
};
use crate::qaoa::{Angles, AnglesSource, Qaoa, RunSettings, Scale, TrainSettings};
use crate::stop::Stop;

/// The arguments of `quavd ibm run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// The Ising problem, as for quavd qaoa; its couplings are a chain.
    pub ising: PathBuf,
    /// The backend: a name, or least_busy.
    #[arg(long, default_value = "least_busy", value_name = "NAME")]
    pub backend: BackendChoice,
    /// Where the angles are trained: local (the exact engine) or qpu.
    #[arg(long, default_value = "local", value_name = "local|qpu")]
    pub train: QpuTraining,
    /// QAOA layers.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u8).range(1..=8))]
    pub layers: u8,
    /// Adam steps: 60 locally, 20 on a QPU where nothing is said.
    #[arg(long, value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub steps: Option<u32>,
    /// Adam's learning rate.
    #[arg(long, default_value_t = 0.1)]
    pub learning_rate: f64,
    /// Shots of each circuit.
    #[arg(long, default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub shots: u32,
    /// How long to wait, seconds; then the job is cancelled.
    #[arg(long, value_name = "SECONDS")]
    pub deadline: Option<f64>,
    /// Where jobs that were submitted are recorded.
    #[arg(long, env = "STATE_DIRECTORY", value_name = "DIR")]
    pub state_dir: Option<PathBuf>,
    /// Print one JSON document on stdout.
    #[arg(long)]
    pub json: bool,
    /// Who pays.
    #[command(flatten)]
    pub account: AccountArgs,
}

impl From<QpuError> for CliError {
    fn from(error: QpuError) -> Self {
        Self::Qpu(error.reason)
    }
}

pub(super) fn run(args: &RunArgs) -> Result<String, CliError> {
    let began = Instant::now();
    let ising = read(&args.ising)?;
    let scaled = ising.scaled(Scale::Sigma);
    let chain = scaled.ising.to_chain().ok_or_else(|| no_chain(&args.ising))?;
    let stop = match args.deadline.map(Duration::try_from_secs_f64) {
        None => Stop::new(),
        Some(Ok(time)) => Stop::new().within(time),
        Some(Err(error)) => return Err(CliError::Usage(format!("--deadline: {error}"))),
    };
    let layers = usize::from(args.layers);
    let mut qpu = args.account.qpu(&args.backend, &state_directory(args.state_dir.as_ref())?)?;
    let mut plan = vec![JobPlan { jobs: 1, circuits: 1 }];
    let on_qpu = args.train == QpuTraining::Qpu;
    let steps = args.steps.unwrap_or(if on_qpu { 20 } else { 60 }) as usize;
    if on_qpu {
        plan.push(JobPlan { jobs: steps, circuits: circuits_of_a_step(layers) });
    }
    qpu.prepare(chain.qubits(), layers, args.shots, &plan, &stop)?;

    let start = Angles::ramp(layers);
    let rate = args.learning_rate;
    let trained = on_qpu
        .then(|| train_on_qpu(&mut qpu, &chain, start.clone(), steps, rate, args.shots, &stop))
        .transpose()?;
    // Without errors, and with the exact optimum: locally, in either case.
    let local = RunSettings {
        angles: match &trained {
            Some(trained) => AnglesSource::Given(trained.angles.clone()),
            None => AnglesSource::Ramp(layers),
        },
        train: TrainSettings { steps, learning_rate: rate, ..TrainSettings::default() },
        shots: 0,
        ..RunSettings::default()
    };
    let ideal = Qaoa::new(memory::available())
        .run(&ising, &local, &stop)
        .map_err(|error| CliError::Usage(error.to_string()))?;
    let circuit = QpuCircuit { chain: &chain, angles: &ideal.angles };
    let measured = qpu.measure(&[circuit], args.shots, Use::Sampling, &stop)?;
    let measured = measured
        .into_iter()
        .next()
        .ok_or_else(|| CliError::Qpu("the QPU gave no result".to_owned()))?;
    let in_units = |energy: f64| scaled.in_input_units(energy);
    let (raw, error) =
        (in_units(measured.raw_expectation), measured.standard_error * scaled.factor);
    let loss_errors: Option<Vec<f64>> =
        trained.as_ref().map(|t| t.loss_errors.iter().map(|error| error * scaled.factor).collect());
    let loss = match trained {
        Some(trained) => trained.loss.into_iter().map(in_units).collect(),
        None => ideal.loss,
    };
    let exact_optimum = ideal.certificate.map(|certificate| certificate.exact_optimum);
    let run = run_of(&ising, ideal.angles, loss, exact_optimum, measured);
    qpu.finish();
    let used = qpu.used();
    let time_ms = began.elapsed().as_secs_f64() * 1e3;
    if !args.json {
        return Ok(format!(
            "{}on {}        {:.1} QPU seconds charged, {:.1} estimated; {} jobs\n\
             as read       {raw:.6}; readout errors taken out above (standard error {error:.6})\n\
             ideal         {:.6}\n",
            summary(&run, time_ms),
            used.backend,
            used.charged_seconds,
            used.estimated_seconds,
            used.jobs,
            ideal.expectation,
        ));
    }
    let mut document = document(&run, time_ms);
    if let Some(fields) = document.as_object_mut() {
        let details = json!({
            "used": used,
            "trained_on": if on_qpu { "qpu" } else { "local" },
            "raw_expectation": raw,
            "standard_error": error,
            "ideal_expectation": ideal.expectation,
            "loss_errors": loss_errors,
        });
        fields.insert("qpu".to_owned(), details);
    }
    Ok(format!("{document:#}\n"))
}
