//! Random states of a closed chain, and its base parameters from them.

use super::Mechanism;
use super::singularity::SINGULAR;
use crate::base::BaseParameters;
use crate::dynamics::Samples;
use crate::error::Result;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Rates and accelerations where the workspace states none: of lengths (m/s, m/s²) and of angles.
const RATES: [[f64; 2]; 2] = [[1.0, 10.0], [2.0, 20.0]];
/// Distance from home where a coordinate has no range, m or rad.
const REACH: f64 = 0.3;

impl Mechanism {
    /// Random states: poses uniform in the workspace box, drawn towards home where they cannot be
    /// reached or lie at a singularity; rates and accelerations uniform in their limits (1 m/s,
    /// 10 m/s², 2 rad/s, 20 rad/s² where there are none). From a fixed stream.
    pub fn random_states(&self, count: usize, seed: u64) -> Samples {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let m = self.freedoms();
        let mut s = Samples::zeros(m, count);
        let mut x = vec![0.0; m];
        for i in 0..count {
            for (k, x) in x.iter_mut().enumerate() {
                let [low, high] = match self.workspace[k].position {
                    [low, high] if (high - low).is_finite() => [low, high],
                    _ => [self.home[k] - REACH, self.home[k] + REACH],
                };
                *x = low + (high - low) * rng.random_range(0.0..1.0);
            }
            let mut tries = 0;
            while tries < 60 && !self.usable(&x) {
                x.iter_mut()
                    .zip(&self.home)
                    .for_each(|(x, h)| *x = h + 0.9 * (*x - h));
                tries += 1;
            }
            for k in 0..m {
                let w = &self.workspace[k];
                let angle = self.is_angle(k);
                let [v, a] = RATES[usize::from(angle)];
                let finite = |x: f64, other: f64| match x.is_finite() && x > 0.0 {
                    true => x,
                    false => other,
                };
                let at = k * count + i;
                s.q[at] = x[k];
                s.qd[at] = finite(w.velocity, v) * rng.random_range(-1.0..1.0);
                s.qdd[at] = finite(w.acceleration, a) * rng.random_range(-1.0..1.0);
            }
        }
        s
    }

    /// Whether a pose can be reached and lies away from both singularities.
    fn usable(&self, x: &[f64]) -> bool {
        self.problem(x).is_none()
            && self.singularity(x).is_ok_and(|s| {
                let far = |v: f64| v > 10.0 * SINGULAR;
                far(s.actuation.sigma_min) && s.constraint.is_none_or(|c| far(c.sigma_min))
            })
    }

    /// Base parameters of the unknowns of this mechanism; the same in all coordinates.
    ///
    /// # Errors
    /// When the decomposition fails, which needs numbers that are not finite, or a state that
    /// cannot be evaluated.
    pub fn base(&self) -> Result<BaseParameters> {
        let list = &self.parameters.list;
        let count = (3 * list.len() / self.actuators().max(1)).max(60);
        let platform = self.platform();
        let w = platform.regressor(&platform.random_states(count, 0x0e_4c17e))?;
        let mut base = BaseParameters::from_matrix(
            list.iter().map(|p| p.name.clone()).collect(),
            list.iter().map(|p| p.unit).collect(),
            w.as_ref(),
        )?;
        base.explain_all();
        Ok(base)
    }
}
