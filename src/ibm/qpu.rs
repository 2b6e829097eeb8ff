//! [`IbmQpu`]: an IBM backend as a [`Qpu`] that the planner can use.
//!
//! Each call is one job: circuits are laid on the best line of today's calibration, submitted once,
//! recorded in the [`Ledger`], waited for, decoded, and cleared of readout errors. A job that is not
//! waited for any longer is cancelled.

use std::collections::BTreeSet;
use std::future::Future;
use std::time::{Duration, Instant};

use tokio::runtime::Runtime;
use tracing::{debug, info, warn};

use super::client::Client;
use super::client::backends::BackendChoice;
use super::client::jobs::{Submission, unique_tag};
use super::device::{Device, PhysicalQubit};
use super::digest::digest;
use super::duration::{cap, example, job_seconds, shot_seconds};
use super::error::IbmError;
use super::interrupted::{Interrupted, stopped};
use super::ledger::{Ledger, Record};
use super::lower::{Binding, lower, lower_on};
use super::mitigation::mitigated_expectation;
use super::program::{Program, Pub, Sampler};
use super::unfolding::unfolded;
use crate::qaoa::Angles;
use crate::qaoa::qpu::{
    JobPlan, Measured, Qpu, QpuCircuit, QpuError, QpuUse, Use, sampled_expectation,
};
use crate::stop::Stop;

/// How long a batch may live, seconds (the most that the Open plan allows).
const BATCH_TTL: u32 = 600;

/// How long cancelling a job, or asking what it has cost, may take.
const TIDY_PATIENCE: Duration = Duration::from_secs(10);

/// An IBM backend.
pub struct IbmQpu {
    runtime: Runtime,
    client: Client,
    program: Box<dyn Program + Send>,
    choice: BackendChoice,
    ledger: Ledger,
    prepared: Option<Prepared>,
    /// Jobs asked for by this run.
    number: usize,
    /// Records of this run, which are forgotten once it has ended.
    own: BTreeSet<String>,
    batch: Option<String>,
    used: QpuUse,
}

/// What is known once a backend has been chosen.
struct Prepared {
    name: String,
    device: Device,
}

