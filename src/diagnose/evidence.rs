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

mod algebra;
mod draw;
mod left;
mod nominal;

pub use algebra::solve;
pub use draw::Draws;

use super::column::Column;
use super::data::Data;
use algebra::{dot, forwards, overlap};
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
    /// information a priori on every coefficient
    pub prior: f64,
}

impl Projected {
    /// `Λ_e` with the information a priori. What is not visible must not be fitted: a ridge far below anything visible.
    fn ridged(&self) -> Mat<f64> {
        let mut s = self.s.clone();
        for x in 0..self.z.len() {
            s[(x, x)] += 1e-7 * self.raw[(x, x)] + 1e-9 + self.prior;
        }
        s
    }

    /// Forgets the rows, so that nothing can be fitted beside it; its energies stay.
    pub fn forget(&mut self) {
        self.z.iter_mut().for_each(|c| c.rows = Vec::new());
    }

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

/// A set of effects that others are fitted beside.
pub struct Set<'a> {
    evidence: &'a Evidence<'a>,
    members: Vec<&'a Projected>,
    /// their `S` and `b`
    s: Mat<f64>,
    b: Vec<f64>,
    gain: f64,
}

impl Set<'_> {
    /// The records and the nominal model.
    pub fn evidence(&self) -> &Evidence<'_> {
        self.evidence
    }

    /// By how much `χ²` falls with it.
    pub fn gain(&self) -> f64 {
        self.gain
    }

    /// Fit with one more, whose coefficients are the last ones.
    pub fn with(&self, more: &Projected) -> Fit {
        let (first, own) = (self.b.len(), more.z.len());
        let mut s = Mat::zeros(first + own, first + own);
        s.submatrix_mut(0, 0, first, first).copy_from(&self.s);
        s.submatrix_mut(first, first, own, own)
            .copy_from(more.ridged());
        let mut at = 0;
        for a in &self.members {
            let cross = self.evidence.cross(more, a);
            for x in 0..cross.nrows() {
                for y in 0..cross.ncols() {
                    s[(first + x, at + y)] = cross[(x, y)];
                    s[(at + y, first + x)] = cross[(x, y)];
                }
            }
            at += a.z.len();
        }
        solve(&s, &[&self.b[..], &more.b].concat())
    }

    /// Parameters of the nominal model that go with it.
    pub fn parameters(&self, more: &Projected, fit: &Fit) -> Vec<f64> {
        let all: Vec<&Projected> = self.members.iter().copied().chain([more]).collect();
        self.evidence.parameters(&all, fit)
    }
}

/// The whitened columns of the nominal model on the rows of one actuator in units of the prior, `W = B R`: `B` are those that
/// show apart from each other in its torque, a half or a third of all.
struct Basis {
    /// `B`, rows of all records
    b: Mat<f64>,
    /// `R`, with a column for each parameter
    r: Mat<f64>,
}

/// Products of whitened columns on the rows of one actuator.
struct OfActuator {
    /// column, and its product with the residual
    own: Vec<(usize, f64)>,
    /// `Wᵀ Z`, a column for each of `own`
    part: Mat<f64>,
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
    /// `W` by actuator, in units of the prior
    w: Vec<Basis>,
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

/// A symmetric matrix over the columns of a set from its blocks `(i, m)` with `m ≤ i`.
fn assembled(set: &[&Projected], block: impl Fn(usize, usize) -> Mat<f64>) -> Mat<f64> {
    let starts = set.iter().scan(0, |at, p| {
        *at += p.z.len();
        Some(*at - p.z.len())
    });
    let starts: Vec<usize> = starts.collect();
    let k: usize = set.iter().map(|p| p.z.len()).sum();
    let mut out = Mat::zeros(k, k);
    for (i, at) in starts.iter().enumerate() {
        for (m, to) in starts.iter().enumerate().take(i + 1) {
            let block = block(i, m);
            for x in 0..block.nrows() {
                for y in 0..block.ncols() {
                    out[(at + x, to + y)] = block[(x, y)];
                    out[(to + y, at + x)] = block[(x, y)];
                }
            }
        }
    }
    out
}

impl Evidence<'_> {
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
        let mut own = a.raw.clone();
        (0..a.b.len()).for_each(|i| own[(i, i)] += a.prior);
        [&self.l * &a.c, own, with]
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
        let modelled = |c: &Column| Column {
            rows: (c.rows.par_iter().with_max_len(1))
                .map(|(j, v)| (*j, self.data.modelled(*j, v)))
                .collect(),
        };
        let z: Vec<Vec<Column>> = (sets.par_iter().with_max_len(1))
            .map(|columns| columns.par_iter().map(modelled).collect())
            .collect();
        let flat: Vec<&Column> = z.iter().flatten().collect();
        let mut c = Mat::<f64>::zeros(p, flat.len());
        let mut b = vec![0.0; flat.len()];
        // of every actuator by itself: the columns on its rows, their products with W and with the residual
        let of = |j: usize| {
            let at = flat.iter().enumerate();
            let here: Vec<(usize, &[f64])> = at
                .filter_map(|(i, c)| Some((i, &c.get(j)?[..fitted])))
                .collect();
            let w = &self.w[j];
            let b = w.b.subrows(0, fitted);
            let part = match here[..] {
                [] => Mat::zeros(b.ncols(), 0),
                [(_, v)] => b.transpose() * faer::ColRef::from_slice(v).as_mat(),
                _ => {
                    let block = Mat::from_fn(fitted, here.len(), |r, i| here[i].1[r]);
                    b.transpose() * &block
                }
            };
            let part = w.r.transpose() * part;
            let r = &self.r[j][..fitted];
            let own = here.iter().map(|(i, v)| (*i, dot(v, r))).collect();
            OfActuator { own, part }
        };
        let joints = (0..self.data.joints()).into_par_iter().with_max_len(1);
        let parts: Vec<OfActuator> = joints.map(of).collect();
        for OfActuator { own, part } in parts {
            for (k, (i, product)) in own.into_iter().enumerate() {
                for m in 0..p {
                    c[(m, i)] += part[(m, k)];
                }
                b[i] += product;
            }
        }
        forwards(&self.l, &mut c);
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
                Projected {
                    z,
                    c,
                    raw,
                    s,
                    b,
                    prior: 0.0,
                }
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
        let (s, b) = self.normal(set);
        solve(&s, &b)
    }

    /// `S` and `b` of a set.
    fn normal(&self, set: &[&Projected]) -> (Mat<f64>, Vec<f64>) {
        let s = assembled(set, |i, m| match i == m {
            true => set[i].ridged(),
            false => self.cross(set[i], set[m]),
        });
        (s, set.iter().flat_map(|a| a.b.iter().copied()).collect())
    }

    /// A set that others are fitted beside.
    pub fn set<'a>(&'a self, members: &[&'a Projected]) -> Set<'a> {
        let (s, b) = self.normal(members);
        Set {
            evidence: self,
            members: members.to_vec(),
            gain: solve(&s, &b).gain,
            s,
            b,
        }
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
}
