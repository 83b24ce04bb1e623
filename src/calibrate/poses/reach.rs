//! Joint readings that bring a frame to a point, or two arms together.

use crate::calibrate::frame::{Frame, log};
use crate::calibrate::serial::{Arm, Posed};
use nalgebra::{DMatrix, DVector, Vector3};

/// Steps that are taken.
const STEPS: usize = 30;
/// How near counts as reached, m and rad.
const REACHED: f64 = 1e-9;
/// Longest step, m and rad.
const LONG: f64 = 0.2;

/// Where the frames are wanted.
pub enum Wanted {
    /// the frame's origin in a point of the base
    Point(Vector3<f64>),
    /// the second arm's frame there in the first
    Grip(Frame),
}

impl Wanted {
    /// What is missing, and its change by the joints.
    fn gap(&self, arm: &Arm, q: &[f64], x: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        let Posed { frame, jacobian } = arm.by_joints(0, q, x);
        match self {
            Wanted::Point(p) => {
                let gap = p - frame.p;
                (
                    DVector::from_column_slice(gap.as_slice()),
                    jacobian.rows(0, 3).into_owned(),
                )
            }
            Wanted::Grip(grip) => {
                let other = arm.by_joints(1, q, x);
                let held = frame.then(grip);
                let shift = held.p - other.frame.p;
                let turn = log(&(held.r * other.frame.r.transpose()));
                let mut j = other.jacobian - &jacobian;
                let lever = grip.p;
                for (k, column) in jacobian.column_iter().enumerate() {
                    let turn = Vector3::new(column[3], column[4], column[5]);
                    let swing = turn.cross(&(frame.r * lever));
                    for i in 0..3 {
                        j[(i, k)] -= swing[i];
                    }
                }
                let all = shift.iter().chain(turn.iter()).copied();
                (DVector::from_iterator(6, all), j)
            }
        }
    }
}

/// Least steps by the Jacobian, at the errors `x` of the geometry; `None` where they lead nowhere.
pub fn reach(arm: &Arm, q: &mut [f64], x: &[f64], wanted: &Wanted) -> Option<()> {
    for _ in 0..STEPS {
        let (gap, j) = wanted.gap(arm, q, x);
        let size = gap.norm();
        if size < REACHED {
            return Some(());
        }
        let n = gap.len();
        let jt = j.transpose();
        let square: DMatrix<f64> = &j * &jt + DMatrix::identity(n, n) * 1e-8;
        let step = jt * square.cholesky()?.solve(&(gap * (LONG / size).min(1.0)));
        for (v, d) in q.iter_mut().zip(step.iter()) {
            *v += d;
        }
    }
    None
}
