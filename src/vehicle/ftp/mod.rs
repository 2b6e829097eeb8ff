//! MAVLink FTP, as far as a plan's file needs it: one question after the other with [`Client`],
//! reads several at a time. What is in the files is [`plan`]'s.

pub mod plan;

use std::collections::BTreeMap;
use std::time::Duration;

use tokio::time::{Instant, timeout_at};

use super::Vehicle;
use super::timing::RoundTrip;
use crate::link::message::FileTransfer;
use crate::link::{Inbox, LinkError};

/// Reads under way at once. ArduPilot keeps five questions waiting and drops what is more.
const WINDOW: usize = 4;

/// Why a file could not be had.
#[derive(Debug, Clone, thiserror::Error)]
pub enum FtpError {
    /// The link is gone.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// It does not answer.
    #[error("no answer to {what} for {:.1} s", waited.as_secs_f64())]
    NoAnswer {
        /// What was asked.
        what: &'static str,
        /// How long.
        waited: Duration,
    },
    /// It said no.
    #[error("{what} was refused: {}", error_name(*code))]
    Refused {
        /// What was asked.
        what: &'static str,
        /// The protocol's error number.
        code: u8,
    },
    /// The file is not what it should be.
    #[error("the file {what}")]
    Content {
        /// What is wrong with it.
        what: &'static str,
    },
}

fn error_name(code: u8) -> String {
    const NAMES: [&str; 11] = [
        "no error",
        "failed",
        "failed with an error of the system",
        "wrong size",
        "not an open file",
        "no session is free",
        "end of file",
        "unknown command",
        "the file exists",
        "the file is protected",
        "no such file",
    ];
    NAMES.get(usize::from(code)).map_or_else(|| format!("error {code}"), ToString::to_string)
}

/// Asks a vehicle for files.
struct Client<'a> {
    vehicle: &'a Vehicle,
    inbox: Inbox,
    seq: u16,
    round_trip: RoundTrip,
}

/// One read under way.
struct Read {
    length: usize,
    at: Instant,
    tries: u32,
}

impl<'a> Client<'a> {
    fn new(vehicle: &'a Vehicle) -> Result<Self, LinkError> {
        // Not the same numbers as the last client: the vehicle repeats its last answer to them.
        let seq = super::timing::random_u16();
        let inbox = vehicle.link.subscribe()?;
        Ok(Self { vehicle, inbox, seq, round_trip: RoundTrip::new() })
    }

    fn message(&self, session: u8, opcode: u8, data: &[u8]) -> FileTransfer {
        let mut bytes = [0; FileTransfer::MOST_DATA];
        for (to, from) in bytes.iter_mut().zip(data) {
            *to = *from;
        }
        FileTransfer {
            target: self.vehicle.node,
            seq: self.seq,
            session,
            opcode,
            size: u8::try_from(data.len()).unwrap_or(u8::MAX),
            req_opcode: 0,
            offset: 0,
            data: bytes,
        }
    }

    /// The next answer for us; `None` at the deadline.
    async fn next_before(&mut self, deadline: Instant) -> Result<Option<FileTransfer>, LinkError> {
        while let Ok(received) = timeout_at(deadline, self.inbox.next()).await {
            let received = received?;
            if received.from != self.vehicle.node {
                continue;
            }
            if let Some(answer) = received.decode::<FileTransfer>()
                && answer.target == self.vehicle.link.node()
                && matches!(answer.opcode, FileTransfer::ACK | FileTransfer::NAK)
            {
                return Ok(Some(answer));
            }
        }
        Ok(None)
    }

    /// Asks until there is an answer. A repeat has the same number, so that the vehicle can tell.
    async fn ask(
        &mut self,
        what: &'static str,
        session: u8,
        opcode: u8,
        data: &[u8],
    ) -> Result<FileTransfer, FtpError> {
        let timing = &self.vehicle.timing;
        self.seq = self.seq.wrapping_add(2);
        let question = self.message(session, opcode, data);
        let began = Instant::now();
        for tries in 0..=timing.retries {
            let asked = Instant::now();
            self.vehicle.link.send(&question).await?;
            // The first answer may want a file scanned.
            let wait = self.round_trip.item_wait(timing).max(timing.ftp);
            while let Some(answer) = self.next_before(asked + wait).await? {
                if answer.req_opcode != opcode || answer.seq != question.seq.wrapping_add(1) {
                    continue;
                }
                if tries == 0 {
                    self.round_trip.measured(asked.elapsed());
                }
                return match answer.opcode {
                    FileTransfer::ACK => Ok(answer),
                    _ => Err(FtpError::Refused {
                        what,
                        code: answer.bytes().first().copied().unwrap_or(0),
                    }),
                };
            }
        }
        Err(FtpError::NoAnswer { what, waited: began.elapsed() })
    }

