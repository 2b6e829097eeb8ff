//! [`Ising`]: `H = constant + Σ h_i Z_i + Σ J_ij Z_i Z_j`, checked once so that nothing behind it has to
//! check again; [`ChainIsing`], the open chain the planner makes; and [`Scaled`], the form the circuit
//! sees.

use std::borrow::Cow;
use std::ops::Range;

use thiserror::Error;

use super::bits::Bits;

/// More qubits than any engine could hold; a bound on what a file may ask for.
pub const MAX_QUBITS: usize = 100_000;
/// More couplings than any use has; a bound on what a file may ask for.
pub const MAX_COUPLINGS: usize = 2_000_000;
/// Σ|coefficients| beyond which squares and sums could overflow.
const MAX_MAGNITUDE: f64 = 1e100;

/// A 2-local Ising Hamiltonian over checked, finite coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct Ising {
    constant: f64,
    h: Vec<f64>,
    /// `(i, j, J)` with `i < j`, sorted, each pair once.
    couplings: Vec<(usize, usize, f64)>,
}

/// An Ising problem that cannot be used.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum IsingError {
    /// No qubits.
    #[error("the problem has no qubit; \"h\" needs one number per qubit")]
    Empty,
    /// Over [`MAX_QUBITS`] or [`MAX_COUPLINGS`].
    #[error("{count} {what}; at most {limit} are accepted")]
    TooMany {
        /// `qubits` or `couplings`.
        what: &'static str,
        /// How many were given.
        count: usize,
        /// The bound.
        limit: usize,
    },
    /// A coefficient is NaN or infinite.
    #[error("{what} is {value}; every coefficient must be finite")]
    NotFinite {
        /// Which coefficient.
        what: String,
        /// What was given.
        value: f64,
    },
    /// The coefficients are so large that energies overflow.
    #[error("the coefficients add up to {sum:e}; scale the problem below {MAX_MAGNITUDE:e}")]
    TooLarge {
        /// Σ of all magnitudes.
        sum: f64,
    },
    /// A coupling names a qubit that does not exist.
    #[error("coupling {index} joins qubits {i} and {j}, but qubits run from 0 to {last}")]
    NoSuchQubit {
        /// Position in the list of couplings, from 0.
        index: usize,
        /// First qubit.
        i: usize,
        /// Second qubit.
        j: usize,
        /// The last qubit there is.
        last: usize,
    },
    /// Z_i Z_i is the identity: put it into the constant.
    #[error(
        "coupling {index} joins qubit {qubit} with itself; add its value to \"constant\" instead"
    )]
    SelfCoupling {
        /// Position in the list of couplings, from 0.
        index: usize,
        /// The qubit.
        qubit: usize,
    },
    /// A chain of n qubits has n − 1 bonds.
    #[error("a chain of {qubits} qubits has {} bonds, not {bonds}", qubits.saturating_sub(1))]
    ChainBonds {
        /// Number of fields.
        qubits: usize,
        /// Number of bonds given.
        bonds: usize,
    },
}

fn check_finite(what: impl FnOnce() -> String, value: f64) -> Result<(), IsingError> {
    if value.is_finite() { Ok(()) } else { Err(IsingError::NotFinite { what: what(), value }) }
}

fn check_magnitude(coefficients: impl Iterator<Item = f64>) -> Result<(), IsingError> {
    let sum: f64 = coefficients.map(f64::abs).sum();
    if sum <= MAX_MAGNITUDE { Ok(()) } else { Err(IsingError::TooLarge { sum }) }
}

fn check_count(what: &'static str, count: usize, limit: usize) -> Result<(), IsingError> {
    if count <= limit { Ok(()) } else { Err(IsingError::TooMany { what, count, limit }) }
}

