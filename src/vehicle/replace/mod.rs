//! Replacing a plan on a vehicle so that it holds, at the end, the new plan or the old one, and
//! quavd knows which.
//!
//! The order of things: what the vehicle holds is on the disk before the first byte is sent
//! ([`crate::store`]); an upload counts when it has been read back and compared; when it has not
//! come to that, the old plan is put back and compared as well. Where the link is gone, the open
//! record stays, and [`settle`] ends the matter when the vehicle is there again.
//!
//! [`settle`] is in a file of its own, with the judgement of what a broken upload left; `guard`
//! decides when a vehicle is written to at all; `outcome` are the ways in which all this can end.

mod guard;
mod outcome;
mod put;
mod settle;

pub use guard::WhileArmed;
pub use outcome::{Aftermath, Failure, Obstacle, ReplaceError, Settled};
pub use settle::settle;

use self::guard::{InFlight, Permit, may_write};
use self::put::{Putting, What};
use self::settle::{Finding, Suspect, finding, settle_record};
use super::Vehicle;
use super::readback::{changes, differences};
use super::transfer::{OnProgress, Progress};
use crate::mission::{MissionItem, MissionType};
use crate::store::{Beginning, Outcome, Record, Store, StoreError};

/// What is to replace what. All lists are in the vehicle's numbering.
#[derive(Debug, Clone)]
pub struct Replacement {
    /// Which plan.
    pub mission_type: MissionType,
    /// The pilot's own plan, to be found again by later planning and by a restore.
    pub original: Vec<MissionItem>,
    /// What was downloaded, and the new plan was made for.
    pub before: Vec<MissionItem>,
    /// The new plan.
    pub intended: Vec<MissionItem>,
}

/// What a replacement is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// Reading what the vehicle holds.
    Reading(Progress),
    /// Uploading the new plan.
    Uploading(Progress),
    /// Reading the new plan back.
    Proving(Progress),
    /// Uploading the old plan again.
    PuttingBack(Progress),
}

/// Is told what a replacement is doing, and how far it is.
pub type OnStep<'a> = &'a mut (dyn FnMut(Step) + Send);

/// Puts a new plan on the vehicle and proves that it is there. Returns the closed record.
///
/// # Errors
/// [`ReplaceError`] says what went wrong and what the vehicle holds now.
pub async fn replace(
    vehicle: &Vehicle,
    store: &Store,
    replacement: Replacement,
    while_armed: WhileArmed,
    on_step: OnStep<'_>,
) -> Result<Record, ReplaceError> {
    let Replacement { mission_type, original, before, mut intended } = replacement;
    if let Some(record) = open_record(vehicle, store, mission_type).await? {
        return Err(Obstacle::Unsettled { path: store.path_of(&record) }.into());
    }
    may_write(vehicle, while_armed).await?;
    // Planning takes time: what somebody uploaded meanwhile must not be overwritten unsaved.
    let held = held(vehicle, mission_type, on_step).await?;
    if let Some(difference) =
        changes(vehicle.autopilot(), mission_type, &before, &held).into_iter().next()
    {
        return Err(Obstacle::Changed { mission_type, difference }.into());
    }
    let state = may_write(vehicle, while_armed).await?;
    let flight = InFlight::of(vehicle, &state, mission_type, &held, &mut intended)?;
    let permit = flight.map_or(Permit::OnTheGround, Permit::InFlight);
    let beginning =
        Beginning { vehicle: vehicle.id(), mission_type, original, before: held, intended };
    let mut record = on_disk(store, move |store| store.begin(beginning)).await?;
    tracing::info!(plan = %mission_type, saved = %store.path_of(&record).display(), "old plan saved");

    let new = Putting { vehicle, record: &record, what: What::New, permit };
    match new.put(on_step).await {
        Ok(read_back) => {
            record.read_back = Some(read_back);
            // Where closing fails, the vehicle holds the new plan; only the record does not say so.
            let proven = Aftermath::Settled(Settled::Finished);
            let failed = |obstacle| ReplaceError { obstacle, aftermath: proven };
            close(store, &mut record, Outcome::Verified).await.map_err(failed)?;
            tracing::info!(plan = %mission_type, items = record.intended.len(), "new plan verified");
            if let Some(flight) = flight {
                let went_on = flight.has_gone_on(vehicle).await;
                went_on.map_err(|obstacle| ReplaceError {
                    obstacle,
                    aftermath: Aftermath::Settled(Settled::Finished),
                })?;
            }
            Ok(record)
        }
        Err(obstacle) => {
            tracing::warn!(plan = %mission_type, %obstacle, "upload failed");
            let ours = Suspect::Ourselves;
            // On the disk, so that also a later start knows it for the vehicle's version of ours.
            if let Obstacle::Mismatch { held, .. } = &obstacle
                && finding(&vehicle.id(), &record, held, ours) == Finding::Mangled
            {
                record.found = Some(held.clone());
                let with_found = record.clone();
                if let Err(error) = on_disk(store, move |store| store.update(&with_found)).await {
                    tracing::warn!(%error, "what the vehicle made of the plan is not saved");
                }
            }
            match settle_record(vehicle, store, &mut record, while_armed, ours, on_step).await {
                // The acknowledgement was lost on the way, the plan was not.
                Ok(Settled::Finished) => Ok(record),
                Ok(settled) => {
                    Err(ReplaceError { obstacle, aftermath: Aftermath::Settled(settled) })
                }
                Err(why) => {
                    let (path, why) = (store.path_of(&record), Box::new(why));
                    Err(ReplaceError { obstacle, aftermath: Aftermath::Unsettled { path, why } })
                }
            }
        }
    }
}

