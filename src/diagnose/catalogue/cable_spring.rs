//! A cable or hose pulls on one joint: a static torque over its position.

use super::*;
use crate::report::format::significant;

/// Cable or hose spring.
pub struct CableSpring;

/// A straight line.
const LINEAR: u8 = 0;
/// Up to the third power.
const CUBIC: u8 = 1;

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

    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.singles()
    }

    fn shapes(&self, _cx: &Context, _place: &Place) -> Vec<Shape> {
        vec![Shape::new(LINEAR, &[]), Shape::new(CUBIC, &[])]
    }

    fn forms(&self) -> u8 {
        2
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let joint = e.place.first();
        let [a, b] = cx.data.range[joint];
        let (middle, half) = (0.5 * (a + b), (0.5 * (b - a)).max(1e-9));
        // Σ η_p ((q − m)/h)^p in powers of q
        let mut coefficients = [0.0; 4];
        let mut power = [1.0, 0.0, 0.0, 0.0];
        for eta in &e.eta {
            let sum = coefficients.iter_mut().zip(power);
            sum.for_each(|(c, p)| *c += eta * p);
            let lower = [0.0, power[0], power[1], power[2]];
            power = std::array::from_fn(|k| (lower[k] - middle * power[k]) / half);
        }
        Some(Element::Spring {
            joint,
            coefficients,
        })
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let j = place.first();
        let [a, b] = cx.data.range[j];
        let (middle, half) = (0.5 * (a + b), (0.5 * (b - a)).max(1e-9));
        let order = if shape.form == LINEAR { 1 } else { 3 };
        (0..=order)
            .map(|p| Column::on(j, cx.data.own(j, |q, _| ((q - middle) / half).powi(p))))
            .collect()
    }

    fn plausible(&self, _cx: &Context, _place: &Place, shape: &Shape, eta: &[f64]) -> bool {
        // a spring: the pull changes over the range, it is no mere offset
        let varies = eta[1..].iter().fold(0.0f64, |m, v| m.max(v.abs()));
        varies > 0.15 * eta[0].abs() || shape.form == CUBIC
    }

    fn impossible(
        &self,
        cx: &Context,
        place: &Place,
        shape: &Shape,
        eta: &[f64],
    ) -> Option<String> {
        let j = place.first();
        let [a, b] = cx.data.range[j];
        // from one end of the range to the other
        let odd = if shape.form == LINEAR { 0.0 } else { eta[3] };
        let stiffness = 2.0 * (eta[1] + odd) / (b - a).max(1e-9);
        (stiffness < 0.0).then(|| {
            format!(
                "its stiffness over the range would be negative ({} {}): a cable pulls back",
                significant(stiffness, 3),
                cx.unit(j, Quantity::Stiffness)
            )
        })
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place,
            shape,
            eta,
            std,
        } = e;
        let j = place.first();
        let [a, b] = cx.data.range[j];
        let half = (0.5 * (b - a)).max(1e-9);
        let unit = cx.unit(j, Quantity::Stiffness);
        let mut all = vec![
            // what the motor holds against the spring grows by this much
            value("stiffness", eta[1] / half, std[1] / half, unit),
            value("torque_at_middle", eta[0], std[0], cx.torque_unit(j)),
        ];
        all.push(constant(
            "middle",
            0.5 * (a + b),
            cx.unit(j, Quantity::Position),
        ));
        if shape.form == CUBIC {
            all.push(value("quadratic_part", eta[2], std[2], cx.torque_unit(j)));
            all.push(value("cubic_part", eta[3], std[3], cx.torque_unit(j)));
        }
        all
    }
}
