//! H4: four chains of arm and parallelogram to two lateral bars, hinged on a platform that
//! translates and turns about the vertical (Pierrot & Company 1999).
//!
//! The bars keep their orientation, so the hinges turn by `−θ` and the end of chain `i` on bar `k`
//! is `b_i = p + Rz(ϑ) c_k + β_i`. Every rod is a body: 15 bodies, 150 columns. See
//! [`parallelogram`] for the chain.
//!
//! **Lumped model** (Vivas, Poignet, Renaud et al.): half of each forearm at the arm's tip, half on
//! the platform,
//!
//! ```text
//! Γ = I_mot q̈ + D_a⁻ᵀ M_l (ẍ − g) + F_v q̇ + F_c sign q̇        M_l = diag(M_nac, M_nac, M_nac, I_nac)
//! ```
//!
//! 14 parameters: four motor inertias, `M_nac`, `I_nac`, four viscous and four Coulomb terms; with
//! the weight of the arms, `g cos q`, 18. In the tree these are `Ixx` (and `mz`) of the arms, `m`
//! and `Izz` of the platform.

use super::closed_form::ClosedForm;
use super::geometry::Kinematics;
use super::parallelogram::{self, Bodies, Chain, Parallelograms};
use super::parameters::{Group, Pattern};
use super::task::Task;
use super::{Mechanism, Setup, Source};
use crate::error::{Error, Result};
use crate::robot::{Inertia, JointTerm};
use nalgebra::Vector3;

/// How the bodies are modelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// every rod
    Rods,
    /// forearms lumped, without the weight of the arms
    Lumped,
    /// forearms lumped, with the weight of the arms
    LumpedGravity,
}

/// An H4 robot.
#[derive(Debug, Clone)]
pub struct H4 {
    /// name
    pub name: String,
    /// the four chains; [`Chain::hinge`] says on which bar each ends
    pub chains: Vec<Chain>,
    /// hinges of the two bars, platform axes
    pub hinges: [Vector3<f64>; 2],
    /// about the platform's origin
    pub platform: Inertia,
    /// about the hinges
    pub bars: [Inertia; 2],
    /// `x, y, z, theta` of the middle of the workspace
    pub home: [f64; 4],
    /// acceleration of gravity, base axes
    pub gravity: Vector3<f64>,
    /// model of the forearms
    pub model: Model,
    /// unknown bodies
    pub bodies: Bodies,
    /// all chains have the same parameters
    pub identical: bool,
    /// motor terms that are unknown
    pub identify: Vec<JointTerm>,
}

/// Bodies of the lumped model.
struct Lumped {
    arms: Vec<Inertia>,
    platform: Inertia,
}

impl H4 {
    /// Half of each forearm at the tip of its arm, half on the platform.
    fn lumped(&self) -> Lumped {
        let mut arms = Vec::new();
        let (mut mass, mut spin) = (self.platform.mass(), self.platform.0[9]);
        for bar in &self.bars {
            mass += bar.mass();
        }
        for (bar, hinge) in self.bars.iter().zip(&self.hinges) {
            spin += bar.mass() * (hinge.x.powi(2) + hinge.y.powi(2));
        }
        for chain in &self.chains {
            let forearm = chain.rods[0].mass() + chain.rods[1].mass();
            let (l, hinge) = (chain.arm_length, self.hinges[chain.hinge.min(1)]);
            let mut arm = Inertia::default();
            arm.0[3] = chain.arm.0[3] + 0.5 * forearm * l;
            arm.0[4] = chain.arm.0[4] + 0.5 * forearm * l * l;
            if self.model == Model::Lumped {
                arm.0[3] = 0.0;
            }
            arms.push(arm);
            mass += 0.5 * forearm;
            spin += 0.5 * forearm * (hinge.x.powi(2) + hinge.y.powi(2));
        }
        let mut platform = Inertia::default();
        platform.0[0] = mass;
        platform.0[9] = spin;
        Lumped { arms, platform }
    }

    /// The mechanism.
    ///
    /// # Errors
    /// Other than four chains, a chain on a third bar, lengths that are not positive, a home out of
    /// reach, and what [`Mechanism::new`] finds.
    pub fn build(&self) -> Result<Mechanism> {
        Mechanism::new(self.setup()?)
    }

    /// What the mechanism is put together from.
    ///
    /// # Errors
    /// As [`Self::build`], what [`Mechanism::new`] finds excepted.
    pub fn setup(&self) -> Result<Setup> {
        let bad = |why: String| Err(Error::Infeasible(format!("{}: {why}", self.name)));
        if self.chains.len() != 4 {
            return bad(format!(
                "an H4 has 4 chains, this one has {}",
                self.chains.len()
            ));
        }
        if let Some(i) = self.chains.iter().position(|c| c.hinge > 1) {
            return bad(format!("chain {} ends on a bar that does not exist", i + 1));
        }
        if let Some(why) = parallelogram::problem(&self.chains) {
            return bad(why);
        }
        let (mut tree, parts) = parallelogram::tree(
            &self.chains,
            &self.hinges,
            Task::Schoenflies,
            &self.identify,
        );
        let groups = match self.model {
            Model::Rods => {
                tree.set(parts.platform, self.platform);
                for (body, inertia) in parts.bars.iter().zip(self.bars) {
                    tree.set(*body, inertia);
                }
                parallelogram::groups(&parts, self.bodies, self.identical)
            }
            Model::Lumped | Model::LumpedGravity => {
                let lumped = self.lumped();
                let only = match self.model {
                    Model::LumpedGravity => vec![3, 4],
                    _ => vec![4],
                };
                let mut groups = Vec::new();
                for (i, arm) in parts.arms.iter().enumerate() {
                    // the rotor turns with the arm and is part of the motor inertia
                    let mut inertia = lumped.arms[i];
                    inertia.0[4] += self.chains[i].terms[JointTerm::Armature as usize];
                    tree.set(*arm, inertia);
                    let name = format!("arm{}", i + 1);
                    groups.push(Group::one(&name, *arm, Pattern::Only(only.clone())));
                }
                for rod in parts.rods.iter().flatten() {
                    tree.set(*rod, Inertia::default());
                }
                tree.set(parts.platform, lumped.platform);
                groups.push(Group::one(
                    "platform",
                    parts.platform,
                    Pattern::Only(vec![0, 9]),
                ));
                groups
            }
        };
        let mut robot = tree.robot(&self.name, self.gravity);
        if self.model != Model::Rods {
            for joint in &mut robot.joints {
                joint.terms[JointTerm::Armature as usize] = 0.0;
                joint.identify[JointTerm::Armature as usize] = false;
            }
        }
        let kinematics = Parallelograms {
            chains: self.chains.clone(),
            hinges: self.hinges.to_vec(),
        };
        if let Some(why) = kinematics.unreachable(&self.home) {
            return bad(format!("at home {why}"));
        }
        let length = self.hinges.iter().map(|h| h.norm()).fold(1e-3, f64::max);
        Ok(Setup {
            source: Source::H4,
            robot,
            actuated: (0..4).collect(),
            task: Task::Schoenflies,
            geometry: Box::new(ClosedForm::<_, 4>(kinematics)),
            groups,
            home: self.home.to_vec(),
            length,
        })
    }
}
