//! What can be said before the run: which parameters a robot and a trajectory can tell, how well,
//! and whether the limits hold.
//!
//! With `W_b` the regressor of the base parameters over all samples of the experiment and `Σ` the
//! diagonal of torque variances, the weighted least-squares estimate will have the covariance
//!
//! ```text
//! C = (W_bᵀ Σ⁻¹ W_b)⁻¹
//! ```
//!
//! (white noise, independent between samples and joints; Swevers et al. 1997, eq. 11), whose
//! diagonal gives the predicted standard deviation of every base parameter.

mod answer;
mod clearance;
mod columns;
mod elsewhere;
mod hardly_moved;
#[doc(hidden)]
pub mod json;
mod load;
mod numbers;
#[doc(hidden)]
pub mod page;
pub mod parts;
mod platform;
mod spread;

pub(crate) use answer::{Answer, Expected};
pub(crate) use clearance::Clearances;
pub(crate) use elsewhere::TorqueUncertainty;
#[doc(hidden)]
pub use load::GAIN;
pub(crate) use load::LoadAccuracy;
pub(crate) use numbers::{ConditionNumbers, Prediction};
pub(crate) use platform::Platform;
pub(crate) use spread::Spread;

use self::json::INFINITE;
use crate::base::BaseParameters;
use crate::design::{Condition, Question, Settings};
use crate::dynamics::Samples;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::plant::Plant;
use crate::report::view::View;
use crate::robot::{Inertia, Robot};
use crate::trajectory::{Certificate, Proof, Trajectory, sample_period};
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef, Side};

/// Everything that the report before the run says about one trajectory.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Excitation {
    /// the trajectory
    pub trajectory: Trajectory,
    /// one period at [`RATE`](crate::trajectory::RATE), the end point left out
    pub motion: Samples,
    /// nominal torque at these samples, joint-major
    pub torque: Vec<f64>,
    /// condition numbers
    pub condition: ConditionNumbers,
    /// `ln det(W_bᵀ Σ⁻¹ W_b)` of one period
    pub log_det: f64,
    /// non-zero singular values of the regressor of all standard parameters, largest first
    pub singular_values: Vec<f64>,
    /// base parameters, worst predicted first
    pub predictions: Vec<Prediction>,
    /// torque uncertainty left at states that the motion did not visit
    pub elsewhere: TorqueUncertainty,
    /// limits over all time
    pub certificate: Certificate,
    /// samples of the experiment that the prediction counts on: periods × samples a period
    pub samples: usize,
    /// of a parallel robot, what its platform does; `motion` and `certificate` are then about the
    /// actuators
    pub platform: Option<Platform>,
    /// how near it brings the robot to itself and to what stands around; `None` where that was not looked at
    pub clearance: Option<Clearances>,
    /// the robot along the motion, for the page
    #[serde(skip)]
    pub(crate) view: Option<View>,
}

impl Excitation {
    /// How many base parameters will be known to so many percent or better, of how many whose nominal value is not 0.
    pub fn known(&self, percent: f64) -> (usize, usize) {
        let judged = || self.predictions.iter().filter_map(|p| p.percent);
        (judged().filter(|p| *p <= percent).count(), judged().count())
    }
}

/// The report before the run, of a robot alone or with a trajectory.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Assessment {
    /// the robot; of a parallel one its actuators as joints, without bodies; not serialised, it is a file
    /// of its own
    #[serde(skip)]
    pub robot: Robot,
    /// its base parameters
    pub base: BaseParameters,
    /// nominal values of the standard parameters
    pub values: Vec<f64>,
    /// the condition number that stands for all, where a single one is printed
    pub headline: Condition,
    /// torque noise used, per joint
    pub torque_noise: Vec<f64>,
    /// the trajectory, where one was given
    pub excitation: Option<Excitation>,
    /// how well it tells a load, where it is meant for one or was asked
    pub load: Option<LoadAccuracy>,
    /// how well it tells the platform, the legs or the friction, where it is meant for them
    pub answer: Option<Answer>,
    /// everything imperfect: the robot's own, the rank's, the trajectory's
    pub warnings: Vec<Warning>,
}

impl Assessment {
    /// The same with how well a trajectory of this plant tells a load.
    ///
    /// # Errors
    /// As [`LoadAccuracy::of`].
    pub fn with_load(
        self,
        plant: &Plant,
        trajectory: &Trajectory,
        load: &Inertia,
        named: bool,
    ) -> Result<Self> {
        let load = Some(LoadAccuracy::of(plant, trajectory, load, named)?);
        Ok(Assessment { load, ..self })
    }

    /// Whether the trajectory was designed for a load.
    pub(crate) fn meant_for_a_load(&self) -> bool {
        let settings = self.excitation.as_ref().map(|e| &e.trajectory.settings);
        settings.is_some_and(|s| s["for"] == "load")
    }

