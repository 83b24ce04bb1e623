//! A model written into an MJCF.

use super::bodies::{SAME, Scene, minus, same};
use super::matching::{Matched, Pose, matched, pose};
use super::text::Edits;
use super::{Edited, assets};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::export::Model;
use crate::export::effects::Effects;
use crate::export::mujoco::body::inertial;
use crate::export::mujoco::{Parts, solid};
use crate::export::{Format, possible};
use crate::robot::mjcf::body::{Part, Reader};
use crate::robot::mjcf::compiler::Compiler;
use crate::robot::mjcf::of;
use crate::robot::mjcf::xml::{Element, Node, sources};
use crate::robot::{Body, Inertia, Motion};
use nalgebra::{Matrix3, Vector3};
use std::collections::HashSet;
use std::path::Path;

/// What makes bodies that are not written in the file.
const MAKERS: [&str; 4] = ["replicate", "attach", "composite", "flexcomp"];

/// A scene in the making.
pub(super) struct Work<'a> {
    pub(super) model: &'a Model<'a>,
    pub(super) scene: Scene,
    pub(super) matched: Matched,
    /// all of the file, what is no part of the robot included
    pub(super) root: &'a Node,
    pub(super) compiler: &'a Compiler,
    pub(super) parts: Vec<Part<'a>>,
    pub(super) edits: Edits,
    pub(super) left_out: Vec<String>,
}

pub(super) fn write(model: &Model, file: &Path, text: &str, folder: &Path) -> Result<Edited> {
    let (root, texts) = sources(text, file)?;
    let mut notes = Vec::new();
    let tree = without_others(&root, &mut notes);
    let compiler = Compiler::of(&root)?;
    let mut reader = Reader::new(&compiler);
    reader.lenient = true;
    let urdf = of(&tree, &compiler, &mut reader, file)?;
    let scene = Scene::new(model, urdf, file)?;
    let matched = stand(model, &scene, file)?;
    let mut work = Work {
        model,
        scene,
        matched,
        root: &root,
        compiler: &compiler,
        parts: std::mem::take(&mut reader.parts),
        edits: Edits::new(texts),
        left_out: Vec::new(),
    };
    let names = assets::names(file, &mut work.edits, folder)?;
    assets::mjcf(file, &root, &mut work.edits, folder);
    let parts = Parts::of(model);
    work.gravity()?;
    let loads = work.bodies(&parts, file)?;
    for (j, on) in parts.joints.iter().enumerate() {
        work.joint(j, on)?;
        work.drive(j, on)?;
    }
    work.added(&parts, loads)?;
    work.left_out.extend(parts.left_out(model.robot));
    let written = work.edits.texts().into_iter().zip(&names);
    let files = written
        .map(|((_, text), name)| (name.clone(), text))
        .collect();
    let mut warnings = work.scene.warnings;
    if !notes.is_empty() {
        warnings.push(Warning::new(
            WarningKind::EntryIgnored,
            file.display().to_string(),
            format!("{} left as they are", notes.join(", ")),
        ));
    }
    for line in parts.versions() {
        warnings.push(Warning::new(
            WarningKind::EntryIgnored,
            file.display().to_string(),
            line,
        ));
    }
    Ok(Edited {
        scene: file.to_path_buf(),
        file: names
            .last()
            .map_or_else(String::new, |n| n.display().to_string()),
        files,
        changes: work.edits.changes,
        left_out: work.left_out,
        effects: effects(model, &work.scene.joints),
        warnings,
    })
}

/// Where the robot stands in the scene, and which body is which.
pub(super) fn stand(model: &Model, scene: &Scene, file: &Path) -> Result<Matched> {
    let ours = model.plant.robot();
    let mut bases = vec![Pose::identity()];
    for (body, &s) in ours.bodies.iter().zip(&scene.body) {
        if body.parent.is_some() {
            continue;
        }
        let theirs = &scene.robot.bodies[s];
        // what stands below it
        let joint = scene.urdf.joints.iter().find(|j| j.child == theirs.name);
        let mut at = joint.map(|j| j.parent.clone());
        while let Some(link) = at {
            if let Some((None, r, p)) = scene.urdf.frame(&link, |_| false, &Default::default()) {
                bases.push(pose(&r, &p));
            }
            let joint = scene.urdf.joints.iter().find(|j| j.child == link);
            at = joint.map(|j| j.parent.clone());
        }
        let [a, b] = [theirs, body].map(|b| pose(&b.rotation, &b.position));
        if theirs.parent.is_none() {
            bases.push(a * b.inverse());
        }
    }
    matched(ours, &scene.robot, &scene.body, &bases, file)
}

/// The functions with the names of the joints in the scene.
fn effects(model: &Model, joints: &[String]) -> Option<String> {
    let mut robot = model.robot.clone();
    let mut others = false;
    for (body, name) in robot.bodies.iter_mut().zip(joints) {
        if body.joint_name == *name {
            continue;
        }
        others = true;
        let joint = &mut robot.joints[body.coordinate];
        if joint.name == body.joint_name {
            joint.name.clone_from(name);
        }
        body.joint_name.clone_from(name);
    }
    let model = Model {
        robot: &robot,
        ..*model
    };
    let text = (others && Effects.needed(&model)).then(|| Effects.write(&model))?;
    text.ok()
}

