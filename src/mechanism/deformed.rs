//! Forces of legs whose joints are not where the file says, along one and the same motion of the actuators.
//!
//! With `q = F(x; g)` the geometry `g` moves the platform at a given reading of the actuators and turns the legs:
//!
//! ```text
//! F_a(x'; g + δg) = q_a + δzero     F'ẋ' = q̇_a     F'ẍ' + F'_xx[ẋ', ẋ'] = q̈_a     δτ = τ(x'; g + δg) − τ(x; g)
//! ```
//!
//! The bodies of a leg feel its length and its angles alone, so the tree stays as it is. Changes are central
//! differences, and `x'` is the first step of Newton's method from the nominal pose: what the second would add is even in the
//! step, and the difference does not have it.

use super::dimensions::LEG;
use super::{Mechanism, Source};
use crate::dynamics::{Samples, Workspace};
use crate::error::Result;
use std::sync::Arc;

/// Half of the difference that a derivative is taken from, m.
const STEP: f64 = 1e-5;
/// Samples a second that a change of the geometry is computed at. It follows the motion and has no reversals.
const RATE: f64 = 60.0;

impl Mechanism {
    /// How many deviations of its legs [`Mechanism::deformations`] knows: [`LEG`] of each, none for other mechanisms.
    pub(crate) fn deviations(&self) -> usize {
        match (&self.source, self.actuators() == self.freedoms()) {
            (Source::GoughStewart, true) => LEG.len() * self.actuators(),
            _ => 0,
        }
    }

    /// Change of the actuator forces per unit of each deviation, in the order of [`LEG`], leg after leg: entry `a·count + s`
    /// for actuator `a` and sample `s`, N/m. `bodies` are the inertial parameters of all bodies of the tree, `dt` is the
    /// time from sample to sample, s: the change is computed at 60 samples a second and at the last, cubics join them.
    ///
    /// # Errors
    /// Poses that cannot be reached.
    pub(crate) fn deformations(
        &self,
        x: &Samples,
        dt: f64,
        bodies: &[f64],
    ) -> Result<Vec<Vec<f64>>> {
        if x.count == 0 {
            return Ok(vec![Vec::new(); self.deviations()]);
        }
        let every = ((1.0 / (RATE * dt)) as usize).clamp(1, x.count);
        let thin = thinned(x, every);
        let nominal = self.motion(&thin)?;
        let read = |of: &[f64]| -> Vec<Vec<f64>> {
            let row = |j: &usize| of[j * thin.count..(j + 1) * thin.count].to_vec();
            self.actuated.iter().map(row).collect()
        };
        let actuators = [&nominal.tree.q, &nominal.tree.qd, &nominal.tree.qdd].map(|of| read(of));
        let (n, parts) = (self.deviations(), LEG.len());
        let mut all = Vec::with_capacity(n);
        for k in 0..n {
            let side = |step: f64| {
                let mut shift = [0.0; 7];
                shift[k % parts] = step;
                self.deformed(&thin, &actuators, k / parts, &shift, bodies)
            };
            let (plus, minus) = (side(STEP)?, side(-STEP)?);
            let pairs = plus.iter().zip(&minus);
            let change: Vec<f64> = pairs.map(|(p, m)| (p - m) / (2.0 * STEP)).collect();
            let mut dense = Vec::with_capacity(self.actuators() * x.count);
            for row in change.chunks_exact(thin.count) {
                between(row, every, x.count, &mut dense);
            }
            all.push(dense);
        }
        Ok(all)
    }

