//! Positions limited to a band, with their derivatives.
//!
//! Where the motion repeats, position, velocity and acceleration are one Fourier series over all
//! periods, `q(t) = Σ_h c_h e^{i h ω t}`, each line weighted by `max(0, 1 − σ²/|c_h|²)` (Wiener)
//! with the noise `σ²` of the scatter between periods, or of the encoder's steps where a motion that
//! repeats exactly hides them in every period alike. Differentiation is exact and needs no
//! filter. Otherwise the positions pass a zero-phase low-pass and central differences.

use super::cutoff::Spectra;
use super::fourier::{Inverse, Plan, low_passed};
use super::repeats::scatter;
use crate::dynamics::Samples;
use std::f64::consts::PI;

/// Highest frequency of the Fourier series of a repeating motion, Hz.
pub const BAND: f64 = 30.0;

/// About where the low-pass of a motion that does not repeat cuts off, Hz.
pub const SMOOTH: f64 = 12.0;

/// Share of the power of the acceleration that is noise, from which on an encoder is coarse: 4 % of its amplitude.
const COARSE: f64 = 2e-3;

/// Lines of a spectrum in a row that noise alone does not lift together.
const LINES: usize = 3;

/// Stretch of a record that its spectrum is averaged over, s.
const STRETCH: f64 = 2.0;

/// Fourier series of the mean period, with its derivatives, over the whole record. `steps` are
/// the variances of the encoders' steps by actuator.
fn periodic(
    q: &[f64],
    steps: &[f64],
    count: usize,
    (cycle, free): (usize, usize),
    dt: f64,
) -> Differentiated {
    let n = steps.len();
    let periods = count / cycle;
    let period = cycle as f64 * dt;
    let omega = 2.0 * PI / period;
    let lines = lines(cycle, dt);
    let variance = scatter(q, n, count, cycle, free);
    let mut out = Samples::zeros(n, count);
    let mut band: f64 = 0.0;
    let turn: Vec<(f64, f64)> = (0..cycle)
        .map(|i| (2.0 * PI * i as f64 / cycle as f64).sin_cos())
        .collect();
    for j in 0..n {
        let row = &q[j * count..(j + 1) * count];
        let mean = mean_period(row, cycle);
        let mut one = [vec![0.0; cycle], vec![0.0; cycle], vec![0.0; cycle]];
        let centre = mean.iter().sum::<f64>() / cycle as f64;
        one[0].fill(centre);
        // variance of a complex line of the mean period; the part of the steps that does not scatter
        // is the same in every period
        let hidden = (steps[j] - variance[j]).max(0.0);
        let floor = variance[j] / count as f64 + hidden / cycle as f64;
        for h in 1..=lines {
            let (mut re, mut im) = (0.0, 0.0);
            for (i, x) in mean.iter().enumerate() {
                let (s, c) = turn[i * h % cycle];
                re += x * c;
                im -= x * s;
            }
            re /= cycle as f64;
            im /= cycle as f64;
            let power = re * re + im * im;
            let weight = 1.0 - floor / power.max(1e-300);
            if weight <= 0.0 {
                continue;
            }
            if power > 12.0 * floor {
                band = band.max(h as f64 / period);
            }
            let (a, b) = (2.0 * weight * re, -2.0 * weight * im); // a cos + b sin
            let w = h as f64 * omega;
            for i in 0..cycle {
                let (s, c) = turn[i * h % cycle];
                one[0][i] += a * c + b * s;
                one[1][i] += w * (b * c - a * s);
                one[2][i] -= w * w * (a * c + b * s);
            }
        }
        for (to, from) in [&mut out.q, &mut out.qd, &mut out.qdd]
            .into_iter()
            .zip(&one)
        {
            for p in 0..periods {
                to[j * count + p * cycle..][..cycle].copy_from_slice(from);
            }
        }
    }
    let noise = variance
        .iter()
        .zip(steps)
        .map(|(v, s)| v.max(*s).sqrt())
        .collect();
    // what a motion that repeats leaves of the steps no filter takes
    let rows = q.chunks(count.max(1)).zip(steps);
    let coarse = rows.map(|(row, s)| *s > 0.0 && Filter::of(row, *s, dt).is_some());
    Differentiated {
        motion: out,
        noise,
        band,
        coarse: coarse.collect(),
        filters: Vec::new(),
    }
}

/// A motion limited to a band, and what is known of the positions that it comes from.
pub struct Differentiated {
    /// positions, velocities, accelerations
    pub motion: Samples,
    /// standard deviation of a position, by row
    pub noise: Vec<f64>,
    /// highest frequency with motion in it, Hz; 0 where none stands out
    pub band: f64,
    /// whether the encoder is coarse, by row
    pub coarse: Vec<bool>,
    /// what the positions of coarse encoders passed, by row; empty where the motion repeats
    pub filters: Vec<Option<Filter>>,
}

