//! Putting one of the two plans of a record on the vehicle, and proving that it is there.
//!
//! Between two attempts somebody else's plan may have got in. It is nowhere saved, so what the
//! vehicle holds is looked at again before each further attempt.

use tokio::time::{Instant, sleep};

use super::guard::Permit;
use super::outcome::Obstacle;
use super::settle::{Finding, Suspect, finding};
use super::{OnStep, Step, held};
use crate::mission::{MissionItem, MissionType};
use crate::store::Record;
use crate::vehicle::Vehicle;
use crate::vehicle::readback::{changes, differences};
use crate::vehicle::transfer::{OnProgress, Setback, TransferError};
use crate::vehicle::upload::{BusyHabit, Uploaded};

/// Which plan of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum What {
    /// [`Record::intended`].
    New,
    /// [`Record::before`].
    Old,
}

/// One of a record's plans on its way to the vehicle.
pub(super) struct Putting<'a> {
    pub(super) vehicle: &'a Vehicle,
    pub(super) record: &'a Record,
    pub(super) what: What,
    pub(super) permit: Permit,
}

impl Putting<'_> {
    /// Uploads, reads back and compares; returns what was read. A fence is read back once more
    /// when the vehicle has had time to erase it, which ArduPilot does to some.
    pub(super) async fn put(&self, on_step: OnStep<'_>) -> Result<Vec<MissionItem>, Obstacle> {
        let timing = &self.vehicle.timing;
        let mut restarts = 0;
        let mut busy_since = None;
        let mut busy_answers = 0;
        // Until an upload has been begun, the vehicle holds what it held, or somebody else's plan.
        let mut is_begun = self.what == What::Old;
        let mut unproven = false;
        loop {
            let mut ours = Vec::from([&self.record.intended]);
            let error = match self.upload(on_step).await {
                Ok(uploaded) => match (uploaded, self.prove(on_step).await) {
                    // There is nothing to fall back on when the old plan is put back: where the
                    // vehicle has just made something else of it, it gets it once more.
                    (_, Err(mismatch @ Obstacle::Mismatch { .. }))
                        if !unproven
                            && (uploaded == Uploaded::Unconfirmed || self.what == What::Old) =>
                    {
                        (unproven, is_begun) = (true, true);
                        if uploaded == Uploaded::Acknowledged {
                            ours.push(&self.record.before);
                        }
                        mismatch
                    }
                    (_, proof) => return self.proven_again(proof?, on_step).await,
                },
                Err(Setback::Again(error @ TransferError::Busy { .. })) => {
                    let since = *busy_since.get_or_insert_with(Instant::now);
                    busy_answers += 1;
                    // Looking at the plan between two answers can take longer than that alone.
                    if busy_answers > timing.retries && since.elapsed() >= timing.busy {
                        let (mission_type, waited) = (self.record.mission_type, since.elapsed());
                        return Err(TransferError::Busy { mission_type, waited }.into());
                    }
                    sleep(timing.busy_pause()).await;
                    error.into()
                }
                Err(Setback::Again(error))
                    if restarts < timing.restarts && self.vehicle.is_alive() =>
                {
                    (restarts, is_begun) = (restarts + 1, true);
                    // What is under way of the old attempt is no answer to the new one.
                    sleep(timing.stragglers).await;
                    error.into()
                }
                Err(Setback::Again(error) | Setback::Final(error)) => return Err(error.into()),
            };
            let plan = self.record.mission_type;
            tracing::warn!(%plan, %error, "upload to be begun again");
            self.nobody_else_was_here(is_begun, &ours, on_step).await?;
        }
    }

    fn items(&self) -> &[MissionItem] {
        match self.what {
            What::New => &self.record.intended,
            What::Old => &self.record.before,
        }
    }

    async fn upload(&self, on_step: OnStep<'_>) -> Result<Uploaded, Setback> {
        let step = match self.what {
            What::New => Step::Uploading,
            What::Old => Step::PuttingBack,
        };
        let on_progress: OnProgress<'_> = &mut |progress| on_step(step(progress));
        let goes_on = |state: &_| self.permit.goes_on(self.vehicle, state);
        let (plan, end) = (self.record.mission_type, BusyHabit::End);
        self.vehicle.attempt(plan, self.items(), &goes_on, end, on_progress).await
    }

    async fn prove(&self, on_step: OnStep<'_>) -> Result<Vec<MissionItem>, Obstacle> {
        let mission_type = self.record.mission_type;
        let on_progress: OnProgress<'_> = &mut |progress| on_step(Step::Proving(progress));
        let held = self.vehicle.download(mission_type, on_progress).await?.items;
        let differences = differences(self.vehicle.autopilot(), mission_type, self.items(), &held);
        if differences.is_empty() {
            return Ok(held);
        }
        Err(Obstacle::Mismatch { mission_type, differences, held })
    }

    async fn proven_again(
        &self,
        read_back: Vec<MissionItem>,
        on_step: OnStep<'_>,
    ) -> Result<Vec<MissionItem>, Obstacle> {
        if self.record.mission_type != MissionType::Fence {
            return Ok(read_back);
        }
        sleep(self.vehicle.timing.fence_settles).await;
        self.prove(on_step).await
    }

    /// Whether the plan on the vehicle is still one that may be overwritten: once an upload has been
    /// begun, also what it can have made of the plans that are `ours`.
    async fn nobody_else_was_here(
        &self,
        is_begun: bool,
        ours: &[&Vec<MissionItem>],
        on_step: OnStep<'_>,
    ) -> Result<(), Obstacle> {
        let Record { mission_type, before, .. } = self.record;
        let held = held(self.vehicle, *mission_type, on_step).await?;
        let mut changed = changes(self.vehicle.autopilot(), *mission_type, before, &held);
        let may_go_on = if is_begun {
            let is_ours = |plan: &&Vec<MissionItem>| {
                let record = Record { intended: (*plan).clone(), ..self.record.clone() };
                let found = finding(&self.vehicle.id(), &record, &held, Suspect::Ourselves);
                found != Finding::SomebodyElses
            };
            ours.iter().any(is_ours)
        } else {
            changed.is_empty()
        };
        if may_go_on || changed.is_empty() {
            return Ok(());
        }
        let difference = changed.swap_remove(0);
        Err(Obstacle::Changed { mission_type: *mission_type, difference })
    }
}
