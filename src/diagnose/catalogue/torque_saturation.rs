//! A motor that gives less torque per current at high torque, or a limited torque.

use super::*;

/// Saturation of the torque constant.
pub struct TorqueSaturation;

/// Loss grows with this power of the torque.
const EXPONENT: u8 = 0;
/// Loss beyond this share of the peak.
const LIMIT: u8 = 1;

impl Effect for TorqueSaturation {
    fn card(&self) -> Card {
        Card {
            name: "torque_saturation",
            title: "saturation of the torque constant",
            equation: "κ τ |τ|^{e−1}, or beyond a limit",
            source: "motor handbooks; Krishnan 2010",
            aliases: &[],
            separated_by: "high torques at low speed",
        }
    }
    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.singles()
    }

    fn shapes(&self, _cx: &Context, _place: &Place) -> Vec<Shape> {
        let with = |form: u8, all: &[f64]| -> Vec<Shape> {
            all.iter().map(|c| Shape::new(form, &[*c])).collect()
        };
        let exponents = with(EXPONENT, &[2.0, 3.0, 5.0]);
        let limits = with(LIMIT, &[0.4, 0.55, 0.7, 0.85]);
        [exponents, limits].concat()
    }

    fn forms(&self) -> u8 {
        2
    }

    fn freedoms(&self, _shape: &Shape) -> usize {
        // the exponent or the limit
        1
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let j = e.place.first();
        let peak = cx.model[j].iter().fold(1e-9f64, |m, v| m.max(v.abs()));
        let [loss, peak, at] = [e.eta[0], peak, e.shape[0]].map(py);
        let part = match e.shape.form {
            EXPONENT => format!("(xp.abs(tau) / {peak}) ** {at}"),
            _ => format!("xp.clip(xp.abs(tau) / {peak} - {at}, 0.0, None)"),
        };
        let lines = vec![format!(
            "return tau + {loss} * {peak} * xp.sign(tau) * {part}"
        )];
        Some(Element::of(Kind::Drive, j, lines))
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let j = place.first();
        let peak = cx.model[j].iter().fold(1e-9f64, |m, v| m.max(v.abs()));
        let values = cx.model[j]
            .iter()
            .map(|t| {
                let x = t.abs() / peak;
                let y = if shape.form == EXPONENT {
                    x.powf(shape[0])
                } else {
                    (x - shape[0]).max(0.0)
                };
                t.signum() * peak * y
            })
            .collect();
        vec![Column::on(j, values)]
    }

    // a drive that gave more torque per current at high torque would be no saturated one
    fn plausible(&self, _cx: &Context, _place: &Place, _shape: &Shape, eta: &[f64]) -> bool {
        eta[0] > 0.0
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place,
            shape,
            eta,
            std,
        } = e;
        let j = place.first();
        let peak = cx.model[j].iter().fold(1e-9f64, |m, v| m.max(v.abs()));
        let mut all = vec![value("loss_at_peak", eta[0], std[0], "")];
        if shape.form == EXPONENT {
            all.push(constant("exponent", shape[0], ""));
        } else {
            all.push(constant("limit", shape[0] * peak, cx.torque_unit(j)));
        }
        all.push(constant("peak", peak, cx.torque_unit(j)));
        all
    }
}
