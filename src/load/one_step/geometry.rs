//! Joints of the legs that are not where the robot file says, as far as the records show them.
//!
//! With the columns `G` that `mechanism::deformed` gives for the deviations `g` of all legs, torques are
//!
//! ```text
//! y = A β + G g + ε        g ~ N(0, s²)        ε: the noise that the residual shows
//! ```
//!
//! The records tell `s` themselves. With `G⊥ = (1 − QQᵀ) G`, what the other columns leave of `G`, the residual `e` and its
//! power `S` over frequency, `G⊥ᵀS⁻¹G⊥ = U diag(λ) Uᵀ` and `z = Uᵀ G⊥ᵀ S⁻¹ e`, the logarithm of the likelihood of `s` is,
//! but for a constant,
//!
//! ```text
//! L(s) = ½ Σ_k [ s² z_k² / (1 + s² λ_k) − ln(1 + s² λ_k) ]
//! ```
//!
//! Where its largest value is more than chance would give, the deviations become unknowns with that standard deviation
//! a priori: the estimate then counts what the records tell of them, and its covariance what they do not.

use super::reweight::Fit;
use super::solver::{Geometry, Solver};
use super::ten;
use crate::error::{Result, Warning, WarningKind};
use crate::load::system::Part;
use crate::plant::Plant;
use faer::Mat;
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;

/// Grid of `s`: from a micrometre to a centimetre.
const LEAST: f64 = 1e-6;
const MOST: f64 = 1e-2;
const STEP: f64 = 1.1;
/// `2 L` that chance exceeds once in a hundred: half of `χ²` with one degree of freedom, since `s` cannot be negative.
const CHANCE: f64 = 5.41;

/// Deviations below which nothing is said, m: they count as unknowns all the same. Friction where joints linger near standstill
/// looks like geometry: 23 of 24 sound machines of a simulator that is not this one (`tests/data/hexapod.py`) seemed to be off by
/// 0.04 to 0.41 mm on designed motions, those that were off by 0.5 mm by 0.49 to 0.72 mm.
const NAMED: f64 = 4.5e-4;

/// Rounds: the second has a residual without the deviations, and with it a power that is that of the noise.
const ROUNDS: usize = 2;

/// Makes the deviations of the legs unknowns of another solver, where the residual of this solution shows them. `again`
/// solves with it.
///
/// # Errors
/// Poses that cannot be reached; signals that are not finite.
pub fn refined<'a>(
    plant: &Plant,
    first: Fit<'a>,
    again: &dyn Fn(Option<Geometry>) -> Result<Fit<'a>>,
) -> Result<Fit<'a>> {
    if plant.deviations() == 0 || first.exact() {
        return Ok(first);
    }
    let mut fit = first;
    for _ in 0..ROUNDS {
        let columns = columns(plant, &fit)?;
        let power = fit.solver.power(&|p, i| fit.deviation(p, i))?;
        let geometry = fit.solver.geometry.take();
        let (gram, seen) = fit
            .solver
            .beside(&|p, i| fit.deviation(p, i), &columns, &power)?;
        let Some(spread) = spread(gram, &seen) else {
            fit.solver.geometry = geometry;
            break;
        };
        fit = again(Some(Geometry { columns, spread }))?;
    }
    Ok(fit)
}

/// What is to be said where they are unknowns.
pub fn warning(solver: &Solver) -> Option<Warning> {
    let found = solver.geometry.as_ref().filter(|g| g.spread >= NAMED)?;
    Some(Warning::new(
        WarningKind::GeometrySuspect,
        "legs",
        format!(
            "what the model leaves of the forces looks like joints of the legs that are {:.2} mm from where the robot file says \
             (standard deviation of each coordinate and length). They count as unknowns, so the load is known less well; \
             other errors of the legs, and friction where joints turn, can look the same: measure the geometry \
             (`excite calibrate`)",
            1e3 * found.spread
        ),
    ))
}

/// Columns of the deviations, record by record, about the load and the platform of a solution.
fn columns(plant: &Plant, fit: &Fit) -> Result<Vec<Mat<f64>>> {
    let (load, _) = ten::values(&fit.solver, &fit.solution, &fit.covariance);
    let platform = ten::platform(fit.solver.system, &fit.solution);
    let values = plant.values();
    let of = |part: &Part| {
        let body: [f64; 10] = std::array::from_fn(|k| match part.loaded {
            true => platform[k] + load[k],
            false => platform[k],
        });
        let changes = plant.deformations(&part.motion, part.step(), &values, Some(&body))?;
        Ok(Mat::from_fn(part.y.len(), changes.len(), |r, c| {
            changes[c][r]
        }))
    };
    fit.solver.system.parts.par_iter().map(of).collect()
}

/// Standard deviation of the deviations that the records show, m; `None` where they show none.
fn spread(gram: DMatrix<f64>, seen: &DVector<f64>) -> Option<f64> {
    let e = SymmetricEigen::try_new(gram, 1e-12, 1000)?;
    let z = e.eigenvectors.transpose() * seen;
    let twice = |s: f64| -> f64 {
        let each = e.eigenvalues.iter().zip(z.iter());
        each.map(|(l, z)| {
            let ratio = 1.0 + s * s * l.max(0.0);
            s * s * z * z / ratio - ratio.ln()
        })
        .sum()
    };
    let steps = (MOST / LEAST).ln() / STEP.ln();
    let grid = (0..=steps as i32).map(|k| LEAST * STEP.powi(k));
    let best = grid
        .map(|s| (twice(s), s))
        .max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0.is_finite() && best.0 > CHANCE).then_some(best.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::record::normal;
    use rand::SeedableRng;

    #[test]
    fn a_spread_is_found_where_there_is_one() {
        let mut r = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let n = 42;
        let gram = DMatrix::from_fn(n, n, |i, k| match i == k {
            true => 1e8 / (1 + i * i) as f64,
            false => 0.0,
        });
        let mut seen = |s: f64| {
            DVector::from_fn(n, |i, _| {
                let l: f64 = gram[(i, i)];
                l * s * normal(&mut r) + l.sqrt() * normal(&mut r)
            })
        };
        let found = spread(gram.clone(), &seen(1e-3)).unwrap();
        assert!((0.7e-3..1.4e-3).contains(&found), "{found}");
        let claimed = (0..200).filter(|_| spread(gram.clone(), &seen(0.0)).is_some());
        let claimed = claimed.count();
        assert!(claimed <= 8, "{claimed} of 200");
    }
}
