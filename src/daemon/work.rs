//! One piece of work: look at what the vehicle holds, and where that is new, plan, upload and
//! prove. It runs as a task of its own, so that the daemon goes on hearing the vehicle meanwhile.

use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::sync::watch;
use tokio::task::JoinHandle;

use super::answer::{Answer, Verdict};
use super::gate::Gate;
use super::place::Place;
use super::planned::Fingerprint;
use crate::cli::CliError;
use crate::cli::flight::way_is_clear;
use crate::cli::once::{in_flight, intended};
use crate::cli::options::as_qpu;
use crate::cli::progress::Shown;
use crate::cli::reading::{Held, Read, read};
use crate::config::DaemonOptions;
use crate::ibm::qpu::IbmQpu;
use crate::mission::{MissionItem, MissionType};
use crate::replan::{Input, Options, ReplanError, Replanned, Stage, replan_with};
use crate::report::Run;
use crate::report::json::PlanDocument;
use crate::report::picture::picture;
use crate::store::Store;
use crate::vehicle::readback::differences;
use crate::vehicle::replace::{Obstacle, ReplaceError, Replacement, Step, replace, settle};
use crate::vehicle::{Autopilot, Vehicle};

/// A vehicle does not wait longer for a QPU's queue, unless the configuration sets a deadline.
const LONGEST_QUEUE: Duration = Duration::from_secs(60);

/// What a piece of work is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Phase {
    /// Downloading, and seeing whether it is new.
    Looking,
    /// Planning; how much of it is done, from 0 to 1.
    Planning(f32),
    /// Writing to the vehicle and reading back; how much is done, from 0 to 1.
    Writing(f32),
}

impl Phase {
    /// What `quavd status` calls it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Looking => "looking",
            Self::Planning(_) => "planning",
            Self::Writing(_) => "writing",
        }
    }

    /// How far the whole is, percent.
    pub(super) fn percent(self) -> u8 {
        let (from, to, done) = match self {
            Self::Looking => (0.0, 0.0, 0.0),
            Self::Planning(done) => (10.0, 60.0, done),
            Self::Writing(done) => (60.0, 99.0, done),
        };
        (from + (to - from) * done.clamp(0.0, 1.0)) as u8
    }
}

/// What is to be done.
#[derive(Clone)]
pub(super) struct Order {
    pub(super) vehicle: Arc<Vehicle>,
    pub(super) store: Store,
    pub(super) options: Arc<DaemonOptions>,
    /// What was planned last: not planned again where it is still held, unless that is forced.
    pub(super) known: Option<Fingerprint>,
    pub(super) force: bool,
    /// Whether to plan what is new.
    pub(super) plan: bool,
}

/// How a piece of work ended.
#[derive(Debug)]
pub(super) enum End {
    /// Called off; nothing was written.
    Cancelled,
    /// What is held was not planned: nothing is new, or nobody wants it planned.
    Seen,
    /// Answered by a plan or a reason.
    Answered(Box<Answer>),
}

/// A running piece of work.
pub(super) struct Work {
    gate: Arc<Gate>,
    phase: watch::Receiver<Phase>,
    task: JoinHandle<End>,
}

impl Work {
    /// Begins.
    pub(super) fn start(order: Order) -> Self {
        let gate = Arc::new(Gate::default());
        let (tell, phase) = watch::channel(Phase::Looking);
        let task = tokio::spawn(run(order, Arc::clone(&gate), tell));
        Self { gate, phase, task }
    }

    pub(super) fn phase(&self) -> Phase {
        *self.phase.borrow()
    }

    /// Calls it off, unless it is writing. `true` where it ends without having written.
    pub(super) fn cancel(&self) -> bool {
        self.gate.cancel()
    }

    /// Its end. May be dropped and asked again.
    pub(super) async fn ended(&mut self) -> End {
        match (&mut self.task).await {
            Ok(end) => end,
            Err(error) => {
                tracing::error!(%error, "the work failed; please report this");
                End::Answered(Box::new(Answer::failed(Verdict::Defect, &error.to_string())))
            }
        }
    }
}

async fn run(order: Order, gate: Arc<Gate>, phase: watch::Sender<Phase>) -> End {
    match work(&order, &gate, &phase).await {
        Ok(end) => end,
        Err(_) if gate.is_cancelled() => End::Cancelled,
        Err(answer) => End::Answered(answer),
    }
}

