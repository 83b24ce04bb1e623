//! Torque limits of the nominal model at the samples, and their linearisation.
//!
//! `τ(t) = Y φ + I_a q̈ + F_v q̇ + o`, and Coulomb friction counted with whichever sign is worse:
//! `|τ| + F_c ≤ τ_max`. A row of the subproblem is `τ + ∂τ/∂x δ`, from one adjoint product for
//! each joint.

use super::information::{Evaluation, Information};
use super::path::{PathLimits, PathMemory, PathRow, ROOM};
use crate::dynamics::{Derivatives, Samples, Workspace};
use crate::robot::{JointTerm, Motion, Robot, plain};

/// Torque limits of a robot.
#[derive(Debug, Clone)]
pub struct TorqueLimits {
    phi: Vec<f64>,
    terms: Vec<[f64; 4]>,
    names: Vec<String>,
    /// limit less Coulomb friction, per joint
    room: Vec<f64>,
    /// what to do about a joint that cannot keep its limit
    remedies: Vec<String>,
}

/// What to do about joint `j` where its limit cannot be kept: friction that joints which mimic it
/// add, and the line that holds it.
fn remedy(robot: &Robot, j: usize, derate: f64) -> String {
    let joint = &robot.joints[j];
    let unit = match joint.motion {
        Motion::Revolute => "N m",
        Motion::Prismatic => "N",
    };
    let coulomb = joint.dry();
    let followers: Vec<&str> = robot
        .bodies
        .iter()
        .filter(|b| b.coordinate == j && b.joint_name != joint.name)
        .map(|b| b.joint_name.as_str())
        .collect();
    let mut text = String::new();
    if coulomb > 0.0 {
        text = format!(
            " (friction {} {unit}{}, limit {} {unit} times derate {derate})",
            plain(coulomb),
            match followers.is_empty() {
                true => String::new(),
                false => format!(
                    ", that of {} joints which mimic it included, {} first",
                    followers.len(),
                    followers[0]
                ),
            },
            plain(joint.limits.effort)
        );
    }
    text + &format!(
        "; correct the effort limit or <dynamics friction>, or hold the joint: write `{}` at the top of robot.toml",
        joint.lock_line()
    )
}

/// Room kept at the samples for what happens between them, as a fraction of the limit.
pub(super) const BETWEEN: f64 = 0.004;

impl TorqueLimits {
    /// Effort limits times `derate`; `None` where no joint has one.
    pub fn new(robot: &Robot, derate: f64) -> Option<Self> {
        if robot.joints.iter().all(|j| j.limits.effort.is_infinite()) {
            return None;
        }
        Some(Self::of(robot, derate))
    }

    /// [`TorqueLimits::new`], also where no joint has a limit.
    pub(super) fn of(robot: &Robot, derate: f64) -> Self {
        TorqueLimits {
            phi: robot.bodies.iter().flat_map(|b| b.inertia.0).collect(),
            terms: robot.joints.iter().map(|j| j.terms).collect(),
            names: robot.joint_names(),
            remedies: (0..robot.dof()).map(|j| remedy(robot, j, derate)).collect(),
            room: robot
                .joints
                .iter()
                .map(|j| j.limits.effort * derate * (1.0 - BETWEEN) - j.dry())
                .collect(),
        }
    }

    /// Derivatives of the torque of joint `j` at all samples with respect to the state.
    pub(super) fn derivatives(
        &self,
        info: &Information,
        motion: &Samples,
        j: usize,
        ws: &mut Workspace,
        d: &mut Derivatives,
    ) {
        let count = motion.count;
        let mut rates = vec![0.0; count * motion.dof];
        rates[j * count..(j + 1) * count].fill(1.0);
        info.tree().gradients(ws, &self.phi, motion, &rates, d);
        for i in 0..count {
            d.qd[j * count + i] += self.terms[j][JointTerm::Viscous as usize];
            d.qdd[j * count + i] += self.terms[j][JointTerm::Armature as usize];
        }
    }

