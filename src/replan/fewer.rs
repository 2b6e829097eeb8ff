//! Planning with a limit on the number of waypoints, for a vehicle that has not room for many.

use super::plan::{Progress, Replanned, replan_as_set};
use super::reason::ReplanError;
use super::{Input, Options};
use crate::qaoa::qpu::Qpu;
use crate::stop::Stop;

/// What saved waypoints may cost together, as shares of a leg's length: tried one after the other
/// where the settings' own gives too many.
const ALLOWANCES: [f64; 4] = [0.01, 0.05, 0.2, 1.0];

/// Plans a mission: every leg that is not clear is re-planned, the waypoints are spliced in, and
/// the new mission is judged from its integers. `stop` calls it off; the deadline of the options
/// counts from now.
///
/// Where the options limit the inserted waypoints, corners are merged at a growing cost in length
/// until there are few enough, and a warning says so. Every leg keeps its buffer all the same.
///
/// # Errors
/// [`ReplanError`] with the reason where there is no safe mission, or none with so few waypoints.
pub fn replan(
    input: &Input<'_>,
    options: &Options,
    stop: &Stop,
    watch: impl FnMut(Progress<'_>),
) -> Result<Replanned, ReplanError> {
    replan_with(input, options, None, stop, watch)
}

/// [`replan`] with the QAOA rounds on a QPU, if there is one.
///
/// # Errors
/// As [`replan`].
pub fn replan_with(
    input: &Input<'_>,
    options: &Options,
    mut qpu: Option<&mut dyn Qpu>,
    stop: &Stop,
    mut watch: impl FnMut(Progress<'_>),
) -> Result<Replanned, ReplanError> {
    let stop = options.deadline.map_or_else(|| stop.clone(), |time| stop.within(time));
    let planned = replan_as_set(input, options, again(&mut qpu), &stop, &mut watch)?;
    let inserted = planned.inserted.len();
    let Some(most) = options.most_waypoints.filter(|&most| inserted > most) else {
        return Ok(planned);
    };
    let mut least = inserted;
    let mut options = options.clone();
    for allowance in ALLOWANCES {
        options.settings.corner_allowance = allowance;
        let mut planned = replan_as_set(input, &options, again(&mut qpu), &stop, &mut watch)?;
        least = least.min(planned.inserted.len());
        if planned.inserted.len() <= most {
            planned.before.warnings.push(format!(
                "corners were merged, {} waypoints instead of {inserted}: each re-planned leg may \
                 be up to {} % longer for it",
                planned.inserted.len(),
                allowance * 100.0
            ));
            return Ok(planned);
        }
    }
    Err(ReplanError::TooManyWaypoints { most, least })
}

/// A reborrow that ends with one attempt.
fn again<'a>(qpu: &'a mut Option<&mut dyn Qpu>) -> Option<&'a mut dyn Qpu> {
    match qpu {
        Some(qpu) => Some(&mut **qpu),
        None => None,
    }
}
