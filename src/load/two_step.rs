//! The published two-step estimator for platforms: Schulte & Gerland, *A systematic load
//! identification procedure for parallel robot manipulators*.
//!
//! With `f, μ` the force and the moment about the platform's origin `O` that the legs exert on the
//! platform (the inertia of the legs subtracted), `R` the orientation of the platform and
//! `Ω = ω̃ω̃ + ω̇̃` in platform axes, Newton's equation `m (a_O + R Ω c) = f + m g` gives step 1,
//! Euler's about the centre of mass step 2:
//!
//! ```text
//! y₁ = a_O − g              X₁ = [ f | −R Ω ]           θ₁ = [1/m, c]
//! y₂ = Rᵀ μ − c × Rᵀ f      X₂ = L(ω̇) + ω̃ L(ω)          θ₂ = [Ixx, Ixy, Ixz, Iyy, Iyz, Izz]
//! ```
//!
//! The printed equations (3) and (4) have the signs of a `z` axis that points down and of the force
//! of the platform on the legs; these hold for `z` up and the force on the platform. Both steps are
//! weighted by a function of the mean piston speed `v̄ = mean_j |v_j|` that vanishes at standstill,
//! `w = 1 − exp(−(v̄/v₀)⁴)` (the paper does not print its own), after Coulomb and viscous friction
//! were taken off the forces.
//!
//! **What is known of its errors.** The first column of `X₁` holds the measured force, so its noise
//! makes `1/m` too small: `m̂/m − 1 ≈ tr(Cov f) / mean |f|²`. Step 1 does not use the moments, which
//! carry the centre of mass; and an error of `c` goes into the tensor. Therefore `one_step`
//! is the default.

mod draws;

use self::draws::Chain;
use super::body::{LoadBody, difference};
use super::one_step::{Solver, rms};
use super::records::Loaded;
use super::settings::Settings;
use super::system::System;
use crate::dynamics::{Samples, Workspace};
use crate::error::{Error, Result};
use crate::log::Payload;
use crate::mechanism::task::rates_to_omega;
use crate::mechanism::{Mechanism, Task};
use crate::plant::Plant;
use crate::regressor::sign;
use crate::robot::Inertia;
use crate::robot::inertia::Quantities;
use crate::robot::inertia::skew;
use faer::Mat;
use faer::linalg::solvers::SolveLstsq;
use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, Vector3};

/// Motion of a platform and the force on it, in one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlatformSample {
    /// `R`: turns platform axes into base axes
    pub rotation: Matrix3<f64>,
    /// `ω`, platform axes, rad/s
    pub omega: Vector3<f64>,
    /// `ω̇`, platform axes, rad/s²
    pub alpha: Vector3<f64>,
    /// `a_O`, base axes, without gravity, m/s²
    pub acceleration: Vector3<f64>,
    /// `f`, base axes, N
    pub force: Vector3<f64>,
    /// `μ` about `O`, base axes, N m
    pub moment: Vector3<f64>,
    /// weight
    pub weight: f64,
}

impl PlatformSample {
    /// `X₁` and `y₁`: Newton's equation, linear in `[1/m, r]`; base axes, m/s².
    pub fn newton(&self, gravity: &Vector3<f64>) -> (SMatrix<f64, 3, 4>, Vector3<f64>) {
        let turning = skew(&self.omega) * skew(&self.omega) + skew(&self.alpha);
        let mut left = SMatrix::<f64, 3, 4>::zeros();
        left.set_column(0, &self.force);
        left.fixed_columns_mut::<3>(1)
            .copy_from(&(-self.rotation * turning));
        (left, self.acceleration - gravity)
    }

    /// `X₂` and `y₂`: Euler's equation about the centre of mass `r`, linear in the tensor; platform
    /// axes, N m.
    pub fn euler(&self, r: &Vector3<f64>) -> (SMatrix<f64, 3, 6>, Vector3<f64>) {
        let back = self.rotation.transpose();
        let right = back * self.moment - r.cross(&(back * self.force));
        let left = spread(&self.alpha) + skew(&self.omega) * spread(&self.omega);
        (left, right)
    }
}

