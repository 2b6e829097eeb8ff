//! Clearing a plan (MAVLink mission protocol, "Clear Missions").

use tokio::time::Instant;

use super::Vehicle;
use super::timing::Patience;
use super::transfer::{Awaited, BusyWait, Exchange, Heard, MissionResult, Refusal, TransferError};
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
        let mut restarts = 0;
        loop {
            exchange.send(&clear).await?;
            let deadline = Instant::now() + self.timing.request;
            while let Some(heard) = exchange.next_before(deadline).await? {
                match heard {
                    Heard::Ack { result: MissionResult::ACCEPTED, .. } => return Ok(()),
                    Heard::Ack { result: MissionResult::DENIED, .. } => {
                        busy.pause(&exchange).await?;
                        patience.renew();
                        break;
                    }
                    Heard::Ack { result, .. } => match exchange.refusal(result, None).await? {
                        Refusal::Meant(error) => return Err(error),
                        Refusal::Accepted => return Ok(()),
                        Refusal::Asked(_) => {}
                    },
                    // What is left of an earlier transfer.
                    Heard::Count { .. } | Heard::Item(_) | Heard::Request(_) => {}
                }
            }
            if exchange.is_hopeless(&mut patience) {
                // Clearing twice is clearing once: while the vehicle is heard, it is asked again.
                if restarts < self.timing.restarts && self.is_alive() {
                    restarts += 1;
                    patience.renew();
                    continue;
                }
                return Err(exchange.no_answer(Awaited::Acknowledgement, patience.waited()));
            }
        }
    }
}
