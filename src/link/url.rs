//! Where the vehicle is reached, as a user writes it: `serial:/dev/ttyAMA0:921600`,
//! `udpin:0.0.0.0:14550`, `udpout:HOST:PORT`, `tcpout:HOST:PORT`, `tcpin:HOST:PORT`, and MAVSDK's
//! spellings of the same with `://`. Parsing only; [`super::transport`] opens.

use std::fmt;
use std::str::FromStr;

/// A parsed connection URL.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Endpoint {
    /// A serial port, 8 data bits, no parity, 1 stop bit, no flow control.
    Serial {
        /// The device, such as `/dev/ttyAMA0`.
        path: String,
        /// Bits per second.
        baud: u32,
    },
    /// Listen for datagrams; the vehicle's address is learned from its first message.
    UdpIn(HostPort),
    /// Send datagrams to a fixed address.
    UdpOut(HostPort),
    /// Wait for one client.
    TcpIn(HostPort),
    /// Connect to a server.
    TcpOut(HostPort),
}

/// A host name or address and a port. An IPv6 address is written in brackets.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct HostPort {
    /// A name or address, without brackets.
    pub host: String,
    /// The port; 0 only where one listens.
    pub port: u16,
}

/// Why a text is no connection URL.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UrlError {
    /// Nothing before the first colon that names a kind of link.
    #[error(
        "{url:?} names no kind of link; write serial:/dev/ttyAMA0:921600, udpin:0.0.0.0:14550, \
         udpout:HOST:PORT, tcpout:HOST:PORT or tcpin:HOST:PORT"
    )]
    UnknownScheme {
        /// The text as given.
        url: String,
    },
    /// A host or a device is missing.
    #[error("{url:?} has no {what}; expected {expected}")]
    Missing {
        /// The text as given.
        url: String,
        /// What is missing.
        what: &'static str,
        /// The form it should have.
        expected: &'static str,
    },
    /// The number after the last colon is not one that is usable there.
    #[error("{number:?} in {url:?} is not a {what}; expected {expected}")]
    Number {
        /// The text as given.
        url: String,
        /// What stood where the number belongs.
        number: String,
        /// What kind of number.
        what: &'static str,
        /// The form it should have.
        expected: &'static str,
    },
}

/// Used where a MAVLink UDP or TCP URL of MAVSDK leaves the port out.
const DEFAULT_UDP_PORT: u16 = 14_540;
const DEFAULT_TCP_PORT: u16 = 5_760;
/// Faster than any UART that carries MAVLink; a larger number is a slip of the keyboard.
const MAX_BAUD: u32 = 12_000_000;

impl FromStr for Endpoint {
    type Err = UrlError;

    fn from_str(url: &str) -> Result<Self, UrlError> {
        let unknown = || UrlError::UnknownScheme { url: url.to_owned() };
        let (scheme, rest) = url.trim().split_once(':').ok_or_else(unknown)?;
        let (rest, mavsdk) = match rest.strip_prefix("//") {
            Some(rest) => (rest, true),
            None => (rest, false),
        };
        let host_port = |default, listens| parse_host_port(url, rest, default, listens);
        let udp_default = mavsdk.then_some(DEFAULT_UDP_PORT);
        let tcp_default = mavsdk.then_some(DEFAULT_TCP_PORT);
        match scheme {
            "serial" => parse_serial(url, rest),
            "udpin" => Ok(Self::UdpIn(host_port(udp_default, true)?)),
            "udpout" => Ok(Self::UdpOut(host_port(udp_default, false)?)),
            "tcpin" => Ok(Self::TcpIn(host_port(tcp_default, true)?)),
            "tcpout" => Ok(Self::TcpOut(host_port(tcp_default, false)?)),
            // MAVSDK: a bare `udp://` listens and a bare `tcp://` connects.
            "udp" if mavsdk => Ok(Self::UdpIn(host_port(udp_default, true)?)),
            "tcp" if mavsdk => Ok(Self::TcpOut(host_port(tcp_default, false)?)),
            _ => Err(unknown()),
        }
    }
}

fn parse_serial(url: &str, rest: &str) -> Result<Endpoint, UrlError> {
    const EXPECTED: &str = "serial:/dev/ttyAMA0:921600";
    let missing = |what| UrlError::Missing { url: url.to_owned(), what, expected: EXPECTED };
    let (path, baud) = rest.rsplit_once(':').ok_or_else(|| missing("baud rate"))?;
    if path.is_empty() {
        return Err(missing("device"));
    }
    match baud.parse() {
        Ok(baud @ 1..=MAX_BAUD) => Ok(Endpoint::Serial { path: path.to_owned(), baud }),
        _ => Err(UrlError::Number {
            url: url.to_owned(),
            number: baud.to_owned(),
            what: "baud rate",
            expected: EXPECTED,
        }),
    }
}

