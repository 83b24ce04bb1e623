//! Rehearsal: the robot simulated under a tracking controller, so that the whole experiment can be
//! run before the robot is touched.
//!
//! ```text
//! M(x) ẍ + b(x, ẋ) + Dᵀ f(q̇) = D_aᵀ τ(t, x, ẋ)
//! ```
//!
//! ([`dynamics`]) with the controller of [`control`], friction that sticks and slides ([`friction`])
//! and the deviations from the nominal model that the user asks for ([`effects`]). The classic
//! Runge-Kutta method of fourth order runs with a fixed largest step; where a joint's velocity
//! passes zero the step is cut there, to rounding, so that friction never changes inside a step.
//! The controller is continuous in time: torque and acceleration of a log belong to the same
//! instant. [`record`] then measures the motion: encoder steps, torque noise, a log file.
//!
//! ```
//! use excite::plant::Plant;
//! use excite::simulate::{Settings, simulate};
//! use excite::trajectory::{Fourier, Series};
//!
//! let plant = Plant::load("planar2")?;
//! let series = |a: f64| Series { constant: 0.0, sin: vec![a], cos: vec![0.1] };
//! let motion = Fourier::new(2.0, vec![1], vec![series(0.5), series(-0.4)])?;
//! let settings = Settings { rate: 200.0, ..Settings::default() };
//! let run = simulate(&plant, &motion, 1, &settings, &|_| {})?;
//! assert_eq!(run.motion.count, 400);
//! # Ok::<(), excite::Error>(())
//! ```

pub mod control;
pub mod dynamics;
pub mod effects;
pub mod friction;
pub mod monte_carlo;
pub mod record;

pub use control::Controller;
pub use dynamics::{Dynamics, Terms};
pub use effects::{Effects, Field};

use crate::dynamics::Samples;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::plant::Plant;
use crate::trajectory::Fourier;
use control::Tracker;
use friction::{Friction, Mode, hold};
use nalgebra::{DMatrix, DVector};
use std::collections::VecDeque;

/// Most numbers of a simulated log in memory (1.6 GB).
const NUMBERS: f64 = 2e8;
/// Most steps of the integrator.
const STEPS: f64 = 1e9;
/// Most steps of one period, for which the controller keeps a table.
const TABLE: f64 = 2e6;

/// Times that friction may change its mode within one step before the step is taken as it is.
const EVENTS: usize = 60;

/// How to simulate.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Settings {
    /// samples a second of the log, Hz
    pub rate: f64,
    /// largest step of the integrator, s
    pub step: f64,
    /// periods run before the log begins
    pub lead_in: u32,
    /// controller
    pub controller: Controller,
    /// natural frequency of the tracking error, Hz
    pub bandwidth: f64,
    /// damping ratio of the tracking error
    pub damping: f64,
    /// what the robot does that its model does not
    pub effects: Effects,
    /// of everything random
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            rate: 1000.0,
            step: 2.5e-4,
            lead_in: 1,
            controller: Controller::Feedforward,
            bandwidth: 10.0,
            damping: 1.0,
            effects: Effects::default(),
            seed: 0,
        }
    }
}

impl Settings {
    fn check(&self) -> Result<()> {
        let positive = [
            ("rate", self.rate),
            ("step", self.step),
            ("bandwidth", self.bandwidth),
            ("damping", self.damping),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::Argument(format!(
                    "--{name} must be a positive number, not {value}"
                )));
            }
        }
        if std::f64::consts::TAU * self.bandwidth * self.damping * self.step > 0.5 {
            return Err(Error::Argument(format!(
                "a bandwidth of {} Hz needs a smaller --step than {} s",
                self.bandwidth, self.step
            )));
        }
        if !(0.0..1.0).contains(&self.effects.perturb) {
            return Err(Error::Argument(format!(
                "--perturb is a fraction from 0 to below 1, not {}",
                self.effects.perturb
            )));
        }
        if !(self.effects.torque_delay >= 0.0 && self.effects.torque_delay < 1.0) {
            return Err(Error::Argument(format!(
                "--torque-delay must be from 0 to below 1 s, not {}",
                self.effects.torque_delay
            )));
        }
        Ok(())
    }
}

