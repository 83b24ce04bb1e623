//! What a move may use of the limits, and which limits had to be assumed.

use super::State;
use super::leg::Leg;
use crate::error::{Error, Warning, WarningKind, number};
use crate::plant::Plant;
use crate::robot::{Limits, Motion};

/// Velocity of a coordinate that states none: rad/s, m/s.
pub const VELOCITY: [f64; 2] = [1.0, 0.25];
/// How often a second a coordinate without acceleration limit could reach its velocity limit.
pub const RISES_OF_VELOCITY: f64 = 5.0;
/// How often a second a coordinate without jerk limit could reach its acceleration limit.
pub const RISES_OF_ACCELERATION: f64 = 10.0;
/// Share of a limit by which rounding may exceed it.
pub const SLACK: f64 = 1e-9;

/// Limits of the coordinates, with what is missing assumed and reported. Positions without limit
/// stay so.
///
/// # Errors
/// [`Error::Argument`] for a limit that is zero, negative or not a number.
pub fn limits(plant: &Plant) -> crate::error::Result<(Vec<Limits>, Vec<Warning>)> {
    let mut warnings = Vec::new();
    let mut all = Vec::new();
    for joint in &plant.moved().joints {
        let mut l = joint.limits;
        let (velocity, unit) = match joint.motion {
            Motion::Revolute => (VELOCITY[0], "rad"),
            Motion::Prismatic => (VELOCITY[1], "m"),
        };
        let mut assumed = Vec::new();
        let mut assume = |what: &str, unit: &str, value: &mut f64, default: f64| {
            if *value == f64::INFINITY {
                *value = default;
                assumed.push(format!("{what} {} {unit}", number(default)));
            }
        };
        assume("velocity", &format!("{unit}/s"), &mut l.velocity, velocity);
        let rise = l.velocity * RISES_OF_VELOCITY;
        assume(
            "acceleration",
            &format!("{unit}/s^2"),
            &mut l.acceleration,
            rise,
        );
        let rise = l.acceleration * RISES_OF_ACCELERATION;
        assume("jerk", &format!("{unit}/s^3"), &mut l.jerk, rise);
        if !(l.velocity > 0.0 && l.acceleration > 0.0 && l.jerk > 0.0) {
            return Err(Error::Argument(format!(
                "joint {} has no positive limits of velocity, acceleration and jerk; correct the \
                 robot file",
                joint.name
            )));
        }
        if !assumed.is_empty() {
            let message = format!(
                "limits not stated, assumed for moves: {}",
                assumed.join(", ")
            );
            warnings.push(Warning::new(
                WarningKind::LimitsMissing,
                &joint.name,
                message,
            ));
        }
        all.push(l);
    }
    Ok((all, warnings))
}

/// The limits of velocity, acceleration and jerk times a factor; positions and effort as they are.
pub fn scaled(limits: &[Limits], factor: f64) -> Vec<Limits> {
    let scale = |l: &Limits| Limits {
        velocity: l.velocity * factor,
        acceleration: l.acceleration * factor,
        jerk: l.jerk * factor,
        ..*l
    };
    limits.iter().map(scale).collect()
}

/// The scaled limits, raised where an end of the move that is in motion asks for more, never above the
/// full ones. A state with `v` and `a` of one sign was, or will be, as fast as `|v| + a²/(2j)`.
pub fn raised(scaled: &[Limits], full: &[Limits], from: &State, to: &State) -> Vec<Limits> {
    let each = scaled.iter().zip(full).enumerate();
    each.map(|(k, (low, full))| {
        let mut l = *low;
        for (state, ahead) in [(from, 1.0), (to, -1.0)] {
            let (v, a) = (state.qd[k].abs(), state.qdd[k].abs());
            l.acceleration = l.acceleration.max(a * (1.0 + SLACK));
            let faster = ahead * state.qd[k] * state.qdd[k] > 0.0;
            let rise = |j: f64| if faster { a * a / (2.0 * j) } else { 0.0 };
            if v + rise(l.jerk) > full.velocity {
                let room = (full.velocity - v).max(f64::MIN_POSITIVE);
                let needed = (a * a / (2.0 * room) * (1.0 + SLACK)).min(full.jerk);
                l.jerk = l.jerk.max(needed);
            }
            l.velocity = l.velocity.max((v + rise(l.jerk)) * (1.0 + SLACK));
        }
        let most = 1.0 + 2.0 * SLACK;
        l.velocity = l.velocity.min(full.velocity * most);
        l.acceleration = l.acceleration.min(full.acceleration * most);
        l
    })
    .collect()
}

