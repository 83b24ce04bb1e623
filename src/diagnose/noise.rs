//! Noise of the measured torque, and the filters that make it white.
//!
//! The spectrum `S_τ(f)` of the noise of each actuator comes from the scatter between periods of a
//! repeating motion; slow changes (below `noise.slow`) count as a gap and not as noise, so the spectrum is
//! continued flat below. To it comes what the resolution of the positions leaves unknown of the
//! acceleration, `Σ_k M_jk² (2πf)⁴ S_q,k(f)`, but never more than the residual of the refitted model
//! shows. A linear predictor of that spectrum (Levinson-Durbin) whitens every signal and every column
//! alike, so that all tests count independent samples (Pintelon & Schoukens 2012, ch. 9).

use super::thresholds::THRESHOLDS as T;
use crate::signals::fourier::Plan;
use crate::signals::repeats::{freedoms, means};
use crate::signals::series::Series;
use std::f64::consts::PI;

/// Order of the whitening filters.
pub const ORDER: usize = T.noise.order;
/// Lines of a spectrum between 0 and half the sampling rate.
pub const LINES: usize = T.noise.lines;

/// One-sided power of a signal on [`LINES`]` + 1` lines, such that their mean is its variance.
pub fn spectrum(x: &[f64]) -> Vec<f64> {
    let n = 2 * LINES;
    let mut out = vec![0.0; LINES + 1];
    if x.len() < n {
        let power = x.iter().map(|v| v * v).sum::<f64>() / x.len().max(1) as f64;
        out.fill(power);
        return out;
    }
    let window: Vec<f64> = (0..n)
        .map(|i| (PI * (i as f64 + 0.5) / n as f64).sin())
        .collect();
    let plan = Plan::new(n);
    let segments = (x.len() - n) / (n / 2) + 1;
    for s in 0..segments {
        let piece: Vec<f64> = x[s * n / 2..][..n]
            .iter()
            .zip(&window)
            .map(|(a, w)| a * w)
            .collect();
        for (out, line) in out.iter_mut().zip(plan.spectrum(piece)) {
            *out += 2.0 * line.norm_sqr() / (n * segments) as f64;
        }
    }
    out
}

/// Residual with the mean over periods taken away, scaled to the variance of one sample, zero where
/// samples do not count; `None` where the record does not repeat.
pub fn between_periods(record: &Series, counted: &[bool], x: &[f64]) -> Option<Vec<f64>> {
    let cycle = record.cycle?;
    let periods = record.periods();
    let sound = counted.iter().filter(|c| **c).count();
    let scale = match sound == record.count {
        true => (periods as f64 / (periods - 1) as f64).sqrt(),
        false => (sound as f64 / freedoms(counted, cycle).max(1) as f64).sqrt(),
    };
    let mean = means(x, counted, cycle);
    let apart = |(i, v): (usize, &f64)| match (counted[i], mean[i % cycle]) {
        (true, Some(mean)) => scale * (v - mean),
        _ => 0.0,
    };
    Some(x.iter().enumerate().map(apart).collect())
}

/// Where the noise came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// repeated periods
    Periods,
    /// what the residual holds above the band of the motion
    HighBand,
}

/// Noise of one actuator for one sampling interval.
#[derive(Debug, Clone)]
pub struct Noise {
    /// spectrum of the torque noise alone
    pub torque: Vec<f64>,
    /// whitening filter `x_i − Σ a_k x_{i−k}`, divided by the innovation's deviation
    pub filter: Vec<f64>,
    /// standard deviation of the torque noise, N m
    pub std: f64,
    /// origin
    pub source: Source,
    /// whether there was next to none, and a share of the torque stands for it
    pub assumed: bool,
    /// power that unresolved acceleration adds, in units of the noise variance
    pub excess: f64,
}

/// Flat continuation below `noise.slow` of a spectrum of noise between periods.
fn flat_below(s: &mut [f64], dt: f64) {
    let of = |f: f64| ((f * 2.0 * dt) * LINES as f64).round() as usize;
    let (a, b) = (
        of(T.noise.slow).min(LINES),
        of(T.noise.level * T.noise.slow).clamp(2, LINES),
    );
    if a + 1 >= b {
        return;
    }
    let mut band = s[a..=b].to_vec();
    band.sort_by(f64::total_cmp);
    let level = band[band.len() / 2];
    for v in &mut s[..a] {
        *v = v.min(level).max(T.noise.flat * level);
    }
    // single lines that stand out are a disturbance with a frequency of its own
    for k in a..=LINES {
        let (lo, hi) = (
            k.saturating_sub(T.noise.about).max(a),
            (k + T.noise.about).min(LINES),
        );
        let mut near = s[lo..=hi].to_vec();
        near.sort_by(f64::total_cmp);
        let middle = near[near.len() / 2];
        if s[k] > T.noise.lone * middle {
            s[k] = middle;
        }
    }
}

impl Noise {
    /// From signals that hold nothing but noise, each with its number of measured samples:
    /// differences between periods, sampled every `dt` seconds.
    pub fn from_periods(parts: &[(Vec<f64>, usize)], dt: f64) -> Self {
        let mut s = vec![0.0; LINES + 1];
        let mut weight = 0.0;
        for (x, sound) in parts {
            for (s, v) in s.iter_mut().zip(spectrum(x)) {
                *s += v * x.len() as f64;
            }
            weight += *sound as f64;
        }
        s.iter_mut().for_each(|v| *v /= weight.max(1.0));
        flat_below(&mut s, dt);
        Self::new(s, Source::Periods)
    }

