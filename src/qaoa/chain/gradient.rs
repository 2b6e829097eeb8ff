//! ⟨H⟩ from one sweep along the chain, and all its derivatives from two.

use std::ops::Range;

use super::super::angles::Angles;
use super::super::ising::ChainIsing;
use super::super::simd::{F4, Kernel};
use super::folded::{CROSSED, STRAIGHT, Slab, layer_at};
use super::site::{Mixers, is_quantum, sign};
use super::sweep::{
    ENERGY, Joint, Met, SIDE_SLABS, SPECTRUM_SLABS, Site, Workspace, end_of_chain, pass_bond,
    pass_site, set_bond, transform_all,
};

/// ⟨H⟩ without derivatives, from the left end to the right.
pub(super) struct Expectation<'a> {
    pub(super) chain: &'a ChainIsing,
    pub(super) mixers: &'a Mixers,
    pub(super) workspace: &'a mut Workspace,
}

impl Kernel for Expectation<'_> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let Self { chain, mixers, workspace } = self;
        workspace.reserve(mixers, 0);
        let blocks = mixers.blocks();
        let Workspace { signs, phases, bond, factors, side, spectrum, .. } = workspace;
        let mut joint = Joint::END;
        end_of_chain(side, blocks);
        for (i, &h) in chain.h().iter().enumerate() {
            let coupling = chain.j().get(i);
            let next = coupling.map_or(Joint::END, |&j| Joint::new(mixers, j));
            let site = Site::new(mixers, phases, h);
            let nothing = (&[][..], next);
            pass_site::<false>(&site, (side, joint), nothing, spectrum, &mut Duals::default());
            if let Some(&j) = coupling {
                let spectrum = &mut spectrum[..SIDE_SLABS * blocks];
                transform_all::<STRAIGHT>(spectrum, blocks);
                set_bond(bond, mixers, j, &signs.straight, factors);
                pass_bond::<STRAIGHT>(spectrum, factors, side);
            }
            joint = next;
        }
        chain.constant() + total_energy(spectrum, blocks)
    }
}

/// The energy of a whole chain, from the slabs at its last site.
#[inline(always)]
fn total_energy(spectrum: &Slab, blocks: usize) -> f64 {
    let energy = &spectrum[ENERGY * blocks..][..blocks];
    let mut sum = F4::ZERO;
    for &block in energy {
        sum += block;
    }
    sum.sum()
}

/// Sites whose right sides are kept at once by default, so that they stay in the processor's cache.
pub(super) const WINDOW: usize = 48;

/// Sites of a window in a chain of `qubits`, with those to its right that it depends on.
///
/// A side's norm does not depend on sites more than p away (nobody looks there, and everything outside
/// the light cone cancels), nor does a derivative on energies that far: the sweep from the right can
/// start twice that far away as if the chain ended.
pub(super) fn window_sites(window: usize, qubits: usize, layers: usize) -> usize {
    qubits.min(window.saturating_add(2 * layers + 2))
}

/// ⟨H⟩ and its derivatives with respect to all angles of the padded circuit.
pub(super) struct Gradient<'a> {
    pub(super) chain: &'a ChainIsing,
    pub(super) mixers: &'a Mixers,
    pub(super) workspace: &'a mut Workspace,
    /// Sites whose right sides are kept at once.
    pub(super) window: usize,
}

impl Kernel for Gradient<'_> {
    type Output = (f64, Angles);

    #[inline(always)]
    fn run(self) -> (f64, Angles) {
        let Self { chain, mixers, workspace, window } = self;
        let (n, blocks) = (chain.qubits(), mixers.blocks());
        let kept = window_sites(window, n, mixers.gammas.len());
        workspace.reserve(mixers, kept);
        let mut duals = Duals::new(blocks);
        let mut gradient = Angles::zeros(mixers.gammas.len());
        let mut joint = Joint::END;
        end_of_chain(&mut workspace.side, blocks);
        let mut start = 0;
        while start < n {
            let reach = n.min(start.saturating_add(kept));
            let end = if reach == n { n } else { start + window };
            sweep_from_right(chain, mixers, workspace, start..reach);
            for i in start..end {
                joint = visit(
                    chain,
                    mixers,
                    workspace,
                    (i, i - start),
                    joint,
                    &mut duals,
                    &mut gradient,
                );
            }
            start = end;
        }
        duals.finish(mixers, &mut gradient);
        (chain.constant() + total_energy(&workspace.spectrum, blocks), gradient)
    }
}

