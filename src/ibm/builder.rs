//! The chain's circuit in native gates, for given directions of the bonds; physical qubits are not known
//! here.
//!
//! A layer is `Π exp(−iγ J Z Z) · Π exp(−iγ h Z)`, then the mixers `Rx(2β)`. Bonds come in two halves,
//! even and odd ones, so that each half runs in parallel. A bond `RZZ(t) = exp(−i t/2 Z_c Z_t)` is
//!
//! - ECR, with `ECR = X_c exp(−iπ/4 Z_c X_t)`: `√X_t · ECR · Rz_t(−t) · ECR · √X†_t`;
//! - CZ: `W_t · CZ · Rx_t(t) · CZ · W†_t` with `W = Rz(π/2) √X`, which turns Z into X;
//! - RZZ itself, whose angle has to be in [0, π/2]: whole turns are dropped, `RZZ(π) = −i Z Z`, and
//!   a qubit is flipped (X before and after the layer) where a bond's angle is negative.
//!
//! In the first layer a qubit that no gate has touched yet is in |+⟩, and one two-qubit gate is enough
//! to bring it to where `RZZ(t)` would: a rotation by ±π/2, its sign given by the neighbour, of a vector
//! at angle t from the rotation's axis leads to two vectors at angles ±t from that axis. The chain is
//! cut into segments that grow from their middle in this way and are joined by ordinary bonds.
//!
//! What a one-gate ECR bond leaves behind, an X on its control, is not undone but carried along as the
//! sign of everything diagonal, up to the next mixer, which it commutes with.

use std::f64::consts::{FRAC_PI_2, PI};

use super::circuit::{Angle, Gate, Parameter};
use super::device::{Entangler, Native};
use super::line::Direction;
use super::segments::{Bond, segments};
use super::turns::{Turns, wrapped};

/// The chain's couplings with the angles' source: a number per layer, or a parameter.
pub(super) struct Terms<'a> {
    pub(super) h: &'a [f64],
    pub(super) j: &'a [f64],
    /// `2γ_l` and `2β_l` per layer.
    pub(super) layers: Vec<LayerAngles>,
}

/// The two angles of a layer.
pub(super) enum LayerAngles {
    /// Numbers: γ and β.
    Bound(f64, f64),
    /// Parameters of this layer.
    Inputs(usize),
}

impl LayerAngles {
    /// `2γ · coefficient`.
    fn phase(&self, coefficient: f64) -> Angle {
        match *self {
            Self::Bound(gamma, _) => Angle::constant(2.0 * gamma * coefficient),
            Self::Inputs(layer) => Angle::of(Parameter::Gamma(layer), 2.0 * coefficient),
        }
    }

    /// `2β`.
    fn mixer(&self) -> Angle {
        match *self {
            Self::Bound(_, beta) => Angle::constant(2.0 * beta),
            Self::Inputs(layer) => Angle::of(Parameter::Beta(layer), 2.0),
        }
    }
}

fn is_zero(angle: &Angle) -> bool {
    angle.number() == Some(0.0)
}

/// Writes the whole circuit up to the measurements; in later layers the even or the odd bonds go first.
pub(super) fn build(
    terms: &Terms<'_>,
    native: Native,
    directions: &[Direction],
    odd_first: bool,
) -> Vec<Gate> {
    let qubits = terms.h.len();
    let mut builder = Builder {
        native,
        directions,
        turns: vec![Turns::fresh(native.has_rx); qubits],
        untouched: vec![true; qubits],
        flipped: vec![false; qubits],
        field: vec![Angle::default(); qubits],
        gates: Vec::new(),
    };
    for (index, layer) in terms.layers.iter().enumerate() {
        let fields = terms.h.iter().map(|&h| layer.phase(h));
        builder.field = fields.collect();
        let bonds: Vec<Angle> = terms.j.iter().map(|&j| layer.phase(j)).collect();
        if index == 0 && native.entangler != Entangler::Rzz {
            builder.first_bonds(&bonds);
        } else {
            builder.bonds(&bonds, odd_first);
        }
        builder.mixers(&layer.mixer());
    }
    for qubit in 0..qubits {
        builder.turns[qubit].write(qubit, true, &mut builder.gates);
    }
    builder.gates
}

