//! The machine with its effects, stepped through time.

use crate::chain::{Body, Chain, Joint, Kinematics, rpy};
use crate::disturb::Disturbance;
use crate::effects::Effect;
use crate::friction::{Dry, Friction, SHARP};
use crate::robots::Machine;
use nalgebra::{Matrix3, Vector3};
use std::collections::VecDeque;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Step of the simulation, s: 24 steps a sample of the log.
pub const STEP: f64 = 1.0 / 6000.0;

/// A motor that is joined to its link by a spring.
#[derive(Clone, Debug)]
pub struct Spring {
    pub stiffness: f64,
    pub damping: f64,
    /// Stiffness grows by this per square of the twist.
    pub cubic: f64,
    /// Half the dead zone.
    pub gap: f64,
    /// Kinematic error of the gear: amplitude and order per joint turn.
    pub error: (f64, f64, f64),
    /// Torque at which a belt slips.
    pub slip: f64,
    pub slipped: f64,
    pub angle: f64,
    pub rate: f64,
}

impl Spring {
    fn torque(&mut self, q: f64, v: f64, h: f64) -> f64 {
        let (a, k, phase) = self.error;
        let wave = self.angle * k + phase;
        let twist = self.angle + a * wave.sin() - q - self.slipped;
        let rate = self.rate * (1.0 + a * k * wave.cos()) - v;
        let mut t = if twist.abs() <= self.gap {
            0.0
        } else {
            let x = twist - self.gap * twist.signum();
            let t = self.stiffness * x * (1.0 + self.cubic * x * x) + self.damping * rate;
            // contact pushes and never pulls
            if self.gap > 0.0 && t * x < 0.0 { 0.0 } else { t }
        };
        if self.slip < f64::INFINITY {
            let excess = t.abs() - self.slip;
            if excess > 0.0 {
                let creep = excess / (self.stiffness * 0.02) * t.signum();
                self.slipped += h * creep;
                t = (self.slip + 0.3 * excess) * t.signum();
            }
            self.slipped -= h * self.slipped / 1.5;
        }
        t
    }
}

/// Inputs, laws and states of one joint.
pub struct Axis {
    pub armature: f64,
    pub friction: Friction,
    pub spring: Option<Spring>,
    /// Torque at the shaft over torque in the log.
    gain: f64,
    saturation: f64,
    cogging: Vec<(f64, f64, f64)>,
    /// Hose: level, centre, half range.
    hose: Option<(f64, f64, f64)>,
    /// Counterbalance: force, crank, distance, phase, growth.
    balance: Option<[f64; 5]>,
    eccentric: [f64; 4],
    shift: f64,
    log_lag: usize,
    drive_lag: usize,
    logged: VecDeque<f64>,
    driven: VecDeque<f64>,
    load: f64,
}

pub struct Plant {
    pub chain: Chain,
    /// Passive joints below the first driven one.
    pub first: usize,
    passive: Vec<(usize, f64, f64)>,
    pub axes: Vec<Axis>,
    coupling: Option<(usize, f64, f64, f64)>,
    crosstalk: Option<(usize, usize, f64)>,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    kinematics: Kinematics,
}

impl Plant {
    /// `machine` is the true one; its drives already hold what an effect changes in them.
    pub fn new(machine: &Machine, effects: &[Effect]) -> Self {
        let home: Vec<f64> = machine.drives.iter().map(|d| 0.5 * (d.range[0] + d.range[1])).collect();
        let inertia = machine.chain.own_inertia(&home);
        let axes = machine
            .drives
            .iter()
            .map(|d| Axis {
                armature: d.armature,
                friction: Friction::ordinary(d.viscous, d.coulomb, d.offset, d.velocity),
                spring: None,
                gain: 1.0,
                saturation: f64::INFINITY,
                cogging: Vec::new(),
                hose: None,
                balance: None,
                eccentric: [0.0; 4],
                shift: 0.0,
                log_lag: 0,
                drive_lag: 0,
                logged: VecDeque::new(),
                driven: VecDeque::new(),
                load: 0.0,
            })
            .collect();
        let mut plant = Self {
            chain: machine.chain.clone(),
            first: 0,
            passive: Vec::new(),
            axes,
            coupling: None,
            crosstalk: None,
            q: Vec::new(),
            v: Vec::new(),
            kinematics: Kinematics::default(),
        };
        for e in effects {
            plant.add(e, machine, &inertia);
        }
        plant
    }

