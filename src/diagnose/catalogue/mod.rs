//! The effects that may separate a model from its robot, one file each.
//!
//! An [`Effect`] says where it can sit ([`Effect::places`]), which shape constants it has that do not
//! enter linearly ([`Effect::shapes`]), and gives the columns that it adds to the torque
//! ([`Effect::columns`]). All effects of a place and shape are linear in their coefficients.

mod backlash;
mod base_compliance;
mod cable_spring;
mod cogging;
mod coulomb_friction;
mod counterbalance;
mod encoder_eccentricity;
mod friction_asymmetry;
mod gravity_direction;
mod joint_coupling;
mod joint_elasticity;
mod joint_offset;
mod leg_inertia;
mod link_inertia;
mod load_dependent_friction;
mod nonlinear_viscous_friction;
mod passive_joint_friction;
mod payload;
mod position_dependent_friction;
mod presliding_hysteresis;
mod rotor_inertia;
mod stribeck_friction;
mod thermal_friction;
mod torque_constant;
mod torque_delay;
mod torque_offset;
mod torque_saturation;
mod transmission_error;
mod viscous_friction;

use super::data::{Column, Data, averaged};
use super::record::Record;
use crate::dynamics::Samples;
use crate::mechanism::MechanismMotion;
use crate::plant::Kind;
use crate::robot::{JointTerm, Motion};
use std::sync::OnceLock;

/// What is known about an effect, for reports and documentation.
#[derive(Debug, Clone, Copy)]
pub struct Card {
    /// name in `diagnosis.json`
    pub name: &'static str,
    /// name in sentences
    pub title: &'static str,
    /// what it adds to the residual
    pub equation: &'static str,
    /// where it is from
    pub source: &'static str,
    /// what it is an exact alias of, by nature
    pub aliases: &'static [&'static str],
    /// the motion that tells it apart
    pub separated_by: &'static str,
}

/// One number of an effect.
#[derive(Debug, Clone)]
pub struct Value {
    /// name
    pub name: &'static str,
    /// value
    pub value: f64,
    /// standard deviation; `None` for shape constants taken from a grid
    pub std: Option<f64>,
    /// SI unit
    pub unit: &'static str,
}

/// State of the diagnosis that columns may depend on.
pub struct Context<'a> {
    /// the records
    pub data: &'a Data<'a>,
    /// parameters of the nominal model, as fitted
    pub phi: Vec<f64>,
    /// modelled torque by actuator, over all records
    pub model: Vec<Vec<f64>>,
    /// rigid-body part of it
    pub rigid: Vec<Vec<f64>>,
    /// largest rigid-body torque by actuator
    pub peak: Vec<f64>,
    /// column `j` of the mass matrix over all records: `mass[j][i]` is `M_ij` (serial robots)
    pub mass: Vec<Vec<Vec<f64>>>,
    /// what the robot exerts on its base, once it was asked for
    base: OnceLock<Option<base_compliance::Load>>,
}

/// An effect of the catalogue.
pub trait Effect: Sync {
    /// What is known about it.
    fn card(&self) -> Card;
    /// Sets of actuators it can sit on; an empty set is the whole robot.
    fn places(&self, cx: &Context) -> Vec<Vec<usize>>;
    /// Shape constants to try.
    fn shapes(&self, _cx: &Context, _place: &[usize]) -> Vec<Vec<f64>> {
        vec![Vec::new()]
    }
    /// Whether shape constant `k` is a positive number that may be refined between grid points.
    fn refinable(&self, _k: usize) -> bool {
        false
    }
    /// Whether a refit of ordinary parameters may absorb it without a trace, so that values which are
    /// unlikely under their prior are its only sign.
    fn hides(&self) -> bool {
        false
    }
    /// Whether it rings with damping, as the loop of the robot's controller does.
    fn rings(&self, _shape: &[f64]) -> bool {
        false
    }
    /// Whether it depends on what went on before a record began, so that coefficients of one record
    /// need not fit another.
    fn remembers(&self) -> bool {
        false
    }
    /// Columns, per unit of the coefficients. A `draft` may leave out rows of lesser weight.
    fn columns(&self, cx: &Context, place: &[usize], shape: &[f64], draft: bool) -> Vec<Column>;
    /// Whether coefficients make physical sense.
    fn plausible(&self, _cx: &Context, _place: &[usize], _shape: &[f64], _eta: &[f64]) -> bool {
        true
    }
    /// Coefficients and shape as physical parameters.
    fn values(
        &self,
        cx: &Context,
        place: &[usize],
        shape: &[f64],
        eta: &[f64],
        std: &[f64],
    ) -> Vec<Value>;
}

