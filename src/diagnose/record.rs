//! Records made ready: a uniform time grid, the motion with its derivatives, the noise of the
//! positions.
//!
//! Where the motion repeats, position, velocity and acceleration are one Fourier series over all
//! periods, `q(t) = Σ_h c_h e^{i h ω t}`, each line weighted by `max(0, 1 − σ²/|c_h|²)` (Wiener)
//! with the noise `σ²` of the scatter between periods, or of the encoder's steps where a motion that
//! repeats exactly hides them in every period alike. Differentiation is exact and needs no
//! filter; what the encoder cannot resolve is left out and counted as noise of the torque (see
//! [`noise`](super::noise)). Otherwise the positions pass a zero-phase low-pass and central
//! differences.

use crate::dynamics::Samples;
use crate::error::Result;
use crate::plant::Plant;
use std::f64::consts::PI;

/// Highest frequency of the Fourier series of a repeating motion, Hz.
pub const BAND: f64 = 30.0;

/// A log as it was read: joint-major arrays of `count` samples.
#[derive(Debug, Clone, Default)]
pub struct Raw {
    /// name, for messages and the report
    pub name: String,
    /// whether it is fitted to, or only predicted
    pub fit: bool,
    /// period of the motion, s, where it repeats
    pub period: Option<f64>,
    /// time stamps, s
    pub t: Vec<f64>,
    /// actuator positions, one column each
    pub q: Vec<Vec<f64>>,
    /// actuator torques, one column each
    pub tau: Vec<Vec<f64>>,
    /// commanded positions of the actuators, one column each, where they were logged
    pub qref: Option<Vec<Vec<f64>>>,
}

/// A record on a uniform grid with its motion.
#[derive(Debug, Clone)]
pub struct Record {
    /// name
    pub name: String,
    /// whether it is fitted to
    pub fit: bool,
    /// sampling interval, s
    pub dt: f64,
    /// samples
    pub count: usize,
    /// samples of a period, where the motion repeats
    pub cycle: Option<usize>,
    /// motion of the coordinates
    pub x: Samples,
    /// motion of the actuators (the same for a serial robot)
    pub actuators: Samples,
    /// commanded motion of the actuators, where it was logged
    pub reference: Option<Samples>,
    /// measured torque, actuator-major
    pub tau: Vec<f64>,
    /// standard deviation of a measured position, by actuator
    pub position_noise: Vec<f64>,
    /// highest frequency with motion in it, Hz
    pub band: f64,
    /// place in the experiment file
    pub order: usize,
    /// remarks for the report
    pub remarks: Vec<String>,
}

impl Record {
    /// Whole periods in the record (1 where it does not repeat).
    pub fn periods(&self) -> usize {
        self.cycle.map_or(1, |c| self.count / c)
    }

    /// Torque of one actuator.
    pub fn torque(&self, j: usize) -> &[f64] {
        &self.tau[j * self.count..(j + 1) * self.count]
    }

    /// Position and velocity of one actuator.
    pub fn state(&self, j: usize) -> (&[f64], &[f64]) {
        let row = j * self.count..(j + 1) * self.count;
        (&self.actuators.q[row.clone()], &self.actuators.qd[row])
    }

    /// Acceleration of one actuator.
    pub fn acceleration(&self, j: usize) -> &[f64] {
        &self.actuators.qdd[j * self.count..(j + 1) * self.count]
    }

