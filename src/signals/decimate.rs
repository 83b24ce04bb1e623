//! The filter that torque and regressor pass alike: low-pass and decimation in one.
//!
//! `W φ = τ` stays true when the same linear filter is applied to every column of `W` and to `τ`
//! ("parallel filtering", Gautier 1997). The filter is a windowed sinc of odd length (Kaiser window,
//! 80 dB), symmetric and therefore without phase: the gain is one half at the cut-off, flat up to
//! half of it and below 10⁻⁴ from one and a half times it, which is where the decimated rate folds. Of
//! its outputs only every `factor`-th is computed, and only those whose whole support was measured
//! count, so that neither ends nor gaps leave a trace.

use super::inner::{AT_ONCE, Inner};
use std::f64::consts::PI;

/// Low-pass and decimation.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Decimator {
    /// gain one half, Hz; infinite for none
    pub cutoff: f64,
    /// every so many-th output is kept
    pub factor: usize,
    /// weights of the middle and of the neighbours to one side; sums to 1 over both
    taps: Vec<f64>,
    /// the same over both sides, in order
    #[serde(skip)]
    kernel: Vec<f64>,
    /// inputs that the outputs stand at
    at: Vec<usize>,
    /// whether the signal repeats
    cyclic: bool,
    /// number of inputs
    count: usize,
}

/// Modified Bessel function of order 0.
fn bessel(x: f64) -> f64 {
    let (mut term, mut sum, mut k) = (1.0, 1.0, 1.0);
    while term > 1e-17 * sum {
        term *= (0.5 * x / k) * (0.5 * x / k);
        sum += term;
        k += 1.0;
    }
    sum
}

impl Decimator {
    /// For signals with so many samples at this rate, of which `valid` were measured; `cyclic`
    /// where the last is followed by the first. An infinite `cutoff` passes everything, and then
    /// `factor` is 1.
    pub fn new(cutoff: f64, rate: f64, valid: &[bool], cyclic: bool) -> Self {
        Self::with_stride(cutoff, rate, valid, cyclic, 1).0
    }

    /// The same with outputs that lie `k` strides apart, for as long a stride of no more than `most` samples as keeps `k`
    /// times it near `factor`. Beside it the stride.
    pub fn with_stride(
        cutoff: f64,
        rate: f64,
        valid: &[bool],
        cyclic: bool,
        most: usize,
    ) -> (Self, usize) {
        let count = valid.len();
        let fraction = cutoff / rate;
        let all = fraction.is_nan() || fraction >= 0.3 || count == 0;
        let (factor, stride, taps) = match all {
            true => (1, 1, vec![1.0]),
            false => {
                let factor = ((1.0 / (3.0 * fraction)).floor() as usize).max(1);
                let strides = factor.div_ceil(most.max(1));
                let stride = factor / strides;
                (strides * stride, stride, kaiser(fraction, count, cyclic))
            }
        };
        let reach = taps.len() - 1;
        let kernel = both_sides(&taps);
        // sound samples before each, to see at once whether a whole support is
        let mut sound = Vec::with_capacity(count + 1);
        sound.push(0usize);
        for v in valid {
            sound.push(sound[sound.len() - 1] + usize::from(*v));
        }
        let whole = |from: isize, to: isize| -> bool {
            let n = count as isize;
            let range =
                |a: isize, b: isize| sound[b as usize] - sound[a as usize] == (b - a) as usize;
            if from >= 0 && to <= n {
                return range(from, to);
            }
            if !cyclic {
                return false;
            }
            let (low, high) = (from.max(0), to.min(n));
            range(low, high)
                && (from >= 0 || range((n + from).max(0), n))
                && (to <= n || range(0, (to - n).min(n)))
        };
        let at = (0..count)
            .step_by(factor)
            .filter(|&i| whole(i as isize - reach as isize, (i + reach + 1) as isize))
            .collect();
        let filter = Decimator {
            cutoff: if all { f64::INFINITY } else { cutoff },
            factor,
            taps,
            kernel,
            at,
            cyclic,
            count,
        };
        (filter, stride)
    }

