//! A part of a move, from one state to another.

use super::profile::Profile;
use crate::collision::clearance::Path;
use crate::dynamics::Samples;

/// A part of a move between two states.
#[derive(Debug, Clone, PartialEq)]
pub struct Leg {
    /// one a coordinate
    pub profiles: Vec<Profile>,
    /// s
    pub duration: f64,
    /// how much slower than the share of the constant limits allows; 1: not slower
    pub slowed: f64,
    /// share of the limits that is used
    pub scale: f64,
    /// whether both ends are at rest
    pub resting: bool,
}

impl Leg {
    /// Of its coordinates; it lasts as long as the longest of them.
    pub fn new(profiles: Vec<Profile>, scale: f64, resting: bool) -> Self {
        let duration = profiles.iter().map(|p| p.duration).fold(0.0, f64::max);
        Leg {
            profiles,
            duration,
            slowed: 1.0,
            scale,
            resting,
        }
    }

    /// Instants at which a jerk may jump, ends included, with others, in order.
    pub fn instants(&self, mut others: Vec<f64>) -> Vec<f64> {
        others.extend(self.profiles.iter().flat_map(|p| p.breaks()));
        others.retain(|t| (0.0..=self.duration).contains(t));
        others.sort_by(f64::total_cmp);
        // what lies closer is rounding
        others.dedup_by(|b, a| *b - *a < 1e-12 * self.duration);
        others
    }

    /// Positions, velocities and accelerations at some times.
    pub fn samples(&self, times: &[f64]) -> Samples {
        let mut x = Samples::zeros(self.profiles.len(), times.len());
        for (k, p) in self.profiles.iter().enumerate() {
            for (s, t) in times.iter().enumerate() {
                let at = k * times.len() + s;
                [x.q[at], x.qd[at], x.qdd[at]] = p.at(*t);
            }
        }
        x
    }

    /// The same positions, `factor` times as slow.
    pub fn stretched(&self, factor: f64) -> Self {
        Leg {
            profiles: self.profiles.iter().map(|p| p.stretched(factor)).collect(),
            duration: self.duration * factor,
            slowed: self.slowed * factor,
            ..*self
        }
    }
}

impl Path for Leg {
    fn position(&self, t: f64, q: &mut [f64]) {
        for (q, p) in q.iter_mut().zip(&self.profiles) {
            *q = p.at(t)[0];
        }
    }

    fn speed(&self, from: f64, to: f64, v: &mut [f64]) {
        for (v, p) in v.iter_mut().zip(&self.profiles) {
            *v = p.speed(from, to);
        }
    }

    fn largest(&self, joint: usize) -> f64 {
        let [low, high] = self.profiles[joint].range(0.0, self.duration);
        low.abs().max(high.abs())
    }

    fn duration(&self) -> f64 {
        self.duration
    }
}
