//! MJCF: from the text of a MuJoCo model to the links and joints that a URDF has.
//!
//! * a body becomes a link; one with several joints a chain of links, all but the last without mass; one without
//!   joints a link on a fixed joint;
//! * a joint that does not pass through the origin of its body moves the frame of its link there;
//! * a joint that an equality couples with another one by a straight line mimics it;
//! * the inertia is that of `<inertial>`, or of the geoms, as `<compiler>` says.
//!
//! Bodies that float, ball joints, closures and inertia of meshes are refused with the line where they stand. Springs
//! and tendons are no part of a model here; a warning says where some are left out.

pub(crate) mod body;
pub(crate) mod compiler;
mod frame;
mod geom;
pub(crate) mod xml;

use super::urdf::{GRAVITY, Limit, Mimic, Urdf};
use crate::error::{Result, Warning, WarningKind};
use body::Reader;
use compiler::Compiler;
use nalgebra::Vector3;
use std::path::Path;
use xml::{Element, Node};

/// Whether a text is an MJCF, by its root element.
pub(crate) fn is(text: &str) -> bool {
    let mut rest = text.trim_start_matches('\u{feff}').trim_start();
    loop {
        let end = match rest {
            _ if rest.starts_with("<?") => "?>",
            _ if rest.starts_with("<!--") => "-->",
            _ => break,
        };
        let Some(at) = rest.find(end) else {
            return false;
        };
        rest = rest[at + end.len()..].trim_start();
    }
    rest.strip_prefix("<mujoco")
        .is_some_and(|r| r.starts_with(|c: char| c.is_whitespace() || c == '>' || c == '/'))
}

/// Reads an MJCF.
pub(super) fn read(text: &str, file: &Path) -> Result<Urdf> {
    let root = xml::parse(text, file)?;
    let compiler = Compiler::of(&root)?;
    let mut reader = Reader::new(&compiler);
    of(&root, &compiler, &mut reader, file)
}

/// Links and joints of the elements of an MJCF; what stands where is left in the reader.
pub(crate) fn of<'a>(
    root: &'a Node,
    compiler: &'a Compiler,
    reader: &mut Reader<'a>,
    file: &Path,
) -> Result<Urdf> {
    for world in root.all("worldbody") {
        reader.world(world)?;
    }
    if reader.links.is_empty() {
        return Err(root.error("it has no <worldbody>; name the file that includes this one"));
    }
    let mut urdf = Urdf {
        name: root.own("model").unwrap_or_default().trim().to_string(),
        file: file.to_path_buf(),
        links: std::mem::take(&mut reader.links),
        joints: std::mem::take(&mut reader.joints),
        warnings: std::mem::take(&mut reader.warnings),
        gravity: GRAVITY,
    };
    for node in root.all("option") {
        let e = Element {
            node,
            defaults: None,
        };
        urdf.gravity = e.vector("gravity")?.unwrap_or(urdf.gravity);
        if node
            .all("flag")
            .any(|f| f.own("gravity") == Some("disable"))
        {
            urdf.gravity = Vector3::zeros();
        }
    }
    if let Some(total) = compiler.total_mass {
        let masses = urdf.links.iter().filter_map(|l| l.inertia.as_ref());
        let sum: f64 = masses.map(|i| i.mass()).sum();
        for inertia in urdf.links.iter_mut().filter_map(|l| l.inertia.as_mut()) {
            inertia.0.iter_mut().for_each(|x| *x *= total / sum);
        }
    }
    for node in root.all("equality").flat_map(|e| &e.children) {
        equality(&mut urdf, compiler, node, &reader.refs)?;
    }
    for node in root.all("actuator").flat_map(|a| &a.children) {
        actuator(&mut urdf, compiler, node)?;
    }
    for node in root.all("tendon").flat_map(|t| &t.children) {
        let e = compiler.element(node, None)?;
        for name in ["stiffness", "damping", "frictionloss", "armature"] {
            if e.number(name)?.is_some_and(|x| x != 0.0) {
                urdf.warnings.push(Warning::new(
                    WarningKind::EntryIgnored,
                    format!("line {}: tendon", node.line),
                    format!("its {name} is no part of the model"),
                ));
            }
        }
    }
    Ok(urdf)
}