impl IbmQpu {
    /// A QPU of the client's instance. Nothing is sent yet.
    ///
    /// # Errors
    /// [`IbmError`] where no runtime for the network can be made.
    pub fn new(client: Client, choice: BackendChoice, ledger: Ledger) -> Result<Self, IbmError> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(
            |error| IbmError::Unreachable {
                host: "the network".to_owned(),
                cause: error.to_string(),
            },
        )?;
        Ok(Self {
            runtime,
            client,
            program: Box::new(Sampler),
            choice,
            ledger,
            prepared: None,
            number: 0,
            own: BTreeSet::new(),
            batch: None,
            used: QpuUse::default(),
        })
    }

    /// The run is over: its records are forgotten, jobs that an earlier run left behind and nobody asked
    /// for again are cancelled, and the batch takes no further jobs.
    pub fn finish(&mut self) {
        for digest in std::mem::take(&mut self.own) {
            self.ledger.remove(&digest);
        }
        for record in self.ledger.all() {
            info!(tag = record.tag, "cancelling a job that an earlier run left behind");
            match self.abandon(&record) {
                Ok(()) => self.ledger.remove(&record.digest),
                Err(error) => warn!("a job of an earlier run is not cancelled yet: {error}"),
            }
        }
        if let Some(batch) = self.batch.take()
            && let Err(error) = self.tidy(self.client.drain_batch(&batch))
        {
            debug!("the batch is left to close by itself: {error}");
        }
    }

    /// Runs `work` for as long as `stop` allows.
    fn until<T>(
        &self,
        stop: &Stop,
        work: impl Future<Output = Result<T, IbmError>>,
    ) -> Result<T, Interrupted> {
        let began = Instant::now();
        self.runtime.block_on(async {
            tokio::select! {
                biased;
                outcome = work => outcome.map_err(Interrupted::Failed),
                stopped = stopped(stop) => Err(Interrupted::Stopped(stopped, began.elapsed())),
            }
        })
    }

    /// Cancels the job of a record, wherever it got to.
    fn abandon(&self, record: &Record) -> Result<(), IbmError> {
        self.tidy(async {
            let id = match &record.job {
                Some(id) => Some(id.clone()),
                None => self.client.tagged(&record.tag).await?,
            };
            match id {
                Some(id) => self.client.cancel(&id).await,
                None => Ok(()),
            }
        })
    }

    /// Runs `work` for so long at most, whatever `stop` says: for tidying up.
    fn tidy<T>(&self, work: impl Future<Output = Result<T, IbmError>>) -> Result<T, IbmError> {
        self.runtime.block_on(async {
            tokio::time::timeout(TIDY_PATIENCE, work).await.unwrap_or_else(|_| {
                Err(IbmError::Unreachable {
                    host: "IBM Quantum".to_owned(),
                    cause: "no answer in time".to_owned(),
                })
            })
        })
    }

    /// Chooses the backend and reads its calibration, once for a run.
    fn prepared(&mut self, qubits: usize, stop: &Stop) -> Result<&Prepared, Interrupted> {
        if self.prepared.is_none() {
            // A job that was left behind was made for a certain backend; with least_busy it is the one.
            let left = self.ledger.all().into_iter().next().map(|record| record.backend);
            let choice = match (&self.choice, left) {
                (BackendChoice::LeastBusy, Some(name)) => BackendChoice::Named(name),
                (choice, _) => choice.clone(),
            };
            let prepared = self.until(stop, async {
                let chosen = self.client.choose(&choice, qubits).await;
                let backend = match chosen {
                    Err(_) if choice != self.choice => {
                        self.client.choose(&self.choice, qubits).await?
                    }
                    chosen => chosen?,
                };
                let device = self.client.device(&backend.name).await?;
                Ok(Prepared { name: backend.name, device })
            })?;
            self.used.backend.clone_from(&prepared.name);
            self.prepared = Some(prepared);
        }
        match &self.prepared {
            Some(prepared) => Ok(prepared),
            None => Err(Interrupted::Failed(IbmError::CalledOff)),
        }
    }

    /// The circuits on one line of the device, and that line.
    fn pubs(
        &self,
        prepared: &Prepared,
        circuits: &[QpuCircuit<'_>],
        purpose: Use,
    ) -> Result<(Vec<Pub>, Vec<u32>, f64), IbmError> {
        let failed = |error: super::LowerError| IbmError::Circuit(error.to_string());
        let Some(first) = circuits.first() else {
            return Err(IbmError::Circuit("no circuit at all".to_owned()));
        };
        let binding = |circuit: &QpuCircuit<'_>| match purpose {
            Use::Sampling => Ok::<_, IbmError>(None),
            Use::Training => Ok(Some(circuit.angles.layers())),
        };
        let lowered = match binding(first)? {
            None => lower(&prepared.device, first.chain, Binding::Bound(first.angles)),
            Some(layers) => lower(&prepared.device, first.chain, Binding::Inputs(layers)),
        }
        .map_err(failed)?;
        let line = lowered.line().clone();
        let mut pubs = Vec::with_capacity(circuits.len());
        let training = matches!(purpose, Use::Training).then(|| lowered.to_qasm());
        for (index, circuit) in circuits.iter().enumerate() {
            let (qasm, values) = match &training {
                Some(text) => (text.clone(), lowered.parameter_values(circuit.angles)),
                None if index == 0 => (lowered.to_qasm(), Vec::new()),
                None => {
                    let same = circuit.chain.qubits() == first.chain.qubits();
                    let bound = Binding::Bound(circuit.angles);
                    let circuit = if same {
                        lower_on(&line, circuit.chain, bound)
                    } else {
                        lower(&prepared.device, circuit.chain, bound)
                    };
                    (circuit.map_err(failed)?.to_qasm(), Vec::new())
                }
            };
            pubs.push(Pub { qasm, values, bits: circuit.chain.qubits() });
        }
        let shot = shot_seconds(&prepared.device, &lowered);
        Ok((pubs, line.qubits().iter().map(|qubit| qubit.0).collect(), shot))
    }

    /// One job from the request to what was measured.
    fn job(
        &mut self,
        circuits: &[QpuCircuit<'_>],
        shots: u32,
        purpose: Use,
        stop: &Stop,
    ) -> Result<Vec<Measured>, Interrupted> {
        let qubits = circuits.iter().map(|circuit| circuit.chain.qubits()).max().unwrap_or(1);
        self.prepared(qubits, stop)?;
        let Some(prepared) = &self.prepared else {
            return Err(Interrupted::Failed(IbmError::CalledOff));
        };
        self.number += 1;
        let digest = digest(&self.choice.to_string(), self.number, circuits, shots);
        let (pubs, line, shot) = self.pubs(prepared, circuits, purpose)?;
        let earlier = self.ledger.find(&digest);
        let picked_up = earlier.is_some();
        let mut record = earlier.unwrap_or_else(|| Record {
            tag: unique_tag(&digest),
            digest: digest.clone(),
            backend: prepared.name.clone(),
            line,
            job: None,
        });
        self.ledger.put(&record)?;
        self.own.insert(digest);

        let cost = cap(job_seconds(pubs.len(), f64::from(shots) * shot));
        let params = self.program.params(&pubs, shots);
        let outcome = self.paid(&mut record, picked_up, &params, cost, (&pubs, shots), stop);
        let body = match outcome {
            Ok(body) => body,
            Err(interrupted) => {
                let uncertain = matches!(
                    interrupted,
                    Interrupted::Stopped(..)
                        | Interrupted::Failed(
                            IbmError::Unreachable { .. } | IbmError::Unavailable { .. }
                        )
                );
                if !uncertain {
                    self.forget(&record);
                    return Err(interrupted);
                }
                return Err(match self.abandon(&record) {
                    Ok(()) => {
                        self.forget(&record);
                        interrupted.with_job(record.job)
                    }
                    Err(error) => {
                        // It stays on record, for the next run to cancel.
                        self.own.remove(&record.digest);
                        warn!(
                            "a job may still be queued, and is cancelled by the next run: {error}"
                        );
                        interrupted
                    }
                });
            }
        };
        let id = record.job.clone().unwrap_or_default();
        let what = format!("GET /jobs/{id}/results");
        let samples = self
            .program
            .decode(&body, &pubs, shots)
            .map_err(|error| IbmError::malformed(what, error.to_string()))?;
        self.used.jobs += 1;
        self.used.picked_up += usize::from(picked_up);
        self.used.circuits += pubs.len();
        self.used.line.clone_from(&record.line);
        match self.tidy(self.client.metrics(&id)) {
            Ok(metrics) => self.used.charged_seconds += metrics.qpu_seconds().unwrap_or(0.0),
            Err(error) => warn!("what a job has cost is not known: {error}"),
        }
        let readout: Vec<_> = record
            .line
            .iter()
            .map(|&qubit| prepared.device.qubit(PhysicalQubit(qubit)).and_then(|q| q.readout))
            .collect();
        Ok(circuits
            .iter()
            .zip(samples)
            .map(|(circuit, samples)| {
                let (raw_expectation, _) = sampled_expectation(circuit.chain, &samples);
                let (expectation, standard_error) =
                    mitigated_expectation(circuit.chain, &samples, &readout);
                let probabilities = match purpose {
                    Use::Sampling => unfolded(&samples, &readout),
                    // Nothing but expectations is wanted.
                    Use::Training => samples
                        .iter()
                        .map(|sample| f64::from(sample.count) / f64::from(shots))
                        .collect(),
                };
                Measured { samples, probabilities, expectation, raw_expectation, standard_error }
            })
            .collect())
    }

    fn forget(&mut self, record: &Record) {
        self.ledger.remove(&record.digest);
        self.own.remove(&record.digest);
    }

    /// The body of a job's results. The record has the job's id as soon as there is one.
    fn paid(
        &self,
        record: &mut Record,
        picked_up: bool,
        params: &serde_json::Value,
        cost: u32,
        (pubs, shots): (&[Pub], u32),
        stop: &Stop,
    ) -> Result<Vec<u8>, Interrupted> {
        self.until(stop, async {
            if picked_up && record.job.is_none() {
                record.job = self.client.tagged(&record.tag).await?;
            }
            let limit = self.program.result_limit(pubs, shots);
            if let Some(id) = &record.job {
                self.ledger.put(record)?;
                info!(job = id, "an earlier run had submitted this");
                match self.client.results(id, limit, |_| {}).await {
                    // It has ended without results: what is paid is paid, a new one is needed.
                    Err(
                        error @ (IbmError::NoSuchJob(_)
                        | IbmError::JobFailed { .. }
                        | IbmError::JobCancelled(_)
                        | IbmError::RanTooLong(_)),
                    ) => {
                        warn!("{error}");
                        record.job = None;
                        record.tag = unique_tag(&record.digest);
                        self.ledger.put(record)?;
                    }
                    outcome => return outcome,
                }
            }
            let submission = Submission {
                backend: &record.backend,
                params,
                tag: &record.tag,
                cost,
                session: self.batch.as_deref(),
            };
            let id = self.client.submit(self.program.as_ref(), &submission).await?;
            record.job = Some(id.clone());
            self.ledger.put(record)?;
            self.client.results(&id, limit, |_| {}).await
        })
    }
}

