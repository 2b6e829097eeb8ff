//! Uploading a plan (MAVLink mission protocol, "Upload a Mission to the Vehicle").
//!
//! An acknowledged upload is not yet a proven one: the caller downloads and compares. That is
//! also what settles an upload whose last acknowledgement was lost.

use std::time::Duration;

use tokio::time::Instant;

use super::discovery::Autopilot;
use super::numbering::for_whole_centimetres;
use super::timing::Patience;
use super::transfer::{
    Awaited, BusyWait, Direction, Exchange, Heard, MOST_ITEMS, MissionResult, OnProgress, Progress,
    Refusal, Setback, TransferError,
};
use super::{Vehicle, VehicleState};
use crate::link::message::{MissionAck, MissionCount, MissionItemInt};
use crate::mission::{MissionItem, MissionType};

/// How an upload ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Uploaded {
    /// The vehicle accepted it.
    Acknowledged,
    /// All items went out, but whether the vehicle took them is not known.
    Unconfirmed,
}

impl Vehicle {
    /// Uploads one plan, in the vehicle's own numbering. An empty list clears the plan.
    ///
    /// Items are numbered by their place in the list. This replaces what the vehicle holds, and
    /// ArduPilot does so item by item: save the old plan first.
    ///
    /// # Errors
    /// [`TransferError`]. The vehicle may then hold the old plan, a part of the new one, or both.
    pub async fn upload(
        &self,
        mission_type: MissionType,
        items: &[MissionItem],
        on_progress: OnProgress<'_>,
    ) -> Result<Uploaded, TransferError> {
        let mut restarts = 0;
        loop {
            match self.attempt(mission_type, items, &|_| true, BusyHabit::Wait, on_progress).await {
                Ok(uploaded) => return Ok(uploaded),
                Err(Setback::Again(error))
                    if restarts < self.timing.restarts && self.is_alive() =>
                {
                    restarts += 1;
                    tracing::warn!(plan = %mission_type, %error, "upload begun again");
                    // What is under way of the old attempt is no answer to the new one.
                    tokio::time::sleep(self.timing.stragglers).await;
                }
                Err(Setback::Again(error) | Setback::Final(error)) => return Err(error),
            }
        }
    }

    /// One attempt at an upload, called off when `goes_on` says no to the state in which the next
    /// item would be sent. What to do about [`Setback::Again`] is the caller's: by the time of the
    /// next attempt, somebody else may have uploaded another plan.
    pub(super) async fn attempt(
        &self,
        mission_type: MissionType,
        items: &[MissionItem],
        goes_on: GoesOn<'_>,
        busy_habit: BusyHabit,
        on_progress: OnProgress<'_>,
    ) -> Result<Uploaded, Setback> {
        let count = u16::try_from(items.len()).ok().filter(|&count| count <= MOST_ITEMS);
        let count =
            count.ok_or(TransferError::TooManyToSend { mission_type, count: items.len() })?;
        let _one_at_a_time = self.transfer.lock().await;
        let mut exchange = Exchange::new(self, mission_type)?;
        let mut upload = Upload {
            exchange: &mut exchange,
            items,
            goes_on,
            busy_habit,
            ends_told: 0,
            count,
            last_sent: None,
            tries: 0,
            is_unasked: false,
        };
        let uploaded = upload.attempt(on_progress).await?;
        tracing::debug!(plan = %mission_type, items = count, ?uploaded, "uploaded");
        Ok(uploaded)
    }
}

/// How often the end of a download is told again to a busy PX4.
const ENDS: u32 = 4;

/// What to do when the vehicle is busy with somebody else's upload.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BusyHabit {
    /// Wait and offer again.
    Wait,
    /// End the attempt with [`TransferError::Busy`]: the plan that is there afterwards will be
    /// another one.
    End,
}

/// Decides, from the vehicle's state, whether an upload goes on.
pub(super) type GoesOn<'a> = &'a (dyn Fn(&VehicleState) -> bool + Sync);

/// One attempt: offers the count, then hands out what is asked for.
struct Upload<'a, 'v> {
    exchange: &'a mut Exchange<'v>,
    items: &'a [MissionItem],
    goes_on: GoesOn<'a>,
    busy_habit: BusyHabit,
    /// How often the end of the last download was told again.
    ends_told: u32,
    count: u16,
    /// The furthest item that the vehicle asked for and was sent.
    last_sent: Option<u16>,
    /// How often that one was sent.
    tries: u32,
    /// Whether it was last sent because the line was quiet, not because it was asked for.
    is_unasked: bool,
}

