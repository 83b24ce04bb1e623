//! Limits of a coordinate from `<limit>`, what `robot.toml` states instead, and its mimics.

use super::{ByPosition, Kind, StatedLimits, UrdfJoint};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::robot::{Limits, VelocityByPosition};
use std::path::Path;

/// A position (rad or m) beyond this is the way in which a file says that there is no limit.
const NO_POSITION: f64 = 1e6;
/// A velocity or an effort from this on, and what a file is given where there is no limit.
pub(crate) const NO_LIMIT: f64 = 1e9;
/// A limit of velocity or effort below this is a zero.
const NO_MOTION: f64 = 1e-9;

/// The end of a range; infinite where it is too far away to be one.
fn unlimited(end: Option<f64>) -> Option<f64> {
    end.map(|x| match x.abs() > NO_POSITION {
        true => x.signum() * f64::INFINITY,
        false => x,
    })
}

/// Limits of a moving joint. Absent limits, and the zeros that exporters write for them, mean
/// "none" and are reported, unless `stated` gives a value.
pub(super) fn of_joint(
    file: &Path,
    joint: &UrdfJoint,
    stated: &StatedLimits,
    warnings: &mut Vec<Warning>,
) -> Result<Limits> {
    let what = format!("joint `{}`", joint.name);
    let error = |message: String| {
        let line = joint.limit.map_or(joint.line, |l| l.line);
        Err(Error::file(file, format!("line {line}: {what}"), message))
    };
    let mut limits = Limits::default();
    let mut missing = Vec::new();
    if let Some(position) = stated.position {
        limits.position = position;
    } else if joint.kind != Kind::Continuous {
        let far = |x: Option<f64>| x.is_some_and(|x| x.abs() > NO_POSITION);
        let ends = joint.limit.map_or((None, None), |l| (l.lower, l.upper));
        if far(ends.0) || far(ends.1) {
            warnings.push(Warning::new(
                WarningKind::LimitsMissing,
                &what,
                format!(
                    "a position limit above {NO_POSITION:e} is taken as none; state `position` in \
                     robot.toml"
                ),
            ));
        }
        let ends = (unlimited(ends.0), unlimited(ends.1));
        match (ends.0.unwrap_or(0.0), ends.1.unwrap_or(0.0)) {
            (0.0, 0.0) => missing.push("position"),
            (lower, upper) if lower > upper => {
                return error(format!(
                    "lower limit {lower} is above upper limit {upper}; \
                     correct them or state `position` in robot.toml"
                ));
            }
            (lower, upper) if lower == upper && lower.is_finite() => {
                return error(format!(
                    "both limits are {lower}: it cannot move; \
                     correct them, make it fixed, or `lock` it in robot.toml"
                ));
            }
            (lower, upper) => {
                limits.position = [lower, upper];
                if ends.0.is_none() || ends.1.is_none() {
                    let end = if ends.0.is_none() { "lower" } else { "upper" };
                    warnings.push(Warning::new(
                        WarningKind::LimitsMissing,
                        &what,
                        format!("<limit> has no {end} position; taken as 0, as URDF defines"),
                    ));
                }
            }
        }
    }
    let written = |stated: Option<f64>, urdf: Option<f64>, name: &'static str| match stated {
        Some(value) => Ok(Some(value)),
        None => match urdf {
            Some(value) if value < 0.0 => Err(format!(
                "its {name} limit is {value}; correct the sign or state `{name}` in robot.toml"
            )),
            Some(value) if value > NO_MOTION && value < NO_LIMIT => Ok(Some(value)),
            _ => Ok(None),
        },
    };
    match written(
        stated.velocity,
        joint.limit.and_then(|l| l.velocity),
        "velocity",
    ) {
        Ok(Some(value)) => limits.velocity = value,
        Ok(None) => missing.push("velocity"),
        Err(message) => return error(message),
    }
    match written(stated.effort, joint.limit.and_then(|l| l.effort), "effort") {
        Ok(Some(value)) => limits.effort = value,
        Ok(None) => missing.push("effort"),
        Err(message) => return error(message),
    }
    if let (Some(l), false) = (joint.by_position, stated.by_position) {
        match by_position(&l, limits.position) {
            Ok(l) => limits.velocity_by_position = Some(l),
            Err(message) => {
                let place = format!("line {}: {what}", l.line);
                return Err(Error::file(file, place, message));
            }
        }
    }
    if !missing.is_empty() {
        warnings.push(Warning::new(
            WarningKind::LimitsMissing,
            &what,
            format!(
                "no limit of {} in the URDF (absent, 0, or {NO_LIMIT:e} and more); taken as unlimited, \
                 state it in robot.toml",
                missing.join(", ")
            ),
        ));
    }
    Ok(limits)
}

/// `<position_based_velocity_limits>` of a joint with these limits of position; what is wrong with it.
fn by_position(
    written: &ByPosition,
    position: [f64; 2],
) -> std::result::Result<VelocityByPosition, String> {
    let remedy = "correct it or state `velocity_by_position` in robot.toml";
    let (deceleration, offset) = match (written.deceleration, written.offset) {
        (Some(d), Some(o)) if d > 0.0 && o >= 0.0 => (d, o),
        (d, o) => {
            let show = |x: Option<f64>| x.map_or("missing".into(), |x| format!("{x}"));
            return Err(format!(
                "<position_based_velocity_limits> needs deceleration_limit > 0 ({}) and velocity_offset not \
                 negative ({}); {remedy}",
                show(d),
                show(o)
            ));
        }
    };
    let limit = VelocityByPosition {
        deceleration,
        offset,
        position,
    };
    match limit.flaw() {
        None => Ok(limit),
        Some(flaw) => Err(format!("<position_based_velocity_limits> {flaw}; {remedy}")),
    }
}

/// Narrows the limits of a coordinate to what a body that follows it as `q = ratio·q_c + offset`
/// permits, except those that `robot.toml` states. Position limits of the follower that leave no
/// room are reported and not applied.
pub(super) fn narrow(
    limits: &mut Limits,
    leader: &str,
    stated: &StatedLimits,
    follower: &UrdfJoint,
    (ratio, offset): (f64, f64),
    warnings: &mut Vec<Warning>,
) {
    if follower.by_position.is_some() {
        warnings.push(Warning::new(
            WarningKind::LimitsContradict,
            format!("joint `{}`", follower.name),
            format!(
                "its <position_based_velocity_limits> are not applied, because it mimics `{leader}`; state \
                 `velocity_by_position` for `{leader}` in robot.toml"
            ),
        ));
    }
    let Some(limit) = follower.limit else { return };
    let velocity = limit.velocity.filter(|v| *v > 0.0);
    if let (Some(velocity), None) = (velocity, stated.velocity) {
        limits.velocity = limits.velocity.min(velocity / ratio.abs());
    }
    let (Some(lower), Some(upper)) = (unlimited(limit.lower), unlimited(limit.upper)) else {
        return;
    };
    if stated.position.is_some()
        || follower.kind == Kind::Continuous
        || (lower == 0.0 && upper == 0.0)
    {
        return;
    }
    let (a, b) = ((lower - offset) / ratio, (upper - offset) / ratio);
    let lower = limits.position[0].max(a.min(b));
    let upper = limits.position[1].min(a.max(b));
    if lower < upper {
        limits.position = [lower, upper];
    } else {
        warnings.push(Warning::new(
            WarningKind::LimitsContradict,
            format!("joint `{}`", follower.name),
            format!(
                "its position limits contradict those of `{leader}`, which it mimics; \
                 those of `{leader}` are used"
            ),
        ));
    }
}
