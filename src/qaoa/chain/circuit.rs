//! What the trained angles mean for one site of the chain: amplitudes over a qubit's *trajectory*
//! `a = (a_1 … a_p)`, its Z value while each phase layer acts (bit l − 1 of the index, 0 for +1).

use num_complex::Complex64;

use super::super::angles::Angles;

/// Site amplitudes of one set of angles, the same for every qubit.
#[derive(Debug, Clone, Default)]
pub(super) struct Circuit {
    pub(super) layers: usize,
    pub(super) gammas: Vec<f64>,
    betas: Vec<f64>,
    /// `walk[s][a]`: ⟨s|e^{−iβ_p X}|a_p⟩ … ⟨a_2|e^{−iβ_1 X}|a_1⟩ ⟨a_1|+⟩ for the measured bit s.
    pub(super) walk: [Vec<Complex64>; 2],
}

impl Circuit {
    pub(super) fn new(angles: &Angles) -> Self {
        let mut circuit = Self {
            layers: angles.layers(),
            gammas: angles.gammas().to_vec(),
            betas: angles.betas().to_vec(),
            walk: Default::default(),
        };
        circuit.walk = [0, 1].map(|s| circuit.walk_with(s, None));
        circuit
    }

    /// Number of trajectories of one qubit.
    pub(super) fn trajectories(&self) -> usize {
        1 << self.layers
    }

    /// ∂walk/∂β of one layer.
    pub(super) fn walk_derivative(&self, bit: usize, layer: usize) -> Vec<Complex64> {
        self.walk_with(bit, Some(layer))
    }

    fn walk_with(&self, bit: usize, derived: Option<usize>) -> Vec<Complex64> {
        let step = |layer: usize, flips: bool| {
            let (sin, cos) = self.betas[layer].sin_cos();
            let (stay, flip) = if derived == Some(layer) { (-sin, cos) } else { (cos, sin) };
            if flips { Complex64::new(0.0, -flip) } else { Complex64::new(stay, 0.0) }
        };
        (0..self.trajectories())
            .map(|a| {
                let next = |layer: usize| {
                    if layer + 1 < self.layers { a >> (layer + 1) & 1 } else { bit }
                };
                let steps =
                    (0..self.layers).map(|layer| step(layer, a >> layer & 1 != next(layer)));
                steps.product::<Complex64>() * std::f64::consts::FRAC_1_SQRT_2
            })
            .collect()
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
