//! Joint friction with sticking, exactly: no regularised `sign`.
//!
//! Every joint with dry friction either **slides** in a direction, with the force
//!
//! ```text
//! f = s (F_c + (F_s − F_c) exp(−(q̇/v_s)²) + β |τ|) + F_v q̇ + c q̇ |q̇|          s = ±1
//! ```
//!
//! or **sticks**. The forces `f_S` of sticking joints are those that hold them, bounded by the force
//! that it takes to break away,
//!
//! ```text
//! q̈_S = b − A f_S,   A = D_S M⁻¹ D_Sᵀ,   |f_j| ≤ F_s,j :   q̈_j = 0, or f_j at its bound
//! ```
//!
//! a box-constrained quadratic program in as many unknowns as joints stick (Stewart & Trinkle 1996,
//! for the acceleration), solved by projected Gauss-Seidel, which also settles more sticking joints
//! than freedoms.

use super::effects::JointEffect;
use crate::robot::Stribeck;
use nalgebra::{DMatrix, DVector};

/// State of the dry friction of one joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// no dry friction
    Smooth,
    /// sliding with positive (`true`) or negative velocity
    Slides(bool),
    /// held
    Sticks,
}

/// Friction of one joint of the tree.
#[derive(Debug, Clone, Copy)]
pub struct Friction {
    /// viscous, N m s/rad or N s/m
    pub viscous: f64,
    /// Coulomb, N m or N
    pub coulomb: f64,
    /// constant torque
    pub offset: f64,
    /// breakaway of the nominal model
    pub stribeck: Stribeck,
    /// the rest
    pub effect: JointEffect,
}

impl Friction {
    /// Whether there is dry friction at all.
    pub fn is_dry(&self) -> bool {
        self.coulomb > 0.0
            || self.stribeck.force > 0.0
            || self.effect.stribeck > 0.0
            || self.effect.load_friction > 0.0
            || self.effect.asymmetry != 0.0
    }

    /// Dry friction against a motion in this direction at speed `v` under the torque `tau`; never
    /// negative.
    pub fn dry(&self, positive: bool, v: f64, tau: f64) -> f64 {
        let e = &self.effect;
        let side = if positive { 0.5 } else { -0.5 };
        let more = Stribeck {
            force: e.stribeck,
            velocity: e.stribeck_velocity,
            fit: false,
        };
        let peak = self.stribeck.level(v) + more.level(v);
        (self.coulomb + side * e.asymmetry + peak + e.load_friction * tau.abs()).max(0.0)
    }

    /// What is smooth: viscous, quadratic, offset.
    pub fn smooth(&self, v: f64) -> f64 {
        self.viscous * v + self.effect.quadratic * v * v.abs() + self.offset
    }
}

/// Forces `f` of the sticking joints: minimises `½ fᵀ A f − bᵀ f` in the box
/// `low_j ≤ f_j ≤ high_j`. `A` is positive semidefinite.
pub fn hold(a: &DMatrix<f64>, b: &DVector<f64>, low: &[f64], high: &[f64]) -> DVector<f64> {
    let n = b.len();
    let mut f = DVector::zeros(n);
    // the usual case first: all are held
    if let Some(free) = a.clone().cholesky().map(|c| c.solve(b))
        && (0..n).all(|j| free[j] >= low[j] && free[j] <= high[j])
    {
        return free;
    }
    let scale = b.amax().max(f64::MIN_POSITIVE);
    for _ in 0..400 {
        let mut change = 0.0f64;
        for j in 0..n {
            if a[(j, j)] <= 0.0 {
                continue;
            }
            let residual = b[j] - a.row(j).transpose().dot(&f);
            let next = (f[j] + residual / a[(j, j)]).clamp(low[j], high[j]);
            change = change.max((next - f[j]).abs() * a[(j, j)]);
            f[j] = next;
        }
        if change <= 1e-13 * scale {
            break;
        }
    }
    f
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn held_joints_do_not_accelerate_and_broken_ones_are_at_their_bound() {
        let a = DMatrix::from_row_slice(3, 3, &[4.0, 1.5, 0.2, 1.5, 2.0, -0.4, 0.2, -0.4, 1.0]);
        let b = DVector::from_column_slice(&[1.0, -9.0, 0.3]);
        let bound = [2.0, 1.0, 5.0];
        let f = hold(&a, &b, &bound.map(|x| -x), &bound);
        let acceleration = &b - &a * &f;
        assert!((f[1] + 1.0).abs() < 1e-12 && acceleration[1] < 0.0);
        assert!(acceleration[0].abs() < 1e-10 && acceleration[2].abs() < 1e-10);
        let wide = [100.0; 3];
        let f = hold(&a, &b, &wide.map(|x| -x), &wide);
        assert!((&b - &a * &f).amax() < 1e-12);
    }

    #[test]
    fn more_sticking_joints_than_freedoms_are_settled() {
        // two brakes on one shaft
        let a = DMatrix::from_element(2, 2, 2.0);
        let b = DVector::from_element(2, 3.0);
        let f = hold(&a, &b, &[-1.0, -1.0], &[1.0, 1.0]);
        assert!((&b - &a * &f).amax() < 1e-9);
    }
}
