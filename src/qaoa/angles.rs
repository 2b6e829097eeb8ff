//! [`Angles`]: the 2p parameters of a QAOA circuit, and where their training starts.

use thiserror::Error;

/// The parameters γ₁…γ_p and β₁…β_p of a circuit with p layers (or a gradient with respect to them).
///
/// The circuit is `|ψ⟩ = Π_l [ Π_i RX_i(2β_l) · exp(−iγ_l H) ] |+⟩ⁿ`, layer 1 applied first.
#[derive(Debug, Clone, PartialEq)]
pub struct Angles {
    gammas: Vec<f64>,
    betas: Vec<f64>,
}

/// Angles that describe no circuit.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum AnglesError {
    /// γ and β belong together layer by layer.
    #[error("{gammas} gammas but {betas} betas; give one of each per layer")]
    Unpaired {
        /// Number of γ.
        gammas: usize,
        /// Number of β.
        betas: usize,
    },
    /// A circuit needs a layer.
    #[error("no layer at all; give at least one gamma and one beta")]
    Empty,
    /// NaN or infinity.
    #[error("{name} {layer} is {value}; every angle must be finite")]
    NotFinite {
        /// `gamma` or `beta`.
        name: &'static str,
        /// The layer, counted from 1.
        layer: usize,
        /// What was given.
        value: f64,
    },
}

impl Angles {
    /// Checked angles, one γ and one β per layer.
    ///
    /// # Errors
    /// If the counts differ, are zero, or an angle is not finite.
    pub fn new(gammas: Vec<f64>, betas: Vec<f64>) -> Result<Self, AnglesError> {
        if gammas.len() != betas.len() {
            return Err(AnglesError::Unpaired { gammas: gammas.len(), betas: betas.len() });
        }
        if gammas.is_empty() {
            return Err(AnglesError::Empty);
        }
        for (name, angles) in [("gamma", &gammas), ("beta", &betas)] {
            if let Some(index) = angles.iter().position(|angle| !angle.is_finite()) {
                let (layer, value) = (index + 1, angles[index]);
                return Err(AnglesError::NotFinite { name, layer, value });
            }
        }
        Ok(Self { gammas, betas })
    }

    /// The start of every training: a linear ramp, γ up to ¾ and β from −¾ to 0 (β < 0 because |+⟩ is
    /// the ground state of −ΣX), in units of a Hamiltonian with standard deviation 1.
    #[must_use]
    pub fn ramp(layers: usize) -> Self {
        let step = |layer: usize| (layer as f64 + 0.5) / layers as f64;
        Self {
            gammas: (0..layers).map(|layer| 0.75 * step(layer)).collect(),
            betas: (0..layers).map(|layer| -0.75 * (1.0 - step(layer))).collect(),
        }
    }

    pub(crate) fn zeros(layers: usize) -> Self {
        Self { gammas: vec![0.0; layers], betas: vec![0.0; layers] }
    }

    /// p, the number of layers.
    #[must_use]
    pub fn layers(&self) -> usize {
        self.gammas.len()
    }

    /// γ₁…γ_p, radians per unit of the Hamiltonian.
    #[must_use]
    pub fn gammas(&self) -> &[f64] {
        &self.gammas
    }

    /// β₁…β_p, radians.
    #[must_use]
    pub fn betas(&self) -> &[f64] {
        &self.betas
    }

    pub(crate) fn gammas_mut(&mut self) -> &mut [f64] {
        &mut self.gammas
    }

    pub(crate) fn betas_mut(&mut self) -> &mut [f64] {
        &mut self.betas
    }

    /// All 2p numbers, γ first.
    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        self.gammas.iter_mut().chain(&mut self.betas)
    }

    /// All 2p numbers, γ first.
    pub fn iter(&self) -> impl Iterator<Item = f64> + '_ {
        self.gammas.iter().chain(&self.betas).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ramp_is_the_one_of_the_formulation() {
        let ramp = Angles::ramp(5);
        let expected_gammas = [0.075, 0.225, 0.375, 0.525, 0.675];
        let expected_betas = [-0.675, -0.525, -0.375, -0.225, -0.075];
        for layer in 0..5 {
            assert!((ramp.gammas()[layer] - expected_gammas[layer]).abs() < 1e-15);
            assert!((ramp.betas()[layer] - expected_betas[layer]).abs() < 1e-15);
        }
    }

    #[test]
    fn angles_that_describe_no_circuit_are_refused() {
        assert_eq!(Angles::new(vec![], vec![]), Err(AnglesError::Empty));
        assert!(matches!(Angles::new(vec![0.1], vec![]), Err(AnglesError::Unpaired { .. })));
        assert!(matches!(
            Angles::new(vec![0.1, f64::NAN], vec![0.0, 0.0]),
            Err(AnglesError::NotFinite { name: "gamma", layer: 2, .. })
        ));
    }
}
