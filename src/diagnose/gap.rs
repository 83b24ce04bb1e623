//! Is there a gap, and where: residuals against the noise floor, per actuator, frequency and state.
//!
//! With `P` periods `e_p(i)` of a residual, mean period `ē` and the variance `v` of one sample between
//! periods, the gap that repeats is `P Σ ē² − v N_cycle` (unbiased: negative terms are kept), and what does
//! not repeat is `(v − σ²)` beyond the noise. Where all joints move on odd harmonics of one period,
//! `½(ē(t) − ē(t + T/2))` is odd and `½(ē(t) + ē(t + T/2))` even about the home pose (Pintelon & Schoukens
//! 2012, ch. 4).

use super::data::Data;
use super::evidence::Evidence;
use super::noise::{LINES, between_periods, spectrum};
use super::thresholds::THRESHOLDS as T;
use crate::signals::series::Series;
use crate::signals::wiener::triangle;

/// Gap of one actuator in physical units.
#[derive(Debug, Clone, Default, serde::Serialize)]
#[non_exhaustive]
pub struct JointGap {
    /// name
    pub joint: String,
    /// rms of the residual above the noise, N m or N
    pub rms: f64,
    /// noise of one sample, N m or N
    pub noise: f64,
    /// share of the gap of the whole robot, weighted by noise
    pub share: f64,
    /// residual over measured torque, rms, both low-passed at about 20 Hz
    pub relative: f64,
}

/// How the gap divides.
#[derive(Debug, Clone, Copy, Default, serde::Serialize)]
pub struct Shares {
    /// odd under half a period, `None` where the motion is not odd
    pub odd: Option<f64>,
    /// even under half a period
    pub even: Option<f64>,
    /// not repeating; `None` without periods
    pub non_periodic: Option<f64>,
}

/// Residuals in units of the noise.
pub fn scaled(data: &Data, residual: &[Vec<f64>]) -> Vec<Vec<f64>> {
    residual
        .iter()
        .enumerate()
        .map(|(j, e)| e.iter().map(|v| v / data.noise[j].std).collect())
        .collect()
}

/// Energy of a whitened residual above the noise in one record of one actuator: what repeats, and
/// what does not. The residual is zero where nothing was measured or the actuator stood.
pub fn excess(record: &Series, j: usize, e: &[f64]) -> (f64, f64) {
    let [a, b, _] = parts(record, j, e);
    (a, b)
}

/// The same, and the variance of a row between periods (1 where nothing repeats).
fn parts(record: &Series, j: usize, e: &[f64]) -> [f64; 3] {
    let counted = record.counted(j);
    let sound = record.counts(j);
    let n = sound as f64;
    if sound == 0 {
        return [0.0, 0.0, 1.0];
    }
    let Some(cycle) = record.cycle else {
        let total: f64 = e.iter().map(|v| v * v).sum();
        return [(total - n).max(-T.measure.negative * n), 0.0, 1.0];
    };
    let periods = record.periods() as f64;
    let mean = record.period_mean(j, e);
    let between: f64 = e
        .iter()
        .enumerate()
        .filter(|(i, _)| counted[*i])
        .map(|(i, v)| (v - mean[i % cycle]).powi(2))
        .sum();
    let free = record.freedoms(j);
    let variance = between / free.max(1) as f64;
    // a phase of the period counts by how often it was measured
    let mut often = vec![0usize; cycle];
    for i in (0..e.len()).filter(|i| counted[*i]) {
        often[i % cycle] += 1;
    }
    let part = |(v, n): (&f64, &usize)| v * v * (*n as f64 / periods);
    let power: f64 = mean.iter().zip(&often).map(part).sum();
    let repeating = periods * power - variance * (sound - free) as f64;
    // slow changes stand out at the lowest lines; what is broad must exceed the noise clearly
    let slow = match between_periods(record, &counted, e) {
        Some(x) => {
            let s = spectrum(&x);
            let low =
                ((T.noise.slow * 2.0 * record.dt * LINES as f64) as usize).clamp(1, LINES / 4);
            let mut rest = s[low..].to_vec();
            rest.sort_by(f64::total_cmp);
            let level = rest[rest.len() / 2].max(1.0);
            let above: f64 = s[..low]
                .iter()
                .map(|v| (v - T.measure.slow * level).max(0.0))
                .sum();
            above / LINES as f64 * n * (periods - 1.0) / periods
        }
        None => 0.0,
    };
    let broad = (variance - T.measure.broad).max(0.0) * n;
    [repeating, slow.max(broad), variance]
}

