//! Every lowering against the plain circuit.

use proptest::prelude::*;

use super::circuit::Circuit;
use super::device::{Entangler, Native, PhysicalQubit};
use super::line::{Direction, Line};
use super::lower::{Binding, lower_on};
use super::simulate::State;
use crate::qaoa::{Angles, ChainIsing};

fn line(native: Native, directions: &[bool]) -> Line {
    let direction = |&forward| if forward { Direction::Forward } else { Direction::Backward };
    Line {
        qubits: (0..=directions.len() as u32).map(PhysicalQubit).collect(),
        native,
        directions: directions.iter().map(direction).collect(),
        success: 1.0,
        proven: true,
    }
}

const NATIVES: [Native; 5] = [
    Native { entangler: Entangler::Ecr, has_rx: false },
    Native { entangler: Entangler::Ecr, has_rx: true },
    Native { entangler: Entangler::Cz, has_rx: false },
    Native { entangler: Entangler::Cz, has_rx: true },
    Native { entangler: Entangler::Rzz, has_rx: true },
];

/// A measured circuit may differ from the plain one by phases of basis states, so it is compared by
/// its probabilities: their Bhattacharyya coefficient is 1 exactly if they are equal.
fn fidelity(circuit: &Circuit, chain: &ChainIsing, angles: &Angles) -> f64 {
    let lowered = State::of(circuit, angles).probabilities();
    let plain = State::plain(chain, angles).probabilities();
    lowered.iter().zip(&plain).map(|(a, b)| (a * b).sqrt()).sum()
}

fn problems() -> impl Strategy<Value = (ChainIsing, Vec<bool>)> {
    let coefficient = || prop_oneof![4 => -2.0..2.0_f64, 1 => Just(0.0)];
    (1_usize..10).prop_flat_map(move |qubits| {
        (
            prop::collection::vec(coefficient(), qubits),
            prop::collection::vec(coefficient(), qubits - 1),
            prop::collection::vec(any::<bool>(), qubits - 1),
        )
            .prop_map(|(h, j, directions)| (ChainIsing::new(0.0, h, j).unwrap(), directions))
    })
}

fn circuits() -> impl Strategy<Value = Angles> {
    let angle = || prop_oneof![4 => -3.0..3.0_f64, 1 => Just(0.0), 1 => Just(0.5)];
    (1_usize..4).prop_flat_map(move |layers| {
        let angles = || prop::collection::vec(angle(), layers);
        (angles(), angles()).prop_map(|(gammas, betas)| Angles::new(gammas, betas).unwrap())
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn every_lowering_measures_what_the_plain_circuit_does(
        (chain, directions) in problems(),
        angles in circuits(),
    ) {
        for native in NATIVES {
            let line = line(native, &directions);
            let bound = lower_on(&line, &chain, Binding::Bound(&angles)).unwrap();
            let found = fidelity(&bound, &chain, &angles);
            prop_assert!((found - 1.0).abs() < 1e-9, "{native:?} bound: {found}");
            if native.entangler != Entangler::Rzz {
                let open = lower_on(&line, &chain, Binding::Inputs(angles.layers())).unwrap();
                let found = fidelity(&open, &chain, &angles);
                prop_assert!((found - 1.0).abs() < 1e-9, "{native:?} inputs: {found}");
            }
        }
    }
}