/// Result of the two steps for everything that moves with the platform.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Total {
    /// mass, centre of mass, tensor about the centre of mass
    pub values: Quantities,
    /// root mean square of the residuals: m/s² and N m
    pub residuals: [f64; 2],
}

/// `L(ω)`: `I ω = L(ω) [Ixx, Ixy, Ixz, Iyy, Iyz, Izz]`.
fn spread(w: &Vector3<f64>) -> SMatrix<f64, 3, 6> {
    let (x, y, z) = (w.x, w.y, w.z);
    SMatrix::<f64, 3, 6>::from_row_slice(&[
        x, y, z, 0.0, 0.0, 0.0, //
        0.0, x, 0.0, y, z, 0.0, //
        0.0, 0.0, x, 0.0, y, z,
    ])
}

/// Weighted least squares; the solution and the root mean square of the residual.
fn solve(a: Mat<f64>, y: Mat<f64>) -> Result<(Vec<f64>, f64)> {
    let n = a.ncols();
    let qr = a.qr();
    let x = qr.solve_lstsq(&y);
    let x: Vec<f64> = (0..n).map(|c| x[(c, 0)]).collect();
    if x.iter().any(|v| !v.is_finite()) {
        return Err(Error::Infeasible(
            "the two-step estimator has no solution: the platform does not turn about all axes"
                .into(),
        ));
    }
    let mut square = 0.0;
    for r in 0..a.nrows() {
        let fit: f64 = (0..n).map(|c| a[(r, c)] * x[c]).sum();
        square += (y[(r, 0)] - fit).powi(2);
    }
    Ok((x, (square / a.nrows() as f64).sqrt()))
}

/// Both steps; `gravity` in base axes, m/s².
///
/// # Errors
/// Fewer than ten samples, or a motion that does not determine the parameters.
pub fn total(samples: &[PlatformSample], gravity: &Vector3<f64>) -> Result<Total> {
    let n = samples.len();
    if n < 10 {
        return Err(Error::Infeasible(format!(
            "{n} samples are too few for the two-step estimator"
        )));
    }
    let mut a = Mat::<f64>::zeros(3 * n, 4);
    let mut y = Mat::<f64>::zeros(3 * n, 1);
    for (i, s) in samples.iter().enumerate() {
        let w = s.weight.sqrt();
        let (left, right) = s.newton(gravity);
        for k in 0..3 {
            for c in 0..4 {
                a[(3 * i + k, c)] = w * left[(k, c)];
            }
            y[(3 * i + k, 0)] = w * right[k];
        }
    }
    let (first, rms1) = solve(a, y)?;
    if first[0] <= 0.0 {
        return Err(Error::Infeasible(format!(
            "step 1 gives a mass of 1/{:.3e} kg: the forces are not those of legs that carry the \
             platform (check the signs of forces or pressures)",
            first[0]
        )));
    }
    let r = Vector3::new(first[1], first[2], first[3]);
    let mut a = Mat::<f64>::zeros(3 * n, 6);
    let mut y = Mat::<f64>::zeros(3 * n, 1);
    for (i, s) in samples.iter().enumerate() {
        let w = s.weight.sqrt();
        let (left, right) = s.euler(&r);
        for k in 0..3 {
            for c in 0..6 {
                a[(3 * i + k, c)] = w * left[(k, c)];
            }
            y[(3 * i + k, 0)] = w * right[k];
        }
    }
    let (j, rms2) = solve(a, y)?;
    let mut values = [0.0; 10];
    values[0] = 1.0 / first[0];
    values[1..4].copy_from_slice(&first[1..]);
    values[4..].copy_from_slice(&j);
    Ok(Total {
        values,
        residuals: [rms1, rms2],
    })
}

