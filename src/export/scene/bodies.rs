//! The inertia that the links of a scene are given, so that a body with all that is welded to it has that of the model.

use super::matching::joint_in;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::export::Model;
use crate::robot::urdf::{Options, Urdf};
use crate::robot::{Inertia, Robot};
use std::collections::{BTreeMap, HashSet};
use std::path::Path;

/// Difference that is none, relative.
pub(super) const SAME: f64 = 1e-9;
/// Part of a body by which it may be moved to one that can exist.
const NEAR: f64 = 1e-6;

/// A scene as a robot of the joints that a model has.
pub(super) struct Scene {
    pub(super) urdf: Urdf,
    pub(super) robot: Robot,
    /// by body of the model: its joint in the scene
    pub(super) joints: Vec<String>,
    /// by body of the model: its body in `robot`
    pub(super) body: Vec<usize>,
    lock: BTreeMap<String, f64>,
    pub(super) warnings: Vec<Warning>,
}

impl Scene {
    /// The joints of a model found in a scene, and all others held.
    pub(super) fn new(model: &Model, urdf: Urdf, file: &Path) -> Result<Self> {
        let ours = model.plant.robot();
        let names: Vec<&str> = urdf
            .joint_names()
            .filter(|n| urdf.is_fixed(n) == Some(false))
            .collect();
        let mut joints = Vec::new();
        for body in &ours.bodies {
            let found = joint_in(&body.joint_name, &names).ok_or_else(|| {
                let listed: Vec<&str> = names.iter().take(20).copied().collect();
                Error::file(
                    file,
                    format!("joint `{}`", body.joint_name),
                    format!(
                        "the scene has no joint of this name, which the robot has; its joints are {}; rename it \
                         there, or name the scene of this robot",
                        match listed.is_empty() {
                            true => "none".to_string(),
                            false => listed.join(", "),
                        }
                    ),
                )
            })?;
            if joints.iter().any(|j| j == found) {
                return Err(Error::file(
                    file,
                    format!("joint `{found}`"),
                    "two joints of the robot would be this one; rename it as in the robot",
                ));
            }
            joints.push(found.to_string());
        }
        let stated = stated_lock(ours);
        let mut warnings = Vec::new();
        let mut lock = BTreeMap::new();
        let others = names.iter().filter(|n| !joints.iter().any(|j| j == *n));
        let mut unstated = Vec::new();
        for name in others {
            // one that follows another of these is held with it
            let follows = urdf.mimics(name);
            if follows.is_some_and(|l| !joints.iter().any(|j| j == l)) {
                continue;
            }
            let at = stated
                .iter()
                .find(|(n, _)| n.as_str() == *name || joint_in(n, &names) == Some(*name));
            if at.is_none() {
                unstated.push(*name);
            }
            lock.insert(name.to_string(), at.map_or(0.0, |(_, q)| *q));
        }
        if !unstated.is_empty() {
            warnings.push(Warning::new(
                WarningKind::JointHeld,
                file.display().to_string(),
                format!(
                    "joints that the robot has not ({}) are taken to stand at 0 for the mass of what they carry",
                    unstated.join(", ")
                ),
            ));
        }
        let renamed: Vec<String> = ours
            .bodies
            .iter()
            .zip(&joints)
            .filter(|(b, j)| b.joint_name != **j)
            .map(|(b, j)| format!("{} is {j}", b.joint_name))
            .collect();
        if !renamed.is_empty() {
            warnings.push(Warning::new(
                WarningKind::EntryIgnored,
                file.display().to_string(),
                format!(
                    "joints with other names in the scene: {}",
                    renamed.join(", ")
                ),
            ));
        }
        let robot = urdf.robot(&Options {
            lock: lock.clone(),
            ..Options::default()
        })?;
        let mut body = Vec::new();
        for (ours, name) in ours.bodies.iter().zip(&joints) {
            let found = robot.bodies.iter().position(|b| b.joint_name == *name);
            let alike = |b: usize| {
                let theirs = &robot.bodies[b];
                let near = |x: f64, y: f64| (x - y).abs() <= 1e-6 * (1.0 + x.abs());
                theirs.motion == ours.motion
                    && near(theirs.ratio, ours.ratio)
                    && near(theirs.offset, ours.offset)
            };
            match found.filter(|b| alike(*b)) {
                Some(b) => body.push(b),
                None => {
                    return Err(Error::file(
                        file,
                        format!("joint `{name}`"),
                        "it is of another kind than in the robot, or follows another joint, or follows it otherwise; \
                         make the two alike",
                    ));
                }
            }
        }
        Ok(Scene {
            urdf,
            robot,
            joints,
            body,
            lock,
            warnings,
        })
    }

    /// Inertia of a link in its frame.
    pub(super) fn own(&self, link: &str) -> Inertia {
        let mut links = self.urdf.links.iter().filter(|l| l.name == link);
        links.next().and_then(|l| l.inertia).unwrap_or_default()
    }

