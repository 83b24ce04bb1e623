//! Least squares block by block: what a set of columns predicts on blocks that it was not fitted to.
//!
//! With `G_b = Σ a aᵀ`, `h_b = Σ a d` and `s_b = Σ d²` over the rows of block `b`, a fit without the block is
//! `x = (Σ_{c≠b} G_c)⁻¹ Σ_{c≠b} h_c`, and its squared error on the block `s_b − 2 h_bᵀ x + xᵀ G_b x`. Any subset of the
//! columns costs `p³` a block.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// Normal equations of one block.
pub struct Block {
    g: Vec<f64>,
    h: Vec<f64>,
    s: f64,
    /// rows
    pub rows: usize,
}

/// Normal equations of all blocks.
pub struct Blocks {
    columns: usize,
    all: Vec<Block>,
}

impl Blocks {
    /// For so many columns.
    pub fn new(columns: usize) -> Self {
        let all = Vec::new();
        Blocks { columns, all }
    }

    /// Adds a block: rows of `columns` numbers, and what they are to predict.
    pub fn add(&mut self, rows: &[f64], d: &[f64]) {
        let p = self.columns;
        let mut block = Block {
            g: vec![0.0; p * p],
            h: vec![0.0; p],
            s: 0.0,
            rows: d.len(),
        };
        for (a, d) in rows.chunks_exact(p).zip(d) {
            for i in 0..p {
                for k in 0..=i {
                    block.g[i * p + k] += a[i] * a[k];
                }
                block.h[i] += a[i] * d;
            }
            block.s += d * d;
        }
        for i in 0..p {
            for k in i + 1..p {
                block.g[i * p + k] = block.g[k * p + i];
            }
        }
        self.all.push(block);
    }

    /// Number of blocks.
    pub fn len(&self) -> usize {
        self.all.len()
    }

    /// Rows of all blocks.
    pub fn rows(&self) -> usize {
        self.all.iter().map(|b| b.rows).sum()
    }

    /// Coefficients of a set of columns from all blocks but one; `None` where they cannot be told apart.
    pub fn fit(&self, set: &[usize], without: Option<usize>) -> Option<Vec<f64>> {
        let (p, n) = (self.columns, set.len());
        let mut g = Mat::<f64>::zeros(n, n);
        let mut h = Mat::<f64>::zeros(n, 1);
        for (_, b) in (self.all.iter().enumerate()).filter(|(k, _)| Some(*k) != without) {
            for i in 0..n {
                for k in 0..n {
                    g[(i, k)] += b.g[set[i] * p + set[k]];
                }
                h[(i, 0)] += b.h[set[i]];
            }
        }
        // columns of length one; what they cannot tell apart is not solved for
        let scale: Vec<f64> = (0..n).map(|i| g[(i, i)].max(1e-300).sqrt()).collect();
        for i in 0..n {
            for k in 0..n {
                g[(i, k)] /= scale[i] * scale[k];
            }
            h[(i, 0)] /= scale[i];
            g[(i, i)] += 1e-12;
        }
        let x = g.llt(Side::Lower).ok()?.solve(&h);
        let x: Vec<f64> = (0..n).map(|i| x[(i, 0)] / scale[i]).collect();
        x.iter().all(|v| v.is_finite()).then_some(x)
    }

    /// Squared error of coefficients on one block.
    pub fn error(&self, k: usize, set: &[usize], x: &[f64]) -> f64 {
        let (p, b) = (self.columns, &self.all[k]);
        let mut e = b.s;
        for (i, &ci) in set.iter().enumerate() {
            e -= 2.0 * b.h[ci] * x[i];
            for (k, &ck) in set.iter().enumerate() {
                e += x[i] * x[k] * b.g[ci * p + ck];
            }
        }
        e.max(0.0)
    }

    /// Squared error on every block, each left out of the fit; `None` where a fit fails.
    pub fn left_out(&self, set: &[usize]) -> Option<Vec<f64>> {
        (0..self.len())
            .map(|k| Some(self.error(k, set, &self.fit(set, Some(k))?)))
            .collect()
    }

    /// Coefficients and their standard deviations, by leaving out one block after the other (jackknife), which holds for
    /// errors that are correlated within a block.
    pub fn estimate(&self, set: &[usize]) -> Option<(Vec<f64>, Vec<f64>)> {
        let x = self.fit(set, None)?;
        let n = self.len() as f64;
        let parts: Option<Vec<Vec<f64>>> =
            (0..self.len()).map(|k| self.fit(set, Some(k))).collect();
        let parts = parts?;
        let std = (0..set.len()).map(|i| {
            let mean = parts.iter().map(|p| p[i]).sum::<f64>() / n;
            let square = parts.iter().map(|p| (p[i] - mean).powi(2)).sum::<f64>();
            ((n - 1.0) / n * square).sqrt()
        });
        Some((x, std.collect()))
    }
}
