//! Friction that grows with another power of the speed.

use super::*;

/// Nonlinear viscous friction.
pub struct NonlinearViscousFriction;

impl Effect for NonlinearViscousFriction {
    fn card(&self) -> Card {
        Card {
            name: "nonlinear_viscous_friction",
            title: "nonlinear viscous friction",
            equation: "F_α |q̇|^α sgn q̇",
            source: "Bittencourt & Gunnarsson 2012; Simoni et al. 2017",
            aliases: &[],
            separated_by: "constant speeds over the whole range",
        }
    }
    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        cx.singles()
    }

    fn shapes(&self, _cx: &Context, _place: &[usize]) -> Vec<Vec<f64>> {
        [0.35, 0.5, 0.7, 1.35, 1.7, 2.0, 2.5, 3.0]
            .map(|a| vec![a])
            .to_vec()
    }

    fn columns(&self, cx: &Context, place: &[usize], shape: &[f64], _draft: bool) -> Vec<Column> {
        let j = place[0];
        let top = cx.data.speed[j];
        let power = |v: f64| v.signum() * (v.abs() / top).powf(shape[0]);
        vec![Column::on(j, cx.data.own(j, |_, v| power(v)))]
    }

    fn values(
        &self,
        cx: &Context,
        place: &[usize],
        shape: &[f64],
        eta: &[f64],
        std: &[f64],
    ) -> Vec<Value> {
        vec![
            value(
                "torque_at_reference_speed",
                eta[0],
                std[0],
                cx.torque_unit(place[0]),
            ),
            constant(
                "reference_speed",
                cx.data.speed[place[0]],
                cx.speed_unit(place[0]),
            ),
            constant("exponent", shape[0], ""),
        ]
    }
}
