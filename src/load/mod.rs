//! The load that a robot carries: mass, centre of mass and inertia from logs of the drives.
//!
//! With `Y_t` the ten regressor columns of the body that carries the load (the last body, or the
//! platform), the torques of a loaded robot are
//!
//! ```text
//! τ = τ_model + W δ + Y_t φ_l + F_c,j sign(q̇_j) + F_v,j q̇_j + o_j        loaded records
//! τ = τ_model + W δ            + F_c,j sign(q̇_j) + F_v,j q̇_j + o_j        unloaded records
//! ```
//!
//! * `τ_model`: the nominal model without the friction of the actuated joints;
//! * `W δ`: what the unloaded robot deviates from it, estimated where there are unloaded records
//!   (base parameters of a serial robot, the platform of a parallel one);
//! * friction: refitted for every record, because it changes with load and temperature.
//!
//! `one_step` solves this by weighted least squares in the space of the actuators. The weights are
//! the inverse of the variance that the residual has at the speed of the actuator,
//!
//! ```text
//! σ_j(v)² = s_j² + (F_s,j exp(−(v/v_s,j)²))²
//! ```
//!
//! fitted to the residuals, so that what is left of stick-slip friction near standstill does not
//! count. For a parallel robot that is the same as a fit of the platform's wrench `w = D_aᵀ f` with the
//! weight `(D_aᵀ diag(σ²) D_a)⁻¹`: the transformation is regular. The parameters are linear in the
//! forces, so noise of the forces does not bias them, unlike the form in `1/m` of [`two_step`], the
//! published estimator of Schulte & Gerland for platforms, which is reported beside it.

// sums over samples and parameters, written with the indices of the equations
#![allow(clippy::needless_range_loop)]

#[doc(hidden)]
pub mod body;
#[doc(hidden)]
pub mod controller;
pub(crate) mod gain;
pub(crate) mod identified;
#[doc(hidden)]
pub mod json;
pub(crate) mod one_step;
#[doc(hidden)]
pub mod page;
pub mod parts;
pub(crate) mod records;
pub(crate) mod settings;
mod speeds;
mod suspicion;
pub(crate) mod system;
#[doc(hidden)]
pub mod two_step;
pub(crate) mod weight;

pub(crate) use body::LoadBody;
pub(crate) use gain::Gains;
pub use identified::Identified;
#[doc(hidden)]
pub use records::Loaded;
pub(crate) use settings::Method;
pub use settings::Settings;
pub(crate) use two_step::TwoStep;

use crate::error::{Error, Result, Warning, WarningKind};
use crate::log::{Experiment, Payload};
use crate::plant::Plant;
use crate::report::format::significant;

/// Identifies the load of the records whose payload is `"unknown"`. Records with `payload = "none"`
/// identify the empty robot; records with a known load identify the drive gains.
///
/// ```no_run
/// use excite::load::{Settings, identify};
/// use excite::log::Experiment;
///
/// let experiment = Experiment::read("experiment.toml")?;
/// let found = identify(&experiment, &Settings::default())?;
/// println!("{:.3} kg", found.load().inertia.mass());
/// # Ok::<(), excite::Error>(())
/// ```
///
/// # Errors
/// No record with an unknown load; signals that cannot be used; a motion that does not excite the
/// load.
pub fn identify(experiment: &Experiment, settings: &Settings) -> Result<Identified> {
    if settings.checked {
        suspicion::raw(experiment, settings.atmosphere)?;
    }
    let records = records::prepared(experiment, settings)?;
    let mut found = from_records(&experiment.plant, records, settings)?;
    found.warnings.splice(0..0, experiment.warnings());
    Ok(found)
}

#[doc(hidden)]
/// [`identify`] from signals.
///
/// # Errors
/// As there.
pub fn from_records(
    plant: &Plant,
    mut records: Vec<Loaded>,
    settings: &Settings,
) -> Result<Identified> {
    let tool = tool(plant)?;
    records::check(&records)?;
    let mut warnings: Vec<Warning> = records
        .iter()
        .flat_map(|r| r.record.warnings.clone())
        .collect();
    let gain = corrected(plant, tool, &mut records, &mut warnings)?;
    if !records::any(&records, Payload::None) {
        warnings.push(Warning::new(
            WarningKind::NominalModelAssumed,
            "payload",
            "there is no record of the empty robot: its nominal model was subtracted, and every \
             error of that is booked on the load",
        ));
    }
    let mut one_step = one_step::estimate(plant, tool, &records, settings)?;
    match &gain {
        // the gains are uncertain, and so is what they scale
        Some(gains) => {
            let plain = Settings {
                consistent: false,
                // looked at above
                checked: false,
                ..settings.clone()
            };
            let estimate = |records: &[Loaded]| -> Result<[f64; 10]> {
                let found = one_step::estimate(plant, tool, records, &plain)?;
                Ok(found.load.inertia.0)
            };
            let found = estimate(&records)?;
            one_step.load.covariance += gains.carried_over(&records, &found, estimate)?;
        }
        None => warnings.push(Warning::new(
            WarningKind::DriveGainAssumed,
            "payload",
            "no record with a known load tells the drive gains: where torques come from motor currents, a gain that is off \
             by one percent makes the mass one percent wrong, whatever its ± says; record a weight of known mass \
             (payload = { mass = 5.0 }), or compare with a scale",
        )),
    }
    warnings.extend(one_step.warnings.iter().cloned());
    warnings.extend(unexplained(plant, &one_step));
    let (two_step, no_two_step) = published(plant, tool, &records, settings)?;
    warnings.extend(
        two_step
            .as_ref()
            .and_then(|t| apart(&one_step.load, &t.load)),
    );
    Ok(Identified {
        robot: plant.name().into(),
        joints: plant.actuators().iter().map(|j| j.name.clone()).collect(),
        frame: plant.robot().bodies[tool].name.clone(),
        one_step,
        two_step,
        no_two_step,
        gain,
        method: settings.method,
        flange: settings.flange,
        warnings,
    })
}