impl Ising {
    /// Checks the coefficients; couplings given twice (in either order) are added up.
    ///
    /// # Errors
    /// If anything is not finite, out of range, too many or too large.
    pub fn new(
        constant: f64,
        h: Vec<f64>,
        mut couplings: Vec<(usize, usize, f64)>,
    ) -> Result<Self, IsingError> {
        if h.is_empty() {
            return Err(IsingError::Empty);
        }
        check_count("qubits", h.len(), MAX_QUBITS)?;
        check_count("couplings", couplings.len(), MAX_COUPLINGS)?;
        check_finite(|| "\"constant\"".into(), constant)?;
        for (qubit, &field) in h.iter().enumerate() {
            check_finite(|| format!("the field \"h\" of qubit {qubit}"), field)?;
        }
        for (index, (i, j, value)) in couplings.iter_mut().enumerate() {
            let (i, j) = (*i.min(j), *i.max(j));
            if j >= h.len() {
                return Err(IsingError::NoSuchQubit { index, i, j, last: h.len() - 1 });
            }
            if i == j {
                return Err(IsingError::SelfCoupling { index, qubit: i });
            }
            check_finite(|| format!("coupling {index} of qubits {i} and {j}"), *value)?;
        }
        for coupling in &mut couplings {
            *coupling = (coupling.0.min(coupling.1), coupling.0.max(coupling.1), coupling.2);
        }
        check_magnitude(h.iter().copied().chain(couplings.iter().map(|c| c.2)).chain([constant]))?;
        couplings.sort_by_key(|&(i, j, _)| (i, j));
        couplings.dedup_by(|next, kept| {
            let same = (next.0, next.1) == (kept.0, kept.1);
            if same {
                kept.2 += next.2;
            }
            same
        });
        Ok(Self { constant, h, couplings })
    }

    /// The identity's coefficient.
    #[must_use]
    pub fn constant(&self) -> f64 {
        self.constant
    }

    /// One field per qubit.
    #[must_use]
    pub fn h(&self) -> &[f64] {
        &self.h
    }

    /// `(i, j, J)` with `i < j`, sorted, each pair once.
    #[must_use]
    pub fn couplings(&self) -> &[(usize, usize, f64)] {
        &self.couplings
    }

    /// Number of qubits, at least 1.
    #[must_use]
    pub fn qubits(&self) -> usize {
        self.h.len()
    }

    /// The energy of a bitstring, in the units of the coefficients.
    #[must_use]
    pub fn energy(&self, bits: &Bits) -> f64 {
        let fields: f64 = self.h.iter().enumerate().map(|(i, h)| h * bits.z(i)).sum();
        let bonds: f64 = self.couplings.iter().map(|&(i, j, v)| v * bits.z(i) * bits.z(j)).sum();
        self.constant + fields + bonds
    }

    /// `sqrt(Σh² + ΣJ²)`: the standard deviation of the energy over uniform bitstrings.
    #[must_use]
    pub fn sigma(&self) -> f64 {
        let squares: f64 =
            self.h.iter().chain(self.couplings.iter().map(|c| &c.2)).map(|v| v * v).sum();
        squares.sqrt()
    }

    /// Whether every coupling joins neighbours `i, i + 1`, as the `chain` engine needs.
    #[must_use]
    pub fn is_chain(&self) -> bool {
        self.couplings.iter().all(|&(i, j, _)| j == i + 1)
    }

    /// The same problem as an open chain, if it is one.
    #[must_use]
    pub fn to_chain(&self) -> Option<ChainIsing> {
        let mut j = vec![0.0; self.qubits() - 1];
        for &(left, right, value) in &self.couplings {
            if right != left + 1 {
                return None;
            }
            j[left] = value;
        }
        Some(ChainIsing { constant: self.constant, h: self.h.clone(), j })
    }

    /// The Hamiltonian the circuit applies.
    #[must_use]
    pub fn scaled(&self, scale: Scale) -> Scaled<'_> {
        match scale {
            Scale::None => Scaled { ising: Cow::Borrowed(self), offset: 0.0, factor: 1.0 },
            Scale::Sigma => {
                let sigma = self.sigma();
                // A constant Hamiltonian has nothing to scale by.
                let factor = if sigma > 0.0 { sigma } else { 1.0 };
                let ising = Self {
                    constant: 0.0,
                    h: self.h.iter().map(|h| h / factor).collect(),
                    couplings: self.couplings.iter().map(|&(i, j, v)| (i, j, v / factor)).collect(),
                };
                Scaled { ising: Cow::Owned(ising), offset: self.constant, factor }
            }
        }
    }
}

/// What is done to the Hamiltonian before the circuit sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    /// Nothing: angles apply to the problem as given.
    None,
    /// Centred and divided by [`Ising::sigma`], so that one set of hyper-parameters serves every problem.
    #[default]
    Sigma,
}

