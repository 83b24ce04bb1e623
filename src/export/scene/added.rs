//! MJCF: bodies, joints and tendons that a scene has not and a model has.

use super::matching::{Pose, pose};
use super::mjcf::Work;
use super::text::Edits;
use crate::error::Result;
use crate::export::Element;
use crate::export::escape;
use crate::export::mujoco::body::{inertial, placement, tilting};
use crate::export::mujoco::{Parts, free_name, stiff};
use crate::robot::mjcf::xml::Node;
use crate::robot::{Inertia, Motion, Robot};
use nalgebra::Matrix3;

/// What a class may have for all joints, and these are not to have.
const PLAIN: &str = "pos=\"0 0 0\" ref=\"0\" springref=\"0\" armature=\"0\" frictionloss=\"0\" limited=\"false\" \
                     actuatorfrclimited=\"false\"";

/// A joint that is new: where its position stands in `qpos` and its velocity in `qvel` of the file as it was.
struct New {
    place: [usize; 2],
}

impl Work<'_> {
    /// Everything that is new. `loads`: by body of the model, in the frame of its link.
    pub(super) fn added(&mut self, parts: &Parts, loads: Vec<(usize, Inertia)>) -> Result<()> {
        for (b, load) in loads {
            self.load(b, &load);
        }
        let mut new = Vec::new();
        for (j, on) in parts.joints.iter().enumerate() {
            if let Some(spring) = on.twist {
                new.extend(self.twist(j, spring)?);
            }
        }
        if let Some(base) = parts.base {
            new.extend(self.base(base)?);
        }
        self.keyframes(&new)?;
        self.tendons(parts);
        Ok(())
    }

    /// The names of the joints that the files of a model have, with those of the scene.
    fn renamed(&self) -> Robot {
        let mut robot = self.model.robot.clone();
        for (body, name) in robot.bodies.iter_mut().zip(&self.scene.joints) {
            let joint = &mut robot.joints[body.coordinate];
            if joint.name == body.joint_name {
                joint.name.clone_from(name);
            }
            body.joint_name.clone_from(name);
        }
        robot
    }

    fn load(&mut self, b: usize, load: &Inertia) {
        let link = &self.scene.robot.bodies[self.scene.body[b]].name;
        let Some(part) = self.parts.iter().find(|p| p.link == *link) else {
            return;
        };
        let (node, anchor) = (part.node, part.anchor);
        let load = load.in_parent(&Matrix3::identity(), &anchor);
        let mut name = "payload".to_string();
        while self.parts.iter().any(|p| p.link == name) {
            name.push('_');
        }
        let line = format!("<body name=\"{name}\">{}</body>", inertial(&load));
        self.edits.inside(node, std::slice::from_ref(&line));
        self.edits
            .say(node, format!("body {name}"), "", [None, Some(line)]);
    }

    /// A second joint behind that of a coordinate.
    fn twist(&mut self, j: usize, [k, cubic, damping]: [f64; 3]) -> Result<Option<New>> {
        let (b, joint) = self.leader(j);
        let Some(e) = self.element(&joint) else {
            return Ok(None);
        };
        let name = crate::export::mujoco::twist_joint(&self.renamed(), j);
        if self.element(&name).is_some() {
            return Err(e.node.error(format!(
                "the scene has a joint `{name}`, the name of the one that is to be added; rename it"
            )));
        }
        let kind = match self.model.robot.bodies[b].motion {
            Motion::Revolute => "hinge",
            Motion::Prismatic => "slide",
        };
        let stiffness = match cubic {
            0.0 => k.to_string(),
            c => format!("{k} 0 {c}"),
        };
        let line = format!(
            "<joint name=\"{}\" type=\"{kind}\" axis=\"{}\" {} stiffness=\"{stiffness}\" damping=\"{damping}\"/>",
            escape(&name),
            e.text("axis").unwrap_or("0 0 1"),
            PLAIN.replace(
                "pos=\"0 0 0\"",
                &format!("pos=\"{}\"", e.text("pos").unwrap_or("0 0 0"))
            ),
        );
        self.edits.after(e.node, std::slice::from_ref(&line));
        self.edits
            .say(e.node, format!("joint {name}"), "", [None, Some(line)]);
        let place = self.place(e.node).map(|[q, v]| [q + 1, v + 1]);
        Ok(Some(New {
            place: place.unwrap_or_default(),
        }))
    }

    /// A base that tilts: a body around the first of the robot.
    fn base(&mut self, base: &Element) -> Result<Vec<New>> {
        let Element::Base {
            stiffness,
            damping,
            inertia,
        } = base
        else {
            return Ok(Vec::new());
        };
        let robot = self.renamed();
        let roots: Vec<usize> = (0..robot.bodies.len())
            .filter(|&b| robot.bodies[b].parent.is_none())
            .collect();
        let link = |b: usize| &self.scene.robot.bodies[self.scene.body[b]];
        let part = match roots[..] {
            [root] => {
                let part = self.parts.iter().find(|p| p.link == link(root).name);
                // of several joints of one body the first is not that of its link
                part.filter(|p| p.joints.len() == 1).map(|p| (root, p))
            }
            _ => None,
        };
        let Some((root, part)) = part else {
            self.left_out
                .push("the springs of the base: not one body stands on it by one joint".into());
            return Ok(Vec::new());
        };
        let node = part.node;
        // pose of the link in the world with its joint at zero; of the body in the file; of what that stands in
        let body = link(root);
        let world = pose(&body.rotation, &body.position);
        let e = crate::robot::mjcf::xml::Element {
            node,
            defaults: None,
        };
        let own = pose(
            &self.compiler.rotation(&e)?,
            &e.vector("pos")?.unwrap_or_default(),
        );
        let turned = self.turned(root, part)?;
        let outer = world * turned.inverse() * own.inverse();
        let wrapper = outer.inverse() * self.matched.base;
        let inner = wrapper.inverse();
        let mut lines = vec![format!(
            "<body name=\"{}\"{}>",
            free_name(&robot, "base_tilt".into()),
            placed(&wrapper)
        )];
        lines.push(format!("  {}", tilting(inertia)));
        let names = crate::export::mujoco::base_joints(&robot);
        let mut new = Vec::new();
        let place = self.place(node).unwrap_or_default();
        // about y first, then about x
        for (axis, direction) in [(1, "0 1 0"), (0, "1 0 0")] {
            if stiffness[axis].is_finite() {
                lines.push(format!(
                    "  <joint name=\"{}\" type=\"hinge\" axis=\"{direction}\" {PLAIN} stiffness=\"{}\" damping=\"{}\"/>",
                    names[axis], stiffness[axis], damping[axis]
                ));
                new.push(New { place });
            }
        }
        let mut end = vec!["</body>".to_string()];
        if !placed(&inner).is_empty() {
            lines.push(format!("  <frame{}>", placed(&inner)));
            end.insert(0, "  </frame>".into());
        }
        self.edits.before(node, &lines);
        self.edits.after(node, &end);
        let said = lines.iter().map(|l| l.trim()).collect::<Vec<_>>().join(" ");
        self.edits
            .say(node, "body base_tilt".into(), "", [None, Some(said)]);
        Ok(new)
    }

    /// The frame of the link of a body in that of the body as the file has it.
    fn turned(&self, b: usize, part: &crate::robot::mjcf::body::Part) -> Result<Pose> {
        let body = &self.scene.robot.bodies[self.scene.body[b]];
        let e = part.joints.first().map(|(_, e)| *e);
        let angle = e
            .map(|e| e.number("ref"))
            .transpose()?
            .flatten()
            .unwrap_or(0.0);
        let shift = Pose::translation(part.anchor.x, part.anchor.y, part.anchor.z);
        Ok(match body.motion {
            Motion::Revolute => {
                let turn = nalgebra::Unit::new_normalize(body.axis);
                let turn =
                    nalgebra::UnitQuaternion::from_axis_angle(&turn, -angle * self.compiler.angle);
                shift * Pose::from_parts(nalgebra::Translation3::identity(), turn)
            }
            Motion::Prismatic => {
                let back = body.axis * -angle;
                shift * Pose::translation(back.x, back.y, back.z)
            }
        })
    }

    /// Where the positions and velocities begin of the joints of a body, or those of a joint.
    fn place(&self, of: &Node) -> Option<[usize; 2]> {
        let mut at = [0, 0];
        let worlds = self.root.all("worldbody");
        for world in worlds {
            if count(world, of, &mut at) {
                return Some(at);
            }
        }
        None
    }

    /// The keyframes with the new joints at rest.
    fn keyframes(&mut self, new: &[New]) -> Result<()> {
        for key in self.root.all("keyframe").flat_map(|k| &k.children) {
            for (which, name) in [(0, "qpos"), (1, "qvel")] {
                let Some(text) = key.own(name).filter(|_| !new.is_empty()) else {
                    continue;
                };
                let mut all = key.numbers_in(name, text)?;
                let mut places: Vec<usize> = new.iter().map(|n| n.place[which]).collect();
                places.sort_unstable();
                for at in places.into_iter().rev() {
                    all.insert(at.min(all.len()), 0.0);
                }
                let value: Vec<String> = all.iter().map(f64::to_string).collect();
                self.edits
                    .set(key, &Edits::called(key), name, value.join(" "), None);
            }
        }
        Ok(())
    }

    /// What two joints share, in a section of its own.
    fn tendons(&mut self, parts: &Parts) {
        for c in &parts.couplings {
            let Element::Coupling {
                joints,
                ratio,
                coulomb,
                viscous,
                inertia,
            } = c
            else {
                continue;
            };
            let [a, b] = joints.map(|j| escape(&self.leader(j).1));
            let line = format!(
                "<tendon><fixed damping=\"{viscous}\" frictionloss=\"{coulomb}\" armature=\"{inertia}\" \
                 stiffness=\"0\" limited=\"false\" {}><joint joint=\"{a}\" coef=\"1\"/><joint joint=\"{b}\" \
                 coef=\"{ratio}\"/></fixed></tendon>",
                stiff()
            );
            self.edits.inside(self.root, std::slice::from_ref(&line));
            self.edits.say(
                self.root,
                format!("tendon over {a} and {b}"),
                "",
                [None, Some(line)],
            );
        }
    }
}

/// `pos` and `quat` of a pose; nothing where it is none.
fn placed(at: &Pose) -> String {
    let (p, q) = (at.translation.vector, at.rotation);
    match p.norm() < 1e-12 && q.angle() < 1e-12 {
        true => String::new(),
        false => format!(" {}", placement(&p, &q)),
    }
}

/// Counts positions and velocities up to an element; whether it was found.
fn count(node: &Node, of: &Node, at: &mut [usize; 2]) -> bool {
    let is = |n: &Node| n.file == of.file && n.span == of.span;
    // the joints of a body come before those of the bodies in it
    for joint in node.children.iter().filter(|c| c.tag.ends_with("joint")) {
        if is(joint) {
            return true;
        }
        let [q, v] = match (joint.tag.as_str(), joint.own("type")) {
            ("freejoint", _) | (_, Some("free")) => [7, 6],
            (_, Some("ball")) => [4, 3],
            _ => [1, 1],
        };
        *at = [at[0] + q, at[1] + v];
    }
    let inner = node.children.iter();
    for child in inner.filter(|c| matches!(c.tag.as_str(), "body" | "frame")) {
        if is(child) || count(child, of, at) {
            return true;
        }
    }
    false
}