/// Gap energy by actuator over the records that `pick` takes, in units of the noise variance; what
/// encoders cannot resolve is taken off.
pub fn energies(
    data: &Data,
    residual: &[Vec<f64>],
    pick: impl Fn(&Series) -> bool,
) -> Vec<[f64; 2]> {
    (0..data.joints())
        .map(|j| {
            let mut sum = [0.0; 2];
            for (k, r) in data.records.iter().enumerate() {
                if pick(r) {
                    let [a, b, variance] = parts(r, j, &residual[j][data.span(k)]);
                    let same = (data.noise[j].excess - data.differing(variance)).max(0.0);
                    sum[0] += a - same * r.counts(j) as f64;
                    sum[1] += b;
                }
            }
            sum
        })
        .collect()
}

/// Gap of each actuator from a residual in N m or N, and whitened: where it is counted on whitened rows, the torque of the same energy over
/// the noise.
pub fn joints(
    evidence: &Evidence,
    residual: &[Vec<f64>],
    whitened: &[Vec<f64>],
    pick: impl Fn(&Series) -> bool + Copy,
) -> Vec<JointGap> {
    let data = evidence.data;
    let names = data.plant.actuators();
    let mut out: Vec<JointGap> = (0..data.joints())
        .map(|j| {
            let (mut sum, mut count, mut torque, mut filtered) = (0.0, 0.0, 0.0, 0.0);
            let mut beyond = 0.0;
            for (k, r) in data.records.iter().enumerate().filter(|(_, r)| pick(r)) {
                let e = &residual[j][data.span(k)];
                sum += e.iter().map(|v| v * v).sum::<f64>();
                count += r.counts(j) as f64;
                beyond += evidence.beyond(j, &whitened[j], k);
                // relative errors below about 20 Hz, torque and residual filtered alike
                let w = ((T.measure.low_pass / r.dt).round() as usize).max(1);
                let low = |x: &[f64]| -> f64 { triangle(x, w).iter().map(|v| v * v).sum() };
                filtered += low(e);
                torque += low(&r.silenced(j, r.torque(j)));
            }
            let noise = data.noise[j].std;
            let count = f64::max(count, 1.0);
            let above = match data.counts_whitened(j) {
                true => noise * noise * beyond / count,
                false => sum / count - noise * noise * (1.0 + data.noise[j].excess),
            };
            JointGap {
                joint: names[j].name.clone(),
                rms: above.max(0.0).sqrt(),
                noise,
                share: 0.0,
                relative: (filtered / torque.max(1e-300)).sqrt(),
            }
        })
        .collect();
    let total: f64 = out.iter().map(|g| (g.rms / g.noise).powi(2)).sum();
    for g in &mut out {
        g.share = (g.rms / g.noise).powi(2) / total.max(1e-300);
    }
    out
}

