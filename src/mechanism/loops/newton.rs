//! Kinematics of closed loops: Newton on the closures, implicit differentiation.
//!
//! With `D = ∂q/∂x` and `Ψ` the map `b ↦ (0, −Φ_p⁺ b)`, the second and third derivatives of the
//! configuration are those that keep `Φ` zero:
//!
//! ```text
//! F_xx[u, v]    = Ψ Φ_qq[Du, Dv]
//! F_xxx[u,u,w]  = Ψ ( Φ_qqq[Du,Du,Dw] + 2 Φ_qq[F_xx[u,w], Du] + Φ_qq[F_xx[u,u], Dw] )
//! ∂q̇/∂x w = F_xx[ẋ, w]      ∂q̈/∂x w = F_xx[ẍ, w] + F_xxx[ẋ, ẋ, w]
//! ```
//!
//! None of these tensors is formed: `Φ` along Taylor series in time with a dual part in the
//! direction `Dw` gives the brackets as coefficients, from which the one unknown is solved.

use super::closure::Chain;
use super::least_squares::LeastSquares;
use crate::dynamics::Samples;
use crate::dynamics::lanes::Isa;
use crate::mechanism::geometry::{Geometry, Segment};
use crate::mechanism::scalar::{Dual, Pack, Taylor};
use crate::mechanism::{Cone, Spread};
use nalgebra::{DMatrix, DVector};

type Number = Pack<f64>;

/// Largest change of a coordinate, rad or characteristic lengths, in one piece of the way.
const PIECE: f64 = 0.25;
/// Most pieces between two samples.
const PIECES: f64 = 4096.0;
/// Relative pivot of `Φ_p` at which the way ends.
const HELD: f64 = 1e-8;

/// The kinematics of a tree with loops.
#[derive(Debug)]
pub(super) struct LoopGeometry {
    chain: Chain,
    /// coordinates that are the task, in order
    independent: Vec<usize>,
    /// the others
    passive: Vec<usize>,
    home: Vec<f64>,
    /// how far loops may be open: what cannot be closed at home, and rounding
    tolerance: f64,
}

/// A closed configuration with what its derivatives need.
struct Configuration {
    q: Vec<f64>,
    /// of `Φ_p`
    solver: LeastSquares,
    /// `D`, coordinates × task
    d: DMatrix<f64>,
}

impl LoopGeometry {
    pub fn new(chain: Chain, independent: Vec<usize>, home: Vec<f64>, open: f64) -> Self {
        let passive = (0..home.len())
            .filter(|i| !independent.contains(i))
            .collect();
        let tolerance = 1e-9 * chain.length + 20.0 * open;
        LoopGeometry {
            chain,
            independent,
            passive,
            home,
            tolerance,
        }
    }

    /// Decomposes the closures of a configuration.
    fn configuration(&self, q: Vec<f64>) -> Result<Configuration, String> {
        let j = self.chain.jacobian(&q);
        let (n, m) = (q.len(), self.independent.len());
        let solver = LeastSquares::new(j.select_columns(&self.passive));
        let (low, high) = solver.range();
        if low.is_nan() || low <= HELD * high {
            return Err(format!(
                "the passive joints are not held there: pivots of their closures from {low:.1e} \
                 to {high:.1e}"
            ));
        }
        let mut follow = Vec::new();
        for &i in &self.independent {
            follow.push(solver.solve(j.column(i).into_owned()));
        }
        let mut d = DMatrix::zeros(n, m);
        for (k, &i) in self.independent.iter().enumerate() {
            d[(i, k)] = 1.0;
        }
        for (row, &i) in self.passive.iter().enumerate() {
            for k in 0..m {
                d[(i, k)] = -follow[k][row];
            }
        }
        Ok(Configuration { q, solver, d })
    }

