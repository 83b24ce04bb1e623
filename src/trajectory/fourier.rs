//! Finite Fourier series of the joints: the motion and all its derivatives in closed form.

use crate::error::{Error, Result};
use crate::robot::Robot;
use std::f64::consts::TAU;

/// Largest harmonic number accepted.
pub const HARMONIC_MAX: u32 = 10_000;

/// Coefficients of one joint on the shared harmonics, rad or m:
/// `q(t) = c_0 + Σ_h [ s_h sin(h ω t) + c_h cos(h ω t) ]`.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Series {
    /// `c_0`
    pub constant: f64,
    /// `s_h`, one per harmonic
    pub sin: Vec<f64>,
    /// `c_h`, one per harmonic
    pub cos: Vec<f64>,
}

impl Series {
    /// The series that stays at zero, with `count` harmonics.
    pub fn zero(count: usize) -> Self {
        Series {
            constant: 0.0,
            sin: vec![0.0; count],
            cos: vec![0.0; count],
        }
    }

    /// From the stacked coefficients `[c_0, s_1 … s_H, c_1 … c_H]` (`2H + 1`).
    ///
    /// # Panics
    /// If the length is even.
    pub fn from_coefficients(coefficients: &[f64]) -> Self {
        assert!(coefficients.len() % 2 == 1, "2H + 1 coefficients expected");
        let count = coefficients.len() / 2;
        Series {
            constant: coefficients[0],
            sin: coefficients[1..=count].to_vec(),
            cos: coefficients[count + 1..].to_vec(),
        }
    }

    /// The stacked coefficients `[c_0, s_1 … s_H, c_1 … c_H]`.
    pub fn coefficients(&self) -> Vec<f64> {
        let mut all = Vec::with_capacity(1 + self.sin.len() + self.cos.len());
        all.push(self.constant);
        all.extend(&self.sin);
        all.extend(&self.cos);
        all
    }

    /// Time derivative of any order, again a series on the same harmonics: once differentiated,
    /// `(s_h, c_h)` becomes `h ω (−c_h, s_h)`. `omega` is `ω = 2π/T` in rad/s.
    pub fn derivative(&self, harmonics: &[u32], omega: f64, order: u32) -> Series {
        let mut out = self.clone();
        if order > 0 {
            out.constant = 0.0;
        }
        for ((s, c), &h) in out.sin.iter_mut().zip(&mut out.cos).zip(harmonics) {
            (*s, *c) = differentiated(*s, *c, f64::from(h) * omega, order);
        }
        out
    }

    /// `Σ_h (h ω)^k √(s_h² + c_h²)`: a bound of the k-th derivative (without the constant, which
    /// counts only for `k = 0` and is left out there too).
    pub fn amplitude_sum(&self, harmonics: &[u32], omega: f64, order: u32) -> f64 {
        self.sin
            .iter()
            .zip(&self.cos)
            .zip(harmonics)
            .map(|((s, c), &h)| s.hypot(*c) * (f64::from(h) * omega).powi(order as i32))
            .sum()
    }
}

/// Position and velocity of a series at a time, straight from its coefficients.
pub(crate) fn evaluate_series(series: &Series, harmonics: &[u32], omega: f64, t: f64) -> [f64; 2] {
    let (mut q, mut v) = (series.constant, 0.0);
    for ((&s, &c), &h) in series.sin.iter().zip(&series.cos).zip(harmonics) {
        let w = f64::from(h) * omega;
        let (sin, cos) = (w * t).sin_cos();
        q += s * sin + c * cos;
        v += w * (s * cos - c * sin);
    }
    [q, v]
}

/// Coefficients of `sin` and `cos` after `order` differentiations at angular frequency `w`.
#[inline]
pub(crate) fn differentiated(s: f64, c: f64, w: f64, order: u32) -> (f64, f64) {
    let f = w.powi(order as i32);
    match order % 4 {
        0 => (f * s, f * c),
        1 => (-f * c, f * s),
        2 => (-f * s, -f * c),
        _ => (f * c, -f * s),
    }
}

/// A periodic motion of all joints.
#[derive(Debug, Clone, PartialEq)]
pub struct Fourier {
    /// period `T`, s
    pub period: f64,
    /// harmonics `h`, strictly increasing, at least 1
    pub harmonics: Vec<u32>,
    /// one series per joint
    pub joints: Vec<Series>,
}

impl Fourier {
    /// A checked series.
    ///
    /// # Errors
    /// [`Error::Argument`] where [`Fourier::check`] finds something.
    pub fn new(period: f64, harmonics: Vec<u32>, joints: Vec<Series>) -> Result<Self> {
        let fourier = Fourier {
            period,
            harmonics,
            joints,
        };
        match fourier.check() {
            Ok(()) => Ok(fourier),
            Err((place, message)) => {
                Err(Error::Argument(format!("trajectory, {place}: {message}")))
            }
        }
    }

