//! The load that a robot carries: mass, centre of mass and inertia from logs of the drives.
//!
//! With `Y_t` the ten regressor columns of the body that carries the load (the last body, or the
//! platform), the torques of a loaded robot are
//!
//! ```text
//! τ = τ_model + Z Δ + Y_t φ_l + F_c,j sign(q̇_j) + F_v,j q̇_j + o_j        loaded records
//! τ = τ_model + Z Δ            + F_c,j sign(q̇_j) + F_v,j q̇_j + o_j        unloaded records
//! ```
//!
//! * `τ_model`: the nominal model without the friction of the actuated joints;
//! * `Δ`: what the unloaded robot deviates from it, estimated where there are unloaded records
//!   (base parameters of a serial robot, the platform of a parallel one);
//! * friction: refitted for every record, because it changes with load and temperature.
//!
//! [`one_step`] solves this by weighted least squares in the space of the actuators. The weights are
//! the inverse of the variance that the residual has at the speed of the actuator,
//!
//! ```text
//! σ_j(v)² = s_j² + (F_s,j exp(−(v/v_s,j)²))²
//! ```
//!
//! fitted to the residuals, so that what is left of stick-slip friction near standstill does not
//! count. For a parallel robot that is the same as a fit of the platform's wrench `w = Jᵀ f` with the
//! weight `(Jᵀ diag(σ²) J)⁻¹`: the transformation is regular. The parameters are linear in the
//! forces, so noise of the forces does not bias them, unlike the form in `1/m` of [`two_step`], the
//! published estimator of Schulte & Gerland for platforms, which is reported beside it.

// sums over samples and parameters, written with the indices of the equations
#![allow(clippy::needless_range_loop)]

pub mod body;
pub mod gain;
pub mod json;
pub mod one_step;
pub mod page;
pub mod system;
pub mod two_step;
pub mod weight;

pub use body::LoadBody;

use crate::error::{Error, Result, Warning, WarningKind};
use crate::log::{Experiment, Payload, Record};
use crate::plant::Plant;
use crate::signals::{self, Prepared};
use one_step::OneStep;
use two_step::TwoStep;

/// Which parameters of the load are unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Parameters {
    /// all ten
    #[default]
    Full,
    /// mass and centre of mass; the load counts as a point mass
    MassCom,
}

/// Which estimate goes into `load.json`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// all parameters at once
    #[default]
    OneStep,
    /// `1/m` and centre of mass, then the tensor (platforms only)
    TwoStep,
}

/// How the load is estimated.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Settings {
    /// unknowns
    pub parameters: Parameters,
    /// estimate that counts
    pub method: Method,
    /// whether rows near standstill lose weight
    pub weighted: bool,
    /// whether the result must be a body that can exist
    pub consistent: bool,
    /// mean speed of the actuators below which the two-step estimator gives no weight, rad/s or
    /// m/s; `None`: a fifth of its root mean square
    pub standstill: Option<f64>,
    /// pressure outside of the cylinders, Pa; 0 where the logged pressures are relative to it
    pub atmosphere: f64,
    /// preparation of the signals
    pub signals: signals::Settings,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            parameters: Parameters::Full,
            method: Method::OneStep,
            weighted: true,
            consistent: true,
            standstill: None,
            atmosphere: 101_325.0,
            signals: signals::Settings::default(),
        }
    }
}

/// A record with what it carried.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// signals
    pub record: Prepared,
    /// load
    pub payload: Payload,
}

/// Everything that is known of the load afterwards.
#[derive(Debug)]
pub struct Identified {
    /// robot
    pub robot: String,
    /// its actuators, in the order of the log columns
    pub joints: Vec<String>,
    /// link or platform in whose frame the load is given
    pub frame: String,
    /// all parameters at once
    pub one_step: OneStep,
    /// the published estimator, where it applies
    pub two_step: Option<TwoStep>,
    /// why the published estimator does not apply
    pub no_two_step: String,
    /// factors of the measured torques, where a known load tells them
    pub gain: Option<gain::Gains>,
    /// estimate that counts
    pub method: Method,
    /// what was found on the way
    pub warnings: Vec<Warning>,
}

impl Identified {
    /// The load by the method that counts.
    pub fn load(&self) -> &LoadBody {
        match (self.method, &self.two_step) {
            (Method::TwoStep, Some(two)) => &two.load,
            _ => &self.one_step.load,
        }
    }
}

