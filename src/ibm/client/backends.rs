//! The backends of the instance, and what is known of each.

use serde::Deserialize;

use super::super::device::Device;
use super::super::error::IbmError;
use super::Client;

/// More backends than this are not a list of backends.
const MAX_BACKENDS: usize = 1000;

/// A backend as the list has it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Backend {
    /// Its name, such as `ibm_fez`.
    pub name: String,
    /// Whether it runs jobs.
    #[serde(default)]
    pub status: BackendStatus,
    /// Qubits in use.
    #[serde(default)]
    pub qubits: Option<u32>,
    /// Jobs waiting.
    #[serde(default)]
    pub queue_length: Option<u64>,
    /// Family and revision.
    #[serde(default)]
    pub processor_type: Option<Processor>,
    /// Whether no QPU is behind it.
    #[serde(default)]
    pub is_simulator: Option<bool>,
}

/// Whether a backend runs jobs.
#[derive(Debug, Clone, PartialEq, Eq, Default, Deserialize)]
pub struct BackendStatus {
    /// `online`, `paused` or `offline`.
    #[serde(default)]
    pub name: String,
    /// More about it.
    #[serde(default)]
    pub reason: Option<String>,
}

/// A kind of processor.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub struct Processor {
    /// Such as `Heron`.
    #[serde(default)]
    pub family: Option<String>,
    /// Its revision, a string here and a number elsewhere.
    #[serde(default)]
    pub revision: Option<serde_json::Value>,
}

impl Backend {
    /// Whether it runs jobs at present.
    #[must_use]
    pub fn is_online(&self) -> bool {
        self.status.name == "online"
    }

    /// Family and revision in words.
    #[must_use]
    pub fn processor(&self) -> String {
        let Some(Processor { family, revision }) = &self.processor_type else {
            return "unknown".to_owned();
        };
        let family = family.as_deref().unwrap_or("unknown");
        match revision {
            Some(serde_json::Value::String(text)) => format!("{family} r{text}"),
            Some(serde_json::Value::Number(number)) => format!("{family} r{number}"),
            _ => family.to_owned(),
        }
    }
}

/// Which backend a user wants.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BackendChoice {
    /// The one with the shortest queue among those that are online and large enough.
    LeastBusy,
    /// This one.
    Named(String),
}

impl std::str::FromStr for BackendChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let valid = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        match text {
            "least_busy" => Ok(Self::LeastBusy),
            name if !name.is_empty() && name.len() <= 64 && name.chars().all(valid) => {
                Ok(Self::Named(name.to_owned()))
            }
            _ => Err(format!("'{text}' is neither least_busy nor the name of a backend")),
        }
    }
}

impl std::fmt::Display for BackendChoice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::LeastBusy => "least_busy",
            Self::Named(name) => name,
        })
    }
}

/// What the instance has used and may use, QPU seconds.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Usage {
    /// Used in the current period.
    #[serde(default)]
    pub usage_consumed_seconds: Option<f64>,
    /// Allowed in it.
    #[serde(default)]
    pub usage_limit_seconds: Option<f64>,
    /// Whether nothing is left.
    #[serde(default)]
    pub usage_limit_reached: bool,
}

impl Usage {
    /// QPU seconds left; `None` without a limit.
    #[must_use]
    pub fn left(&self) -> Option<f64> {
        if self.usage_limit_reached {
            return Some(0.0);
        }
        let left = self.usage_limit_seconds? - self.usage_consumed_seconds.unwrap_or(0.0);
        Some(left.max(0.0))
    }
}

#[derive(Deserialize)]
struct Backends {
    devices: Vec<Backend>,
}

impl Client {
    /// All backends of the instance.
    ///
    /// # Errors
    /// [`IbmError`].
    pub async fn backends(&self) -> Result<Vec<Backend>, IbmError> {
        const WHAT: &str = "GET /backends";
        let reply = self.read(self.get(&["backends"])).await?;
        let Backends { devices } = reply.document(WHAT).map_err(|error| match error {
            // The oldest version's form: what a server answers that ignores the version asked for.
            IbmError::Malformed { why, .. } if why.contains("invalid type: string") => {
                IbmError::malformed(WHAT, "it is of an old API version; check the API's address")
            }
            error => error,
        })?;
        if devices.len() > MAX_BACKENDS {
            return Err(IbmError::malformed(WHAT, "too many backends"));
        }
        Ok(devices)
    }

