//! The vehicle at the other end of a link: finding it, knowing its state, and moving missions,
//! fences and rally points without ever losing one.
//!
//! [`discovery`] finds it, [`identity`] tells it from others, [`state`] follows it, [`parameter`]
//! reads its parameters, [`download`], [`upload`] and [`clear`] speak the mission protocol over
//! [`transfer`], [`ftp`] reads plans as files, [`readback`] compares what was sent with what is held,
//! [`replace`] is the safe sequence of it all, [`numbering`] turns the vehicle's lists into
//! missions and back.

pub mod clear;
pub mod discovery;
pub mod download;
pub mod ftp;
pub mod identity;
pub mod numbering;
pub mod parameter;
pub mod readback;
pub mod replace;
pub mod rules;
pub mod state;
mod text;
pub mod timing;
pub mod transfer;
pub mod upload;

use std::collections::BTreeSet;
use std::time::Duration;

use tokio::sync::{Mutex, watch};
use tokio::task::JoinHandle;
use tokio::time::timeout;

pub use discovery::{Autopilot, Capabilities, DiscoveryError, Search, find};
pub use ftp::plan::Fingerprint;
pub use identity::{Uid, VehicleId};
pub use parameter::{ParameterError, ParameterValue};
pub use state::{Position, VehicleState};
pub use timing::Timing;
pub use transfer::{MissionResult, Progress, TransferError};

use crate::link::message::ParamName;
use crate::link::{Link, LinkError, Node};

/// One vehicle on a link. Transfers take `&self` and run one at a time.
pub struct Vehicle {
    link: Link,
    node: Node,
    autopilot: Autopilot,
    capabilities: Option<Capabilities>,
    uid: Option<Uid>,
    state: watch::Receiver<VehicleState>,
    monitor: JoinHandle<LinkError>,
    timing: Timing,
    /// Parameters that it was found not to have.
    lacked: std::sync::Mutex<BTreeSet<ParamName>>,
    /// Held by the transfer that runs.
    transfer: Mutex<()>,
}

impl Vehicle {
    /// The autopilot's system and component.
    #[must_use]
    pub fn node(&self) -> Node {
        self.node
    }

    /// Which flight software it runs.
    #[must_use]
    pub fn autopilot(&self) -> Autopilot {
        self.autopilot
    }

    /// Which vehicle it is, as far as it has told.
    #[must_use]
    pub fn id(&self) -> VehicleId {
        VehicleId { system: self.node.system, autopilot: self.autopilot, uid: self.uid }
    }

    /// What it says it can do, where it says so.
    #[must_use]
    pub fn capabilities(&self) -> Option<Capabilities> {
        self.capabilities
    }

    /// Its state as last heard.
    #[must_use]
    pub fn state(&self) -> VehicleState {
        self.state.borrow().clone()
    }

    /// Its state, to be watched.
    #[must_use]
    pub fn watch(&self) -> watch::Receiver<VehicleState> {
        self.state.clone()
    }

    /// Waits until the state satisfies `wanted`, and returns it; `None` after `patience`.
    pub async fn wait_for(
        &self,
        patience: Duration,
        wanted: impl FnMut(&VehicleState) -> bool,
    ) -> Option<VehicleState> {
        let mut state = self.state.clone();
        let waited = timeout(patience, state.wait_for(wanted)).await;
        waited.ok()?.ok().map(|state| state.clone())
    }

    /// For how long nothing at all has come from it.
    #[must_use]
    pub fn silent_for(&self) -> Duration {
        self.state.borrow().heard_at.elapsed()
    }

    /// Whether it was heard lately.
    #[must_use]
    pub fn is_alive(&self) -> bool {
        self.silent_for() <= self.timing.silence
    }

    /// Stops following the vehicle. The link stays open.
    pub async fn close(self) {
        self.monitor.abort();
        // An abort is the one way this ends, and what it returns says nothing more.
        let _ = self.monitor.await;
    }
}

#[cfg(test)]
mod tests;
