//! Brings a motion inside the limits along its path by moving it, not by shrinking it.
//!
//! Most random motions touch something. Shrunk until they touch nothing, little is left of them. Here the
//! linearised limits are solved for the nearest motion instead, a few times:
//!
//! ```text
//! minimise   ½ zᵀz + C t
//! subject to limits(x + δ),   ∂h_i δ ≤ s_i + t (−s_i)₊,   |z_k| ≤ Δ,   0 ≤ t ≤ 1
//! ```
//!
//! with the scaled step `z_k = δ_k / s_k` and the slacks `s_i` of the limits along the path. `t = 1`, `z = 0` is always inside, so that the
//! program has a solution; `t` is the share of the excess that this step leaves.

use super::information::Evaluation;
use super::limits::ExtremaWork;
use super::path::PathMemory;
use super::solve::Task;
use crate::conic::Problem;
use crate::error::Result;

/// Most linearisations.
const STEPS: usize = 12;
/// Largest change `Δ` of a free number in one step, in units of the joint's scale.
const REACH: f64 = 0.25;
/// Weight `C` of the excess that is left.
const EXCESS: f64 = 100.0;
/// Rows that use more than this share of a limit are written.
const NEAR: f64 = 0.6;

/// The motion near `x` that is inside all limits, or `None` where none was found in a few steps.
///
/// # Errors
/// Only when numbers are not finite.
pub fn restore(
    task: &Task,
    x: &[f64],
    halt: &(dyn Fn() -> bool + Sync),
) -> Result<Option<Vec<f64>>> {
    let Some(limits) = task.path else {
        return Ok(Some(x.to_vec()));
    };
    let n = x.len();
    let m = n / task.scale.len();
    let mut problem = Problem::new(n + 1);
    let (mut e, mut work) = (Evaluation::default(), ExtremaWork::default());
    let mut memory = PathMemory::default();
    let mut x = x.to_vec();
    task.limits.pull_inside(&mut x, &mut work);
    for step in 0..=STEPS {
        task.info.evaluate(&x, &mut e);
        if limits.used(task.info, &x, &e.motion, &mut memory) <= 1.0 {
            return Ok(Some(x));
        }
        if step == STEPS || halt() {
            break;
        }
        let p = &mut problem;
        p.clear();
        (0..n).for_each(|k| p.quadratic(k, k, 1.0));
        p.linear(n, EXCESS);
        p.bounds(n, 0.0, 1.0);
        (0..n).for_each(|k| p.bounds(k, -REACH, REACH));
        let rows = task.limits.rows(&x, NEAR, &mut work);
        rows.write(p, m, task.scale);
        for row in limits.rows(task.info, &x, &mut e, NEAR) {
            let scaled = row.gradient.iter().enumerate();
            let excess = (-row.slack).max(0.0);
            p.inequality(
                scaled
                    .map(|(k, g)| (k, g * task.scale[k / m]))
                    .chain([(n, -excess)]),
                row.slack,
            );
        }
        let solution = p.solve(&task.conic())?;
        if !solution.status.is_solved() {
            return Ok(None);
        }
        for (k, x) in x.iter_mut().enumerate() {
            *x += solution.x[k] * task.scale[k / m];
        }
        task.limits.pull_inside(&mut x, &mut work);
    }
    Ok(None)
}
