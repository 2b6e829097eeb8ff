//! The rounds of a leg on a QPU: few jobs with many circuits each, since every job costs seconds of QPU
//! time and the service takes five a minute.
//!
//! One job holds all routes that challenge the incumbent, filled up with moved copies of it; the next
//! ones hold moved copies of what won. What the QPU gave is decoded and judged exactly like local
//! samples. Where it gives nothing in time, the local engine goes on from what there is, if the settings
//! allow it, and the result says so.

use std::collections::VecDeque;

use super::candidates::Candidate;
use super::moves::moves;
use super::pair::Pair;
use super::round::{Challenger, QpuRound, Round};
use super::rounds::{Contest, Contested, PROGRESS, PROPOSALS, RoundError};
use super::settings::QpuTraining;
use crate::geodesy::Xy;
use crate::qaoa::qpu::{
    JobPlan, Measured, Qpu, QpuCircuit, Use, circuits_of_a_step, run_of, train_on_qpu,
};
use crate::qaoa::{
    Angles, AnglesSource, ChainIsing, EngineError, Objective, QaoaRun, RunSettings, Scale,
};
use crate::stop::{Stop, Stopped};

/// The share of the time until the deadline that is kept for the local engine.
const LOCAL_SHARE: f64 = 0.25;

/// Jobs in a row without progress before the end.
const IDLE_JOBS: usize = 2;

/// A pair with its trained angles.
struct Trained {
    pair: Pair,
    chain: ChainIsing,
    angles: Angles,
    /// What the training lowered, and whether that was estimated from samples.
    objective: (Objective, bool),
    /// Its value at each step, metres.
    loss: Vec<f64>,
    loss_errors: Vec<f64>,
    /// ⟨H⟩ at the angles without errors, metres.
    ideal: f64,
    exact_optimum: Option<f64>,
}

