//! Friction that varies over a turn.

use super::*;

/// Position-dependent friction.
pub struct PositionDependentFriction;

impl Effect for PositionDependentFriction {
    fn card(&self) -> Card {
        Card {
            name: "position_dependent_friction",
            title: "position-dependent friction",
            equation: "(a sin kq + b cos kq) sgn q̇",
            source: "Bittencourt & Gunnarsson 2012",
            aliases: &[],
            separated_by: "a slow full turn in both directions",
        }
    }
    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.singles()
    }

    fn shapes(&self, cx: &Context, place: &Place) -> Vec<Shape> {
        let [a, b] = cx.data.range[place.first()];
        match cx.motion(place.first()) {
            Motion::Revolute => [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0]
                .map(|k| Shape::of(&[k]))
                .to_vec(),
            Motion::Prismatic => ladder(1.5, 16.0, 7)
                .into_iter()
                .map(|k| Shape::of(&[k / (b - a).max(1e-9)]))
                .collect(),
        }
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let j = e.place.first();
        let [sine, cosine, k] = [e.eta[0], e.eta[1], e.shape[0]].map(py);
        let level = format!("{sine} * xp.sin({k} * q) + {cosine} * xp.cos({k} * q)");
        Some(Element::dry(j, 1e-3 * cx.data.speed[j], level))
    }

    fn at_reversals(&self, _shape: &Shape) -> bool {
        true
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let j = place.first();
        let width = 1e-3 * cx.data.speed[j];
        let sign = |v: f64| crate::diagnose::window::sign(v, width);
        vec![
            Column::on(j, cx.data.added(j, |q, v| (shape[0] * q).sin() * sign(v))),
            Column::on(j, cx.data.added(j, |q, v| (shape[0] * q).cos() * sign(v))),
        ]
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place,
            shape,
            eta,
            std,
        } = e;
        let unit = cx.torque_unit(place.first());
        let per = cx.unit(place.first(), Quantity::Order);
        vec![
            value("sine", eta[0], std[0], unit),
            value("cosine", eta[1], std[1], unit),
            constant("order", shape[0], per),
        ]
    }
}
