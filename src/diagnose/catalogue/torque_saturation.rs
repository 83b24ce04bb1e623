//! A motor that gives less torque per current at high torque, or a limited torque.

use super::*;

/// Saturation of the torque constant.
pub struct TorqueSaturation;

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
    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        cx.singles()
    }

    fn shapes(&self, _cx: &Context, _place: &[usize]) -> Vec<Vec<f64>> {
        // above 1 an exponent, below 1 the limit as a share of the peak
        [2.0, 3.0, 5.0, 0.4, 0.55, 0.7, 0.85]
            .map(|e| vec![e])
            .to_vec()
    }

    fn columns(&self, cx: &Context, place: &[usize], shape: &[f64], _draft: bool) -> Vec<Column> {
        let j = place[0];
        let peak = cx.model[j].iter().fold(1e-9f64, |m, v| m.max(v.abs()));
        let values = cx.model[j]
            .iter()
            .map(|t| {
                let x = t.abs() / peak;
                let y = if shape[0] > 1.0 {
                    x.powf(shape[0])
                } else {
                    (x - shape[0]).max(0.0)
                };
                t.signum() * peak * y
            })
            .collect();
        vec![Column::on(j, values)]
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
        let peak = cx.model[j].iter().fold(1e-9f64, |m, v| m.max(v.abs()));
        let mut all = vec![value("loss_at_peak", eta[0], std[0], "")];
        if shape[0] > 1.0 {
            all.push(constant("exponent", shape[0], ""));
        } else {
            all.push(constant("limit", shape[0] * peak, cx.torque_unit(j)));
        }
        all.push(constant("peak", peak, cx.torque_unit(j)));
        all
    }
}
