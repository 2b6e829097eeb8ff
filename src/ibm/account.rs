//! The account that pays: API key, instance (CRN) and the addresses of the services.
//!
//! Credentials come from a file that the user names, from the environment or from systemd
//! (`LoadCredential=`), never from the command line, which every process on the machine can read.

use std::fmt;
use std::fs;
use std::io::Read;
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use reqwest::Url;
use thiserror::Error;

use super::secret::Secret;

/// A key or CRN longer than this is none.
const MAX_CREDENTIAL_BYTES: u64 = 4096;

/// The names of the systemd credentials.
const KEY_CREDENTIAL: &str = "ibm-api-key";
const CRN_CREDENTIAL: &str = "ibm-crn";

/// The environment variables.
const KEY_VARIABLE: &str = "QUAV_IBM_API_KEY";
const CRN_VARIABLE: &str = "QUAV_IBM_CRN";

/// Why the account cannot be used; no message holds a credential.
#[derive(Debug, Error)]
pub enum AccountError {
    /// No key anywhere.
    #[error(
        "no IBM Quantum {what}: set {variable}, name a file with {option}, or give systemd's unit \
         LoadCredential={credential}:FILE"
    )]
    Missing {
        /// `API key` or `CRN`.
        what: &'static str,
        /// The environment variable.
        variable: &'static str,
        /// The option that names a file.
        option: &'static str,
        /// The systemd credential.
        credential: &'static str,
    },
    /// A credential's file cannot be read.
    #[error("cannot read the {what} from {}: {cause}", path.display())]
    Read {
        /// `API key` or `CRN`.
        what: &'static str,
        /// The file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// A file that others may read.
    #[error(
        "{} can be read by others on this machine; run chmod 600 on it, and consider making a new key",
        .0.display()
    )]
    Exposed(PathBuf),
    /// Not what a key looks like.
    #[error(
        "the API key from {0} is not one: it must be one line of visible characters; copy it again \
         from cloud.ibm.com/iam/apikeys"
    )]
    NotAKey(String),
    /// Not what a CRN looks like.
    #[error(
        "the CRN from {0} is not one of an IBM Quantum instance \
         (crn:v1:bluemix:public:quantum-computing:REGION:a/ACCOUNT:INSTANCE::); copy it from \
         quantum.cloud.ibm.com/instances"
    )]
    NotACrn(String),
    /// A service's address that cannot be used.
    #[error("the {what} address {url} cannot be used: {why}")]
    Address {
        /// Which service.
        what: &'static str,
        /// What was given.
        url: String,
        /// Why not.
        why: String,
    },
}

/// The instance that a job is charged to (Cloud Resource Name). It names the account, so that it is not
/// shown in full either: `Display` leaves account and instance out.
#[derive(Clone, PartialEq, Eq)]
pub struct Crn {
    text: String,
    region: String,
}

/// A text that is no CRN of an IBM Quantum instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotACrn;

impl FromStr for Crn {
    type Err = NotACrn;

    fn from_str(text: &str) -> Result<Self, NotACrn> {
        let fields: Vec<&str> = text.split(':').collect();
        let visible = text.bytes().all(|byte| byte.is_ascii_graphic());
        let region = fields.get(5).copied().unwrap_or_default();
        let named = !region.is_empty()
            && region.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-');
        let shape = fields.len() == 10
            && fields[0] == "crn"
            && fields[4] == "quantum-computing"
            && !fields[7].is_empty();
        if visible && named && shape {
            Ok(Self { text: text.to_owned(), region: region.to_owned() })
        } else {
            Err(NotACrn)
        }
    }
}

impl Crn {
    /// The region that the instance is in, such as `us-east`.
    #[must_use]
    pub fn region(&self) -> &str {
        &self.region
    }

    pub(super) fn expose(&self) -> &str {
        &self.text
    }

    /// `text` without the CRN, which IBM's own messages repeat (error 1279).
    pub(super) fn removed_from(&self, text: &str) -> String {
        text.replace(&self.text, "<crn>")
    }
}

impl fmt::Display for Crn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the instance in {}", self.region)
    }
}

