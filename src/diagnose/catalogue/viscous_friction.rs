//! Viscous friction of an actuator beyond what its file states, `F_v q̇`.

use super::*;

/// Viscous friction.
pub struct ViscousFriction;

impl Effect for ViscousFriction {
    fn card(&self) -> Card {
        Card {
            name: "viscous_friction",
            title: "viscous friction",
            equation: "F_v q̇",
            source: "Swevers, Verdonck & De Schutter 2007",
            aliases: &[],
            separated_by: "at least three speeds",
        }
    }
    fn hides(&self) -> bool {
        true
    }

    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.changed(JointTerm::Viscous)
    }

    fn familiarity(&self) -> f64 {
        3.0
    }

    fn apply(&self, cx: &Context, e: &Estimate, robot: &mut Robot) -> Option<Part> {
        Some(joint_term(cx, e, robot, JointTerm::Viscous))
    }

    fn columns(&self, cx: &Context, place: &Place, _shape: &Shape, _draft: bool) -> Vec<Column> {
        let values = cx.data.each(|r, _| smooth(r.state(place.first()).1));
        vec![Column::on(place.first(), values)]
    }

    fn plausible(&self, cx: &Context, place: &Place, _shape: &Shape, eta: &[f64]) -> bool {
        cx.whole(place, JointTerm::Viscous, eta) > 0.0
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let unit = cx.unit(e.place.first(), Quantity::Damping);
        cx.term_values(["viscous_friction", "nominal"], JointTerm::Viscous, e, unit)
    }
}
