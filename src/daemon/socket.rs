//! The Unix socket of the daemon: one line asks, one line of JSON answers. For people on the board
//! only; nothing of it is reachable over a network.

use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::fs::{FileTypeExt, PermissionsExt};
use std::os::unix::net::UnixStream as StdUnixStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt};
use tokio::net::{UnixListener, UnixStream};
use tokio::sync::{Notify, Semaphore};
use tokio::time::timeout;

use super::status::{Board, Status};

/// A question is a word.
const LONGEST_QUESTION: u64 = 64;
/// Nobody needs longer to ask or to read.
const PATIENCE: Duration = Duration::from_secs(2);
/// Those who may ask at once; the others wait.
const MOST_AT_ONCE: usize = 8;
/// Larger than any status.
const LONGEST_ANSWER: u64 = 1 << 20;

/// Where the socket is: as configured, else in the runtime directory that systemd gives, else in
/// the state directory.
pub(crate) fn path(configured: Option<&Path>, state: &Path) -> PathBuf {
    const NAME: &str = "status.sock";
    if let Some(path) = configured {
        return path.to_owned();
    }
    match std::env::var_os("RUNTIME_DIRECTORY") {
        Some(directory) => PathBuf::from(directory).join(NAME),
        None => state.join(NAME),
    }
}

/// The socket, removed when it is dropped.
pub(super) struct Socket {
    listener: UnixListener,
    path: PathBuf,
}

impl Socket {
    /// Binds it, in place of one that an earlier daemon left. The state directory's lock has made
    /// sure that none is running.
    pub(super) fn bind(path: &Path) -> io::Result<Self> {
        match std::fs::symlink_metadata(path) {
            Ok(found) if found.file_type().is_socket() => std::fs::remove_file(path)?,
            Ok(_) => {
                let why = format!("{} is there and is no socket", path.display());
                return Err(io::Error::new(io::ErrorKind::AlreadyExists, why));
            }
            Err(_) => {}
        }
        let listener = UnixListener::bind(path)?;
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o660))?;
        Ok(Self { listener, path: path.to_owned() })
    }

    /// Answers whoever asks, until it is dropped.
    pub(super) async fn serve(&self, board: &Board, trigger: &Arc<Notify>) {
        let room = Arc::new(Semaphore::new(MOST_AT_ONCE));
        loop {
            let Ok(permit) = Arc::clone(&room).acquire_owned().await else { return };
            match self.listener.accept().await {
                Ok((stream, _)) => {
                    let (board, trigger) = (board.clone(), Arc::clone(trigger));
                    tokio::spawn(async move {
                        let _ = timeout(PATIENCE, answer(stream, &board, &trigger)).await;
                        drop(permit);
                    });
                }
                Err(error) => {
                    // Out of descriptors, say: no busy loop over it.
                    tracing::debug!(%error, "the status socket does not accept");
                    tokio::time::sleep(Duration::from_secs(1)).await;
                }
            }
        }
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        // It may be gone already with the runtime directory.
        let _ = std::fs::remove_file(&self.path);
    }
}

async fn answer(stream: UnixStream, board: &Board, trigger: &Notify) -> io::Result<()> {
    let (read, mut write) = stream.into_split();
    let mut question = String::new();
    tokio::io::BufReader::new(read.take(LONGEST_QUESTION)).read_line(&mut question).await?;
    if question.trim() == "plan" {
        trigger.notify_one();
    }
    let mut line = serde_json::to_vec(&board.read())?;
    line.push(b'\n');
    write.write_all(&line).await?;
    write.shutdown().await
}

/// Asks a running daemon: `status`, or `plan` to have it plan now. Answers with its status.
pub(crate) fn ask(path: &Path, question: &str) -> io::Result<Status> {
    let mut stream = StdUnixStream::connect(path)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.write_all(format!("{question}\n").as_bytes())?;
    let mut line = String::new();
    BufReader::new(io::Read::take(stream, LONGEST_ANSWER)).read_line(&mut line)?;
    serde_json::from_str(&line).map_err(io::Error::other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn a_question_is_answered_with_the_status_and_plan_triggers() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("status.sock");
        // What a daemon that was killed leaves behind.
        drop(std::os::unix::net::UnixListener::bind(&path).unwrap());
        let socket = Socket::bind(&path).unwrap();
        let (board, trigger) = (Board::new(), Arc::new(Notify::new()));
        board.change(|status| status.state = "watching".to_owned());
        let serving = {
            let trigger = Arc::clone(&trigger);
            tokio::spawn(async move { socket.serve(&board, &trigger).await })
        };
        let asked = |question: &'static str| {
            let path = path.clone();
            tokio::task::spawn_blocking(move || ask(&path, question))
        };
        assert_eq!(asked("status").await.unwrap().unwrap().state, "watching");
        asked("plan").await.unwrap().unwrap();
        trigger.notified().await;
        asked(&"x".repeat(5000).leak()[..]).await.unwrap().ok();
        assert_eq!(asked("status").await.unwrap().unwrap().state, "watching");
        serving.abort();
        let _ = serving.await;
        assert!(!path.exists());
    }

    #[test]
    fn a_file_that_is_no_socket_is_left_alone() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("status.sock");
        std::fs::write(&path, b"mine").unwrap();
        assert!(Socket::bind(&path).is_err());
        assert_eq!(std::fs::read(&path).unwrap(), b"mine");
    }
}
