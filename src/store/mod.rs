//! The plans that must not be lost, on disk: before quavd changes anything on a vehicle, what the
//! vehicle held is written here, with what it is to hold. The record is closed when the outcome
//! has been proven; one that is still open tells the next start that there is something to settle.
//!
//! [`record`] is one upload and its file format; this file is the directory they live in. What to
//! do about an open record is [`crate::vehicle::replace`]'s.

pub mod record;

use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

pub use record::{Outcome, Record, RecordError};

use crate::link::SystemId;
use crate::mission::{MissionItem, MissionType};
use crate::vehicle::Autopilot;

/// Closed records kept for each plan of each vehicle, beside those that are still needed.
const KEPT: usize = 50;
/// Larger than any record: three lists of the longest plan there can be.
const LARGEST_FILE: u64 = 32 * 1024 * 1024;
const LOCK_FILE: &str = "lock";
/// Begins the name of a file that is being written and not yet a record.
const UNFINISHED: &str = ".unfinished-";

/// Why the store could not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The system refused.
    #[error("cannot {what} {}: {source}; see that the disk is writable and not full", path.display())]
    Io {
        /// What was tried.
        what: &'static str,
        /// On which file or directory.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A second quavd is at work.
    #[error(
        "{} is in use by another quavd; stop that one first (`systemctl stop quavd`)",
        path.display()
    )]
    InUse {
        /// The directory.
        path: PathBuf,
    },
    /// The program is ending.
    #[error("the disk was not waited for: {0}")]
    Interrupted(String),
    /// A file that should be a record is none.
    #[error(
        "{}: {source}; it may hold a mission that is to be put back, so look into it, and move it \
         away to go on without it",
        path.display()
    )]
    Record {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: RecordError,
    },
}

/// The directory of records. One process at a time; clones share it.
#[derive(Debug, Clone)]
pub struct Store {
    directory: Arc<Directory>,
}

#[derive(Debug)]
struct Directory {
    path: PathBuf,
    /// Locked for as long as this lives.
    _lock: File,
}

/// What is known when an upload begins.
#[derive(Debug, Clone)]
pub struct Beginning {
    /// Which vehicle.
    pub vehicle: SystemId,
    /// Its flight software.
    pub autopilot: Autopilot,
    /// Which of its plans.
    pub mission_type: MissionType,
    /// The pilot's own plan.
    pub original: Vec<MissionItem>,
    /// What the vehicle holds now.
    pub before: Vec<MissionItem>,
    /// What it is to hold.
    pub intended: Vec<MissionItem>,
}