    /// The same filter over every `stride`-th sample, from the first on: what it makes of signals that have nothing beyond
    /// half of their rate differs by what its stop band lets pass (80 dB). `None` where the outputs do not stand at such samples,
    /// or the signal repeats.
    pub fn over_every(&self, stride: usize) -> Option<Decimator> {
        if self.cyclic || stride < 2 || !self.factor.is_multiple_of(stride) {
            return None;
        }
        let mut taps: Vec<f64> = self.taps.iter().step_by(stride).copied().collect();
        normalise(&mut taps);
        Some(Decimator {
            cutoff: self.cutoff,
            factor: self.factor / stride,
            kernel: both_sides(&taps),
            taps,
            at: self.at.iter().map(|i| i / stride).collect(),
            cyclic: false,
            count: self.count.div_ceil(stride),
        })
    }

    /// Inputs at which the outputs stand.
    pub fn at(&self) -> &[usize] {
        &self.at
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.at.len()
    }

    /// Inputs to each side that an output depends on.
    pub fn reach(&self) -> usize {
        self.taps.len() - 1
    }

    /// Correlation of the outputs `k` steps apart for white noise at the input.
    pub fn correlation(&self, k: usize) -> f64 {
        let (m, lag) = (self.reach() as isize, (k * self.factor) as isize);
        let tap = |i: isize| match i.unsigned_abs() <= m as usize {
            true => self.taps[i.unsigned_abs()],
            false => 0.0,
        };
        let sum = |lag: isize| (-m..=m).map(|i| tap(i) * tap(i + lag)).sum::<f64>();
        sum(lag) / sum(0)
    }

    /// Filters a signal of `count` samples into `out`, which has [`Decimator::outputs`].
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn apply_into(&self, x: &[f64], out: &mut [f64]) {
        assert!(
            x.len() == self.count && out.len() == self.at.len(),
            "lengths of signal and filter"
        );
        let (m, n) = (self.reach(), x.len());
        let from = self.at.partition_point(|i| *i < m);
        let to = self.at.partition_point(|i| i + m < n).max(from);
        if from < to {
            self.apply_part(&x[self.at[from] - m..], from..to, &mut out[from..to]);
        }
        // the ends are there only where the signal repeats
        for k in (0..from).chain(to..out.len()) {
            let i = self.at[k];
            let wrapped = |k: usize| x[(i + n * (m / n + 1) + k - m) % n];
            let products = self.kernel.iter().enumerate();
            out[k] = products.map(|(k, w)| w * wrapped(k)).sum();
        }
    }

    /// Inputs that the outputs of this range depend on, in order (wrapped, where the signal repeats).
    pub fn inputs(&self, range: std::ops::Range<usize>) -> Vec<usize> {
        if range.is_empty() {
            return Vec::new();
        }
        let (n, m) = (self.count as isize, self.reach() as isize);
        let (first, last) = (
            self.at[range.start] as isize,
            self.at[range.end - 1] as isize,
        );
        (first - m..=last + m)
            .map(|i| i.rem_euclid(n) as usize)
            .collect()
    }

    /// Outputs of a range from the part of the signal that [`Decimator::inputs`] names.
    ///
    /// # Panics
    /// If the lengths do not fit.
    pub fn apply_part(&self, x: &[f64], range: std::ops::Range<usize>, out: &mut [f64]) {
        let Some(&first) = self.at.get(range.start) else {
            return;
        };
        let length = self.kernel.len();
        let inner = Inner::new();
        let part = |i: usize| &x[i - first..i - first + length];
        let at = self.at[range].chunks(AT_ONCE);
        for (y, at) in out.chunks_mut(AT_ONCE).zip(at) {
            match *at {
                [a, b, c, d] => y.copy_from_slice(
                    &inner.four(&self.kernel, [part(a), part(b), part(c), part(d)]),
                ),
                _ => y
                    .iter_mut()
                    .zip(at)
                    .for_each(|(y, &i)| *y = inner.one(&self.kernel, part(i))),
            }
        }
    }

