//! Chains of an arm and a forearm of two parallel rods: what Delta and H4 are made of.
//!
//! Motor `i` sits in `a_i` with the frame `R_i = [u, y, r]` (`u` motor axis, `r` direction of the arm
//! at zero, `y = r × u`, upwards for a horizontal axis). With arm length `L`, rod length `l` and the
//! middle `b_i` of the rods' ends on the platform,
//!
//! ```text
//! d(q) = cos q r − sin q y       e = b − a       κ = (|e|² + L² − l²) / 2L
//! e·r cos q − e·y sin q = κ      q = atan2(−e·y, e·r) − atan2(√(ρ² − κ²), κ)
//! ```
//!
//! (`ρ² = (e·r)² + (e·y)²`; minus: elbow outwards), reachable where `|κ| ≤ ρ`. Both rods have the
//! direction `w = e − L d` and the same two angles in the arm's frame `R_i Rx(q)`:
//! `w = l (sin β, −sin γ cos β, cos γ cos β)`.
//!
//! Bodies of a chain: arm (frame in `a_i`, `x` the motor axis, `z` along the arm) and two rods
//! (frames in their joints at the arm, `z` along the rod). The platform keeps its tilt because the
//! rods are parallel: those conditions are the [constraint block](Kinematics::constraint_block).

use super::dimensions::{ArmChain, Dimensions};
use super::geometry::{Coordinates, Kinematics, Segment};
use super::parameters::{Group, Pattern};
use super::scalar::{Scalar, linear};
use super::task::{Task, rotation};
use super::tree::{Builder, Place};
use crate::robot::{Inertia, Joint, JointTerm, Limits, Motion};
use nalgebra::{DMatrix, Matrix3, Vector3};

/// Geometry and bodies of one chain.
#[derive(Debug, Clone)]
pub struct Chain {
    /// middle of the motor axis, base axes, m
    pub motor: Vector3<f64>,
    /// `[u, y, r]`
    pub rotation: Matrix3<f64>,
    /// arm length `L`, m
    pub arm_length: f64,
    /// rod length `l`, m
    pub rod_length: f64,
    /// distance of the two rods, m
    pub width: f64,
    /// arm angle at which the encoder reads zero, rad
    pub zero: f64,
    /// middle of the rods' ends from the hinge (or platform origin), base axes, m
    pub attachment: Vector3<f64>,
    /// hinge that it belongs to (H4)
    pub hinge: usize,
    /// limits of the motor
    pub limits: Limits,
    /// values of armature, viscous, Coulomb and offset
    pub terms: [f64; 4],
    /// standard deviation of the torque, N m
    pub torque_noise: Option<f64>,
    /// arm
    pub arm: Inertia,
    /// the rods at `+width/2` and `−width/2` along the motor axis
    pub rods: [Inertia; 2],
}

/// Frame of a motor with a horizontal axis whose arm points to `azimuth` at zero.
pub fn motor_frame(azimuth: f64) -> Matrix3<f64> {
    let (s, c) = azimuth.sin_cos();
    Matrix3::from_columns(&[
        Vector3::new(-s, c, 0.0),
        Vector3::z(),
        Vector3::new(c, s, 0.0),
    ])
}

/// Frame of a motor with any axis: the arm at zero is the direction at right angles to the axis
/// that is closest to `azimuth`. `None` where there is none.
pub fn motor_frame_about(axis: &Vector3<f64>, azimuth: f64) -> Option<Matrix3<f64>> {
    let u = axis.try_normalize(1e-9)?;
    let out = Vector3::new(azimuth.cos(), azimuth.sin(), 0.0);
    let r = (out - u * u.dot(&out)).try_normalize(1e-6)?;
    Some(Matrix3::from_columns(&[u, r.cross(&u), r]))
}

/// Which bodies are unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Bodies {
    /// platform (and its bars) alone
    Platform,
    /// arms, rods, platform
    Rods,
}

/// Kinematics of three chains to a platform that translates, or four to one that also turns.
#[derive(Debug, Clone)]
pub(super) struct Parallelograms {
    pub chains: Vec<Chain>,
    /// hinges of the lateral bars on the platform, platform axes; empty for a Delta
    pub hinges: Vec<Vector3<f64>>,
}

impl Parallelograms {
    fn task(&self) -> usize {
        if self.hinges.is_empty() { 3 } else { 4 }
    }

    fn hinge(&self, chain: &Chain) -> Vector3<f64> {
        self.hinges.get(chain.hinge).copied().unwrap_or_default()
    }

    /// `b_i` in base axes.
    fn end(&self, chain: &Chain, x: &[f64]) -> Vector3<f64> {
        let theta = x.get(3).copied().unwrap_or(0.0);
        let turn = rotation(&Vector3::new(0.0, 0.0, theta));
        Vector3::new(x[0], x[1], x[2]) + turn * self.hinge(chain) + chain.attachment
    }