/// Takes the left side over site `i`, the `place`-th of its window, and its bond, and adds their
/// derivatives. Returns the bond.
#[inline(always)]
fn visit(
    chain: &ChainIsing,
    mixers: &Mixers,
    workspace: &mut Workspace,
    (i, place): (usize, usize),
    joint: Joint,
    duals: &mut Duals,
    gradient: &mut Angles,
) -> Joint {
    let blocks = mixers.blocks();
    let Workspace { signs, phases, bond, factors, side, spectrum, rights, right_spectra, product } =
        workspace;
    let coupling = chain.j().get(i);
    let next = coupling.map_or(Joint::END, |&j| Joint::new(mixers, j));
    let site = Site::new(mixers, phases, chain.h()[i]);
    let opposite = (&rights[place * SIDE_SLABS * blocks..][..SIDE_SLABS * blocks], next);
    pass_site::<true>(&site, (side, joint), opposite, spectrum, duals);
    if let Some(&j) = coupling {
        transform_all::<STRAIGHT>(spectrum, blocks);
        set_bond(bond, mixers, j, &signs.straight, factors);
        pass_bond::<STRAIGHT>(spectrum, factors, side);
        let there = &right_spectra[(place + 1) * SPECTRUM_SLABS * blocks..];
        bond.factors(&signs.product, factors);
        let pair = Pair { here: spectrum, there, joint: next, measured: mixers.cos };
        let last = pair.multiply(&signs.product, factors, product);
        gradient.gammas_mut()[mixers.inner()] += 2.0 * j * last;
        bond.derivatives(product, |place, slope| {
            gradient.gammas_mut()[layer_at(place)] += j * slope;
        });
    }
    next
}

/// Fills in the right side of every site of a window and its spectra (those of the first are not
/// needed), as if the chain ended with the window.
#[inline(always)]
fn sweep_from_right(
    chain: &ChainIsing,
    mixers: &Mixers,
    workspace: &mut Workspace,
    window: Range<usize>,
) {
    let blocks = mixers.blocks();
    let Workspace { signs, phases, bond, factors, rights, right_spectra, .. } = workspace;
    end_of_chain(
        &mut rights[(window.len() - 1) * SIDE_SLABS * blocks..][..SIDE_SLABS * blocks],
        blocks,
    );
    let mut joint = Joint::END;
    for i in window.clone().skip(1).rev() {
        let place = i - window.start;
        let j = chain.j()[i - 1];
        let next = Joint::new(mixers, j);
        let (nearer, side) = rights.split_at_mut(place * SIDE_SLABS * blocks);
        let spectrum =
            &mut right_spectra[place * SPECTRUM_SLABS * blocks..][..SPECTRUM_SLABS * blocks];
        let site = Site::new(mixers, phases, chain.h()[i]);
        pass_site::<false>(&site, (side, joint), (&[], next), spectrum, &mut Duals::default());
        transform_all::<CROSSED>(spectrum, blocks);
        set_bond(bond, mixers, j, &signs.crossed, factors);
        pass_bond::<CROSSED>(spectrum, factors, &mut nearer[(place - 1) * SIDE_SLABS * blocks..]);
        joint = next;
    }
}

