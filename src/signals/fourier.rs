//! Spectra of real signals, and differentiation of periodic ones. The transforms are those of `rustfft`.

use realfft::num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use std::f64::consts::PI;
use std::sync::{Arc, Mutex, PoisonError};

/// Plans of the lengths that were asked for last: to make one takes several times as long as to use it.
struct Lately<T: ?Sized>(Mutex<Vec<(usize, Arc<T>)>>);

/// So many are kept, of signals no longer than that.
const KEPT: (usize, usize) = (8, 1 << 18);

impl<T: ?Sized> Lately<T> {
    const fn new() -> Self {
        Lately(Mutex::new(Vec::new()))
    }

    /// The plan of a length, made where it is not among them.
    fn plan(&self, count: usize, make: fn(usize) -> Arc<T>) -> Arc<T> {
        let mine = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = |kept: &[(usize, Arc<T>)]| kept.iter().position(|k| k.0 == count);
        let mut kept = mine();
        if let Some(at) = found(&kept) {
            let last = kept.remove(at);
            kept.push(last.clone());
            return last.1;
        }
        drop(kept);
        let made = make(count);
        let mut kept = mine();
        if count <= KEPT.1 && found(&kept).is_none() {
            if kept.len() == KEPT.0 {
                kept.remove(0);
            }
            kept.push((count, made.clone()));
        }
        made
    }
}

static FORWARD: Lately<dyn RealToComplex<f64>> = Lately::new();
static BACK: Lately<dyn ComplexToReal<f64>> = Lately::new();

/// What transforms of signals of one length share. `None` for a signal without samples.
pub struct Plan(Option<Arc<dyn RealToComplex<f64>>>);

impl Plan {
    /// For signals of `count` samples, any number; O(N log N).
    pub fn new(count: usize) -> Plan {
        let make = |count| RealFftPlanner::new().plan_fft_forward(count);
        Plan((count > 0).then(|| FORWARD.plan(count, make)))
    }

    /// `X_k = Σ x_n e^{−2πi kn/N}` for `k = 0 … ⌊N/2⌋`; those above are the conjugates of these. The signal is used up.
    ///
    /// # Panics
    /// If it is not as long as planned.
    pub fn spectrum(&self, mut x: Vec<f64>) -> Vec<Complex64> {
        let mut room = self.room();
        self.spectrum_in(&mut x, &mut room);
        room.lines
    }

    /// What [`Plan::spectrum_in`] works in.
    fn room(&self) -> Room {
        let of = |make: fn(&Arc<dyn RealToComplex<f64>>) -> Vec<Complex64>| {
            self.0.as_ref().map_or(Vec::new(), make)
        };
        Room {
            lines: of(|f| f.make_output_vec()),
            scratch: of(|f| f.make_scratch_vec()),
        }
    }

    /// The lines of the spectrum of a signal, which is used up.
    fn spectrum_in(&self, x: &mut [f64], room: &mut Room) {
        if let Some(forward) = &self.0 {
            (forward.process_with_scratch(x, &mut room.lines, &mut room.scratch))
                .expect("signals are as long as their plan: the one error");
        }
    }
}

/// The largest length up to this one that transforms quickly: even, with no prime factor above 5; four fifths of it or more, from
/// four samples on.
pub fn quick(count: usize) -> usize {
    let smooth = |n: &usize| {
        let mut rest = *n;
        for prime in [2, 3, 5] {
            while rest.is_multiple_of(prime) {
                rest /= prime;
            }
        }
        rest == 1
    };
    let mut even = (2..=count).rev().filter(|n| n.is_multiple_of(2));
    even.find(smooth).unwrap_or(count)
}

/// Where a transform stands, and what it needs besides.
struct Room {
    lines: Vec<Complex64>,
    scratch: Vec<Complex64>,
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
        let make = |count| RealFftPlanner::new().plan_fft_inverse(count);
        Inverse((count > 0).then(|| BACK.plan(count, make)))
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
    derived(x, 2.0 * PI / period, highest, [0, 1, 2])
}

/// A signal of one period without the harmonics above `highest`.
pub fn low_passed(x: &[f64], highest: usize) -> Vec<f64> {
    let [one] = derived(x, 1.0, highest, [0]);
    one
}

