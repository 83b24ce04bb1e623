//! What the torque channel makes of a signal: averages over sub-steps of a sampling interval.
//!
//! Controllers average torque over a triangle of plus and minus one sample. A smooth signal is changed by
//! `Δ² ẍ / 12`; what is not smooth is evaluated on [`FINE`] sub-steps a sample.

use super::thresholds::THRESHOLDS as T;

/// Sub-steps of a sampling interval over which what is not smooth is averaged.
pub const FINE: usize = T.window.fine;

/// Smooth sign.
pub fn sign(v: f64, width: f64) -> f64 {
    let x = v / width;
    match x.abs() < T.window.saturated {
        true => x.tanh(),
        false => 1f64.copysign(x),
    }
}

/// A smooth signal averaged over a triangle of plus and minus one sample: `x + Δ² ẍ / 12`.
pub fn averaged(x: &[f64], out: &mut [f64]) {
    let last = x.len() - 1;
    for i in 0..=last {
        out[i] = if i == 0 || i == last {
            x[i]
        } else {
            (x[i - 1] + 10.0 * x[i] + x[i + 1]) / 12.0
        };
    }
}

/// A function of position and velocity on sub-steps, averaged over a triangle of plus and minus one
/// sample; the motion between samples is the Hermite polynomial of positions and velocities.
pub fn fine(
    q: &[f64],
    v: &[f64],
    a: &[f64],
    dt: f64,
    f: impl Fn(f64, f64) -> f64,
    out: &mut Vec<f64>,
) {
    let values = fine_values(q, v, a, dt, |q, v, _| f(q, v));
    from_fine(&values, q.len(), out);
}

/// Values of a function on the sub-steps: `FINE` a sample, from the first sample to the last; the
/// function sees them in order of time (position, velocity, time).
pub fn fine_values(
    q: &[f64],
    v: &[f64],
    a: &[f64],
    dt: f64,
    mut f: impl FnMut(f64, f64, f64) -> f64,
) -> Vec<f64> {
    let n = q.len();
    let mut values = Vec::with_capacity((n - 1) * FINE + 1);
    for i in 0..n {
        values.push(f(q[i], v[i], i as f64 * dt));
        if i + 1 == n {
            break;
        }
        for s in 1..FINE {
            let h = s as f64 / FINE as f64;
            // position: cubic Hermite; velocity: cubic Hermite of its own
            let hermite = |p0: f64, m0: f64, p1: f64, m1: f64| {
                let (h2, h3) = (h * h, h * h * h);
                (2.0 * h3 - 3.0 * h2 + 1.0) * p0
                    + (h3 - 2.0 * h2 + h) * dt * m0
                    + (3.0 * h2 - 2.0 * h3) * p1
                    + (h3 - h2) * dt * m1
            };
            let position = hermite(q[i], v[i], q[i + 1], v[i + 1]);
            let velocity = hermite(v[i], a[i], v[i + 1], a[i + 1]);
            values.push(f(position, velocity, (i as f64 + h) * dt));
        }
    }
    values
}

/// Triangular average of values on sub-steps, one a sample.
pub fn from_fine(values: &[f64], count: usize, out: &mut Vec<f64>) {
    let last = values.len() as isize - 1;
    let weights: [f64; 2 * FINE - 1] =
        std::array::from_fn(|k| (FINE - k.abs_diff(FINE - 1)) as f64);
    for i in 0..count {
        // from just after the sample before to just before the next one
        let from = (i * FINE) as isize + 1 - FINE as isize;
        let inside = usize::try_from(from).ok();
        let whole = inside.and_then(|from| values.get(from..from + 2 * FINE - 1));
        let sum: f64 = match whole {
            Some(values) => weights.iter().zip(values).map(|(w, x)| w * x).sum(),
            None => (weights.iter().zip(from..))
                .map(|(w, at)| w * values[at.clamp(0, last) as usize])
                .sum(),
        };
        out.push(sum / (FINE * FINE) as f64);
    }
}

/// Two functions as of [`fine_values`], which are made together, averaged over the triangle.
pub fn fine_pair(
    [q, v, a]: [&[f64]; 3],
    dt: f64,
    mut f: impl FnMut(f64, f64, f64) -> [f64; 2],
) -> [Vec<f64>; 2] {
    let mut second = Vec::with_capacity(q.len() * FINE);
    let first = fine_values(q, v, a, dt, |q, v, t| {
        let [first, other] = f(q, v, t);
        second.push(other);
        first
    });
    [first, second].map(|values| sampled(&values, q.len()))
}

/// What [`from_fine`] gives, by itself.
pub fn sampled(values: &[f64], count: usize) -> Vec<f64> {
    let mut out = Vec::with_capacity(count);
    from_fine(values, count, &mut out);
    out
}
