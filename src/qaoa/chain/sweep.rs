//! From site to site: what one side of a site contributes to ⟨H⟩, as slabs over the site's own
//! trajectory, and the step that takes it over the site and the next bond.
//!
//! Three vectors make a side: its *norm* (nobody looks at it), its last qubit's *Z*, and its whole
//! *energy*. Where nobody looks, the last layer's state is classical and the one before it only matters
//! in parts, so six slabs hold all three vectors.

use super::super::simd::{C4, F4};
use super::folded::{
    Bond, Signs, Slab, cross_bond, exchanged, exchanged_block, layer_at, transform,
};
use super::gradient::Duals;
use super::site::{Mixers, Phases};

/// Slabs of a side, in this order (*even* and *odd* in the sign of the last layer's state; odd parts of
/// quantum states are stored without their factor i):
/// norm, classical, even; norm, classical, odd (which is quantum and odd beyond the bond); Z, quantum,
/// even and odd; energy, even, as it is classical beyond the bond; energy, quantum, odd (classical and
/// odd beyond the bond).
pub(super) const SIDE_SLABS: usize = 6;
/// Slabs of a spectrum: those of a side, and the energy, quantum, even, for the derivative of the last
/// layer's bond.
pub(super) const SPECTRUM_SLABS: usize = 7;
/// Position of the energy's even part among them.
pub(super) const ENERGY: usize = 4;

/// The bond that a side ends with: its coupling and what it does to the last layer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Joint {
    pub(super) j: f64,
    /// cos 2γ_pJ and sin 2γ_pJ.
    pub(super) cos: f64,
    pub(super) sin: f64,
}

impl Joint {
    /// The end of the chain.
    pub(super) const END: Self = Self { j: 0.0, cos: 1.0, sin: 0.0 };

    #[inline(always)]
    pub(super) fn new(mixers: &Mixers, j: f64) -> Self {
        let (sin, cos) = (2.0 * mixers.gammas[mixers.inner()] * j).sin_cos();
        Self { j, cos, sin }
    }
}

/// One site's own part in a sweep.
pub(super) struct Site<'a> {
    pub(super) mixers: &'a Mixers,
    /// Scaled by one half.
    pub(super) phases: &'a Phases,
    pub(super) h: f64,
    /// cos 2γ_ph and sin 2γ_ph.
    pub(super) turn: (f64, f64),
}

impl<'a> Site<'a> {
    #[inline(always)]
    pub(super) fn new(mixers: &'a Mixers, phases: &'a mut Phases, h: f64) -> Self {
        phases.set(&mixers.gammas[..mixers.inner()], h, 0.5);
        let (sin, cos) = (2.0 * mixers.gammas[mixers.inner()] * h).sin_cos();
        Self { mixers, phases, h, turn: (cos, sin) }
    }
}

/// One slab's block as complex numbers (twice their value).
#[inline(always)]
pub(super) fn load(slab: &Slab, block: usize, other: usize) -> C4 {
    let (x, y) = (slab[block], exchanged(slab[other]));
    C4 { re: x + y, im: x - y }
}

/// A side's slabs in one block.
#[inline(always)]
fn load_side(slabs: &Slab, blocks: usize, block: usize, other: usize) -> [C4; SIDE_SLABS] {
    [
        load(&slabs[..blocks], block, other),
        load(&slabs[blocks..2 * blocks], block, other),
        load(&slabs[2 * blocks..3 * blocks], block, other),
        load(&slabs[3 * blocks..4 * blocks], block, other),
        load(&slabs[4 * blocks..5 * blocks], block, other),
        load(&slabs[5 * blocks..6 * blocks], block, other),
    ]
}

#[inline(always)]
fn store(slabs: &mut Slab, block: usize, other: usize, value: C4) {
    slabs[block] = value.re + value.im;
    slabs[other] = exchanged(value.re - value.im);
}

