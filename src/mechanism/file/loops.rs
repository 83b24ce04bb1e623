//! `mechanism = "loops"`: a URDF, its closures and its actuated joints; and the URDF-plus-YAML
//! layout of `example-parallel-robots`.

mod closure;
mod tree;

use super::body::positive;
use super::common::mechanism_file;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::mechanism::Mechanism;
use crate::mechanism::loops::Loops;
use crate::mechanism::loops::yaml;
use crate::robot::file::names::{did_you_mean, listed};
use crate::robot::file::text::read_text;
use crate::robot::file::{Text, described, expanded};
use crate::robot::xacro;
use closure::{LoopEntry, Names, closure, from_yaml};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::Path;
use toml::Spanned;
use tree::tree;

mechanism_file! {
    /// The file of a tree with loops.
    LoopsFile {
        urdf: Spanned<String>,
        yaml: Option<Spanned<String>>,
        #[serde(default)]
        lock: BTreeMap<String, Spanned<f64>>,
        #[serde(default)]
        start: BTreeMap<String, Spanned<f64>>,
        actuated: Option<Spanned<Vec<Spanned<String>>>>,
        #[serde(default)]
        unknown: Vec<Spanned<String>>,
        #[serde(default)]
        r#loop: Vec<LoopEntry>,
    }
}

/// Reads a tree with loops.
pub(super) fn read(source: Text, folder: &Path) -> Result<Mechanism> {
    let file = LoopsFile::parse(source)?;
    let head = file.head(source);
    let beside = |name: &Spanned<String>, key: &str| {
        let path = folder.join(name.get_ref());
        match read_text(&path) {
            Ok(text) => Ok((path, text)),
            Err(Error::Io { source: cause, .. }) => Err(source.error(
                name.span().start,
                key,
                format!(
                    "cannot read {} ({cause}); the path is relative to this file",
                    path.display()
                ),
            )),
            Err(other) => Err(other),
        }
    };
    let (name, arguments) = xacro::with_arguments(file.urdf.get_ref());
    let named = Spanned::new(file.urdf.span(), name.to_string());
    let (urdf_path, urdf_text) = beside(&named, "urdf")?;
    let (urdf_path, urdf_text) = expanded(urdf_path, urdf_text, &arguments)?;
    let mut hash = Sha256::new()
        .chain_update(source.text)
        .chain_update(&urdf_text);
    let listed_loops = match &file.yaml {
        None => yaml::Closures::default(),
        Some(name) => {
            let (path, text) = beside(name, "yaml")?;
            hash.update(&text);
            yaml::read(&text, &path)?
        }
    };
    let mut lock = BTreeMap::new();
    for (name, value) in &file.lock {
        if !value.get_ref().is_finite() {
            let at = value.span().start;
            return Err(source.error(at, "lock", format!("`{name}` must be finite")));
        }
        lock.insert(name.clone(), *value.get_ref());
    }
    let urdf = described(&urdf_text, &urdf_path)?;
    for (name, value) in &file.lock {
        if !urdf.joint_names().any(|n| n == name) {
            return Err(source.error(
                value.span().start,
                "lock",
                format!(
                    "the URDF has no joint `{name}`{}",
                    did_you_mean(name, urdf.joint_names())
                ),
            ));
        }
    }
    let mut robot = tree(&urdf, &mut lock, &listed_loops)?;
    robot.name = head.name();
    robot.gravity = head.gravity()?;
    for joint in &mut robot.joints {
        if joint.limits.velocity_by_position.take().is_some() {
            let message = "its <position_based_velocity_limits> are kept for serial and tree robots only and \
                           not looked at here; state a constant `velocity` that they imply";
            let warning = Warning::new(WarningKind::EntryIgnored, joint.name.clone(), message);
            robot.warnings.push(warning);
        }
    }
    let names = Names {
        urdf: &urdf,
        robot: &robot,
        lock: &lock,
    };
    let mut closures = from_yaml(&names, &listed_loops, file.yaml.as_ref(), source)?;
    for (i, entry) in file.r#loop.iter().enumerate() {
        closures.push(closure(source, &names, entry, i + 1)?);
    }
    let mut actuated = Vec::new();
    match &file.actuated {
        Some(list) => {
            for name in list.get_ref() {
                let at = name.span().start;
                let index = names
                    .joint(name.get_ref())
                    .map_err(|why| source.error(at, "actuated", why))?;
                if actuated.contains(&index) {
                    return Err(source.error(
                        at,
                        "actuated",
                        format!("`{}` is listed twice", name.get_ref()),
                    ));
                }
                actuated.push(index);
            }
        }
        None => {
            for name in &listed_loops.actuated {
                let index = names.joint(name);
                actuated.push(index.map_err(|why| source.error(0, "name_mot", why))?);
            }
        }
    }
    if actuated.is_empty() {
        return Err(source.error(
            0,
            "actuated",
            "no actuated joints: add actuated = [\"joint1\", …]",
        ));
    }
    let mut start = vec![0.0; robot.dof()];
    for (name, value) in &file.start {
        let at = value.span().start;
        let i = names
            .joint(name)
            .map_err(|why| source.error(at, "start", why))?;
        if !value.get_ref().is_finite() {
            return Err(source.error(at, "start", format!("`{name}` must be finite")));
        }
        start[i] = *value.get_ref();
    }
    if let Some(home) = head.home {
        if home.get_ref().len() != actuated.len() {
            return Err(source.error(
                home.span().start,
                "home",
                format!(
                    "it has {} numbers for {} actuated joints",
                    home.get_ref().len(),
                    actuated.len()
                ),
            ));
        }
        for (&a, x) in actuated.iter().zip(home.get_ref()) {
            start[a] = *x;
        }
    }
    let mut unknown = Vec::new();
    for link in &file.unknown {
        let name = link.get_ref();
        match robot.bodies.iter().position(|b| b.name == *name) {
            Some(b) => unknown.push(b),
            None => {
                let all: Vec<&str> = robot.bodies.iter().map(|b| b.name.as_str()).collect();
                return Err(source.error(
                    link.span().start,
                    "unknown",
                    format!(
                        "there is no moving body `{name}`{}; bodies are {}",
                        did_you_mean(name, all.iter().copied()),
                        listed(&all)
                    ),
                ));
            }
        }
    }
    let length = match head.length {
        Some(l) => Some(positive(source, l, "", "length")?),
        None => None,
    };
    let mut warnings = std::mem::take(&mut robot.warnings);
    for &a in &actuated {
        head.shared(&mut robot.joints[a], &mut warnings)?;
    }
    let stated: Vec<&str> = (file.joint.iter())
        .map(|j| j.get_ref())
        .filter(|j| j.position.is_some())
        .map(|j| j.name.get_ref().as_str())
        .collect();
    let stated: Vec<bool> = (robot.joints.iter())
        .map(|j| stated.contains(&j.name.as_str()))
        .collect();
    let loops = Loops {
        robot,
        closures,
        actuated,
        start,
        unknown,
        length,
    };
    let (setup, more) = loops.setup()?;
    warnings.extend(more);
    let mut mechanism = head.finish(setup, Vec::new(), warnings)?;
    limit_workspace(&mut mechanism, &stated);
    mechanism.robot.hash = format!("{:x}", hash.finalize());
    Ok(mechanism)
}

