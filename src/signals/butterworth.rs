//! Zero-phase Butterworth low-pass in second-order sections.
//!
//! The analog prototype `|H(jω)|² = 1/(1 + (ω/ω_c)^{2N})` goes through the bilinear transform with
//! the cut-off pre-warped (Oppenheim & Schafer, ch. 7). A transfer function of order 8 at 0.5 Hz of
//! 1 kHz cannot be written in double precision; second-order sections can. Forward and backward
//! filtering doubles the order and cancels the phase (Gustafsson 1996); the ends are continued by
//! the record turned about its end points, and the states start as for a constant input, as
//! `scipy.signal.sosfiltfilt` does. At the cut-off the gain of both passes is one half.

use crate::dynamics::lanes::Isa;
use crate::error::{Error, Result};
use rayon::prelude::*;

/// `y = (b0 + b1 z⁻¹ + b2 z⁻²)/(1 + a1 z⁻¹ + a2 z⁻²) x`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

/// A low-pass filter.
#[derive(Debug, Clone, PartialEq)]
pub struct Butterworth {
    sections: Vec<Section>,
    order: usize,
}

impl Butterworth {
    /// Low-pass of this order (of one pass) with this cut-off, for this sampling rate, Hz.
    ///
    /// # Errors
    /// An order that is not 1..=16, a cut-off that is not between 0 and half the rate.
    pub fn low_pass(order: usize, cutoff: f64, rate: f64) -> Result<Self> {
        if !(1..=16).contains(&order) {
            return Err(Error::Argument(format!(
                "a Butterworth filter of order {order}: orders 1 to 16 are possible"
            )));
        }
        if !(cutoff > 0.0 && cutoff < 0.5 * rate) {
            return Err(Error::Argument(format!(
                "a cut-off of {cutoff} Hz: it must lie between 0 and half the sampling rate of {rate} Hz"
            )));
        }
        // in units of twice the rate
        let w = (std::f64::consts::PI * cutoff / rate).tan();
        let mut sections = Vec::with_capacity(order.div_ceil(2));
        for k in 0..order / 2 {
            // pole pair at angle θ from the negative real axis: s² + 2 cos θ w s + w²
            let theta = std::f64::consts::PI * (2 * k + 1) as f64 / (2 * order) as f64;
            let damping = 2.0 * theta.sin() * w;
            let a0 = 1.0 + damping + w * w;
            sections.push(Section {
                b: [w * w / a0, 2.0 * w * w / a0, w * w / a0],
                a: [2.0 * (w * w - 1.0) / a0, (1.0 - damping + w * w) / a0],
            });
        }
        if order % 2 == 1 {
            let a0 = 1.0 + w;
            sections.push(Section {
                b: [w / a0, w / a0, 0.0],
                a: [(w - 1.0) / a0, 0.0],
            });
        }
        Ok(Butterworth { sections, order })
    }

    /// Length of the continuation that SciPy uses by default.
    pub fn default_pad(&self) -> usize {
        3 * (2 * self.sections.len() + 1 - self.order % 2)
    }

    /// One pass in place, `back` from the end to the beginning, starting in the steady state of a constant input: the first
    /// sample.
    fn pass(&self, x: &mut [f64], back: bool) {
        let first = if back { x.last() } else { x.first() };
        let Some(&x0) = first else { return };
        match self.sections[..] {
            // the usual number, one after the other at each sample
            [a, b] => pass([a, b], &mut [a, b].map(|s| s.steady(x0)), x, back),
            _ => (self.sections.iter()).for_each(|s| pass([*s], &mut [s.steady(x0)], x, back)),
        }
    }

    /// A signal with its ends continued by `pad` samples (less where it is shorter), and by how many.
    fn continued(x: &[f64], pad: usize) -> (Vec<f64>, usize) {
        let n = x.len();
        let pad = pad.min(n - 1);
        let mut y = Vec::with_capacity(n + 2 * pad);
        y.extend((1..=pad).rev().map(|i| 2.0 * x[0] - x[i]));
        y.extend_from_slice(x);
        y.extend((1..=pad).map(|i| 2.0 * x[n - 1] - x[n - 1 - i]));
        (y, pad)
    }

    /// Both passes, with the ends continued by `pad` samples (less where the record is shorter).
    pub fn zero_phase(&self, x: &[f64], pad: usize) -> Vec<f64> {
        if x.len() < 2 {
            return x.to_vec();
        }
        let (mut y, pad) = Self::continued(x, pad);
        self.pass(&mut y, false);
        self.pass(&mut y, true);
        y.truncate(pad + x.len());
        y.drain(..pad);
        y
    }
}