    /// The backend that a user wants, for a circuit of so many qubits.
    ///
    /// # Errors
    /// [`IbmError::NoSuchBackend`] with those that exist, and [`IbmError::NotOnline`].
    pub async fn choose(&self, choice: &BackendChoice, qubits: usize) -> Result<Backend, IbmError> {
        chosen(self.backends().await?, choice, qubits)
    }

    /// Gates, coupling map and today's calibration of a backend.
    ///
    /// # Errors
    /// [`IbmError`]; also where the documents make no sense.
    pub async fn device(&self, name: &str) -> Result<Device, IbmError> {
        let configuration = self.read(self.get(&["backends", name, "configuration"])).await?;
        let properties = self.read(self.get(&["backends", name, "properties"])).await?;
        let what = format!("GET /backends/{name}/configuration and properties");
        Device::parse(configuration.text(&what)?, properties.text(&what)?)
            .map_err(|error| IbmError::malformed(what, error.to_string()))
    }

    /// What the instance has used and may use.
    ///
    /// # Errors
    /// [`IbmError`].
    pub async fn usage(&self) -> Result<Usage, IbmError> {
        self.read(self.get(&["instances", "usage"])).await?.document("GET /instances/usage")
    }
}

fn chosen(
    backends: Vec<Backend>,
    choice: &BackendChoice,
    qubits: usize,
) -> Result<Backend, IbmError> {
    let names = || backends.iter().map(|backend| super::visible(&backend.name)).collect::<Vec<_>>();
    match choice {
        BackendChoice::Named(name) => {
            let available = names();
            let found = backends.into_iter().find(|backend| backend.name == *name);
            let found =
                found.ok_or_else(|| IbmError::NoSuchBackend { name: name.clone(), available })?;
            if found.is_online() {
                return Ok(found);
            }
            let status = super::visible(&found.status.name);
            Err(IbmError::NotOnline { name: name.clone(), status })
        }
        BackendChoice::LeastBusy => {
            let available = names();
            let fits = |backend: &Backend| backend.qubits.is_some_and(|n| n as usize >= qubits);
            backends
                .into_iter()
                .filter(|backend| backend.is_online() && fits(backend))
                .filter(|backend| backend.is_simulator != Some(true))
                .min_by_key(|backend| {
                    (backend.queue_length.unwrap_or(u64::MAX), backend.name.clone())
                })
                .ok_or(IbmError::NoneOnline { available })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn backends() -> Vec<Backend> {
        let text = r#"[
            {"name":"ibm_fez","status":{"name":"online","reason":"available"},"qubits":156,
             "physical_qubits":332,"processor_type":{"family":"Heron","revision":"2"},"queue_length":121},
            {"name":"ibm_torino","status":{"name":"paused"},"qubits":133,"queue_length":0},
            {"name":"ibm_small","status":{"name":"online"},"qubits":5,"queue_length":0},
            {"name":"ibm_odd","status":{"name":"online"},"qubits":null,"processor_type":null},
            {"name":"ibm_kingston","status":{"name":"online"},"qubits":156,"queue_length":7}]"#;
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn the_least_busy_one_is_online_and_large_enough() {
        let chosen = chosen(backends(), &BackendChoice::LeastBusy, 20).unwrap();
        assert_eq!(chosen.name, "ibm_kingston");
        assert_eq!(backends()[0].processor(), "Heron r2");
    }

    #[test]
    fn a_named_one_must_exist_and_be_online() {
        let named = |name: &str| chosen(backends(), &BackendChoice::Named(name.to_owned()), 20);
        assert_eq!(named("ibm_fez").unwrap().name, "ibm_fez");
        assert!(matches!(named("ibm_torino"), Err(IbmError::NotOnline { .. })));
        let error = named("ibm_kyiv").unwrap_err().to_string();
        assert!(error.contains("retired") && error.contains("ibm_kingston"), "{error}");
    }

    #[test]
    fn what_is_left_is_known_where_there_is_a_limit() {
        let usage = |text: &str| serde_json::from_str::<Usage>(text).unwrap().left();
        assert_eq!(
            usage(r#"{"usage_consumed_seconds":12,"usage_limit_seconds":600}"#),
            Some(588.0)
        );
        assert_eq!(usage(r#"{"usage_limit_seconds":600,"usage_limit_reached":true}"#), Some(0.0));
        assert_eq!(usage("{}"), None);
    }
}
