//! Parallel robots: actuators as functions of the platform's pose, so that no forward kinematics is needed to fit.
//!
//! Per actuator `i`, with the pose `(p, R)` of the platform in the base and errors `ξ` of the dimensions:
//!
//! | algorithm | residual |
//! |---|---|
//! | inverse | `IKM_i(p, R; ξ) − q_i`, rad or m |
//! | implicit | `f_i(q_i, p, R; ξ)`, the closure of chain `i`, m² |
//!
//! (Renaud et al. 2006.) Both see nothing of what the mechanism cannot do: a platform of an H4 keeps its tilt, one of
//! a Delta its orientation. The **orientation residual** says that the measured orientation is one the mechanism can
//! take. Each row is whitened by the covariance that the noise of pose and encoder has in its residuals. The pose of
//! given readings, needed to predict, is found by Newton on the same equations.

use super::feature::{Feature, Rate};
use super::frame::{Frame, exp, log};
use super::serial::Posed;
use super::unknown::{Part, Unknown};
use crate::error::{Error, Result};
use crate::mechanism::dimensions::{ARM, Dimensions, LEG};
use crate::mechanism::scalar::{Dual, Pack, Scalar};
use crate::mechanism::{Mechanism, Task};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// Variables of one actuator: its own dimensions, a hinge, the pose.
const VARIABLES: usize = 20;
type Number = Dual<Pack<f64>, VARIABLES>;

/// A parallel robot with errors of its dimensions.
#[derive(Debug)]
pub struct Parallel {
    /// the robot as in its file
    pub mechanism: Mechanism,
    /// its dimensions
    pub dimensions: Dimensions,
}

/// Residuals of the actuators, and their derivatives by dimensions and pose.
#[derive(Debug, Clone)]
pub struct Actuators {
    /// rad or m; m² of the implicit ones
    pub value: DVector<f64>,
    /// by the errors of the dimensions
    pub by_errors: DMatrix<f64>,
    /// by a shift and a turn of the platform, base axes
    pub by_pose: DMatrix<f64>,
    /// by the reading
    pub by_reading: DVector<f64>,
}

/// Steps of Newton's method.
const STEPS: usize = 40;

impl Parallel {
    /// Of a mechanism; `None` where its dimensions are not known as numbers.
    pub fn new(mechanism: &Mechanism) -> Option<Self> {
        let mechanism = mechanism.platform().clone();
        let dimensions = mechanism.geometry().dimensions()?;
        Some(Parallel {
            mechanism,
            dimensions,
        })
    }

    fn hinges(&self) -> usize {
        match &self.dimensions {
            Dimensions::Chains(_, hinges) => hinges.len(),
            Dimensions::Legs(_) => 0,
        }
    }

    /// Dimensions of one chain.
    fn own(&self) -> usize {
        match &self.dimensions {
            Dimensions::Chains(..) => ARM.len(),
            Dimensions::Legs(_) => LEG.len(),
        }
    }

    /// Number of actuators.
    pub fn actuators(&self) -> usize {
        match &self.dimensions {
            Dimensions::Chains(chains, _) => chains.len(),
            Dimensions::Legs(legs) => legs.len(),
        }
    }

    /// Number of dimensions.
    pub fn errors(&self) -> usize {
        self.own() * self.actuators() + 3 * self.hinges()
    }

    /// The dimensions as unknowns.
    pub fn unknowns(&self, [length, angle]: [f64; 2]) -> Vec<Unknown> {
        let (names, chain): (&[&str], &str) = match &self.dimensions {
            Dimensions::Chains(..) => (&ARM, "chain"),
            Dimensions::Legs(_) => (&LEG, "leg"),
        };
        let is_angle = |n: &str| chain == "chain" && (n == "zero" || n.starts_with("tilt"));
        let mut all = Vec::new();
        for i in 1..=self.actuators() {
            for n in names {
                let (unit, prior) = if is_angle(n) {
                    ("rad", angle)
                } else {
                    ("m", length)
                };
                all.push(Unknown::new(
                    format!("{chain}{i}.{n}"),
                    unit,
                    Part::Geometry,
                    prior,
                ));
            }
        }
        for k in 1..=self.hinges() {
            for n in ["x", "y", "z"] {
                all.push(Unknown::new(
                    format!("hinge{k}.{n}"),
                    "m",
                    Part::Geometry,
                    length,
                ));
            }
        }
        all
    }

