//! Torque and its rate over all time: samples, and a proof of what happens between them.

use super::bounds::{SampledBound, TorqueBound};
use super::enclose::{Enclosed, Motion, enclose};
use super::fourier::{Fourier, check};
use super::jets::Norms;
use crate::error::{Error, Result};
use crate::robot::{Joint, Robot};

/// What may be missing between samples, as a fraction of the limit.
const TARGET: f64 = 0.002;
/// Step of the central difference of a rate, as a fraction of the period; its error is bounded, too.
const STEP: f64 = 1e-5;

/// The smooth part of the torque (rigid bodies, armature, viscous friction, offset) at one state:
/// `(q, qd, qdd, tau)` with `tau` to be written.
pub type TorqueFn<'a> = dyn Fn(&[f64], &[f64], &[f64], &mut [f64]) + 'a;

/// Bounds every joint's torque over all time, `torque` being the smooth part.
///
/// The period is cut into segments; on each, `sup |τ̈|` follows from the coordinates' derivatives
/// by norm jets (see [`jets`](super::jets)). An interval of width `h` then holds
/// `|τ| ≤ max(|τ_i|, |τ_{i+1}|) + (h²/8) sup |τ̈|`. Intervals where this could exceed the largest
/// sample of some joint by more than 0.2 % of its effort limit (of the largest torque of the
/// robot, where there is no limit) are halved, the most excessive first, until none is left or
/// `samples` evaluations are spent. Either way the bound reported holds, up
/// to the rounding of `torque` itself.
///
/// # Errors
/// [`Error::Argument`] if the trajectory is malformed or has another number of joints than the
/// robot, or if `torque` returns a number that is not finite.
pub fn torque_certificate(
    robot: &Robot,
    trajectory: &Fourier,
    samples: usize,
    torque: &TorqueFn,
) -> Result<Vec<TorqueBound>> {
    check(robot, trajectory)?;
    let mut state = State::new(robot.dof());
    let take = |t: f64, out: &mut [f64]| {
        state.torque(trajectory, t, torque, out);
        finite(robot, t, out)
    };
    let norms = Norms::new(robot);
    let curvature = |motion: &Motion, start: f64, width: f64| {
        let of = norms.torque_derivatives(&motion.on(start, width));
        of.into_iter().map(|[second, _]| second).collect()
    };
    let limits: Vec<f64> = robot.joints.iter().map(|j| j.limits.effort).collect();
    let found = enclose(trajectory, samples, take, curvature, &targets(&limits))?;
    let each = robot.joints.iter().zip(found);
    Ok(each
        .map(|(joint, found)| {
            let coulomb = joint.dry();
            let limit = Some(joint.limits.effort).filter(|l| l.is_finite());
            let value = found.highest + coulomb;
            TorqueBound {
                joint: joint.name.clone(),
                max_on_grid: found.highest,
                time: found.time,
                between_grid_bound: found.between,
                coulomb,
                samples: found.samples,
                limit,
                used: limit.map(|l| if value == 0.0 { 0.0 } else { value / l }),
                margin: limit.map(|l| l - value),
            }
        })
        .collect())
}

/// Bounds the rate of every joint's smooth torque over all time, like [`torque_certificate`] with `sup |τ⃛|`.
/// `None` for joints without such a limit. Coulomb friction, which jumps where a joint turns, is no part of it.
///
/// A rate is the central difference of two torques `δ` before and after, wrong by `(δ²/6) sup |τ⃛|` at most,
/// which is added.
///
/// # Errors
/// As [`torque_certificate`].
pub fn rate_certificate(
    robot: &Robot,
    trajectory: &Fourier,
    samples: usize,
    torque: &TorqueFn,
) -> Result<Vec<Option<SampledBound>>> {
    check(robot, trajectory)?;
    let limited = |j: &Joint| j.limits.effort_rate.is_finite();
    if !robot.joints.iter().any(limited) {
        return Ok(vec![None; robot.dof()]);
    }
    let step = STEP * trajectory.period;
    let mut state = State::new(robot.dof());
    let mut before = vec![0.0; robot.dof()];
    let take = |t: f64, out: &mut [f64]| {
        state.torque(trajectory, t - step, torque, &mut before);
        state.torque(trajectory, t + step, torque, out);
        let ends = out.iter_mut().zip(&before);
        ends.for_each(|(after, before)| *after = (*after - before) / (2.0 * step));
        finite(robot, t, out)
    };
    let norms = Norms::new(robot);
    let mut third = vec![0.0_f64; robot.dof()];
    let curvature = |motion: &Motion, start: f64, width: f64| -> Vec<f64> {
        let of = norms.torque_derivatives(&motion.on(start, width));
        let of: Vec<f64> = of.into_iter().map(|[_, third]| third).collect();
        third.iter_mut().zip(&of).for_each(|(a, b)| *a = a.max(*b));
        of
    };
    let limits: Vec<f64> = robot.joints.iter().map(|j| j.limits.effort_rate).collect();
    let found = enclose(trajectory, samples, take, curvature, &targets(&limits))?;
    let each = robot.joints.iter().zip(found).zip(third);
    Ok(each
        .map(|((joint, found), third)| {
            let Enclosed {
                highest,
                time,
                between,
                samples,
            } = found;
            let limit = joint.limits.effort_rate;
            limited(joint).then(|| SampledBound {
                max_on_grid: highest,
                time,
                between_grid_bound: between + step * step / 6.0 * third,
                samples,
                limit,
                used: highest / limit,
                margin: limit - highest,
            })
        })
        .collect())
}

/// What may be missing: a fraction of the limits, of the largest value where there is none.
fn targets(limits: &[f64]) -> impl Fn(&[f64]) -> Vec<f64> + '_ {
    |best| {
        let scale = best.iter().copied().fold(0.0, f64::max);
        let each = limits.iter().map(|l| match l.is_finite() && *l > 0.0 {
            true => TARGET * l,
            false => TARGET * scale,
        });
        each.collect()
    }
}

fn finite(robot: &Robot, t: f64, values: &[f64]) -> Result<()> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(j) => Err(Error::Argument(format!(
            "the torque of joint {} is not finite at t = {t} s; check the inertial parameters",
            robot.joints[j].name
        ))),
    }
}

/// Memory of one evaluation.
struct State([Vec<f64>; 3]);

impl State {
    fn new(n: usize) -> Self {
        State([vec![0.0; n], vec![0.0; n], vec![0.0; n]])
    }

    fn torque(&mut self, trajectory: &Fourier, t: f64, torque: &TorqueFn, out: &mut [f64]) {
        let [q, qd, qdd] = &mut self.0;
        trajectory.evaluate(t, [q, qd, qdd]);
        torque(q, qd, qdd, out);
    }
}