/// Result of [`estimate`].
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct TwoStep {
    /// the load: total minus platform
    pub load: LoadBody,
    /// everything that moves with the platform
    pub total: Total,
    /// what was subtracted: the platform as estimated from unloaded records, or nominal
    pub platform: Inertia,
    /// mean piston speed at which the weight is `1 − 1/e`, m/s
    pub standstill: f64,
    /// predicted bias of the total mass of the `1/m` form, as a fraction
    pub bias: f64,
}

/// Estimates the load of the records with an unknown one.
///
/// # Errors
/// A robot without a platform that moves in all six directions; otherwise as [`total`].
pub fn estimate(
    plant: &Plant,
    tool: usize,
    records: &[Loaded],
    settings: &Settings,
) -> Result<TwoStep> {
    let mechanism = match plant.mechanism() {
        Some(m) if m.task == Task::Pose && m.actuators() == 6 => m,
        _ => {
            return Err(Error::Infeasible(
                "the two-step estimator is for platforms with six freedoms and six actuators; \
                 the one-step fit serves all robots"
                    .into(),
            ));
        }
    };
    let gravity = mechanism.robot.gravity;
    let (mut full, mut empty) = (Vec::new(), Vec::new());
    let mut standstill = 0.0;
    for loaded in records {
        let bare = match loaded.payload {
            Payload::Unknown => false,
            Payload::None => true,
            Payload::Known { .. } => continue,
        };
        let count = if bare { empty.len() } else { full.len() };
        let record = count as u64 + 1000 * u64::from(bare);
        let before: Vec<&Chain> = full.iter().chain(&empty).collect();
        let (chain, v0) = chain(plant, mechanism, tool, loaded, settings, record, &before)?;
        standstill = v0;
        if bare { &mut empty } else { &mut full }.push(chain);
    }
    let (all, unloaded) = draws::totals(&full, &empty, &gravity)?;
    let platform = match unloaded {
        None => mechanism.robot.bodies[tool].inertia,
        Some(t) => Inertia::from_quantities(&t.values),
    };
    let inertia = difference(&Inertia::from_quantities(&all.values), &platform);
    let c = draws::covariance(&full, &empty, &gravity, &inertia.0, &platform.0);
    let full: Vec<PlatformSample> = full.into_iter().flat_map(|c| c.samples).collect();
    let load = LoadBody::new(inertia, c, [true; 10], settings.consistent)?;
    let mean = full.iter().map(|s| s.force.norm_squared()).sum::<f64>() / full.len() as f64;
    // residual of Newton's equation, as a force
    let scatter = 3.0 * (all.residuals[0] * all.values[0]).powi(2);
    Ok(TwoStep {
        load,
        platform,
        standstill,
        bias: scatter / mean,
        total: all,
    })
}

/// Motion of the platform and the wrench on it, friction and legs taken off, with the weights; and what other forces
/// would make of it.
fn chain(
    plant: &Plant,
    mechanism: &Mechanism,
    tool: usize,
    loaded: &Loaded,
    settings: &Settings,
    record: u64,
    before: &[&Chain],
) -> Result<(Chain, f64)> {
    // friction: Coulomb and viscous beside all that the platform may carry, unweighted
    let as_loaded = Loaded {
        record: loaded.record.clone(),
        payload: Payload::Unknown,
        exchanged: None,
    };
    let system = System::new(plant, tool, &[&as_loaded], false)?;
    let solver = Solver::new(&system, system.base.kept.clone());
    let solution = solver.solve(&|_, _| 1.0)?;
    let part = &system.parts[0];
    let (n, na) = (part.count, system.actuators);
    let force: Vec<f64> = (0..na * n)
        .map(|i| part.torque[i] - solver.friction_at(&solution.values, 0, i))
        .collect();
    let speeds: Vec<f64> = (0..n)
        .map(|i| (0..na).map(|a| part.speed[a * n + i].abs()).sum::<f64>() / na as f64)
        .collect();
    let v0 = settings.standstill.unwrap_or(0.2 * rms(&speeds));
    let weights: Vec<f64> = speeds
        .iter()
        .map(|v| match settings.weighted && v0 > 0.0 {
            true => 1.0 - (-(v / v0).powi(4)).exp(),
            false => 1.0,
        })
        .collect();
    let at = |force: &[f64]| wrenches(mechanism, tool, &part.motion, force, &weights);
    let mut none = vec![0.0; na * n];
    let nothing = at(&none)?;
    let mut unit = Vec::with_capacity(na);
    for a in 0..na {
        none[a * n..(a + 1) * n].fill(1.0);
        unit.push(at(&none)?);
        none[a * n..(a + 1) * n].fill(0.0);
    }
    Ok((
        Chain::new(at(&force)?, &nothing, &unit, &solver, record, before)?,
        v0,
    ))
}

