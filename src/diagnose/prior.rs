//! How far the parameters of a nominal model may be off: what is ordinary for a model of its origin.

use super::noise::Noise;
use super::thresholds::THRESHOLDS as T;
use crate::plant::{self, Parameter, Plant};
use crate::robot::{JointTerm, Prior};

/// Factors on the deviations of the prior: of masses, first moments and rotors, and of tensors.
pub type Closeness = [f64; 2];

/// Factor of every parameter of the nominal model.
pub fn factors(parameters: &[Parameter], closeness: Closeness) -> Vec<f64> {
    let of = |kind: &plant::Column| match kind {
        plant::Column::Inertial { k, .. } => closeness[usize::from(*k > 3)],
        plant::Column::Term {
            term: JointTerm::Armature,
            ..
        } => closeness[0],
        plant::Column::Term { .. } | plant::Column::Nuisance => 1.0,
    };
    parameters.iter().map(|p| of(&p.kind)).collect()
}

/// Standard deviations of the parameters a priori, from the robot's file, the noise of the torques and
/// the largest speeds of the actuators.
pub fn spread(plant: &Plant, parameters: &[Parameter], noise: &[Noise], speed: &[f64]) -> Vec<f64> {
    let robot = plant.robot();
    let cad = usize::from(plant.prior() != Prior::Identified);
    let of = |deviations: [f64; 2]| deviations[cad];
    let heaviest = robot
        .bodies
        .iter()
        .map(|b| b.inertia.mass())
        .fold(0.0, f64::max);
    let actuated = plant.actuated();
    let size = |b: usize| -> f64 {
        // length of a link: where the next one starts, its centre of mass, its radius of gyration
        let body = &robot.bodies[b];
        let next = robot
            .bodies
            .iter()
            .filter(|c| c.parent == Some(b))
            .map(|c| c.position.norm())
            .fold(0.0, f64::max);
        let m = body.inertia.mass().max(1e-9);
        let about = (body.inertia.tensor().trace().max(0.0) / (2.0 * m)).sqrt();
        next.max(about).max(T.prior.short)
    };
    parameters
        .iter()
        .map(|p| match p.kind {
            plant::Column::Inertial { body, k } => {
                let m = robot.bodies[body]
                    .inertia
                    .mass()
                    .max(T.prior.lightest * heaviest)
                    .max(T.prior.light);
                let l = size(body);
                match k {
                    0 => of(T.prior.mass) * m,
                    1..=3 => of(T.prior.first) * m * l,
                    _ => of(T.prior.second) * m * l * l,
                }
            }
            plant::Column::Term { joint, term } => {
                let terms = robot.joints[joint].terms;
                let value = p.value.abs();
                let j = actuated.iter().position(|a| *a == joint);
                let noise = j.map_or(0.0, |j| noise[j].std);
                let speed = j.map_or(1.0, |j| speed[j]);
                let friction = terms[2].abs() + T.prior.at_speed * terms[1].abs() * speed;
                match term {
                    JointTerm::Armature => of(T.prior.armature) * value,
                    JointTerm::Viscous => of(T.prior.viscous) * value,
                    JointTerm::Coulomb => of(T.prior.coulomb) * value,
                    JointTerm::Offset => {
                        (of(T.prior.offset) * friction).max(of(T.prior.offset_noise) * noise)
                    }
                }
                .max(T.prior.noise * noise)
            }
            // each states its own
            plant::Column::Nuisance => 0.0,
        })
        .collect()
}