/// The file without what is no part of a robot that stands.
fn without_others(root: &Node, notes: &mut Vec<String>) -> Node {
    let mut out = root.clone();
    out.children
        .retain(|c| !matches!(c.tag.as_str(), "actuator" | "tendon"));
    for world in out.children.iter_mut().filter(|c| c.tag == "worldbody") {
        standing(world, notes);
    }
    let mut names = HashSet::new();
    for world in out.all("worldbody") {
        joints(world, &mut names);
    }
    for node in out.children.iter_mut().filter(|c| c.tag == "equality") {
        node.children.retain(|c| {
            let keep = c.tag == "joint"
                && ["joint1", "joint2"]
                    .iter()
                    .all(|k| c.own(k).is_some_and(|n| names.contains(n)));
            if !keep && c.own("active") != Some("false") {
                notes.push(format!("line {}: equality {}", c.line, c.tag));
            }
            keep
        });
    }
    out
}

fn standing(node: &mut Node, notes: &mut Vec<String>) {
    node.children.retain(|c| {
        let free = |j: &Node| {
            j.tag == "freejoint"
                || j.tag == "joint" && matches!(j.own("type"), Some("free" | "ball"))
        };
        let keep =
            !(MAKERS.contains(&c.tag.as_str()) || c.tag == "body" && c.children.iter().any(free));
        if !keep {
            notes.push(format!("line {}: {}", c.line, Edits::called(c)));
        }
        keep
    });
    let bodies = node.children.iter_mut();
    for child in bodies.filter(|c| matches!(c.tag.as_str(), "body" | "frame")) {
        standing(child, notes);
    }
}

fn joints(node: &Node, names: &mut HashSet<String>) {
    for child in &node.children {
        match child.tag.as_str() {
            "joint" => names.extend(child.own("name").map(String::from)),
            "body" | "frame" => joints(child, names),
            _ => {}
        }
    }
}

/// Way of a body along its joint from one model to another, rad or m; `None` where it is moved otherwise.
pub(super) fn moved(before: &Body, after: &Body) -> Option<f64> {
    let [a, b] = [before, after].map(|b| pose(&b.rotation, &b.position));
    let way = a.inverse() * b;
    let turn = way.rotation.scaled_axis();
    let (along, across) = match before.motion {
        Motion::Revolute => (turn, way.translation.vector),
        Motion::Prismatic => (way.translation.vector, turn),
    };
    let by = along.dot(&before.axis);
    let rest = (along - before.axis * by).norm().max(across.norm());
    let small = |x: f64| x < 1e-12;
    match small(rest - 1e-9 * by.abs()) {
        true if small(by.abs()) => Some(0.0),
        true => Some(by),
        false => None,
    }
}

impl<'a> Work<'a> {
    /// Body of a coordinate, and the name of its joint in the scene.
    pub(super) fn leader(&self, j: usize) -> (usize, String) {
        let robot = self.model.plant.robot();
        let of = |b: &Body| b.coordinate == j && b.joint_name == robot.joints[j].name;
        let b = robot.bodies.iter().position(of).unwrap_or_default();
        (b, self.scene.joints.get(b).cloned().unwrap_or_default())
    }

