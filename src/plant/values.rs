//! The robot with other values of its unknowns.

use super::{Column, Plant};
use crate::robot::Robot;

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
}