    /// Rotations that the platform cannot make: rows of `log R` in base axes.
    pub fn held(&self) -> &'static [usize] {
        match self.mechanism.task {
            Task::Schoenflies => &[0, 1],
            Task::Translation => &[0, 1, 2],
            _ => &[],
        }
    }

    /// Residuals of the actuators at a pose.
    pub fn actuators_at(&self, pose: &Frame, q: &[f64], x: &[f64], implicit: bool) -> Actuators {
        let (n, own) = (self.actuators(), self.own());
        let mut out = Actuators {
            value: DVector::zeros(n),
            by_errors: DMatrix::zeros(n, self.errors()),
            by_pose: DMatrix::zeros(n, 6),
            by_reading: DVector::from_element(n, -1.0),
        };
        let constant = |v: f64| Number::constant(v);
        let variable = |v: f64, i: usize| Number::variable(Pack(v), i);
        // turn variables: R (1 + skew(w)) from the left
        let first = VARIABLES - 6;
        let p = [0, 1, 2].map(|k| variable(pose.p[k], first + k));
        let w = [0, 1, 2].map(|k| variable(0.0, first + 3 + k));
        let column = |c: usize| [0, 1, 2].map(|k| pose.r[(k, c)]);
        let mut r = [[constant(0.0); 3]; 3];
        #[allow(clippy::needless_range_loop)]
        for c in 0..3 {
            let v = column(c);
            r[0][c] = w[1] * v[2] - w[2] * v[1] + v[0];
            r[1][c] = w[2] * v[0] - w[0] * v[2] + v[1];
            r[2][c] = w[0] * v[1] - w[1] * v[0] + v[2];
        }
        for i in 0..n {
            let e: [Number; 11] = std::array::from_fn(|k| match k < own {
                true => variable(x[own * i + k], k),
                false => constant(0.0),
            });
            let (value, by_reading, hinge) = match &self.dimensions {
                Dimensions::Legs(legs) => {
                    let leg = &legs[i];
                    match implicit {
                        false => (leg.reading(&e, &r, &p) + (-q[i]), -1.0, None),
                        true => {
                            let l = q[i] + x[own * i + 6] + leg.zero;
                            (leg.closure(&e, &r, &p, constant(q[i])), -2.0 * l, None)
                        }
                    }
                }
                Dimensions::Chains(chains, hinges) => {
                    let chain = &chains[i];
                    let at = own * n + 3 * chain.hinge;
                    let hinge = hinges.get(chain.hinge);
                    let c: [Number; 3] = std::array::from_fn(|k| match hinge {
                        Some(h) => variable(h[k] + x[at + k], 11 + k),
                        None => constant(0.0),
                    });
                    let which = hinge.map(|_| at);
                    match implicit {
                        false => (chain.reading(&e, &c, &r, &p) + (-q[i]), -1.0, which),
                        true => {
                            let value = chain.closure(&e, &c, &r, &p, constant(q[i]));
                            // the reading and its offset come as a sum
                            (value, value.d[5].0, which)
                        }
                    }
                }
            };
            out.value[i] = value.v.0;
            out.by_reading[i] = by_reading;
            for k in 0..own {
                out.by_errors[(i, own * i + k)] = value.d[k].0;
            }
            if let Some(at) = hinge {
                for k in 0..3 {
                    out.by_errors[(i, at + k)] = value.d[11 + k].0;
                }
            }
            for k in 0..6 {
                out.by_pose[(i, k)] = value.d[first + k].0;
            }
        }
        out
    }

    /// Pose of nominal dimensions, walked from home.
    ///
    /// # Errors
    /// Readings that no pose of the assembly mode of home gives.
    pub fn nominal(&self, q: &[f64]) -> Result<Frame> {
        let m = &self.mechanism;
        Ok(self.frame_of(&m.forward(q, &m.home)?.x))
    }

    /// Pose of task coordinates.
    pub fn frame_of(&self, x: &[f64]) -> Frame {
        let angle = |k: usize| x.get(k).copied().unwrap_or(0.0);
        let rpy = match self.mechanism.task {
            Task::Schoenflies => Vector3::new(0.0, 0.0, angle(3)),
            Task::Translation => Vector3::zeros(),
            _ => Vector3::new(angle(3), angle(4), angle(5)),
        };
        Frame {
            r: crate::mechanism::task::rotation(&rpy),
            p: Vector3::new(x[0], x[1], x[2]),
        }
    }

    /// Readings with what the joints do beside turning: features behind the dimensions in `x`.
    pub fn readings(&self, q: &[f64], x: &[f64], features: &[Feature], rate: &[Rate]) -> Vec<f64> {
        let mut q = q.to_vec();
        for (k, f) in features.iter().enumerate() {
            q[f.joint] += x[self.errors() + k] * rate[k].turn;
        }
        q
    }

    /// Pose at readings `q` with errors `x` (dimensions, then one number a feature), from a pose nearby.
    ///
    /// # Errors
    /// Newton does not come to rest, or the actuators do not hold the platform.
    pub fn pose(
        &self,
        q: &[f64],
        x: &[f64],
        features: &[Feature],
        rate: &[Rate],
        near: &Frame,
    ) -> Result<Posed> {
        let readings = self.readings(q, x, features, rate);
        let q = &readings[..];
        let held = self.held();
        let free: Vec<usize> = (0..6)
            .filter(|k| *k < 3 || !held.contains(&(k - 3)))
            .collect();
        let mut at = *near;
        let failed = || {
            Error::Infeasible(format!(
                "{}: no pose near the nominal one has the actuators at {q:?}",
                self.mechanism.robot.name
            ))
        };
        let solve = |a: &Actuators, rhs: &DMatrix<f64>| {
            let j = DMatrix::from_fn(a.value.len(), free.len(), |i, k| a.by_pose[(i, free[k])]);
            if j.iter().chain(rhs.iter()).any(|v| !v.is_finite()) {
                return Err(failed());
            }
            match j.is_square() {
                true => j.lu().solve(rhs).ok_or_else(failed),
                false => j.svd(true, true).solve(rhs, 1e-12).map_err(|_| failed()),
            }
        };
        for step in 0.. {
            let a = self.actuators_at(&at, q, x, false);
            let rhs = DMatrix::from_column_slice(a.value.len(), 1, (-&a.value).as_slice());
            let d = solve(&a, &rhs)?;
            let mut move_by = [0.0; 6];
            for (k, &f) in free.iter().enumerate() {
                move_by[f] = d[(k, 0)];
            }
            let size = d.amax();
            // far steps are cut: they would leave the reach
            let cut = (0.1 / size.max(1e-12)).min(1.0);
            let shift = Vector3::new(move_by[0], move_by[1], move_by[2]) * cut;
            let turn = Vector3::new(move_by[3], move_by[4], move_by[5]) * cut;
            at.p += shift;
            at.r = exp(&turn) * at.r;
            if size < 1e-11 {
                break;
            }
            if step == STEPS {
                return Err(failed());
            }
        }
        let a = self.actuators_at(&at, q, x, false);
        let errors = self.errors();
        let mut by = DMatrix::zeros(a.value.len(), errors + features.len());
        by.columns_mut(0, errors).copy_from(&a.by_errors);
        for (k, f) in features.iter().enumerate() {
            by[(f.joint, errors + k)] = a.by_reading[f.joint] * rate[k].turn;
        }
        let rates = solve(&a, &(-by))?;
        let mut jacobian = DMatrix::zeros(6, errors + features.len());
        for (k, &f) in free.iter().enumerate() {
            jacobian.row_mut(f).copy_from(&rates.row(k));
        }
        Ok(Posed {
            frame: at,
            jacobian,
        })
    }

    /// What the measured orientation is off from one the mechanism can take, rad, and its derivative by a turn in
    /// base axes.
    pub fn orientation(&self, r: &Matrix3<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let held = self.held();
        let (value, by): (Vector3<f64>, Matrix3<f64>) = match held.len() {
            2 => {
                // the third axis of the platform against that of the base: z_x = −w_y, z_y = w_x … of small tilts
                let z = r.column(2);
                let value = Vector3::new(-z[1], z[0], 0.0);
                let by = Matrix3::new(z[2], 0.0, -z[0], 0.0, z[2], -z[1], 0.0, 0.0, 0.0);
                (value, by)
            }
            _ => {
                let w = log(r);
                (w, super::frame::left_jacobian_inverse(&w))
            }
        };
        (
            DVector::from_fn(held.len(), |k, _| value[held[k]]),
            DMatrix::from_fn(held.len(), 3, |k, c| by[(held[k], c)]),
        )
    }
}
