//! The rows as a linear problem in the columns of all effects, with the set-up eliminated.
//!
//! ```text
//! r(y) = r_0 + J y        G = Jᵀ J,  b = −Jᵀ r_0        set-up s eliminated:  G_cc − G_cs (G_ss + P_s⁻¹)⁻¹ G_sc
//! ```
//!
//! The logarithm of the evidence of a set of columns with a Gaussian prior `P`, up to a constant, is
//! `½ bᵀ (G + P⁻¹)⁻¹ b − ½ ln det(P G + 1)`.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Whitened rows in scaled columns.
#[derive(Debug, Clone)]
pub struct Lines {
    /// `Jᵀ J` of all columns
    pub gram: DMatrix<f64>,
    /// `−Jᵀ r_0`
    pub rhs: DVector<f64>,
    /// number of residuals
    pub count: usize,
}

/// The problem in the columns of effects alone.
#[derive(Debug, Clone)]
pub struct Problem {
    gram: DMatrix<f64>,
    rhs: DVector<f64>,
    /// number of residuals
    pub count: usize,
    /// number of unknowns of the set-up that the rows see
    pub set_up: usize,
}

/// Columns of one member, and the factor on their prior.
pub type Member<'a> = (&'a [usize], f64);

/// A set of members, fitted.
#[derive(Debug, Clone)]
pub struct Solved {
    /// logarithm of the evidence against no effect
    pub evidence: f64,
    /// values of the columns in the order of the members, in their scales
    pub mean: DVector<f64>,
    /// number of values that the rows decide
    pub decided: f64,
    factor: Cholesky<f64, nalgebra::Dyn>,
}

impl Solved {
    /// Standard deviation of a value.
    pub fn std(&self, k: usize) -> f64 {
        let n = self.mean.len();
        let unit = DVector::from_fn(n, |i, _| f64::from(u8::from(i == k)));
        self.factor.solve(&unit)[k].max(0.0).sqrt()
    }
}

impl Problem {
    /// Eliminates the set-up: the columns `set_up` with the inverse variances `precision`.
    pub fn new(lines: &Lines, set_up: &[usize], precision: &[f64]) -> Option<Self> {
        let n = lines.gram.nrows();
        let s = set_up.len();
        let mut inner = DMatrix::from_fn(s, s, |i, k| lines.gram[(set_up[i], set_up[k])]);
        for k in 0..s {
            inner[(k, k)] += precision[k];
        }
        let across = DMatrix::from_fn(s, n, |i, k| lines.gram[(set_up[i], k)]);
        let own = DVector::from_fn(s, |i, _| lines.rhs[set_up[i]]);
        let factor = inner.cholesky()?;
        let carried = factor.solve(&across);
        let at = factor.solve(&own);
        Some(Problem {
            gram: &lines.gram - across.tr_mul(&carried),
            rhs: &lines.rhs - across.tr_mul(&at),
            count: lines.count,
            set_up: s,
        })
    }

    /// Information of columns beside the set-up alone.
    pub fn information(&self, columns: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(columns.len(), columns.len(), |i, k| {
            self.gram[(columns[i], columns[k])]
        })
    }

    /// Information of columns beside others that are free within their prior.
    pub fn beside(&self, columns: &[usize], others: &[Member]) -> Option<DMatrix<f64>> {
        let rest: Vec<(usize, f64)> = others
            .iter()
            .flat_map(|(c, s)| c.iter().map(move |c| (*c, *s)))
            .filter(|(c, _)| !columns.contains(c))
            .collect();
        let own = self.information(columns);
        if rest.is_empty() {
            return Some(own);
        }
        let r = rest.len();
        let mut inner = DMatrix::from_fn(r, r, |i, k| self.gram[(rest[i].0, rest[k].0)]);
        for k in 0..r {
            inner[(k, k)] += 1.0 / (rest[k].1 * rest[k].1);
        }
        let across = DMatrix::from_fn(r, columns.len(), |i, k| self.gram[(rest[i].0, columns[k])]);
        let carried = inner.cholesky()?.solve(&across);
        Some(own - across.tr_mul(&carried))
    }

    /// Fits a set.
    pub fn solve(&self, set: &[Member]) -> Option<Solved> {
        let all: Vec<(usize, f64)> = set
            .iter()
            .flat_map(|(c, s)| c.iter().map(move |c| (*c, *s)))
            .collect();
        let n = all.len();
        let g = DMatrix::from_fn(n, n, |i, k| self.gram[(all[i].0, all[k].0)]);
        let mut a = g.clone();
        let mut evidence = 0.0;
        for k in 0..n {
            a[(k, k)] += 1.0 / (all[k].1 * all[k].1);
            evidence -= all[k].1.ln();
        }
        let b = DVector::from_fn(n, |i, _| self.rhs[all[i].0]);
        let factor = a.cholesky()?;
        let mean = factor.solve(&b);
        let l = factor.l_dirty();
        evidence += 0.5 * b.dot(&mean) - (0..n).map(|k| l[(k, k)].ln()).sum::<f64>();
        let decided = factor.solve(&g).trace();
        evidence.is_finite().then_some(Solved {
            evidence,
            mean,
            decided,
            factor,
        })
    }
}
