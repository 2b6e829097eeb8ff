//! The state through the layers of a circuit, and back with its adjoint for the derivatives: after the
//! forward pass λ = Hψ, then every layer is taken off ψ and λ again, so that no layer is stored.

use std::fmt;

use rayon::prelude::*;

use super::super::angles::Angles;
use super::super::cvar::Tail;
use super::super::ising::Ising;
use super::energies::Energies;
use super::kernels::{Energy, First, Mix, Mixer, Phase, Phases, Plain, Turn, Unmix, Unphase};
use super::layout::{Amplitudes, Layout};
use super::vector::{D8, LANES, S8, Vector};
#[cfg(target_arch = "x86_64")]
use super::{
    super::simd,
    vector::{D4x2, D8Wide, S8Wide},
};

/// Bins into which [`Evolution::quantile`] divides the energies, and how often it does.
const BINS: usize = 256;
const DIVISIONS: usize = 6;

/// What the engine asks of a state, whatever its numbers are.
pub(super) trait State: fmt::Debug + Send + Sync {
    /// Runs the circuit.
    fn run(&mut self, angles: &Angles);
    /// ⟨H⟩ after [`State::run`].
    fn energy(&self) -> f64;
    /// The energy below which a share `alpha` of all measurements lies after [`State::run`].
    fn quantile(&self, alpha: f64) -> f64;
    /// ⟨H⟩ and its derivatives, or those of a tail's CVaR. Leaves no state behind.
    fn gradient(&mut self, angles: &Angles, tail: Option<Tail>) -> (f64, Angles);
    /// Number of basis states, those of dummy qubits included.
    fn basis_states(&self) -> usize;
    /// |amplitude|² of a basis state after [`State::run`].
    fn probability(&self, index: usize) -> f64;
}

/// The state of `ising` in doubles, with the widest vectors that this processor has.
pub(super) fn in_doubles(ising: &Ising) -> Box<dyn State> {
    #[cfg(target_arch = "x86_64")]
    {
        if simd::has_avx512() {
            return Box::new(Evolution::<D8Wide>::new(ising));
        }
        if simd::has_avx2() {
            return Box::new(Evolution::<D4x2>::new(ising));
        }
    }
    Box::new(Evolution::<D8>::new(ising))
}

/// The same in singles.
pub(super) fn in_singles(ising: &Ising) -> Box<dyn State> {
    #[cfg(target_arch = "x86_64")]
    if simd::has_avx2() {
        return Box::new(Evolution::<S8Wide>::new(ising));
    }
    Box::new(Evolution::<S8>::new(ising))
}

/// The state of one problem.
#[derive(Debug)]
struct Evolution<V> {
    layout: Layout,
    energies: Energies,
    low_energies: Vec<f64>,
    low_vectors: Vec<V>,
    state: Amplitudes<V>,
    adjoint: Amplitudes<V>,
}

