//! A [`Device`] out of the two documents of IBM's REST API: `GET /backends/{name}/configuration` (which
//! gates join which qubits) and `GET /backends/{name}/properties` (the calibration of the day).
//!
//! Both are hostile until parsed. Values may be missing, null, `Infinity` (which is no JSON) or out of
//! range; a gate, coupler or readout whose error is unknown, is 1 or more, or that is marked as not
//! operational is left out of the device, never guessed.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer};
use serde_json::Value;
use thiserror::Error;

use super::device::{
    Calibration, Device, Entangler, Nanoseconds, PhysicalQubit, QubitCalibration, Readout,
};

/// The largest device that is believed; IBM's largest has 1121 qubits.
pub const MAX_QUBITS: usize = 2_000;
/// The most couplers or gate calibrations that are believed.
const MAX_ENTRIES: usize = 50_000;
/// Longer gates and times than this (a second) are no calibration.
const MAX_LENGTH: f64 = 1e9;

/// Documents that describe no device.
#[derive(Debug, Error)]
pub enum DeviceError {
    /// Not the JSON that IBM documents.
    #[error("the {document} document of the backend is malformed: {source}")]
    Malformed {
        /// `configuration` or `properties`.
        document: &'static str,
        /// Where and why.
        source: serde_json::Error,
    },
    /// The service answered `null`: it has no calibration data for this backend.
    #[error(
        "the backend's {document} document is empty, so no line of qubits can be chosen on it; try \
         another backend (quavd ibm backends lists them)"
    )]
    Empty {
        /// `configuration` or `properties`.
        document: &'static str,
    },
    /// More than any device has.
    #[error("the {document} document lists {count} {what}; at most {limit} are accepted")]
    TooMany {
        /// `configuration` or `properties`.
        document: &'static str,
        /// What was counted.
        what: &'static str,
        /// How many were given.
        count: usize,
        /// The bound.
        limit: usize,
    },
    /// The device lacks what every circuit needs.
    #[error(
        "{name} has the native gates {basis:?}, but quavd needs rz, sx, x and one of ecr, cz, rzz; \
         choose another backend"
    )]
    Basis {
        /// The backend.
        name: String,
        /// Its gates.
        basis: Vec<String>,
    },
}

#[derive(Deserialize)]
struct ConfigurationDocument {
    backend_name: String,
    n_qubits: usize,
    basis_gates: Vec<String>,
    #[serde(default)]
    gates: Vec<GateDocument>,
    #[serde(default)]
    coupling_map: Option<Vec<(u32, u32)>>,
    #[serde(default, deserialize_with = "lenient_number")]
    default_rep_delay: Option<f64>,
}

#[derive(Deserialize)]
struct GateDocument {
    name: String,
    #[serde(default)]
    coupling_map: Option<Vec<Vec<u32>>>,
}

#[derive(Deserialize)]
struct PropertiesDocument {
    #[serde(default, deserialize_with = "lenient_text")]
    last_update_date: Option<String>,
    #[serde(default)]
    qubits: Vec<Vec<ValueDocument>>,
    #[serde(default)]
    gates: Vec<GateProperties>,
}

#[derive(Deserialize)]
struct GateProperties {
    gate: String,
    qubits: Vec<u32>,
    #[serde(default)]
    parameters: Vec<ValueDocument>,
}

/// IBM's `Nduv`: name, date, unit, value.
#[derive(Deserialize)]
struct ValueDocument {
    name: String,
    #[serde(default)]
    unit: Option<String>,
    #[serde(default, deserialize_with = "lenient_number")]
    value: Option<f64>,
}

/// Anything but a finite number is no value.
fn lenient_number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    Ok(Value::deserialize(deserializer)?.as_f64().filter(|value| value.is_finite()))
}

/// Anything but a text is no text.
fn lenient_text<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<String>, D::Error> {
    Ok(Value::deserialize(deserializer)?.as_str().map(str::to_owned))
}

