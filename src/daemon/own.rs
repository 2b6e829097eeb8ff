//! quavd's own MAVLink parameters: what a ground station can see and set without touching the
//! configuration file. A value that was set counts more than the file's, and is kept on disk.
//!
//! All are of type REAL32: ArduPilot's ground stations cast integers into the float and PX4's copy
//! their bits, and a float is the same for both.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::config::{ConfigError, Configuration, DaemonOptions, Overrides, Policy};
use crate::link::message::{ParamName, ParamValue};

/// `MAV_PARAM_TYPE_REAL32`.
const REAL32: u8 = 9;

/// One parameter: its MAVLink name, the option it is, and how its value is had from the options.
struct Parameter {
    name: &'static str,
    key: &'static str,
    value: fn(&DaemonOptions) -> f32,
}

const PARAMETERS: [Parameter; 8] = [
    Parameter { name: "QUAV_BUFFER", key: "buffer", value: |o| o.planning.safety.buffer as f32 },
    Parameter { name: "QUAV_DEBOUNCE", key: "debounce", value: |o| o.service.debounce as f32 },
    Parameter {
        name: "QUAV_ENABLE",
        key: "enable",
        value: |o| f32::from(u8::from(o.service.enable)),
    },
    Parameter { name: "QUAV_LAYERS", key: "layers", value: |o| f32::from(o.planning.layers) },
    Parameter {
        name: "QUAV_POLICY",
        key: "policy",
        value: |o| Policy::ALL.iter().position(|p| *p == o.service.policy).unwrap_or(0) as f32,
    },
    Parameter { name: "QUAV_QUBITS", key: "qubits", value: |o| f32::from(o.planning.qubits) },
    Parameter { name: "QUAV_SHOTS", key: "shots", value: |o| o.planning.shots as f32 },
    Parameter {
        name: "QUAV_USER_CMD",
        key: "user_command",
        value: |o| f32::from(o.service.user_command),
    },
];

/// The options in force: the file's, with what was set over MAVLink.
#[derive(Debug)]
pub(super) struct Own {
    configuration: Configuration,
    overrides: Overrides,
    path: PathBuf,
    pub(super) options: DaemonOptions,
}

impl Own {
    /// The file's options with what is kept in the state directory. What is kept and does not fit
    /// the file (any more) is left out, with a warning.
    pub(super) fn new(configuration: Configuration, state: &Path) -> Result<Self, ConfigError> {
        let path = state.join("parameters.json");
        let overrides = read(&path);
        match configuration.with(&overrides).options() {
            Ok(options) => Ok(Self { configuration, overrides, path, options }),
            Err(error) => {
                let options = configuration.options()?;
                tracing::warn!(%error, "the parameters set over MAVLink do not fit the file; ignored");
                Ok(Self { configuration, overrides: Overrides::new(), path, options })
            }
        }
    }

    /// Bytes that the reports of past plans may take.
    pub(super) fn room_for_history(&self) -> u64 {
        u64::from(self.options.service.history) << 20
    }

    /// The value of one parameter, by name.
    pub(super) fn by_name(&self, name: ParamName) -> Option<ParamValue> {
        let index = PARAMETERS.iter().position(|own| ParamName::new(own.name) == Some(name))?;
        self.by_index(index)
    }

    /// The value of one parameter, by its number.
    pub(super) fn by_index(&self, index: usize) -> Option<ParamValue> {
        let own = PARAMETERS.get(index)?;
        Some(ParamValue {
            bits: (own.value)(&self.options).to_bits(),
            count: PARAMETERS.len() as u16,
            index: u16::try_from(index).ok()?,
            name: ParamName::new(own.name)?,
            kind: REAL32,
        })
    }

    /// All parameters.
    pub(super) fn all(&self) -> impl Iterator<Item = ParamValue> + '_ {
        (0..PARAMETERS.len()).filter_map(|index| self.by_index(index))
    }

    /// Sets one. `Ok(false)` where it is none of ours or has that value already; where the value
    /// is out of range nothing changes and the error says why.
    pub(super) fn set(&mut self, name: ParamName, value: f32) -> Result<bool, String> {
        let own = PARAMETERS.iter().find(|own| ParamName::new(own.name) == Some(name));
        let Some(own) = own else { return Ok(false) };
        let text = text_of(own.key, value).ok_or_else(|| format!("{name} cannot be {value}"))?;
        let mut overrides = self.overrides.clone();
        overrides.insert(own.key.to_owned(), text);
        let options = self.configuration.with(&overrides).options().map_err(|e| e.to_string())?;
        let before = (own.value)(&self.options);
        self.overrides = overrides;
        self.options = options;
        write(&self.path, &self.overrides)
            .map_err(|error| format!("{} cannot be kept: {error}", own.name))?;
        Ok((own.value)(&self.options).to_bits() != before.to_bits())
    }
}