impl<V: Vector> Evolution<V> {
    fn new(ising: &Ising) -> Self {
        let layout = Layout::new(ising.qubits());
        let energies = Energies::new(ising, layout.low, layout.high);
        let low_energies: Vec<f64> = (0..1 << layout.low).map(|k| energies.low_energy(k)).collect();
        let vectors = low_energies.chunks_exact(LANES);
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

    /// Runs the circuit up to the last mixer, whose low qubits are still transformed.
    fn forward(&mut self, angles: &Angles) {
        let Self { layout, energies, low_energies, state, .. } = self;
        let layout = &*layout;
        state.reserve(layout);
        for (layer, (&gamma, &beta)) in angles.gammas().iter().zip(angles.betas()).enumerate() {
            let phases = &Phases::new(low_energies, gamma);
            state.rows(layout).enumerate().for_each(|(row, state)| {
                if layer == 0 {
                    V::run(First { energies, layout, phases, row, state });
                } else {
                    V::run(Phase { energies, layout, phases, row, state });
                }
            });
            let mixer = &Mixer::new(layout.qubits(), beta);
            let groups = state.columns(layout).into_par_iter();
            groups.for_each(|state| V::run(Mix { layout, mixer, state }));
        }
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
                    for lane in 0..LANES {
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
}

impl<V: Vector> State for Evolution<V> {
    fn run(&mut self, angles: &Angles) {
        self.forward(angles);
        self.state.rows(&self.layout).for_each(|state| V::run(Plain { state }));
    }

    fn energy(&self) -> f64 {
        let Self { layout, energies, low_vectors: low_energies, state, .. } = self;
        let rows = state.plain_rows(layout);
        let sums = rows
            .enumerate()
            .map(|(row, state)| V::run(Energy { energies, low_energies, layout, row, state }));
        in_order(sums)
    }

    fn quantile(&self, alpha: f64) -> f64 {
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

    fn gradient(&mut self, angles: &Angles, tail: Option<Tail>) -> (f64, Angles) {
        self.forward(angles);
        let Self { layout, energies, low_energies, low_vectors, state, adjoint } = self;
        let (layout, energies) = (&*layout, &*energies);
        adjoint.reserve(layout);
        let mut gradient = Angles::zeros(angles.layers());

        let rows = state.rows(layout).zip(adjoint.rows(layout)).enumerate();
        let expectation = in_order(rows.map(|(row, (state, adjoint))| {
            V::run(Turn { energies, low_energies: low_vectors, tail, row, state, adjoint })
        }));
        for layer in (0..angles.layers()).rev() {
            let mixer = &Mixer::new(layout.qubits(), -angles.betas()[layer]);
            let (states, adjoints) = (state.columns(layout), adjoint.columns(layout));
            let groups = states.into_par_iter().zip(adjoints);
            let slope = in_order(
                groups.map(|(state, adjoint)| V::run(Unmix { layout, mixer, state, adjoint })),
            );
            gradient.betas_mut()[layer] = 2.0 * slope;

            let phases = (layer > 0).then(|| Phases::new(low_energies, -angles.gammas()[layer]));
            let phases = phases.as_ref();
            let rows = state.rows(layout).zip(adjoint.rows(layout)).enumerate();
            let slope = in_order(rows.map(|(row, (state, adjoint))| {
                let low_energies = &*low_vectors;
                V::run(Unphase { energies, low_energies, layout, phases, row, state, adjoint })
            }));
            gradient.gammas_mut()[layer] = 2.0 * slope;
        }
        (expectation, gradient)
    }

    fn basis_states(&self) -> usize {
        1 << self.layout.qubits()
    }

    fn probability(&self, index: usize) -> f64 {
        let (vector, lane) = self.layout.place(index);
        self.state.re[vector].lane(lane).powi(2) + self.state.im[vector].lane(lane).powi(2)
    }
}

/// The same sum whatever the threads do.
fn in_order(terms: impl IndexedParallelIterator<Item = f64>) -> f64 {
    terms.collect::<Vec<f64>>().into_iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn problems() -> impl Strategy<Value = Ising> {
        let fields = prop::collection::vec(-1.0..1.0_f64, 14);
        let couplings = prop::collection::vec((0..13_usize, 1..14_usize, -1.0..1.0_f64), 0..20);
        (fields, couplings).prop_map(|(h, couplings)| {
            let ordered = couplings.into_iter().map(|(i, j, value)| (i.min(j), i.max(j), value));
            let mut ordered: Vec<_> = ordered.filter(|(i, j, _)| i != j).collect();
            ordered.sort_by_key(|&(i, j, _)| (i, j));
            ordered.dedup_by_key(|&mut (i, j, _)| (i, j));
            Ising::new(0.5, h, ordered).unwrap()
        })
    }

    fn outcome(mut state: impl State) -> (f64, (f64, Angles), (f64, Angles), Vec<f64>) {
        let angles = Angles::ramp(2);
        state.run(&angles);
        let quantile = state.quantile(0.2);
        let seen = (0..state.basis_states()).step_by(97).map(|k| state.probability(k)).collect();
        let tail = Some(Tail { alpha: 0.2, quantile });
        (state.energy(), state.gradient(&angles, None), state.gradient(&angles, tail), seen)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(8))]
        #[cfg(target_arch = "x86_64")]
        #[test]
        fn every_instruction_set_gives_the_same_bits(ising in problems()) {
            let doubles = outcome(Evolution::<D8>::new(&ising));
            let singles = outcome(Evolution::<S8>::new(&ising));
            prop_assert!((doubles.0 - singles.0).abs() < 1e-4);
            if simd::has_avx2() {
                prop_assert_eq!(&outcome(Evolution::<D4x2>::new(&ising)), &doubles);
                prop_assert_eq!(&outcome(Evolution::<S8Wide>::new(&ising)), &singles);
            }
            if simd::has_avx512() {
                prop_assert_eq!(&outcome(Evolution::<D8Wide>::new(&ising)), &doubles);
            }
        }
    }
}