/// Velocity that counts as standing beside a velocity by position: what rounding leaves of none.
pub fn still_at(limits: &Limits) -> f64 {
    SLACK * limits.velocity
}

/// A leg slowed until no coordinate uses more than the leg's share of the velocity that its position leaves,
/// for all time. A leg whose ends move may use all of it, and is not slowed.
///
/// # Errors
/// In words, the coordinate that cannot.
pub fn by_position(limits: &[Limits], names: &[String], leg: Leg) -> Result<Leg, String> {
    let mut factor = 1.0_f64;
    for ((l, name), profile) in limits.iter().zip(names).zip(&leg.profiles) {
        let Some(limit) = l.velocity_by_position else {
            continue;
        };
        let share = profile.share(&limit, still_at(l));
        if share.is_infinite() {
            let [low, high] = limit.range();
            return Err(format!(
                "joint {name} would move outwards beyond {} or {}, where its velocity by position leaves none",
                number(low),
                number(high)
            ));
        }
        if !leg.resting && share > 1.0 + SLACK {
            return Err(format!(
                "joint {name} would be at {} % of the velocity that its position leaves",
                number(100.0 * share)
            ));
        }
        factor = factor.max(share / leg.scale);
    }
    Ok(match leg.resting && factor > 1.0 {
        true => leg.stretched(factor),
        false => leg,
    })
}

/// Whether a state has all coordinates, is finite and within the limits, to [`SLACK`] of them.
///
/// # Errors
/// [`Error::Argument`] with the joint, what it is and what would be right.
pub fn inside(
    plant: &Plant,
    limits: &[Limits],
    which: &str,
    state: &State,
) -> crate::error::Result<()> {
    let joints = &plant.moved().joints;
    let n = joints.len();
    if [&state.q, &state.qd, &state.qdd]
        .iter()
        .any(|v| v.len() != n)
    {
        return Err(Error::Argument(format!(
            "the {which} of the move has {} numbers; robot {:?} has {n} joints: {}",
            state.q.len(),
            plant.name(),
            plant.coordinate_names().join(", ")
        )));
    }
    for (k, (joint, l)) in joints.iter().zip(limits).enumerate() {
        let [a, b] = l.position;
        let slack = SLACK * if (b - a).is_finite() { b - a } else { 1.0 };
        let slight = 1.0 + SLACK;
        let (q, v, w) = (state.q[k], state.qd[k], state.qdd[k]);
        let fault = if !(q.is_finite() && v.is_finite() && w.is_finite()) {
            "not finite".to_string()
        } else if q < a - slack || q > b + slack {
            format!(
                "at {}, outside its position limits [{}, {}]",
                number(q),
                number(a),
                number(b)
            )
        } else if v.abs() > l.velocity * slight {
            format!(
                "at velocity {}, above its limit {}",
                number(v),
                number(l.velocity)
            )
        } else if w.abs() > l.acceleration * slight {
            format!(
                "at acceleration {}, above its limit {}",
                number(w),
                number(l.acceleration)
            )
        } else {
            continue;
        };
        return Err(Error::Argument(format!(
            "joint {} is {fault}, at the {which} of the move",
            joint.name
        )));
    }
    Ok(())
}
