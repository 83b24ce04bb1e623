//! Payload: mass on the last link that the model does not have, `Y_n (m, m c)`.

use super::*;

/// Payload.
pub struct Payload;

impl Effect for Payload {
    fn card(&self) -> Card {
        Card {
            name: "payload",
            title: "payload",
            equation: "Y_n(q, q̇, q̈) (m, m c)",
            source: "Khalil, Gautier & Lemoine 2007; Swevers et al. 2002",
            aliases: &["link_inertia"],
            separated_by: "the same motion with and without the load, and several static poses of the wrist",
        }
    }
    fn hides(&self) -> bool {
        true
    }

    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        match (cx.serial(), cx.data.plant.robot().bodies.last()) {
            (true, Some(last)) => vec![vec![last.coordinate]],
            _ => Vec::new(),
        }
    }

    fn shapes(&self, _cx: &Context, _place: &[usize]) -> Vec<Vec<f64>> {
        // a point mass, or with an inertia of its own
        vec![vec![4.0], vec![10.0]]
    }

    fn columns(&self, cx: &Context, _place: &[usize], shape: &[f64], _draft: bool) -> Vec<Column> {
        let last = cx.data.plant.robot().bodies.len() - 1;
        link_inertia::body_columns(cx, last, shape[0] as usize)
    }

    fn plausible(&self, _cx: &Context, _place: &[usize], _shape: &[f64], eta: &[f64]) -> bool {
        let reach = (eta[1].powi(2) + eta[2].powi(2) + eta[3].powi(2)).sqrt();
        eta[0] > 0.0 && reach < 0.8 * eta[0]
    }

    fn values(
        &self,
        _cx: &Context,
        _place: &[usize],
        _shape: &[f64],
        eta: &[f64],
        std: &[f64],
    ) -> Vec<Value> {
        let m = eta[0];
        let com = |k: usize| {
            let s = (std[k] / m).hypot(eta[k] * std[0] / (m * m));
            (eta[k] / m, s)
        };
        let [(x, sx), (y, sy), (z, sz)] = [com(1), com(2), com(3)];
        vec![
            value("mass", m, std[0], "kg"),
            value("com_x", x, sx, "m"),
            value("com_y", y, sy, "m"),
            value("com_z", z, sz, "m"),
        ]
    }
}
