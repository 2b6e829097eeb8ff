//! [`Turns`]: the one-qubit rotations between two neighbouring two-qubit gates of a qubit, merged into
//! as few pulses as possible. Rotations about Z are virtual and free; a pulse is `sx`, `x` or `rx`.
//!
//! Rotations with fixed angles between two parametrised ones multiply to one unitary, which takes
//! 0 (diagonal), 1 (θ = π/2 or π) or 2 pulses: `U = Rz(φ) Rx(θ) Rz(λ)` and
//! `Rx(θ) = Rz(π/2) √X Rz(θ + π) √X Rz(π/2)`, up to global phases. With every angle bound, the whole
//! run is one such unitary.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};

use num_complex::Complex64;

use super::circuit::{Angle, Gate};

/// Angles closer to a multiple of π/2 than this are that multiple: an infidelity of 1e-22.
const SAME_ANGLE: f64 = 1e-11;

/// One rotation.
#[derive(Debug, Clone, PartialEq)]
enum Turn {
    /// Fixed rotations, multiplied.
    Fixed(Unitary),
    /// `exp(−i θ/2 Z)`; the angle has parameters and no constant.
    Z(Angle),
    /// `exp(−i θ/2 X)` with parameters, where `rx` is native.
    X(Angle),
}

/// Rotations of one qubit in time order, not yet written as gates.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Turns {
    turns: Vec<Turn>,
    /// Nothing has happened to the qubit before: it is in |0⟩, where rotations about Z do nothing.
    fresh: bool,
    has_rx: bool,
}

impl Turns {
    /// The start of a qubit.
    pub(super) fn fresh(has_rx: bool) -> Self {
        Self { turns: Vec::new(), fresh: true, has_rx }
    }

    /// Rotates about Z.
    pub(super) fn z(&mut self, angle: &Angle) {
        self.fixed(Unitary::z(angle.constant));
        if angle.number().is_none() {
            self.parametrised_z(Angle { constant: 0.0, terms: angle.terms.clone() });
        }
    }

    /// Rotates about X.
    pub(super) fn x(&mut self, angle: &Angle) {
        self.fixed(Unitary::x(angle.constant));
        if angle.number().is_some() {
            return;
        }
        let varying = Angle { constant: 0.0, terms: angle.terms.clone() };
        if self.has_rx {
            match &mut self.turns[..] {
                [.., Turn::X(before), Turn::Fixed(between)] if between.is_about_x() => {
                    *before = before.clone().plus(&varying);
                }
                _ => self.turns.push(Turn::X(varying)),
            }
        } else {
            self.fixed(Unitary::hadamard());
            self.parametrised_z(varying);
            self.fixed(Unitary::hadamard());
        }
    }

    fn parametrised_z(&mut self, varying: Angle) {
        match &mut self.turns[..] {
            [.., Turn::Z(before), Turn::Fixed(between)] if between.is_diagonal() => {
                *before = before.clone().plus(&varying);
            }
            _ => self.turns.push(Turn::Z(varying)),
        }
    }

    fn fixed(&mut self, unitary: Unitary) {
        match self.turns.last_mut() {
            Some(Turn::Fixed(before)) => *before = unitary.after(before),
            _ => self.turns.push(Turn::Fixed(unitary)),
        }
    }

    /// Writes the gates, and is empty afterwards. A qubit that is `measured` next needs no phase.
    pub(super) fn write(&mut self, qubit: usize, measured: bool, gates: &mut Vec<Gate>) {
        let mut pulses = Pulses { qubit, gates, phase: Angle::default(), in_zero: self.fresh };
        for turn in self.turns.drain(..) {
            match turn {
                Turn::Z(angle) => pulses.rotate(&angle),
                Turn::X(angle) => pulses.pulse(Gate::Rx(qubit, angle)),
                Turn::Fixed(unitary) => pulses.unitary(&unitary, self.has_rx),
            }
        }
        if !measured {
            pulses.flush();
        }
        self.fresh = false;
    }
}

