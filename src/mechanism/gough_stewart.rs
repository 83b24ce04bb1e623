//! Gough-Stewart platform: six legs of variable length between base and platform, 6-UPS or 6-SPS.
//!
//! Leg `i` joins `a_i` (base axes) to `b_i` (platform axes). With `l = p + R b − a` and its
//! universal joint in the frame `R_0` (columns: first axis, second axis, direction at zero angles),
//!
//! ```text
//! L = |l|      R_leg = R_0 Rx(α) Ry(β)      R_0ᵀ l = L (sin β, −sin α cos β, cos α cos β)
//! ```
//!
//! so that `β = atan2(l_x, √(l_y² + l_z²))`, `α = atan2(−l_y, l_z)` in `R_0` axes. The leg has three
//! bodies: the cross of the universal joint (turns by `α`), the cylinder (`β`), both with their
//! frame in `a_i`, and the rod (`L`) with its frame in `b_i`; `z` of the latter two points along
//! the leg. Differentiating these expressions exactly gives the leg's spin, too.
//!
//! **6-SPS**: a spherical joint at the base leaves the spin of the leg free. Its bodies must be
//! bodies of revolution, about whose axis no torque acts; without `Izz` the dynamics does not
//! depend on the spin, so the same equations hold with `Izz` left out of the model.
//!
//! Khalil & Guégan, IEEE Transactions on Robotics 20(4), 2004, give the same model in closed form.

use super::closed_form::ClosedForm;
use super::dimensions::{Dimensions, LEG, LegChain};
use super::geometry::{Cone, Coordinates, Kinematics, Segment};
use super::parameters::{Group, Pattern};
use super::scalar::{Scalar, linear};
use super::task::{Task, rotation};
use super::tree::{Builder, Place};
use super::{Mechanism, Setup, Source};
use crate::error::{Error, Result};
use crate::robot::{Inertia, Joint, JointTerm, Limits, Motion};
use nalgebra::{Matrix3, Vector3};

/// Geometry and bodies of one leg.
#[derive(Debug, Clone)]
pub struct Leg {
    /// joint at the base, base axes, m
    pub base: Vector3<f64>,
    /// joint at the platform, platform axes, m
    pub platform: Vector3<f64>,
    /// frame of the universal joint: `R_0`
    pub rotation: Matrix3<f64>,
    /// length at which the actuator reads zero, m
    pub zero: f64,
    /// limits of the actuator
    pub limits: Limits,
    /// values of armature (ball screw and rotor, kg), viscous, Coulomb and offset
    pub terms: [f64; 4],
    /// standard deviation of the force, N
    pub force_noise: Option<f64>,
    /// half opening of the cones of the joints at the base and at the platform, rad
    pub cone: [f64; 2],
    /// about `a_i`, in the axes of the cross
    pub cross: Inertia,
    /// about `a_i`, `z` along the leg
    pub cylinder: Inertia,
    /// about `b_i`, `z` along the leg
    pub rod: Inertia,
}

/// Which bodies are unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Bodies {
    /// the platform alone
    Platform,
    /// platform, cylinders and rods
    Legs,
    /// platform, cylinders, rods and crosses of the universal joints
    Cross,
}

/// A Gough-Stewart platform.
#[derive(Debug, Clone)]
pub struct GoughStewart {
    /// name
    pub name: String,
    /// the six legs
    pub legs: Vec<Leg>,
    /// about the platform frame's origin
    pub platform: Inertia,
    /// `x, y, z, roll, pitch, yaw` of the middle of the workspace
    pub home: [f64; 6],
    /// acceleration of gravity, base axes
    pub gravity: Vector3<f64>,
    /// unknown bodies
    pub bodies: Bodies,
    /// all legs have the same parameters
    pub identical: bool,
    /// legs are bodies of revolution: `m, mz, Ixx = Iyy, Izz`
    pub axisymmetric: bool,
    /// spherical joints at the base
    pub spherical: bool,
    /// actuator terms that are unknown
    pub identify: Vec<JointTerm>,
}

/// `R_0` for a leg that points along `direction` in the middle of the workspace: `z` along it, `x`
/// horizontal.
pub fn joint_frame(direction: &Vector3<f64>) -> Matrix3<f64> {
    let z = direction.normalize();
    let across = Vector3::z().cross(&z);
    let x = match across.norm() < 1e-9 {
        true => Vector3::x(),
        false => across.normalize(),
    };
    Matrix3::from_columns(&[x, z.cross(&x), z])
}