    /// Whether the period is positive and finite, the harmonics strictly increase from at least 1
    /// to at most `HARMONIC_MAX`, there is a joint, and every joint has as many finite
    /// coefficients as there are harmonics. Otherwise place and message of the first fault; the
    /// place is written as in `trajectory.json`.
    pub fn check(&self) -> Result<(), (String, String)> {
        if !(self.period.is_finite() && self.period > 0.0) {
            let message = format!("must be a positive number of seconds, not {}", self.period);
            return Err(("period".into(), message));
        }
        if self.harmonics.is_empty() {
            return Err((
                "harmonics".into(),
                "is empty; at least one is needed".into(),
            ));
        }
        let mut last = 0;
        for (k, &h) in self.harmonics.iter().enumerate() {
            if h <= last || h > HARMONIC_MAX {
                let message = format!(
                    "{h} found; harmonics are positive, strictly increasing and at most {HARMONIC_MAX}"
                );
                return Err((format!("harmonics[{k}]"), message));
            }
            last = h;
        }
        if self.joints.is_empty() {
            return Err((
                "coefficients".into(),
                "is empty; one entry per joint is needed".into(),
            ));
        }
        for (j, series) in self.joints.iter().enumerate() {
            if !series.constant.is_finite() {
                return Err((
                    format!("coefficients[{j}].constant"),
                    "must be finite".into(),
                ));
            }
            for (name, values) in [("sin", &series.sin), ("cos", &series.cos)] {
                if values.len() != self.harmonics.len() {
                    let message = format!(
                        "{} values, but there are {} harmonics",
                        values.len(),
                        self.harmonics.len()
                    );
                    return Err((format!("coefficients[{j}].{name}"), message));
                }
                if let Some(k) = values.iter().position(|v| !v.is_finite()) {
                    return Err((
                        format!("coefficients[{j}].{name}[{k}]"),
                        "must be finite".into(),
                    ));
                }
            }
        }
        Ok(())
    }

    /// Number of joints.
    pub fn dof(&self) -> usize {
        self.joints.len()
    }

    /// Base angular frequency `ω = 2π/T`, rad/s.
    pub fn omega(&self) -> f64 {
        TAU / self.period
    }

    /// Largest harmonic, 0 if there is none.
    pub fn harmonic_max(&self) -> u32 {
        self.harmonics.iter().copied().max().unwrap_or(0)
    }

    /// Positions and the first `K − 1` time derivatives of all joints at time `t` (s; the motion
    /// goes on periodically on both sides): `evaluate(t, [&mut q, &mut qd, &mut qdd])`. Nothing is
    /// allocated, every sine and cosine is taken once.
    ///
    /// # Panics
    /// If a slice does not have one entry per joint.
    pub fn evaluate<const K: usize>(&self, t: f64, mut out: [&mut [f64]; K]) {
        for (order, slice) in out.iter_mut().enumerate() {
            assert_eq!(slice.len(), self.joints.len(), "one entry per joint");
            for (value, series) in slice.iter_mut().zip(&self.joints) {
                *value = if order == 0 { series.constant } else { 0.0 };
            }
        }
        let (turns, omega) = (self.turns(t), self.omega());
        for (k, &h) in self.harmonics.iter().enumerate() {
            let (sin, cos) = sin_cos_turns(h, turns);
            let mut factor = 1.0;
            for (order, slice) in out.iter_mut().enumerate() {
                // dᵒ/dtᵒ of (sin, cos) is (hω)ᵒ times one of the four quarter turns
                let (ds, dc) = match order % 4 {
                    0 => (factor * sin, factor * cos),
                    1 => (factor * cos, -factor * sin),
                    2 => (-factor * sin, -factor * cos),
                    _ => (-factor * cos, factor * sin),
                };
                for (value, series) in slice.iter_mut().zip(&self.joints) {
                    *value += series.sin[k] * ds + series.cos[k] * dc;
                }
                factor *= f64::from(h) * omega;
            }
        }
    }

    /// Time derivative of one order (0: position) of all joints at time `t`.
    ///
    /// # Panics
    /// If `out` does not have one entry per joint.
    pub fn derivative(&self, order: u32, t: f64, out: &mut [f64]) {
        assert_eq!(out.len(), self.joints.len(), "one entry per joint");
        for (value, series) in out.iter_mut().zip(&self.joints) {
            *value = if order == 0 { series.constant } else { 0.0 };
        }
        let (turns, omega) = (self.turns(t), self.omega());
        for (k, &h) in self.harmonics.iter().enumerate() {
            let (sin, cos) = sin_cos_turns(h, turns);
            for (value, series) in out.iter_mut().zip(&self.joints) {
                let w = f64::from(h) * omega;
                let (s, c) = differentiated(series.sin[k], series.cos[k], w, order);
                *value += s * sin + c * cos;
            }
        }
    }

    /// Where in the period the time `t` falls, in turns, `[0, 1)`.
    fn turns(&self, t: f64) -> f64 {
        let turns = t / self.period;
        turns - turns.floor()
    }
}

