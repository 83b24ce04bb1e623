//! What a pose must keep away from, beside the limits of the actuators: the cones of the passive
//! joints, both kinds of singularity, and other legs.
//!
//! Each is judged by its **use**, 1 at the limit: `angle/limit` of a cone, `margin/σ_min` of a
//! singularity, `distance/gap` of two legs.

use super::Mechanism;
use nalgebra::Vector3;

/// Part of the smallest singular values at home that a motion keeps where nothing else is stated.
const KEPT: f64 = 0.25;

/// Distances that a motion keeps.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Margins {
    /// least `σ_min` of the actuation Jacobian, lengths scaled
    pub actuation: f64,
    /// least `σ_min` of the constraint block
    pub constraint: f64,
    /// least distance between the axes of two legs, arms or rods that do not meet, and from the lines of the platform
    /// that they do not carry, m; 0: not asked for
    pub distance: f64,
}

/// Use of one limit of a pose.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct PoseUse {
    /// what: `leg3 base` (a passive joint), `singularity`, `leg1 to leg4`
    pub name: String,
    /// which kind
    pub kind: PoseKind,
    /// what is limited: rad, dimensionless or m
    pub value: f64,
    /// its limit: at most, of an angle; at least, of the others
    pub limit: f64,
}

/// Kinds of limits of a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PoseKind {
    /// opening of a passive joint, at most
    PassiveJoint,
    /// smallest singular value of the actuation Jacobian, at least
    Actuation,
    /// smallest singular value of the constraint block, at least
    Constraint,
    /// distance of two legs, at least
    Distance,
}

impl PoseKind {
    /// Share of a limit that a value uses: 1 at the limit, more beyond.
    pub(super) fn used(self, value: f64, limit: f64) -> f64 {
        match self {
            PoseKind::PassiveJoint => value / limit,
            _ => limit / value.max(1e-12),
        }
    }
}

impl PoseUse {
    /// 1 at the limit, more beyond.
    pub fn used(&self) -> f64 {
        self.kind.used(self.value, self.limit)
    }
}

/// Shortest distance of two segments (Ericson 2005, ch. 5.1.9).
pub fn distance(a: &[Vector3<f64>; 2], b: &[Vector3<f64>; 2]) -> f64 {
    let (d1, d2, r) = (a[1] - a[0], b[1] - b[0], a[0] - b[0]);
    let (aa, ee, f) = (d1.norm_squared(), d2.norm_squared(), d2.dot(&r));
    let (c, bb) = (d1.dot(&r), d1.dot(&d2));
    let tiny = 1e-18;
    let (s, t) = match (aa <= tiny, ee <= tiny) {
        (true, true) => (0.0, 0.0),
        (true, false) => (0.0, (f / ee).clamp(0.0, 1.0)),
        (false, true) => ((-c / aa).clamp(0.0, 1.0), 0.0),
        (false, false) => {
            let det = aa * ee - bb * bb;
            let mut s = match det > 1e-12 * aa * ee {
                true => ((bb * f - c * ee) / det).clamp(0.0, 1.0),
                false => 0.0,
            };
            let mut t = (bb * s + f) / ee;
            if t < 0.0 {
                t = 0.0;
                s = (-c / aa).clamp(0.0, 1.0);
            } else if t > 1.0 {
                t = 1.0;
                s = ((bb - c) / aa).clamp(0.0, 1.0);
            }
            (s, t)
        }
    };
    (a[0] + d1 * s - b[0] - d2 * t).norm()
}

impl Mechanism {
    /// Margins where none are stated: a quarter of the smallest singular values at home, no
    /// distance.
    pub(super) fn default_margins(&self) -> Margins {
        match self.singularity(&self.home) {
            Ok(s) => Margins {
                actuation: KEPT * s.actuation.sigma_min,
                constraint: s.constraint.map_or(0.0, |c| KEPT * c.sigma_min),
                distance: 0.0,
            },
            Err(_) => Margins::default(),
        }
    }

    /// Pairs of legs, or of a leg and the platform, as indices into the segments of a pose, whose distance counts: of
    /// different names, and apart at home by more than is asked for (those that are not, meet in a joint).
    pub fn pairs(&self) -> Vec<(usize, usize)> {
        let gap = self.margins.distance;
        if gap <= 0.0 {
            return Vec::new();
        }
        let all = self.geometry.segments(&self.home);
        let mut pairs = Vec::new();
        for j in 0..all.len() {
            for i in 0..j {
                if all[i].name != all[j].name && distance(&all[i].ends, &all[j].ends) > gap {
                    pairs.push((i, j));
                }
            }
        }
        pairs
    }

    /// Use of every limit of a pose that can be reached; `pairs` from [`Mechanism::pairs`]. The
    /// order and number of entries is the same for every pose.
    pub fn pose_uses(&self, x: &[f64], pairs: &[(usize, usize)]) -> Vec<PoseUse> {
        let mut all: Vec<PoseUse> = self
            .geometry
            .cones(x)
            .into_iter()
            .filter(|c| c.limit.is_finite())
            .map(|c| PoseUse {
                name: c.name,
                kind: PoseKind::PassiveJoint,
                value: c.angle,
                limit: c.limit,
            })
            .collect();
        let m = &self.margins;
        if m.actuation > 0.0 || m.constraint > 0.0 {
            let s = self.singularity(x).ok();
            let sigma = s.map_or(0.0, |s| s.actuation.sigma_min);
            let constraint = s.map(|s| s.constraint.map(|c| c.sigma_min));
            if m.actuation > 0.0 {
                all.push(PoseUse {
                    name: "singularity".into(),
                    kind: PoseKind::Actuation,
                    value: sigma,
                    limit: m.actuation,
                });
            }
            if m.constraint > 0.0 {
                all.push(PoseUse {
                    name: "singularity of the passive joints".into(),
                    kind: PoseKind::Constraint,
                    value: constraint.flatten().unwrap_or(0.0),
                    limit: m.constraint,
                });
            }
        }
        if !pairs.is_empty() {
            let segments = self.geometry.segments(x);
            for &(i, j) in pairs {
                let (Some(a), Some(b)) = (segments.get(i), segments.get(j)) else {
                    continue;
                };
                all.push(PoseUse {
                    name: format!("{} to {}", a.name, b.name),
                    kind: PoseKind::Distance,
                    value: distance(&a.ends, &b.ends),
                    limit: m.distance,
                });
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    #[test]
    fn distance_of_segments_is_the_least_over_both() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        for round in 0..200 {
            let mut point = || Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
            let a = [point(), point()];
            // every other pair is parallel
            let b = match round % 2 {
                0 => [point(), point()],
                _ => {
                    let p = point();
                    [p, p + (a[1] - a[0]) * 0.7]
                }
            };
            let at = |e: &[Vector3<f64>; 2], s: f64| e[0] + (e[1] - e[0]) * s;
            let mut least = f64::INFINITY;
            for i in 0..=200 {
                for j in 0..=200 {
                    let gap = at(&a, i as f64 / 200.0) - at(&b, j as f64 / 200.0);
                    least = least.min(gap.norm());
                }
            }
            let d = distance(&a, &b);
            assert!(d <= least + 1e-12 && d > least - 0.02, "{d} {least}");
        }
    }
}