    fn add(&mut self, e: &Effect, machine: &Machine, inertia: &[f64]) {
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
                let f = if side > 0.0 { 1.0 + 0.4 * s } else { 1.0 / (1.0 + 0.4 * s) };
                self.chain.joints[body].body = Body::from_parameters(&old.map(|p| p * f));
            }
            "gravity_direction" => {
                let turn = rpy(0.05 * s * (TAU * x[0]).cos(), 0.05 * s * (TAU * x[0]).sin(), 0.0);
                self.chain.gravity = turn * self.chain.gravity;
            }
            "friction_asymmetry" => {
                let f = &mut axis.friction;
                let (a, b) = (0.4 * s * side, 0.5 * s * side);
                f.coulomb = [f.coulomb[0] * (1.0 + a).max(0.05), f.coulomb[1] * (1.0 - a).max(0.05)];
                f.viscous = [f.viscous[0] * (1.0 + b).max(0.05), f.viscous[1] * (1.0 - b).max(0.05)];
            }
            "nonlinear_viscous_friction" if x[0] < 0.5 => {
                axis.friction.eyring = Some((0.03 * s * effort, speed * (0.04 + 0.1 * x[1])));
            }
            "nonlinear_viscous_friction" => {
                axis.friction.power = Some((0.15 * s * effort, 1.7 + 0.8 * x[1]));
            }
            "stribeck_friction" => {
                axis.friction.dry = Dry::Bristle {
                    rise: s,
                    velocity: speed * (0.015 + 0.05 * x[0]),
                    exponent: if x[1] < 0.5 { 1.0 } else { 2.0 },
                    deflection: 3e-5 * speed,
                    z: 0.0,
                };
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
                    Dry::Elements { deflection, z: [0.0; 6] }
                };
            }
            "load_dependent_friction" => {
                let p = if x[0] < 0.5 { 1.0 } else { 0.8 + 0.6 * x[1] };
                axis.friction.gear = Some([0.08 * s * effort, 0.5 * effort, p, 0.3 * x[2]]);
            }
            "position_dependent_friction" => {
                axis.friction.around =
                    Some([0.6 * s, TAU * x[0], 0.3 * s * x[2], TAU * x[1]]);
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
                let k = stiffness(55.0);
                let a = 0.01 * s * effort / k;
                axis.spring = Some(Spring { error: (a, 2.0 * drive.gear, TAU * x[1]), ..spring(k) });
            }
            "joint_elasticity" => {
                let k = stiffness(13.0 / s.sqrt());
                let wound = effort / k;
                let cubic = if x[0] < 0.5 { 0.0 } else { 0.5 / (wound * wound) };
                axis.spring = Some(Spring { cubic, ..spring(k) });
            }
            "backlash" => {
                axis.spring = Some(Spring { gap: 0.0025 * s, ..spring(stiffness(45.0)) });
            }
            "base_compliance" => self.tilt(s, machine),
            "torque_delay" => {
                let steps = (0.0025 * s / STEP).round() as usize;
                let all = x[0] < 0.5;
                for (i, axis) in self.axes.iter_mut().enumerate() {
                    if all || i == j {
                        *(if x[1] < 0.7 { &mut axis.log_lag } else { &mut axis.drive_lag }) = steps;
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
                axis.balance = Some([force, crank, (0.35 + 0.3 * x[1]) * machine.reach, phase, 1.5 * x[2]]);
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
                axis.eccentric = [a, TAU * x[0], if x[1] < 0.5 { 0.0 } else { 0.3 * a }, TAU * x[2]];
            }
            "slipping_belt" => {
                let slip = 0.25 * effort / s;
                axis.spring = Some(Spring { slip, ..spring(stiffness(40.0)) });
            }
            "sloshing_load" => {
                let last = machine.chain.joints[machine.dof() - 1].body.mass;
                let (m, l) = (s * last, 0.1 + 0.2 * x[0]);
                let mut body = Body::default();
                body.add(m, Vector3::new(l, 0.0, 0.0), Matrix3::identity() * (0.05 * m * l * l));
                let index = self.chain.len();
                self.chain.joints.push(Joint {
                    prismatic: false,
                    rotation: rpy(FRAC_PI_2 * (1.0 + x[1]), 0.3 * x[2], 0.0),
                    position: Vector3::new(0.0, 0.0, 0.1 * machine.reach),
                    body,
                });
                self.passive.push((index, 0.0, 0.3 * m * l * (9.81 * l).sqrt()));
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
        self.chain.joints[0].rotation = second_to_base(&ry) * self.chain.joints[0].rotation;
        self.chain.joints[0].position = second_to_base(&ry) * self.chain.joints[0].position;
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

    /// Puts every joint on the given position and velocity; what is passive rests.
    pub fn place(&mut self, q: &[f64], v: &[f64]) {
        self.q = vec![0.0; self.chain.len()];
        self.v = vec![0.0; self.chain.len()];
        for (j, axis) in self.axes.iter_mut().enumerate() {
            self.q[self.first + j] = q[j];
            self.v[self.first + j] = v[j];
            axis.logged.clear();
            axis.driven.clear();
            axis.load = 0.0;
            if let Some(s) = &mut axis.spring {
                (s.angle, s.rate, s.slipped) = (q[j], v[j], 0.0);
            }
        }
    }

    /// What the encoder of joint `j` shows, and its rate.
    pub fn encoder(&self, j: usize) -> (f64, f64) {
        let axis = &self.axes[j];
        let (q, v) = match &axis.spring {
            Some(s) => (s.angle, s.rate),
            None => (self.q[self.first + j], self.v[self.first + j]),
        };
        let [a, pa, b, pb] = axis.eccentric;
        let shown = q + axis.shift + a * (q + pa).sin() + b * (2.0 * q + pb).sin();
        (shown, v * (1.0 + a * (q + pa).cos() + 2.0 * b * (2.0 * q + pb).cos()))
    }

    /// Advances one step under commanded torques and returns what the log shows of them.
    pub fn step(&mut self, command: &[f64], outer: &Disturbance, t: f64, since: f64) -> Vec<f64> {
        let (n, total, h) = (self.axes.len(), self.chain.len(), STEP);
        self.chain.kinematics(&self.q, &self.v, &mut self.kinematics);
        let mut tau = vec![0.0; total];
        let mut arm = vec![0.0; total];
        let mut motor = vec![(0.0, 0.0); n];
        let mut log = vec![0.0; n];
        for (j, axis) in self.axes.iter_mut().enumerate() {
            log[j] = through(&mut axis.logged, axis.log_lag, command[j]);
            let u = through(&mut axis.driven, axis.drive_lag, command[j]);
            let i = self.first + j;
            let mut shaft = u * axis.gain;
            if axis.saturation < f64::INFINITY {
                shaft /= (1.0 + (shaft.abs() / axis.saturation).powi(3)).cbrt();
            }
            shaft += outer.torque(j, t);
            let (angle, rate) = match &axis.spring {
                Some(s) => (s.angle, s.rate),
                None => (self.q[i], self.v[i]),
            };
            for (a, order, phase) in &axis.cogging {
                shaft -= a * (order * angle + phase).sin();
            }
            let (f, df) = axis.friction.step(rate, angle, axis.load, outer.drag(j, t), h);
            let link = axis.link_torque(self.q[i]);
            motor[j] = (shaft - f, df);
            match &mut axis.spring {
                Some(s) => tau[i] = s.torque(self.q[i], self.v[i], h) + link,
                None => {
                    tau[i] = shaft - f + link;
                    arm[i] = axis.armature + h * df;
                }
            }
        }
        if let Some((j, dry, wet, sign)) = self.coupling {
            let i = self.first + j;
            let w = self.v[i] + sign * self.v[i + 1];
            let width = SHARP * self.axes[j].friction.speed * 2.0;
            let f = dry * (w / width).tanh() + wet * w;
            let df = dry * (1.0 - (w / width).tanh().powi(2)) / width + wet;
            tau[i] -= f;
            tau[i + 1] -= sign * f;
            arm[i] += 2.0 * h * df;
            arm[i + 1] += 2.0 * h * df;
        }
        for (i, k, d) in &self.passive {
            tau[*i] = -k * self.q[*i] - d * self.v[*i];
            arm[*i] = h * d + h * h * k;
        }
        let mut external = Vec::new();
        if let Some((body, point)) = &outer.at {
            let i = self.first + body;
            external.push((i, self.kinematics.point(i, point), outer.force(t, since)));
        }
        let mut a = vec![0.0; total];
        self.chain.forward(&self.kinematics, &self.v, &tau, &arm, &external, &mut a);
        for i in 0..total {
            self.v[i] += h * a[i];
            self.q[i] += h * self.v[i];
        }
        for (j, axis) in self.axes.iter_mut().enumerate() {
            let i = self.first + j;
            let (drive, df) = motor[j];
            match &mut axis.spring {
                Some(s) => {
                    axis.load = tau[i];
                    s.rate += h * (drive - tau[i]) / (axis.armature + h * df);
                    s.angle += h * s.rate;
                }
                None => axis.load = drive - axis.armature * a[i],
            }
        }
        if let Some((j, other, c)) = self.crosstalk {
            log[j] += c * log[other];
        }
        log
    }
}

impl Axis {
    /// Torque on the link from what hangs between it and its parent.
    fn link_torque(&self, q: f64) -> f64 {
        let mut t = 0.0;
        if let Some((level, centre, half)) = self.hose {
            let x = (q - centre) / half;
            t -= level * (1.6 * x).sinh() / 1.6f64.sinh();
        }
        if let Some([force, crank, distance, phase, growth]) = self.balance {
            let (s, c) = (q + phase).sin_cos();
            let length = (crank * crank + distance * distance - 2.0 * crank * distance * c).sqrt();
            let pull = force * (1.0 + growth * (length - distance) / distance);
            t -= pull * crank * distance * s / length;
        }
        t
    }
}

/// Rotation that undoes the axes of the second base joint.
fn second_to_base(ry: &Matrix3<f64>) -> Matrix3<f64> {
    ry.transpose()
}

/// A ring buffer: what went in `lag` steps ago.
fn through(buffer: &mut VecDeque<f64>, lag: usize, x: f64) -> f64 {
    if lag == 0 {
        return x;
    }
    buffer.push_back(x);
    if buffer.len() > lag {
        buffer.pop_front().unwrap_or(x)
    } else {
        buffer[0]
    }
}
