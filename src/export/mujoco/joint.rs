//! What stands on a joint, and its attributes.

use std::fmt::Write;

/// Stiffness of a spring that stands for a constant torque, per its torque, 1/rad or 1/m.
const FAR: f64 = 1e-6;

/// What stands on a joint.
#[derive(Debug, Clone, Default)]
pub(in crate::export) struct OnJoint {
    pub(in crate::export) armature: f64,
    /// of `q̇`, `q̇ |q̇|`, `q̇³`
    pub(in crate::export) damping: [f64; 3],
    pub(in crate::export) coulomb: f64,
    /// of `1`, `q`, `q²`, `q³`
    pub(in crate::export) spring: [f64; 4],
    /// stiffness, its third power, damping; of a spring that the file states
    pub(in crate::export) twist: Option<[f64; 3]>,
    pub(in crate::export) gain: f64,
    /// s
    pub(in crate::export) delay: f64,
}

impl OnJoint {
    /// Whether its spring has no position of rest, which MuJoCo's have.
    pub(in crate::export) fn never_rests(&self) -> bool {
        self.spring != [0.0; 4] && spring(self.spring).is_none()
    }

    /// Its attributes in the file.
    pub(in crate::export) fn attributes(&self) -> String {
        let mut out = String::new();
        let used = |x: &[f64]| x.iter().rposition(|v| *v != 0.0).map_or(0, |i| i + 1);
        let list = |x: &[f64]| -> String {
            let all: Vec<String> = x.iter().map(f64::to_string).collect();
            all.join(" ")
        };
        if used(&self.damping) > 0 {
            let _ = write!(
                out,
                " damping=\"{}\"",
                list(&self.damping[..used(&self.damping)])
            );
        }
        if self.coulomb > 0.0 {
            let _ = write!(out, " frictionloss=\"{}\"", self.coulomb);
        }
        if self.armature > 0.0 {
            let _ = write!(out, " armature=\"{}\"", self.armature);
        }
        if let Some((stiffness, at)) = spring(self.spring) {
            let stiffness = list(&stiffness[..used(&stiffness)]);
            let _ = write!(out, " stiffness=\"{stiffness}\" springref=\"{at}\"");
        }
        out
    }
}

/// A torque `Σ c_k q^k` as a spring: the factors of the first three powers of the way from where it is zero, and
/// that position. `None` where there is no torque, or none is zero anywhere.
fn spring(c: [f64; 4]) -> Option<([f64; 3], f64)> {
    if c == [0.0; 4] {
        return None;
    }
    if c[1..] == [0.0; 3] {
        return Some(([FAR * c[0].abs(), 0.0, 0.0], -c[0].signum() / FAR));
    }
    let value = |q: f64| c[0] + q * (c[1] + q * (c[2] + q * c[3]));
    let mut reach = 1.0;
    let (mut low, mut high) = (0.0, 0.0);
    while value(low) * value(high) > 0.0 || low == high {
        if reach > 1e9 {
            return None;
        }
        // to the nearer side first
        (low, high) = if value(0.0) * value(reach) <= 0.0 {
            (0.0, reach)
        } else {
            (-reach, 0.0)
        };
        reach *= 1.5;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        match value(low) * value(middle) <= 0.0 {
            true => high = middle,
            false => low = middle,
        }
    }
    let r = 0.5 * (low + high);
    let factors = [
        c[1] + r * (2.0 * c[2] + 3.0 * r * c[3]),
        c[2] + 3.0 * r * c[3],
        c[3],
    ];
    Some((factors, r))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Torque of a spring as MuJoCo has it.
    fn torque(c: [f64; 4], q: f64) -> f64 {
        let (k, at) = spring(c).unwrap();
        let x = q - at;
        x * (k[0] + x * (k[1] + x * k[2]))
    }

    #[test]
    fn springs_are_those_of_the_polynomial() {
        for c in [
            [2.0, 0.0, 0.0, 0.0],
            [-1.5, 4.0, 0.0, 0.0],
            [0.7, 3.0, -0.5, 1.2],
            [0.0, 0.0, 0.0, 2.0],
            [-5.0, 1.0, 2.0, -0.3],
        ] {
            for q in [-1.3, 0.0, 0.4, 2.0] {
                let wanted = c[0] + q * (c[1] + q * (c[2] + q * c[3]));
                assert!((torque(c, q) - wanted).abs() < 1e-5, "{c:?} at {q}");
            }
        }
        assert!(spring([0.0; 4]).is_none());
        assert!(spring([1.0, 0.0, 1.0, 0.0]).is_none());
    }
}