/// What a side exerts on the site: energies, and the factors of the site's Z.
struct Pull {
    /// Norm, last layer quantum.
    norm_even: C4,
    norm_odd: C4,
    /// Energy, last layer classical.
    energy: C4,
    energy_odd: C4,
    /// Factor of Z, last layer classical.
    z_even: C4,
    z_odd: C4,
    /// Factor of Z, last layer quantum.
    zq_even: C4,
    zq_odd: C4,
}

impl Pull {
    #[inline(always)]
    fn new(side: [C4; SIDE_SLABS], joint: Joint, mixers: &Mixers, h: f64) -> Self {
        let [norm, norm_odd, z, z_odd, energy, energy_odd] = side;
        let Joint { j, cos, sin } = joint;
        let measured = j * mixers.cos;
        Self {
            norm_even: cos * norm,
            norm_odd: -sin * norm_odd,
            energy,
            energy_odd: sin * energy_odd,
            z_even: h * norm + measured * norm_odd + (j * cos) * z,
            z_odd: (j * sin) * z_odd,
            zq_even: (h * cos) * norm + j * z + (measured * cos) * norm_odd,
            zq_odd: (-h * sin) * norm_odd + (-sin * measured) * norm,
        }
    }
}

/// What a measured site does to the quantum states of its last layer: phase of the field, mixer, Z.
struct Quantum {
    even: F4,
    odd: F4,
    /// Of the field's phase, times 2 sin 2β_p.
    cos: f64,
    sin: f64,
}

impl Quantum {
    #[inline(always)]
    fn apply(&self, even: C4, odd: C4) -> (C4, C4) {
        let turned_even = self.cos * even + self.sin * odd;
        let turned_odd = self.cos * odd - self.sin * even;
        (
            self.even * turned_even + self.odd * turned_odd.times_i(),
            self.even * turned_odd - self.odd * turned_even.times_i(),
        )
    }
}

/// Takes a side over a site: seven slabs before their transform. With `DUALS` the site meets the other
/// side, `opposite`, and adds to the derivatives of its own weights.
#[inline(always)]
pub(super) fn pass_site<const DUALS: bool>(
    site: &Site<'_>,
    (side, joint): (&Slab, Joint),
    (opposite, next): (&Slab, Joint),
    spectrum: &mut Slab,
    duals: &mut Duals,
) {
    let Site { mixers, phases, h, turn: (turn_cos, turn_sin) } = *site;
    let blocks = phases.re.len();
    let measure = 2.0 * mixers.sin;
    for block in 0..blocks {
        let other = exchanged_block(block);
        if other < block {
            continue;
        }
        let phase = C4 { re: phases.re[block], im: phases.im[block] };
        let [a, b, c, d, e, f] = load_side(side, blocks, block, other);
        let parts = [phase * a, phase * b, phase * c, phase * d, phase * e, phase * f];
        let norm = parts[0];
        let pull = Pull::new(parts, joint, mixers, h);
        let (even, odd) = (mixers.even[block], mixers.odd[block]);
        let quantum = Quantum {
            even: mixers.z_even[block],
            odd: mixers.z_odd[block],
            cos: measure * turn_cos,
            sin: measure * turn_sin,
        };
        let (z, z_odd) = quantum.apply(pull.norm_even, pull.norm_odd);
        let (energy_q, energy_odd) = quantum.apply(pull.zq_even, pull.zq_odd);
        let energy = even * (pull.energy + mixers.cos * pull.z_odd)
            + odd * (pull.energy_odd + mixers.cos * pull.z_even)
            + next.cos * energy_q;
        let all = [even * norm, odd * norm, z, z_odd, energy, energy_odd, energy_q];
        for (k, value) in all.into_iter().enumerate() {
            store(&mut spectrum[k * blocks..(k + 1) * blocks], block, other, value);
        }
        if DUALS {
            let parts = load_side(opposite, blocks, block, other);
            let weight = if other == block { 0.5 } else { 1.0 };
            let (norm_there, there) = (parts[0], Pull::new(parts, next, mixers, 0.0));
            let q_even = pull.zq_even * there.norm_even - pull.zq_odd * there.norm_odd
                + pull.norm_even * there.zq_even
                - pull.norm_odd * there.zq_odd;
            let q_odd = pull.zq_even * there.norm_odd
                + pull.zq_odd * there.norm_even
                + pull.norm_even * there.zq_odd
                + pull.norm_odd * there.zq_even;
            let met = Met {
                even: pull.energy * norm_there + norm * there.energy,
                odd: pull.energy_odd * norm_there + norm * there.energy_odd,
                even_z: pull.z_odd * norm_there + norm * there.z_odd,
                odd_z: pull.z_even * norm_there + norm * there.z_even,
                q_even: (2.0 * turn_cos) * q_even + (2.0 * turn_sin) * q_odd,
                q_odd: (2.0 * turn_cos) * q_odd - (2.0 * turn_sin) * q_even,
            };
            duals.add(mixers, h, block, weight, met);
        }
    }
}

