//! A closed chain in the coordinates of its actuators.
//!
//! With as many actuators as freedoms, their positions `θ = q_a` determine the mechanism as the
//! pose `x` of its platform does, in one assembly mode: `x = X(θ)` with `F_a(X(θ)) = θ` by forward
//! kinematics. With `A = D_a⁻¹`, `G = D A` and `Ξ M = M − G M_a` (`M_a`: the actuated rows):
//!
//! ```text
//! q = F(X(θ))          ẋ = A θ̇             ẍ = A (θ̈ − F_a,xx[ẋ, ẋ])
//! ∂q/∂θ = G            ∂q̇/∂θ = Ξ (F_xx[ẋ, ·] A)
//! ∂(G u)/∂θ = Ξ (F_xx[A u, ·] A)
//! ∂q̈/∂θ = Ξ (∂q̈/∂x A + 2 F_xx[ẋ, ·] B)     B = ∂ẋ/∂θ = −A (F_a,xx[ẋ, ·] A)
//! ```
//!
//! all exact, so that a Fourier series of the actuators is designed, judged and simulated as one of
//! the platform is.

use super::follow::{forward, rates};
use super::geometry::{Cone, Geometry, Segment};
use super::{Mechanism, MechanismMotion, Source, Task};
use crate::dynamics::{Isa, Samples};
use crate::error::{Error, Result};
use crate::robot::Limits;
use crate::trajectory::Space;
use nalgebra::DMatrix;
use std::borrow::Cow;
use std::sync::{Arc, Mutex, PoisonError};

/// Batches whose poses are remembered: each is asked for several times in turn.
const REMEMBERED: usize = 8;

/// Kinematics from the positions of the actuators.
#[derive(Debug)]
struct ActuatorSpace {
    platform: Mechanism,
    /// positions of the actuators, and the poses that they give
    remembered: Mutex<Vec<(Vec<f64>, Vec<f64>)>>,
}

impl Mechanism {
    /// What the task coordinates are: joints that are actuated, or the pose of the platform.
    pub fn space(&self) -> Space {
        match self.task {
            Task::Joints(_) => Space::Actuators,
            _ => Space::Platform,
        }
    }

    /// The mechanism in the coordinates of its platform, where it has been put
    /// [`in_actuators`](Mechanism::in_actuators); otherwise itself.
    pub fn platform(&self) -> &Mechanism {
        self.follows().unwrap_or(self)
    }

    /// The mechanism in the coordinates of its platform, where that follows from the actuators.
    pub(crate) fn follows(&self) -> Option<&Mechanism> {
        match &self.source {
            Source::InActuators(platform) => Some(platform),
            _ => None,
        }
    }

    /// The same mechanism with the positions of its actuators as task coordinates, inside their own
    /// limits; the workspace box stays a limit of its [`platform`](Mechanism::platform). A mechanism
    /// whose task coordinates are joints already stays as it is.
    ///
    /// # Errors
    /// More actuators than freedoms, whose positions cannot be chosen freely; a tree without the
    /// coordinates of its platform.
    pub fn in_actuators(&self) -> Result<Mechanism> {
        if self.space() == Space::Actuators {
            return Ok(self.clone());
        }
        let (m, na) = (self.freedoms(), self.actuators());
        if na != m {
            return Err(Error::Argument(format!(
                "{}: {na} actuators move {m} freedoms, so their positions cannot be chosen freely; \
                 take the coordinates of the platform",
                self.robot.name
            )));
        }
        if self.platform_rows().len() != m {
            return Err(Error::Argument(format!(
                "{}: its tree lacks the coordinates {} of its platform",
                self.robot.name,
                self.task_names.join(", ")
            )));
        }
        let limits = |&a: &usize| -> Limits { self.robot.joints[a].limits };
        Ok(Mechanism {
            source: Source::InActuators(Box::new(self.clone())),
            task: Task::Joints(m),
            task_names: self.actuator_names(),
            workspace: self.actuated.iter().map(limits).collect(),
            home: self.actuator_positions(&self.home)?,
            geometry: Arc::new(ActuatorSpace {
                platform: self.clone(),
                remembered: Mutex::default(),
            }),
            ..self.clone()
        })
    }

