//! Draws from what the records and the prior leave open of parameters and coefficients together.

use super::algebra::backwards;
use super::{Evidence, Fit, Projected, assembled};
use faer::{Mat, Side};

/// Parameters `δ` and coefficients `η` about those of a fit, with the precision for noise of variance `s²`
///
/// ```text
/// [ WᵀW/s² + P⁻¹   WᵀZ/s²       ]
/// [ ZᵀW/s²         ZᵀZ/s² + P_η⁻¹ ]
/// ```
///
/// `δ` in units of the prior.
pub struct Draws {
    /// parameters of the fit, and coefficients
    mean: Vec<f64>,
    /// deviations that each number would have alone
    scale: Vec<f64>,
    /// factor of the precision, scaled to a unit diagonal
    l: Mat<f64>,
    /// parameters of the nominal model among the numbers
    parameters: usize,
}

impl Evidence<'_> {
    /// Draws about a fit of a set; `None` where its columns are the same.
    pub fn draws(&self, set: &[&Projected], fit: &Fit, noise: f64) -> Option<Draws> {
        let (p, k) = (self.d.len(), fit.eta.len());
        let weight = 1.0 / (noise * noise);
        let [gram, _] = self.normal_equations();
        let mut a = Mat::<f64>::zeros(p + k, p + k);
        for i in 0..p {
            for m in 0..p {
                a[(i, m)] = weight * gram[(i, m)];
            }
            a[(i, i)] += 1.0;
        }
        // without what the parameters absorb
        let own = assembled(set, |i, m| match i == m {
            true => set[i].raw.clone(),
            false => self.cross(set[i], set[m]) + set[i].c.transpose() * &set[m].c,
        });
        for x in 0..k {
            for y in 0..k {
                a[(p + x, p + y)] = weight * own[(x, y)];
            }
        }
        let mut at = p;
        for one in set {
            let mixed = &self.l * &one.c;
            for x in 0..one.z.len() {
                for m in 0..p {
                    a[(m, at + x)] = weight * mixed[(m, x)];
                    a[(at + x, m)] = a[(m, at + x)];
                }
                a[(at + x, at + x)] += one.prior;
            }
            at += one.z.len();
        }
        let scale: Vec<f64> = (0..p + k)
            .map(|i| 1.0 / a[(i, i)].max(1e-300).sqrt())
            .collect();
        let a = Mat::from_fn(p + k, p + k, |i, m| a[(i, m)] * scale[i] * scale[m]);
        let l = a.llt(Side::Lower).ok()?.L().to_owned();
        let mut mean = self.parameters(set, fit);
        mean.extend(&fit.eta);
        let units = self.spread.iter().copied().chain(vec![1.0; k]);
        let scale = scale.into_iter().zip(units).map(|(s, u)| s * u).collect();
        Some(Draws {
            mean,
            scale,
            l,
            parameters: p,
        })
    }
}

impl Draws {
    /// Parameters and coefficients that go with standard normal numbers, one for each.
    pub fn at(&self, normal: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let x = backwards(&self.l, &normal[..self.mean.len()]);
        let drawn = self.mean.iter().zip(&self.scale).enumerate();
        let mut all: Vec<f64> = drawn.map(|(i, (m, s))| m + s * x[(i, 0)]).collect();
        let eta = all.split_off(self.parameters);
        (all, eta)
    }

    /// How many numbers there are.
    pub fn count(&self) -> usize {
        self.mean.len()
    }
}
