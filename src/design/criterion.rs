//! What a design minimises, and its local model for the conic subproblem.
//!
//! All criteria are functions of the eigenvalues `λ_1 ≥ … ≥ λ_r` of the information matrix `Λ_s`
//! (`Λ`, or `Λ` scaled to a unit diagonal for the column-normalised condition number), taken as
//! logarithms so that steps and tolerances mean the same for all of them:
//!
//! | criterion | `f` | minimised |
//! |---|---|---|
//! | condition | `½ ln(λ_1/λ_r)` | `cond(W)` |
//! | D | `−½ ln det Λ_s / r` | volume of the confidence ellipsoid, per axis |
//! | A | `½ ln(tr Λ_s⁻¹ / r)` | root mean square of the standard deviations |
//! | E | `−½ ln λ_r` | longest axis of the ellipsoid |
//! | known | `ln Σ ρ_i⁴/(1 + ρ_i⁴)` | parameters that will not be known |
//!
//! The last one ([`Targets`]) asks for what a user counts: parameters whose standard deviation is small
//! **beside their value**. It is no function of eigenvalues alone, but as smooth as D and A.
//!
//! D, A and known are smooth where `Λ_s` is regular. `λ_1` and `λ_r` are not where eigenvalues meet, and at
//! an optimum several do. There the **matrix** that the group of extreme eigenvalues lives in is
//! linearised instead of the eigenvalue (Overton 1992): with `U` the eigenvectors of the `s`
//! smallest ones,
//!
//! ```text
//! λ_r(x + d) ≈ max b  subject to  Uᵀ(Λ_s + Σ_k d_k ∂Λ_s/∂x_k) U ⪰ b 1
//! ```
//!
//! which is exact to first order whatever their multiplicity, and a semidefinite cone of order
//! `s` in the subproblem. Likewise for the largest.

use super::information::{Evaluation, Information};
pub use super::targets::Targets;
use crate::error::{Error, Result};
use crate::plant::Plant;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// What is minimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Criterion {
    /// ratio of the largest to the smallest singular value
    #[default]
    Condition,
    /// determinant of the information matrix (maximised)
    D,
    /// trace of its inverse
    A,
    /// smallest eigenvalue (maximised)
    E,
    /// base parameters known to 10 % of their nominal value, by prior and motion together
    Known,
}

impl Criterion {
    /// Harmonics where none are asked for: fast ones excite the small links, and one parameter more becomes known. The
    /// others stay with five, as the literature has them.
    pub fn harmonics(self) -> usize {
        match self {
            Criterion::Known => 8,
            _ => 5,
        }
    }
}

/// Which matrix the eigenvalues are taken of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Condition {
    /// non-zero singular values of the regressor of all standard parameters: does not depend on
    /// the choice of base parameters
    #[default]
    Invariant,
    /// columns kept as base parameters
    Raw,
    /// the same with unit columns
    Normalised,
    /// the same with rows divided by the torque noise
    Weighted,
}

impl Condition {
    /// What is usual for a plant: the invariant condition number of a tree; unit columns for a closed
    /// chain, whose parameters differ by many orders of magnitude in size.
    pub fn usual(plant: &Plant) -> Self {
        match plant.closed() {
            false => Condition::Invariant,
            true => Condition::Normalised,
        }
    }
}

/// Group of extreme eigenvalues: `A_0 + Σ_k δ_k A_k`, in units of the extreme one.
#[derive(Debug, Clone)]
pub struct Cluster {
    /// eigenvalues over the extreme one, the extreme one (1) first
    pub values: Vec<f64>,
    /// for each pair `(a, b)`, `a ≤ b`, column by column, the gradient of entry `(a, b)`
    pub gradients: Vec<Vec<f64>>,
}

/// First-order model of the criterion around a point.
#[derive(Debug, Clone)]
pub struct Model {
    /// value of the criterion (logarithmic)
    pub value: f64,
    /// gradient of the smooth part
    pub gradient: Vec<f64>,
    /// largest eigenvalues
    pub upper: Option<Cluster>,
    /// smallest eigenvalues
    pub lower: Option<Cluster>,
}

/// Eigenvalues (ascending), eigenvectors and scaling of the matrix judged.
pub struct Spectrum {
    /// ascending
    pub values: Vec<f64>,
    vectors: Mat<f64>,
    /// `1/√G_kk` where normalised, 1 otherwise
    scale: Vec<f64>,
    normalised: bool,
    /// of the matrix judged, where known parameters are counted
    inverse: Option<Mat<f64>>,
}

