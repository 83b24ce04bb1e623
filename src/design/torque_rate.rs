//! Limits of the rate of torque along the trajectory of a tree, linearised.
//!
//! The torques at the `N` samples of a period are those of a periodic function that has few harmonics, so its
//! rate at the samples is that of the trigonometric polynomial through them,
//!
//! ```text
//! τ̇_i = ω Σ_k D_{i−k} τ_k        D_m = ½ (−1)ᵐ cot(mπ/N)   (N even),   ½ (−1)ᵐ / sin(mπ/N)   (N odd)
//! ```
//!
//! and its gradient the same sum of the gradients of the torques. Coulomb friction, which jumps, is no part of it.

use super::information::{Evaluation, Information};
use super::path::{PathLimits, PathMemory, PathRow, ROOM};
use super::torque::{BETWEEN, TorqueLimits};
use crate::dynamics::{Derivatives, Samples, Workspace};
use crate::robot::Robot;
use std::f64::consts::{PI, TAU};

/// Limits of the rates of a robot's torques.
pub struct TorqueRateLimits {
    torques: TorqueLimits,
    names: Vec<String>,
    /// per joint, infinite where there is none
    room: Vec<f64>,
    /// rad/s
    omega: f64,
}

impl TorqueRateLimits {
    /// Rate limits times `derate` of motions of this period; `None` where no joint has one.
    pub fn new(robot: &Robot, derate: f64, period: f64) -> Option<Self> {
        let limits = robot.joints.iter().map(|j| j.limits.effort_rate);
        let room: Vec<f64> = limits.map(|l| l * derate * (1.0 - BETWEEN)).collect();
        room.iter()
            .any(|r| r.is_finite())
            .then(|| TorqueRateLimits {
                torques: TorqueLimits::of(robot, derate),
                names: robot.joint_names(),
                room,
                omega: TAU / period,
            })
    }

    /// Rates from torques, joint-major.
    fn rates(&self, tau: &[f64]) -> Vec<f64> {
        let count = tau.len() / self.room.len();
        let kernel = self.kernel(count);
        let mut out = Vec::with_capacity(tau.len());
        for (row, room) in tau.chunks_exact(count).zip(&self.room) {
            let at = |i: usize| -> f64 {
                let each = row.iter().enumerate();
                each.map(|(k, t)| kernel[(count + i - k) % count] * t).sum()
            };
            // without a limit nobody asks
            let limited = room.is_finite();
            out.extend((0..count).map(|i| if limited { at(i) } else { 0.0 }));
        }
        out
    }

    /// `ω D_m`.
    fn kernel(&self, count: usize) -> Vec<f64> {
        let each = (0..count).map(|m| {
            let x = PI * m as f64 / count as f64;
            let sign = if m % 2 == 0 { 0.5 } else { -0.5 };
            match (m, count % 2) {
                (0, _) => 0.0,
                (_, 0) => self.omega * sign / x.tan(),
                _ => self.omega * sign / x.sin(),
            }
        });
        each.collect()
    }

    /// Largest rate over its limit, with the joint.
    fn worst(&self, rates: &[f64]) -> (f64, usize) {
        let count = rates.len() / self.room.len();
        let each = rates
            .chunks_exact(count)
            .zip(&self.room)
            .map(|(row, room)| {
                let most = row.iter().fold(0.0, |m: f64, r| m.max(r.abs()));
                most / room
            });
        let each = each.enumerate().map(|(j, used)| (used, j));
        each.fold((0.0, 0), |a, b| if b.0 > a.0 { b } else { a })
    }
}

impl PathLimits for TorqueRateLimits {
    fn used(
        &self,
        info: &Information,
        _: &[f64],
        motion: &Samples,
        memory: &mut PathMemory,
    ) -> f64 {
        let mut tau = std::mem::take(&mut memory.tau);
        let ws = &mut memory.workspace;
        self.torques.torques(info, motion, ws, &mut tau);
        let used = self.worst(&self.rates(&tau)).0;
        memory.tau = tau;
        used
    }

    fn broken(&self, info: &Information, _: &[f64], motion: &Samples) -> String {
        let mut tau = Vec::new();
        let ws = &mut Workspace::default();
        self.torques.torques(info, motion, ws, &mut tau);
        let (used, j) = self.worst(&self.rates(&tau));
        match used > 1.0 {
            true => format!(
                "{} is at {:.0} % of its limit of the rate of torque",
                self.names[j],
                100.0 * used
            ),
            false => String::new(),
        }
    }