async fn work(
    order: &Order,
    gate: &Gate,
    phase: &watch::Sender<Phase>,
) -> Result<End, Box<Answer>> {
    let Order { vehicle, store, options, .. } = order;
    let began = Instant::now();
    if !settled(order, gate, phase).await? {
        return Ok(End::Cancelled);
    }
    let quiet = Shown::new(true);
    let held = tokio::select! {
        held = Held::download(vehicle, &quiet) => held.map_err(|error| Answer::from_cli(error.into()))?,
        () = gate.cancelled() => return Ok(End::Cancelled),
    };
    let fingerprint = Fingerprint::of(vehicle.autopilot(), &held);
    if !order.plan || (order.known == Some(fingerprint) && !order.force) {
        return Ok(End::Seen);
    }
    // As it was before what follows read it: what moves from now on has moved.
    let place = Place::of(&vehicle.state());
    let known = |mut answer: Box<Answer>| {
        answer.fingerprint = Some(fingerprint);
        answer.planned_from = Some(place);
        answer
    };
    let places = usize::from(vehicle.autopilot() == Autopilot::ArduPilot);
    if held.mission.len() <= places {
        return Ok(End::Answered(known(Box::new(Answer::no_mission()))));
    }
    let read = tokio::select! {
        read = read(vehicle, store, &options.planning, held.clone(), &quiet) => read,
        () = gate.cancelled() => return Ok(End::Cancelled),
    };
    let mut read = read.map_err(|error| known(Answer::from_cli(error)))?;
    let flight = in_flight(vehicle, &mut read, &options.writing);
    let flight = flight.map_err(|error| known(Answer::from_cli(error)))?;
    let load = began.elapsed();

    let mut planning = read.options(&options.planning);
    let qpu = options.planning.qpu(options.vehicle.state_dir.as_ref());
    let qpu = qpu.map_err(|error| known(Answer::from_cli(error)))?;
    if qpu.is_some() {
        planning.deadline.get_or_insert(LONGEST_QUEUE);
    }
    let input = held;
    let (read, planned) = plan(read, planning.clone(), qpu, gate, phase).await.map_err(known)?;
    let run =
        Run { options: &planning, warnings: &read.scenario.warnings, load, total: began.elapsed() };
    let planned = match planned {
        Ok(planned) => planned,
        Err(ReplanError::Cancelled) => return Ok(End::Cancelled),
        Err(error) => {
            let document = PlanDocument::failed(&error, None, &run);
            return Ok(End::Answered(known(Box::new(Answer::no_plan(&error, document)))));
        }
    };
    let mut answer = Answer::planned(&planned, PlanDocument::planned(&planned, &run));
    answer.fingerprint = Some(fingerprint);
    answer.planned_from = Some(place);
    let list = intended(vehicle, &read, &planned, flight.as_ref(), &options.writing);
    let list = list.and_then(|list| match &flight {
        Some(_) => way_is_clear(vehicle, &read, &list, &planning).map(|()| list),
        None => Ok(list),
    });
    match list {
        Ok(intended) => {
            let list = intended.clone();
            deliver(order, gate, phase, (&input, &read), intended, &planned, &mut answer).await;
            if flight.is_some()
                && answer.verdict == Verdict::Uploaded
                && let Err(error) = way_is_clear(vehicle, &read, &list, &planning)
            {
                answer.way_is_not_clear(&error);
            }
        }
        Err(error) => {
            let Answer { verdict, texts, reason, .. } = *Answer::from_cli(error);
            answer = Answer { verdict, texts, reason, ..answer };
        }
    }
    if answer.verdict == Verdict::Cancelled {
        return Ok(End::Cancelled);
    }
    answer.picture = picture(&planned, &run, &format!("mission of {}", vehicle.node())).ok();
    Ok(End::Answered(Box::new(answer)))
}

/// Ends what an earlier upload left open. `false` where the work was called off before.
async fn settled(
    order: &Order,
    gate: &Gate,
    phase: &watch::Sender<Phase>,
) -> Result<bool, Box<Answer>> {
    if !gate.begin_writing() {
        return Ok(false);
    }
    let mut on_step = |step| tell(phase, step);
    let while_armed = order.options.writing.while_armed();
    for plan in [MissionType::Fence, MissionType::Mission] {
        let settled = settle(&order.vehicle, &order.store, plan, while_armed, &mut on_step).await;
        match settled {
            Ok(None) => {}
            Ok(Some(settled)) => {
                tracing::warn!(%plan, "an earlier upload was not settled: {settled}");
            }
            Err(obstacle) => {
                return Err(Box::new(Answer::not_written(&obstacle, Answer::default())));
            }
        }
    }
    gate.end_writing();
    phase.send_replace(Phase::Looking);
    Ok(!gate.is_cancelled())
}

