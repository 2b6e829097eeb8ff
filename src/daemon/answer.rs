//! The answer to a change on the vehicle: a plan that is there, or the reason why there is none. In
//! words for the pilot, as a document for the record, and as a result for whoever asked.

use std::time::SystemTime;

use serde::Serialize;

use super::place::Place;
use super::planned::Fingerprint;
use super::speech::{Severity, Text, about_fallback, about_plan};
use crate::cli::CliError;
use crate::link::message::CommandAck;
use crate::replan::{ReplanError, Replanned};
use crate::report::json::PlanDocument;
use crate::vehicle::replace::{Failure, Obstacle, ReplaceError};

/// What it came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Verdict {
    /// The new mission is on the vehicle, read back and compared.
    Uploaded,
    /// The vehicle holds what was planned: nothing was written.
    AlreadyThere,
    /// There is no mission to plan.
    NoMission,
    /// No safe path exists or was found; the mission is untouched.
    NoPath,
    /// The input or a setting cannot be used; the mission is untouched.
    BadInput,
    /// The QPU failed and nothing else was allowed.
    Qpu,
    /// The vehicle is armed.
    Armed,
    /// The vehicle said no.
    Refused,
    /// The vehicle did not answer.
    Unreachable,
    /// The plans changed again before the upload.
    Overtaken,
    /// This machine's disk failed.
    Local,
    /// Nobody wanted it any more.
    Cancelled,
    /// A defect of quavd.
    #[default]
    Defect,
}

impl Verdict {
    /// Whether the same may work in a moment, with nothing changed.
    pub(super) fn is_worth_retrying(self) -> bool {
        matches!(self, Self::Unreachable | Self::Overtaken | Self::Local)
    }

    /// `MAV_RESULT` for whoever asked by a command.
    pub(super) fn command_result(self) -> u8 {
        match self {
            Self::Uploaded | Self::AlreadyThere => CommandAck::ACCEPTED,
            Self::Armed | Self::NoMission => CommandAck::DENIED,
            Self::Overtaken | Self::Unreachable => CommandAck::TEMPORARILY_REJECTED,
            Self::Cancelled => CommandAck::CANCELLED,
            _ => CommandAck::FAILED,
        }
    }
}

/// One answer.
#[derive(Debug, Default)]
pub(super) struct Answer {
    pub(super) verdict: Verdict,
    /// What was planned from; `None` where that is not known or has to be looked at again.
    pub(super) fingerprint: Option<Fingerprint>,
    /// Where the vehicle was then.
    pub(super) planned_from: Option<Place>,
    /// For the pilot.
    pub(super) texts: Vec<Text>,
    /// The reason in full, where there is one.
    pub(super) reason: Option<String>,
    /// The plan as `quavd plan --json` prints it.
    pub(super) document: Option<PlanDocument>,
    /// The same as a picture.
    pub(super) picture: Option<String>,
}

/// An answer as it is kept.
#[derive(Debug, Clone, Serialize)]
pub(super) struct AnswerDocument<'a> {
    /// Seconds since 1970.
    pub(super) time: u64,
    pub(super) verdict: Verdict,
    /// Why it was worked on.
    pub(super) trigger: &'a str,
    pub(super) reason: Option<&'a str>,
    pub(super) plan: Option<&'a PlanDocument>,
}

impl Answer {
    pub(super) fn planned(planned: &Replanned, document: PlanDocument) -> Self {
        let mut texts = about_plan(planned);
        texts.extend(document.fallback.as_deref().map(about_fallback));
        Self { texts, document: Some(document), ..Self::default() }
    }

    /// The vehicle holds it already.
    pub(super) fn already_there(&mut self, planned: &Replanned) {
        self.verdict = Verdict::AlreadyThere;
        if planned.is_changed() {
            let words = "the planned mission is on the vehicle";
            self.texts = vec![Text::new(Severity::Notice, words)];
            let fallback = self.document.as_ref().and_then(|document| document.fallback.as_deref());
            self.texts.extend(fallback.map(about_fallback));
        }
    }

