//! Batched evaluation on the uniform grid of one period.

use super::fourier::{Fourier, Series, differentiated};
use nalgebra::DMatrix;
use std::f64::consts::TAU;

/// Sines and cosines of the `N` uniform samples of one period, `t_i = i T/N`, from which every
/// harmonic is read: `sin(2π h i/N)` is entry `h i mod N`.
#[derive(Debug, Clone)]
pub struct Table {
    period: f64,
    harmonics: Vec<u32>,
    sin: Vec<f64>,
    cos: Vec<f64>,
}

/// Positions, velocities and accelerations on a grid, `n × N`: a column per sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampled {
    /// positions, rad or m
    pub q: DMatrix<f64>,
    /// velocities
    pub qd: DMatrix<f64>,
    /// accelerations
    pub qdd: DMatrix<f64>,
}

impl Table {
    /// The table of `samples` points (at least 1) for series of this period on these harmonics.
    pub fn new(period: f64, harmonics: &[u32], samples: usize) -> Self {
        let n = samples.max(1);
        let (sin, cos) = (0..n)
            .map(|i| (TAU * (i as f64 / n as f64)).sin_cos())
            .unzip();
        Table {
            period,
            harmonics: harmonics.to_vec(),
            sin,
            cos,
        }
    }

    /// Number of samples `N`.
    pub fn len(&self) -> usize {
        self.sin.len()
    }

    /// Never: a table has at least one sample.
    pub fn is_empty(&self) -> bool {
        self.sin.is_empty()
    }

    /// Time of sample `i`, s.
    pub fn time(&self, i: usize) -> f64 {
        i as f64 * self.period / self.len() as f64
    }

    /// Period, s.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// Base angular frequency, rad/s.
    pub fn omega(&self) -> f64 {
        TAU / self.period
    }

    /// Harmonics.
    pub fn harmonics(&self) -> &[u32] {
        &self.harmonics
    }

    /// Derivative of the given order (0: the series itself) of one joint at all samples.
    ///
    /// # Panics
    /// If `out` does not have one entry per sample.
    pub fn series(&self, series: &Series, order: u32, out: &mut [f64]) {
        assert_eq!(out.len(), self.len(), "one entry per sample");
        out.fill(if order == 0 { series.constant } else { 0.0 });
        for ((&s, &c), &h) in series.sin.iter().zip(&series.cos).zip(&self.harmonics) {
            let (s, c) = differentiated(s, c, f64::from(h) * self.omega(), order);
            self.walk(h, |i, sin, cos| out[i] += s * sin + c * cos);
        }
    }

    /// Positions, velocities and accelerations of all joints at all samples.
    pub fn sample(&self, fourier: &Fourier) -> Sampled {
        let (n, samples) = (fourier.dof(), self.len());
        let zero = DMatrix::zeros(n, samples);
        let mut all = Sampled {
            q: zero.clone(),
            qd: zero.clone(),
            qdd: zero,
        };
        let (q, qd, qdd) = (
            all.q.as_mut_slice(),
            all.qd.as_mut_slice(),
            all.qdd.as_mut_slice(),
        );
        for (j, series) in fourier.joints.iter().enumerate() {
            for i in 0..samples {
                q[i * n + j] = series.constant;
            }
            for ((&s, &c), &h) in series.sin.iter().zip(&series.cos).zip(&self.harmonics) {
                let w = f64::from(h) * self.omega();
                self.walk(h, |i, sin, cos| {
                    let value = s * sin + c * cos;
                    q[i * n + j] += value;
                    qd[i * n + j] += w * (s * cos - c * sin);
                    qdd[i * n + j] -= w * w * value;
                });
            }
        }
        all
    }

    /// The matrix that turns coefficients `[c_0, s_1 … s_H, c_1 … c_H]` into the samples of the
    /// derivative of this order, `N × (2H + 1)`.
    pub fn design(&self, order: u32) -> DMatrix<f64> {
        let count = self.harmonics.len();
        let mut b = DMatrix::zeros(self.len(), 2 * count + 1);
        if order == 0 {
            b.column_mut(0).fill(1.0);
        }
        for (k, &h) in self.harmonics.iter().enumerate() {
            let w = f64::from(h) * self.omega();
            let (ss, sc) = differentiated(1.0, 0.0, w, order);
            let (cs, cc) = differentiated(0.0, 1.0, w, order);
            self.walk(h, |i, sin, cos| {
                b[(i, 1 + k)] = ss * sin + sc * cos;
                b[(i, 1 + count + k)] = cs * sin + cc * cos;
            });
        }
        b
    }

    /// Calls `f(i, sin, cos)` with the values of harmonic `h` at every sample.
    #[inline]
    fn walk(&self, h: u32, mut f: impl FnMut(usize, f64, f64)) {
        let n = self.len();
        let step = h as usize % n;
        let mut at = 0;
        for i in 0..n {
            f(i, self.sin[at], self.cos[at]);
            at += step;
            if at >= n {
                at -= n;
            }
        }
    }
}

impl Fourier {
    /// Positions, velocities and accelerations at `samples` uniform points of one period, the end
    /// point (a repetition of the first) left out.
    pub fn sample(&self, samples: usize) -> Sampled {
        Table::new(self.period, &self.harmonics, samples).sample(self)
    }

    /// [`Fourier::sample`] in the order that the kernels read: all samples of a coordinate together.
    pub fn motion(&self, samples: usize) -> crate::dynamics::Samples {
        let sampled = self.sample(samples);
        let all = |a: &DMatrix<f64>| a.transpose().as_slice().to_vec();
        crate::dynamics::Samples {
            dof: self.dof(),
            count: samples,
            q: all(&sampled.q),
            qd: all(&sampled.qd),
            qdd: all(&sampled.qdd),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    #[test]
    fn table_agrees_with_direct_evaluation() {
        let a = Series {
            constant: 0.3,
            sin: vec![0.5, -0.1, 0.2],
            cos: vec![0.2, 0.4, -0.3],
        };
        let b = Series {
            constant: -0.2,
            sin: vec![0.1, 0.6, 0.0],
            cos: vec![1.0, 0.0, 0.9],
        };
        let f = Fourier::new(3.0, vec![1, 5, 30], vec![a, b]).unwrap();
        // 23 samples: fewer than the highest harmonic, prime
        for samples in [1, 23, 200] {
            let table = Table::new(f.period, &f.harmonics, samples);
            let all = table.sample(&f);
            assert_eq!(all, f.sample(samples));
            for i in 0..samples {
                let [mut q, mut qd, mut qdd] = [[0.0; 2]; 3];
                f.evaluate(table.time(i), [&mut q, &mut qd, &mut qdd]);
                for j in 0..2 {
                    assert!((all.q[(j, i)] - q[j]).abs() < 1e-11);
                    assert!((all.qd[(j, i)] - qd[j]).abs() < 1e-9);
                    assert!((all.qdd[(j, i)] - qdd[j]).abs() < 1e-7);
                }
            }
            for order in 0..5 {
                let scale = (30.0 * f.omega()).powi(order as i32);
                for series in &f.joints {
                    let mut direct = vec![0.0; samples];
                    table.series(series, order, &mut direct);
                    let by_matrix = table.design(order) * DVector::from_vec(series.coefficients());
                    for i in 0..samples {
                        assert!((direct[i] - by_matrix[i]).abs() < 1e-12 * scale);
                    }
                }
            }
        }
    }
}
