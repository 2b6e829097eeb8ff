//! What is done to one row or one tile while it is in cache.

use std::f64::consts::TAU;

use super::super::cvar::Tail;
use super::super::simd::Kernel;
use super::energies::{Energies, Row};
use super::layout::{Columns, Layout, Part};
use super::vector::{LANES, Vector};
use super::walsh;

/// `e^{−iγE}` over the low qubits alone; `e^{+iγE}` for a negative γ.
#[derive(Debug, Clone)]
pub(super) struct Phases<V> {
    gamma: f64,
    re: Vec<V>,
    im: Vec<V>,
}

fn cis(angle: f64) -> (f64, f64) {
    let (sin, cos) = (angle % TAU).sin_cos();
    (cos, sin)
}

impl<V: Vector> Phases<V> {
    pub(super) fn new(low_energies: &[f64], gamma: f64) -> Self {
        let chunks = low_energies.chunks_exact(LANES);
        Self {
            gamma,
            re: chunks.clone().map(|e| V::from_fn(|lane| cis(-gamma * e[lane]).0)).collect(),
            im: chunks.map(|e| V::from_fn(|lane| cis(-gamma * e[lane]).1)).collect(),
        }
    }

    /// The phases that the high bits of a row add: doubled bit by bit.
    #[inline(always)]
    fn row(&self, row: &Row, (re, im): (&mut [V], &mut [V])) {
        let within = LANES.trailing_zeros() as usize;
        let (inner, outer) = row.fields.split_at(within);
        let outer_sum: f64 = outer.iter().sum();
        let angle = |lane: usize| {
            let signed = inner.iter().enumerate();
            let fields = signed.map(|(bit, f)| if lane >> bit & 1 == 0 { *f } else { -f });
            -self.gamma * (row.constant + outer_sum + fields.sum::<f64>())
        };
        re[0] = V::from_fn(|lane| cis(angle(lane)).0);
        im[0] = V::from_fn(|lane| cis(angle(lane)).1);
        for (bit, field) in outer.iter().enumerate() {
            let (cos, sin) = cis(2.0 * self.gamma * field);
            let (cos, sin) = (V::splat(cos), V::splat(sin));
            let (re_low, re_high) = re[..2 << bit].split_at_mut(1 << bit);
            let (im_low, im_high) = im[..2 << bit].split_at_mut(1 << bit);
            let low = re_low.iter().zip(im_low.iter());
            for ((x, y), (re, im)) in low.zip(re_high.iter_mut().zip(im_high)) {
                *re = *x * cos - *y * sin;
                *im = *x * sin + *y * cos;
            }
        }
    }

    /// Multiplies one row of amplitudes by the phases of the low qubits and those of the row.
    #[inline(always)]
    fn apply(&self, (row_re, row_im): (&[V], &[V]), part: &mut Part<'_, V>) {
        let low = self.re.iter().zip(&self.im);
        let phases = low.zip(row_re.iter().zip(row_im));
        for (((a, b), (c, d)), (x, y)) in phases.zip(part.re.iter_mut().zip(part.im.iter_mut())) {
            let (re, im) = (*a * *c - *b * *d, *a * *d + *b * *c);
            (*x, *y) = (*x * re - *y * im, *x * im + *y * re);
        }
    }
}

/// The mixer's eigenvalues by number of ones, divided by 2ⁿ for a transform there and back.
#[derive(Debug, Clone)]
pub(super) struct Mixer {
    by_ones: Vec<(f64, f64)>,
}

impl Mixer {
    pub(super) fn new(qubits: usize, beta: f64) -> Self {
        let scale = 0.5_f64.powi(qubits as i32);
        let eigenvalue = |ones: usize| cis(-beta * (qubits as f64 - 2.0 * ones as f64));
        let scaled = |(cos, sin): (f64, f64)| (cos * scale, sin * scale);
        Self { by_ones: (0..=qubits).map(|ones| scaled(eigenvalue(ones))).collect() }
    }

    /// The factors of one tile's columns for each number of ones among the high bits.
    #[inline(always)]
    fn columns<V: Vector>(&self, layout: &Layout, column: usize) -> Vec<(V, V)> {
        let mut factors = Vec::with_capacity((layout.high + 1) * layout.width);
        for ones in 0..=layout.high {
            for vector in 0..layout.width {
                let start = (column + vector) * LANES;
                let at = |lane: usize| self.by_ones[ones + (start + lane).count_ones() as usize];
                factors.push((V::from_fn(|lane| at(lane).0), V::from_fn(|lane| at(lane).1)));
            }
        }
        factors
    }
}