    fn rows(&self, info: &Information, _: &[f64], e: &mut Evaluation, from: f64) -> Vec<PathRow> {
        let count = e.motion.count;
        let (mut tau, mut ws) = (Vec::new(), Workspace::default());
        self.torques.torques(info, &e.motion, &mut ws, &mut tau);
        let rates = self.rates(&tau);
        let kernel = self.kernel(count);
        let mut rows = Vec::new();
        let mut d = Derivatives::default();
        for (j, (rates, room)) in rates.chunks_exact(count).zip(&self.room).enumerate() {
            let near: Vec<usize> = (0..count)
                .filter(|i| rates[*i].abs() > from * room)
                .collect();
            if near.is_empty() {
                continue;
            }
            let motion = &e.motion;
            self.torques.derivatives(info, motion, j, &mut ws, &mut d);
            let gradients: Vec<Vec<f64>> = (0..count)
                .map(|k| TorqueLimits::gradient(info, motion, &d, k))
                .collect();
            for i in near {
                let sign = rates[i].signum();
                let mut gradient = vec![0.0; info.len()];
                for (k, g) in gradients.iter().enumerate() {
                    let f = sign * kernel[(count + i - k) % count];
                    gradient.iter_mut().zip(g).for_each(|(a, b)| *a += f * b);
                }
                rows.push(PathRow {
                    gradient,
                    slack: (1.0 - ROOM) * room - rates[i].abs(),
                });
            }
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Plant;
    use crate::trajectory::{Basis, Ends};

    fn limited() -> (Plant, Basis) {
        let mut robot = Robot::load("planar2").unwrap();
        robot.joints[1].limits.effort_rate = 3.0;
        let basis = Basis::new(&[1, 2, 3], Ends::Free, 2, None).unwrap();
        (Plant::from(robot), basis)
    }

    #[test]
    fn rates_and_rows_are_those_of_differences() {
        let (plant, basis) = limited();
        let transform = plant.base().unwrap().row_space;
        for count in [60, 61] {
            let info = Information::new(&plant, &basis, 2.5, count, transform.clone(), None);
            let x: Vec<f64> = (0..info.len())
                .map(|k| 0.3 * (1.7 * k as f64).sin())
                .collect();
            let limits = TorqueRateLimits::new(plant.robot(), 1.0, 2.5).unwrap();
            let rates = |x: &[f64]| -> Vec<f64> {
                let (mut motion, mut tau) = (Samples::default(), Vec::new());
                info.sample(x, &mut motion);
                let ws = &mut Workspace::default();
                limits.torques.torques(&info, &motion, ws, &mut tau);
                limits.rates(&tau)[count..].to_vec()
            };
            // against torques of the series a little before and after
            let fourier = basis.fourier(2.5, &x);
            let tau = |t: f64| {
                let (mut q, mut qd, mut qdd) = ([0.0; 2], [0.0; 2], [0.0; 2]);
                fourier.evaluate(t, [&mut q, &mut qd, &mut qdd]);
                let at = Samples::from_rows(2, &[&q.to_vec()], &[&qd.to_vec()], &[&qdd.to_vec()]);
                plant.nominal_torque(&at).unwrap()[1]
            };
            let (here, h) = (rates(&x), 1e-4);
            let most = here.iter().fold(0.0, |m: f64, r| m.max(r.abs()));
            for (i, rate) in here.iter().enumerate() {
                let t = 2.5 * i as f64 / count as f64;
                let exact = (8.0 * (tau(t + h) - tau(t - h)) - tau(t + 2.0 * h) + tau(t - 2.0 * h))
                    / (12.0 * h);
                assert!((rate - exact).abs() < 1e-4 * most, "{rate} {exact}");
            }
            let mut e = Evaluation::default();
            info.evaluate(&x, &mut e);
            let rows = limits.rows(&info, &x, &mut e, 0.0);
            assert_eq!(rows.len(), count);
            for (i, row) in rows.iter().enumerate().step_by(7) {
                for k in 0..x.len() {
                    let moved = |s: f64| {
                        let mut y = x.clone();
                        y[k] += s * 1e-5;
                        rates(&y)[i].abs()
                    };
                    let exact = (moved(1.0) - moved(-1.0)) / 2e-5;
                    assert!(
                        (row.gradient[k] - exact).abs() < 1e-4 * (1.0 + exact.abs()),
                        "{i} {k}"
                    );
                }
            }
        }
    }
}