impl Contest<'_> {
    /// Runs the rounds on a QPU, and locally what it does not give.
    ///
    /// # Errors
    /// [`RoundError`]; [`RoundError::Qpu`] only where no fallback is allowed.
    pub fn run_on_qpu(
        mut self,
        qpu: &mut dyn Qpu,
        others: &[Candidate],
        mut watch: impl FnMut(&Round),
    ) -> Result<Contested, RoundError> {
        let time = self.stop.remaining();
        let share = time.map_or_else(
            || self.stop.clone(),
            |left| self.stop.within(left.mul_f64(1.0 - LOCAL_SHARE)),
        );
        let why = match self.qpu_rounds(qpu, others, &share, &mut watch) {
            Ok(()) if self.is_clear() => {
                let (path, rounds) = (self.incumbent, self.rounds);
                return Ok(Contested { path, rounds, cut_short: false, fallback: None });
            }
            Ok(()) => "its rounds found no clear path".to_owned(),
            Err(RoundError::Qpu(error)) if error.stopped == Some(Stopped::Cancelled) => {
                return Err(Stopped::Cancelled.into());
            }
            Err(RoundError::Qpu(error)) if self.settings.qpu.fallback => error.reason,
            Err(RoundError::Stopped(Stopped::DeadlinePassed)) => "its time was up".to_owned(),
            Err(error) => return Err(error),
        };
        let backend = qpu.used().backend;
        let name = if backend.is_empty() { "the QPU".to_owned() } else { backend };
        if !self.settings.qpu.fallback {
            let reason = format!("{name} gave no path: {why}");
            return Err(RoundError::Qpu(crate::qaoa::qpu::QpuError { reason, stopped: None }));
        }
        tracing::warn!("the local engine instead of {name}: {why}");
        let cut_short = match self.all_rounds(others, &mut watch) {
            Ok(()) => false,
            Err(RoundError::Stopped(Stopped::DeadlinePassed)) => true,
            Err(error) => return Err(error),
        };
        let fallback = Some(format!("the local engine instead of {name}: {why}"));
        Ok(Contested { path: self.incumbent, rounds: self.rounds, cut_short, fallback })
    }

    fn is_clear(&self) -> bool {
        self.incumbent.windows(2).all(|edge| !self.judge.edge(edge[0], edge[1]).collides)
    }

    fn qpu_rounds(
        &mut self,
        qpu: &mut dyn Qpu,
        others: &[Candidate],
        stop: &Stop,
        watch: &mut impl FnMut(&Round),
    ) -> Result<(), RoundError> {
        let settings = self.settings;
        let (jobs, circuits) = (settings.qpu.jobs, settings.qpu.circuits);
        let trains = settings.qpu.training == QpuTraining::Qpu;
        let mut plan = vec![JobPlan { jobs, circuits }];
        if trains {
            let circuits = circuits_of_a_step(settings.layers);
            plan.push(JobPlan { jobs: settings.qpu.steps, circuits });
        }
        qpu.prepare(settings.qubits, settings.layers, settings.shots, &plan, stop)?;

        let mut routes: VecDeque<Vec<Xy>> = self.cheapest_first(others);
        let mut idle = 0;
        for job in 0..jobs {
            stop.check()?;
            let progress = job as f64 / jobs as f64;
            let pairs = self.pairs(&mut routes, circuits, progress)?;
            if pairs.is_empty() {
                break;
            }
            let mut trained = Vec::with_capacity(pairs.len());
            for pair in pairs {
                trained.push(self.trained(pair, qpu, stop)?);
            }
            let asked: Vec<QpuCircuit<'_>> = trained
                .iter()
                .map(|one| QpuCircuit { chain: &one.chain, angles: &one.angles })
                .collect();
            let measured = qpu.measure(&asked, settings.shots, Use::Sampling, stop)?;
            let before = self.cost(&self.incumbent);
            // The costs of the pairs of one job are compared with each other: all have the incumbent
            // at the job's start in common.
            let mut champion = f64::INFINITY;
            let backend = qpu.used().backend;
            for (one, measured) in trained.into_iter().zip(measured) {
                let (pair, run, round) = decided(one, measured, &backend, trains);
                champion = champion.min(self.decide(&pair, run, Some(round), champion, watch).cost);
            }
            let gained = before - self.cost(&self.incumbent);
            idle = if gained > PROGRESS * before { 0 } else { idle + 1 };
            if routes.is_empty() && idle >= IDLE_JOBS {
                break;
            }
        }
        Ok(())
    }

    /// Makes the cheapest of all candidates the incumbent; the others are to challenge it.
    fn cheapest_first(&mut self, others: &[Candidate]) -> VecDeque<Vec<Xy>> {
        let mut routes: Vec<Vec<Xy>> = others.iter().map(|other| other.points.clone()).collect();
        for route in &mut routes {
            if self.cost(route) < self.cost(&self.incumbent) {
                std::mem::swap(route, &mut self.incumbent);
            }
        }
        routes.into()
    }

    /// The pairs of one job: routes first, then moved copies of the incumbent.
    fn pairs(
        &mut self,
        routes: &mut VecDeque<Vec<Xy>>,
        circuits: usize,
        progress: f64,
    ) -> Result<Vec<Pair>, RoundError> {
        let mut pairs = Vec::new();
        while pairs.len() < circuits
            && let Some(route) = routes.pop_front()
        {
            pairs.extend(self.pairs_of(Challenger::Route, &self.incumbent, &route)?);
        }
        for _ in 0..PROPOSALS * circuits {
            if pairs.len() >= circuits {
                break;
            }
            let moves = moves(&self.incumbent, &self.judge, progress, self.room(), &mut self.rng);
            if moves.from != moves.to {
                pairs.extend(self.pairs_of(Challenger::Refinement, &moves.from, &moves.to)?);
            }
        }
        // A long chain is several circuits; a job has no more than it was planned with.
        pairs.truncate(circuits);
        Ok(pairs)
    }

    /// Trains the angles of a pair: on the QPU the first time, where it is to train, else locally.
    fn trained(
        &mut self,
        pair: Pair,
        qpu: &mut dyn Qpu,
        stop: &Stop,
    ) -> Result<Trained, RoundError> {
        let kind = pair.kind as usize;
        let scaled = pair.ising.scaled(Scale::Sigma);
        let chain = scaled.ising.to_chain().ok_or(EngineError::NoQpu)?;
        let engine = self.settings.engine.local();
        let given = |angles: Angles| RunSettings {
            engine,
            angles: AnglesSource::Given(angles),
            shots: 0,
            ..RunSettings::default()
        };
        let (local, losses) = match self.settings.qpu.training {
            QpuTraining::Local => (RunSettings { shots: 0, ..self.run_settings(pair.kind) }, None),
            QpuTraining::Qpu => match self.angles.iter().flatten().next().cloned() {
                Some(angles) => (given(angles), Some((Vec::new(), Vec::new()))),
                None => {
                    let settings = self.settings;
                    let start = Angles::ramp(settings.layers);
                    let (steps, rate) = (settings.qpu.steps, settings.learning_rate);
                    let training =
                        train_on_qpu(qpu, &chain, start, steps, rate, settings.shots, stop)?;
                    let loss = training.loss.iter().map(|&loss| scaled.in_input_units(loss));
                    let errors = training.loss_errors.iter().map(|error| error * scaled.factor);
                    (given(training.angles), Some((loss.collect(), errors.collect())))
                }
            },
        };
        let run = self.qaoa.run(&pair.ising, &local, stop)?;
        self.angles[kind] = Some(run.angles.clone());
        let objective = match &losses {
            None => (run.objective, run.loss_is_sampled),
            Some(_) => (Objective::Mean, true),
        };
        let (loss, loss_errors) = losses.unwrap_or((run.loss, Vec::new()));
        Ok(Trained {
            chain,
            angles: run.angles,
            objective,
            loss,
            loss_errors,
            ideal: run.expectation,
            exact_optimum: run.certificate.map(|certificate| certificate.exact_optimum),
            pair,
        })
    }
}