/// Puts the pilot's own plan back, as of the newest upload that was begun. What the vehicle holds
/// in its place is saved first.
///
/// # Errors
/// [`ReplaceError`], with [`Obstacle::NothingSaved`] where quavd never wrote to this vehicle.
pub async fn restore(
    vehicle: &Vehicle,
    store: &Store,
    mission_type: MissionType,
    while_armed: WhileArmed,
    on_step: OnStep<'_>,
) -> Result<Record, ReplaceError> {
    settle(vehicle, store, mission_type, while_armed, on_step).await?;
    let id = vehicle.id();
    let last = on_disk(store, move |store| store.last(&id, mission_type)).await?;
    let last = last.ok_or(Obstacle::NothingSaved { mission_type, system: id.system })?;
    let before = held(vehicle, mission_type, on_step).await?;
    if changes(vehicle.autopilot(), mission_type, &last.original, &before).is_empty() {
        return Ok(last);
    }
    let original = last.original;
    let replacement = Replacement { mission_type, intended: original.clone(), original, before };
    replace(vehicle, store, replacement, while_armed, on_step).await
}

/// The pilot's own plan behind what the vehicle holds: where that is, to the last bit, the last
/// plan quavd proved there, what it was made from; else what is held.
///
/// # Errors
/// [`StoreError`].
pub async fn pilots_own(
    vehicle: &Vehicle,
    store: &Store,
    mission_type: MissionType,
    held: &[MissionItem],
) -> Result<Vec<MissionItem>, StoreError> {
    let id = vehicle.id();
    let last = on_disk(store, move |store| store.last_verified(&id, mission_type)).await?;
    let autopilot = vehicle.autopilot();
    let is_held = |last: &Record| match &last.read_back {
        Some(read_back) => changes(autopilot, mission_type, read_back, held).is_empty(),
        None => differences(autopilot, mission_type, &last.intended, held).is_empty(),
    };
    Ok(last.filter(is_held).map_or_else(|| held.to_vec(), |last| last.original))
}

async fn held(
    vehicle: &Vehicle,
    mission_type: MissionType,
    on_step: OnStep<'_>,
) -> Result<Vec<MissionItem>, Obstacle> {
    let on_progress: OnProgress<'_> = &mut |progress| on_step(Step::Reading(progress));
    Ok(vehicle.download(mission_type, on_progress).await?.items)
}

async fn open_record(
    vehicle: &Vehicle,
    store: &Store,
    mission_type: MissionType,
) -> Result<Option<Record>, Obstacle> {
    let id = vehicle.id();
    Ok(on_disk(store, move |store| store.open_record(&id, mission_type)).await?)
}

async fn close(store: &Store, record: &mut Record, outcome: Outcome) -> Result<(), Obstacle> {
    let mut closed = record.clone();
    *record = on_disk(store, move |store| {
        store.close(&mut closed, outcome)?;
        Ok(closed)
    })
    .await?;
    Ok(())
}

/// Runs a disk operation where waiting for the disk holds up nobody's heartbeat.
async fn on_disk<T: Send + 'static>(
    store: &Store,
    operation: impl FnOnce(&Store) -> Result<T, StoreError> + Send + 'static,
) -> Result<T, StoreError> {
    let store = store.clone();
    match tokio::task::spawn_blocking(move || operation(&store)).await {
        Ok(result) => result,
        // The operation panicked, or the runtime is shutting down.
        Err(error) => match error.try_into_panic() {
            Ok(panic) => std::panic::resume_unwind(panic),
            Err(error) => Err(StoreError::Interrupted(error.to_string())),
        },
    }
}