/// A signal limited to the band of the positions: the mean period up to [`BAND`] where the motion
/// repeats, low-passed as they are otherwise.
pub fn limited(x: &[f64], cycle: Option<usize>, dt: f64) -> Vec<f64> {
    let cycles = cycle.map(|c| (c, c * (x.len() / c - 1)));
    differentiated(x, &[0.0], x.len(), cycles, dt).motion.q
}

/// What follows from a motion that [`differentiated`] has limited to its band, limited likewise: the mean period up to
/// [`BAND`] where the motion repeats, low-passed otherwise.
pub fn likewise(x: &[f64], cycle: Option<usize>, dt: f64) -> Vec<f64> {
    let Some(cycle) = cycle else {
        return low_pass(x, half_width(dt));
    };
    let one = low_passed(&mean_period(x, cycle), lines(cycle, dt));
    one.iter().copied().cycle().take(x.len()).collect()
}

/// Mean of the whole periods of a signal.
fn mean_period(x: &[f64], cycle: usize) -> Vec<f64> {
    let periods = x.len() / cycle;
    (0..cycle)
        .map(|i| (0..periods).map(|p| x[p * cycle + i]).sum::<f64>() / periods as f64)
        .collect()
}

/// Harmonics of a motion of this period that are looked at.
fn lines(cycle: usize, dt: f64) -> usize {
    ((BAND * cycle as f64 * dt) as usize)
        .min(cycle / 2 - 1)
        .max(1)
}

/// Positions limited to a band, with their derivatives, noise and band: by Fourier series where the
/// motion repeats (`cycles`: samples of a period, and freedoms of the scatter between periods), by a
/// low-pass otherwise.
pub fn differentiated(
    q: &[f64],
    steps: &[f64],
    count: usize,
    cycles: Option<(usize, usize)>,
    dt: f64,
) -> Differentiated {
    match cycles {
        Some(cycles) => periodic(q, steps, count, cycles, dt),
        None => smooth(q, steps, count, dt),
    }
}

/// Half-width, samples, of the triangle that positions pass twice: about 12 Hz.
pub fn half_width(dt: f64) -> usize {
    ((0.022 / dt).round() as usize).max(1)
}

/// Low-passed positions and their central differences.
fn smooth(q: &[f64], steps: &[f64], count: usize, dt: f64) -> Differentiated {
    let n = steps.len();
    let mut out = Samples::zeros(n, count);
    let mut noise = Vec::new();
    let half = half_width(dt);
    let mut filters = Vec::new();
    for j in 0..n {
        let row = &q[j * count..(j + 1) * count];
        let variance = variance(row, steps[j]);
        noise.push(variance.sqrt());
        let filter = match steps[j] > 0.0 {
            true => Filter::of(row, variance, dt),
            false => None,
        };
        let clean = match &filter {
            Some(filter) => filter.pass(row),
            None => low_pass(row, half),
        };
        filters.push(filter);
        let velocity = difference(&clean, dt);
        let acceleration = difference(&velocity, dt);
        out.q[j * count..(j + 1) * count].copy_from_slice(&clean);
        out.qd[j * count..(j + 1) * count].copy_from_slice(&velocity);
        out.qdd[j * count..(j + 1) * count].copy_from_slice(&acceleration);
    }
    Differentiated {
        motion: out,
        noise,
        band: SMOOTH,
        coarse: filters.iter().map(Option::is_some).collect(),
        filters,
    }
}

/// What the positions of a coarse encoder pass: every line of their spectrum `S(f)` weighted by `max(0, 1 − S_n/S(f))`
/// (Wiener) with the density `S_n = 2 σ² Δ` of white noise of the variance `σ²`, then the low-pass of every motion that
/// does not repeat.
#[derive(Debug, Clone)]
pub struct Filter {
    /// weights of lines from 0 to half the sampling rate, the same distance apart
    weight: Vec<f64>,
    /// that distance over the sampling rate
    apart: f64,
    /// half-width of the triangles of the low-pass, samples
    half: usize,
}

