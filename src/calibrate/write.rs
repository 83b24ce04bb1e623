//! The calibrated robot: the file that was read, with other geometry and nothing else changed.

use super::frame::Frame;
use super::kin::Kin;
use super::open::Opened;
pub use super::write_parallel::TOML;
use crate::error::{Error, Result};

/// Name of the calibrated URDF.
pub const URDF: &str = "robot.urdf";

/// Files of the calibrated robot: names and texts. `x` are the geometric errors.
///
/// # Errors
/// A robot without text, or with joints that its text does not have.
pub fn robot(opened: &Opened, x: &[f64]) -> Result<Vec<(&'static str, String)>> {
    let none = || {
        Error::Infeasible(format!(
            "{}: no robot file to write into",
            opened.plant.name()
        ))
    };
    let arm = match &opened.kin {
        Kin::Arm(arm) => arm,
        Kin::Parallel(p) => return super::write_parallel::robot(p, opened, x),
    };
    let text = opened.urdf.as_deref().ok_or_else(none)?;
    let changes: Vec<(&str, Frame)> = arm
        .places()
        .into_iter()
        .enumerate()
        .map(|(i, n)| (n, Frame::small(&x[6 * i..6 * i + 6])))
        .collect();
    let mut files = vec![(URDF, urdf(text, &changes)?)];
    if let Some(toml) = &opened.toml {
        files.push((TOML, refer(toml)));
    }
    Ok(files)
}

/// The URDF with every `<origin>` of these joints followed by a small displacement.
fn urdf(text: &str, changes: &[(&str, Frame)]) -> Result<String> {
    let bare = text.strip_prefix('\u{feff}').unwrap_or(text);
    let bad = |why: String| Error::Infeasible(format!("{URDF}: {why}"));
    let document = roxmltree::Document::parse(bare).map_err(|e| bad(e.to_string()))?;
    let numbers = |node: Option<roxmltree::Node>, key: &str| -> [f64; 3] {
        let mut all = [0.0; 3];
        let said = node.and_then(|n| n.attribute(key)).unwrap_or_default();
        for (x, t) in all.iter_mut().zip(said.split_whitespace()) {
            *x = t.parse().unwrap_or(0.0);
        }
        all
    };
    let mut edits: Vec<(std::ops::Range<usize>, String)> = Vec::new();
    for (name, error) in changes {
        let is_joint = |n: &roxmltree::Node| {
            n.tag_name().name() == "joint" && n.attribute("name") == Some(name)
        };
        let joint = document
            .root_element()
            .children()
            .find(|n| n.is_element() && is_joint(n))
            .ok_or_else(|| bad(format!("there is no joint `{name}`")))?;
        let origin = joint.children().find(|n| n.tag_name().name() == "origin");
        let [roll, pitch, yaw] = numbers(origin, "rpy");
        let p = numbers(origin, "xyz");
        let nominal = Frame {
            r: *nalgebra::Rotation3::from_euler_angles(roll, pitch, yaw).matrix(),
            p: p.into(),
        };
        let new = nominal.then(error);
        let [roll, pitch, yaw] = new.rpy();
        let line = format!(
            "<origin xyz=\"{} {} {}\" rpy=\"{roll} {pitch} {yaw}\"/>",
            new.p.x, new.p.y, new.p.z
        );
        match origin {
            Some(o) => edits.push((o.range(), line)),
            None => match joint.first_child() {
                Some(first) => edits.push((first.range().start..first.range().start, line)),
                None => return Err(bad(format!("joint `{name}` is empty"))),
            },
        }
    }
    edits.sort_by_key(|e| std::cmp::Reverse(e.0.start));
    let mut out = bare.to_string();
    for (range, line) in edits {
        out.replace_range(range, &line);
    }
    Ok(out)
}

/// The `robot.toml` with the calibrated URDF in place of its own.
fn refer(toml: &str) -> String {
    let line = |l: &str| match l.trim_start().strip_prefix("urdf").map(str::trim_start) {
        Some(rest) if rest.starts_with('=') => format!("urdf = \"{URDF}\""),
        _ => l.to_string(),
    };
    let mut out: String = toml.lines().map(|l| line(l) + "\n").collect();
    if !toml.ends_with('\n') {
        out.pop();
    }
    out
}
