//! Friction that falls (or rises) as the joint warms up.

use super::*;

/// Most that one term may change against the other, over the change of that.
const AGAINST: f64 = 0.3;

/// Thermal friction.
pub struct ThermalFriction;

/// Shares of the warmth that are left when the next record begins.
const KEPT: [f64; 4] = [1.0, 0.65, 0.35, 0.0];

impl Effect for ThermalFriction {
    fn card(&self) -> Card {
        Card {
            name: "thermal_friction",
            title: "thermal friction",
            equation: "(a sgn q̇ + b q̇) f(ϑ),  ϑ̇ = (P/P₀ − ϑ)/T,  f = ϑ or (1 − e^{−cϑ})/c",
            source: "Bittencourt & Gunnarsson 2012; Simoni et al. 2019",
            aliases: &[],
            separated_by: "the same period repeated cold and warm",
        }
    }
    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.singles()
    }

    fn shapes(&self, _cx: &Context, _place: &Place) -> Vec<Shape> {
        // time constant, how far it saturates, what a pause leaves
        let mut all = Vec::new();
        for time in [5.0, 15.0, 40.0, 100.0, 300.0] {
            for bend in [0.0, 3.0, 8.0] {
                all.extend(KEPT.map(|kept| Shape::of(&[time, bend, kept])));
            }
        }
        all
    }

    fn refinable(&self, _shape: &Shape, k: usize) -> bool {
        k < 2
    }

    fn remembers(&self) -> bool {
        // how warm a record begins
        true
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let j = e.place.first();
        let (top, [fc, fv]) = (cx.data.speed[j], heating(cx, j));
        let [time, bend] = [e.shape[0], e.shape[1]];
        let [dry, viscous] = [e.eta[0], e.eta[1]].map(py);
        let [fc, fv] = [fc / top / (fc + fv), fv / (top * top) / (fc + fv)].map(py);
        let lines = vec![
            format!("power = {fc} * xp.abs(dq) + {fv} * dq**2"),
            format!("memory = memory + dt / {} * (power - memory)", py(time)),
            match bend > 0.0 {
                true => format!("warm = (1.0 - xp.exp(-{bend:?} * memory)) / {bend:?}"),
                false => "warm = memory".into(),
            },
            format!("return {dry} * warm, {viscous} * warm * dq, memory"),
        ];
        Some(Element::memory(
            j,
            T.reversals.sharp * top,
            "0.0 * q",
            e.shape[2],
            lines,
        ))
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let j = place.first();
        // warmth from the power of friction; what a pause leaves of it goes from record to record in the order of the
        // experiment
        let (top, [fc, fv]) = (cx.data.speed[j], heating(cx, j));
        let power = |v: f64| (fc * v.abs() / top + fv * (v / top).powi(2)) / (fc + fv);
        let mut order: Vec<usize> = (0..cx.data.records.len()).collect();
        order.sort_by_key(|k| cx.data.records[*k].order);
        let mut warmth = vec![0.0; cx.data.rows()];
        let mut warm = 0.0;
        for k in order {
            let r = &cx.data.records[k];
            warm *= shape[2];
            let (_, v) = r.state(j);
            for (to, v) in warmth[cx.data.span(k)].iter_mut().zip(v) {
                warm += r.dt / shape[0] * (power(*v) - warm);
                *to = match shape[1] > 0.0 {
                    true => (1.0 - (-shape[1] * warm).exp()) / shape[1],
                    false => warm,
                };
            }
        }
        let times = |x: Vec<f64>| x.iter().zip(&warmth).map(|(x, w)| x * w).collect();
        vec![
            Column::on(j, times(cx.sign(j))),
            Column::on(j, times(cx.data.each(|r, _| r.state(j).1.to_vec()))),
        ]
    }

    // oil and grease change all friction in one direction; a curve over the velocity that turns is something else
    fn plausible(&self, cx: &Context, place: &Place, _shape: &Shape, eta: &[f64]) -> bool {
        let [dry, viscous] = [eta[0], eta[1] * cx.data.speed[place.first()]];
        let least = dry.abs().min(viscous.abs());
        dry * viscous > 0.0 || least < AGAINST * dry.abs().max(viscous.abs())
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place,
            shape,
            eta,
            std,
        } = e;
        let unit = cx.unit(place.first(), Quantity::Damping);
        vec![
            value(
                "coulomb_change",
                eta[0],
                std[0],
                cx.torque_unit(place.first()),
            ),
            value("viscous_change", eta[1], std[1], unit),
            constant("time_constant", shape[0], "s"),
            constant("lasts_over_records", shape[2], ""),
        ]
    }
}

/// Dry and viscous friction at the largest speed, by which a joint warms itself.
fn heating(cx: &Context, j: usize) -> [f64; 2] {
    let [_, viscous, coulomb, _] = cx.data.plant.actuators()[j].terms;
    match coulomb + viscous > 0.0 {
        true => [coulomb, viscous * cx.data.speed[j]],
        false => [1.0, 1.0],
    }
}
