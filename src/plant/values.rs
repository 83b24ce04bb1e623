//! The robot with other values of its unknowns.

use super::{Column, Plant};
use crate::robot::JointTerm;
use crate::robot::{Inertia, Robot, Stribeck};
use std::sync::Arc;

impl Plant {
    /// The bodies and joint terms with the values `phi` of [`Plant::parameters`]; of a closed chain its
    /// tree, in which bodies that share parameters get the same.
    ///
    /// # Panics
    /// If there is not one number for each unknown.
    pub fn with_values(&self, phi: &[f64]) -> Robot {
        let mut robot = self.robot().clone();
        self.set_values(&mut robot, phi);
        robot
    }

    /// Writes the values `phi` into a robot with the bodies and joints of this one; what no unknown
    /// stands for stays as it is.
    ///
    /// # Panics
    /// As [`Plant::with_values`].
    pub fn set_values(&self, robot: &mut Robot, phi: &[f64]) {
        let parameters = self.parameters();
        assert_eq!(parameters.len(), phi.len(), "one number for each unknown");
        let mut raw = vec![0.0; self.raw().len()];
        for (p, x) in parameters.iter().zip(phi) {
            p.raw.iter().for_each(|&r| raw[r] += x);
        }
        for (column, x) in self.raw().iter().zip(raw) {
            match *column {
                Column::Inertial { body, k } => robot.bodies[body].inertia.0[k] = x,
                Column::Term { joint, term } => robot.joints[joint].terms[term as usize] = x,
                Column::Nuisance => {}
            }
        }
    }

    /// The values of the unknowns in a robot with the bodies and joints of this one; of bodies that
    /// share parameters those of the first.
    pub fn values_in(&self, robot: &Robot) -> Vec<f64> {
        let of = |column: Column| match column {
            Column::Inertial { body, k } => robot.bodies[body].inertia.0[k],
            Column::Term { joint, term } => robot.joints[joint].terms[term as usize],
            Column::Nuisance => 0.0,
        };
        self.parameters().iter().map(|p| of(p.kind)).collect()
    }

    /// The same tree with the values `phi` of its unknowns.
    ///
    /// # Panics
    /// As [`Plant::with_values`].
    pub(crate) fn valued(&self, phi: &[f64]) -> Plant {
        self.amid(self.with_values(phi).into())
    }

    /// The same robot with a load in the body that carries it ([`Plant::tool`]); unchanged where there is none.
    pub fn carrying(&self, load: &Inertia) -> Plant {
        let Some(tool) = self.tool() else {
            return self.clone();
        };
        let other: Plant = match self.mechanism.clone() {
            None => {
                let mut robot = self.robot.clone();
                let own = &mut robot.bodies[tool].inertia;
                *own = *own + *load;
                robot.into()
            }
            Some(mechanism) => Arc::unwrap_or_clone(mechanism).carrying(tool, load).into(),
        };
        self.amid(other)
    }

    /// The same robot with other breakaway friction of some actuators.
    pub(crate) fn with_stribeck(&self, all: &[(usize, Stribeck)]) -> Plant {
        let set = |robot: &mut Robot| {
            for (a, stribeck) in all {
                robot.joints[self.actuated[*a]].stribeck = *stribeck;
            }
        };
        let other: Plant = match self.mechanism.clone() {
            None => {
                let mut robot = self.robot.clone();
                set(&mut robot);
                robot.into()
            }
            Some(mechanism) => {
                let mut mechanism = Arc::unwrap_or_clone(mechanism);
                set(&mut mechanism.robot);
                mechanism.into()
            }
        };
        self.amid(other)
    }

    /// The same robot with its breakaway friction among what `identify` estimates, or not, for every actuator.
    pub fn fitting_stribeck(&self, fit: bool) -> Plant {
        let joints = self.actuators();
        let all: Vec<(usize, Stribeck)> = joints
            .iter()
            .enumerate()
            .map(|(a, j)| (a, Stribeck { fit, ..j.stribeck }))
            .collect();
        self.with_stribeck(&all)
    }

    /// The same robot with fewer unknowns: of a closed chain the ten of the body that carries a load, and of every robot
    /// Coulomb and viscous friction and a constant of each actuator. A tree keeps its bodies as unknowns.
    pub(crate) fn asked_for_its_tool(&self, tool: usize) -> Plant {
        let plain: Plant = match self.mechanism.clone() {
            None => return self.clone().with_terms(&JointTerm::FRICTION),
            Some(mechanism) => {
                let name = self.robot.bodies[tool].name.clone();
                Arc::unwrap_or_clone(mechanism)
                    .with_unknown_body(&name, tool)
                    .into()
            }
        };
        self.amid(plain).with_terms(&JointTerm::FRICTION)
    }
}
