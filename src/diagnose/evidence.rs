//! What columns explain once the nominal model has taken its share.
//!
//! All rows are whitened, so that noise has variance 1. With the nominal regressor `W`, parameters
//! `φ = φ₀ + δ` with prior `δ ~ N(0, P)`, residual `r = τ − W φ₀` and the columns `Z` of an effect,
//!
//! ```text
//! χ²(δ, η) = ‖r − W δ − Z η‖² + δᵀ P⁻¹ δ          A = WᵀW + P⁻¹ = L Lᵀ,  Q = W L⁻ᵀ
//! min over δ:  (r − Zη)ᵀ Π (r − Zη)              Π = 1 − Q Qᵀ
//! gain = bᵀ Λ_e⁻¹ b,   Λ_e = Zᵀ Π Z,   b = Zᵀ Π r
//! ```
//!
//! `Π` takes from residual and effect alike what the nominal model can absorb at the price of the
//! prior: with a loose prior it is the projection `1 − P_W` of a refit, with a tight one the identity
//! of a frozen model. Both questions are one formula. The **visibility** of an effect is
//! `ηᵀ Λ_e η / ηᵀZᵀZη`.

use super::column::Column;
use super::data::Data;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use rayon::prelude::*;

/// Columns of an effect, whitened and reduced by the nominal model.
#[derive(Debug, Clone)]
pub struct Projected {
    /// whitened columns, rows of all records
    pub z: Vec<Column>,
    /// `Qᵀ Z`, parameters × columns
    c: Mat<f64>,
    /// `ZᵀZ` over fitted rows
    pub raw: Mat<f64>,
    /// `Λ_e = ZᵀΠZ`
    pub s: Mat<f64>,
    /// `b = ZᵀRr`
    pub b: Vec<f64>,
}

impl Projected {
    /// `ηᵀ Λ_e η` and `ηᵀZᵀZη`: energy of the effect that is left, and all of it.
    pub fn energy(&self, eta: &[f64]) -> (f64, f64) {
        let k = self.z.len().min(eta.len());
        let quad = |m: &Mat<f64>| -> f64 {
            (0..k)
                .map(|i| (0..k).map(|l| eta[i] * m[(i, l)] * eta[l]).sum::<f64>())
                .sum()
        };
        (quad(&self.s), quad(&self.raw))
    }

    /// The same; with unknown coefficients of all columns together, per unit of each.
    pub fn energies(&self, eta: Option<&[f64]>) -> (f64, f64) {
        match eta {
            Some(eta) => self.energy(eta),
            None => {
                let sum = |m: &Mat<f64>| (0..self.z.len()).map(|i| m[(i, i)]).sum::<f64>();
                (sum(&self.s), sum(&self.raw))
            }
        }
    }

    /// Share of the effect that the nominal model cannot absorb.
    pub fn visibility(&self, eta: Option<&[f64]>) -> f64 {
        let (left, all) = self.energies(eta);
        (left / all.max(1e-300)).clamp(0.0, 1.0)
    }
}

/// A fit of a set of effects.
#[derive(Debug, Clone, Default)]
pub struct Fit {
    /// by how much `χ²` falls
    pub gain: f64,
    /// coefficients of all columns, set after set
    pub eta: Vec<f64>,
    /// their covariance for noise of variance 1
    pub covariance: Vec<Vec<f64>>,
}

/// Energies of a fit on records.
#[derive(Debug, Clone, Default)]
pub struct Energy {
    /// squared whitened residual by actuator and record
    pub joints: Vec<Vec<f64>>,
}

impl Energy {
    /// Sum over records of one kind and all actuators.
    pub fn sum(&self, records: impl Fn(usize) -> bool + Copy) -> f64 {
        let row = |r: &Vec<f64>| -> f64 {
            r.iter()
                .enumerate()
                .filter(|(k, _)| records(*k))
                .map(|(_, v)| v)
                .sum()
        };
        self.joints.iter().map(row).sum()
    }
}