/// Both sides multiplied at a site, by the mixer weight that is still to come: what ⟨H⟩ changes by if
/// that weight changes.
pub(super) struct Met {
    pub(super) even: C4,
    pub(super) odd: C4,
    pub(super) even_z: C4,
    pub(super) odd_z: C4,
    pub(super) q_even: C4,
    pub(super) q_odd: C4,
}

/// Takes a transformed spectrum over a bond: the side that the next site sees.
#[inline(always)]
pub(super) fn pass_bond<const ORDER: bool>(spectrum: &Slab, factors: &Slab, side: &mut Slab) {
    let blocks = factors.len();
    for (spectrum, side) in spectrum.chunks_exact(blocks).zip(side.chunks_exact_mut(blocks)) {
        cross_bond::<ORDER>(spectrum, factors, side);
    }
}

/// Transforms all slabs of a spectrum.
#[inline(always)]
pub(super) fn transform_all<const ORDER: bool>(spectrum: &mut Slab, blocks: usize) {
    for slab in spectrum.chunks_exact_mut(blocks) {
        transform::<ORDER>(slab);
    }
}

/// The side of a chain's end: norm 1, nothing else.
pub(super) fn end_of_chain(side: &mut Slab, blocks: usize) {
    side.fill(F4::ZERO);
    side[..blocks].fill(F4::ONE);
}

/// Sets up a bond for spectra.
#[inline(always)]
pub(super) fn set_bond(bond: &mut Bond, mixers: &Mixers, j: f64, signs: &Slab, factors: &mut Slab) {
    let turns =
        (0..mixers.inner()).map(|place| (2.0 * mixers.gammas[layer_at(place)] * j).sin_cos());
    bond.set(turns);
    bond.factors(signs, factors);
}

/// Buffers that live from call to call.
#[derive(Debug, Clone, Default)]
pub(super) struct Workspace {
    pub(super) signs: Signs,
    pub(super) phases: Phases,
    pub(super) bond: Bond,
    pub(super) factors: Vec<F4>,
    /// One side of the current site.
    pub(super) side: Vec<F4>,
    pub(super) spectrum: Vec<F4>,
    /// The right side of every site, and its spectra.
    pub(super) rights: Vec<F4>,
    pub(super) right_spectra: Vec<F4>,
    /// Product of two spectra.
    pub(super) product: Vec<F4>,
}

impl Workspace {
    /// Makes room for circuits like that of `mixers`; `stored` right sides are kept.
    pub(super) fn reserve(&mut self, mixers: &Mixers, stored: usize) {
        let blocks = mixers.blocks();
        if self.factors.len() != blocks {
            self.signs = Signs::new(mixers.inner());
        }
        self.factors.resize(blocks, F4::ZERO);
        self.product.resize(blocks, F4::ZERO);
        self.side.resize(SIDE_SLABS * blocks, F4::ZERO);
        self.spectrum.resize(SPECTRUM_SLABS * blocks, F4::ZERO);
        self.rights.resize(self.rights.len().max(stored * SIDE_SLABS * blocks), F4::ZERO);
        let spectra = stored * SPECTRUM_SLABS * blocks;
        self.right_spectra.resize(self.right_spectra.len().max(spectra), F4::ZERO);
    }
}
