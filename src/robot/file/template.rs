//! The commented `robot.toml` of `excite new`.

use crate::robot::geometry::Obstacle;
use crate::robot::{JointTerm, Motion, Prior, Robot, Stribeck, VelocityByPosition};
use crate::solid::Shape;
use nalgebra::{Rotation3, Vector3};
use std::fmt::Write as _;

/// What stands where a joint has none.
const EXAMPLE: VelocityByPosition = VelocityByPosition {
    deceleration: 6.0,
    offset: 0.3,
    position: [-2.5, 2.5],
};

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
        let out = &mut out;
        let finite = |x: f64| x.is_finite().then_some(x);
        let l = &joint.limits;
        key(
            out,
            "velocity",
            finite(l.velocity),
            2.0,
            &format!("{angle}/s"),
        );
        let (hash, by_position) = match l.velocity_by_position {
            Some(v) => ("", v),
            None => ("# ", EXAMPLE),
        };
        let _ = writeln!(
            out,
            "{hash}velocity_by_position = {{ deceleration = {:?}, offset = {:?}, position = {:?} }}     \
             # velocity is at most sqrt(2 deceleration (end - position)) - offset towards an end",
            by_position.deceleration, by_position.offset, by_position.position
        );
        key(
            out,
            "acceleration",
            finite(l.acceleration),
            10.0,
            &format!("{angle}/s^2"),
        );
        key(out, "jerk", finite(l.jerk), 1000.0, &format!("{angle}/s^3"));
        key(out, "effort", finite(l.effort), 50.0, torque);
        key(
            out,
            "effort_rate",
            finite(l.effort_rate),
            1000.0,
            &format!("{torque}/s"),
        );
        key(
            out,
            "torque_noise",
            joint.torque_noise,
            0.1,
            &format!("{torque}: standard deviation of the measured torque"),
        );
        key(
            out,
            "position_resolution",
            joint.position_resolution,
            1e-5,
            &format!("{angle}: encoder step"),
        );
        key(out, "gear_ratio", joint.gear_ratio, 100.0, gear);
        key(
            out,
            "continuous_torque",
            joint.continuous_torque,
            25.0,
            &format!("{torque}: root mean square that it bears for ever"),
        );
        key(
            out,
            "continuous_power",
            joint.continuous_power,
            100.0,
            "W: mean mechanical power that it bears for ever",
        );
        let [armature, viscous, coulomb, offset] = joint.terms;
        key(
            out,
            "armature",
            Some(armature),
            0.0,
            &format!("{inertia}: rotor inertia at the joint"),
        );
        key(
            out,
            "viscous",
            Some(viscous),
            0.0,
            &format!("{torque} s/{angle}"),
        );
        key(out, "coulomb", Some(coulomb), 0.0, torque);
        key(out, "offset", Some(offset), 0.0, torque);
        let Stribeck {
            force, velocity, ..
        } = joint.stribeck;
        key(
            out,
            "stribeck",
            (force > 0.0).then_some(force),
            1.0,
            &format!(
                "{torque}: breakaway beyond coulomb, stribeck exp(-(speed/stribeck_velocity)^2)"
            ),
        );
        key(
            out,
            "stribeck_velocity",
            (force > 0.0).then_some(velocity),
            0.01,
            &format!("{angle}/s"),
        );
        let identify: Vec<String> = JointTerm::ALL
            .into_iter()
            .zip(joint.identify)
            .filter(|(_, wanted)| *wanted)
            .map(|(t, _)| quoted(t.name()))
            .chain(joint.stribeck.fit.then(|| quoted("stribeck")))
            .collect();
        let _ = writeln!(
            out,
            "identify = [{}]     # any of \"armature\", \"viscous\", \"coulomb\", \"offset\", \"stribeck\"",
            identify.join(", ")
        );
    }
    tool(robot, &mut out);
    surroundings(robot, &mut out);
    out
}

/// A line for a key; commented out where it has no value.
fn key(out: &mut String, key: &str, value: Option<f64>, example: f64, comment: &str) {
    // writing to a String cannot fail
    let _ = match value {
        Some(v) => writeln!(out, "{key} = {v:?}     # {comment}"),
        None => writeln!(out, "# {key} = {example:?}     # {comment}"),
    };
}

/// `[tool]`, its frame the link that carries it.
fn tool(robot: &Robot, out: &mut String) {
    let quoted = |s: &str| toml::Value::String(s.to_string()).to_string();
    let Some(tool) = &robot.tool else {
        let last = robot.bodies.last().map_or("tip", |b| b.name.as_str());
        let _ = write!(
            out,
            "\n# Limits of the tool point.\n# [tool]\n# frame = {}     # a link\n# point = [0.0, 0.0, 0.1]     # m, in \
             its axes\n# speed = 1.0     # m/s\n# acceleration = 10.0     # m/s^2\n",
            quoted(last)
        );
        return;
    };
    let p = tool.point;
    let _ = write!(
        out,
        "\n# Limits of the tool point.\n[tool]\nframe = {}\npoint = [{:?}, {:?}, {:?}]     # m, in its axes\n",
        quoted(&robot.bodies[tool.body].name),
        p.x,
        p.y,
        p.z
    );
    for (key, limit, unit) in [
        ("speed", tool.speed, "m/s"),
        ("acceleration", tool.acceleration, "m/s^2"),
    ] {
        let _ = match limit.is_finite() {
            true => writeln!(out, "{key} = {limit:?}     # {unit}"),
            false => writeln!(out, "# {key} = 10.0     # {unit}: unlimited"),
        };
    }
}

/// Steps a metre to which fitted volumes are written.
const STEPS: f64 = 1e4;

