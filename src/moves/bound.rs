//! What a leg asks of the actuators and of the tool point between its samples: bounds for all time.
//!
//! On an interval `[a, b]`, `h` long, in which every jerk is constant, norm jets bound the derivatives of the smooth
//! torque `τ` and of the velocity `v` and acceleration of the tool point. So
//!
//! ```text
//! |τ| ≤ max(|τ_a|, |τ_b|) + (h²/8) sup |τ̈|        |τ̇| ≤ |τ_b − τ_a| / h + (h/2) sup |τ̈|
//! |v| ≤ max(|v_a|, |v_b|) + (h²/8) sup |v̈|        likewise the acceleration
//! ```
//!
//! The rate of the torque jumps where a jerk does; intervals end there, so both of its limits count.

use super::closed;
use super::leg::Leg;
use crate::dynamics::point::{Point, PointMotion};
use crate::error::Result;
use crate::mechanism::stretches::Reached;
use crate::plant::Plant;
use crate::regressor::term_factor;
use crate::robot::JointTerm;
use crate::trajectory::jets::{Jet, Norms, point_jet};

/// Intervals of a leg at first, at least.
const INTERVALS: f64 = 64.0;
/// Most samples.
const MOST: usize = 60_000;
/// What may be missing at the largest value, as a fraction of the limit.
const TARGET: f64 = 0.01;

/// What is exceeded at no time.
#[derive(Clone)]
pub struct Bounds {
    /// torque of every actuator, dry friction included
    pub torque: Vec<f64>,
    /// rate of the smooth torque of every actuator
    pub rate: Vec<f64>,
    /// speed and acceleration of the tool point
    pub tool: [f64; 2],
    /// of a closed chain
    pub closed: Option<Reached>,
}

impl Bounds {
    /// Of nothing that moves.
    pub fn none(actuators: usize) -> Self {
        Bounds {
            torque: vec![0.0; actuators],
            rate: vec![0.0; actuators],
            tool: [0.0; 2],
            closed: None,
        }
    }

    /// The larger of both, quantity by quantity.
    pub fn or(mut self, other: Bounds) -> Self {
        let larger = |a: &mut [f64], b: &[f64]| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a = a.max(*b));
        };
        larger(&mut self.torque, &other.torque);
        larger(&mut self.rate, &other.rate);
        larger(&mut self.tool, &other.tool);
        self.closed = match (self.closed, other.closed) {
            (Some(a), Some(b)) => Some(a.or(b)),
            (a, b) => a.or(b),
        };
        self
    }

    /// The same, begun so many seconds later.
    pub fn later(mut self, seconds: f64) -> Self {
        self.closed = self.closed.map(|c| c.later(seconds));
        self
    }

    fn all(self) -> Vec<f64> {
        [self.torque, self.rate, self.tool.to_vec()].concat()
    }
}

/// A time, the smooth torque there, and the speed and acceleration of the tool point.
#[derive(Clone)]
struct Sample {
    t: f64,
    torque: Vec<f64>,
    tool: [f64; 2],
}