/// Where the services are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Endpoints {
    /// The IAM service, without `/identity/token`.
    pub iam: Url,
    /// The quantum service, with its version (`…/api/v1`).
    pub api: Url,
}

impl Endpoints {
    /// IBM's own addresses for a region, or others (a proxy, or a stand-in for tests).
    ///
    /// # Errors
    /// [`AccountError::Address`] for one that is no `https` address; `http` only on this machine, since
    /// the key would cross the network in the clear.
    pub fn new(iam: Option<&str>, api: Option<&str>, region: &str) -> Result<Self, AccountError> {
        let own = match region {
            "us-east" => "https://quantum.cloud.ibm.com/api/v1".to_owned(),
            region => format!("https://{region}.quantum.cloud.ibm.com/api/v1"),
        };
        Ok(Self {
            iam: address("IAM", iam.unwrap_or("https://iam.cloud.ibm.com"))?,
            api: address("IBM Quantum API", api.unwrap_or(&own))?,
        })
    }
}

fn address(what: &'static str, text: &str) -> Result<Url, AccountError> {
    let refused = |why: String| AccountError::Address { what, url: text.to_owned(), why };
    let url = Url::parse(text).map_err(|error| refused(error.to_string()))?;
    if !url.username().is_empty() || url.password().is_some() {
        return Err(AccountError::Address {
            what,
            url: format!("{}://…", url.scheme()),
            why: "it holds a user name or password".to_owned(),
        });
    }
    let Some(host) = url.host_str() else {
        return Err(refused("it names no host".to_owned()));
    };
    let ip = host.trim_matches(['[', ']']).parse::<IpAddr>();
    let here = ip.map_or(host == "localhost", |ip| ip.is_loopback());
    match url.scheme() {
        "https" => Ok(url),
        "http" if here => Ok(url),
        "http" => Err(refused("the API key would be sent unencrypted; use https".to_owned())),
        _ => Err(refused("it must begin with https://".to_owned())),
    }
}

/// Where to look for credentials besides the environment and systemd.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CredentialFiles {
    /// A file with the API key.
    pub key: Option<PathBuf>,
    /// A file with the CRN.
    pub crn: Option<PathBuf>,
}

/// A key and the instance that pays.
#[derive(Clone, PartialEq, Eq)]
pub struct Credentials {
    /// The API key.
    pub key: Secret,
    /// The instance.
    pub crn: Crn,
}

impl Credentials {
    /// Reads both: a file that was named comes first, then the environment, then systemd.
    ///
    /// # Errors
    /// [`AccountError`] where one is missing or is not what it should be.
    pub fn find(files: &CredentialFiles) -> Result<Self, AccountError> {
        let (key, origin) = look_up(
            Place {
                what: "API key",
                variable: KEY_VARIABLE,
                option: "--api-key-file",
                credential: KEY_CREDENTIAL,
            },
            files.key.as_deref(),
            true,
        )?;
        let visible = !key.is_empty() && key.bytes().all(|byte| byte.is_ascii_graphic());
        let key = Secret::new(key);
        if !visible {
            return Err(AccountError::NotAKey(origin));
        }
        let (crn, origin) = look_up(
            Place {
                what: "CRN",
                variable: CRN_VARIABLE,
                option: "--crn-file",
                credential: CRN_CREDENTIAL,
            },
            files.crn.as_deref(),
            false,
        )?;
        let crn = crn.parse().map_err(|NotACrn| AccountError::NotACrn(origin))?;
        Ok(Self { key, crn })
    }

    /// A server's text without either credential.
    pub(super) fn removed_from(&self, text: &str) -> String {
        self.key.removed_from(&self.crn.removed_from(text))
    }
}

/// Where one credential may be.
struct Place {
    what: &'static str,
    variable: &'static str,
    option: &'static str,
    credential: &'static str,
}

