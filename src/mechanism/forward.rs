//! Forward kinematics: the pose from the actuators, by Newton on the inverse kinematics.
//!
//! `x ← x − D_a⁺ (F_a(x) − q_a)` from a pose nearby. A parallel robot has many assembly modes (a
//! general hexapod up to 40 real ones), and Newton may end in another than it started in. Two tests
//! guard against that: the sign of `det D_a` must not have changed (between two modes that share a
//! sign-definite Jacobian lies a singularity), and the pose must lie where the actuators moved it to
//! first order; where the latter fails the way is cut in halves and walked, as the robot would.

use super::{Mechanism, Spread};
use crate::error::{Error, Result};
use nalgebra::{DMatrix, DVector};

/// Result of the forward kinematics.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// task coordinates
    pub x: Vec<f64>,
    /// largest error of an actuator, m or rad
    pub residual: f64,
    /// Newton steps in all
    pub iterations: usize,
    /// pieces that the way was cut into
    pub pieces: usize,
}

/// Largest number of pieces.
const PIECES: usize = 256;
const TOLERANCE: f64 = 1e-12;

impl Mechanism {
    /// Actuator positions and `D_a` of a pose, `None` where it cannot be reached.
    fn actuation_at(&self, x: &[f64]) -> Option<(DVector<f64>, DMatrix<f64>)> {
        if self.problem(x).is_some() {
            return None;
        }
        let (m, na) = (self.freedoms(), self.actuators());
        let mut q = DVector::zeros(na);
        let mut rows = vec![0.0; na * m];
        self.geometry
            .rows(x, &self.actuated, q.as_mut_slice(), &mut rows);
        let j = DMatrix::from_row_slice(na, m, &rows);
        (q.iter().chain(j.iter()).all(|v| v.is_finite())).then_some((q, j))
    }

    /// Pose from actuator positions, starting from the pose `from` close by, in whose assembly mode
    /// the result is.
    ///
    /// # Errors
    /// A start that cannot be reached; actuator positions that no pose gives, or only poses of
    /// another assembly mode.
    pub fn forward(&self, actuators: &[f64], from: &[f64]) -> Result<Solution> {
        let fail = |why: String| Err(Error::Infeasible(format!("{}: {why}", self.robot.name)));
        if actuators.len() != self.actuators() {
            return fail(format!(
                "{} actuator positions for {} actuators",
                actuators.len(),
                self.actuators()
            ));
        }
        let Some((start, j0)) = self.actuation_at(from) else {
            let why = self.problem(from).unwrap_or_default();
            return fail(format!(
                "forward kinematics starts in a pose that cannot be reached: {why}"
            ));
        };
        let side = orientation(&j0);
        let target = DVector::from_column_slice(actuators);
        let mut last = String::new();
        let mut iterations = 0;
        let mut pieces = 1;
        while pieces <= PIECES {
            let mut x = DVector::from_column_slice(from);
            let mut residual = f64::INFINITY;
            let mut done = true;
            for piece in 1..=pieces {
                let goal = &start + (&target - &start) * (piece as f64 / pieces as f64);
                match self.newton(&x, &goal, side, &mut iterations) {
                    Ok((next, r)) => {
                        x = next;
                        residual = r;
                    }
                    Err(why) => {
                        last = why;
                        done = false;
                        break;
                    }
                }
            }
            if done {
                return Ok(Solution {
                    x: x.as_slice().to_vec(),
                    residual,
                    iterations,
                    pieces,
                });
            }
            pieces *= 2;
        }
        fail(format!(
            "no pose of this assembly mode has the actuators at {actuators:?} (walked from {} in {} \
             pieces): {last}",
            self.show(from),
            PIECES
        ))
    }

    /// One piece of the way.
    fn newton(
        &self,
        from: &DVector<f64>,
        goal: &DVector<f64>,
        side: f64,
        iterations: &mut usize,
    ) -> Result<(DVector<f64>, f64), String> {
        let mut x = from.clone();
        let (mut q, mut j) = self
            .actuation_at(x.as_slice())
            .ok_or("the way leaves the reach")?;
        let solve = |j: &DMatrix<f64>, e: &DVector<f64>| {
            if j.iter().chain(e.iter()).any(|x| !x.is_finite()) {
                return Err("the motion is not finite there".to_string());
            }
            if let Some(step) = regular(j, e) {
                return Ok(step);
            }
            j.clone()
                .svd(true, true)
                .solve(e, 1e-12)
                .map_err(|e| e.to_string())
        };
        let first = solve(&j, &(goal - &q))?;
        let mut ahead = Some(first.clone());
        let size = |v: &DVector<f64>| {
            (0..v.len())
                .map(|k| match self.task.is_angle(k) {
                    true => (v[k] * self.length).powi(2),
                    false => v[k] * v[k],
                })
                .sum::<f64>()
                .sqrt()
        };
        let mut error = (goal - &q).amax();
        // one step more than the tolerance asks for: positions that are differentiated later want
        // the last digits
        let mut polished = false;
        for _ in 0..30 {
            if error <= TOLERANCE * (1.0 + goal.amax()) {
                if polished {
                    break;
                }
                polished = true;
            }
            *iterations += 1;
            let step = match ahead.take() {
                Some(step) => step,
                None => solve(&j, &(goal - &q))?,
            };
            let mut fraction = 1.0;
            loop {
                let next = &x + &step * fraction;
                if let Some((qn, jn)) = self.actuation_at(next.as_slice()) {
                    let e = (goal - &qn).amax();
                    if e < error || e <= TOLERANCE * (1.0 + goal.amax()) {
                        (x, q, j, error) = (next, qn, jn, e);
                        break;
                    }
                }
                fraction *= 0.5;
                if fraction < 1e-3 {
                    return if error < 1e-9 * (1.0 + goal.amax()) {
                        Ok((x, error))
                    } else {
                        Err(format!(
                            "Newton stalls with an actuator off by {error:.2e}; smallest singular \
                             value of the actuation Jacobian {:.1e}",
                            Spread::of(&j).sigma_min
                        ))
                    };
                }
            }
        }
        if error > 1e-9 * (1.0 + goal.amax()) {
            return Err(format!("after 30 steps an actuator is off by {error:.2e}"));
        }
        if orientation(&j) != side {
            return Err(format!(
                "the assembly mode has jumped: det of the actuation Jacobian changed sign to {:.2e}",
                determinant(&j)
            ));
        }
        let moved = &x - from;
        let off = size(&(&moved - &first));
        if off > 0.5 * size(&first) + 1e-9 {
            return Err(format!(
                "the assembly mode may have jumped: the pose is {off:.3} m from where the actuators \
                 move it to first order ({:.3} m)",
                size(&first)
            ));
        }
        Ok((x, error))
    }
}

/// Solution of a square system whose pivots differ by less than 1e8; its matrix may be singular otherwise.
fn regular(j: &DMatrix<f64>, e: &DVector<f64>) -> Option<DVector<f64>> {
    if !j.is_square() {
        return None;
    }
    let lu = j.clone().lu();
    let pivots = lu.u().diagonal().abs();
    (pivots.min() > 1e-8 * pivots.max()).then(|| lu.solve(e))?
}

/// Determinant of a square matrix; 1 for others, which have no such test.
fn determinant(j: &DMatrix<f64>) -> f64 {
    match j.is_square() {
        true => j.determinant(),
        false => 1.0,
    }
}

fn orientation(j: &DMatrix<f64>) -> f64 {
    determinant(j).signum()
}