    /// Gradient of that torque at sample `i` with respect to the free numbers.
    pub(super) fn gradient(
        info: &Information,
        motion: &Samples,
        d: &Derivatives,
        i: usize,
    ) -> Vec<f64> {
        let (count, dof) = (motion.count, motion.dof);
        let at = |g: &[f64]| -> Vec<f64> { (0..dof).map(|c| g[c * count + i]).collect() };
        let (q, qd, qdd) = (at(&d.q), at(&d.qd), at(&d.qdd));
        info.pull_back(i, [&q, &qd, &qdd])
    }

    /// Torques without Coulomb friction, joint-major.
    pub fn torques(
        &self,
        info: &Information,
        motion: &Samples,
        ws: &mut Workspace,
        tau: &mut Vec<f64>,
    ) {
        tau.resize(motion.dof * motion.count, 0.0);
        info.tree().inverse_dynamics(ws, &self.phi, motion, tau);
        for (j, [armature, viscous, _, offset]) in self.terms.iter().enumerate() {
            for i in 0..motion.count {
                let [_, qd, qdd] = motion.at(j, i);
                tau[j * motion.count + i] += armature * qdd + viscous * qd + offset;
            }
        }
    }

    /// Largest torque over its limit, with the joint; at most 1 inside.
    pub fn worst(&self, tau: &[f64]) -> (f64, usize) {
        let count = tau.len() / self.room.len();
        let mut worst = (0.0, 0);
        for (j, room) in self.room.iter().enumerate() {
            let most = tau[j * count..(j + 1) * count]
                .iter()
                .fold(0.0, |m: f64, t| m.max(t.abs()));
            let used = if *room > 0.0 {
                most / room
            } else {
                f64::INFINITY
            };
            if used > worst.0 {
                worst = (used, j);
            }
        }
        worst
    }
}

impl PathLimits for TorqueLimits {
    fn used(
        &self,
        info: &Information,
        _: &[f64],
        motion: &Samples,
        memory: &mut PathMemory,
    ) -> f64 {
        let mut tau = std::mem::take(&mut memory.tau);
        self.torques(info, motion, &mut memory.workspace, &mut tau);
        let used = self.worst(&tau).0;
        memory.tau = tau;
        used
    }

    fn broken(&self, info: &Information, _: &[f64], motion: &Samples) -> String {
        let mut tau = Vec::new();
        self.torques(info, motion, &mut Workspace::default(), &mut tau);
        let (used, j) = self.worst(&tau);
        let (name, remedy) = (&self.names[j], &self.remedies[j]);
        match used > 1.0 {
            true if used.is_infinite() => format!(
                "{name} has nothing left of its effort limit: its Coulomb friction alone is \
                 more{remedy}"
            ),
            true => format!(
                "{name} already needs {} % of its effort limit{remedy}",
                plain(100.0 * used)
            ),
            false => String::new(),
        }
    }

    fn rows(&self, info: &Information, _: &[f64], e: &mut Evaluation, from: f64) -> Vec<PathRow> {
        let (count, dof) = (e.motion.count, e.motion.dof);
        let mut tau = Vec::new();
        let mut ws = Workspace::default();
        self.torques(info, &e.motion, &mut ws, &mut tau);
        let near: Vec<Vec<usize>> = (0..dof)
            .map(|j| {
                (0..count)
                    .filter(|i| tau[j * count + i].abs() > from * self.room[j])
                    .collect()
            })
            .collect();
        let mut rows = Vec::new();
        let mut d = Derivatives::default();
        for (j, near) in near.into_iter().enumerate() {
            if near.is_empty() {
                continue;
            }
            self.derivatives(info, &e.motion, j, &mut ws, &mut d);
            for i in near {
                let mut gradient = Self::gradient(info, &e.motion, &d, i);
                let value = tau[j * count + i];
                if value < 0.0 {
                    gradient.iter_mut().for_each(|g| *g = -*g);
                }
                rows.push(PathRow {
                    gradient,
                    slack: (1.0 - ROOM) * self.room[j] - value.abs(),
                });
            }
        }
        rows
    }
}