    /// Whether anything between a link and the body that carries it is a joint that is held.
    fn held(&self, link: &str, body: &str) -> bool {
        let mut at = link;
        for _ in 0..=self.urdf.joints.len() {
            if at == body {
                return false;
            }
            let Some(joint) = self.urdf.joints.iter().find(|j| j.child == at) else {
                return false;
            };
            if self.urdf.is_fixed(&joint.name) == Some(false) {
                return true;
            }
            at = &joint.parent;
        }
        false
    }

    /// Inertia of the links that make a body of the model one with the inertia `target`, kg, kg m, kg m² about and in
    /// the frame of the body's link in the scene: those that are to be changed. `unknown` are links whose inertia
    /// cannot be told from the file.
    pub(super) fn links(
        &self,
        b: usize,
        target: &Inertia,
        unknown: &HashSet<String>,
        able: &dyn Fn(&Inertia) -> Inertia,
        file: &Path,
    ) -> Result<Vec<(String, Inertia)>> {
        let body = &self.robot.bodies[self.body[b]];
        let moved = |link: &String| {
            let at = self.urdf.frame(link, |l| l == body.name, &self.lock);
            at.map_or_else(Inertia::default, |(_, r, p)| {
                self.own(link).in_parent(&r, &p)
            })
        };
        let (held, welded): (Vec<&String>, Vec<&String>) =
            body.merged.iter().partition(|l| self.held(l, &body.name));
        let refuse = |why: &str| {
            Err(Error::file(
                file,
                format!("joint `{}`", body.joint_name),
                format!(
                    "{why}; write the links that are welded to `{}` as one body, or use robot.xml and robot.urdf",
                    body.name
                ),
            ))
        };
        if let Some(name) = held.iter().find(|l| unknown.contains(**l)) {
            return refuse(&format!(
                "the inertia of `{name}`, which it carries, is that of a mesh: give it an <inertial>"
            ));
        }
        let sum = |links: &[&String]| {
            let all = links.iter().map(|l| moved(l));
            all.fold(Inertia::default(), |a, b| a + b)
        };
        let carried = sum(&held);
        let blind = welded.iter().any(|l| unknown.contains(*l));
        let rest = minus(target, &carried);
        let own = minus(&rest, &sum(&welded));
        let exists = |i: &Inertia| {
            let written = able(i);
            (i.mass() > 0.0 && same(&written, i, target, NEAR)).then_some(written)
        };
        if let Some(written) = exists(&own).filter(|_| !blind) {
            let now = self.own(&body.name);
            let as_it_is = !unknown.contains(&body.name) && same(&now, &written, target, SAME);
            return Ok(match as_it_is {
                true => Vec::new(),
                false => vec![(body.name.clone(), written)],
            });
        }
        // what is welded to it is too heavy for the model: the body takes all, and the welded parts nothing
        match exists(&rest) {
            Some(written) => {
                let empty = welded
                    .iter()
                    .filter(|l| unknown.contains(**l) || self.own(l) != Inertia::default());
                let mut out = vec![(body.name.clone(), written)];
                out.extend(empty.map(|l| (l.to_string(), Inertia::default())));
                Ok(out)
            }
            None => refuse("what it carries in the scene is heavier than the body of the model"),
        }
    }
}

/// What is left of a body without another one.
pub(super) fn minus(a: &Inertia, b: &Inertia) -> Inertia {
    Inertia(std::array::from_fn(|k| a.0[k] - b.0[k]))
}

/// Whether two bodies are the same to a part of a third.
pub(super) fn same(a: &Inertia, b: &Inertia, of: &Inertia, part: f64) -> bool {
    let size = |k: std::ops::Range<usize>| of.0[k].iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let scale = [size(0..1), size(1..4).max(0.01 * size(0..1)), size(4..10)];
    (0..10).all(|k| {
        let scale = scale[[0, 1, 1, 1, 2, 2, 2, 2, 2, 2][k]];
        (a.0[k] - b.0[k]).abs() <= part * scale
    })
}

/// Positions of the joints that the robot file holds; none where it does not say.
fn stated_lock(robot: &Robot) -> BTreeMap<String, f64> {
    let file = robot.path.as_ref();
    let file = file.filter(|f| {
        f.extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("toml"))
    });
    let text = file.and_then(|f| crate::robot::file::text::read_text(f).ok());
    let table = text.and_then(|t| toml::from_str::<toml::Table>(&t).ok());
    let lock = table.and_then(|t| t.get("lock").and_then(|l| l.as_table()).cloned());
    let number = |v: &toml::Value| v.as_float().or(v.as_integer().map(|i| i as f64));
    let each = lock.into_iter().flatten();
    each.filter_map(|(name, v)| Some((name, number(&v)?)))
        .collect()
}
