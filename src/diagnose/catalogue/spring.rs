//! A mass on springs, with or without a gap between them.

use super::Context;
use crate::diagnose::window::{FINE, from_fine};

/// How much of the begin of a record without periods is run through first, s.
const BACK: f64 = 2.0;

/// Way `δ` of the link against the motor, its rate and acceleration, `M δ̈ = T(δ) − τ_J`, where `T`
/// is the torque of flanks at `±b/2` with springs of `M (2πf)²` and a damping ratio; the springs
/// stiffen by `cubic` at the largest load. Averaged as torque is measured.
#[allow(clippy::too_many_arguments)]
pub(crate) fn way(
    load: &[f64],
    mass: &[f64],
    dt: f64,
    gap: f64,
    frequency: f64,
    damping: f64,
    cubic: f64,
    cycle: Option<usize>,
) -> [Vec<f64>; 3] {
    let omega = 2.0 * std::f64::consts::PI * frequency;
    let n = load.len();
    // sub-steps of the springs, finer than those of the average
    let sub = ((omega * dt / FINE as f64 / 0.2).ceil() as usize).max(1);
    let h = dt / (FINE * sub) as f64;
    let mean = mass.iter().sum::<f64>() / n as f64;
    let k = mean * omega * omega;
    let d = 2.0 * damping * mean * omega;
    let twist = load.iter().fold(1e-12f64, |m, v| m.max(v.abs())) / k;
    let begin = match cycle {
        Some(_) => load[0],
        None => load[((BACK / dt) as usize).min(n - 1)],
    };
    let (mut x, mut v) = (-gap / 2.0 * begin.signum() - begin / k, 0.0);
    let mut values: [Vec<f64>; 3] = Default::default();
    let settle = cycle.unwrap_or(0).min(n - 1);
    if cycle.is_none() {
        // a record may begin in the middle of a motion: backwards through its begin with a damping of one half, so that
        // nothing swings from the start
        let back = ((BACK / dt) as usize).min(n - 1);
        for i in (0..back).rev() {
            let (m, steps) = (mass[i].max(0.05 * mean), FINE * sub);
            for s in 0..steps {
                let tau = load[i + 1] + s as f64 / steps as f64 * (load[i] - load[i + 1]);
                let beyond = x - x.clamp(-gap / 2.0, gap / 2.0);
                v += h * (-k * beyond - mean * omega * v - tau) / m;
                x += h * v;
            }
        }
        v = -v;
    }
    for pass in 0..2 {
        let upto = if pass == 0 { settle } else { n };
        for i in 0..upto {
            let next = (i + 1).min(n - 1);
            let m = mass[i].max(0.05 * mean);
            for s in 0..FINE {
                let mut sum = 0.0;
                let begin = (x, v);
                for u in 0..sub {
                    let w = (s * sub + u) as f64 / (FINE * sub) as f64;
                    let tau = load[i] + w * (load[next] - load[i]);
                    let beyond = x - x.clamp(-gap / 2.0, gap / 2.0);
                    let mut t = -k * beyond * (1.0 + cubic * (beyond / twist).powi(2).min(9.0));
                    // flanks push only while they touch
                    if gap == 0.0 {
                        t -= d * v;
                    } else if beyond != 0.0 {
                        let damped = t - d * v;
                        t = if damped * t > 0.0 { damped } else { 0.0 };
                    }
                    let a = (t - tau) / m;
                    sum += a;
                    v += h * a;
                    x += h * v;
                }
                if pass == 1 {
                    values[0].push(begin.0);
                    values[1].push(begin.1);
                    values[2].push(sum / sub as f64);
                }
                if pass == 1 && i + 1 == n {
                    break;
                }
            }
        }
    }
    values.map(|mut all| {
        all.truncate((n - 1) * FINE + 1);
        let mut out = Vec::with_capacity(n);
        from_fine(&all, n, &mut out);
        out
    })
}

/// Stiffness and damping of a spring on which the link of an actuator swings with a frequency, Hz, and a damping
/// ratio, and its twist under the largest load: what [`way`] takes them for.
pub(crate) fn constants(cx: &Context, j: usize, frequency: f64, damping: f64) -> [f64; 3] {
    let omega = 2.0 * std::f64::consts::PI * frequency;
    let mean = cx.mass[j][j].iter().sum::<f64>() / cx.data.rows() as f64;
    let stiffness = mean * omega * omega;
    [
        stiffness,
        2.0 * damping * mean * omega,
        cx.peak[j] / stiffness,
    ]
}
