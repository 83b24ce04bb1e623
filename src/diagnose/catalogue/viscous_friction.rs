//! Viscous friction of an actuator whose model has none, `F_v q̇`.

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

    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        cx.without(JointTerm::Viscous)
    }

    fn columns(&self, cx: &Context, place: &[usize], _shape: &[f64], _draft: bool) -> Vec<Column> {
        let values = cx.data.each(|r, _| smooth(r.state(place[0]).1));
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
            Motion::Revolute => "N m s/rad",
            Motion::Prismatic => "N s/m",
        };
        vec![value("viscous_friction", eta[0], std[0], unit)]
    }
}