fn equality(
    urdf: &mut Urdf,
    compiler: &Compiler,
    node: &Node,
    refs: &std::collections::HashMap<String, f64>,
) -> Result<()> {
    let e = compiler.element(node, None)?;
    if e.text("active") == Some("false") {
        return Ok(());
    }
    match node.tag.as_str() {
        "joint" => {}
        "connect" | "weld" => {
            return Err(node.error(
                "it closes a loop, which is not read from an MJCF; describe the mechanism in a robot.toml \
                 (mechanism = \"loops\") with the tree as a URDF, or set active=\"false\" if the tree alone is meant",
            ));
        }
        _ => {
            urdf.warnings.push(Warning::new(
                WarningKind::EntryIgnored,
                format!("line {}: equality", node.line),
                format!(
                    "a constraint of kind `{}` is no part of the model",
                    node.tag
                ),
            ));
            return Ok(());
        }
    }
    let name = e
        .text("joint1")
        .ok_or_else(|| node.error("it names no `joint1`"))?;
    let poly = e.numbers("polycoef")?.unwrap_or(vec![0.0, 1.0]);
    let c = |k: usize| poly.get(k).copied().unwrap_or(0.0);
    if (2..poly.len()).any(|k| c(k) != 0.0) {
        return Err(node.error(
            "only a straight line couples joints here: `polycoef` with zeros from the third on",
        ));
    }
    let zero = |name: &str| refs.get(name).copied().unwrap_or(0.0);
    // without a second joint it is held at a position
    let leader = e.text("joint2");
    let (multiplier, offset) = match leader {
        Some(of) => (c(1), zero(name) + c(0) - c(1) * zero(of)),
        None => (0.0, zero(name) + c(0)),
    };
    let Some(leader) = leader else {
        return Err(node.error(format!(
            "it holds `{name}` at {offset}; remove it and name the joint in `lock` of a robot.toml"
        )));
    };
    if !urdf.joints.iter().any(|j| j.name == leader) {
        return Err(node.error(format!("no joint is named `{leader}`; correct the name")));
    }
    let line = node.line as usize;
    let joint = urdf.joints.iter_mut().find(|j| j.name == name);
    let joint =
        joint.ok_or_else(|| node.error(format!("no joint is named `{name}`; correct the name")))?;
    joint.mimic = Some(Mimic {
        line,
        joint: leader.to_string(),
        multiplier,
        offset,
    });
    Ok(())
}

/// The effort limit that an actuator states for its joint: the least of its ranges.
fn actuator(urdf: &mut Urdf, compiler: &Compiler, node: &Node) -> Result<()> {
    let e = compiler.element(node, None)?;
    let Some(joint) = e.text("joint") else {
        return Ok(());
    };
    let gear = e.number("gear")?.unwrap_or(1.0).abs();
    let limited = |name: &str, range: Option<[f64; 2]>| match e.text(name) {
        Some("false") => None,
        Some("true") => range,
        _ => range.filter(|_| compiler.autolimits),
    };
    let force = limited("forcelimited", e.exactly("forcerange")?);
    let control =
        limited("ctrllimited", e.exactly("ctrlrange")?).filter(|_| match node.tag.as_str() {
            "motor" => true,
            // a gain without bias
            "general" => {
                e.text("biastype").unwrap_or("none") == "none"
                    && e.text("dyntype").unwrap_or("none") == "none"
            }
            _ => false,
        });
    let gain = match node.tag.as_str() {
        "general" => e.number("gainprm")?.unwrap_or(1.0).abs(),
        _ => 1.0,
    };
    let most = |[a, b]: [f64; 2]| a.abs().max(b.abs());
    let ranges = [force.map(most), control.map(|r| gain * most(r))];
    let Some(effort) = ranges
        .into_iter()
        .flatten()
        .reduce(f64::min)
        .map(|x| x * gear)
    else {
        return Ok(());
    };
    let found = urdf.joints.iter_mut().find(|j| j.name == joint);
    let found = found
        .ok_or_else(|| node.error(format!("no joint is named `{joint}`; correct the name")))?;
    let limit = found.limit.get_or_insert(Limit {
        line: node.line as usize,
        lower: None,
        upper: None,
        velocity: None,
        effort: None,
    });
    limit.effort = Some(limit.effort.map_or(effort, |e| e.min(effort)));
    Ok(())
}

/// A vector without direction.
fn unit(node: &Node, name: &str, v: Vector3<f64>) -> Result<Vector3<f64>> {
    v.try_normalize(1e-12)
        .ok_or_else(|| node.error(format!("`{name}` has no direction")))
}

#[cfg(test)]
mod tests;
