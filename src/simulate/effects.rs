//! What the simulated robot does that its nominal model does not: chosen by the user, so that an
//! identification or a diagnosis can be rehearsed against it.

use crate::error::{Error, Result};
use crate::plant::Plant;
use crate::robot::Inertia;
use nalgebra::{Matrix3, Rotation3, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Joint friction beyond viscous and Coulomb, and errors of the torque and position signals; one
/// for each actuator.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct JointEffect {
    /// `F_s − F_c`: what breaking away takes beyond Coulomb friction, N m or N
    pub stribeck: f64,
    /// speed at which that has fallen to `1/e`, rad/s or m/s
    pub stribeck_velocity: f64,
    /// `c` of the friction `c q̇ |q̇|`
    pub quadratic: f64,
    /// change of the Coulomb friction with direction: `± half` of it, N m or N
    pub asymmetry: f64,
    /// `β` of the friction `β |τ| sign(q̇)`
    pub load_friction: f64,
    /// factor on the measured torque: `1 + ε` for an error of the torque constant
    pub torque_gain: f64,
    /// added to the measured position, rad or m
    pub position_offset: f64,
}

impl Default for JointEffect {
    fn default() -> Self {
        JointEffect {
            stribeck: 0.0,
            stribeck_velocity: 0.01,
            quadratic: 0.0,
            asymmetry: 0.0,
            load_friction: 0.0,
            torque_gain: 1.0,
            position_offset: 0.0,
        }
    }
}

/// All effects of a simulated robot.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct Effects {
    /// one for each actuator; empty where there are none
    pub joints: Vec<JointEffect>,
    /// load on the last body or the platform, about its frame
    pub payload: Option<Inertia>,
    /// delay of the measured torque, s
    pub torque_delay: f64,
    /// rotation of the base about its `x` and `y` axes that the model does not know, rad
    pub tilt: [f64; 2],
    /// spread of the bodies' inertia and of the joint terms about the nominal ones, as a fraction
    pub perturb: f64,
}

crate::settings::changeable!(Effects);

/// Which field of [`JointEffect`] an option sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Field {
    /// `EXTRA,VELOCITY`
    Stribeck,
    /// `C`
    Quadratic,
    /// `DIFFERENCE`
    Asymmetry,
    /// `BETA`
    LoadFriction,
    /// `FACTOR`
    TorqueGain,
    /// `OFFSET`
    PositionOffset,
}

impl Field {
    fn option(self) -> &'static str {
        match self {
            Field::Stribeck => "--stribeck-friction",
            Field::Quadratic => "--nonlinear-viscous-friction",
            Field::Asymmetry => "--friction-asymmetry",
            Field::LoadFriction => "--load-dependent-friction",
            Field::TorqueGain => "--torque-constant",
            Field::PositionOffset => "--joint-offset",
        }
    }
}

fn numbers(text: &str, what: &str) -> Result<Vec<f64>> {
    text.split(',')
        .map(|part| match part.trim().parse::<f64>() {
            Ok(v) if v.is_finite() => Ok(v),
            _ => Err(Error::Argument(format!(
                "{what}: `{}` of `{text}` is not a number",
                part.trim()
            ))),
        })
        .collect()
}

impl Effects {
    /// Sets a joint effect from `[JOINT=]NUMBERS`; without a joint, of all actuators.
    ///
    /// # Errors
    /// [`Error::Argument`]: an unknown joint, a wrong count of numbers, a number out of range.
    pub fn set(&mut self, plant: &Plant, field: Field, text: &str) -> Result<()> {
        let names: Vec<String> = plant.actuators().iter().map(|j| j.name.clone()).collect();
        self.joints.resize(names.len(), JointEffect::default());
        let option = field.option();
        let (joint, values) = match text.split_once('=') {
            Some((name, rest)) => (Some(name.trim()), rest),
            None => (None, text),
        };
        let v = numbers(values, option)?;
        let (wanted, form) = match field {
            Field::Stribeck => (2, "[JOINT=]EXTRA,VELOCITY"),
            _ => (1, "[JOINT=]VALUE"),
        };
        if v.len() != wanted {
            return Err(Error::Argument(format!(
                "{option} takes {form}, not `{text}`"
            )));
        }
        let bad = match field {
            Field::Stribeck => v[0] < 0.0 || v[1] <= 0.0,
            Field::Quadratic | Field::LoadFriction => v[0] < 0.0,
            Field::TorqueGain => v[0] <= 0.0,
            Field::Asymmetry | Field::PositionOffset => false,
        };
        if bad {
            return Err(Error::Argument(format!(
                "{option} `{text}`: the number must be positive"
            )));
        }
        let chosen: Vec<usize> = match joint {
            None => (0..names.len()).collect(),
            Some(name) => match names.iter().position(|n| n == name) {
                Some(j) => vec![j],
                None => {
                    return Err(Error::Argument(format!(
                        "{option}: there is no actuator `{name}`; there are {}",
                        names.join(", ")
                    )));
                }
            },
        };
        for j in chosen {
            let e = &mut self.joints[j];
            match field {
                Field::Stribeck => (e.stribeck, e.stribeck_velocity) = (v[0], v[1]),
                Field::Quadratic => e.quadratic = v[0],
                Field::Asymmetry => e.asymmetry = v[0],
                Field::LoadFriction => e.load_friction = v[0],
                Field::TorqueGain => e.torque_gain = v[0],
                Field::PositionOffset => e.position_offset = v[0],
            }
        }
        Ok(())
    }

