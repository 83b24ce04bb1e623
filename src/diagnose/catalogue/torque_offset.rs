//! Torque offset of an actuator whose model has none, `o`.

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

    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        cx.without(JointTerm::Offset)
    }

    fn columns(&self, cx: &Context, place: &[usize], _shape: &[f64], _draft: bool) -> Vec<Column> {
        let values = vec![1.0; cx.data.rows()];
        vec![Column::on(place[0], values)]
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
        vec![value("torque_offset", eta[0], std[0], unit)]
    }
}
