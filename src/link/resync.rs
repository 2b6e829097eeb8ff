//! Ends a false start on a quiet line.
//!
//! Noise can hold the byte that begins a frame and, after it, a length. A frame decoder then waits
//! for as many as 280 bytes before it can tell that the checksum is wrong, and on a line that
//! carries one heartbeat a second that takes a quarter of a minute, in which the heartbeats inside
//! are not seen. So when the line falls quiet, zeros are fed in the place of the bytes that do not
//! come: no frame begins with a zero, and all that was held back is judged at once.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use mavlink::consts::MAX_FRAME_SIZE;
use tokio::io::{AsyncRead, ReadBuf};
use tokio::time::{Instant, Sleep, sleep};

/// Far longer than a pause within a frame: at 9600 baud the longest frame takes 0.3 s in all.
const QUIET: Duration = Duration::from_millis(400);

/// A reader that feeds one frame's length of zeros each time its source falls quiet.
pub(super) struct Resync<R> {
    source: R,
    quiet: Pin<Box<Sleep>>,
    /// Whether bytes came since zeros were fed last.
    is_dirty: bool,
    /// Zeros still to be fed.
    zeros: usize,
}

impl<R> Resync<R> {
    pub(super) fn new(source: R) -> Self {
        Self { source, quiet: Box::pin(sleep(QUIET)), is_dirty: false, zeros: 0 }
    }

    fn feed_zeros(&mut self, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        let count = self.zeros.min(buffer.remaining());
        buffer.initialize_unfilled_to(count).fill(0);
        buffer.advance(count);
        self.zeros -= count;
        Poll::Ready(Ok(()))
    }
}

impl<R: AsyncRead + Unpin> AsyncRead for Resync<R> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        if self.zeros > 0 {
            return self.feed_zeros(buffer);
        }
        let before = buffer.filled().len();
        match Pin::new(&mut self.source).poll_read(context, buffer) {
            Poll::Ready(result) => {
                if buffer.filled().len() > before {
                    self.is_dirty = true;
                    self.quiet.as_mut().reset(Instant::now() + QUIET);
                }
                Poll::Ready(result)
            }
            Poll::Pending if self.is_dirty && self.quiet.as_mut().poll(context).is_ready() => {
                self.is_dirty = false;
                self.zeros = MAX_FRAME_SIZE;
                self.feed_zeros(buffer)
            }
            Poll::Pending => Poll::Pending,
        }
    }
}

#[cfg(test)]
mod tests {
    use mavlink::AsyncMavlinkReader;
    use tokio::io::AsyncWriteExt;

    use super::*;
    use crate::link::frame::{Packet, Wire};
    use crate::link::id::{ComponentId, Node, SystemId};
    use crate::link::message::MissionRequestList;

    #[tokio::test(start_paused = true)]
    async fn frames_behind_a_false_start_are_seen_as_soon_as_the_line_is_quiet() {
        let node = Node { system: SystemId(1), component: ComponentId(1) };
        let message = MissionRequestList { target: node, mission_type: 0 };
        let (mut line, source) = tokio::io::duplex(1024);
        let mut reader = AsyncMavlinkReader::new(Resync::new(source));
        line.write_all(&[0xfd, 0xff, 0x00, 0xfe, 0x80]).await.unwrap();
        let begin = Instant::now();
        for sequence in 0..3 {
            let frame = Packet::new(&message).to_frame(node, sequence, None);
            line.write_all(frame.raw_bytes()).await.unwrap();
        }
        for sequence in 0..3 {
            let raw = reader.read_any_raw_message_with_dialect(&Wire).await.unwrap();
            assert_eq!(raw.sequence(), sequence);
        }
        assert!(begin.elapsed() <= 2 * QUIET);
    }

    #[tokio::test(start_paused = true)]
    async fn a_frame_in_slow_pieces_arrives_whole() {
        let node = Node { system: SystemId(1), component: ComponentId(1) };
        let message = MissionRequestList { target: node, mission_type: 2 };
        let (mut line, source) = tokio::io::duplex(1024);
        let mut reader = AsyncMavlinkReader::new(Resync::new(source));
        let frame = Packet::new(&message).to_frame(node, 9, None);
        let write = async {
            for byte in frame.raw_bytes() {
                line.write_all(&[*byte]).await.unwrap();
                sleep(QUIET / 2).await;
            }
        };
        let (raw, ()) = tokio::join!(reader.read_any_raw_message_with_dialect(&Wire), write);
        assert_eq!(raw.unwrap().sequence(), 9);
    }
}
