//! The record on disk of jobs that were submitted: what a restarted quavd picks up or cancels instead of
//! paying again.
//!
//! One file a job, named by its [digest](super::digest). It is there before the job is created, with
//! the tag that finds it; the id is added afterwards. A run holds a lock, so that no two runs take each
//! other's jobs for left over.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::error::IbmError;

/// A record is never longer.
const MAX_RECORD_BYTES: u64 = 64 << 10;

/// A job that was submitted, or is about to be.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// What it was asked for.
    pub digest: String,
    /// The tag that only this job has.
    pub tag: String,
    /// The backend it was sent to.
    pub backend: String,
    /// The physical qubits of the chain, in its order.
    pub line: Vec<u32>,
    /// Its id, once the service has named it.
    pub job: Option<String>,
}

/// The records of this and earlier runs.
#[derive(Debug)]
pub struct Ledger {
    directory: PathBuf,
    /// Held as long as this value lives.
    _lock: File,
}

impl Ledger {
    /// Opens (or makes) the records in a state directory.
    ///
    /// # Errors
    /// [`IbmError::Ledger`] where it cannot be written, or another quavd is using it.
    pub fn open(state: &Path) -> Result<Self, IbmError> {
        let directory = state.join("ibm-jobs");
        let failed = |cause| IbmError::Ledger { path: directory.clone(), cause };
        fs::create_dir_all(&directory).map_err(failed)?;
        let lock = File::create(directory.join("lock")).map_err(failed)?;
        lock.try_lock().map_err(|error| match error {
            fs::TryLockError::WouldBlock => failed(io::Error::other("another quavd is using it")),
            fs::TryLockError::Error(cause) => failed(cause),
        })?;
        Ok(Self { directory, _lock: lock })
    }

    fn path(&self, digest: &str) -> PathBuf {
        self.directory.join(format!("{digest}.json"))
    }

    /// Writes a record, in place of the one that its digest has. It is on disk when this returns.
    ///
    /// # Errors
    /// [`IbmError::Ledger`].
    pub fn put(&self, record: &Record) -> Result<(), IbmError> {
        let path = self.path(&record.digest);
        let failed = |cause| IbmError::Ledger { path: path.clone(), cause };
        let mut file = tempfile::NamedTempFile::new_in(&self.directory).map_err(failed)?;
        serde_json::to_writer(&mut file, record).map_err(|error| failed(error.into()))?;
        file.flush().and_then(|()| file.as_file().sync_all()).map_err(failed)?;
        file.persist(&path).map_err(|error| failed(error.error))?;
        File::open(&self.directory).and_then(|directory| directory.sync_all()).map_err(failed)
    }

    /// The record of a digest. One that cannot be read is as good as none.
    #[must_use]
    pub fn find(&self, digest: &str) -> Option<Record> {
        read(&self.path(digest)).filter(|record| record.digest == digest)
    }

    /// All records.
    #[must_use]
    pub fn all(&self) -> Vec<Record> {
        let entries = fs::read_dir(&self.directory).into_iter().flatten().flatten();
        let mut records: Vec<Record> = entries
            .map(|entry| entry.path())
            .filter(|path| path.extension().is_some_and(|suffix| suffix == "json"))
            .filter_map(|path| read(&path))
            .collect();
        records.sort_by(|a, b| a.digest.cmp(&b.digest));
        records
    }

    /// Forgets a job. One that is not there is forgotten already.
    pub fn remove(&self, digest: &str) {
        if let Err(error) = fs::remove_file(self.path(digest))
            && error.kind() != io::ErrorKind::NotFound
        {
            tracing::warn!("cannot remove a record of {}: {error}", self.directory.display());
        }
    }
}

fn read(path: &Path) -> Option<Record> {
    let size = fs::metadata(path).ok()?.len();
    let bytes = (size <= MAX_RECORD_BYTES).then(|| fs::read(path).ok()).flatten()?;
    serde_json::from_slice(&bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(digest: &str) -> Record {
        Record {
            digest: digest.to_owned(),
            tag: "quavd-1".to_owned(),
            backend: "ibm_fez".to_owned(),
            line: vec![3, 4, 5],
            job: None,
        }
    }

    #[test]
    fn a_record_survives_the_run_that_wrote_it() {
        let state = tempfile::tempdir().unwrap();
        let ledger = Ledger::open(state.path()).unwrap();
        ledger.put(&record("a")).unwrap();
        ledger.put(&Record { job: Some("d1".to_owned()), ..record("a") }).unwrap();
        drop(ledger);
        let ledger = Ledger::open(state.path()).unwrap();
        assert_eq!(ledger.find("a").unwrap().job.as_deref(), Some("d1"));
        assert_eq!(ledger.all().len(), 1);
        ledger.remove("a");
        ledger.remove("a");
        assert_eq!(ledger.find("a"), None);
    }

    #[test]
    fn two_runs_do_not_share_a_ledger() {
        let state = tempfile::tempdir().unwrap();
        let _first = Ledger::open(state.path()).unwrap();
        let error = Ledger::open(state.path()).unwrap_err().to_string();
        assert!(error.contains("another quavd"), "{error}");
    }

    #[test]
    fn a_damaged_record_is_none() {
        let state = tempfile::tempdir().unwrap();
        let ledger = Ledger::open(state.path()).unwrap();
        fs::write(ledger.path("a"), "{").unwrap();
        fs::write(ledger.path("b"), serde_json::to_vec(&record("c")).unwrap()).unwrap();
        assert_eq!((ledger.find("a"), ledger.find("b")), (None, None));
    }
}
