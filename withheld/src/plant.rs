//! The machine with its effects, stepped through time.

use crate::chain::{Chain, Kinematics};
use crate::disturb::Disturbance;
use crate::effects::Effect;
use crate::friction::{Friction, SHARP};
use crate::robots::Machine;
use std::collections::VecDeque;

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
            if self.gap > 0.0 && t * x < 0.0 {
                0.0
            } else {
                t
            }
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
    pub gain: f64,
    pub saturation: f64,
    pub cogging: Vec<(f64, f64, f64)>,
    /// Hose: level, centre, half range.
    pub hose: Option<(f64, f64, f64)>,
    /// Counterbalance: force, crank, distance, phase, growth.
    pub balance: Option<[f64; 5]>,
    pub eccentric: [f64; 4],
    pub shift: f64,
    pub log_lag: usize,
    pub drive_lag: usize,
    logged: VecDeque<f64>,
    driven: VecDeque<f64>,
    load: f64,
}

pub struct Plant {
    pub chain: Chain,
    /// Passive joints below the first driven one.
    pub first: usize,
    pub passive: Vec<(usize, f64, f64)>,
    pub axes: Vec<Axis>,
    pub coupling: Option<(usize, f64, f64, f64)>,
    pub crosstalk: Option<(usize, usize, f64)>,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    kinematics: Kinematics,
}

impl Plant {
    /// `machine` is the true one; its drives already hold what an effect changes in them.
    pub fn new(machine: &Machine, effects: &[Effect]) -> Self {
        let home: Vec<f64> = machine
            .drives
            .iter()
            .map(|d| 0.5 * (d.range[0] + d.range[1]))
            .collect();
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
            plant.attach(e, machine, &inertia);
        }
        plant
    }

    /// Puts every joint on the given position and velocity; what is passive rests.
    pub fn place(&mut self, q: &[f64], v: &[f64]) {
        self.q = vec![0.0; self.chain.dof()];
        self.v = vec![0.0; self.chain.dof()];
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
        (
            shown,
            v * (1.0 + a * (q + pa).cos() + 2.0 * b * (2.0 * q + pb).cos()),
        )
    }

    /// Advances one step under commanded torques and returns what the log shows of them.
    pub fn step(&mut self, command: &[f64], outer: &Disturbance, t: f64, since: f64) -> Vec<f64> {
        let (n, total, h) = (self.axes.len(), self.chain.dof(), STEP);
        self.chain
            .kinematics(&self.q, &self.v, &mut self.kinematics);
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
            let (f, df) = axis
                .friction
                .step(rate, angle, axis.load, outer.drag(j, t), h);
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
        self.chain
            .forward(&self.kinematics, &self.v, &tau, &arm, &external, &mut a);
        for ((q, v), a) in self.q.iter_mut().zip(&mut self.v).zip(&a) {
            *v += h * a;
            *q += h * *v;
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
