//! The line to the vehicle: opening it, framing, and being a MAVLink component on it.
//!
//! [`url`] is how a user writes an endpoint, [`transport`] opens it, [`frame`] is what travels,
//! [`message`] the messages that are laid out here, [`signing`] who is believed, [`peer`] whom a
//! datagram link talks to, [`component`] the task that owns the line.
//! What is said over it is [`crate::vehicle`]'s.

pub mod component;
pub mod frame;
pub mod id;
pub mod message;
mod peer;
mod resync;
pub mod signing;
pub mod transport;
pub mod url;

pub use component::{Identity, Inbox, Link, LinkError, LinkTask};
pub use frame::Received;
pub use id::{ComponentId, Node, SystemId};
pub use signing::{KeySource, Signer, SigningError, SigningSettings, UnsignedPolicy};
pub use transport::{OpenError, Transport};
pub use url::{Endpoint, UrlError};
