//! Past answers on disk, each as a document and a picture, the oldest removed when they take too
//! much space. They are for people; what quavd needs itself is in [`crate::store`].

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The directory of past answers.
#[derive(Debug, Clone)]
pub(super) struct History {
    directory: PathBuf,
    /// Bytes that all of them may take.
    room: u64,
}

impl History {
    pub(super) fn new(state: &Path, room: u64) -> Self {
        Self { directory: state.join("plans"), room }
    }

    /// Keeps one answer; returns the path of its document.
    pub(super) fn keep(&self, document: &[u8], picture: Option<&str>) -> io::Result<PathBuf> {
        fs::create_dir_all(&self.directory)?;
        let number = self.files()?.last().map_or(1, |last| last.number.saturating_add(1));
        let path = self.directory.join(format!("{number:08}.json"));
        // The picture first: a document that is there is complete.
        if let Some(picture) = picture {
            write(&path.with_extension("svg"), picture.as_bytes())?;
        }
        write(&path, document)?;
        self.forget_old()?;
        Ok(path)
    }

    fn forget_old(&self) -> io::Result<()> {
        let files = self.files()?;
        let mut size: u64 = files.iter().map(|file| file.size).sum();
        let newest = files.last().map_or(0, |file| file.number);
        for file in files {
            if size <= self.room || file.number == newest {
                break;
            }
            fs::remove_file(&file.path)?;
            size = size.saturating_sub(file.size);
        }
        Ok(())
    }

    /// All files, the oldest answer first.
    fn files(&self) -> io::Result<Vec<Kept>> {
        let mut files = Vec::new();
        for entry in fs::read_dir(&self.directory)? {
            let entry = entry?;
            let path = entry.path();
            let number = path.file_stem().and_then(|stem| stem.to_str()?.parse().ok());
            if let Some(number) = number {
                files.push(Kept { number, size: entry.metadata()?.len(), path });
            }
        }
        files.sort_unstable_by(|a, b| (a.number, &a.path).cmp(&(b.number, &b.path)));
        Ok(files)
    }
}

struct Kept {
    number: u32,
    size: u64,
    path: PathBuf,
}

/// Whole or not at all. A power cut may lose the newest: nothing depends on it.
fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let unfinished = path.with_extension("new");
    fs::write(&unfinished, bytes)?;
    fs::rename(unfinished, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_stay_and_the_space_is_bounded() {
        let state = tempfile::tempdir().unwrap();
        let history = History::new(state.path(), 1000);
        let document = [b' '; 90];
        let mut last = PathBuf::new();
        for k in 0..40 {
            last = history.keep(&document, (k % 2 == 0).then_some("<svg/>")).unwrap();
        }
        let files = history.files().unwrap();
        assert!(files.iter().map(|file| file.size).sum::<u64>() <= 1000);
        assert!(files.len() >= 10 && last.ends_with("00000040.json") && last.exists());
    }

    #[test]
    fn one_that_is_larger_than_the_space_is_kept_alone() {
        let state = tempfile::tempdir().unwrap();
        let history = History::new(state.path(), 10);
        history.keep(&[b' '; 90], None).unwrap();
        let path = history.keep(&[b' '; 90], Some("<svg/>")).unwrap();
        assert!(path.exists() && path.with_extension("svg").exists());
        assert_eq!(history.files().unwrap().len(), 2);
    }
}