/// Objective: criterion and matrix.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Objective {
    /// what is minimised
    pub criterion: Criterion,
    /// of which matrix
    pub condition: Condition,
    /// accuracies that are asked for, where the criterion is about these
    pub targets: Option<Targets>,
}

/// Most eigenvalues in a cluster at the small end, where they crowd.
const LOWER: usize = 6;
/// Most eigenvalues in a cluster at the large end.
const UPPER: usize = 3;
/// Eigenvalues within this factor of the extreme one can meet it in one step.
const REACH: f64 = 2.5;

impl Objective {
    /// Spectrum of the matrix at an evaluated point.
    ///
    /// # Errors
    /// When the eigenvalues do not converge (numbers that are not finite).
    pub fn spectrum(&self, gram: &Mat<f64>) -> Result<Spectrum> {
        let r = gram.nrows();
        let known = self.targets.as_ref();
        let normalised = known.is_none() && self.condition == Condition::Normalised;
        let scale: Vec<f64> = (0..r)
            .map(|k| match (normalised, known) {
                (_, Some(t)) => t.scale[k],
                (true, None) => 1.0 / gram[(k, k)].max(f64::MIN_POSITIVE).sqrt(),
                (false, None) => 1.0,
            })
            .collect();
        let prior = |i: usize| known.map_or(0.0, |t| t.prior[i]);
        let m = Mat::from_fn(r, r, |i, j| {
            gram[(i, j)] * scale[i] * scale[j] + if i == j { prior(i) } else { 0.0 }
        });
        let failed = || {
            Error::Infeasible("the eigenvalues of the information matrix did not converge".into())
        };
        let eigen = m.self_adjoint_eigen(Side::Lower).map_err(|_| failed())?;
        let inverse = match known {
            Some(_) => {
                let factor = m.llt(Side::Lower).map_err(|_| failed())?;
                Some(factor.solve(Mat::<f64>::identity(r, r)))
            }
            None => None,
        };
        Ok(Spectrum {
            values: (0..r).map(|k| eigen.S().column_vector()[k]).collect(),
            vectors: eigen.U().to_owned(),
            scale,
            normalised,
            inverse,
        })
    }

    /// Value of the criterion, logarithmic; infinite where the matrix is singular.
    pub fn value(&self, spectrum: &Spectrum) -> f64 {
        let l = &spectrum.values;
        let (r, low, high) = (l.len() as f64, l[0], l[l.len() - 1]);
        if low.is_nan() || low <= 0.0 || low < 1e-15 * high {
            return f64::INFINITY;
        }
        if let Some(targets) = &self.targets {
            return targets.value(&spectrum.variances());
        }
        match self.criterion {
            Criterion::Condition => 0.5 * (high / low).ln(),
            Criterion::D => -0.5 * l.iter().map(|x| x.ln()).sum::<f64>() / r,
            Criterion::A => 0.5 * (l.iter().map(|x| 1.0 / x).sum::<f64>() / r).ln(),
            Criterion::E => -0.5 * low.ln(),
            // never without accuracies that are asked for
            Criterion::Known => f64::INFINITY,
        }
    }

    /// The criterion with its extreme eigenvalues smoothed by p-norms,
    /// `λ_1 ≈ (Σ λ^p)^{1/p}`, `1/λ_r ≈ (Σ λ^{-p})^{1/p}`; D and A as they are. Infinite where
    /// the information matrix is singular.
    pub fn smooth_value(&self, s: &Spectrum, p: f64) -> f64 {
        let l = &s.values;
        let (low, high) = (l[0], l[l.len() - 1]);
        if !self.value(s).is_finite() {
            return f64::INFINITY;
        }
        if let Some(targets) = &self.targets {
            return targets.smooth_value(&s.variances(), p);
        }
        let upper = || high.ln() + l.iter().map(|x| (x / high).powf(p)).sum::<f64>().ln() / p;
        let lower = || low.ln() - l.iter().map(|x| (low / x).powf(p)).sum::<f64>().ln() / p;
        match self.criterion {
            Criterion::Condition => 0.5 * (upper() - lower()),
            Criterion::E => -0.5 * lower(),
            _ => self.value(s),
        }
    }

