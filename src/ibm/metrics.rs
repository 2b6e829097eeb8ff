//! What a circuit costs: gates, depths, how long one shot takes and how likely it is to go without an
//! error.

use super::circuit::{Circuit, Gate};
use super::device::{Device, Nanoseconds};

/// Counts and figures of one circuit; rotations about Z are virtual and count nowhere but in `depth`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Metrics {
    /// ECR, CZ or RZZ gates.
    pub two_qubit_gates: usize,
    /// Longest chain of two-qubit gates.
    pub two_qubit_depth: usize,
    /// `sx`, `x` and `rx` gates.
    pub pulses: usize,
    /// Rotations about Z.
    pub virtual_gates: usize,
    /// Longest chain of gates of any kind, without the measurement (qiskit's `depth`).
    pub depth: usize,
    /// From the first gate to the end of the readout, every gate as early as it can be; `None` where
    /// the device does not say how long a gate takes.
    pub duration: Option<Nanoseconds>,
    /// Π (1 − error) over all gates and readouts on the line's qubits.
    pub success: f64,
}

impl Metrics {
    /// The figures of `circuit` on the device its line belongs to.
    #[must_use]
    pub fn of(circuit: &Circuit, device: &Device) -> Self {
        let qubits = circuit.line().qubits();
        let entangler = circuit.line().native().entangler;
        let gates = circuit.gates();
        let mut metrics = Self {
            two_qubit_gates: 0,
            two_qubit_depth: two_qubit_depth(gates, qubits.len()),
            pulses: 0,
            virtual_gates: 0,
            depth: depth(gates, qubits.len(), |_| true),
            duration: None,
            success: 1.0,
        };
        // When each qubit is free again, as long as all lengths are known.
        let mut free = Some(vec![0.0_f64; qubits.len()]);
        for gate in gates {
            let calibration = match gate {
                Gate::Rz(..) => {
                    metrics.virtual_gates += 1;
                    continue;
                }
                Gate::Sx(q) | Gate::X(q) => {
                    metrics.pulses += 1;
                    device.qubit(qubits[*q]).and_then(|qubit| qubit.sx)
                }
                Gate::Rx(q, _) => {
                    metrics.pulses += 1;
                    device.qubit(qubits[*q]).and_then(|qubit| qubit.rx)
                }
                Gate::Ecr(a, b) | Gate::Cz(a, b) | Gate::Rzz(a, b, _) => {
                    metrics.two_qubit_gates += 1;
                    device.coupler(entangler, qubits[*a], qubits[*b])
                }
            };
            metrics.success *= calibration.map_or(0.0, |calibration| 1.0 - calibration.error);
            let length = calibration.and_then(|calibration| calibration.length);
            free = free.zip(length).map(|(mut free, length)| {
                let (a, b) = gate.qubits();
                let end = free[a].max(free[b]) + length.0;
                free[a] = end;
                free[b] = end;
                free
            });
        }
        let mut readout_length = Some(0.0_f64);
        for &qubit in qubits {
            let readout = device.qubit(qubit).and_then(|qubit| qubit.readout);
            metrics.success *= readout.map_or(0.0, |readout| 1.0 - readout.error);
            let length = readout.and_then(|readout| readout.length);
            readout_length =
                readout_length.zip(length).map(|(longest, length)| longest.max(length.0));
        }
        metrics.duration = free
            .zip(readout_length)
            .map(|(free, readout)| Nanoseconds(free.into_iter().fold(0.0, f64::max) + readout));
        metrics
    }
}

/// Longest chain of two-qubit gates.
pub(super) fn two_qubit_depth(gates: &[Gate], qubits: usize) -> usize {
    depth(gates, qubits, |gate| {
        let (a, b) = gate.qubits();
        a != b
    })
}

fn depth(gates: &[Gate], qubits: usize, counts: impl Fn(&Gate) -> bool) -> usize {
    let mut depths = vec![0; qubits];
    for gate in gates {
        let (a, b) = gate.qubits();
        let depth = depths[a].max(depths[b]) + usize::from(counts(gate));
        depths[a] = depth;
        depths[b] = depth;
    }
    depths.into_iter().max().unwrap_or(0)
}
