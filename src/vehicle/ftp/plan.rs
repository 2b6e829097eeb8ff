//! Plans as files: ArduPilot shows its mission, fence and rally points as `@MISSION/mission.dat`,
//! `fence.dat` and `rally.dat`: a header of five little-endian u16 (magic, type, options, first
//! item, count), then the items as MISSION_ITEM_INT payloads of 38 bytes each. The checksum of a
//! file is a fingerprint of the plan in it.

use mavlink::{MavlinkVersion, MessageData};

use super::{Client, FtpError};
use crate::link::LinkError;
use crate::link::message::{FileTransfer, MissionItemInt};
use crate::mission::{MissionItem, MissionType};
use crate::vehicle::Vehicle;
use crate::vehicle::discovery::{Autopilot, Capabilities};
use crate::vehicle::download::{Downloaded, Source};
use crate::vehicle::transfer::{Direction, MOST_ITEMS, OnProgress, Progress, TransferError};

/// A plan file begins with this.
const MAGIC: u16 = 0x763d;
/// Bytes of the header.
const HEADER: usize = 10;
/// Bytes of an item.
const ITEM: usize = MissionItemInt::ENCODED_LEN;

/// Tells one plan from another, of one vehicle and one kind. Equal fingerprints mean that nothing
/// has changed; fingerprints of two kinds are never equal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Fingerprint {
    /// The vehicle's `opaque_id` (PX4).
    OpaqueId(u32),
    /// The checksum of its plan file (ArduPilot). Contains home, so setting home changes it.
    Crc32(u32),
}

impl Vehicle {
    /// The fingerprint of a plan, where the vehicle has such a thing: nothing is downloaded. An
    /// opaque id is as old as the last MISSION_CURRENT, a second at most.
    ///
    /// # Errors
    /// [`LinkError`].
    pub async fn fingerprint(
        &self,
        mission_type: MissionType,
    ) -> Result<Option<Fingerprint>, LinkError> {
        let current = self.state.borrow().mission_current;
        let id = current.map_or(0, |current| current.plan_ids[mission_type as usize]);
        if id != 0 {
            return Ok(Some(Fingerprint::OpaqueId(id)));
        }
        if !self.serves_files() {
            return Ok(None);
        }
        let _one_at_a_time = self.transfer.lock().await;
        let mut client = Client::new(self)?;
        match client.crc32(0, mission_type).await {
            Ok((session, crc32)) => {
                client.terminate(session).await?;
                Ok(Some(Fingerprint::Crc32(crc32)))
            }
            Err(FtpError::Link(error)) => Err(error),
            Err(error) => {
                tracing::warn!(plan = %mission_type, %error, "no checksum over MAVLink FTP");
                Ok(None)
            }
        }
    }

    /// Reads one plan the fastest way there is: as a file where the vehicle offers that, else (and
    /// where that fails) item by item. The two give the same items; a file's are held against the
    /// vehicle's own checksum.
    ///
    /// # Errors
    /// [`TransferError`] of the mission protocol.
    pub async fn read_plan(
        &self,
        mission_type: MissionType,
        on_progress: OnProgress<'_>,
    ) -> Result<Downloaded, TransferError> {
        if !self.serves_files() {
            return self.download(mission_type, on_progress).await;
        }
        let error = match self.download_file(mission_type, on_progress).await {
            Ok(plan) => return Ok(plan),
            Err(FtpError::Link(error)) => return Err(error.into()),
            Err(error) => error,
        };
        tracing::warn!(plan = %mission_type, %error, "no plan over MAVLink FTP; item by item instead");
        let plan = self.download(mission_type, on_progress).await?;
        let ftp_failed = Some(format!("{mission_type}: {error}"));
        Ok(Downloaded { source: Source::MissionProtocol { ftp_failed }, ..plan })
    }

    /// Whether the vehicle offers plans as files.
    #[must_use]
    pub fn serves_files(&self) -> bool {
        self.autopilot == Autopilot::ArduPilot
            && self.capabilities.is_some_and(Capabilities::has_ftp)
    }

    /// Downloads one plan as a file.
    ///
    /// # Errors
    /// [`FtpError`].
    pub async fn download_file(
        &self,
        mission_type: MissionType,
        on_progress: OnProgress<'_>,
    ) -> Result<Downloaded, FtpError> {
        let _one_at_a_time = self.transfer.lock().await;
        let mut client = Client::new(self)?;
        let path = path(mission_type);
        let opened = client.ask("opening", 0, FileTransfer::OPEN_FILE_RO, path.as_bytes()).await?;
        let outcome = client.plan(opened.session, mission_type, on_progress).await;
        client.terminate(opened.session).await?;
        outcome
    }
}

