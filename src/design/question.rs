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

pub(crate) use super::purpose::of_legs;
use super::purpose::{DENSITY, Question};
use super::settings::Settings;
use super::targets::{Targets, sizes};
use crate::base::BaseParameters;
use crate::error::{Error, Result};
use crate::plant::Plant;
use crate::robot::inertia::{NAMES, Quantities, UNITS};
use crate::robot::{Column, Inertia, JointTerm};
use crate::trajectory::RATE;
use faer::Mat;

/// Accuracies that count the same: of the mass (relative), of the centre of mass (m), of the tensor (relative to
/// `√(I_ii I_jj)`).
pub const ACCURACY: (f64, f64, f64) = (5e-4, 2e-4, 0.015);
/// Standard deviation of what is estimated along, before the run, in its accuracies: free.
const FREE: f64 = 1e4;
/// Accuracy of a friction term that counts as one, relative to its nominal value.
const FRICTION: f64 = 0.02;
/// Random states that tell which of the ten parameters of a load can be told.
const STATES: usize = 400;

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