impl Device {
    /// Reads the bodies of `GET /backends/{name}/configuration` and `…/properties`.
    ///
    /// # Errors
    /// If a document is malformed, empty or absurdly large, or the device lacks the gates.
    pub fn parse(configuration: &str, properties: &str) -> Result<Self, DeviceError> {
        let configuration: ConfigurationDocument = document("configuration", configuration)?;
        let properties: PropertiesDocument = document("properties", properties)?;
        check_sizes(&configuration, &properties)?;

        let basis: BTreeSet<&str> = configuration.basis_gates.iter().map(String::as_str).collect();
        let calibrations = GateCalibrations::new(&properties.gates);
        let has_rx = basis.contains("rx");
        let qubits: Vec<QubitCalibration> = (0..configuration.n_qubits)
            .map(|index| {
                let values = properties.qubits.get(index).map_or(&[][..], Vec::as_slice);
                qubit(values, index as u32, &calibrations, has_rx)
            })
            .collect();

        let mut couplers = BTreeMap::new();
        for entangler in Entangler::ALL {
            if !basis.contains(entangler.name()) {
                continue;
            }
            let usable: BTreeMap<_, _> = pairs(&configuration, entangler)
                .filter(|&(a, b)| {
                    let works = |q: u32| qubits.get(q as usize).is_some_and(|q| q.usable());
                    a != b && works(a) && works(b)
                })
                .filter_map(|(a, b)| {
                    let calibration = calibrations.of(entangler.name(), &[a, b])?;
                    Some(((PhysicalQubit(a), PhysicalQubit(b)), calibration))
                })
                .collect();
            if !usable.is_empty() {
                couplers.insert(entangler, usable);
            }
        }
        let one_qubit = ["rz", "sx", "x"].iter().all(|gate| basis.contains(gate));
        let two_qubit = Entangler::ALL.iter().any(|gate| basis.contains(gate.name()));
        if !(one_qubit && two_qubit) {
            let basis = configuration.basis_gates;
            return Err(DeviceError::Basis { name: configuration.backend_name, basis });
        }

        Ok(Self {
            name: configuration.backend_name,
            calibrated: properties.last_update_date,
            couplers,
            has_rx: has_rx && qubits.iter().all(|qubit| !qubit.usable() || qubit.rx.is_some()),
            qubits,
            rep_delay: configuration
                .default_rep_delay
                .filter(|&delay| delay >= 0.0)
                .map(|microseconds| Nanoseconds(microseconds * 1e3)),
        })
    }
}

fn document<T: DeserializeOwned>(document: &'static str, text: &str) -> Result<T, DeviceError> {
    let malformed = |source| DeviceError::Malformed { document, source };
    let parsed: Option<T> = serde_json::from_str(&without_infinities(text)).map_err(malformed)?;
    parsed.ok_or(DeviceError::Empty { document })
}

fn check_sizes(
    configuration: &ConfigurationDocument,
    properties: &PropertiesDocument,
) -> Result<(), DeviceError> {
    let of_gates = configuration.gates.iter().filter_map(|gate| gate.coupling_map.as_ref());
    let pairs = configuration.coupling_map.as_ref().map_or(0, Vec::len)
        + of_gates.map(Vec::len).sum::<usize>();
    let counts = [
        ("configuration", "qubits", configuration.n_qubits, MAX_QUBITS),
        ("configuration", "couplers", pairs, MAX_ENTRIES),
        ("properties", "qubits", properties.qubits.len(), MAX_QUBITS),
        ("properties", "gates", properties.gates.len(), MAX_ENTRIES),
    ];
    match counts.into_iter().find(|&(_, _, count, limit)| count > limit) {
        Some((document, what, count, limit)) => {
            Err(DeviceError::TooMany { document, what, count, limit })
        }
        None => Ok(()),
    }
}

/// The ordered pairs the configuration allows for a gate: its own list, or the device's coupling map.
fn pairs(
    configuration: &ConfigurationDocument,
    entangler: Entangler,
) -> impl Iterator<Item = (u32, u32)> + '_ {
    let own = configuration
        .gates
        .iter()
        .find(|gate| gate.name == entangler.name())
        .and_then(|gate| gate.coupling_map.as_ref());
    let shared =
        configuration.coupling_map.iter().flatten().copied().filter(move |_| own.is_none());
    own.into_iter()
        .flatten()
        .filter_map(|pair| match pair[..] {
            [a, b] => Some((a, b)),
            _ => None,
        })
        .chain(shared)
}

