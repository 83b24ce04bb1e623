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

    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.singles()
    }

    fn element(&self, _cx: &Context, e: &Estimate) -> Option<Element> {
        Some(Element::Gain {
            joint: e.place.first(),
            error: e.eta[0],
        })
    }

    fn columns(&self, cx: &Context, place: &Place, _shape: &Shape, _draft: bool) -> Vec<Column> {
        vec![Column::on(place.first(), cx.model[place.first()].clone())]
    }

    fn plausible(&self, _cx: &Context, _place: &Place, _shape: &Shape, eta: &[f64]) -> bool {
        eta[0].abs() < 0.6
    }

    fn values(&self, _cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate { eta, std, .. } = e;
        vec![value("gain_error", eta[0], std[0], "")]
    }
}