    /// Brings a raw log onto its grid. `likely` are periods of other records, tried where it states
    /// none.
    ///
    /// # Errors
    /// A record that is too short, or poses of a parallel robot that cannot be reached.
    pub fn prepare(plant: &Plant, raw: &Raw, likely: &[f64]) -> Result<Self> {
        let n = plant.actuators().len();
        let mut remarks = Vec::new();
        let total = raw.t.len();
        let span = raw.t[total - 1] - raw.t[0];
        let mean = span / (total - 1) as f64;
        // a repeating record is cut to whole periods on a grid that divides the period
        let period = raw.period.or_else(|| {
            let found = likely.iter().copied().find(|p| repeats(raw, mean, *p));
            if found.is_some() {
                remarks.push("it repeats with the period of another record".to_string());
            }
            found
        });
        let (dt, count, cycle) = match period {
            Some(period)
                if span + 1.5 * mean >= period
                    && period >= 4.0 * mean
                    && thinned(period, mean) >= 4 =>
            {
                let whole = ((span + 1.5 * mean) / period).floor().max(1.0) as usize;
                let per = thinned(period, mean);
                (period / per as f64, whole * per, Some(per))
            }
            _ => {
                let mut step = mean;
                while 1.0 / step > 600.0 {
                    step *= 2.0;
                }
                (step, (span / step).floor() as usize + 1, None)
            }
        };
        let cycle = cycle.filter(|c| count / c >= 2);
        let grid = |columns: &[Vec<f64>], stamped: bool| -> Vec<f64> {
            let mut out = Vec::with_capacity(n * count);
            for column in columns.iter().take(n) {
                out.extend(resample(&raw.t, column, mean, dt, count, stamped));
            }
            out
        };
        // stamps may jitter about a clock that did not: what repeats better is believed
        let regular = raw
            .t
            .iter()
            .enumerate()
            .all(|(i, t)| (t - raw.t[0] - i as f64 * mean).abs() < 0.5 * mean);
        let mut q = grid(&raw.q, true);
        let mut stamped = true;
        if regular {
            let by_clock = grid(&raw.q, false);
            let roughness = |x: &[f64]| match cycle {
                Some(c) => scatter(x, n, count, c).iter().sum::<f64>(),
                None => third_difference(x, n, count),
            };
            if roughness(&by_clock) < roughness(&q) {
                (q, stamped) = (by_clock, false);
                remarks.push(
                    "time stamps jitter about a regular clock; the clock is used".to_string(),
                );
            }
        }
        let tau = grid(&raw.tau, stamped);
        let steps: Vec<f64> = plant
            .actuators()
            .iter()
            .zip(&raw.q)
            .map(|(joint, q)| {
                joint
                    .position_resolution
                    .unwrap_or_else(|| lattice(q))
                    .powi(2)
                    / 12.0
            })
            .collect();
        let (motion, position_noise, band) = differentiated(&q, &steps, count, cycle, dt);
        let reference = raw.qref.as_ref().map(|columns| {
            let exact = vec![0.0; n];
            differentiated(&grid(columns, stamped), &exact, count, cycle, dt).0
        });
        let x = super::closed::coordinates(plant, &motion, cycle)?;
        let actuators = motion;
        Ok(Record {
            name: raw.name.clone(),
            fit: raw.fit,
            dt,
            count,
            cycle,
            x,
            actuators,
            reference,
            tau,
            position_noise,
            band,
            order: 0,
            remarks,
        })
    }
}

/// Samples of a period at intervals of `mean` or multiples of it: far above the band nothing is learnt
/// from more of them.
fn thinned(period: f64, mean: f64) -> usize {
    let mut per = (period / mean).round() as usize;
    while per as f64 / period > 600.0 {
        per /= 2;
    }
    per
}

/// Whether a record repeats after `period`: at least two of them, and the positions one period
/// apart differ by less than a thousandth of their range.
fn repeats(raw: &Raw, mean: f64, period: f64) -> bool {
    let lag = (period / mean).round() as usize;
    let n = raw.t.len();
    if lag == 0 || lag > n || 2 * lag > n + lag / 10 {
        return false;
    }
    raw.q.iter().all(|q| {
        let (lo, hi) = q
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                (a.min(*v), b.max(*v))
            });
        let apart: f64 = (0..n - lag).map(|i| (q[i + lag] - q[i]).powi(2)).sum();
        (apart / (n - lag) as f64).sqrt() < 1e-3 * (hi - lo).max(1e-9)
    })
}

/// A column at `count` times `0, dt, …` after the first stamp: by its stamps, or by its number
/// times the mean interval. Where the grid is coarser than the samples, they are averaged over a
/// triangle first.
fn resample(t: &[f64], x: &[f64], mean: f64, dt: f64, count: usize, stamped: bool) -> Vec<f64> {
    let coarse = (dt / mean).round() as usize;
    let filtered: Vec<f64>;
    let x = if coarse > 1 {
        filtered = triangle(x, coarse);
        &filtered
    } else {
        x
    };
    let last = x.len() - 1;
    let mut k = 0;
    (0..count)
        .map(|i| {
            let at = i as f64 * dt;
            let (lo, w) = if stamped {
                while k + 1 < last && t[k + 1] - t[0] <= at {
                    k += 1;
                }
                let step = t[k + 1] - t[k];
                (k, (at - (t[k] - t[0])) / step)
            } else {
                let lo = ((at / mean + 1e-9) as usize).min(last - 1);
                (lo, at / mean - lo as f64)
            };
            let w = if w.abs() < 1e-6 { 0.0 } else { w };
            // cubic where there are neighbours on both sides
            if lo >= 1 && lo + 2 <= last && w != 0.0 {
                let (a, b, c, d) = (x[lo - 1], x[lo], x[lo + 1], x[lo + 2]);
                let h = w.clamp(-0.5, 1.5);
                b + 0.5
                    * h
                    * (c - a + h * (2.0 * a - 5.0 * b + 4.0 * c - d + h * (3.0 * (b - c) + d - a)))
            } else {
                x[lo] + w.clamp(-1.0, 2.0) * (x[lo + 1] - x[lo])
            }
        })
        .collect()
}

/// Triangular moving average of half-width `w` samples.
pub(crate) fn triangle(x: &[f64], w: usize) -> Vec<f64> {
    let n = x.len() as isize;
    let w = w as isize;
    (0..n)
        .map(|i| {
            let (mut sum, mut weight) = (0.0, 0.0);
            for k in 1 - w..w {
                if (0..n).contains(&(i + k)) {
                    let f = (w - k.abs()) as f64;
                    sum += f * x[(i + k) as usize];
                    weight += f;
                }
            }
            sum / weight
        })
        .collect()
}

