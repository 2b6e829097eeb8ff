//! Replacing a plan on a vehicle so that it holds, at the end, the new plan or the old one, and
//! quavd knows which.
//!
//! The order of things: what the vehicle holds is on the disk before the first byte is sent
//! ([`crate::store`]); an upload counts when it has been read back and compared; when it has not
//! come to that, the old plan is put back and compared as well. Where the link is gone, the open
//! record stays, and [`settle`] ends the matter when the vehicle is there again.

use std::fmt;

use super::discovery::Autopilot;
use super::readback::{Difference, differences};
use super::transfer::{OnProgress, Progress, TransferError};
use super::upload::Uploaded;
use super::{Vehicle, VehicleState};
use crate::mission::{MissionItem, MissionType};
use crate::store::{Beginning, Outcome, Record, Store, StoreError};

/// Whether a vehicle whose motors may turn is written to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WhileArmed {
    /// Never.
    #[default]
    Refuse,
    /// As the configuration says it may be.
    Allow,
}

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

/// How an open record was settled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Settled {
    /// The new plan had arrived whole: it stays.
    Finished,
    /// The old plan was still there.
    Untouched,
    /// Parts of the upload were there: the old plan was put back.
    PutBack,
    /// Somebody else has put another plan there since: it was left alone.
    LeftAlone,
}

impl fmt::Display for Settled {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Finished => "the new plan is on the vehicle, complete",
            Self::Untouched => "the old plan is on the vehicle, unchanged",
            Self::PutBack => "the old plan was put back and verified",
            Self::LeftAlone => "another plan was uploaded since, and was left alone",
        })
    }
}

/// What stands in the way of a replacement.
#[derive(Debug, thiserror::Error)]
pub enum Obstacle {
    /// The motors may turn.
    #[error("the vehicle is armed; disarm it, or allow uploads in flight in the configuration")]
    Armed,
    /// No heartbeat.
    #[error("the vehicle has not been heard for {seconds:.0} s; see that it is on and in range")]
    Silent {
        /// Since when.
        seconds: f64,
    },
    /// An earlier upload has not been settled.
    #[error("the upload of {} is not settled; settle it first with `quavd once --restore`", path.display())]
    Unsettled {
        /// Its record.
        path: std::path::PathBuf,
    },
    /// The plan on the vehicle is not the one that was planned from.
    #[error(
        "somebody changed the {mission_type} on the vehicle meanwhile ({difference}); plan again"
    )]
    Changed {
        /// Which plan.
        mission_type: MissionType,
        /// The first of the changes.
        difference: Difference,
    },
    /// The store cannot keep the old plan safe.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A transfer failed.
    #[error(transparent)]
    Transfer(#[from] TransferError),
    /// The vehicle does not hold what it accepted.
    #[error(
        "the vehicle does not hold the {mission_type} that it was sent: {}{}",
        differences.first().map(ToString::to_string).unwrap_or_default(),
        more(differences.len())
    )]
    Mismatch {
        /// Which plan.
        mission_type: MissionType,
        /// Field by field.
        differences: Vec<Difference>,
    },
    /// Nothing to go back to.
    #[error("no earlier {mission_type} of system {system} was saved here")]
    NothingSaved {
        /// Which plan.
        mission_type: MissionType,
        /// Of which vehicle.
        system: crate::link::SystemId,
    },
}

fn more(differences: usize) -> String {
    match differences {
        0 | 1 => String::new(),
        all => format!(", and {} more differences", all - 1),
    }
}

/// What the vehicle holds after a replacement failed.
#[derive(Debug)]
pub enum Aftermath {
    /// Nothing was written.
    NotBegun,
    /// Settled, as it says.
    Settled(Settled),
    /// Not known: the record stays open, and the next start settles it.
    Unsettled {
        /// Where the old plan is saved.
        path: std::path::PathBuf,
        /// Why it could not be settled now.
        why: Box<Obstacle>,
    },
}

