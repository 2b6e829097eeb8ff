//! Downloading a plan (MAVLink mission protocol, "Download a Mission from the Vehicle").

use std::collections::BTreeMap;
use std::time::Duration;

use tokio::time::Instant;

use super::Vehicle;
use super::discovery::Autopilot;
use super::timing::Patience;
use super::transfer::{
    Awaited, BusyWait, Direction, Exchange, Heard, MOST_ITEMS, MissionResult, OnProgress, Progress,
    Refusal, Setback, TransferError,
};
use crate::link::message::{MissionAck, MissionRequestInt, MissionRequestList};
use crate::mission::{MissionItem, MissionType};

/// Requests that may be under way at once to an autopilot that answers in any order.
const WIDEST_WINDOW: usize = 16;

/// A plan exactly as the vehicle sent it.
#[derive(Debug, Clone, PartialEq)]
pub struct Downloaded {
    /// The items in the vehicle's own numbering: `items[k].seq == k`, and for a mission of
    /// ArduPilot item 0 is home.
    pub items: Vec<MissionItem>,
    /// The vehicle's fingerprint of the plan; 0 where it has none (ArduPilot).
    pub opaque_id: u32,
    /// How it came.
    pub source: Source,
}

impl Downloaded {
    /// What to tell the user where the vehicle offers files and a file could not be had.
    #[must_use]
    pub fn fell_back(&self) -> Option<String> {
        match &self.source {
            Source::MissionProtocol { ftp_failed: Some(reason) } => {
                Some(format!("read item by item, since MAVLink FTP failed for the {reason}"))
            }
            _ => None,
        }
    }
}

/// The way a plan came.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// Item by item.
    MissionProtocol {
        /// Why not as a file, where the vehicle offers files.
        ftp_failed: Option<String>,
    },
    /// As a file over MAVLink FTP, held against the vehicle's own checksum.
    File {
        /// That checksum.
        crc32: u32,
    },
}

impl Vehicle {
    /// Downloads one plan. Items are kept as they come, whatever their values.
    ///
    /// # Errors
    /// [`TransferError`].
    pub async fn download(
        &self,
        mission_type: MissionType,
        on_progress: OnProgress<'_>,
    ) -> Result<Downloaded, TransferError> {
        let _one_at_a_time = self.transfer.lock().await;
        let mut restarts = 0;
        loop {
            let mut exchange = Exchange::new(self, mission_type)?;
            let widest = if restarts == 0 { widest_window(self.autopilot) } else { 1 };
            match attempt(&mut exchange, widest, on_progress).await {
                Ok(plan) => {
                    tracing::debug!(plan = %mission_type, items = plan.items.len(), "downloaded");
                    return Ok(plan);
                }
                Err(Setback::Again(error))
                    if restarts < self.timing.restarts && self.is_alive() =>
                {
                    restarts += 1;
                    tracing::warn!(plan = %mission_type, %error, "download begun again");
                }
                Err(Setback::Again(error) | Setback::Final(error)) => return Err(error),
            }
        }
    }
}

async fn attempt(
    exchange: &mut Exchange<'_>,
    widest: usize,
    on_progress: OnProgress<'_>,
) -> Result<Downloaded, Setback> {
    let (count, opaque_id) = count(exchange).await?;
    let (direction, mission_type) = (Direction::Download, exchange.mission_type);
    let total = usize::from(count);
    let mut tell = |done| on_progress(Progress { direction, mission_type, done, total });
    tell(0);
    let items = items(exchange, count, widest, &mut tell).await?;
    // Without this the vehicle would keep the transfer open until its own time-out.
    let ack = MissionAck {
        target: exchange.target(),
        result: MissionResult::ACCEPTED.0,
        mission_type: exchange.wire_type(),
        opaque_id: 0,
    };
    exchange.send(&ack).await?;
    let source = Source::MissionProtocol { ftp_failed: None };
    Ok(Downloaded { items, opaque_id, source })
}

/// MISSION_REQUEST_LIST until there is a MISSION_COUNT.
async fn count(exchange: &mut Exchange<'_>) -> Result<(u16, u32), Setback> {
    let (target, mission_type) = (exchange.target(), exchange.wire_type());
    let mut patience = Patience::new();
    let mut busy = BusyWait::default();
    let mut unclear = None;
    loop {
        exchange.send(&MissionRequestList { target, mission_type }).await?;
        let asked = Instant::now();
        while let Some(heard) = exchange.next_before(asked + exchange.timing().request).await? {
            match heard {
                Heard::Count { count, opaque_id } => {
                    exchange.round_trip.measured(asked.elapsed());
                    if count > MOST_ITEMS {
                        let mission_type = exchange.mission_type;
                        return Err(TransferError::TooManyAnnounced { mission_type, count }.into());
                    }
                    return Ok((count, opaque_id));
                }
                Heard::Ack { result: MissionResult::DENIED, .. } => {
                    busy.pause(exchange).await?;
                    patience.renew();
                    break;
                }
                // A refusal, or PX4's answer to something earlier: it counts if nothing better comes.
                Heard::Ack { result: MissionResult::ERROR, .. } => {
                    unclear = Some(MissionResult::ERROR);
                }
                Heard::Ack { result, .. } if is_refusal(result) => {
                    if let Refusal::Meant(error) = exchange.refusal(result, None).await? {
                        return Err(error.into());
                    }
                }
                // What is left of an earlier transfer.
                Heard::Ack { .. } | Heard::Item(_) | Heard::Request(_) => {}
            }
        }
        if exchange.is_hopeless(&mut patience) {
            if let Some(result) = unclear
                && let Refusal::Meant(error) = exchange.refusal(result, None).await?
            {
                return Err(error.into());
            }
            // On a line that loses a third each way, seven questions in a row go unanswered once in a
            // hundred times: while the vehicle is heard that is no reason to give up.
            let error = exchange.no_answer(Awaited::Count, patience.waited());
            return Err(Setback::Again(error));
        }
    }
}