struct Builder<'a> {
    native: Native,
    directions: &'a [Direction],
    turns: Vec<Turns>,
    /// Still in |0⟩, |+⟩ not prepared.
    untouched: Vec<bool>,
    /// The state is X times what it ought to be.
    flipped: Vec<bool>,
    /// `Rz` of the current layer that is still to come.
    field: Vec<Angle>,
    gates: Vec<Gate>,
}

impl Builder<'_> {
    fn x(&mut self, qubit: usize, angle: f64) {
        self.turns[qubit].x(&Angle::constant(angle));
    }

    fn z(&mut self, qubit: usize, angle: f64) {
        self.turns[qubit].z(&Angle::constant(angle));
    }

    /// Prepares |+⟩ where nothing has happened yet.
    fn prepare(&mut self, qubit: usize) {
        if std::mem::take(&mut self.untouched[qubit]) {
            self.x(qubit, FRAC_PI_2);
            self.z(qubit, FRAC_PI_2);
        }
    }

    /// The angle of something diagonal as the flips of its qubits want it.
    fn signed(&self, angle: &Angle, qubits: &[usize]) -> Angle {
        let odd = qubits.iter().filter(|&&qubit| self.flipped[qubit]).count() % 2 == 1;
        if odd { angle.clone().negated() } else { angle.clone() }
    }

    /// Applies the qubit's field unless that has been done.
    fn apply_field(&mut self, qubit: usize) {
        let field = std::mem::take(&mut self.field[qubit]);
        if !is_zero(&field) {
            let signed = self.signed(&field, &[qubit]);
            self.turns[qubit].z(&signed);
        }
    }

    /// The native gate of a bond, in the direction the device has; `angle` is for RZZ.
    fn entangle(&mut self, bond: usize, angle: f64) {
        let (a, b) = match self.directions[bond] {
            Direction::Forward => (bond, bond + 1),
            Direction::Backward => (bond + 1, bond),
        };
        for qubit in [a, b] {
            self.turns[qubit].write(qubit, false, &mut self.gates);
        }
        self.gates.push(match self.native.entangler {
            Entangler::Ecr => Gate::Ecr(a, b),
            Entangler::Cz => Gate::Cz(a, b),
            Entangler::Rzz => Gate::Rzz(a, b, Angle::constant(angle)),
        });
    }

    /// Control and target of a bond. CZ has neither: odd qubits are taken as targets, so that no qubit
    /// changes its role.
    fn roles(&self, bond: usize) -> (usize, usize) {
        let forward = match self.native.entangler {
            Entangler::Ecr => self.directions[bond] == Direction::Forward,
            Entangler::Cz | Entangler::Rzz => bond.is_multiple_of(2),
        };
        if forward { (bond, bond + 1) } else { (bond + 1, bond) }
    }

    fn bonds(&mut self, angles: &[Angle], odd_first: bool) {
        (0..self.turns.len()).for_each(|qubit| self.prepare(qubit));
        if self.native.entangler == Entangler::Rzz {
            self.flip_for(angles);
        }
        for parity in [usize::from(odd_first), usize::from(!odd_first)] {
            for bond in (parity..angles.len()).step_by(2) {
                self.bond(bond, &angles[bond]);
            }
        }
    }

    fn first_bonds(&mut self, angles: &[Angle]) {
        for bond in segments(self.turns.len()) {
            match bond {
                Bond::Join(bond) => self.bond(bond, &angles[bond]),
                Bond::Seed(bond) => {
                    let (control, target) = self.roles(bond);
                    self.attach(bond, control, target, &angles[bond]);
                }
                Bond::Grow { bond, from, to } => self.attach(bond, from, to, &angles[bond]),
            }
        }
    }

    /// An ordinary bond.
    fn bond(&mut self, bond: usize, angle: &Angle) {
        if is_zero(angle) {
            return;
        }
        let (control, target) = self.roles(bond);
        self.prepare(control);
        self.prepare(target);
        let signed = self.signed(angle, &[control, target]);
        // The control is as it ought to be, while the target of ECR and CZ is turned around: where
        // the field's angle is a parameter, this is the place where it needs no pulse of its own.
        self.apply_field(control);
        match self.native.entangler {
            Entangler::Ecr => {
                self.x(target, FRAC_PI_2);
                self.entangle(bond, 0.0);
                self.turns[target].z(&signed.negated());
                self.entangle(bond, 0.0);
                self.x(target, -FRAC_PI_2);
            }
            Entangler::Cz => {
                self.x(target, FRAC_PI_2);
                self.z(target, FRAC_PI_2);
                self.entangle(bond, 0.0);
                self.turns[target].x(&signed);
                self.entangle(bond, 0.0);
                self.z(target, -FRAC_PI_2);
                self.x(target, -FRAC_PI_2);
            }
            Entangler::Rzz => {
                self.apply_field(target);
                let (turned, half_turn) = quarter(angle.constant);
                if half_turn {
                    self.z(control, PI);
                    self.z(target, PI);
                }
                // `flip_for` has flipped the qubits so that its sign is positive.
                self.entangle(bond, turned.abs());
            }
        }
    }

    /// A bond of the first layer between `from` and the untouched qubit `to`.
    fn attach(&mut self, bond: usize, from: usize, to: usize, angle: &Angle) {
        if is_zero(angle) {
            return;
        }
        self.prepare(from);
        debug_assert!(self.untouched[to], "segments grow to untouched qubits only");
        self.untouched[to] = false;
        let angle = self.signed(angle, &[from]);
        match self.native.entangler {
            Entangler::Ecr if self.roles(bond) == (from, to) => {
                self.apply_field(from);
                self.x(to, FRAC_PI_2);
                self.turns[to].z(&angle.plus(&Angle::constant(FRAC_PI_2)));
                self.entangle(bond, 0.0);
                self.x(to, -FRAC_PI_2);
                self.flipped[from] = !self.flipped[from];
                self.z(from, FRAC_PI_2);
            }
            Entangler::Ecr => {
                self.turns[to].x(&angle.negated());
                self.z(to, -FRAC_PI_2);
                self.x(from, FRAC_PI_2);
                self.z(from, FRAC_PI_2);
                self.entangle(bond, 0.0);
                self.z(from, -FRAC_PI_2);
                self.x(from, -FRAC_PI_2);
                self.z(from, -FRAC_PI_2);
                self.z(to, FRAC_PI_2);
                self.x(to, -FRAC_PI_2);
                self.z(to, FRAC_PI_2);
            }
            Entangler::Cz | Entangler::Rzz => {
                self.turns[to].x(&angle);
                self.z(to, -FRAC_PI_2);
                self.entangle(bond, 0.0);
                self.z(to, -PI);
                self.x(to, FRAC_PI_2);
                self.z(to, FRAC_PI_2);
            }
        }
    }

    fn mixers(&mut self, mixer: &Angle) {
        for qubit in 0..self.turns.len() {
            self.prepare(qubit);
            self.apply_field(qubit);
            if std::mem::take(&mut self.flipped[qubit]) {
                self.x(qubit, PI);
            }
            self.turns[qubit].x(mixer);
        }
    }

    /// Flips qubits so that no bond's angle is negative.
    fn flip_for(&mut self, angles: &[Angle]) {
        for (bond, angle) in angles.iter().enumerate() {
            let negative = quarter(angle.constant).0 < 0.0;
            if negative != self.flipped[bond] {
                self.flipped[bond + 1] = true;
                self.x(bond + 1, PI);
            }
        }
    }
}

/// An RZZ angle reduced to [−π/2, π/2], and whether `RZZ(π)` is left over. Odd in its argument.
fn quarter(angle: f64) -> (f64, bool) {
    let turned = wrapped(angle);
    if turned.abs() <= FRAC_PI_2 { (turned, false) } else { (turned - PI.copysign(turned), true) }
}
