//! Delta robot: three chains of arm and parallelogram to a platform that only translates
//! (Clavel 1988). Every rod is a body: 10 bodies, 100 columns. See
//! [`parallelogram`] for the chain.

use super::closed_form::ClosedForm;
use super::geometry::Kinematics;
use super::parallelogram::{self, Bodies, Chain, Parallelograms};
use super::task::Task;
use super::{Mechanism, Setup, Source};
use crate::error::{Error, Result};
use crate::robot::{Inertia, JointTerm};
use nalgebra::Vector3;

/// A Delta robot.
#[derive(Debug, Clone)]
pub struct Delta {
    /// name
    pub name: String,
    /// the three chains
    pub chains: Vec<Chain>,
    /// about the platform's origin
    pub platform: Inertia,
    /// `x, y, z` of the middle of the workspace
    pub home: [f64; 3],
    /// acceleration of gravity, base axes
    pub gravity: Vector3<f64>,
    /// unknown bodies
    pub bodies: Bodies,
    /// all chains have the same parameters
    pub identical: bool,
    /// motor terms that are unknown
    pub identify: Vec<JointTerm>,
}

impl Delta {
    /// The mechanism.
    ///
    /// # Errors
    /// Other than three chains, lengths that are not positive, a home out of reach, and what
    /// [`Mechanism::new`] finds.
    pub fn build(&self) -> Result<Mechanism> {
        Mechanism::new(self.setup()?)
    }

    /// What the mechanism is put together from.
    ///
    /// # Errors
    /// As [`Self::build`], what [`Mechanism::new`] finds excepted.
    pub fn setup(&self) -> Result<Setup> {
        let bad = |why: String| Err(Error::Infeasible(format!("{}: {why}", self.name)));
        if self.chains.len() != 3 {
            return bad(format!(
                "a Delta has 3 chains, this one has {}",
                self.chains.len()
            ));
        }
        if let Some(why) = parallelogram::problem(&self.chains) {
            return bad(why);
        }
        let (mut tree, parts) =
            parallelogram::tree(&self.chains, &[], Task::Translation, &self.identify);
        tree.set(parts.platform, self.platform);
        let kinematics = Parallelograms {
            chains: self.chains.clone(),
            hinges: Vec::new(),
        };
        if let Some(why) = kinematics.unreachable(&self.home) {
            return bad(format!("at home {why}"));
        }
        let length = kinematics
            .chains
            .iter()
            .map(|c| c.arm_length)
            .fold(0.0, f64::max);
        Ok(Setup {
            source: Source::Delta,
            robot: tree.robot(&self.name, self.gravity),
            actuated: (0..3).collect(),
            task: Task::Translation,
            geometry: Box::new(ClosedForm::<_, 3>(kinematics)),
            groups: parallelogram::groups(&parts, self.bodies, self.identical),
            home: self.home.to_vec(),
            length,
        })
    }
}
