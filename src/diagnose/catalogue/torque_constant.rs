//! The measured torque of a drive is off by a factor.

use super::*;

/// Torque constant (drive gain).
pub struct TorqueConstant;

impl Effect for TorqueConstant {
    fn card(&self) -> Card {
        Card {
            name: "torque_constant",
            title: "torque constant (drive gain)",
            equation: "ε τ_j",
            source: "Gautier & Briot 2014",
            aliases: &[],
            separated_by: "one payload of known mass",
        }
    }
    fn hides(&self) -> bool {
        true
    }

    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        cx.singles()
    }

    fn columns(&self, cx: &Context, place: &[usize], _shape: &[f64], _draft: bool) -> Vec<Column> {
        vec![Column::on(place[0], cx.model[place[0]].clone())]
    }

    fn plausible(&self, _cx: &Context, _place: &[usize], _shape: &[f64], eta: &[f64]) -> bool {
        eta[0].abs() < 0.6
    }

    fn values(
        &self,
        _cx: &Context,
        _place: &[usize],
        _shape: &[f64],
        eta: &[f64],
        std: &[f64],
    ) -> Vec<Value> {
        vec![value("gain_error", eta[0], std[0], "")]
    }
}
