//! The commented `robot.toml` of `excite new`.

use crate::robot::{JointTerm, Motion, Prior, Robot};
use std::fmt::Write as _;

/// A `robot.toml` with all joints and their present values; what has none is commented out.
pub(super) fn template(robot: &Robot, urdf: &str) -> String {
    let quoted = |s: &str| toml::Value::String(s.to_string()).to_string();
    let mut out = String::new();
    let g = robot.gravity;
    let prior = match robot.prior {
        Prior::Cad => "cad",
        Prior::Identified => "identified",
    };
    let names: Vec<String> = robot.joints.iter().map(|j| quoted(&j.name)).collect();
    // writing to a String cannot fail
    let _ = write!(
        out,
        "# Robot file. SI units: rad, m, s, kg, N, N m.\n\
         name = {}\n\
         urdf = {}                 # relative to this file\n\
         gravity = [{:?}, {:?}, {:?}]     # acceleration of gravity in base axes, m/s^2\n\
         prior = \"{prior}\"                # trust in the URDF's inertia: \"cad\" (rough) or \"identified\" (close)\n\
         # lock = {{ {} = 0.0 }}      # joints held fixed at a position, their links merged into the parent\n\
         #                            (the [[joint]] of a locked joint may stay: it has no effect until the lock is gone)\n\n\
         # Joints, in the order of the columns of every log. Every key but `name` is optional;\n\
         # one that is commented out has no value yet, and no limit where it is a limit.\n",
        quoted(&robot.name),
        quoted(urdf),
        g.x,
        g.y,
        g.z,
        names.last().map_or("finger_joint", String::as_str),
    );
    for (joint, name) in robot.joints.iter().zip(&names) {
        let (angle, torque, inertia, gear) = match joint.motion {
            Motion::Revolute => ("rad", "N m", "kg m^2", "motor turns per joint turn"),
            Motion::Prismatic => ("m", "N", "kg", "motor rad per m"),
        };
        let _ = write!(out, "\n[[joint]]\nname = {name}\n");
        let [lower, upper] = joint.limits.position;
        if lower.is_finite() || upper.is_finite() {
            let _ = writeln!(out, "position = [{lower:?}, {upper:?}]     # {angle}");
        } else {
            let _ = writeln!(out, "# position = [-1.0, 1.0]     # {angle}: unlimited");
        }
        let mut key = |key: &str, value: Option<f64>, example: f64, comment: &str| {
            let _ = match value {
                Some(v) => writeln!(out, "{key} = {v:?}     # {comment}"),
                None => writeln!(out, "# {key} = {example:?}     # {comment}"),
            };
        };
        let finite = |x: f64| x.is_finite().then_some(x);
        let l = &joint.limits;
        key("velocity", finite(l.velocity), 2.0, &format!("{angle}/s"));
        key(
            "acceleration",
            finite(l.acceleration),
            10.0,
            &format!("{angle}/s^2"),
        );
        key("jerk", finite(l.jerk), 1000.0, &format!("{angle}/s^3"));
        key("effort", finite(l.effort), 50.0, torque);
        key(
            "torque_noise",
            joint.torque_noise,
            0.1,
            &format!("{torque}: standard deviation of the measured torque"),
        );
        key(
            "position_resolution",
            joint.position_resolution,
            1e-5,
            &format!("{angle}: encoder step"),
        );
        key("gear_ratio", joint.gear_ratio, 100.0, gear);
        let [armature, viscous, coulomb, offset] = joint.terms;
        key(
            "armature",
            Some(armature),
            0.0,
            &format!("{inertia}: rotor inertia at the joint"),
        );
        key(
            "viscous",
            Some(viscous),
            0.0,
            &format!("{torque} s/{angle}"),
        );
        key("coulomb", Some(coulomb), 0.0, torque);
        key("offset", Some(offset), 0.0, torque);
        let identify: Vec<String> = JointTerm::ALL
            .into_iter()
            .zip(joint.identify)
            .filter(|(_, wanted)| *wanted)
            .map(|(t, _)| quoted(t.name()))
            .collect();
        let _ = writeln!(
            out,
            "identify = [{}]     # any of \"armature\", \"viscous\", \"coulomb\", \"offset\"",
            identify.join(", ")
        );
    }
    out
}
