//! The zero of an encoder is off.

use super::*;
use nalgebra::{Rotation3, Unit};

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

    fn robots(&self) -> Robots {
        Robots::Open
    }

    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.singles()
    }

    fn apply(&self, cx: &Context, e: &Estimate, robot: &mut Robot) -> Option<Part> {
        let joint = cx.data.plant.actuated()[e.place.first()];
        for body in robot.bodies.iter_mut().filter(|b| b.coordinate == joint) {
            let by = body.ratio * e.eta[0];
            match body.motion {
                Motion::Revolute => {
                    let axis = Unit::new_normalize(body.axis);
                    body.rotation *= Rotation3::from_axis_angle(&axis, by).matrix();
                }
                Motion::Prismatic => body.position += body.rotation * body.axis * by,
            }
        }
        Some(Part::Frames)
    }

    fn columns(&self, cx: &Context, place: &Place, _shape: &Shape, _draft: bool) -> Vec<Column> {
        vec![cx.displaced(place.first(), |r, _| {
            [vec![1.0; r.count], vec![0.0; r.count], vec![0.0; r.count]]
        })]
    }

    fn plausible(&self, _cx: &Context, _place: &Place, _shape: &Shape, eta: &[f64]) -> bool {
        eta[0].abs() < 0.3
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place, eta, std, ..
        } = e;
        vec![value(
            "offset",
            eta[0],
            std[0],
            cx.unit(place.first(), Quantity::Position),
        )]
    }
}