/// Sine and cosine of `2π h · turns`; whole turns are dropped before the angle is formed.
#[inline]
pub(crate) fn sin_cos_turns(h: u32, turns: f64) -> (f64, f64) {
    let x = f64::from(h) * turns;
    (TAU * (x - x.floor())).sin_cos()
}

/// Rate of the samples that condition numbers and predictions refer to, Hz.
pub const RATE: f64 = 100.0;
/// Most numbers in the regressor of one period (320 MB); a longer period is sampled more coarsely.
const NUMBERS: usize = 40_000_000;

/// One period at [`RATE`] (at least 20 samples), the end point left out.
pub fn sample_period(fourier: &Fourier) -> crate::dynamics::Samples {
    // ten columns a body, as many rows a sample as joints
    let most = (NUMBERS / (10 * fourier.dof().max(1).pow(2))).max(5000);
    let count = ((fourier.period * RATE).round() as usize).clamp(20, most);
    fourier.motion(count)
}

/// Whether the trajectory is well-formed and has the robot's joints.
pub(super) fn check(robot: &Robot, trajectory: &Fourier) -> Result<()> {
    if let Err((place, message)) = trajectory.check() {
        return Err(Error::Argument(format!("trajectory, {place}: {message}")));
    }
    if robot.dof() != trajectory.dof() {
        return Err(Error::Argument(format!(
            "the trajectory has {} joints, robot {:?} has {}; use the robot it was designed for",
            trajectory.dof(),
            robot.name,
            robot.dof()
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two() -> Fourier {
        let a = Series {
            constant: 0.3,
            sin: vec![0.5, -0.1],
            cos: vec![0.2, 0.4],
        };
        let b = Series {
            constant: -1.0,
            sin: vec![0.0, 0.7],
            cos: vec![0.1, 0.0],
        };
        Fourier::new(2.5, vec![1, 4], vec![a, b]).unwrap()
    }

    #[test]
    fn derivatives_match_central_differences_and_each_other() {
        let f = two();
        let (h, t) = (1e-5, 0.77);
        for order in 0..5 {
            let [mut a, mut b, mut d, mut e] = [[0.0; 2]; 4];
            f.derivative(order, t - h, &mut a);
            f.derivative(order, t + h, &mut b);
            f.derivative(order + 1, t, &mut d);
            let w = (4.0 * f.omega()).powi(order as i32 + 1);
            for j in 0..2 {
                assert!(((b[j] - a[j]) / (2.0 * h) - d[j]).abs() < 1e-7 * w);
                let series = f.joints[j].derivative(&f.harmonics, f.omega(), order + 1);
                let g = Fourier {
                    joints: vec![series],
                    ..f.clone()
                };
                g.derivative(0, t, &mut e[..1]);
                assert!((e[0] - d[j]).abs() < 1e-12 * w);
            }
        }
    }

    #[test]
    fn evaluate_agrees_with_the_formula_and_repeats() {
        let f = two();
        let [mut q, mut qd, mut qdd, mut qddd, mut one] = [[0.0; 2]; 5];
        for t in [0.0, 0.4, 2.5, -1.3, 1234.56] {
            f.evaluate(t, [&mut q, &mut qd, &mut qdd, &mut qddd]);
            for (order, all) in [q, qd, qdd, qddd].iter().enumerate() {
                f.derivative(order as u32, t, &mut one);
                for j in 0..2 {
                    assert!((one[j] - all[j]).abs() < 1e-10 * (1.0 + one[j].abs()));
                }
            }
            let w = f.omega();
            let want = 0.3 + 0.5 * (w * t).sin() - 0.1 * (4.0 * w * t).sin()
                + 0.2 * (w * t).cos()
                + 0.4 * (4.0 * w * t).cos();
            assert!((q[0] - want).abs() < 1e-11);
        }
        f.evaluate(0.0, [&mut q]);
        f.evaluate(2.5, [&mut one]);
        assert_eq!(q, one);
    }

    #[test]
    fn faults_are_named() {
        let broken = |change: fn(&mut Fourier)| {
            let mut f = two();
            change(&mut f);
            f.check().unwrap_err().0
        };
        assert_eq!(broken(|f| f.period = 0.0), "period");
        assert_eq!(broken(|f| f.period = f64::NAN), "period");
        assert_eq!(broken(|f| f.harmonics[1] = 1), "harmonics[1]");
        assert_eq!(broken(|f| f.harmonics[0] = 0), "harmonics[0]");
        assert_eq!(broken(|f| f.harmonics[1] = 10_001), "harmonics[1]");
        assert_eq!(broken(|f| f.harmonics.clear()), "harmonics");
        assert_eq!(broken(|f| f.joints.clear()), "coefficients");
        assert_eq!(
            broken(|f| f.joints[1].cos[1] = f64::INFINITY),
            "coefficients[1].cos[1]"
        );
        assert_eq!(broken(|f| f.joints[0].sin.push(0.0)), "coefficients[0].sin");
    }

    #[test]
    fn stacking_is_its_own_inverse() {
        let s = two().joints[0].clone();
        assert_eq!(Series::from_coefficients(&s.coefficients()), s);
    }
}
