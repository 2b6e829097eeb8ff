//! Planning for a vehicle that has not room for many waypoints.

use std::sync::atomic::AtomicBool;

use super::plan::{Progress, Replanned, replan};
use super::reason::ReplanError;
use super::{Input, Options};

/// What saved waypoints may cost together, as shares of a leg's length: tried one after the other
/// behind the settings' own.
const ALLOWANCES: [f64; 4] = [0.01, 0.05, 0.2, 1.0];

/// A plan with few waypoints.
#[derive(Debug, Clone, PartialEq)]
pub struct Fewer {
    /// The plan.
    pub planned: Replanned,
    /// The share of its length that a leg was allowed to grow by, where that had to be more than
    /// usual.
    pub allowance: Option<f64>,
}

/// As [`replan`], with at most `most` inserted waypoints in all: corners are merged at a growing
/// cost in length until there are few enough. Every leg keeps its buffer all the same.
///
/// # Errors
/// [`ReplanError`], with [`ReplanError::TooManyWaypoints`] where there are still more.
pub fn replan_with_at_most(
    most: Option<usize>,
    input: &Input<'_>,
    options: &Options,
    cancelled: &AtomicBool,
    mut watch: impl FnMut(Progress<'_>),
) -> Result<Fewer, ReplanError> {
    let planned = replan(input, options, cancelled, &mut watch)?;
    let Some(most) = most.filter(|&most| planned.inserted.len() > most) else {
        return Ok(Fewer { planned, allowance: None });
    };
    let mut least = planned.inserted.len();
    let mut options = options.clone();
    for allowance in ALLOWANCES {
        options.settings.corner_allowance = allowance;
        let planned = replan(input, &options, cancelled, &mut watch)?;
        least = least.min(planned.inserted.len());
        if planned.inserted.len() <= most {
            return Ok(Fewer { planned, allowance: Some(allowance) });
        }
    }
    Err(ReplanError::TooManyWaypoints { most, least })
}
