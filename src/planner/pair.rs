//! Two polylines as problems for QAOA: one chain, or windows of it where it is too long (the paper's
//! runs have 20 qubits). A window is solved with the qubits outside held, so that what it decides is worth
//! the same on the whole path. Where the two polylines share a station the couplings vanish: what windows
//! decide that meet there is exactly what the whole chain would.

use std::ops::Range;

use super::round::Challenger;
use super::trellis::Trellis;
use crate::qaoa::{Bits, ChainIsing, Ising, IsingError};

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
    /// All of a trellis, or where that has more qubits than `most` windows of everything that there is
    /// to decide, the incumbent's bits outside.
    ///
    /// # Errors
    /// [`IsingError`] where a cost is not finite.
    pub(super) fn windows_of(
        kind: Challenger,
        trellis: &Trellis,
        most: usize,
    ) -> Result<Vec<Self>, IsingError> {
        let held = Bits::zeros(trellis.qubits());
        let mut pairs = Vec::new();
        for window in windows(trellis.qubits(), most, |qubit| trellis.is_idle(qubit)) {
            let penalty = trellis.penalty(&window, &held);
            let chain = trellis.ising(penalty)?;
            let Some(problem) = chain.window(window.clone(), &held) else { continue };
            let (ising, trellis, held) = (problem.into(), trellis.clone(), held.clone());
            pairs.push(Self { kind, trellis, penalty, chain, window, held, ising });
        }
        Ok(pairs)
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

/// Where no station is shared, the step from window to window is the width by this.
const WINDOWS_OVERLAP: usize = 2;

/// Windows of at most `most` qubits over all of a chain that is not idle, from its start to its end;
/// they end at idle qubits where they can, and else overlap.
fn windows(qubits: usize, most: usize, is_idle: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let most = most.max(1);
    if qubits <= most {
        return std::iter::once(0..qubits).collect();
    }
    let mut windows = Vec::new();
    let mut first = 0;
    while first < qubits {
        if is_idle(first) {
            first += 1;
            continue;
        }
        let end = (first + most).min(qubits);
        let meeting = (first + 1..=end).rev().find(|&at| at == qubits || is_idle(at));
        let last = (first + 1..=meeting.unwrap_or(end)).rev().find(|&at| !is_idle(at - 1));
        windows.push(first..last.unwrap_or(first + 1));
        first = meeting.unwrap_or(first + (most / WINDOWS_OVERLAP).max(1));
    }
    windows
}

#[cfg(test)]
mod tests {
    use super::windows;

    #[test]
    fn windows_cover_the_chain_and_overlap_where_nothing_is_shared() {
        for most in [20, usize::MAX] {
            assert_eq!(windows(20, most, |_| false), vec![0..20; 1]);
        }
        assert_eq!(windows(21, 20, |_| false), [0..20, 10..21]);
        assert_eq!(windows(33, 16, |_| false), [0..16, 8..24, 16..32, 24..33]);
        assert_eq!(windows(3, 1, |_| false), [0..1, 1..2, 2..3]);
    }

    #[test]
    fn windows_meet_at_shared_stations_and_leave_out_what_is_idle() {
        let idle = |qubit| [0, 1, 7, 8, 13, 14].contains(&qubit);
        assert_eq!(windows(20, 6, idle), [2..7, 9..13, 15..20]);
        assert_eq!(windows(20, 12, idle), [2..13, 15..20]);
        assert_eq!(windows(20, 4, idle), [2..6, 4..7, 9..13, 15..19, 17..20]);
        assert!(windows(20, 6, |_| true).is_empty());
    }
}
