//! The consistent estimate as a semidefinite program.
//!
//! With the distance from the prior quadratic (the metric of the pseudo-inertia cone at the nominal
//! body, "constant pullback", Lee, Wensing & Park 2020, sec. IV),
//!
//! ```text
//! minimise   ½ ‖C φ − d‖² + ½ γ Σ_bodies ‖J₀^{-½} (J − J₀) J₀^{-½}‖² + ½ γ Σ_terms ((x − x₀)/x₀)²
//! subject to J_i(φ) ⪰ ε J₀,i,    x ≥ 0
//! ```
//!
//! is a quadratic objective under linear matrix inequalities of order four, which [`crate::conic`]
//! solves. Unlike the entropic distance it lets estimates come to lie on the border.

use super::consistent::{Prior, unit};
use crate::conic::{Problem, Settings};
use crate::error::{Error, Result};
use faer::{Mat, MatRef};

/// Fraction of the nominal pseudo-inertia that the estimate keeps at least.
pub const MARGIN: f64 = 1e-3;

/// Solves the program; returns the standard parameters.
///
/// # Errors
/// When the solver does not come to an end.
pub fn solve(c: MatRef<'_, f64>, d: &[f64], prior: &Prior, gamma: f64) -> Result<Vec<f64>> {
    let p = prior.phi.len();
    let mut h = c.transpose() * c;
    let mut g: Vec<f64> = (0..p)
        .map(|j| -(0..c.nrows()).map(|i| c[(i, j)] * d[i]).sum::<f64>())
        .collect();
    // Hessian of the divergence at the prior is that of the quadratic distance
    let mut metric = Mat::<f64>::zeros(p, p);
    let mut none = vec![0.0; p];
    prior.add(&prior.phi, gamma, &mut none, &mut metric);
    h += &metric;
    for i in 0..p {
        g[i] -= (0..p).map(|j| metric[(i, j)] * prior.phi[j]).sum::<f64>();
    }
    // unknowns in units of their own, φ = s y, so that the interior-point steps are well scaled
    let s: Vec<f64> = (0..p).map(|i| 1.0 / h[(i, i)].max(1e-300).sqrt()).collect();
    let mut problem = Problem::new(p);
    for i in 0..p {
        for j in i..p {
            problem.quadratic(i, j, h[(i, j)] * s[i] * s[j]);
        }
        problem.linear(i, g[i] * s[i]);
    }
    for t in &prior.terms {
        problem.inequality([(t.unknown, -s[t.unknown] / t.nominal)], 0.0);
    }
    for b in &prior.bodies {
        // J₀^{-½} (J − ε J₀) J₀^{-½} ⪰ 0, in Cholesky's root
        let Some(root) = b.nominal.cholesky().and_then(|c| c.l().try_inverse()) else {
            continue;
        };
        let matrix = |m: nalgebra::Matrix4<f64>| Mat::from_fn(4, 4, |i, j| m[(i, j)]);
        let terms: Vec<(usize, Mat<f64>)> = (0..10)
            .filter_map(|k| {
                b.unknowns[k].map(|u| (u, matrix(root * unit(k) * root.transpose() * s[u])))
            })
            .collect();
        let refs: Vec<(usize, MatRef<'_, f64>)> =
            terms.iter().map(|(u, m)| (*u, m.as_ref())).collect();
        let constant = matrix(nalgebra::Matrix4::identity() * -MARGIN);
        problem.semidefinite(constant.as_ref(), &refs);
    }
    let solution = problem.solve(&Settings::default())?;
    if !solution.status.is_solved() {
        return Err(Error::Infeasible(format!(
            "the semidefinite program of the consistent estimate ended as {:?}",
            solution.status
        )));
    }
    let mut phi: Vec<f64> = (0..p).map(|i| s[i] * solution.x[i]).collect();
    // inequalities hold to the tolerance of the solver only
    for t in &prior.terms {
        phi[t.unknown] = phi[t.unknown].max(0.0);
    }
    Ok(phi)
}
