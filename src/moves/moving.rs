//! Legs that begin or end in motion: the fastest jerk-limited motion between two states, all
//! coordinates arriving together.
//!
//! By the algorithm of Berscheid & Kröger, *Jerk-limited Real-time Trajectory Generation with
//! Arbitrary Target States*, RSS 2021. Its end states are met to 1e-8; the rest is put right here, and
//! all limits are checked by exact extrema afterwards.

use super::State;
use super::profile::Profile;
use crate::robot::Limits;
use rsruckig::prelude::{
    ControlInterface, DataArrayOrVec, InputParameter, Ruckig, RuckigResult, Synchronization,
    ThrowErrorHandler, Trajectory,
};

/// Room kept for putting the ends right, as a share of the limits; larger ones follow where it is not
/// enough.
const RESERVES: [f64; 3] = [1e-6, 1e-4, 2e-3];
/// Share of a limit by which a checked profile may exceed it.
const TOLERANCE: f64 = 1e-9;

/// The fastest motion between two states; the reason where there is none.
///
/// # Errors
/// What the planner said, or which coordinate (by number) would leave which limit.
pub fn through(from: &State, to: &State, limits: &[Limits]) -> Result<Vec<Profile>, String> {
    let mut why = String::new();
    for reserve in RESERVES {
        // with the position limits, and where that finds nothing, without: they are checked anyway
        for bounded in [true, false] {
            match attempt(from, to, limits, reserve, bounded) {
                Ok(found) => match beyond(&found, limits) {
                    None => return Ok(found),
                    Some(what) => why = what,
                },
                Err(e) if why.is_empty() => why = e,
                Err(_) => {}
            }
        }
    }
    Err(why)
}

/// Which limit profiles leave, in words.
pub fn beyond(profiles: &[Profile], limits: &[Limits]) -> Option<String> {
    for (k, (p, l)) in profiles.iter().zip(limits).enumerate() {
        let peaks = p.peaks();
        let [low, high] = l.position;
        let slack = TOLERANCE
            * if (high - low).is_finite() {
                high - low
            } else {
                1.0
            };
        let over = |value: f64, limit: f64| value > limit * (1.0 + 3.0 * TOLERANCE);
        let number = k + 1;
        let what = if peaks.position[0] < low - slack {
            format!(
                "joint {number} would pass {:.6}, its limit is {low:.6}",
                peaks.position[0]
            )
        } else if peaks.position[1] > high + slack {
            format!(
                "joint {number} would pass {:.6}, its limit is {high:.6}",
                peaks.position[1]
            )
        } else if over(peaks.velocity, l.velocity) {
            format!(
                "velocity of joint {number}: {} of {}",
                peaks.velocity, l.velocity
            )
        } else if over(peaks.acceleration, l.acceleration) {
            format!(
                "acceleration of joint {number}: {} of {}",
                peaks.acceleration, l.acceleration
            )
        } else if over(peaks.jerk, l.jerk) {
            format!("jerk of joint {number}: {} of {}", peaks.jerk, l.jerk)
        } else {
            continue;
        };
        return Some(what);
    }
    None
}

fn attempt(
    from: &State,
    to: &State,
    limits: &[Limits],
    reserve: f64,
    bounded: bool,
) -> Result<Vec<Profile>, String> {
    let n = limits.len();
    let mut input = InputParameter::<0>::new(Some(n));
    input.synchronization = Synchronization::Time;
    let (mut lower, mut upper) = (vec![0.0; n], vec![0.0; n]);
    for (k, l) in limits.iter().enumerate() {
        input.current_position[k] = from.q[k];
        input.current_velocity[k] = from.qd[k];
        input.current_acceleration[k] = from.qdd[k];
        input.target_position[k] = to.q[k];
        input.target_velocity[k] = to.qd[k];
        input.target_acceleration[k] = to.qdd[k];
        let (v, a) = (
            from.qd[k].abs().max(to.qd[k].abs()),
            from.qdd[k].abs().max(to.qdd[k].abs()),
        );
        input.max_velocity[k] = (l.velocity * (1.0 - reserve)).max(v);
        input.max_acceleration[k] = (l.acceleration * (1.0 - reserve)).max(a);
        input.max_jerk[k] = l.jerk * (1.0 - reserve);
        lower[k] = l.position[0].min(from.q[k]).min(to.q[k]);
        upper[k] = l.position[1].max(from.q[k]).max(to.q[k]);
    }
    if bounded {
        input.min_position = Some(DataArrayOrVec::Heap(lower));
        input.max_position = Some(DataArrayOrVec::Heap(upper));
    }
    let profiles = planned(&input, bounded)?;
    let duration = profiles.duration;
    let ends = profiles.profiles.first().ok_or("no motion")?;
    Ok((0..n)
        .map(|k| {
            let p = &ends[k];
            let mut phases: Vec<(f64, f64)> = Vec::with_capacity(9);
            if p.brake.duration > 0.0 {
                phases.extend((0..2).map(|i| (p.brake.t[i], p.brake.j[i])));
            }
            phases.extend(p.t.iter().copied().zip(p.j));
            let state = |s: &State| [s.q[k], s.qd[k], s.qdd[k]];
            Profile::new(state(from), &phases, state(to), duration)
        })
        .collect())
}

fn planned(input: &InputParameter<0>, validate: bool) -> Result<Trajectory<0>, String> {
    let n = input.degrees_of_freedom;
    let mut out = Trajectory::<0>::new(Some(n));
    let mut planner = Ruckig::<0, ThrowErrorHandler>::new(Some(n), 1.0);
    if validate {
        planner
            .validate_input(input, true, true)
            .map_err(|e| e.to_string())?;
    }
    match planner.calculate(input, &mut out) {
        Ok(RuckigResult::Working | RuckigResult::Finished) if out.duration.is_finite() => Ok(out),
        Ok(other) => Err(format!("{other:?}")),
        Err(e) => Err(e.to_string()),
    }
}

/// Where a state comes to rest when every coordinate brakes as hard as the limits allow; with
/// `before`, the posture from which it can be reached by speeding up alone (the same, time reversed).
/// Postures are cut to the position limits.
pub fn braked(state: &State, limits: &[Limits], before: bool) -> Option<Vec<f64>> {
    let n = limits.len();
    let sign = if before { -1.0 } else { 1.0 };
    let mut input = InputParameter::<0>::new(Some(n));
    input.control_interface = ControlInterface::Velocity;
    input.synchronization = Synchronization::None;
    for (k, l) in limits.iter().enumerate() {
        input.current_position[k] = state.q[k];
        input.current_velocity[k] = sign * state.qd[k];
        input.current_acceleration[k] = state.qdd[k];
        input.target_velocity[k] = 0.0;
        input.target_acceleration[k] = 0.0;
        input.max_velocity[k] = l.velocity;
        input.max_acceleration[k] = l.acceleration;
        input.max_jerk[k] = l.jerk;
    }
    let out = planned(&input, false).ok()?;
    let ends = out.profiles.first()?;
    Some(
        (0..n)
            .map(|k| {
                let [low, high] = limits[k].position;
                ends[k].p[7].max(low).min(high)
            })
            .collect(),
    )
}