    /// The effect of one actuator.
    pub fn joint(&self, a: usize) -> JointEffect {
        self.joints.get(a).copied().unwrap_or_default()
    }

    /// Gravity as the tilted base feels it.
    pub fn gravity(&self, plant: &Plant) -> Vector3<f64> {
        let turn = Rotation3::from_euler_angles(self.tilt[0], self.tilt[1], 0.0);
        turn.inverse() * plant.robot().gravity
    }

    /// Armature, viscous and Coulomb friction and offset of all joints of the tree: nominal and, but
    /// for the offset, perturbed.
    pub fn terms(&self, plant: &Plant, seed: u64) -> Vec<[f64; 4]> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x7e57_0f7e);
        let joints = plant.robot().joints.iter();
        joints
            .map(|joint| {
                let mut terms = joint.terms;
                for t in &mut terms[..3] {
                    *t *= 1.0 + self.perturb * rng.random_range(-1.0..1.0);
                }
                terms
            })
            .collect()
    }

    /// Inertial parameters of all bodies of the simulated robot: nominal, perturbed, with the load.
    /// Each body is scaled as a whole, so that it remains a body that can exist.
    pub fn inertia(&self, plant: &Plant, seed: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x9e77_10ad);
        let mut phi: Vec<f64> = Vec::new();
        for body in &plant.robot().bodies {
            let factor = 1.0 + self.perturb * rng.random_range(-1.0..1.0);
            phi.extend(body.inertia.0.map(|p| p * factor));
        }
        if let (Some(load), Some(body)) = (self.payload, plant.tool()) {
            for k in 0..10 {
                phi[10 * body + k] += load.0[k];
            }
        }
        phi
    }
}

/// A load from `MASS,X,Y,Z[,Ixx,Ixy,Ixz,Iyy,Iyz,Izz]`: kg, centre of mass in m in the frame of the
/// last body or platform, tensor in kg m² about the centre of mass.
///
/// # Errors
/// [`Error::Argument`]: another count of numbers, a mass that is not positive, a body that cannot
/// exist.
pub fn parse_payload(text: &str) -> Result<Inertia> {
    let v = numbers(text, "--payload")?;
    if v.len() != 4 && v.len() != 10 {
        return Err(Error::Argument(format!(
            "--payload takes MASS,X,Y,Z or MASS,X,Y,Z,Ixx,Ixy,Ixz,Iyy,Iyz,Izz, not {} numbers",
            v.len()
        )));
    }
    let tensor = match v.len() {
        4 => Matrix3::zeros(),
        _ => Matrix3::new(v[4], v[5], v[6], v[5], v[7], v[8], v[6], v[8], v[9]),
    };
    let load = Inertia::from_com(v[0], Vector3::new(v[1], v[2], v[3]), tensor);
    // as it is given: moved to the origin and back, the tensor of a point mass is rounding
    let (smallest, triangle) = Inertia::from_com(v[0], Vector3::zeros(), tensor).realizability();
    if v[0] <= 0.0 || smallest < -1e-9 || triangle > 1e-9 {
        return Err(Error::Argument(format!(
            "--payload {text}: no body has such a mass and inertia (mass > 0; principal moments \
             positive, none larger than the sum of the others)"
        )));
    }
    Ok(load)
}

#[cfg(test)]
mod tests {
    use super::parse_payload;

    #[test]
    fn point_masses_are_payloads_wherever_they_are() {
        for text in ["0.8,0.02,0,0.1", "0.5,0,0,0.1", "3,-0.07,0.013,0.21"] {
            let load = parse_payload(text).unwrap();
            assert!(load.mass() > 0.0, "{text}");
        }
        assert!(parse_payload("1,0,0,0.1,1,0,0,0.1,0,0.1").is_err());
    }
}