/// Whether a result can be meant for a download. The others end or accompany uploads.
fn is_refusal(result: MissionResult) -> bool {
    !matches!(
        result,
        MissionResult::ACCEPTED
            | MissionResult::INVALID_SEQUENCE
            | MissionResult::OPERATION_CANCELLED
    )
}

/// Answers to later requests after which a request counts as lost: fewer could be a line that
/// changes the order (TCP's rule, RFC 5681, section 3.2).
const OVERTAKEN: u32 = 3;

/// One request under way.
struct Asked {
    at: Instant,
    /// Its place among all requests of the transfer.
    turn: u64,
    again: bool,
    /// How many requests that were made later have been answered.
    overtaken: u32,
}

/// Requests under way, by item.
#[derive(Default)]
struct UnderWay {
    requests: BTreeMap<u16, Asked>,
    turns: u64,
}

impl UnderWay {
    async fn ask(
        &mut self,
        exchange: &Exchange<'_>,
        seq: u16,
        again: bool,
    ) -> Result<(), TransferError> {
        let (target, mission_type) = (exchange.target(), exchange.wire_type());
        exchange.send(&MissionRequestInt { seq, target, mission_type }).await?;
        self.turns += 1;
        let asked = Asked { at: Instant::now(), turn: self.turns, again, overtaken: 0 };
        self.requests.insert(seq, asked);
        Ok(())
    }

    /// When the oldest request was made.
    fn oldest(&self) -> Instant {
        self.requests.values().map(|asked| asked.at).min().unwrap_or_else(Instant::now)
    }

    /// Those that have waited long enough.
    fn overdue(&self, wait: Duration) -> Vec<u16> {
        let overdue = |(&seq, asked): (&u16, &Asked)| (asked.at.elapsed() >= wait).then_some(seq);
        self.requests.iter().filter_map(overdue).collect()
    }

    /// Those that are lost now that a later one was answered. The autopilot answers in the order of
    /// the requests: no need to wait for the end of their time.
    fn overtaken_by(&mut self, answered: &Asked) -> Vec<u16> {
        let mut lost = Vec::new();
        for (&seq, earlier) in &mut self.requests {
            if earlier.turn < answered.turn {
                earlier.overtaken += 1;
                if earlier.overtaken >= OVERTAKEN {
                    lost.push(seq);
                }
            }
        }
        lost
    }
}

/// PX4 keeps a cursor and ends the transfer over a request out of turn, so one request is under way
/// at a time unless the autopilot is known to answer in any order.
fn widest_window(autopilot: Autopilot) -> usize {
    if autopilot == Autopilot::ArduPilot { WIDEST_WINDOW } else { 1 }
}

/// MISSION_REQUEST_INT for each item, until all are there. The window grows up to `widest` with each
/// answer and is halved when the line falls quiet; a transfer that is begun again has one of one.
async fn items(
    exchange: &mut Exchange<'_>,
    count: u16,
    widest: usize,
    tell: &mut (dyn FnMut(usize) + Send),
) -> Result<Vec<MissionItem>, Setback> {
    let mut window = 1;
    let mut held: BTreeMap<u16, MissionItem> = BTreeMap::new();
    let mut under_way = UnderWay::default();
    let mut next = 0;
    let mut patience = Patience::new();
    while held.len() < usize::from(count) {
        while under_way.requests.len() < window && next < count {
            under_way.ask(exchange, next, false).await?;
            next += 1;
        }
        let wait = exchange.round_trip.item_wait(exchange.timing());
        match exchange.next_before(under_way.oldest() + wait).await? {
            Some(Heard::Item(item)) => {
                // Another seq than one that is wanted: a repeat, or somebody's mistake.
                let Some(request) = under_way.requests.remove(&item.seq) else { continue };
                if !request.again {
                    exchange.round_trip.measured(request.at.elapsed());
                    window = (window + 1).min(widest);
                }
                held.insert(item.seq, item);
                patience.renew();
                tell(held.len());
                for seq in under_way.overtaken_by(&request) {
                    under_way.ask(exchange, seq, true).await?;
                }
            }
            // PX4 lost the thread, or the plan is shorter than was announced.
            Some(Heard::Ack { result, .. })
                if is_refusal(result) || result == MissionResult::INVALID_SEQUENCE =>
            {
                if let Refusal::Meant(error) = exchange.refusal(result, None).await? {
                    return Err(Setback::Again(error));
                }
            }
            Some(_) => {}
            None => {
                window = (window / 2).max(1);
                let waiting = under_way.requests.keys().next().copied().unwrap_or(next);
                if exchange.is_hopeless(&mut patience) {
                    let error = exchange.no_answer(Awaited::Item(waiting), patience.waited());
                    return Err(Setback::Again(error));
                }
                for seq in under_way.overdue(wait) {
                    under_way.ask(exchange, seq, true).await?;
                }
            }
        }
    }
    Ok(held.into_values().collect())
}
