//! A cable or hose pulls on one joint: a static torque over its position.

use super::bristles::{Bristles, DAHL};
use super::*;
use crate::export::element::cubic;
use crate::report::format::significant;

/// Cable or hose spring.
pub struct CableSpring;

/// A straight line.
const LINEAR: u8 = 0;
/// Up to the third power.
const CUBIC: u8 = 1;
/// The same of a hose that rubs, with friction that builds up over a displacement.
const RUBS: u8 = 2;
/// These displacements, over the range of the motion.
const REACH: [f64; 2] = [0.01, 0.15];
/// Its friction over the pull of the spring at the end of the range: less is a spring alone, more is friction.
const RUB: [f64; 2] = [0.05, 1.0];

impl Effect for CableSpring {
    fn card(&self) -> Card {
        Card {
            name: "cable_spring",
            title: "cable or hose spring",
            equation: "f(q): k (q − q₀), and of higher order; where it rubs, F z beside it, ż = q̇/s (1 − z sgn q̇)",
            source: "Siciliano & Khatib 2016, ch. 9; Dahl 1968",
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

    fn shapes(&self, cx: &Context, place: &Place) -> Vec<Shape> {
        let [a, b] = cx.data.range[place.first()];
        let reaches = ladder(REACH[0] * (b - a), REACH[1] * (b - a), 4);
        let rubs = reaches.into_iter().map(|s| Shape::new(RUBS, &[s]));
        let smooth = [LINEAR, CUBIC].map(|form| Shape::new(form, &[]));
        smooth.into_iter().chain(rubs).collect()
    }

    fn forms(&self) -> u8 {
        3
    }

    fn refinable(&self, _shape: &Shape, _k: usize) -> bool {
        true
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let joint = e.place.first();
        let [a, b] = cx.data.range[joint];
        let (middle, half) = (0.5 * (a + b), (0.5 * (b - a)).max(1e-9));
        // Σ η_p ((q − m)/h)^p in powers of q
        let mut coefficients = [0.0; 4];
        let mut power = [1.0, 0.0, 0.0, 0.0];
        for eta in e.eta.iter().take(4) {
            let sum = coefficients.iter_mut().zip(power);
            sum.for_each(|(c, p)| *c += eta * p);
            let lower = [0.0, power[0], power[1], power[2]];
            power = std::array::from_fn(|k| (lower[k] - middle * power[k]) / half);
        }
        if e.shape.form != RUBS {
            return Some(Element::Spring {
                joint,
                coefficients,
            });
        }
        let pull = cubic(coefficients);
        let rubs = py(e.eta[4]);
        let (start, mut lines) = Bristles::lines(DAHL, e.shape[0]);
        lines.push(format!("return 0.0 * q, {pull} + {rubs} * z, memory"));
        let width = 1e-3 * cx.data.speed[joint];
        Some(Element::memory(joint, width, &start, 0.0, lines))
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        with_friction(cx, place.first(), shape, pull(cx, place.first(), shape))
    }

    fn drafts(&self, cx: &Context, place: &Place, shapes: &[Shape]) -> Vec<Vec<Column>> {
        let j = place.first();
        // the pull is the same however far its friction reaches
        let mut last = Last::none();
        let of = |shape: &Shape| {
            let smooth = last.of(order(shape), || pull(cx, j, shape));
            with_friction(cx, j, shape, smooth.clone())
        };
        shapes.iter().map(of).collect()
    }

    fn plausible(&self, _cx: &Context, _place: &Place, shape: &Shape, eta: &[f64]) -> bool {
        // a spring: the pull changes over the range, it is no mere offset
        let varies = eta[1..].iter().fold(0.0f64, |m, v| m.max(v.abs()));
        match shape.form {
            LINEAR => varies > 0.15 * eta[0].abs(),
            CUBIC => true,
            _ => {
                let pull = eta[1] + eta[3];
                pull > 0.0 && (RUB[0] * pull..RUB[1] * pull).contains(&eta[4])
            }
        }
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
        if shape.form != LINEAR {
            all.push(value("quadratic_part", eta[2], std[2], cx.torque_unit(j)));
            all.push(value("cubic_part", eta[3], std[3], cx.torque_unit(j)));
        }
        if shape.form == RUBS {
            all.push(value("level", eta[4], std[4], cx.torque_unit(j)));
            let way = cx.unit(j, Quantity::Position);
            all.push(constant("presliding", shape[0], way));
        }
        all
    }
}

/// Highest power of the pull.
fn order(shape: &Shape) -> u8 {
    if shape.form == LINEAR { 1 } else { 3 }
}

/// Powers of the position, from −1 to 1 over the range.
fn pull(cx: &Context, j: usize, shape: &Shape) -> Vec<Column> {
    let [a, b] = cx.data.range[j];
    let (middle, half) = (0.5 * (a + b), (0.5 * (b - a)).max(1e-9));
    let power = |p: u8| cx.data.own(j, |q, _| ((q - middle) / half).powi(p.into()));
    (0..=order(shape))
        .map(|p| Column::on(j, power(p)))
        .collect()
}

/// The pull and, where it rubs, its friction.
fn with_friction(cx: &Context, j: usize, shape: &Shape, mut pull: Vec<Column>) -> Vec<Column> {
    if shape.form == RUBS {
        let rubs = Bristles::column(cx, j, DAHL, shape[0], |z, _| z);
        pull.push(Column::on(j, rubs));
    }
    pull
}
