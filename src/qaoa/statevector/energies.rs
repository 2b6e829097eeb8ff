//! The diagonal of H, worked out once as far as it pays: the qubits are split into *low* ones, which
//! number the amplitudes of a row, and *high* ones, which number the rows. Within a row the energy is
//! that of the low qubits alone (a table made once), plus one field per low qubit and a constant that
//! the high bits make: two additions per amplitude instead of eight bytes of memory for each.

use super::super::ising::Ising;
use super::vector::{LANES, Vector};

/// An Ising problem split into low and high qubits.
#[derive(Debug, Clone)]
pub(super) struct Energies {
    low: usize,
    constant: f64,
    low_fields: Vec<f64>,
    low_couplings: Vec<(usize, usize, f64)>,
    high_fields: Vec<f64>,
    high_couplings: Vec<(usize, usize, f64)>,
    /// `(low qubit, high qubit, J)`.
    across: Vec<(usize, usize, f64)>,
}

/// What the high bits of a row make of the low qubits' energy.
#[derive(Debug, Clone, Default)]
pub(super) struct Row {
    /// Energy of the high qubits alone.
    pub(super) constant: f64,
    /// Field on each low qubit, on top of its own.
    pub(super) fields: Vec<f64>,
}

fn z(index: usize, bit: usize) -> f64 {
    if index >> bit & 1 == 0 { 1.0 } else { -1.0 }
}

impl Energies {
    /// Splits `ising`, padded to `low + high` qubits without any field.
    pub(super) fn new(ising: &Ising, low: usize, high: usize) -> Self {
        let field = |qubit: usize| ising.h().get(qubit).copied().unwrap_or(0.0);
        let mut energies = Self {
            low,
            constant: ising.constant(),
            low_fields: (0..low).map(field).collect(),
            low_couplings: Vec::new(),
            high_fields: (low..low + high).map(field).collect(),
            high_couplings: Vec::new(),
            across: Vec::new(),
        };
        for &(i, j, value) in ising.couplings() {
            match (i < low, j < low) {
                (true, true) => energies.low_couplings.push((i, j, value)),
                (true, false) => energies.across.push((i, j - low, value)),
                _ => energies.high_couplings.push((i - low, j - low, value)),
            }
        }
        energies
    }

    /// A range that holds all energies.
    pub(super) fn range(&self) -> (f64, f64) {
        let fields = self.low_fields.iter().chain(&self.high_fields).map(|h| h.abs());
        let pairs = [&self.low_couplings, &self.high_couplings, &self.across];
        let pairs = pairs.into_iter().flatten().map(|(_, _, value)| value.abs());
        // Rounding adds up, in single precision more than in double.
        let reach = fields.chain(pairs).sum::<f64>() * (1.0 + 1e-4) + f64::MIN_POSITIVE;
        (self.constant - reach, self.constant + reach)
    }

    /// Energy of the low qubits alone.
    pub(super) fn low_energy(&self, index: usize) -> f64 {
        energy(index, &self.low_fields, &self.low_couplings)
    }

    /// What the high bits `index` add.
    pub(super) fn row(&self, index: usize) -> Row {
        let mut fields = vec![0.0; self.low];
        for &(i, j, value) in &self.across {
            fields[i] += value * z(index, j);
        }
        let constant = self.constant + energy(index, &self.high_fields, &self.high_couplings);
        Row { constant, fields }
    }

    /// Adds the diagonal's derivative-free part of a row to `low` energies: all energies of the row.
    #[inline(always)]
    pub(super) fn fill<V: Vector>(&self, index: usize, low_energies: &[V], out: &mut [V]) {
        let Row { constant, fields } = self.row(index);
        let within = LANES.trailing_zeros() as usize;
        out[0] = V::from_fn(|lane| {
            let inner: f64 =
                fields[..within].iter().enumerate().map(|(bit, f)| f * z(lane, bit)).sum();
            constant + inner + fields[within..].iter().sum::<f64>()
        });
        for (bit, field) in fields[within..].iter().enumerate() {
            let (lower, upper) = out[..2 << bit].split_at_mut(1 << bit);
            let flip = V::splat(2.0 * field);
            for (x, y) in lower.iter().zip(upper) {
                *y = *x - flip;
            }
        }
        for (out, low) in out.iter_mut().zip(low_energies) {
            *out += *low;
        }
    }
}

fn energy(index: usize, fields: &[f64], couplings: &[(usize, usize, f64)]) -> f64 {
    let alone: f64 = fields.iter().enumerate().map(|(bit, h)| h * z(index, bit)).sum();
    let pairs: f64 = couplings.iter().map(|&(i, j, v)| v * z(index, i) * z(index, j)).sum();
    alone + pairs
}
