//! How a replacement or the settling of one can end, in types and in words.

use std::fmt;
use std::path::PathBuf;

use super::super::readback::Difference;
use super::super::transfer::TransferError;
use crate::link::SystemId;
use crate::mission::{MissionItem, MissionType};
use crate::store::StoreError;

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
    /// ArduPilot's mission is not replaced under a vehicle that flies it.
    #[error(
        "the vehicle flies its mission, and this autopilot replaces one item by item; change to \
         another mode (LOITER, BRAKE, GUIDED) first"
    )]
    FlyingMission,
    /// The vehicle is in flight, and this would not be safe.
    #[error("not in flight: {why}; land and disarm first")]
    InFlight {
        /// Why not.
        why: String,
    },
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
        path: PathBuf,
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
        /// What it holds.
        held: Vec<MissionItem>,
    },
    /// Nothing to go back to.
    #[error("no earlier {mission_type} of system {system} was saved here")]
    NothingSaved {
        /// Which plan.
        mission_type: MissionType,
        /// Of which vehicle.
        system: SystemId,
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
        path: PathBuf,
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
            Self::Transfer(_)
            | Self::Armed
            | Self::FlyingMission
            | Self::InFlight { .. }
            | Self::Changed { .. }
            | Self::Mismatch { .. } => Failure::Refused,
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