/// What was measured of a pair, in the form of every run.
fn decided(
    trained: Trained,
    measured: Measured,
    backend: &str,
    trained_on_qpu: bool,
) -> (Pair, QaoaRun, QpuRound) {
    let Trained {
        pair, angles, objective, mut loss, mut loss_errors, ideal, exact_optimum, ..
    } = trained;
    let scaled = pair.ising.scaled(Scale::Sigma);
    let metres = |energy: f64| scaled.in_input_units(energy);
    let expectation = metres(measured.expectation);
    let error = measured.standard_error * scaled.factor;
    if trained_on_qpu {
        loss.push(expectation);
        loss_errors.push(error);
    }
    let round = QpuRound {
        backend: backend.to_owned(),
        trained_on: if trained_on_qpu { "qpu" } else { "local" },
        expectation,
        raw_expectation: metres(measured.raw_expectation),
        standard_error: error,
        ideal_expectation: ideal,
        loss_errors,
    };
    let mut run = run_of(&pair.ising, angles, loss, exact_optimum, measured);
    (run.objective, run.loss_is_sampled) = objective;
    (pair, run, round)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::{QpuSettings, Settings};
    use crate::qaoa::qpu::testing::IdealQpu;
    use crate::qaoa::{EngineChoice, EngineKind};
    use crate::replan::{Options, Replanned};
    use crate::report::samples::{POND, planned_on};

    fn options(qpu: QpuSettings) -> Options {
        let engine = EngineChoice::Only(EngineKind::Ibm);
        let settings =
            Settings { qubits: 6, layers: 2, shots: 256, engine, qpu, ..Settings::default() };
        Options { settings, ..Options::default() }
    }

    fn engines(result: &Replanned) -> Vec<EngineKind> {
        let rounds = result.legs.iter().flat_map(|leg| &leg.rounds);
        let mut engines: Vec<EngineKind> = rounds.map(|round| round.engine).collect();
        engines.dedup();
        engines
    }

    #[test]
    fn a_mission_is_planned_in_few_jobs_and_nothing_runs_elsewhere() {
        let mut qpu = IdealQpu::new();
        let options = options(QpuSettings { jobs: 2, circuits: 3, ..QpuSettings::default() });
        let result = planned_on(POND, &options, Some(&mut qpu)).unwrap();
        assert_eq!(engines(&result), [EngineKind::Ibm]);
        assert_eq!(result.fallback(), None);
        assert!(result.legs.len() == 2 && qpu.used.jobs <= 4 && qpu.used.circuits <= 12);
        for round in result.legs.iter().flat_map(|leg| &leg.rounds) {
            let measured = round.qpu.as_ref().unwrap();
            let off = (measured.expectation - measured.ideal_expectation).abs();
            // A bitstring that no shot gave may lack a little besides.
            assert!(off < 6.0 * measured.standard_error + 0.05, "{measured:?}");
        }
    }

    #[test]
    fn training_on_the_qpu_happens_once_a_leg_and_its_curve_is_kept() {
        let mut qpu = IdealQpu::new();
        let training = QpuTraining::Qpu;
        let options =
            options(QpuSettings { training, steps: 5, jobs: 1, ..QpuSettings::default() });
        let result = planned_on(POND, &options, Some(&mut qpu)).unwrap();
        assert_eq!(qpu.used.jobs, 2 * 6);
        for leg in &result.legs {
            let first = &leg.rounds[0];
            assert_eq!(first.loss.len(), 6);
            assert_eq!(first.qpu.as_ref().unwrap().loss_errors.len(), 6);
            assert!(leg.rounds[1..].iter().all(|round| round.loss.len() == 1));
        }
    }

    #[test]
    fn a_qpu_that_fails_is_replaced_and_the_result_says_so() {
        for fails_after in [0, 1] {
            let mut qpu = IdealQpu { fails_after, ..IdealQpu::new() };
            let result =
                planned_on(POND, &options(QpuSettings::default()), Some(&mut qpu)).unwrap();
            let said = result.fallback().unwrap();
            assert!(said.contains("the local engine instead of ideal: out of order"), "{said}");
            assert!(engines(&result).contains(&EngineKind::Chain));
        }
    }

    #[test]
    fn where_no_fallback_is_allowed_there_is_no_plan() {
        let mut qpu = IdealQpu { fails_after: 0, ..IdealQpu::new() };
        let options = options(QpuSettings { fallback: false, ..QpuSettings::default() });
        let error = planned_on(POND, &options, Some(&mut qpu)).unwrap_err();
        assert!(error.is_qpu_failure() && !error.is_no_path(), "{error}");
    }

    #[test]
    fn the_ibm_engine_without_a_qpu_is_an_error_and_no_simulation() {
        let error = planned_on(POND, &options(QpuSettings::default()), None).unwrap_err();
        assert!(error.to_string().contains("the ibm engine is no simulator"), "{error}");
    }
}
