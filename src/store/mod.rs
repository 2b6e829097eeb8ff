//! The plans that must not be lost, on disk: before quavd changes anything on a vehicle, what the
//! vehicle held is written here, with what it is to hold. The record is closed when the outcome
//! has been proven; one that is still open tells the next start that there is something to settle.
//!
//! [`record`] is one upload and its file format; this file is the directory they live in. What to
//! do about an open record is [`crate::vehicle::replace`]'s.

pub mod record;

use std::collections::BTreeSet;
use std::fs::{self, DirBuilder, File, TryLockError};
use std::io::{self, Read, Write};
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

pub use record::{Outcome, Record, RecordError};

use crate::link::SystemId;
use crate::mission::{MissionItem, MissionType};
use crate::vehicle::{Uid, VehicleId};

/// Closed records kept for each plan of each vehicle, beside those that are still needed.
const KEPT: usize = 50;
/// Larger than any record: five lists of the longest plan there can be.
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
    pub vehicle: VehicleId,
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
        make_directory(path)?;
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
        let Beginning { vehicle, mission_type, original, before, intended } = beginning;
        let number = self.numbers()?.into_iter().max().map_or(1, |last| last.saturating_add(1));
        let began = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
        let outcome = Outcome::Started;
        let record = Record {
            number,
            outcome,
            vehicle,
            mission_type,
            began,
            original,
            before,
            intended,
            read_back: None,
            found: None,
        };
        self.write(&record)?;
        self.forget_old(&record);
        Ok(record)
    }

    /// Writes a record that is still open once more, with what has been learnt since.
    ///
    /// # Errors
    /// [`StoreError`]: what was written before is still there.
    pub fn update(&self, record: &Record) -> Result<(), StoreError> {
        self.write(record)
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
        vehicle: &VehicleId,
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
        vehicle: &VehicleId,
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
        vehicle: &VehicleId,
        mission_type: MissionType,
    ) -> Result<Option<Record>, StoreError> {
        self.newest(vehicle, mission_type, |_| true)
    }

    /// Where a record is.
    #[must_use]
    pub fn path_of(&self, record: &Record) -> PathBuf {
        let Record { mission_type, vehicle, number, .. } = record;
        let name = format!("{mission_type}-{}-{number:06}.json", vehicle.system);
        self.directory.path.join(name)
    }

    /// The newest record of a vehicle that is wanted. Records of another vehicle with the same
    /// system id are passed over; an open one among them is mentioned in the log.
    fn newest(
        &self,
        vehicle: &VehicleId,
        mission_type: MissionType,
        wanted: impl Fn(&Record) -> bool,
    ) -> Result<Option<Record>, StoreError> {
        for path in self.files(vehicle.system, mission_type)?.into_iter().rev() {
            let record = read(&path)?;
            if !record.vehicle.may_be(vehicle) {
                if record.outcome == Outcome::Started {
                    tracing::warn!(
                        record = %path.display(), of = %record.vehicle, here = %vehicle,
                        "an upload to another vehicle is not settled"
                    );
                }
            } else if wanted(&record) {
                return Ok(Some(record));
            }
        }
        Ok(None)
    }

    /// The files of one plan of one system, oldest first.
    fn files(
        &self,
        system: SystemId,
        mission_type: MissionType,
    ) -> Result<Vec<PathBuf>, StoreError> {
        let prefix = format!("{mission_type}-{system}-");
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
        sync_directory(directory)
    }

    /// Removes the oldest closed records beyond those kept. Never an open one, nor the newest, nor
    /// the newest verified one of each vehicle. What cannot be removed stays: it is only disk space.
    fn forget_old(&self, newest: &Record) {
        let Ok(files) = self.files(newest.vehicle.system, newest.mission_type) else { return };
        let mut closed = 0;
        let mut verified: BTreeSet<Option<Uid>> = BTreeSet::new();
        for path in files.into_iter().rev() {
            let Ok(record) = read(&path) else { continue };
            let newest_verified =
                record.outcome == Outcome::Verified && verified.insert(record.vehicle.uid);
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

/// Makes a directory for the owner only, and those above it, and waits until their names are on
/// the disk: a record is of no use in a directory that a power cut takes away.
fn make_directory(path: &Path) -> Result<(), StoreError> {
    let missing: Vec<_> = path.ancestors().take_while(|above| !above.exists()).collect();
    let made = DirBuilder::new().recursive(true).mode(0o700).create(path);
    made.map_err(failed("make the directory", path))?;
    for above in missing.iter().filter_map(|made| made.parent()) {
        // The parent of a relative path's first part is the working directory.
        let above = if above.as_os_str().is_empty() { Path::new(".") } else { above };
        sync_directory(above)?;
    }
    Ok(())
}

fn sync_directory(path: &Path) -> Result<(), StoreError> {
    let synced = File::open(path).and_then(|directory| directory.sync_all());
    synced.map_err(failed("write to", path))
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
mod tests;
