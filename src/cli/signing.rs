//! The options that sign a link.

use clap::Args;

use crate::link::{KeySource, SigningSettings, UnsignedPolicy};

/// MAVLink 2 signing, of what quavd sends and of what it believes.
#[derive(Debug, Clone, Args)]
pub struct SigningArgs {
    /// Sign the link with this key (32 bytes or 64 hexadecimal digits, mode 0600):
    /// a file, or credential:NAME for a systemd credential.
    #[arg(long, value_name = "FILE|credential:NAME")]
    pub signing_key: Option<KeySource>,
    /// What to do with frames that are not signed: reject, radio-status (reject all but
    /// RADIO_STATUS, which radios put in) or accept.
    #[arg(long, requires = "signing_key", default_value_t, value_name = "POLICY")]
    pub signing_policy: UnsignedPolicy,
    /// Tells this link apart from other links of the same component with the same key.
    #[arg(long, requires = "signing_key", default_value_t = 0, value_name = "N")]
    pub signing_link_id: u8,
}

impl SigningArgs {
    /// What they ask for; `None` without a key.
    #[must_use]
    pub fn settings(&self) -> Option<SigningSettings> {
        Some(SigningSettings {
            key: self.signing_key.clone()?,
            unsigned: self.signing_policy,
            link_id: self.signing_link_id,
        })
    }
}
