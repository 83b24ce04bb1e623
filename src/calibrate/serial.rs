//! Serial robots and trees: the chain from the base to the frame that the measurement sees, and to that of a second
//! arm where there is one. Joints that both chains have in common are there once.
//!
//! Joint `i` sits in the frame before at `X_i E_i M_i(q)`: `X_i` as in the robot file, `E_i` six small errors
//! (a shift in the axes of `X_i`, then a rotation vector), `M_i` the motion of the joint. Behind the last joint
//! comes the frame's own place, with errors `E` where a fixed joint of the file holds it. The six errors contain
//! joint offset, link lengths, twists and the parameter of Hayati for near-parallel axes; those that a
//! neighbouring frame expresses as well are told apart by their tolerances alone
//! (see [`identifiable`](super::identifiable)).

use super::feature::{Feature, Rate, Shape};
use super::frame::{Frame, right_jacobian};
use super::unknown::{Part, Unknown};
use crate::robot::{Body, Motion};
use nalgebra::{DMatrix, Vector3};

/// One joint of the chain.
#[derive(Debug, Clone)]
pub struct Link {
    /// the body, as in the robot file
    pub body: Body,
    /// index of its coordinate among those that are measured
    pub coordinate: usize,
    /// index of the joint before it in the list; `None` on the base
    pub parent: Option<usize>,
}

/// A frame that is measured.
#[derive(Debug, Clone)]
pub struct End {
    /// index of the joint that carries it
    pub link: usize,
    /// the frame on the body of that joint
    pub tip: Frame,
    /// name of the fixed joint whose errors are identified; `None` where the frame is the body's own
    pub tip_joint: Option<String>,
}

/// A chain of joints, or two that hold the same thing.
#[derive(Debug, Clone)]
pub struct Arm {
    /// joints, each behind the one that carries it
    pub links: Vec<Link>,
    /// the frame, and that of the second arm
    pub ends: Vec<End>,
}

/// Pose of a frame, and by how much it moves with each unknown of the robot: position and rotation in base
/// axes.
#[derive(Debug, Clone)]
pub struct Posed {
    /// pose in the base frame
    pub frame: Frame,
    /// `6 × unknowns`
    pub jacobian: DMatrix<f64>,
}

impl Arm {
    /// Names of the joints of the chain.
    pub fn names(&self) -> Vec<&str> {
        self.links
            .iter()
            .map(|l| l.body.joint_name.as_str())
            .collect()
    }

    /// Names of all joints that have six errors, in their order: those that move, then the fixed ones of the tips.
    pub fn places(&self) -> Vec<&str> {
        let tips = self.ends.iter().filter_map(|e| e.tip_joint.as_deref());
        self.names().into_iter().chain(tips).collect()
    }

    /// Indices of the joints that lead to a frame, from the base.
    fn chain(&self, end: usize) -> Vec<usize> {
        let mut all = vec![self.ends[end].link];
        while let Some(parent) = self.links[all[all.len() - 1]].parent {
            all.push(parent);
        }
        all.reverse();
        all
    }

    /// Index of the six errors of the fixed joint of a frame.
    fn tip_place(&self, end: usize) -> Option<usize> {
        self.ends[end].tip_joint.as_ref()?;
        let before = self.ends[..end].iter().filter(|e| e.tip_joint.is_some());
        Some(self.links.len() + before.count())
    }

    /// Number of geometric unknowns.
    pub fn errors(&self) -> usize {
        let tips = self.ends.iter().filter(|e| e.tip_joint.is_some());
        6 * (self.links.len() + tips.count())
    }

    /// The geometric unknowns.
    pub fn unknowns(&self, tolerance: [f64; 2]) -> Vec<Unknown> {
        self.places()
            .into_iter()
            .flat_map(|n| Unknown::frame(n, Part::Geometry, tolerance))
            .collect()
    }

