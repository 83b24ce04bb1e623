//! Friction that grows with the transmitted torque.

use super::*;

/// Load-dependent friction.
pub struct LoadDependentFriction;

impl Effect for LoadDependentFriction {
    fn card(&self) -> Card {
        Card {
            name: "load_dependent_friction",
            title: "load-dependent friction",
            equation: "β |τ_load|^e sgn q̇",
            source: "Hamon, Gautier, Garrec & Janot 2010; Bittencourt 2010",
            aliases: &[],
            separated_by: "the same speed with two payloads",
        }
    }
    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.singles()
    }

    fn shapes(&self, _cx: &Context, _place: &Place) -> Vec<Shape> {
        [0.7, 1.0, 1.4, 2.0].map(|e| Shape::of(&[e])).to_vec()
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let j = e.place.first();
        let [level, peak, power] = [e.eta[0], cx.peak[j], e.shape[0]].map(py);
        let level = format!("{level} * (xp.abs(load) / {peak}) ** {power}");
        Some(Element::dry(j, T.reversals.sharp * cx.data.speed[j], level))
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let j = place.first();
        let values = cx
            .sign(j)
            .iter()
            .zip(&cx.rigid[j])
            .map(|(s, load)| s * (load.abs() / cx.peak[j]).powf(shape[0]))
            .collect();
        vec![Column::on(j, values)]
    }

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
        let unit = cx.torque_unit(place.first());
        vec![
            value("torque_at_reference_load", eta[0], std[0], unit),
            constant("reference_load", cx.peak[place.first()], unit),
            constant("exponent", shape[0], ""),
        ]
    }
}