    /// Filters a signal.
    ///
    /// # Panics
    /// If its length is not that of the filter.
    pub fn apply(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.at.len()];
        self.apply_into(x, &mut out);
        out
    }

    /// Whether an output may lie above `level` for a signal of ones where `one` says so, and zeros: whether as many ones as
    /// that takes lie so near to each other.
    pub(crate) fn may_exceed(&self, one: &[bool], level: f64) -> bool {
        let mut largest = self.kernel.clone();
        largest.sort_unstable_by(|a, b| b.total_cmp(a));
        let mut sum = 0.0;
        let enough = largest.iter().position(|w| {
            sum += w;
            // sums in another order are rounded otherwise
            sum > level * (1.0 - 1e-9)
        });
        let Some(fewer) = enough else { return false };
        let ones: Vec<usize> = (0..one.len()).filter(|i| one[*i]).collect();
        match self.cyclic {
            true => ones.len() > fewer,
            false => (ones.windows(fewer + 1)).any(|w| w[fewer] - w[0] < self.kernel.len()),
        }
    }

    /// Whether the signal repeats.
    pub fn cyclic(&self) -> bool {
        self.cyclic
    }
}

/// Half of a Kaiser-windowed sinc with its cut-off at this fraction of the rate.
fn kaiser(fraction: f64, count: usize, cyclic: bool) -> Vec<f64> {
    // 80 dB over a transition as wide as the cut-off
    const BETA: f64 = 0.1102 * (80.0 - 8.7);
    let wanted = ((80.0 - 8.0) / (2.285 * 2.0 * PI * fraction) / 2.0).ceil() as usize;
    let most = if cyclic { count } else { count / 4 };
    let m = wanted.min(most).max(1);
    let mut taps: Vec<f64> = (0..=m)
        .map(|k| {
            let x = k as f64 / m as f64;
            let sinc = match k {
                0 => 2.0 * fraction,
                _ => (2.0 * PI * fraction * k as f64).sin() / (PI * k as f64),
            };
            sinc * bessel(BETA * (1.0 - x * x).max(0.0).sqrt()) / bessel(BETA)
        })
        .collect();
    normalise(&mut taps);
    taps
}

/// Makes the gain at zero frequency 1, of half a kernel.
fn normalise(taps: &mut [f64]) {
    let sum = taps[0] + 2.0 * taps[1..].iter().sum::<f64>();
    taps.iter_mut().for_each(|t| *t /= sum);
}

/// A kernel from its half.
fn both_sides(taps: &[f64]) -> Vec<f64> {
    taps.iter().skip(1).rev().chain(taps).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// No output that lies above the level is passed over, and few runs of ones are looked at for nothing.
    #[test]
    fn outputs_above_a_level_are_expected() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let (mut above, mut spared) = (0, 0);
        for case in 0..300 {
            let (n, cyclic) = (2000, case % 3 == 0);
            let filter = Decimator::new(rng.random_range(1.0..10.0), 250.0, &vec![true; n], cyclic);
            let mut one = vec![false; n];
            for _ in 0..rng.random_range(0..6) {
                let from = rng.random_range(0..n);
                let to = (from + rng.random_range(1..60)).min(n);
                one[from..to].fill(true);
            }
            let signal: Vec<f64> = one.iter().map(|o| f64::from(*o)).collect();
            let level = [0.5, 0.3, 0.9][case % 3];
            let highest = filter.apply(&signal).into_iter().fold(0.0, f64::max);
            let expected = filter.may_exceed(&one, level);
            assert!(expected || highest <= level, "case {case}: {highest}");
            above += usize::from(highest > level);
            spared += usize::from(!expected);
        }
        assert!(above > 60 && spared > 60, "{above} above, {spared} spared");
    }
}
