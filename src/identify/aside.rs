//! What goes with another joint, fitted aside.
//!
//! A wrist whose axes share a gear has friction of one joint that follows the velocity of the other. The
//! model has no term for it, and least squares puts what it can of it into the joint's own friction and
//! inertia, which then predict other motion wrongly. Where most of a joint's residual goes with another
//! joint, functions `G` of that joint's motion are fitted alongside and forgotten: by the theorem of
//! Frisch, Waugh and Lovell that is least squares on rows freed of them, `(1 − G G⁺) W_a`,
//! `(1 − G G⁺) τ_a`. The model that is written has no such term, and the residuals that are reported
//! contain it.

use super::followers::followers;
use super::stack::Stack;
use super::trace::Trace;
use crate::dot::dot;
use crate::error::{Result, Warning, WarningKind};
use crate::plant::Plant;
use crate::regressor::sign;
use crate::signals::Prepared;

/// Share of a joint's residual that must go with another joint.
const SHARE: f64 = 0.5;
/// Residual of the joint over its torque that makes it worth while.
const ERROR: f64 = 0.1;

/// The fit records with the rows of such joints freed, and what was done; `None` where there is no such
/// joint.
///
/// # Errors
/// A pose of a parallel robot that cannot be reached.
pub fn apart(
    plant: &Plant,
    fit: &[&Stack],
    prepared: &[&Prepared],
    pi: &[f64],
) -> Result<(Option<Vec<Stack>>, Vec<Warning>)> {
    let names: Vec<String> = plant.actuators().iter().map(|j| j.name.clone()).collect();
    let mut traces = Vec::new();
    for (s, p) in fit.iter().zip(prepared) {
        let velocity = plant.actuator_motion(&p.output_motion())?.qd;
        traces.push(Trace::new(s, pi, velocity));
    }
    let large = |a: usize| {
        let (mut e, mut t) = (0.0, 0.0);
        for x in &traces {
            let n = x.time.len();
            for k in a * n..(a + 1) * n {
                e += (x.measured[k] - x.predicted[k]).powi(2);
                t += x.measured[k].powi(2);
            }
        }
        e > ERROR * ERROR * t
    };
    let found: Vec<_> = followers(&names, &traces, large)
        .into_iter()
        .filter(|f| f.share > SHARE)
        .collect();
    if found.is_empty() {
        return Ok((None, Vec::new()));
    }
    let mut out: Vec<Stack> = fit.iter().map(|s| (*s).clone()).collect();
    for (s, p) in out.iter_mut().zip(prepared) {
        let motion = plant.actuator_motion(&p.motion)?;
        let n = motion.count;
        for f in &found {
            let (a, b) = (f.actuator, f.other);
            let (va, vb) = (
                &motion.qd[a * n..(a + 1) * n],
                &motion.qd[b * n..(b + 1) * n],
            );
            let each = |g: fn(f64, f64) -> f64| -> Vec<f64> {
                va.iter().zip(vb).map(|(x, y)| g(*x, *y)).collect()
            };
            let signals = [
                vb.to_vec(),
                motion.qdd[b * n..(b + 1) * n].to_vec(),
                each(|_, y| sign(y)),
                each(|x, y| (x + y).signum()),
                each(|x, y| (x - y).signum()),
            ];
            let filtered = signals.iter().map(|g| p.filter.apply(g)).collect();
            free(s, a, filtered);
        }
    }
    let notes = found
        .iter()
        .map(|f| {
            Warning::new(
                WarningKind::JointsCoupled,
                &names[f.actuator],
                format!(
                    "{:.0} % of what the model left of its torque goes with {}: the joints seem to be coupled. That \
                     part was fitted aside, so that friction and inertia do not take it up; the model that is written \
                     has no term for it",
                    100.0 * f.share,
                    f.what
                ),
            )
        })
        .collect();
    Ok((Some(out), notes))
}

/// Frees the rows of an actuator of these signals.
fn free(s: &mut Stack, a: usize, signals: Vec<Vec<f64>>) {
    let m = s.count;
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for mut g in signals {
        let out = &s.left_out[a * m..(a + 1) * m];
        g.iter_mut()
            .zip(out)
            .for_each(|(x, out)| *x *= f64::from(!*out));
        let before = g.iter().map(|x| x * x).sum::<f64>().sqrt();
        // twice is enough (Giraud, Langou & Rozložník 2005)
        for _ in 0..2 {
            for q in &basis {
                let c = dot(q, &g);
                g.iter_mut().zip(q).for_each(|(y, x)| *y -= c * x);
            }
        }
        let norm = g.iter().map(|x| x * x).sum::<f64>().sqrt();
        if norm > 1e-6 * before {
            g.iter_mut().for_each(|x| *x /= norm);
            basis.push(g);
        }
    }
    let rows = a * m..(a + 1) * m;
    for q in &basis {
        for list in [&mut s.measured, &mut s.known] {
            let part = &mut list[rows.clone()];
            let c = dot(q, part);
            part.iter_mut().zip(q).for_each(|(y, x)| *y -= c * x);
        }
        for k in 0..s.w.ncols() {
            let c: f64 = (0..m).map(|i| q[i] * s.w[(a * m + i, k)]).sum();
            (0..m).for_each(|i| s.w[(a * m + i, k)] -= c * q[i]);
        }
    }
}