impl fmt::Display for Aftermath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotBegun => f.write_str("nothing was written to the vehicle"),
            Self::Settled(settled) => settled.fmt(f),
            Self::Unsettled { path, why } => write!(
                f,
                "the vehicle may hold half a plan ({why}); the old one is saved in {} and is put \
                 back with `quavd once --restore`, or when the daemon next finds the vehicle",
                path.display()
            ),
        }
    }
}

/// A replacement that failed, and what became of the vehicle.
#[derive(Debug, thiserror::Error)]
#[error("{obstacle}; {aftermath}")]
pub struct ReplaceError {
    /// What went wrong.
    pub obstacle: Obstacle,
    /// What the vehicle holds now.
    pub aftermath: Aftermath,
}

/// The kinds of failure that a caller tells apart (its exit codes).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// The vehicle is not there, or was lost.
    Unreachable,
    /// The vehicle, or its state, says no.
    Refused,
    /// This machine's disk or directory.
    Local,
}

impl Obstacle {
    /// Which kind of failure it is.
    #[must_use]
    pub fn failure(&self) -> Failure {
        match self {
            Self::Silent { .. } => Failure::Unreachable,
            Self::Transfer(error) if error.is_unreachable() => Failure::Unreachable,
            Self::Transfer(_) | Self::Armed | Self::Changed { .. } | Self::Mismatch { .. } => {
                Failure::Refused
            }
            Self::Store(_) | Self::Unsettled { .. } | Self::NothingSaved { .. } => Failure::Local,
        }
    }
}

impl ReplaceError {
    /// Which kind of failure it is: a vehicle that was lost counts most.
    #[must_use]
    pub fn failure(&self) -> Failure {
        match &self.aftermath {
            Aftermath::Unsettled { why, .. } if why.failure() == Failure::Unreachable => {
                Failure::Unreachable
            }
            _ => self.obstacle.failure(),
        }
    }
}

impl From<StoreError> for ReplaceError {
    fn from(error: StoreError) -> Self {
        Obstacle::from(error).into()
    }
}

