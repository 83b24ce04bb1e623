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
    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        cx.singles()
    }

    fn shapes(&self, cx: &Context, place: &[usize]) -> Vec<Vec<f64>> {
        let [a, b] = cx.data.range[place[0]];
        match cx.motion(place[0]) {
            Motion::Revolute => [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0]
                .map(|k| vec![k])
                .to_vec(),
            Motion::Prismatic => ladder(1.5, 16.0, 7)
                .into_iter()
                .map(|k| vec![k / (b - a).max(1e-9)])
                .collect(),
        }
    }

    fn columns(&self, cx: &Context, place: &[usize], shape: &[f64], _draft: bool) -> Vec<Column> {
        let j = place[0];
        let width = 1e-3 * cx.data.speed[j];
        let sign = |v: f64| crate::diagnose::data::sign(v, width);
        vec![
            Column::on(j, cx.data.own(j, |q, v| (shape[0] * q).sin() * sign(v))),
            Column::on(j, cx.data.own(j, |q, v| (shape[0] * q).cos() * sign(v))),
        ]
    }

    fn values(
        &self,
        cx: &Context,
        place: &[usize],
        shape: &[f64],
        eta: &[f64],
        std: &[f64],
    ) -> Vec<Value> {
        let unit = cx.torque_unit(place[0]);
        let per = match cx.motion(place[0]) {
            Motion::Revolute => "rad/rad",
            Motion::Prismatic => "rad/m",
        };
        vec![
            value("sine", eta[0], std[0], unit),
            value("cosine", eta[1], std[1], unit),
            constant("order", shape[0], per),
        ]
    }
}
