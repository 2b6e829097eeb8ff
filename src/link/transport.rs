//! Serial ports, datagrams and TCP streams as one thing: a source of frames and a sink for
//! frames. Opening and framing only; who speaks, and what, is [`super::component`]'s.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use mavlink::error::MessageReadError;
use mavlink::{AsyncMavlinkReader, MAVLinkMessageRaw, consts};
use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream, UdpSocket, lookup_host};
use tokio_serial::{DataBits, FlowControl, Parity, SerialPortBuilderExt, StopBits};

use super::frame::Wire;
use super::peer::Peer;
use super::resync::Resync;
use super::signing::Signer;
use super::url::{Endpoint, HostPort};

/// How long a TCP connection may take to come about.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(10);
/// Larger than any datagram that holds MAVLink frames on an ordinary network.
const MAX_DATAGRAM: usize = 2048;

/// An open link, not yet used.
pub struct Transport {
    pub(super) source: Source,
    pub(super) sink: Sink,
    pub(super) signer: Option<Signer>,
}

/// Why an endpoint could not be opened.
#[derive(Debug, thiserror::Error)]
#[error("cannot open {endpoint}: {source}; {hint}")]
pub struct OpenError {
    /// What was to be opened.
    pub endpoint: Endpoint,
    /// What the system said.
    pub source: io::Error,
    /// What to do about it.
    pub hint: &'static str,
}

impl Transport {
    /// Opens an endpoint. `tcpin` returns when a client has connected.
    ///
    /// # Errors
    /// [`OpenError`] where the device or address cannot be opened, or a TCP server does not answer
    /// within ten seconds.
    pub async fn open(endpoint: &Endpoint) -> Result<Self, OpenError> {
        let opened = match endpoint {
            Endpoint::Serial { path, baud } => open_serial(path, *baud),
            Endpoint::UdpIn(at) => open_udp_in(at).await,
            Endpoint::UdpOut(at) => open_udp_out(at).await,
            Endpoint::TcpIn(at) => open_tcp_in(at).await,
            Endpoint::TcpOut(at) => open_tcp_out(at).await,
        };
        opened.map_err(|source| OpenError {
            hint: hint(endpoint, source.kind()),
            endpoint: endpoint.clone(),
            source,
        })
    }

    /// A link over any byte stream.
    pub fn from_stream<S>(stream: S) -> Self
    where
        S: AsyncRead + AsyncWrite + Send + 'static,
    {
        let (read, write) = tokio::io::split(stream);
        Self {
            source: Source::Stream(AsyncMavlinkReader::new(Resync::new(Box::new(read)))),
            sink: Sink::Stream(Box::new(write)),
            signer: None,
        }
    }

    /// The same link with MAVLink 2 signing in both directions.
    #[must_use]
    pub fn signed(self, signer: Signer) -> Self {
        Self { signer: Some(signer), ..self }
    }
}

/// Where frames come from.
pub(super) enum Source {
    Stream(AsyncMavlinkReader<Resync<Box<dyn AsyncRead + Send + Unpin>>>),
    Datagrams(Datagrams),
}

/// Where frames go to.
pub(super) enum Sink {
    Stream(Box<dyn AsyncWrite + Send + Unpin>),
    Datagrams { socket: Arc<UdpSocket>, peer: Peer },
}

/// Frames out of datagrams, each framed by itself so that a broken one cannot spoil the next.
pub(super) struct Datagrams {
    socket: Arc<UdpSocket>,
    peer: Peer,
    datagram: Option<(SocketAddr, AsyncMavlinkReader<io::Cursor<Vec<u8>>>)>,
}

impl Source {
    /// The next frame with a valid checksum. Bytes that are no frame are skipped, in bounded
    /// memory. Cancelling loses nothing.
    pub(super) async fn next(&mut self) -> io::Result<(MAVLinkMessageRaw, Option<SocketAddr>)> {
        match self {
            Self::Stream(reader) => {
                let raw = reader.read_any_raw_message_with_dialect(&Wire).await;
                Ok((raw.map_err(into_io)?, None))
            }
            Self::Datagrams(datagrams) => datagrams.next().await,
        }
    }

    /// The peer of a datagram link, to be pinned when the vehicle is known.
    pub(super) fn peer(&self) -> Option<Peer> {
        match self {
            Self::Stream(_) => None,
            Self::Datagrams(datagrams) => Some(datagrams.peer.clone()),
        }
    }
}

impl Datagrams {
    async fn next(&mut self) -> io::Result<(MAVLinkMessageRaw, Option<SocketAddr>)> {
        loop {
            if let Some((from, reader)) = &mut self.datagram {
                // All bytes are in memory: this ends at once, with a frame or at the end.
                if let Ok(raw) = reader.read_any_raw_message_with_dialect(&Wire).await {
                    return Ok((raw, Some(*from)));
                }
                self.datagram = None;
            }
            let mut bytes = vec![0; MAX_DATAGRAM];
            match self.socket.recv_from(&mut bytes).await {
                Ok((length, from)) if self.peer.accepts(from) => {
                    bytes.truncate(length);
                    let capacity = length.max(consts::MAX_FRAME_SIZE);
                    let reader =
                        AsyncMavlinkReader::with_capacity(capacity, io::Cursor::new(bytes));
                    self.datagram = Some((from, reader));
                }
                Ok(_) => {}
                Err(error) if is_passing(&error) => {}
                Err(error) => return Err(error),
            }
        }
    }
}

