//! The state through the layers of a circuit, and back with its adjoint for the derivatives: after the
//! forward pass λ = Hψ, then every layer is taken off ψ and λ again, so that no layer is stored.

use std::mem::swap;

use rayon::prelude::*;

use super::super::angles::Angles;
use super::super::ising::Ising;
use super::super::simd;
use super::energies::Energies;
use super::kernels::{
    Energy, First, Mix, Mixer, Phase, Phases, Plain, Spectrum, Turn, Unmix, Unphase,
};
use super::layout::{Amplitudes, Layout};
use super::vector::Vector;

/// The state of one problem.
#[derive(Debug, Clone)]
pub(super) struct Evolution<V> {
    layout: Layout,
    energies: Energies,
    low_energies: Vec<f64>,
    low_vectors: Vec<V>,
    state: Amplitudes<V>,
    adjoint: Amplitudes<V>,
    scratch: Amplitudes<V>,
}

impl<V: Vector> Evolution<V> {
    pub(super) fn new(ising: &Ising) -> Self {
        let layout = Layout::new::<V>(ising.qubits());
        let energies = Energies::new(ising, layout.low, layout.high);
        let low_energies: Vec<f64> = (0..1 << layout.low).map(|k| energies.low_energy(k)).collect();
        let vectors = low_energies.chunks_exact(V::LANES);
        let low_vectors = vectors.map(|e| V::from_fn(|lane| e[lane])).collect();
        Self {
            layout,
            energies,
            low_energies,
            low_vectors,
            state: Amplitudes::default(),
            adjoint: Amplitudes::default(),
            scratch: Amplitudes::default(),
        }
    }

    /// Number of amplitudes, those of dummy qubits included.
    pub(super) fn amplitudes(qubits: usize) -> u64 {
        1_u64.checked_shl(Layout::new::<V>(qubits).qubits() as u32).unwrap_or(u64::MAX)
    }

    /// The state before its last mixer's transform is undone, in tiles.
    fn forward(&mut self, angles: &Angles) {
        let Self { layout, energies, low_energies, state, scratch, .. } = self;
        let layout = &*layout;
        state.reserve(layout);
        scratch.reserve(layout);
        for (layer, (&gamma, &beta)) in angles.gammas().iter().zip(angles.betas()).enumerate() {
            let phases = &Phases::new(low_energies, gamma);
            if layer == 0 {
                state.parts(layout.row).enumerate().for_each(|(row, out)| {
                    simd::run(First { energies, layout, phases, row, out });
                });
            } else {
                let from = &*state;
                scratch.parts(layout.row).enumerate().for_each(|(row, out)| {
                    simd::run(Phase { energies, layout, phases, row, from, out });
                });
                swap(state, scratch);
            }
            let mixer = &Mixer::new(layout.qubits(), beta);
            let from = &*state;
            scratch.parts(layout.tile()).enumerate().for_each(|(tile, out)| {
                simd::run(Mix { layout, mixer, tile, from, out });
            });
            swap(state, scratch);
        }
    }

    /// Runs the circuit; the state is then plain, in rows.
    pub(super) fn run(&mut self, angles: &Angles) {
        self.forward(angles);
        let Self { layout, state, scratch, .. } = self;
        let from = &*state;
        scratch.parts(layout.row).enumerate().for_each(|(row, out)| {
            simd::run(Plain { layout, row, from, out });
        });
        swap(state, scratch);
    }

    /// ⟨H⟩ after [`Self::run`].
    pub(super) fn energy(&self) -> f64 {
        let Self { layout, energies, low_vectors: low_energies, state, .. } = self;
        let rows = state.re.par_chunks(layout.row).zip(state.im.par_chunks(layout.row));
        let sums = rows
            .enumerate()
            .map(|(row, state)| simd::run(Energy { energies, low_energies, layout, row, state }));
        in_order(sums)
    }

    /// ⟨H⟩ and its derivatives. Leaves no state behind.
    pub(super) fn gradient(&mut self, angles: &Angles) -> (f64, Angles) {
        self.forward(angles);
        let Self { layout, energies, low_energies, low_vectors, state, adjoint, scratch } = self;
        let (layout, low_vectors) = (&*layout, &*low_vectors);
        adjoint.reserve(layout);
        let mut gradient = Angles::zeros(angles.layers());

        let from = &*state;
        let rows = scratch.parts(layout.row).zip(adjoint.parts(layout.row)).enumerate();
        let expectation = in_order(rows.map(|(row, (state, adjoint))| {
            simd::run(Turn {
                energies,
                low_energies: low_vectors,
                layout,
                row,
                from,
                state,
                adjoint,
            })
        }));
        swap(state, scratch);

        for layer in (0..angles.layers()).rev() {
            let from = &*state;
            scratch.parts(layout.tile()).enumerate().for_each(|(tile, out)| {
                simd::run(Spectrum { layout, tile, from, out });
            });
            swap(state, scratch);
            let (mixer, from) = (&Mixer::new(layout.qubits(), -angles.betas()[layer]), &*adjoint);
            let tiles = scratch.parts(layout.tile()).zip(state.parts(layout.tile())).enumerate();
            let slope = in_order(tiles.map(|(tile, (adjoint, state))| {
                simd::run(Unmix { layout, mixer, tile, from, adjoint, state })
            }));
            gradient.betas_mut()[layer] = 2.0 * slope;
            swap(adjoint, scratch);

            let from = &*state;
            scratch.parts(layout.row).enumerate().for_each(|(row, out)| {
                simd::run(Plain { layout, row, from, out });
            });
            swap(state, scratch);
            let phases = (layer > 0).then(|| Phases::new(low_energies, -angles.gammas()[layer]));
            let (phases, from) = (phases.as_ref(), &*adjoint);
            let rows = scratch.parts(layout.row).zip(state.parts(layout.row)).enumerate();
            let slope = in_order(rows.map(|(row, (adjoint, state))| {
                let low_energies = low_vectors;
                simd::run(Unphase {
                    energies,
                    low_energies,
                    layout,
                    phases,
                    row,
                    from,
                    adjoint,
                    state,
                })
            }));
            gradient.gammas_mut()[layer] = 2.0 * slope;
            swap(adjoint, scratch);
        }
        (expectation, gradient)
    }

    /// |amplitude|² of a basis state after [`Self::run`].
    pub(super) fn probability(&self, index: usize) -> f64 {
        let (vector, lane) = (index / V::LANES, index % V::LANES);
        self.state.re[vector].lane(lane).powi(2) + self.state.im[vector].lane(lane).powi(2)
    }
}

/// The same sum whatever the threads do.
fn in_order(terms: impl IndexedParallelIterator<Item = f64>) -> f64 {
    terms.collect::<Vec<f64>>().into_iter().sum()
}
