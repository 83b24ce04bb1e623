//! Magnitudes over all time: samples, halved where a bound of the curvature leaves too much between them.

use super::fourier::Fourier;
use super::jets::Jet;
use crate::error::Result;

/// Part of the period between two samples.
#[derive(Clone, Copy)]
struct Interval {
    start: f64,
    width: f64,
    /// indices of the samples at its ends
    ends: [usize; 2],
    /// index of the segment it came from, whose curvature holds in it
    segment: usize,
}

/// The largest magnitude of a quantity.
pub(super) struct Enclosed {
    /// at a sample
    pub highest: f64,
    /// when, s
    pub time: f64,
    /// it exceeds `highest` by no more than this
    pub between: f64,
    /// samples taken
    pub samples: usize,
}

/// Encloses the magnitudes of quantities that `take` writes at a time: on an interval of width `h` a quantity
/// obeys `|y| ≤ max(|y_i|, |y_{i+1}|) + (h²/8) sup |ÿ|`, also where `y` is the norm of a vector. `curvature`
/// bounds `|ÿ|` on a stretch of time. Intervals where that could exceed the largest sample by more than `target`
/// (of the largest samples) are halved, the most excessive first, until `samples` are spent.
///
/// # Errors
/// Those of `take`.
pub(super) fn enclose(
    trajectory: &Fourier,
    samples: usize,
    mut take: impl FnMut(f64, &mut [f64]) -> Result<()>,
    mut curvature: impl FnMut(&Motion, f64, f64) -> Vec<f64>,
    target: &dyn Fn(&[f64]) -> Vec<f64>,
) -> Result<Vec<Enclosed>> {
    let segments = (8 * trajectory.harmonic_max() as usize)
        .clamp(64, 1024)
        .min(samples.max(1));
    let width = trajectory.period / segments as f64;
    let motion = Motion::new(trajectory);
    let mut curved = Vec::new();
    for segment in 0..segments {
        curved.push(curvature(&motion, segment as f64 * width, width));
    }
    let n = curved.first().map_or(0, Vec::len);
    let (mut highest, mut when) = (vec![0.0_f64; n], vec![0.0; n]);
    let mut taken: Vec<f64> = Vec::new();
    let mut sample = |t: f64, taken: &mut Vec<f64>| -> Result<usize> {
        let at = taken.len();
        taken.resize(at + n, 0.0);
        take(t, &mut taken[at..])?;
        for (j, value) in taken[at..].iter_mut().enumerate() {
            *value = value.abs();
            if *value > highest[j] {
                (highest[j], when[j]) = (*value, t);
            }
        }
        Ok(at / n.max(1))
    };
    let mut open = Vec::with_capacity(segments);
    for segment in 0..segments {
        let start = segment as f64 * width;
        sample(start, &mut taken)?;
        open.push(Interval {
            start,
            width,
            ends: [segment, (segment + 1) % segments],
            segment,
        });
    }
    // the sup of what intervals already closed could hold
    let mut settled = vec![0.0_f64; n];
    loop {
        let best: Vec<f64> = (0..n)
            .map(|j| taken.iter().skip(j).step_by(n).copied().fold(0.0, f64::max))
            .collect();
        let target = target(&best);
        let above = |interval: &Interval, j: usize| {
            let [a, b] = interval.ends;
            let sag = interval.width * interval.width / 8.0 * curved[interval.segment][j];
            taken[a * n + j].max(taken[b * n + j]) + sag
        };
        // by how many targets the worst bound exceeds its largest sample
        let mut ranked: Vec<(f64, Interval)> = open
            .drain(..)
            .map(|interval| {
                let excess = (0..n)
                    .map(|j| (above(&interval, j) - best[j]) / target[j])
                    .map(|e| if e.is_nan() { 0.0 } else { e })
                    .fold(f64::NEG_INFINITY, f64::max);
                (excess, interval)
            })
            .collect();
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.start.total_cmp(&b.1.start)));
        let wanted = ranked
            .iter()
            .take_while(|(excess, _)| *excess > 1.0)
            .count();
        let halved = wanted.min(samples.saturating_sub(taken.len() / n.max(1)));
        for (_, interval) in &ranked[halved..] {
            for (j, sup) in settled.iter_mut().enumerate() {
                *sup = sup.max(above(interval, j));
            }
        }
        if halved == 0 {
            break;
        }
        for (_, interval) in &ranked[..halved] {
            let half = 0.5 * interval.width;
            let middle = sample(interval.start + half, &mut taken)?;
            let [a, b] = interval.ends;
            open.push(Interval {
                width: half,
                ends: [a, middle],
                ..*interval
            });
            open.push(Interval {
                start: interval.start + half,
                width: half,
                ends: [middle, b],
                ..*interval
            });
        }
    }
    let samples = taken.len() / n.max(1);
    let each = highest.into_iter().zip(when).zip(settled);
    Ok(each
        .map(|((highest, time), settled)| Enclosed {
            highest,
            time,
            between: (settled - highest).max(0.0),
            samples,
        })
        .collect())
}

/// Orders of the derivatives whose amplitudes are summed: two more than a jet has.
const SUMS: usize = 8;

/// A motion, and bounds of its derivatives on intervals of time.
pub(super) struct Motion<'a> {
    trajectory: &'a Fourier,
    /// `Σ_h (hω)ᵏ A_h` of every joint (without the constant)
    sums: Vec<[f64; SUMS]>,
}

impl<'a> Motion<'a> {
    fn new(trajectory: &'a Fourier) -> Self {
        let omega = trajectory.omega();
        let sums = trajectory
            .joints
            .iter()
            .map(|s| {
                std::array::from_fn(|k| {
                    s.amplitude_sum(&trajectory.harmonics, omega, k as u32) * (1.0 + 1e-9)
                })
            })
            .collect();
        Motion { trajectory, sums }
    }

    /// Jets of all coordinates on an interval, by Taylor about its centre `m`, half width `r`:
    /// `|q⁽ᵏ⁾| ≤ |q⁽ᵏ⁾(m)| + r |q⁽ᵏ⁺¹⁾(m)| + ½ r² sup |q⁽ᵏ⁺²⁾|`.
    pub fn on(&self, start: f64, width: f64) -> Vec<Jet> {
        let n = self.trajectory.dof();
        let (r, mut d) = (0.5 * width, vec![0.0; 7 * n]);
        let mut rows = d.chunks_exact_mut(n);
        let mut row = || rows.next().unwrap_or_default();
        let all = [row(), row(), row(), row(), row(), row(), row()];
        self.trajectory.evaluate(start + r, all);
        (0..n)
            .map(|j| {
                let sums = &self.sums[j];
                std::array::from_fn(|k| {
                    let at = |order: usize| d[order * n + j].abs();
                    let local = at(k) + r * at(k + 1) + 0.5 * r * r * sums[k + 2];
                    let shift = if k == 0 {
                        self.trajectory.joints[j].constant.abs()
                    } else {
                        0.0
                    };
                    local.min(sums[k] + shift) + 1e-12 * (sums[k] + shift)
                })
            })
            .collect()
    }
}