    /// Pose of a frame, and its shift and turn by each joint, `6 × joints` in base axes, at the errors `x` of the
    /// geometry.
    pub fn by_joints(&self, end: usize, q: &[f64], x: &[f64]) -> Posed {
        let features: Vec<Feature> = (0..q.len()).map(Feature::turn).collect();
        let ones = vec![Rate::turn(1.0); q.len()];
        let all: Vec<f64> = x.iter().copied().chain(ones.iter().map(|_| 0.0)).collect();
        let posed = self.pose(end, q, &all, &features, &ones);
        Posed {
            frame: posed.frame,
            jacobian: posed.jacobian.columns(self.errors(), q.len()).into_owned(),
        }
    }

    /// Pose of a frame at joint readings `q`, with errors `x` (geometry, then one number a feature). `rate` holds the value of
    /// each feature in this posture: the change of its joint per unit.
    pub fn pose(
        &self,
        end: usize,
        q: &[f64],
        x: &[f64],
        features: &[Feature],
        rate: &[Rate],
    ) -> Posed {
        let n = self.errors();
        let mut j = DMatrix::zeros(6, n + features.len());
        let mut at = Frame::identity();
        // errors of the frames, with what the links bend
        let mut x = x.to_vec();
        for (k, f) in features.iter().enumerate() {
            if let Some(place) = rate[k].place {
                for (c, v) in place.iter().enumerate() {
                    x[6 * f.joint + c] += x[n + k] * v;
                }
            }
        }
        // axis and origin of each joint, and of the frames of the errors
        let mut joints = Vec::with_capacity(self.links.len());
        let mut places = Vec::with_capacity(self.links.len() + 1);
        for i in self.chain(end) {
            let link = &self.links[i];
            let b = &link.body;
            at = at.then(&Frame {
                r: b.rotation,
                p: b.position,
            });
            places.push((i, at));
            at = at.then(&Frame::small(&x[6 * i..6 * i + 6]));
            let mut s = b.ratio * q[link.coordinate] + b.offset;
            for (k, f) in features.iter().enumerate() {
                if f.shape != Shape::Bend && f.joint == link.coordinate {
                    s += b.ratio * x[n + k] * rate[k].turn;
                }
            }
            joints.push((link.coordinate, b.motion, b.ratio, at.r * b.axis, at.p));
            let motion = match b.motion {
                Motion::Revolute => Frame {
                    r: super::frame::exp(&(b.axis * s)),
                    p: Vector3::zeros(),
                },
                Motion::Prismatic => Frame {
                    p: b.axis * s,
                    ..Frame::identity()
                },
            };
            at = at.then(&motion);
        }
        at = at.then(&self.ends[end].tip);
        if let Some(i) = self.tip_place(end) {
            places.push((i, at));
            at = at.then(&Frame::small(&x[6 * i..6 * i + 6]));
        }
        let put = |j: &mut DMatrix<f64>, column: usize, shift: Vector3<f64>, turn: Vector3<f64>| {
            for k in 0..3 {
                j[(k, column)] += shift[k];
                j[(3 + k, column)] += turn[k];
            }
        };
        for (i, before) in &places {
            let e = &x[6 * i..6 * i + 6];
            let after = before.then(&Frame::small(e));
            let turns = after.r * right_jacobian(&Vector3::new(e[3], e[4], e[5]));
            for k in 0..3 {
                put(
                    &mut j,
                    6 * i + k,
                    before.r.column(k).into_owned(),
                    Vector3::zeros(),
                );
                let w = turns.column(k).into_owned();
                put(&mut j, 6 * i + 3 + k, w.cross(&(at.p - after.p)), w);
            }
        }
        for (k, f) in features.iter().enumerate() {
            if f.shape == Shape::Bend {
                let place = rate[k].place.unwrap_or_default();
                for row in 0..6 {
                    let own = (0..6).map(|c| j[(row, 6 * f.joint + c)] * place[c]);
                    let sum: f64 = own.sum();
                    j[(row, n + k)] += sum;
                }
                continue;
            }
            for (_, motion, ratio, axis, origin) in joints.iter().filter(|(c, ..)| *c == f.joint) {
                let v = axis * (ratio * rate[k].turn);
                match motion {
                    Motion::Revolute => put(&mut j, n + k, v.cross(&(at.p - origin)), v),
                    Motion::Prismatic => put(&mut j, n + k, v, Vector3::zeros()),
                }
            }
        }
        Posed {
            frame: at,
            jacobian: j,
        }
    }
}
