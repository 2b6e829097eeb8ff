//! Amplitudes of bit prefixes over the next qubit's trajectory, several prefixes side by side.

use num_complex::Complex64;

use super::super::simd::F4;

/// Prefixes that are worked on together.
pub(super) const LANES: usize = 8;

/// Real and imaginary parts of [`LANES`] prefixes for one trajectory.
#[derive(Debug, Clone, Copy)]
struct Row {
    re: [F4; 2],
    im: [F4; 2],
}

impl Row {
    const ZERO: Self = Self { re: [F4::ZERO; 2], im: [F4::ZERO; 2] };
}

/// Up to [`LANES`] prefixes over all trajectories.
#[derive(Debug, Clone)]
pub(super) struct Group {
    rows: Vec<Row>,
}

impl Group {
    /// The empty prefix, before the first qubit, in every lane.
    pub(super) fn start(trajectories: usize) -> Self {
        Self { rows: vec![Row { re: [F4::ONE; 2], im: [F4::ZERO; 2] }; trajectories] }
    }

    /// Copies one prefix.
    #[inline(always)]
    pub(super) fn copy_lane(&mut self, lane: usize, from: &Self, column: usize) {
        for (to, from) in self.rows.iter_mut().zip(&from.rows) {
            to.re[lane / 4].0[lane % 4] = from.re[column / 4].0[column % 4];
            to.im[lane / 4].0[lane % 4] = from.im[column / 4].0[column % 4];
        }
    }

    /// Multiplies all prefixes by one factor per trajectory.
    #[inline(always)]
    pub(super) fn multiply(&mut self, factors: &[Complex64]) {
        for (row, factor) in self.rows.iter_mut().zip(factors) {
            for k in 0..2 {
                let (x, y) = (row.re[k], row.im[k]);
                row.re[k] = factor.re * x - factor.im * y;
                row.im[k] = factor.im * x + factor.re * y;
            }
        }
    }

    /// Multiplies each prefix by the factors of its bit: `scales[bit]` is zero where a prefix has the
    /// other bit.
    #[inline(always)]
    pub(super) fn multiply_by_bit(
        &mut self,
        factors: &[Vec<Complex64>; 2],
        scales: &[[f64; LANES]; 2],
    ) {
        let [zero, one] = scales;
        let half = |scale: &[f64; LANES], k: usize| {
            F4([scale[4 * k], scale[4 * k + 1], scale[4 * k + 2], scale[4 * k + 3]])
        };
        let (zero, one) = ([half(zero, 0), half(zero, 1)], [half(one, 0), half(one, 1)]);
        for ((row, f), g) in self.rows.iter_mut().zip(&factors[0]).zip(&factors[1]) {
            for k in 0..2 {
                let (re, im) = (f.re * zero[k] + g.re * one[k], f.im * zero[k] + g.im * one[k]);
                let (x, y) = (row.re[k], row.im[k]);
                row.re[k] = re * x - im * y;
                row.im[k] = im * x + re * y;
            }
        }
    }

    /// Carries the amplitudes over a bond: `Π_l e^{−iγ_l J a_l b_l}`.
    #[inline(always)]
    pub(super) fn cross_bond(&mut self, gammas: &[f64], j: f64) {
        for (layer, gamma) in gammas.iter().enumerate() {
            let (sin, cos) = (gamma * j).sin_cos();
            let half = 1 << layer;
            for block in self.rows.chunks_exact_mut(2 * half) {
                let (plus, minus) = block.split_at_mut(half);
                for (p, m) in plus.iter_mut().zip(minus) {
                    for k in 0..2 {
                        let (even_re, even_im) =
                            (cos * (p.re[k] + m.re[k]), cos * (p.im[k] + m.im[k]));
                        let (odd_re, odd_im) =
                            (sin * (p.re[k] - m.re[k]), sin * (p.im[k] - m.im[k]));
                        // cos·even − i sin·odd, and its mirror image.
                        p.re[k] = even_re + odd_im;
                        p.im[k] = even_im - odd_re;
                        m.re[k] = even_re - odd_im;
                        m.im[k] = even_im + odd_re;
                    }
                }
            }
        }
    }

    /// `Σ w(a) w(ā)* R(a, ā)` of every prefix for a Hermitian matrix R, entry `a + 2^p ā`.
    #[inline(always)]
    pub(super) fn quadratic_form(&self, right: &[Complex64]) -> [f64; LANES] {
        let width = self.rows.len();
        let mut total = [F4::ZERO; 2];
        for (bra, row) in self.rows.iter().enumerate() {
            let matrix = &right[width * bra..width * (bra + 1)];
            let half = 0.5 * matrix[bra].re;
            let mut sum = Row::ZERO;
            for k in 0..2 {
                (sum.re[k], sum.im[k]) = (half * row.re[k], half * row.im[k]);
            }
            for (ket, r) in self.rows[..bra].iter().zip(matrix) {
                for k in 0..2 {
                    sum.re[k] += r.re * ket.re[k] - r.im * ket.im[k];
                    sum.im[k] += r.re * ket.im[k] + r.im * ket.re[k];
                }
            }
            for (k, total) in total.iter_mut().enumerate() {
                *total += row.re[k] * sum.re[k] + row.im[k] * sum.im[k];
            }
        }
        let [F4([a, b, c, d]), F4([e, f, g, h])] = [2.0 * total[0], 2.0 * total[1]];
        [a, b, c, d, e, f, g, h]
    }

    /// The amplitude of one lane's prefix once all qubits are in it.
    pub(super) fn amplitude(&self, lane: usize) -> Complex64 {
        let part = |parts: &[F4; 2]| parts[lane / 4].0[lane % 4];
        self.rows.iter().map(|row| Complex64::new(part(&row.re), part(&row.im))).sum()
    }
}
