//! Actuator forces of a closed chain, `τ = Gᵀ Γ`.

use super::Mechanism;
use super::actuation::contract;
use super::motion::{MechanismMotion, MechanismWorkspace};
use crate::dynamics::{Samples, Workspace};
use crate::error::Result;
use crate::regressor::term_factor;
use crate::robot::JointTerm;

impl Mechanism {
    /// Inertial parameters of all bodies of the tree: those of `raw` for bodies with columns, and,
    /// where asked, the nominal ones of the others.
    pub(super) fn tree_phi(&self, raw: &[f64], known: bool, phi: &mut Vec<f64>) {
        let start = phi.len();
        for body in &self.robot.bodies {
            match known {
                true => phi.extend(body.inertia.0),
                false => phi.extend([0.0; 10]),
            }
        }
        for (b, &body) in self.parameters.bodies.iter().enumerate() {
            phi[start + 10 * body..start + 10 * body + 10]
                .copy_from_slice(&raw[10 * b..10 * b + 10]);
        }
    }

    /// Actuator forces of the nominal model, known bodies and all joint terms included: actuator
    /// `a`, sample `s` at `a·count + s`, N or N m.
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    pub fn nominal_torque(&self, x: &Samples) -> Result<Vec<f64>> {
        let motion = self.motion(x)?;
        let phi: Vec<f64> = self.robot.bodies.iter().flat_map(|b| b.inertia.0).collect();
        let mut gamma = vec![0.0; motion.tree.dof * x.count];
        let ws = &mut Workspace::default();
        self.tree
            .inverse_dynamics(ws, &phi, &motion.tree, &mut gamma);
        for (j, joint) in self.robot.joints.iter().enumerate() {
            for (term, value) in JointTerm::ALL.into_iter().zip(joint.terms) {
                if value != 0.0 {
                    for s in 0..x.count {
                        gamma[j * x.count + s] += value * term_factor(term, motion.tree.at(j, s));
                    }
                }
            }
            if joint.stribeck.force != 0.0 {
                for s in 0..x.count {
                    gamma[j * x.count + s] += joint.stribeck.torque(motion.tree.at(j, s)[1]);
                }
            }
        }
        Ok(self.project(&motion, &gamma))
    }

    /// Actuator forces of other values of the unknowns: `τ = Y φ`, plus what the known bodies add.
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    ///
    /// # Panics
    /// If there is not one number for each parameter.
    pub fn torque(&self, x: &Samples, phi: &[f64]) -> Result<Vec<f64>> {
        let motion = self.motion(x)?;
        let raw = self.parameters.expand(phi);
        let mut all = Vec::new();
        self.tree_phi(&raw, true, &mut all);
        let mut gamma = vec![0.0; motion.tree.dof * x.count];
        let ws = &mut Workspace::default();
        self.tree
            .inverse_dynamics(ws, &all, &motion.tree, &mut gamma);
        self.add_terms(&motion, &raw, &mut gamma);
        Ok(self.project(&motion, &gamma))
    }

    /// Actuator forces of the nominal model along the motion in the memory, in two halves: without
    /// dry friction, and the most that dry friction of any sign can add,
    /// `Σ_j |G_ja| F_j`. Each actuator-major.
    pub fn smooth_force(&self, ws: &mut MechanismWorkspace, force: &mut Vec<f64>) {
        let MechanismWorkspace {
            tree,
            motion,
            phi,
            torque,
            ..
        } = ws;
        let (na, count) = (self.actuators(), motion.tree.count);
        phi.clear();
        phi.extend(self.robot.bodies.iter().flat_map(|b| b.inertia.0));
        torque.clear();
        torque.resize(motion.tree.dof * count, 0.0);
        self.tree.inverse_dynamics(tree, phi, &motion.tree, torque);
        for (j, joint) in self.robot.joints.iter().enumerate() {
            let [armature, viscous, _, offset] = joint.terms;
            if armature != 0.0 || viscous != 0.0 || offset != 0.0 {
                for s in 0..count {
                    let [_, qd, qdd] = motion.tree.at(j, s);
                    torque[j * count + s] += armature * qdd + viscous * qd + offset;
                }
            }
        }
        force.clear();
        force.resize(2 * na * count, 0.0);
        let (smooth, friction) = force.split_at_mut(na * count);
        contract(&motion.g, torque, motion.tree.dof, na, count, smooth);
        for (j, joint) in self.robot.joints.iter().enumerate() {
            let coulomb = joint.dry();
            if coulomb == 0.0 {
                continue;
            }
            for a in 0..na {
                let g = &motion.g[(j * na + a) * count..][..count];
                let own = self.own_row(j, a);
                for (to, g) in friction[a * count..][..count].iter_mut().zip(g) {
                    *to += coulomb * own.unwrap_or(*g).abs();
                }
            }
        }
    }

    /// Adds the terms of raw parameters to the torques of the tree.
    fn add_terms(&self, motion: &MechanismMotion, raw: &[f64], gamma: &mut [f64]) {
        let count = motion.tree.count;
        let values = &raw[10 * self.parameters.bodies.len()..];
        for (&(joint, term), value) in self.parameters.terms.iter().zip(values) {
            for s in 0..count {
                gamma[joint * count + s] += value * term_factor(term, motion.tree.at(joint, s));
            }
        }
    }

    /// `Gᵀ Γ`.
    ///
    /// # Panics
    /// If `gamma` is too short.
    pub fn project(&self, motion: &MechanismMotion, gamma: &[f64]) -> Vec<f64> {
        let mut tau = vec![0.0; self.actuators() * motion.tree.count];
        contract(
            &motion.g,
            gamma,
            motion.tree.dof,
            self.actuators(),
            motion.tree.count,
            &mut tau,
        );
        tau
    }
}