    /// Arm tip and rod direction (length `l`) in base axes; not numbers out of reach.
    fn elbow(&self, i: usize, x: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
        let chain = &self.chains[i];
        let mut q = vec![super::scalar::Pack(f64::NAN); self.coordinates()];
        let x_: Vec<_> = x.iter().map(|&v| super::scalar::Pack(v)).collect();
        self.inverse(&x_, &mut q[..]);
        let (s, c) = (q[i].0 + chain.zero).sin_cos();
        let r = chain.rotation;
        let d = r.column(2) * c - r.column(1) * s;
        let tip = chain.motor + d * chain.arm_length;
        (tip, self.end(chain, x) - tip)
    }
}

impl Kinematics for Parallelograms {
    fn coordinates(&self) -> usize {
        5 * self.chains.len() + self.task() + self.hinges.len()
    }

    #[inline(always)]
    fn inverse<S: Scalar, C: Coordinates<S> + ?Sized>(&self, x: &[S], q: &mut C) {
        let n = self.chains.len();
        let turn = match x.get(3) {
            Some(theta) => theta.sin_cos(),
            None => (S::constant(0.0), S::constant(1.0)),
        };
        for (i, chain) in self.chains.iter().enumerate() {
            let c = self.hinge(chain);
            let at = chain.attachment - chain.motor;
            let e = [
                turn.1 * c.x - turn.0 * c.y + x[0] + at.x,
                turn.0 * c.x + turn.1 * c.y + x[1] + at.y,
                x[2] + (at.z + c.z),
            ];
            let e = linear::turned_back(&chain.rotation, e);
            let (l, arm) = (chain.rod_length, chain.arm_length);
            let k = (linear::dot(e, e) + (arm * arm - l * l)) * (0.5 / arm);
            let h2 = e[1] * e[1] + e[2] * e[2];
            let angle = (-e[1]).atan2(e[2]) - (h2 - k * k).sqrt().atan2(k);
            q.put(i, angle + (-chain.zero));
            let (sin, cos) = angle.sin_cos();
            // in the arm's frame: z along the arm
            let b = [
                e[0],
                e[1] * cos + e[2] * sin,
                e[2] * cos - e[1] * sin + (-arm),
            ];
            // both rods turn alike
            let first = n + 4 * i;
            q.put_angle(&[first, first + 2], -b[1], b[2]);
            let along = (b[1] * b[1] + b[2] * b[2]).sqrt();
            q.put_angle(&[first + 1, first + 3], b[0], along);
        }
        let m = self.task();
        for k in 0..m {
            q.put(5 * n + k, x[k]);
        }
        for k in 0..self.hinges.len() {
            q.put(5 * n + m + k, -x[3]);
        }
    }

    fn unreachable(&self, x: &[f64]) -> Option<String> {
        self.chains.iter().enumerate().find_map(|(i, chain)| {
            let e = chain.rotation.transpose() * (self.end(chain, x) - chain.motor);
            let (l, arm) = (chain.rod_length, chain.arm_length);
            let in_plane = (l * l - e.x * e.x).max(0.0).sqrt();
            let distance = e.y.hypot(e.z);
            let (near, far) = ((arm - in_plane).abs(), arm + in_plane);
            if e.x.abs() < l && distance > near && distance < far {
                return None;
            }
            Some(format!(
                "chain {} does not reach: the end of its rods is {distance:.4} m from the motor \
                 axis and {:.4} m along it; arm and rods reach from {near:.4} m to {far:.4} m there",
                i + 1,
                e.x
            ))
        })
    }

    fn constraint_block(&self, x: &[f64]) -> Option<DMatrix<f64>> {
        // angular velocity of the bar that a chain ends on, at right angles to u × n
        let spins = self.hinges.len().max(1);
        let mut block = DMatrix::zeros(self.chains.len(), 2 + spins);
        for (i, chain) in self.chains.iter().enumerate() {
            let (_, b) = self.elbow(i, x);
            let m = chain.rotation.column(0).cross(&(b / chain.rod_length));
            block[(i, 0)] = m.x;
            block[(i, 1)] = m.y;
            block[(i, 2 + chain.hinge.min(spins - 1))] = m.z;
        }
        Some(block)
    }

    fn dimensions(&self) -> Option<Dimensions> {
        let chain = |c: &Chain| ArmChain {
            motor: c.motor,
            rotation: c.rotation,
            zero: c.zero,
            arm: c.arm_length,
            rod: c.rod_length,
            attachment: c.attachment,
            hinge: c.hinge,
        };
        let chains = self.chains.iter().map(chain).collect();
        Some(Dimensions::Chains(chains, self.hinges.clone()))
    }