#[inline(always)]
fn scale_tile<V: Vector>(factors: &[(V, V)], layout: &Layout, part: &mut Part<'_, V>) {
    let width = layout.width;
    let rows = part.re.chunks_exact_mut(width).zip(part.im.chunks_exact_mut(width));
    for (row, (re, im)) in rows.enumerate() {
        let ones = row.count_ones() as usize;
        let factors = &factors[ones * width..(ones + 1) * width];
        for ((x, y), (c, s)) in re.iter_mut().zip(im).zip(factors) {
            (*x, *y) = (*x * *c - *y * *s, *x * *s + *y * *c);
        }
    }
}

/// The equal superposition after the first phase, transformed for the mixer.
pub(super) struct First<'a, V> {
    pub(super) energies: &'a Energies,
    pub(super) layout: &'a Layout,
    pub(super) phases: &'a Phases<V>,
    pub(super) row: usize,
    pub(super) state: Part<'a, V>,
}

impl<V: Vector> Kernel for First<'_, V> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { energies, layout, phases, row, mut state } = self;
        let (mut re, mut im) = (vec![V::ZERO; layout.row], vec![V::ZERO; layout.row]);
        phases.row(&energies.row(row), (&mut re, &mut im));
        state.re.fill(V::splat(0.5_f64.powi(layout.qubits() as i32).sqrt()));
        state.im.fill(V::ZERO);
        phases.apply((&re, &im), &mut state);
        forward(&mut state);
    }
}

#[inline(always)]
fn transform_tile<V: Vector>(layout: &Layout, tile: &mut Part<'_, V>) {
    walsh::columns(tile.re, layout.width);
    walsh::columns(tile.im, layout.width);
}

/// One mixer on a group of columns.
pub(super) struct Mix<'a, V> {
    pub(super) layout: &'a Layout,
    pub(super) mixer: &'a Mixer,
    pub(super) state: Columns<'a, V>,
}

impl<V: Vector> Kernel for Mix<'_, V> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { layout, mixer, mut state } = self;
        let (mut re, mut im) = (vec![V::ZERO; layout.tile()], vec![V::ZERO; layout.tile()]);
        let tile = &mut Part { re: &mut re, im: &mut im };
        for column in (0..state.width()).step_by(layout.width) {
            let factors = mixer.columns::<V>(layout, state.start + column);
            state.read(column, layout.width, tile);
            transform_tile(layout, tile);
            scale_tile(&factors, layout, tile);
            transform_tile(layout, tile);
            state.write(column, layout.width, tile);
        }
    }
}

/// Takes a mixer off the state and its adjoint. Returns Im⟨λ|ΣX|ψ⟩ of a group of columns.
pub(super) struct Unmix<'a, V> {
    pub(super) layout: &'a Layout,
    /// With the sign of β changed.
    pub(super) mixer: &'a Mixer,
    pub(super) state: Columns<'a, V>,
    pub(super) adjoint: Columns<'a, V>,
}

impl<V: Vector> Kernel for Unmix<'_, V> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let Self { layout, mixer, mut state, mut adjoint } = self;
        let mut buffers = vec![V::ZERO; 4 * layout.tile()];
        let (first, second) = buffers.split_at_mut(2 * layout.tile());
        let (re, im) = first.split_at_mut(layout.tile());
        let psi = &mut Part { re, im };
        let (re, im) = second.split_at_mut(layout.tile());
        let lambda = &mut Part { re, im };
        let mut total = 0.0;
        for column in (0..state.width()).step_by(layout.width) {
            let factors = mixer.columns::<V>(layout, state.start + column);
            state.read(column, layout.width, psi);
            adjoint.read(column, layout.width, lambda);
            transform_tile(layout, psi);
            transform_tile(layout, lambda);
            total += flips(layout, state.start + column, psi, lambda);
            scale_tile(&factors, layout, psi);
            scale_tile(&factors, layout, lambda);
            transform_tile(layout, psi);
            transform_tile(layout, lambda);
            state.write(column, layout.width, psi);
            adjoint.write(column, layout.width, lambda);
        }
        total * 0.5_f64.powi(layout.qubits() as i32)
    }
}

/// Im⟨λ|ΣX|ψ⟩ of one transformed tile, where ΣX has the eigenvalue n − 2·(number of ones).
#[inline(always)]
fn flips<V: Vector>(
    layout: &Layout,
    column: usize,
    psi: &Part<'_, V>,
    lambda: &Part<'_, V>,
) -> f64 {
    let mut total = 0.0;
    for vector in 0..layout.width {
        let start = (column + vector) * LANES;
        let of_low = V::from_fn(|lane| {
            layout.qubits() as f64 - 2.0 * f64::from((start + lane).count_ones())
        });
        let mut sum = V::ZERO;
        for row in 0..layout.rows() {
            let at = row * layout.width + vector;
            let (x, y, u, v) = (psi.re[at], psi.im[at], lambda.re[at], lambda.im[at]);
            let eigenvalue = of_low - V::splat(2.0 * f64::from(row.count_ones()));
            sum += eigenvalue * (u * y - v * x);
        }
        total += sum.sum();
    }
    total
}

