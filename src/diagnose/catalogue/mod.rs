//! The effects that may separate a model from its robot, one file each.
//!
//! An [`Effect`] says where it can sit ([`Effect::places`]), which shape constants it has that do not
//! enter linearly ([`Effect::shapes`]), and gives the columns that it adds to the torque
//! ([`Effect::columns`]). All effects of a place and shape are linear in their coefficients. It also says
//! what its coefficients mean ([`Effect::values`]), how a model holds it ([`Effect::apply`]), what
//! it is in a simulator otherwise ([`Effect::element`]) and how common it is ([`Effect::familiarity`]). A new effect is one
//! file and one line in [`all`].

mod backlash;
mod base_compliance;
mod bristles;
mod cable_spring;
mod cogging;
mod context;
mod coulomb_friction;
mod counterbalance;
mod encoder_eccentricity;
mod estimate;
mod friction_asymmetry;
mod gravity_direction;
mod joint_coupling;
mod joint_elasticity;
mod joint_offset;
mod leg_geometry;
mod leg_inertia;
mod link_inertia;
mod load_dependent_friction;
mod nonlinear_viscous_friction;
mod passive_joint_friction;
mod payload;
mod position_dependent_friction;
mod presliding_hysteresis;
mod rotor_inertia;
mod spring;
mod stribeck_friction;
mod thermal_friction;
mod torque_constant;
mod torque_delay;
mod torque_offset;
mod torque_saturation;
mod transmission_error;
mod viscous_friction;

pub use context::Context;
pub use estimate::{Estimate, Place, Quantity, Shape, Value};
pub(super) use payload::away;

use super::chain;
use super::column::Column;
use super::thresholds::THRESHOLDS as T;
use crate::dynamics::Samples;
use crate::export::element::{Element, Kind, py};
use crate::export::{Form, Part, simulator};
use crate::plant;
use crate::robot::{Inertia, JointTerm, Motion, Robot};
use crate::signals::series::Series;
use context::{Last, closed_column, ladder, peak, projected, prune, smooth};
use estimate::{constant, value};

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

/// The robots that an effect is told of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Robots {
    /// every one
    All,
    /// serial and tree robots: what moves a link shows in the torques of the joints before it
    Open,
    /// parallel robots: what only legs and passive joints have
    Closed,
}

impl Robots {
    /// Whether a robot is one of them.
    fn hold(self, plant: &plant::Plant) -> bool {
        match self {
            Robots::All => true,
            one => chain::closed(plant) == (one == Robots::Closed),
        }
    }
}