    /// Tree coordinates that are those of the platform, see
    /// [`tree::Builder::platform`](super::tree::Builder::platform).
    pub(crate) fn platform_rows(&self) -> Vec<usize> {
        let joints = &self.robot.joints;
        let row = |name: &&str| joints.iter().position(|j| j.name == **name);
        let names = self.platform().task.names();
        names.iter().filter_map(row).collect()
    }

    /// Motion of the platform's coordinates that goes with a motion of the task coordinates: the
    /// same, unless these are the actuators in their place.
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    pub fn platform_motion<'a>(&self, x: &'a Samples) -> Result<Cow<'a, Samples>> {
        match self.follows() {
            Some(_) => Ok(self.platform_of(x, &self.motion(x)?.tree)),
            None => Ok(Cow::Borrowed(x)),
        }
    }

    /// [`Mechanism::platform_motion`] where the motion of the tree is at hand.
    pub(super) fn platform_of<'a>(&self, x: &'a Samples, tree: &Samples) -> Cow<'a, Samples> {
        match self.follows() {
            Some(_) => Cow::Owned(tree.rows(&self.platform_rows())),
            None => Cow::Borrowed(x),
        }
    }
}

/// The matrix of sample `s` of a batch.
fn matrix(a: &[f64], rows: usize, columns: usize, count: usize, s: usize) -> DMatrix<f64> {
    DMatrix::from_fn(rows, columns, |i, k| a[(i * columns + k) * count + s])
}

/// Writes the matrix of sample `s`.
fn put(a: &mut [f64], matrix: &DMatrix<f64>, count: usize, s: usize) {
    let columns = matrix.ncols();
    for i in 0..matrix.nrows() {
        for k in 0..columns {
            a[(i * columns + k) * count + s] = matrix[(i, k)];
        }
    }
}

impl ActuatorSpace {
    /// Poses of the platform, coordinate-major, from positions of the actuators.
    fn poses(&self, theta: &Samples) -> Result<Vec<f64>> {
        let lock = || {
            self.remembered
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
        };
        if let Some((_, x)) = lock().iter().find(|(q, _)| *q == theta.q) {
            return Ok(x.clone());
        }
        let x = forward(&self.platform, &lists(&theta.q, theta.count))?;
        let mut remembered = lock();
        if remembered.len() == REMEMBERED {
            remembered.remove(0);
        }
        remembered.push((theta.q.clone(), x.clone()));
        Ok(x)
    }

    /// Motion of the platform and of the tree.
    fn follow(&self, isa: Isa, theta: &Samples) -> Result<(Samples, MechanismMotion)> {
        let (m, count) = (theta.dof, theta.count);
        let mut x = Samples::zeros(m, count);
        x.q = self.poses(theta)?;
        let positions = lists(&x.q, count);
        let [first, second] = [&theta.qd, &theta.qdd].map(|a| lists(a, count));
        let rates = rates(&self.platform, &positions, &first, Some(&second))?;
        x.qd = rates.velocity.concat();
        x.qdd = rates.acceleration.unwrap_or_default().concat();
        let mut motion = MechanismMotion::default();
        self.platform.motion_into(isa, &x, &mut motion)?;
        Ok((x, motion))
    }

    /// `Ξ M`.
    fn project(&self, g: &DMatrix<f64>, m: DMatrix<f64>) -> DMatrix<f64> {
        let own = m.select_rows(&self.platform.actuated);
        m - g * own
    }

    fn pose(&self, theta: &[f64]) -> Result<Vec<f64>> {
        Ok(self.platform.forward(theta, &self.platform.home)?.x)
    }
}

/// One list a coordinate.
fn lists(a: &[f64], count: usize) -> Vec<Vec<f64>> {
    a.chunks(count.max(1)).map(<[f64]>::to_vec).collect()
}

impl Geometry for ActuatorSpace {
    fn coordinates(&self) -> usize {
        self.platform.geometry.coordinates()
    }
    fn task(&self) -> usize {
        self.platform.freedoms()
    }
    fn task_joints(&self) -> Option<&[usize]> {
        Some(&self.platform.actuated)
    }
    fn sequential(&self) -> bool {
        true
    }

