//! Coulomb friction of an actuator whose model has none, `F_c sgn q̇`.

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

    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        cx.without(JointTerm::Coulomb)
    }

    fn columns(&self, cx: &Context, place: &[usize], _shape: &[f64], _draft: bool) -> Vec<Column> {
        let values = cx.sign(place[0]);
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
        let unit = cx.torque_unit(place[0]);
        vec![value("coulomb_friction", eta[0], std[0], unit)]
    }
}
