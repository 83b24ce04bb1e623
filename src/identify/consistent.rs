//! Parameters that a robot can have, as near to the data as to the prior.
//!
//! ```text
//! minimise over φ   ½ (T_b φ − π̂)ᵀ Λ (T_b φ − π̂) + γ d(φ ‖ φ₀)
//! ```
//!
//! with `π_b = T_b φ` the base parameters, `π̂` and `Λ` their estimate and information, and the Bregman
//! divergence of the log-determinant, the entropic distance between bodies (Lee, Wensing & Park 2020;
//! Wensing, Kim & Slotine 2018),
//!
//! ```text
//! d = Σ_bodies [ tr(J₀⁻¹J) − ln det(J₀⁻¹J) − 4 ] + Σ_terms [ x/x₀ − ln(x/x₀) − 1 ]
//! ```
//!
//! of pseudo-inertia matrices `J` (4×4), armature, viscous and Coulomb friction. It does not depend on
//! frames or units, and it grows without end towards the border, so that every `J` stays positive
//! definite and every friction positive: a barrier with a meaning. Directions that the data do not see
//! stay where the prior has them. `D` near `φ₀` is half the squared relative deviation: `γ = 1/s²`
//! stands for a prior that is good to a fraction `s`. The problem is convex and smooth; damped Newton
//! steps solve it to machine precision. [`super::lmi`] solves the same problem as a semidefinite
//! program where the distance is quadratic.

use crate::error::{Error, Result, Warning, WarningKind};
use crate::plant::{Column, Plant};
use crate::robot::{Inertia, JointTerm};
use faer::{ColRef, Mat, MatRef, Side};
use nalgebra::Matrix4;

/// A body whose ten parameters are unknowns: its number and the unknown of each, where it has one.
#[derive(Debug, Clone)]
pub struct Body {
    /// name
    pub name: String,
    /// unknown that each of the ten parameters is
    pub unknowns: [Option<usize>; 10],
    /// nominal pseudo-inertia, made positive definite
    pub nominal: Matrix4<f64>,
}

/// A number that cannot be negative.
#[derive(Debug, Clone)]
pub struct Term {
    /// unknown
    pub unknown: usize,
    /// value that it is compared with
    pub nominal: f64,
    /// weight relative to that of a body
    pub weight: f64,
}

/// What is known of the unknowns of a plant before the run.
#[derive(Debug, Clone)]
pub struct Prior {
    /// bodies whose pseudo-inertia must be positive definite
    pub bodies: Vec<Body>,
    /// unknowns that must be positive
    pub terms: Vec<Term>,
    /// unknowns of any sign: nominal value and scale of a deviation
    pub free: Vec<(usize, f64, f64)>,
    /// start, inside
    pub phi: Vec<f64>,
    /// nominal values that had to be changed
    pub warnings: Vec<Warning>,
}

/// Pseudo-inertia of unit `k`: `J = Σ_k φ_k E_k`.
pub fn unit(k: usize) -> Matrix4<f64> {
    let mut x = [0.0; 10];
    x[k] = 1.0;
    Inertia(x).pseudo_inertia()
}