    /// A joint of the scene, with what it has from its class.
    pub(super) fn element(&self, name: &str) -> Option<Element<'a>> {
        let mut all = self.parts.iter().flat_map(|p| &p.joints);
        all.find(|(n, _)| n == name).map(|(_, e)| *e)
    }

    /// The element that an option stands in, the last that states it.
    fn stated(&self, name: &str) -> Option<&'a Node> {
        self.root
            .all("option")
            .filter(|o| o.own(name).is_some())
            .last()
    }

    /// A number of `<option>`.
    pub(super) fn option(&self, name: &str) -> Result<Option<f64>> {
        let node = self.stated(name);
        let text = node.and_then(|n| Some((n, n.own(name)?)));
        let all = text.map(|(n, t)| n.numbers_in(name, t)).transpose()?;
        Ok(all.and_then(|x| x.first().copied()))
    }

    fn gravity(&mut self) -> Result<()> {
        let wanted = self.matched.base.rotation * self.model.robot.gravity;
        let now = self.scene.robot.gravity;
        if (wanted - now).norm() <= SAME * wanted.norm().max(1.0) {
            return Ok(());
        }
        let off = |o: &Node| o.all("flag").any(|f| f.own("gravity") == Some("disable"));
        if self.root.all("option").any(off) {
            self.left_out
                .push("gravity, which the scene switches off".into());
            return Ok(());
        }
        let value = format!("{} {} {}", wanted.x, wanted.y, wanted.z);
        let node = self.stated("gravity").or(self.root.all("option").next());
        match (node, self.root.children.first()) {
            (Some(node), _) => self
                .edits
                .set(node, "option", "gravity", value, Some("0 0 -9.81")),
            (None, Some(first)) => {
                self.edits
                    .before(first, &[format!("<option gravity=\"{value}\"/>")]);
                let old = Some("0 0 -9.81".to_string());
                self.edits
                    .say(first, "option".into(), "gravity", [old, Some(value)]);
            }
            _ => {}
        }
        Ok(())
    }

    /// Inertia of all bodies; gives the loads that are to be bodies of their own, in the frame of their link.
    fn bodies(&mut self, parts: &Parts, file: &Path) -> Result<Vec<(usize, Inertia)>> {
        let unknown: HashSet<String> = self
            .parts
            .iter()
            .filter(|p| !p.known)
            .map(|p| p.link.clone())
            .collect();
        let mut loads = Vec::new();
        for b in 0..self.model.robot.bodies.len() {
            let at = self.matched.at[b];
            let turn = at.rotation.to_rotation_matrix().into_inner();
            let here = |i: &Inertia| i.in_parent(&turn, &at.translation.vector);
            let target = here(&solid(&self.model.robot.bodies[b].inertia));
            let link = self.scene.robot.bodies[self.scene.body[b]].name.clone();
            let node = self.parts.iter().find(|p| p.link == link);
            if node.is_none() {
                // between the joints of one body: nothing can have a mass there
                if target.mass() > 1e-5 {
                    return Err(Error::file(
                        file,
                        format!("joint `{}`", self.scene.joints[b]),
                        format!(
                            "another joint follows in the same body, so that nothing can weigh the {} kg of the model \
                             between them; write two bodies",
                            target.mass()
                        ),
                    ));
                }
                continue;
            }
            let mut links = None;
            for (_, load) in parts.loads.iter().filter(|(of, _)| *of == b) {
                let load = here(&solid(load));
                let without = minus(&target, &load);
                let real = load.mass() > 0.0 && without.mass() > 0.0;
                if real && same(&possible(&without), &without, &target, SAME) {
                    let found = self.scene.links(b, &without, &unknown, &solid, file);
                    if let Ok(found) = found {
                        links = Some(found);
                        loads.push((b, load));
                    }
                }
            }
            let links = match links {
                Some(found) => found,
                None => self.scene.links(b, &target, &unknown, &solid, file)?,
            };
            for (link, inertia) in links {
                self.inertial(&link, &inertia)?;
            }
        }
        Ok(loads)
    }

    /// Writes the inertia of a link.
    fn inertial(&mut self, link: &str, inertia: &Inertia) -> Result<()> {
        let Some(part) = self.parts.iter().find(|p| p.link == link) else {
            return Ok(());
        };
        let (node, anchor) = (part.node, part.anchor);
        if self.compiler.from_geoms == Some(true) {
            return Err(node.error(
                "the compiler takes every inertia from geoms (inertiafromgeom=\"true\"), so that no <inertial> \
                 counts; set it to \"auto\"",
            ));
        }
        if self.compiler.total_mass.is_some() {
            return Err(node.error(
                "the compiler scales all masses (settotalmass), so that none can be written; save the model from \
                 MuJoCo (mj_saveLastXML) and name that file",
            ));
        }
        let here = inertia.in_parent(&Matrix3::identity(), &anchor);
        let (mass, com, i) = (
            here.mass(),
            here.com().unwrap_or_default(),
            here.tensor_com(),
        );
        let wanted = [i.m11, i.m22, i.m33, i.m12, i.m13, i.m23];
        let text = |v: &[f64]| v.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        let of = format!("{} inertial", Edits::called(node));
        let pos = text(com.as_slice());
        let Some(stated) = node.all("inertial").next() else {
            let line = inertial(&here);
            match node.children.first() {
                Some(first) => self.edits.before(first, std::slice::from_ref(&line)),
                None => self.edits.inside(node, std::slice::from_ref(&line)),
            }
            let had = Some("from its geoms".to_string());
            self.edits.say(node, of, "", [had, Some(line)]);
            return Ok(());
        };
        let now = self
            .scene
            .own(link)
            .in_parent(&Matrix3::identity(), &anchor);
        let near = |a: f64, b: f64, size: f64| (a - b).abs() <= SAME * size;
        if !near(now.mass(), mass, mass) {
            self.edits.set(stated, &of, "mass", mass.to_string(), None);
        }
        let old: Vector3<f64> = now.com().unwrap_or_default();
        if (old - com).norm() > SAME * com.norm().max(1e-3) {
            self.edits.set(stated, &of, "pos", pos, None);
        }
        let old = now.tensor_com();
        if (old - i).norm() > SAME * i.norm() || mass == 0.0 {
            for key in [
                "diaginertia",
                "quat",
                "axisangle",
                "xyaxes",
                "zaxis",
                "euler",
            ] {
                self.edits.unset(stated, &of, key);
            }
            self.edits
                .set(stated, &of, "fullinertia", text(&wanted), None);
        }
        Ok(())
    }
}
