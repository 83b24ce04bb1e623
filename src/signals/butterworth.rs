//! Zero-phase Butterworth low-pass in second-order sections.
//!
//! The analog prototype `|H(jω)|² = 1/(1 + (ω/ω_c)^{2N})` goes through the bilinear transform with
//! the cut-off pre-warped (Oppenheim & Schafer, ch. 7). A transfer function of order 8 at 0.5 Hz of
//! 1 kHz cannot be written in double precision; second-order sections can. Forward and backward
//! filtering doubles the order and cancels the phase (Gustafsson 1996); the ends are continued by
//! the record turned about its end points, and the states start as for a constant input, as
//! `scipy.signal.sosfiltfilt` does. At the cut-off the gain of both passes is one half.

use crate::error::{Error, Result};

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
            // the usual number, side by side
            [a, b] => pass([a, b], x, x0, back),
            _ => self.sections.iter().for_each(|s| pass([*s], x, x0, back)),
        }
    }

    /// Both passes, with the ends continued by `pad` samples (less where the record is shorter).
    pub fn zero_phase(&self, x: &[f64], pad: usize) -> Vec<f64> {
        let n = x.len();
        if n < 2 {
            return x.to_vec();
        }
        let pad = pad.min(n - 1);
        let mut y = Vec::with_capacity(n + 2 * pad);
        y.extend((1..=pad).rev().map(|i| 2.0 * x[0] - x[i]));
        y.extend_from_slice(x);
        y.extend((1..=pad).map(|i| 2.0 * x[n - 1] - x[n - 1 - i]));
        self.pass(&mut y, false);
        self.pass(&mut y, true);
        y.truncate(pad + n);
        y.drain(..pad);
        y
    }
}

/// A sample passes all of these sections before the next one does; they start as if the input had been `x0` for ever.
fn pass<const N: usize>(sections: [Section; N], x: &mut [f64], x0: f64, back: bool) {
    // gain 1 at zero frequency: every section sees the same constant
    let mut states = sections.map(|Section { b, a }| {
        let z2 = (b[2] - a[1]) * x0;
        [(b[1] - a[0]) * x0 + z2, z2]
    });
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

/// Continuation of the ends of a motion, in periods of the cut-off.
const PAD: f64 = 3.0;

/// What a motion that does not repeat passes: this filter forward and backward, with its cut-off below half of the rate.
///
/// # Errors
/// As [`Butterworth::low_pass`].
pub fn smoother(order: usize, cutoff: f64, rate: f64) -> Result<impl Fn(&[f64]) -> Vec<f64>> {
    let low = Butterworth::low_pass(order, cutoff.min(0.45 * rate), rate)?;
    let pad = low.default_pad().max((PAD * rate / cutoff) as usize);
    Ok(move |x: &[f64]| low.zero_phase(x, pad))
}

/// First derivative by central differences of sixth order, one-sided at the ends. `h` is the step.
///
/// The error is `(ωh)⁶/140` of the true derivative.
pub fn first_derivative(x: &[f64], h: f64) -> Vec<f64> {
    const C: [f64; 3] = [45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0];
    stencil(
        x,
        |i| {
            (1..=3)
                .map(|k| C[k - 1] * (x[i + k] - x[i - k]))
                .sum::<f64>()
                / h
        },
        1,
        h,
    )
}

/// Second derivative by central differences of sixth order, one-sided at the ends.
pub fn second_derivative(x: &[f64], h: f64) -> Vec<f64> {
    const C: [f64; 3] = [1.5, -3.0 / 20.0, 1.0 / 90.0];
    stencil(
        x,
        |i| {
            // differences first, so that a large constant does not cost digits
            (1..=3)
                .map(|k| C[k - 1] * ((x[i + k] - x[i]) - (x[i] - x[i - k])))
                .sum::<f64>()
                / (h * h)
        },
        2,
        h,
    )
}

/// A stencil of three neighbours on each side; near the ends the parabola through three samples.
fn stencil(x: &[f64], inner: impl Fn(usize) -> f64, derivative: usize, h: f64) -> Vec<f64> {
    let n = x.len();
    (0..n)
        .map(|i| {
            if i >= 3 && i + 3 < n {
                return inner(i);
            }
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
        })
        .collect()
}