    /// `Ψ b`.
    fn passive_part(&self, at: &Configuration, b: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; at.q.len()];
        let p = at.solver.solve(DVector::from_column_slice(b));
        for (k, &i) in self.passive.iter().enumerate() {
            out[i] = -p[k];
        }
        out
    }

    /// From one closed configuration to that with the independent coordinates at `x`, in pieces
    /// that are short enough for the assembly mode to stay the same.
    fn walk(&self, from: &Configuration, x: &[f64]) -> Result<Configuration, String> {
        let start: Vec<f64> = self.independent.iter().map(|&i| from.q[i]).collect();
        let way = DVector::from_fn(x.len(), |k, _| x[k] - start[k]);
        let mut here = self.configuration(from.q.clone())?;
        let (mut done, mut piece) = (0.0, 1.0f64);
        loop {
            let step = piece.min(1.0 - done);
            let predicted = &here.d * &way * step;
            let reach = self.chain.scaled_step(predicted.as_slice());
            let next = match reach <= PIECE {
                true => self.piece(&here, &predicted, x, &start, done + step),
                false => Err(String::new()),
            };
            match next {
                Ok(there) => {
                    here = there;
                    done += step;
                    if done > 1.0 - 1e-12 {
                        break;
                    }
                    piece *= 2.0;
                }
                Err(why) => {
                    piece = 0.5 * step;
                    if piece < 1.0 / PIECES {
                        let s = Spread::of(&self.block(&here.q));
                        return Err(format!(
                            "the loops cannot be followed further than {:.1} % of the way from \
                             {start:.4?}: {why} (smallest singular value of the passive joints \
                             there {:.1e}, condition {:.1e})",
                            100.0 * done,
                            s.sigma_min,
                            s.condition()
                        ));
                    }
                }
            }
        }
        Ok(here)
    }

    /// One piece: predictor along the tangent, then Newton.
    fn piece(
        &self,
        from: &Configuration,
        predicted: &DVector<f64>,
        x: &[f64],
        start: &[f64],
        fraction: f64,
    ) -> Result<Configuration, String> {
        let mut q: Vec<f64> = (0..from.q.len())
            .map(|i| from.q[i] + predicted[i])
            .collect();
        for (k, &i) in self.independent.iter().enumerate() {
            q[i] = match fraction > 1.0 - 1e-12 {
                true => x[k],
                false => start[k] + fraction * (x[k] - start[k]),
            };
        }
        let expected = self.chain.scaled_step(predicted.as_slice());
        let mut corrected = 0.0;
        for _ in 0..12 {
            let at = self.configuration(q)?;
            let r = self.chain.residual_of(&at.q);
            let step = self.passive_part(&at, r.as_slice());
            let size = self.chain.scaled_step(&step);
            corrected += size;
            if corrected.is_nan() || corrected > 0.5 * expected + 1e-3 {
                return Err(format!(
                    "the assembly mode may jump: Newton moves the joints by {corrected:.3}, the \
                     tangent by {expected:.3}"
                ));
            }
            q = at.q.iter().zip(&step).map(|(q, s)| q + s).collect();
            // converged: the next error is the square of this step
            if size < 1e-8 {
                let (open, which) = self.chain.open(&q);
                if open > self.tolerance {
                    return Err(format!("loop {which} stays open by {open:.2e} m"));
                }
                return self.configuration(q);
            }
        }
        Err("Newton does not converge in 12 steps".into())
    }

    fn at_home(&self) -> Result<Configuration, String> {
        self.configuration(self.home.clone())
    }

    /// Calls `f` with the closed configuration of each sample, or with `None`.
    fn follow(&self, x: &Samples, mut f: impl FnMut(usize, Option<&Configuration>)) {
        let home = self.at_home().ok();
        let mut last = self.at_home().ok();
        for s in 0..x.count {
            let pose: Vec<f64> = (0..x.dof).map(|k| x.q[k * x.count + s]).collect();
            let from = |start: &Option<Configuration>| match start {
                Some(start) if pose.iter().all(|v| v.is_finite()) => self.walk(start, &pose).ok(),
                _ => None,
            };
            // a straight line from the sample before may leave the reach, that from home not
            let next = from(&last).or_else(|| from(&home));
            f(s, next.as_ref());
            if next.is_some() {
                last = next;
            }
        }
    }

    /// `q̇` and `q̈` of a closed configuration.
    fn rates(
        &self,
        at: &Configuration,
        xd: &DVector<f64>,
        xdd: &DVector<f64>,
    ) -> [DVector<f64>; 2] {
        let qd = &at.d * xd;
        let path: Vec<_> = (0..at.q.len())
            .map(|i| Taylor {
                a: Pack(at.q[i]),
                b: Pack(qd[i]),
                c: Pack(0.0),
            })
            .collect();
        let bias: Vec<f64> = self
            .chain
            .residual(&path)
            .iter()
            .map(|r| 2.0 * r.c.0)
            .collect();
        let second = DVector::from_vec(self.passive_part(at, &bias));
        [qd, &at.d * xdd + second]
    }

    /// `Φ_qq[a, b]`.
    fn second(&self, q: &[f64], a: &[f64], b: &[f64]) -> Vec<f64> {
        let x: Vec<Dual<Dual<Number, 1>, 1>> = (0..q.len())
            .map(|i| Dual {
                v: Dual {
                    v: Pack(q[i]),
                    d: [Pack(a[i])],
                },
                d: [Dual {
                    v: Pack(b[i]),
                    d: [Pack(0.0)],
                }],
            })
            .collect();
        let all = self.chain.residual(&x);
        all.iter().map(|r| r.d[0].d[0].0).collect()
    }

    /// `Φ_p` without dimension.
    fn block(&self, q: &[f64]) -> DMatrix<f64> {
        let j = self.chain.scaled(&self.chain.jacobian(q));
        j.select_columns(&self.passive)
    }
}

