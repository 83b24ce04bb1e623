//! Joints that a motion hardly moves: what follows from the numbers, said in words.

use crate::error::{Warning, WarningKind, number};
use crate::report::format::unit_of;
use crate::robot::Joint;
use crate::trajectory::certificate::Kind;
use crate::trajectory::{Certificate, JointCertificate};

/// A joint is hardly moved if it uses less than this share of its range and of its speed.
const SHARE: f64 = 0.05;
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
pub(super) fn warning(certificate: &Certificate, joints: &[&Joint]) -> Option<Warning> {
    let named: Vec<String> = (certificate.joints.iter().zip(joints))
        .filter(|(c, _)| used(c) < SHARE)
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
             on little; look at their limits, or choose another start, period or criterion",
            named.join(", "),
            100.0 * SHARE
        );
        Warning::new(WarningKind::NotExcited, "trajectory", message)
    })
}