/// One block of all slabs of a spectrum.
#[inline(always)]
fn column(spectrum: &Slab, blocks: usize, block: usize) -> [F4; SPECTRUM_SLABS] {
    [
        spectrum[block],
        spectrum[blocks + block],
        spectrum[2 * blocks + block],
        spectrum[3 * blocks + block],
        spectrum[4 * blocks + block],
        spectrum[5 * blocks + block],
        spectrum[6 * blocks + block],
    ]
}

/// The spectra that meet at a bond.
struct Pair<'a> {
    here: &'a Slab,
    there: &'a Slab,
    joint: Joint,
    /// cos 2β_p.
    measured: f64,
}

impl Pair<'_> {
    /// The product whose contraction with the bond's factors is the energy, into `product`. Returns the
    /// derivative with respect to 2γ_pJ, for which `factors` are those with the product's signs.
    #[inline(always)]
    fn multiply(&self, signs: &Slab, factors: &Slab, product: &mut Slab) -> f64 {
        let blocks = product.len();
        let Joint { j, cos, sin } = self.joint;
        let measured = j * self.measured;
        let (mut d_cos, mut d_sin) = (F4::ZERO, F4::ZERO);
        for block in 0..blocks {
            let [a, a_odd, z, z_odd, energy, energy_odd, energy_q] =
                column(self.here, blocks, block);
            let [b, b_odd, y, y_odd, there, there_odd, there_q] = column(self.there, blocks, block);
            let mixed_even = measured * (a_odd * y + z * b_odd);
            let mixed_odd = measured * (a * y_odd + z_odd * b);
            let sum = energy * b
                + a * there
                + sin * (energy_odd * b_odd + a_odd * there_odd + mixed_odd)
                + cos * mixed_even
                + (measured * self.measured) * (a_odd * b_odd)
                + j * (z * y);
            product[block] = signs[block] * sum;
            d_cos += factors[block] * (energy_q * b + a * there_q + mixed_even);
            d_sin += factors[block] * (energy_odd * b_odd + a_odd * there_odd + mixed_odd);
        }
        cos * d_sin.sum() - sin * d_cos.sum()
    }
}

/// Sums over all sites of what ⟨H⟩ changes by if the mixer weights (or field phases) change. Only blocks
/// that come first among those with ket and bra exchanged are used.
#[derive(Debug, Clone, Default)]
pub(super) struct Duals {
    even: Vec<F4>,
    even_z: Vec<F4>,
    odd: Vec<F4>,
    odd_z: Vec<F4>,
    z_even: Vec<F4>,
    z_odd: Vec<F4>,
    /// Field times imaginary part: for the phases of the inner layers.
    phase: Vec<F4>,
    /// For the phase of the last layer.
    last_phase: f64,
}

impl Duals {
    fn new(blocks: usize) -> Self {
        let slab = || vec![F4::ZERO; blocks];
        Self {
            even: slab(),
            even_z: slab(),
            odd: slab(),
            odd_z: slab(),
            z_even: slab(),
            z_odd: slab(),
            phase: slab(),
            last_phase: 0.0,
        }
    }

    /// Adds one block of one site.
    #[inline(always)]
    pub(super) fn add(&mut self, mixers: &Mixers, h: f64, block: usize, weight: f64, met: Met) {
        let (even, odd) = (mixers.even[block], mixers.odd[block]);
        let (z_even, z_odd) = (mixers.z_even[block], mixers.z_odd[block]);
        self.even[block] += weight * met.even.re;
        self.even_z[block] += weight * met.even_z.re;
        self.odd[block] += weight * met.odd.re;
        self.odd_z[block] += weight * met.odd_z.re;
        self.z_even[block] += weight * met.q_even.re;
        self.z_odd[block] += -weight * met.q_odd.im;
        let imaginary = even * (met.even.im + mixers.cos * met.even_z.im)
            + odd * (met.odd.im + mixers.cos * met.odd_z.im)
            + mixers.sin * (z_even * met.q_even.im + z_odd * met.q_odd.re);
        self.phase[block] += (weight * h) * imaginary;
        let turned = z_even * met.q_odd.re + z_odd * met.q_even.im;
        self.last_phase += 2.0 * weight * h * mixers.sin * turned.sum();
    }

