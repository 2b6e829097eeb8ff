//! The state through the layers of a circuit, and back with its adjoint for the derivatives: after the
//! forward pass λ = Hψ, then every layer is taken off ψ and λ again, so that no layer is stored.

use rayon::prelude::*;

use super::super::angles::Angles;
use super::super::cvar::Tail;
use super::super::ising::Ising;
use super::super::simd;
use super::energies::Energies;
use super::kernels::{Energy, First, Mix, Mixer, Phase, Phases, Plain, Turn, Unmix, Unphase};
use super::layout::{Amplitudes, Layout};
use super::vector::Vector;

/// Bins into which [`Evolution::quantile`] divides the energies, and how often it does.
const BINS: usize = 256;
const DIVISIONS: usize = 6;

/// The state of one problem.
#[derive(Debug, Clone)]
pub(super) struct Evolution<V> {
    layout: Layout,
    energies: Energies,
    low_energies: Vec<f64>,
    low_vectors: Vec<V>,
    state: Amplitudes<V>,
    adjoint: Amplitudes<V>,
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
        }
    }

    /// Number of amplitudes, those of dummy qubits included.
    pub(super) fn amplitudes(qubits: usize) -> u64 {
        1_u64.checked_shl(Layout::new::<V>(qubits).qubits() as u32).unwrap_or(u64::MAX)
    }

    /// Runs the circuit up to the last mixer, whose low qubits are still transformed.
    fn forward(&mut self, angles: &Angles) {
        let Self { layout, energies, low_energies, state, .. } = self;
        let layout = &*layout;
        state.reserve(layout);
        for (layer, (&gamma, &beta)) in angles.gammas().iter().zip(angles.betas()).enumerate() {
            let phases = &Phases::new(low_energies, gamma);
            state.rows(layout).enumerate().for_each(|(row, state)| {
                if layer == 0 {
                    simd::run(First { energies, layout, phases, row, state });
                } else {
                    simd::run(Phase { energies, layout, phases, row, state });
                }
            });
            let mixer = &Mixer::new(layout.qubits(), beta);
            let groups = state.columns(layout).into_par_iter();
            groups.for_each(|state| simd::run(Mix { layout, mixer, state }));
        }
    }

    /// Runs the circuit.
    pub(super) fn run(&mut self, angles: &Angles) {
        self.forward(angles);
        self.state.rows(&self.layout).for_each(|state| simd::run(Plain { state }));
    }

    /// ⟨H⟩ after [`Self::run`].
    pub(super) fn energy(&self) -> f64 {
        let Self { layout, energies, low_vectors: low_energies, state, .. } = self;
        let rows = state.plain_rows(layout);
        let sums = rows
            .enumerate()
            .map(|(row, state)| simd::run(Energy { energies, low_energies, layout, row, state }));
        in_order(sums)
    }

    /// The energy below which a share `alpha` of all measurements lies after [`Self::run`].
    pub(super) fn quantile(&self, alpha: f64) -> f64 {
        let (mut low, mut high) = self.energies.range();
        let wanted = alpha * self.histogram(low, high).iter().sum::<f64>();
        let mut below = 0.0;
        for _ in 0..DIVISIONS {
            let bins = self.histogram(low, high);
            let width = (high - low) / BINS as f64;
            let mut bin = 0;
            // Rounding must not lead past the last bin.
            while bin + 1 < BINS && below + bins[bin] < wanted {
                below += bins[bin];
                bin += 1;
            }
            (low, high) = (low + bin as f64 * width, low + (bin + 1) as f64 * width);
        }
        high
    }

    /// The probability in each of [`BINS`] equal parts of a range of energies.
    fn histogram(&self, low: f64, high: f64) -> Vec<f64> {
        let Self { layout, energies, low_vectors, state, .. } = self;
        let scale = BINS as f64 / (high - low).max(f64::MIN_POSITIVE);
        let rows = state.plain_rows(layout);
        let parts: Vec<Vec<f64>> = rows
            .enumerate()
            .map(|(row, (re, im))| {
                let mut here = vec![V::ZERO; layout.row];
                energies.fill(row, low_vectors, &mut here);
                let mut bins = vec![0.0; BINS];
                for ((x, y), e) in re.iter().zip(im).zip(&here) {
                    for lane in 0..V::LANES {
                        let bin = (e.lane(lane) - low) * scale;
                        if (0.0..BINS as f64).contains(&bin) {
                            bins[bin as usize] += x.lane(lane).powi(2) + y.lane(lane).powi(2);
                        }
                    }
                }
                bins
            })
            .collect();
        parts.iter().fold(vec![0.0; BINS], |mut sum, part| {
            sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
            sum
        })
    }

    /// ⟨H⟩ and its derivatives, or those of a tail's CVaR. Leaves no state behind.
    pub(super) fn gradient(&mut self, angles: &Angles, tail: Option<Tail>) -> (f64, Angles) {
        self.forward(angles);
        let Self { layout, energies, low_energies, low_vectors, state, adjoint } = self;
        let (layout, energies) = (&*layout, &*energies);
        adjoint.reserve(layout);
        let mut gradient = Angles::zeros(angles.layers());

        let rows = state.rows(layout).zip(adjoint.rows(layout)).enumerate();
        let expectation = in_order(rows.map(|(row, (state, adjoint))| {
            simd::run(Turn { energies, low_energies: low_vectors, tail, row, state, adjoint })
        }));
        for layer in (0..angles.layers()).rev() {
            let mixer = &Mixer::new(layout.qubits(), -angles.betas()[layer]);
            let (states, adjoints) = (state.columns(layout), adjoint.columns(layout));
            let groups = states.into_par_iter().zip(adjoints);
            let slope = in_order(
                groups.map(|(state, adjoint)| simd::run(Unmix { layout, mixer, state, adjoint })),
            );
            gradient.betas_mut()[layer] = 2.0 * slope;

            let phases = (layer > 0).then(|| Phases::new(low_energies, -angles.gammas()[layer]));
            let phases = phases.as_ref();
            let rows = state.rows(layout).zip(adjoint.rows(layout)).enumerate();
            let slope = in_order(rows.map(|(row, (state, adjoint))| {
                let low_energies = &*low_vectors;
                simd::run(Unphase { energies, low_energies, layout, phases, row, state, adjoint })
            }));
            gradient.gammas_mut()[layer] = 2.0 * slope;
        }
        (expectation, gradient)
    }

    /// |amplitude|² of a basis state after [`Self::run`].
    pub(super) fn probability(&self, index: usize) -> f64 {
        let (vector, lane) = self.layout.place::<V>(index);
        self.state.re[vector].lane(lane).powi(2) + self.state.im[vector].lane(lane).powi(2)
    }
}

/// The same sum whatever the threads do.
fn in_order(terms: impl IndexedParallelIterator<Item = f64>) -> f64 {
    terms.collect::<Vec<f64>>().into_iter().sum()
}
