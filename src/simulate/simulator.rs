//! One step of the simulated robot: Runge-Kutta of fourth order, cut where friction changes.

use super::control::Tracker;
use super::dynamics::Dynamics;
use super::friction::{Friction, Mode, hold};
use super::settings::Settings;
use crate::error::{Error, Result};
use crate::plant::Plant;
use crate::trajectory::Fourier;
use nalgebra::{DMatrix, DVector};
use std::collections::VecDeque;

/// Times that friction may change its mode within one step before the step is taken as it is.
const EVENTS: usize = 60;

/// A velocity that counts as zero, rad/s or m/s.
const TINY: f64 = 1e-11;

/// Velocity below which a joint begins at rest, rad/s or m/s.
const STILL: f64 = 1e-9;

/// Everything about one instant.
pub(super) struct Instant {
    pub x: DVector<f64>,
    pub xd: DVector<f64>,
    pub xdd: DVector<f64>,
    /// velocities of the tree's joints
    pub qd: DVector<f64>,
    /// accelerations of the actuators' and all other joints
    pub qdd: DVector<f64>,
    pub q: DVector<f64>,
    pub tau: DVector<f64>,
    pub cut: bool,
    /// direction in which a sticking joint has broken away
    broken: Vec<(usize, bool)>,
}

/// Dynamics, controller and friction with their state.
pub(super) struct Simulator<'a> {
    dynamics: Dynamics<'a>,
    tracker: Tracker<'a>,
    friction: Vec<Friction>,
    modes: Vec<Mode>,
    /// actuator of each joint of the tree
    actuator: Vec<Option<usize>>,
    history: VecDeque<(f64, DVector<f64>)>,
    delay: f64,
    /// steps in which friction chattered
    pub unsettled: usize,
}

impl<'a> Simulator<'a> {
    /// The robot with its deviations, under the controller, before the first sample.
    ///
    /// # Errors
    /// A controller that this robot cannot have.
    pub fn new(plant: &'a Plant, fourier: &'a Fourier, settings: &Settings) -> Result<Self> {
        let effects = &settings.effects;
        let terms = effects.terms(plant, settings.seed);
        let actuated = plant.actuated();
        let actuator: Vec<Option<usize>> = (0..terms.len())
            .map(|j| actuated.iter().position(|&a| a == j))
            .collect();
        let friction: Vec<Friction> = terms
            .iter()
            .zip(&actuator)
            .zip(&plant.robot().joints)
            .map(|((t, a), joint)| Friction {
                viscous: t[1],
                coulomb: t[2],
                offset: t[3],
                stribeck: joint.stribeck,
                effect: a.map_or_else(Default::default, |a| effects.joint(a)),
            })
            .collect();
        let dynamics = Dynamics::new(
            plant,
            effects.inertia(plant, settings.seed),
            terms.iter().map(|t| t[0]).collect(),
            effects.gravity(plant),
        );
        let tracker = Tracker::new(
            plant,
            fourier,
            settings.controller,
            settings.bandwidth,
            settings.damping,
            settings.step,
        )?;
        Ok(Simulator {
            dynamics,
            tracker,
            modes: vec![Mode::Smooth; friction.len()],
            friction,
            actuator,
            history: VecDeque::new(),
            delay: effects.torque_delay,
            unsettled: 0,
        })
    }

    /// The first instant: on the reference, joints that do not move sticking.
    ///
    /// # Errors
    /// A pose that cannot be reached, a mass matrix that is not positive definite.
    pub fn begin(&mut self, fourier: &Fourier) -> Result<Instant> {
        let mut x = DVector::zeros(fourier.dof());
        let mut xd = DVector::zeros(fourier.dof());
        fourier.evaluate(0.0, [x.as_mut_slice(), xd.as_mut_slice()]);
        let qd = self.dynamics.terms(&x, &xd)?.qd;
        for (j, f) in self.friction.iter().enumerate() {
            if f.is_dry() {
                self.modes[j] = match qd[j] {
                    v if v.abs() <= STILL => Mode::Sticks,
                    v => Mode::Slides(v > 0.0),
                };
            }
        }
        self.evaluate(0.0, &x, &xd)
    }
}