/// Nominal model, residual and prior, ready to test columns.
pub struct Evidence<'a> {
    /// the records
    pub data: &'a Data<'a>,
    /// nominal parameters
    pub phi: Vec<f64>,
    /// `Q` by actuator, rows of all records
    q: Vec<Mat<f64>>,
    /// `L`
    l: Mat<f64>,
    /// whitened residual of the frozen model by actuator, rows of all records
    pub r: Vec<Vec<f64>>,
    /// `Qᵀ r` over fitted rows
    d: Vec<f64>,
    /// `χ²` of the nominal model refitted under its prior
    pub j0: f64,
    /// deviations of the prior in use
    pub spread: Vec<f64>,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    // four sums: the compiler may use wide registers without reordering one sum
    let mut s = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let tail: f64 = a8
        .remainder()
        .iter()
        .zip(b8.remainder())
        .map(|(x, y)| x * y)
        .sum();
    for (x, y) in a8.zip(b8) {
        for k in 0..8 {
            s[k] += x[k] * y[k];
        }
    }
    s.iter().sum::<f64>() + tail
}

impl<'a> Evidence<'a> {
    /// With the prior of the data, its deviations multiplied by `loosen`.
    pub fn new(data: &'a Data<'a>, loosen: f64) -> Self {
        let n = data.joints();
        let p = data.parameters.len();
        let fitted = data.fitted;
        let phi: Vec<f64> = data.parameters.iter().map(|p| p.value).collect();
        // a parameter that is exactly zero a priori must still be able to move
        let floor = 1e-9;
        let spread: Vec<f64> = data
            .spread
            .iter()
            .map(|s| (s * loosen).max(floor))
            .collect();
        let mut w: Vec<Mat<f64>> = (0..n)
            .into_par_iter()
            .map(|j| {
                let mut out = Mat::zeros(data.rows(), p);
                for c in 0..p {
                    let from: Vec<f64> = data.w[j].col(c).iter().copied().collect();
                    if from.iter().all(|v| *v == 0.0) {
                        continue;
                    }
                    for (i, v) in data.modelled(j, &from).into_iter().enumerate() {
                        out[(i, c)] = v;
                    }
                }
                out
            })
            .collect();
        let nominal = data.model_torque(&phi);
        let r: Vec<Vec<f64>> = (0..n)
            .into_par_iter()
            .map(|j| {
                let model = data.windowed(&nominal[j]);
                let raw: Vec<f64> = data.tau[j].iter().zip(&model).map(|(a, b)| a - b).collect();
                data.whiten(j, &raw)
            })
            .collect();
        let grams: Vec<Mat<f64>> = w
            .par_iter()
            .map(|w| {
                let f = w.subrows(0, fitted);
                f.transpose() * f
            })
            .collect();
        // scaled by the prior, so that the matrix is 1 + something
        let mut a = Mat::<f64>::identity(p, p);
        for g in &grams {
            for i in 0..p {
                for k in 0..p {
                    a[(i, k)] += g[(i, k)] * spread[i] * spread[k];
                }
            }
        }
        let l = match a.llt(Side::Lower) {
            Ok(f) => f.L().to_owned(),
            Err(_) => Mat::identity(p, p),
        };
        // Q = W diag(spread) L⁻ᵀ: solve L Qᵀ = (W diag(spread))ᵀ
        w.par_iter_mut().for_each(|w| {
            for c in 0..p {
                for i in 0..w.nrows() {
                    w[(i, c)] *= spread[c];
                }
            }
            let mut t = w.transpose().to_owned();
            faer::linalg::triangular_solve::solve_lower_triangular_in_place(
                l.as_ref(),
                t.as_mut(),
                faer::Par::Seq,
            );
            *w = t.transpose().to_owned();
        });
        let q = w;
        let mut d = vec![0.0; p];
        let mut rr = 0.0;
        for j in 0..n {
            for (c, d) in d.iter_mut().enumerate() {
                let column = q[j].col(c);
                let column = column.try_as_col_major().expect("column major").as_slice();
                *d += dot(&column[..fitted], &r[j][..fitted]);
            }
            rr += dot(&r[j][..fitted], &r[j][..fitted]);
        }
        let j0 = rr - dot(&d, &d);
        Evidence {
            data,
            phi,
            q,
            l,
            r,
            d,
            j0,
            spread,
        }
    }

    /// `WᵀW` and `Wᵀr` over fitted rows, in units of the prior.
    pub fn normal_equations(&self) -> [Mat<f64>; 2] {
        let gram = &self.l * self.l.transpose() - Mat::<f64>::identity(self.d.len(), self.d.len());
        [gram, &self.l * faer::ColRef::from_slice(&self.d).as_mat()]
    }

