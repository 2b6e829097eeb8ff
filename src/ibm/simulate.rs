//! A statevector of native gates and of the plain circuit, for tests: the two are written independently
//! of each other and of `builder`.

use num_complex::Complex64;

use super::circuit::{Angle, Circuit, Gate};
use crate::qaoa::{Angles, ChainIsing};

/// Amplitudes; qubit q is binary digit q of the index.
pub(super) struct State {
    pub(super) amplitudes: Vec<Complex64>,
}

type Matrix = [[Complex64; 2]; 2];

fn c(re: f64, im: f64) -> Complex64 {
    Complex64::new(re, im)
}

fn rx(angle: f64) -> Matrix {
    let (sin, cos) = (angle / 2.0).sin_cos();
    [[c(cos, 0.0), c(0.0, -sin)], [c(0.0, -sin), c(cos, 0.0)]]
}

impl State {
    fn zeros(qubits: usize) -> Self {
        let mut amplitudes = vec![Complex64::ZERO; 1 << qubits];
        amplitudes[0] = Complex64::ONE;
        Self { amplitudes }
    }

    fn one(&mut self, qubit: usize, m: Matrix) {
        for index in (0..self.amplitudes.len()).filter(|index| index >> qubit & 1 == 0) {
            let other = index | 1 << qubit;
            let (zero, one) = (self.amplitudes[index], self.amplitudes[other]);
            self.amplitudes[index] = m[0][0] * zero + m[0][1] * one;
            self.amplitudes[other] = m[1][0] * zero + m[1][1] * one;
        }
    }

    fn diagonal(&mut self, phase: impl Fn(usize) -> f64) {
        for (index, amplitude) in self.amplitudes.iter_mut().enumerate() {
            *amplitude *= Complex64::cis(phase(index));
        }
    }

    /// qiskit's `ECRGate`: `(I⊗X − X⊗Y)/√2` with the control on the right.
    fn ecr(&mut self, control: usize, target: usize) {
        let before = self.amplitudes.clone();
        for (index, &amplitude) in before.iter().enumerate() {
            let bit = index >> control & 1;
            let flipped = index ^ 1 << control;
            let scaled = amplitude * std::f64::consts::FRAC_1_SQRT_2;
            self.amplitudes[index] -= amplitude;
            self.amplitudes[flipped] += scaled;
            // Y|0⟩ = i|1⟩, Y|1⟩ = −i|0⟩.
            let y = if bit == 0 { c(0.0, 1.0) } else { c(0.0, -1.0) };
            self.amplitudes[flipped ^ 1 << target] -= scaled * y;
        }
    }

    /// The circuit's state before the measurement.
    pub(super) fn of(circuit: &Circuit, angles: &Angles) -> Self {
        let mut state = Self::zeros(circuit.line().qubits().len());
        let value = |angle: &Angle| angle.value(angles);
        let z = |index: usize, qubit: usize| if index >> qubit & 1 == 0 { 1.0 } else { -1.0 };
        for gate in circuit.gates() {
            match gate {
                Gate::Rz(q, angle) => {
                    let half = value(angle) / 2.0;
                    state.diagonal(|index| -half * z(index, *q));
                }
                Gate::Sx(q) => state.one(*q, rx(std::f64::consts::FRAC_PI_2)),
                Gate::X(q) => state.one(*q, rx(std::f64::consts::PI)),
                Gate::Rx(q, angle) => state.one(*q, rx(value(angle))),
                Gate::Ecr(control, target) => state.ecr(*control, *target),
                Gate::Cz(a, b) => state.diagonal(|index| {
                    if index >> a & index >> b & 1 == 1 { std::f64::consts::PI } else { 0.0 }
                }),
                Gate::Rzz(a, b, angle) => {
                    let half = value(angle) / 2.0;
                    state.diagonal(|index| -half * z(index, *a) * z(index, *b));
                }
            }
        }
        state
    }

    /// `Π_l [ Π_i RX_i(2β_l) · exp(−iγ_l H) ] |+⟩^n` as the formulation has it.
    pub(super) fn plain(chain: &ChainIsing, angles: &Angles) -> Self {
        let qubits = chain.qubits();
        let amplitude = c((1.0 / (1_u64 << qubits) as f64).sqrt(), 0.0);
        let mut state = Self { amplitudes: vec![amplitude; 1 << qubits] };
        let z = |index: usize, qubit: usize| if index >> qubit & 1 == 0 { 1.0 } else { -1.0 };
        for (gamma, beta) in angles.gammas().iter().zip(angles.betas()) {
            state.diagonal(|index| {
                let fields: f64 = chain.h().iter().enumerate().map(|(i, h)| h * z(index, i)).sum();
                let bonds = chain.j().iter().enumerate();
                let bonds: f64 = bonds.map(|(i, j)| j * z(index, i) * z(index, i + 1)).sum();
                -gamma * (fields + bonds)
            });
            (0..qubits).for_each(|qubit| state.one(qubit, rx(2.0 * beta)));
        }
        state
    }

    /// Measurement probabilities.
    pub(super) fn probabilities(&self) -> Vec<f64> {
        self.amplitudes.iter().map(|amplitude| amplitude.norm_sqr()).collect()
    }
}