    /// The derivatives through mixers and field phases, added to `gradient`.
    fn finish(&self, mixers: &Mixers, gradient: &mut Angles) {
        let inner = mixers.inner();
        let quarter = mixers.blocks() / 4;
        let dot =
            |x: &Slab, y: &Slab| x.iter().zip(y).fold(F4::ZERO, |sum, (&x, &y)| sum + x * y).sum();
        // The weights of ⟨H⟩ by state of the last inner layer (c+, c−, q+, q−), inner mixers left open.
        let open = |even: [f64; 4], odd: [f64; 4], z_even: [f64; 4], z_odd: [f64; 4]| -> Vec<F4> {
            (0..mixers.blocks())
                .map(|block| {
                    let state = block / quarter;
                    even[state] * (self.even[block] + mixers.cos * self.even_z[block])
                        + odd[state] * (self.odd[block] + mixers.cos * self.odd_z[block])
                        + (mixers.sin * z_even[state]) * self.z_even[block]
                        + (mixers.sin * z_odd[state]) * self.z_odd[block]
                })
                .collect()
        };
        let (sin, cos) = (2.0 * mixers.betas[inner - 1]).sin_cos();
        let value = open(
            [1.0, 1.0, 0.0, 0.0],
            [cos, -cos, sin, sin],
            [-0.5 * sin, 0.5 * sin, 0.5 * cos, 0.5 * cos],
            [0.0, 0.0, 0.5, -0.5],
        );
        for layer in 0..inner - 1 {
            gradient.betas_mut()[layer] += dot(&mixers.walk_with(Some(layer)), &value);
        }
        let slope = open(
            [0.0; 4],
            [-2.0 * sin, 2.0 * sin, 2.0 * cos, 2.0 * cos],
            [-cos, cos, -sin, -sin],
            [0.0; 4],
        );
        gradient.betas_mut()[inner - 1] += dot(&mixers.walk, &slope);
        let through_cos = dot(&mixers.even, &self.even_z) + dot(&mixers.odd, &self.odd_z);
        let through_sin = dot(&mixers.z_even, &self.z_even) + dot(&mixers.z_odd, &self.z_odd);
        gradient.betas_mut()[inner] += 2.0 * (mixers.cos * through_sin - mixers.sin * through_cos);

        for layer in 0..inner {
            let phases = self.phase.iter().flat_map(|block| block.0).enumerate();
            let terms = phases.map(|(index, phase)| {
                let state = index >> (2 * layer) & 3;
                if is_quantum(state) { sign(state) * phase } else { 0.0 }
            });
            gradient.gammas_mut()[layer] += 2.0 * terms.sum::<f64>();
        }
        gradient.gammas_mut()[inner] += self.last_phase;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn windows_of_any_size_give_the_same_derivatives(
            window in 1_usize..12,
            layers in 1_usize..6,
            fields in prop::collection::vec(-1.5..1.5_f64, 14),
            couplings in prop::collection::vec(-1.5..1.5_f64, 13),
            angles in prop::collection::vec(-1.0..1.0_f64, 10),
        ) {
            let chain = &ChainIsing::new(0.3, fields, couplings).unwrap();
            let (gammas, betas) = (angles[..layers].to_vec(), angles[5..5 + layers].to_vec());
            let mixers = &Mixers::new(&Angles::new(gammas, betas).unwrap());
            let derivatives = |window: usize| {
                let workspace = &mut Workspace::default();
                let (expectation, gradient) = Gradient { chain, mixers, workspace, window }.run();
                [vec![expectation], gradient.iter().collect()].concat()
            };
            for (part, whole) in derivatives(window).into_iter().zip(derivatives(usize::MAX / 2)) {
                prop_assert!((part - whole).abs() < 1e-11, "{} instead of {}", part, whole);
            }
        }
    }
}
