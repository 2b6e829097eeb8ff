//! The decision between calling a piece of work off and writing to the vehicle: until the first
//! byte is written it can be called off; from then on it goes to its end, since a half-written
//! mission is worse than an old one.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use crate::stop::Stop;

/// Decides between "called off" and "writing": the one that is first wins.
#[derive(Default)]
pub(super) struct Gate {
    state: Mutex<GateState>,
    stop: Stop,
}

#[derive(Default, Clone, Copy, PartialEq)]
enum GateState {
    #[default]
    Open,
    Cancelled,
    Writing,
}

impl Gate {
    /// Calls it off, unless it is writing. `true` where nothing will be written.
    pub(super) fn cancel(&self) -> bool {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if *state != GateState::Writing {
            *state = GateState::Cancelled;
            self.stop.cancel();
        }
        *state == GateState::Cancelled
    }

    /// From now on it cannot be called off. `false` where it already has been.
    pub(super) fn begin_writing(&self) -> bool {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if *state == GateState::Open {
            *state = GateState::Writing;
        }
        *state == GateState::Writing
    }

    /// After a settlement, before anything new is written.
    pub(super) fn end_writing(&self) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if *state == GateState::Writing {
            *state = GateState::Open;
        }
    }

    /// What the planner looks at.
    pub(super) fn stop(&self) -> Stop {
        self.stop.clone()
    }

    pub(super) fn is_cancelled(&self) -> bool {
        self.stop.is_stopped()
    }

    /// Waits until it is called off.
    pub(super) async fn cancelled(&self) {
        /// The rare case is what waits here.
        const LOOK: Duration = Duration::from_millis(20);
        while !self.is_cancelled() {
            tokio::time::sleep(LOOK).await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_being_written_is_not_called_off_and_what_was_called_off_is_not_written() {
        let gate = Gate::default();
        assert!(gate.begin_writing());
        assert!(!gate.cancel() && !gate.is_cancelled());
        gate.end_writing();
        assert!(gate.cancel() && gate.is_cancelled());
        assert!(!gate.begin_writing());
    }
}
