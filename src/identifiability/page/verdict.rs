//! The verdict in a sentence, built from the facts.

use super::{KNOWN, answer, clearance};
use crate::collision::in_words;
use crate::identifiability::{Answer, Assessment, Excitation, LoadAccuracy, Platform};
use crate::mechanism::PoseKind;
use crate::plant::PairClearance;
use crate::report::format::{count, percent, significant, unit_of, with_unit};
use crate::robot::{Motion, Robot};
use crate::trajectory::certificate::{JointCertificate, Kind, Peak};
use crate::trajectory::{PositionPeak, SampledBound};

/// Condition number from which a trajectory does not excite every base parameter.
const UNEXCITED: f64 = 1e7;

/// What no verdict may leave out: what is known of collisions.
fn collisions(e: &Excitation) -> String {
    if let Some(p) = e.platform.as_ref().and_then(|p| p.nearest_axes()) {
        return format!(
            "The axes of legs, arms, rods and platform that do not meet keep {} by a stated bound (closest: {}, {} at \
             {}). Collisions with what stands around were not checked.",
            clearance::millimetres(p.bound),
            p.name,
            clearance::millimetres(p.value),
            with_unit(p.time, 3, "s")
        );
    }
    let Some(c) = &e.clearance else {
        return "Collisions of the robot with itself and with its surroundings were not checked."
            .into();
    };
    let unseen = match c.certificate.unseen.as_slice() {
        [] => String::new(),
        all => format!(
            " The volume of {} is not known and was not looked at.",
            all.join(", ")
        ),
    };
    let near = match c.certificate.always_near.as_slice() {
        [] => String::new(),
        all => format!(
            " Not looked at, because they are near in every posture: {}.",
            in_words(all)
        ),
    };
    format!("Collisions: {}.{unseen}{near}", clearance::sentence(c))
}

/// The pair that comes too near, in words.
fn too_near(e: &Excitation) -> Option<String> {
    let c = &e.clearance.as_ref()?.certificate;
    if c.satisfied {
        return None;
    }
    let short = |p: &&PairClearance| p.bound.is_nan() || p.bound < p.margin;
    let Some(p) = c.pairs.iter().find(short) else {
        return Some("the clearance could not be proven".into());
    };
    let [a, b] = &p.between;
    let time = with_unit(p.time, 3, "s");
    Some(match p.least < 0.0 {
        true => format!(
            "{a} and {b} overlap by {} at {time}",
            clearance::millimetres(-p.least)
        ),
        false => format!(
            "{a} and {b} come as near as {} at {time} (margin {})",
            clearance::millimetres(p.least),
            clearance::millimetres(p.margin)
        ),
    })
}

/// The verdict in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Grade {
    /// limits hold, every base parameter is excited, at least half of them will be known
    Worthwhile,
    /// limits hold and every base parameter is excited, but most will hardly be known
    Weak,
    /// limits hold, but some base parameters are not excited
    Unexciting,
    /// some limit does not hold
    Unsafe,
    /// no trajectory was given
    RobotAlone,
}

/// The verdict: a word and a sentence.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Verdict {
    /// in a word
    pub grade: Grade,
    /// in a sentence
    pub text: String,
}

