//! One vehicle from the moment it is found until it is lost: hears everything on the link, decides
//! when to work, answers requests, and says what happens.

use std::sync::Arc;
use std::time::Duration;

use tokio::time::{Instant, MissedTickBehavior, sleep_until};
use tokio_util::sync::CancellationToken;

use super::Service;
use super::agenda::{Agenda, Due};
use super::answer::{Answer, Verdict};
use super::hints::{Hint, Hints};
use super::place::Moves;
use super::planned::Basis;
use super::requests::{Asker, Request, answer};
use super::speech::{Severity, Speaker, Text};
use super::status::{LastAnswer, VehicleStatus};
use super::work::{End, Order, Phase, Work};
use crate::config::Policy;
use crate::link::message::CommandAck;
use crate::link::{Inbox, Link, LinkError, LinkTask, Received};
use crate::vehicle::Vehicle;

/// How often to look after the vehicle, and to tell how far a plan is.
const TICK: Duration = Duration::from_secs(1);
/// A vehicle that has been silent for longer is looked for anew.
const LOST: Duration = Duration::from_secs(10);
/// An upload that goes on when the daemon is to end is waited for this long. What has not ended
/// then is settled at the next start.
const LAST_UPLOAD: Duration = Duration::from_secs(20);

/// A vehicle on an open link.
pub(super) struct Connection {
    pub(super) link: Link,
    pub(super) task: LinkTask,
    pub(super) inbox: Inbox,
    pub(super) vehicle: Arc<Vehicle>,
}

/// Why a session ended.
#[derive(Debug, thiserror::Error)]
pub(super) enum Ended {
    /// The daemon is to end, or to begin anew.
    #[error("the daemon ends")]
    Halted,
    /// The link failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The vehicle is silent.
    #[error("the vehicle has not been heard for {} s", .0.as_secs())]
    Silent(Duration),
}

/// Work that runs, why, and on which basis it was begun.
struct Running {
    work: Work,
    due: Due,
    basis: Basis,
}

struct Session<'a> {
    service: &'a mut Service,
    link: Link,
    vehicle: Arc<Vehicle>,
    speaker: Speaker,
    hints: Hints,
    agenda: Agenda,
    work: Option<Running>,
    moves: Moves,
}

/// Stays with a vehicle.
pub(super) async fn stay(
    service: &mut Service,
    connection: Connection,
    halt: &CancellationToken,
) -> Ended {
    let Connection { link, task, mut inbox, vehicle } = connection;
    let now = Instant::now();
    let times = &service.own.options.service;
    let mut session = Session {
        speaker: Speaker::new(link.clone(), service.board.began()),
        hints: Hints::new(vehicle.node(), link.node()),
        agenda: Agenda::new(now, times.quiet_time(), Duration::from_secs(times.poll.into())),
        work: None,
        moves: Moves::default(),
        service,
        link,
        vehicle,
    };
    session.agenda.changed(now, "the vehicle was found");
    let ended = session.run(&mut inbox, halt).await;
    session.wind_up(&ended).await;
    drop(session);
    drop(inbox);
    task.close().await;
    ended
}