/// Bounds of a leg. Of a closed chain: [`closed`](super::closed). Of a serial or tree robot, intervals are halved until the bounds
/// exceed neither a limit nor the largest value by more than 1 % of it, or until the samples are spent.
///
/// # Errors
/// Those of the torques.
pub fn bounds(plant: &Plant, leg: &Leg) -> Result<Bounds> {
    if let Some(mechanism) = plant.mechanism() {
        let found = closed::reached(mechanism, leg)?;
        return Ok(Bounds {
            torque: found.forces.iter().map(|f| f.bound()).collect(),
            closed: Some(found),
            ..Bounds::none(mechanism.actuators())
        });
    }
    let (robot, joints) = (plant.robot(), plant.actuators());
    let norms = Norms::new(robot);
    let tool = robot.tool.as_ref();
    let chain = tool.map(|t| (t.chain(robot), t.point.norm()));
    let mut limits: Vec<f64> = joints.iter().map(|j| j.limits.effort).collect();
    limits.extend(joints.iter().map(|j| j.limits.effort_rate));
    limits.extend(tool.map_or([f64::INFINITY; 2], |t| [t.speed, t.acceleration]));
    let n = joints.len();

    let over = |a: &Sample, b: &Sample| -> (Bounds, Bounds) {
        let h = b.t - a.t;
        let jets: Vec<Jet> = leg.profiles.iter().map(|p| p.jet(a.t, b.t)).collect();
        let curved = norms.torque_derivatives(&jets);
        let mut low = Bounds::none(n);
        let mut high = low.clone();
        for (j, joint) in joints.iter().enumerate() {
            let [from, to] = leg.profiles[j].velocities(a.t, b.t);
            let dry = joint.dry();
            let most = |x: f64| {
                let ahead = if to > 0.0 { (x + dry).abs() } else { 0.0 };
                let back = if from < 0.0 { (x - dry).abs() } else { 0.0 };
                x.abs().max(ahead).max(back)
            };
            let (x, y, bent) = (a.torque[j], b.torque[j], curved[j][0]);
            low.torque[j] = most(x).max(most(y));
            high.torque[j] = low.torque[j] + h * h / 8.0 * bent;
            low.rate[j] = (y - x).abs() / h;
            high.rate[j] = low.rate[j] + 0.5 * h * bent;
        }
        if let Some((chain, reach)) = &chain {
            let jet = point_jet(robot, chain, *reach, &jets);
            for k in 0..2 {
                low.tool[k] = a.tool[k].max(b.tool[k]);
                high.tool[k] = low.tool[k] + h * h / 8.0 * jet[3 + k];
            }
        }
        (low, high)
    };

    let even = (0..=INTERVALS as usize).map(|k| leg.duration * k as f64 / INTERVALS);
    let times = leg.instants(even.collect());
    let first = sample(plant, leg, &times)?;
    let mut taken = first.len();
    let mut open: Vec<[Sample; 2]> = first
        .windows(2)
        .map(|w| [w[0].clone(), w[1].clone()])
        .collect();
    let mut best = vec![0.0_f64; 2 * n + 2];
    let mut settled = Bounds::none(n);
    while !open.is_empty() {
        let each: Vec<(Bounds, Bounds)> = open.iter().map(|[a, b]| over(a, b)).collect();
        for (low, _) in &each {
            for (best, own) in best.iter_mut().zip(low.clone().all()) {
                *best = best.max(own);
            }
        }
        let mut halved = Vec::new();
        for (pair, (_, high)) in open.drain(..).zip(each) {
            let all = high.clone().all();
            let loose = all
                .iter()
                .zip(&best)
                .zip(&limits)
                .any(|((high, best), limit)| {
                    limit.is_finite()
                        && (*high > best + TARGET * limit || (high > limit && best <= limit))
                });
            let wide = pair[1].t - pair[0].t > 1e-7 * leg.duration;
            match loose && wide && taken + halved.len() < MOST {
                true => halved.push(pair),
                false => settled = settled.or(high),
            }
        }
        let middles: Vec<f64> = halved.iter().map(|[a, b]| 0.5 * (a.t + b.t)).collect();
        taken += middles.len();
        for ([a, b], middle) in halved.into_iter().zip(sample(plant, leg, &middles)?) {
            open.push([a, middle.clone()]);
            open.push([middle, b]);
        }
    }
    Ok(settled)
}

fn sample(plant: &Plant, leg: &Leg, times: &[f64]) -> Result<Vec<Sample>> {
    if times.is_empty() {
        return Ok(Vec::new());
    }
    let count = times.len();
    let x = leg.samples(times);
    let tau = plant.nominal_torque(&x)?;
    let robot = plant.robot();
    let point = robot.tool.as_ref().map(|tool| Point::of(robot, tool));
    let mut at = PointMotion::default();
    let each = times.iter().enumerate().map(|(s, t)| {
        let torque = plant.actuators().into_iter().enumerate().map(|(a, joint)| {
            let state = x.at(a, s);
            let jump =
                joint.terms[JointTerm::Coulomb as usize] * term_factor(JointTerm::Coulomb, state);
            tau[a * count + s] - jump - joint.stribeck.torque(state[1])
        });
        let of = |k: usize| -> Vec<f64> { (0..x.dof).map(|j| x.at(j, s)[k]).collect() };
        let tool = point.as_ref().map_or([0.0; 2], |point| {
            point.at(&of(0), &of(1), &of(2), &mut at);
            [at.velocity.norm(), at.acceleration.norm()]
        });
        Sample {
            t: *t,
            torque: torque.collect(),
            tool,
        }
    });
    Ok(each.collect())
}