impl Chain {
    /// Largest entry of a step, rad or characteristic lengths.
    fn scaled_step(&self, step: &[f64]) -> f64 {
        let sizes = step.iter().zip(self.units());
        sizes.fold(0.0, |m, (s, unit)| f64::max(m, (s / unit).abs()))
    }
}

fn row(x: &[f64], m: usize, count: usize, s: usize) -> DVector<f64> {
    DVector::from_fn(m, |k, _| x[k * count + s])
}

impl Geometry for LoopGeometry {
    fn coordinates(&self) -> usize {
        self.home.len()
    }
    fn task(&self) -> usize {
        self.independent.len()
    }
    fn task_joints(&self) -> Option<&[usize]> {
        Some(&self.independent)
    }
    fn sequential(&self) -> bool {
        true
    }

    fn motion(&self, _isa: Isa, x: &Samples, motion: &mut Samples, d: &mut [f64]) {
        let (n, m, count) = (self.home.len(), self.independent.len(), x.count);
        self.follow(x, |s, at| {
            let Some(at) = at else {
                for i in 0..n {
                    for a in [&mut motion.q, &mut motion.qd, &mut motion.qdd] {
                        a[i * count + s] = f64::NAN;
                    }
                    (0..m).for_each(|k| d[(i * m + k) * count + s] = f64::NAN);
                }
                return;
            };
            let [qd, qdd] = self.rates(at, &row(&x.qd, m, count, s), &row(&x.qdd, m, count, s));
            for i in 0..n {
                motion.q[i * count + s] = at.q[i];
                motion.qd[i * count + s] = qd[i];
                motion.qdd[i * count + s] = qdd[i];
                for k in 0..m {
                    d[(i * m + k) * count + s] = at.d[(i, k)];
                }
            }
        });
    }