impl Prior {
    /// From the nominal values of a plant. `scale` gives the size of the terms that are nominally
    /// zero (an estimate of them).
    pub fn new(plant: &Plant, scale: &dyn Fn(usize) -> Option<f64>) -> Prior {
        let parameters = plant.parameters();
        let robot = plant.robot();
        let mut phi: Vec<f64> = parameters.iter().map(|p| p.value).collect();
        let mut prior = Prior {
            bodies: Vec::new(),
            terms: Vec::new(),
            free: Vec::new(),
            phi: Vec::new(),
            warnings: Vec::new(),
        };
        let mut taken = vec![false; phi.len()];
        for (body, unknowns) in body_unknowns(plant) {
            // without a mass or one of the moments there is no matrix to be definite: its numbers
            // on the diagonal must be positive by themselves
            let whole = [0, 4, 7, 9].iter().all(|&k| unknowns[k].is_some());
            let name = robot.bodies[body].name.clone();
            if !whole {
                for (k, unknown) in unknowns.iter().enumerate() {
                    let Some(u) = unknown.filter(|u| !taken[*u]) else {
                        continue;
                    };
                    taken[u] = true;
                    if matches!(k, 0 | 4 | 7 | 9) {
                        let nominal = if phi[u] > 0.0 { phi[u] } else { 1e-3 };
                        phi[u] = nominal;
                        prior.terms.push(Term {
                            unknown: u,
                            nominal,
                            weight: 1.0,
                        });
                    } else {
                        prior.free.push((u, phi[u], 0.1 + phi[u].abs()));
                    }
                }
                continue;
            }
            let ten: [f64; 10] = std::array::from_fn(|k| unknowns[k].map_or(0.0, |u| phi[u]));
            let (nominal, changed) = definite(Inertia(ten).pseudo_inertia());
            if changed {
                prior.warnings.push(Warning::new(WarningKind::InertiaImpossible,
                    name.clone(),
                    "its nominal inertia is not that of a body that can exist; the nearest that can was \
                     taken for the prior",
                ));
                for (u, x) in unknowns.iter().zip(ten_of(&nominal)) {
                    if let Some(u) = u {
                        phi[*u] = x;
                    }
                }
            }
            unknowns.iter().flatten().for_each(|&u| taken[u] = true);
            prior.bodies.push(Body {
                name,
                unknowns,
                nominal,
            });
        }
        for (u, p) in parameters.iter().enumerate().filter(|(u, _)| !taken[*u]) {
            let Column::Term { term, joint } = p.kind else {
                prior.free.push((u, p.value, 1.0 + p.value.abs()));
                continue;
            };
            if term == JointTerm::Offset {
                let effort = robot.joints[joint].limits.effort;
                let size = if effort.is_finite() && effort > 0.0 {
                    0.1 * effort
                } else {
                    10.0
                };
                prior.free.push((u, p.value, size.max(p.value.abs())));
                continue;
            }
            // a term that nothing is known of only has to be positive
            let (nominal, weight) = match (p.value > 0.0, scale(u).filter(|x| *x > 0.0)) {
                (true, _) => (p.value, 1.0),
                (false, Some(x)) => (x, 0.01),
                (false, None) => (1e-3, 0.01),
            };
            phi[u] = nominal;
            prior.terms.push(Term {
                unknown: u,
                nominal,
                weight,
            });
        }
        prior.phi = phi;
        prior
    }

    /// Pseudo-inertia of a body.
    pub fn pseudo(&self, body: &Body, phi: &[f64]) -> Matrix4<f64> {
        Inertia(std::array::from_fn(|k| {
            body.unknowns[k].map_or(0.0, |u| phi[u])
        }))
        .pseudo_inertia()
    }

    /// The divergence from the prior; infinite outside.
    pub fn divergence(&self, phi: &[f64]) -> f64 {
        let mut sum = 0.0;
        for b in &self.bodies {
            let j = self.pseudo(b, phi);
            let (Some(c), Some(c0)) = (j.cholesky(), b.nominal.cholesky()) else {
                return f64::INFINITY;
            };
            let ln = |l: Matrix4<f64>| 2.0 * (0..4).map(|i| l[(i, i)].ln()).sum::<f64>();
            sum += (c0.inverse() * j).trace() - ln(c.l()) + ln(c0.l()) - 4.0;
        }
        for t in &self.terms {
            let x = phi[t.unknown] / t.nominal;
            if x.is_nan() || x <= 0.0 {
                return f64::INFINITY;
            }
            sum += t.weight * (x - x.ln() - 1.0);
        }
        for &(u, x0, s) in &self.free {
            sum += 0.5 * ((phi[u] - x0) / s).powi(2);
        }
        sum
    }

