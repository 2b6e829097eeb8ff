use proptest::prelude::*;
use serde_json::{Value, json};

use super::*;
use crate::ibm::samples::device;

#[test]
fn an_eagle_is_read_as_its_documents_say() {
    let kyiv = device("kyiv");
    assert_eq!(kyiv.name(), "ibm_kyiv");
    assert_eq!(kyiv.calibrated(), Some("2025-02-26T11:02:56-05:00"));
    assert_eq!(kyiv.qubits().len(), 127);
    assert_eq!(kyiv.entanglers().collect::<Vec<_>>(), [Entangler::Ecr]);
    // 144 couplers, of which five are marked faulty by an error of 1.
    assert_eq!(kyiv.couplers(Entangler::Ecr).count(), 139);
    let coupler = |a, b| kyiv.coupler(Entangler::Ecr, PhysicalQubit(a), PhysicalQubit(b));
    assert_eq!(coupler(80, 79), None);
    let ecr = coupler(96, 95).unwrap();
    assert!((ecr.error - 0.008_289_66).abs() < 1e-8);
    assert!((ecr.length.unwrap().0 - 561.777_8).abs() < 1e-3);
    assert_eq!(coupler(95, 96), None);
    let readout = kyiv.qubit(PhysicalQubit(0)).unwrap().readout.unwrap();
    assert_eq!((readout.one_for_zero, readout.zero_for_one), (0.0078125, 0.00634765625));
    assert_eq!(kyiv.rep_delay(), Some(Nanoseconds(250_000.0)));
    assert!(!kyiv.has_rx());
}

#[test]
fn a_heron_has_both_directions_and_fractional_gates() {
    let kingston = device("kingston");
    assert_eq!(kingston.entanglers().collect::<Vec<_>>(), [Entangler::Rzz, Entangler::Cz]);
    assert!(kingston.has_rx());
    for (a, b, calibration) in kingston.couplers(Entangler::Cz) {
        assert_eq!(kingston.coupler(Entangler::Cz, b, a), Some(calibration));
    }
    let nighthawk = device("nighthawk");
    assert_eq!(nighthawk.entanglers().collect::<Vec<_>>(), [Entangler::Cz]);
    assert!(!nighthawk.has_rx());
}

/// Three qubits in a row with ECR 0 → 1 and 2 → 1.
fn small() -> (Value, Value) {
    let configuration = json!({
        "backend_name": "ibm_small", "n_qubits": 3, "basis_gates": ["ecr", "rz", "sx", "x"],
        "coupling_map": [[0, 1], [2, 1]], "dt": 0.5, "default_rep_delay": 250.0,
    });
    let value =
        |name: &str, unit: &str, value: f64| json!({"name": name, "unit": unit, "value": value});
    let qubit = json!([
        value("T1", "us", 100.0),
        value("readout_error", "", 0.01),
        value("readout_length", "ns", 1000.0)
    ]);
    let mut gates = Vec::new();
    for gate in ["sx", "x"] {
        for index in 0..3 {
            let parameters = [value("gate_error", "", 1e-4), value("gate_length", "ns", 50.0)];
            gates.push(json!({"gate": gate, "qubits": [index], "parameters": parameters}));
        }
    }
    for pair in [[0, 1], [2, 1]] {
        let parameters = [value("gate_error", "", 0.01), value("gate_length", "ns", 500.0)];
        gates.push(json!({"gate": "ecr", "qubits": pair, "parameters": parameters}));
    }
    (configuration, json!({"qubits": [qubit, qubit, qubit], "gates": gates}))
}

fn couplers(configuration: &Value, properties: &str) -> Vec<(u32, u32)> {
    let device = Device::parse(&configuration.to_string(), properties).unwrap();
    device.couplers(Entangler::Ecr).map(|(a, b, _)| (a.0, b.0)).collect()
}