/// The number in ArduPilot's "Only 650 items are supported".
fn capacity_in(text: &str) -> Option<usize> {
    text.strip_prefix("Only ")?.strip_suffix(" items are supported")?.parse().ok()
}

/// What follows an acknowledgement.
enum Next {
    Done(Uploaded),
    Send(u16),
    Offer,
    Wait,
}

impl Upload<'_, '_> {
    async fn attempt(&mut self, on_progress: OnProgress<'_>) -> Result<Uploaded, Setback> {
        let timing = self.exchange.timing();
        let (direction, mission_type) = (Direction::Upload, self.exchange.mission_type);
        let total = usize::from(self.count);
        let mut tell = |done| on_progress(Progress { direction, mission_type, done, total });
        tell(0);
        self.offer().await?;
        let mut sent_at = Instant::now();
        let mut deadline = sent_at + timing.request;
        let mut patience = Patience::new();
        let mut busy = BusyWait::default();
        loop {
            match self.exchange.next_before(deadline).await? {
                Some(Heard::Request(seq)) => {
                    if seq >= self.count {
                        continue;
                    }
                    if self.last_sent.is_none_or(|last| seq > last) {
                        if self.tries <= 1 {
                            self.exchange.round_trip.measured(sent_at.elapsed());
                        }
                        patience.renew();
                        tell(usize::from(seq));
                    }
                    self.send_item(seq).await?;
                    self.is_unasked = false;
                }
                Some(Heard::Ack { result, .. }) => match self.judge(result, &mut busy).await? {
                    Next::Done(uploaded) => {
                        tell(total);
                        return Ok(uploaded);
                    }
                    Next::Send(seq) => {
                        self.send_item(seq).await?;
                        self.is_unasked = false;
                    }
                    Next::Offer => self.offer().await?,
                    Next::Wait => continue,
                },
                Some(Heard::Count { .. } | Heard::Item(_)) => continue,
                None => {
                    if self.exchange.is_hopeless(&mut patience) {
                        return self.silence(&patience);
                    }
                    self.repeat().await?;
                }
            }
            sent_at = Instant::now();
            let wait = match self.last_sent {
                None => timing.request,
                Some(_) => self.exchange.round_trip.item_wait(timing),
            };
            deadline = sent_at + wait;
        }
    }

    fn all_sent(&self) -> bool {
        self.last_sent.map_or(0, |last| last + 1) == self.count
    }

    async fn offer(&self) -> Result<(), TransferError> {
        let message = MissionCount {
            count: self.count,
            target: self.exchange.target(),
            mission_type: self.exchange.wire_type(),
            opaque_id: 0,
        };
        self.exchange.send(&message).await
    }

    async fn send_item(&mut self, seq: u16) -> Result<(), TransferError> {
        let Some(&item) = self.items.get(usize::from(seq)) else { return Ok(()) };
        if !(self.goes_on)(&self.exchange.vehicle.state()) {
            self.acknowledge(MissionResult::OPERATION_CANCELLED).await?;
            return Err(TransferError::CalledOff { mission_type: self.exchange.mission_type });
        }
        let message = MissionItemInt {
            item: MissionItem {
                seq,
                z: self.altitude_of(&item),
                current: self.mark_of(&item),
                ..item
            },
            target: self.exchange.target(),
            mission_type: self.exchange.wire_type(),
        };
        self.exchange.send(&message).await?;
        if self.last_sent.is_none_or(|last| seq > last) {
            self.last_sent = Some(seq);
            self.tries = 1;
        } else {
            self.tries += 1;
        }
        Ok(())
    }

    async fn acknowledge(&self, result: MissionResult) -> Result<(), TransferError> {
        let ack = MissionAck {
            target: self.exchange.target(),
            result: result.0,
            mission_type: self.exchange.wire_type(),
            opaque_id: 0,
        };
        self.exchange.send(&ack).await
    }

    /// Whether an item is marked as the current one. ArduPilot takes other marks than 0 for orders
    /// to fly at once, whatever they stood for in what was downloaded.
    fn mark_of(&self, item: &MissionItem) -> u8 {
        match self.exchange.vehicle.autopilot {
            Autopilot::ArduPilot => 0,
            Autopilot::Px4 | Autopilot::Other(_) => u8::from(item.current == 1),
        }
    }

    /// The altitude to send for an item.
    fn altitude_of(&self, item: &MissionItem) -> f32 {
        match (self.exchange.vehicle.autopilot, self.exchange.mission_type) {
            (Autopilot::ArduPilot, MissionType::Mission) => for_whole_centimetres(item.z),
            _ => item.z,
        }
    }

