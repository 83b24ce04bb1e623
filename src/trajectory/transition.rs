//! Jerk-limited moves between postures and the trajectory's start.
//!
//! Time-optimal and synchronised over the joints, by the algorithm of Berscheid & Kröger,
//! *Jerk-limited Real-time Trajectory Generation with Arbitrary Target States*, RSS 2021.

use super::fourier::Fourier;
use super::samples::{Samples, times};
use crate::error::{Error, Result, Warning, WarningKind, number};
use crate::robot::{Limits, Robot};
use rsruckig::prelude::{
    DataArrayOrVec, InputParameter, Ruckig, RuckigResult, Synchronization, ThrowErrorHandler,
    Trajectory as Profile,
};

/// Time in which a joint without acceleration limit reaches its velocity limit, s.
pub const RISE_VELOCITY: f64 = 0.5;
/// Time in which a joint without jerk limit reaches its acceleration limit, s.
pub const RISE_ACCELERATION: f64 = 0.1;

/// Position, velocity and acceleration of all joints.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// positions, rad or m
    pub q: Vec<f64>,
    /// velocities
    pub qd: Vec<f64>,
    /// accelerations
    pub qdd: Vec<f64>,
}

impl State {
    /// At rest in a posture.
    pub fn rest(q: &[f64]) -> Self {
        State {
            q: q.to_vec(),
            qd: vec![0.0; q.len()],
            qdd: vec![0.0; q.len()],
        }
    }

    /// Where a trajectory starts, and passes at every period's end.
    pub fn start_of(trajectory: &Fourier) -> Self {
        let mut state = State::rest(&vec![0.0; trajectory.dof()]);
        trajectory.evaluate(0.0, [&mut state.q, &mut state.qd, &mut state.qdd]);
        state
    }
}

/// A move from one state to another.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// duration, s
    pub duration: f64,
    /// samples from 0 to the duration, both included
    pub samples: Samples,
    /// limits that had to be assumed
    pub warnings: Vec<Warning>,
}

/// Move from rest in the posture `from` to the trajectory's state at `t = 0`.
///
/// # Errors
/// As [`transition`].
pub fn approach(robot: &Robot, from: &[f64], to: &Fourier, rate: f64) -> Result<Transition> {
    transition(robot, &State::rest(from), &State::start_of(to), rate)
}

/// Move from the trajectory's state at the end of a period to rest in the posture `to`.
///
/// # Errors
/// As [`transition`].
pub fn retreat(robot: &Robot, from: &Fourier, to: &[f64], rate: f64) -> Result<Transition> {
    transition(robot, &State::start_of(from), &State::rest(to), rate)
}

