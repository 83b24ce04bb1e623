//! Kinematic calibration: the geometry of a robot from joint readings and what a camera, a tracker, a socket, a plane
//! or a gauge says of its tool.
//!
//! ```text
//! minimise over x   Σ ρ(|Σ_r^(−1/2) r(q, y; x)|)  +  |P^(−1/2) x|²
//! ```
//!
//! with the residuals of `model`, the prior `P` of the manufacturing tolerances, and a loss `ρ` that strays do not
//! bend (`fit`). Which effects of the joints stand beside the geometry is decided by cross-validation of the rows
//! that are fitted; the rows held out judge the result and nothing else.

mod actuators_at;
mod cells;
mod doubts;
mod effects;
mod feature;
mod file;
mod fit;
mod frame;
mod gravity;
mod identifiable;
#[doc(hidden)]
pub mod json;
mod judge;
mod kin;
mod kind;
mod layout;
mod model;
mod open;
#[doc(hidden)]
pub mod page;
mod parallel;
mod pixels;
#[doc(hidden)]
pub mod poses;
mod result;
mod robust;
mod rows;
mod select;
mod serial;
mod start;
#[cfg(test)]
mod tests;
mod unknown;
#[doc(hidden)]
pub mod write;
mod write_parallel;

pub use file::{Calibration, Distance, EFFECTS, Measurement, Tolerances};
pub use frame::Frame;
pub use identifiable::{Confounded, Identifiability};
pub use judge::{Errors, Stats};
pub use kind::Kind;
pub use model::{Algorithm, Settings};
pub use open::{Opened, open};
pub use result::{Calibrated, DistanceResult, GroupResult, Identified, Outlier, RowResult};
pub use select::Trial;
pub use unknown::{Part, Unknown};

use crate::error::{Error, Result, Warning, WarningKind};
use feature::Feature;
use fit::Plan;
use kin::Kin;
use model::Model;
use std::path::Path;

/// Reads a `calibration.toml`, its robot and its rows.
///
/// # Errors
/// As [`Calibration::read`] and [`open()`].
pub fn read(path: impl AsRef<Path>) -> Result<(Calibration, Opened)> {
    Calibration::read(path.as_ref(), |robot, frame| {
        let opened = open(robot, frame)?;
        let joints = opened.joints.clone();
        Ok((opened, joints))
    })
}