    fn segments(&self, x: &[f64]) -> Vec<Segment> {
        let mut all = Vec::new();
        let centre = Vector3::new(x[0], x[1], x[2]);
        for (i, chain) in self.chains.iter().enumerate() {
            let (tip, b) = self.elbow(i, x);
            let across = chain.rotation.column(0) * (0.5 * chain.width);
            let k = i + 1;
            let mut add = |name: String, a, b| all.push(Segment { name, ends: [a, b] });
            add(format!("arm{k}"), chain.motor, tip);
            add(format!("rod{k}a"), tip + across, tip + b + across);
            add(format!("rod{k}b"), tip - across, tip + b - across);
            let hinge = tip + b - chain.attachment;
            add("platform".into(), tip + b, hinge);
            if !self.hinges.is_empty() {
                add("platform".into(), hinge, centre);
            }
        }
        all
    }
}

/// Bodies of the tree, by what they are.
pub(super) struct Parts {
    pub arms: Vec<usize>,
    pub rods: Vec<[usize; 2]>,
    pub platform: usize,
    pub bars: Vec<usize>,
}

/// The tree of a robot of such chains.
pub(super) fn tree(
    chains: &[Chain],
    hinges: &[Vector3<f64>],
    task: Task,
    identify: &[JointTerm],
) -> (Builder, Parts) {
    let n = chains.len();
    let mut tree = Builder::default();
    for (i, chain) in chains.iter().enumerate() {
        let mut joint = Joint::new(&format!("motor{}", i + 1), Motion::Revolute);
        joint.limits = chain.limits;
        joint.terms = chain.terms;
        joint.torque_noise = chain.torque_noise;
        joint.identify = JointTerm::mask(identify);
        tree.add(joint);
    }
    for i in 0..n {
        for rod in ["a", "b"] {
            for angle in ["gamma", "beta"] {
                tree.coordinate(&format!("rod{}{rod}_{angle}", i + 1), Motion::Revolute);
            }
        }
    }
    let (mut arms, mut rods) = (Vec::new(), Vec::new());
    for (i, chain) in chains.iter().enumerate() {
        let k = i + 1;
        let place = Place {
            parent: None,
            rotation: chain.rotation,
            position: chain.motor,
        };
        let arm = tree.body(&format!("arm{k}"), place, i, Vector3::x());
        tree.set(arm, chain.arm);
        tree.zero(arm, chain.zero);
        let mut pair = [0; 2];
        for (r, (rod, side)) in [("a", 0.5), ("b", -0.5)].iter().enumerate() {
            let at = Vector3::new(side * chain.width, 0.0, chain.arm_length);
            let first = n + 4 * i + 2 * r;
            let cross = tree.body(
                &format!("rod{k}{rod}_cross"),
                Place::at(arm, at),
                first,
                Vector3::x(),
            );
            pair[r] = tree.body(
                &format!("rod{k}{rod}"),
                Place::on(cross),
                first + 1,
                Vector3::y(),
            );
            tree.set(pair[r], chain.rods[r]);
        }
        arms.push(arm);
        rods.push(pair);
    }
    let platform = tree.platform(task);
    let mut bars = Vec::new();
    for (k, hinge) in hinges.iter().enumerate() {
        let c = tree.coordinate(&format!("bar{}_hinge", k + 1), Motion::Revolute);
        let name = format!("bar{}", k + 1);
        bars.push(tree.body(&name, Place::at(platform, *hinge), c, Vector3::z()));
    }
    let parts = Parts {
        arms,
        rods,
        platform,
        bars,
    };
    (tree, parts)
}

/// The unknowns of a model with all rods.
pub(super) fn groups(parts: &Parts, bodies: Bodies, identical: bool) -> Vec<Group> {
    let mut all = Vec::new();
    if bodies == Bodies::Rods && identical {
        let side = |r: usize| parts.rods.iter().map(|p| p[r]).collect::<Vec<_>>();
        all.push(Group::shared("arm", &parts.arms, Pattern::Full));
        all.push(Group::shared("rod_a", &side(0), Pattern::Full));
        all.push(Group::shared("rod_b", &side(1), Pattern::Full));
    } else if bodies == Bodies::Rods {
        for (i, (arm, rods)) in parts.arms.iter().zip(&parts.rods).enumerate() {
            let k = i + 1;
            all.push(Group::one(&format!("arm{k}"), *arm, Pattern::Full));
            all.push(Group::one(&format!("rod{k}a"), rods[0], Pattern::Full));
            all.push(Group::one(&format!("rod{k}b"), rods[1], Pattern::Full));
        }
    }
    all.push(Group::one("platform", parts.platform, Pattern::Full));
    for (k, bar) in parts.bars.iter().enumerate() {
        all.push(Group::one(&format!("bar{}", k + 1), *bar, Pattern::Full));
    }
    all
}

/// What is wrong with the numbers of the chains.
pub(super) fn problem(chains: &[Chain]) -> Option<String> {
    chains.iter().enumerate().find_map(|(i, c)| {
        let lengths = [c.arm_length, c.rod_length, c.width];
        let bad = lengths.iter().any(|l| l.is_nan() || *l <= 0.0);
        bad.then(|| {
            format!(
                "chain {}: arm {} m, rods {} m and their distance {} m must be positive",
                i + 1,
                c.arm_length,
                c.rod_length,
                c.width
            )
        })
    })
}
