//! Gradients of a weighted sum of actuator forces of a closed chain,
//!
//! ```text
//! v = D_a⁺ u    uᵀτ = (D v)ᵀ Γ_tree
//! d(uᵀτ) = (D v)ᵀ dΓ_tree + μᵀ F_xx[v, dx] + ρᵀ F_a,xx[z, dx]
//! μ = Γ_tree − Σ_a τ_a e_a      ρ = u − D_a v      z = D_a⁺ D_a⁺ᵀ Dᵀ Γ_tree
//! ```
//!
//! with `ρ = 0` without redundant actuators.

use super::Mechanism;
use super::actuation::{contract, spread};
use super::motion::MechanismWorkspace;
use crate::dynamics::Samples;
use crate::error::Result;
use crate::regressor::term_factor;
use crate::robot::JointTerm;

/// `sign(v)` rounded over `w`: `v/√(v² + w²)`, and its derivative.
pub(crate) fn rounded_sign(v: f64, w: f64) -> [f64; 2] {
    let size = v * v + w * w;
    [v / size.sqrt(), w * w / size.powf(1.5)]
}

/// Gradients by the task coordinates and their two derivatives: parameter vector `v`, task
/// coordinate `k`, sample `s` at `(v·task + k)·count + s`.
#[derive(Debug, Clone, Default)]
pub struct TaskDerivatives {
    /// `∂/∂x`
    pub x: Vec<f64>,
    /// `∂/∂ẋ`
    pub xd: Vec<f64>,
    /// `∂/∂ẍ`
    pub xdd: Vec<f64>,
}

impl Mechanism {
    /// For each of the raw parameter vectors `φ_v` (one after another in `raw`) and rates `r_v` of
    /// the actuators the gradient of `Σ_a r_va τ_a(x, ẋ, ẍ; φ_v)`, see the head of this file.
    /// `rates` holds vector `v`, actuator `a`, sample `s` at `(v·actuators + a)·count + s`. Known
    /// bodies do not count; Coulomb friction is rounded by [`MechanismWorkspace::sign_width`].
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    ///
    /// # Panics
    /// If an array is too short.
    pub fn gradients(
        &self,
        ws: &mut MechanismWorkspace,
        raw: &[f64],
        x: &Samples,
        rates: &[f64],
        out: &mut TaskDerivatives,
    ) -> Result<()> {
        let each = self.parameters.raw_count();
        ws.phi.clear();
        ws.terms.clear();
        for raw in raw.chunks_exact(each.max(1)) {
            self.tree_phi(raw, false, &mut ws.phi);
            let values = &raw[10 * self.parameters.bodies.len()..];
            let terms = self.parameters.terms.iter().zip(values);
            ws.terms
                .extend(terms.map(|(&(joint, term), &value)| (joint, term, value)));
        }
        let vectors = raw.len() / each.max(1);
        self.gradients_of(ws, vectors, x, rates, out)
    }

    /// As [`Mechanism::gradients`], with `vectors` times the nominal model: known bodies and all
    /// joint terms count.
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    ///
    /// # Panics
    /// If `rates` is too short.
    pub fn nominal_gradients(
        &self,
        ws: &mut MechanismWorkspace,
        vectors: usize,
        x: &Samples,
        rates: &[f64],
        out: &mut TaskDerivatives,
    ) -> Result<()> {
        ws.phi.clear();
        ws.terms.clear();
        for _ in 0..vectors {
            ws.phi
                .extend(self.robot.bodies.iter().flat_map(|b| b.inertia.0));
            for (j, joint) in self.robot.joints.iter().enumerate() {
                let terms = JointTerm::ALL.into_iter().zip(joint.terms);
                ws.terms.extend(terms.map(|(term, value)| (j, term, value)));
            }
        }
        self.gradients_of(ws, vectors, x, rates, out)
    }