impl Sink {
    /// Writes one frame. On a datagram link without a peer yet it is dropped, as is one that the
    /// network cannot carry just now: MAVLink repeats what matters.
    pub(super) async fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        match self {
            // Not flushed: of a serial port that would be tcdrain(3), which holds up the thread, and
            // with it the reader, until the last byte has left.
            Self::Stream(stream) => stream.write_all(frame).await,
            Self::Datagrams { socket, peer } => {
                let Some(address) = peer.address() else { return Ok(()) };
                match socket.send_to(frame, address).await {
                    Ok(_) => Ok(()),
                    Err(error) if is_passing(&error) => {
                        tracing::debug!(%address, %error, "datagram not sent");
                        Ok(())
                    }
                    Err(error) => Err(error),
                }
            }
        }
    }
}

/// Errors of a datagram socket that say "not now", not "never again": an ICMP message about an
/// earlier datagram, or a network that is down for the moment.
fn is_passing(error: &io::Error) -> bool {
    use io::ErrorKind as Kind;
    matches!(
        error.kind(),
        Kind::ConnectionRefused
            | Kind::ConnectionReset
            | Kind::Interrupted
            | Kind::WouldBlock
            | Kind::HostUnreachable
            | Kind::NetworkUnreachable
            | Kind::NetworkDown
            | Kind::PermissionDenied
    )
}

fn into_io(error: MessageReadError) -> io::Error {
    match error {
        MessageReadError::Io(error) => error,
        MessageReadError::Parse(error) => io::Error::new(io::ErrorKind::InvalidData, error),
    }
}

fn open_serial(path: &str, baud: u32) -> io::Result<Transport> {
    let port = tokio_serial::new(path, baud)
        .data_bits(DataBits::Eight)
        .parity(Parity::None)
        .stop_bits(StopBits::One)
        .flow_control(FlowControl::None)
        .open_native_async()?;
    Ok(Transport::from_stream(port))
}

async fn resolve(at: &HostPort) -> io::Result<SocketAddr> {
    let no_address = || io::Error::new(io::ErrorKind::NotFound, "the name has no address");
    lookup_host((at.host.as_str(), at.port)).await?.next().ok_or_else(no_address)
}

async fn open_udp_in(at: &HostPort) -> io::Result<Transport> {
    let socket = UdpSocket::bind(resolve(at).await?).await?;
    Ok(from_socket(socket, Peer::open()))
}

async fn open_udp_out(at: &HostPort) -> io::Result<Transport> {
    let to = resolve(at).await?;
    let any = if to.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" };
    let socket = UdpSocket::bind(any).await?;
    Ok(from_socket(socket, Peer::fixed(to)))
}

fn from_socket(socket: UdpSocket, peer: Peer) -> Transport {
    let socket = Arc::new(socket);
    Transport {
        source: Source::Datagrams(Datagrams {
            socket: Arc::clone(&socket),
            peer: peer.clone(),
            datagram: None,
        }),
        sink: Sink::Datagrams { socket, peer },
        signer: None,
    }
}

async fn open_tcp_in(at: &HostPort) -> io::Result<Transport> {
    let listener = TcpListener::bind(resolve(at).await?).await?;
    let (stream, from) = listener.accept().await?;
    tracing::info!(%from, "client connected");
    from_tcp(stream)
}

async fn open_tcp_out(at: &HostPort) -> io::Result<Transport> {
    let connect = TcpStream::connect((at.host.as_str(), at.port));
    let stream = tokio::time::timeout(CONNECT_TIMEOUT, connect)
        .await
        .map_err(|_| io::Error::from(io::ErrorKind::TimedOut))??;
    from_tcp(stream)
}

fn from_tcp(stream: TcpStream) -> io::Result<Transport> {
    stream.set_nodelay(true)?;
    Ok(Transport::from_stream(stream))
}

fn hint(endpoint: &Endpoint, kind: io::ErrorKind) -> &'static str {
    use io::ErrorKind as Kind;
    match (endpoint, kind) {
        (Endpoint::Serial { .. }, Kind::NotFound) => {
            "look for the port with `ls /dev/tty{AMA,S,USB,ACM}* /dev/serial/by-id/*`, and see \
             that the UART is enabled"
        }
        (Endpoint::Serial { .. }, Kind::PermissionDenied) => {
            "add the user to the group `dialout`, or close the program that holds the port"
        }
        (Endpoint::Serial { .. }, _) => "see that no other program uses the port",
        (Endpoint::UdpIn(_) | Endpoint::TcpIn(_), Kind::AddrInUse) => {
            "another program listens on that port; stop it or take another port"
        }
        (Endpoint::UdpIn(_) | Endpoint::TcpIn(_), _) => {
            "listen on an address of this machine, such as 0.0.0.0"
        }
        (Endpoint::TcpOut(_), Kind::ConnectionRefused) => {
            "nothing listens there; start the vehicle or the MAVLink router first"
        }
        (Endpoint::UdpOut(_) | Endpoint::TcpOut(_), _) => {
            "see that the host name is right and the network reaches it"
        }
    }
}
