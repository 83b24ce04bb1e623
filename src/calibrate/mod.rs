//! Kinematic calibration: the geometry of a robot from joint readings and what a camera, a tracker, a socket, a plane,
//! a gauge or a second arm says of its tool.
//!
//! ```text
//! minimise over x   Σ ρ(|Σ_r^(−1/2) r(q, y; x)|)  +  |P^(−1/2) x|²
//! ```
//!
//! with the residuals of `model`, the prior `P` of the manufacturing tolerances, and a loss `ρ` that strays do not
//! bend (`fit`). Which effects of the joints stand beside the geometry is decided by cross-validation of the rows
//! that are fitted; the rows held out judge the result and nothing else.

mod actuators_at;
mod apart;
mod bench;
mod bend;
mod cells;
mod closed;
mod doubts;
mod effects;
mod entry;
mod feature;
mod file;
mod fit;
mod frame;
#[doc(hidden)]
pub mod gap;
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
pub mod parts;
mod pixels;
#[doc(hidden)]
pub mod poses;
mod result;
mod robust;
mod row;
mod row_columns;
mod row_doubts;
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

pub use file::Calibration;
#[doc(hidden)]
pub use file::{EFFECTS, is_calibration};
pub(crate) use frame::Frame;
pub use model::Settings;
pub(crate) use open::Opened;
pub use open::open;
#[doc(hidden)]
pub use open::open_pair;
pub use result::Calibrated;

use crate::error::Result;
use bench::Bench;
use std::path::Path;

/// Reads a `calibration.toml`, its robot and its rows.
///
/// # Errors
/// As [`Calibration::read`] and [`open()`].
pub fn read(path: impl AsRef<Path>) -> Result<(Calibration, Opened)> {
    Calibration::read(path.as_ref(), |robot, frame, other| {
        let opened = match other {
            None => open(robot, frame)?,
            Some(other) => open_pair(robot, frame, other)?,
        };
        let joints = opened.joints.clone();
        Ok((opened, joints))
    })
}

/// Calibrates: the nominal robot under the instruments, effects that the rows bear out, what can be told, the fit,
/// its errors, and the robot that is written.
///
/// # Errors
/// Too few rows, rows that contradict the robot, a robot whose geometry cannot be calibrated.
pub fn calibrate(input: &Calibration, opened: &Opened, settings: Settings) -> Result<Calibrated> {
    let mut warnings = doubts::carried(input, opened);
    doubts::too_few(input)?;
    let sound = apart::sound(input, opened, settings, &mut warnings)?;
    let input = sound.as_ref();
    let bench = Bench::new(input, opened, settings, &mut warnings)?;
    let nominal = bench.model(Vec::new());
    let mut plan = bench.plan(&nominal);
    let x_before = robust::set_up(&nominal, &plan, &vec![0.0; nominal.count()])?;
    let before = judge::errors(&nominal, &x_before);
    doubts::suspicious(input, &before, &mut warnings);
    doubts::unmoved(input, &opened.joints, &mut warnings);
    let chosen = select::choose(input, &|f| bench.model(f), &|part| bench.columns(part))?;
    let mut model = bench.model(chosen.features);
    let mut x = robust::extend(&nominal, &model, &x_before);
    plan.free = robust::seen(&model, &plan);
    let identifiability = identifiable::assess(&model.exact(), &plan, &x)?;
    doubts::determined(&model, &identifiability, &mut warnings);
    robust::hold_tilt(&model, &mut plan, &mut x);
    let fit = robust::robustly(&mut model, &mut plan, &x)?;
    let fit = robust::stiff(&model, &mut plan, fit)?;
    doubts::unsettled(&fit, &mut warnings);
    let x = robust::set_up_rest(&model, &plan, &fit.x)?;
    let after = judge::errors(&model, &x);
    doubts::hopeless(input, &after)?;
    let (groups, strays) = judge::strays(&model, &after);
    let covariance = fit::covariance(&model, &plan, &x);
    doubts::uncertain(covariance.as_ref(), &mut warnings);
    let errors = [&before, &after];
    let rows = result::row_results(&model, &x, &groups, &strays, errors, covariance.as_ref());
    let groups = result::group_results(&groups, &rows);
    doubts::spoiled(&groups, &mut warnings);
    doubts::worse(&rows, &mut warnings);
    let files = write::robot(opened, &x[..opened.kin.errors()])?;
    Ok(Calibrated {
        robot: opened.plant.name().to_string(),
        frame: opened.frame.clone(),
        joints: opened.joints.clone(),
        identifiability,
        unknowns: result::identified(&model, &plan, &x, covariance.as_ref()),
        trials: chosen.trials,
        rows,
        groups,
        outliers: result::outliers(&model, &x, &strays, &after),
        distances: result::distances(&nominal, &x_before, &model, &x),
        setups: result::setups(&model, &x),
        noise: model.noise,
        steps: fit.steps,
        gravity: bench.gravity.map(|g| g.source),
        files,
        warnings,
    })
}
