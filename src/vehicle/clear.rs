//! Clearing a plan (MAVLink mission protocol, "Clear Missions").

use tokio::time::Instant;

use super::Vehicle;
use super::timing::Patience;
use super::transfer::{Awaited, BusyWait, Exchange, Heard, MissionResult, TransferError};
use crate::link::message::MissionClearAll;
use crate::mission::MissionType;

impl Vehicle {
    /// Clears one plan with MISSION_CLEAR_ALL, which ArduPilot refuses while it flies the mission.
    ///
    /// # Errors
    /// [`TransferError`].
    pub async fn clear(&self, mission_type: MissionType) -> Result<(), TransferError> {
        let _one_at_a_time = self.transfer.lock().await;
        let mut exchange = Exchange::new(self, mission_type)?;
        let clear =
            MissionClearAll { target: exchange.target(), mission_type: exchange.wire_type() };
        let mut patience = Patience::new();
        let mut busy = BusyWait::default();
        loop {
            exchange.send(&clear).await?;
            let deadline = Instant::now() + self.timing.request;
            match exchange.next_before(deadline).await? {
                Some(Heard::Ack { result: MissionResult::ACCEPTED, .. }) => return Ok(()),
                Some(Heard::Ack { result: MissionResult::DENIED, .. }) => {
                    busy.pause(&exchange).await?;
                    patience.renew();
                }
                Some(Heard::Ack { result, .. }) => match exchange.refusal(result, None).await? {
                    Some(error) => return Err(error),
                    None => return Ok(()),
                },
                // What is left of an earlier transfer.
                Some(_) => {}
                None => {
                    if patience.is_exhausted(&self.timing) {
                        let waited = patience.waited();
                        return Err(exchange.no_answer(Awaited::Acknowledgement, waited));
                    }
                }
            }
        }
    }
}
