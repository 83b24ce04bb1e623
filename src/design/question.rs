//! What a motion is for: the unknowns that answer the question, what is estimated along, and how well is good enough.
//!
//! | question | asked for | estimated along |
//! |---|---|---|
//! | load | mass, centre of mass and tensor of what the robot carries | friction and constant of every drive |
//! | platform | the same of the platform itself | friction and constant of every drive |
//! | legs | base parameters of all other bodies of a parallel robot | the platform, joint terms |
//! | friction | joint terms of the drives | the bodies |
//!
//! **Load.** Record the robot empty and loaded on the same motion. With `Y_t` the ten columns of the body that carries the
//! load and `F` those of the drives, whatever else the empty robot deviates by drops out of the difference of the records
//! (`Y_t` is among its columns), and
//!
//! ```text
//! Cov φ_l = 2 (Y_tᵀ Π Y_t)⁻¹        Π: what a refit of F leaves
//! ```
//!
//! so the design minimises the variances of mass, centre of mass and tensor about it for a load that is named, each over
//! the square of an accuracy of [`ACCURACY`]. Constants of the drives count as free: they drift, and a motion that needs
//! them to stay gains nothing where they do not.

use super::criterion::{Condition, Criterion};
use super::settings::Settings;
use super::targets::{Targets, sizes};
use crate::base::BaseParameters;
use crate::error::{Error, Result};
use crate::plant::Plant;
use crate::robot::inertia::{NAMES, Quantities, UNITS};
use crate::robot::{Column, Inertia, JointTerm};
use crate::trajectory::RATE;
use faer::Mat;
use nalgebra::{Matrix3, Vector3};

/// What a motion is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Question {
    /// mass, centre of mass and tensor of a load
    Load,
    /// those of the platform of a parallel robot
    Platform,
    /// the other bodies of a parallel robot
    Legs,
    /// friction of the drives
    Friction,
}

/// Accuracies that count the same: of the mass (relative), of the centre of mass (m), of the tensor (relative to
/// `√(I_ii I_jj)`).
pub const ACCURACY: (f64, f64, f64) = (5e-4, 2e-4, 0.015);
/// Density of the load that is assumed where none is named, kg/m³.
pub const DENSITY: f64 = 1000.0;
/// Least mass of that load, of the bodies that move.
const LEAST: f64 = 0.05;
/// Standard deviation of what is estimated along, before the run, in its accuracies: free.
const FREE: f64 = 1e4;
/// Accuracy of a friction term that counts as one, relative to its nominal value.
const FRICTION: f64 = 0.02;
/// Random states that tell which of the ten parameters of a load can be told.
const STATES: usize = 400;

impl Question {
    /// `load`, `platform`, `legs`, `friction`.
    pub fn name(self) -> &'static str {
        match self {
            Question::Load => "load",
            Question::Platform => "platform",
            Question::Legs => "legs",
            Question::Friction => "friction",
        }
    }

    /// Harmonics, period (s) and periods that serve it, where nothing else is asked for.
    pub fn motion(self) -> (usize, f64, u32) {
        match self {
            Question::Load | Question::Platform => (9, 5.0, 12),
            Question::Legs => (9, 10.0, 6),
            Question::Friction => (7, 20.0, 3),
        }
    }

    /// Settings that serve it.
    pub fn settings(self) -> Settings {
        let (harmonics, period, periods) = self.motion();
        Settings {
            harmonics,
            period,
            periods,
            question: Some(self),
            criterion: self.criterion(),
            condition: Condition::Weighted,
            ..Settings::default()
        }
    }

    /// The criterion that it is judged by.
    pub fn criterion(self) -> Criterion {
        match self {
            Question::Legs => Criterion::Known,
            _ => Criterion::A,
        }
    }

    /// Refuses a robot of which it cannot be asked.
    ///
    /// # Errors
    /// [`Error::Argument`] with the reason and what can be asked instead.
    pub fn check(self, plant: &Plant) -> Result<()> {
        let no = |why: &str| {
            Err(Error::Argument(format!(
                "--for {}: {} {why}",
                self.name(),
                plant.name()
            )))
        };
        let tool = plant.tool();
        let platform = tool.is_some_and(|t| plant.robot().bodies[t].name == "platform");
        match self {
            Question::Load if tool.is_none() => no("has no body that could carry a load"),
            Question::Platform | Question::Legs if !plant.closed() => no(
                "is no parallel robot and has neither platform nor legs; --for load asks for what its last body \
                 carries, --for friction for its drives, and without --for for all of its bodies",
            ),
            Question::Platform if !platform => {
                no("has no body called `platform`; without --for all of its bodies are asked for")
            }
            Question::Legs if !platform => {
                no("has no platform and so no legs; without --for all of its bodies are asked for")
            }
            Question::Legs if !plant.parameters().iter().any(|p| of_legs(plant, p.kind)) => no(
                "has no unknowns of its legs: its file takes them as known; set `bodies = \"legs\"` or \
                 `bodies = \"all\"`",
            ),
            _ => Ok(()),
        }
    }
}