/// A scaled Hamiltonian and the way back: `energy = offset + factor · scaled energy`.
#[derive(Debug, Clone)]
pub struct Scaled<'a> {
    /// The Hamiltonian the circuit applies.
    pub ising: Cow<'a, Ising>,
    /// What was subtracted, in the units of the input.
    pub offset: f64,
    /// What was divided by, in the units of the input; positive.
    pub factor: f64,
}

impl Scaled<'_> {
    /// An energy (or expectation) back in the units of the input.
    #[must_use]
    pub fn in_input_units(&self, energy: f64) -> f64 {
        self.offset + self.factor * energy
    }
}

/// An open chain: `constant + Σ h_i Z_i + Σ j_i Z_i Z_{i+1}`.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainIsing {
    constant: f64,
    h: Vec<f64>,
    j: Vec<f64>,
}

impl ChainIsing {
    /// Checks the coefficients: `j[i]` couples qubits `i` and `i + 1`.
    ///
    /// # Errors
    /// If anything is not finite, too many or too large, or `j` is not one shorter than `h`.
    pub fn new(constant: f64, h: Vec<f64>, j: Vec<f64>) -> Result<Self, IsingError> {
        if h.is_empty() {
            return Err(IsingError::Empty);
        }
        if j.len() + 1 != h.len() {
            return Err(IsingError::ChainBonds { qubits: h.len(), bonds: j.len() });
        }
        check_count("qubits", h.len(), MAX_QUBITS)?;
        check_finite(|| "\"constant\"".into(), constant)?;
        for (qubit, &field) in h.iter().enumerate() {
            check_finite(|| format!("the field \"h\" of qubit {qubit}"), field)?;
        }
        for (bond, &value) in j.iter().enumerate() {
            check_finite(|| format!("coupling {bond} of qubits {bond} and {}", bond + 1), value)?;
        }
        check_magnitude(h.iter().chain(&j).copied().chain([constant]))?;
        Ok(Self { constant, h, j })
    }

    /// The identity's coefficient.
    #[must_use]
    pub fn constant(&self) -> f64 {
        self.constant
    }

    /// One field per qubit.
    #[must_use]
    pub fn h(&self) -> &[f64] {
        &self.h
    }

    /// One coupling per bond; `j()[i]` couples qubits `i` and `i + 1`.
    #[must_use]
    pub fn j(&self) -> &[f64] {
        &self.j
    }

    /// Number of qubits, at least 1.
    #[must_use]
    pub fn qubits(&self) -> usize {
        self.h.len()
    }

    /// The problem of some neighbouring qubits while all others hold the bits of `held`: energies are
    /// those of the whole chain. `None` for a range without qubits of the chain, or bits of another
    /// length.
    #[must_use]
    pub fn window(&self, range: Range<usize>, held: &Bits) -> Option<Self> {
        let (first, end) = (range.start, range.end);
        if first >= end || end > self.qubits() || held.len() != self.qubits() {
            return None;
        }
        let outside = |i: &usize| !range.contains(i);
        let fields = (0..self.qubits()).filter(outside).map(|i| self.h[i] * held.z(i));
        let bonds = (0..self.j.len())
            .filter(|i| outside(i) && outside(&(i + 1)))
            .map(|i| self.j[i] * held.z(i) * held.z(i + 1));
        let constant = self.constant + fields.sum::<f64>() + bonds.sum::<f64>();
        let mut h = self.h[range.clone()].to_vec();
        let last = h.len() - 1;
        if first > 0 {
            h[0] += self.j[first - 1] * held.z(first - 1);
        }
        if end < self.qubits() {
            h[last] += self.j[end - 1] * held.z(end);
        }
        Some(Self { constant, h, j: self.j[first..end - 1].to_vec() })
    }
}

