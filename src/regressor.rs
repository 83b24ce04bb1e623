//! The stacked regressor `W` of a sampled motion: `τ = W φ` with all standard parameters, the ten
//! of every link and the joint columns that the robot asks for.

use crate::dynamics::{Samples, Tree};
use crate::robot::{Column, Joint, JointTerm, Robot};
use faer::{Mat, MatRef};

/// `W`, stacked joint-major: row `j·count + i` is coordinate `j` at sample `i`; columns as in
/// [`Robot::columns`].
#[derive(Debug, Clone)]
pub struct Regressor {
    /// meaning of the columns
    pub columns: Vec<Column>,
    /// coordinates
    pub dof: usize,
    /// samples
    pub count: usize,
    w: Vec<f64>,
}

/// Factor of a joint column in the torque of its joint: `q̈`, `q̇`, `sign(q̇)`, `1`.
#[doc(hidden)]
pub fn term_factor(term: JointTerm, [_, qd, qdd]: [f64; 3]) -> f64 {
    match term {
        JointTerm::Armature => qdd,
        JointTerm::Viscous => qd,
        JointTerm::Coulomb => sign(qd),
        JointTerm::Offset => 1.0,
    }
}

/// Sign of a velocity, 0 at rest.
pub(crate) fn sign(qd: f64) -> f64 {
    if qd == 0.0 { 0.0 } else { qd.signum() }
}

impl Regressor {
    /// Evaluates `W` for all samples, on all threads.
    ///
    /// # Panics
    /// If the motion is of another robot.
    pub fn new(robot: &Robot, motion: &Samples) -> Self {
        Self::with_tree(robot, &Tree::new(robot), motion)
    }

    /// Evaluates `W` for all samples with a [`Tree`] of the robot made before.
    ///
    /// # Panics
    /// If the motion is of another robot.
    pub fn with_tree(robot: &Robot, tree: &Tree, motion: &Samples) -> Self {
        let columns = robot.columns();
        let rows = motion.dof * motion.count;
        let mut w = vec![0.0; rows * columns.len()];
        if motion.count > 0 {
            tree.regressor_parallel(motion, &mut w, rows);
        }
        for (c, column) in columns.iter().enumerate() {
            if let Column::Term { joint, term } = *column {
                for i in 0..motion.count {
                    w[c * rows + joint * motion.count + i] = term_factor(term, motion.at(joint, i));
                }
            }
        }
        Regressor {
            columns,
            dof: motion.dof,
            count: motion.count,
            w,
        }
    }

    /// `W` as a matrix, `dof·count × columns`.
    pub fn mat(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.w, self.dof * self.count, self.columns.len())
    }

    /// The numbers of `W`, column by column.
    pub fn into_columns(self) -> Vec<f64> {
        self.w
    }

    /// `W` with the rows of each joint divided by its torque noise.
    pub fn weighted(&self, torque_noise: &[f64]) -> Mat<f64> {
        let w = self.mat();
        Mat::from_fn(w.nrows(), w.ncols(), |i, j| {
            w[(i, j)] / torque_noise[i / self.count]
        })
    }
}

/// Torque of the nominal model, all terms included: rigid bodies, armature, viscous and Coulomb
/// friction, offset. Joint-major like the motion.
///
/// # Panics
/// If the motion is of another robot.
#[doc(hidden)]
pub fn nominal_torque(robot: &Robot, tree: &Tree, motion: &Samples) -> Vec<f64> {
    let mut tau = vec![0.0; motion.dof * motion.count];
    let phi: Vec<f64> = robot.bodies.iter().flat_map(|b| b.inertia.0).collect();
    tree.inverse_dynamics(&mut Default::default(), &phi, motion, &mut tau);
    for (j, joint) in robot.joints.iter().enumerate() {
        for i in 0..motion.count {
            tau[j * motion.count + i] += joint_torque(joint, motion.at(j, i));
        }
    }
    tau
}

/// The nominal torque of one state as a function, for
/// [`write_along`](crate::trajectory::samples::write_along) and the like.
#[doc(hidden)]
pub fn torque_function<'a>(
    robot: &'a Robot,
    tree: &'a Tree,
) -> impl Fn(&[f64], &[f64], &[f64], &mut [f64]) + 'a {
    state_torque(robot, tree, joint_torque)
}

/// The part of it that has derivatives: all but Coulomb friction.
#[doc(hidden)]
pub fn smooth_torque_function<'a>(
    robot: &'a Robot,
    tree: &'a Tree,
) -> impl Fn(&[f64], &[f64], &[f64], &mut [f64]) + 'a {
    state_torque(robot, tree, |joint, [_, qd, qdd]| {
        let [armature, viscous, _, offset] = joint.terms;
        armature * qdd + viscous * qd + offset
    })
}

/// Torque of the bodies in one state, and of each joint what `own` says.
fn state_torque<'a>(
    robot: &'a Robot,
    tree: &'a Tree,
    own: impl Fn(&Joint, [f64; 3]) -> f64 + 'a,
) -> impl Fn(&[f64], &[f64], &[f64], &mut [f64]) + 'a {
    let phi: Vec<f64> = robot.bodies.iter().flat_map(|b| b.inertia.0).collect();
    let memory = std::cell::RefCell::new((
        crate::dynamics::Workspace::default(),
        Samples::zeros(robot.dof(), 1),
    ));
    move |q, qd, qdd, tau| {
        let (ws, s) = &mut *memory.borrow_mut();
        s.q.copy_from_slice(q);
        s.qd.copy_from_slice(qd);
        s.qdd.copy_from_slice(qdd);
        tree.inverse_dynamics(ws, &phi, s, tau);
        for (j, joint) in robot.joints.iter().enumerate() {
            tau[j] += own(joint, s.at(j, 0));
        }
    }
}

/// Sum of the joint terms of the nominal model: armature, friction, offset, breakaway.
#[doc(hidden)]
pub fn joint_torque(joint: &Joint, state: [f64; 3]) -> f64 {
    let terms: f64 = JointTerm::ALL
        .into_iter()
        .zip(joint.terms)
        .map(|(term, value)| value * term_factor(term, state))
        .sum();
    terms + joint.stribeck.torque(state[1])
}