    /// `C` with `CᵀC` the information on the first `count` parameters, records and prior together, whatever
    /// the others are.
    pub fn information(&self, count: usize) -> Mat<f64> {
        let p = self.d.len();
        let a = &self.l * self.l.transpose();
        // the Schur complement of the others
        let others = a.submatrix(count, count, p - count, p - count);
        let mixed = a.submatrix(count, 0, p - count, count);
        let mut own = a.submatrix(0, 0, count, count).to_owned();
        if p > count
            && let Ok(f) = others.llt(Side::Lower)
        {
            own -= mixed.transpose() * f.solve(mixed);
        }
        let root = match own.llt(Side::Lower) {
            Ok(f) => f.L().to_owned(),
            Err(_) => Mat::identity(count, count),
        };
        Mat::from_fn(count, count, |i, k| root[(k, i)] / self.spread[k])
    }

    /// `WᵀZ` in units of the prior, `ZᵀZ` and `Zᵀr` over fitted rows.
    pub fn as_seen(&self, a: &Projected) -> [Mat<f64>; 3] {
        let absorbed = a.c.transpose() * faer::ColRef::from_slice(&self.d).as_mat();
        let with = Mat::from_fn(a.b.len(), 1, |i, _| a.b[i] + absorbed[(i, 0)]);
        [&self.l * &a.c, a.raw.clone(), with]
    }

    /// Whitens and reduces columns.
    pub fn project(&self, columns: &[Column]) -> Projected {
        self.project_all(std::slice::from_ref(&columns.to_vec()))
            .pop()
            .expect("one set in, one out")
    }

    /// Whitens and reduces several sets of columns at once, which is several times faster.
    pub fn project_all(&self, sets: &[Vec<Column>]) -> Vec<Projected> {
        let fitted = self.data.fitted;
        let p = self.d.len();
        let z: Vec<Vec<Column>> = sets
            .iter()
            .map(|columns| {
                let whiten = |c: &Column| Column {
                    rows: c
                        .rows
                        .iter()
                        .map(|(j, v)| (*j, self.data.modelled(*j, v)))
                        .collect(),
                };
                columns.iter().map(whiten).collect()
            })
            .collect();
        let flat: Vec<&Column> = z.iter().flatten().collect();
        let mut c = Mat::<f64>::zeros(p, flat.len());
        let mut b = vec![0.0; flat.len()];
        for j in 0..self.data.joints() {
            let here: Vec<(usize, &[f64])> = flat
                .iter()
                .enumerate()
                .filter_map(|(i, c)| Some((i, &c.get(j)?[..fitted])))
                .collect();
            if here.is_empty() {
                continue;
            }
            let block = Mat::from_fn(fitted, here.len(), |r, i| here[i].1[r]);
            let part = self.q[j].subrows(0, fitted).transpose() * &block;
            for (k, (i, v)) in here.iter().enumerate() {
                for m in 0..p {
                    c[(m, *i)] += part[(m, k)];
                }
                b[*i] += dot(v, &self.r[j][..fitted]);
            }
        }
        for (i, b) in b.iter_mut().enumerate() {
            *b -= (0..p).map(|m| c[(m, i)] * self.d[m]).sum::<f64>();
        }
        let mut at = 0;
        z.into_iter()
            .map(|z| {
                let k = z.len();
                let c = c.subcols(at, k).to_owned();
                let b = b[at..at + k].to_vec();
                at += k;
                let mut raw = Mat::zeros(k, k);
                let mut s = Mat::zeros(k, k);
                for i in 0..k {
                    for m in 0..=i {
                        let full = overlap(&z[i], &z[m], fitted);
                        let absorbed: f64 = (0..p).map(|r| c[(r, i)] * c[(r, m)]).sum();
                        (raw[(i, m)], raw[(m, i)]) = (full, full);
                        (s[(i, m)], s[(m, i)]) = (full - absorbed, full - absorbed);
                    }
                }
                Projected { z, c, raw, s, b }
            })
            .collect()
    }

    /// `Z₁ᵀ Π Z₂`.
    pub fn cross(&self, a: &Projected, b: &Projected) -> Mat<f64> {
        Mat::from_fn(a.z.len(), b.z.len(), |i, k| {
            let absorbed: f64 = (0..self.d.len()).map(|r| a.c[(r, i)] * b.c[(r, k)]).sum();
            overlap(&a.z[i], &b.z[k], self.data.fitted) - absorbed
        })
    }

