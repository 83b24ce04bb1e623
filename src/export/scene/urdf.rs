//! A model written into a URDF.

use super::bodies::{SAME, Scene};
use super::mjcf::{moved, stand};
use super::text::Edits;
use super::{Edited, assets};
use crate::error::Result;
use crate::export::{Model, named_moments, possible, rpy};
use crate::robot::mjcf::xml::{Node, sources};
use crate::robot::urdf::Urdf;
use crate::robot::{Inertia, JointTerm, Motion};
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion};
use std::collections::HashSet;
use std::path::Path;

pub(super) fn write(model: &Model, file: &Path, text: &str, folder: &Path) -> Result<Edited> {
    let urdf = Urdf::parse(text, file)?;
    let (root, texts) = sources(text, file)?;
    let scene = Scene::new(model, urdf, file)?;
    let matched = stand(model, &scene, file)?;
    let mut edits = Edits::new(texts);
    let mut left_out = Vec::new();
    let names = assets::names(file, &mut edits, folder)?;
    assets::urdf(file, &root, &mut edits, folder);
    let find = |tag: &str, name: &str| {
        let mut all = root.all(tag).filter(|n| n.own("name") == Some(name));
        all.next().cloned()
    };
    for b in 0..model.robot.bodies.len() {
        let at = matched.at[b];
        let turn = at.rotation.to_rotation_matrix().into_inner();
        let target = possible(&model.robot.bodies[b].inertia);
        let target = target.in_parent(&turn, &at.translation.vector);
        if target.mass() == 0.0 {
            continue;
        }
        for (link, inertia) in scene.links(b, &target, &HashSet::new(), &possible, file)? {
            if let Some(node) = find("link", &link) {
                inertial(&mut edits, &node, &scene.own(&link), &inertia);
            }
        }
    }
    let before = model.plant.robot();
    for (b, body) in model.robot.bodies.iter().enumerate() {
        let joint = &model.robot.joints[body.coordinate];
        let name = &scene.joints[b];
        let Some(node) = find("joint", name) else {
            continue;
        };
        match moved(&before.bodies[b], body) {
            Some(0.0) => {}
            Some(by) => origin(&mut edits, &node, &scene, name, by),
            None => left_out.push(format!(
                "the frame of the link of `{name}`, which is another one"
            )),
        }
        if body.joint_name != joint.name {
            continue;
        }
        let theirs = scene.robot.joints.iter().find(|j| j.name == *name);
        let theirs = theirs.map_or([0.0; 4], |j| j.terms);
        let own = scene.urdf.joints.iter().find(|j| j.name == *name);
        let own = own.map_or([0.0; 2], |j| [j.damping, j.friction]);
        let both = [
            ("damping", JointTerm::Viscous, own[0]),
            ("friction", JointTerm::Coulomb, own[1]),
        ];
        let mut changed = Vec::new();
        for (key, term, own) in both {
            let wanted = joint.terms[term as usize].max(0.0);
            let new = (wanted - (theirs[term as usize] - own)).max(0.0);
            if (new - own).abs() > SAME * (new.abs() + own.abs()) {
                changed.push((key, own, new));
            }
        }
        let of = format!("{} dynamics", Edits::called(&node));
        match node.all("dynamics").next() {
            Some(d) => {
                for (key, _, new) in changed {
                    edits.set(d, &of, key, new.to_string(), None);
                }
            }
            None if !changed.is_empty() => {
                let all: Vec<String> = changed
                    .iter()
                    .map(|(k, _, v)| format!("{k}=\"{v}\""))
                    .collect();
                edits.inside(&node, &[format!("<dynamics {}/>", all.join(" "))]);
                for (key, _, new) in changed {
                    edits.say(&node, of.clone(), key, [None, Some(new.to_string())]);
                }
            }
            None => {}
        }
        for (term, what) in [
            (JointTerm::Armature, "rotor inertia"),
            (JointTerm::Offset, "torque offset"),
        ] {
            let value = joint.terms[term as usize];
            if value != 0.0 {
                left_out.push(format!(
                    "{what} of `{name}`, {value}: a URDF has no place for it"
                ));
            }
        }
    }
    if model.robot.gravity != before.gravity {
        left_out.push("gravity: a URDF has no place for it".into());
    }
    for r in model.remarks.iter().filter(|r| r.held.is_none()) {
        left_out.push(format!(
            "{} ({}): a URDF has no element for it",
            r.effect, r.place
        ));
    }
    let written = edits.texts().into_iter().zip(&names);
    let files = written
        .map(|((_, text), name)| (name.clone(), text))
        .collect();
    Ok(Edited {
        scene: file.to_path_buf(),
        file: names
            .last()
            .map_or_else(String::new, |n| n.display().to_string()),
        files,
        changes: edits.changes,
        left_out,
        effects: None,
        warnings: scene.warnings,
    })
}

