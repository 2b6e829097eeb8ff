//! Work on the network that ends without its outcome: it failed, or is not waited for any longer.

use std::time::Duration;

use super::error::IbmError;
use crate::qaoa::qpu::QpuError;
use crate::stop::{Stop, Stopped};

/// How often the wish to stop is looked at.
const STOP_CHECK: Duration = Duration::from_millis(50);

/// Why work on the network ended without its outcome.
pub(super) enum Interrupted {
    Failed(IbmError),
    Stopped(Stopped, Duration),
}

impl From<IbmError> for Interrupted {
    fn from(error: IbmError) -> Self {
        Self::Failed(error)
    }
}

impl Interrupted {
    /// Says which job was cancelled.
    pub(super) fn with_job(self, job: Option<String>) -> Self {
        match (self, job) {
            (Self::Stopped(Stopped::DeadlinePassed, after), Some(job)) => {
                Self::Failed(IbmError::Deadline { after, job: Some(job) })
            }
            (interrupted, _) => interrupted,
        }
    }
}

impl From<Interrupted> for QpuError {
    fn from(interrupted: Interrupted) -> Self {
        match interrupted {
            Interrupted::Failed(error) => {
                let late = matches!(error, IbmError::Deadline { .. });
                Self { reason: error.to_string(), stopped: late.then_some(Stopped::DeadlinePassed) }
            }
            Interrupted::Stopped(Stopped::Cancelled, _) => {
                Self { reason: IbmError::CalledOff.to_string(), stopped: Some(Stopped::Cancelled) }
            }
            Interrupted::Stopped(stopped, after) => Self {
                reason: IbmError::Deadline { after, job: None }.to_string(),
                stopped: Some(stopped),
            },
        }
    }
}

/// Ends when `stop` says so.
pub(super) async fn stopped(stop: &Stop) -> Stopped {
    loop {
        if let Err(stopped) = stop.check() {
            return stopped;
        }
        let pause = stop.remaining().map_or(STOP_CHECK, |left| left.min(STOP_CHECK));
        tokio::time::sleep(pause.max(Duration::from_millis(1))).await;
    }
}