/// A value as the configuration writes it.
fn text_of(key: &str, value: f32) -> Option<String> {
    let whole =
        || (value.is_finite() && value.fract() == 0.0 && value >= 0.0).then_some(value as u32);
    match key {
        "policy" => Policy::ALL.get(whole()? as usize).map(ToString::to_string),
        "enable" => match whole()? {
            0 => Some("false".to_owned()),
            1 => Some("true".to_owned()),
            _ => None,
        },
        // The shortest text that gives the same float again: 0.1 and not 0.10000000149.
        _ => value.is_finite().then(|| value.to_string()),
    }
}

/// What is kept on disk. A damaged file is as good as none: these are settings, not missions.
fn read(path: &Path) -> Overrides {
    match fs::read(path) {
        Ok(bytes) => serde_json::from_slice(&bytes).unwrap_or_else(|error| {
            tracing::warn!(path = %path.display(), %error, "the kept parameters cannot be read; ignored");
            Overrides::new()
        }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Overrides::new(),
        Err(error) => {
            tracing::warn!(path = %path.display(), %error, "the kept parameters cannot be read; ignored");
            Overrides::new()
        }
    }
}

fn write(path: &Path, overrides: &Overrides) -> io::Result<()> {
    let unfinished = path.with_extension("json.new");
    fs::write(&unfinished, serde_json::to_vec_pretty(overrides)?)?;
    fs::rename(unfinished, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn configured(directory: &Path, text: &str) -> Configuration {
        let path = directory.join("quavd.toml");
        fs::write(&path, text).unwrap();
        Configuration::read(&path).unwrap()
    }

    fn value(own: &Own, name: &str) -> f32 {
        f32::from_bits(own.by_name(ParamName::new(name).unwrap()).unwrap().bits)
    }

    fn set(own: &mut Own, name: &str, value: f32) -> Result<bool, String> {
        own.set(ParamName::new(name).unwrap(), value)
    }

    #[test]
    fn what_is_set_holds_over_the_file_and_over_a_restart() {
        let directory = tempfile::tempdir().unwrap();
        let configuration =
            configured(directory.path(), "connect = \"udpin:0.0.0.0:1\"\nbuffer = 6\n");
        let mut own = Own::new(configuration.clone(), directory.path()).unwrap();
        assert_eq!(value(&own, "QUAV_BUFFER"), 6.0);
        assert_eq!(set(&mut own, "QUAV_BUFFER", 7.1), Ok(true));
        assert_eq!(set(&mut own, "QUAV_BUFFER", 7.1), Ok(false), "the same again");
        assert_eq!(set(&mut own, "QUAV_POLICY", 2.0), Ok(true));
        assert_eq!(set(&mut own, "QUAV_ENABLE", 0.0), Ok(true));
        drop(own);
        let own = Own::new(configuration, directory.path()).unwrap();
        assert_eq!(value(&own, "QUAV_BUFFER"), 7.1);
        assert_eq!(own.options.service.policy, Policy::Manual);
        assert!(!own.options.service.enable);
    }

    #[test]
    fn what_is_out_of_range_changes_nothing_and_says_why() {
        let directory = tempfile::tempdir().unwrap();
        let text = "connect = \"udpin:0.0.0.0:1\"\n";
        let mut own = Own::new(configured(directory.path(), text), directory.path()).unwrap();
        for (name, bad) in [
            ("QUAV_BUFFER", -1.0),
            ("QUAV_BUFFER", f32::NAN),
            ("QUAV_QUBITS", 1.0),
            ("QUAV_QUBITS", 20.5),
            ("QUAV_POLICY", 3.0),
            ("QUAV_ENABLE", 2.0),
        ] {
            assert!(set(&mut own, name, bad).is_err(), "{name} {bad}");
        }
        assert_eq!(set(&mut own, "ATC_RAT_RLL_P", 1.0), Ok(false), "not ours");
        assert_eq!((value(&own, "QUAV_BUFFER"), value(&own, "QUAV_QUBITS")), (5.0, 20.0));
    }

    #[test]
    fn the_list_is_complete_numbered_and_named_once() {
        let directory = tempfile::tempdir().unwrap();
        let text = "connect = \"udpin:0.0.0.0:1\"\n";
        let own = Own::new(configured(directory.path(), text), directory.path()).unwrap();
        let all: Vec<_> = own.all().collect();
        assert_eq!(all.len(), PARAMETERS.len());
        let mut names: Vec<_> = all.iter().map(|value| value.name).collect();
        names.dedup();
        assert_eq!(names.len(), PARAMETERS.len());
        let numbered = (0..).zip(&all);
        assert!(numbered.into_iter().all(|(k, v)| v.index == k && v.count as usize == all.len()));
    }
}
