//! The secret key: 32 bytes from a file that nobody else can read, or from a systemd credential.

use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Bytes of a key.
const LENGTH: usize = 32;
/// More than any file has that holds a key.
const MOST_BYTES: u64 = 1024;

/// The secret that both ends of a link share. It is not shown, and not written anywhere.
#[derive(Clone, PartialEq, Eq)]
pub struct Key([u8; LENGTH]);

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Key(secret)")
    }
}

/// Where a key is: a path, or `credential:NAME` for a credential that systemd hands over
/// (`LoadCredential=NAME:PATH` in the unit).
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum KeySource {
    /// A file of mode 0600 or stricter.
    File(PathBuf),
    /// A file in `$CREDENTIALS_DIRECTORY`.
    Credential(String),
}

impl FromStr for KeySource {
    type Err = KeyError;

    fn from_str(text: &str) -> Result<Self, KeyError> {
        match text.strip_prefix("credential:") {
            None => Ok(Self::File(PathBuf::from(text))),
            Some(name) if name.is_empty() || name.starts_with('.') || name.contains('/') => {
                Err(KeyError::CredentialName { name: name.to_owned() })
            }
            Some(name) => Ok(Self::Credential(name.to_owned())),
        }
    }
}

/// Why there is no key.
#[derive(Debug, thiserror::Error)]
pub enum KeyError {
    /// It cannot be a file's name.
    #[error("{name:?} is no name of a credential")]
    CredentialName {
        /// The name.
        name: String,
    },
    /// systemd handed over none.
    #[error(
        "there is no CREDENTIALS_DIRECTORY for the signing key {name:?}; add \
         LoadCredential={name}:/etc/quavd/{name} to the unit"
    )]
    NoCredentials {
        /// The credential's name.
        name: String,
    },
    /// It cannot be read.
    #[error("cannot read the signing key {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// It is no file, but a directory or a device.
    #[error("the signing key {} is no regular file", path.display())]
    NoFile {
        /// The file.
        path: PathBuf,
    },
    /// Others than its owner can read or change it.
    #[error(
        "the signing key {} is open to others (mode {mode:04o}); make it `chmod 600`, and if others \
         may have read it, make a new key",
        path.display()
    )]
    Open {
        /// The file.
        path: PathBuf,
        /// Its permission bits.
        mode: u32,
    },
    /// It holds something else.
    #[error(
        "the signing key {} holds neither 32 bytes nor 64 hexadecimal digits, or only zeros; make \
         one with `head -c 32 /dev/urandom > {}`",
        path.display(),
        path.display()
    )]
    Content {
        /// The file.
        path: PathBuf,
    },
}

impl KeySource {
    /// Reads the key.
    ///
    /// # Errors
    /// [`KeyError`].
    pub fn read(&self) -> Result<Key, KeyError> {
        match self {
            // systemd shows an access list for the service's user as bits of the group.
            Self::Credential(name) => {
                let directory = std::env::var_os("CREDENTIALS_DIRECTORY")
                    .ok_or_else(|| KeyError::NoCredentials { name: name.clone() })?;
                Key::read(&Path::new(&directory).join(name), 0o007)
            }
            Self::File(path) => Key::read(path, 0o077),
        }
    }
}

impl Key {
    /// A key with these bytes.
    #[must_use]
    pub fn new(bytes: [u8; LENGTH]) -> Self {
        Self(bytes)
    }

    pub(super) fn bytes(&self) -> &[u8; LENGTH] {
        &self.0
    }