impl Section {
    /// State after an input that has been `x0` for ever: gain 1 at zero frequency, so that every section sees the same.
    fn steady(&self, x0: f64) -> [f64; 2] {
        let z2 = (self.b[2] - self.a[1]) * x0;
        [(self.b[1] - self.a[0]) * x0 + z2, z2]
    }
}

/// A sample passes all of these sections before the next one does.
fn pass<const N: usize>(
    sections: [Section; N],
    states: &mut [[f64; 2]; N],
    x: &mut [f64],
    back: bool,
) {
    let mut take = |v: &mut f64| {
        for (z, Section { b, a }) in states.iter_mut().zip(&sections) {
            let y = b[0] * *v + z[0];
            z[0] = b[1] * *v - a[0] * y + z[1];
            z[1] = b[2] * *v - a[1] * y;
            *v = y;
        }
    };
    match back {
        false => x.iter_mut().for_each(&mut take),
        true => x.iter_mut().rev().for_each(&mut take),
    }
}

/// [`pass`] of `W` signals, each with filters of its own: while one waits for its products, the others go on.
#[inline(always)]
fn side_by_side<const W: usize>(sections: [[Section; 2]; W], mut x: [&mut [f64]; W], back: bool) {
    let shared = x.iter().map(|x| x.len()).min().unwrap_or(0);
    let mut states: [[[f64; 2]; 2]; W] = std::array::from_fn(|l| {
        let first = if back { x[l].last() } else { x[l].first() };
        sections[l].map(|s| s.steady(first.copied().unwrap_or(0.0)))
    });
    let mut rests: [&mut [f64]; W] = std::array::from_fn(|_| &mut [][..]);
    let mut parts: [&mut [f64]; W] = std::array::from_fn(|_| &mut [][..]);
    for l in 0..W {
        let all = std::mem::take(&mut x[l]);
        let at = if back { all.len() - shared } else { shared };
        let (first, second) = all.split_at_mut(at);
        (parts[l], rests[l]) = if back {
            (second, first)
        } else {
            (first, second)
        };
    }
    // section by section, and in each of them signal by signal
    let b: [[[f64; W]; 3]; 2] = std::array::from_fn(|s| {
        std::array::from_fn(|k| std::array::from_fn(|l| sections[l][s].b[k]))
    });
    let a: [[[f64; W]; 2]; 2] = std::array::from_fn(|s| {
        std::array::from_fn(|k| std::array::from_fn(|l| sections[l][s].a[k]))
    });
    let mut z: [[[f64; W]; 2]; 2] =
        std::array::from_fn(|s| std::array::from_fn(|k| std::array::from_fn(|l| states[l][s][k])));
    for i in 0..shared {
        let at = if back { shared - 1 - i } else { i };
        let mut v: [f64; W] = std::array::from_fn(|l| parts[l][at]);
        for s in 0..2 {
            for l in 0..W {
                let y = b[s][0][l] * v[l] + z[s][0][l];
                z[s][0][l] = b[s][1][l] * v[l] - a[s][0][l] * y + z[s][1][l];
                z[s][1][l] = b[s][2][l] * v[l] - a[s][1][l] * y;
                v[l] = y;
            }
        }
        for l in 0..W {
            parts[l][at] = v[l];
        }
    }
    for (l, rest) in rests.into_iter().enumerate() {
        states[l] = std::array::from_fn(|s| [z[s][0][l], z[s][1][l]]);
        pass(sections[l], &mut states[l], rest, back);
    }
}

/// [`side_by_side`] with the widest instructions of this machine; signals without a filter of their own have the first one.
fn together<'a, const W: usize>(
    isa: Isa,
    filters: &[[Section; 2]],
    mut all: impl Iterator<Item = &'a mut [f64]>,
    back: bool,
) {
    let sections = std::array::from_fn(|l| *filters.get(l).unwrap_or(&filters[0]));
    let x: [&mut [f64]; W] = std::array::from_fn(|_| all.next().unwrap_or_default());
    match isa {
        Isa::Scalar | Isa::Portable => side_by_side(sections, x, back),
        #[cfg(all(target_arch = "x86_64", feature = "wide"))]
        // SAFETY: the machine has AVX2
        Isa::Avx2 => unsafe { side_by_side_avx2(sections, x, back) },
        #[cfg(all(target_arch = "x86_64", feature = "wide"))]
        // SAFETY: the machine has AVX-512
        Isa::Avx512 => unsafe { side_by_side_avx512(sections, x, back) },
    }
}

