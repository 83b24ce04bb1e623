//! What the platform of a closed chain does along a motion: poses, uses of their limits, distance from
//! singularities.

use crate::dynamics::Samples;
use crate::error::Result;
use crate::mechanism::{
    Mechanism, MechanismCertificate, PoseKind, PosePeak, PoseUse, Segment, Task,
};
use crate::trajectory::Space;

/// Most samples of a period that are kept.
const MOST: usize = 20_000;

/// What the platform of a parallel robot does.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Platform {
    /// what its coordinates are
    pub task: Task,
    /// their names
    pub names: Vec<String>,
    /// what the series of the trajectory move
    pub space: Space,
    /// one period at [`RATE`](crate::trajectory::RATE), or as many samples as are kept, the end point left out
    pub motion: Samples,
    /// workspace box, actuators, passive joints, singularities and distances
    pub certificate: MechanismCertificate,
    /// uses of the limits of the pose at the samples
    pub uses: Vec<Vec<PoseUse>>,
    /// smallest singular values at the samples: of the actuation Jacobian, of the constraint block
    pub sigma: Vec<[Option<f64>; 2]>,
    /// the mechanism in home and in its extreme poses: what, when, and its lines
    pub poses: Vec<(String, Vec<Segment>)>,
}

impl Platform {
    /// The two axes of legs, arms, rods or platform that come nearest, where their distance is asked for.
    pub fn nearest_axes(&self) -> Option<&PosePeak> {
        let all = self.certificate.pose.iter();
        let distances = all.filter(|p| p.kind == PoseKind::Distance);
        distances.min_by(|a, b| a.bound.total_cmp(&b.bound))
    }

    /// Along one period of a motion of the task coordinates.
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    pub(super) fn of(
        mechanism: &Mechanism,
        motion: &Samples,
        certificate: MechanismCertificate,
        period: f64,
    ) -> Result<Self> {
        let space = mechanism.space();
        // what is kept of each sample must not grow with a period of days
        let each = motion.count.div_ceil(MOST).max(1);
        let step = period / motion.count.max(1) as f64 * each as f64;
        let some: Vec<usize> = (0..motion.count).step_by(each).collect();
        let motion = mechanism
            .platform_motion(&motion.select(&some))?
            .into_owned();
        let mechanism = mechanism.platform();
        let pairs = mechanism.pairs();
        let n = motion.count;
        let pose =
            |s: usize| -> Vec<f64> { (0..motion.dof).map(|k| motion.q[k * n + s]).collect() };
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
        let smallest =
            |a: &[Option<f64>; 2]| a.iter().flatten().copied().fold(f64::INFINITY, f64::min);
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
        let time = |s: usize| s as f64 * step;
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
        Ok(Platform {
            task: mechanism.task,
            names: mechanism.task_names.clone(),
            space,
            motion,
            certificate,
            uses,
            sigma,
            poses,
        })
    }
}