impl Drop for IbmQpu {
    fn drop(&mut self) {
        self.finish();
    }
}

impl Qpu for IbmQpu {
    fn prepare(
        &mut self,
        qubits: usize,
        layers: usize,
        shots: u32,
        plan: &[JobPlan],
        stop: &Stop,
    ) -> Result<(), QpuError> {
        let (needed, name) = {
            let Prepared { name, device } = self.prepared(qubits, stop)?;
            let chain = example(qubits).map_err(Interrupted::Failed)?;
            let circuit = lower(device, &chain, Binding::Bound(&Angles::ramp(layers)))
                .map_err(|error| Interrupted::Failed(IbmError::Circuit(error.to_string())))?;
            let shot = f64::from(shots) * shot_seconds(device, &circuit);
            let seconds = |kind: &JobPlan| kind.jobs as f64 * job_seconds(kind.circuits, shot);
            (plan.iter().map(seconds).sum::<f64>(), name.clone())
        };
        let usage = self.until(stop, self.client.usage())?;
        self.used.estimated_seconds += needed;
        info!(backend = name, seconds = needed, left = usage.left(), "QPU time estimated");
        if let Some(left) = usage.left().filter(|left| *left < needed) {
            return Err(Interrupted::Failed(IbmError::TooDear { needed, left }).into());
        }
        let jobs: usize = plan.iter().map(|kind| kind.jobs).sum();
        if jobs > 1 && self.batch.is_none() {
            match self.until(stop, self.client.open_batch(&name, BATCH_TTL)) {
                Ok(batch) => self.batch = Some(batch),
                // Without one the jobs queue one by one.
                Err(Interrupted::Failed(error)) => info!("no batch: {error}"),
                Err(stopped) => return Err(stopped.into()),
            }
        }
        Ok(())
    }

    fn measure(
        &mut self,
        circuits: &[QpuCircuit<'_>],
        shots: u32,
        purpose: Use,
        stop: &Stop,
    ) -> Result<Vec<Measured>, QpuError> {
        Ok(self.job(circuits, shots, purpose, stop)?)
    }

    fn used(&self) -> QpuUse {
        self.used.clone()
    }
}
