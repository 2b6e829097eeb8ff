//! What the trained angles mean for one site of the chain: amplitudes over a qubit's *trajectory*
//! `a = (a_1 … a_p)`, its Z value while each phase layer acts (bit l − 1 of the index, 0 for +1).

use num_complex::Complex64;

use super::site::Mixers;

/// Site amplitudes of one set of angles, the same for every qubit.
#[derive(Debug, Clone, Default)]
pub(super) struct Circuit {
    pub(super) gammas: Vec<f64>,
    /// `walk[s][a]`: ⟨s|e^{−iβ_p X}|a_p⟩ … ⟨a_2|e^{−iβ_1 X}|a_1⟩ ⟨a_1|+⟩ for the measured bit s.
    walk: [Vec<Complex64>; 2],
}

impl Circuit {
    pub(super) fn new(mixers: &Mixers) -> Self {
        Self { gammas: mixers.gammas.clone(), walk: Self::walks(&mixers.betas, None) }
    }

    /// The amplitudes of [`Self::walk`], or their derivative with respect to β of one layer.
    pub(super) fn walks(betas: &[f64], derived: Option<usize>) -> [Vec<Complex64>; 2] {
        let layers = betas.len();
        // Amplitude of a layer's mixer to leave the bit as it is, and to flip it (times −i).
        let steps: Vec<(f64, f64)> = betas
            .iter()
            .enumerate()
            .map(|(layer, beta)| match beta.sin_cos() {
                (sin, cos) if derived == Some(layer) => (cos, -sin),
                step => step,
            })
            .collect();
        [0, 1].map(|bit| {
            let amplitude = |a: usize| {
                let next =
                    |layer: usize| if layer + 1 < layers { a >> (layer + 1) & 1 } else { bit };
                let start = Complex64::new(std::f64::consts::FRAC_1_SQRT_2, 0.0);
                steps.iter().enumerate().fold(start, |product, (layer, &(sin, cos))| {
                    let flips = a >> layer & 1 != next(layer);
                    product
                        * if flips { Complex64::new(0.0, -sin) } else { Complex64::new(cos, 0.0) }
                })
            };
            (0..1 << layers).map(amplitude).collect()
        })
    }

    /// Number of trajectories of one qubit.
    pub(super) fn trajectories(&self) -> usize {
        self.walk[0].len()
    }

    /// The amplitudes of one qubit with field `h`, for each bit.
    pub(super) fn factors(&self, h: f64) -> [Vec<Complex64>; 2] {
        let phases = self.phases(h);
        [0, 1].map(|bit| self.walk[bit].iter().zip(&phases).map(|(w, p)| w * p).collect())
    }

    /// `e^{−i h Σ_l γ_l a_l}` over all trajectories.
    pub(super) fn phases(&self, h: f64) -> Vec<Complex64> {
        let mut phases = vec![Complex64::ONE];
        for gamma in &self.gammas {
            let plus = Complex64::cis(-h * gamma);
            let minus = plus.conj();
            let flipped: Vec<_> = phases.iter().map(|phase| phase * minus).collect();
            phases.iter_mut().for_each(|phase| *phase *= plus);
            phases.extend(flipped);
        }
        phases
    }
}
