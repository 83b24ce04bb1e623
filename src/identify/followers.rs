//! Residuals that follow the motion of another joint.

use super::trace::Trace;
use crate::log::Purpose;
use crate::regressor::sign;

/// A residual that is proportional, in part, to a function of another joint's velocity.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Follower {
    /// actuator whose residual it is
    pub actuator: usize,
    /// actuator that it goes with
    pub other: usize,
    /// function, in words
    pub what: String,
    /// share of the residual's power on the fit records
    pub share: f64,
}

/// A function of the velocities of a joint and of another.
type Function = fn(f64, f64) -> f64;

/// Looks, joint by joint, for the function of another joint's velocity that explains most of the
/// residual, beyond what functions of its own velocity do. The shares below a tenth are left out, and so are joints that are not
/// asked for.
pub fn followers(
    names: &[String],
    traces: &[Trace],
    asked: impl Fn(usize) -> bool,
) -> Vec<Follower> {
    let fitted: Vec<&Trace> = (traces.iter())
        .filter(|t| t.purpose == Purpose::Fit)
        .collect();
    let count: usize = fitted.iter().map(|t| t.time.len()).sum();
    let all = |of: &dyn Fn(&Trace, usize) -> f64| -> Vec<f64> {
        let mut out = Vec::with_capacity(count);
        for t in &fitted {
            out.extend((0..t.time.len()).map(|k| of(t, k)));
        }
        out
    };
    let mut out = Vec::new();
    for a in (0..names.len()).filter(|a| asked(*a)) {
        let at = |t: &Trace, k: usize| a * t.time.len() + k;
        let e = all(&|t, k| t.measured[at(t, k)] - t.predicted[at(t, k)]);
        let power: f64 = e.iter().map(|v| v * v).sum();
        // its own mean, velocity and direction
        let own = all(&|t, k| t.velocity[at(t, k)]);
        let direction = own.iter().map(|x| sign(*x)).collect();
        let mut basis: Vec<Vec<f64>> = Vec::new();
        for mut x in [vec![1.0; count], own.clone(), direction] {
            free(&mut x, &basis);
            basis.push(x);
        }
        let mut best: Option<Follower> = None;
        for b in (0..names.len()).filter(|b| *b != a) {
            let functions: [(String, Function); 4] = [
                (format!("the velocity of {}", names[b]), |_, y| y),
                (format!("the direction of {}", names[b]), |_, y| sign(y)),
                (
                    format!("the direction of {} + {}", names[a], names[b]),
                    |x, y| (x + y).signum(),
                ),
                (
                    format!("the direction of {} − {}", names[a], names[b]),
                    |x, y| (x - y).signum(),
                ),
            ];
            let other = all(&|t, k| t.velocity[b * t.time.len() + k]);
            for (what, f) in functions {
                // what is left of the function explains what is left of the residual
                let mut g: Vec<f64> = own.iter().zip(&other).map(|(x, y)| f(*x, *y)).collect();
                free(&mut g, &basis);
                let c: f64 = g.iter().zip(&e).map(|(p, r)| p * r).sum();
                let share = c * c / power.max(1e-300);
                if share > 0.1 && best.as_ref().is_none_or(|f| share > f.share) {
                    best = Some(Follower {
                        actuator: a,
                        other: b,
                        what,
                        share,
                    });
                }
            }
        }
        out.extend(best);
    }
    out
}

/// Frees a signal of those of an orthonormal basis, and makes it as long as they are; one of which nothing is left is zero.
fn free(x: &mut [f64], basis: &[Vec<f64>]) {
    for q in basis {
        let c: f64 = q.iter().zip(&*x).map(|(p, r)| p * r).sum();
        x.iter_mut().zip(q).for_each(|(r, p)| *r -= c * p);
    }
    let norm = x.iter().map(|v| v * v).sum::<f64>().sqrt();
    let small = norm <= 1e-6 * (x.len() as f64).sqrt();
    x.iter_mut()
        .for_each(|r| *r = if small { 0.0 } else { *r / norm });
}
