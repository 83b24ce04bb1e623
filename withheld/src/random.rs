//! Random numbers of one case: a counter-based generator, so that a seed gives the same cases on any
//! number of threads.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub struct Random(ChaCha8Rng);

impl Random {
    /// The generator of a case; `stream` separates uses that must not disturb each other.
    pub fn new(seed: u64, case: usize, stream: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream((case as u64) << 8 | stream);
        Self(rng)
    }

    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// Uniform in the logarithm.
    pub fn log_range(&mut self, low: f64, high: f64) -> f64 {
        self.range(low.ln(), high.ln()).exp()
    }

    pub fn index(&mut self, n: usize) -> usize {
        ((self.0.random::<f64>() * n as f64) as usize).min(n - 1)
    }

    pub fn chance(&mut self, p: f64) -> bool {
        self.0.random::<f64>() < p
    }

    pub fn normal(&mut self) -> f64 {
        let u: f64 = 1.0 - self.0.random::<f64>();
        let w: f64 = self.0.random();
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * w).cos()
    }

    /// 1 plus a normal deviation, kept within three of them.
    pub fn factor(&mut self, std: f64) -> f64 {
        (1.0 + std * self.normal().clamp(-3.0, 3.0)).max(0.2)
    }

    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            let j = self.index(i + 1);
            items.swap(i, j);
        }
    }
}