#[inline(always)]
fn forward<V: Vector>(part: &mut Part<'_, V>) {
    walsh::forward(part.re);
    walsh::forward(part.im);
}

#[inline(always)]
fn backward<V: Vector>(part: &mut Part<'_, V>) {
    walsh::backward(part.re);
    walsh::backward(part.im);
}

/// A row out of the mixer's transform: plain amplitudes.
pub(super) struct Plain<'a, V> {
    pub(super) state: Part<'a, V>,
}

impl<V: Vector> Kernel for Plain<'_, V> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        backward(&mut self.state);
    }
}

/// The next phase on a row, from the last mixer to the next.
pub(super) struct Phase<'a, V> {
    pub(super) energies: &'a Energies,
    pub(super) layout: &'a Layout,
    pub(super) phases: &'a Phases<V>,
    pub(super) row: usize,
    pub(super) state: Part<'a, V>,
}

impl<V: Vector> Kernel for Phase<'_, V> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { energies, layout, phases, row, mut state } = self;
        backward(&mut state);
        let (mut re, mut im) = (vec![V::ZERO; layout.row], vec![V::ZERO; layout.row]);
        phases.row(&energies.row(row), (&mut re, &mut im));
        phases.apply((&re, &im), &mut state);
        forward(&mut state);
    }
}

/// ⟨ψ|H|ψ⟩ of a row of plain amplitudes.
pub(super) struct Energy<'a, V> {
    pub(super) energies: &'a Energies,
    pub(super) low_energies: &'a [V],
    pub(super) layout: &'a Layout,
    pub(super) row: usize,
    pub(super) state: (&'a [V], &'a [V]),
}

impl<V: Vector> Kernel for Energy<'_, V> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let mut energies = vec![V::ZERO; self.layout.row];
        self.energies.fill(self.row, self.low_energies, &mut energies);
        let mut sum = V::ZERO;
        for ((x, y), e) in self.state.0.iter().zip(self.state.1).zip(&energies) {
            sum += *e * (*x * *x + *y * *y);
        }
        sum.sum()
    }
}

/// Turns round: λ = Hψ of a row, both transformed for the mixer. Returns ⟨ψ|H|ψ⟩. With a tail, what
/// it makes of H takes its place.
pub(super) struct Turn<'a, V> {
    pub(super) energies: &'a Energies,
    pub(super) low_energies: &'a [V],
    pub(super) tail: Option<Tail>,
    pub(super) row: usize,
    pub(super) state: Part<'a, V>,
    pub(super) adjoint: Part<'a, V>,
}

impl<V: Vector> Kernel for Turn<'_, V> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let Self { energies, low_energies, tail, row, mut state, mut adjoint } = self;
        backward(&mut state);
        energies.fill(row, low_energies, adjoint.im);
        if let Some(tail) = tail {
            for energy in adjoint.im.iter_mut() {
                *energy = V::from_fn(|lane| tail.value(energy.lane(lane)));
            }
        }
        let mut sum = V::ZERO;
        let there = adjoint.re.iter_mut().zip(adjoint.im.iter_mut());
        for ((x, y), (u, v)) in state.re.iter().zip(state.im.iter()).zip(there) {
            let energy = *v;
            (*u, *v) = (energy * *x, energy * *y);
            sum += *x * *u + *y * *v;
        }
        forward(&mut state);
        forward(&mut adjoint);
        sum.sum()
    }
}

/// Takes a phase off a row of the state and its adjoint, and transforms both for the mixer before it, if
/// there is one. Returns Im⟨λ|H|ψ⟩.
pub(super) struct Unphase<'a, V> {
    pub(super) energies: &'a Energies,
    pub(super) low_energies: &'a [V],
    pub(super) layout: &'a Layout,
    /// With the sign of γ changed; none before the first layer.
    pub(super) phases: Option<&'a Phases<V>>,
    pub(super) row: usize,
    pub(super) state: Part<'a, V>,
    pub(super) adjoint: Part<'a, V>,
}

impl<V: Vector> Kernel for Unphase<'_, V> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let Self { energies, low_energies, layout, phases, row, mut state, mut adjoint } = self;
        backward(&mut state);
        backward(&mut adjoint);
        let (mut re, mut im) = (vec![V::ZERO; layout.row], vec![V::ZERO; layout.row]);
        energies.fill(row, low_energies, &mut re);
        let mut sum = V::ZERO;
        let there = adjoint.re.iter().zip(adjoint.im.iter());
        for (((x, y), (u, v)), e) in state.re.iter().zip(state.im.iter()).zip(there).zip(&re) {
            sum += *e * (*u * *y - *v * *x);
        }
        if let Some(phases) = phases {
            phases.row(&energies.row(row), (&mut re, &mut im));
            for part in [&mut state, &mut adjoint] {
                phases.apply((&re, &im), part);
                forward(part);
            }
        }
        sum.sum()
    }
}
