//! Volumes of a robot and of its surroundings, and the pairs of them that must stay apart.
//!
//! A pair is a volume of one body and a volume of another body, of the base, or an obstacle. Bodies that a
//! joint joins and pairs that the user names are left out.

use super::distance::{Separation, separation, separation_from_plane};
use super::shape::{Pose, Shape};
use crate::robot::{Motion, Robot};
use nalgebra::{Rotation3, Unit, Vector3};

/// A volume of the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume {
    /// link that it belongs to, as the robot file calls it
    pub link: String,
    /// body that carries it, an index into the robot's bodies; `None`: the base
    pub body: Option<usize>,
    /// in the frame of that body
    pub shape: Shape,
}

/// A fixed thing in the base frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Obstacle {
    /// what lies below `normalᵀ x = offset`: a floor, a table, a wall, a ceiling
    Plane {
        /// name in reports
        name: String,
        /// unit normal, away from the solid
        normal: Vector3<f64>,
        /// m
        offset: f64,
    },
    /// a convex thing
    Solid {
        /// name in reports
        name: String,
        /// in the base frame
        shape: Shape,
    },
}

impl Obstacle {
    /// Name in reports.
    pub fn name(&self) -> &str {
        match self {
            Obstacle::Plane { name, .. } | Obstacle::Solid { name, .. } => name,
        }
    }
}

/// Second partner of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Partner {
    /// index into [`Scene::volumes`]
    Volume(usize),
    /// index into [`Scene::obstacles`]
    Obstacle(usize),
}

/// Two things that must stay apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Pair {
    /// index into [`Scene::volumes`], of a body that moves
    pub volume: usize,
    /// what it must not touch
    pub partner: Partner,
}

/// Everything that can collide.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// volumes of the robot, base included
    pub volumes: Vec<Volume>,
    /// fixed things
    pub obstacles: Vec<Obstacle>,
    /// what must stay apart
    pub pairs: Vec<Pair>,
    /// least distance that is allowed, m
    pub margin: f64,
}

/// Poses of all bodies in the base frame at one posture, parents before children.
pub fn poses(robot: &Robot, q: &[f64], out: &mut Vec<Pose>) {
    out.clear();
    for body in &robot.bodies {
        let x = body.ratio * q[body.coordinate] + body.offset;
        let (turn, slide) = match body.motion {
            Motion::Revolute => {
                let axis = Unit::new_unchecked(body.axis);
                (
                    Rotation3::from_axis_angle(&axis, x).into_inner(),
                    Vector3::zeros(),
                )
            }
            Motion::Prismatic => (nalgebra::Matrix3::identity(), body.axis * x),
        };
        let joint = Pose {
            rotation: body.rotation * turn,
            position: body.position + body.rotation * slide,
        };
        out.push(match body.parent {
            Some(p) => out[p].then(&joint),
            None => joint,
        });
    }
}

impl Scene {
    /// Pose of a body, or of the base.
    fn pose(body: Option<usize>, poses: &[Pose]) -> Pose {
        body.map_or_else(Pose::identity, |b| poses[b])
    }

    /// Names of the two partners of a pair.
    pub fn names(&self, pair: &Pair) -> [&str; 2] {
        let second = match pair.partner {
            Partner::Volume(v) => &self.volumes[v].link,
            Partner::Obstacle(o) => self.obstacles[o].name(),
        };
        [&self.volumes[pair.volume].link, second]
    }

    /// Separation of a pair, the margin not taken off.
    pub fn separation(&self, pair: &Pair, poses: &[Pose]) -> Separation {
        let a = &self.volumes[pair.volume];
        let at = Self::pose(a.body, poses);
        match pair.partner {
            Partner::Volume(v) => {
                let b = &self.volumes[v];
                separation(&a.shape, &at, &b.shape, &Self::pose(b.body, poses))
            }
            Partner::Obstacle(o) => match &self.obstacles[o] {
                Obstacle::Plane { normal, offset, .. } => {
                    separation_from_plane(&a.shape, &at, normal, *offset)
                }
                Obstacle::Solid { shape, .. } => {
                    separation(&a.shape, &at, shape, &Pose::identity())
                }
            },
        }
    }

    /// Derivative of the distance of a pair by each coordinate: `∂d/∂q_j = nᵀ (∂b/∂q_j − ∂a/∂q_j)`,
    /// added to `out` (one number a coordinate).
    pub fn gradient(
        &self,
        robot: &Robot,
        pair: &Pair,
        s: &Separation,
        poses: &[Pose],
        out: &mut [f64],
    ) {
        let mut carry = |body: Option<usize>, point: &Vector3<f64>, sign: f64| {
            let mut at = body;
            while let Some(b) = at {
                let k = &robot.bodies[b];
                // the axis keeps its direction under the joint's own motion
                let axis = poses[b].rotation * k.axis;
                let rate = match k.motion {
                    Motion::Revolute => axis.cross(&(point - poses[b].position)),
                    Motion::Prismatic => axis,
                };
                out[k.coordinate] += sign * k.ratio * s.normal.dot(&rate);
                at = k.parent;
            }
        };
        carry(self.volumes[pair.volume].body, &s.on_first, -1.0);
        if let Partner::Volume(v) = pair.partner {
            carry(self.volumes[v].body, &s.on_second, 1.0);
        }
    }

    /// All pairs but those of one body, of bodies joined by a joint, of two things that do not move, and
    /// those that `ignored` names.
    pub fn all_pairs(&self, robot: &Robot, ignored: impl Fn(&str, &str) -> bool) -> Vec<Pair> {
        let joined = |a: Option<usize>, b: Option<usize>| {
            let parent = |x: Option<usize>| x.map(|b| robot.bodies[b].parent);
            a == b || parent(a) == Some(b) || parent(b) == Some(a)
        };
        let mut out = Vec::new();
        for (i, a) in self.volumes.iter().enumerate() {
            for (k, b) in self.volumes.iter().enumerate().skip(i + 1) {
                if joined(a.body, b.body) || ignored(&a.link, &b.link) {
                    continue;
                }
                // the first one moves
                let (volume, other) = if a.body.is_some() { (i, k) } else { (k, i) };
                let partner = Partner::Volume(other);
                out.push(Pair { volume, partner });
            }
            if a.body.is_some() {
                let free = (0..self.obstacles.len())
                    .filter(|o| !ignored(&a.link, self.obstacles[*o].name()));
                out.extend(free.map(|o| Pair {
                    volume: i,
                    partner: Partner::Obstacle(o),
                }));
            }
        }
        out
    }
}