/// Variance between periods by actuator: an estimate of the variance of one sample.
pub fn scatter(x: &[f64], n: usize, count: usize, cycle: usize) -> Vec<f64> {
    let periods = count / cycle;
    (0..n)
        .map(|j| {
            let row = &x[j * count..(j + 1) * count];
            let mut sum = 0.0;
            for i in 0..cycle {
                let mean = (0..periods).map(|p| row[p * cycle + i]).sum::<f64>() / periods as f64;
                sum += (0..periods)
                    .map(|p| (row[p * cycle + i] - mean).powi(2))
                    .sum::<f64>();
            }
            sum / (cycle * (periods - 1)) as f64
        })
        .collect()
}

fn third_difference(x: &[f64], n: usize, count: usize) -> f64 {
    (0..n)
        .map(|j| {
            x[j * count..(j + 1) * count]
                .windows(4)
                .map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).powi(2))
                .sum::<f64>()
        })
        .sum()
}

/// Step of a channel whose values are whole multiples of it; 0 where they are not.
fn lattice(x: &[f64]) -> f64 {
    let moves = || x.windows(2).map(|w| (w[1] - w[0]).abs());
    let step = moves().filter(|d| *d > 1e-12).fold(f64::INFINITY, f64::min);
    let off = |d: f64| (d / step - (d / step).round()).abs();
    match step.is_finite() && moves().all(|d| off(d) < 0.1) {
        true => step,
        false => 0.0,
    }
}

/// Fourier series of the mean period, with its derivatives, over the whole record. `steps` are
/// the variances of the encoders' steps by actuator.
fn periodic(
    q: &[f64],
    steps: &[f64],
    count: usize,
    cycle: usize,
    dt: f64,
) -> (Samples, Vec<f64>, f64) {
    let n = steps.len();
    let periods = count / cycle;
    let period = cycle as f64 * dt;
    let omega = 2.0 * PI / period;
    let lines = ((BAND * period) as usize).min(cycle / 2 - 1).max(1);
    let variance = scatter(q, n, count, cycle);
    let mut out = Samples::zeros(n, count);
    let mut band: f64 = 0.0;
    let turn: Vec<(f64, f64)> = (0..cycle)
        .map(|i| (2.0 * PI * i as f64 / cycle as f64).sin_cos())
        .collect();
    for j in 0..n {
        let row = &q[j * count..(j + 1) * count];
        let mean: Vec<f64> = (0..cycle)
            .map(|i| (0..periods).map(|p| row[p * cycle + i]).sum::<f64>() / periods as f64)
            .collect();
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
    (out, noise, band)
}

/// A signal limited to the band of the positions: the mean period up to [`BAND`] where the motion
/// repeats, low-passed as they are otherwise.
pub(super) fn limited(x: &[f64], cycle: Option<usize>, dt: f64) -> Vec<f64> {
    differentiated(x, &[0.0], x.len(), cycle, dt).0.q
}

/// Positions limited to a band, with their derivatives, noise and band: by Fourier series where the
/// motion repeats, by a low-pass otherwise.
fn differentiated(
    q: &[f64],
    steps: &[f64],
    count: usize,
    cycle: Option<usize>,
    dt: f64,
) -> (Samples, Vec<f64>, f64) {
    match cycle {
        Some(cycle) => periodic(q, steps, count, cycle, dt),
        None => smooth(q, steps, count, dt),
    }
}

/// Low-passed positions and their central differences.
fn smooth(q: &[f64], steps: &[f64], count: usize, dt: f64) -> (Samples, Vec<f64>, f64) {
    let n = steps.len();
    let mut out = Samples::zeros(n, count);
    let mut noise = Vec::new();
    // half-width of a triangle applied twice: about 12 Hz
    let half = ((0.022 / dt).round() as usize).max(1);
    for j in 0..n {
        let row = &q[j * count..(j + 1) * count];
        // moving averages shrink curvature; doing it twice and adding the difference back undoes
        // the leading term (Kaiser & Hamming 1977)
        let sharpen = |x: &[f64]| -> Vec<f64> {
            let once = triangle(x, half);
            let twice = triangle(&once, half);
            once.iter().zip(&twice).map(|(a, b)| 2.0 * a - b).collect()
        };
        let clean = sharpen(&sharpen(row));
        let velocity = difference(&clean, dt);
        let acceleration = difference(&velocity, dt);
        let rough: f64 = row
            .windows(4)
            .map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).powi(2))
            .sum::<f64>()
            / (20.0 * row.len() as f64);
        noise.push(rough.max(steps[j]).sqrt());
        out.q[j * count..(j + 1) * count].copy_from_slice(&clean);
        out.qd[j * count..(j + 1) * count].copy_from_slice(&velocity);
        out.qdd[j * count..(j + 1) * count].copy_from_slice(&acceleration);
    }
    (out, noise, 12.0)
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