/// `properties.gates` by gate name and qubits.
struct GateCalibrations<'a>(BTreeMap<(&'a str, &'a [u32]), Calibration>);

impl<'a> GateCalibrations<'a> {
    fn new(gates: &'a [GateProperties]) -> Self {
        let working = gates.iter().filter_map(|gate| {
            let error = probability(&gate.parameters, "gate_error").filter(|&error| error < 1.0)?;
            let length = length(&gate.parameters, "gate_length");
            operational(&gate.parameters).then_some((
                (gate.gate.as_str(), gate.qubits.as_slice()),
                Calibration { error, length },
            ))
        });
        Self(working.collect())
    }

    fn of(&self, gate: &str, qubits: &[u32]) -> Option<Calibration> {
        self.0.get(&(gate, qubits)).copied()
    }
}

fn qubit(
    values: &[ValueDocument],
    index: u32,
    calibrations: &GateCalibrations<'_>,
    has_rx: bool,
) -> QubitCalibration {
    if !operational(values) {
        return QubitCalibration::default();
    }
    let readout =
        probability(values, "readout_error").filter(|&error| error < 1.0).map(|error| Readout {
            error,
            one_for_zero: probability(values, "prob_meas1_prep0").unwrap_or(error),
            zero_for_one: probability(values, "prob_meas0_prep1").unwrap_or(error),
            length: length(values, "readout_length"),
        });
    let works = |gate| calibrations.of(gate, &[index]);
    QubitCalibration {
        sx: works("sx").filter(|_| works("x").is_some()),
        rx: works("rx").filter(|_| has_rx),
        readout,
    }
}

fn value<'a>(values: &'a [ValueDocument], name: &str) -> Option<(&'a ValueDocument, f64)> {
    values.iter().find(|value| value.name == name).and_then(|found| Some((found, found.value?)))
}

/// A number in [0, 1].
fn probability(values: &[ValueDocument], name: &str) -> Option<f64> {
    value(values, name).map(|(_, value)| value).filter(|value| (0.0..=1.0).contains(value))
}

fn length(values: &[ValueDocument], name: &str) -> Option<Nanoseconds> {
    let (document, value) = value(values, name)?;
    let factor = match document.unit.as_deref() {
        Some("ns") => 1.0,
        Some("us" | "µs" | "μs") => 1e3,
        Some("ms") => 1e6,
        Some("s") => 1e9,
        _ => return None,
    };
    let length = value * factor;
    (0.0..=MAX_LENGTH).contains(&length).then_some(Nanoseconds(length))
}

/// IBM marks what is switched off with a parameter `operational` of 0.
fn operational(values: &[ValueDocument]) -> bool {
    value(values, "operational").is_none_or(|(_, value)| value != 0.0)
}

/// Python's `json` writes `Infinity`, `-Infinity` and `NaN`, which JSON does not have: null instead.
fn without_infinities(text: &str) -> Cow<'_, str> {
    const WORDS: [&str; 3] = ["-Infinity", "Infinity", "NaN"];
    if !WORDS.iter().any(|word| text.contains(word)) {
        return Cow::Borrowed(text);
    }
    let mut clean = String::with_capacity(text.len());
    let (mut in_string, mut rest) = (false, text);
    while let Some(next) = rest.chars().next() {
        if !in_string && let Some(word) = WORDS.iter().find(|word| rest.starts_with(**word)) {
            clean.push_str("null");
            rest = &rest[word.len()..];
            continue;
        }
        let mut taken = next.len_utf8();
        if in_string && next == '\\' {
            taken += rest[taken..].chars().next().map_or(0, char::len_utf8);
        } else if next == '"' {
            in_string = !in_string;
        }
        clean.push_str(&rest[..taken]);
        rest = &rest[taken..];
    }
    Cow::Owned(clean)
}

#[cfg(test)]
mod tests;