/// What really happened: the simulated motion without any sensor.
#[derive(Debug, Clone)]
pub struct Run {
    /// times, s, from 0
    pub t: Vec<f64>,
    /// motion of the coordinates (of the platform, for parallel robots)
    pub motion: Samples,
    /// motion of the actuators
    pub actuators: Samples,
    /// torque that the drives applied, actuator-major, N m or N
    pub tau: Vec<f64>,
    /// the same as the sensor sees it: delayed where the effects say so
    pub tau_seen: Vec<f64>,
    /// commanded positions of the actuators, actuator-major
    pub reference: Vec<f64>,
    /// what went not quite as planned
    pub warnings: Vec<Warning>,
}

/// Everything about one instant.
struct Instant {
    x: DVector<f64>,
    xd: DVector<f64>,
    xdd: DVector<f64>,
    /// velocities of the tree's joints
    qd: DVector<f64>,
    /// accelerations of the actuators' and all other joints
    qdd: DVector<f64>,
    q: DVector<f64>,
    tau: DVector<f64>,
    cut: bool,
    /// direction in which a sticking joint has broken away
    broken: Vec<(usize, bool)>,
}

struct Simulator<'a> {
    dynamics: Dynamics<'a>,
    tracker: Tracker<'a>,
    friction: Vec<Friction>,
    modes: Vec<Mode>,
    /// actuator of each joint of the tree
    actuator: Vec<Option<usize>>,
    history: VecDeque<(f64, DVector<f64>)>,
    delay: f64,
    unsettled: usize,
}

