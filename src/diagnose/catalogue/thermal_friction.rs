//! Friction that falls (or rises) as the joint warms up.

use super::*;

/// Thermal friction.
pub struct ThermalFriction;

impl Effect for ThermalFriction {
    fn card(&self) -> Card {
        Card {
            name: "thermal_friction",
            title: "thermal friction",
            equation: "(a sgn q̇ + b q̇) ϑ(t),  ϑ̇ = (P/P̄ − ϑ)/T",
            source: "Bittencourt & Gunnarsson 2012; Simoni et al. 2019",
            aliases: &[],
            separated_by: "the same period repeated cold and warm",
        }
    }
    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        cx.singles()
    }

    fn shapes(&self, _cx: &Context, _place: &[usize]) -> Vec<Vec<f64>> {
        [3.0, 8.0, 20.0, 60.0, 200.0].map(|t| vec![t]).to_vec()
    }

    fn columns(&self, cx: &Context, place: &[usize], shape: &[f64], _draft: bool) -> Vec<Column> {
        let j = place[0];
        // warmth from the power of friction, cold at the start of every record
        let warmth = cx.data.each(|r, _| {
            let (_, v) = r.state(j);
            let mut warm = 0.0;
            v.iter()
                .map(|v| {
                    warm += r.dt / shape[0] * (v.abs() / cx.data.speed[j] - warm);
                    warm
                })
                .collect()
        });
        let times = |x: Vec<f64>| x.iter().zip(&warmth).map(|(x, w)| x * w).collect();
        vec![
            Column::on(j, times(cx.sign(j))),
            Column::on(j, times(cx.data.each(|r, _| r.state(j).1.to_vec()))),
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
        let unit = match cx.motion(place[0]) {
            Motion::Revolute => "N m s/rad",
            Motion::Prismatic => "N s/m",
        };
        vec![
            value("coulomb_change", eta[0], std[0], cx.torque_unit(place[0])),
            value("viscous_change", eta[1], std[1], unit),
            constant("time_constant", shape[0], "s"),
        ]
    }
}
