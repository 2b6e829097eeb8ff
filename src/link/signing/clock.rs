//! The timestamps of signing: never the same one twice, also over a restart on a board whose clock
//! starts in 1970.
//!
//! A file holds a timestamp that was not used yet. While a link is open it lies ahead of what is
//! in use, so that a run that ends suddenly has used nothing beyond it; at the end of a run it is
//! set to what was used last.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// 10 microseconds each, since 2015-01-01 00:00 UTC.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Timestamp(pub u64);

impl Timestamp {
    /// Timestamps in a second.
    pub const PER_SECOND: u64 = 100_000;
    /// 2015-01-01 00:00 UTC in Unix time.
    const EPOCH: Duration = Duration::from_secs(1_420_070_400);
    /// It has 48 bits.
    const MAX: u64 = (1 << 48) - 1;

    fn of(time: SystemTime) -> Self {
        let since = time.duration_since(UNIX_EPOCH + Self::EPOCH).unwrap_or_default();
        let ticks = u64::try_from(since.as_micros() / 10).unwrap_or(Self::MAX);
        Self(ticks.min(Self::MAX))
    }
}

/// The file of one link in the state directory. Links with one key differ in their id, so each has
/// its own time.
fn file_name(link_id: u8) -> String {
    format!("signing-timestamp-{link_id}")
}

/// The file is written again when this much of what it holds in advance is left.
const LEAST_AHEAD: u64 = 10 * Timestamp::PER_SECOND;
/// How far the file lies ahead. After a sudden end the next run starts there, so it stays well
/// below the minute that the vehicle allows other senders to lag behind.
const AHEAD: u64 = 30 * Timestamp::PER_SECOND;

/// Why the timestamps of earlier runs are not known.
#[derive(Debug, thiserror::Error)]
pub enum TimestampError {
    /// The file cannot be read or written.
    #[error("cannot use the signing timestamp in {}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file holds something else.
    #[error(
        "{} holds no timestamp; remove it if the clock of this machine is right, or the vehicle will \
         take what quavd sends for a replay",
        path.display()
    )]
    Content {
        /// The file.
        path: PathBuf,
    },
}

/// Gives out timestamps.
#[derive(Debug)]
pub(crate) struct Clock {
    /// What was used or seen last.
    last: Timestamp,
    /// Nothing beyond this was promised to the file.
    promised: Timestamp,
    /// `None` in tests that need none.
    path: Option<PathBuf>,
}

impl Clock {
    /// Goes on after the last run of this link that used this directory, or at the time of the
    /// system where that is later.
    ///
    /// # Errors
    /// [`TimestampError`]: without the file a timestamp might come a second time.
    pub(super) fn open(directory: &Path, link_id: u8) -> Result<Self, TimestampError> {
        let path = directory.join(file_name(link_id));
        let failed = |source| TimestampError::File { path: path.clone(), source };
        let stored = match fs::read_to_string(&path) {
            Ok(text) => match text.trim().parse() {
                Ok(stored) if stored <= Timestamp::MAX => Timestamp(stored),
                _ => return Err(TimestampError::Content { path }),
            },
            Err(error) if error.kind() == io::ErrorKind::NotFound => Timestamp(0),
            Err(error) => return Err(failed(error)),
        };
        fs::create_dir_all(directory).map_err(failed)?;
        let last = stored.max(Timestamp::of(SystemTime::now()));
        let promised = Timestamp(last.0.saturating_add(AHEAD).min(Timestamp::MAX));
        save(&path, promised).map_err(failed)?;
        Ok(Self { last, promised, path: Some(path) })
    }

    #[cfg(test)]
    pub(super) fn starting_at(last: Timestamp) -> Self {
        Self { last, promised: last, path: None }
    }

    /// The time: that of the system, or what was seen last where that is later.
    pub(super) fn now(&self) -> Timestamp {
        self.last.max(Timestamp::of(SystemTime::now()))
    }

    /// A timestamp that was never used.
    pub(super) fn next(&mut self) -> Timestamp {
        let after = Timestamp((self.last.0 + 1).min(Timestamp::MAX));
        self.last = after.max(Timestamp::of(SystemTime::now()));
        self.keep_promise();
        self.last
    }

    /// Somebody with the key has used this one.
    pub(super) fn raise(&mut self, seen: Timestamp) {
        self.last = self.last.max(seen);
        self.keep_promise();
    }

    fn keep_promise(&mut self) {
        if self.last.0.saturating_add(LEAST_AHEAD) < self.promised.0 {
            return;
        }
        self.promised = Timestamp(self.last.0.saturating_add(AHEAD).min(Timestamp::MAX));
        self.write(self.promised);
    }

    /// The end of a run: the next one may start right here.
    pub(super) fn close(&mut self) {
        self.write(Timestamp((self.last.0 + 1).min(Timestamp::MAX)));
    }

    fn write(&self, timestamp: Timestamp) {
        let Some(path) = &self.path else { return };
        if let Err(error) = save(path, timestamp) {
            tracing::error!(path = %path.display(), %error, "the signing timestamp was not saved");
        }
    }
}

/// The whole file or nothing, and on the disk when this returns.
fn save(path: &Path, timestamp: Timestamp) -> io::Result<()> {
    let directory = path.parent().unwrap_or(Path::new("."));
    let mut file = tempfile::NamedTempFile::new_in(directory)?;
    writeln!(file, "{}", timestamp.0)?;
    file.as_file().sync_all()?;
    file.persist(path)?;
    fs::File::open(directory)?.sync_all()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_timestamp_counts_10_microseconds_since_2015() {
        let time = UNIX_EPOCH + Duration::from_micros(1_420_070_400_000_000 + 1_234_567);
        assert_eq!(Timestamp::of(time), Timestamp(123_456));
        assert_eq!(Timestamp::of(UNIX_EPOCH), Timestamp(0));
    }

    #[test]
    fn no_timestamp_comes_twice_also_after_a_sudden_end() {
        let directory = tempfile::tempdir().unwrap();
        let mut clock = Clock::open(directory.path(), 3).unwrap();
        // Somebody's clock is a year ahead: that of this machine no longer counts.
        let ahead = Timestamp(clock.now().0 + 365 * 86_400 * Timestamp::PER_SECOND);
        clock.raise(ahead);
        let mut used = Timestamp(0);
        for _ in 0..1000 {
            let next = clock.next();
            assert!(next > used && next > ahead);
            used = next;
        }
        // No close: the program was killed.
        let mut clock = Clock::open(directory.path(), 3).unwrap();
        assert!(clock.next() > used);
        let used = clock.next();
        clock.close();
        let next = Clock::open(directory.path(), 3).unwrap().next();
        assert!(next > used && next.0 < used.0 + 10, "a clean end costs nothing");
    }

    #[test]
    fn a_file_without_a_timestamp_is_an_error() {
        let directory = tempfile::tempdir().unwrap();
        for content in ["", "soon", "-1", "99999999999999999"] {
            fs::write(directory.path().join(file_name(3)), content).unwrap();
            let error = Clock::open(directory.path(), 3).unwrap_err();
            assert!(matches!(error, TimestampError::Content { .. }), "{error}");
        }
    }
}