    /// No more than the robot file states: what is beyond is not noise but a gap that does not repeat.
    pub fn limit(&mut self, stated: Option<f64>) {
        let Some(stated) = stated.filter(|s| *s > 0.0 && self.std > T.noise.stated * s) else {
            return;
        };
        let scale = (stated / self.std).powi(2);
        self.torque.iter_mut().for_each(|v| *v *= scale);
        self.std = stated;
        self.filter = predictor(&self.torque);
    }

    /// White noise of `least`, N m or N, in its place where there is next to none, or, where `always`, less than that.
    pub fn at_least(&mut self, least: f64, always: bool) {
        let enough = if always { 1.0 } else { T.noise.none };
        if self.std >= enough * least || self.torque.is_empty() {
            return;
        }
        self.assumed = true;
        self.torque
            .iter_mut()
            .for_each(|v| *v = v.max(least * least));
        let power = self.torque.iter().sum::<f64>() / self.torque.len() as f64;
        self.std = power.sqrt();
        self.filter = predictor(&self.torque);
    }

    /// From a residual: its power above `band`, taken as flat below.
    pub fn from_residual(x: &[f64], dt: f64, band: f64) -> Self {
        let mut s = spectrum(x);
        let from = ((band * 2.0 * dt * LINES as f64).ceil() as usize).min(LINES - T.noise.last);
        let mut high = s[from..LINES].to_vec();
        high.sort_by(f64::total_cmp);
        let level = high[high.len() / 2];
        s[..from].fill(level);
        Self::new(s, Source::HighBand)
    }

    fn new(mut torque: Vec<f64>, source: Source) -> Self {
        let power = torque.iter().sum::<f64>() / torque.len() as f64;
        for v in &mut torque {
            *v = v.max(T.noise.least * power).max(1e-300);
        }
        let mut noise = Noise {
            std: power.sqrt(),
            filter: Vec::new(),
            torque,
            source,
            assumed: false,
            excess: 0.0,
        };
        noise.filter = predictor(&noise.torque);
        noise
    }

    /// Whitening filter for the noise and an excess on top of it.
    pub fn with_excess(&mut self, excess: &[f64]) {
        let s: Vec<f64> = self.torque.iter().zip(excess).map(|(a, b)| a + b).collect();
        self.filter = predictor(&s);
        self.excess = excess.iter().sum::<f64>() / excess.len() as f64 / self.std.powi(2);
    }

    /// A signal of one record, whitened; the first [`ORDER`] samples are zero.
    pub fn whiten(&self, x: &[f64], out: &mut Vec<f64>) {
        let skip = (self.filter.len() - 1).min(x.len());
        out.extend(std::iter::repeat_n(0.0, skip));
        // several sums side by side, each in the order of the filter
        const SIDE: usize = 16;
        let mut i = skip;
        while i + SIDE <= x.len() {
            let mut sums = [0.0; SIDE];
            for (k, f) in self.filter.iter().enumerate() {
                let from = &x[i - k..i - k + SIDE];
                for (sum, x) in sums.iter_mut().zip(from) {
                    *sum += f * x;
                }
            }
            out.extend_from_slice(&sums);
            i += SIDE;
        }
        for i in i..x.len() {
            let mut sum = 0.0;
            for (k, f) in self.filter.iter().enumerate() {
                sum += f * x[i - k];
            }
            out.push(sum);
        }
    }
}

impl Noise {
    /// Undoes [`Noise::whiten`] of one record (but for its first samples, which are taken as zero), in
    /// units of the noise's standard deviation.
    pub fn unwhiten(&self, e: &[f64], out: &mut Vec<f64>) {
        let at = out.len();
        for i in 0..e.len() {
            let mut sum = e[i];
            for k in 1..self.filter.len().min(i + 1) {
                sum -= self.filter[k] * out[at + i - k];
            }
            out.push(sum / self.filter[0]);
        }
        out[at..].iter_mut().for_each(|v| *v /= self.std);
    }
}

/// Levinson-Durbin recursion on the autocorrelation of a spectrum: `[1, −a_1, …]/σ`.
fn predictor(s: &[f64]) -> Vec<f64> {
    let n = s.len() - 1;
    let correlation: Vec<f64> = (0..=ORDER)
        .map(|lag| {
            (0..=n)
                .map(|l| {
                    let w = if l == 0 || l == n { 0.5 } else { 1.0 };
                    w * s[l] * (PI * (lag * l) as f64 / n as f64).cos()
                })
                .sum::<f64>()
                / n as f64
        })
        .collect();
    let mut a = vec![1.0];
    let mut error = correlation[0] * (1.0 + 1e-9);
    for m in 1..=ORDER {
        let k = -(0..m).map(|i| a[i] * correlation[m - i]).sum::<f64>() / error;
        a.push(0.0);
        let old = a.clone();
        for i in 1..=m {
            a[i] = old[i] + k * old[m - i];
        }
        error *= 1.0 - k * k;
    }
    let scale = 1.0 / error.max(1e-300).sqrt();
    a.iter().map(|v| v * scale).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coloured_noise_becomes_white() {
        use rand::{Rng, SeedableRng};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut x = vec![0.0; 20_000];
        for i in 1..x.len() {
            let e: f64 = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
            x[i] = 0.8 * x[i - 1] + e;
        }
        let noise = Noise::new(spectrum(&x), Source::Periods);
        let mut w = Vec::new();
        noise.whiten(&x, &mut w);
        let power =
            |lag: usize| w[lag..].iter().zip(&w).map(|(a, b)| a * b).sum::<f64>() / w.len() as f64;
        assert!((power(0) - 1.0).abs() < 0.05, "{}", power(0));
        assert!(power(1).abs() < 0.05 && power(2).abs() < 0.05);
        // variance of the process: 1/(1 − 0.64)
        assert!((noise.std - (1.0f64 / 0.36).sqrt()).abs() < 0.08);
    }
}
