//! The load as a body: from its ten parameters to mass, centre of mass and tensor, with standard
//! deviations, and to the nearest body that can exist.

use crate::conic::{Problem, Settings};
use crate::error::Result;
use crate::robot::Inertia;
use faer::Mat;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

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

/// Mass, centre of mass and tensor about it: the quantities of `load.json`, xx, xy, xz, yy, yz, zz.
pub type Quantities = [f64; 10];

/// Mass, centre of mass, tensor about the centre of mass from the ten parameters.
pub fn quantities(inertia: &Inertia) -> Quantities {
    let c = inertia.com().unwrap_or_else(Vector3::zeros);
    let i = inertia.tensor_com();
    [
        inertia.mass(),
        c.x,
        c.y,
        c.z,
        i.m11,
        i.m12,
        i.m13,
        i.m22,
        i.m23,
        i.m33,
    ]
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
        quantities(&self.inertia)
    }

    /// Their standard deviations, to first order.
    pub fn stds(&self) -> Quantities {
        let base = self.inertia.0;
        let scale = base.iter().fold(0.0f64, |m, v| m.max(v.abs())).max(1e-12);
        // gradient by central differences: the map is a low-order rational function
        let columns: Vec<Quantities> = (0..10)
            .map(|k| {
                let h = 1e-6 * scale;
                let at = |s: f64| {
                    let mut p = base;
                    p[k] += s * h;
                    quantities(&Inertia(p))
                };
                let (up, down) = (at(1.0), at(-1.0));
                std::array::from_fn(|i| (up[i] - down[i]) / (2.0 * h))
            })
            .collect();
        std::array::from_fn(|i| {
            let mut variance = 0.0;
            for a in 0..10 {
                for b in 0..10 {
                    variance += columns[a][i] * self.covariance[(a, b)] * columns[b][i];
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

/// Ten parameters from mass, centre of mass and the six entries of the tensor about it.
pub fn from_quantities(v: &Quantities) -> Inertia {
    let tensor = Matrix3::new(v[4], v[5], v[6], v[5], v[7], v[8], v[6], v[8], v[9]);
    Inertia::from_com(v[0], Vector3::new(v[1], v[2], v[3]), tensor)
}
