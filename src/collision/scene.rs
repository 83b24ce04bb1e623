//! Volumes of a robot and of its surroundings, and the pairs of them that must stay apart.
//!
//! A pair is a volume of one body and a volume of another body, of the base, or an obstacle. Bodies that a
//! joint joins and pairs that the user names are left out.

use crate::error::Warning;
pub use crate::robot::geometry::Obstacle;
use crate::robot::geometry::Volumes;
use crate::robot::{Motion, Robot};
use crate::solid::distance::{Separation, separation, separation_from_plane};
use crate::solid::shape::{Pose, Shape};
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

/// Second partner of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Partner {
    /// index into [`Scene::volumes`]
    Volume(usize),
    /// index into [`Scene::obstacles`]
    Obstacle(usize),
}

/// Two things that must stay apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// index into [`Scene::volumes`], of a body that moves
    pub volume: usize,
    /// what it must not touch
    pub partner: Partner,
    /// least distance that is allowed, m
    pub margin: f64,
}

/// Two things that are not looked at, and why.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct LeftOut {
    /// names of the two
    pub between: [String; 2],
    /// reason in words
    pub why: String,
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
    /// the most room beyond its margin that each pair was seen with, m; empty where no posture was looked at
    pub most: Vec<f64>,
    /// what is not looked at
    pub left_out: Vec<LeftOut>,
    /// links whose volumes are so near in every posture that nothing can be said of them
    pub always_near: Vec<[String; 2]>,
    /// links whose volume is not known
    pub unseen: Vec<String>,
    /// least distance of two things where nothing else is stated, m
    pub margin: f64,
    /// postures of all joints, free of contact, the most spacious first
    pub free: Vec<Vec<f64>>,
    /// what was imperfect
    pub warnings: Vec<Warning>,
    /// volumes of all links, as the scene has them
    pub fitted: Volumes,
}

/// Balls about all volumes and solid obstacles of a scene: a quick lower bound of any distance.
#[derive(Debug, Clone, Default)]
pub struct Balls {
    volumes: Vec<(Option<usize>, Vector3<f64>, f64)>,
    obstacles: Vec<Option<(Vector3<f64>, f64)>>,
}

impl Balls {
    /// Of a scene.
    pub fn new(scene: &Scene) -> Self {
        let of = |v: &Volume| {
            let (centre, radius) = v.shape.ball();
            (v.body, centre, radius)
        };
        Balls {
            volumes: scene.volumes.iter().map(of).collect(),
            obstacles: (scene.obstacles.iter())
                .map(|o| match o {
                    Obstacle::Plane { .. } => None,
                    Obstacle::Solid { shape, .. } => Some(shape.ball()),
                })
                .collect(),
        }
    }

    /// A distance that the pair is not nearer than; minus infinity where only the exact one is cheap.
    pub fn lower_bound(&self, pair: &Pair, poses: &[Pose]) -> f64 {
        let at = |&(body, centre, radius): &(Option<usize>, Vector3<f64>, f64)| {
            (body.map_or(centre, |b| poses[b].apply(&centre)), radius)
        };
        let (a, ra) = at(&self.volumes[pair.volume]);
        let other = match pair.partner {
            Partner::Volume(v) => Some(at(&self.volumes[v])),
            Partner::Obstacle(o) => self.obstacles[o],
        };
        match other {
            Some((b, rb)) => (b - a).norm() - ra - rb,
            None => f64::NEG_INFINITY,
        }
    }
}

/// Poses of all bodies in the base frame at one posture, parents before children.
pub fn poses(robot: &Robot, q: &[f64], out: &mut Vec<Pose>) {
    out.clear();
    append_poses(robot, q, out);
}

/// [`poses`] behind what is there already.
pub fn append_poses(robot: &Robot, q: &[f64], out: &mut Vec<Pose>) {
    let first = out.len();
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
            Some(p) => out[first + p].then(&joint),
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

    /// A distance that the pair is not nearer than: the gap between the two along a unit direction.
    pub fn gap_along(&self, pair: &Pair, poses: &[Pose], n: &Vector3<f64>) -> f64 {
        let a = &self.volumes[pair.volume];
        let far = a.shape.extent(&Self::pose(a.body, poses), n)[1];
        let near = match pair.partner {
            Partner::Volume(v) => {
                let b = &self.volumes[v];
                b.shape.extent(&Self::pose(b.body, poses), n)[0]
            }
            Partner::Obstacle(o) => match &self.obstacles[o] {
                Obstacle::Plane { .. } => f64::NEG_INFINITY,
                Obstacle::Solid { shape, .. } => shape.extent(&Pose::identity(), n)[0],
            },
        };
        near - far
    }

    /// Whether the exact distance of a pair takes an iteration: one of the two is a box or a hull.
    pub fn iterates(&self, pair: &Pair) -> bool {
        let boxed = |s: &Shape| matches!(s, Shape::Box { .. } | Shape::Hull(_));
        let other = match pair.partner {
            Partner::Volume(v) => boxed(&self.volumes[v].shape),
            Partner::Obstacle(o) => match &self.obstacles[o] {
                Obstacle::Plane { .. } => return false,
                Obstacle::Solid { shape, .. } => boxed(shape),
            },
        };
        other || boxed(&self.volumes[pair.volume].shape)
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
}
