//! Convex volumes: a core (point, segment or box) swept by a ball of radius `r`.
//!
//! ```text
//! S = { c + r u : c ∈ conv{v_1 … v_k}, |u| ≤ 1 }       k = 1 sphere, 2 capsule, 8 box
//! ```
//!
//! All lengths in m. Vertices are in the frame of the body that carries the shape.

use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

/// Pose of a frame `F` in a frame `W`: `p_W = rotation · p_F + position`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// `R_WF`
    pub rotation: Matrix3<f64>,
    /// origin of `F` in `W`, m
    pub position: Vector3<f64>,
}

impl Pose {
    /// The frame itself.
    pub fn identity() -> Self {
        Pose {
            rotation: Matrix3::identity(),
            position: Vector3::zeros(),
        }
    }

    /// A point of `F` in `W`.
    pub fn apply(&self, p: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * p + self.position
    }

    /// `X_FW`.
    pub fn inverse(&self) -> Pose {
        let rotation = self.rotation.transpose();
        Pose {
            rotation,
            position: -(rotation * self.position),
        }
    }

    /// `X_WF X_FG`.
    pub fn then(&self, other: &Pose) -> Pose {
        Pose {
            rotation: self.rotation * other.rotation,
            position: self.apply(&other.position),
        }
    }
}

/// A convex volume, fixed to one body.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// ball
    Sphere {
        /// centre
        centre: Vector3<f64>,
        /// radius
        radius: f64,
    },
    /// segment swept by a ball
    Capsule {
        /// one end of the segment
        from: Vector3<f64>,
        /// the other end
        to: Vector3<f64>,
        /// radius
        radius: f64,
    },
    /// box of edge lengths `2 half`
    Box {
        /// pose of the box's centre and axes in the body's frame
        pose: Pose,
        /// half edge lengths
        half: Vector3<f64>,
    },
}

impl Shape {
    /// Radius that sweeps the core.
    pub fn radius(&self) -> f64 {
        match self {
            Shape::Sphere { radius, .. } | Shape::Capsule { radius, .. } => *radius,
            Shape::Box { .. } => 0.0,
        }
    }

    /// Vertices of the core in the frame `W` in which the body has pose `body`; returns how many.
    pub fn core(&self, body: &Pose, out: &mut [Vector3<f64>; 8]) -> usize {
        match self {
            Shape::Sphere { centre, .. } => {
                out[0] = body.apply(centre);
                1
            }
            Shape::Capsule { from, to, .. } => {
                out[0] = body.apply(from);
                out[1] = body.apply(to);
                2
            }
            Shape::Box { pose, half } => {
                let at = body.then(pose);
                for (i, v) in out.iter_mut().enumerate() {
                    let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
                    let corner =
                        Vector3::new(sign(0) * half[0], sign(1) * half[1], sign(2) * half[2]);
                    *v = at.apply(&corner);
                }
                8
            }
        }
    }

    /// Volume, m³.
    pub fn volume(&self) -> f64 {
        match self {
            Shape::Sphere { radius: r, .. } => 4.0 / 3.0 * PI * r.powi(3),
            Shape::Capsule {
                from,
                to,
                radius: r,
            } => PI * r * r * (to - from).norm() + 4.0 / 3.0 * PI * r.powi(3),
            Shape::Box { half, .. } => 8.0 * half[0] * half[1] * half[2],
        }
    }

    /// Distance of a point of the body's frame from the surface, negative inside, m.
    pub fn signed_distance(&self, p: &Vector3<f64>) -> f64 {
        match self {
            Shape::Sphere { centre, radius } => (p - centre).norm() - radius,
            Shape::Capsule { from, to, radius } => {
                (p - nearest_on_segment(from, to, p)).norm() - radius
            }
            Shape::Box { pose, half } => {
                let local = pose.rotation.transpose() * (p - pose.position);
                let over = local.abs() - half;
                let outside = over.map(|x| x.max(0.0)).norm();
                outside + over.max().min(0.0)
            }
        }
    }

    /// Least and largest `nᵀ p` over the points of the shape on a body at this pose, m.
    pub fn extent(&self, body: &Pose, n: &Vector3<f64>) -> [f64; 2] {
        let [low, high] = match self {
            Shape::Sphere { centre, .. } => [n.dot(&body.apply(centre)); 2],
            Shape::Capsule { from, to, .. } => {
                let (a, b) = (n.dot(&body.apply(from)), n.dot(&body.apply(to)));
                [a.min(b), a.max(b)]
            }
            Shape::Box { pose, half } => {
                let local = pose.rotation.tr_mul(&body.rotation.tr_mul(n));
                let middle = n.dot(&body.apply(&pose.position));
                let reach = local.abs().dot(half);
                [middle - reach, middle + reach]
            }
        };
        [low - self.radius(), high + self.radius()]
    }

    /// A ball that holds the shape: its centre in the body's frame and its radius, m.
    pub fn ball(&self) -> (Vector3<f64>, f64) {
        match self {
            Shape::Sphere { centre, radius } => (*centre, *radius),
            Shape::Capsule { from, to, radius } => {
                ((from + to) * 0.5, 0.5 * (to - from).norm() + radius)
            }
            Shape::Box { pose, half } => (pose.position, half.norm()),
        }
    }

    /// Radius of the ball about the body's origin that holds the shape, m.
    pub fn reach(&self) -> f64 {
        let mut v = [Vector3::zeros(); 8];
        let k = self.core(&Pose::identity(), &mut v);
        v[..k].iter().map(|p| p.norm()).fold(0.0, f64::max) + self.radius()
    }
}

/// Point of the segment nearest to `p`.
pub fn nearest_on_segment(
    from: &Vector3<f64>,
    to: &Vector3<f64>,
    p: &Vector3<f64>,
) -> Vector3<f64> {
    let d = to - from;
    let length = d.norm_squared();
    let t = match length > 0.0 {
        true => (d.dot(&(p - from)) / length).clamp(0.0, 1.0),
        false => 0.0,
    };
    from + d * t
}

impl Shape {
    /// The same volume in the frame `W` in which its own frame has this pose.
    pub fn moved(&self, by: &Pose) -> Shape {
        match self {
            Shape::Sphere { centre, radius } => Shape::Sphere {
                centre: by.apply(centre),
                radius: *radius,
            },
            Shape::Capsule { from, to, radius } => Shape::Capsule {
                from: by.apply(from),
                to: by.apply(to),
                radius: *radius,
            },
            Shape::Box { pose, half } => Shape::Box {
                pose: by.then(pose),
                half: *half,
            },
        }
    }
}