impl Store {
    /// Opens a directory, making it if need be, and keeps others out of it.
    ///
    /// # Errors
    /// [`StoreError::InUse`], [`StoreError::Io`].
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        fs::create_dir_all(path).map_err(failed("make the directory", path))?;
        let lock_path = path.join(LOCK_FILE);
        let lock = File::options().create(true).truncate(false).write(true).open(&lock_path);
        let lock = lock.map_err(failed("open", &lock_path))?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(StoreError::InUse { path: path.to_owned() });
            }
            Err(TryLockError::Error(source)) => return Err(failed("lock", &lock_path)(source)),
        }
        let store = Self { directory: Arc::new(Directory { path: path.to_owned(), _lock: lock }) };
        for name in store.names()?.iter().filter(|name| name.starts_with(UNFINISHED)) {
            let unfinished = path.join(name);
            fs::remove_file(&unfinished).map_err(failed("remove", &unfinished))?;
        }
        Ok(store)
    }

    /// Writes down that an upload begins. When this returns, the record is on the disk.
    ///
    /// # Errors
    /// [`StoreError`]: then nothing may be written to the vehicle.
    pub fn begin(&self, beginning: Beginning) -> Result<Record, StoreError> {
        let Beginning { vehicle, autopilot, mission_type, original, before, intended } = beginning;
        let number = self.numbers()?.into_iter().max().map_or(1, |last| last.saturating_add(1));
        let began = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
        let outcome = Outcome::Started;
        let record = Record {
            number,
            outcome,
            vehicle,
            autopilot,
            mission_type,
            began,
            original,
            before,
            intended,
        };
        self.write(&record)?;
        self.forget_old(vehicle, mission_type);
        Ok(record)
    }

    /// Writes down how an upload ended. When this returns, that is on the disk.
    ///
    /// # Errors
    /// [`StoreError`]: the record is then still open, and the next start settles it again.
    pub fn close(&self, record: &mut Record, outcome: Outcome) -> Result<(), StoreError> {
        let closed = Record { outcome, ..record.clone() };
        self.write(&closed)?;
        *record = closed;
        Ok(())
    }

    /// The newest upload of a plan whose outcome is not known.
    ///
    /// # Errors
    /// [`StoreError`], also where a record cannot be read: it might be the one.
    pub fn open_record(
        &self,
        vehicle: SystemId,
        mission_type: MissionType,
    ) -> Result<Option<Record>, StoreError> {
        self.newest(vehicle, mission_type, |record| record.outcome == Outcome::Started)
    }

    /// The newest upload of a plan that was proven.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn last_verified(
        &self,
        vehicle: SystemId,
        mission_type: MissionType,
    ) -> Result<Option<Record>, StoreError> {
        self.newest(vehicle, mission_type, |record| record.outcome == Outcome::Verified)
    }

    /// The newest upload of a plan, however it ended.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn last(
        &self,
        vehicle: SystemId,
        mission_type: MissionType,
    ) -> Result<Option<Record>, StoreError> {
        self.newest(vehicle, mission_type, |_| true)
    }

    /// Where a record is.
    #[must_use]
    pub fn path_of(&self, record: &Record) -> PathBuf {
        let Record { mission_type, vehicle, number, .. } = record;
        self.directory.path.join(format!("{mission_type}-{vehicle}-{number:06}.json"))
    }

    fn newest(
        &self,
        vehicle: SystemId,
        mission_type: MissionType,
        wanted: impl Fn(&Record) -> bool,
    ) -> Result<Option<Record>, StoreError> {
        for path in self.files(vehicle, mission_type)?.into_iter().rev() {
            let record = read(&path)?;
            if wanted(&record) {
                return Ok(Some(record));
            }
        }
        Ok(None)
    }

    /// The files of one plan of one vehicle, oldest first.
    fn files(
        &self,
        vehicle: SystemId,
        mission_type: MissionType,
    ) -> Result<Vec<PathBuf>, StoreError> {
        let prefix = format!("{mission_type}-{vehicle}-");
        let mut files: Vec<_> = self
            .names()?
            .into_iter()
            .filter_map(|name| Some((number_in(name.strip_prefix(&prefix)?)?, name)))
            .collect();
        files.sort_unstable();
        Ok(files.into_iter().map(|(_, name)| self.directory.path.join(name)).collect())
    }

    /// The numbers of all records of all vehicles.
    fn numbers(&self) -> Result<Vec<u32>, StoreError> {
        let number = |name: String| number_in(name.rsplit_once('-')?.1);
        Ok(self.names()?.into_iter().filter_map(number).collect())
    }

    fn names(&self) -> Result<Vec<String>, StoreError> {
        let path = &self.directory.path;
        let entries = fs::read_dir(path).map_err(failed("list", path))?;
        let names = entries.map(|entry| entry.map(|entry| entry.file_name().into_string().ok()));
        let names: io::Result<Vec<_>> = names.collect();
        Ok(names.map_err(failed("list", path))?.into_iter().flatten().collect())
    }

    /// Replaces a file as a whole: after a power cut there is the old one or the new one.
    fn write(&self, record: &Record) -> Result<(), StoreError> {
        let path = self.path_of(record);
        let bytes =
            record.to_json().map_err(|source| StoreError::Record { path: path.clone(), source })?;
        let directory = &self.directory.path;
        let file = tempfile::Builder::new().prefix(UNFINISHED).tempfile_in(directory);
        let mut file = file.map_err(failed("write to", directory))?;
        file.write_all(&bytes).map_err(failed("write", &path))?;
        file.as_file().sync_all().map_err(failed("write", &path))?;
        file.persist(&path).map_err(|error| failed("write", &path)(error.error))?;
        // The rename itself has to reach the disk as well.
        let synced = File::open(directory).and_then(|directory| directory.sync_all());
        synced.map_err(failed("write to", directory))
    }

    /// Removes the oldest closed records beyond those kept. Never an open one, nor the newest, nor
    /// the newest verified. What cannot be removed stays: it is only disk space.
    fn forget_old(&self, vehicle: SystemId, mission_type: MissionType) {
        let Ok(files) = self.files(vehicle, mission_type) else { return };
        let mut closed = 0;
        let mut verified = false;
        for path in files.into_iter().rev() {
            let Ok(record) = read(&path) else { continue };
            let newest_verified =
                record.outcome == Outcome::Verified && !std::mem::replace(&mut verified, true);
            if record.outcome == Outcome::Started || newest_verified {
                continue;
            }
            closed += 1;
            if closed > KEPT
                && let Err(error) = fs::remove_file(&path)
            {
                tracing::warn!(path = %path.display(), %error, "an old record cannot be removed");
            }
        }
    }
}

/// The number of `000042.json`.
fn number_in(name: &str) -> Option<u32> {
    name.strip_suffix(".json")?.parse().ok()
}