/// All effects, in the order of `formats.md`.
pub fn all() -> Vec<Box<dyn Effect>> {
    vec![
        Box::new(payload::Payload),
        Box::new(link_inertia::LinkInertia),
        Box::new(gravity_direction::GravityDirection),
        Box::new(rotor_inertia::RotorInertia),
        Box::new(viscous_friction::ViscousFriction),
        Box::new(coulomb_friction::CoulombFriction),
        Box::new(torque_offset::TorqueOffset),
        Box::new(friction_asymmetry::FrictionAsymmetry),
        Box::new(nonlinear_viscous_friction::NonlinearViscousFriction),
        Box::new(stribeck_friction::StribeckFriction),
        Box::new(presliding_hysteresis::PreslidingHysteresis),
        Box::new(load_dependent_friction::LoadDependentFriction),
        Box::new(position_dependent_friction::PositionDependentFriction),
        Box::new(thermal_friction::ThermalFriction),
        Box::new(torque_constant::TorqueConstant),
        Box::new(torque_saturation::TorqueSaturation),
        Box::new(cogging::Cogging),
        Box::new(transmission_error::TransmissionError),
        Box::new(joint_elasticity::JointElasticity),
        Box::new(backlash::Backlash),
        Box::new(base_compliance::BaseCompliance),
        Box::new(torque_delay::TorqueDelay),
        Box::new(cable_spring::CableSpring),
        Box::new(counterbalance::Counterbalance),
        Box::new(joint_coupling::JointCoupling),
        Box::new(joint_offset::JointOffset),
        Box::new(encoder_eccentricity::EncoderEccentricity),
        Box::new(passive_joint_friction::PassiveJointFriction),
        Box::new(leg_inertia::LegInertia),
    ]
}

impl<'a> Context<'a> {
    /// With parameters `phi` of the nominal model.
    ///
    /// # Errors
    /// Poses that cannot be reached.
    pub fn new(data: &'a Data<'a>, phi: Vec<f64>) -> crate::Result<Self> {
        let model = data.model_torque(&phi);
        let rigid = data.rigid_torque(&phi);
        let peak = rigid
            .iter()
            .map(|r| r.iter().fold(0.0f64, |m, v| m.max(v.abs())).max(1e-9))
            .collect();
        let mut mass = Vec::new();
        if data.plant.mechanism().is_none() {
            for j in 0..data.joints() {
                let more = data.torque_of(&phi, |r, _, x| {
                    x.qdd[j * r.count..(j + 1) * r.count]
                        .iter_mut()
                        .for_each(|a| *a += 1.0);
                })?;
                let column = more
                    .iter()
                    .zip(&rigid)
                    .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect())
                    .collect();
                mass.push(column);
            }
        }
        Ok(Context {
            data,
            phi,
            model,
            rigid,
            peak,
            mass,
            base: OnceLock::new(),
        })
    }

    /// What the robot exerts on its base (serial robots).
    pub(crate) fn base(&self) -> Option<&base_compliance::Load> {
        self.base
            .get_or_init(|| base_compliance::Load::of(self))
            .as_ref()
    }

    /// Every actuator by itself.
    pub fn singles(&self) -> Vec<Vec<usize>> {
        (0..self.data.joints()).map(|j| vec![j]).collect()
    }

    /// Whether it is a serial robot.
    pub fn serial(&self) -> bool {
        self.data.plant.mechanism().is_none()
    }

    /// Actuators whose nominal model has no unknown of this kind.
    pub fn without(&self, term: JointTerm) -> Vec<Vec<usize>> {
        let actuated = self.data.plant.actuated();
        self.singles()
            .into_iter()
            .filter(|place| {
                let joint = actuated[place[0]];
                !self
                    .data
                    .parameters
                    .iter()
                    .any(|p| p.kind == Kind::Term { joint, term })
            })
            .collect()
    }

    /// Kind of motion of an actuator.
    pub fn motion(&self, j: usize) -> Motion {
        self.data.plant.actuators()[j].motion
    }

    /// Unit of the torque of an actuator.
    pub fn torque_unit(&self, j: usize) -> &'static str {
        match self.motion(j) {
            Motion::Revolute => "N m",
            Motion::Prismatic => "N",
        }
    }

    /// Unit of a velocity of an actuator.
    pub fn speed_unit(&self, j: usize) -> &'static str {
        match self.motion(j) {
            Motion::Revolute => "rad/s",
            Motion::Prismatic => "m/s",
        }
    }

    /// Unit of a position of an actuator.
    pub fn position_unit(&self, j: usize) -> &'static str {
        match self.motion(j) {
            Motion::Revolute => "rad",
            Motion::Prismatic => "m",
        }
    }

    /// Smooth sign of the velocity of an actuator over all records, averaged as torque is.
    pub fn sign(&self, j: usize) -> Vec<f64> {
        let width = 1e-3 * self.data.speed[j];
        self.data.own(j, |_, v| super::data::sign(v, width))
    }

    /// Change of the rigid-body torque of all actuators when coordinate `j` moves by a small `δ`
    /// more: `∂τ/∂(q_j, q̇_j, q̈_j) (δ, δ̇, δ̈)`. `delta` gives `(δ, δ̇, δ̈)` of a record, sample by
    /// sample.
    pub fn displaced(
        &self,
        j: usize,
        delta: impl Fn(&Record, usize) -> [Vec<f64>; 3] + Sync,
    ) -> Column {
        let n = self.data.joints();
        let side = |sign: f64| {
            self.data.torque_of(&self.phi, |r, k, x: &mut Samples| {
                let d = delta(r, k);
                let largest = d[0].iter().fold(1e-12f64, |m, v| m.max(v.abs()));
                let step = sign * 1e-4 / largest;
                let row = j * r.count..(j + 1) * r.count;
                for (to, from) in [&mut x.q, &mut x.qd, &mut x.qdd].into_iter().zip(&d) {
                    for (x, v) in to[row.clone()].iter_mut().zip(from) {
                        *x += step * v;
                    }
                }
            })
        };
        let (Ok(plus), Ok(minus)) = (side(1.0), side(-1.0)) else {
            return Column::default();
        };
        let rows = (0..n)
            .map(|i| {
                let mut out = Vec::with_capacity(self.data.rows());
                for (k, r) in self.data.records.iter().enumerate() {
                    let d = delta(r, k);
                    let largest = d[0].iter().fold(1e-12f64, |m, v| m.max(v.abs()));
                    let step = 2e-4 / largest;
                    let span = self.data.span(k);
                    out.extend(
                        plus[i][span.clone()]
                            .iter()
                            .zip(&minus[i][span])
                            .map(|(a, b)| (a - b) / step),
                    );
                }
                (i, out)
            })
            .collect();
        prune(Column { rows })
    }

    /// `M_ij δ̈` on the rows of all actuators for an acceleration `δ̈` of coordinate `j` given on all
    /// samples (or only on the row of `j`).
    pub fn inertial(&self, j: usize, acceleration: &[f64], own_only: bool) -> Column {
        let rows = (0..self.data.joints())
            .filter(|i| !own_only || *i == j)
            .map(|i| {
                let values = self.mass[j][i]
                    .iter()
                    .zip(acceleration)
                    .map(|(m, a)| m * a)
                    .collect();
                (i, values)
            })
            .collect();
        prune(Column { rows })
    }
}

