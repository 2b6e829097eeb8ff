//! Vectors over one qubit's folded trajectory, and how a bond carries them to the neighbour.
//!
//! A qubit's Z value while layer l acts is `a_l` in the ket and `ā_l` in the bra: *classical* if they
//! agree, *quantum* if not. So a layer has four states, numbered c+ = 0, c− = 1, q+ = 2, q− = 3 (the
//! sign is that of `a_l`), and a [`slab`](Slab) holds the 4^m states of all but the last layer.
//! Exchanging ket and bra exchanges q+ and q− and conjugates, so a slab is stored as one real number per
//! state, the sum of its real and its imaginary part; the difference is found at the exchanged state.
//!
//! The bond factor of a layer, `e^{−iγJ(a b − ā b̄)}`, is 1 between states of one kind and `e^{∓2iγJ}`
//! between a classical and a quantum one. In terms of sums and differences over the sign it scales the
//! sum and the difference of the even parts, c + q by cos²(γJ) and c − q by sin²(γJ), and exchanges the
//! odd parts, with the factor −i sin(2γJ): one transform for all layers, one product, and back.

use super::super::simd::F4;

/// 4^m numbers in blocks of four: state of layer 0 within the block, of layer 1 next, and so on.
pub(super) type Slab = [F4];

/// The block that holds the states of `block` with ket and bra exchanged.
#[inline(always)]
pub(super) fn exchanged_block(block: usize) -> usize {
    block ^ (block >> 1 & 0x5555_5555)
}

/// Ket and bra exchanged in layer 0.
#[inline(always)]
pub(super) fn exchanged(block: F4) -> F4 {
    let F4([a, b, c, d]) = block;
    F4([a, b, d, c])
}

/// Whether the odd parts of quantum and classical states have changed places in a spectrum. Those of
/// the vectors coming from the left are straight, those from the right crossed, so that what a bond
/// joins has the same index.
pub(super) const STRAIGHT: bool = false;
/// See [`STRAIGHT`].
pub(super) const CROSSED: bool = true;

#[inline(always)]
fn to_spectrum<const ORDER: bool>([c_plus, c_minus, q_plus, q_minus]: [F4; 4]) -> [F4; 4] {
    let (c_even, c_odd) = (c_plus + c_minus, c_plus - c_minus);
    let (q_even, q_odd) = (q_plus + q_minus, q_plus - q_minus);
    let (third, fourth) = if ORDER == CROSSED { (q_odd, c_odd) } else { (c_odd, q_odd) };
    [c_even + q_even, c_even - q_even, third, fourth]
}

#[inline(always)]
fn from_spectrum<const ORDER: bool>([sum, difference, third, fourth]: [F4; 4]) -> [F4; 4] {
    let (c_even, q_even) = (sum + difference, sum - difference);
    // The bond turns the odd part of one kind into that of the other.
    let (c_odd, q_odd) = if ORDER == CROSSED { (third, fourth) } else { (fourth, third) };
    [c_even + c_odd, c_even - c_odd, q_even + q_odd, q_even - q_odd]
}

#[inline(always)]
fn four(slab: &Slab) -> [F4; 4] {
    [slab[0], slab[1], slab[2], slab[3]]
}

#[inline(always)]
fn layer_by_layer(slab: &mut Slab, stride: usize, step: impl Fn([F4; 4]) -> [F4; 4]) {
    for group in slab.chunks_exact_mut(4 * stride) {
        let (first, rest) = group.split_at_mut(stride);
        let (second, rest) = rest.split_at_mut(stride);
        let (third, fourth) = rest.split_at_mut(stride);
        for (((a, b), c), d) in first.iter_mut().zip(second).zip(third).zip(fourth) {
            [*a, *b, *c, *d] = step([*a, *b, *c, *d]);
        }
    }
}

/// Transforms a slab of at least two layers in place. In the spectrum layers 0 and 1 have changed
/// places: layer 1 is within the block.
#[inline(always)]
pub(super) fn transform<const ORDER: bool>(slab: &mut Slab) {
    let mut stride = slab.len() / 4;
    while stride > 1 {
        layer_by_layer(slab, stride, to_spectrum::<ORDER>);
        stride /= 4;
    }
    for group in slab.chunks_exact_mut(4) {
        let rows = F4::transpose(to_spectrum::<ORDER>(four(group)));
        group.copy_from_slice(&to_spectrum::<ORDER>(rows));
    }
}

/// Multiplies a spectrum by the bond's factors and transforms it back.
#[inline(always)]
pub(super) fn cross_bond<const ORDER: bool>(spectrum: &Slab, factors: &Slab, out: &mut Slab) {
    let groups = spectrum.chunks_exact(4).zip(factors.chunks_exact(4));
    for (out, (spectrum, factors)) in out.chunks_exact_mut(4).zip(groups) {
        let (x, f) = (four(spectrum), four(factors));
        let scaled = [x[0] * f[0], x[1] * f[1], x[2] * f[2], x[3] * f[3]];
        let rows = F4::transpose(from_spectrum::<ORDER>(scaled));
        out.copy_from_slice(&from_spectrum::<ORDER>(rows));
    }
    let mut stride = 4;
    while stride < out.len() {
        layer_by_layer(out, stride, from_spectrum::<ORDER>);
        stride *= 4;
    }
}

