//! The rehearsal: `simulate`.

use crate::call::{Interrupted, Reporter, call};
use crate::error::notices;
use crate::plant::Plant;
use excite::plant::Plant as Core;
use excite::simulate::effects::parse_payload;
use excite::simulate::monte_carlo::monte_carlo;
use excite::simulate::parts::Field;
use excite::simulate::record::{Sensors, measure};
use excite::simulate::{Settings, simulate as simulated};
use excite::{Error, Result};
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Effects as the command line states them.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Effects {
    payload: Option<String>,
    stribeck_friction: Vec<String>,
    nonlinear_viscous_friction: Vec<String>,
    friction_asymmetry: Vec<String>,
    load_dependent_friction: Vec<String>,
    torque_constant: Vec<String>,
    joint_offset: Vec<String>,
    torque_delay: f64,
    gravity_direction: Option<[f64; 2]>,
    perturb: f64,
}

impl Effects {
    fn set(&self, plant: &Core, settings: &mut Settings) -> Result<()> {
        let effects = &mut settings.effects;
        for (field, texts) in [
            (Field::Stribeck, &self.stribeck_friction),
            (Field::Quadratic, &self.nonlinear_viscous_friction),
            (Field::Asymmetry, &self.friction_asymmetry),
            (Field::LoadFriction, &self.load_dependent_friction),
            (Field::TorqueGain, &self.torque_constant),
            (Field::PositionOffset, &self.joint_offset),
        ] {
            for text in texts {
                effects.set(plant, field, text)?;
            }
        }
        effects.payload = self.payload.as_deref().map(parse_payload).transpose()?;
        effects.torque_delay = self.torque_delay;
        effects.perturb = self.perturb;
        if let Some([x, y]) = self.gravity_direction {
            if !(x.abs() < 1.6 && y.abs() < 1.6) {
                return Err(Error::Argument(format!(
                    "gravity_direction is (rx, ry) in rad, below a right angle, not ({x}, {y})"
                )));
            }
            effects.tilt = [x, y];
        }
        Ok(())
    }
}

/// Simulates a robot along a trajectory: channels of its log, actuator-major.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
#[pyo3(signature = (plant, text, *, periods, lead_in, rate, step, controller, bandwidth, damping, noise, seed, effects, pose, monte_carlo_, progress))]
pub fn simulate<'py>(
    py: Python<'py>,
    plant: &Plant,
    text: &str,
    periods: Option<u32>,
    lead_in: u32,
    rate: f64,
    step: f64,
    controller: String,
    bandwidth: f64,
    damping: f64,
    noise: f64,
    seed: u64,
    effects: Effects,
    pose: bool,
    monte_carlo_: Option<usize>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let trajectory = crate::design::trajectory(text)?;
    let core = plant.core.clone();
    let controller = crate::named::named("controller", &controller)?;
    let period = trajectory.fourier.period;
    let work = move |reporter: &Reporter| {
        let about = |e: Error| match e {
            Error::Argument(m) => Error::file("trajectory", "", m),
            other => other,
        };
        let plant = (*core).clone().in_space(trajectory.space).map_err(about)?;
        // the names are what makes it the same robot
        trajectory.matches(plant.moved()).map_err(about)?;
        let mut settings = Settings::default().with(|set| {
            set.rate = rate;
            set.step = step;
            set.lead_in = lead_in;
            set.controller = controller;
            set.bandwidth = bandwidth;
            set.damping = damping;
            set.seed = seed;
        });
        effects.set(&plant, &mut settings)?;
        if !(noise >= 0.0 && noise.is_finite()) {
            return Err(Error::Argument(format!(
                "noise is a factor of 0 or more, not {noise}"
            )));
        }
        if monte_carlo_.is_some() && noise == 0.0 {
            return Err(Error::Argument(
                "monte_carlo needs noise: noise must not be 0".into(),
            ));
        }
        let (sensors, more) = Sensors::new(&plant, noise);
        let mut warnings = plant.warnings().to_vec();
        warnings.extend(more);
        let periods = periods.unwrap_or(trajectory.periods);
        let tell = |done: f64| reporter.tell(done, 1.0, "simulate");
        let run = simulated(&plant, &trajectory.fourier, periods, &settings, &tell)?;
        warnings.extend(run.warnings.iter().cloned());
        let measured = measure(&run, &sensors, &settings.effects, settings.seed);
        let pose = match pose {
            true => plant.pose_columns(&run.motion)?,
            false => Vec::new(),
        };
        let spread = match monte_carlo_ {
            None => None,
            Some(n) => {
                let m = monte_carlo(&plant, &trajectory.fourier, &run, &settings, &sensors, n)?;
                let text = serde_json::to_string(&m);
                Some(text.map_err(|e| Error::Infeasible(format!("monte_carlo: {e}")))?)
            }
        };
        Ok((run, measured, pose, spread, warnings, periods))
    };
    let ((run, measured, pose, spread, warnings, periods), _) =
        call(py, progress.as_ref(), Interrupted::Leaves, work)?;
    let d = PyDict::new(py);
    for (name, values) in [
        ("t", run.t),
        ("q", measured.q),
        ("tau", measured.tau),
        ("qref", run.reference),
        ("true_q", run.actuators.q),
        ("dq", run.actuators.qd),
        ("ddq", run.actuators.qdd),
        ("true_tau", run.tau),
    ] {
        d.set_item(name, values.into_pyarray(py))?;
    }
    let pose: Vec<Bound<'py, PyArray1<f64>>> =
        pose.into_iter().map(|v| v.into_pyarray(py)).collect();
    d.set_item("pose", pose)?;
    d.set_item("monte_carlo", spread)?;
    d.set_item("warnings", notices(&warnings))?;
    d.set_item("period", period)?;
    d.set_item("periods", periods)?;
    Ok(d)
}
