//! Motion of all joints of a closed chain over batches of samples, and the memory that evaluations
//! share. Matrices of a batch are sample-fastest, as in [`Geometry`](super::geometry::Geometry).

use super::Mechanism;
use super::task::{PITCH_MARGIN, Task};
use crate::dynamics::lanes::Isa;
use crate::dynamics::{Derivatives, Samples, Workspace};
use crate::error::{Error, Result};
use crate::robot::JointTerm;
use std::f64::consts::FRAC_PI_2;

/// Samples that one thread handles at a time, so that a regressor of a hexapod (6 kB a sample) is
/// written into the cache and copied from there: written straight into a large matrix, its 780
/// streams cost three times the arithmetic.
const CHUNK: usize = 64;

/// A motion of the whole mechanism.
#[derive(Debug, Clone, Default)]
pub struct MechanismMotion {
    /// all tree coordinates
    pub tree: Samples,
    /// `D = ∂q/∂x`, coordinates × task
    pub d: Vec<f64>,
    /// `D_a⁺`, task × actuators
    pub a: Vec<f64>,
    /// `G = D D_a⁺`, coordinates × actuators
    pub g: Vec<f64>,
}

/// Memory of one thread; grows once.
#[derive(Clone, Default)]
pub struct MechanismWorkspace {
    /// of the tree's kernels
    pub tree: Workspace,
    /// the motion last evaluated
    pub motion: MechanismMotion,
    pub(super) d: [Vec<f64>; 3],
    pub(super) derivatives: Derivatives,
    pub(super) phi: Vec<f64>,
    pub(super) rates: Vec<f64>,
    pub(super) torque: Vec<f64>,
    pub(super) u: Vec<f64>,
    pub(super) z: Vec<f64>,
    pub(super) curvature: Vec<f64>,
    pub(super) part: Samples,
    pub(super) raw: Vec<f64>,
    pub(super) terms: Vec<(usize, JointTerm, f64)>,
    /// rate over which `sign(q̇)` of each coordinate is rounded in [`Mechanism::gradients`], so that
    /// Coulomb friction has a derivative; empty: it is constant between changes of sign
    pub sign_width: Vec<f64>,
}

/// Whether every number is finite.
pub(super) fn finite(a: &[f64]) -> bool {
    a.iter().map(|x| x * 0.0).sum::<f64>() == 0.0
}

/// Samples `from .. to` of a motion, into memory that is reused.
pub(super) fn slice(x: &Samples, from: usize, to: usize, part: &mut Samples) {
    let n = to - from;
    part.dof = x.dof;
    part.count = n;
    for (to, source) in [
        (&mut part.q, &x.q),
        (&mut part.qd, &x.qd),
        (&mut part.qdd, &x.qdd),
    ] {
        to.clear();
        for k in 0..x.dof {
            to.extend_from_slice(&source[k * x.count + from..][..n]);
        }
    }
}

impl Mechanism {
    /// Motion of all joints, and `G`, from a motion of the task coordinates.
    ///
    /// # Errors
    /// A pose that cannot be reached or where the actuation Jacobian has no inverse: which sample
    /// and why.
    pub fn motion(&self, x: &Samples) -> Result<MechanismMotion> {
        let mut out = MechanismMotion::default();
        self.motion_into(Workspace::default().isa(), x, &mut out)?;
        Ok(out)
    }

    /// [`Mechanism::motion`] into memory that is reused.
    ///
    /// # Errors
    /// As there.
    ///
    /// # Panics
    /// If the motion has not one row for each task coordinate.
    pub fn motion_into(&self, isa: Isa, x: &Samples, out: &mut MechanismMotion) -> Result<()> {
        let (n, m, na) = (self.robot.dof(), self.freedoms(), self.actuators());
        let count = x.count;
        assert_eq!(x.dof, m, "one row for each task coordinate");
        out.tree.dof = n;
        out.tree.count = count;
        for a in [&mut out.tree.q, &mut out.tree.qd, &mut out.tree.qdd] {
            a.resize(n * count, 0.0);
        }
        out.d.resize(n * m * count, 0.0);
        out.a.resize(m * na * count, 0.0);
        out.g.resize(n * na * count, 0.0);
        if count == 0 {
            return Ok(());
        }
        if self.task == Task::Pose {
            let steep = FRAC_PI_2 - PITCH_MARGIN;
            if x.q[4 * count..5 * count].iter().any(|p| p.abs() > steep) {
                return Err(self.why_not(x, None));
            }
        }
        self.geometry.motion(isa, x, &mut out.tree, &mut out.d);
        match (m, na) {
            (1, 1) => self.actuation::<1>(isa, count, out),
            (2, 2) => self.actuation::<2>(isa, count, out),
            (3, 3) => self.actuation::<3>(isa, count, out),
            (4, 4) => self.actuation::<4>(isa, count, out),
            (6, 6) => self.actuation::<6>(isa, count, out),
            _ => self.actuation_any(count, out),
        }
        if finite(&out.tree.qdd) && finite(&out.tree.q) && finite(&out.g) {
            return Ok(());
        }
        Err(self.why_not(x, Some(out)))
    }

    /// Motion of all joints, and `G`, into the memory ([`MechanismWorkspace::motion`]).
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    pub fn evaluate_motion(&self, ws: &mut MechanismWorkspace, x: &Samples) -> Result<()> {
        let isa = ws.tree.isa();
        self.motion_into(isa, x, &mut ws.motion)
    }

    /// The first sample that failed, and why.
    fn why_not(&self, x: &Samples, out: Option<&MechanismMotion>) -> Error {
        let count = x.count;
        for s in 0..count {
            let pose: Vec<f64> = (0..x.dof).map(|k| x.q[k * count + s]).collect();
            let why = self.problem(&pose).or_else(|| {
                let out = out?;
                let bad = |a: &[f64], rows: usize| (0..rows).any(|i| !a[i * count + s].is_finite());
                let n = out.tree.dof;
                if bad(&out.tree.q, n) || bad(&out.tree.qdd, n) {
                    Some("the motion is not finite there".to_string())
                } else if bad(&out.g, n * self.actuators()) {
                    Some("the actuation Jacobian is singular: σ_min = 0".to_string())
                } else {
                    None
                }
            });
            if let Some(why) = why {
                return Error::Infeasible(format!(
                    "{}: sample {s} at {} cannot be taken: {why}",
                    self.robot.name,
                    self.show(&pose)
                ));
            }
        }
        Error::Infeasible(format!("{}: the motion is not finite", self.robot.name))
    }

    /// A pose with the names of its coordinates.
    pub fn show(&self, x: &[f64]) -> String {
        let all: Vec<String> = self
            .task_names
            .iter()
            .zip(x)
            .map(|(n, v)| format!("{n} = {v:.4}"))
            .collect();
        all.join(", ")
    }

    /// Pieces of a batch that may be handled on their own, see [`Mechanism::raw_block`].
    pub fn chunks(&self, count: usize) -> Vec<(usize, usize)> {
        let size = match self.geometry.sequential() {
            true => count.max(1),
            false => CHUNK,
        };
        (0..count)
            .step_by(size)
            .map(|from| (from, (from + size).min(count)))
            .collect()
    }
}
