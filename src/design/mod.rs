//! Design of exciting trajectories: the criterion, the limits, and the sequential convex programs
//! that bring them together.
//!
//! ```text
//! minimise over x   cond W(x)      (or another criterion)
//! subject to        q_min ≤ q(t; x) ≤ q_max,  |q̇| ≤ v,  |q̈| ≤ a,  |q⃛| ≤ j,  |τ| ≤ τ_max   for all t
//! ```
//!
//! with `q(t; x)` a Fourier series whose end conditions are built in ([`Basis`]). The problem is
//! not convex, so [`design`] runs many starts in rounds: eight random ones are each improved by
//! convex programs (`solve`), the best three of them are followed to the end, and later rounds
//! also start from disturbed copies of the best so far. Each start has its own stream of random
//! numbers and rounds are compared in a fixed order, so the result is the same for the same seed
//! whatever the number of threads, unless a time limit ends the run.

mod by_position;
mod clearance;
#[doc(hidden)]
pub mod criterion;
#[doc(hidden)]
pub mod diagnostic;
#[doc(hidden)]
pub mod information;
pub(crate) mod limits;
mod mechanism_limits;
pub mod parts;
pub(crate) mod path;
mod problem;
mod purpose;
#[doc(hidden)]
pub mod question;
#[doc(hidden)]
pub mod record;
mod restore;
mod result;
mod rounds;
pub(crate) mod settings;
pub(crate) mod solve;
pub(crate) mod start;
mod targets;
mod tool;
pub(crate) mod torque;
mod torque_rate;

pub(crate) use criterion::Condition;
pub use criterion::Criterion;
pub(crate) use purpose::Question;
pub(crate) use result::Control;
pub use result::Design;
pub use settings::Settings;

use crate::base::BaseParameters;
use crate::collision::Scene;
use crate::error::{Error, Result};
use crate::plant::Plant;
use crate::robot::{JointTerm, Robot};
use crate::trajectory::{Basis, RATE};
use clearance::ClearanceLimits;
use criterion::Targets;
use information::Information;
use limits::Limits;
use mechanism_limits::MechanismLimits;
use path::{All, PathLimits};
use problem::{Problem, first_certified};
use question::Asked;
use std::sync::Arc;
use std::time::Instant;
use tool::ToolLimits;
use torque::TorqueLimits;
use torque_rate::TorqueRateLimits;

/// Designs an exciting trajectory: a Fourier series for each coordinate of the plant (the joints of
/// a tree; the platform or the actuators of a closed chain), inside all limits for all time.
///
/// ```
/// use excite::Plant;
/// use excite::design::{Settings, design};
///
/// let plant = Plant::load("planar2")?;
/// let settings = Settings::default().with(|set| set.starts = Some(1));
/// let result = design(&plant, &settings)?;
/// assert!(result.plant.certify(&result.trajectory.fourier, 1.0)?.satisfied());
/// # Ok::<(), excite::Error>(())
/// ```
///
/// # Errors
/// [`Error::Argument`] for settings that cannot be, [`Error::Infeasible`] where no trajectory is
/// inside the limits (torques at rest, say), none that was found is certified, or nothing can be
/// identified.
pub fn design(plant: &Plant, settings: &Settings) -> Result<Design> {
    design_with(plant, settings, &Control::default())
}