    /// The condition number that stands for all, where a single one is printed, with its name: that of
    /// [`Assessment::headline`].
    pub fn condition(&self) -> Option<(&'static str, f64)> {
        let c = &self.excitation.as_ref()?.condition;
        Some(match self.unit_columns() {
            true => ("normalised", c.normalised),
            false => ("invariant", c.invariant),
        })
    }

    /// Whether the condition number that stands for all is that of unit columns.
    pub(crate) fn unit_columns(&self) -> bool {
        self.headline == Condition::Normalised
    }
}

/// What a robot can tell at all, or on this trajectory.
///
/// ```
/// use excite::Plant;
/// use excite::identifiability::assess;
///
/// // without a trajectory: what any motion can tell
/// let report = assess(&Plant::load("planar2")?, None)?;
/// assert!(report.base.count() > 0 && report.excitation.is_none());
/// println!("{}", serde_json::to_string(&report).expect("it is serialisable"));
/// # Ok::<(), excite::Error>(())
/// ```
///
/// # Errors
/// As [`BaseParameters::new`]; a trajectory of another robot, or one that leaves the reach of a closed
/// chain.
pub fn assess(plant: &Plant, trajectory: Option<&Trajectory>) -> Result<Assessment> {
    let Some(trajectory) = trajectory else {
        return alone(plant);
    };
    let plant = &plant.clone().in_space(trajectory.space)?;
    let mut all = alone(plant)?;
    all.warnings.extend(trajectory.matches(plant.moved())?);
    let motion = sample_period(&trajectory.fourier);
    let w = plant.regressor(&motion)?;
    let (condition, singular_values, log_det) =
        condition_numbers(&all.base, w.as_ref(), &all.torque_noise)?;
    let kept = all.base.select(w.as_ref());
    let rows = weighted(kept.as_ref(), &all.torque_noise);
    let rows = columns::beside_breakaway(plant, &motion, rows)?;
    let covariance = covariance(rows.as_ref(), f64::from(trajectory.periods));
    let predictions = predict(&all.values, &all.base, &covariance);
    let elsewhere = TorqueUncertainty::of(plant, &all.base, &covariance)?;
    let certified = plant.certify(&trajectory.fourier, 1.0)?;
    if certified.proof == Proof::Stated {
        all.warnings.push(Warning::new(
            WarningKind::BoundedNotProven,
            "limits",
            "this mechanism has no closed-form kinematics: what its actuators do between the \
             samples is bounded by twice the largest second difference, not proven",
        ));
    }
    let scene = plant.scene()?;
    let clearance = match (&scene, certified.clearance) {
        (Some(scene), Some(found)) => {
            all.warnings.extend(scene.warnings.iter().cloned());
            Some(Clearances::of(plant, scene, found, &motion)?)
        }
        _ => {
            all.warnings.extend(plant.scene_warnings());
            None
        }
    };
    let platform = match (plant.mechanism(), certified.mechanism) {
        (Some(m), Some(c)) => Some(Platform::of(m, &motion, c, trajectory.fourier.period)?),
        _ => None,
    };
    let unit_columns = all.unit_columns();
    all.warnings.extend(unexcited(&condition, unit_columns));
    let torque = plant.nominal_torque(&motion)?;
    let (actuated, lock) = (plant.actuators(), platform.is_none());
    all.warnings
        .extend(hardly_moved::warning(&certified.actuators, &actuated, lock));
    all.warnings.extend(hardly_moved::lost_in_noise(
        &torque,
        &all.torque_noise,
        &actuated,
        lock,
    ));
    let actuators = plant.actuator_motion(&motion)?;
    let view = page::view::fill(
        plant,
        trajectory.fourier.period,
        &motion,
        &actuators,
        &torque,
        scene.as_deref(),
    )?;
    all.excitation = Some(Excitation {
        samples: motion.count * trajectory.periods as usize,
        trajectory: trajectory.clone(),
        torque,
        condition,
        log_det,
        singular_values,
        predictions,
        elsewhere,
        certificate: certified.actuators,
        platform,
        clearance,
        motion: actuators,
        view: Some(view),
    });
    let meant: Option<Settings> = serde_json::from_value(trajectory.settings.clone()).ok();
    match meant.as_ref().and_then(|s| Some((s, s.question?))) {
        Some((s, Question::Load)) => {
            all.with_load(plant, trajectory, &s.load(plant), s.payload.is_some())
        }
        Some((_, question)) if question.check(plant).is_ok() => {
            all.answer = Answer::of(plant, trajectory, question)?;
            Ok(all)
        }
        _ => Ok(all),
    }
}

