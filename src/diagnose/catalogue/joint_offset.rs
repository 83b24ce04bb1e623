//! The zero of an encoder is off.

use super::*;

/// Joint offset.
pub struct JointOffset;

impl Effect for JointOffset {
    fn card(&self) -> Card {
        Card {
            name: "joint_offset",
            title: "joint offset",
            equation: "∂τ/∂q_j δ",
            source: "Hollerbach & Wampler 1996",
            aliases: &[],
            separated_by: "a calibration; poses that differ in gravity",
        }
    }
    fn hides(&self) -> bool {
        true
    }

    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        if cx.serial() {
            cx.singles()
        } else {
            Vec::new()
        }
    }

    fn columns(&self, cx: &Context, place: &[usize], _shape: &[f64], _draft: bool) -> Vec<Column> {
        vec![cx.displaced(place[0], |r, _| {
            [vec![1.0; r.count], vec![0.0; r.count], vec![0.0; r.count]]
        })]
    }

    fn plausible(&self, _cx: &Context, _place: &[usize], _shape: &[f64], eta: &[f64]) -> bool {
        eta[0].abs() < 0.3
    }

    fn values(
        &self,
        cx: &Context,
        place: &[usize],
        _shape: &[f64],
        eta: &[f64],
        std: &[f64],
    ) -> Vec<Value> {
        vec![value("offset", eta[0], std[0], cx.position_unit(place[0]))]
    }
}