/// Verdict on a robot or on a trajectory.
pub fn verdict(a: &Assessment) -> Verdict {
    let b = a.base.count();
    let Some(e) = &a.excitation else {
        return Verdict {
            grade: Grade::RobotAlone,
            text: format!(
                "The torques of this robot depend on {} of its {}: no trajectory can tell more, \
                 and none was given, so nothing is said here about limits or uncertainty.",
                count(b, "combination"),
                count(a.base.names.len(), "standard parameter"),
            ),
        };
    };
    let mut broken = violations(&a.robot, e);
    broken.splice(0..0, too_near(e));
    let loaded = a.load.as_ref().and_then(|l| l.broken.as_ref());
    broken.extend(loaded.map(|why| format!("with the load, {why}")));
    let unchecked = collisions(e);
    if !e.certificate.satisfied || !broken.is_empty() {
        let more = match broken.len().saturating_sub(1) {
            0 => String::new(),
            1 => "; another limit does not hold either".into(),
            n => format!("; {n} more limits do not hold either"),
        };
        let first = broken
            .first()
            .cloned()
            .unwrap_or_else(|| "the limits could not be proven".into());
        return Verdict {
            grade: Grade::Unsafe,
            text: format!("Do not run: {first}{more}."),
        };
    }
    let limits = match &e.certificate.worst {
        Some(w) => format!(
            "all limits hold for all time (closest: {} {} at {})",
            w.joint,
            w.kind.name(),
            percent(w.used)
        ),
        None => "the robot states no limits".into(),
    };
    if let Some(l) = a.load.as_ref().filter(|_| a.meant_for_a_load()) {
        return for_a_load(l, &limits, &unchecked);
    }
    if let Some(answer) = &a.answer {
        return for_a_question(answer, &limits, &unchecked);
    }
    let (known, judged) = e.known(KNOWN);
    let lost = e
        .predictions
        .iter()
        .filter(|p| p.std.is_nan() || p.std >= 1e299)
        .count();
    let condition = a.condition().map_or(f64::INFINITY, |c| c.1);
    if condition.is_nan() || condition > UNEXCITED || lost > 0 {
        return Verdict {
            grade: Grade::Unexciting,
            text: format!(
                "Inside its limits, but not every parameter is excited: {limits}, yet the motion \
                 cannot separate all {} (condition number {}). {unchecked}",
                count(b, "base parameter"),
                significant(condition, 2)
            ),
        };
    }
    let noise = if a.robot.joints.iter().all(|j| j.torque_noise.is_some()) {
        "stated"
    } else {
        "assumed"
    };
    if judged == 0 {
        return Verdict {
            grade: Grade::Weak,
            text: format!(
                "Inside its limits, but how well the model will be known cannot be told: {limits}, {}, condition number {}; all \
                 nominal values are 0, so there is nothing to compare with. State masses and friction, if only roughly. {unchecked}",
                count(b, "base parameter"),
                significant(condition, 3),
            ),
        };
    }
    let of = if judged == b {
        format!("{known} of {judged}")
    } else {
        format!("{known} of the {judged} with a nominal value other than 0")
    };
    let facts = format!(
        "{limits}, {}, condition number {}; {of} will be known to {KNOWN}\u{a0}% or better at the \
         {noise} torque noise",
        count(b, "base parameter"),
        significant(condition, 3),
    );
    if 2 * known >= judged {
        Verdict {
            grade: Grade::Worthwhile,
            text: format!("Inside its limits and worth running: {facts}. {unchecked}"),
        }
    } else {
        Verdict {
            grade: Grade::Weak,
            text: format!(
                "Inside its limits, but most parameters stay uncertain: {facts}. {unchecked}"
            ),
        }
    }
}

/// Uncertainty of the mass, at 95 %, up to which a motion for a load is worth running.
const WEIGHED: f64 = 0.02;

/// Verdict on a motion that is meant for a load: by how well it tells that.
fn for_a_load(l: &LoadAccuracy, limits: &str, unchecked: &str) -> Verdict {
    let [mass, com, tensor] = l.in_short(&l.shared);
    let of = |x: Option<f64>, factor: f64, unit: &str| match x {
        Some(x) => format!("to {}\u{a0}{unit}", significant(1.96 * factor * x, 2)),
        None => "not at all".into(),
    };
    let relative = mass.map(|m| m / l.payload[0]);
    let (grade, words) = match relative.is_some_and(|m| 1.96 * m <= WEIGHED) {
        true => (Grade::Worthwhile, "and worth running for a load"),
        false => (Grade::Weak, "but it hardly tells the load"),
    };
    Verdict {
        grade,
        text: format!(
            "Inside its limits {words}: {limits}; of {} recorded {} empty and as long loaded it tells the mass {}, the centre of mass {} \
             and the tensor {} (95\u{a0}%). {unchecked}",
            with_unit(l.payload[0], 4, "kg"),
            with_unit(l.seconds, 3, "s"),
            of(relative, 100.0, "%"),
            of(com, 1e3, "mm"),
            of(tensor, 100.0, "%"),
        ),
    }
}