/// Share of a drive's torque that may be left in the loaded records without a word: all of it.
const MUCH: f64 = 1.0;

/// The drive of which most is left, where that is much.
fn unexplained(plant: &Plant, found: &one_step::OneStep) -> Option<Warning> {
    let suspect = |w: &Warning| w.kind == WarningKind::LogSuspect;
    if found.warnings.iter().any(suspect) {
        return None;
    }
    let loaded = found.records.iter().filter(|r| r.loaded);
    let left = loaded.flat_map(|r| r.residuals.iter().enumerate());
    let (j, worst) = left.max_by(|a, b| a.1.relative.total_cmp(&b.1.relative))?;
    (worst.relative > MUCH).then(|| {
        Warning::new(
            WarningKind::LogSuspect,
            plant.actuators()[j].name.clone(),
            format!(
                "{:.0} % of its torque is left by the load, the robot and any friction: its column, unit or gain may not be \
                 what is stated, and the load is no better than that",
                100.0 * worst.relative
            ),
        )
    })
}

/// That two methods give loads whose intervals do not meet.
fn apart(one: &LoadBody, two: &LoadBody) -> Option<Warning> {
    const WHAT: [(&str, &str, f64); 4] = [
        ("mass", "kg", 1.0),
        ("x of the centre", "mm", 1e3),
        ("y of the centre", "mm", 1e3),
        ("z of the centre", "mm", 1e3),
    ];
    let ([a, b], [s, t]) = (
        [one, two].map(LoadBody::values),
        [one, two].map(LoadBody::stds),
    );
    let apart: Vec<String> = (0..4)
        .filter(|&i| (a[i] - b[i]).abs() > 1.96 * (s[i] + t[i]))
        .map(|i| {
            let (name, unit, size) = WHAT[i];
            let value = |x: f64, s: f64| {
                let (x, s) = (significant(size * x, 4), significant(1.96 * size * s, 2));
                format!("{x} ± {s} {unit}")
            };
            format!("{name} {} and {}", value(a[i], s[i]), value(b[i], t[i]))
        })
        .collect();
    (!apart.is_empty()).then(|| {
        Warning::new(
            WarningKind::MethodsDisagree,
            "load",
            format!(
                "one step and two steps are farther apart than both their ±: {}; one of them, or both, cannot be right: \
                 the two steps fit friction without a Stribeck term",
                apart.join(", ")
            ),
        )
    })
}

/// The body that carries the load.
fn tool(plant: &Plant) -> Result<usize> {
    plant.tool().ok_or_else(|| {
        Error::Infeasible(format!(
            "{} has no body that could carry a load",
            plant.name()
        ))
    })
}

/// Drive gains from records with a known load, where there are any; the torques are corrected by them.
fn corrected(
    plant: &Plant,
    tool: usize,
    records: &mut [Loaded],
    warnings: &mut Vec<Warning>,
) -> Result<Option<Gains>> {
    let known = |r: &Loaded| matches!(r.payload, Payload::Known { .. });
    if !records.iter().any(known) {
        return Ok(None);
    }
    let gains = gain::estimate(plant, tool, records)?;
    warnings.extend(gains.warnings.iter().cloned());
    gains.correct(records);
    Ok(Some(gains))
}

/// The published estimator, or why it does not apply.
///
/// # Errors
/// Where it is the one that counts and does not apply.
fn published(
    plant: &Plant,
    tool: usize,
    records: &[Loaded],
    settings: &Settings,
) -> Result<(Option<TwoStep>, String)> {
    match two_step::estimate(plant, tool, records, settings) {
        Ok(two) => Ok((Some(two), String::new())),
        Err(e) if settings.method == Method::TwoStep => Err(e),
        Err(e) => Ok((None, e.to_string())),
    }
}
