//! Noise of simulated sensors.

use rand::Rng;

/// A draw from the normal distribution of variance one (Box & Muller 1958).
pub fn normal(r: &mut impl Rng) -> f64 {
    let u: f64 = 1.0 - r.random::<f64>();
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * r.random::<f64>()).cos()
}
