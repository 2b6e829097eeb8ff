//! [`Circuit`]: native gates on a line of qubits, with angles that are numbers or affine in the circuit's
//! parameters.

use std::fmt;

use super::line::Line;
use crate::qaoa::Angles;

/// An angle of the QAOA circuit that a job fills in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Parameter {
    /// γ of a layer, counted from 0.
    Gamma(usize),
    /// β of a layer, counted from 0.
    Beta(usize),
}

impl Parameter {
    /// Its value.
    #[must_use]
    pub fn value(self, angles: &Angles) -> f64 {
        match self {
            Self::Gamma(layer) => angles.gammas()[layer],
            Self::Beta(layer) => angles.betas()[layer],
        }
    }
}

impl fmt::Display for Parameter {
    /// `g00`, `b00`, … Zero-padded, so that IBM's order (by name) is by layer, β before γ.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Gamma(layer) => write!(f, "g{layer:02}"),
            Self::Beta(layer) => write!(f, "b{layer:02}"),
        }
    }
}

/// `constant + Σ factor · parameter`, in radians.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Angle {
    /// The part without parameters.
    pub constant: f64,
    /// `(parameter, factor)`, each parameter once, sorted, no factor 0.
    pub terms: Vec<(Parameter, f64)>,
}

impl Angle {
    /// A number.
    #[must_use]
    pub fn constant(constant: f64) -> Self {
        Self { constant, terms: Vec::new() }
    }

    /// `factor · parameter`.
    #[must_use]
    pub fn of(parameter: Parameter, factor: f64) -> Self {
        let terms = if factor == 0.0 { Vec::new() } else { vec![(parameter, factor)] };
        Self { constant: 0.0, terms }
    }

    /// The number, if no parameter is in it.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        self.terms.is_empty().then_some(self.constant)
    }

    /// The sum of two angles.
    #[must_use]
    pub fn plus(mut self, other: &Self) -> Self {
        self.constant += other.constant;
        for &(parameter, factor) in &other.terms {
            match self.terms.iter_mut().find(|term| term.0 == parameter) {
                Some(term) => term.1 += factor,
                None => self.terms.push((parameter, factor)),
            }
        }
        self.terms.retain(|term| term.1 != 0.0);
        self.terms.sort_by_key(|term| term.0);
        self
    }

    /// The angle times −1.
    #[must_use]
    pub fn negated(mut self) -> Self {
        self.constant = -self.constant;
        self.terms.iter_mut().for_each(|term| term.1 = -term.1);
        self
    }

    /// Its value once the parameters have theirs.
    #[must_use]
    pub fn value(&self, angles: &Angles) -> f64 {
        self.terms
            .iter()
            .fold(self.constant, |sum, (parameter, factor)| sum + factor * parameter.value(angles))
    }
}

/// A native gate; qubits are positions on the line, from 0.
#[derive(Debug, Clone, PartialEq)]
pub enum Gate {
    /// `exp(−i θ/2 Z)`: virtual, costs nothing.
    Rz(usize, Angle),
    /// √X.
    Sx(usize),
    /// X.
    X(usize),
    /// `exp(−i θ/2 X)`.
    Rx(usize, Angle),
    /// Echoed cross-resonance: control, target, in a direction the device has.
    Ecr(usize, usize),
    /// Controlled Z.
    Cz(usize, usize),
    /// `exp(−i θ/2 Z⊗Z)`, θ in [0, π/2].
    Rzz(usize, usize, Angle),
}

impl Gate {
    /// The qubits it acts on; the same one twice for a gate on one qubit.
    #[must_use]
    pub fn qubits(&self) -> (usize, usize) {
        match *self {
            Self::Rz(q, _) | Self::Rx(q, _) | Self::Sx(q) | Self::X(q) => (q, q),
            Self::Ecr(a, b) | Self::Cz(a, b) | Self::Rzz(a, b, _) => (a, b),
        }
    }
}

/// Native gates on a line, followed by the measurement of every qubit: position i of the line is qubit
/// i of the chain and classical bit i (`c[0]` is the least significant bit of IBM's hexadecimal samples).
#[derive(Debug, Clone, PartialEq)]
pub struct Circuit {
    line: Line,
    gates: Vec<Gate>,
    parameters: Vec<Parameter>,
}

impl Circuit {
    pub(super) fn new(line: Line, gates: Vec<Gate>, parameters: Vec<Parameter>) -> Self {
        Self { line, gates, parameters }
    }

    /// The physical qubits.
    #[must_use]
    pub fn line(&self) -> &Line {
        &self.line
    }

    /// The gates in an order that respects every dependence.
    #[must_use]
    pub fn gates(&self) -> &[Gate] {
        &self.gates
    }

    /// The parameters a job has to give values for, in IBM's order (by name); none if they are bound.
    #[must_use]
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Name and value of each parameter, as a job's `{name: value}` map wants them; empty if bound.
    #[must_use]
    pub fn parameter_values(&self, angles: &Angles) -> Vec<(String, f64)> {
        self.parameters.iter().map(|p| (p.to_string(), p.value(angles))).collect()
    }
}