/// Whether a column is one of a body other than that which carries a load.
fn of_legs(plant: &Plant, column: Column) -> bool {
    matches!(column, Column::Inertial { body, .. } if plant.tool() != Some(body))
}

/// The load that counts where none is named: a cube of water that stands on the `x`-`y` plane of the body that carries
/// it, as heavy as that body, or a twentieth of all bodies where that is more.
pub fn ordinary_load(plant: &Plant) -> Inertia {
    let bodies = &plant.robot().bodies;
    let all: f64 = bodies.iter().map(|b| b.inertia.mass()).sum();
    let own = plant.tool().map_or(0.0, |t| bodies[t].inertia.mass());
    let mass = match own.max(LEAST * all) {
        m if m > 0.0 => m,
        _ => 1.0,
    };
    let side = (mass / DENSITY).cbrt();
    let tensor = Matrix3::identity() * (mass * side * side / 6.0);
    Inertia::from_com(mass, Vector3::new(0.0, 0.0, 0.5 * side), tensor)
}

/// The ten parameters of the body that carries a load as its actuators feel them.
///
/// # Errors
/// Numbers that are not finite.
pub fn felt(plant: &Plant, tool: usize) -> Result<BaseParameters> {
    let states = plant.random_states(STATES, 0x10ad);
    let columns = plant.body_columns(tool, &states)?;
    let names = NAMES.map(str::to_string).to_vec();
    BaseParameters::from_matrix(names, UNITS.to_vec(), columns.as_ref())
}

/// Accuracies that count the same for a load: of its mass, centre of mass and tensor.
pub fn accuracies(load: &Inertia) -> Quantities {
    let q = load.quantities();
    let mass = load.mass().abs().max(1e-9);
    let side = (mass / DENSITY).cbrt();
    // a point mass has no tensor to compare with
    let least = 0.01 * mass * side * side / 6.0;
    let principal = [4, 7, 9].map(|k| q[k].max(least));
    let pair = |a: usize, b: usize| ACCURACY.2 * (principal[a] * principal[b]).sqrt();
    let (m, c) = (ACCURACY.0 * mass, ACCURACY.1);
    [
        m,
        c,
        c,
        c,
        pair(0, 0),
        pair(0, 1),
        pair(0, 2),
        pair(1, 1),
        pair(1, 2),
        pair(2, 2),
    ]
}

/// What a design searches with.
pub struct Asked {
    /// the robot with the unknowns that count, and with the load that it may carry
    pub plant: Plant,
    /// `B` of the matrix judged
    pub transform: Mat<f64>,
    /// how well is good enough; `None` where the criterion is one of eigenvalues
    pub targets: Option<Targets>,
}

/// Puts a question to a robot; `count` gives the samples of the optimiser's period.
///
/// # Errors
/// A question that it cannot be asked, a load that no actuator feels.
pub fn asked(
    question: Question,
    plant: &Plant,
    settings: &Settings,
    count: impl Fn(&Plant) -> usize,
) -> Result<Asked> {
    question.check(plant)?;
    let recorded = f64::from(settings.periods) * settings.period * RATE;
    let kappa = |plant: &Plant| recorded / count(plant) as f64;
    match (question, plant.tool()) {
        (Question::Load, Some(tool)) => {
            let load = settings.load(plant);
            let plant = plant.asked_for_its_tool(tool).carrying(&load);
            let kappa = kappa(&plant);
            body(plant, tool, &load, kappa)
        }
        (Question::Platform, Some(tool)) => {
            let plant = plant.asked_for_its_tool(tool);
            let own = plant.robot().bodies[tool].inertia;
            let kappa = kappa(&plant);
            body(plant, tool, &own, kappa)
        }
        (Question::Legs, _) => {
            let base = plant.base()?;
            let kappa = kappa(plant);
            let units: Vec<&str> = base.kept.iter().map(|&k| base.units[k]).collect();
            let targets = Targets::new(&base.project(&plant.values()), &units, kappa);
            let kinds: Vec<Column> = base
                .kept
                .iter()
                .map(|&k| plant.parameters()[k].kind)
                .collect();
            Ok(Asked {
                transform: base.selection(),
                targets: Some(targets.only(|i| of_legs(plant, kinds[i]))),
                plant: plant.clone(),
            })
        }
        _ => {
            let plant = with_friction(plant);
            let kappa = kappa(&plant);
            friction(plant, kappa)
        }
    }
}

