//! Friction of the drives and what their sensors show.

use crate::random::Random;

/// A drive: dry and viscous friction, what else is wrong with it.
#[derive(Clone, Debug, Default)]
pub struct Drive {
    pub dry: f64,
    pub viscous: f64,
    /// Rise towards standstill (N), its velocity (m/s) and exponent.
    pub rise: f64,
    pub rise_speed: f64,
    pub rise_power: f64,
    /// Difference of the directions, over their mean.
    pub asymmetry: f64,
    /// Error of the logged force.
    pub gain: f64,
    /// Constant force.
    pub offset: f64,
    /// Dry friction per unit of transmitted force.
    pub loaded: f64,
}

impl Drive {
    /// What the sensor of the force shows of it, N: force on the leg `f` at the rate `v`.
    pub fn logged(&self, f: f64, v: f64) -> f64 {
        let side = 1.0 + 0.5 * self.asymmetry * if v > 0.0 { 1.0 } else { -1.0 };
        let rise = match self.rise > 0.0 {
            true => self.rise * (-(v.abs() / self.rise_speed).powf(self.rise_power)).exp(),
            false => 0.0,
        };
        let dry = self.dry * side + rise + self.loaded * f.abs();
        let friction = dry * (v / 3e-4).tanh() + self.viscous * side * v;
        (f + friction + self.offset) * (1.0 + self.gain)
    }
}

/// Noise of a force sensor: white, and of first order beside it.
pub struct Sensor {
    white: f64,
    slow: f64,
    pole: f64,
    state: f64,
}

impl Sensor {
    /// Deviations of both parts, corner of the second in Hz, time between samples.
    pub fn new(white: f64, slow: f64, corner: f64, step: f64, rng: &mut Random) -> Self {
        Sensor {
            white,
            slow,
            pole: (-std::f64::consts::TAU * corner * step).exp(),
            state: rng.normal(),
        }
    }

    pub fn next(&mut self, rng: &mut Random) -> f64 {
        let p = self.pole;
        self.state = p * self.state + (1.0 - p * p).sqrt() * rng.normal();
        self.slow * self.state + self.white * rng.normal()
    }
}