    /// Adds `γ` times gradient and Hessian of the divergence.
    pub fn add(&self, phi: &[f64], gamma: f64, g: &mut [f64], h: &mut Mat<f64>) {
        for b in &self.bodies {
            let (Some(inverse), Some(nominal)) =
                (self.pseudo(b, phi).try_inverse(), b.nominal.try_inverse())
            else {
                continue;
            };
            let difference = nominal - inverse;
            let e: Vec<(usize, Matrix4<f64>)> = (0..10)
                .filter_map(|k| b.unknowns[k].map(|u| (u, unit(k))))
                .collect();
            let turned: Vec<Matrix4<f64>> = e.iter().map(|(_, m)| inverse * m).collect();
            for (i, (u, m)) in e.iter().enumerate() {
                g[*u] += gamma * (difference * m).trace();
                for (k, (v, _)) in e.iter().enumerate() {
                    h[(*u, *v)] += gamma * (turned[i] * turned[k]).trace();
                }
            }
        }
        for t in &self.terms {
            let x = phi[t.unknown];
            g[t.unknown] += gamma * t.weight * (1.0 / t.nominal - 1.0 / x);
            h[(t.unknown, t.unknown)] += gamma * t.weight / (x * x);
        }
        for &(u, x0, s) in &self.free {
            g[u] += gamma * (phi[u] - x0) / (s * s);
            h[(u, u)] += gamma / (s * s);
        }
    }

