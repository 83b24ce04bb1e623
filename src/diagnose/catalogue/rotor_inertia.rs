//! Rotor inertia of an actuator beyond what its file states, `I_a q̈`.

use super::*;

/// Rotor inertia.
pub struct RotorInertia;

impl Effect for RotorInertia {
    fn card(&self) -> Card {
        Card {
            name: "rotor_inertia",
            title: "rotor inertia",
            equation: "I_a q̈",
            source: "Khalil & Dombre 2002",
            aliases: &["link_inertia"],
            separated_by: "other poses of the arm: the inertia of links varies, that of the rotor does not",
        }
    }
    fn hides(&self) -> bool {
        true
    }

    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.changed(JointTerm::Armature)
    }

    fn familiarity(&self) -> f64 {
        3.0
    }

    fn apply(&self, cx: &Context, e: &Estimate, robot: &mut Robot) -> Option<Part> {
        Some(joint_term(cx, e, robot, JointTerm::Armature))
    }

    fn columns(&self, cx: &Context, place: &Place, _shape: &Shape, _draft: bool) -> Vec<Column> {
        let values = cx.data.each(|r, _| smooth(r.acceleration(place.first())));
        vec![Column::on(place.first(), values)]
    }

    fn plausible(&self, cx: &Context, place: &Place, _shape: &Shape, eta: &[f64]) -> bool {
        cx.whole(place, JointTerm::Armature, eta) > 0.0
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let unit = cx.unit(e.place.first(), Quantity::Inertia);
        cx.term_values(["rotor_inertia", "nominal"], JointTerm::Armature, e, unit)
    }
}