    fn sensitivity(
        &self,
        _isa: Isa,
        x: &Samples,
        d: &mut [f64],
        dqd: &mut [f64],
        dqdd: &mut [f64],
    ) {
        let (n, m, count) = (self.home.len(), self.independent.len(), x.count);
        self.follow(x, |s, at| {
            let Some(at) = at else {
                for a in [&mut *d, &mut *dqd, &mut *dqdd] {
                    (0..n * m).for_each(|i| a[i * count + s] = f64::NAN);
                }
                return;
            };
            let [qd, qdd] = self.rates(at, &row(&x.qd, m, count, s), &row(&x.qdd, m, count, s));
            for k in 0..m {
                let along: Vec<f64> = (0..n).map(|i| at.d[(i, k)]).collect();
                let first = self.passive_part(at, &self.second(&at.q, qd.as_slice(), &along));
                // the whole motion, moved in the direction k: what is missing is ∂q̈/∂x
                let path: Vec<Dual<Taylor<Number>, 1>> = (0..n)
                    .map(|i| Dual {
                        v: Taylor {
                            a: Pack(at.q[i]),
                            b: Pack(qd[i]),
                            c: Pack(0.5 * qdd[i]),
                        },
                        d: [Taylor {
                            a: Pack(along[i]),
                            b: Pack(first[i]),
                            c: Pack(0.0),
                        }],
                    })
                    .collect();
                let bias: Vec<f64> = self
                    .chain
                    .residual(&path)
                    .iter()
                    .map(|r| 2.0 * r.d[0].c.0)
                    .collect();
                let second = self.passive_part(at, &bias);
                for i in 0..n {
                    let to = (i * m + k) * count + s;
                    (d[to], dqd[to], dqdd[to]) = (along[i], first[i], second[i]);
                }
            }
        });
    }

    fn curvature(&self, _isa: Isa, x: &Samples, u: &[f64], out: &mut [f64]) {
        let (n, m, count) = (self.home.len(), self.independent.len(), x.count);
        self.follow(x, |s, at| {
            let Some(at) = at else {
                (0..n * m).for_each(|i| out[i * count + s] = f64::NAN);
                return;
            };
            let du = &at.d * row(u, m, count, s);
            for k in 0..m {
                let along: Vec<f64> = (0..n).map(|i| at.d[(i, k)]).collect();
                let bend = self.passive_part(at, &self.second(&at.q, du.as_slice(), &along));
                for i in 0..n {
                    out[(i * m + k) * count + s] = bend[i];
                }
            }
        });
    }

    fn unreachable(&self, x: &[f64]) -> Option<String> {
        let home = match self.at_home() {
            Ok(home) => home,
            Err(why) => return Some(format!("at home {why}")),
        };
        self.walk(&home, x).err()
    }

    fn constraint_block(&self, x: &[f64]) -> Option<DMatrix<f64>> {
        let home = match self.at_home() {
            Ok(home) => home,
            // singular already at home: shown as it is
            Err(_) => return Some(self.block(&self.home)),
        };
        match self.walk(&home, x) {
            Ok(at) => Some(self.block(&at.q)),
            Err(_) => Some(DMatrix::from_element(1, 1, f64::NAN)),
        }
    }

    fn segments(&self, x: &[f64]) -> Vec<Segment> {
        let Some(at) = self.at_home().and_then(|home| self.walk(&home, x)).ok() else {
            return Vec::new();
        };
        let origins = self.chain.origins(&at.q);
        let mut all = Vec::new();
        let mut add = |name: String, ends: [nalgebra::Vector3<f64>; 2]| {
            if (ends[0] - ends[1]).norm() > 1e-9 {
                all.push(Segment { name, ends });
            }
        };
        for (b, node) in self.chain.tree.nodes.iter().enumerate() {
            let from = node.parent.map_or_else(Default::default, |p| origins[p]);
            add(self.chain.names[b].clone(), [from, origins[b]]);
        }
        for closure in &self.chain.closures {
            for (frame, end) in closure.frames.iter().zip(self.chain.ends(&at.q, closure)) {
                let from = frame.body.map_or_else(Default::default, |b| origins[b]);
                add(frame.name.clone(), [from, end]);
            }
        }
        all
    }

    fn cones(&self, _x: &[f64]) -> Vec<Cone> {
        Vec::new()
    }
}