/// Odd, even and non-periodic shares of a whitened residual over the fitted records.
pub fn shares(data: &Data, residual: &[Vec<f64>]) -> Shares {
    let (mut odd, mut even, mut other, mut repeating) = (0.0, 0.0, 0.0, 0.0);
    let (mut any, mut halves) = (false, 0.0);
    for (k, r) in data.records.iter().enumerate().filter(|(_, r)| r.fit) {
        let Some(cycle) = r.cycle else {
            continue;
        };
        any = true;
        let symmetric = is_odd(r);
        for (j, e) in residual.iter().enumerate() {
            let e = &e[data.span(k)];
            let (a, b) = excess(r, j, e);
            repeating += a.max(0.0);
            other += b;
            if symmetric {
                let mean = r.period_mean(j, e);
                let half = cycle / 2;
                // noise of the mean period, half of it in either part
                let periods = r.periods() as f64;
                let power = periods * mean.iter().map(|v| v * v).sum::<f64>();
                let noise = (power - a).max(0.0) / 2.0;
                let part = |sign: f64| -> f64 {
                    let sum: f64 = (0..cycle)
                        .map(|i| (0.5 * (mean[i] + sign * mean[(i + half) % cycle])).powi(2))
                        .sum();
                    periods * sum - noise
                };
                odd += part(-1.0).max(0.0);
                even += part(1.0).max(0.0);
                halves += a.max(0.0);
            }
        }
    }
    let total = repeating + other;
    if !any || total <= 0.0 {
        return Shares::default();
    }
    let within = (repeating / total) / (odd + even).max(1e-300);
    Shares {
        odd: (halves > 0.0).then_some(odd * within),
        even: (halves > 0.0).then_some(even * within),
        non_periodic: Some(other / total),
    }
}

/// Whether all coordinates move on odd harmonics of the period only.
pub fn is_odd(r: &Series) -> bool {
    let Some(cycle) = r.cycle else {
        return false;
    };
    if cycle % 2 != 0 {
        return false;
    }
    (0..r.actuators.dof).all(|j| {
        let (q, _) = r.state(j);
        let q = &q[..cycle];
        let home = q.iter().sum::<f64>() / cycle as f64;
        let power: f64 = q.iter().map(|v| (v - home).powi(2)).sum();
        let even: f64 = (0..cycle)
            .map(|i| (0.5 * (q[i] + q[(i + cycle / 2) % cycle]) - home).powi(2))
            .sum();
        even < T.measure.odd * power
    })
}

/// Share of the gap that a function of position and velocity of each actuator could explain: bins of
/// the state of a joint are filled from odd periods (or halves) and tried on even ones.
pub fn bound(data: &Data, residual: &[Vec<f64>]) -> Option<f64> {
    const BINS: usize = T.measure.bins;
    let (mut gap, mut left) = (0.0, 0.0);
    for (j, e) in residual.iter().enumerate() {
        let [lo, hi] = data.range[j];
        let top = data.speed[j];
        let bin = |q: f64, v: f64| -> usize {
            let a = ((q - lo) / (hi - lo).max(1e-12) * BINS as f64) as usize;
            // finer at low speed
            let s = v.signum() * (v.abs() / top).min(1.0).sqrt();
            let b = ((s + 1.0) / 2.0 * 2.0 * BINS as f64) as usize;
            a.min(BINS - 1) * 2 * BINS + b.min(2 * BINS - 1)
        };
        // one record trains, the others of the fit are predicted, and the other way round
        let mut sums = vec![[(0.0, 0.0); 2]; 2 * BINS * BINS];
        let part = |k: usize, i: usize, r: &Series| -> usize {
            let chunk = r.cycle.unwrap_or(r.count.div_ceil(T.measure.pieces));
            (i / chunk + k) % 2
        };
        for pass in 0..2 {
            for (k, r) in data.records.iter().enumerate().filter(|(_, r)| r.fit) {
                let (q, v) = r.state(j);
                let counted = r.counted(j);
                let rows = e[data.span(k)].iter().enumerate();
                for (i, x) in rows.filter(|(i, _)| counted[*i]) {
                    let side = part(k, i, r);
                    let b = bin(q[i], v[i]);
                    if pass == 0 {
                        sums[b][side].0 += x;
                        sums[b][side].1 += 1.0;
                    } else {
                        let (sum, count) = sums[b][1 - side];
                        let guess = sum / (count + T.measure.bin_prior);
                        gap += x * x - 1.0;
                        left += (x - guess).powi(2) - 1.0;
                    }
                }
            }
        }
    }
    (gap > T.measure.least * (data.fitted * data.joints()) as f64)
        .then(|| (1.0 - left / gap).clamp(0.0, 1.0))
}
