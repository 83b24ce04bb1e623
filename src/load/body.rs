//! The load as a body: from its ten parameters to mass, centre of mass and tensor, with standard
//! deviations, and to the nearest body that can exist.

use crate::conic::{Problem, Settings};
use crate::error::Result;
use crate::robot::Inertia;
use crate::robot::inertia::Quantities;
use faer::Mat;
use nalgebra::SymmetricEigen;

/// A load with its uncertainty.
#[derive(Debug, Clone, serde::Serialize)]
pub struct LoadBody {
    /// the ten parameters about the origin of the frame
    pub inertia: Inertia,
    /// their covariance, 10 × 10; rows and columns of what was not identified are zero
    #[serde(serialize_with = "crate::output::rows")]
    pub covariance: Mat<f64>,
    /// which of the ten were identified
    pub known: [bool; 10],
    /// whether the estimate itself is a body that can exist
    pub consistent: bool,
    /// whether it was moved to the nearest body that can exist
    pub projected: bool,
}

impl LoadBody {
    /// From an estimate; moved to the nearest body that can exist where it is none and `consistent`
    /// asks for that.
    ///
    /// # Errors
    /// A covariance that is not finite.
    pub fn new(
        inertia: Inertia,
        covariance: Mat<f64>,
        known: [bool; 10],
        consistent: bool,
    ) -> Result<Self> {
        let all = known.iter().all(|k| *k);
        let lowest = SymmetricEigen::new(inertia.pseudo_inertia())
            .eigenvalues
            .min();
        let size = inertia.pseudo_inertia().norm();
        let possible = lowest >= -1e-9 * size;
        let mut body = LoadBody {
            inertia,
            covariance,
            known,
            consistent: possible,
            projected: false,
        };
        if all && !possible && consistent {
            body.inertia = nearest(&inertia, &body.covariance)?;
            body.projected = true;
        }
        Ok(body)
    }

    /// Mass, centre of mass and tensor.
    pub fn values(&self) -> Quantities {
        self.inertia.quantities()
    }

    /// Their standard deviations, to first order.
    pub fn stds(&self) -> Quantities {
        let slopes = self.inertia.quantity_slopes();
        std::array::from_fn(|i| {
            let mut variance = 0.0;
            for a in 0..10 {
                for b in 0..10 {
                    variance += slopes[i][a] * self.covariance[(a, b)] * slopes[i][b];
                }
            }
            variance.max(0.0).sqrt()
        })
    }
}

/// The body that can exist nearest to an estimate: least `(φ − φ̂)ᵀ C⁻¹ (φ − φ̂)` with a positive
/// semidefinite pseudo-inertia (Wensing, Kim & Slotine 2018), a semidefinite program.
fn nearest(inertia: &Inertia, covariance: &Mat<f64>) -> Result<Inertia> {
    let n = 10;
    // scaled so that all unknowns are of the size of their standard deviations
    let floor = (0..n).map(|k| covariance[(k, k)]).fold(0.0f64, f64::max) * 1e-16;
    let scale: Vec<f64> = (0..n)
        .map(|k| covariance[(k, k)].max(floor).sqrt().max(1e-12))
        .collect();
    let scaled = Mat::from_fn(n, n, |a, b| {
        let ridge = if a == b { 1e-9 } else { 0.0 };
        covariance[(a, b)] / (scale[a] * scale[b]) + ridge
    });
    let information = {
        use faer::linalg::solvers::DenseSolveCore;
        scaled.partial_piv_lu().inverse()
    };
    let mut problem = Problem::new(n);
    problem.quadratic_matrix(information.as_ref());
    let dense = |phi: &Inertia| {
        let j = phi.pseudo_inertia();
        Mat::from_fn(4, 4, |a, b| j[(a, b)])
    };
    let a0 = dense(inertia);
    let steps: Vec<Mat<f64>> = (0..n)
        .map(|k| {
            let mut phi = [0.0; 10];
            phi[k] = scale[k];
            dense(&Inertia(phi))
        })
        .collect();
    let terms: Vec<_> = steps
        .iter()
        .enumerate()
        .map(|(k, a)| (k, a.as_ref()))
        .collect();
    problem.semidefinite(a0.as_ref(), &terms);
    let solution = problem.solve(&Settings::default())?;
    if !solution.status.is_solved() {
        return Ok(*inertia);
    }
    Ok(Inertia(std::array::from_fn(|k| {
        inertia.0[k] + scale[k] * solution.x[k]
    })))
}

/// A load from total and platform, both about the same point: parameters add.
pub fn difference(total: &Inertia, platform: &Inertia) -> Inertia {
    Inertia(std::array::from_fn(|k| total.0[k] - platform.0[k]))
}