    /// Smallest eigenvalue of any pseudo-inertia relative to its largest, and the body.
    pub fn margin(&self, phi: &[f64]) -> Option<(f64, &str)> {
        self.bodies
            .iter()
            .map(|b| {
                let e = self.pseudo(b, phi).symmetric_eigen().eigenvalues;
                (e.min() / e.max().abs().max(1e-300), b.name.as_str())
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// For every body with unknowns of its own, which unknown each of its ten parameters is. Bodies that
/// share all of theirs with an earlier one are left out.
pub fn body_unknowns(plant: &Plant) -> Vec<(usize, [Option<usize>; 10])> {
    // which unknown multiplies each raw column first
    let mut first = vec![None; plant.raw().len()];
    for (u, p) in plant.parameters().iter().enumerate() {
        for &r in &p.raw {
            first[r].get_or_insert(u);
        }
    }
    let mut out: Vec<(usize, [Option<usize>; 10])> = Vec::new();
    for (column, unknown) in plant.raw().iter().zip(first) {
        if let Column::Inertial { body, k } = *column {
            if out.last().is_none_or(|(b, _)| *b != body) {
                out.push((body, [None; 10]));
            }
            if let Some((_, map)) = out.last_mut() {
                map[k] = unknown;
            }
        }
    }
    let mut seen: Vec<[Option<usize>; 10]> = Vec::new();
    out.retain(|(_, map)| {
        let new = map.iter().any(Option::is_some) && !seen.contains(map);
        if new {
            seen.push(*map);
        }
        new
    });
    out
}

/// The ten parameters of a pseudo-inertia: `I = tr(Σ) 1 − Σ`.
pub fn ten_of(j: &Matrix4<f64>) -> [f64; 10] {
    let t = j[(0, 0)] + j[(1, 1)] + j[(2, 2)];
    [
        j[(3, 3)],
        j[(0, 3)],
        j[(1, 3)],
        j[(2, 3)],
        t - j[(0, 0)],
        -j[(0, 1)],
        -j[(0, 2)],
        t - j[(1, 1)],
        -j[(1, 2)],
        t - j[(2, 2)],
    ]
}

/// A pseudo-inertia well inside the cone, and whether it had to be moved. A body without mass gets
/// a gram.
fn definite(mut j: Matrix4<f64>) -> (Matrix4<f64>, bool) {
    let mut changed = false;
    if j[(3, 3)].is_nan() || j[(3, 3)] <= 1e-3 {
        j[(3, 3)] = 1e-3;
        changed = true;
    }
    // about the centre of mass the tensor part stands alone
    let m = j[(3, 3)];
    let c = j.fixed_view::<3, 1>(0, 3) / m;
    let sigma = j.fixed_view::<3, 3>(0, 0) - c * c.transpose() * m;
    let mut e = sigma.symmetric_eigen();
    let least = (1e-3 * e.eigenvalues.max()).max(1e-6 * m * 0.01);
    for x in e.eigenvalues.iter_mut() {
        if *x < least {
            changed |= *x < 0.5 * least;
            *x = least;
        }
    }
    if changed {
        let sigma = e.recompose() + c * c.transpose() * m;
        j.fixed_view_mut::<3, 3>(0, 0).copy_from(&sigma);
        let h = c * m;
        j.fixed_view_mut::<3, 1>(0, 3).copy_from(&h);
        j.fixed_view_mut::<1, 3>(3, 0).copy_from(&h.transpose());
    }
    (j, changed)
}

/// A consistent estimate.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// standard parameters
    pub phi: Vec<f64>,
    /// Hessian of the whole at the minimum
    pub hessian: Mat<f64>,
}

/// Minimises `½ ‖C φ − d‖² + γ D(φ)` from the point `start` inside (the prior where it is `None`).
///
/// # Errors
/// Numbers that are not finite.
pub fn solve(
    c: MatRef<'_, f64>,
    d: &[f64],
    prior: &Prior,
    gamma: f64,
    start: Option<&[f64]>,
) -> Result<Estimate> {
    let p = prior.phi.len();
    let mut phi = start.unwrap_or(&prior.phi).to_vec();
    let gram = c.transpose() * c;
    let right: Vec<f64> = (0..p)
        .map(|j| (0..c.nrows()).map(|i| c[(i, j)] * d[i]).sum())
        .collect();
    let data = |phi: &[f64]| -> f64 {
        let error = c * ColRef::from_slice(phi) - ColRef::from_slice(d);
        0.5 * error.squared_norm_l2()
    };
    let total = |phi: &[f64]| {
        let distance = prior.divergence(phi);
        if distance.is_finite() {
            data(phi) + gamma * distance
        } else {
            f64::INFINITY
        }
    };
    let mut value = total(&phi);
    let mut hessian = gram.clone();
    for _ in 0..200 {
        let known = &gram * ColRef::from_slice(&phi);
        let mut g: Vec<f64> = (0..p).map(|i| known[i] - right[i]).collect();
        hessian = gram.clone();
        prior.add(&phi, gamma, &mut g, &mut hessian);
        // unit diagonal, so that units do not cost digits
        let s: Vec<f64> = (0..p).map(|i| hessian[(i, i)].max(1e-300).sqrt()).collect();
        let scaled = Mat::from_fn(p, p, |i, j| {
            hessian[(i, j)] / (s[i] * s[j]) + if i == j { 1e-14 } else { 0.0 }
        });
        let factor = scaled.llt(Side::Lower).map_err(|_| {
            Error::Infeasible(
                "the information matrix with the prior is not positive definite".into(),
            )
        })?;
        use faer::linalg::solvers::Solve;
        let x = factor.solve(Mat::from_fn(p, 1, |i, _| -g[i] / s[i]));
        let step: Vec<f64> = (0..p).map(|i| x[(i, 0)] / s[i]).collect();
        // Newton decrement, squared and halved: how far the objective is from its minimum
        let gap = -0.5 * (0..p).map(|i| g[i] * step[i]).sum::<f64>();
        if !gap.is_finite() {
            return Err(Error::Infeasible(
                "the consistent estimate ran into numbers that are not finite".into(),
            ));
        }
        if gap <= 1e-11 * (1.0 + 1e-3 * value.abs()) {
            break;
        }
        let mut t = 1.0;
        loop {
            let next: Vec<f64> = (0..p).map(|i| phi[i] + t * step[i]).collect();
            let v = total(&next);
            if v <= value - 0.2 * t * gap {
                phi = next;
                value = v;
                break;
            }
            t *= 0.5;
            if t < 1e-12 {
                return Ok(Estimate { phi, hessian });
            }
        }
    }
    Ok(Estimate { phi, hessian })
}