/// Identifies the load of the records whose payload is `"unknown"`; records with `"none"` tell the
/// empty robot, records with a known load the drive gains.
///
/// # Errors
/// No record with an unknown load; signals that cannot be used; a motion that does not excite the
/// load.
pub fn identify(experiment: &Experiment, settings: &Settings) -> Result<Identified> {
    let plant = &experiment.plant;
    let records = experiment
        .records
        .iter()
        .map(|record| {
            let pressed = pressure_forces(record, plant, settings.atmosphere)?;
            let record = pressed.as_ref().unwrap_or(record);
            Ok(Loaded {
                record: Prepared::new(record, plant, &settings.signals)?,
                payload: record.payload,
            })
        })
        .collect::<Result<Vec<_>>>()?;
    let mut found = from_records(plant, records, settings)?;
    let mut warnings = experiment.warnings();
    warnings.append(&mut found.warnings);
    found.warnings = warnings;
    Ok(found)
}

/// The record with forces from the chamber pressures where it has no torques:
///
/// ```text
/// f = p_a A_a − p_b A_b − p_atm (A_a − A_b)
/// ```
///
/// # Errors
/// A log with pressures of a robot without piston areas.
pub fn pressure_forces(record: &Record, plant: &Plant, atmosphere: f64) -> Result<Option<Record>> {
    let Some([pa, pb]) = record.pressures.as_ref().filter(|_| record.tau.is_empty()) else {
        return Ok(None);
    };
    let tau = plant
        .actuators()
        .iter()
        .zip(pa.iter().zip(pb))
        .map(|(joint, (a, b))| {
            let Some([area_a, area_b]) = joint.piston else {
                return Err(Error::Infeasible(format!(
                    "{}: the log has chamber pressures, but `{}` no piston areas; add piston = \
                     [AREA_A, AREA_B] in m^2 to [actuator] or to its [[joint]] in the robot file",
                    record.name, joint.name
                )));
            };
            let outside = atmosphere * (area_a - area_b);
            let force = |(a, b): (&f64, &f64)| a * area_a - b * area_b - outside;
            Ok(a.iter().zip(b).map(force).collect())
        })
        .collect::<Result<Vec<Vec<f64>>>>()?;
    Ok(Some(Record {
        tau,
        ..record.clone()
    }))
}

/// [`identify`] from signals.
///
/// # Errors
/// As there.
pub fn from_records(
    plant: &Plant,
    mut records: Vec<Loaded>,
    settings: &Settings,
) -> Result<Identified> {
    let Some(tool) = plant.tool() else {
        return Err(Error::Infeasible(format!(
            "{} has no body that could carry a load",
            plant.name()
        )));
    };
    if let Some(r) = records.iter().find(|r| r.record.torque.is_empty()) {
        return Err(Error::Infeasible(format!(
            "{}: the log has neither torques nor pressures with piston areas",
            r.record.name
        )));
    }
    if !records.iter().any(|r| r.payload == Payload::Unknown) {
        return Err(Error::Infeasible(
            "no record has the load that is to be identified: write payload = \"unknown\" at the \
             records of the loaded robot in the experiment (and payload = \"none\" at those of the \
             empty one)"
                .into(),
        ));
    }
    let mut warnings: Vec<Warning> = records
        .iter()
        .flat_map(|r| r.record.warnings.clone())
        .collect();
    let known = |r: &Loaded| matches!(r.payload, Payload::Known { .. });
    let gain = match records.iter().any(known) {
        true => {
            let gains = gain::estimate(plant, tool, &records)?;
            warnings.extend(gains.warnings.iter().cloned());
            gains.correct(&mut records);
            Some(gains)
        }
        false => None,
    };
    if !records.iter().any(|r| r.payload == Payload::None) {
        warnings.push(Warning::new(
            WarningKind::NominalModelAssumed,
            "payload",
            "there is no record of the empty robot: its nominal model was subtracted, and every \
             error of that is booked on the load",
        ));
    }
    let one_step = one_step::estimate(plant, tool, &records, settings)?;
    warnings.extend(one_step.warnings.iter().cloned());
    let (two_step, no_two_step) = match two_step::estimate(plant, tool, &records, settings) {
        Ok(two) => (Some(two), String::new()),
        Err(e) if settings.method == Method::TwoStep => return Err(e),
        Err(e) => (None, e.to_string()),
    };
    Ok(Identified {
        robot: plant.name().into(),
        joints: plant.actuators().iter().map(|j| j.name.clone()).collect(),
        frame: plant.robot().bodies[tool].name.clone(),
        one_step,
        two_step,
        no_two_step,
        gain,
        method: settings.method,
        warnings,
    })
}
