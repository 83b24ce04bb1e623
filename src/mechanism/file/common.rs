//! What the files of all mechanisms share: name, gravity, home, workspace, actuators and joints.

use super::body::{finite, numbers, positive, vector};
use crate::error::{Result, Warning, WarningKind};
use crate::mechanism::{Mechanism, Setup, Task};
use crate::robot::file::joint::{JointEntry, joint_values, stated_limits};
use crate::robot::file::names::{did_you_mean, listed};
use crate::robot::file::{Text, file_stem};
use crate::robot::{Joint, JointTerm, Motion, Prior};
use nalgebra::Vector3;
use serde::Deserialize;
use toml::Spanned;

/// `[workspace]`: the box in which the platform may move.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WorkspaceEntry {
    x: Option<Spanned<Vec<f64>>>,
    y: Option<Spanned<Vec<f64>>>,
    z: Option<Spanned<Vec<f64>>>,
    roll: Option<Spanned<Vec<f64>>>,
    pitch: Option<Spanned<Vec<f64>>>,
    yaw: Option<Spanned<Vec<f64>>>,
    theta: Option<Spanned<Vec<f64>>>,
    tilt: Option<Spanned<f64>>,
    velocity: Option<Spanned<f64>>,
    acceleration: Option<Spanned<f64>>,
    angular_velocity: Option<Spanned<f64>>,
    angular_acceleration: Option<Spanned<f64>>,
}

/// `[margins]`: what a motion keeps away from.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MarginsEntry {
    singularity: Option<Spanned<f64>>,
    constraint: Option<Spanned<f64>>,
    distance: Option<Spanned<f64>>,
}

/// The keys that every mechanism has, as written.
#[derive(Clone, Copy)]
pub(super) struct Head<'a> {
    pub source: Text<'a>,
    pub name: &'a Option<Spanned<String>>,
    pub gravity: &'a Option<Spanned<Vec<f64>>>,
    pub prior: Prior,
    pub home: &'a Option<Spanned<Vec<f64>>>,
    pub length: &'a Option<Spanned<f64>>,
    pub workspace: &'a Option<WorkspaceEntry>,
    pub margins: &'a Option<MarginsEntry>,
    pub actuator: &'a Option<JointEntry>,
    pub joint: &'a [Spanned<JointEntry>],
}