impl Simulator<'_> {
    /// Accelerations and torques of a state.
    pub fn evaluate(&mut self, t: f64, x: &DVector<f64>, xd: &DVector<f64>) -> Result<Instant> {
        let terms = self.dynamics.terms(x, xd)?;
        let (tau, cut) = self.tracker.torque(t, x, xd);
        let driven = terms.d_a.tr_mul(&tau);
        let mut force = driven - &terms.bias;
        let mut sticking = Vec::new();
        let loads: Vec<f64> = (0..self.friction.len())
            .map(|j| self.actuator[j].map_or(0.0, |a| tau[a]))
            .collect();
        for (j, f) in self.friction.iter().enumerate() {
            let v = terms.qd[j];
            let mut opposed = f.smooth(v);
            match self.modes[j] {
                Mode::Slides(true) => opposed += f.dry(true, v, loads[j]),
                Mode::Slides(false) => opposed -= f.dry(false, v, loads[j]),
                Mode::Sticks => sticking.push(j),
                Mode::Smooth => {}
            }
            if opposed != 0.0 {
                force -= terms.d.row(j).transpose() * opposed;
            }
        }
        let Some(mass) = terms.mass.clone().cholesky() else {
            return Err(Error::Infeasible(
                "the mass matrix of the simulated robot is not positive definite: a joint moves no \
                 mass (give its link an inertia, or the joint an armature), or the pose is singular"
                    .into(),
            ));
        };
        let mut xdd = mass.solve(&force);
        let mut broken = Vec::new();
        if !sticking.is_empty() {
            let rows = DMatrix::from_fn(sticking.len(), x.len(), |i, k| terms.d[(sticking[i], k)]);
            let moved = mass.solve(&rows.transpose());
            let a = &rows * &moved;
            let b = DVector::from_fn(sticking.len(), |i, _| {
                rows.row(i).transpose().dot(&xdd) + terms.qdd_bias[sticking[i]]
            });
            let bound = |positive: bool| -> Vec<f64> {
                let one = |&j: &usize| self.friction[j].dry(positive, 0.0, loads[j]);
                sticking.iter().map(one).collect()
            };
            let (high, low) = (bound(true), bound(false));
            let low: Vec<f64> = low.iter().map(|f| -f).collect();
            let f = hold(&a, &b, &low, &high);
            xdd -= &moved * &f;
            let rest = &b - &a * &f;
            let scale = 1e-9 * (1.0 + b.amax());
            for (i, &j) in sticking.iter().enumerate() {
                if f[i] >= high[i] && rest[i] > scale {
                    broken.push((j, true));
                } else if f[i] <= low[i] && rest[i] < -scale {
                    broken.push((j, false));
                }
            }
        }
        let qdd = &terms.d * &xdd + &terms.qdd_bias;
        Ok(Instant {
            x: x.clone(),
            xd: xd.clone(),
            xdd,
            qd: terms.qd,
            qdd,
            q: terms.q,
            tau,
            cut,
            broken,
        })
    }

    /// One step of the classic Runge-Kutta method from an instant that is known.
    fn runge_kutta(&mut self, t: f64, now: &Instant, h: f64) -> Result<Instant> {
        let (x, v) = (&now.x, &now.xd);
        let a1 = &now.xdd;
        let v2 = v + a1 * (0.5 * h);
        let a2 = self.evaluate(t + 0.5 * h, &(x + v * (0.5 * h)), &v2)?.xdd;
        let v3 = v + &a2 * (0.5 * h);
        let a3 = self.evaluate(t + 0.5 * h, &(x + &v2 * (0.5 * h)), &v3)?.xdd;
        let v4 = v + &a3 * h;
        let a4 = self.evaluate(t + h, &(x + &v3 * h), &v4)?.xdd;
        let x1 = x + (v + (&v2 + &v3) * 2.0 + &v4) * (h / 6.0);
        let v1 = v + (a1 + (&a2 + &a3) * 2.0 + &a4) * (h / 6.0);
        self.evaluate(t + h, &x1, &v1)
    }

    /// The sliding joint whose velocity changes its sign first, and where in the step it does so.
    fn crossing(&self, now: &Instant, next: &Instant) -> Option<(usize, f64)> {
        let mut first: Option<(usize, f64)> = None;
        for (j, mode) in self.modes.iter().enumerate() {
            let Mode::Slides(positive) = *mode else {
                continue;
            };
            let s = if positive { 1.0 } else { -1.0 };
            let (v0, v1) = (s * now.qd[j], s * next.qd[j]);
            if v1 < 0.0 {
                let at = if v0 > TINY { v0 / (v0 - v1) } else { 0.0 };
                if first.is_none_or(|(_, other)| at < other) {
                    first = Some((j, at));
                }
            }
        }
        first
    }

    /// Advances by `h`, cut where friction changes.
    pub fn advance(&mut self, t: f64, mut now: Instant, h: f64) -> Result<Instant> {
        let (mut t, mut left) = (t, h);
        for _ in 0..EVENTS {
            for &(j, positive) in &now.broken {
                self.modes[j] = Mode::Slides(positive);
            }
            now.broken.clear();
            let next = self.runge_kutta(t, &now, left)?;
            let Some((j, guess)) = self.crossing(&now, &next) else {
                if next.broken.is_empty() {
                    return Ok(next);
                }
                // what has broken away slides from here on, in the log as well
                for &(j, positive) in &next.broken {
                    self.modes[j] = Mode::Slides(positive);
                }
                return self.evaluate(t + left, &next.x, &next.xd);
            };
            let mut part = 0.0;
            if guess > 0.0 {
                let s = if self.modes[j] == Mode::Slides(true) {
                    1.0
                } else {
                    -1.0
                };
                // Illinois variant of the false position
                let (mut a, mut fa, mut b, mut fb) = (0.0, s * now.qd[j], 1.0, s * next.qd[j]);
                let mut at = next;
                for _ in 0..12 {
                    part = (a * fb - b * fa) / (fb - fa);
                    at = self.runge_kutta(t, &now, part * left)?;
                    let f = s * at.qd[j];
                    if f.abs() < TINY {
                        break;
                    }
                    if f > 0.0 {
                        (a, fa) = (part, f);
                        fb *= 0.5;
                    } else {
                        (b, fb) = (part, f);
                        fa *= 0.5;
                    }
                }
                now = at;
                t += part * left;
                left *= 1.0 - part;
            }
            self.modes[j] = Mode::Sticks;
            now = self.evaluate(t, &now.x.clone(), &now.xd.clone())?;
            if left <= 1e-12 * h {
                return Ok(now);
            }
        }
        // chatter: the rest of the step with the directions that the velocities have
        self.unsettled += 1;
        for (j, mode) in self.modes.iter_mut().enumerate() {
            if let Mode::Slides(_) = mode {
                *mode = Mode::Slides(now.qd[j] >= 0.0);
            }
        }
        let next = self.runge_kutta(t, &now, left)?;
        for (j, mode) in self.modes.iter_mut().enumerate() {
            if let Mode::Slides(_) = mode {
                *mode = Mode::Slides(next.qd[j] >= 0.0);
            }
        }
        Ok(next)
    }

    /// Remembers the torque for the delayed sensor.
    pub fn remember(&mut self, t: f64, tau: &DVector<f64>) {
        if self.history.back().is_some_and(|(last, _)| *last >= t) {
            self.history.pop_back();
        }
        if self.delay > 0.0 {
            self.history.push_back((t, tau.clone()));
            while self.history.len() > 2 && self.history[1].0 <= t - self.delay {
                self.history.pop_front();
            }
        }
    }

    /// Torque as it was `delay` ago.
    pub fn delayed(&self, t: f64, now: &DVector<f64>) -> DVector<f64> {
        let at = t - self.delay;
        match (self.history.front(), self.history.get(1)) {
            (Some((t0, a)), Some((t1, b))) if self.delay > 0.0 && t1 > t0 => {
                let f = ((at - t0) / (t1 - t0)).clamp(0.0, 1.0);
                a * (1.0 - f) + b * f
            }
            (Some((_, a)), None) if self.delay > 0.0 => a.clone(),
            _ => now.clone(),
        }
    }
}