fn read(path: &Path) -> Result<Record, StoreError> {
    let file = File::open(path).map_err(failed("open", path))?;
    let mut bytes = Vec::new();
    file.take(LARGEST_FILE).read_to_end(&mut bytes).map_err(failed("read", path))?;
    Record::from_json(&bytes).map_err(|source| StoreError::Record { path: path.to_owned(), source })
}

fn failed(what: &'static str, path: &Path) -> impl Fn(io::Error) -> StoreError + use<> {
    let path = path.to_owned();
    move |source| StoreError::Io { what, path: path.clone(), source }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mission::{Command, Frame};

    const VEHICLE: SystemId = SystemId(1);

    fn item(seq: u16) -> MissionItem {
        MissionItem {
            seq,
            frame: Frame::GLOBAL,
            command: Command::NAV_WAYPOINT,
            current: 0,
            autocontinue: 1,
            params: [0.0; 4],
            x: 10,
            y: 20,
            z: 30.0,
        }
    }

    fn beginning(items: u16) -> Beginning {
        let original: Vec<_> = (0..items).map(item).collect();
        Beginning {
            vehicle: VEHICLE,
            autopilot: Autopilot::ArduPilot,
            mission_type: MissionType::Mission,
            before: original.clone(),
            intended: original.iter().rev().copied().collect(),
            original,
        }
    }

    fn store() -> (tempfile::TempDir, Store) {
        let directory = tempfile::tempdir().unwrap();
        let store = Store::open(directory.path()).unwrap();
        (directory, store)
    }

    fn open_record(store: &Store) -> Option<Record> {
        store.open_record(VEHICLE, MissionType::Mission).unwrap()
    }

    #[test]
    fn an_upload_is_open_until_it_is_closed_also_after_a_restart() {
        let (directory, store) = store();
        let mut record = store.begin(beginning(3)).unwrap();
        drop(store);
        let store = Store::open(directory.path()).unwrap();
        assert_eq!(open_record(&store).as_ref(), Some(&record));
        assert_eq!(store.open_record(SystemId(2), MissionType::Mission).unwrap(), None);
        assert_eq!(store.open_record(VEHICLE, MissionType::Fence).unwrap(), None);

        store.close(&mut record, Outcome::Verified).unwrap();
        assert_eq!(open_record(&store), None);
        let verified = store.last_verified(VEHICLE, MissionType::Mission).unwrap();
        assert_eq!(verified.as_ref(), Some(&record));
    }

    #[test]
    fn two_processes_do_not_share_a_directory() {
        let (directory, store) = store();
        let second = Store::open(directory.path());
        assert!(matches!(second, Err(StoreError::InUse { .. })), "{second:?}");
        drop(store);
        Store::open(directory.path()).unwrap();
    }

    #[test]
    fn old_records_go_but_none_that_is_needed() {
        let (directory, store) = store();
        let unsettled = store.begin(beginning(1)).unwrap();
        let mut verified = store.begin(beginning(2)).unwrap();
        store.close(&mut verified, Outcome::Verified).unwrap();
        for _ in 0..2 * KEPT {
            let mut record = store.begin(beginning(3)).unwrap();
            store.close(&mut record, Outcome::Restored).unwrap();
        }
        let newest = store.begin(beginning(4)).unwrap();
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), KEPT + 4, "with the lock");
        assert_eq!(open_record(&store), Some(newest));
        let kept = store.last_verified(VEHICLE, MissionType::Mission).unwrap();
        assert_eq!(kept, Some(verified));
        assert!(store.path_of(&unsettled).exists());
    }

    #[test]
    fn a_damaged_record_is_an_error_and_not_forgotten() {
        let (_directory, store) = store();
        let record = store.begin(beginning(2)).unwrap();
        let path = store.path_of(&record);
        let bytes = fs::read(&path).unwrap();
        fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        let read = store.open_record(VEHICLE, MissionType::Mission);
        let error = read.unwrap_err().to_string();
        assert!(
            error.contains("mission-1-000001.json") && error.contains("move it away"),
            "{error}"
        );
        assert_eq!(store.begin(beginning(2)).unwrap().number, 2, "its number is not used again");
    }

    #[test]
    fn what_a_dying_process_left_behind_is_no_record() {
        let directory = tempfile::tempdir().unwrap();
        let unfinished = directory.path().join(format!("{UNFINISHED}Ab12"));
        let foreign = directory.path().join("notes.txt");
        fs::write(&unfinished, b"{\"version\":1").unwrap();
        fs::write(&foreign, b"mine").unwrap();
        let store = Store::open(directory.path()).unwrap();
        assert!(!unfinished.exists() && foreign.exists());
        assert_eq!(open_record(&store), None);
        let record = store.begin(beginning(1)).unwrap();
        assert_eq!(open_record(&store), Some(record));
    }
}
