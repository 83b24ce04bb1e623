//! Convex volumes: a core (point, segment, box or hull) swept by a ball of radius `r`.
//!
//! ```text
//! S = { c + r u : c ∈ conv{v_1 … v_k}, |u| ≤ 1 }       k = 1 sphere, 2 capsule, 8 box,
//!                                                      4 to 32 hull
//! ```
//!
//! All lengths in m. Vertices are in the frame of the body that carries the shape.

use super::hull::hull;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;
use std::sync::Arc;

/// Most vertices of a core.
pub const MOST_VERTICES: usize = 32;
/// Room for the vertices of a core.
pub type Core = [Vector3<f64>; MOST_VERTICES];

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
    /// convex hull of points swept by a ball; made by [`Shape::hull`]
    Hull(Polytope),
}

/// A convex hull of points, swept by a ball.
#[derive(Debug, Clone, PartialEq)]
pub struct Polytope {
    /// corners, 4 to [`MOST_VERTICES`]
    pub points: Arc<[Vector3<f64>]>,
    /// radius
    pub radius: f64,
    /// outward unit normals and offsets `nᵀ x` of the faces of the core
    pub(super) faces: Arc<[(Vector3<f64>, f64)]>,
    /// of the swept core, an edge's share left out, m³
    volume: f64,
}

impl Polytope {
    /// Outward unit normals of the faces of the core.
    pub fn normals(&self) -> impl Iterator<Item = &Vector3<f64>> {
        self.faces.iter().map(|f| &f.0)
    }

    /// The mean of the corners.
    pub fn centre(&self) -> Vector3<f64> {
        self.points.iter().sum::<Vector3<f64>>() / self.points.len() as f64
    }
}

impl Shape {
    /// The convex hull of points, swept by a ball. `None` where they lie in a plane, or more than [`MOST_VERTICES`] of them
    /// are corners.
    pub fn hull(points: &[Vector3<f64>], radius: f64) -> Option<Shape> {
        let found = hull(points)?;
        if found.corners.len() > MOST_VERTICES {
            return None;
        }
        let mut area = 0.0;
        let faces = found.faces.iter().filter_map(|f| {
            let [a, b, c] = f.map(|i| points[i]);
            let across = (b - a).cross(&(c - a));
            area += 0.5 * across.norm();
            let n = across.try_normalize(1e-300)?;
            Some((n, n.dot(&a)))
        });
        let faces = faces.collect();
        Some(Shape::Hull(Polytope {
            points: found.corners.iter().map(|i| points[*i]).collect(),
            radius,
            faces,
            volume: found.volume + radius * (area + 4.0 / 3.0 * PI * radius * radius),
        }))
    }

    /// Radius that sweeps the core.
    pub fn radius(&self) -> f64 {
        match self {
            Shape::Sphere { radius, .. } | Shape::Capsule { radius, .. } => *radius,
            Shape::Box { .. } => 0.0,
            Shape::Hull(h) => h.radius,
        }
    }

    /// Ends of the core of a sphere or capsule in the frame `W` in which the body has pose `body`.
    pub(super) fn segment(&self, body: &Pose) -> Option<[Vector3<f64>; 2]> {
        match self {
            Shape::Sphere { centre, .. } => Some([body.apply(centre); 2]),
            Shape::Capsule { from, to, .. } => Some([body.apply(from), body.apply(to)]),
            Shape::Box { .. } | Shape::Hull(_) => None,
        }
    }

    /// Vertices of the core in the frame `W` in which the body has pose `body`; returns how many.
    pub fn core(&self, body: &Pose, out: &mut Core) -> usize {
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
                for (i, v) in out.iter_mut().take(8).enumerate() {
                    let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
                    let corner =
                        Vector3::new(sign(0) * half[0], sign(1) * half[1], sign(2) * half[2]);
                    *v = at.apply(&corner);
                }
                8
            }
            Shape::Hull(h) => {
                for (v, p) in out.iter_mut().zip(h.points.iter()) {
                    *v = body.apply(p);
                }
                h.points.len()
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
            Shape::Hull(h) => h.volume,
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
            Shape::Hull(h) => {
                let local = body.rotation.tr_mul(n);
                let origin = n.dot(&body.position);
                let mut range = [f64::INFINITY, f64::NEG_INFINITY];
                for p in h.points.iter() {
                    let x = origin + local.dot(p);
                    range = [range[0].min(x), range[1].max(x)];
                }
                range
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
            Shape::Hull(h) => {
                let centre = h.centre();
                let far = h.points.iter().map(|p| (p - centre).norm());
                (centre, far.fold(0.0, f64::max) + h.radius)
            }
        }
    }

    /// Radius of the ball about the body's origin that holds the shape, m.
    pub fn reach(&self) -> f64 {
        let mut v = [Vector3::zeros(); MOST_VERTICES];
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
            Shape::Hull(h) => Shape::Hull(Polytope {
                points: h.points.iter().map(|p| by.apply(p)).collect(),
                faces: (h.faces.iter())
                    .map(|(n, o)| {
                        let n = by.rotation * n;
                        (n, o + n.dot(&by.position))
                    })
                    .collect(),
                ..h.clone()
            }),
        }
    }
}