/// The robot with friction among its unknowns: that which its file lists, or viscous and Coulomb.
pub fn with_friction(plant: &Plant) -> Plant {
    let listed = |t: JointTerm| plant.actuators().iter().any(|j| j.identify[t as usize]);
    let usual = |t: JointTerm| matches!(t, JointTerm::Viscous | JointTerm::Coulomb);
    let terms: Vec<JointTerm> = JointTerm::ALL
        .into_iter()
        .filter(|t| usual(*t) || listed(*t))
        .collect();
    plant.clone().with_terms(&terms)
}

/// The ten of a body in coordinates whose unit is the accuracy asked for, and the terms of the drives beside them.
fn body(plant: Plant, tool: usize, load: &Inertia, kappa: f64) -> Result<Asked> {
    let felt = felt(&plant, tool)?;
    let accuracy = accuracies(load);
    // φ = J⁻¹ diag(a) z where all ten are felt; else each of those that are kept on its own
    let ten: Mat<f64> = match felt.kept.len() {
        10 => {
            use faer::linalg::solvers::Solve;
            let slopes = load.quantity_slopes();
            let j = Mat::from_fn(10, 10, |r, c| slopes[r][c]);
            let a = Mat::from_fn(10, 10, |r, c| if r == c { accuracy[r] } else { 0.0 });
            j.partial_piv_lu().solve(a)
        }
        0 => {
            return Err(Error::Infeasible(format!(
                "{}: no actuator feels what its body {} carries",
                plant.name(),
                plant.robot().bodies[tool].name
            )));
        }
        n => Mat::from_fn(10, n, |r, c| match felt.kept[c] == r {
            true if (1..4).contains(&r) => load.mass() * accuracy[r],
            true => accuracy[r],
            false => 0.0,
        }),
    };
    let parameters = plant.parameters();
    let noise = plant.torque_noise().0;
    // accuracy, standard deviation before the run, weight
    let mut each = vec![(1.0, f64::INFINITY, 1.0); ten.ncols()];
    let mut drives = Vec::new();
    for (p, parameter) in parameters.iter().enumerate() {
        let Column::Term { joint, term } = parameter.kind else {
            continue;
        };
        let Some(a) = plant.actuated().iter().position(|&j| j == joint) else {
            continue;
        };
        let fast = plant.robot().joints[joint].limits.velocity;
        let accuracy = match term {
            JointTerm::Viscous if fast.is_finite() => noise[a] / fast,
            _ => noise[a],
        };
        drives.push(p);
        each.push((accuracy, FREE * accuracy, 0.0));
    }
    let n = ten.ncols();
    let transform = Mat::from_fn(parameters.len(), n + drives.len(), |p, c| {
        match (c.checked_sub(n), parameters[p].kind) {
            (None, Column::Inertial { body, k }) if body == tool => ten[(k, c)],
            (Some(d), _) if drives[d] == p => 1.0,
            _ => 0.0,
        }
    });
    Ok(Asked {
        targets: Some(Targets::sum(&each, kappa)),
        transform,
        plant,
    })
}

/// Friction of the drives beside the bodies.
fn friction(plant: Plant, kappa: f64) -> Result<Asked> {
    let base = plant.base()?;
    let units: Vec<&str> = base.kept.iter().map(|&k| base.units[k]).collect();
    let sizes = sizes(&base.project(&plant.values()), &units);
    let each: Vec<(f64, f64, f64)> = base
        .kept
        .iter()
        .zip(&sizes)
        .map(|(&k, size)| {
            let wanted = match plant.parameters()[k].kind {
                Column::Term { joint, term } => {
                    term != JointTerm::Armature && plant.actuated().contains(&joint)
                }
                _ => false,
            };
            (
                FRICTION * size,
                FREE * FRICTION * size,
                f64::from(u8::from(wanted)),
            )
        })
        .collect();
    Ok(Asked {
        transform: base.selection(),
        targets: Some(Targets::sum(&each, kappa)),
        plant,
    })
}
