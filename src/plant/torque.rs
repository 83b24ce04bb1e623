//! Regressor and torques of a plant along a motion of its coordinates.

use super::Plant;
use crate::dynamics::{Samples, Workspace};
use crate::error::Result;
use crate::regressor::{Regressor, nominal_torque, term_factor};
use crate::robot::{Column, Joint, JointTerm};
use faer::Mat;
use std::borrow::Cow;

impl Plant {
    /// The stacked regressor `W` of a motion of the coordinates, on all threads: row `a·count + s`
    /// is actuator `a` at sample `s`, columns as [`Plant::parameters`].
    ///
    /// # Errors
    /// A pose of a closed chain that cannot be reached.
    pub fn regressor(&self, x: &Samples) -> Result<Mat<f64>> {
        match self.mechanism() {
            None => {
                let w = Regressor::with_tree(&self.robot, &self.tree, x);
                Ok(w.mat().to_owned())
            }
            Some(mechanism) => mechanism.regressor(x),
        }
    }

    /// The numbers of [`Plant::regressor`], column by column, without a copy for a tree.
    ///
    /// # Errors
    /// As [`Plant::regressor`].
    pub(crate) fn regressor_columns(&self, x: &Samples) -> Result<Vec<f64>> {
        match self.mechanism() {
            None => Ok(Regressor::with_tree(&self.robot, &self.tree, x).into_columns()),
            Some(mechanism) => {
                let w = mechanism.regressor(x)?;
                let columns = (0..w.ncols()).flat_map(|c| (0..w.nrows()).map(move |i| (i, c)));
                Ok(columns.map(|at| w[at]).collect())
            }
        }
    }

    /// Columns of the regressor that jump, and the joint in whose equation alone each stands: those of Coulomb friction. All
    /// others are smooth in the motion. `None` of a closed chain, where friction of a joint is in the equations of several
    /// actuators.
    pub(crate) fn jumps(&self) -> Option<Vec<(usize, usize)>> {
        if self.mechanism().is_some() {
            return None;
        }
        let dry = |p: &crate::robot::Parameter| match p.kind {
            Column::Term {
                joint,
                term: JointTerm::Coulomb,
            } => Some(joint),
            _ => None,
        };
        let all = self.parameters.iter().enumerate();
        Some(all.filter_map(|(c, p)| Some((c, dry(p)?))).collect())
    }

    /// Torque of the nominal model, all terms included, actuator-major, N m or N.
    ///
    /// # Errors
    /// As [`Plant::regressor`].
    pub fn nominal_torque(&self, x: &Samples) -> Result<Vec<f64>> {
        match self.mechanism() {
            None => Ok(nominal_torque(&self.robot, &self.tree, x)),
            Some(mechanism) => mechanism.nominal_torque(x),
        }
    }

    /// Torque of the bodies alone with these values of the unknowns, actuator-major: no friction,
    /// rotors or offsets, and no bodies that are known.
    ///
    /// # Errors
    /// As [`Plant::regressor`].
    ///
    /// # Panics
    /// If there is not one number for each parameter.
    pub fn rigid_torque(&self, x: &Samples, phi: &[f64]) -> Result<Vec<f64>> {
        assert_eq!(phi.len(), self.parameters.len(), "one for each parameter");
        if self.mechanism.is_none() {
            let mut tau = vec![0.0; x.dof * x.count];
            let bodies = &phi[..10 * self.robot.bodies.len()];
            let ws = &mut Workspace::default();
            self.tree.inverse_dynamics(ws, bodies, x, &mut tau);
            return Ok(tau);
        }
        let value = |(p, v): (&crate::robot::Parameter, &f64)| match p.kind {
            Column::Inertial { .. } => *v,
            _ => 0.0,
        };
        let bodies: Vec<f64> = self.parameters.iter().zip(phi).map(value).collect();
        let y = self.regressor(x)? * faer::ColRef::from_slice(&bodies);
        Ok(y.iter().copied().collect())
    }

    /// The part of the nominal torque that no column of [`Plant::regressor`] stands for: terms of
    /// joints that are not identified, and bodies that are known.
    ///
    /// # Errors
    /// As [`Plant::regressor`].
    pub fn known_torque(&self, x: &Samples) -> Result<Vec<f64>> {
        match self.mechanism {
            None => Ok(self.known_terms(x)),
            Some(_) => self.known(x, &self.regressor(x)?),
        }
    }

