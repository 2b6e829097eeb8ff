//! [`Device`]: what a circuit needs to know about one QPU: its gates, which qubits they join in which
//! direction, and how often each of them fails.

use std::collections::BTreeMap;
use std::fmt;

/// A qubit of the device, written `$n` in OpenQASM 3.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PhysicalQubit(pub u32);

impl PhysicalQubit {
    /// Its place in the device's list of qubits.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl fmt::Display for PhysicalQubit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "${}", self.0)
    }
}

/// A duration on the QPU, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
pub struct Nanoseconds(pub f64);

/// A native gate on two qubits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Entangler {
    /// Echoed cross-resonance (Eagle): one direction per coupler.
    Ecr,
    /// Controlled Z (Heron, Nighthawk).
    Cz,
    /// `exp(−i θ/2 Z⊗Z)` with θ in [0, π/2] (Heron's fractional gate).
    Rzz,
}

impl Entangler {
    /// Every kind, in the order of preference where errors tie.
    pub const ALL: [Self; 3] = [Self::Rzz, Self::Cz, Self::Ecr];

    /// The gate's name in IBM's documents and in OpenQASM.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Ecr => "ecr",
            Self::Cz => "cz",
            Self::Rzz => "rzz",
        }
    }

    /// Whether exchanging the two qubits leaves the gate as it is.
    #[must_use]
    pub fn is_symmetric(self) -> bool {
        self != Self::Ecr
    }
}

impl fmt::Display for Entangler {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// The gates a circuit is made of, besides `rz`, `sx` and `x`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Native {
    /// The gate of every bond.
    pub entangler: Entangler,
    /// Whether `rx` with any angle may be used.
    pub has_rx: bool,
}

/// How one gate on given qubits did when it was last calibrated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// Probability that it fails, 0 ≤ error < 1. Faulty ones (1.0, unknown) have no calibration at all.
    pub error: f64,
    /// How long it takes, where IBM says so.
    pub length: Option<Nanoseconds>,
}

/// How one qubit is read out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Readout {
    /// Mean of the two below as IBM gives it, 0 ≤ error < 1.
    pub error: f64,
    /// Probability to read 1 after |0⟩ was prepared.
    pub one_for_zero: f64,
    /// Probability to read 0 after |1⟩ was prepared.
    pub zero_for_one: f64,
    /// How long it takes, where IBM says so.
    pub length: Option<Nanoseconds>,
}

/// One qubit's calibration. What is missing here cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct QubitCalibration {
    /// The `sx` gate; `x` has the same pulse and error.
    pub sx: Option<Calibration>,
    /// The `rx` gate, where the device offers it.
    pub rx: Option<Calibration>,
    /// The readout.
    pub readout: Option<Readout>,
}

impl QubitCalibration {
    /// Whether the qubit can be driven and read.
    #[must_use]
    pub fn usable(&self) -> bool {
        self.sx.is_some() && self.readout.is_some()
    }
}

/// A QPU as of its last calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Device {
    pub(super) name: String,
    pub(super) calibrated: Option<String>,
    pub(super) qubits: Vec<QubitCalibration>,
    pub(super) couplers: BTreeMap<Entangler, BTreeMap<(PhysicalQubit, PhysicalQubit), Calibration>>,
    pub(super) has_rx: bool,
    pub(super) rep_delay: Option<Nanoseconds>,
}

impl Device {
    /// IBM's name of it, for instance `ibm_kyiv`.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// When the properties were last updated, as IBM writes it (ISO 8601).
    #[must_use]
    pub fn calibrated(&self) -> Option<&str> {
        self.calibrated.as_deref()
    }

    /// Every qubit, usable or not; `qubits()[n]` is `$n`.
    #[must_use]
    pub fn qubits(&self) -> &[QubitCalibration] {
        &self.qubits
    }

    /// One qubit; `None` if the device has no such qubit.
    #[must_use]
    pub fn qubit(&self, qubit: PhysicalQubit) -> Option<&QubitCalibration> {
        self.qubits.get(qubit.index())
    }

    /// Kinds of two-qubit gates that work on at least one pair of usable qubits.
    pub fn entanglers(&self) -> impl Iterator<Item = Entangler> + '_ {
        Entangler::ALL.into_iter().filter(|kind| self.couplers.contains_key(kind))
    }

    /// The pairs a gate works on, in the direction the device has, between usable qubits. Symmetric
    /// gates may be listed in both directions.
    pub fn couplers(
        &self,
        entangler: Entangler,
    ) -> impl Iterator<Item = (PhysicalQubit, PhysicalQubit, Calibration)> + '_ {
        let pairs = self.couplers.get(&entangler).into_iter().flatten();
        pairs.map(|(&(control, target), &calibration)| (control, target, calibration))
    }

    /// The calibration of a gate on exactly this ordered pair; `None` if it cannot be used.
    #[must_use]
    pub fn coupler(
        &self,
        entangler: Entangler,
        control: PhysicalQubit,
        target: PhysicalQubit,
    ) -> Option<Calibration> {
        self.couplers.get(&entangler)?.get(&(control, target)).copied()
    }

    /// Whether `rx` with any angle is native.
    #[must_use]
    pub fn has_rx(&self) -> bool {
        self.has_rx
    }

    /// Pause between two shots if a job does not ask for another.
    #[must_use]
    pub fn rep_delay(&self) -> Option<Nanoseconds> {
        self.rep_delay
    }
}
