//! Torque offset of an actuator beyond what its file states, `o`.

use super::*;

/// Torque offset.
pub struct TorqueOffset;

impl Effect for TorqueOffset {
    fn card(&self) -> Card {
        Card {
            name: "torque_offset",
            title: "torque offset",
            equation: "o",
            source: "Swevers, Verdonck & De Schutter 2007",
            aliases: &["friction_asymmetry"],
            separated_by: "holding torque in several poses",
        }
    }
    fn hides(&self) -> bool {
        true
    }

    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.changed(JointTerm::Offset)
    }

    fn familiarity(&self) -> f64 {
        2.0
    }

    fn apply(&self, cx: &Context, e: &Estimate, robot: &mut Robot) -> Option<Part> {
        Some(joint_term(cx, e, robot, JointTerm::Offset))
    }

    fn columns(&self, cx: &Context, place: &Place, _shape: &Shape, _draft: bool) -> Vec<Column> {
        let values = vec![1.0; cx.data.rows()];
        vec![Column::on(place.first(), values)]
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let unit = cx.torque_unit(e.place.first());
        cx.term_values(["torque_offset", "nominal"], JointTerm::Offset, e, unit)
    }
}
