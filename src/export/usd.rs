//! USD with the schema of UsdPhysics, and rotor inertia as PhysX has it. Not run in a simulator.
//!
//! Friction, offsets and effects have no attribute in UsdPhysics. A drive with a damping towards zero velocity is viscous
//! friction, per degree as the schema wants it.

use super::mujoco::solid;
use super::{Format, Model, Part, base_name, remark};
use crate::error::Result;
use crate::robot::{Body, JointTerm, Motion, Robot};
use nalgebra::{Matrix3, Rotation3, SymmetricEigen, UnitQuaternion, Vector3};
use std::fmt::Write;

/// USD, as text.
pub struct Usd;

impl Format for Usd {
    fn name(&self) -> &'static str {
        "USD"
    }

    fn file(&self) -> &'static str {
        "robot.usda"
    }

    fn has(&self, part: Part) -> bool {
        match part {
            Part::Bodies | Part::Frames | Part::Gravity => true,
            Part::Term(term) => matches!(term, JointTerm::Viscous | JointTerm::Armature),
        }
    }

    fn write(&self, model: &Model) -> Result<String> {
        let robot = model.robot;
        let base = base_name(robot);
        let mut names = Names::default();
        let root = names.of(&robot.name);
        let scene = names.of("physicsScene");
        let base = names.of(&base);
        let links: Vec<String> = robot.bodies.iter().map(|b| names.of(&b.name)).collect();
        let mut out = format!(
            "#usda 1.0\n(\n    defaultPrim = \"{root}\"\n    metersPerUnit = 1\n    kilogramsPerUnit = 1\n    upAxis = \"Z\"\n)\n\n\
             # Written by excite after the schema of UsdPhysics; not run in a simulator.\n"
        );
        for joint in &robot.joints {
            for (term, what) in [
                (JointTerm::Coulomb, "Coulomb friction"),
                (JointTerm::Offset, "torque offset"),
            ] {
                let value = joint.terms[term as usize];
                if value != 0.0 {
                    let _ = writeln!(
                        out,
                        "# UsdPhysics has no attribute for the {what} of {}: {value}",
                        line(&joint.name)
                    );
                }
            }
        }
        for text in remark::lines(model.remarks, self) {
            let _ = writeln!(out, "# {}", line(&text));
        }
        let g = robot.gravity;
        let size = g.norm();
        let d = if size > 0.0 { g / size } else { -Vector3::z() };
        let _ = write!(
            out,
            "\ndef PhysicsScene \"{scene}\"\n{{\n    vector3f physics:gravityDirection = ({}, {}, {})\n    \
             float physics:gravityMagnitude = {size}\n}}\n\ndef Xform \"{root}\" (\n    prepend apiSchemas = \
             [\"PhysicsArticulationRootAPI\"]\n)\n{{\n    def Xform \"{base}\" (\n        prepend apiSchemas = \
             [\"PhysicsRigidBodyAPI\", \"PhysicsMassAPI\"]\n    )\n    {{\n        float physics:mass = 1\n    }}\n\n    \
             def PhysicsFixedJoint \"{}\"\n    {{\n        rel physics:body1 = </{root}/{base}>\n    }}\n",
            d.x,
            d.y,
            d.z,
            names.of("base_to_world")
        );
        let poses = places(robot);
        for (b, body) in robot.bodies.iter().enumerate() {
            link(body, &links[b], &poses[b], &mut out);
            let parent = body.parent.map_or(&base, |p| &links[p]);
            joint(
                robot,
                body,
                [&root, parent, &links[b]],
                &names.of(&body.joint_name),
                &mut out,
            );
        }
        Ok(out + "}\n")
    }
}

/// Names of prims: letters, digits and underscores, each once.
#[derive(Default)]
struct Names(Vec<String>);

impl Names {
    fn of(&mut self, name: &str) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let mut out: String = name.chars().map(plain).collect();
        if !out.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
            out.insert(0, '_');
        }
        while self.0.contains(&out) {
            out.push('_');
        }
        self.0.push(out.clone());
        out
    }
}

fn line(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
}

fn quat(r: &Matrix3<f64>) -> String {
    let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*r));
    format!("({}, {}, {}, {})", q.w, q.i, q.j, q.k)
}

fn vector(v: &Vector3<f64>) -> String {
    format!("({}, {}, {})", v.x, v.y, v.z)
}

