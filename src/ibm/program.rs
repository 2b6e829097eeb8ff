//! What is asked of the service and how its answer is read: the payload of a job. [`Sampler`] is the
//! program of today; IBM has announced `executor`, which would be a second [`Program`].

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::{Map, Value, json};
use thiserror::Error;

use crate::qaoa::Bits;
use crate::qaoa::engine::Sample;

/// The classical register that quavd's circuits measure into: bit `q` is qubit `q` of the chain.
pub const REGISTER: &str = "c";

/// One circuit with its parameters ("primitive unified bloc").
#[derive(Debug, Clone, PartialEq)]
pub struct Pub {
    /// OpenQASM 3.
    pub qasm: String,
    /// A value for each of its inputs.
    pub values: Vec<(String, f64)>,
    /// Bits measured.
    pub bits: usize,
}

/// A result that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct ResultError(pub String);

/// A program of the service that samples circuits.
pub trait Program {
    /// Its `program_id`.
    fn id(&self) -> &'static str;

    /// The `params` of a job that measures each circuit `shots` times.
    fn params(&self, pubs: &[Pub], shots: u32) -> Value;

    /// Bytes that the results have at most.
    fn result_limit(&self, pubs: &[Pub], shots: u32) -> usize;

    /// What each circuit was measured to be: distinct bitstrings in ascending order.
    ///
    /// # Errors
    /// [`ResultError`] where anything is not as it was asked for; nothing is guessed.
    fn decode(
        &self,
        body: &[u8],
        pubs: &[Pub],
        shots: u32,
    ) -> Result<Vec<Vec<Sample>>, ResultError>;
}

/// Sampler V2, with plain results (`support_qiskit: false`): one hexadecimal number a shot.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sampler;

#[derive(Deserialize)]
struct Results {
    results: Vec<PubResult>,
}

#[derive(Deserialize)]
struct PubResult {
    data: BTreeMap<String, Register>,
}

#[derive(Deserialize)]
struct Register {
    samples: Vec<String>,
    num_bits: usize,
}

impl Program for Sampler {
    fn id(&self) -> &'static str {
        "sampler"
    }

    fn params(&self, pubs: &[Pub], shots: u32) -> Value {
        let pubs: Vec<Value> = pubs
            .iter()
            .map(|Pub { qasm, values, .. }| {
                // By name: positional values would be bound in the order of sorted names.
                let values: Map<String, Value> =
                    values.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
                let values = if values.is_empty() { Value::Null } else { Value::Object(values) };
                json!([qasm, values, shots])
            })
            .collect();
        json!({
            "version": 2,
            "support_qiskit": false,
            "pubs": pubs,
            "options": {
                // Idle qubits are kept from dephasing. Readout is not twirled: mitigation knows how
                // often each qubit is read wrongly from 0 and from 1.
                "dynamical_decoupling": { "enable": true, "sequence_type": "XY4" },
                "twirling": { "enable_gates": false, "enable_measure": false },
            },
        })
    }

    fn result_limit(&self, pubs: &[Pub], shots: u32) -> usize {
        // `"0x…",` with a space, and twice that for what is not expected.
        let shot = |bits: usize| bits.div_ceil(4) + 6;
        let shots = shots as usize;
        pubs.iter().map(|one| 4096 + 2 * shots * shot(one.bits)).sum::<usize>() + 65_536
    }

    fn decode(
        &self,
        body: &[u8],
        pubs: &[Pub],
        shots: u32,
    ) -> Result<Vec<Vec<Sample>>, ResultError> {
        let Results { results } =
            serde_json::from_slice(body).map_err(|error| ResultError(error.to_string()))?;
        if results.len() != pubs.len() {
            let (found, asked) = (results.len(), pubs.len());
            return Err(ResultError(format!("{found} results for {asked} circuits")));
        }
        results
            .into_iter()
            .zip(pubs)
            .enumerate()
            .map(|(index, (PubResult { mut data }, one))| {
                let failed = |why: String| ResultError(format!("circuit {index}: {why}"));
                let register = data
                    .remove(REGISTER)
                    .ok_or_else(|| failed(format!("there is no register {REGISTER:?}")))?;
                if register.num_bits != one.bits {
                    let (found, asked) = (register.num_bits, one.bits);
                    return Err(failed(format!("{found} bits for {asked} qubits")));
                }
                if register.samples.len() != shots as usize {
                    let found = register.samples.len();
                    return Err(failed(format!("{found} samples for {shots} shots")));
                }
                counted(&register.samples, one.bits).map_err(failed)
            })
            .collect()
    }
}