/// [`design`] with progress and cancellation. When it is cancelled, and when a time limit ends the
/// run, the best feasible trajectory so far is returned.
///
/// ```
/// use excite::Plant;
/// use excite::design::{Settings, design_with};
/// use excite::design::parts::Control;
/// use excite::design::parts::Progress;
///
/// let plant = Plant::load("planar2")?;
/// let settings = Settings::default().with(|set| set.starts = Some(1));
/// let tell = |p: Progress| println!("{} starts, best {:.2}", p.starts, p.best);
/// let control = Control { progress: &tell, ..Control::default() };
/// let result = design_with(&plant, &settings, &control)?;
/// assert!(!result.record.starts.is_empty());
/// # Ok::<(), excite::Error>(())
/// ```
///
/// # Errors
/// As [`design`].
pub fn design_with(plant: &Plant, settings: &Settings, control: &Control) -> Result<Design> {
    settings.check(plant.moved())?;
    let begin = Instant::now();
    let plant = &plant.clone().with_assumed_limits();
    let moved = plant.moved();
    let basis = basis(moved, settings)?;
    let count = |plant: &Plant| samples(plant.robot(), &basis.harmonics);
    let asked = match settings.question {
        Some(question) => question::asked(question, plant, settings, count)?,
        None => everything(plant, settings, count(plant))?,
    };
    let (searched, count) = (&asked.plant, count(&asked.plant));
    let noise = searched.torque_noise().0;
    let weights = (asked.targets.is_some() || settings.condition == Condition::Weighted)
        .then_some(noise.as_slice());
    let (period, derate) = (settings.period, settings.derate);
    let info = Information::new(searched, &basis, period, count, asked.transform, weights);
    let scene = plant.scene()?;
    first_certified(|tighter| {
        let share = derate * tighter;
        let path: Option<Box<dyn PathLimits + '_>> = match searched.mechanism() {
            None => along_tree(searched, share, tighter, &basis, period, scene.clone()),
            Some(m) => Some(Box::new(MechanismLimits::new(m, share, period, count))),
        };
        let mut limits = Limits::new(moved, &basis, period, derate);
        if let Some(home) = plant.home() {
            limits = limits.resting(home);
        }
        Problem {
            plant: searched,
            empty: (settings.question == Some(Question::Load)).then_some(plant),
            settings,
            basis: &basis,
            info: &info,
            limits,
            path: path.as_deref(),
            targets: asked.targets.clone(),
        }
        .solve(begin, control)
    })
    .map(|found| Design {
        plant: match settings.question {
            Some(Question::Friction) => question::with_friction(plant),
            _ => plant.clone(),
        },
        ..found
    })
}

/// What all base parameters are judged by.
fn everything(plant: &Plant, settings: &Settings, count: usize) -> Result<Asked> {
    let base = plant.base()?;
    something_to_identify(plant.name(), &base)?;
    let targets = (settings.criterion == Criterion::Known).then(|| {
        let units: Vec<&str> = base.kept.iter().map(|&k| base.units[k]).collect();
        let recorded = f64::from(settings.periods) * settings.period * RATE;
        let nominal = base.project(&plant.values());
        Targets::new(&nominal, &units, recorded / count as f64)
    });
    Ok(Asked {
        transform: transform(&base, settings),
        targets,
        plant: plant.clone(),
    })
}

/// Torques, the tool point and clearances of a tree, where there is anything to keep.
fn along_tree<'a>(
    plant: &'a Plant,
    share: f64,
    tighter: f64,
    basis: &Basis,
    period: f64,
    scene: Option<Arc<Scene>>,
) -> Option<Box<dyn PathLimits + 'a>> {
    let robot = plant.robot();
    let mut all: Vec<Box<dyn PathLimits + 'a>> = Vec::new();
    if let Some(torques) = TorqueLimits::new(robot, share) {
        all.push(Box::new(torques));
    }
    if let Some(rates) = TorqueRateLimits::new(robot, share, period) {
        all.push(Box::new(rates));
    }
    if let Some(tool) = ToolLimits::new(robot, share) {
        all.push(Box::new(tool));
    }
    if let Some(scene) = scene.filter(|s| !s.pairs.is_empty()) {
        let clear = ClearanceLimits::new(scene, robot, basis, period, tighter);
        all.push(Box::new(clear));
    }
    (!all.is_empty()).then(|| Box::new(All(all)) as _)
}

fn something_to_identify(name: &str, base: &BaseParameters) -> Result<()> {
    match base.count() {
        0 => Err(Error::Infeasible(format!(
            "{name}: no parameter can be identified from actuator torques, so there is nothing to \
             excite; check gravity, axes and `identify`"
        ))),
        _ => Ok(()),
    }
}

fn basis(robot: &Robot, settings: &Settings) -> Result<Basis> {
    let harmonics = settings.grid.harmonics(settings.harmonics, settings.seed);
    let start = settings.start.as_deref();
    Basis::new(&harmonics, settings.ends, robot.dof(), start)
}

/// `B` of the matrix that the settings ask for.
fn transform(base: &BaseParameters, settings: &Settings) -> faer::Mat<f64> {
    match (settings.criterion, settings.condition) {
        (Criterion::Known, _) => base.selection(),
        (_, Condition::Invariant) => base.row_space.clone(),
        _ => base.selection(),
    }
}

/// Samples of a period in the optimiser: enough for the harmonics that trigonometric functions of
/// the positions add, more where the sign of the velocity is a column.
fn samples(robot: &Robot, harmonics: &[u32]) -> usize {
    let most = harmonics.iter().copied().max().unwrap_or(1) as usize;
    let coulomb = robot
        .joints
        .iter()
        .any(|j| j.identify[JointTerm::Coulomb as usize]);
    (most * if coulomb { 36 } else { 20 }).clamp(64, 8000)
}