/// A robot of the collection: its YAML, and the URDF beside it.
pub(super) fn read_yaml(yaml: &Path) -> Result<Mechanism> {
    let folder = yaml.parent().unwrap_or(Path::new(""));
    let same = yaml.with_extension("urdf");
    let urdf = match same.exists() {
        true => same,
        false => folder.join("robot.urdf"),
    };
    if !urdf.exists() {
        return Err(Error::file(
            yaml,
            "",
            format!(
                "there is no URDF beside it ({} or {})",
                yaml.with_extension("urdf").display(),
                folder.join("robot.urdf").display()
            ),
        ));
    }
    let name = |p: &Path| p.file_name().map(|n| n.to_string_lossy().into_owned());
    let quoted = |s: Option<String>| toml::Value::String(s.unwrap_or_default()).to_string();
    let folder_name = folder
        .canonicalize()
        .ok()
        .and_then(|f| name(&f))
        .or_else(|| name(yaml));
    let text = format!(
        "mechanism = \"loops\"\nname = {}\nurdf = {}\nyaml = {}\n",
        quoted(folder_name),
        quoted(name(&urdf)),
        quoted(name(yaml))
    );
    let source = Text {
        file: yaml,
        text: &text,
    };
    read(source, folder)
}

/// The box of the independent joints: their limits where the robot file states them, else a
/// cautious one inside the limits of the URDF.
fn limit_workspace(mechanism: &mut Mechanism, stated: &[bool]) {
    let joints: Vec<usize> = match mechanism.geometry().task_joints() {
        Some(joints) => joints.to_vec(),
        None => return,
    };
    for (k, &i) in joints.iter().enumerate() {
        let limits = mechanism.robot.joints[i].limits;
        let home = mechanism.home[k];
        let [low, high] = limits.position;
        let own = &mut mechanism.workspace[k];
        let inside = low < home && home < high;
        if stated[i] && inside && low.is_finite() && high.is_finite() {
            own.position = [low, high];
        } else if inside {
            own.position = [own.position[0].max(low), own.position[1].min(high)];
        }
        own.velocity = own.velocity.min(limits.velocity);
        own.acceleration = own.acceleration.min(limits.acceleration);
    }
}
