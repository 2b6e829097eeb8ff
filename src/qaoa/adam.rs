//! Adam (Kingma & Ba 2015, Algorithm 1), the paper's optimiser.

use super::angles::Angles;

const BETA_1: f64 = 0.9;
const BETA_2: f64 = 0.999;
const EPSILON: f64 = 1e-8;

/// The moments of one descent.
#[derive(Debug, Clone)]
pub struct Adam {
    learning_rate: f64,
    moments: Vec<(f64, f64)>,
    decay_1: f64,
    decay_2: f64,
}

impl Adam {
    /// A descent over circuits with `layers` layers.
    #[must_use]
    pub fn new(learning_rate: f64, layers: usize) -> Self {
        Self { learning_rate, moments: vec![(0.0, 0.0); 2 * layers], decay_1: 1.0, decay_2: 1.0 }
    }

    /// One step against `gradient`.
    pub fn step(&mut self, angles: &mut Angles, gradient: &Angles) {
        self.decay_1 *= BETA_1;
        self.decay_2 *= BETA_2;
        for ((angle, slope), (first, second)) in
            angles.iter_mut().zip(gradient.iter()).zip(&mut self.moments)
        {
            *first = BETA_1 * *first + (1.0 - BETA_1) * slope;
            *second = BETA_2 * *second + (1.0 - BETA_2) * slope * slope;
            let mean = *first / (1.0 - self.decay_1);
            let spread = (*second / (1.0 - self.decay_2)).sqrt();
            *angle -= self.learning_rate * mean / (spread + EPSILON);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_step_is_the_learning_rate_whatever_the_slope() {
        let mut angles = Angles::zeros(1);
        Adam::new(0.1, 1).step(&mut angles, &Angles::new(vec![1e3], vec![-1e-3]).unwrap());
        assert!((angles.gammas()[0] + 0.1).abs() < 1e-6);
        assert!((angles.betas()[0] - 0.1).abs() < 1e-5);
    }

    #[test]
    fn a_parabola_is_descended_to_its_bottom() {
        let mut angles = Angles::new(vec![1.0], vec![-2.0]).unwrap();
        let mut adam = Adam::new(0.1, 1);
        for _ in 0..500 {
            let gradient =
                Angles::new(vec![2.0 * angles.gammas()[0]], vec![8.0 * angles.betas()[0]]).unwrap();
            adam.step(&mut angles, &gradient);
        }
        assert!(angles.iter().all(|angle| angle.abs() < 1e-3));
    }
}
