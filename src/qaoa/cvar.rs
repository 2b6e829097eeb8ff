//! CVaR, the optional objective: the mean energy of the best share α of all measurements (Barkoutsos et
//! al., "Improving Variational Quantum Optimization using CVaR", Quantum 4, 256, 2020).
//!
//! With q the α-quantile of the energy, `CVaR = q − ⟨(q − E)₊⟩ / α`. Its derivative is that of this
//! expectation with q held (q maximises the right hand side, so that its own change does not count).
//! Amplitudes give both exactly. From R samples, q is the sample quantile, the expectation the sample
//! mean, and the derivative is estimated with the likelihood ratio,
//! `−(1/αR) Σ (q − E)₊ ∂ log p` (Tamar, Glassner & Mannor, "Optimizing the CVaR via Sampling", AAAI
//! 2015): only samples better than q count. The estimate's bias and noise fall with R.

use super::angles::Angles;
use super::bits::Bits;
use super::engine::Sample;

/// The share of the best measurements that counts, and where it ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tail {
    /// α, above 0 and at most 1.
    pub(super) alpha: f64,
    /// q, the α-quantile of the energy.
    pub(super) quantile: f64,
}

impl Tail {
    /// What a measurement with this energy contributes: its mean is the CVaR.
    #[inline(always)]
    pub(super) fn value(&self, energy: f64) -> f64 {
        self.quantile + (energy - self.quantile).min(0.0) / self.alpha
    }
}

/// CVaR and its derivative from samples; `score` is `∂ log p / ∂angles` of a bitstring.
pub(super) fn estimate(
    samples: &[Sample],
    alpha: f64,
    layers: usize,
    energy: impl Fn(&Bits) -> f64,
    score: impl Fn(&Bits) -> Angles,
) -> (f64, Angles) {
    let mut ranked: Vec<(f64, &Sample)> =
        samples.iter().map(|sample| (energy(&sample.bits), sample)).collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let shots: f64 = samples.iter().map(|sample| f64::from(sample.count)).sum();
    let counting = alpha * shots;
    let mut before = 0.0;
    let quantile = ranked
        .iter()
        .find(|(_, sample)| {
            before += f64::from(sample.count);
            before >= counting * (1.0 - 1e-12)
        })
        .map_or(0.0, |(energy, _)| *energy);
    let mut value = quantile;
    let mut gradient = Angles::zeros(layers);
    for (energy, sample) in ranked.into_iter().take_while(|(energy, _)| *energy < quantile) {
        let weight = f64::from(sample.count) * (quantile - energy) / counting;
        value -= weight;
        let score = score(&sample.bits);
        gradient.iter_mut().zip(score.iter()).for_each(|(slope, part)| *slope -= weight * part);
    }
    (value, gradient)
}
