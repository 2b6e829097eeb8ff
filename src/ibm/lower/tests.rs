use super::*;
use crate::ibm::metrics::Metrics;
use crate::ibm::samples::device;

fn chain() -> ChainIsing {
    let h = (0..20).map(|i| 0.05 * ((i * 7 % 11) as f64 - 5.2)).collect();
    let j = (1..20).map(|i| 0.05 * ((i * 5 % 13) as f64 - 6.3)).collect();
    ChainIsing::new(0.0, h, j).unwrap()
}

#[test]
fn twenty_qubits_and_five_layers_stay_within_the_figures() {
    let (kyiv, angles) = (device("kyiv"), Angles::ramp(5));
    for (binding, pulses) in [(Binding::Bound(&angles), 260), (Binding::Inputs(5), 300)] {
        let metrics = Metrics::of(&lower(&kyiv, &chain(), binding).unwrap(), &kyiv);
        assert_eq!((metrics.two_qubit_gates, metrics.two_qubit_depth), (174, 20));
        assert!(metrics.pulses <= pulses, "{metrics:?}");
        assert!(metrics.duration.unwrap().0 < 15_100.0, "{metrics:?}");
    }
}

#[test]
fn a_heron_uses_the_gate_that_fails_least() {
    let (kingston, angles) = (device("kingston"), Angles::ramp(5));
    let circuit = lower(&kingston, &chain(), Binding::Bound(&angles)).unwrap();
    assert_eq!(circuit.line().native().entangler, Entangler::Rzz);
    let metrics = Metrics::of(&circuit, &kingston);
    assert_eq!((metrics.two_qubit_gates, metrics.two_qubit_depth), (95, 10));
    // |+⟩ and five mixers, one rx each.
    assert_eq!(metrics.pulses, 120);
    for gate in circuit.gates() {
        if let Gate::Rzz(_, _, angle) = gate {
            let angle = angle.number().unwrap();
            assert!((0.0..=std::f64::consts::FRAC_PI_2).contains(&angle), "{angle}");
        }
    }
    let open = lower(&kingston, &chain(), Binding::Inputs(5)).unwrap();
    assert_eq!(open.line().native().entangler, Entangler::Cz);
    assert_eq!(lower_on(circuit.line(), &chain(), Binding::Inputs(5)), Err(LowerError::UnboundRzz));
}

#[test]
fn parameters_are_named_in_the_order_of_their_names() {
    let circuit = lower(&device("kyiv"), &chain(), Binding::Inputs(12)).unwrap();
    let names: Vec<String> =
        circuit.parameter_values(&Angles::ramp(12)).into_iter().map(|(name, _)| name).collect();
    assert!(names.is_sorted() && names.len() == 24);
    assert_eq!((names[10].as_str(), names[12].as_str()), ("b10", "g00"));
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let kyiv = device("kyiv");
    assert_eq!(
        lower(&kyiv, &chain(), Binding::Inputs(101)),
        Err(LowerError::TooManyLayers { layers: 101 })
    );
    let line = choose_line(&kyiv, Entangler::Ecr, &chain(), Binding::Inputs(1)).unwrap();
    let short = ChainIsing::new(0.0, vec![1.0; 2], vec![1.0]).unwrap();
    assert_eq!(
        lower_on(&line, &short, Binding::Inputs(1)),
        Err(LowerError::Length { line: 20, chain: 2 })
    );
}