impl Filter {
    /// For positions that noise of this variance is on, sampled every `dt` seconds; `None` where the
    /// noise is a small part of the acceleration that the low-pass leaves.
    pub fn of(q: &[f64], variance: f64, dt: f64) -> Option<Filter> {
        let count = q.len();
        let length = ((STRETCH / dt) as usize).clamp(64, (count / 2).max(64));
        let (f, density) = Spectra::new(q.len(), 1.0 / dt, length, usize::MAX).of(q);
        let noise = 2.0 * variance * dt;
        let of = |k: usize| (1.0 - noise / density[k].max(1e-300)).max(0.0);
        // the first line is that of the trend
        let weight: Vec<f64> = (0..f.len())
            .map(|k| if k == 0 { 1.0 } else { of(k) })
            .collect();
        let half = half_width(dt);
        // power of the acceleration that the low-pass leaves: of the noise, and of all
        let left = |k: usize| response(f[k] * dt, half).powi(2) * f[k].powi(4);
        let power =
            |of: &dyn Fn(usize) -> f64| -> f64 { (1..f.len()).map(|k| left(k) * of(k)).sum() };
        let share = power(&|_| noise) / power(&|k| density[k]).max(1e-300);
        (share > COARSE).then_some(Filter {
            weight,
            apart: f[1] * dt,
            half,
        })
    }

    /// Samples over which an end of a record is felt: one and a half turns of the frequency from which on less than half passes.
    pub fn reach(&self) -> usize {
        let stops = |w: &[f64]| w.iter().all(|w| *w < 0.5);
        let first = self.weight.windows(LINES).position(stops);
        let first = first.unwrap_or(self.weight.len()).max(1);
        (1.5 / (first as f64 * self.apart)).ceil() as usize
    }

    /// What is left of the amplitude at a frequency, over the sampling rate.
    pub fn gain(&self, frequency: f64) -> f64 {
        self.weight(frequency) * response(frequency, self.half)
    }

    /// The weight at a frequency, over the sampling rate.
    fn weight(&self, frequency: f64) -> f64 {
        let at = frequency / self.apart;
        let (low, part) = (at.floor() as usize, at.fract());
        let of = |k: usize| self.weight[k.min(self.weight.len() - 1)];
        (1.0 - part) * of(low) + part * of(low + 1)
    }

    /// A signal of the same rate, passed. It is continued by its reflection in either end.
    pub fn pass(&self, x: &[f64]) -> Vec<f64> {
        let count = x.len();
        if count < 3 {
            return x.to_vec();
        }
        // odd about both ends: neither the signal nor its slope jumps there
        let slope = (x[count - 1] - x[0]) / (count - 1) as f64;
        let level = |i: usize| x[0] + slope * i as f64;
        let mut odd: Vec<f64> = (0..count).map(|i| x[i] - level(i)).collect();
        odd.extend((1..count - 1).rev().map(|i| level(i) - x[i]));
        let whole = odd.len();
        let mut lines = Plan::new(whole).spectrum(odd);
        for (k, line) in lines.iter_mut().enumerate() {
            *line *= self.weight(k as f64 / whole as f64) / whole as f64;
        }
        let back = Inverse::new(whole).signal(lines);
        let kept: Vec<f64> = (0..count).map(|i| level(i) + back[i]).collect();
        low_pass(&kept, self.half)
    }
}

/// What [`low_pass`] leaves of the amplitude at a frequency, over the sampling rate.
fn response(frequency: f64, half: usize) -> f64 {
    let (x, half) = (PI * frequency, half as f64);
    // a triangle is two boxes
    let once = match x.sin() == 0.0 {
        true => 1.0,
        false => ((half * x).sin() / (half * x.sin())).powi(2),
    };
    (2.0 * once - once * once).powi(2)
}

/// A low-pass without phase: moving averages shrink curvature; doing it twice and adding the difference back undoes the
/// leading term (Kaiser & Hamming 1977).
fn low_pass(x: &[f64], half: usize) -> Vec<f64> {
    let sharpen = |x: &[f64]| -> Vec<f64> {
        let once = triangle(x, half);
        let twice = triangle(&once, half);
        once.iter().zip(&twice).map(|(a, b)| 2.0 * a - b).collect()
    };
    sharpen(&sharpen(x))
}

/// Variance of the noise on positions, from their third differences, and no less than that of the encoder's steps.
fn variance(q: &[f64], steps: f64) -> f64 {
    let rough = q
        .windows(4)
        .map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).powi(2))
        .sum::<f64>()
        / (20.0 * q.len() as f64);
    rough.max(steps)
}

fn difference(x: &[f64], dt: f64) -> Vec<f64> {
    let last = x.len() - 1;
    (0..=last)
        .map(|i| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
            (x[b] - x[a]) / ((b - a) as f64 * dt)
        })
        .collect()
}

