//! Two polylines as problems for QAOA: one chain, or windows of it where an engine does not take as many
//! qubits (the paper's QPU run has 20). A window is solved with the qubits outside held, so that what it
//! decides is worth the same on the whole path.

use std::ops::Range;

use super::rounds::Challenger;
use super::trellis::Trellis;
use crate::qaoa::{Bits, ChainIsing, Ising};

/// A part of a chain. The qubits outside keep the bits that they have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Window {
    /// Its first qubit, from 0.
    pub first: usize,
    /// Qubits of the whole chain.
    pub of: usize,
}

/// Two polylines as a problem, or a window of it.
pub(super) struct Pair {
    pub(super) kind: Challenger,
    pub(super) trellis: Trellis,
    pub(super) penalty: f64,
    /// All of the trellis.
    chain: ChainIsing,
    window: Range<usize>,
    /// The bits of the whole chain, of which those outside the window stay.
    pub(super) held: Bits,
    /// The problem of the window.
    pub(super) ising: Ising,
}

impl Pair {
    /// All of a trellis, or where that has more qubits than `most` each window that has something to
    /// decide, the incumbent's bits outside.
    pub(super) fn windows_of(
        kind: Challenger,
        trellis: Trellis,
        penalty: f64,
        chain: ChainIsing,
        most: usize,
    ) -> Vec<Self> {
        let windows = windows(trellis.qubits(), most);
        let only = windows.len() == 1;
        let held = Bits::zeros(trellis.qubits());
        windows
            .into_iter()
            .filter(|window| only || !trellis.is_idle(window.clone()))
            .filter_map(|window| {
                let ising = chain.window(window.clone(), &held)?.into();
                let (trellis, chain, held) = (trellis.clone(), chain.clone(), held.clone());
                Some(Self { kind, trellis, penalty, chain, window, held, ising })
            })
            .collect()
    }

    /// Which part of the chain it is, where it is not all of it.
    pub(super) fn part(&self) -> Option<Window> {
        let of = self.trellis.qubits();
        (self.window.len() < of).then_some(Window { first: self.window.start, of })
    }

    /// The same window with other bits outside.
    pub(super) fn holding(self, held: Bits) -> Self {
        let ising = match self.chain.window(self.window.clone(), &held) {
            Some(problem) => problem.into(),
            None => self.ising,
        };
        Self { held, ising, ..self }
    }

    /// The bits of the whole chain with those of a window's sample.
    pub(super) fn whole(&self, sample: &Bits) -> Bits {
        let mut whole = self.held.clone();
        sample.iter().zip(self.window.clone()).for_each(|(bit, qubit)| whole.set(qubit, bit));
        whole
    }
}

/// Steps between two windows, as a share of their width: they overlap by half.
const WINDOWS_OVERLAP: usize = 2;

/// Windows of at most `most` qubits over a chain, from its start to its end.
fn windows(qubits: usize, most: usize) -> Vec<Range<usize>> {
    let width = most.clamp(1, qubits.max(1));
    let step = (width / WINDOWS_OVERLAP).max(1);
    let last = qubits - width.min(qubits);
    (0..last).step_by(step).chain([last]).map(|first| first..first + width).collect()
}

#[cfg(test)]
mod tests {
    use super::windows;

    #[test]
    fn windows_cover_the_chain_and_overlap() {
        for most in [20, usize::MAX] {
            assert_eq!(windows(20, most), vec![0..20; 1]);
        }
        assert_eq!(windows(21, 20), [0..20, 1..21]);
        assert_eq!(windows(33, 8), [0..8, 4..12, 8..16, 12..20, 16..24, 20..28, 24..32, 25..33]);
        assert_eq!(windows(3, 1), [0..1, 1..2, 2..3]);
    }
}
