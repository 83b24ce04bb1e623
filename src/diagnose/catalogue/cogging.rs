//! Torque that repeats with the turn of the motor.

use super::*;
use crate::diagnose::window::fine_pair;
use crate::signals::wiener::likewise;

/// Cogging (torque ripple).
pub struct Cogging;

impl Effect for Cogging {
    fn card(&self) -> Card {
        Card {
            name: "cogging",
            title: "cogging (torque ripple)",
            equation: "a sin kNq + b cos kNq",
            source: "Holtz & Springob 1996",
            aliases: &[],
            separated_by: "slow constant speed: a line in position; two speeds tell ripple from kinematic error",
        }
    }
    fn most(&self) -> f64 {
        // a motor that cogs by half of what it can would not turn smoothly at all
        0.5
    }

    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.singles()
    }

    fn shapes(&self, cx: &Context, place: &Place) -> Vec<Shape> {
        super::cogging::orders(cx, place.first())
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let j = e.place.first();
        let [sine, cosine, k] = [e.eta[0], e.eta[1], e.shape[0]].map(py);
        let torque = format!("{sine} * xp.sin({k} * q) + {cosine} * xp.cos({k} * q)");
        Some(Element::smooth(j, 1e-3 * cx.data.speed[j], torque))
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let (j, k) = (place.first(), shape[0]);
        let [mut sines, mut cosines] = [0, 1].map(|_| Vec::with_capacity(cx.data.rows()));
        for r in &cx.data.records {
            let ((q, v), a) = (r.state(j), r.acceleration(j));
            let [sine, cosine] = fine_pair([q, v, a], r.dt, |q, _, _| (k * q).sin_cos().into());
            // what no controller makes up for moves the motor: it shows where the motor's acceleration is known
            for (all, wave) in [(&mut sines, sine), (&mut cosines, cosine)] {
                all.extend(likewise(&wave, r.cycle, r.dt));
            }
        }
        vec![Column::on(j, sines), Column::on(j, cosines)]
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place,
            shape,
            eta,
            std,
        } = e;
        let unit = cx.torque_unit(place.first());
        let scale = 1.0;
        let amplitude = eta[0].hypot(eta[1]);
        let per = cx.unit(place.first(), Quantity::Order);
        vec![
            value(
                "amplitude",
                scale * amplitude,
                scale * std[0].max(std[1]),
                unit,
            ),
            value(
                "phase",
                eta[1].atan2(eta[0]),
                std[0].max(std[1]) / amplitude.max(1e-300),
                "rad",
            ),
            constant("per_position", shape[0], per),
        ]
    }
}

/// Orders `k N` of the motor turn that the records can tell apart from slower terms: whole multiples
/// where the gear ratio is known, otherwise the orders at which the residual has its highest lines.
pub(crate) fn orders(cx: &Context, j: usize) -> Vec<Shape> {
    let [a, b] = cx.data.range[j];
    let least = 4.0 * std::f64::consts::PI / (b - a).max(1e-9);
    if let Some(ratio) = cx.data.plant.actuators()[j].gear_ratio {
        return (1..=24)
            .map(|k| k as f64 * ratio.abs())
            .filter(|k| *k > least)
            .map(|k| Shape::of(&[k]))
            .collect();
    }
    // residual of the model against position, line by line
    let fitted = cx.data.fitted;
    let weights = &cx.data.counted(j)[..fitted];
    let residual: Vec<f64> = (0..fitted)
        .map(|i| weights[i] * (cx.data.tau[j][i] - cx.model[j][i]))
        .collect();
    let mut position = Vec::with_capacity(fitted);
    for r in cx.data.records.iter().filter(|r| r.fit) {
        position.extend_from_slice(r.state(j).0);
    }
    let step = std::f64::consts::PI / (2.0 * (b - a).max(1e-9));
    const LINES: usize = 400;
    let mut lines: Vec<(f64, f64)> = (0..LINES)
        .map(|i| {
            let k = least + i as f64 * step;
            let (mut s, mut c) = (0.0, 0.0);
            for (r, q) in residual.iter().zip(&position).step_by(2) {
                let (sin, cos) = (k * q).sin_cos();
                s += r * sin;
                c += r * cos;
            }
            (s * s + c * c, k)
        })
        .collect();
    lines.sort_by(|a, b| b.0.total_cmp(&a.0));
    lines.truncate(8);
    lines.into_iter().map(|(_, k)| Shape::of(&[k])).collect()
}
