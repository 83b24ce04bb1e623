//! Coulomb friction of an actuator beyond what its file states, `F_c sgn q̇`.

use super::*;

/// Coulomb friction.
pub struct CoulombFriction;

impl Effect for CoulombFriction {
    fn card(&self) -> Card {
        Card {
            name: "coulomb_friction",
            title: "Coulomb friction",
            equation: "F_c sgn q̇",
            source: "Swevers, Verdonck & De Schutter 2007",
            aliases: &[],
            separated_by: "reversals at several speeds",
        }
    }
    fn hides(&self) -> bool {
        true
    }

    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.changed(JointTerm::Coulomb)
    }

    fn familiarity(&self) -> f64 {
        3.0
    }

    fn apply(&self, cx: &Context, e: &Estimate, robot: &mut Robot) -> Option<Part> {
        Some(joint_term(cx, e, robot, JointTerm::Coulomb))
    }

    fn columns(&self, cx: &Context, place: &Place, _shape: &Shape, _draft: bool) -> Vec<Column> {
        let values = cx.dry_sign(place.first());
        vec![Column::on(place.first(), values)]
    }

    fn plausible(&self, cx: &Context, place: &Place, _shape: &Shape, eta: &[f64]) -> bool {
        cx.whole(place, JointTerm::Coulomb, eta) > 0.0
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let unit = cx.torque_unit(e.place.first());
        cx.term_values(["coulomb_friction", "nominal"], JointTerm::Coulomb, e, unit)
    }
}
