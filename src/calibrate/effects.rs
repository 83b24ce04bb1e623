//! What a joint does beside turning by its reading: how it gives way under gravity, an error that repeats with
//! its turn, dead play that gravity closes. Each is linear in one number, so that `q + Σ η_k z_k(q)` takes the
//! place of the reading `q`.

use super::feature::{Feature, Rate, Shape};
use super::serial::Arm;
use super::unknown::{Part, Unknown};
use crate::dynamics::{Samples, Tree, Workspace};
use crate::robot::{Inertia, Motion, Robot};
use nalgebra::Matrix3;

/// Change of the joint's position under gravity that is expected of the joint that bears most, rad.
pub(super) const SAG: f64 = 3e-3;
/// First harmonic of an encoder or gear, rad: a disc of 50 mm radius mounted 5 µm off its middle.
pub(super) const RUN_OUT: f64 = 1e-4;
/// Half the play of a gear, rad.
pub(super) const PLAY: f64 = 1e-3;
/// Torque, as a fraction of the largest of that joint, below which gravity does not close the play.
pub(super) const SOFT: f64 = 0.05;

/// Torques of gravity at the joints of a chain, from a robot with inertia.
#[derive(Debug)]
pub struct Gravity {
    pub(super) robot: Robot,
    tree: Tree,
    /// index of each measured joint among the robot's
    pub(super) joints: Vec<usize>,
    /// what the figures come from
    pub source: String,
}

impl Gravity {
    /// Of a robot that has joints of these names and a mass beyond them; `None` otherwise.
    pub fn of(robot: Robot, names: &[String], source: String) -> Option<Self> {
        let index = |n: &String| robot.joints.iter().position(|j| j.name == *n);
        let joints: Option<Vec<usize>> = names.iter().map(index).collect();
        let heavy = robot.bodies.iter().any(|b| b.inertia.mass() > 0.0);
        let joints = joints.filter(|_| heavy)?;
        Some(Gravity {
            tree: Tree::new(&robot),
            robot,
            joints,
            source,
        })
    }

    /// Torques that gravity puts on the joints in these postures: minus what holds the robot.
    pub fn torques(&self, postures: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let (n, count) = (self.robot.dof(), postures.len());
        let mut motion = Samples::zeros(n, count);
        for (j, joint) in self.robot.joints.iter().enumerate() {
            let [low, high] = joint.range();
            let rest = 0.0_f64.clamp(low, high);
            for s in 0..count {
                motion.q[j * count + s] = rest;
            }
        }
        for (s, q) in postures.iter().enumerate() {
            for (k, &j) in self.joints.iter().enumerate() {
                motion.q[j * count + s] = q[k];
            }
        }
        let phi: Vec<f64> = self.robot.bodies.iter().flat_map(|b| b.inertia.0).collect();
        let mut tau = vec![0.0; n * count];
        self.tree
            .inverse_dynamics(&mut Workspace::default(), &phi, &motion, &mut tau);
        let row = |s: usize| self.joints.iter().map(|&j| -tau[j * count + s]).collect();
        (0..count).map(row).collect()
    }
}

/// The same robot with even rods of 1 kg/m between its joints, for a file that states no masses.
pub fn rods(robot: &Robot, arm: &Arm) -> Robot {
    let mut robot = robot.clone();
    for (i, link) in arm.links.iter().enumerate() {
        let next = arm.links.iter().find(|l| l.parent == Some(i));
        let tip = arm.ends.iter().find(|e| e.link == i).map(|e| e.tip.p);
        let end = next.map(|l| l.body.position).or(tip).unwrap_or_default();
        if let Some(body) = robot.bodies.iter_mut().find(|b| b.name == link.body.name) {
            body.inertia = Inertia::from_com(end.norm(), end * 0.5, Matrix3::zeros());
        }
    }
    robot
}

/// Columns of one kind of effect for all joints that can have it. `torques` are those of the postures at hand.
pub fn features(
    part: Part,
    names: &[String],
    motions: &[Motion],
    torques: &[Vec<f64>],
) -> Vec<Feature> {
    let largest = |j: usize| torques.iter().fold(0.0f64, |m, t| m.max(t[j].abs()));
    let most = (0..names.len()).fold(0.0f64, |m, j| m.max(largest(j)));
    let mut all = Vec::new();
    for (joint, name) in names.iter().enumerate() {
        let turns = motions[joint] == Motion::Revolute;
        let mut add = |shape: Shape, what: &str, unit: &'static str, prior: f64| {
            let soft = (SOFT * largest(joint)).max(f64::MIN_POSITIVE);
            let unknown = Unknown::new(format!("{name}.{what}"), unit, part, prior);
            all.push(Feature {
                joint,
                part,
                shape,
                soft,
                unknown,
            });
        };
        match part {
            // a joint that bears nothing has no column
            Part::Compliance if most > 0.0 && largest(joint) > 1e-3 * most => {
                let unit = if turns { "rad/(N m)" } else { "m/N" };
                add(Shape::Torque, "compliance", unit, SAG / most);
            }
            Part::Eccentricity if turns => {
                add(Shape::Sine, "sin", "rad", RUN_OUT);
                add(Shape::Cosine, "cos", "rad", RUN_OUT);
            }
            Part::Backlash if most > 0.0 && largest(joint) > 1e-3 * most => {
                let unit = if turns { "rad" } else { "m" };
                add(Shape::Sign, "play", unit, PLAY);
            }
            _ => {}
        }
    }
    all
}

/// Values of the columns in one posture.
pub fn rates(features: &[Feature], q: &[f64], torque: Option<&[f64]>) -> Vec<Rate> {
    let of = |f: &Feature| {
        let (q, t) = (q[f.joint], torque.map_or(0.0, |t| t[f.joint]));
        Rate::turn(match f.shape {
            Shape::Torque => t,
            Shape::Sine => q.sin(),
            Shape::Cosine => q.cos(),
            Shape::Sign => (t / f.soft).tanh(),
            Shape::Given | Shape::Bend => 0.0,
        })
    };
    features.iter().map(of).collect()
}