/// Verdict on a motion that is meant for the platform, the legs or the friction: by how well it tells those.
fn for_a_question(a: &Answer, limits: &str, unchecked: &str) -> Verdict {
    let (known, judged) = a.known(KNOWN);
    let subject = answer::subject(a.question);
    let (grade, words) = match 2 * known >= judged && known > 0 {
        true => (
            Grade::Worthwhile,
            format!("and worth running for {subject}"),
        ),
        false => (Grade::Weak, format!("but it hardly tells {subject}")),
    };
    Verdict {
        grade,
        text: format!(
            "Inside its limits {words}: {limits}; recorded for {} it tells {known} of the {judged} values that are not zero in the robot \
             file to {KNOWN}\u{a0}% or better (95\u{a0}%). {unchecked}",
            with_unit(a.seconds, 3, "s"),
        ),
    }
}

/// Every limit that does not hold or is not proven to, in words, the furthest beyond first.
pub(in crate::identifiability) fn violations(robot: &Robot, e: &Excitation) -> Vec<String> {
    let mut all: Vec<(f64, String)> = Vec::new();
    for (joint, c) in robot.joints.iter().zip(&e.certificate.joints) {
        position(joint.motion, c, &mut all);
        for (kind, peak) in [
            (Kind::Velocity, c.velocity),
            (Kind::Acceleration, c.acceleration),
            (Kind::Jerk, c.jerk),
        ] {
            if !peak.satisfied() {
                all.push(magnitude(&c.joint, kind, joint.motion, &peak));
            }
        }
        if let Some(p) = c.velocity_by_position.as_ref().filter(|p| !p.satisfied()) {
            all.push(by_position(&c.joint, joint.motion, p));
        }
        if let Some(t) = c.torque.as_ref().filter(|t| !t.satisfied()) {
            let peak = Peak {
                value: t.max_on_grid + t.coulomb,
                time: t.time,
                bound: t.bound(),
                limit: t.limit,
                used: t.used,
                margin: t.margin,
            };
            all.push(magnitude(&c.joint, Kind::Torque, joint.motion, &peak));
        }
        if let Some(t) = c.torque_rate.as_ref().filter(|t| !t.satisfied()) {
            all.push(sampled(&c.joint, Kind::TorqueRate, joint.motion, t));
        }
    }
    if let Some(tool) = &e.certificate.tool {
        let both = [
            (Kind::ToolSpeed, &tool.speed),
            (Kind::ToolAcceleration, &tool.acceleration),
        ];
        for (kind, bound) in both {
            if let Some(b) = bound.as_ref().filter(|b| !b.satisfied()) {
                all.push(sampled(&tool.frame, kind, Motion::Prismatic, b));
            }
        }
    }
    if let Some(p) = &e.platform {
        of_platform(p, &mut all);
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter().map(|(_, text)| text).collect()
}

/// Limits of the platform, the passive joints and the singularities that do not hold.
fn of_platform(p: &Platform, all: &mut Vec<(f64, String)>) {
    for (k, c) in p.certificate.platform.joints.iter().enumerate() {
        let motion = match p.task.is_angle(k) {
            true => Motion::Revolute,
            false => Motion::Prismatic,
        };
        position(motion, c, all);
        for (kind, peak) in [
            (Kind::Velocity, c.velocity),
            (Kind::Acceleration, c.acceleration),
            (Kind::Jerk, c.jerk),
        ] {
            if !peak.satisfied() {
                all.push(magnitude(&c.joint, kind, motion, &peak));
            }
        }
    }
    for q in p.certificate.pose.iter().filter(|q| !q.satisfied) {
        let (what, unit, side) = match q.kind {
            PoseKind::PassiveJoint => ("opens to", "rad", "at most"),
            PoseKind::Distance => ("come as near as", "m", "at least"),
            _ => ("has a smallest singular value of", "", "at least"),
        };
        all.push((
            q.used,
            format!(
                "{} {what} {} at t = {}, where {side} {} is allowed",
                q.name,
                with_unit(q.value, 4, unit),
                with_unit(q.time, 4, "s"),
                with_unit(q.limit, 4, unit)
            ),
        ));
    }
}

/// A magnitude beyond its limit, and which part of the limit it takes.
fn magnitude(joint: &str, kind: Kind, motion: Motion, peak: &Peak) -> (f64, String) {
    let unit = unit_of(kind, motion);
    let what = format!("{joint} {}", kind.name());
    let Some(limit) = peak.limit else {
        return (f64::INFINITY, format!("{what} is not finite"));
    };
    let at = format!("at t = {}", with_unit(peak.time, 4, "s"));
    let text = if peak.value > limit {
        format!(
            "{what} reaches {} {at}, {} over its limit of {}",
            with_unit(peak.value, 4, unit),
            percent(peak.value / limit - 1.0),
            with_unit(limit, 4, unit)
        )
    } else {
        format!(
            "{what} comes so close to its limit of {} {at} that it is not proven to hold between \
             samples (at most {})",
            with_unit(limit, 4, unit),
            with_unit(peak.bound, 4, unit)
        )
    };
    (peak.used.unwrap_or(f64::INFINITY), text)
}

/// A sampled magnitude beyond its limit.
fn sampled(name: &str, kind: Kind, motion: Motion, b: &SampledBound) -> (f64, String) {
    let peak = Peak {
        value: b.max_on_grid,
        time: b.time,
        bound: b.bound(),
        limit: Some(b.limit),
        used: Some(b.used),
        margin: Some(b.margin),
    };
    magnitude(name, kind, motion, &peak)
}

/// A velocity beyond what the position leaves of it.
fn by_position(joint: &str, motion: Motion, p: &PositionPeak) -> (f64, String) {
    let rate = unit_of(Kind::Velocity, motion);
    let place = format!(
        "at {} (t = {})",
        with_unit(p.position, 4, unit_of(Kind::Position, motion)),
        with_unit(p.time, 4, "s")
    );
    let velocity = with_unit(p.velocity, 4, rate);
    let text = if p.used.is_infinite() {
        format!(
            "{joint} still moves outwards {place}, at {velocity}, where no velocity is allowed any more"
        )
    } else if p.used > 1.0 {
        format!(
            "{joint} velocity is {velocity} {place}, {} over the {} that its position allows",
            percent(p.used - 1.0),
            with_unit(p.limit, 4, rate)
        )
    } else {
        format!("{joint} velocity is not proven to stay within what its position allows")
    };
    (p.used, text)
}

/// A position beyond one or both of its limits.
fn position(motion: Motion, c: &JointCertificate, all: &mut Vec<(f64, String)>) {
    let r = &c.position;
    if r.satisfied() {
        return;
    }
    let unit = unit_of(Kind::Position, motion);
    let before = all.len();
    for (extremum, limit, side, sign) in [
        (r.min, r.lower, "lower", -1.0),
        (r.max, r.upper, "upper", 1.0),
    ] {
        if let Some(limit) = limit
            && sign * (extremum.value - limit) > 0.0
        {
            let over = sign * (extremum.value - limit);
            let text = format!(
                "{} position reaches {} at t = {}, {} beyond its {side} limit of {}",
                c.joint,
                with_unit(extremum.value, 4, unit),
                with_unit(extremum.time, 4, "s"),
                with_unit(over, 3, unit),
                with_unit(limit, 4, unit)
            );
            all.push((r.used.unwrap_or(1.0), text));
        }
    }
    if all.len() == before {
        all.push((
            r.used.unwrap_or(1.0),
            format!(
                "{} position is not proven to stay within its limits",
                c.joint
            ),
        ));
    }
}