#[test]
fn what_is_faulty_or_unknown_is_left_out() {
    let (configuration, properties) = small();
    assert_eq!(couplers(&configuration, &properties.to_string()), [(0, 1), (2, 1)]);

    let mut faulty = properties.clone();
    faulty["gates"][6]["parameters"][0]["value"] = json!(1.0);
    assert_eq!(couplers(&configuration, &faulty.to_string()), [(2, 1)]);

    let mut unknown = properties.clone();
    unknown["gates"][7]["parameters"] = json!([]);
    assert_eq!(couplers(&configuration, &unknown.to_string()), [(0, 1)]);

    for error in ["null", "Infinity", "-Infinity", "NaN", "-0.1", "1e999", "\"a lot\""] {
        let mut marked = properties.clone();
        marked["qubits"][2][1]["value"] = json!("MARK");
        let text = marked.to_string().replace("\"MARK\"", error);
        if error == "1e999" {
            let malformed = Device::parse(&configuration.to_string(), &text);
            assert!(matches!(malformed, Err(DeviceError::Malformed { .. })));
        } else {
            assert_eq!(couplers(&configuration, &text), [(0, 1)], "readout error {error}");
        }
    }

    let mut off = properties.clone();
    off["gates"][6]["parameters"][1] = json!({"name": "operational", "unit": "", "value": 0});
    assert_eq!(couplers(&configuration, &off.to_string()), [(2, 1)]);
    let mut off = properties.clone();
    off["qubits"][0][0] = json!({"name": "operational", "unit": "", "value": 0});
    assert_eq!(couplers(&configuration, &off.to_string()), [(2, 1)]);

    let mut odd = configuration.clone();
    odd["coupling_map"] = json!([[0, 1], [2, 2], [1, 700], [4_000_000_000_u32, 0]]);
    assert_eq!(couplers(&odd, &properties.to_string()), [(0, 1)]);
}

#[test]
fn an_infinity_inside_a_text_stays_a_text() {
    let text = r#"{"a": Infinity, "b": "NaN \" Infinity", "c": [-Infinity, NaN]}"#;
    let clean = r#"{"a": null, "b": "NaN \" Infinity", "c": [null, null]}"#;
    assert_eq!(without_infinities(text), clean);
}

#[test]
fn documents_that_describe_no_device_are_refused() {
    let (configuration, properties) = small();
    let parse = |configuration: &Value, properties: &Value| {
        Device::parse(&configuration.to_string(), &properties.to_string())
    };
    assert!(matches!(
        parse(&configuration, &Value::Null),
        Err(DeviceError::Empty { document: "properties" })
    ));
    assert!(matches!(
        Device::parse("<html>", &properties.to_string()),
        Err(DeviceError::Malformed { document: "configuration", .. })
    ));
    let mut huge = configuration.clone();
    huge["n_qubits"] = json!(1_000_000_000_u64);
    assert!(matches!(parse(&huge, &properties), Err(DeviceError::TooMany { .. })));
    let mut other = configuration.clone();
    other["basis_gates"] = json!(["cx", "u3"]);
    let refused = parse(&other, &properties).unwrap_err().to_string();
    assert!(refused.contains("ibm_small") && refused.contains("cx"), "{refused}");
}

proptest! {
    #[test]
    fn no_damage_to_a_document_makes_it_panic(
        place in 0.0..1.0_f64,
        length in 0_usize..40,
        put in "[0-9a-z\",:\\[\\]{}. -]{0,12}",
    ) {
        let (configuration, properties) = small();
        let (configuration, properties) = (configuration.to_string(), properties.to_string());
        let damaged = |text: &str| {
            let start = (place * text.len() as f64) as usize;
            let end = (start + length).min(text.len());
            format!("{}{put}{}", &text[..start], &text[end..])
        };
        let _ = Device::parse(&damaged(&configuration), &properties);
        let _ = Device::parse(&configuration, &damaged(&properties));
    }
}
