//! Models as files: one writer a format.
//!
//! | file | module | holds | robots |
//! |---|---|---|---|
//! | `robot.urdf` | [`urdf`] | tree, inertia, limits, viscous and Coulomb friction | all |
//! | `robot.xml` | `mujoco` | the same for MuJoCo, rotor inertia, gravity, springs, drives | serial |
//! | `robot.xml` | `closed` | the same with loops as equality constraints | parallel |
//! | `effects.py` | `effects` | what MuJoCo has no element for, as functions of state and time step | all |
//! | `robot.toml` | `robot_toml`, [`mechanism`] | what the other commands read, geometry and loops included | all |
//!
//! On demand ([`further`]): `robot.sdf` (Gazebo), `robot.usda` (USD physics), `actuators.py` (Isaac Lab).
//!
//! [`into_scene`] writes a model into an MJCF or URDF of its user, where only what differs is changed.
//!
//! A new format is one file with an implementation of [`Format`], and one line in [`FORMATS`]. What a model
//! has and a format cannot hold stands in it as a comment ([`Remark`]). The bodies that are written can
//! exist: masses are positive and principal moments fulfil the triangle inequality ([`possible`]).

mod closed;
pub(crate) mod effects;
pub(crate) mod element;
mod format;
pub(crate) mod isaac_lab;
#[doc(hidden)]
pub mod mechanism;
pub(crate) mod model;
pub(crate) mod mujoco;
pub mod parts;
pub(crate) mod remark;
pub(crate) mod robot_toml;
pub(crate) mod scene;
pub(crate) mod sdf;
pub(crate) mod simulator;
#[doc(hidden)]
pub mod urdf;
pub(crate) mod usd;

#[doc(hidden)]
pub use element::{Element, Form};
pub(crate) use format::{Format, Part};
pub(crate) use model::Model;
#[doc(hidden)]
pub use remark::Remark;
pub(crate) use scene::Edited;
pub use scene::into_scene;
pub(crate) use scene::page as scene_page;

use crate::error::{Result, Warning, WarningKind};
use crate::plant::{Column, Plant};
use crate::robot::{Inertia, Robot};
use nalgebra::{Matrix3, Rotation3, SymmetricEigen, Vector3};

/// All formats.
#[doc(hidden)]
pub const FORMATS: [&dyn Format; 5] = [
    &urdf::Urdf,
    &mujoco::Mujoco,
    &closed::Closed,
    &effects::Effects,
    &robot_toml::RobotToml,
];

/// Formats that are written where they are asked for, by their names on the command line. None was run in its simulator.
#[doc(hidden)]
pub const FURTHER: [(&str, &dyn Format); 3] = [
    ("sdf", &sdf::Sdf),
    ("usd", &usd::Usd),
    ("isaac-lab", &isaac_lab::IsaacLab),
];

/// The formats of [`FURTHER`] with these names, for a robot of this kind.
///
/// # Errors
/// A name that there is not; a closed chain.
pub fn further(names: &[String], plant: &Plant) -> Result<Vec<&'static dyn Format>> {
    let one = |name: &String| {
        let found = FURTHER.iter().find(|(n, _)| n == name).map(|(_, f)| *f);
        let format = found.ok_or_else(|| {
            let known: Vec<&str> = FURTHER.iter().map(|(n, _)| *n).collect();
            crate::Error::Argument(format!("`{name}` is none of {}", known.join(", ")))
        })?;
        match format.holds(plant) {
            true => Ok(format),
            false => Err(crate::Error::Infeasible(format!(
                "{}: closed chains are not written for {}",
                plant.name(),
                format.name()
            ))),
        }
    };
    names.iter().map(one).collect()
}

/// Breakaway friction of the model, which only `robot.toml` holds, in words.
fn breakaway(robot: &Robot) -> Vec<String> {
    let sticks = robot.joints.iter().filter(|j| j.stribeck.force > 0.0);
    sticks
        .map(|j| {
            format!(
                "Breakaway friction of {} on {}, falling to 1/e at {}, is not written: there is no element for it",
                j.stribeck.force, j.name, j.stribeck.velocity
            )
        })
        .collect()
}

#[doc(hidden)]
/// Names of the files that a robot of this kind may be written to.
pub fn files(plant: &Plant) -> Vec<&'static str> {
    let held = FORMATS.iter().filter(|f| f.holds(plant));
    held.map(|f| f.file()).collect()
}

/// Names of all files.
#[doc(hidden)]
pub fn all() -> Vec<&'static str> {
    let mut all: Vec<&str> = FORMATS.iter().map(|f| f.file()).collect();
    all.dedup();
    all
}

/// Names of the files that a model needs.
pub(crate) fn needed(model: &Model) -> Vec<&'static str> {
    let held = FORMATS.iter().filter(|f| f.holds(model.plant));
    held.filter(|f| f.needed(model)).map(|f| f.file()).collect()
}

/// Every file of a model that it needs, in the order of [`files`], with its text or why there is none.
///
/// ```
/// use excite::Plant;
/// use excite::export::write;
/// use excite::export::parts::Model;
///
/// let plant = Plant::load("ur5e")?;
/// let mut robot = plant.robot().clone();
/// robot.joints[0].terms[2] = 7.5; // Coulomb friction as it was identified, N m
/// let model = Model { plant: &plant, robot: &robot, remarks: &[] };
/// for (name, text) in write(&model) {
///     assert!(!text?.is_empty(), "{name}"); // robot.urdf, robot.xml, robot.toml
/// }
/// # Ok::<(), excite::Error>(())
/// ```
pub fn write(model: &Model) -> Vec<(&'static str, Result<String>)> {
    let held = FORMATS.iter().filter(|f| f.holds(model.plant));
    held.filter(|f| f.needed(model))
        .map(|f| (f.file(), f.write(model)))
        .collect()
}