/// Writes the inertia of a link.
fn inertial(edits: &mut Edits, node: &Node, now: &Inertia, wanted: &Inertia) {
    let (mass, com) = (wanted.mass(), wanted.com().unwrap_or_default());
    let of = format!("{} inertial", Edits::called(node));
    let xyz = format!("{} {} {}", com.x, com.y, com.z);
    let i = wanted.tensor_com();
    let moments = named_moments(&i);
    let list = moments.map(|(k, v)| format!(" {k}=\"{v}\"")).concat();
    let Some(stated) = node.all("inertial").next() else {
        let lines = [
            "<inertial>".to_string(),
            format!("  <origin xyz=\"{xyz}\" rpy=\"0 0 0\"/>"),
            format!("  <mass value=\"{mass}\"/>"),
            format!("  <inertia{list}/>"),
            "</inertial>".to_string(),
        ];
        edits.inside(node, &lines);
        let said: Vec<&str> = lines.iter().map(|l| l.trim()).collect();
        edits.say(node, of, "", [None, Some(said.join(" "))]);
        return;
    };
    let mut put = |tag: &str, keys: &[(&str, String)]| match stated.all(tag).next() {
        Some(at) => {
            for (key, value) in keys {
                edits.set(at, &of, key, value.clone(), None);
            }
        }
        None => {
            let all: String = keys.iter().map(|(k, v)| format!(" {k}=\"{v}\"")).collect();
            edits.inside(stated, &[format!("<{tag}{all}/>")]);
            for (key, value) in keys {
                edits.say(stated, of.clone(), key, [None, Some(value.clone())]);
            }
        }
    };
    if (now.mass() - mass).abs() > SAME * mass {
        put("mass", &[("value", mass.to_string())]);
    }
    let turned = (now.tensor_com() - i).norm() > SAME * i.norm();
    let mut frame = Vec::new();
    if (now.com().unwrap_or_default() - com).norm() > SAME * com.norm().max(1e-3) {
        frame.push(("xyz", xyz));
    }
    let origin = stated.all("origin").next();
    if turned && origin.is_some_and(|o| o.own("rpy").is_some()) {
        frame.push(("rpy", "0 0 0".into()));
    }
    if !frame.is_empty() {
        put("origin", &frame);
    }
    if turned {
        put("inertia", &moments.map(|(k, v)| (k, v.to_string())));
    }
}

/// Moves the origin of a joint along it.
fn origin(edits: &mut Edits, node: &Node, scene: &Scene, name: &str, by: f64) {
    let Some(joint) = scene.urdf.joints.iter().find(|j| j.name == name) else {
        return;
    };
    let turns = scene.robot.bodies.iter().find(|b| b.joint_name == name);
    let way = match turns.map_or(Motion::Revolute, |b| b.motion) {
        Motion::Revolute => {
            let axis = Unit::new_normalize(joint.axis);
            let turn = UnitQuaternion::from_axis_angle(&axis, by);
            Isometry3::from_parts(Translation3::identity(), turn)
        }
        Motion::Prismatic => {
            let v = joint.axis * by;
            Isometry3::translation(v.x, v.y, v.z)
        }
    };
    let at = super::matching::pose(&joint.rotation, &joint.position) * way;
    let [r, p, y] = rpy(&at.rotation.to_rotation_matrix().into_inner());
    let t = at.translation.vector;
    let keys = [
        ("xyz", format!("{} {} {}", t.x, t.y, t.z)),
        ("rpy", format!("{r} {p} {y}")),
    ];
    let of = format!("{} origin", Edits::called(node));
    match node.all("origin").next() {
        Some(o) => {
            for (key, value) in keys {
                edits.set(o, &of, key, value, None);
            }
        }
        None => {
            let all = keys.clone().map(|(k, v)| format!(" {k}=\"{v}\"")).concat();
            edits.inside(node, &[format!("<origin{all}/>")]);
            for (key, value) in keys {
                edits.say(node, of.clone(), key, [None, Some(value)]);
            }
        }
    }
}