    fn motion(&self, isa: Isa, theta: &Samples, motion: &mut Samples, d: &mut [f64]) {
        let Ok((_, at)) = self.follow(isa, theta) else {
            for a in [&mut motion.q, &mut motion.qd, &mut motion.qdd] {
                a.fill(f64::NAN);
            }
            return d.fill(f64::NAN);
        };
        let size = motion.dof * theta.count;
        motion.q[..size].copy_from_slice(&at.tree.q);
        motion.qd[..size].copy_from_slice(&at.tree.qd);
        motion.qdd[..size].copy_from_slice(&at.tree.qdd);
        d[..at.g.len()].copy_from_slice(&at.g);
        // what is given, to the last digit
        let (m, count) = (theta.dof, theta.count);
        for (i, &j) in self.platform.actuated.iter().enumerate() {
            let (from, to) = (i * count..(i + 1) * count, j * count..(j + 1) * count);
            motion.q[to.clone()].copy_from_slice(&theta.q[from.clone()]);
            motion.qd[to.clone()].copy_from_slice(&theta.qd[from.clone()]);
            motion.qdd[to].copy_from_slice(&theta.qdd[from]);
            for k in 0..m {
                let one = if i == k { 1.0 } else { 0.0 };
                d[(j * m + k) * count..][..count].fill(one);
            }
        }
    }

    fn sensitivity(
        &self,
        isa: Isa,
        theta: &Samples,
        d: &mut [f64],
        dqd: &mut [f64],
        dqdd: &mut [f64],
    ) {
        let Ok((x, at)) = self.follow(isa, theta) else {
            return [d, dqd, dqdd].into_iter().for_each(|a| a.fill(f64::NAN));
        };
        let (n, m, count) = (self.coordinates(), theta.dof, theta.count);
        let platform = &self.platform.geometry;
        platform.sensitivity(isa, &x, d, dqd, dqdd);
        for s in 0..count {
            let a = matrix(&at.a, m, m, count, s);
            let g = matrix(&at.g, n, m, count, s);
            let bend = matrix(dqd, n, m, count, s);
            let first = &bend * &a;
            let b = &a * first.select_rows(&self.platform.actuated) * -2.0;
            let second = matrix(dqdd, n, m, count, s) * &a + bend * b;
            put(d, &g, count, s);
            put(dqd, &self.project(&g, first), count, s);
            put(dqdd, &self.project(&g, second), count, s);
        }
    }

    fn curvature(&self, isa: Isa, theta: &Samples, u: &[f64], out: &mut [f64]) {
        let Ok((x, at)) = self.follow(isa, theta) else {
            return out.fill(f64::NAN);
        };
        let (n, m, count) = (self.coordinates(), theta.dof, theta.count);
        let mut along = vec![0.0; m * count];
        for k in 0..m {
            for i in 0..m {
                for s in 0..count {
                    along[k * count + s] += at.a[(k * m + i) * count + s] * u[i * count + s];
                }
            }
        }
        self.platform.geometry.curvature(isa, &x, &along, out);
        for s in 0..count {
            let bend = matrix(out, n, m, count, s) * matrix(&at.a, m, m, count, s);
            let g = matrix(&at.g, n, m, count, s);
            put(out, &self.project(&g, bend), count, s);
        }
    }

    fn unreachable(&self, theta: &[f64]) -> Option<String> {
        self.pose(theta).err().map(|e| e.to_string())
    }
    fn constraint_block(&self, theta: &[f64]) -> Option<DMatrix<f64>> {
        match self.pose(theta) {
            Ok(x) => self.platform.geometry.constraint_block(&x),
            Err(_) => Some(DMatrix::from_element(1, 1, f64::NAN)),
        }
    }
    fn segments(&self, theta: &[f64]) -> Vec<Segment> {
        let lines = |x: Vec<f64>| self.platform.geometry.segments(&x);
        self.pose(theta).map(lines).unwrap_or_default()
    }
    fn cones(&self, theta: &[f64]) -> Vec<Cone> {
        let open = |x: Vec<f64>| self.platform.geometry.cones(&x);
        self.pose(theta).map(open).unwrap_or_default()
    }
}