impl Model<'_> {
    /// Bodies whose values are not those of a body that can exist, for which the nearest is written.
    pub fn warnings(&self) -> Vec<Warning> {
        let all = impossible(self.plant, self.robot).into_iter();
        let one = |b: usize| {
            Warning::new(
                WarningKind::InertiaImpossible,
                self.robot.bodies[b].name.clone(),
                "its values are not those of a body that can exist; the nearest one that can is in the \
                 robot files",
            )
        };
        all.map(one).collect()
    }
}

/// Bodies of a robot whose values are not those of a body that can exist. Bodies of which the plant
/// knows a part of the ten parameters only stand for no body and are left out.
#[doc(hidden)]
pub fn impossible(plant: &Plant, robot: &Robot) -> Vec<usize> {
    let raw = plant.raw();
    let own = |b: usize, c: &Column| matches!(c, Column::Inertial { body, .. } if *body == b);
    // raw columns that an unknown stands for; of a body that is known there are none
    let unknown = |b: usize, wanted: usize| {
        let at = raw
            .iter()
            .position(|c| *c == Column::Inertial { body: b, k: wanted });
        at.is_some_and(|at| plant.parameters().iter().any(|p| p.raw.contains(&at)))
    };
    let whole = |b: &usize| {
        let known = !raw.iter().any(|c| own(*b, c));
        known || [0, 4, 7, 9].iter().all(|k| unknown(*b, *k))
    };
    let able = |b: &usize| {
        let inertia = &robot.bodies[*b].inertia;
        possible(inertia) == *inertia
    };
    (0..robot.bodies.len())
        .filter(whole)
        .filter(|b| !able(b))
        .collect()
}

/// Least principal second moment of mass of a body as a share of the largest, where it had to be moved.
const LEAST: f64 = 1e-6;
/// Part of the largest second moment by which rounding may make another negative.
const ROUNDING: f64 = 1e-9;

/// Moments of a tensor by the names that URDF and SDFormat have for them.
pub(crate) fn named_moments(tensor: &Matrix3<f64>) -> [(&'static str, f64); 6] {
    [
        ("ixx", tensor.m11),
        ("ixy", tensor.m12),
        ("ixz", tensor.m13),
        ("iyy", tensor.m22),
        ("iyz", tensor.m23),
        ("izz", tensor.m33),
    ]
}

/// The nearest body that can exist: the same where it can, otherwise with the same mass and centre and
/// with the negative second moments about it raised to zero, where `Σ_c = ½ tr(I_c) 1 − I_c` (the
/// triangle inequality of the principal moments is `Σ_c ⪰ 0`; Wensing, Kim & Slotine 2018). A body of
/// negative mass becomes one of a milligram at its origin. One without mass stays as it is.
#[doc(hidden)]
pub fn possible(inertia: &Inertia) -> Inertia {
    if inertia.mass() < 0.0 {
        return bounded(
            &Inertia([1e-6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
            LEAST,
            1e-12,
        );
    }
    let e = second_moments(inertia).eigenvalues;
    match inertia.mass() == 0.0 || e.min() >= -ROUNDING * e.max().abs() {
        true => *inertia,
        false => bounded(inertia, LEAST, 0.0),
    }
}

fn second_moments(inertia: &Inertia) -> SymmetricEigen<f64, nalgebra::U3> {
    let tensor = inertia.tensor_com();
    (Matrix3::identity() * (0.5 * tensor.trace()) - tensor).symmetric_eigen()
}

/// A body with second moments about its centre of at least `share` of the largest and at least `least`,
/// kg m²; the same where it has them.
pub(crate) fn bounded(inertia: &Inertia, share: f64, least: f64) -> Inertia {
    let mut e = second_moments(inertia);
    let floor = (share * e.eigenvalues.max()).max(least);
    if e.eigenvalues.min() >= floor {
        return *inertia;
    }
    e.eigenvalues.iter_mut().for_each(|x| *x = x.max(floor));
    let sigma = e.recompose();
    let tensor = Matrix3::identity() * sigma.trace() - sigma;
    let tensor = 0.5 * (tensor + tensor.transpose());
    Inertia::from_com(
        inertia.mass(),
        inertia.com().unwrap_or_else(Vector3::zeros),
        tensor,
    )
}

/// Text that may stand in an XML attribute.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;")
}

/// Lines as an XML comment; none without lines.
fn xml_comment(lines: &[String]) -> String {
    match lines.is_empty() {
        true => String::new(),
        // two hyphens may not stand in a comment
        false => format!("<!--\n  {}\n-->\n", lines.join("\n  ").replace("--", "- -")),
    }
}

/// Roll, pitch and yaw of a rotation.
fn rpy(r: &Matrix3<f64>) -> [f64; 3] {
    let (roll, pitch, yaw) = Rotation3::from_matrix_unchecked(*r).euler_angles();
    [roll, pitch, yaw]
}

/// A name for the base that no link has.
///
/// That of the root link as it was read: volumes and frames of `robot.toml` name it.
fn base_name(robot: &Robot) -> String {
    let links = robot.geometry.links.iter();
    let mut roots = links.filter(|l| l.body.is_none() && l.parent.is_none());
    let mut name = roots.next().map_or("base".into(), |l| l.name.clone());
    while robot.bodies.iter().any(|b| b.name == name) {
        name.push('_');
    }
    name
}

#[cfg(test)]
mod tests;