/// Wrench on the platform from forces of the actuators (actuator-major, friction taken off): `D_aᵀ f`
/// minus what moves the legs.
///
/// # Errors
/// Poses that the mechanism cannot take.
pub fn wrenches(
    mechanism: &Mechanism,
    tool: usize,
    x: &Samples,
    force: &[f64],
    weights: &[f64],
) -> Result<Vec<PlatformSample>> {
    let motion = mechanism.motion(x)?;
    let (joints, n, m) = (motion.tree.dof, x.count, x.dof);
    let mut phi: Vec<f64> = mechanism
        .robot
        .bodies
        .iter()
        .flat_map(|b| b.inertia.0)
        .collect();
    phi[10 * tool..10 * tool + 10].fill(0.0);
    let mut gamma = vec![0.0; joints * n];
    let ws = &mut Workspace::default();
    mechanism
        .tree()
        .inverse_dynamics(ws, &phi, &motion.tree, &mut gamma);
    for (j, joint) in mechanism.robot.joints.iter().enumerate() {
        let own = mechanism.actuated.contains(&j);
        for i in 0..n {
            let [_, qd, qdd] = motion.tree.at(j, i);
            let sign = sign(qd);
            let [armature, viscous, coulomb, offset] = joint.terms;
            gamma[j * n + i] += armature * qdd;
            if !own {
                gamma[j * n + i] += viscous * qd + coulomb * sign + offset;
            }
            gamma[j * n + i] += joint.stribeck.torque(qd);
        }
    }
    for (a, &j) in mechanism.actuated.iter().enumerate() {
        for i in 0..n {
            gamma[j * n + i] -= force[a * n + i];
        }
    }
    (0..n)
        .map(|i| {
            let d = DMatrix::from_fn(joints, m, |j, k| motion.d[(j * m + k) * n + i]);
            let g = DVector::from_fn(joints, |j, _| gamma[j * n + i]);
            let q = -d.tr_mul(&g);
            let column = |a: &[f64]| -> Vec<f64> { (0..m).map(|k| a[k * n + i]).collect() };
            let pose = column(&x.q);
            let angles = Vector3::new(pose[3], pose[4], pose[5]);
            let Some(p) = mechanism
                .task
                .motion(&pose, &column(&x.qd), &column(&x.qdd))
            else {
                return Err(Error::Infeasible("the mechanism has no platform".into()));
            };
            // power: Fᵀ v + Mᵀ E ṙ
            let Some(inverse) = rates_to_omega(&angles).transpose().try_inverse() else {
                return Err(Error::Infeasible("the pitch is a right angle".into()));
            };
            let back = p.rotation.transpose();
            Ok(PlatformSample {
                rotation: p.rotation,
                omega: back * p.omega,
                alpha: back * p.alpha,
                acceleration: p.acceleration,
                force: Vector3::new(q[0], q[1], q[2]),
                moment: inverse * Vector3::new(q[3], q[4], q[5]),
                weight: weights.get(i).copied().unwrap_or(1.0),
            })
        })
        .collect()
}
