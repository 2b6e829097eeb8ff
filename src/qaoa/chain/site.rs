//! The weights of one site: what the mixers do between the phase layers (the same for every qubit), and
//! the phases of its field.
//!
//! All layers but the last are *inner*; their states index the slabs of [`super::folded`]. The last
//! layer is written out: its state is classical unless Z is measured at the site.

use super::super::angles::Angles;
use super::super::simd::F4;

/// Fewest layers the kernels handle; shorter circuits get layers without effect in front.
pub(super) const MIN_LAYERS: usize = 3;

/// The angles with layers γ = β = 0 in front, up to [`MIN_LAYERS`]: |+⟩ does not notice them.
pub(super) fn padded(angles: &Angles) -> (Vec<f64>, Vec<f64>) {
    let missing = MIN_LAYERS.saturating_sub(angles.layers());
    let pad = |values: &[f64]| [vec![0.0; missing], values.to_vec()].concat();
    (pad(angles.gammas()), pad(angles.betas()))
}

/// Mixer weights of a site, real and unchanged when ket and bra are exchanged (`z_odd` changes its
/// sign). A factor ±i for a quantum state of layer 0 is left to [`Phases`].
#[derive(Debug, Clone, Default)]
pub(super) struct Mixers {
    /// γ and β of the (padded) circuit.
    pub(super) gammas: Vec<f64>,
    pub(super) betas: Vec<f64>,
    /// Inner mixers alone.
    pub(super) walk: Vec<F4>,
    /// To the last layer, classical: sum over its sign.
    pub(super) even: Vec<F4>,
    /// To the last layer, classical: difference over its sign.
    pub(super) odd: Vec<F4>,
    /// To the last layer, quantum, and on to a measured Z, without sin 2β_p: even in its sign.
    pub(super) z_even: Vec<F4>,
    /// The same, odd in its sign.
    pub(super) z_odd: Vec<F4>,
    /// cos 2β_p and sin 2β_p.
    pub(super) cos: f64,
    pub(super) sin: f64,
}

/// Sign of a layer's state.
#[inline(always)]
pub(super) fn sign(state: usize) -> f64 {
    if state & 1 == 0 { 1.0 } else { -1.0 }
}

#[inline(always)]
pub(super) fn is_quantum(state: usize) -> bool {
    state & 2 != 0
}

impl Mixers {
    pub(super) fn new(angles: &Angles) -> Self {
        let (gammas, betas) = padded(angles);
        let mut mixers = Self { gammas, betas, ..Self::default() };
        let last = mixers.betas.len() - 1;
        (mixers.sin, mixers.cos) = (2.0 * mixers.betas[last]).sin_cos();
        mixers.walk = mixers.walk_with(None);
        let (sin, cos) = (2.0 * mixers.betas[last - 1]).sin_cos();
        // By state of the last inner layer, the outermost digit: c+, c−, q+, q−.
        let table = |factors: [f64; 4]| -> Vec<F4> {
            let quarters = mixers.walk.chunks_exact(mixers.walk.len() / 4);
            quarters.zip(factors).flat_map(|(q, f)| q.iter().map(move |w| f * *w)).collect()
        };
        let even = table([1.0, 1.0, 0.0, 0.0]);
        let odd = table([cos, -cos, sin, sin]);
        let z_even = table([-0.5 * sin, 0.5 * sin, 0.5 * cos, 0.5 * cos]);
        let z_odd = table([0.0, 0.0, 0.5, -0.5]);
        Self { even, odd, z_even, z_odd, ..mixers }
    }

    /// Number of inner layers.
    pub(super) fn inner(&self) -> usize {
        self.gammas.len() - 1
    }

    /// Blocks of a slab.
    pub(super) fn blocks(&self) -> usize {
        1 << (2 * self.inner() - 2)
    }

    /// [`Self::walk`], or its derivative with respect to one inner β.
    pub(super) fn walk_with(&self, derived: Option<usize>) -> Vec<F4> {
        let mut walk = vec![F4::splat(0.5)];
        for layer in 1..self.inner() {
            // From layer − 1 to layer, by the mixer between them.
            let beta = self.betas[layer - 1];
            let (sin, cos) = (2.0 * beta).sin_cos();
            let [stay, flip, turn] = if derived == Some(layer - 1) {
                [-sin, sin, cos]
            } else {
                [0.5 * (1.0 + cos), 0.5 * (1.0 - cos), 0.5 * sin]
            };
            let weight = |from: usize, to: usize| match (is_quantum(from), is_quantum(to)) {
                (false, false) => {
                    if sign(from) == sign(to) {
                        stay
                    } else {
                        flip
                    }
                }
                (true, true) => {
                    if sign(from) == sign(to) {
                        stay
                    } else {
                        -flip
                    }
                }
                (false, true) => -sign(from) * turn,
                (true, false) => sign(to) * turn,
            };
            let blocks = walk.len();
            walk = (0..4 * blocks)
                .map(|block| {
                    let (to, block) = (block / blocks, block % blocks);
                    if layer == 1 {
                        F4([0, 1, 2, 3].map(|from| weight(from, to))) * walk[block]
                    } else {
                        weight(block / (blocks / 4), to) * walk[block]
                    }
                })
                .collect();
        }
        walk
    }
}

/// `Π e^{∓2ihγ}` over the quantum layers of the inner states, real and imaginary parts.
#[derive(Debug, Clone, Default)]
pub(super) struct Phases {
    pub(super) re: Vec<F4>,
    pub(super) im: Vec<F4>,
}

impl Phases {
    /// Sets up the phases of a site with field `h`, all multiplied by `scale`.
    #[inline(always)]
    pub(super) fn set(&mut self, gammas: &[f64], h: f64, scale: f64) {
        self.re.clear();
        self.im.clear();
        for (layer, gamma) in gammas.iter().enumerate() {
            let (sin, cos) = (2.0 * h * gamma).sin_cos();
            if layer == 0 {
                // The ±i of a quantum state in layer 0 turns (cos, ∓sin) by a quarter.
                let (re, im) = (F4([1.0, 1.0, sin, sin]), F4([0.0, 0.0, cos, -cos]));
                self.re.push(scale * re);
                self.im.push(scale * im);
                continue;
            }
            let blocks = self.re.len();
            self.re.extend_from_within(..blocks);
            self.im.extend_from_within(..blocks);
            for sin in [sin, -sin] {
                for block in 0..blocks {
                    let (re, im) = (self.re[block], self.im[block]);
                    self.re.push(cos * re + sin * im);
                    self.im.push(cos * im - sin * re);
                }
            }
        }
    }
}