/// An effect of the catalogue.
pub trait Effect: Sync {
    /// What is known about it.
    fn card(&self) -> Card;
    /// Which robots it is told of.
    fn robots(&self) -> Robots {
        Robots::All
    }
    /// Where it can sit on a robot of [`Effect::robots`].
    fn places(&self, cx: &Context) -> Vec<Place>;
    /// Where it can sit on this robot.
    fn sites(&self, cx: &Context) -> Vec<Place> {
        match self.robots().hold(cx.data.plant) {
            true => self.places(cx),
            false => Vec::new(),
        }
    }
    /// Shapes to try.
    fn shapes(&self, _cx: &Context, _place: &Place) -> Vec<Shape> {
        vec![Shape::default()]
    }
    /// How many forms its shapes have.
    fn forms(&self) -> u8 {
        1
    }
    /// Numbers that are fitted with a shape: its constants, and which form where there are several.
    fn freedoms(&self, shape: &Shape) -> usize {
        shape.constants.len() + usize::from(self.forms() > 1)
    }
    /// How common it is in practice, as a preference in hundredths of the gain: above zero for what every
    /// textbook model has, below for wide families that imitate others.
    fn familiarity(&self) -> f64 {
        0.0
    }
    /// Whether shape constant `k` is a positive number that may be refined between grid points.
    fn refinable(&self, _shape: &Shape, _k: usize) -> bool {
        false
    }
    /// Whether one of the whole robot is the same on every actuator, where each could have its own.
    fn is_alike(&self) -> bool {
        false
    }
    /// Whether a refit of ordinary parameters may absorb it without a trace, so that values which are
    /// unlikely under their prior are its only sign.
    fn hides(&self) -> bool {
        false
    }
    /// Whether the fall of the prior's penalty counts as its size where it explains nearly all of a small gap: a refit takes most of it
    /// into parameters of all links, and leaves little.
    fn moves_parameters(&self, _shape: &Shape) -> bool {
        false
    }
    /// Of a body, how many of its coefficients are mass and first moments, before those of its tensor; of others 0.
    fn moments(&self) -> usize {
        0
    }
    /// Information a priori on every coefficient, where these are in units of their deviations: 1; 0 where nothing is
    /// known of them.
    fn prior(&self) -> f64 {
        0.0
    }
    /// Whether it moves links against what the encoders read, by a way that the inertia of the model decides.
    fn sways(&self) -> bool {
        false
    }
    /// Whether dry friction that reverses early passes for it.
    fn late(&self) -> bool {
        false
    }
    /// Time by which it has the torque ahead of the positions, s.
    fn ahead(&self, _shape: &Shape, _eta: &[f64]) -> Option<f64> {
        None
    }
    /// Whether it may be believed where it explains a part of the gap on its joints only, and nothing else comes near that part.
    fn of_a_part(&self, _shape: &Shape) -> bool {
        true
    }
    /// Whether its columns are made from the torque that it explains: whatever else raises that explains itself in part.
    fn explains_itself(&self, _shape: &Shape) -> bool {
        false
    }
    /// Whether it is dry friction, which turns at the reversals of its joint: what the formula of a large one misses there looks like
    /// another one.
    fn at_reversals(&self, _shape: &Shape) -> bool {
        false
    }
    /// Whether it rings with damping, as the loop of the robot's controller does.
    fn rings(&self, _shape: &Shape) -> bool {
        false
    }
    /// Whether it depends on what went on before a record began, so that coefficients of one record
    /// need not fit another.
    fn remembers(&self) -> bool {
        false
    }
    /// Columns, per unit of the coefficients. A `draft` may leave out rows of lesser weight.
    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, draft: bool) -> Vec<Column>;
    /// Draft columns of several shapes, which may have work in common.
    fn drafts(&self, cx: &Context, place: &Place, shapes: &[Shape]) -> Vec<Vec<Column>> {
        let columns = |s| self.columns(cx, place, s, true);
        shapes.iter().map(columns).collect()
    }
    /// Whether coefficients make physical sense.
    fn plausible(&self, _cx: &Context, _place: &Place, _shape: &Shape, _eta: &[f64]) -> bool {
        true
    }
    /// What it adds to the friction of its joint at a steady speed, N m or N; `None` of what is no friction that depends on the
    /// speed alone.
    fn friction(
        &self,
        _cx: &Context,
        _place: &Place,
        _shape: &Shape,
        _eta: &[f64],
        _speed: f64,
    ) -> Option<f64> {
        None
    }
    /// Why no machine has these coefficients, where none has: not tried as long as another shape is left, and
    /// never found.
    fn impossible(
        &self,
        _cx: &Context,
        _place: &Place,
        _shape: &Shape,
        _eta: &[f64],
    ) -> Option<String> {
        None
    }
    /// The largest torque that it can make on its joint, over what its drive can.
    fn most(&self) -> f64 {
        1.0
    }
    /// Coefficients and shape as physical parameters.
    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value>;
    /// Adds it to the bodies and joints of `robot`, those of the nominal model or others like them: which
    /// part of a model now holds it, `None` where no part can.
    fn apply(&self, _cx: &Context, _e: &Estimate, _robot: &mut Robot) -> Option<Part> {
        None
    }
    /// What it is in a simulator, beside parts of a model.
    fn element(&self, _cx: &Context, _e: &Estimate) -> Option<Element> {
        None
    }
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
        Box::new(leg_geometry::LegGeometry),
    ]
}

/// The one of this name.
pub fn named<'e>(effects: &'e [Box<dyn Effect>], name: &str) -> Option<&'e dyn Effect> {
    let found = effects.iter().find(|e| e.card().name == name);
    found.map(|e| e.as_ref())
}

/// How the files for MuJoCo hold an effect.
pub(crate) fn in_mujoco(cx: &Context, effect: &dyn Effect, e: &Estimate) -> Form {
    let plant = cx.data.plant;
    let held = effect.apply(cx, e, &mut plant.robot().clone());
    simulator::in_mujoco(plant, held, element(cx, effect, e).as_ref())
}

/// What an effect is in a simulator: on a closed chain, whose drives may be tendons, functions only.
pub(crate) fn element(cx: &Context, effect: &dyn Effect, e: &Estimate) -> Option<Element> {
    let found = effect.element(cx, e)?;
    match Robots::Closed.hold(cx.data.plant) {
        true => {
            let width = T.reversals.sharp * cx.data.speed[e.place.first()];
            Some(found.into_function(width))
        }
        false => Some(found),
    }
}

/// Adds an effect of one coefficient to a term of its joint.
fn joint_term(cx: &Context, e: &Estimate, robot: &mut Robot, term: JointTerm) -> Part {
    let joint = &mut robot.joints[cx.data.plant.actuated()[e.place.first()]];
    joint.terms[term as usize] += e.eta[0];
    joint.identify[term as usize] = true;
    Part::Term(term)
}

#[cfg(test)]
mod tests;