/// The layer at a place of a spectrum, counted from within the block outwards.
#[inline(always)]
pub(super) fn layer_at(place: usize) -> usize {
    if place < 2 { 1 - place } else { place }
}

/// Signs that keep spectra real. An odd part of k quantum layers carries i^k, which a slab stores as a
/// real number; the bond's (−i)^n of n odd layers must fit in between.
#[derive(Debug, Clone, Default)]
pub(super) struct Signs {
    /// Of the bond's factors for straight spectra.
    pub(super) straight: Vec<F4>,
    /// Of the bond's factors for crossed spectra.
    pub(super) crossed: Vec<F4>,
    /// Of the product of a straight and a crossed spectrum.
    pub(super) product: Vec<F4>,
}

impl Signs {
    pub(super) fn new(layers: usize) -> Self {
        let digits = |state: usize| (0..layers).map(move |layer| state >> (2 * layer) & 3);
        let count = |state: usize, digit: usize| digits(state).filter(|&d| d == digit).count();
        let power = |exponent: usize| if exponent.is_multiple_of(2) { 1.0 } else { -1.0 };
        let factor = |state: usize, quantum: usize| {
            let odd = count(state, 2) + count(state, 3);
            if odd.is_multiple_of(2) || quantum % 2 == 1 {
                power(odd / 2)
            } else {
                power(odd / 2 + 1)
            }
        };
        let product = |state: usize| {
            let (classical, quantum) = (count(state, 2), count(state, 3));
            let odd = classical + quantum;
            if odd.is_multiple_of(2) { power(odd / 2 + quantum) } else { power(odd / 2) }
        };
        let slab = |sign: &dyn Fn(usize) -> f64| {
            (0..1 << (2 * layers - 2))
                .map(|block| F4([0, 1, 2, 3].map(|i| sign(4 * block + i))))
                .collect()
        };
        Self {
            straight: slab(&|state| factor(state, count(state, 3))),
            crossed: slab(&|state| factor(state, count(state, 2))),
            product: slab(&product),
        }
    }
}

/// The factors of one bond, and those of its first layers alone (in the order of [`layer_at`]).
#[derive(Debug, Clone, Default)]
pub(super) struct Bond {
    /// Level k (1 … m) starts at block (4^{k−1} − 1)/3.
    levels: Vec<F4>,
    /// `(sin 2γJ, cos 2γJ)` per layer, in spectrum order.
    turns: Vec<(f64, f64)>,
}

impl Bond {
    #[inline(always)]
    fn level_start(level: usize) -> usize {
        ((1 << (2 * level - 2)) - 1) / 3
    }

    #[inline(always)]
    fn level(&self, level: usize) -> &Slab {
        &self.levels[Self::level_start(level)..Self::level_start(level + 1)]
    }

    /// Sets up the bond with `turns` = `(sin 2γJ, cos 2γJ)` per layer in spectrum order.
    #[inline(always)]
    pub(super) fn set(&mut self, turns: impl Iterator<Item = (f64, f64)>) {
        self.turns.clear();
        self.turns.extend(turns);
        self.levels.clear();
        for (place, &(sin, cos)) in self.turns.iter().enumerate() {
            let factors = [0.5 * (1.0 + cos), 0.5 * (1.0 - cos), sin, sin];
            if place == 0 {
                self.levels.push(F4(factors));
                continue;
            }
            let lower = Self::level_start(place)..Self::level_start(place + 1);
            for factor in factors {
                for block in lower.clone() {
                    self.levels.push(factor * self.levels[block]);
                }
            }
        }
    }

    /// The factors of all layers with signs, into `out`.
    #[inline(always)]
    pub(super) fn factors(&self, signs: &Slab, out: &mut Slab) {
        let all = self.level(self.turns.len());
        for ((out, factor), sign) in out.iter_mut().zip(all).zip(signs) {
            *out = *factor * *sign;
        }
    }

    /// `Σ_k factor(k) spectrum(k)` with one layer's factor replaced by its derivative with respect to
    /// γJ, for each layer in turn (spectrum order, last first). Destroys `spectrum`.
    #[inline(always)]
    pub(super) fn derivatives(
        &self,
        mut spectrum: &mut Slab,
        mut derivative: impl FnMut(usize, f64),
    ) {
        for (place, &(sin, cos)) in self.turns.iter().enumerate().skip(1).rev() {
            let lower = self.level(place);
            let (first, rest) = spectrum.split_at_mut(lower.len());
            let (second, rest) = rest.split_at(lower.len());
            let (third, fourth) = rest.split_at(lower.len());
            let (large, small) = (0.5 * (1.0 + cos), 0.5 * (1.0 - cos));
            let mut total = F4::ZERO;
            for (i, factor) in lower.iter().enumerate() {
                let odd = third[i] + fourth[i];
                total += *factor * (sin * (second[i] - first[i]) + (2.0 * cos) * odd);
                first[i] = large * first[i] + small * second[i] + sin * odd;
            }
            derivative(place, total.sum());
            spectrum = first;
        }
        let (sin, cos) = self.turns[0];
        let F4([sum, difference, third, fourth]) = spectrum[0];
        derivative(0, sin * (difference - sum) + 2.0 * cos * (third + fourth));
    }
}
