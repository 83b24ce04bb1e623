//! The cut-off of the positions, from their spectrum.

use super::fourier::{Plan, Welch, welch};
use realfft::num_complex::Complex64;
use std::f64::consts::PI;

/// A cut-off and how it was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cutoff {
    /// Hz
    pub frequency: f64,
    /// noise floor of the position, one-sided, units²/Hz
    pub floor: f64,
}

/// Weight of what is lost of the signal against the noise that passes.
const BIAS: f64 = 100.0;

/// Relative size below which a spectrum is rounding, or the tolerance of forward kinematics (1e-12).
const ROUNDING: f64 = 1e-24;

/// Frequency that minimises the estimated mean square error of the acceleration: what passes of the
/// noise plus what is lost of the signal. `density` and `noise` are of the position at `frequency`.
fn least_error(frequency: &[f64], density: &[f64], noise: impl Fn(usize) -> f64) -> usize {
    let (mut sum, mut best, mut at) = (0.0, 0.0, 0);
    for k in 1..frequency.len() {
        let w4 = (2.0 * PI * frequency[k]).powi(4);
        sum += (2.0 * noise(k) - density[k]) * w4;
        if sum < best {
            best = sum;
            at = k;
        }
    }
    at.max(1)
}

/// Median of a spectrum between 0.3 and 0.45 of the rate, as the mean of the exponential distribution
/// that it is the median of.
fn noise_floor(f: &[f64], density: &[f64], rate: f64) -> f64 {
    let mut high: Vec<f64> = f
        .iter()
        .zip(density)
        .filter(|(f, _)| (0.3 * rate..0.45 * rate).contains(f))
        .map(|(_, d)| *d)
        .collect();
    if high.is_empty() {
        return 0.0;
    }
    let middle = high.len() / 2;
    *high.select_nth_unstable_by(middle, f64::total_cmp).1 / std::f64::consts::LN_2
}

/// Spectra of positions of one length, of which no more than so many windows are looked at.
pub struct Spectra {
    welch: Welch,
    rate: f64,
    /// what the difference does to each line
    gain: Vec<f64>,
}

impl Spectra {
    /// Of positions of `count` samples, with windows of `length`.
    pub fn new(count: usize, rate: f64, length: usize, windows: usize) -> Self {
        let welch = Welch::new(count.saturating_sub(1), length, windows);
        let gain = |f: f64| {
            let gain = 2.0 * (PI * f / rate).sin();
            (gain * gain).max(1e-300)
        };
        Spectra {
            gain: welch.frequencies(rate).into_iter().map(gain).collect(),
            welch,
            rate,
        }
    }

    /// A tenth of a hertz to resolve the motion, and at least four windows to average.
    pub fn fine(count: usize, rate: f64, windows: usize) -> Self {
        let length = ((10.0 * rate) as usize).clamp(64, (count / 2).max(64));
        Self::new(count, rate, length, windows)
    }

    /// A hertz, for the noise.
    pub fn coarse(count: usize, rate: f64, windows: usize) -> Self {
        let length = (rate as usize).clamp(64, (count / 2).max(64));
        Self::new(count, rate, length, windows)
    }

    /// Spectrum of a position, one-sided, units²/Hz: that of its first difference, which has no trend to
    /// leak, divided by the difference's own.
    pub fn of(&self, q: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let put = |start: usize, to: &mut [f64]| {
            let pairs = q[start..].windows(2);
            to.iter_mut().zip(pairs).for_each(|(d, q)| *d = q[1] - q[0]);
        };
        let (f, mut density) = self.welch.density(self.rate, put);
        density
            .iter_mut()
            .zip(&self.gain)
            .for_each(|(d, gain)| *d /= gain);
        density[0] = 0.0;
        (f, density)
    }

    /// Noise floor of a channel, units²/Hz: the median of its spectrum between 0.3 and 0.45 of the rate.
    pub fn floor(&self, q: &[f64]) -> f64 {
        let (f, density) = self.of(q);
        noise_floor(&f, &density, self.rate)
    }
}

/// Standard deviation of the velocity that white noise of this floor, units²/Hz, makes of positions that
/// are cut off at `frequency`: `2π √(S f³/3)`.
pub fn velocity_noise(floor: f64, frequency: f64) -> f64 {
    2.0 * PI * (floor * frequency.powi(3) / 3.0).sqrt()
}

/// Frequency below which 99.99 % of the power of the position's changes lies, Hz: the band of the
/// motion. A hundredth of the amplitude lies above it.
pub fn bandwidth(q: &[f64], rate: f64) -> f64 {
    let difference: Vec<f64> = q.windows(2).map(|w| w[1] - w[0]).collect();
    let length = ((20.0 * rate) as usize).clamp(64, difference.len().max(64));
    let (f, density) = welch(&difference, rate, length);
    let mut position: Vec<f64> = f
        .iter()
        .zip(&density)
        .map(|(f, d)| {
            let gain = 2.0 * (PI * f / rate).sin();
            if *f > 0.0 { d / (gain * gain) } else { 0.0 }
        })
        .collect();
    // noise is no motion
    let floor = 2.0 * noise_floor(&f, &position, rate);
    position
        .iter_mut()
        .for_each(|p| *p = if *p > floor { *p - floor } else { 0.0 });
    let total: f64 = position.iter().sum();
    let mut sum = 0.0;
    for (f, d) in f.iter().zip(&position) {
        sum += d;
        if *f > 0.0 && sum >= 0.9999 * total {
            return *f;
        }
    }
    0.5 * rate
}