    /// Gradients for the bodies in `ws.phi` and the terms in `ws.terms`, both vector by vector.
    fn gradients_of(
        &self,
        ws: &mut MechanismWorkspace,
        vectors: usize,
        x: &Samples,
        rates: &[f64],
        out: &mut TaskDerivatives,
    ) -> Result<()> {
        let isa = ws.tree.isa();
        self.motion_into(isa, x, &mut ws.motion)?;
        let (n, m, na, count) = (self.robot.dof(), self.freedoms(), self.actuators(), x.count);
        assert!(rates.len() >= vectors * na * count, "rates do not fit");
        for a in &mut ws.d {
            a.resize(n * m * count, 0.0);
        }
        let [d, dqd, dqdd] = &mut ws.d;
        self.geometry.sensitivity(isa, x, d, dqd, dqdd);
        let motion = &ws.motion;

        // virtual motion of the tree, and the gradients of the tree along it
        ws.rates.clear();
        ws.rates.resize(vectors * n * count, 0.0);
        ws.u.clear();
        ws.u.resize(vectors * m * count, 0.0);
        for v in 0..vectors {
            let r = &rates[v * na * count..(v + 1) * na * count];
            let tree = &mut ws.rates[v * n * count..(v + 1) * n * count];
            spread(&motion.g, r, n, na, count, tree);
            let u = &mut ws.u[v * m * count..(v + 1) * m * count];
            spread(&motion.a, r, m, na, count, u);
        }
        self.tree.gradients(
            &mut ws.tree,
            &ws.phi,
            &motion.tree,
            &ws.rates,
            &mut ws.derivatives,
        );
        for a in [&mut out.x, &mut out.xd, &mut out.xdd] {
            a.clear();
            a.resize(vectors * m * count, 0.0);
        }
        ws.torque.resize(n * count, 0.0);
        ws.curvature.resize(n * m * count, 0.0);
        let terms_each = ws.terms.len() / vectors.max(1);
        for v in 0..vectors {
            let block = |len: usize| v * len * count..(v + 1) * len * count;
            let terms = &ws.terms[v * terms_each..(v + 1) * terms_each];
            let tree_rates = &ws.rates[block(n)];
            let (gq, gqd, gqdd) = (
                &ws.derivatives.q[block(n)],
                &mut ws.derivatives.qd[block(n)],
                &mut ws.derivatives.qdd[block(n)],
            );
            for &(joint, term, value) in terms {
                let row = joint * count..(joint + 1) * count;
                let r = &tree_rates[row.clone()];
                match term {
                    JointTerm::Armature => {
                        let to = gqdd[row].iter_mut().zip(r);
                        to.for_each(|(g, r)| *g += value * r);
                    }
                    JointTerm::Viscous => {
                        let to = gqd[row].iter_mut().zip(r);
                        to.for_each(|(g, r)| *g += value * r);
                    }
                    JointTerm::Coulomb => {
                        let Some(&w) = ws.sign_width.get(joint) else {
                            continue;
                        };
                        let to = gqd[row.clone()].iter_mut().zip(r);
                        for ((g, r), qd) in to.zip(&motion.tree.qd[row]) {
                            *g += value * r * rounded_sign(*qd, w)[1];
                        }
                    }
                    JointTerm::Offset => {}
                }
            }
            let (ox, oxd, oxdd) = (
                &mut out.x[block(m)],
                &mut out.xd[block(m)],
                &mut out.xdd[block(m)],
            );
            contract(d, gqdd, n, m, count, oxdd);
            contract(d, gqd, n, m, count, oxd);
            contract(dqd, gqdd, n, m, count, ox);
            oxd.iter_mut().zip(&*ox).for_each(|(a, b)| *a += 2.0 * b);
            ox.fill(0.0);
            contract(d, gq, n, m, count, ox);
            contract(dqd, gqd, n, m, count, ox);
            contract(dqdd, gqdd, n, m, count, ox);

            // change of G: μᵀ F_xx[v, ·]
            let bodies = 10 * self.tree.bodies();
            let phi = &ws.phi[v * bodies..(v + 1) * bodies];
            let gamma = &mut ws.torque;
            self.tree
                .inverse_dynamics(&mut ws.tree, phi, &motion.tree, gamma);
            for &(joint, term, value) in terms {
                for s in 0..count {
                    let state = motion.tree.at(joint, s);
                    let factor = match (term, ws.sign_width.get(joint)) {
                        (JointTerm::Coulomb, Some(&w)) => rounded_sign(state[1], w)[0],
                        _ => term_factor(term, state),
                    };
                    gamma[joint * count + s] += value * factor;
                }
            }
            let tau = self.project(motion, gamma);
            let u = &ws.u[block(m)];
            let redundant = na > m;
            if redundant {
                // z = D_a⁺ D_a⁺ᵀ Dᵀ Γ = D_a⁺ τ
                ws.z.clear();
                ws.z.resize(m * count, 0.0);
                spread(&motion.a, &tau, m, na, count, &mut ws.z);
            }
            for (i, &c) in self.actuated.iter().enumerate() {
                for s in 0..count {
                    gamma[c * count + s] -= tau[i * count + s];
                }
            }
            self.geometry.curvature(isa, x, u, &mut ws.curvature);
            contract(&ws.curvature, gamma, n, m, count, ox);
            if redundant {
                let r = &rates[block(na)];
                gamma.fill(0.0);
                for (i, &c) in self.actuated.iter().enumerate() {
                    for s in 0..count {
                        let along: f64 = (0..m)
                            .map(|k| motion.d[(c * m + k) * count + s] * u[k * count + s])
                            .sum();
                        gamma[c * count + s] = r[i * count + s] - along;
                    }
                }
                self.geometry.curvature(isa, x, &ws.z, &mut ws.curvature);
                contract(&ws.curvature, gamma, n, m, count, ox);
            }
        }
        Ok(())
    }
}