/// The credential and where it came from.
fn look_up(
    place: Place,
    file: Option<&Path>,
    private: bool,
) -> Result<(String, String), AccountError> {
    let Place { what, variable, option, credential } = place;
    let from_file =
        |path: &Path| read(what, path, private).map(|text| (text, path.display().to_string()));
    if let Some(path) = file {
        return from_file(path);
    }
    if let Some(value) = std::env::var_os(variable).filter(|value| !value.is_empty()) {
        let text = value.into_string().unwrap_or_default();
        return Ok((text.trim().to_owned(), variable.to_owned()));
    }
    if let Some(directory) = std::env::var_os("CREDENTIALS_DIRECTORY") {
        let path = Path::new(&directory).join(credential);
        if path.exists() {
            return from_file(&path);
        }
    }
    Err(AccountError::Missing { what, variable, option, credential })
}

fn read(what: &'static str, path: &Path, private: bool) -> Result<String, AccountError> {
    let failed = |cause| AccountError::Read { what, path: path.to_owned(), cause };
    let file = fs::File::open(path).map_err(failed)?;
    #[cfg(unix)]
    if private {
        use std::os::unix::fs::PermissionsExt;
        let metadata = file.metadata().map_err(failed)?;
        if metadata.is_file() && metadata.permissions().mode() & 0o007 != 0 {
            return Err(AccountError::Exposed(path.to_owned()));
        }
    }
    let mut text = String::new();
    file.take(MAX_CREDENTIAL_BYTES).read_to_string(&mut text).map_err(failed)?;
    Ok(text.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    const CRN: &str = "crn:v1:bluemix:public:quantum-computing:eu-de:a/0123:1111-2222::";

    #[test]
    fn a_crn_gives_its_region_and_is_never_shown_in_full() {
        let crn: Crn = CRN.parse().ok().unwrap();
        assert_eq!(crn.region(), "eu-de");
        assert!(!crn.to_string().contains("0123"));
        assert_eq!(crn.removed_from(&format!("no {CRN} here")), "no <crn> here");
        for bad in
            ["", "crn:v1", &CRN.replace("quantum-computing", "vpc"), &CRN.replace("eu-de", "")]
        {
            assert!(bad.parse::<Crn>().is_err(), "{bad}");
        }
    }

    #[test]
    fn the_region_chooses_the_host_and_a_key_is_never_sent_in_the_clear() {
        let host = |region| Endpoints::new(None, None, region).unwrap().api.to_string();
        assert_eq!(host("us-east"), "https://quantum.cloud.ibm.com/api/v1");
        assert_eq!(host("eu-de"), "https://eu-de.quantum.cloud.ibm.com/api/v1");
        assert!(Endpoints::new(Some("http://127.0.0.1:1"), None, "us-east").is_ok());
        assert!(Endpoints::new(Some("http://[::1]:1"), None, "us-east").is_ok());
        for bad in ["http://example.org", "ftp://example.org", "nonsense", "https://u:p@host"] {
            let error = Endpoints::new(Some(bad), None, "us-east").unwrap_err().to_string();
            assert!(error.contains("IAM") && !error.contains("u:p"), "{error}");
        }
    }

    #[test]
    fn a_key_file_that_others_can_read_is_refused() {
        use std::os::unix::fs::PermissionsExt;
        let mut key = tempfile::NamedTempFile::new().unwrap();
        writeln!(key, "secret-key").unwrap();
        let mut crn = tempfile::NamedTempFile::new().unwrap();
        writeln!(crn, "{CRN}").unwrap();
        let files =
            CredentialFiles { key: Some(key.path().to_owned()), crn: Some(crn.path().to_owned()) };
        assert!(Credentials::find(&files).is_ok());
        let open = fs::Permissions::from_mode(0o644);
        fs::set_permissions(key.path(), open).unwrap();
        let error = Credentials::find(&files).err().unwrap().to_string();
        assert!(error.contains("chmod 600") && !error.contains("secret-key"), "{error}");
    }

    #[test]
    fn what_is_no_key_is_refused_without_repeating_it() {
        let mut key = tempfile::NamedTempFile::new().unwrap();
        writeln!(key, "two words").unwrap();
        let files = CredentialFiles { key: Some(key.path().to_owned()), crn: None };
        let error = Credentials::find(&files).err().unwrap().to_string();
        assert!(error.contains("one line") && !error.contains("two words"), "{error}");
    }
}