    /// Forces with one leg off, at the same motion of the actuators.
    fn deformed(
        &self,
        x: &Samples,
        actuators: &[Vec<Vec<f64>>; 3],
        leg: usize,
        shift: &[f64; 7],
        bodies: &[f64],
    ) -> Result<Vec<f64>> {
        let mut other = self.clone();
        let mut off = vec![0.0; self.deviations()];
        off[LEG.len() * leg..LEG.len() * (leg + 1)].copy_from_slice(shift);
        if let Some(geometry) = self.geometry.deformed(&off) {
            other.geometry = Arc::from(geometry);
        }
        let (na, m, count) = (self.actuators(), self.freedoms(), x.count);
        // `D_a⁻¹` times what the actuators lack
        let solved = |a: &[f64], lack: &dyn Fn(usize, usize) -> f64, to: &mut [f64], add: bool| {
            for k in 0..m {
                for s in 0..count {
                    let sum: f64 = (0..na)
                        .map(|j| a[(k * na + j) * count + s] * lack(j, s))
                        .sum();
                    let to = &mut to[k * count + s];
                    *to = if add { *to + sum } else { sum };
                }
            }
        };
        let at = |of: &[f64], j: usize, s: usize| of[self.actuated[j] * count + s];
        let mut y = x.clone();
        let mut motion = other.motion(&y)?;
        let lack = |j: usize, s: usize| {
            let zero = if j == leg { shift[6] } else { 0.0 };
            actuators[0][j][s] + zero - at(&motion.tree.q, j, s)
        };
        solved(&motion.a, &lack, &mut y.q, true);
        let isa = Workspace::default().isa();
        other.motion_into(isa, &y, &mut motion)?;
        solved(&motion.a, &|j, s| actuators[1][j][s], &mut y.qd, false);
        y.qdd.fill(0.0);
        other.motion_into(isa, &y, &mut motion)?;
        let lack = |j: usize, s: usize| actuators[2][j][s] - at(&motion.tree.qdd, j, s);
        solved(&motion.a, &lack, &mut y.qdd, false);
        // accelerations of all joints are linear in those of the platform: `q̈ = D ẍ + Ḋ ẋ`
        for (c, qdd) in motion.tree.qdd.chunks_exact_mut(count).enumerate() {
            for k in 0..m {
                let d = &motion.d[(c * m + k) * count..][..count];
                let rows = qdd.iter_mut().zip(d).zip(&y.qdd[k * count..]);
                rows.for_each(|((to, d), x)| *to += d * x);
            }
        }
        let mut gamma = vec![0.0; motion.tree.dof * count];
        let ws = &mut Workspace::default();
        self.tree
            .inverse_dynamics(ws, bodies, &motion.tree, &mut gamma);
        Ok(other.project(&motion, &gamma))
    }

    /// Inertial parameters of all bodies of the tree with `phi` in place of the unknowns, ten a body.
    pub(crate) fn bodies_with(&self, phi: &[f64]) -> Vec<f64> {
        let mut all = Vec::new();
        self.tree_phi(&self.parameters.expand(phi), true, &mut all);
        all
    }
}

/// Every `every`-th sample, and the last.
fn thinned(x: &Samples, every: usize) -> Samples {
    let points = (x.count - 1).div_ceil(every) + 1;
    let mut out = Samples::zeros(x.dof, points);
    let all = [
        (&mut out.q, &x.q),
        (&mut out.qd, &x.qd),
        (&mut out.qdd, &x.qdd),
    ];
    for (to, from) in all {
        for c in 0..x.dof {
            for i in 0..points {
                to[c * points + i] = from[c * x.count + (i * every).min(x.count - 1)];
            }
        }
    }
    out
}

/// Values at every `every`-th sample and at the last, at all of `count`: cubics with the slopes of their neighbours.
fn between(values: &[f64], every: usize, count: usize, out: &mut Vec<f64>) {
    let last = values.len() - 1;
    let time = |i: usize| (i * every).min(count - 1) as f64;
    let slope = |i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
        (values[b] - values[a]) / (time(b) - time(a)).max(1.0)
    };
    for s in 0..count {
        let i = (s / every).min(last.saturating_sub(1));
        let (a, b) = (i, (i + 1).min(last));
        let width = (time(b) - time(a)).max(1.0);
        let u = (s as f64 - time(a)) / width;
        let (v, w) = (u * u, u * u * u);
        let ends = (2.0 * w - 3.0 * v + 1.0) * values[a] + (3.0 * v - 2.0 * w) * values[b];
        let tangents = (w - 2.0 * v + u) * slope(a) + (w - v) * slope(b);
        out.push(ends + width * tangents);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_follow_a_smooth_signal() {
        let f = |t: f64| (0.05 * t).sin();
        let coarse: Vec<f64> = (0..=50).map(|i| f((4 * i).min(199) as f64)).collect();
        let mut fine = Vec::new();
        between(&coarse, 4, 200, &mut fine);
        let worst = fine.iter().enumerate();
        let worst = worst.fold(0.0f64, |m, (t, v)| m.max((v - f(t as f64)).abs()));
        assert!(fine.len() == 200 && worst < 1e-3, "{worst}");
    }
}