fn parse_host_port(
    url: &str,
    rest: &str,
    default_port: Option<u16>,
    listens: bool,
) -> Result<HostPort, UrlError> {
    let expected = if listens { "udpin:0.0.0.0:14550" } else { "tcpout:HOST:PORT" };
    let missing = |what| UrlError::Missing { url: url.to_owned(), what, expected };
    let (host, port) = if let Some(bracketed) = rest.strip_prefix('[') {
        let (host, after) = bracketed.split_once(']').ok_or_else(|| missing("closing bracket"))?;
        (host, after.strip_prefix(':'))
    } else {
        match rest.rsplit_once(':') {
            Some((host, port)) => (host, Some(port)),
            None => (rest, None),
        }
    };
    let host = match host {
        "" if listens => "0.0.0.0",
        "" => return Err(missing("host")),
        host => host,
    };
    let port = match port {
        None | Some("") => default_port.ok_or_else(|| missing("port"))?,
        Some(text) => match text.parse() {
            Ok(port) if port != 0 || listens => port,
            _ => {
                return Err(UrlError::Number {
                    url: url.to_owned(),
                    number: text.to_owned(),
                    what: "port",
                    expected,
                });
            }
        },
    };
    Ok(HostPort { host: host.to_owned(), port })
}

impl fmt::Display for HostPort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.host.contains(':') {
            write!(f, "[{}]:{}", self.host, self.port)
        } else {
            write!(f, "{}:{}", self.host, self.port)
        }
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial { path, baud } => write!(f, "serial:{path}:{baud}"),
            Self::UdpIn(at) => write!(f, "udpin:{at}"),
            Self::UdpOut(at) => write!(f, "udpout:{at}"),
            Self::TcpIn(at) => write!(f, "tcpin:{at}"),
            Self::TcpOut(at) => write!(f, "tcpout:{at}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(host: &str, port: u16) -> HostPort {
        HostPort { host: host.to_owned(), port }
    }

    #[test]
    fn every_spelling_of_an_endpoint_is_understood() {
        let serial = Endpoint::Serial { path: "/dev/ttyAMA0".to_owned(), baud: 921_600 };
        for (url, endpoint) in [
            ("serial:/dev/ttyAMA0:921600", serial.clone()),
            ("serial:///dev/ttyAMA0:921600", serial),
            ("udpin:0.0.0.0:14550", Endpoint::UdpIn(at("0.0.0.0", 14_550))),
            ("udpin://0.0.0.0:14550", Endpoint::UdpIn(at("0.0.0.0", 14_550))),
            ("udp://:14540", Endpoint::UdpIn(at("0.0.0.0", 14_540))),
            ("udpout:fc.local:14550", Endpoint::UdpOut(at("fc.local", 14_550))),
            ("udpout://192.168.1.2:14550", Endpoint::UdpOut(at("192.168.1.2", 14_550))),
            ("tcp://127.0.0.1:5760", Endpoint::TcpOut(at("127.0.0.1", 5_760))),
            ("tcp://127.0.0.1", Endpoint::TcpOut(at("127.0.0.1", 5_760))),
            ("tcpout://127.0.0.1:5760", Endpoint::TcpOut(at("127.0.0.1", 5_760))),
            ("tcpin:0.0.0.0:5760", Endpoint::TcpIn(at("0.0.0.0", 5_760))),
            ("tcpout:[::1]:5760", Endpoint::TcpOut(at("::1", 5_760))),
        ] {
            assert_eq!(url.parse(), Ok(endpoint), "{url}");
        }
    }

    #[test]
    fn an_endpoint_is_written_as_it_is_read() {
        for url in ["serial:/dev/ttyS1:57600", "udpout:a:1", "tcpin:[::]:5760"] {
            assert_eq!(url.parse::<Endpoint>().unwrap().to_string(), url);
        }
    }

    #[test]
    fn what_is_no_endpoint_is_refused_with_what_to_write_instead() {
        for (url, says) in [
            ("", "names no kind of link"),
            ("/dev/ttyAMA0", "names no kind of link"),
            ("udp:0.0.0.0:14550", "names no kind of link"),
            ("serial:/dev/ttyAMA0", "has no baud rate"),
            ("serial::57600", "has no device"),
            ("serial:/dev/ttyAMA0:fast", "is not a baud rate"),
            ("serial:/dev/ttyAMA0:0", "is not a baud rate"),
            ("udpout:host", "has no port"),
            ("udpout::14550", "has no host"),
            ("tcpout:host:0", "is not a port"),
            ("udpin:0.0.0.0:70000", "is not a port"),
            ("tcpout:[::1", "has no closing bracket"),
        ] {
            let error = url.parse::<Endpoint>().unwrap_err().to_string();
            assert!(error.contains(says), "{url}: {error}");
        }
    }
}
