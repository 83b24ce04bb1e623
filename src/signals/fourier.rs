//! Spectra of real signals, and differentiation of periodic ones. The transforms are those of `rustfft`.

use realfft::num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use std::f64::consts::PI;
use std::sync::Arc;

/// What transforms of signals of one length share. `None` for a signal without samples.
pub struct Plan(Option<Arc<dyn RealToComplex<f64>>>);

impl Plan {
    /// For signals of `count` samples, any number; O(N log N).
    pub fn new(count: usize) -> Plan {
        Plan((count > 0).then(|| RealFftPlanner::new().plan_fft_forward(count)))
    }

    /// `X_k = Σ x_n e^{−2πi kn/N}` for `k = 0 … ⌊N/2⌋`; those above are the conjugates of these. The signal is used up.
    ///
    /// # Panics
    /// If it is not as long as planned.
    pub fn spectrum(&self, mut x: Vec<f64>) -> Vec<Complex64> {
        let Some(forward) = &self.0 else {
            return Vec::new();
        };
        let mut out = forward.make_output_vec();
        (forward.process(&mut x, &mut out))
            .expect("signals are as long as their plan: the one error");
        out
    }
}

/// [`Plan::spectrum`] of one signal.
pub fn spectrum(x: &[f64]) -> Vec<Complex64> {
    Plan::new(x.len()).spectrum(x.to_vec())
}

/// What the ways back from spectra of one length share. `None` for a signal without samples.
pub struct Inverse(Option<Arc<dyn ComplexToReal<f64>>>);

impl Inverse {
    /// For signals of `count` samples, any number; O(N log N).
    pub fn new(count: usize) -> Inverse {
        Inverse((count > 0).then(|| RealFftPlanner::new().plan_fft_inverse(count)))
    }

    /// The signal with this spectrum, times the number of its samples. The spectrum is used up.
    ///
    /// # Panics
    /// If the spectrum is not that of a real signal of the length that was planned.
    pub fn signal(&self, mut spectrum: Vec<Complex64>) -> Vec<f64> {
        let Some(back) = &self.0 else {
            return Vec::new();
        };
        let mut out = back.make_output_vec();
        (back.process(&mut spectrum, &mut out))
            .expect("first and last line are real, and as many as planned: the two errors");
        out
    }
}

/// A signal of one period, low-passed to the harmonics up to `highest`, and its first two
/// derivatives with respect to time; `period` in seconds.
///
/// Exact for a signal that has no other harmonics, whatever its length.
pub fn derivatives(x: &[f64], period: f64, highest: usize) -> [Vec<f64>; 3] {
    let n = x.len();
    let mean = x.iter().sum::<f64>() / n.max(1) as f64;
    let full = spectrum(&x.iter().map(|v| v - mean).collect::<Vec<_>>());
    let kept = n.div_ceil(2).min(highest.saturating_add(1));
    let back = Inverse::new(n);
    std::array::from_fn(|d| {
        let mut y = vec![Complex64::ZERO; full.len()];
        for k in 1..kept {
            let rate = Complex64::new(0.0, 2.0 * PI / period * k as f64);
            y[k] = full[k] * rate.powu(d as u32) / n as f64;
        }
        if d == 0 && n > 0 {
            y[0] = mean.into();
        }
        back.signal(y)
    })
}

/// Power spectral density (one-sided, units²/Hz) by Welch's method: Hann windows of `length`
/// samples that overlap by half, means removed. Returns frequencies and densities.
pub fn welch(x: &[f64], rate: f64, length: usize) -> (Vec<f64>, Vec<f64>) {
    welch_of(x, rate, length, usize::MAX)
}

/// The same of no more than so many windows, evenly spread over a long signal.
pub fn welch_of(x: &[f64], rate: f64, length: usize, most: usize) -> (Vec<f64>, Vec<f64>) {
    let n = length.min(x.len()).max(2);
    let window: Vec<f64> = (0..n)
        .map(|i| 0.5 - 0.5 * (2.0 * PI * i as f64 / n as f64).cos())
        .collect();
    let power: f64 = window.iter().map(|w| w * w).sum();
    let plan = Plan::new(n);
    let bins = n / 2 + 1;
    let mut sum = vec![0.0; bins];
    let step = (n / 2).max(1);
    let all = match x.len() >= n {
        true => (x.len() - n) / step + 1,
        false => 0,
    };
    let count = all.min(most.max(1));
    for k in 0..count {
        let start = k * all / count * step;
        let part = &x[start..start + n];
        let mean = part.iter().sum::<f64>() / n as f64;
        let z = part.iter().zip(&window).map(|(v, w)| (v - mean) * w);
        for (s, c) in sum.iter_mut().zip(plan.spectrum(z.collect())) {
            *s += c.norm_sqr();
        }
    }
    let scale = 2.0 / (rate * power * count.max(1) as f64);
    let frequencies = (0..bins).map(|k| k as f64 * rate / n as f64).collect();
    (frequencies, sum.into_iter().map(|s| s * scale).collect())
}