impl From<ChainIsing> for Ising {
    fn from(chain: ChainIsing) -> Self {
        let bonds = chain.j.iter().enumerate();
        let couplings = bonds.map(|(i, &value)| (i, i + 1, value)).collect();
        Self { constant: chain.constant, h: chain.h, couplings }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Ising {
        Ising::new(1.0, vec![0.5, -1.0, 2.0], vec![(0, 1, 1.0), (2, 1, 3.0), (1, 2, -1.0)]).unwrap()
    }

    #[test]
    fn a_window_has_the_energies_of_the_whole_chain() {
        let h = vec![0.3, -1.0, 0.7, 0.2, -0.4, 1.1];
        let chain = ChainIsing::new(2.0, h, vec![0.5, -0.2, 0.9, -1.3, 0.4]).unwrap();
        let whole = Ising::from(chain.clone());
        let held = Bits::from_index(6, 0b101101);
        for first in 0..6 {
            for end in first + 1..=6 {
                let window = Ising::from(chain.window(first..end, &held).unwrap());
                for inner in 0..1 << (end - first) {
                    let inner = Bits::from_index(end - first, inner);
                    let mut bits = held.clone();
                    inner.iter().enumerate().for_each(|(k, bit)| bits.set(first + k, bit));
                    assert!((window.energy(&inner) - whole.energy(&bits)).abs() < 1e-12);
                }
            }
        }
        assert!(chain.window(2..2, &held).is_none() && chain.window(2..7, &held).is_none());
    }

    #[test]
    fn a_pair_given_twice_in_either_order_is_added_up() {
        assert_eq!(triangle().couplings(), [(0, 1, 1.0), (1, 2, 2.0)]);
    }

    #[test]
    fn energy_counts_bit_zero_as_plus_one() {
        let energy = |bits: &str| triangle().energy(&bits.parse().unwrap());
        assert_eq!(energy("000"), 1.0 + 1.5 + 3.0);
        assert_eq!(energy("010"), 1.0 + 3.5 - 3.0);
    }

    #[test]
    fn sigma_is_the_deviation_over_all_bitstrings() {
        let ising = triangle();
        let energies = (0..8).map(|index| ising.energy(&Bits::from_index(3, index)));
        let variance = energies.map(|energy| (energy - 1.0).powi(2)).sum::<f64>() / 8.0;
        assert!((ising.sigma() - variance.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn scaling_leads_back_to_the_units_of_the_input() {
        let ising = triangle();
        let bits: Bits = "011".parse().unwrap();
        for scale in [Scale::None, Scale::Sigma] {
            let scaled = ising.scaled(scale);
            let back = scaled.in_input_units(scaled.ising.energy(&bits));
            assert!((back - ising.energy(&bits)).abs() < 1e-12);
        }
        assert!((ising.scaled(Scale::Sigma).ising.sigma() - 1.0).abs() < 1e-12);
        let constant = Ising::new(4.0, vec![0.0], vec![]).unwrap();
        assert_eq!(constant.scaled(Scale::Sigma).in_input_units(0.0), 4.0);
    }

    #[test]
    fn a_chain_is_recognised_and_comes_back_the_same() {
        let ising = triangle();
        let chain = ising.to_chain().unwrap();
        assert_eq!((chain.h(), chain.j()), ([0.5, -1.0, 2.0].as_slice(), [1.0, 2.0].as_slice()));
        assert_eq!(Ising::from(chain), ising);
        let ring = Ising::new(0.0, vec![0.0; 3], vec![(0, 2, 1.0)]).unwrap();
        assert!(!ring.is_chain() && ring.to_chain().is_none());
    }

    #[test]
    fn hostile_coefficients_are_refused() {
        let new = |h: Vec<f64>, couplings| Ising::new(0.0, h, couplings);
        assert_eq!(new(vec![], vec![]), Err(IsingError::Empty));
        assert!(matches!(new(vec![f64::NAN], vec![]), Err(IsingError::NotFinite { .. })));
        assert!(matches!(new(vec![1e300], vec![]), Err(IsingError::TooLarge { .. })));
        assert!(matches!(
            new(vec![0.0; 2], vec![(0, 2, 1.0)]),
            Err(IsingError::NoSuchQubit { index: 0, last: 1, .. })
        ));
        assert!(matches!(
            new(vec![0.0; 2], vec![(1, 1, 1.0)]),
            Err(IsingError::SelfCoupling { qubit: 1, .. })
        ));
        assert!(matches!(
            ChainIsing::new(0.0, vec![0.0; 3], vec![1.0]),
            Err(IsingError::ChainBonds { qubits: 3, bonds: 1 })
        ));
        assert!(matches!(
            new(vec![0.0; MAX_QUBITS + 1], vec![]),
            Err(IsingError::TooMany { what: "qubits", .. })
        ));
    }
}