    /// Gradient of [`Objective::smooth_value`] at a point that was just evaluated.
    pub fn smooth_gradient(
        &self,
        info: &Information,
        e: &mut Evaluation,
        s: &Spectrum,
        p: f64,
    ) -> Vec<f64> {
        let l = &s.values;
        let r = l.len();
        if let Some(targets) = &self.targets {
            return s.target_gradient(info, e, targets, p);
        }
        let (low, high) = (l[0], l[r - 1]);
        let up: Vec<f64> = l.iter().map(|x| (x / high).powf(p)).collect();
        let down: Vec<f64> = l.iter().map(|x| (low / x).powf(p)).collect();
        let (su, sd) = (up.iter().sum::<f64>(), down.iter().sum::<f64>());
        let total: f64 = l.iter().map(|l| 1.0 / l).sum();
        let weights: Vec<f64> = (0..r)
            .map(|k| match self.criterion {
                Criterion::Condition => 0.5 * (up[k] / su - down[k] / sd) / l[k],
                Criterion::E => -0.5 * down[k] / sd / l[k],
                Criterion::D => -0.5 / (r as f64 * l[k]),
                _ => -0.5 / (total * l[k] * l[k]),
            })
            .collect();
        let list: Vec<usize> = (0..r)
            .filter(|&k| (weights[k] * l[k]).abs() > 1e-5)
            .collect();
        let mut vectors: Vec<Vec<f64>> = list.iter().map(|&k| s.vector(&[k, k])).collect();
        let mut w: Vec<f64> = list.iter().map(|&k| weights[k]).collect();
        if s.normalised {
            for k in 0..r {
                let mut u = vec![0.0; r];
                u[k] = s.scale[k];
                vectors.push(u);
                w.push(
                    -list
                        .iter()
                        .map(|&a| weights[a] * l[a] * s.vectors[(k, a)].powi(2))
                        .sum::<f64>(),
                );
            }
        }
        let matrix = Mat::from_fn(r, vectors.len(), |i, k| vectors[k][i]);
        let g = info.quadratic_gradients(e, matrix.as_ref());
        (0..info.len())
            .map(|x| (0..w.len()).map(|k| w[k] * g[(x, k)]).sum())
            .collect()
    }

    /// Value only: what a trial point costs.
    pub fn evaluate(&self, info: &Information, x: &[f64], e: &mut Evaluation) -> f64 {
        info.evaluate(x, e);
        self.spectrum(&e.gram)
            .map_or(f64::INFINITY, |s| self.value(&s))
    }

