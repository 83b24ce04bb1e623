//! A cable or hose pulls on one joint: a static torque over its position.

use super::*;

/// Cable or hose spring.
pub struct CableSpring;

impl Effect for CableSpring {
    fn card(&self) -> Card {
        Card {
            name: "cable_spring",
            title: "cable or hose spring",
            equation: "f(q): k (q − q₀), and of higher order",
            source: "Siciliano & Khatib 2016, ch. 9",
            aliases: &["counterbalance"],
            separated_by: "slow full range with and without the dress pack",
        }
    }
    fn hides(&self) -> bool {
        true
    }

    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        cx.singles()
    }

    fn shapes(&self, _cx: &Context, _place: &[usize]) -> Vec<Vec<f64>> {
        vec![vec![1.0], vec![3.0]]
    }

    fn columns(&self, cx: &Context, place: &[usize], shape: &[f64], _draft: bool) -> Vec<Column> {
        let j = place[0];
        let [a, b] = cx.data.range[j];
        let (middle, half) = (0.5 * (a + b), (0.5 * (b - a)).max(1e-9));
        (0..=shape[0] as i32)
            .map(|p| Column::on(j, cx.data.own(j, |q, _| ((q - middle) / half).powi(p))))
            .collect()
    }

    fn plausible(&self, _cx: &Context, _place: &[usize], shape: &[f64], eta: &[f64]) -> bool {
        // a spring: the pull changes over the range, it is no mere offset
        let varies = eta[1..].iter().fold(0.0f64, |m, v| m.max(v.abs()));
        varies > 0.15 * eta[0].abs() || shape[0] > 1.0
    }

    fn values(
        &self,
        cx: &Context,
        place: &[usize],
        shape: &[f64],
        eta: &[f64],
        std: &[f64],
    ) -> Vec<Value> {
        let j = place[0];
        let [a, b] = cx.data.range[j];
        let half = (0.5 * (b - a)).max(1e-9);
        let unit = match cx.motion(j) {
            Motion::Revolute => "N m/rad",
            Motion::Prismatic => "N/m",
        };
        let mut all = vec![
            value("stiffness", -eta[1] / half, std[1] / half, unit),
            value("torque_at_middle", eta[0], std[0], cx.torque_unit(j)),
        ];
        if shape[0] > 1.0 {
            all.push(value("quadratic_part", eta[2], std[2], cx.torque_unit(j)));
            all.push(value("cubic_part", eta[3], std[3], cx.torque_unit(j)));
        }
        all
    }
}
