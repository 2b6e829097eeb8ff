//! From an Ising chain to a circuit of native gates on the best line of a device.

use thiserror::Error;

use super::builder::{LayerAngles, Terms, build};
use super::circuit::{Circuit, Gate, Parameter};
use super::device::{Device, Entangler, Native};
use super::line::{Demand, Direction, Line, LineError};
use super::metrics::two_qubit_depth;
use crate::qaoa::{Angles, ChainIsing};

/// More layers than parameters have names for.
pub const MAX_LAYERS: usize = 100;

/// How the circuit gets its angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Binding<'a> {
    /// As numbers: fewest pulses, since whole runs of rotations merge.
    Bound(&'a Angles),
    /// As parameters of a job, for this many layers; one text serves any angles. RZZ is not used: its
    /// angle's range cannot be kept without knowing the value.
    Inputs(usize),
}

impl Binding<'_> {
    fn layers(&self) -> usize {
        match self {
            Self::Bound(angles) => angles.layers(),
            Self::Inputs(layers) => *layers,
        }
    }

    fn angles(&self) -> Vec<LayerAngles> {
        match self {
            Self::Bound(angles) => {
                let pairs = angles.gammas().iter().zip(angles.betas());
                pairs.map(|(&gamma, &beta)| LayerAngles::Bound(gamma, beta)).collect()
            }
            Self::Inputs(layers) => (0..*layers).map(LayerAngles::Inputs).collect(),
        }
    }

    /// β before γ, which is the order of the names.
    fn parameters(&self) -> Vec<Parameter> {
        match self {
            Self::Bound(_) => Vec::new(),
            Self::Inputs(layers) => {
                let betas = (0..*layers).map(Parameter::Beta);
                betas.chain((0..*layers).map(Parameter::Gamma)).collect()
            }
        }
    }
}

/// A circuit that cannot be made.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum LowerError {
    /// No line for the chain.
    #[error(transparent)]
    Line(#[from] LineError),
    /// Too many layers.
    #[error("{layers} layers; at most {MAX_LAYERS} are sent to a QPU")]
    TooManyLayers {
        /// How many were asked for.
        layers: usize,
    },
    /// The line was chosen for another length.
    #[error("a line of {line} qubits for a chain of {chain}; choose a new line")]
    Length {
        /// Qubits of the line.
        line: usize,
        /// Qubits of the chain.
        chain: usize,
    },
    /// The line was chosen for RZZ gates, which want numbers.
    #[error("rzz gates cannot take parameters; bind the angles")]
    UnboundRzz,
}

/// Lowers the chain's circuit onto the best line of the device, with the entangler that gives the lowest
/// product of errors. `chain` is the Hamiltonian the circuit applies (scaled: [`crate::qaoa::Scale`]).
///
/// # Errors
/// If the device has no such line, or the circuit has too many layers.
pub fn lower(
    device: &Device,
    chain: &ChainIsing,
    binding: Binding<'_>,
) -> Result<Circuit, LowerError> {
    let mut best: Option<Line> = None;
    let mut failure = None;
    for entangler in device.entanglers() {
        if entangler == Entangler::Rzz && matches!(binding, Binding::Inputs(_)) {
            continue;
        }
        match choose_line(device, entangler, chain, binding) {
            Ok(line) => {
                if best.as_ref().is_none_or(|best| line.success() > best.success()) {
                    best = Some(line);
                }
            }
            Err(error) => failure = failure.or(Some(error)),
        }
    }
    match (best, failure) {
        (Some(line), _) => lower_on(&line, chain, binding),
        (None, Some(error)) => Err(error),
        (None, None) => Err(LowerError::Line(LineError::NoLine {
            device: device.name().to_owned(),
            wanted: chain.qubits(),
            exhausted: true,
        })),
    }
}

/// The best line for one kind of two-qubit gate.
///
/// # Errors
/// If the device has no such line, or the circuit has too many layers.
pub fn choose_line(
    device: &Device,
    entangler: Entangler,
    chain: &ChainIsing,
    binding: Binding<'_>,
) -> Result<Line, LowerError> {
    let native = Native { entangler, has_rx: device.has_rx() };
    let demand = demand(native, chain, binding)?;
    Ok(Line::choose(device, native, &demand)?)
}

/// Lowers the chain's circuit onto a line that was chosen before, for instance for the other circuits of
/// the same job.
///
/// # Errors
/// If the line has another length than the chain, or the circuit has too many layers.
pub fn lower_on(
    line: &Line,
    chain: &ChainIsing,
    binding: Binding<'_>,
) -> Result<Circuit, LowerError> {
    let (length, wanted) = (line.qubits().len(), chain.qubits());
    if length != wanted {
        return Err(LowerError::Length { line: length, chain: wanted });
    }
    let gates = gates(line.native(), chain, binding, line.directions())?;
    Ok(Circuit::new(line.clone(), gates, binding.parameters()))
}

/// The circuit's gates with whichever half of the bonds first makes it shallower.
fn gates(
    native: Native,
    chain: &ChainIsing,
    binding: Binding<'_>,
    directions: &[Direction],
) -> Result<Vec<Gate>, LowerError> {
    let layers = binding.layers();
    if layers > MAX_LAYERS {
        return Err(LowerError::TooManyLayers { layers });
    }
    if native.entangler == Entangler::Rzz && matches!(binding, Binding::Inputs(_)) {
        return Err(LowerError::UnboundRzz);
    }
    let terms = Terms { h: chain.h(), j: chain.j(), layers: binding.angles() };
    let [even, odd] = [false, true].map(|odd_first| build(&terms, native, directions, odd_first));
    let depth = |gates: &[Gate]| two_qubit_depth(gates, chain.qubits());
    Ok(if depth(&odd) < depth(&even) { odd } else { even })
}

/// What the circuit asks of each place of a line, found by lowering it for four imaginary lines that
/// show every pair of directions at every qubit.
pub(super) fn demand(
    native: Native,
    chain: &ChainIsing,
    binding: Binding<'_>,
) -> Result<Demand, LowerError> {
    let qubits = chain.qubits();
    let bonds = qubits - 1;
    let mut demand = Demand { bonds: vec![0; bonds], pulses: vec![[[0; 2]; 2]; qubits] };
    let directions = [Direction::Forward, Direction::Backward];
    for (even, odd) in directions.into_iter().flat_map(|a| directions.map(|b| (a, b))) {
        let along: Vec<Direction> =
            (0..bonds).map(|bond| if bond % 2 == 0 { even } else { odd }).collect();
        let gates = gates(native, chain, binding, &along)?;
        let mut pulses = vec![0; qubits];
        demand.bonds.fill(0);
        for gate in &gates {
            match gate {
                Gate::Rz(..) => {}
                Gate::Sx(qubit) | Gate::X(qubit) | Gate::Rx(qubit, _) => pulses[*qubit] += 1,
                Gate::Ecr(a, b) | Gate::Cz(a, b) | Gate::Rzz(a, b, _) => {
                    demand.bonds[*a.min(b)] += 1;
                }
            }
        }
        for (qubit, &count) in pulses.iter().enumerate() {
            let left = qubit.checked_sub(1).or(Some(qubit)).and_then(|bond| along.get(bond));
            let right = along.get(qubit).or(left);
            if let (Some(&left), Some(&right)) = (left, right) {
                demand.pulses[qubit][left as usize][right as usize] = count;
            } else {
                demand.pulses[qubit] = [[count; 2]; 2];
            }
        }
    }
    Ok(demand)
}

#[cfg(test)]
mod tests;
