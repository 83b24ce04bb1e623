//! Rotor inertia of an actuator whose model has none, `I_a q̈`.

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

    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        cx.without(JointTerm::Armature)
    }

    fn columns(&self, cx: &Context, place: &[usize], _shape: &[f64], _draft: bool) -> Vec<Column> {
        let values = cx.data.each(|r, _| smooth(r.acceleration(place[0])));
        vec![Column::on(place[0], values)]
    }

    fn plausible(&self, _cx: &Context, _place: &[usize], _shape: &[f64], eta: &[f64]) -> bool {
        eta[0] > 0.0
    }

    fn values(
        &self,
        cx: &Context,
        place: &[usize],
        _shape: &[f64],
        eta: &[f64],
        std: &[f64],
    ) -> Vec<Value> {
        let unit = match cx.motion(place[0]) {
            Motion::Revolute => "kg m^2",
            Motion::Prismatic => "kg",
        };
        vec![value("rotor_inertia", eta[0], std[0], unit)]
    }
}
