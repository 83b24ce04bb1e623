//! What a fit leaves: parameters, residuals, energies.

use super::super::noise::Noise;
use super::algebra::{backwards, dot, forwards};
use super::{Energy, Evidence, Fit, Projected};
use faer::Mat;
use rayon::prelude::*;

impl Evidence<'_> {
    /// Parameters of the nominal model that go with a fit of a set.
    pub fn parameters(&self, set: &[&Projected], fit: &Fit) -> Vec<f64> {
        let p = self.d.len();
        let x = backwards(&self.l, &self.reduced(set, fit));
        (0..p)
            .map(|i| self.phi[i] + self.spread[i] * x[(i, 0)])
            .collect()
    }

    /// Freedoms of the nominal model that the records settle, `tr(1 − A⁻¹)` in units of the prior: what the penalty of the
    /// prior is expected to be for parameters that were drawn from it (MacKay 1992).
    pub fn freedoms(&self) -> f64 {
        let p = self.d.len();
        let mut inverse = Mat::<f64>::identity(p, p);
        forwards(&self.l, &mut inverse);
        p as f64 - inverse.squared_norm_l2()
    }

    /// Standard deviation of parameter `i` beside all others, from records and prior, for noise of variance 1.
    pub fn std(&self, i: usize) -> f64 {
        self.std_beside(&[], &Fit::default(), i)
    }

    /// The same beside a set, whose coefficients take a part of it:
    ///
    /// ```text
    /// var φ_i = |x|² + gᵀ Σ_η g        x = L⁻¹ e_i p_i,  g = Cᵀ x
    /// ```
    pub fn std_beside(&self, set: &[&Projected], fit: &Fit, i: usize) -> f64 {
        let mut x = Mat::<f64>::zeros(self.d.len(), 1);
        x[(i, 0)] = self.spread[i];
        forwards(&self.l, &mut x);
        let x = x.col(0);
        let moved = |one: &&Projected| -> Vec<f64> {
            let columns = one.c.col_iter();
            columns.map(|c| c.transpose() * x).collect()
        };
        let g: Vec<f64> = set.iter().flat_map(moved).collect();
        let rows = fit.covariance.iter().zip(&g);
        let more: f64 = rows
            .map(|(row, own)| own * row.iter().zip(&g).map(|(c, g)| c * g).sum::<f64>())
            .sum();
        (x.squared_norm_l2() + more).sqrt()
    }

    /// Squares of a whitened residual on fitted rows, by actuator.
    fn powers(&self, residual: &[Vec<f64>]) -> impl Iterator<Item = f64> {
        let fitted = self.data.fitted;
        let power = move |e: &Vec<f64>| e[..fitted].iter().map(|v| v * v).sum::<f64>();
        residual.iter().map(power)
    }

    /// Penalty of the prior with a fit that leaves this residual.
    pub fn surprise(&self, fit: &Fit, residual: &[Vec<f64>]) -> f64 {
        self.j0 - fit.gain - self.powers(residual).sum::<f64>()
    }

    /// `Σ_j n ln Σ e²` of a residual on fitted rows: every actuator counts as with a noise of its own that is not known. It is
    /// in the unit of the actuator and not of its noise, so that what is assumed of that noise does not decide.
    pub fn log_power(&self, residual: &[Vec<f64>]) -> f64 {
        let of = |(power, noise): (f64, &Noise)| {
            let power = power / noise.filter[0].powi(2);
            self.data.fitted as f64 * power.max(f64::MIN_POSITIVE).ln()
        };
        self.powers(residual).zip(&self.data.noise).map(of).sum()
    }

    fn reduced(&self, set: &[&Projected], fit: &Fit) -> Vec<f64> {
        let mut u = self.d.clone();
        let mut at = 0;
        for a in set {
            for i in 0..a.z.len() {
                for (m, u) in u.iter_mut().enumerate() {
                    *u -= a.c[(m, i)] * fit.eta[at + i];
                }
            }
            at += a.z.len();
        }
        u
    }

    /// Whitened residual of all rows with a fitted set, by actuator.
    pub fn residual(&self, set: &[&Projected], fit: &Fit) -> Vec<Vec<f64>> {
        let x = backwards(&self.l, &self.reduced(set, fit));
        (0..self.data.joints())
            .into_par_iter()
            .map(|j| {
                let w = &self.w[j];
                let y = &w.b * (&w.r * x.col(0));
                let mut e: Vec<f64> = self.r[j]
                    .iter()
                    .enumerate()
                    .map(|(i, r)| r - y[i])
                    .collect();
                let mut at = 0;
                for a in set {
                    for column in &a.z {
                        if let Some(v) = column.get(j) {
                            for (e, v) in e.iter_mut().zip(v) {
                                *e -= fit.eta[at] * v;
                            }
                        }
                        at += 1;
                    }
                }
                e
            })
            .collect()
    }

    /// A whitened residual as it was before, in units of the noise of each actuator; zero where
    /// nothing was measured.
    pub fn unwhitened(&self, residual: &[Vec<f64>]) -> Vec<Vec<f64>> {
        self.unwhitened_but(residual, |_| false)
    }

    /// A whitened residual as the gap of each actuator is counted: as it is where that is on whitened rows, elsewhere as by
    /// [`Evidence::unwhitened`].
    pub fn as_counted(&self, residual: &[Vec<f64>]) -> Vec<Vec<f64>> {
        self.unwhitened_but(residual, |j| self.data.counts_whitened(j))
    }

    fn unwhitened_but(
        &self,
        residual: &[Vec<f64>],
        kept: impl Fn(usize) -> bool + Sync,
    ) -> Vec<Vec<f64>> {
        let data = self.data;
        let own = |(j, e): (usize, &Vec<f64>)| match kept(j) {
            true => e.clone(),
            false => data.unwhiten(j, e),
        };
        let all = residual.par_iter().enumerate().map(own).collect();
        let mut all = data.silenced(all);
        let before = all.iter_mut().enumerate().filter(|(j, _)| !kept(*j));
        before.for_each(|(j, row)| data.tell(j, row));
        all
    }

    /// Energy of a whitened residual of an actuator in record `k` beyond that of its noise; whitening has taken what its encoder makes
    /// unknown for noise.
    pub fn beyond(&self, j: usize, e: &[f64], k: usize) -> f64 {
        let weights = &self.data.weights[j];
        let rows = self.data.span(k);
        rows.map(|i| e[i] * e[i] - weights[i] * weights[i]).sum()
    }

    /// A whitened residual of a torque, by actuator, N m or N; zero where nothing was measured.
    pub fn in_torque(&self, residual: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut all = self.unwhitened(residual);
        for (row, noise) in all.iter_mut().zip(&self.data.noise) {
            row.iter_mut().for_each(|v| *v *= noise.std);
        }
        all
    }

    /// Energies of a whitened residual.
    pub fn energy(&self, residual: &[Vec<f64>]) -> Energy {
        let joints = residual
            .iter()
            .map(|e| {
                (0..self.data.records.len())
                    .map(|k| {
                        let piece = &e[self.data.span(k)];
                        dot(piece, piece)
                    })
                    .collect()
            })
            .collect();
        Energy { joints }
    }
}