impl Session<'_> {
    async fn run(&mut self, inbox: &mut Inbox, halt: &CancellationToken) -> Ended {
        let mut tick = tokio::time::interval(TICK);
        tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let trigger = Arc::clone(&self.service.trigger);
        loop {
            let turn = tokio::select! {
                () = halt.cancelled() => return Ended::Halted,
                frame = inbox.next() => match frame {
                    Ok(frame) => self.heard(&frame).await,
                    Err(error) => Err(error),
                },
                end = ended(&mut self.work) => self.worked(end).await,
                () = sleep_until(self.agenda.at()), if self.work.is_none() => self.begin().await,
                () = trigger.notified() => {
                    self.agenda.asked(Instant::now(), "asked for on the board", None);
                    Ok(())
                },
                _ = tick.tick() => {
                    self.service.pulse.beat();
                    let silent = self.vehicle.silent_for();
                    if silent > LOST && !self.is_writing() {
                        return Ended::Silent(silent);
                    }
                    self.look_around().await
                },
            };
            if let Err(error) = turn {
                return error.into();
            }
        }
    }

    fn is_writing(&self) -> bool {
        self.work.as_ref().is_some_and(|it| matches!(it.work.phase(), Phase::Writing(_)))
    }

    /// One frame of anybody's.
    async fn heard(&mut self, frame: &Received) -> Result<(), LinkError> {
        let now = Instant::now();
        match self.hints.take(frame) {
            Some(Hint::Changed(trigger)) => {
                tracing::debug!(trigger, "sign of a change");
                self.agenda.changed(now, trigger);
                self.overtake(trigger);
            }
            Some(Hint::Transfer) => self.agenda.transfer(now),
            None => {}
        }
        match answer(&self.link, &mut self.service.own, frame).await? {
            None => Ok(()),
            Some(Request::Plan(asker)) => self.asked(asker).await,
            Some(Request::Set) => {
                self.service.tell_options();
                let times = &self.service.own.options.service;
                self.agenda.set_times(times.quiet_time(), Duration::from_secs(times.poll.into()));
                self.service.planned.forget();
                self.agenda.changed(now, "a parameter of quavd was set");
                self.overtake("a parameter of quavd was set");
                Ok(())
            }
            Some(Request::BadValue(why)) => {
                self.speaker.say(&Text::new(Severity::Warning, format!("not set: {why}"))).await
            }
        }
    }

    /// Newer input: what is planned for the old one is called off. What is being written goes to
    /// its end, and is looked at again then.
    fn overtake(&mut self, trigger: &str) {
        let Some(Running { work, .. }) = &self.work else { return };
        let was_planning = matches!(work.phase(), Phase::Planning(_));
        if work.cancel() && was_planning {
            tracing::info!(trigger, "the plan that was being made is for old input: called off");
            self.service.board.change(|status| status.counts.cancelled += 1);
        }
    }

    async fn asked(&mut self, asker: Asker) -> Result<(), LinkError> {
        if !self.service.own.options.service.enable {
            let words = "planning is disabled (QUAV_ENABLE)";
            self.speaker.say(&Text::new(Severity::Notice, words)).await?;
            return self.link.send(&asker.ack(CommandAck::DENIED, 255)).await;
        }
        let is_known = self.work.as_ref().is_some_and(|it| it.due.askers.contains(&asker));
        if !is_known {
            self.agenda.asked(Instant::now(), "asked for by command", Some(asker));
        }
        let percent = self.work.as_ref().map_or(0, |it| it.work.phase().percent());
        self.link.send(&asker.ack(CommandAck::IN_PROGRESS, percent)).await
    }

    /// Begins what is due.
    async fn begin(&mut self) -> Result<(), LinkError> {
        let Some(due) = self.agenda.take(Instant::now()) else { return Ok(()) };
        let options = &self.service.own.options;
        let wanted = due.force || options.service.policy == Policy::OnChange;
        let order = Order {
            vehicle: Arc::clone(&self.vehicle),
            store: self.service.store.clone(),
            options: Arc::new(options.clone()),
            known: self.service.planned.fingerprint(),
            force: due.force,
            plan: options.service.enable && wanted,
        };
        self.service.board.change(|status| status.counts.looks += 1);
        let basis = self.service.planned.basis();
        self.work = Some(Running { work: Work::start(order), due, basis });
        Ok(())
    }

    /// A piece of work has ended.
    async fn worked(&mut self, end: End) -> Result<(), LinkError> {
        let Some(Running { due, basis, .. }) = self.work.take() else { return Ok(()) };
        let now = Instant::now();
        match end {
            End::Cancelled => {
                self.agenda.again(now, due);
                Ok(())
            }
            End::Seen => {
                tracing::debug!("looked: nothing to plan");
                self.agenda.done(now);
                for asker in due.askers {
                    self.link.send(&asker.ack(CommandAck::DENIED, 255)).await?;
                }
                Ok(())
            }
            End::Answered(answer) => self.answered(*answer, due, basis).await,
        }
    }

    async fn answered(&mut self, answer: Answer, due: Due, basis: Basis) -> Result<(), LinkError> {
        let now = Instant::now();
        let verdict = answer.verdict;
        self.agenda.done(now);
        if verdict.is_worth_retrying() {
            self.agenda.failed(now, due.trigger, due.force);
        }
        self.service.keep(&answer, basis);
        if verdict == Verdict::Overtaken {
            self.service.board.change(|status| status.counts.cancelled += 1);
            return Ok(());
        }
        // The same failure again is no news.
        let is_news = !verdict.is_worth_retrying() || self.service.last != Some(verdict);
        self.service.last = Some(verdict);
        self.record(&answer, &due, now);
        for text in answer.texts.iter().filter(|_| is_news) {
            self.speaker.say(text).await?;
        }
        if let Some(document) = &answer.document {
            for (name, value) in
                [("quav_len", document.length_m), ("quav_clr", document.min_clearance_m)]
            {
                if let Some(value) = value {
                    self.speaker.show(name, value).await?;
                }
            }
        }
        for asker in due.askers {
            self.link.send(&asker.ack(verdict.command_result(), 100)).await?;
        }
        Ok(())
    }

    /// Keeps an answer, in the log, in the status, on disk.
    fn record(&self, answer: &Answer, due: &Due, now: Instant) {
        let document = answer.document(due.trigger);
        let kept = serde_json::to_vec(&document)
            .map_err(std::io::Error::other)
            .and_then(|bytes| self.service.history.keep(&bytes, answer.picture.as_deref()));
        let report = match kept {
            Ok(path) => Some(path.display().to_string()),
            Err(error) => {
                tracing::warn!(%error, "the report cannot be kept");
                None
            }
        };
        let name = verdict_name(answer.verdict);
        let took = now.saturating_duration_since(due.since);
        let reason = answer.reason.as_deref().unwrap_or("");
        tracing::info!(
            verdict = name,
            trigger = due.trigger,
            took_ms = took.as_millis() as u64,
            reason,
            "answered"
        );
        self.service.board.change(|status| {
            status.counts.answers += 1;
            status.counts.uploads += u64::from(answer.verdict == Verdict::Uploaded);
            status.last = Some(LastAnswer {
                time: document.time,
                verdict: name,
                trigger: due.trigger.to_owned(),
                text: answer.texts.iter().map(|text| text.words.clone()).collect(),
                reason: answer.reason.clone(),
                fallback: answer.document.as_ref().and_then(|plan| plan.fallback.clone()),
                report,
                took_ms: u64::try_from(took.as_millis()).unwrap_or(u64::MAX),
            });
        });
    }

    /// Once a second: what changes without a frame, and how far things are.
    async fn look_around(&mut self) -> Result<(), LinkError> {
        let now = Instant::now();
        let state = self.vehicle.state();
        if self.service.waits_for_disarming && !state.is_armed() {
            self.service.waits_for_disarming = false;
            self.service.planned.forget();
            self.agenda.changed(now, "the vehicle was disarmed");
        }
        if let Some(planned) = self.service.planned.from()
            && self.moves.has_moved(now, planned, &state)
        {
            self.service.planned.forget();
            self.agenda.changed(now, "the vehicle or its home is in another place");
            self.overtake("the vehicle or its home is in another place");
        }
        let phase = self.work.as_ref().map(|it| it.work.phase());
        self.service.board.change(|status| {
            status.state = phase.map_or("watching", Phase::name).to_owned();
            status.progress = phase.map(Phase::percent).filter(|&percent| percent > 0);
            status.vehicle = Some(VehicleStatus {
                system: self.vehicle.node().system.0,
                autopilot: self.vehicle.autopilot().to_string(),
                armed: state.is_armed(),
                silent_s: state.heard_at.elapsed().as_secs_f64(),
            });
        });
        let Some(Running { work, due, .. }) = &self.work else { return Ok(()) };
        let percent = work.phase().percent();
        if percent > 0 {
            self.speaker.show("quav_prog", f64::from(percent)).await?;
        }
        for asker in &due.askers {
            self.link.send(&asker.ack(CommandAck::IN_PROGRESS, percent)).await?;
        }
        Ok(())
    }

    /// Ends what runs: a plan is called off, an upload is waited for.
    async fn wind_up(&mut self, ended: &Ended) {
        let Some(Running { work, due, basis }) = &mut self.work else { return };
        if work.cancel() {
            work.ended().await;
        } else {
            tracing::info!(why = %ended, "an upload goes on; waiting for its end");
            let pulse = Arc::clone(&self.service.pulse);
            match pulse.beating(tokio::time::timeout(LAST_UPLOAD, work.ended())).await {
                Ok(End::Answered(answer)) => {
                    let (due, basis) = (due.clone(), *basis);
                    self.service.keep(&answer, basis);
                    self.record(&answer, &due, Instant::now());
                }
                Ok(_) => {}
                Err(_) => {
                    tracing::warn!("the upload has not ended; the next start settles it");
                }
            }
        }
    }
}

/// The end of the work that runs, never where none does.
async fn ended(work: &mut Option<Running>) -> End {
    match work {
        Some(Running { work, .. }) => work.ended().await,
        None => std::future::pending().await,
    }
}

fn verdict_name(verdict: Verdict) -> String {
    match serde_json::to_value(verdict) {
        Ok(serde_json::Value::String(name)) => name,
        _ => format!("{verdict:?}"),
    }
}