#[cfg(all(target_arch = "x86_64", feature = "wide"))]
#[target_feature(enable = "avx2")]
unsafe fn side_by_side_avx2<const W: usize>(
    sections: [[Section; 2]; W],
    x: [&mut [f64]; W],
    back: bool,
) {
    side_by_side(sections, x, back);
}

#[cfg(all(target_arch = "x86_64", feature = "wide"))]
#[target_feature(enable = "avx512f,avx512dq")]
unsafe fn side_by_side_avx512<const W: usize>(
    sections: [[Section; 2]; W],
    x: [&mut [f64]; W],
    back: bool,
) {
    side_by_side(sections, x, back);
}

/// Signals that are filtered side by side.
const ABREAST: usize = 8;

/// [`Butterworth::zero_phase`] of as many signals as [`ABREAST`] or fewer, of one length, one after the other into `out`; each
/// with its filter and the length of its continuation.
fn zero_phase_of(filters: &[(Butterworth, usize)], x: &[Vec<f64>], out: &mut [f64]) {
    let count = x.first().map_or(0, Vec::len);
    let pairs: Vec<[Section; 2]> = (filters.iter())
        .filter_map(|(f, _)| <[Section; 2]>::try_from(&f.sections[..]).ok())
        .collect();
    let rows = out.chunks_exact_mut(count.max(1));
    if pairs.len() < filters.len() || count < 2 {
        for (((f, pad), x), out) in filters.iter().zip(x).zip(rows) {
            out.copy_from_slice(&f.zero_phase(x, *pad));
        }
        return;
    }
    let with_pad = |((_, pad), x): (&(_, usize), &Vec<f64>)| Butterworth::continued(x, *pad);
    let (mut y, pads): (Vec<Vec<f64>>, Vec<usize>) = filters.iter().zip(x).map(with_pad).unzip();
    // as many as one instruction takes: some stand for nothing
    let spare = pairs.len().next_power_of_two() - pairs.len();
    let mut more: Vec<Vec<f64>> = y.iter().take(1).cycle().take(spare).cloned().collect();
    let isa = Isa::detect();
    for back in [false, true] {
        let y = y.iter_mut().chain(&mut more).map(Vec::as_mut_slice);
        match pairs.len() {
            5.. => together::<8>(isa, &pairs, y, back),
            3 | 4 => together::<4>(isa, &pairs, y, back),
            2 => together::<2>(isa, &pairs, y, back),
            _ => together::<1>(isa, &pairs, y, back),
        }
    }
    for ((y, pad), out) in y.iter().zip(pads).zip(rows) {
        out.copy_from_slice(&y[pad..pad + count]);
    }
}

/// Continuation of the ends of a motion, in periods of the cut-off.
const PAD: f64 = 3.0;

/// What a motion that does not repeat passes, and the continuation of its ends: a filter with its cut-off below half of the
/// rate.
fn smoother_with(order: usize, cutoff: f64, rate: f64) -> Result<(Butterworth, usize)> {
    let low = Butterworth::low_pass(order, cutoff.min(0.45 * rate), rate)?;
    let pad = low.default_pad().max((PAD * rate / cutoff) as usize);
    Ok((low, pad))
}

/// What a motion that does not repeat passes: this filter forward and backward, with its cut-off below half of the rate.
///
/// # Errors
/// As [`Butterworth::low_pass`].
pub fn smoother(order: usize, cutoff: f64, rate: f64) -> Result<impl Fn(&[f64]) -> Vec<f64>> {
    let (low, pad) = smoother_with(order, cutoff, rate)?;
    Ok(move |x: &[f64]| low.zero_phase(x, pad))
}

/// What [`smoother`] makes of signals of one length, each with a cut-off of its own, one after the other; to the same bits.
///
/// # Errors
/// As [`Butterworth::low_pass`].
pub(super) fn smooth(order: usize, rate: f64, cutoffs: &[f64], x: &[Vec<f64>]) -> Result<Vec<f64>> {
    let filters = cutoffs.iter().map(|f| smoother_with(order, *f, rate));
    let filters = filters.collect::<Result<Vec<_>>>()?;
    let count = x.first().map_or(0, Vec::len);
    let mut out = vec![0.0; x.len() * count];
    let parts = out.par_chunks_mut((ABREAST * count).max(1));
    let all = filters.par_chunks(ABREAST).zip(x.par_chunks(ABREAST));
    parts
        .zip(all)
        .for_each(|(out, (filters, x))| zero_phase_of(filters, x, out));
    Ok(out)
}