    /// Model at a point that was just evaluated.
    pub fn model(&self, info: &Information, e: &mut Evaluation, s: &Spectrum) -> Model {
        let r = s.values.len();
        let value = self.value(s);
        let wants = |c: &[Criterion]| c.contains(&self.criterion);
        let lower = wants(&[Criterion::Condition, Criterion::E]).then(|| s.near(false, LOWER));
        let upper = wants(&[Criterion::Condition]).then(|| s.near(true, UPPER));
        // vectors whose quadratic forms are to be differentiated
        let mut vectors: Vec<Vec<f64>> = Vec::new();
        let mut cluster = |list: &Vec<usize>| {
            let first = vectors.len();
            for (b, &j) in list.iter().enumerate() {
                for &i in &list[..=b] {
                    vectors.push(s.vector(&[i, j]));
                }
            }
            first
        };
        let at_lower = lower.as_ref().map(&mut cluster);
        let at_upper = upper.as_ref().map(&mut cluster);
        let smooth = vectors.len();
        let smooth_weights: Vec<f64> = match self.criterion {
            Criterion::D => s.values.iter().map(|l| -0.5 / (r as f64 * l)).collect(),
            Criterion::A => {
                let total: f64 = s.values.iter().map(|l| 1.0 / l).sum();
                s.values.iter().map(|l| -0.5 / (total * l * l)).collect()
            }
            _ => Vec::new(),
        };
        (0..smooth_weights.len()).for_each(|k| vectors.push(s.vector(&[k, k])));
        let units = vectors.len();
        if s.normalised {
            vectors.extend((0..r).map(|k| {
                let mut u = vec![0.0; r];
                u[k] = s.scale[k];
                u
            }));
        }
        let matrix = Mat::from_fn(r, vectors.len(), |i, k| vectors[k][i]);
        let g = info.quadratic_gradients(e, matrix.as_ref());
        // gradient of v_iᵀ M v_j from those of v_iᵀGv_i, v_jᵀGv_j and (v_i+v_j)ᵀG(v_i+v_j); a unit
        // diagonal adds −½ (λ_i + λ_j) Σ_k v_ik v_jk ∂ln G_kk
        let n = info.len();
        let entry = |both: usize, own: [usize; 2], [i, j]: [usize; 2]| -> Vec<f64> {
            let mut out: Vec<f64> = match i == j {
                true => (0..n).map(|x| g[(x, both)]).collect(),
                false => (0..n)
                    .map(|x| 0.5 * (g[(x, both)] - g[(x, own[0])] - g[(x, own[1])]))
                    .collect(),
            };
            if s.normalised {
                let sum = s.values[i] + s.values[j];
                for k in 0..r {
                    let f = -0.5 * sum * s.vectors[(k, i)] * s.vectors[(k, j)];
                    (0..n).for_each(|x| out[x] += f * g[(x, units + k)]);
                }
            }
            out
        };
        let build = |list: Option<Vec<usize>>, first: Option<usize>| -> Option<Cluster> {
            let (list, first) = (list?, first?);
            let reference = s.values[list[0]];
            let diagonal = |a: usize| first + a * (a + 1) / 2 + a;
            let mut gradients = Vec::new();
            for b in 0..list.len() {
                for a in 0..=b {
                    let both = first + b * (b + 1) / 2 + a;
                    let mut d = entry(both, [diagonal(a), diagonal(b)], [list[a], list[b]]);
                    d.iter_mut().for_each(|x| *x /= reference);
                    gradients.push(d);
                }
            }
            let values = list.iter().map(|&k| s.values[k] / reference).collect();
            Some(Cluster { values, gradients })
        };
        let lower = build(lower, at_lower);
        let upper = build(upper, at_upper);
        let mut gradient = vec![0.0; n];
        for (k, w) in smooth_weights.iter().enumerate() {
            let d = entry(smooth + k, [smooth + k; 2], [k, k]);
            gradient.iter_mut().zip(d).for_each(|(g, d)| *g += w * d);
        }
        Model {
            value,
            gradient,
            upper,
            lower,
        }
    }
}

impl Spectrum {
    /// Diagonal of the inverse matrix: `ρ_i²` of [`Targets`].
    fn variances(&self) -> Vec<f64> {
        let Some(inverse) = &self.inverse else {
            return Vec::new();
        };
        (0..inverse.nrows()).map(|i| inverse[(i, i)]).collect()
    }

    /// Gradient of what [`Targets`] make of the variances: `∂ρ_i² = −u_iᵀ ∂Λ u_i` with `u_i` column `i` of the inverse,
    /// scaled.
    fn target_gradient(
        &self,
        info: &Information,
        e: &mut Evaluation,
        targets: &Targets,
        p: f64,
    ) -> Vec<f64> {
        let Some(inverse) = &self.inverse else {
            return vec![0.0; info.len()];
        };
        let slopes = targets.slopes(&self.variances(), p);
        let judged: Vec<usize> = (0..slopes.len()).filter(|&i| slopes[i] != 0.0).collect();
        let columns = Mat::from_fn(inverse.nrows(), judged.len(), |row, i| {
            inverse[(row, judged[i])] * self.scale[row]
        });
        let g = info.quadratic_gradients(e, columns.as_ref());
        (0..info.len())
            .map(|x| {
                let all = judged.iter().enumerate();
                all.map(|(i, &k)| -slopes[k] * g[(x, i)]).sum()
            })
            .collect()
    }

    /// Indices of the extreme eigenvalues that a step may bring together.
    fn near(&self, largest: bool, most: usize) -> Vec<usize> {
        let r = self.values.len();
        let at = |k: usize| if largest { r - 1 - k } else { k };
        let extreme = self.values[at(0)];
        (0..r.min(most))
            .map(at)
            .take_while(|&k| {
                let ratio = self.values[k] / extreme;
                if largest {
                    ratio * REACH >= 1.0
                } else {
                    ratio <= REACH
                }
            })
            .collect()
    }

    /// `v_i`, or `v_i + v_j`, in the coordinates of `Λ`.
    fn vector(&self, [i, j]: &[usize; 2]) -> Vec<f64> {
        (0..self.scale.len())
            .map(|k| {
                let v = self.vectors[(k, *i)];
                (if i == j { v } else { v + self.vectors[(k, *j)] }) * self.scale[k]
            })
            .collect()
    }
}