    /// [`Plant::known_torque`] where the regressor of the motion is at hand.
    fn known(&self, x: &Samples, w: &Mat<f64>) -> Result<Vec<f64>> {
        if self.mechanism.is_none() {
            return Ok(self.known_terms(x));
        }
        let all = self.nominal_torque(x)?;
        let phi = self.values();
        let unknown = w * faer::ColRef::from_slice(&phi);
        let rest = all.iter().enumerate().map(|(i, t)| t - unknown[i]);
        Ok(rest.collect())
    }

    /// Whether [`Plant::known_torque`] of a tree is anything but zero.
    pub(crate) fn knows_terms(&self) -> bool {
        let known = |j: &Joint| j.stribeck.force != 0.0 || known_of(j).next().is_some();
        self.robot.joints.iter().any(known)
    }

    /// Torque of the terms of a tree's joints that are not identified: no difference of nearly
    /// equal numbers.
    fn known_terms(&self, x: &Samples) -> Vec<f64> {
        let mut tau = vec![0.0; x.dof * x.count];
        for (j, joint) in self.robot.joints.iter().enumerate() {
            if joint.stribeck.force != 0.0 {
                for s in 0..x.count {
                    tau[j * x.count + s] += joint.stribeck.torque(x.qd[j * x.count + s]);
                }
            }
            for (term, value) in known_of(joint) {
                for s in 0..x.count {
                    tau[j * x.count + s] += value * term_factor(term, x.at(j, s));
                }
            }
        }
        tau
    }

    /// Torque with other values of the unknowns: `W φ + τ_known`.
    ///
    /// # Errors
    /// As [`Plant::regressor`].
    ///
    /// # Panics
    /// If there is not one number for each parameter.
    pub fn torque(&self, x: &Samples, phi: &[f64]) -> Result<Vec<f64>> {
        let w = self.regressor(x)?;
        assert_eq!(w.ncols(), phi.len(), "one number for each parameter");
        let mut tau = self.known(x, &w)?;
        let unknown = &w * faer::ColRef::from_slice(phi);
        tau.iter_mut()
            .enumerate()
            .for_each(|(i, t)| *t += unknown[i]);
        Ok(tau)
    }

    /// Motion of all joints, passive ones included, that goes with a motion of the coordinates.
    ///
    /// # Errors
    /// As [`Plant::regressor`].
    pub fn joint_motion<'a>(&self, x: &'a Samples) -> Result<Cow<'a, Samples>> {
        match self.mechanism() {
            None => Ok(Cow::Borrowed(x)),
            Some(mechanism) => Ok(Cow::Owned(mechanism.motion(x)?.tree)),
        }
    }

    /// Motion of the actuators that goes with a motion of the coordinates.
    ///
    /// # Errors
    /// As [`Plant::regressor`].
    pub fn actuator_motion(&self, x: &Samples) -> Result<Samples> {
        Ok(self.drive_motion(x)?.into_owned())
    }

    /// The same without a copy where the coordinates are the actuators.
    pub(crate) fn drive_motion<'a>(&self, x: &'a Samples) -> Result<Cow<'a, Samples>> {
        Ok(match self.joint_motion(x)? {
            Cow::Borrowed(x) => Cow::Borrowed(x),
            Cow::Owned(joints) => Cow::Owned(joints.rows(&self.actuated)),
        })
    }

    /// Columns of the ten parameters of one body of the tree, whether or not they are unknowns,
    /// `actuators·count × 10`.
    ///
    /// # Errors
    /// As [`Plant::regressor`].
    ///
    /// # Panics
    /// If there is no such body.
    pub fn body_columns(&self, body: usize, x: &Samples) -> Result<Mat<f64>> {
        let Some(mechanism) = self.mechanism() else {
            let w = Regressor::with_tree(&self.robot, &self.tree, x);
            return Ok(w.mat().subcols(10 * body, 10).to_owned());
        };
        let motion = mechanism.motion(x)?;
        let (na, count) = (self.actuated.len(), x.count);
        let rows = na * count;
        let mut w = vec![0.0; rows * 10];
        let ws = &mut Workspace::default();
        let (tree, g) = (&motion.tree, &motion.g);
        self.tree
            .projected_regressor(ws, &[body], tree, g, na, &mut w, rows, count);
        Ok(Mat::from_fn(rows, 10, |r, k| w[k * rows + r]))
    }
}

/// Terms of a joint that are not identified, with their values other than zero.
fn known_of(joint: &Joint) -> impl Iterator<Item = (JointTerm, f64)> + '_ {
    let all = JointTerm::ALL.into_iter().map(|t| (t, t as usize));
    all.filter(|&(_, k)| !joint.identify[k] && joint.terms[k] != 0.0)
        .map(|(term, k)| (term, joint.terms[k]))
}