fn tell(phase: &watch::Sender<Phase>, step: Step) {
    let (from, to, progress) = match step {
        Step::Reading(progress) => (0.0, 0.2, progress),
        Step::Uploading(progress) | Step::PuttingBack(progress) => (0.2, 0.7, progress),
        Step::Proving(progress) => (0.7, 1.0, progress),
    };
    let done = progress.done as f32 / progress.total.max(1) as f32;
    phase.send_replace(Phase::Writing(from + (to - from) * done));
}

/// Plans on a thread of its own: PROJ and the planner block.
async fn plan(
    read: Read,
    options: Options,
    mut qpu: Option<IbmQpu>,
    gate: &Gate,
    phase: &watch::Sender<Phase>,
) -> Result<(Read, Result<Replanned, ReplanError>), Box<Answer>> {
    phase.send_replace(Phase::Planning(0.0));
    let (stop, phase) = (gate.stop(), phase.clone());
    let task = tokio::task::spawn_blocking(move || {
        let input = Input {
            mission: &read.scenario.mission,
            fences: &read.scenario.fences,
            rally: &read.rally,
            start: read.start,
            autopilot: read.autopilot,
        };
        let planned = replan_with(&input, &options, as_qpu(&mut qpu), &stop, |progress| {
            let done = match progress.stage {
                Stage::Candidates => progress.leg.saturating_sub(1) as f32,
                Stage::Round { .. } => progress.leg as f32 - 0.5,
                Stage::Planned => progress.leg as f32,
            };
            phase.send_replace(Phase::Planning(done / progress.legs.max(1) as f32));
        });
        (read, planned)
    });
    task.await.map_err(|panic| {
        tracing::error!(%panic, "the planner failed; please report this");
        Box::new(Answer::failed(Verdict::Defect, "the planner failed, mission untouched"))
    })
}

/// Uploads a plan where the vehicle does not hold it yet, and proves it.
async fn deliver(
    order: &Order,
    gate: &Gate,
    phase: &watch::Sender<Phase>,
    (input, read): (&Held, &Read),
    intended: Vec<MissionItem>,
    planned: &Replanned,
    answer: &mut Answer,
) {
    let Order { vehicle, store, options, .. } = order;
    let autopilot = vehicle.autopilot();
    if differences(autopilot, MissionType::Mission, &intended, &read.held).is_empty() {
        answer.already_there(planned);
        return;
    }
    if !gate.begin_writing() {
        answer.verdict = Verdict::Cancelled;
        return;
    }
    let replacement = Replacement {
        mission_type: MissionType::Mission,
        original: read.original.clone(),
        before: read.held.clone(),
        intended,
    };
    let mut on_step = |step| tell(phase, step);
    match replace(vehicle, store, replacement, options.writing.while_armed(), &mut on_step).await {
        Ok(record) => {
            answer.uploaded(record.intended.len());
            // The next look knows by this that what is new is our own.
            let mission = record.read_back.unwrap_or(record.intended);
            let held = Held { mission, ..input.clone() };
            answer.fingerprint = Some(Fingerprint::of(autopilot, &held));
        }
        Err(ReplaceError { obstacle: Obstacle::Changed { .. }, .. }) => {
            // Newer input: the change that was found is looked at next.
            answer.verdict = Verdict::Overtaken;
            answer.fingerprint = None;
        }
        Err(error) => *answer = Answer::not_delivered(&error, std::mem::take(answer)),
    }
}

impl From<CliError> for Box<Answer> {
    fn from(error: CliError) -> Self {
        Answer::from_cli(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_only_rises_from_phase_to_phase() {
        let phases = [
            Phase::Looking,
            Phase::Planning(0.0),
            Phase::Planning(1.0),
            Phase::Writing(0.2),
            Phase::Writing(1.0),
        ];
        let percents: Vec<u8> = phases.iter().map(|phase| phase.percent()).collect();
        assert!(percents.is_sorted(), "{percents:?}");
        assert!(percents.iter().all(|&percent| percent < 100));
    }
}
