//! The link follows the motor through a spring: `q_link = q − τ_J/K`.

use super::spring::Springs;
use super::*;

/// Joint elasticity.
pub struct JointElasticity;

impl Effect for JointElasticity {
    fn card(&self) -> Card {
        Card {
            name: "joint_elasticity",
            title: "joint elasticity",
            equation: "∂τ/∂(q, q̇, q̈) (δ, δ̇, δ̈),  M δ̈ + D δ̇ + K δ = −τ_J",
            source: "Spong 1987; Wernholt & Gunnarsson 2006",
            aliases: &[],
            separated_by: "high harmonics, a locked output, or a second encoder",
        }
    }
    fn robots(&self) -> Robots {
        Robots::Open
    }

    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.singles()
    }

    fn shapes(&self, _cx: &Context, _place: &Place) -> Vec<Shape> {
        // natural frequency of the link on its spring, damping ratio, stiffening at the peak load
        let mut all = Vec::new();
        for frequency in [5.0, 7.0, 10.0, 14.0, 20.0, 30.0, 45.0] {
            for damping in [0.02, 0.08] {
                for cubic in [0.0, 0.5] {
                    all.push(Shape::of(&[frequency, damping, cubic]));
                }
            }
        }
        all
    }

    fn refinable(&self, _shape: &Shape, k: usize) -> bool {
        k < 2
    }

    fn rings(&self, shape: &Shape) -> bool {
        shape[1] > 0.08
    }

    fn sways(&self) -> bool {
        true
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let joint = e.place.first();
        let [stiffness, damping, twist] = spring::constants(cx, joint, e.shape[0], e.shape[1]);
        // a coefficient that is not 1 is a twist that is larger: a softer spring
        Some(Element::Twist {
            joint,
            stiffness: stiffness / e.eta[0],
            cubic: stiffness * e.shape[2] / (twist * twist) / e.eta[0].powi(3),
            damping: damping / e.eta[0],
            gap: 0.0,
        })
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, draft: bool) -> Vec<Column> {
        match draft {
            true => self
                .drafts(cx, place, std::slice::from_ref(shape))
                .remove(0),
            false => spring::whole(cx, place.first(), springs(shape)),
        }
    }

    fn drafts(&self, cx: &Context, place: &Place, shapes: &[Shape]) -> Vec<Vec<Column>> {
        let springs: Vec<Springs> = shapes.iter().map(springs).collect();
        spring::drafts(cx, place.first(), &springs, false)
    }

    fn plausible(&self, _cx: &Context, _place: &Place, _shape: &Shape, eta: &[f64]) -> bool {
        eta[0] > 0.4 && eta[0] < 2.0
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place,
            shape,
            eta,
            std,
        } = e;
        let unit = cx.unit(place.first(), Quantity::Stiffness);
        // a coefficient that is not 1 is a twist that is larger: a softer spring
        let j = place.first();
        let mass = cx.mass[j][j].iter().sum::<f64>() / cx.data.rows() as f64;
        let k = mass * (2.0 * std::f64::consts::PI * shape[0]).powi(2);
        vec![
            value(
                "stiffness",
                k / eta[0],
                k * std[0] / (eta[0] * eta[0]),
                unit,
            ),
            constant("natural_frequency", shape[0], "Hz"),
            constant("damping_ratio", shape[1], ""),
            constant("cubic_share", shape[2], ""),
        ]
    }
}

/// Natural frequency of the link on its spring, damping ratio, stiffening at the largest load.
fn springs(shape: &Shape) -> Springs {
    Springs {
        gap: 0.0,
        frequency: shape[0],
        damping: shape[1],
        cubic: shape[2],
    }
}