    /// Reads a file none of whose `forbidden` permission bits is set.
    fn read(path: &Path, forbidden: u32) -> Result<Self, KeyError> {
        let failed = |source| KeyError::Read { path: path.to_owned(), source };
        // Asked before it is opened: to open a pipe would wait for ever.
        if !path.metadata().map_err(failed)?.is_file() {
            return Err(KeyError::NoFile { path: path.to_owned() });
        }
        let file = File::open(path).map_err(failed)?;
        let mode = file.metadata().map_err(failed)?.permissions().mode() & 0o777;
        if mode & forbidden != 0 {
            return Err(KeyError::Open { path: path.to_owned(), mode });
        }
        let mut bytes = Vec::new();
        file.take(MOST_BYTES).read_to_end(&mut bytes).map_err(failed)?;
        Self::parse(&bytes).ok_or_else(|| KeyError::Content { path: path.to_owned() })
    }

    /// 32 bytes as they are, or 64 hexadecimal digits with white space around them. All zeros are
    /// what an autopilot holds that has no key.
    fn parse(bytes: &[u8]) -> Option<Self> {
        let key = match <[u8; LENGTH]>::try_from(bytes) {
            Ok(key) => key,
            Err(_) => digits(bytes.trim_ascii())?,
        };
        (key != [0; LENGTH]).then_some(Self(key))
    }
}

fn digits(text: &[u8]) -> Option<[u8; LENGTH]> {
    let text = <&[u8; 2 * LENGTH]>::try_from(text).ok()?;
    let mut key = [0; LENGTH];
    for (byte, pair) in key.iter_mut().zip(text.chunks_exact(2)) {
        let digit = |at: usize| (pair[at] as char).to_digit(16);
        *byte = u8::try_from(digit(0)? * 16 + digit(1)?).ok()?;
    }
    Some(key)
}

#[cfg(test)]
mod tests {
    use std::fs::{self, Permissions};

    use super::*;

    fn file(bytes: &[u8], mode: u32) -> (tempfile::TempDir, PathBuf) {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("key");
        fs::write(&path, bytes).unwrap();
        fs::set_permissions(&path, Permissions::from_mode(mode)).unwrap();
        (directory, path)
    }

    #[test]
    fn a_key_is_32_bytes_or_64_digits() {
        let raw: Vec<u8> = (1..=32).collect();
        let text = raw.iter().map(|byte| format!("{byte:02X}")).collect::<String>() + "\n";
        for bytes in [raw.as_slice(), text.as_bytes()] {
            let (_directory, path) = file(bytes, 0o600);
            let key = KeySource::File(path).read().unwrap();
            assert_eq!(key.bytes().as_slice(), raw);
            assert_eq!(format!("{key:?}"), "Key(secret)");
        }
    }

    #[test]
    fn what_is_no_key_is_refused() {
        for bytes in [vec![], vec![1; 31], vec![1; 33], vec![b'g'; 64], vec![0; 32], vec![1; 5000]]
        {
            let (_directory, path) = file(&bytes, 0o600);
            let error = KeySource::File(path).read().unwrap_err();
            assert!(matches!(error, KeyError::Content { .. }), "{error}");
        }
        let directory = tempfile::tempdir().unwrap();
        let error = KeySource::File(directory.path().to_owned()).read().unwrap_err();
        assert!(matches!(error, KeyError::NoFile { .. }), "{error}");
    }

    #[test]
    fn a_key_that_others_can_read_is_refused() {
        for mode in [0o644, 0o640, 0o604, 0o620, 0o666] {
            let (_directory, path) = file(&[7; 32], mode);
            let error = KeySource::File(path).read().unwrap_err();
            assert!(
                matches!(error, KeyError::Open { mode: found, .. } if found == mode),
                "{error}"
            );
        }
        let (_directory, path) = file(&[7; 32], 0o400);
        assert!(KeySource::File(path).read().is_ok());
    }

    #[test]
    fn a_credential_is_a_name_and_no_path() {
        for (text, source) in [
            ("credential:key", KeySource::Credential("key".into())),
            ("/etc/key", KeySource::File("/etc/key".into())),
        ] {
            assert_eq!(text.parse::<KeySource>().unwrap(), source);
        }
        for text in ["credential:", "credential:../key", "credential:a/b"] {
            assert!(text.parse::<KeySource>().is_err(), "{text}");
        }
    }
}