/// Actuator forces of a closed chain whose tree has the inertial parameters `phi` (ten a body) and
/// nothing else, `Gᵀ Y_tree φ`; `None` for a serial robot and poses that cannot be reached.
pub(crate) fn closed_column(cx: &Context, phi: &[f64]) -> Option<Column> {
    projected(cx, |motion| {
        let mut gamma = vec![0.0; motion.tree.dof * motion.tree.count];
        let tree = cx.data.plant.tree();
        tree.inverse_dynamics(&mut Default::default(), phi, &motion.tree, &mut gamma);
        gamma
    })
}

/// Generalised forces of the joints of the tree, record by record, as the actuators of a closed
/// chain feel them: `Gᵀ Γ`.
pub(crate) fn projected(
    cx: &Context,
    gamma: impl Fn(&MechanismMotion) -> Vec<f64>,
) -> Option<Column> {
    let mechanism = cx.data.plant.mechanism()?;
    let mut rows = vec![Vec::with_capacity(cx.data.rows()); cx.data.joints()];
    for r in &cx.data.records {
        let motion = mechanism.motion(&r.x).ok()?;
        let tau = mechanism.project(&motion, &gamma(&motion));
        for (row, tau) in rows.iter_mut().zip(tau.chunks_exact(r.count)) {
            row.extend(smooth(tau));
        }
    }
    Some(Column {
        rows: rows.into_iter().enumerate().collect(),
    })
}

/// Drops rows that are zero throughout.
fn prune(mut column: Column) -> Column {
    column
        .rows
        .retain(|(_, v)| v.iter().any(|x| x.abs() > 1e-12));
    column
}

/// Average as torque is measured.
pub(crate) fn smooth(x: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; x.len()];
    averaged(x, &mut out);
    out
}

/// `count` numbers from `a` to `b` in equal ratios.
pub(crate) fn ladder(a: f64, b: f64, count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| a * (b / a).powf(i as f64 / (count - 1) as f64))
        .collect()
}

/// A linear coefficient.
pub(crate) fn value(name: &'static str, value: f64, std: f64, unit: &'static str) -> Value {
    Value {
        name,
        value,
        std: Some(std),
        unit,
    }
}

/// A shape constant.
pub(crate) fn constant(name: &'static str, value: f64, unit: &'static str) -> Value {
    Value {
        name,
        value,
        std: None,
        unit,
    }
}
