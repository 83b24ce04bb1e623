//! Friction that is not the same in both directions: even functions of the velocity.

use super::*;

/// Friction that differs with the direction.
pub struct FrictionAsymmetry;

impl Effect for FrictionAsymmetry {
    fn card(&self) -> Card {
        Card {
            name: "friction_asymmetry",
            title: "friction that differs with the direction",
            equation: "F_v^± q̇, F_c^±: |q̇| and 1 − e^{−|q̇|/v_t}",
            source: "Armstrong 1991; Janot, Gautier & Brunot 2019",
            aliases: &["torque_offset"],
            separated_by: "both directions through the same poses",
        }
    }
    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        cx.singles()
    }

    fn shapes(&self, cx: &Context, place: &[usize]) -> Vec<Vec<f64>> {
        let mut all = vec![vec![0.0]];
        let v = cx.data.speed[place[0]];
        all.extend(ladder(0.02 * v, 0.6 * v, 6).into_iter().map(|v| vec![v]));
        all
    }

    fn columns(&self, cx: &Context, place: &[usize], shape: &[f64], _draft: bool) -> Vec<Column> {
        let j = place[0];
        let mut all = vec![Column::on(j, cx.data.own(j, |_, v| v.abs()))];
        if shape[0] > 0.0 {
            all.push(Column::on(
                j,
                cx.data.own(j, |_, v| 1.0 - (-v.abs() / shape[0]).exp()),
            ));
        }
        all
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
        // F_v^+ − F_v^−: half of it goes with |q̇|
        let mut all = vec![value(
            "viscous_difference",
            2.0 * eta[0],
            2.0 * std[0],
            unit,
        )];
        if shape[0] > 0.0 {
            let (e, s) = (eta[1], std[1]);
            all.push(value(
                "coulomb_difference",
                2.0 * e,
                2.0 * s,
                cx.torque_unit(place[0]),
            ));
            all.push(constant(
                "turnover_velocity",
                shape[0],
                cx.speed_unit(place[0]),
            ));
        }
        all
    }
}
