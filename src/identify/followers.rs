//! Residuals that follow the motion of another joint.

use super::trace::Trace;
use crate::log::Purpose;

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
/// residual, beyond what functions of its own velocity do. The shares below a tenth are left out.
pub fn followers(names: &[String], traces: &[Trace]) -> Vec<Follower> {
    let sign = |x: f64| if x == 0.0 { 0.0 } else { x.signum() };
    let mut out = Vec::new();
    for a in 0..names.len() {
        let mut best: Option<Follower> = None;
        for b in (0..names.len()).filter(|b| *b != a) {
            let functions: [(String, Function); 4] = [
                (format!("the velocity of {}", names[b]), |_, y| y),
                (format!("the direction of {}", names[b]), |_, y| {
                    if y == 0.0 { 0.0 } else { y.signum() }
                }),
                (
                    format!("the direction of {} + {}", names[a], names[b]),
                    |x, y| (x + y).signum(),
                ),
                (
                    format!("the direction of {} − {}", names[a], names[b]),
                    |x, y| (x - y).signum(),
                ),
            ];
            for (what, f) in functions {
                // f and residual, both without their own velocity, direction and mean
                let (mut g, mut e, mut own) = (Vec::new(), Vec::new(), [Vec::new(), Vec::new()]);
                for t in traces.iter().filter(|t| t.purpose == Purpose::Fit) {
                    let n = t.time.len();
                    for k in 0..n {
                        let (x, y) = (t.velocity[a * n + k], t.velocity[b * n + k]);
                        g.push(f(x, y));
                        e.push(t.measured[a * n + k] - t.predicted[a * n + k]);
                        own[0].push(x);
                        own[1].push(sign(x));
                    }
                }
                let [x, s] = own;
                let power: f64 = e.iter().map(|v| v * v).sum();
                let mut list = [vec![1.0; e.len()], x, s, g];
                // Gram-Schmidt; what is left of the last explains what is left of the residual
                for i in 0..4 {
                    let (before, rest) = list.split_at_mut(i);
                    for q in before.iter() {
                        let c: f64 = q.iter().zip(&rest[0]).map(|(p, r)| p * r).sum();
                        rest[0].iter_mut().zip(q).for_each(|(r, p)| *r -= c * p);
                    }
                    let norm = rest[0].iter().map(|v| v * v).sum::<f64>().sqrt();
                    let small = norm <= 1e-6 * (e.len() as f64).sqrt();
                    rest[0]
                        .iter_mut()
                        .for_each(|r| *r = if small { 0.0 } else { *r / norm });
                }
                let c: f64 = list[3].iter().zip(&e).map(|(p, r)| p * r).sum();
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