/// Cut-off of a motion that does not repeat. The noise floor is the median of the spectrum between
/// 0.3 and 0.45 of the sampling rate, where the motion of a robot has nothing.
///
/// `order` is that of one pass of the Butterworth filter, whose gain `1/(1 + (f/f_c)^{2N})` decides what
/// passes. What is lost of the signal is the same in every sample and does not average out in the
/// estimate as noise does; it counts a hundredfold.
pub fn aperiodic(q: &[f64], spectra: &Spectra, order: usize) -> Cutoff {
    let rate = spectra.rate;
    let (f, density) = spectra.of(q);
    let largest = density.iter().cloned().fold(0.0, f64::max);
    let floor = noise_floor(&f, &density, rate).max(ROUNDING * largest);
    // a line of noise here and there is no signal: means over neighbours decide
    let mut sums = vec![0.0];
    for d in &density {
        sums.push(sums[sums.len() - 1] + d);
    }
    let smooth = |k: usize| {
        let wide = 3 + k / 16;
        let (a, b) = (
            k.saturating_sub(wide).max(1),
            (k + wide + 1).min(density.len()),
        );
        (sums[b] - sums[a]) / (b - a).max(1) as f64
    };
    let signal: Vec<f64> = (0..density.len())
        .map(|k| match k > 0 && smooth(k) > 2.0 * floor {
            true => (density[k] - floor).max(0.0),
            false => 0.0,
        })
        .collect();
    // grid of 16 cut-offs an octave, from the second bin to what was taken for noise
    let (low, high) = (f.get(2).copied().unwrap_or(0.0), 0.3 * rate);
    let mut best = (f64::INFINITY, high);
    let mut cutoff = high;
    // in units of the highest, so that no power is beyond what a number holds
    let power = |f: f64| (f / high).powi(2 * order as i32);
    let lines: Vec<[f64; 3]> = (f.iter().zip(&signal).skip(1))
        .map(|(f, signal)| [power(*f), f.powi(4) * floor, f.powi(4) * BIAS * signal])
        .collect();
    while cutoff > low && low > 0.0 {
        let own = power(cutoff);
        // gain c/(c + x) and what it leaves out, x/(c + x)
        let of = |[x, noise, signal]: &[f64; 3]| {
            let all = own + x;
            (own * own * noise + x * x * signal) / (all * all)
        };
        // partial sums need not wait for each other
        let mut sums = [0.0; 4];
        for four in lines.chunks(4) {
            let pairs = sums.iter_mut().zip(four);
            pairs.for_each(|(sum, line)| *sum += of(line));
        }
        let error: f64 = sums.iter().sum();
        if error < best.0 {
            best = (error, cutoff);
        }
        cutoff *= 0.5f64.powf(1.0 / 16.0);
    }
    Cutoff {
        frequency: best.1,
        floor,
    }
}

/// Cut-off of the mean of `periods` (each of `samples` positions, joined): the highest harmonic that
/// is kept. The noise of each harmonic is its scatter between the periods, smoothed over
/// neighbours.
pub fn periodic(periods: &[&[f64]], period: f64) -> (usize, Cutoff) {
    let n = periods.first().map_or(0, |p| p.len());
    let count = periods.len() as f64;
    let plan = Plan::new(n);
    let all: Vec<_> = periods.iter().map(|p| plan.spectrum(p.to_vec())).collect();
    let bins = n.div_ceil(2);
    let scale = 2.0 * period / (n as f64 * n as f64);
    let frequency: Vec<f64> = (0..bins).map(|k| k as f64 / period).collect();
    let mut density = vec![0.0; bins];
    let mut scatter = vec![0.0; bins];
    for k in 1..bins {
        let mean = all.iter().map(|s| s[k]).sum::<Complex64>() / count;
        density[k] = scale * mean.norm_sqr();
        // variance of the mean
        let spread: f64 = all.iter().map(|s| (s[k] - mean).norm_sqr()).sum();
        scatter[k] = scale * spread / ((count - 1.0).max(1.0) * count);
    }
    let largest = density.iter().cloned().fold(0.0, f64::max);
    let mut sums = vec![0.0; bins + 1];
    for k in 0..bins {
        sums[k + 1] = sums[k] + scatter[k];
    }
    let smooth = |k: usize| {
        let wide = 3 + k / 8;
        let (a, b) = (k.saturating_sub(wide).max(1), (k + wide + 1).min(bins));
        ((sums[b] - sums[a]) / (b - a).max(1) as f64).max(ROUNDING * largest)
    };
    let k = least_error(&frequency, &density, smooth);
    let cutoff = Cutoff {
        frequency: (k as f64 + 0.5) / period,
        floor: smooth(bins * 3 / 4),
    };
    (k, cutoff)
}