impl GoughStewart {
    /// The mechanism.
    ///
    /// # Errors
    /// A leg of no length at home, 6-SPS with legs that are not bodies of revolution, and what
    /// [`Mechanism::new`] finds.
    pub fn build(&self) -> Result<Mechanism> {
        Mechanism::new(self.setup()?)
    }

    /// What the mechanism is put together from.
    ///
    /// # Errors
    /// As [`Self::build`], what [`Mechanism::new`] finds excepted.
    pub fn setup(&self) -> Result<Setup> {
        let n = self.legs.len();
        if n != 6 {
            return Err(Error::Infeasible(format!(
                "a Gough-Stewart platform has 6 legs, this one has {n}; with fewer the platform is \
                 not held, for more or others use mechanism = \"loops\""
            )));
        }
        if self.spherical && !(self.axisymmetric && self.bodies != Bodies::Cross) {
            return Err(Error::Infeasible(
                "6-SPS: the spin of a leg between two spherical joints is free, so its bodies must \
                 be bodies of revolution and there is no cross; set axisymmetric = true and \
                 bodies = \"legs\" or \"platform\""
                    .into(),
            ));
        }
        let spin_free = |i: Inertia| match self.spherical {
            false => i,
            true => {
                let mut i = i;
                i.0[9] = 0.0;
                i
            }
        };
        let mut tree = Builder::default();
        for (i, leg) in self.legs.iter().enumerate() {
            let mut joint = Joint::new(&format!("leg{}", i + 1), Motion::Prismatic);
            joint.limits = leg.limits;
            joint.terms = leg.terms;
            joint.torque_noise = leg.force_noise;
            joint.identify = JointTerm::mask(&self.identify);
            tree.add(joint);
        }
        for i in 0..6 {
            tree.coordinate(&format!("leg{}_alpha", i + 1), Motion::Revolute);
            tree.coordinate(&format!("leg{}_beta", i + 1), Motion::Revolute);
        }
        let (mut crosses, mut cylinders, mut rods) = (Vec::new(), Vec::new(), Vec::new());
        for (i, leg) in self.legs.iter().enumerate() {
            let k = i + 1;
            let place = Place {
                parent: None,
                rotation: leg.rotation,
                position: leg.base,
            };
            let cross = tree.body(&format!("cross{k}"), place, 6 + 2 * i, Vector3::x());
            tree.set(cross, leg.cross);
            let cylinder = tree.body(
                &format!("cylinder{k}"),
                Place::on(cross),
                7 + 2 * i,
                Vector3::y(),
            );
            tree.set(cylinder, spin_free(leg.cylinder));
            let rod = tree.body(&format!("rod{k}"), Place::on(cylinder), i, Vector3::z());
            tree.set(rod, spin_free(leg.rod));
            tree.zero(rod, leg.zero);
            crosses.push(cross);
            cylinders.push(cylinder);
            rods.push(rod);
        }
        let platform = tree.platform(Task::Pose);
        tree.set(platform, self.platform);

        let legs = match (self.spherical, self.axisymmetric) {
            (true, _) => Pattern::NoSpin,
            (false, true) => Pattern::Axisymmetric,
            (false, false) => Pattern::Full,
        };
        let mut groups = Vec::new();
        let mut add = |name: &str, bodies: &[usize], pattern: &Pattern| match self.identical {
            true => groups.push(Group::shared(name, bodies, pattern.clone())),
            false => groups.extend(
                bodies
                    .iter()
                    .enumerate()
                    .map(|(i, &b)| Group::one(&format!("{name}{}", i + 1), b, pattern.clone())),
            ),
        };
        if self.bodies != Bodies::Platform {
            if self.bodies == Bodies::Cross {
                add("cross", &crosses, &Pattern::Full);
            }
            add("cylinder", &cylinders, &legs);
            add("rod", &rods, &legs);
        }
        groups.push(Group::one("platform", platform, Pattern::Full));
        let length = self
            .legs
            .iter()
            .map(|l| l.platform.norm())
            .fold(0.0, f64::max)
            .max(1e-3);
        let kinematics = Kinematic {
            legs: self.legs.clone(),
        };
        if let Some(why) = kinematics.unreachable(&self.home) {
            return Err(Error::Infeasible(format!("at home {why}")));
        }
        Ok(Setup {
            source: Source::GoughStewart,
            robot: tree.robot(&self.name, self.gravity),
            actuated: (0..6).collect(),
            task: Task::Pose,
            geometry: Box::new(ClosedForm::<_, 6>(kinematics)),
            groups,
            home: self.home.to_vec(),
            length,
        })
    }
}

