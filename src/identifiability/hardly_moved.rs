//! Joints that a motion hardly moves, or whose torque their noise hides: what follows from the numbers, said in words.

use crate::error::{Warning, WarningKind, number};
use crate::report::format::{significant, unit_of};
use crate::robot::Joint;
use crate::trajectory::certificate::Kind;
use crate::trajectory::{Certificate, JointCertificate};

/// A joint is hardly moved if it uses less than this share of its range and of its speed.
const SHARE: f64 = 0.05;
/// A torque is lost in its noise if it is less than this part of it.
const LOST: f64 = 0.1;
/// Range of a joint without limits that counts as all of it, rad or m.
const UNLIMITED: f64 = 1.0;

/// Share of its range and of its speed that a joint uses, the larger one.
fn used(joint: &JointCertificate) -> f64 {
    let width = match (joint.position.lower, joint.position.upper) {
        (Some(low), Some(high)) if high > low => high - low,
        _ => UNLIMITED,
    };
    let range = (joint.position.max.value - joint.position.min.value) / width;
    range.max(joint.velocity.used.unwrap_or(0.0))
}

/// One warning that names the joints that are hardly moved. What depends on their motion (friction, inertia about
/// their axes) comes from the noise.
/// `lock`: whether the robot file can hold them.
pub(super) fn warning(certificate: &Certificate, joints: &[&Joint], lock: bool) -> Option<Warning> {
    let moved = certificate.joints.iter().zip(joints);
    let moved: Vec<_> = moved.filter(|(c, _)| used(c) < SHARE).collect();
    let named: Vec<String> = (moved.iter())
        .map(|(c, joint)| {
            let range = c.position.max.value - c.position.min.value;
            format!(
                "{} ({} {})",
                c.joint,
                number(range),
                unit_of(Kind::Position, joint.motion)
            )
        })
        .collect();
    (!named.is_empty()).then(|| {
        let message = format!(
            "it hardly moves {}: less than {:.0} % of the range and of the speed. What is identified of these joints rests \
             on little; look at their limits, or choose another start, period or criterion{}",
            named.join(", "),
            100.0 * SHARE,
            held(lock, moved.first().map(|(_, joint)| **joint))
        );
        Warning::new(WarningKind::NotExcited, "trajectory", message)
    })
}

/// One warning that names the joints whose torque is far below their noise, as that of a light finger on a strong drive. What belongs to
/// them is not known, and what it mixes with in the base parameters of other links is not known either. `torque`:
/// of the nominal model, actuator-major.
pub(super) fn lost_in_noise(
    torque: &[f64],
    noise: &[f64],
    joints: &[&Joint],
    lock: bool,
) -> Option<Warning> {
    let count = torque.len() / joints.len().max(1);
    let rms = |part: &[f64]| (part.iter().map(|x| x * x).sum::<f64>() / count as f64).sqrt();
    let lost: Vec<(f64, f64, &Joint)> = (torque.chunks(count.max(1)).zip(noise).zip(joints))
        .map(|((part, noise), joint)| (rms(part), *noise, *joint))
        .filter(|(size, noise, _)| *size < LOST * noise)
        .collect();
    let named: Vec<String> = (lost.iter())
        .map(|(size, noise, joint)| {
            let unit = unit_of(Kind::Torque, joint.motion);
            format!(
                "{} ({} of {} {unit})",
                joint.name,
                significant(*size, 2),
                significant(*noise, 2)
            )
        })
        .collect();
    (!named.is_empty()).then(|| {
        let message = format!(
            "the torque of {} is far below the noise of its measurement. What moves with such a joint is hardly known, and base \
             parameters of other links that contain it are not either{}",
            named.join(", "),
            held(lock, lost.first().map(|l| l.2))
        );
        Warning::new(WarningKind::NotExcited, "trajectory", message)
    })
}

/// What to do where a joint stands still in the run.
fn held(lock: bool, first: Option<&Joint>) -> String {
    match first {
        Some(joint) if lock => format!(
            ". Hold a joint that stands still in the run: `{}` at the top of robot.toml",
            joint.lock_line()
        ),
        _ => String::new(),
    }
}
