//! Why there is no plan, in words that name the leg, the regions, and what to do next.

use super::field::FieldError;
use crate::fence::FenceSet;
use crate::geodesy::ProjectionError;
use crate::mission::{Leg, LegError, SpliceError};
use crate::planner::PlanError;
use crate::planner::rounds::RoundError;
use crate::stop::Stopped;

/// Why a mission could not be judged or planned. The mission is untouched in every case.
#[derive(Debug, thiserror::Error)]
pub enum ReplanError {
    /// A region or a place cannot be used.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// The path of the mission is not known.
    #[error(transparent)]
    Legs(#[from] LegError),
    /// A leg cannot be judged.
    #[error("the {leg} cannot be judged: {why}")]
    Unjudged {
        /// The leg's name.
        leg: String,
        /// Why, and what to do.
        why: String,
    },
    /// Proven: a leg has no safe path.
    #[error("the {leg} has no safe path: {why}")]
    Infeasible {
        /// The leg's name.
        leg: String,
        /// What is in the way, and what to do.
        why: String,
    },
    /// No safe path was found for a leg, which is no proof that there is none.
    #[error("no safe path was found for the {leg}: {why}")]
    NotFound {
        /// The leg's name.
        leg: String,
        /// What was in the way last, and what to do.
        why: String,
    },
    /// A leg is not clear and nothing can be inserted into it.
    #[error("the {leg} comes too near to {region}, and {why}")]
    Fixed {
        /// The leg's name.
        leg: String,
        /// The region's name.
        region: String,
        /// Why it cannot be re-planned, and what to do.
        why: String,
    },
    /// The waypoints cannot be put into the mission.
    #[error(transparent)]
    Splice(#[from] SpliceError),
    /// The new mission did not pass the judgement. A defect; nothing is uploaded.
    #[error(
        "the new mission was refused by its own check: the {leg} comes too near to {region}; \
         please report this"
    )]
    NotVerified {
        /// The leg's name in the new mission.
        leg: String,
        /// The region's name.
        region: String,
    },
    /// The plan needs more waypoints than there may be.
    #[error(
        "no plan with at most {most} inserted waypoints was found; the best has {least}. Allow more \
         (--max-waypoints), or lower --buffer"
    )]
    TooManyWaypoints {
        /// How many there may be.
        most: usize,
        /// How many the best plan has.
        least: usize,
    },
    /// QAOA failed on a leg.
    #[error("QAOA failed on the {leg}: {cause}")]
    Qaoa {
        /// The leg's name.
        leg: String,
        /// What happened.
        cause: RoundError,
    },
    /// The time was up before a leg had any safe path.
    #[error(
        "the deadline passed before a safe path was found for the {leg}; give more time with \
         --deadline"
    )]
    DeadlinePassed {
        /// The leg's name.
        leg: String,
    },
    /// Planning was called off.
    #[error("planning was cancelled")]
    Cancelled,
}

impl From<ProjectionError> for ReplanError {
    fn from(cause: ProjectionError) -> Self {
        Self::Field(cause.into())
    }
}

impl ReplanError {
    /// Whether the answer is "there is no safe path" (exit code 3) rather than bad input.
    #[must_use]
    pub fn is_no_path(&self) -> bool {
        matches!(
            self,
            Self::Unjudged { .. }
                | Self::Infeasible { .. }
                | Self::NotFound { .. }
                | Self::DeadlinePassed { .. }
                | Self::Fixed { .. }
                | Self::Splice(_)
                | Self::NotVerified { .. }
                | Self::TooManyWaypoints { .. }
        )
    }

    /// Whether a QPU gave nothing and nothing else was allowed (exit code 6).
    #[must_use]
    pub fn is_qpu_failure(&self) -> bool {
        matches!(self, Self::Qaoa { cause: RoundError::Qpu(_), .. })
    }

    pub(super) fn unjudged(leg: &Leg, why: &str) -> Self {
        Self::Unjudged { leg: leg.name().to_string(), why: why.to_owned() }
    }

    /// A planner's error about a leg, with regions by their names.
    pub(super) fn from_plan(error: PlanError, leg: &Leg, fences: &FenceSet) -> Self {
        let name = |region: &crate::airspace::RegionId| {
            fences.regions.get(region.0 as usize).map_or("a fence", |r| r.origin.as_str())
        };
        let leg = leg.name().to_string();
        let end = |goal: bool| if goal { "its end" } else { "its start" };
        match error {
            PlanError::EndNotClear { goal, region, clearance, margin } => {
                let (end, region) = (end(goal), name(&region));
                let where_ = if clearance <= 0.0 {
                    format!("{end} is in or beyond {region}")
                } else {
                    format!("{end} is {clearance:.2} m from {region} and needs {margin:.2} m")
                };
                Self::Infeasible { leg, why: format!("{where_}; move it, or lower --buffer") }
            }
            PlanError::Infeasible { goal, regions } => {
                let names: Vec<&str> = regions.iter().map(name).collect();
                let why = format!(
                    "{} is shut in by {}; open the fence, or lower --buffer",
                    end(goal),
                    names.join(", ")
                );
                Self::Infeasible { leg, why }
            }
            PlanError::NotFound { region } => {
                let hit = region.as_ref().map_or_else(String::new, |region| {
                    format!("the best one comes too near to {}; ", name(region))
                });
                let why = format!("{hit}try a finer --grid, more --qubits or another --seed");
                Self::NotFound { leg, why }
            }
            PlanError::Stopped(Stopped::Cancelled) => Self::Cancelled,
            PlanError::Stopped(Stopped::DeadlinePassed) => Self::DeadlinePassed { leg },
            PlanError::Round(cause) => Self::Qaoa { leg, cause },
            PlanError::Projection(cause) => cause.into(),
        }
    }
}
