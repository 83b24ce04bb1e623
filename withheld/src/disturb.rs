//! Disturbances that are no function of the state: drawn once per record.

use crate::effects::Effect;
use crate::random::Random;
use crate::robots::Machine;
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};

/// What acts from outside during one record.
#[derive(Default)]
pub struct Disturbance {
    /// Force pulses on a body: start, length, force in base axes.
    pulses: Vec<(f64, f64, Vector3<f64>)>,
    /// Body and point of application in its axes.
    pub at: Option<(usize, Vector3<f64>)>,
    /// Torque pulses of a joint.
    knocks: Vec<(f64, f64, f64)>,
    /// Slow force, sampled at 10 Hz.
    drift: Vec<Vector3<f64>>,
    /// Amplitude, frequency, phase.
    tone: Option<(f64, f64, f64)>,
    /// Intervals in which a brake drags.
    brake: Vec<(f64, f64)>,
    drag: f64,
    joint: usize,
}

impl Disturbance {
    /// `from` and `to` bound the time of the record.
    pub fn new(
        effects: &[Effect],
        machine: &Machine,
        from: f64,
        to: f64,
        rng: &mut Random,
    ) -> Self {
        let mut d = Self {
            drag: 1.0,
            ..Self::default()
        };
        let n = machine.dof();
        for e in effects {
            let drive = &machine.drives[e.joint];
            let s = e.strength;
            let newton = s * 0.12 * machine.drives[1.min(n - 1)].effort / (0.7 * machine.reach);
            let tool = (n - 1, Vector3::new(0.0, 0.0, 0.08 * machine.reach));
            let direction = |rng: &mut Random| {
                Vector3::new(rng.normal(), rng.normal(), rng.normal()).normalize()
            };
            match e.name {
                "contact_bursts" => {
                    let body = if e.shape[0] < 0.5 {
                        n - 1
                    } else {
                        n.min(4) - 1
                    };
                    d.at = Some((body, tool.1));
                    let mut t = from;
                    while t < to {
                        t -= rng.range(1e-6, 1.0).ln() / 0.5;
                        let force = direction(rng) * (newton * rng.range(0.4, 1.0));
                        d.pulses.push((t, rng.range(0.12, 0.6), force));
                    }
                }
                "impulses" => {
                    d.joint = e.joint;
                    let mut t = from;
                    while t < to {
                        t -= rng.range(1e-6, 1.0).ln();
                        let size = s * 0.15 * drive.effort * rng.range(-1.0, 1.0);
                        d.knocks.push((t, rng.range(0.02, 0.06), size));
                    }
                }
                "drifting_tool_force" => {
                    d.at = Some(tool);
                    let mut f = Vector3::zeros();
                    let count = ((to - from) * 10.0) as usize + 3;
                    for _ in 0..count {
                        let kick = Vector3::new(rng.normal(), rng.normal(), rng.normal());
                        f = f * 0.93 + kick * (0.25 * newton);
                        d.drift.push(f);
                    }
                }
                "unlogged_oscillation" => {
                    d.joint = e.joint;
                    let f = 2.3 + 5.0 * e.shape[1];
                    d.tone = Some((0.02 * s * drive.effort, f, rng.range(0.0, TAU)));
                }
                "dragging_brake" => {
                    d.joint = e.joint;
                    d.drag = 1.0 + s;
                    let mut t = from;
                    while t < to {
                        t += rng.range(1.0, 4.0);
                        let end = t + rng.range(0.5, 2.5);
                        d.brake.push((t, end));
                        t = end;
                    }
                }
                _ => {}
            }
        }
        d
    }

    /// Force on the body of `at`, `since` seconds after the start of the record's simulation.
    pub fn force(&self, t: f64, since: f64) -> Vector3<f64> {
        let mut f = Vector3::zeros();
        for (start, length, force) in &self.pulses {
            let x = (t - start) / length;
            if (0.0..1.0).contains(&x) {
                f += force * (PI * x).sin();
            }
        }
        if !self.drift.is_empty() {
            let x = (since * 10.0).max(0.0);
            let i = (x as usize).min(self.drift.len() - 2);
            let w = (x - i as f64).min(1.0);
            f += self.drift[i] * (1.0 - w) + self.drift[i + 1] * w;
        }
        f
    }

    /// Torque on joint `j` that no log shows.
    pub fn torque(&self, j: usize, t: f64) -> f64 {
        if j != self.joint {
            return 0.0;
        }
        let mut sum = 0.0;
        for (start, length, size) in &self.knocks {
            let x = (t - start) / length;
            if (0.0..1.0).contains(&x) {
                sum += size * (PI * x).sin();
            }
        }
        if let Some((a, f, phase)) = self.tone {
            sum += a * (TAU * f * t + phase).sin();
        }
        sum
    }

    /// Factor on the dry friction of joint `j`.
    pub fn drag(&self, j: usize, t: f64) -> f64 {
        let on = j == self.joint && self.brake.iter().any(|(a, b)| (*a..*b).contains(&t));
        if on { self.drag } else { 1.0 }
    }
}