/// How often each bitstring occurs.
fn counted(samples: &[String], bits: usize) -> Result<Vec<Sample>, String> {
    let mut counts: BTreeMap<Bits, u32> = BTreeMap::new();
    for text in samples {
        let bits = hexadecimal(text, bits).ok_or_else(|| {
            format!("{:?} is no hexadecimal number of {bits} bits", super::client::visible(text))
        })?;
        *counts.entry(bits).or_default() += 1;
    }
    Ok(counts.into_iter().map(|(bits, count)| Sample { bits, count }).collect())
}

/// `0x…` as bits: bit `q` of the number is qubit `q`.
fn hexadecimal(text: &str, len: usize) -> Option<Bits> {
    let digits = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X"))?;
    if digits.is_empty() || digits.len() > len.div_ceil(4) + 64 {
        return None;
    }
    let mut bits = Bits::zeros(len);
    for (place, digit) in digits.bytes().rev().enumerate() {
        let digit = (digit as char).to_digit(16)?;
        for k in (0..4).filter(|k| digit >> k & 1 == 1) {
            let qubit = 4 * place + k;
            if qubit >= len {
                return None;
            }
            bits.set(qubit, true);
        }
    }
    Some(bits)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn one(bits: usize) -> Vec<Pub> {
        vec![Pub { qasm: String::new(), values: vec![], bits }]
    }

    fn body(samples: &str, bits: usize) -> String {
        format!(
            r#"{{"results":[{{"data":{{"c":{{"samples":[{samples}],"num_bits":{bits}}}}},
                "metadata":{{}}}}],"metadata":{{"version":2}}}}"#
        )
    }

    #[test]
    fn the_least_significant_bit_is_qubit_zero() {
        let decoded = Sampler.decode(body(r#""0x3","0x0","0x1""#, 2).as_bytes(), &one(2), 3);
        let counts: Vec<(String, u32)> =
            decoded.unwrap()[0].iter().map(|s| (s.bits.to_string(), s.count)).collect();
        assert_eq!(counts, [("00".into(), 1), ("10".into(), 1), ("11".into(), 1)]);
    }

    #[test]
    fn what_was_not_asked_for_is_refused() {
        let decode = |text: &str, bits, shots| Sampler.decode(text.as_bytes(), &one(bits), shots);
        let text = |error: Result<_, ResultError>| error.unwrap_err().to_string();
        let fine = body(r#""0x3""#, 2);
        assert!(decode(&fine, 2, 1).is_ok());
        assert!(text(decode(&fine, 3, 1)).contains("2 bits for 3 qubits"));
        assert!(text(decode(&fine, 2, 2)).contains("1 samples for 2 shots"));
        assert!(text(decode(&body(r#""0x4""#, 2), 2, 1)).contains("no hexadecimal number"));
        assert!(text(decode(&body(r#""3""#, 2), 2, 1)).contains("no hexadecimal number"));
        assert!(text(decode(&body(r#""0x""#, 2), 2, 1)).contains("no hexadecimal number"));
        assert!(text(decode(r#"{"results":[]}"#, 2, 1)).contains("0 results for 1"));
        assert!(text(decode(&fine.replace("\"c\"", "\"d\""), 2, 1)).contains("no register"));
        assert!(decode(&fine[..fine.len() / 2], 2, 1).is_err());
    }

    #[test]
    fn values_go_by_name_and_a_bound_circuit_has_none() {
        let mut pubs = one(1);
        let params = Sampler.params(&pubs, 7);
        assert_eq!(params["pubs"][0], json!(["", null, 7]));
        assert_eq!(params["support_qiskit"], false);
        pubs[0].values = vec![("b00".to_owned(), 0.5)];
        assert_eq!(Sampler.params(&pubs, 7)["pubs"][0][1], json!({"b00": 0.5}));
    }

    proptest! {
        #[test]
        fn hexadecimal_numbers_of_any_width_survive(bits in prop::collection::vec(any::<bool>(), 1..200)) {
            let digits: String = bits
                .chunks(4)
                .map(|four| four.iter().enumerate().map(|(k, &b)| u32::from(b) << k).sum::<u32>())
                .map(|digit| char::from_digit(digit, 16).unwrap())
                .rev()
                .collect();
            let expected = Bits::from_fn(bits.len(), |qubit| bits[qubit]);
            prop_assert_eq!(hexadecimal(&format!("0x{digits}"), bits.len()), Some(expected));
        }

        #[test]
        fn no_body_makes_it_panic(body in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = Sampler.decode(&body, &one(3), 1);
        }
    }
}