impl Client<'_> {
    /// The plan in an open file.
    async fn plan(
        &mut self,
        session: u8,
        mission_type: MissionType,
        on_progress: OnProgress<'_>,
    ) -> Result<Downloaded, FtpError> {
        let header = self.read(session, 0, HEADER, &mut |_| {}).await?;
        let count = count_in(&header, mission_type)?;
        let direction = Direction::Download;
        let mut tell = |done| on_progress(Progress { direction, mission_type, done, total: count });
        tell(0);
        let mut on_bytes = |bytes: usize| tell(bytes / ITEM);
        let body = self.read(session, HEADER, count * ITEM, &mut on_bytes).await?;
        let (_, theirs) = self.crc32(session, mission_type).await?;
        let crc32 = checksum(&[&header, &body]);
        if crc32 != theirs {
            // Somebody changed it meanwhile, or more items follow than it says.
            return Err(FtpError::Content { what: "is not what the vehicle's checksum says" });
        }
        let source = Source::File { crc32 };
        Ok(Downloaded { items: items_in(&body), opaque_id: 0, source })
    }

    /// The vehicle's own checksum of a plan file, and the session that it used for it.
    async fn crc32(
        &mut self,
        session: u8,
        mission_type: MissionType,
    ) -> Result<(u8, u32), FtpError> {
        let path = path(mission_type);
        let opcode = FileTransfer::CALC_FILE_CRC32;
        let answer = self.ask("a checksum", session, opcode, path.as_bytes()).await?;
        let bytes = <[u8; 4]>::try_from(answer.bytes())
            .map_err(|_| FtpError::Content { what: "has a checksum of another size" })?;
        Ok((answer.session, u32::from_le_bytes(bytes)))
    }

    /// Gives a session back. The vehicle does so itself after some seconds, so one try will do.
    async fn terminate(&mut self, session: u8) -> Result<(), LinkError> {
        self.seq = self.seq.wrapping_add(2);
        let message = self.message(session, FileTransfer::TERMINATE_SESSION, &[]);
        self.vehicle.link.send(&message).await
    }
}

fn path(mission_type: MissionType) -> &'static str {
    match mission_type {
        MissionType::Mission => "@MISSION/mission.dat",
        MissionType::Fence => "@MISSION/fence.dat",
        MissionType::Rally => "@MISSION/rally.dat",
    }
}

/// How many items follow a header.
fn count_in(header: &[u8], mission_type: MissionType) -> Result<usize, FtpError> {
    let field = |at: usize| {
        let bytes = [0, 1].map(|k| header.get(2 * at + k).copied().unwrap_or(0));
        u16::from_le_bytes(bytes)
    };
    let what = if field(0) != MAGIC {
        "does not begin as a plan file does"
    } else if field(1) != mission_type as u16 {
        "holds another kind of plan"
    } else if field(2) != 0 || field(3) != 0 {
        "holds a part of a plan"
    } else if field(4) > MOST_ITEMS {
        "says that it holds more items than any autopilot can"
    } else {
        return Ok(usize::from(field(4)));
    };
    Err(FtpError::Content { what })
}

/// The items, numbered by their place as in a download.
fn items_in(body: &[u8]) -> Vec<MissionItem> {
    let item = |(seq, bytes): (u16, &[u8])| {
        let message = MissionItemInt::deser(MavlinkVersion::V2, bytes).ok()?;
        Some(MissionItem { seq, ..message.item })
    };
    (0..).zip(body.chunks_exact(ITEM)).filter_map(item).collect()
}

/// The CRC-32 of MAVLink FTP: the usual polynomial, but nothing is inverted at either end.
fn checksum(parts: &[&[u8]]) -> u32 {
    let mut hasher = crc32fast::Hasher::new_with_initial(!0);
    for part in parts {
        hasher.update(part);
    }
    !hasher.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_inverts_nothing() {
        // By definition of a CRC with a zero register: leading zeros do not count, and the first
        // 1 bit that is shifted out brings the (reflected) polynomial.
        assert_eq!(checksum(&[&[0; 9]]), 0);
        assert_eq!(checksum(&[&[0x80]]), 0xedb8_8320);
        assert_eq!(checksum(&[&[0, 0, 0x80]]), 0xedb8_8320);
        assert_eq!(checksum(&[b"1234", b"56789"]), checksum(&[b"123456789"]));
        // CRC-32/JAMCRC without its initial value, computed bit by bit.
        let mut register = 0_u32;
        for byte in b"123456789" {
            register ^= u32::from(*byte);
            for _ in 0..8 {
                let carry = register & 1;
                register = (register >> 1) ^ (carry * 0xedb8_8320);
            }
        }
        assert_eq!(checksum(&[b"123456789"]), register);
    }

    #[test]
    fn a_header_of_another_file_is_refused() {
        let header = |fields: [u16; 5]| -> Vec<u8> {
            fields.iter().flat_map(|field| field.to_le_bytes()).collect()
        };
        let good = [MAGIC, 1, 0, 0, 12];
        assert_eq!(count_in(&header(good), MissionType::Fence).unwrap(), 12);
        for (at, value) in [(0, 0x671b), (1, 0), (2, 1), (3, 4), (4, 9000)] {
            let mut bad = good;
            bad[at] = value;
            assert!(count_in(&header(bad), MissionType::Fence).is_err(), "{bad:?}");
        }
        assert!(count_in(&[], MissionType::Mission).is_err());
    }
}