/// The kinematics alone.
#[derive(Debug, Clone)]
struct Kinematic {
    legs: Vec<Leg>,
}

impl Kinematic {
    /// `l_i` in base axes.
    fn leg(&self, leg: &Leg, x: &[f64]) -> Vector3<f64> {
        let r = rotation(&Vector3::new(x[3], x[4], x[5]));
        Vector3::new(x[0], x[1], x[2]) + r * leg.platform - leg.base
    }
}

impl Kinematics for Kinematic {
    fn coordinates(&self) -> usize {
        24
    }

    #[inline(always)]
    fn inverse<S: Scalar, C: Coordinates<S> + ?Sized>(&self, x: &[S], q: &mut C) {
        let r = linear::rpy(x[3], x[4], x[5]);
        for (i, leg) in self.legs.iter().enumerate() {
            let b = linear::turned(&r, &leg.platform);
            let l = [
                b[0] + x[0] + (-leg.base.x),
                b[1] + x[1] + (-leg.base.y),
                b[2] + x[2] + (-leg.base.z),
            ];
            let l = linear::turned_back(&leg.rotation, l);
            let yz = l[1] * l[1] + l[2] * l[2];
            q.put(i, (l[0] * l[0] + yz).sqrt() + (-leg.zero));
            q.put_angle(&[6 + 2 * i], -l[1], l[2]);
            q.put_angle(&[7 + 2 * i], l[0], yz.sqrt());
        }
        for k in 0..6 {
            q.put(18 + k, x[k]);
        }
    }

    fn unreachable(&self, x: &[f64]) -> Option<String> {
        self.legs.iter().enumerate().find_map(|(i, leg)| {
            let l = self.leg(leg, x);
            let along = leg.rotation.transpose() * l;
            let across = along.y.hypot(along.z);
            (across <= 1e-9 * (1.0 + l.norm())).then(|| {
                format!(
                    "leg {} of length {:.4} m lies along the first axis of its universal joint: \
                     the joint cannot turn there",
                    i + 1,
                    l.norm()
                )
            })
        })
    }

    fn segments(&self, x: &[f64]) -> Vec<Segment> {
        let tip = |leg: &Leg| leg.base + self.leg(leg, x);
        let mut all: Vec<Segment> = self
            .legs
            .iter()
            .enumerate()
            .map(|(i, leg)| Segment {
                name: format!("leg{}", i + 1),
                ends: [leg.base, tip(leg)],
            })
            .collect();
        for (i, leg) in self.legs.iter().enumerate() {
            all.push(Segment {
                name: "platform".into(),
                ends: [tip(leg), tip(&self.legs[(i + 1) % self.legs.len()])],
            });
        }
        all
    }

    fn dimensions(&self) -> Option<Dimensions> {
        let leg = |l: &Leg| LegChain {
            base: l.base,
            platform: l.platform,
            zero: l.zero,
        };
        Some(Dimensions::Legs(self.legs.iter().map(leg).collect()))
    }

    fn deformed(&self, off: &[f64]) -> Option<Self> {
        let mut other = self.clone();
        for (leg, e) in other.legs.iter_mut().zip(off.chunks_exact(LEG.len())) {
            leg.base += Vector3::new(e[0], e[1], e[2]);
            leg.platform += Vector3::new(e[3], e[4], e[5]);
        }
        Some(other)
    }

    fn cones(&self, x: &[f64]) -> Vec<Cone> {
        let r = rotation(&Vector3::new(x[3], x[4], x[5]));
        let mut all = Vec::new();
        for (i, leg) in self.legs.iter().enumerate() {
            let s = self.leg(leg, x).normalize();
            let axis = leg.rotation.column(2).into_owned();
            // the joint at the platform is mounted in line with the leg at home
            for (k, (name, z)) in [("base", axis), ("platform", r * axis)].iter().enumerate() {
                all.push(Cone {
                    name: format!("leg{} {name}", i + 1),
                    angle: s.cross(z).norm().atan2(s.dot(z)),
                    limit: leg.cone[k],
                });
            }
        }
        all
    }
}
