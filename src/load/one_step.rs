//! All parameters of the load at once, by weighted least squares over the actuators.

mod fitted;
mod geometry;
mod reweight;
mod solver;
mod spectrum;
mod stream;
mod ten;
mod zeros;

use self::reweight::Fit;
pub(super) use fitted::rms;
pub use fitted::{Fitted, JointFriction};
pub(super) use solver::Solver;
pub(super) use spectrum::{Rest, samples as of_rows};
pub use stream::Step;
pub use zeros::Decision;

use super::body::LoadBody;
use super::records::{Loaded, of_platform};
use super::settings::{Parameters, Settings};
use super::suspicion;
use super::system::System;
use super::weight::Spread;
use crate::error::{Result, Warning, WarningKind};
use crate::log::Payload;
use crate::plant::Plant;
use crate::robot::Inertia;

/// Condition number above which the motion hardly excites the load.
const POOR: f64 = 1e4;

/// Result of `estimate`.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct OneStep {
    /// the load
    pub load: LoadBody,
    /// records
    pub records: Vec<Fitted>,
    /// spread of the residual of each actuator
    pub spreads: Vec<Spread>,
    /// what the empty platform of a closed chain deviates by from the robot file, ten parameters about its origin; `None`
    /// without a record of it, and of a serial robot
    pub platform: Option<[f64; 10]>,
    /// standard deviation of the coordinates of the legs' joints and of their lengths from the robot file, m, where the
    /// records show one: the estimate counts them as unknowns
    pub geometry: Option<f64>,
    /// constant forces of the actuators: shared by the records, drifting or free; empty with a single record
    pub zeros: Vec<Decision>,
    /// the load as it became known, block by block of the loaded records
    #[serde(skip)]
    pub stream: Vec<Step>,
    /// condition number of the weighted columns of the load, scaled to unit length
    pub condition: f64,
    /// parameters of the load that cannot be told, with the reason
    pub unknown: Vec<String>,
    /// what was found
    pub warnings: Vec<Warning>,
}

/// Estimates the load of the records with an unknown one.
///
/// # Errors
/// A motion that does not excite the load, or signals that are not finite.
pub fn estimate(
    plant: &Plant,
    tool: usize,
    records: &[Loaded],
    settings: &Settings,
) -> Result<OneStep> {
    let known = |r: &&Loaded| matches!(r.payload, Payload::Known { .. });
    let used: Vec<&Loaded> = records.iter().filter(|r| !known(r)).collect();
    let empty = used.iter().any(|r| r.payload == Payload::None);
    let system = System::new(plant, tool, &used, empty)?;
    let suspicions = match settings.checked {
        true => suspicion::prepared(plant, tool, &system)?,
        false => Vec::new(),
    };
    let unknowns = ten::unknowns(&system, settings.parameters)?;
    let noise = reweight::first_noise(plant, &system);
    let fit = |geometry| {
        let mut solver = Solver::new(&system, unknowns.clone());
        solver.geometry = geometry;
        Fit::new(solver, &noise, settings)
    };
    let Fit {
        solver,
        mut solution,
        covariance: mut all,
        spreads,
    } = geometry::refined(plant, fit(None)?, &fit)?;
    let zeros = zeros::decide(&solver, &mut solution, &mut all);
    let (mut phi, covariance) = ten::values(&solver, &solution, &all);
    let (mut known, mut unknown) = ten::known(&system);
    if settings.parameters == Parameters::MassCom {
        phi = ten::point(&phi).0;
        known[4..].fill(false);
        unknown.retain(|u| !u.starts_with('I'));
    }
    let first = system.deviations.len();
    let condition = ten::condition(&solution.r, first, solver.load.len());
    let full = settings.parameters == Parameters::Full;
    if settings.checked && known[0] {
        suspicion::negative(phi[0], covariance[(0, 0)].max(0.0).sqrt())?;
    }
    let free = LoadBody::new(Inertia(phi), covariance.clone(), known, false)?;
    let stream = stream::stream(&solver, &solution, &zeros, &spreads, &free)?;
    let load = LoadBody::new(Inertia(phi), covariance, known, settings.consistent && full)?;
    Ok(OneStep {
        warnings: suspicions
            .into_iter()
            .chain(geometry::warning(&solver))
            .chain(warnings(
                &load,
                full && known.iter().all(|k| *k),
                &unknown,
                condition,
            ))
            .collect(),
        records: (0..system.parts.len())
            .map(|p| fitted::fitted(&solver, &solution, &all, &load, p))
            .collect(),
        platform: (empty && of_platform(plant)).then(|| ten::platform(&system, &solution)),
        geometry: solver.geometry.as_ref().map(|g| g.spread),
        zeros,
        stream,
        load,
        spreads,
        condition,
        unknown,
    })
}

/// What is imperfect; `all` where all ten parameters were estimated and are known.
fn warnings(load: &LoadBody, all: bool, unknown: &[String], condition: f64) -> Vec<Warning> {
    let mut out = Vec::new();
    let mut warn = |kind, message: String| out.push(Warning::new(kind, "load", message));
    if !unknown.is_empty() {
        warn(
            WarningKind::NotIdentifiable,
            format!(
                "this robot cannot tell all ten parameters: {}",
                unknown.join("; ")
            ),
        );
    }
    if condition > POOR {
        warn(
            WarningKind::NotExcited,
            format!(
                "the motion hardly excites the load (condition number {condition:.1e}): turn the \
             load about several axes, at more than one frequency"
            ),
        );
    }
    if load.projected {
        warn(
            WarningKind::InertiaImpossible,
            "the estimate itself is no body that can exist; the nearest one is given".into(),
        );
    } else if all && !load.consistent {
        warn(
            WarningKind::InertiaImpossible,
            "the estimate is no body that can exist: its inertia is not known well enough".into(),
        );
    }
    out
}
