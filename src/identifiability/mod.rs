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

mod closed;
pub mod json;
pub mod page;

use crate::base::BaseParameters;
use crate::dynamics::{Samples, Tree};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::mechanism::{ClosedCertificate, PoseUse, Segment, Task};
use crate::plant::Plant;
use crate::regressor::{Regressor, nominal_torque};
use crate::robot::Robot;
use crate::trajectory::certificate::{Certificate, certify};
use crate::trajectory::torque::torque_certificate;
use crate::trajectory::{Fourier, Space, Trajectory};
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef, Side};

/// Rate of the samples that condition numbers and predictions refer to, Hz.
pub const RATE: f64 = 100.0;

/// Torque noise assumed where a robot file states none, as a fraction of the effort limit (or of
/// 100 N m where there is none either).
pub const DEFAULT_NOISE: f64 = 0.01;

/// The four condition numbers of one trajectory.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ConditionNumbers {
    /// largest over smallest non-zero singular value of the regressor of all standard parameters
    pub invariant: f64,
    /// condition number of the columns kept as base parameters
    pub raw: f64,
    /// the same with unit columns
    pub normalised: f64,
    /// the same with the rows of each joint divided by its torque noise
    pub weighted: f64,
}

/// Predicted uncertainty of one base parameter.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Prediction {
    /// name of its kept column
    pub parameter: String,
    /// the combination in words
    pub combination: String,
    /// unit
    pub unit: String,
    /// value in the nominal model
    pub nominal: f64,
    /// predicted standard deviation, in that unit
    pub std: f64,
    /// predicted relative standard deviation, percent of the nominal value; `None` where that is 0
    pub percent: Option<f64>,
}

/// Everything that the report before the run says about one trajectory.
#[derive(Debug, Clone)]
pub struct Excitation {
    /// the trajectory
    pub trajectory: Trajectory,
    /// one period at [`RATE`], the end point left out
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
    /// limits over all time
    pub certificate: Certificate,
    /// samples of the experiment that the prediction counts on: periods × samples a period
    pub samples: usize,
    /// of a parallel robot, what its platform does; `motion` and `certificate` are then about the
    /// actuators
    pub platform: Option<Platform>,
}

/// What the platform of a parallel robot does.
#[derive(Debug, Clone)]
pub struct Platform {
    /// what its coordinates are
    pub task: Task,
    /// their names
    pub names: Vec<String>,
    /// what the series of the trajectory move
    pub space: Space,
    /// one period at [`RATE`], the end point left out
    pub motion: Samples,
    /// workspace box, actuators, passive joints, singularities and distances
    pub certificate: ClosedCertificate,
    /// uses of the limits of the pose at the samples
    pub uses: Vec<Vec<PoseUse>>,
    /// smallest singular values at the samples: of the actuation Jacobian, of the constraint block
    pub sigma: Vec<[Option<f64>; 2]>,
    /// the mechanism in home and in its extreme poses: what, when, and its lines
    pub poses: Vec<(String, Vec<Segment>)>,
}

/// The report before the run, of a robot alone or with a trajectory.
#[derive(Debug, Clone)]
pub struct Assessment {
    /// the robot; of a parallel one its actuators as joints, without bodies
    pub robot: Robot,
    /// its base parameters
    pub base: BaseParameters,
    /// nominal values of the standard parameters
    pub values: Vec<f64>,
    /// whether it is a parallel robot
    pub mechanism: bool,
    /// torque noise used, per joint
    pub torque_noise: Vec<f64>,
    /// the trajectory, where one was given
    pub excitation: Option<Excitation>,
    /// everything imperfect: the robot's own, the rank's, the trajectory's
    pub warnings: Vec<Warning>,
}

/// Torque noise per joint and a warning for those that had to be assumed.
pub fn torque_noise(robot: &Robot) -> (Vec<f64>, Vec<Warning>) {
    let mut missing = Vec::new();
    let noise = robot
        .joints
        .iter()
        .map(|j| {
            j.torque_noise.unwrap_or_else(|| {
                missing.push(j.name.as_str());
                let effort = j.limits.effort;
                DEFAULT_NOISE * if effort.is_finite() { effort } else { 100.0 }
            })
        })
        .collect();
    let warnings = if missing.is_empty() {
        vec![]
    } else {
        vec![Warning::new(
            WarningKind::TorqueNoiseAssumed,
            "torque_noise",
            format!(
                "not stated for {}: taken as {} % of the effort limit; state `torque_noise` for \
                 predictions that can be trusted",
                missing.join(", "),
                100.0 * DEFAULT_NOISE
            ),
        )]
    };
    (noise, warnings)
}

impl Assessment {
    /// What a robot can tell at all.
    ///
    /// # Errors
    /// As [`BaseParameters::new`].
    pub fn of_robot(robot: &Robot) -> Result<Self> {
        let base = BaseParameters::new(robot)?;
        Ok(Self::alone(robot.clone(), base, robot.parameters(), false))
    }

    /// What a robot of either kind can tell at all.
    ///
    /// # Errors
    /// As [`BaseParameters::new`].
    pub fn of_plant(plant: &Plant) -> Result<Self> {
        let mechanism = match plant {
            Plant::Serial(robot) => return Self::of_robot(robot),
            Plant::Parallel(mechanism) => mechanism,
        };
        let robot = mechanism.actuator_robot();
        Ok(Self::alone(robot, plant.base()?, plant.values(), true))
    }

    /// Without a trajectory.
    fn alone(robot: Robot, base: BaseParameters, values: Vec<f64>, mechanism: bool) -> Self {
        let (torque_noise, more) = torque_noise(&robot);
        let known = robot.warnings.iter().chain(&base.warnings).cloned();
        Assessment {
            warnings: known.chain(more).collect(),
            values,
            mechanism,
            robot,
            base,
            torque_noise,
            excitation: None,
        }
    }

