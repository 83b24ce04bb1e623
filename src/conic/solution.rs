//! What a conic program came to: status, point and multipliers.

use std::f64::consts::FRAC_1_SQRT_2;
use std::ops::Range;

use clarabel::solver::SolverStatus;
use faer::Mat;

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Solved to the tolerances.
    Solved,
    /// Stopped short of the tolerances with a gap below 5e-5 and residuals below 1e-4.
    AlmostSolved,
    /// No point satisfies the rows; `z` is a certificate of it.
    Infeasible,
    /// The objective falls without end, or the rows of the dual contradict; `x` is a direction.
    Unbounded,
    /// A limit was reached or the numerics broke down; `x` is the last point and proves nothing.
    Failed,
}

impl Status {
    /// Whether `x` is a solution, be it to the reduced accuracy.
    pub fn is_solved(self) -> bool {
        matches!(self, Status::Solved | Status::AlmostSolved)
    }

    pub(super) fn of(status: SolverStatus) -> Self {
        match status {
            SolverStatus::Solved => Status::Solved,
            SolverStatus::AlmostSolved => Status::AlmostSolved,
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => {
                Status::Infeasible
            }
            SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible => Status::Unbounded,
            _ => Status::Failed,
        }
    }
}

/// One cone among the rows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cone {
    pub semidefinite: bool,
    /// rows of a second-order cone, order of the matrix of a semidefinite one
    pub order: usize,
    /// first row, counted from that of the first cone
    pub start: usize,
}

impl Cone {
    fn rows(&self) -> Range<usize> {
        let count = if self.semidefinite {
            self.order * (self.order + 1) / 2
        } else {
            self.order
        };
        self.start..self.start + count
    }
}

/// Point and multipliers of a conic program.
///
/// With the Lagrangian `½xᵀPx + qᵀx + zᵀ(A x − b)`, where `b − A x` are the slacks of all rows, the
/// multipliers of inequalities are `≥ 0`, those of a second-order cone lie in the cone, and those of
/// a semidefinite one are a matrix `Z ⪰ 0` with `−⟨Aₖ, Z⟩` in the `k`-th row of stationarity.
#[derive(Debug, Clone)]
pub struct Solution {
    /// how it ended
    pub status: Status,
    /// the point, one number a variable
    pub x: Vec<f64>,
    /// `½xᵀPx + qᵀx`; NaN if infeasible or unbounded
    pub objective: f64,
    /// the multipliers: equalities, inequalities and cones, each in the order they were added
    pub z: Vec<f64>,
    /// interior-point iterations
    pub iterations: u32,
    /// first row of the equalities, the inequalities and the cones
    pub(super) starts: [usize; 3],
    pub(super) cones: Vec<Cone>,
}

impl Solution {
    /// Multipliers of the equalities, of either sign.
    pub fn equalities(&self) -> &[f64] {
        &self.z[..self.starts[1]]
    }

    /// Multipliers of the inequalities, `≥ 0`.
    pub fn inequalities(&self) -> &[f64] {
        &self.z[self.starts[1]..self.starts[2]]
    }

    /// Multipliers of the rows of a cone (those of a semidefinite one packed); `None` if there is no
    /// such cone.
    pub fn cone(&self, number: usize) -> Option<&[f64]> {
        self.z[self.starts[2]..].get(self.cones.get(number)?.rows())
    }

    /// The matrix of multipliers of a semidefinite cone; `None` if that cone is none.
    pub fn matrix(&self, number: usize) -> Option<Mat<f64>> {
        let order = self
            .cones
            .get(number)
            .filter(|cone| cone.semidefinite)?
            .order;
        let packed = self.cone(number)?;
        Some(Mat::from_fn(order, order, |i, j| {
            let (i, j) = (i.min(j), i.max(j));
            packed[j * (j + 1) / 2 + i] * if i == j { 1.0 } else { FRAC_1_SQRT_2 }
        }))
    }
}