/// Without a trajectory.
fn alone(plant: &Plant) -> Result<Assessment> {
    let base = plant.base()?;
    let (torque_noise, more) = plant.torque_noise();
    let known = plant.warnings().iter().chain(&base.warnings).cloned();
    Ok(Assessment {
        warnings: known.chain(more).collect(),
        values: plant.values(),
        headline: Condition::usual(plant),
        robot: plant.actuator_robot(),
        base,
        torque_noise,
        excitation: None,
        load: None,
        answer: None,
    })
}

/// A number of any size with two digits.
fn scale(x: f64) -> String {
    match x >= INFINITE {
        true => "infinite".into(),
        false => format!("{x:.1e}"),
    }
}

/// A warning where the motion leaves base parameters out, by the condition number that stands for all.
fn unexcited(condition: &ConditionNumbers, unit_columns: bool) -> Option<Warning> {
    let (number, most, how) = match unit_columns {
        false => (condition.invariant, 1e7, ""),
        true => (condition.normalised, 1e6, " with unit columns"),
    };
    (number > most).then(|| {
        let message = "it does not excite every base parameter: the condition number";
        Warning::new(
            WarningKind::NotExcited,
            "trajectory",
            format!("{message}{how} is {}", scale(number)),
        )
    })
}

#[doc(hidden)]
/// Condition numbers, non-zero singular values and `ln det` of the weighted information matrix.
///
/// # Errors
/// When the singular values do not converge.
pub fn condition_numbers(
    base: &BaseParameters,
    w: MatRef<'_, f64>,
    torque_noise: &[f64],
) -> Result<(ConditionNumbers, Vec<f64>, f64)> {
    let invariant = singular_values((w * &base.row_space).as_ref())?;
    let kept = base.select(w);
    let raw = singular_values(kept.as_ref())?;
    let norms: Vec<f64> = (0..kept.ncols())
        .map(|j| kept.col(j).norm_l2().max(f64::MIN_POSITIVE))
        .collect();
    let unit = Mat::from_fn(kept.nrows(), kept.ncols(), |i, j| kept[(i, j)] / norms[j]);
    let normalised = singular_values(unit.as_ref())?;
    let weighted = singular_values(weighted(kept.as_ref(), torque_noise).as_ref())?;
    let log_det = weighted.iter().map(|s| 2.0 * s.ln()).sum();
    let condition = ConditionNumbers {
        invariant: ratio(&invariant),
        raw: ratio(&raw),
        normalised: ratio(&normalised),
        weighted: ratio(&weighted),
    };
    Ok((condition, invariant, log_det))
}

/// Rows of each actuator divided by its torque noise.
fn weighted(w: MatRef<'_, f64>, torque_noise: &[f64]) -> Mat<f64> {
    let count = w.nrows() / torque_noise.len().max(1);
    Mat::from_fn(w.nrows(), w.ncols(), |i, j| {
        w[(i, j)] / torque_noise[i / count.max(1)]
    })
}

/// Singular values by way of `R`, largest first.
fn singular_values(m: MatRef<'_, f64>) -> Result<Vec<f64>> {
    let failed =
        || Error::Infeasible("the singular values of the regressor did not converge".into());
    if m.nrows() < m.ncols() {
        return m.singular_values().map_err(|_| failed());
    }
    m.qr().thin_R().singular_values().map_err(|_| failed())
}

fn ratio(s: &[f64]) -> f64 {
    match (s.first(), s.last()) {
        (Some(a), Some(b)) if *b > 0.0 => (a / b).min(INFINITE),
        (None, _) => 1.0,
        _ => INFINITE,
    }
}

/// Covariance of the base parameters from the weighted regressor of one period, infinite where it is singular.
fn covariance(weighted: MatRef<'_, f64>, periods: f64) -> Mat<f64> {
    let b = weighted.ncols();
    let information = weighted.transpose() * weighted;
    match information.llt(Side::Lower) {
        Ok(llt) => {
            let one = Mat::from_fn(b, b, |i, j| if i == j { 1.0 / periods } else { 0.0 });
            llt.solve(one)
        }
        Err(_) => Mat::from_fn(b, b, |_, _| f64::INFINITY),
    }
}

/// Predicted standard deviations, worst first.
fn predict(values: &[f64], base: &BaseParameters, covariance: &Mat<f64>) -> Vec<Prediction> {
    let nominal = base.project(values);
    let b = base.count();
    let mut all: Vec<Prediction> = (0..b)
        .map(|a| {
            let std = covariance[(a, a)].sqrt().min(INFINITE);
            Prediction {
                parameter: base.name(a).to_string(),
                combination: base.combination(a),
                unit: base.units[base.kept[a]].to_string(),
                nominal: nominal[a],
                std,
                percent: (nominal[a] != 0.0)
                    .then(|| (100.0 * std / nominal[a].abs()).min(INFINITE)),
            }
        })
        .collect();
    all.sort_by(|x, y| {
        let key = |p: &Prediction| p.percent.unwrap_or(f64::INFINITY);
        key(y).total_cmp(&key(x))
    });
    all
}