impl From<Obstacle> for ReplaceError {
    fn from(obstacle: Obstacle) -> Self {
        Self { obstacle, aftermath: Aftermath::NotBegun }
    }
}

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
    let Replacement { mission_type, original, before, intended } = replacement;
    if let Some(record) = open_record(vehicle, store, mission_type).await? {
        return Err(Obstacle::Unsettled { path: store.path_of(&record) }.into());
    }
    may_write(vehicle, while_armed).await?;
    // Planning takes time: what somebody uploaded meanwhile must not be overwritten unsaved.
    let held = held(vehicle, mission_type, on_step).await?;
    if let Some(difference) = first_difference(vehicle, mission_type, &before, &held) {
        return Err(Obstacle::Changed { mission_type, difference }.into());
    }
    may_write(vehicle, while_armed).await?;
    let beginning = Beginning {
        vehicle: vehicle.node().system,
        autopilot: vehicle.autopilot(),
        mission_type,
        original,
        before: held,
        intended,
    };
    let mut record = on_disk(store, move |store| store.begin(beginning)).await?;
    tracing::info!(plan = %mission_type, saved = %store.path_of(&record).display(), "old plan saved");

    match put(vehicle, mission_type, &record.intended, Step::Uploading, on_step).await {
        Ok(()) => match close(store, &mut record, Outcome::Verified).await {
            Ok(()) => Ok(record),
            Err(obstacle) => {
                // The vehicle holds the new plan; only the record does not say so yet.
                Err(ReplaceError { obstacle, aftermath: Aftermath::Settled(Settled::Finished) })
            }
        },
        Err(obstacle) => {
            tracing::warn!(plan = %mission_type, %obstacle, "upload failed");
            let ours = Suspect::Ourselves;
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

/// Ends what an earlier run left open, after a lost link, a crash or a power cut. `None` where
/// nothing was open.
///
/// A plan that is neither the old one, nor the new one, nor made of parts of both has been put
/// there by somebody else, and is left alone.
///
/// # Errors
/// [`Obstacle`]: the record is then still open.
pub async fn settle(
    vehicle: &Vehicle,
    store: &Store,
    mission_type: MissionType,
    while_armed: WhileArmed,
    on_step: OnStep<'_>,
) -> Result<Option<Settled>, Obstacle> {
    let Some(mut record) = open_record(vehicle, store, mission_type).await? else {
        return Ok(None);
    };
    let suspect = Suspect::Anybody;
    settle_record(vehicle, store, &mut record, while_armed, suspect, on_step).await.map(Some)
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
    let system = vehicle.node().system;
    let last = on_disk(store, move |store| store.last(system, mission_type)).await?;
    let last = last.ok_or(Obstacle::NothingSaved { mission_type, system })?;
    let before = held(vehicle, mission_type, on_step).await?;
    if first_difference(vehicle, mission_type, &last.original, &before).is_none() {
        return Ok(last);
    }
    let original = last.original;
    let replacement = Replacement { mission_type, intended: original.clone(), original, before };
    replace(vehicle, store, replacement, while_armed, on_step).await
}

/// The pilot's own plan behind what the vehicle holds: where that is the last plan quavd proved
/// there, what it was made from; else what is held.
///
/// # Errors
/// [`StoreError`].
pub async fn pilots_own(
    vehicle: &Vehicle,
    store: &Store,
    mission_type: MissionType,
    held: &[MissionItem],
) -> Result<Vec<MissionItem>, StoreError> {
    let system = vehicle.node().system;
    let last = on_disk(store, move |store| store.last_verified(system, mission_type)).await?;
    Ok(match last {
        Some(last) if first_difference(vehicle, mission_type, &last.intended, held).is_none() => {
            last.original
        }
        _ => held.to_vec(),
    })
}

/// Who may have put an unknown plan on the vehicle.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Suspect {
    /// Only the upload that has just failed.
    Ourselves,
    /// Anybody: time has passed.
    Anybody,
}

async fn settle_record(
    vehicle: &Vehicle,
    store: &Store,
    record: &mut Record,
    while_armed: WhileArmed,
    suspect: Suspect,
    on_step: OnStep<'_>,
) -> Result<Settled, Obstacle> {
    let mission_type = record.mission_type;
    is_there(vehicle)?;
    tokio::time::sleep(vehicle.timing.stragglers).await;
    let held = held(vehicle, mission_type, on_step).await?;
    let is = |plan: &[MissionItem]| first_difference(vehicle, mission_type, plan, &held).is_none();
    let (settled, outcome) = if is(&record.before) {
        (Settled::Untouched, Outcome::Restored)
    } else if is(&record.intended) {
        (Settled::Finished, Outcome::Verified)
    } else if suspect == Suspect::Ourselves || is_mixture(vehicle.autopilot(), record, &held) {
        may_write(vehicle, while_armed).await?;
        put(vehicle, mission_type, &record.before, Step::PuttingBack, on_step).await?;
        (Settled::PutBack, Outcome::Restored)
    } else {
        (Settled::LeftAlone, Outcome::Superseded)
    };
    close(store, record, outcome).await?;
    tracing::info!(plan = %mission_type, outcome = %settled, "upload settled");
    Ok(settled)
}

/// Whether a plan can be what a broken upload left: each item the old one or the new one.
/// (ArduPilot cuts the mission to the new length at once, then overwrites item by item.)
fn is_mixture(autopilot: Autopilot, record: &Record, held: &[MissionItem]) -> bool {
    let longest = record.before.len().max(record.intended.len());
    let is_at = |plan: &[MissionItem], k: usize| {
        // Compared as a plan of one item, behind a slot that stands for those before it.
        plan.get(k).is_some_and(|item| {
            let of = |item: MissionItem| {
                [MissionItem { seq: 0, ..item }, MissionItem { seq: 1, ..item }]
            };
            differences(autopilot, record.mission_type, &of(*item), &of(held[k])).is_empty()
        })
    };
    let home_slot = usize::from(
        autopilot == Autopilot::ArduPilot && record.mission_type == MissionType::Mission,
    );
    held.len() <= longest
        && (home_slot..held.len()).all(|k| is_at(&record.before, k) || is_at(&record.intended, k))
}

/// Uploads, reads back and compares. A fence is read back once more when the vehicle has had time
/// to erase it, which ArduPilot does to some.
async fn put(
    vehicle: &Vehicle,
    mission_type: MissionType,
    items: &[MissionItem],
    uploading: fn(Progress) -> Step,
    on_step: OnStep<'_>,
) -> Result<(), Obstacle> {
    let upload = async |on_step: OnStep<'_>| {
        let on_progress: OnProgress<'_> = &mut |progress| on_step(uploading(progress));
        vehicle.upload(mission_type, items, on_progress).await
    };
    let uploaded = upload(on_step).await?;
    match (uploaded, prove(vehicle, mission_type, items, on_step).await) {
        (Uploaded::Unconfirmed, Err(Obstacle::Mismatch { .. })) => {
            tracing::warn!(plan = %mission_type, "the unacknowledged upload did not arrive; again");
            upload(on_step).await?;
            prove(vehicle, mission_type, items, on_step).await?;
        }
        (_, proof) => proof?,
    }
    if mission_type == MissionType::Fence {
        tokio::time::sleep(vehicle.timing.fence_settles).await;
        prove(vehicle, mission_type, items, on_step).await?;
    }
    Ok(())
}