impl Simulator<'_> {
    fn evaluate(&mut self, t: f64, x: &DVector<f64>, xd: &DVector<f64>) -> Result<Instant> {
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
    fn advance(&mut self, t: f64, mut now: Instant, h: f64) -> Result<Instant> {
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
    fn remember(&mut self, t: f64, tau: &DVector<f64>) {
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
    fn delayed(&self, t: f64, now: &DVector<f64>) -> DVector<f64> {
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

/// A velocity that counts as zero, rad/s or m/s.
const TINY: f64 = 1e-11;

/// Runs `periods` periods of a reference in the coordinates of the plant. `progress` is called with
/// the fraction done.
///
/// # Errors
/// [`Error::Argument`]: settings that cannot be. [`Error::Infeasible`]: a pose that cannot be
/// reached, a mass matrix that is not positive definite, a robot that does not follow.
pub fn simulate(
    plant: &Plant,
    fourier: &Fourier,
    periods: u32,
    settings: &Settings,
    progress: &dyn Fn(f64),
) -> Result<Run> {
    settings.check()?;
    if fourier.dof() != plant.coordinates() {
        return Err(Error::Argument(format!(
            "the trajectory moves {} coordinates, {} has {}: {}",
            fourier.dof(),
            plant.name(),
            plant.coordinates(),
            plant.coordinate_names().join(", ")
        )));
    }
    let samples = (fourier.period * f64::from(periods) * settings.rate).round();
    let (m, na) = (plant.coordinates(), plant.actuated().len());
    let most = (NUMBERS / (1 + 3 * m + 6 * na) as f64).floor();
    if !(1.0..=most).contains(&samples) {
        return Err(Error::Argument(format!(
            "{periods} periods of {} s at {} Hz are {samples} samples; from 1 to {most} can be simulated: choose \
             another --rate or fewer --periods",
            fourier.period, settings.rate
        )));
    }
    let duration = fourier.period * (f64::from(periods) + f64::from(settings.lead_in));
    if duration / settings.step > STEPS || fourier.period / settings.step > TABLE {
        return Err(Error::Argument(format!(
            "{} periods before the log and {periods} in it, {duration} s, are too many steps of {} s: \
             {STEPS:e} in all and {TABLE:e} a period are possible; choose a larger --step or fewer periods",
            settings.lead_in, settings.step
        )));
    }
    let effects = &settings.effects;
    let terms = effects.terms(plant, settings.seed);
    let actuated = plant.actuated();
    let actuator: Vec<Option<usize>> = (0..terms.len())
        .map(|j| actuated.iter().position(|&a| a == j))
        .collect();
    let friction: Vec<Friction> = terms
        .iter()
        .zip(&actuator)
        .map(|(t, a)| Friction {
            viscous: t[1],
            coulomb: t[2],
            offset: t[3],
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
    let mut simulator = Simulator {
        dynamics,
        tracker,
        modes: vec![Mode::Smooth; friction.len()],
        friction,
        actuator,
        history: VecDeque::new(),
        delay: effects.torque_delay,
        unsettled: 0,
    };

    let mut x = DVector::zeros(m);
    let mut xd = DVector::zeros(m);
    fourier.evaluate(0.0, [x.as_mut_slice(), xd.as_mut_slice()]);
    let qd = simulator.dynamics.terms(&x, &xd)?.qd;
    for (j, f) in simulator.friction.iter().enumerate() {
        if f.is_dry() {
            simulator.modes[j] = match qd[j] {
                v if v.abs() <= 1e-9 => Mode::Sticks,
                v => Mode::Slides(v > 0.0),
            };
        }
    }
    let count = samples as usize;
    // the log starts after whole periods; its grid is the log's
    let start = fourier.period * f64::from(settings.lead_in);
    let dt = 1.0 / settings.rate;
    let mut run = Run {
        t: (0..count).map(|k| k as f64 * dt).collect(),
        motion: Samples::zeros(m, count),
        actuators: Samples::zeros(na, count),
        tau: vec![0.0; na * count],
        tau_seen: vec![0.0; na * count],
        reference: vec![0.0; na * count],
        warnings: Vec::new(),
    };
    let mut now = simulator.evaluate(0.0, &x, &xd)?;
    let mut t = 0.0;
    let mut saturated = 0usize;
    let mut steps = 0usize;
    let lost = 1e3 * plant_size(fourier);
    for k in 0..count {
        let goal = start + k as f64 * dt;
        let pieces = ((goal - t) / settings.step - 1e-9).ceil().max(0.0) as usize;
        let from = t;
        for i in 0..pieces {
            simulator.remember(t, &now.tau);
            let until = match i + 1 == pieces {
                true => goal,
                false => from + (goal - from) * (i + 1) as f64 / pieces as f64,
            };
            now = simulator.advance(t, now, until - t)?;
            t = until;
            steps += 1;
            saturated += usize::from(now.cut);
            if !now.x.iter().all(|v| v.abs() < lost) {
                return Err(Error::Infeasible(format!(
                    "the simulated robot does not follow its reference (t = {t:.3} s): its effort \
                     limits may be too low for the load; or lower --bandwidth, or --step"
                )));
            }
        }
        // what breaks away at this very instant does so in the next step
        for c in 0..m {
            run.motion.q[c * count + k] = now.x[c];
            run.motion.qd[c * count + k] = now.xd[c];
            run.motion.qdd[c * count + k] = now.xdd[c];
        }
        simulator.remember(t, &now.tau);
        let seen = simulator.delayed(t, &now.tau);
        for (a, &j) in actuated.iter().enumerate() {
            run.actuators.q[a * count + k] = now.q[j];
            run.actuators.qd[a * count + k] = now.qd[j];
            run.actuators.qdd[a * count + k] = now.qdd[j];
            run.tau[a * count + k] = now.tau[a];
            run.tau_seen[a * count + k] = seen[a];
        }
        if k % 256 == 0 {
            progress((goal / (start + count as f64 * dt)).clamp(0.0, 1.0));
        }
    }
    run.reference = reference(plant, fourier, start, &run.t)?;
    if saturated > 0 {
        run.warnings.push(Warning::new(
            WarningKind::TorqueSaturated,
            plant.name(),
            format!(
                "an effort limit cut the torque in {:.2} % of the steps",
                100.0 * saturated as f64 / steps.max(1) as f64
            ),
        ));
    }
    if simulator.unsettled > 0 {
        run.warnings.push(Warning::new(
            WarningKind::FrictionChattered,
            plant.name(),
            format!(
                "friction chattered in {} of {steps} steps; a smaller --step resolves it",
                simulator.unsettled
            ),
        ));
    }
    Ok(run)
}

/// Largest coordinate of a reference, at least 1: a bound for a robot that got lost.
fn plant_size(fourier: &Fourier) -> f64 {
    fourier
        .joints
        .iter()
        .map(|s| s.constant.abs() + s.amplitude_sum(&fourier.harmonics, fourier.omega(), 0))
        .fold(1.0, f64::max)
}

/// Commanded positions of the actuators.
fn reference(plant: &Plant, fourier: &Fourier, start: f64, t: &[f64]) -> Result<Vec<f64>> {
    let (m, count) = (fourier.dof(), t.len());
    let mut motion = Samples::zeros(m, count);
    let mut x = vec![0.0; m];
    for (k, &t) in t.iter().enumerate() {
        fourier.evaluate(start + t, [&mut x]);
        for (c, v) in x.iter().enumerate() {
            motion.q[c * count + k] = *v;
        }
    }
    Ok(plant.actuator_motion(&motion)?.q)
}