/// The fastest move between two states within the robot's position, velocity, acceleration and
/// jerk limits, all joints arriving together, sampled at `rate` hertz.
///
/// A joint without acceleration limit reaches its velocity limit in 0.5 s, one without jerk limit
/// its acceleration limit in 0.1 s; both are reported as warnings.
///
/// # Errors
/// [`Error::Argument`] if a state has another number of joints than the robot, is not finite or
/// beyond a limit, if a joint has no velocity limit, or the rate is unusable (see [`times`]);
/// [`Error::Infeasible`] if there is no such move.
pub fn transition(robot: &Robot, from: &State, to: &State, rate: f64) -> Result<Transition> {
    let n = robot.dof();
    let mut warnings = Vec::new();
    let mut input = InputParameter::<0>::new(Some(n));
    let (mut lower, mut upper) = (vec![0.0; n], vec![0.0; n]);
    for (name, state) in [("start", from), ("target", to)] {
        if [&state.q, &state.qd, &state.qdd]
            .iter()
            .any(|v| v.len() != n)
        {
            return Err(Error::Argument(format!(
                "the {name} of the move does not have the {n} joints of robot {:?}",
                robot.name
            )));
        }
    }
    for (j, joint) in robot.joints.iter().enumerate() {
        let limits = assumed(&joint.name, joint.limits, &mut warnings)?;
        for (name, state) in [("start", from), ("target", to)] {
            inside(
                &joint.name,
                name,
                &limits,
                [state.q[j], state.qd[j], state.qdd[j]],
            )?;
        }
        input.current_position[j] = from.q[j];
        input.current_velocity[j] = from.qd[j];
        input.current_acceleration[j] = from.qdd[j];
        input.target_position[j] = to.q[j];
        input.target_velocity[j] = to.qd[j];
        input.target_acceleration[j] = to.qdd[j];
        // states may exceed a limit by rounding, see `inside`
        input.max_velocity[j] = limits.velocity.max(from.qd[j].abs()).max(to.qd[j].abs());
        input.max_acceleration[j] = limits
            .acceleration
            .max(from.qdd[j].abs())
            .max(to.qdd[j].abs());
        input.max_jerk[j] = limits.jerk;
        lower[j] = limits.position[0].min(from.q[j]).min(to.q[j]);
        upper[j] = limits.position[1].max(from.q[j]).max(to.q[j]);
    }
    if lower.iter().chain(&upper).any(|v| v.is_finite()) {
        input.min_position = Some(DataArrayOrVec::Heap(lower));
        input.max_position = Some(DataArrayOrVec::Heap(upper));
    }
    input.synchronization = Synchronization::Time;

    let mut profile = Profile::<0>::new(Some(n));
    let mut planner = Ruckig::<0, ThrowErrorHandler>::new(Some(n), 1.0);
    let none = |why: String| {
        Error::Infeasible(format!(
            "no move within the limits of robot {:?} was found between the two states ({why}); \
             give a posture at rest inside the position limits, or a trajectory with ends at rest",
            robot.name
        ))
    };
    planner
        .validate_input(&input, true, true)
        .map_err(|e| none(e.to_string()))?;
    match planner.calculate(&input, &mut profile) {
        Ok(RuckigResult::Working | RuckigResult::Finished) => {}
        Ok(other) => return Err(none(format!("{other:?}"))),
        Err(e) => return Err(none(e.to_string())),
    }
    let duration = profile.get_duration();
    let times = times(duration, rate)?;
    let mut samples = Samples::with_capacity(n, times.len());
    let column = || DataArrayOrVec::<f64, 0>::new(Some(n), 0.0);
    let (mut q, mut qd, mut qdd) = (column(), column(), column());
    for &t in &times {
        let section = &mut None;
        profile.at_time(
            t,
            &mut Some(&mut q),
            &mut Some(&mut qd),
            &mut Some(&mut qdd),
            &mut None,
            section,
        );
        samples.push(t, &q, &qd, &qdd);
    }
    Ok(Transition {
        duration,
        samples,
        warnings,
    })
}

/// The limits with what is missing assumed and reported.
fn assumed(name: &str, mut limits: Limits, warnings: &mut Vec<Warning>) -> Result<Limits> {
    if !(limits.velocity.is_finite() && limits.velocity > 0.0) {
        return Err(Error::Argument(format!(
            "joint {name} has no usable velocity limit for the move; give `velocity` in the \
             robot file"
        )));
    }
    let mut assume = |what: &str, value: &mut f64, default: f64| {
        if value.is_infinite() {
            *value = default;
            let message = format!(
                "has no {what} limit; {} is assumed for the move to and from the start",
                number(default)
            );
            warnings.push(Warning::new(WarningKind::LimitsMissing, name, message));
        }
    };
    assume(
        "acceleration",
        &mut limits.acceleration,
        limits.velocity / RISE_VELOCITY,
    );
    assume(
        "jerk",
        &mut limits.jerk,
        limits.acceleration / RISE_ACCELERATION,
    );
    if !(limits.acceleration > 0.0 && limits.jerk > 0.0) {
        return Err(Error::Argument(format!(
            "joint {name} has no positive acceleration and jerk limit; correct the robot file"
        )));
    }
    Ok(limits)
}

/// Whether a joint's state is finite and within the limits, to 1e-9 of them.
fn inside(joint: &str, which: &str, limits: &Limits, [q, qd, qdd]: [f64; 3]) -> Result<()> {
    let [a, b] = limits.position;
    let slack = 1e-9 * if (b - a).is_finite() { b - a } else { 1.0 };
    let slight = 1.0 + 1e-9;
    let fault = if !(q.is_finite() && qd.is_finite() && qdd.is_finite()) {
        "not finite".to_string()
    } else if q < a - slack || q > b + slack {
        format!(
            "at {}, outside its position limits [{}, {}]",
            number(q),
            number(a),
            number(b)
        )
    } else if qd.abs() > limits.velocity * slight {
        format!(
            "at velocity {}, above its limit {}",
            number(qd),
            number(limits.velocity)
        )
    } else if qdd.abs() > limits.acceleration * slight {
        format!(
            "at acceleration {}, above its limit {}",
            number(qdd),
            number(limits.acceleration)
        )
    } else {
        return Ok(());
    };
    Err(Error::Argument(format!(
        "joint {joint} is {fault}, at the {which} of the move"
    )))
}