    /// Fits a set of effects together.
    pub fn fit(&self, set: &[&Projected]) -> Fit {
        let sizes: Vec<usize> = set.iter().map(|p| p.z.len()).collect();
        let k: usize = sizes.iter().sum();
        let mut s = Mat::zeros(k, k);
        let mut b = Vec::with_capacity(k);
        let mut at = 0;
        for (i, a) in set.iter().enumerate() {
            let mut to = 0;
            for (m, other) in set.iter().enumerate().take(i + 1) {
                let block = if m == i {
                    a.s.clone()
                } else {
                    self.cross(a, other)
                };
                for x in 0..sizes[i] {
                    for y in 0..sizes[m] {
                        s[(at + x, to + y)] = block[(x, y)];
                        s[(to + y, at + x)] = block[(x, y)];
                    }
                }
                to += sizes[m];
            }
            // what is not visible must not be fitted: a ridge far below anything visible
            for x in 0..sizes[i] {
                s[(at + x, at + x)] += 1e-7 * a.raw[(x, x)] + 1e-9;
            }
            b.extend(a.b.iter().copied());
            at += sizes[i];
        }
        solve(&s, &b)
    }

    /// Parameters of the nominal model that go with a fit of a set.
    pub fn parameters(&self, set: &[&Projected], fit: &Fit) -> Vec<f64> {
        let p = self.d.len();
        let u = self.reduced(set, fit);
        // L^T x = u
        let mut x = Mat::from_fn(p, 1, |i, _| u[i]);
        faer::linalg::triangular_solve::solve_upper_triangular_in_place(
            self.l.transpose(),
            x.as_mut(),
            faer::Par::Seq,
        );
        (0..p)
            .map(|i| self.phi[i] + self.spread[i] * x[(i, 0)])
            .collect()
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
        let u = self.reduced(set, fit);
        (0..self.data.joints())
            .into_par_iter()
            .map(|j| {
                let y = &self.q[j] * faer::ColRef::from_slice(&u);
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

    /// Share of effect `a` with coefficients `eta` that effect `b` can imitate once the nominal model
    /// has taken its share: the squared cosine of the projected angle.
    pub fn overlap(&self, a: &Projected, eta: &[f64], b: &Projected) -> f64 {
        let k = a.z.len().min(eta.len());
        let own = a.energy(eta).0;
        let cross = self.cross(b, a);
        let rhs: Vec<f64> = (0..b.z.len())
            .map(|i| (0..k).map(|m| cross[(i, m)] * eta[m]).sum())
            .collect();
        (solve(&b.s, &rhs).gain / own.max(1e-300)).clamp(0.0, 1.0)
    }

    /// A whitened residual as it was before, in units of the noise of each actuator; zero where
    /// nothing was measured.
    pub fn unwhitened(&self, residual: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let before = residual.par_iter().enumerate();
        let before = before.map(|(j, e)| self.data.unwhiten(j, e)).collect();
        self.data.silenced(before)
    }

    /// What the nominal model leaves of the torque beside a fitted set, by actuator, N m or N; zero
    /// where nothing was measured.
    pub fn torque_left(&self, set: &[&Projected]) -> Vec<Vec<f64>> {
        let mut all = self.unwhitened(&self.residual(set, &self.fit(set)));
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

/// Sum of products of two columns over fitted rows.
fn overlap(a: &Column, b: &Column, fitted: usize) -> f64 {
    a.rows
        .iter()
        .filter_map(|(j, x)| Some(dot(&x[..fitted], &b.get(*j)?[..fitted])))
        .sum()
}

/// `S η = b` with `S` positive semi-definite, scaled to a unit diagonal first.
pub fn solve(s: &Mat<f64>, b: &[f64]) -> Fit {
    let k = b.len();
    let scale: Vec<f64> = (0..k).map(|i| 1.0 / s[(i, i)].max(1e-300).sqrt()).collect();
    let a = Mat::from_fn(k, k, |i, m| {
        s[(i, m)] * scale[i] * scale[m] + if i == m { 1e-10 } else { 0.0 }
    });
    let Ok(f) = a.llt(Side::Lower) else {
        return Fit {
            gain: 0.0,
            eta: vec![0.0; k],
            covariance: vec![vec![0.0; k]; k],
        };
    };
    let rhs = Mat::from_fn(k, 1, |i, _| b[i] * scale[i]);
    let x = f.solve(&rhs);
    let inverse = f.solve(Mat::<f64>::identity(k, k));
    let eta: Vec<f64> = (0..k).map(|i| x[(i, 0)] * scale[i]).collect();
    Fit {
        gain: eta.iter().zip(b).map(|(e, b)| e * b).sum(),
        covariance: (0..k)
            .map(|i| {
                (0..k)
                    .map(|m| inverse[(i, m)] * scale[i] * scale[m])
                    .collect()
            })
            .collect(),
        eta,
    }
}
