//! What every site of the chain sees to its right if nobody looks there: the matrices that give a prefix
//! of bits its probability.

use num_complex::Complex64;

use super::super::ising::ChainIsing;
use super::super::simd::{C4, F4, Kernel};
use super::folded::{CROSSED, cross_bond, exchanged_block, transform};
use super::site::Mixers;
use super::sweep::{Joint, Site, Workspace, load, set_bond};

/// Two slabs and a bond per site.
#[derive(Debug, Clone)]
pub(super) struct RightNorms {
    inner: usize,
    slabs: Vec<F4>,
    joints: Vec<Joint>,
}

/// Computes [`RightNorms`].
pub(super) struct Norms<'a> {
    pub(super) chain: &'a ChainIsing,
    pub(super) mixers: &'a Mixers,
    pub(super) workspace: &'a mut Workspace,
}

impl Kernel for Norms<'_> {
    type Output = RightNorms;

    #[inline(always)]
    fn run(self) -> RightNorms {
        let Self { chain, mixers, workspace } = self;
        let (n, blocks) = (chain.qubits(), mixers.blocks());
        workspace.reserve(mixers, 0);
        let Workspace { signs, phases, bond, factors, spectrum, .. } = workspace;
        let mut norms = RightNorms {
            inner: mixers.inner(),
            slabs: vec![F4::ZERO; 2 * n * blocks],
            joints: vec![Joint::END; n],
        };
        norms.slabs[2 * (n - 1) * blocks..][..blocks].fill(F4::ONE);
        for i in (1..n).rev() {
            let (nearer, side) = norms.slabs.split_at_mut(2 * i * blocks);
            let site = Site::new(mixers, phases, chain.h()[i]);
            let (even, odd) = spectrum[..2 * blocks].split_at_mut(blocks);
            for block in 0..blocks {
                let norm = load(side, block, exchanged_block(block));
                let phase = C4 { re: site.phases.re[block], im: site.phases.im[block] };
                let C4 { re, im } = phase * norm;
                even[block] = mixers.even[block] * (re + im);
                odd[block] = mixers.odd[block] * (re + im);
            }
            transform::<CROSSED>(even);
            transform::<CROSSED>(odd);
            let j = chain.j()[i - 1];
            set_bond(bond, mixers, j, &signs.crossed, factors);
            let (even_out, odd_out) = nearer[2 * (i - 1) * blocks..].split_at_mut(blocks);
            cross_bond::<CROSSED>(even, factors, even_out);
            cross_bond::<CROSSED>(odd, factors, odd_out);
            norms.joints[i - 1] = Joint::new(mixers, j);
        }
        norms
    }
}

impl RightNorms {
    /// The matrix of one site over pairs of trajectories, entry `ket + 2^p bra`.
    pub(super) fn matrix(&self, site: usize, matrix: &mut Vec<Complex64>) {
        let width = 2 << self.inner;
        let blocks = 1 << (2 * self.inner - 2);
        let slabs = &self.slabs[2 * site * blocks..2 * (site + 1) * blocks];
        let (norm, odd) = slabs.split_at(blocks);
        let Joint { cos, sin, .. } = self.joints[site];
        matrix.clear();
        matrix.resize(width * width, Complex64::ZERO);
        for block in 0..blocks {
            let other = exchanged_block(block);
            let (norm, odd) = (load(norm, block, other), load(odd, block, other));
            for lane in 0..4 {
                let half = |part: C4| 0.5 * Complex64::new(part.re.0[lane], part.im.0[lane]);
                let (norm, odd) = (half(norm), half(odd));
                let (ket, bra) = trajectories(4 * block + lane, self.inner);
                let last = width / 2;
                matrix[ket + width * bra] = norm;
                matrix[ket + last + width * (bra + last)] = norm;
                // The last layer quantum: ket + and bra −, or the other way round.
                let turned = Complex64::new(sin * odd.im, -sin * odd.re);
                matrix[ket + width * (bra + last)] = cos * norm + turned;
                matrix[ket + last + width * bra] = cos * norm - turned;
            }
        }
    }
}

/// The ket and bra trajectories of a slab's state, bit l for layer l.
fn trajectories(state: usize, layers: usize) -> (usize, usize) {
    (0..layers).fold((0, 0), |(ket, bra), layer| {
        let digit = state >> (2 * layer) & 3;
        let (a, b) = (digit & 1, (digit & 1) ^ (digit >> 1));
        (ket | a << layer, bra | b << layer)
    })
}