/// Triangular moving average of half-width `w` samples: two running sums of `w` samples, with zeros outside of the signal, over
/// what the triangle has within it.
pub fn triangle(x: &[f64], w: usize) -> Vec<f64> {
    let n = x.len();
    // sums over `i + 1 − w ..= i` for every `i` that a triangle about a sample needs
    let mut sum = 0.0;
    let sums: Vec<f64> = (0..n + w - 1)
        .map(|i| {
            sum += x.get(i).copied().unwrap_or(0.0);
            if i >= w {
                sum -= x[i - w];
            }
            sum
        })
        .collect();
    let mut total: f64 = sums[..w - 1].iter().sum();
    (0..n)
        .map(|i| {
            total += sums[i + w - 1];
            let mean = total / weight(i.min(w - 1), (n - 1 - i).min(w - 1), w);
            total -= sums[i];
            mean
        })
        .collect()
}

/// Sum of the weights of a triangle of half-width `w` with so many samples before its middle, and so many after it.
fn weight(before: usize, after: usize, w: usize) -> f64 {
    let side = |k: usize| k * w - k * (k + 1) / 2;
    (w + side(before) + side(after)) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_response_of_the_low_pass_is_what_it_leaves_of_a_sine() {
        for half in [1, 5, 11] {
            for frequency in [0.004, 0.02, 0.05] {
                let x: Vec<f64> = (0..2000)
                    .map(|i| (2.0 * PI * frequency * i as f64).sin())
                    .collect();
                let y = low_pass(&x, half);
                let (mut with, mut own) = (0.0, 0.0);
                for i in 200..1800 {
                    with += x[i] * y[i];
                    own += x[i] * x[i];
                }
                let left = response(frequency, half);
                assert!(
                    (with / own - left).abs() < 1e-9,
                    "{half} {frequency}: {left}"
                );
            }
        }
    }

    #[test]
    fn a_triangle_is_the_weighted_mean_of_what_it_meets() {
        let x: Vec<f64> = (0..60).map(|i| ((i * i) as f64 * 0.37).sin()).collect();
        for (n, w) in [(1, 1), (1, 4), (5, 9), (60, 1), (60, 7), (60, 22)] {
            let mean = triangle(&x[..n], w);
            for (i, mean) in mean.iter().enumerate() {
                let of = |k: usize| (w as f64 - i.abs_diff(k) as f64).max(0.0);
                let all: f64 = (0..n).map(of).sum();
                let sum: f64 = (0..n).map(|k| of(k) * x[k]).sum();
                assert!((mean - sum / all).abs() < 1e-13, "{n} {w} {i}");
            }
        }
    }

    /// A motion that is cut out of a longer one: accelerations near its ends are wrong, and farther in they are not.
    #[test]
    fn an_end_is_felt_as_far_as_is_said() {
        let (dt, count, tick) = (0.004, 2000, 2.0 * PI / 4096.0);
        let lines = [(0.35, 0.5, 0.3), (0.85, 0.2, 1.1), (1.6, 0.06, 2.3)];
        let of = |i: usize, power: i32| -> f64 {
            let line = |(f, a, phase): &(f64, f64, f64)| {
                let w = 2.0 * PI * f;
                a * w.powi(power) * (w * dt * i as f64 + phase).sin()
            };
            lines.iter().map(line).sum()
        };
        let q: Vec<f64> = (0..count)
            .map(|i| (of(i, 0) / tick).round() * tick)
            .collect();
        let filter = Filter::of(&q, tick * tick / 12.0, dt).unwrap();
        let found = difference(&difference(&filter.pass(&q), dt), dt);
        let error = |i: usize| (found[i] + of(i, 2)).powi(2);
        let rms = |rows: std::ops::Range<usize>| {
            (rows.clone().map(error).sum::<f64>() / rows.len() as f64).sqrt()
        };
        let reach = filter.reach();
        assert!((20..250).contains(&reach), "{reach}");
        let middle = rms(800..1200);
        for [ends, within] in [
            [0..reach, reach..2 * reach],
            [count - reach..count, count - 2 * reach..count - reach],
        ] {
            assert!(
                rms(within.clone()) < 3.0 * middle,
                "{} {middle}",
                rms(within)
            );
            assert!(rms(ends.clone()) > 5.0 * middle, "{} {middle}", rms(ends));
        }
    }

    #[test]
    fn coarse_steps_are_filtered_and_fine_ones_are_not() {
        let dt = 0.002;
        let smooth: Vec<f64> = (0..8000)
            .map(|i| (2.0 * PI * 0.4 * dt * i as f64).sin())
            .collect();
        let stepped =
            |tick: f64| -> Vec<f64> { smooth.iter().map(|q| (q / tick).round() * tick).collect() };
        let of = |tick: f64| Filter::of(&stepped(tick), tick * tick / 12.0, dt);
        assert!(of(2.0 * PI / 1e6).is_none());
        assert!(of(2.0 * PI / 4096.0).is_some());
    }
}