    /// Reads `length` bytes of an open file from `offset` on.
    async fn read(
        &mut self,
        session: u8,
        offset: usize,
        length: usize,
        on_bytes: &mut (dyn FnMut(usize) + Send),
    ) -> Result<Vec<u8>, FtpError> {
        let mut held = vec![0; length];
        let mut missing = length;
        let mut next = 0;
        let mut under_way: BTreeMap<usize, Read> = BTreeMap::new();
        let mut due: Vec<(usize, Read)> = Vec::new();
        let began = Instant::now();
        while missing > 0 {
            while under_way.len() < WINDOW
                && let Some((at, read)) = due.pop().or_else(|| next_read(&mut next, length))
            {
                if read.tries > self.vehicle.timing.retries {
                    return Err(FtpError::NoAnswer { what: "a read", waited: began.elapsed() });
                }
                self.send_read(session, offset + at, read.length).await?;
                under_way.insert(at, Read { at: Instant::now(), ..read });
            }
            let wait = self.round_trip.item_wait(&self.vehicle.timing);
            let oldest = under_way.values().map(|read| read.at).min().unwrap_or_else(Instant::now);
            let Some(answer) = self.next_before(oldest + wait).await? else {
                let overdue: Vec<usize> = under_way
                    .iter()
                    .filter_map(|(&at, read)| (read.at.elapsed() >= wait).then_some(at))
                    .collect();
                for at in overdue {
                    if let Some(read) = under_way.remove(&at) {
                        due.push((at, Read { tries: read.tries + 1, ..read }));
                    }
                }
                continue;
            };
            if answer.req_opcode != FileTransfer::READ_FILE || answer.session != session {
                continue;
            }
            if answer.opcode == FileTransfer::NAK {
                let code = answer.bytes().first().copied().unwrap_or(0);
                return Err(FtpError::Refused { what: "a read", code });
            }
            let Some(at) =
                usize::try_from(answer.offset).ok().and_then(|at| at.checked_sub(offset))
            else {
                continue;
            };
            // An answer to a repeat that came after the first one.
            let Some(read) = under_way.remove(&at) else { continue };
            if read.tries == 0 {
                self.round_trip.measured(read.at.elapsed());
            }
            let bytes = answer.bytes();
            let count = bytes.len().min(read.length);
            if count == 0 {
                return Err(FtpError::Content { what: "is shorter than it says" });
            }
            held[at..at + count].copy_from_slice(&bytes[..count]);
            missing -= count;
            on_bytes(length - missing);
            if count < read.length {
                // The vehicle sends less at a time than fits.
                due.push((at + count, Read { length: read.length - count, tries: 0, ..read }));
            }
        }
        Ok(held)
    }

    async fn send_read(
        &mut self,
        session: u8,
        offset: usize,
        length: usize,
    ) -> Result<(), FtpError> {
        self.seq = self.seq.wrapping_add(2);
        let mut question = self.message(session, FileTransfer::READ_FILE, &[]);
        question.offset = u32::try_from(offset)
            .map_err(|_| FtpError::Content { what: "is longer than a file can be" })?;
        question.size = u8::try_from(length).unwrap_or(u8::MAX);
        Ok(self.vehicle.link.send(&question).await?)
    }
}

/// The next piece of a file that fits into one answer.
fn next_read(next: &mut usize, length: usize) -> Option<(usize, Read)> {
    let at = *next;
    let piece = FileTransfer::MOST_DATA.min(length.checked_sub(at)?);
    *next += piece;
    (piece > 0).then(|| (at, Read { length: piece, at: Instant::now(), tries: 0 }))
}