    /// Nothing came: either our message or the answer was lost. Sends again what was sent last,
    /// never what was not asked for.
    async fn repeat(&mut self) -> Result<(), TransferError> {
        match self.last_sent {
            None => self.offer().await,
            Some(seq) => {
                self.is_unasked = true;
                self.send_item(seq).await
            }
        }
    }

    /// ArduPilot says "invalid sequence" of an item that it has already, and carries on. That is
    /// noise where the line repeated a frame; where quavd has just repeated the item because the
    /// line was quiet, it tells that the request for the next one was lost, which ArduPilot would
    /// repeat after a second only.
    fn request_was_lost(&self) -> Option<u16> {
        let next = self.last_sent? + 1;
        let ardupilot = self.exchange.vehicle.autopilot == Autopilot::ArduPilot;
        (ardupilot && self.is_unasked && next < self.count).then_some(next)
    }

    /// What to do about an acknowledgement.
    async fn judge(&mut self, result: MissionResult, busy: &mut BusyWait) -> Result<Next, Setback> {
        match result {
            MissionResult::ACCEPTED if self.all_sent() => Ok(Next::Done(Uploaded::Acknowledged)),
            MissionResult::INVALID_SEQUENCE => {
                Ok(self.request_was_lost().map_or(Next::Wait, Next::Send))
            }
            // Left of an earlier transfer: before the end nothing is accepted, before the first
            // request there is nothing to cancel, and after it the upload is ours.
            MissionResult::ACCEPTED => Ok(Next::Wait),
            MissionResult::OPERATION_CANCELLED if self.last_sent.is_none() => Ok(Next::Wait),
            MissionResult::DENIED if self.last_sent.is_some() => Ok(Next::Wait),
            result if self.last_sent.is_none() && self.means_busy(result) => {
                // PX4 is busy with our own last download where the end of that was lost.
                if self.exchange.vehicle.autopilot == Autopilot::Px4 && self.ends_told < ENDS {
                    self.ends_told += 1;
                    self.acknowledge(MissionResult::ACCEPTED).await?;
                    return Ok(Next::Offer);
                }
                if self.busy_habit == BusyHabit::End {
                    let mission_type = self.exchange.mission_type;
                    let busy = TransferError::Busy { mission_type, waited: Duration::ZERO };
                    return Err(Setback::Again(busy));
                }
                busy.pause(self.exchange).await?;
                Ok(Next::Offer)
            }
            result => match self.exchange.refusal(result, self.last_sent).await? {
                Refusal::Accepted if self.all_sent() => Ok(Next::Done(Uploaded::Acknowledged)),
                Refusal::Accepted => Ok(Next::Wait),
                Refusal::Asked(seq) if seq < self.count => Ok(Next::Send(seq)),
                Refusal::Asked(_) => Ok(Next::Wait),
                Refusal::Meant(error) => self.refused(result, error),
            },
        }
    }

    fn refused(&self, result: MissionResult, error: TransferError) -> Result<Next, Setback> {
        match result {
            // Perhaps it only says that it no longer waits for the repeated last item.
            MissionResult::ERROR if self.all_sent() && self.tries > 1 => {
                Ok(Next::Done(Uploaded::Unconfirmed))
            }
            // It knows of no upload any more: it has restarted, or given up.
            MissionResult::ERROR if self.is_unasked => Err(Setback::Again(error)),
            MissionResult::OPERATION_CANCELLED => Err(Setback::Again(error)),
            MissionResult::NO_SPACE => Err(Setback::Final(self.no_space(error))),
            _ => Err(Setback::Final(error)),
        }
    }

    /// "No space" with its numbers.
    fn no_space(&self, error: TransferError) -> TransferError {
        let TransferError::Refused { mission_type, texts, .. } = error else { return error };
        let most = texts.iter().find_map(|text| capacity_in(text));
        TransferError::NoSpace { mission_type, count: self.items.len(), most, texts }
    }

    /// Whether a refusal of the count only says "not now". PX4 has no better word than ERROR.
    fn means_busy(&self, result: MissionResult) -> bool {
        let px4 = self.exchange.vehicle.autopilot == Autopilot::Px4;
        result == MissionResult::DENIED || (px4 && result == MissionResult::ERROR)
    }

    fn silence(&self, patience: &Patience) -> Result<Uploaded, Setback> {
        let awaited = match self.last_sent {
            None => Awaited::Request(0),
            Some(_) if self.all_sent() => {
                // The end may have been reached; a vehicle that is gone shows in the read-back.
                return Ok(Uploaded::Unconfirmed);
            }
            Some(last) => Awaited::Request(last + 1),
        };
        Err(Setback::Again(self.exchange.no_answer(awaited, patience.waited())))
    }
}