/// Calibrates.
///
/// # Errors
/// Too few rows, rows that contradict the robot, a robot whose geometry cannot be calibrated.
pub fn calibrate(input: &Calibration, opened: &Opened, settings: Settings) -> Result<Calibrated> {
    let mut warnings: Vec<Warning> = opened.plant.warnings().to_vec();
    // what a calibration does not use is not worth a word
    warnings.retain(|w| {
        !matches!(
            w.kind,
            WarningKind::InertiaMissing | WarningKind::LimitsMissing
        )
    });
    warnings.extend(input.warnings.iter().cloned());
    let fitted = input.rows.iter().filter(|r| r.fit).count();
    if fitted < 3 {
        return Err(Error::file(
            &input.path,
            "",
            format!(
                "{fitted} rows are for the fit; at least 3 are needed, and several times the unknowns are good"
            ),
        ));
    }
    let gravity = match &opened.kin {
        Kin::Arm(_) => gravity::gravity(input, opened, &mut warnings)?,
        Kin::Parallel(_) => None,
    };
    let postures: Vec<Vec<f64>> = input.rows.iter().map(|r| r.q.clone()).collect();
    let torques = gravity.as_ref().map(|g| g.torques(&postures));
    let poses: Vec<Option<Frame>> = input
        .rows
        .iter()
        .map(|r| opened.kin.nominal(&r.q).ok())
        .collect();
    doubts::unreached(input, &poses, &mut warnings)?;
    let start = start::start(input, &opened.kin, &poses)?;
    let make = |features: Vec<Feature>| {
        let start = start.clone();
        Model::new(
            input,
            &opened.kin,
            features,
            torques.as_deref(),
            start,
            &poses,
            settings,
        )
    };
    let nominal = make(Vec::new());
    let x0 = vec![0.0; nominal.count()];
    let mut plan = Plan {
        weights: (input.rows.iter().zip(&poses))
            .map(|(r, p)| f64::from(u8::from(r.fit && p.is_some())))
            .collect(),
        free: vec![false; nominal.count()],
        robust: true,
    };
    let x_before = robust::set_up(&nominal, &plan, &x0)?;
    let before = judge::errors(&nominal, &x_before);
    doubts::suspicious(input, &before, &mut warnings);
    doubts::unmoved(input, &opened.joints, &mut warnings);
    let names = &opened.joints;
    let motions = opened.kin.motions(names.len());
    let columns = |part: Part| {
        let none = || vec![vec![0.0; names.len()]; input.rows.len()];
        match opened.kin {
            Kin::Parallel(_) => Vec::new(),
            Kin::Arm(_) => match &torques {
                Some(t) => effects::features(part, names, &motions, t),
                None => effects::features(part, names, &motions, &none()),
            },
        }
    };
    let chosen = select::choose(input, &make, &columns)?;
    let mut model = make(chosen.features);
    let mut x = robust::extend(&nominal, &model, &x_before);
    plan.free = robust::seen(&model, &plan);
    let identifiability = {
        // what can be told hangs on geometry and postures, not on noise; the algorithms of the paper see no orientation
        let mut exact = model.clone();
        exact.consistent = true;
        exact.settings.orientation = false;
        identifiable::assess(&exact, &plan, &x)?
    };
    if identifiability.gap < 1e3 && identifiability.rank < identifiability.total {
        warnings.push(Warning::new(
            WarningKind::RankGap,
            "identifiability",
            format!(
                "the border between what can be told and what cannot is blurred (gap {})",
                crate::error::number(identifiability.gap)
            ),
        ));
    }
    let residuals: usize = (0..input.rows.len())
        .filter(|&i| input.rows[i].fit)
        .map(|i| model.residuals(i))
        .sum();
    if residuals < identifiability.total {
        warnings.push(Warning::new(
            WarningKind::NotExcited,
            "rows",
            format!(
                "{residuals} numbers were measured for {} unknowns; tolerances decide the rest. Record more postures",
                identifiability.total
            ),
        ));
    }
    let fit = robust::robustly(&mut model, &mut plan, &x)?;
    if !fit.converged {
        warnings.push(Warning::new(
            WarningKind::NotExcited,
            "fit",
            format!(
                "it did not come to rest within {} steps; the result is where it stood",
                fit.steps
            ),
        ));
    }
    x = fit.x;
    let x = robust::set_up_rest(&model, &plan, &x)?;
    let after = judge::errors(&model, &x);
    let (groups, strays) = judge::strays(&model, &after);
    let covariance = fit::covariance(&model, &plan, &x);
    if covariance.is_none() {
        warnings.push(Warning::new(
            WarningKind::NotIdentifiable,
            "uncertainty",
            "the information matrix has no inverse; standard deviations are not known",
        ));
    }
    let std = |k: usize| {
        covariance
            .as_ref()
            .map_or(f64::NAN, |c| c[(k, k)].max(0.0).sqrt())
    };
    let rows = result::row_results(
        &model,
        &x,
        &groups,
        &strays,
        [&before, &after],
        covariance.as_ref(),
    );
    let groups = result::group_results(&groups, &rows);
    for g in groups.iter().filter(|g| g.spoiled) {
        warnings.push(Warning::new(
            WarningKind::RecordLeftOut,
            g.name.clone(),
            format!(
                "its errors are out of proportion to those of all other groups (mean {} mm): it was spoiled while it \
                 was recorded, a socket or camera moved, say. It is not counted among the sound ones",
                crate::error::number(1e3 * g.after.map_or(f64::NAN, |s| s.mean))
            ),
        ));
    }
    let outliers = result::outliers(&model, &x, &strays, &after);
    let distances = result::distances(&nominal, &x_before, &model, &x);
    let mut setups: Vec<(String, Frame, Frame)> = Vec::new();
    for (m, measured) in input.measurements.iter().enumerate() {
        if measured.kind.has_instrument() && !setups.iter().any(|s| s.0 == measured.instrument) {
            setups.push((
                measured.instrument.clone(),
                model.camera(m, &x),
                model.target(m, &x),
            ));
        }
    }
    let files = write::robot(opened, &x[..opened.kin.errors()])?;
    Ok(Calibrated {
        robot: opened.plant.name().to_string(),
        frame: opened.frame.clone(),
        joints: opened.joints.clone(),
        identifiability,
        unknowns: (0..model.count())
            .filter(|&k| plan.free[k])
            .map(|k| Identified {
                unknown: model.unknowns[k].clone(),
                value: x[k],
                std: std(k),
            })
            .collect(),
        trials: chosen.trials,
        rows,
        groups,
        outliers,
        distances,
        setups,
        noise: model.noise,
        steps: fit.steps,
        gravity: gravity.map(|g| g.source),
        files,
        warnings,
    })
}