    /// The plan has arrived.
    pub(super) fn uploaded(&mut self, items: usize) {
        self.verdict = Verdict::Uploaded;
        let words = format!("mission uploaded and verified ({items} items)");
        self.texts.push(Text::new(Severity::Notice, words));
    }

    /// The plan has arrived, and meanwhile the vehicle is where the way to it is not clear.
    pub(super) fn way_is_not_clear(&mut self, error: &CliError) {
        let words = "the way to the next item is not clear: stop";
        self.texts.push(Text::new(Severity::Critical, words));
        self.reason = Some(format!("the new mission is on the vehicle, but {error}"));
    }

    pub(super) fn no_mission() -> Self {
        Self {
            verdict: Verdict::NoMission,
            reason: Some("the vehicle holds no mission".to_owned()),
            ..Self::default()
        }
    }

    pub(super) fn no_plan(error: &ReplanError, document: PlanDocument) -> Self {
        let (verdict, words) = if error.is_no_path() {
            (Verdict::NoPath, "no safe path, mission untouched")
        } else {
            (Verdict::BadInput, "cannot plan, mission untouched")
        };
        Self { document: Some(document), ..Self::refused(verdict, words, error.to_string()) }
    }

    pub(super) fn failed(verdict: Verdict, reason: &str) -> Self {
        Self::refused(verdict, "planning failed, mission untouched", reason.to_owned())
    }

    /// An error on the way to a plan.
    pub(super) fn from_cli(error: CliError) -> Box<Self> {
        let reason = error.to_string();
        let (verdict, words) = match error {
            CliError::Usage(_) => (Verdict::BadInput, "cannot plan, mission untouched"),
            CliError::NoPath { .. } => (Verdict::NoPath, "no safe path, mission untouched"),
            CliError::Qpu(_) => (Verdict::Qpu, "the QPU failed, mission untouched"),
            CliError::Unreachable(_) => (Verdict::Unreachable, "vehicle does not answer"),
            CliError::Refused(_) => (Verdict::Refused, "vehicle refused, mission untouched"),
        };
        Box::new(Self::refused(verdict, words, reason))
    }

    /// What stood in the way of writing.
    pub(super) fn not_written(obstacle: &Obstacle, before: Self) -> Self {
        let (verdict, words) = match (obstacle, obstacle.failure()) {
            (Obstacle::Armed | Obstacle::FlyingMission, _) => {
                (Verdict::Armed, "vehicle is armed, plan not uploaded")
            }
            (_, Failure::Unreachable) => (Verdict::Unreachable, "link lost during upload"),
            (_, Failure::Refused) => (Verdict::Refused, "vehicle refused the plan"),
            (_, Failure::Local) => (Verdict::Local, "cannot save the old mission: no upload"),
        };
        Self {
            fingerprint: before.fingerprint,
            planned_from: before.planned_from,
            document: before.document,
            ..Self::refused(verdict, words, obstacle.to_string())
        }
    }

    /// The same with what became of the vehicle.
    pub(super) fn not_delivered(error: &ReplaceError, before: Self) -> Self {
        let aftermath = error.aftermath.to_string();
        let mut answer = Self::not_written(&error.obstacle, before);
        answer.reason = Some(error.to_string());
        if answer.verdict != Verdict::Armed {
            answer.texts.push(Text::new(Severity::Warning, aftermath));
        }
        answer
    }

    fn refused(verdict: Verdict, words: &str, reason: String) -> Self {
        let mut texts = vec![Text::new(Severity::Warning, words)];
        if matches!(verdict, Verdict::NoPath | Verdict::BadInput | Verdict::Refused) {
            texts.push(Text::new(Severity::Info, &reason));
        }
        Self { verdict, reason: Some(reason), texts, ..Self::default() }
    }

    /// What is kept of it.
    pub(super) fn document<'a>(&'a self, trigger: &'a str) -> AnswerDocument<'a> {
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        AnswerDocument {
            time: now.map_or(0, |since| since.as_secs()),
            verdict: self.verdict,
            trigger,
            reason: self.reason.as_deref(),
            plan: self.document.as_ref(),
        }
    }
}