    /// What a robot of either kind will tell on this trajectory.
    ///
    /// # Errors
    /// As [`Assessment::new`]; for a parallel robot also when the motion leaves its reach, or its
    /// coordinates are none of the robot's.
    pub fn with_plant(plant: &Plant, trajectory: &Trajectory) -> Result<Self> {
        let plant = plant.clone().in_space(trajectory.space)?;
        match &plant {
            Plant::Serial(robot) => Self::new(robot, trajectory),
            Plant::Parallel(mechanism) => closed::assess(&plant, mechanism, trajectory),
        }
    }

    /// What a robot will tell on this trajectory.
    ///
    /// # Errors
    /// When the trajectory is of another robot, or as [`BaseParameters::new`].
    pub fn new(robot: &Robot, trajectory: &Trajectory) -> Result<Self> {
        let mut all = Self::of_robot(robot)?;
        all.warnings.extend(trajectory.matches(robot)?);
        let tree = Tree::new(robot);
        let motion = sample_period(&trajectory.fourier);
        let torque = nominal_torque(robot, &tree, &motion);
        let w = Regressor::with_tree(robot, &tree, &motion);
        let certificate = certificate(robot, &tree, &trajectory.fourier)?;
        all.excite(trajectory, motion, torque, w.mat(), certificate, None)?;
        Ok(all)
    }

    /// Adds what a motion tells, `w` being its stacked regressor.
    fn excite(
        &mut self,
        trajectory: &Trajectory,
        motion: Samples,
        torque: Vec<f64>,
        w: MatRef<'_, f64>,
        certificate: Certificate,
        platform: Option<Platform>,
    ) -> Result<()> {
        let (condition, singular_values, log_det) =
            condition_numbers(&self.base, w, &self.torque_noise)?;
        let kept = self.base.select(w);
        let predictions = predict(
            &self.values,
            &self.base,
            weighted(kept.as_ref(), &self.torque_noise).as_ref(),
            f64::from(trajectory.periods),
        );
        if condition.invariant > 1e7 && platform.is_none() {
            self.warnings.push(Warning::new(
                WarningKind::NotExcited,
                "trajectory",
                format!(
                    "it does not excite every base parameter: the condition number is {:.1e}",
                    condition.invariant
                ),
            ));
        }
        self.excitation = Some(Excitation {
            samples: motion.count * trajectory.periods as usize,
            trajectory: trajectory.clone(),
            motion,
            torque,
            condition,
            log_det,
            singular_values,
            predictions,
            certificate,
            platform,
        });
        Ok(())
    }
}

/// One period at [`RATE`] (at least 20 samples), the end point left out.
pub fn sample_period(fourier: &Fourier) -> Samples {
    let count = ((fourier.period * RATE).round() as usize).clamp(20, 1_000_000);
    fourier.motion(count)
}

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
        (Some(a), Some(b)) if *b > 0.0 => (a / b).min(1e300),
        (None, _) => 1.0,
        _ => 1e300,
    }
}

/// Predicted standard deviations from the weighted regressor of one period, worst first.
fn predict(
    values: &[f64],
    base: &BaseParameters,
    weighted: MatRef<'_, f64>,
    periods: f64,
) -> Vec<Prediction> {
    let nominal = base.project(values);
    let information = weighted.transpose() * weighted;
    let b = base.count();
    let covariance = match information.llt(Side::Lower) {
        Ok(llt) => llt.solve(Mat::<f64>::identity(b, b)),
        Err(_) => Mat::from_fn(b, b, |_, _| f64::INFINITY),
    };
    let mut all: Vec<Prediction> = (0..b)
        .map(|a| {
            let std = (covariance[(a, a)] / periods).sqrt().min(1e300);
            Prediction {
                parameter: base.name(a).to_string(),
                combination: base.combination(a),
                unit: base.units[base.kept[a]].to_string(),
                nominal: nominal[a],
                std,
                percent: (nominal[a] != 0.0).then(|| (100.0 * std / nominal[a].abs()).min(1e300)),
            }
        })
        .collect();
    all.sort_by(|x, y| {
        let key = |p: &Prediction| p.percent.unwrap_or(f64::INFINITY);
        key(y).total_cmp(&key(x))
    });
    all
}

/// Proof that the limits hold for all time, torques included.
///
/// # Errors
/// When trajectory and robot differ in their joints.
pub fn certificate(robot: &Robot, tree: &Tree, fourier: &Fourier) -> Result<Certificate> {
    let positions = certify(robot, fourier)?;
    let phi: Vec<f64> = robot.bodies.iter().flat_map(|b| b.inertia.0).collect();
    let n = robot.dof();
    let workspace =
        std::cell::RefCell::new((crate::dynamics::Workspace::default(), Samples::zeros(n, 1)));
    let torque = |q: &[f64], qd: &[f64], qdd: &[f64], tau: &mut [f64]| {
        let (ws, s) = &mut *workspace.borrow_mut();
        s.q.copy_from_slice(q);
        s.qd.copy_from_slice(qd);
        s.qdd.copy_from_slice(qdd);
        tree.inverse_dynamics(ws, &phi, s, tau);
        for (j, joint) in robot.joints.iter().enumerate() {
            let [armature, viscous, _, offset] = joint.terms;
            tau[j] += armature * qdd[j] + viscous * qd[j] + offset;
        }
    };
    let bounds = torque_certificate(robot, fourier, 2000, &torque)?;
    Ok(positions.with_torque(bounds))
}