/// Poses of the links with all joints at zero.
fn places(robot: &Robot) -> Vec<(Matrix3<f64>, Vector3<f64>)> {
    let mut out: Vec<(Matrix3<f64>, Vector3<f64>)> = Vec::new();
    for body in &robot.bodies {
        let (r, p) = body
            .parent
            .map_or((Matrix3::identity(), Vector3::zeros()), |p| out[p]);
        out.push((r * body.rotation, p + r * body.position));
    }
    out
}

fn link(body: &Body, name: &str, (r, p): &(Matrix3<f64>, Vector3<f64>), out: &mut String) {
    let inertia = solid(&body.inertia);
    let SymmetricEigen {
        eigenvalues: moments,
        eigenvectors: mut axes,
    } = inertia.tensor_com().symmetric_eigen();
    if axes.determinant() < 0.0 {
        axes.column_mut(0).neg_mut();
    }
    let _ = write!(
        out,
        "\n    def Xform \"{name}\" (\n        prepend apiSchemas = [\"PhysicsRigidBodyAPI\", \"PhysicsMassAPI\"]\n    )\n    {{\n        \
         double3 xformOp:translate = {}\n        quatd xformOp:orient = {}\n        uniform token[] xformOpOrder = \
         [\"xformOp:translate\", \"xformOp:orient\"]\n        float physics:mass = {}\n        point3f physics:centerOfMass = {}\n        \
         float3 physics:diagonalInertia = {}\n        quatf physics:principalAxes = {}\n    }}\n",
        vector(p),
        quat(r),
        inertia.mass(),
        vector(&inertia.com().unwrap_or_default()),
        vector(&moments),
        quat(&axes)
    );
}

fn joint(
    robot: &Robot,
    body: &Body,
    [root, parent, child]: [&str; 3],
    name: &str,
    out: &mut String,
) {
    let joint = &robot.joints[body.coordinate];
    let (kind, drive, degrees) = match body.motion {
        Motion::Revolute => (
            "PhysicsRevoluteJoint",
            "angular",
            180.0 / std::f64::consts::PI,
        ),
        Motion::Prismatic => ("PhysicsPrismaticJoint", "linear", 1.0),
    };
    // the axis of the joint is the x of its frame
    let turn = Rotation3::rotation_between(&Vector3::x(), &body.axis);
    let turn = turn
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI));
    let [low, high] = joint.limits.position.map(|x| body.ratio * x + body.offset);
    let (low, high) = (low.min(high), low.max(high));
    let mut limits = String::new();
    for (side, x) in [("lower", low), ("upper", high)] {
        if x.is_finite() {
            let _ = writeln!(
                limits,
                "        float physics:{side}Limit = {}",
                x * degrees
            );
        }
    }
    let leads = body.joint_name == joint.name;
    let term = |t: JointTerm| {
        if leads {
            joint.terms[t as usize].max(0.0)
        } else {
            0.0
        }
    };
    let mut more = String::new();
    if !leads {
        let _ = writeln!(
            more,
            "        # follows {}: {} times its position and {}; UsdPhysics has no such joint",
            line(&joint.name),
            body.ratio,
            body.offset
        );
    }
    if leads && joint.limits.effort.is_finite() {
        let _ = writeln!(
            more,
            "        float drive:{drive}:physics:maxForce = {}",
            joint.limits.effort
        );
    }
    if leads && joint.limits.velocity.is_finite() {
        let _ = writeln!(
            more,
            "        float physxJoint:maxJointVelocity = {}",
            joint.limits.velocity * degrees
        );
    }
    let _ = write!(
        out,
        "\n    def {kind} \"{name}\" (\n        prepend apiSchemas = [\"PhysicsDriveAPI:{drive}\", \"PhysxJointAPI\"]\n    )\n    {{\n        \
         rel physics:body0 = </{root}/{parent}>\n        rel physics:body1 = </{root}/{child}>\n        uniform token physics:axis = \"X\"\n        \
         point3f physics:localPos0 = {}\n        quatf physics:localRot0 = {}\n        point3f physics:localPos1 = (0, 0, 0)\n        \
         quatf physics:localRot1 = {}\n{limits}        uniform token drive:{drive}:physics:type = \"force\"\n        \
         float drive:{drive}:physics:stiffness = 0\n        float drive:{drive}:physics:damping = {}\n        \
         float physxJoint:armature = {}\n{more}    }}\n",
        vector(&body.position),
        quat(&(body.rotation * turn.matrix())),
        quat(turn.matrix()),
        term(JointTerm::Viscous) / degrees,
        term(JointTerm::Armature)
    );
}
