//! How each effect enters the plant.

use crate::chain::{Body, Joint, rpy};
use crate::effects::Effect;
use crate::friction::Dry;
use crate::plant::{Plant, STEP, Spring};
use crate::robots::Machine;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

impl Plant {
    /// Adds an effect; `inertia` is that of each joint's own motion at home.
    pub fn attach(&mut self, e: &Effect, machine: &Machine, inertia: &[f64]) {
        let (s, x, j) = (e.strength, e.shape, e.joint);
        let drive = &machine.drives[j];
        let (effort, speed) = (drive.effort, drive.velocity);
        let side = if x[5] < 0.5 { -1.0 } else { 1.0 };
        // a stiffness by the frequency of the joint's inertia against it
        let stiffness = |hertz: f64| (TAU * hertz).powi(2) * (inertia[j] + 0.2 * drive.armature);
        let spring = |stiffness: f64| Spring {
            stiffness,
            damping: 0.12 * (stiffness * inertia[j].min(drive.armature)).sqrt(),
            cubic: 0.0,
            gap: 0.0,
            error: (0.0, 0.0, 0.0),
            slip: f64::INFINITY,
            slipped: 0.0,
            angle: 0.0,
            rate: 0.0,
        };
        let axis = &mut self.axes[j];
        let body = self.first + j;
        match e.name {
            "payload" => {
                let last = machine.chain.joints[machine.dof() - 1].body.mass;
                let m = s * 0.5 * last;
                let com = Vector3::new(x[0] - 0.5, x[1] - 0.5, 0.3 + x[2]) * (0.12 * machine.reach);
                let ball = Matrix3::identity() * (0.4 * m * 0.0025 * machine.reach.powi(2));
                self.chain.joints[body].body.add(m, com, ball);
            }
            "link_inertia" => {
                let old = self.chain.joints[body].body.parameters();
                let f = if side > 0.0 {
                    1.0 + 0.4 * s
                } else {
                    1.0 / (1.0 + 0.4 * s)
                };
                self.chain.joints[body].body = Body::from_parameters(&old.map(|p| p * f));
            }
            "gravity_direction" => {
                let turn = rpy(
                    0.05 * s * (TAU * x[0]).cos(),
                    0.05 * s * (TAU * x[0]).sin(),
                    0.0,
                );
                self.chain.gravity = turn * self.chain.gravity;
            }
            "friction_asymmetry" => {
                let f = &mut axis.friction;
                let (a, b) = (0.4 * s * side, 0.5 * s * side);
                f.coulomb = [
                    f.coulomb[0] * (1.0 + a).max(0.05),
                    f.coulomb[1] * (1.0 - a).max(0.05),
                ];
                f.viscous = [
                    f.viscous[0] * (1.0 + b).max(0.05),
                    f.viscous[1] * (1.0 - b).max(0.05),
                ];
            }
            "nonlinear_viscous_friction" if x[0] < 0.5 => {
                axis.friction.eyring = Some((0.03 * s * effort, speed * (0.04 + 0.1 * x[1])));
            }
            "nonlinear_viscous_friction" => {
                axis.friction.power = Some((0.15 * s * effort, 1.7 + 0.8 * x[1]));
            }
            "stribeck_friction" => {
                let velocity = speed * (0.02 + 0.05 * x[0]);
                let exponent = if x[1] < 0.5 { 1.0 } else { 2.0 };
                let f = &mut axis.friction;
                if x[2] < 0.5 {
                    f.stribeck = Some([s, velocity, exponent]);
                } else {
                    f.dry = Dry::Bristle {
                        rise: s,
                        velocity,
                        exponent,
                        deflection: 3e-5 * speed,
                        z: 0.0,
                    };
                }
            }
            "presliding_hysteresis" => {
                let deflection = 0.012 * s * speed.min(2.0);
                axis.friction.dry = if x[0] < 0.5 {
                    Dry::Bristle {
                        rise: 0.0,
                        velocity: 0.05 * speed,
                        exponent: 2.0,
                        deflection,
                        z: 0.0,
                    }
                } else {
                    Dry::Elements {
                        deflection,
                        z: [0.0; 6],
                    }
                };
            }
            "load_dependent_friction" => {
                let p = if x[0] < 0.5 { 1.0 } else { 0.8 + 0.6 * x[1] };
                axis.friction.gear = Some([0.08 * s * effort, 0.5 * effort, p, 0.3 * x[2]]);
            }
            "position_dependent_friction" => {
                axis.friction.around = Some([0.6 * s, TAU * x[0], 0.3 * s * x[2], TAU * x[1]]);
            }
            "thermal_friction" => axis.friction.warming = Some((0.8 * s, 20.0 + 40.0 * x[0])),
            "torque_constant" => axis.gain = 1.0 / (1.0 + 0.12 * s * side).max(0.4),
            "torque_saturation" => axis.saturation = 0.6 * effort * s.powf(-1.0 / 3.0),
            "cogging" => {
                let order = drive.gear * [1.0, 2.0, 4.0][(x[0] * 2.999) as usize];
                let a = 0.008 * s * effort;
                axis.cogging = vec![(a, order, TAU * x[1]), (0.35 * a, 2.0 * order, TAU * x[2])];
            }
            "transmission_error" => {
                let k = stiffness(35.0);
                let a = 8e-5 * s;
                axis.spring = Some(Spring {
                    error: (a, 2.0 * drive.gear, TAU * x[1]),
                    ..spring(k)
                });
            }
            "joint_elasticity" => {
                let k = stiffness(13.0 / s.sqrt());
                let wound = effort / k;
                let cubic = if x[0] < 0.5 {
                    0.0
                } else {
                    0.5 / (wound * wound)
                };
                axis.spring = Some(Spring { cubic, ..spring(k) });
            }
            "backlash" => {
                axis.spring = Some(Spring {
                    gap: 0.0025 * s,
                    ..spring(stiffness(45.0))
                });
            }
            "base_compliance" => self.tilt(s, machine),
            "torque_delay" => {
                let steps = (0.0025 * s / STEP).round() as usize;
                let all = x[0] < 0.5;
                for (i, axis) in self.axes.iter_mut().enumerate() {
                    if all || i == j {
                        *(if x[1] < 0.7 {
                            &mut axis.log_lag
                        } else {
                            &mut axis.drive_lag
                        }) = steps;
                    }
                }
            }
            "cable_spring" => {
                let level = 0.04 * s * effort;
                let half = 0.5 * (drive.range[1] - drive.range[0]);
                let centre = 0.5 * (drive.range[0] + drive.range[1]) + half * (x[0] - 0.5);
                axis.hose = Some((level, centre, half));
                axis.friction.hose = Some((0.1 * level, 0.05 * half, 0.0));
            }
            "counterbalance" => {
                let crank = 0.12 * machine.reach;
                let force = 0.35 * s * effort / crank;
                let phase = PI * (0.3 + 0.4 * x[0]);
                axis.balance = Some([
                    force,
                    crank,
                    (0.35 + 0.3 * x[1]) * machine.reach,
                    phase,
                    1.5 * x[2],
                ]);
            }
            "joint_coupling" => {
                let sign = if x[0] < 0.75 { 1.0 } else { -1.0 };
                let least = effort.min(machine.drives[j + 1].effort);
                let slow = speed.min(machine.drives[j + 1].velocity);
                self.coupling = Some((j, 0.06 * s * least, 0.04 * s * least / slow, sign));
            }
            "joint_offset" => axis.shift = 0.02 * s * side,
            "encoder_eccentricity" => {
                let a = 0.015 * s;
                axis.eccentric = [
                    a,
                    TAU * x[0],
                    if x[1] < 0.5 { 0.0 } else { 0.3 * a },
                    TAU * x[2],
                ];
            }
            "slipping_belt" => {
                let slip = 0.25 * effort / s;
                axis.spring = Some(Spring {
                    slip,
                    ..spring(stiffness(40.0))
                });
            }
            "sloshing_load" => {
                let last = machine.chain.joints[machine.dof() - 1].body.mass;
                let (m, l) = (s * last, 0.1 + 0.2 * x[0]);
                let mut body = Body::default();
                body.add(
                    m,
                    Vector3::new(l, 0.0, 0.0),
                    Matrix3::identity() * (0.05 * m * l * l),
                );
                let index = self.chain.dof();
                self.chain.joints.push(Joint {
                    prismatic: false,
                    rotation: rpy(FRAC_PI_2 * (1.0 + x[1]), 0.3 * x[2], 0.0),
                    position: Vector3::new(0.0, 0.0, 0.1 * machine.reach),
                    body,
                });
                self.passive
                    .push((index, 0.0, 0.3 * m * l * (9.81 * l).sqrt()));
            }
            "sensor_crosstalk" => {
                let n = machine.dof();
                let other = (j + 1 + (x[0] * (n as f64 - 1.001)) as usize) % n;
                let ratio = effort / machine.drives[other].effort;
                self.crosstalk = Some((j, other, 0.06 * s * ratio * side));
            }
            _ => {}
        }
    }

