//! Where amplitudes lie, and how a pass over the state cuts them up so that what it transforms fits into
//! cache: into *rows* (all low qubits, contiguous) for the phases, and into *tiles* (all high qubits, a
//! few columns wide, copied out and back) for the other half of the mixer.

use rayon::prelude::*;

use super::vector::{LANES, Vector};

/// Groups of tiles that threads can take separately.
const GROUPS: usize = 16;
/// Vectors of a tile's row.
const WIDTH: usize = 4;
/// Vectors between rows.
const PAD: usize = 4;

/// Sizes of rows and tiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// Low qubits.
    pub(super) low: usize,
    /// High qubits.
    pub(super) high: usize,
    /// Vectors of a row.
    pub(super) row: usize,
    /// Vectors from one row to the next.
    pub(super) stride: usize,
    /// Vectors of a tile's row.
    pub(super) width: usize,
}

impl Layout {
    /// Number of amplitudes of the state of `qubits` as it lies in memory, [`u64::MAX`] if it can't.
    pub(super) fn amplitudes(qubits: usize) -> u64 {
        let Self { high, stride, .. } = Self::new(qubits);
        let row = (stride * LANES) as u64;
        1_u64.checked_shl(high as u32).map_or(u64::MAX, |rows| rows.saturating_mul(row))
    }

    /// The layout for `qubits`, with dummy qubits on top if there are too few for whole vectors.
    pub(super) fn new(qubits: usize) -> Self {
        let lanes = LANES.trailing_zeros() as usize;
        let low = (qubits / 2).clamp(11, 13);
        let row = 1 << (low - lanes);
        Self { low, high: qubits.saturating_sub(low), row, stride: row + PAD, width: WIDTH }
    }

    /// All qubits, dummies included.
    pub(super) fn qubits(&self) -> usize {
        self.low + self.high
    }

    /// Number of rows.
    pub(super) fn rows(&self) -> usize {
        1 << self.high
    }

    /// Vector and lane of an amplitude.
    pub(super) fn place(&self, index: usize) -> (usize, usize) {
        let vector = index / LANES;
        (vector / self.row * self.stride + vector % self.row, index % LANES)
    }

    /// Vectors of a tile.
    pub(super) fn tile(&self) -> usize {
        self.width << self.high
    }
}

/// Real and imaginary parts of all amplitudes, row by row.
#[derive(Debug, Clone, Default)]
pub(super) struct Amplitudes<V> {
    pub(super) re: Vec<V>,
    pub(super) im: Vec<V>,
}

/// Real and imaginary parts of one row or tile.
pub(super) struct Part<'a, V> {
    pub(super) re: &'a mut [V],
    pub(super) im: &'a mut [V],
}

/// The same columns of all rows, a few tiles wide.
pub(super) struct Columns<'a, V> {
    /// Where the columns start, in vectors.
    pub(super) start: usize,
    re: Vec<&'a mut [V]>,
    im: Vec<&'a mut [V]>,
}

impl<V: Vector> Amplitudes<V> {
    /// Makes room.
    pub(super) fn reserve(&mut self, layout: &Layout) {
        self.re.resize(layout.stride << layout.high, V::ZERO);
        self.im.resize(layout.stride << layout.high, V::ZERO);
    }

    /// All rows, for several threads.
    pub(super) fn rows(
        &mut self,
        layout: &Layout,
    ) -> impl IndexedParallelIterator<Item = Part<'_, V>> {
        let (row, stride) = (layout.row, layout.stride);
        let parts = self.re.par_chunks_mut(stride).zip(self.im.par_chunks_mut(stride));
        parts.map(move |(re, im)| Part { re: &mut re[..row], im: &mut im[..row] })
    }

    /// All rows, to read.
    pub(super) fn plain_rows(
        &self,
        layout: &Layout,
    ) -> impl IndexedParallelIterator<Item = (&[V], &[V])> {
        let (row, stride) = (layout.row, layout.stride);
        let parts = self.re.par_chunks(stride).zip(self.im.par_chunks(stride));
        parts.map(move |(re, im)| (&re[..row], &im[..row]))
    }

    /// All columns in groups, for several threads.
    pub(super) fn columns(&mut self, layout: &Layout) -> Vec<Columns<'_, V>> {
        let width = (layout.row / GROUPS).max(layout.width);
        let group = |group: usize| Columns { start: group * width, re: vec![], im: vec![] };
        let mut groups: Vec<_> = (0..layout.row / width).map(group).collect();
        let rows =
            self.re.chunks_exact_mut(layout.stride).zip(self.im.chunks_exact_mut(layout.stride));
        for (re, im) in rows {
            let pieces = re[..layout.row]
                .chunks_exact_mut(width)
                .zip(im[..layout.row].chunks_exact_mut(width));
            for (group, (re, im)) in groups.iter_mut().zip(pieces) {
                group.re.push(re);
                group.im.push(im);
            }
        }
        groups
    }
}

impl<V: Vector> Columns<'_, V> {
    /// Width of the columns, in vectors.
    #[inline(always)]
    pub(super) fn width(&self) -> usize {
        self.re[0].len()
    }

    /// Copies out the tile that begins at a column.
    #[inline(always)]
    pub(super) fn read(&self, column: usize, width: usize, tile: &mut Part<'_, V>) {
        for (out, row) in tile.re.chunks_exact_mut(width).zip(&self.re) {
            copy(&row[column..column + width], out);
        }
        for (out, row) in tile.im.chunks_exact_mut(width).zip(&self.im) {
            copy(&row[column..column + width], out);
        }
    }

    /// Copies a tile back.
    #[inline(always)]
    pub(super) fn write(&mut self, column: usize, width: usize, tile: &Part<'_, V>) {
        for (from, row) in tile.re.chunks_exact(width).zip(&mut self.re) {
            copy(from, &mut row[column..column + width]);
        }
        for (from, row) in tile.im.chunks_exact(width).zip(&mut self.im) {
            copy(from, &mut row[column..column + width]);
        }
    }
}

/// A few vectors; `copy_from_slice` would call a function for them.
#[inline(always)]
fn copy<V: Vector>(from: &[V], to: &mut [V]) {
    for (from, to) in from.iter().zip(to) {
        *to = *from;
    }
}
