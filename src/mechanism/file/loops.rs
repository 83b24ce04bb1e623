//! `mechanism = "loops"`: a URDF, its closures and its actuated joints; and the URDF-plus-YAML
//! layout of `example-parallel-robots`.

use super::body::{numbers, positive, vector};
use super::common::mechanism_file;
use crate::error::{Error, Result};
use crate::mechanism::Mechanism;
use crate::mechanism::loops::yaml::{self, Stand};
use crate::mechanism::loops::{Closure, Coincide, Frame, Loops};
use crate::mechanism::task::rotation;
use crate::robot::file::names::{did_you_mean, listed};
use crate::robot::file::{Text, read_text};
use crate::robot::urdf::{Options, Urdf};
use crate::robot::{Body, Inertia, Joint, Limits, Motion, Robot};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use serde::de::{MapAccess, Visitor, value::MapAccessDeserializer};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::Path;
use toml::Spanned;

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

/// One `[[loop]]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LoopEntry {
    frames: Spanned<Vec<Spanned<FrameEntry>>>,
    coincide: Spanned<String>,
}

/// A link, or a frame on it.
struct FrameEntry {
    link: String,
    position: Option<Spanned<Vec<f64>>>,
    rpy: Option<Spanned<Vec<f64>>>,
}

impl<'de> Deserialize<'de> for FrameEntry {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Table {
            link: String,
            position: Option<Spanned<Vec<f64>>>,
            rpy: Option<Spanned<Vec<f64>>>,
        }
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = FrameEntry;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("the name of a link, or { link, position, rpy }")
            }
            fn visit_str<E: serde::de::Error>(self, link: &str) -> Result<FrameEntry, E> {
                Ok(FrameEntry {
                    link: link.into(),
                    position: None,
                    rpy: None,
                })
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<FrameEntry, A::Error> {
                let t = Table::deserialize(MapAccessDeserializer::new(map))?;
                Ok(FrameEntry {
                    link: t.link,
                    position: t.position,
                    rpy: t.rpy,
                })
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// Finds frames and joints by name.
struct Names<'a> {
    urdf: &'a Urdf,
    robot: &'a Robot,
    lock: &'a BTreeMap<String, f64>,
}

impl Names<'_> {
    /// The frame of a link.
    fn frame(&self, link: &str) -> Result<Frame, String> {
        let bodies = &self.robot.bodies;
        let at = |name: &str| bodies.iter().position(|b| b.name == name);
        let Some((body, rotation, position)) =
            self.urdf.frame(link, |l| at(l).is_some(), self.lock)
        else {
            let all: Vec<&str> = self.urdf.link_names().collect();
            return Err(format!(
                "the URDF has no link `{link}`{}; its links are {}",
                did_you_mean(link, all.iter().copied()),
                listed(&all)
            ));
        };
        Ok(Frame {
            name: link.to_string(),
            body: body.as_deref().and_then(at),
            rotation,
            position,
        })
    }

    /// Index of a coordinate.
    fn joint(&self, name: &str) -> Result<usize, String> {
        let all = &self.robot.joints;
        all.iter().position(|j| j.name == name).ok_or_else(|| {
            let names: Vec<&str> = all.iter().map(|j| j.name.as_str()).collect();
            let fixed = match self.urdf.joint_names().any(|n| n == name) {
                true => " that moves (it is fixed, locked, or follows another)",
                false => "",
            };
            format!(
                "there is no joint `{name}`{fixed}{}; joints that move are {}",
                did_you_mean(name, names.iter().copied()),
                listed(&names)
            )
        })
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
    let (urdf_path, urdf_text) = beside(&file.urdf, "urdf")?;
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
    let urdf = Urdf::parse(&urdf_text, &urdf_path)?;
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

fn closure(source: Text, names: &Names, entry: &LoopEntry, number: usize) -> Result<Closure> {
    let what = format!("[[loop]] {number}");
    let coincide = match entry.coincide.get_ref().as_str() {
        "position" => Coincide::Position,
        "pose" => Coincide::Pose,
        other => {
            return Err(source.error(
                entry.coincide.span().start,
                &what,
                format!("coincide = \"{other}\" must be \"position\" or \"pose\""),
            ));
        }
    };
    let [a, b] = &entry.frames.get_ref()[..] else {
        return Err(source.error(
            entry.frames.span().start,
            &what,
            format!(
                "a loop joins two frames, here are {}",
                entry.frames.get_ref().len()
            ),
        ));
    };
    let frame = |spanned: &Spanned<FrameEntry>| -> Result<Frame> {
        let (entry, at) = (spanned.get_ref(), spanned.span().start);
        let mut frame = names
            .frame(&entry.link)
            .map_err(|why| source.error(at, &what, why))?;
        if let Some(p) = &entry.position {
            frame.position += frame.rotation * vector(source, p, &what, "position")?;
        }
        if let Some(rpy) = &entry.rpy {
            let rpy = numbers::<3>(source, rpy, &what, "rpy")?;
            frame.rotation *= rotation(&Vector3::from(rpy));
        }
        Ok(frame)
    };
    let frames = [frame(a)?, frame(b)?];
    if frames[0].body == frames[1].body {
        return Err(source.error(
            entry.frames.span().start,
            &what,
            format!(
                "`{}` and `{}` sit on the same body: nothing is closed",
                frames[0].name, frames[1].name
            ),
        ));
    }
    Ok(Closure { frames, coincide })
}

fn from_yaml(
    names: &Names,
    listed: &yaml::Closures,
    key: Option<&Spanned<String>>,
    source: Text,
) -> Result<Vec<Closure>> {
    let at = key.map_or(0, |k| k.span().start);
    let frame = |link: &String| {
        names
            .frame(link)
            .map_err(|why| source.error(at, "closed_loop", why))
    };
    listed
        .loops
        .iter()
        .map(|([a, b], coincide)| {
            Ok(Closure {
                frames: [frame(a)?, frame(b)?],
                coincide: *coincide,
            })
        })
        .collect()
}

/// The tree of the URDF with the joints that stand for others replaced.
fn tree(urdf: &Urdf, lock: &mut BTreeMap<String, f64>, listed: &yaml::Closures) -> Result<Robot> {
    for (name, stand) in &listed.joints {
        if *stand == Stand::Fixed {
            lock.insert(name.clone(), 0.0);
        }
    }
    let options = Options {
        lock: lock.clone(),
        ..Options::default()
    };
    let mut robot = urdf.robot(&options)?;
    for (name, stand) in &listed.joints {
        let axes: &[Vector3<f64>] = match stand {
            Stand::Fixed => continue,
            Stand::Cardan => &[
                Vector3::x_axis().into_inner(),
                Vector3::y_axis().into_inner(),
            ],
            Stand::Spherical => &[
                Vector3::x_axis().into_inner(),
                Vector3::y_axis().into_inner(),
                Vector3::z_axis().into_inner(),
            ],
        };
        split(&mut robot, name, axes).map_err(|why| {
            Error::Infeasible(format!("{}: joint_name `{name}`: {why}", robot.name))
        })?;
    }
    Ok(robot)
}

/// Replaces the joint of a body by joints about several axes, one after the other.
fn split(robot: &mut Robot, joint: &str, axes: &[Vector3<f64>]) -> Result<(), String> {
    let Some(c) = robot.joints.iter().position(|j| j.name == joint) else {
        return Err("there is no such joint that moves".into());
    };
    let mut on = robot
        .bodies
        .iter()
        .enumerate()
        .filter(|(_, b)| b.coordinate == c);
    let (Some((at, _)), None) = (on.next(), on.next()) else {
        return Err("several bodies follow it".into());
    };
    let more = axes.len() - 1;
    let old = robot.bodies[at].clone();
    for body in &mut robot.bodies {
        body.parent = body.parent.map(|p| if p >= at { p + more } else { p });
        if body.coordinate > c {
            body.coordinate += more;
        }
    }
    let names = ["_X", "_Y", "_Z"];
    let mut parent = old.parent;
    for (k, axis) in axes.iter().enumerate() {
        let last = k == more;
        let name = format!("{joint}{}", names[k]);
        let body = Body {
            name: match last {
                true => old.name.clone(),
                false => format!("{}{}", old.name, names[k]),
            },
            joint_name: name.clone(),
            parent,
            motion: Motion::Revolute,
            axis: *axis,
            rotation: if k == 0 {
                old.rotation
            } else {
                Matrix3::identity()
            },
            position: if k == 0 {
                old.position
            } else {
                Vector3::zeros()
            },
            inertia: if last {
                old.inertia
            } else {
                Inertia::default()
            },
            merged: if last { old.merged.clone() } else { Vec::new() },
            coordinate: c + k,
            ratio: 1.0,
            offset: 0.0,
            meant: None,
        };
        let coordinate = Joint {
            name,
            motion: Motion::Revolute,
            continuous: true,
            limits: Limits::default(),
            torque_noise: None,
            position_resolution: None,
            gear_ratio: None,
            piston: None,
            terms: [0.0; 4],
            identify: [false; 4],
        };
        if k == 0 {
            robot.bodies[at] = body;
            robot.joints[c] = coordinate;
        } else {
            robot.bodies.insert(at + k, body);
            robot.joints.insert(c + k, coordinate);
        }
        parent = Some(at + k);
    }
    Ok(())
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