async fn prove(
    vehicle: &Vehicle,
    mission_type: MissionType,
    items: &[MissionItem],
    on_step: OnStep<'_>,
) -> Result<(), Obstacle> {
    let on_progress: OnProgress<'_> = &mut |progress| on_step(Step::Proving(progress));
    let held = vehicle.download(mission_type, on_progress).await?.items;
    let differences = differences(vehicle.autopilot(), mission_type, items, &held);
    if differences.is_empty() {
        return Ok(());
    }
    Err(Obstacle::Mismatch { mission_type, differences })
}

async fn held(
    vehicle: &Vehicle,
    mission_type: MissionType,
    on_step: OnStep<'_>,
) -> Result<Vec<MissionItem>, Obstacle> {
    let on_progress: OnProgress<'_> = &mut |progress| on_step(Step::Reading(progress));
    Ok(vehicle.download(mission_type, on_progress).await?.items)
}

fn first_difference(
    vehicle: &Vehicle,
    mission_type: MissionType,
    sent: &[MissionItem],
    held: &[MissionItem],
) -> Option<Difference> {
    differences(vehicle.autopilot(), mission_type, sent, held).into_iter().next()
}

fn is_there(vehicle: &Vehicle) -> Result<(), Obstacle> {
    if vehicle.is_alive() {
        return Ok(());
    }
    Err(Obstacle::Silent { seconds: vehicle.silent_for().as_secs_f64() })
}

/// Whether the vehicle is there and, unless allowed, its motors are off, by a heartbeat that is
/// not old.
async fn may_write(vehicle: &Vehicle, while_armed: WhileArmed) -> Result<(), Obstacle> {
    let silence = vehicle.timing.silence;
    let fresh = |state: &VehicleState| state.heartbeat_at.elapsed() <= silence / 2;
    let Some(state) = vehicle.wait_for(silence, fresh).await else {
        return Err(Obstacle::Silent { seconds: vehicle.silent_for().as_secs_f64() });
    };
    if state.is_armed() && while_armed == WhileArmed::Refuse {
        return Err(Obstacle::Armed);
    }
    Ok(())
}

async fn open_record(
    vehicle: &Vehicle,
    store: &Store,
    mission_type: MissionType,
) -> Result<Option<Record>, Obstacle> {
    let system = vehicle.node().system;
    Ok(on_disk(store, move |store| store.open_record(system, mission_type)).await?)
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