/// `[collision]` and the volumes of the links, in link frames, a tenth of a millimetre larger than fitted.
fn surroundings(robot: &Robot, out: &mut String) {
    let quoted = |s: &str| toml::Value::String(s.to_string()).to_string();
    let geometry = &robot.geometry;
    if geometry.is_empty() && geometry.obstacles.is_empty() {
        return;
    }
    out.push_str(
        "\n# What the robot must not touch. Volumes stand for the geometry of the URDF; remove one and it is \
         fitted anew.\n[collision]\n",
    );
    let _ = match geometry.floor {
        Some(floor) => writeln!(
            out,
            "floor = {floor}     # the plane z = 0 of the base frame"
        ),
        None => writeln!(
            out,
            "# floor = true     # the plane z = 0 of the base frame; left out, where the base ends"
        ),
    };
    let margin = geometry.margin.unwrap_or(crate::robot::geometry::MARGIN);
    let _ = writeln!(
        out,
        "margin = {margin:?}     # m: least distance of any two"
    );
    let pairs: Vec<String> = geometry
        .ignore
        .iter()
        .map(|[a, b]| format!("[{}, {}]", quoted(a), quoted(b)))
        .collect();
    let _ = writeln!(
        out,
        "ignore = [{}]     # pairs of links that are not looked at",
        pairs.join(", ")
    );
    if let Some(path) = &geometry.srdf {
        // the file may go to another folder
        let path = std::path::absolute(path).unwrap_or_else(|_| path.clone());
        let path = quoted(&path.to_string_lossy());
        let _ = writeln!(
            out,
            "srdf = {path}     # its disabled pairs are not looked at"
        );
    }
    if let Some(check) = geometry.check {
        let _ = writeln!(
            out,
            "check = {check}     # whether collisions are looked at"
        );
    }
    for volume in &geometry.volumes().links {
        let link = &geometry.links[volume.link];
        if geometry.volumes().unseen.contains(&volume.link) {
            let _ = writeln!(
                out,
                "\n# {}: part of its geometry could not be read",
                link.name
            );
            continue;
        }
        let name = quoted(&link.name);
        for shape in &volume.shapes {
            let _ = writeln!(out, "\n[[volume]]\nlink = {name}");
            shape_keys(&shape.moved(&link.pose.inverse()), Some(STEPS), out);
        }
    }
    for o in &geometry.obstacles {
        let _ = writeln!(out, "\n[[obstacle]]\nname = {}", quoted(o.name()));
        match o {
            Obstacle::Plane { normal, offset, .. } => {
                let _ = writeln!(
                    out,
                    "kind = \"plane\"\nnormal = {}\noffset = {offset:?}",
                    three(normal, None)
                );
            }
            Obstacle::Solid { shape, .. } => shape_keys(shape, None, out),
        }
    }
    for k in &geometry.keep_in {
        let corner = |v: &Vector3<f64>| {
            // infinite where there is no bound, which TOML writes the same
            format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z)
        };
        let _ = writeln!(
            out,
            "\n[[keep_in]]\nframe = {}\nlow = {}\nhigh = {}",
            quoted(&k.frame),
            corner(&k.low),
            corner(&k.high)
        );
    }
}

/// Three numbers, to whole steps where there are steps.
fn three(v: &Vector3<f64>, step: Option<f64>) -> String {
    // no minus before a zero
    let [x, y, z] = [v.x, v.y, v.z].map(|x| step.map_or(x, |s| (x * s).round() / s) + 0.0);
    format!("[{x:?}, {y:?}, {z:?}]")
}

/// Kind and dimensions of a volume. With a `step`, steps a metre, its lengths are whole ones, and one larger than they were.
fn shape_keys(shape: &Shape, step: Option<f64>, out: &mut String) {
    let length = |x: f64| match step {
        Some(s) => ((x * s).ceil() + 1.0) / s,
        None => x,
    };
    let three = |v: &Vector3<f64>| three(v, step);
    // writing to a String cannot fail
    let _ = match shape {
        Shape::Sphere { centre, radius } => writeln!(
            out,
            "kind = \"sphere\"\ncentre = {}\nradius = {:?}",
            three(centre),
            length(*radius)
        ),
        Shape::Capsule { from, to, radius } => writeln!(
            out,
            "kind = \"capsule\"\nfrom = {}\nto = {}\nradius = {:?}",
            three(from),
            three(to),
            length(*radius)
        ),
        Shape::Box { pose, half } => {
            let (r, p, y) = Rotation3::from_matrix_unchecked(pose.rotation).euler_angles();
            let size = half.map(|h| length(2.0 * h));
            let size = format!("[{:?}, {:?}, {:?}]", size.x, size.y, size.z);
            let (at, turn) = match step {
                Some(_) => (
                    format!(
                        "{:.5}, {:.5}, {:.5}",
                        pose.position.x, pose.position.y, pose.position.z
                    ),
                    format!("{r:.6}, {p:.6}, {y:.6}"),
                ),
                None => (
                    format!(
                        "{:?}, {:?}, {:?}",
                        pose.position.x, pose.position.y, pose.position.z
                    ),
                    format!("{r:?}, {p:?}, {y:?}"),
                ),
            };
            writeln!(out, "kind = \"box\"\nsize = {size}\npose = [{at}, {turn}]")
        }
        Shape::Hull(h) => {
            let points: Vec<String> = h.points.iter().map(three).collect();
            writeln!(
                out,
                "kind = \"hull\"\npoints = [{}]\nradius = {:?}",
                points.join(", "),
                length(h.radius)
            )
        }
    };
}