/// Declares the file of one kind of mechanism: the keys of all, and its own.
macro_rules! mechanism_file {
    ($(#[$doc:meta])* $file:ident { $($(#[$field_doc:meta])* $field:ident : $type:ty,)* }) => {
        $(#[$doc])*
        #[derive(serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        struct $file {
            #[allow(dead_code)] // decides which reader is called
            mechanism: String,
            name: Option<toml::Spanned<String>>,
            gravity: Option<toml::Spanned<Vec<f64>>>,
            #[serde(default)]
            prior: crate::robot::Prior,
            home: Option<toml::Spanned<Vec<f64>>>,
            length: Option<toml::Spanned<f64>>,
            workspace: Option<crate::mechanism::file::common::WorkspaceEntry>,
            margins: Option<crate::mechanism::file::common::MarginsEntry>,
            actuator: Option<crate::robot::file::joint::JointEntry>,
            #[serde(default)]
            joint: Vec<toml::Spanned<crate::robot::file::joint::JointEntry>>,
            $($(#[$field_doc])* $field: $type,)*
        }
        impl $file {
            fn parse(source: crate::robot::file::Text) -> crate::error::Result<Self> {
                toml::from_str(source.text).map_err(|e| source.toml_error(&e))
            }
            fn head<'a>(
                &'a self,
                source: crate::robot::file::Text<'a>,
            ) -> crate::mechanism::file::common::Head<'a> {
                crate::mechanism::file::common::Head {
                    source,
                    name: &self.name,
                    gravity: &self.gravity,
                    prior: self.prior,
                    home: &self.home,
                    length: &self.length,
                    workspace: &self.workspace,
                    margins: &self.margins,
                    actuator: &self.actuator,
                    joint: &self.joint,
                }
            }
        }
    };
}
pub(super) use mechanism_file;

/// Limits that are kept for serial and tree robots only are no limits of a parallel one.
fn refuse(source: Text, entry: &JointEntry, what: &str) -> Result<()> {
    let by_position = entry.velocity_by_position.as_ref().map(|e| e.span());
    let rate = entry.effort_rate.as_ref().map(|e| e.span());
    for (key, span) in [("velocity_by_position", by_position), ("effort_rate", rate)] {
        if let Some(span) = span {
            return Err(source.error(
                span.start,
                what,
                format!(
                    "{key} is kept for serial and tree robots only; remove it, and state a constant limit \
                     that it implies"
                ),
            ));
        }
    }
    Ok(())
}

/// Values of one entry on top of those that a joint has already.
fn overlay(
    source: Text,
    entry: &JointEntry,
    what: &str,
    joint: &mut Joint,
    warnings: &mut Vec<Warning>,
) -> Result<()> {
    refuse(source, entry, what)?;
    let stated = stated_limits(source, entry, what)?;
    let limits = &mut joint.limits;
    limits.position = stated.position.unwrap_or(limits.position);
    limits.velocity = stated.velocity.unwrap_or(limits.velocity);
    limits.effort = stated.effort.unwrap_or(limits.effort);
    let before = (
        joint.torque_noise,
        joint.position_resolution,
        joint.gear_ratio,
    );
    joint_values(source, entry, what, joint, warnings)?;
    joint.torque_noise = joint.torque_noise.or(before.0);
    joint.position_resolution = joint.position_resolution.or(before.1);
    joint.gear_ratio = joint.gear_ratio.or(before.2);
    Ok(())
}

impl Head<'_> {
    /// Name of the robot.
    pub(super) fn name(&self) -> String {
        match self.name {
            Some(n) if !n.get_ref().trim().is_empty() => n.get_ref().trim().to_string(),
            _ => file_stem(self.source.file),
        }
    }

    /// Acceleration of gravity.
    pub(super) fn gravity(&self) -> Result<Vector3<f64>> {
        match self.gravity {
            Some(g) => vector(self.source, g, "", "gravity"),
            None => Ok(Vector3::new(0.0, 0.0, -9.81)),
        }
    }

    /// The pose in the middle of the workspace.
    pub(super) fn home<const N: usize>(&self, names: &str) -> Result<[f64; N]> {
        match self.home {
            Some(home) => numbers(self.source, home, "", "home"),
            None => Err(self.source.error(
                0,
                "home",
                format!("state the middle of the workspace: home = [{names}]"),
            )),
        }
    }

    /// Entries of `[[joint]]` by name; no name twice.
    fn entries(&self) -> Result<Vec<(&str, &JointEntry)>> {
        let mut all: Vec<(&str, &JointEntry)> = Vec::new();
        for spanned in self.joint {
            let entry = spanned.get_ref();
            let name = entry.name.get_ref().as_str();
            if name.is_empty() {
                return Err(self.source.error(
                    spanned.span().start,
                    "[[joint]]",
                    "it has no name; add name = \"…\"",
                ));
            }
            if all.iter().any(|(n, _)| *n == name) {
                return Err(self.source.error(
                    entry.name.span().start,
                    &format!("joint `{name}`"),
                    "it has two [[joint]] entries; merge them",
                ));
            }
            all.push((name, entry));
        }
        Ok(all)
    }

    /// Actuators `prefix1`, `prefix2` …: what `[actuator]` says of all, then `[[joint]]` of each.
    pub(super) fn actuators(
        &self,
        prefix: &str,
        count: usize,
        motion: Motion,
        warnings: &mut Vec<Warning>,
    ) -> Result<Vec<Joint>> {
        let entries = self.entries()?;
        let mut all = Vec::new();
        for i in 1..=count {
            let name = format!("{prefix}{i}");
            let mut joint = Joint::new(&name, motion);
            self.shared(
                &mut joint,
                &mut if i == 1 { warnings.clone() } else { vec![] },
            )?;
            if let Some((_, entry)) = entries.iter().find(|(n, _)| *n == name) {
                overlay(
                    self.source,
                    entry,
                    &format!("joint `{name}`"),
                    &mut joint,
                    warnings,
                )?;
            }
            all.push(joint);
        }
        Ok(all)
    }

    /// What `[actuator]` says of every actuator.
    pub(super) fn shared(&self, joint: &mut Joint, warnings: &mut Vec<Warning>) -> Result<()> {
        let Some(entry) = self.actuator else {
            return Ok(());
        };
        if !entry.name.get_ref().is_empty() {
            return Err(self.source.error(
                entry.name.span().start,
                "[actuator]",
                "it describes all actuators and has no name; one of them is a [[joint]]",
            ));
        }
        overlay(self.source, entry, "[actuator]", joint, warnings)
    }

    /// The mechanism: joints as read, passive ones as `[[joint]]` says, and the workspace.
    pub(super) fn finish(
        &self,
        mut setup: Setup,
        actuators: Vec<Joint>,
        mut warnings: Vec<Warning>,
    ) -> Result<Mechanism> {
        let source = self.source;
        let names: Vec<String> = setup.robot.joint_names();
        for joint in &actuators {
            if let Some(j) = setup.robot.joints.iter_mut().find(|j| j.name == joint.name) {
                j.position_resolution = joint.position_resolution;
                j.gear_ratio = joint.gear_ratio;
                j.piston = joint.piston;
                j.stribeck = joint.stribeck;
                j.continuous_torque = joint.continuous_torque;
                j.continuous_power = joint.continuous_power;
                // what the model has moved into a body (lumped inertia) is no column any more
                for (own, wanted) in j.identify.iter_mut().zip(joint.identify) {
                    *own &= wanted;
                }
            }
        }
        for (name, entry) in self.entries()? {
            let what = format!("joint `{name}`");
            let at = entry.name.span().start;
            if actuators.iter().any(|a| a.name == name) {
                continue;
            }
            // poses of the platform are not joints
            let task = setup.task.names().contains(&name);
            match setup.robot.joints.iter_mut().find(|j| j.name == name) {
                Some(j) if !task => overlay(source, entry, &what, j, &mut warnings)?,
                _ => {
                    let known: Vec<&str> = names
                        .iter()
                        .map(String::as_str)
                        .filter(|n| !setup.task.names().contains(n))
                        .collect();
                    return Err(source.error(
                        at,
                        "[[joint]]",
                        format!(
                            "the mechanism has no joint `{name}`{}; its joints are {}",
                            did_you_mean(name, known.iter().copied()),
                            listed(&known)
                        ),
                    ));
                }
            }
        }
        if let Some(length) = self.length {
            setup.length = positive(source, length, "", "length")?;
        }
        setup.robot.prior = self.prior;
        let mut mechanism = Mechanism::new(setup)?;
        mechanism.text = source.text.to_string();
        mechanism.robot.warnings.splice(0..0, warnings.clone());
        mechanism.warnings.splice(0..0, warnings);
        self.workspace(&mut mechanism)?;
        self.margins(&mut mechanism)?;
        Ok(mechanism)
    }

    /// Reads `[margins]` into the mechanism.
    fn margins(&self, mechanism: &mut Mechanism) -> Result<()> {
        let Some(m) = self.margins else {
            return Ok(());
        };
        let (source, what) = (self.source, "[margins]");
        let margins = &mut mechanism.margins;
        for (key, value, to) in [
            ("singularity", &m.singularity, &mut margins.actuation),
            ("constraint", &m.constraint, &mut margins.constraint),
            ("distance", &m.distance, &mut margins.distance),
        ] {
            let Some(value) = value else { continue };
            let number = *value.get_ref();
            if !(number >= 0.0 && number.is_finite()) {
                return Err(source.error(
                    value.span().start,
                    what,
                    format!("{key} must be a number of at least 0, not {number}"),
                ));
            }
            *to = number;
        }
        let pairs = mechanism.pairs();
        let home = mechanism.home.clone();
        if let Some(u) = mechanism
            .pose_uses(&home, &pairs)
            .into_iter()
            .find(|u| u.used() > 1.0)
        {
            mechanism.warnings.push(Warning::new(
                WarningKind::OutsideLimits,
                u.name.clone(),
                format!(
                    "at home already beyond its limit: {:.4} where {:.4} is allowed; no design \
                     will be found",
                    u.value, u.limit
                ),
            ));
        }
        Ok(())
    }

    /// Reads `[workspace]` into the mechanism.
    fn workspace(&self, mechanism: &mut Mechanism) -> Result<()> {
        let Some(w) = self.workspace else {
            return Ok(());
        };
        let (source, what) = (self.source, "[workspace]");
        let ranges = [
            ("x", &w.x),
            ("y", &w.y),
            ("z", &w.z),
            ("roll", &w.roll),
            ("pitch", &w.pitch),
            ("yaw", &w.yaw),
            ("theta", &w.theta),
        ];
        if let Some(t) = &w.tilt {
            let tilt = positive(source, t, what, "tilt")?;
            if mechanism.task != Task::Pose {
                return Err(source.error(t.span().start, what, "this platform does not tilt"));
            }
            for k in [3, 4] {
                let home = mechanism.home[k];
                mechanism.workspace[k].position = [home - tilt, home + tilt];
            }
        }
        for (key, range) in ranges {
            let Some(range) = range else { continue };
            let at = range.span().start;
            let [low, high] = numbers::<2>(source, range, what, key)?;
            let Some(k) = mechanism.task.names().iter().position(|n| *n == key) else {
                return Err(source.error(
                    at,
                    what,
                    format!(
                        "the platform has no coordinate {key}; it moves in {}",
                        mechanism.task_names.join(", ")
                    ),
                ));
            };
            let home = mechanism.home[k];
            if !(low < high && low <= home && home <= high) {
                return Err(source.error(
                    at,
                    what,
                    format!(
                        "{key} = [{low}, {high}] must be [lower, upper] with home ({home}) inside"
                    ),
                ));
            }
            mechanism.workspace[k].position = [low, high];
        }
        let rates = [
            ("velocity", &w.velocity, false),
            ("acceleration", &w.acceleration, false),
            ("angular_velocity", &w.angular_velocity, true),
            ("angular_acceleration", &w.angular_acceleration, true),
        ];
        for (key, value, angular) in rates {
            let Some(value) = value else { continue };
            let x = positive(source, value, what, key)?;
            for (k, limits) in mechanism.workspace.iter_mut().enumerate() {
                if mechanism.task.is_angle(k) == angular {
                    match key.ends_with("velocity") {
                        true => limits.velocity = x,
                        false => limits.acceleration = x,
                    }
                }
            }
        }
        Ok(())
    }
}

/// A finite number that may be missing.
pub(super) fn optional(
    source: Text,
    v: &Option<Spanned<f64>>,
    what: &str,
    key: &str,
) -> Result<Option<f64>> {
    v.as_ref().map(|v| finite(source, v, what, key)).transpose()
}

/// The terms that any of the actuators identifies.
pub(super) fn identified(actuators: &[Joint]) -> Vec<JointTerm> {
    JointTerm::ALL
        .into_iter()
        .filter(|t| actuators.iter().any(|a| a.identify[*t as usize]))
        .collect()
}