/// First derivative by central differences of sixth order, one-sided at the ends. `h` is the step.
///
/// The error is `(ωh)⁶/140` of the true derivative.
pub fn first_derivative(x: &[f64], h: f64) -> Vec<f64> {
    let mut out = vec![0.0; x.len()];
    first_derivative_into(x, h, &mut out);
    out
}

/// Second derivative by central differences of sixth order, one-sided at the ends.
pub fn second_derivative(x: &[f64], h: f64) -> Vec<f64> {
    let mut out = vec![0.0; x.len()];
    second_derivative_into(x, h, &mut out);
    out
}

/// [`first_derivative`] into a signal of the same length.
pub(super) fn first_derivative_into(x: &[f64], h: f64, out: &mut [f64]) {
    const C: [f64; 3] = [45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0];
    let inner =
        |[a, b, c, _, e, f, g]: [f64; 7]| (C[0] * (e - c) + C[1] * (f - b) + C[2] * (g - a)) / h;
    stencil(x, inner, 1, h, out);
}

/// [`second_derivative`] into a signal of the same length.
pub(super) fn second_derivative_into(x: &[f64], h: f64, out: &mut [f64]) {
    const C: [f64; 3] = [1.5, -3.0 / 20.0, 1.0 / 90.0];
    // differences first, so that a large constant does not cost digits
    let bend = |before: f64, here: f64, after: f64| (after - here) - (here - before);
    let inner = |[a, b, c, d, e, f, g]: [f64; 7]| {
        (C[0] * bend(c, d, e) + C[1] * bend(b, d, f) + C[2] * bend(a, d, g)) / (h * h)
    };
    stencil(x, inner, 2, h, out);
}

/// A stencil of three neighbours on each side; near the ends the parabola through three samples.
fn stencil(x: &[f64], inner: impl Fn([f64; 7]) -> f64, derivative: usize, h: f64, out: &mut [f64]) {
    let n = x.len();
    let end = |i: usize| {
        if n < 3 {
            return match (derivative, n) {
                (1, 2) => (x[1] - x[0]) / h,
                _ => 0.0,
            };
        }
        let k = i.clamp(1, n - 2);
        let bend = (x[k + 1] - 2.0 * x[k] + x[k - 1]) / (h * h);
        match derivative {
            2 => bend,
            _ => (x[k + 1] - x[k - 1]) / (2.0 * h) + bend * (i as f64 - k as f64) * h,
        }
    };
    for i in (0..n.min(3)).chain(n.saturating_sub(3)..n) {
        out[i] = end(i);
    }
    if n > 6 {
        // seven signals of one length, so that neighbours are computed side by side
        let out = &mut out[3..n - 3];
        let shifted = |k: usize| &x[k..k + out.len()];
        let [a, b, c, d, e, f, g] = [0, 1, 2, 3, 4, 5, 6].map(shifted);
        for (i, y) in out.iter_mut().enumerate() {
            *y = inner([a[i], b[i], c[i], d[i], e[i], f[i], g[i]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever the number of signals, their length, the order and the cut-offs.
    #[test]
    fn signals_that_are_smoothed_side_by_side_are_those_that_are_smoothed_alone() {
        for (order, n) in [1, 2, 3, 4, 6]
            .into_iter()
            .flat_map(|order| [0, 1, 2, 37, 1000].map(|n| (order, n)))
        {
            for count in 0..18 {
                let x = |k: usize| -> Vec<f64> {
                    let x = |i: usize| {
                        ((0.1 + 0.01 * k as f64) * i as f64).sin() + 0.1 * (i % 7) as f64
                    };
                    (0..n).map(x).collect()
                };
                let x: Vec<Vec<f64>> = (0..count).map(x).collect();
                let cutoffs: Vec<f64> = (0..count).map(|k| 1.0 + 2.5 * k as f64).collect();
                let together = smooth(order, 100.0, &cutoffs, &x).unwrap();
                let alone = cutoffs
                    .iter()
                    .zip(&x)
                    .map(|(cutoff, x)| smoother(order, *cutoff, 100.0).unwrap()(x));
                let alone: Vec<f64> = alone.flatten().collect();
                assert_eq!(together, alone, "{count} of order {order}, {n} samples");
            }
        }
    }
}
