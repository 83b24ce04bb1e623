//! Rigid-body dynamics of a serial chain, written for this generator alone: every spatial quantity is
//! held in base axes about the base origin, so that forces and articulated inertias of neighbours add
//! without a change of frame. (The library works in link frames; nothing of it is called here.)
//!
//! Featherstone, Rigid Body Dynamics Algorithms, 2008: tables 5.1 and 7.1.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// A revolute or prismatic joint about or along its own z axis, and the body that it carries.
#[derive(Clone, Debug)]
pub struct Joint {
    pub prismatic: bool,
    /// Fixed rotation from joint axes (at q = 0) to the axes of the parent body.
    pub rotation: Matrix3<f64>,
    /// Origin of the joint in the parent body.
    pub position: Vector3<f64>,
    pub body: Body,
}

/// Mass, first moment and inertia tensor about the origin of the body, in body axes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Body {
    pub mass: f64,
    pub moment: Vector3<f64>,
    pub tensor: Matrix3<f64>,
}

impl Body {
    /// Ten numbers in the order of `docs/notation.md`.
    pub fn parameters(&self) -> [f64; 10] {
        let (h, i) = (self.moment, self.tensor);
        [
            self.mass,
            h.x,
            h.y,
            h.z,
            i[(0, 0)],
            i[(0, 1)],
            i[(0, 2)],
            i[(1, 1)],
            i[(1, 2)],
            i[(2, 2)],
        ]
    }

    pub fn from_parameters(p: &[f64]) -> Self {
        Self {
            mass: p[0],
            moment: Vector3::new(p[1], p[2], p[3]),
            tensor: Matrix3::new(p[4], p[5], p[6], p[5], p[7], p[8], p[6], p[8], p[9]),
        }
    }

    /// Adds a body given by its mass, centre and tensor about that centre.
    pub fn add(&mut self, mass: f64, com: Vector3<f64>, tensor: Matrix3<f64>) {
        let s = cross_matrix(&com);
        self.mass += mass;
        self.moment += com * mass;
        self.tensor += tensor - s * s * mass;
    }

    pub fn com(&self) -> Vector3<f64> {
        self.moment / self.mass
    }

    pub fn tensor_com(&self) -> Matrix3<f64> {
        let s = cross_matrix(&self.com());
        self.tensor + s * s * self.mass
    }

    /// Spatial inertia about the base origin in base axes.
    fn spatial(&self, r: &Matrix3<f64>, p: &Vector3<f64>) -> Matrix6<f64> {
        let rh = r * self.moment;
        let h = rh + p * self.mass;
        let (sp, srh) = (cross_matrix(p), cross_matrix(&rh));
        let turned = r * self.tensor * r.transpose();
        let i = turned - sp * srh - srh * sp - sp * sp * self.mass;
        let s = cross_matrix(&h);
        let mut m = Matrix6::zeros();
        m.fixed_view_mut::<3, 3>(0, 0).copy_from(&i);
        m.fixed_view_mut::<3, 3>(0, 3).copy_from(&s);
        m.fixed_view_mut::<3, 3>(3, 0).copy_from(&s.transpose());
        for k in 3..6 {
            m[(k, k)] = self.mass;
        }
        m
    }
}