/// Derivatives of these orders of a signal of one period, low-passed; `omega` is the rate of its first harmonic, rad/s.
fn derived<const N: usize>(
    x: &[f64],
    omega: f64,
    highest: usize,
    orders: [u32; N],
) -> [Vec<f64>; N] {
    let n = x.len();
    let mean = x.iter().sum::<f64>() / n.max(1) as f64;
    let full = spectrum(&x.iter().map(|v| v - mean).collect::<Vec<_>>());
    let kept = n.div_ceil(2).min(highest.saturating_add(1));
    let back = Inverse::new(n);
    orders.map(|order| {
        let mut y = vec![Complex64::ZERO; full.len()];
        for k in 1..kept {
            let rate = Complex64::new(0.0, omega * k as f64);
            y[k] = full[k] * rate.powu(order) / n as f64;
        }
        if order == 0 && n > 0 {
            y[0] = mean.into();
        }
        back.signal(y)
    })
}

/// Power spectral density (one-sided, units²/Hz) by Welch's method: Hann windows of `length`
/// samples that overlap by half, means removed. Returns frequencies and densities.
pub fn welch(x: &[f64], rate: f64, length: usize) -> (Vec<f64>, Vec<f64>) {
    let put = |start: usize, to: &mut [f64]| to.copy_from_slice(&x[start..start + to.len()]);
    Welch::new(x.len(), length, usize::MAX).density(rate, put)
}

/// What [`welch`] of signals of one length shares.
pub struct Welch {
    window: Vec<f64>,
    plan: Plan,
    /// first samples of the windows that are looked at
    starts: Vec<usize>,
}

impl Welch {
    /// Of signals of `samples`, with no more than so many windows, evenly spread.
    pub fn new(samples: usize, length: usize, most: usize) -> Welch {
        let n = length.min(samples).max(2);
        let step = (n / 2).max(1);
        let all = match samples >= n {
            true => (samples - n) / step + 1,
            false => 0,
        };
        let count = all.min(most.max(1));
        let hann = |i: usize| 0.5 - 0.5 * (2.0 * PI * i as f64 / n as f64).cos();
        Welch {
            window: (0..n).map(hann).collect(),
            plan: Plan::new(n),
            starts: (0..count).map(|k| k * all / count * step).collect(),
        }
    }

    /// Frequencies and densities of a signal; `put` writes its samples from the given one on.
    pub fn density(&self, rate: f64, put: impl Fn(usize, &mut [f64])) -> (Vec<f64>, Vec<f64>) {
        let n = self.window.len();
        let power: f64 = self.window.iter().map(|w| w * w).sum();
        let bins = n / 2 + 1;
        let mut sum = vec![0.0; bins];
        let mut room = self.plan.room();
        let mut part = vec![0.0; n];
        for start in &self.starts {
            put(*start, &mut part);
            let mean = part.iter().sum::<f64>() / n as f64;
            let each = part.iter_mut().zip(&self.window);
            each.for_each(|(v, w)| *v = (*v - mean) * w);
            self.plan.spectrum_in(&mut part, &mut room);
            for (s, c) in sum.iter_mut().zip(&room.lines) {
                *s += c.norm_sqr();
            }
        }
        let scale = 2.0 / (rate * power * self.starts.len().max(1) as f64);
        let density = sum.into_iter().map(|s| s * scale).collect();
        (self.frequencies(rate), density)
    }

    /// Frequencies of the lines.
    pub(super) fn frequencies(&self, rate: f64) -> Vec<f64> {
        let n = self.window.len();
        (0..n / 2 + 1).map(|k| k as f64 * rate / n as f64).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quick_lengths_are_near_and_have_small_factors() {
        for count in 4..20_000 {
            let n = quick(count);
            assert!(
                n <= count && 5 * n >= 4 * count && n.is_multiple_of(2),
                "{count}"
            );
            let rest = [2, 3, 5].into_iter().fold(n, |mut n, prime| {
                while n.is_multiple_of(prime) {
                    n /= prime;
                }
                n
            });
            assert_eq!(rest, 1, "{count}");
        }
        assert_eq!([0, 1, 2, 3].map(quick), [0, 1, 2, 2]);
    }
}