/// Writes one qubit's gates and keeps the phase that is still to come.
struct Pulses<'a> {
    qubit: usize,
    gates: &'a mut Vec<Gate>,
    phase: Angle,
    in_zero: bool,
}

impl Pulses<'_> {
    fn rotate(&mut self, angle: &Angle) {
        self.phase = std::mem::take(&mut self.phase).plus(angle);
    }

    fn turn(&mut self, angle: f64) {
        self.phase.constant += angle;
    }

    fn flush(&mut self) {
        let mut phase = std::mem::take(&mut self.phase);
        phase.constant = wrapped(phase.constant);
        if phase.constant.abs() < SAME_ANGLE {
            phase.constant = 0.0;
        }
        if !self.in_zero && phase.number() != Some(0.0) {
            self.gates.push(Gate::Rz(self.qubit, phase));
        }
    }

    fn pulse(&mut self, gate: Gate) {
        self.flush();
        self.gates.push(gate);
        self.in_zero = false;
    }

    fn unitary(&mut self, unitary: &Unitary, has_rx: bool) {
        let Euler { phi, theta, lambda } = unitary.euler();
        self.turn(lambda);
        if theta < SAME_ANGLE {
        } else if (theta - FRAC_PI_2).abs() < SAME_ANGLE {
            self.pulse(Gate::Sx(self.qubit));
        } else if PI - theta < SAME_ANGLE {
            self.pulse(Gate::X(self.qubit));
        } else if has_rx {
            self.pulse(Gate::Rx(self.qubit, Angle::constant(theta)));
        } else {
            self.turn(FRAC_PI_2);
            self.pulse(Gate::Sx(self.qubit));
            self.turn(theta + PI);
            self.pulse(Gate::Sx(self.qubit));
            self.turn(FRAC_PI_2);
        }
        self.turn(phi);
    }
}

/// The same angle in (−π, π].
pub(super) fn wrapped(angle: f64) -> f64 {
    let turned = angle.rem_euclid(2.0 * PI);
    if turned > PI { turned - 2.0 * PI } else { turned }
}

/// A 2×2 unitary with determinant 1, row by row: `[[a, b], [−b*, a*]]`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Unitary {
    a: Complex64,
    b: Complex64,
}

/// `U = Rz(phi) Rx(theta) Rz(lambda)`, θ in [0, π].
struct Euler {
    phi: f64,
    theta: f64,
    lambda: f64,
}

impl Unitary {
    fn z(angle: f64) -> Self {
        Self { a: Complex64::cis(-angle / 2.0), b: Complex64::ZERO }
    }

    fn x(angle: f64) -> Self {
        let (sin, cos) = (angle / 2.0).sin_cos();
        Self { a: Complex64::new(cos, 0.0), b: Complex64::new(0.0, -sin) }
    }

    /// Exchanges X and Z: times −i, which makes the determinant 1.
    fn hadamard() -> Self {
        let entry = Complex64::new(0.0, -FRAC_1_SQRT_2);
        Self { a: entry, b: entry }
    }

    /// This one after `first`.
    fn after(&self, first: &Self) -> Self {
        Self {
            a: self.a * first.a - self.b * first.b.conj(),
            b: self.a * first.b + self.b * first.a.conj(),
        }
    }

    fn is_diagonal(&self) -> bool {
        self.b.norm() < SAME_ANGLE
    }

    fn is_about_x(&self) -> bool {
        self.a.im.abs() < SAME_ANGLE && self.b.re.abs() < SAME_ANGLE
    }

    fn euler(&self) -> Euler {
        let theta = 2.0 * self.b.norm().atan2(self.a.norm());
        // a = cos(θ/2) e^{−i(φ+λ)/2}, −b* = −i sin(θ/2) e^{i(φ−λ)/2}.
        let half_sum = if PI - theta < SAME_ANGLE { 0.0 } else { -self.a.arg() };
        let half_difference = if theta < SAME_ANGLE {
            0.0
        } else {
            (Complex64::new(0.0, -1.0) * self.b.conj()).arg()
        };
        Euler { phi: half_sum + half_difference, theta, lambda: half_sum - half_difference }
    }
}
