//! What a joint adds to its torque by itself: an offset, the inertia of its rotor, and friction.

use crate::dot::dot;

/// Own terms of a joint: orthonormal columns from an offset, its acceleration and its friction.
pub(super) struct Own {
    /// offset; acceleration; viscous friction; Coulomb friction beside it; Coulomb friction alone. Zero where others make
    /// it up.
    columns: [Vec<f64>; 5],
    /// how much of Coulomb friction goes with the viscous one, in their lengths
    slope: f64,
}

/// Which friction there is: both, Coulomb, viscous, none; the columns of each.
pub(super) const KINDS: [&[usize]; 4] = [&[0, 1, 2, 3], &[0, 1, 4], &[0, 1, 2], &[0, 1]];

/// A signal along the own terms of a joint.
#[derive(Clone, Copy, Default)]
pub(super) struct Along {
    along: [f64; 5],
    square: f64,
}

impl Own {
    /// Own terms of a joint with these velocities and accelerations. The rotor of a joint that is `alone` is not told from
    /// its body.
    pub fn new(v: &[f64], a: &[f64], alone: bool) -> Own {
        let count = v.len();
        let usual = (dot(v, v) / count.max(1) as f64).sqrt();
        // friction turns over smoothly where the sign of a filtered velocity is not known
        let sign: Vec<f64> = v
            .iter()
            .map(|x| (x / (0.05 * usual).max(1e-12)).tanh())
            .collect();
        let offset = unit(&vec![1.0; count], &[]);
        let rotor = match alone {
            true => vec![0.0; count],
            false => unit(a, &[&offset]),
        };
        let viscous = unit(v, &[&offset, &rotor]);
        let beside = unit(&sign, &[&offset, &rotor, &viscous]);
        let coulomb = unit(&sign, &[&offset, &rotor]);
        let (along, own) = (dot(&sign, &viscous), dot(&sign, &beside));
        Own {
            slope: if own > 0.0 { along / own } else { 0.0 },
            columns: [offset, rotor, viscous, beside, coulomb],
        }
    }

    /// The columns of a kind.
    pub fn basis(&self, kind: usize) -> Vec<&[f64]> {
        KINDS[kind].iter().map(|&k| &self.columns[k][..]).collect()
    }

    pub fn along(&self, y: &[f64]) -> Along {
        let mut along = [0.0; 5];
        for (a, c) in along.iter_mut().zip(&self.columns) {
            *a = dot(y, c);
        }
        Along {
            along,
            square: dot(y, y),
        }
    }

    /// Viscous and Coulomb friction that a kind finds in `y` without `gain` times `x`, each in a unit of its own.
    pub fn friction(&self, kind: usize, y: &Along, x: &Along, gain: f64) -> [f64; 2] {
        let at = |k: usize| y.along[k] - gain * x.along[k];
        match kind {
            0 => [at(2) - self.slope * at(3), at(3)],
            1 => [0.0, at(4)],
            2 => [at(2), 0.0],
            _ => [0.0; 2],
        }
    }
}

impl Along {
    /// Square of the signal.
    pub fn square(&self) -> f64 {
        self.square
    }

    /// Square of what the terms of a kind leave.
    pub fn left(&self, kind: usize) -> f64 {
        self.square - self.shared(self, kind)
    }

    /// What two signals share along the terms of a kind.
    pub fn shared(&self, other: &Along, kind: usize) -> f64 {
        KINDS[kind]
            .iter()
            .map(|&k| self.along[k] * other.along[k])
            .sum()
    }
}

/// A column of length one without what orthonormal others explain; zero where they explain it all.
fn unit(column: &[f64], others: &[&[f64]]) -> Vec<f64> {
    let rest = without(&without(column, others), others);
    let (norm, whole) = (dot(&rest, &rest).sqrt(), dot(column, column).sqrt());
    match norm > 1e-9 * whole.max(1e-300) {
        true => rest.iter().map(|x| x / norm).collect(),
        false => vec![0.0; column.len()],
    }
}

/// A signal without what an orthonormal basis explains of it.
pub(super) fn without(x: &[f64], basis: &[&[f64]]) -> Vec<f64> {
    let mut out = x.to_vec();
    for &b in basis {
        let c = dot(&out, b);
        out.iter_mut().zip(b).for_each(|(o, b)| *o -= c * b);
    }
    out
}

/// What own terms and a rigid torque leave of a column, with coefficients from the samples of `fit`.
pub(super) fn residual(y: &[f64], own: &[&[f64]], side: Option<&[f64]>, fit: &[bool]) -> Vec<f64> {
    let mask = |x: &[f64]| -> Vec<f64> {
        x.iter()
            .zip(fit)
            .map(|(x, f)| if *f { *x } else { 0.0 })
            .collect()
    };
    // Gram-Schmidt on the fitted samples, carried along on all
    let mut basis: Vec<(Vec<f64>, Vec<f64>)> = Vec::new();
    let columns = own.iter().copied().chain(side);
    for column in columns {
        let mut whole = column.to_vec();
        for _ in 0..2 {
            let part = mask(&whole);
            for (b, all) in &basis {
                let c = dot(&part, b);
                whole.iter_mut().zip(all).for_each(|(w, a)| *w -= c * a);
            }
        }
        let part = mask(&whole);
        let norm = dot(&part, &part).sqrt();
        if norm > 1e-9 * dot(column, column).sqrt().max(1e-300) {
            basis.push((
                part.iter().map(|x| x / norm).collect(),
                whole.iter().map(|x| x / norm).collect(),
            ));
        }
    }
    let mut rest = y.to_vec();
    for (b, all) in &basis {
        let c = dot(&mask(&rest), b);
        rest.iter_mut().zip(all).for_each(|(r, a)| *r -= c * a);
    }
    rest
}