    /// Puts the robot on a base that tilts against two springs.
    fn tilt(&mut self, s: f64, machine: &Machine) {
        let mut total = 0.0;
        for j in &machine.chain.joints {
            total += j.body.mass;
        }
        let inertia = total * (0.5 * machine.reach).powi(2);
        let k = (TAU * 8.0).powi(2) * inertia / s;
        let mut block = Body::default();
        let own = Matrix3::identity() * (0.04 * total * machine.reach.powi(2));
        block.add(total, Vector3::zeros(), own);
        let lever = |rotation, body| Joint {
            prismatic: false,
            rotation,
            position: Vector3::zeros(),
            body,
        };
        let (rx, ry) = (rpy(0.0, FRAC_PI_2, 0.0), rpy(-FRAC_PI_2, 0.0, 0.0));
        // first about x, then about y; the robot stands upright on the second
        let second = rx.transpose() * ry;
        self.chain.joints[0].rotation = ry.transpose() * self.chain.joints[0].rotation;
        self.chain.joints[0].position = ry.transpose() * self.chain.joints[0].position;
        self.chain.joints.insert(0, lever(second, block));
        self.chain.joints.insert(0, lever(rx, Body::default()));
        for (index, _, _) in &mut self.passive {
            *index += 2;
        }
        self.first = 2;
        let damping = 0.1 * (k * inertia).sqrt();
        self.passive.push((0, k, damping));
        self.passive.push((1, k, damping));
    }
}