pub fn cross_matrix(a: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// Rz(yaw) Ry(pitch) Rx(roll), as in a URDF.
pub fn rpy(r: f64, p: f64, y: f64) -> Matrix3<f64> {
    *nalgebra::Rotation3::from_euler_angles(r, p, y).matrix()
}

fn top(v: &Vector6<f64>) -> Vector3<f64> {
    Vector3::new(v[0], v[1], v[2])
}

fn low(v: &Vector6<f64>) -> Vector3<f64> {
    Vector3::new(v[3], v[4], v[5])
}

fn join(a: Vector3<f64>, b: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
}

/// Rate of a motion vector carried along with velocity `v`.
fn cross_motion(v: &Vector6<f64>, m: &Vector6<f64>) -> Vector6<f64> {
    let (w, u) = (top(v), low(v));
    join(w.cross(&top(m)), w.cross(&low(m)) + u.cross(&top(m)))
}

/// Rate of a force vector carried along with velocity `v`.
fn cross_force(v: &Vector6<f64>, f: &Vector6<f64>) -> Vector6<f64> {
    let (w, u) = (top(v), low(v));
    join(w.cross(&top(f)) + u.cross(&low(f)), w.cross(&low(f)))
}

/// A serial chain and the acceleration of gravity in base axes.
#[derive(Clone, Debug)]
pub struct Chain {
    pub joints: Vec<Joint>,
    pub gravity: Vector3<f64>,
}

/// Placement and velocity of every body: what both directions of the dynamics start from.
#[derive(Default)]
pub struct Kinematics {
    rotation: Vec<Matrix3<f64>>,
    origin: Vec<Vector3<f64>>,
    axis: Vec<Vector6<f64>>,
    velocity: Vec<Vector6<f64>>,
    inertia: Vec<Matrix6<f64>>,
}

impl Kinematics {
    /// A point of body `i` in base axes.
    pub fn point(&self, i: usize, local: &Vector3<f64>) -> Vector3<f64> {
        self.origin[i] + self.rotation[i] * local
    }
}

impl Chain {
    pub fn dof(&self) -> usize {
        self.joints.len()
    }

    pub fn kinematics(&self, q: &[f64], v: &[f64], k: &mut Kinematics) {
        k.rotation.clear();
        k.origin.clear();
        k.axis.clear();
        k.velocity.clear();
        k.inertia.clear();
        let (mut r, mut p) = (Matrix3::identity(), Vector3::zeros());
        let mut velocity = Vector6::zeros();
        for (i, joint) in self.joints.iter().enumerate() {
            p += r * joint.position;
            r *= joint.rotation;
            let a = r.column(2).into_owned();
            let axis = if joint.prismatic {
                p += a * q[i];
                join(Vector3::zeros(), a)
            } else {
                let (s, c) = q[i].sin_cos();
                r *= Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
                join(a, p.cross(&a))
            };
            velocity += axis * v[i];
            k.rotation.push(r);
            k.origin.push(p);
            k.axis.push(axis);
            k.velocity.push(velocity);
            k.inertia.push(joint.body.spatial(&r, &p));
        }
    }

    /// Joint torques that give the accelerations `a` (kinematics already computed).
    pub fn inverse(&self, k: &Kinematics, v: &[f64], a: &[f64], tau: &mut [f64]) {
        let n = self.dof();
        let mut acc = join(Vector3::zeros(), -self.gravity);
        let mut force = Vec::with_capacity(n);
        for i in 0..n {
            acc += k.axis[i] * a[i] + cross_motion(&k.velocity[i], &(k.axis[i] * v[i]));
            let momentum = k.inertia[i] * k.velocity[i];
            force.push(k.inertia[i] * acc + cross_force(&k.velocity[i], &momentum));
        }
        let mut sum = Vector6::zeros();
        for i in (0..n).rev() {
            sum += force[i];
            tau[i] = k.axis[i].dot(&sum);
        }
    }

    /// Accelerations under joint torques `tau` and forces `external` (body, point and force in base
    /// axes); `armature` is added to the inertia of each joint's own motion.
    pub fn forward(
        &self,
        k: &Kinematics,
        v: &[f64],
        tau: &[f64],
        armature: &[f64],
        external: &[(usize, Vector3<f64>, Vector3<f64>)],
        a: &mut [f64],
    ) {
        let n = self.dof();
        let mut inertia = k.inertia.clone();
        let mut bias: Vec<Vector6<f64>> = (0..n)
            .map(|i| cross_force(&k.velocity[i], &(k.inertia[i] * k.velocity[i])))
            .collect();
        for (body, point, force) in external {
            bias[*body] -= join(point.cross(force), *force);
        }
        let mut parts = vec![(Vector6::zeros(), 0.0, 0.0, Vector6::zeros()); n];
        for i in (0..n).rev() {
            let s = k.axis[i];
            let c = cross_motion(&k.velocity[i], &(s * v[i]));
            let u = inertia[i] * s;
            let d = s.dot(&u) + armature[i];
            let rest = tau[i] - s.dot(&bias[i]);
            if i > 0 {
                let ia = inertia[i] - u * u.transpose() / d;
                let pa = bias[i] + ia * c + u * (rest / d);
                inertia[i - 1] += ia;
                bias[i - 1] += pa;
            }
            parts[i] = (u, d, rest, c);
        }
        let mut acc = join(Vector3::zeros(), -self.gravity);
        for i in 0..n {
            let (u, d, rest, c) = &parts[i];
            acc += c;
            a[i] = (rest - u.dot(&acc)) / d;
            acc += k.axis[i] * a[i];
        }
    }

    /// Joint torques by unit values of the ten parameters of every body: `out[j][10 i + k]`.
    pub fn regressor(&self, k: &Kinematics, v: &[f64], a: &[f64], out: &mut [Vec<f64>]) {
        let mut acc = join(Vector3::zeros(), -self.gravity);
        for i in 0..self.dof() {
            acc += k.axis[i] * a[i] + cross_motion(&k.velocity[i], &(k.axis[i] * v[i]));
            for p in 0..10 {
                let mut unit = [0.0; 10];
                unit[p] = 1.0;
                let inertia = Body::from_parameters(&unit).spatial(&k.rotation[i], &k.origin[i]);
                let force = inertia * acc + cross_force(&k.velocity[i], &(inertia * k.velocity[i]));
                for (j, row) in out.iter_mut().enumerate() {
                    row[10 * i + p] = if j <= i { k.axis[j].dot(&force) } else { 0.0 };
                }
            }
        }
    }

    /// Diagonal of the mass matrix.
    pub fn own_inertia(&self, q: &[f64]) -> Vec<f64> {
        let n = self.dof();
        let mut k = Kinematics::default();
        self.kinematics(q, &vec![0.0; n], &mut k);
        let mut sum = Matrix6::zeros();
        let mut out = vec![0.0; n];
        for i in (0..n).rev() {
            sum += k.inertia[i];
            out[i] = k.axis[i].dot(&(sum * k.axis[i]));
        }
        out
    }
}
