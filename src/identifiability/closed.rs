//! The report before the run of a parallel robot: actuators, platform, singularities.

use super::{Assessment, Platform, sample_period};
use crate::dynamics::Samples;
use crate::error::{Result, Warning, WarningKind};
use crate::mechanism::{ClosedCertificate, Mechanism, closed_certificate};
use crate::plant::Plant;
use crate::trajectory::certificate::{Certificate, Kind, Worst};
use crate::trajectory::{Space, Trajectory};

pub(super) fn assess(
    plant: &Plant,
    mechanism: &Mechanism,
    trajectory: &Trajectory,
) -> Result<Assessment> {
    let mut all = Assessment::of_plant(plant)?;
    all.warnings
        .extend(trajectory.matches(&mechanism.task_robot())?);
    let motion = sample_period(&trajectory.fourier);
    let torque = mechanism.nominal_torque(&motion)?;
    let w = mechanism.regressor(&motion)?;
    let actuators = plant.actuator_motion(&motion)?;
    let closed = closed_certificate(mechanism, &trajectory.fourier, 1.0)?;
    if !closed.proven {
        all.warnings.push(Warning::new(
            WarningKind::BoundedNotProven,
            "limits",
            "this mechanism has no closed-form kinematics: what its actuators do between the \
             samples is bounded by twice the largest second difference, not proven",
        ));
    }
    let certificate = overall(&closed);
    let moved = mechanism.platform_motion(&motion)?.into_owned();
    let platform = platform(mechanism.platform(), mechanism.space(), moved, closed);
    all.excite(
        trajectory,
        actuators,
        torque,
        w.as_ref(),
        certificate,
        Some(platform),
    )?;
    let poor = unexcited(&all);
    all.warnings.extend(poor);
    Ok(all)
}

/// A warning where the motion leaves base parameters out. Parameters of a parallel robot differ by
/// many orders of magnitude in size, so unit columns decide.
fn unexcited(a: &Assessment) -> Option<Warning> {
    let condition = a.excitation.as_ref()?.condition;
    (condition.normalised > 1e6).then(|| {
        Warning::new(
            WarningKind::NotExcited,
            "trajectory",
            format!(
                "it does not excite every base parameter: the condition number with unit columns \
                 is {:.1e}",
                condition.normalised
            ),
        )
    })
}

/// The certificate of the actuators, with box and poses counted in.
fn overall(closed: &ClosedCertificate) -> Certificate {
    let mut worst = closed.actuators.worst.clone();
    let mut offer = |other: Option<Worst>| {
        if let Some(w) = other
            && worst.as_ref().is_none_or(|old| w.used > old.used)
        {
            worst = Some(w);
        }
    };
    offer(closed.platform.worst.clone());
    for p in &closed.pose {
        offer(Some(Worst {
            joint: p.name.clone(),
            kind: Kind::Pose,
            used: p.used,
        }));
    }
    Certificate {
        joints: closed.actuators.joints.clone(),
        satisfied: closed.satisfied,
        worst,
    }
}

fn platform(
    mechanism: &Mechanism,
    space: Space,
    motion: Samples,
    certificate: ClosedCertificate,
) -> Platform {
    let pairs = mechanism.pairs();
    let n = motion.count;
    let pose = |s: usize| -> Vec<f64> { (0..motion.dof).map(|k| motion.q[k * n + s]).collect() };
    let (mut uses, mut sigma) = (Vec::with_capacity(n), Vec::with_capacity(n));
    for s in 0..n {
        let x = pose(s);
        uses.push(mechanism.pose_uses(&x, &pairs));
        sigma.push(match mechanism.singularity(&x) {
            Ok(s) => [
                Some(s.actuation.sigma_min),
                s.constraint.map(|c| c.sigma_min),
            ],
            Err(_) => [None, None],
        });
    }
    // home, and the poses nearest to a singularity and farthest out
    let mut poses = vec![(
        "home".to_string(),
        mechanism.geometry().segments(&mechanism.home),
    )];
    let smallest = |a: &[Option<f64>; 2]| a.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    let nearest = (0..n).min_by(|&a, &b| smallest(&sigma[a]).total_cmp(&smallest(&sigma[b])));
    let size = |s: usize| -> f64 {
        (0..motion.dof)
            .map(|k| {
                let [low, high] = mechanism.workspace[k].position;
                let half = (0.5 * (high - low)).max(1e-9);
                ((motion.q[k * n + s] - mechanism.home[k]) / half).powi(2)
            })
            .sum()
    };
    let farthest = (0..n).max_by(|&a, &b| size(a).total_cmp(&size(b)));
    let time = |s: usize| s as f64 / super::RATE;
    for (what, at) in [
        ("nearest to a singularity", nearest),
        ("farthest from home", farthest),
    ] {
        if let Some(s) = at {
            poses.push((
                format!("{what}, t = {:.2} s", time(s)),
                mechanism.geometry().segments(&pose(s)),
            ));
        }
    }
    Platform {
        task: mechanism.task,
        names: mechanism.task_names.clone(),
        space,
        motion,
        certificate,
        uses,
        sigma,
        poses,
    }
}
