//! Where amplitudes lie. A pass over the state reads it in one layout and writes it in the other, so that
//! what it transforms is contiguous in cache: *rows* of all low qubits for the phases, *tiles* of all
//! high qubits (a few columns wide) for the other half of the mixer.

use rayon::prelude::*;

use super::vector::Vector;

/// Sizes of rows and tiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// Low qubits.
    pub(super) low: usize,
    /// High qubits.
    pub(super) high: usize,
    /// Vectors of a row.
    pub(super) row: usize,
    /// Vectors of a tile's row.
    pub(super) width: usize,
}

impl Layout {
    /// The layout for `qubits`, with dummy qubits on top if there are too few for whole vectors.
    pub(super) fn new<V: Vector>(qubits: usize) -> Self {
        let lanes = V::LANES.trailing_zeros() as usize;
        let low = (qubits / 2).clamp(11, 13);
        let high = qubits.saturating_sub(low);
        Self { low, high, row: 1 << (low - lanes), width: 4 }
    }

    /// All qubits, dummies included.
    pub(super) fn qubits(&self) -> usize {
        self.low + self.high
    }

    /// Number of rows.
    pub(super) fn rows(&self) -> usize {
        1 << self.high
    }

    /// Vectors of a tile.
    pub(super) fn tile(&self) -> usize {
        self.width << self.high
    }

    /// Copies one row out of tiles.
    #[inline(always)]
    pub(super) fn gather_row<V: Vector>(&self, tiles: &[V], row: usize, out: &mut [V]) {
        let start = row * self.width;
        for (tile, out) in out.chunks_exact_mut(self.width).enumerate() {
            out.copy_from_slice(&tiles[start + tile * self.tile()..][..self.width]);
        }
    }

    /// Copies one tile out of rows.
    #[inline(always)]
    pub(super) fn gather_tile<V: Vector>(&self, rows: &[V], tile: usize, out: &mut [V]) {
        let start = tile * self.width;
        for (row, out) in out.chunks_exact_mut(self.width).enumerate() {
            out.copy_from_slice(&rows[start + row * self.row..][..self.width]);
        }
    }
}

/// Real and imaginary parts of all amplitudes.
#[derive(Debug, Clone, Default)]
pub(super) struct Amplitudes<V> {
    pub(super) re: Vec<V>,
    pub(super) im: Vec<V>,
}

/// The same of one row or tile.
pub(super) struct Part<'a, V> {
    pub(super) re: &'a mut [V],
    pub(super) im: &'a mut [V],
}

impl<V: Vector> Amplitudes<V> {
    /// Makes room.
    pub(super) fn reserve(&mut self, layout: &Layout) {
        self.re.resize(layout.row << layout.high, V::ZERO);
        self.im.resize(layout.row << layout.high, V::ZERO);
    }

    /// Rows or tiles of `size` vectors each, for several threads.
    pub(super) fn parts(
        &mut self,
        size: usize,
    ) -> impl IndexedParallelIterator<Item = Part<'_, V>> {
        let parts = self.re.par_chunks_mut(size).zip(self.im.par_chunks_mut(size));
        parts.map(|(re, im)| Part { re, im })
    }
}
