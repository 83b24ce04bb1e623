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
    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.singles()
    }

    fn shapes(&self, cx: &Context, place: &Place) -> Vec<Shape> {
        // the difference of viscous friction alone, or with one that turns over at a velocity
        let mut all = vec![Shape::new(0, &[])];
        let v = cx.data.speed[place.first()];
        all.extend(
            ladder(0.02 * v, 0.6 * v, 6)
                .into_iter()
                .map(|v| Shape::new(1, &[v])),
        );
        all
    }

    fn forms(&self) -> u8 {
        2
    }

    fn freedoms(&self, _shape: &Shape) -> usize {
        // the velocity, or that it takes no part
        1
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let j = e.place.first();
        let mut torque = format!("{} * xp.abs(dq)", py(e.eta[0]));
        if e.shape.form == 1 {
            let [level, v] = [e.eta[1], e.shape[0]].map(py);
            torque += &format!(" + {level} * (1.0 - xp.exp(-xp.abs(dq) / {v}))");
        }
        Some(Element::smooth(j, 1e-3 * cx.data.speed[j], torque))
    }

    fn at_reversals(&self, shape: &Shape) -> bool {
        shape.form == 1
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let j = place.first();
        let mut all = vec![Column::on(j, cx.data.own(j, |_, v| v.abs()))];
        if shape.form == 1 {
            all.push(Column::on(
                j,
                cx.data.added(j, |_, v| 1.0 - (-v.abs() / shape[0]).exp()),
            ));
        }
        all
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place,
            shape,
            eta,
            std,
        } = e;
        let unit = cx.unit(place.first(), Quantity::Damping);
        // F_v^+ − F_v^−: half of it goes with |q̇|
        let mut all = vec![value(
            "viscous_difference",
            2.0 * eta[0],
            2.0 * std[0],
            unit,
        )];
        if shape.form == 1 {
            let (e, s) = (eta[1], std[1]);
            all.push(value(
                "coulomb_difference",
                2.0 * e,
                2.0 * s,
                cx.torque_unit(place.first()),
            ));
            all.push(constant(
                "turnover_velocity",
                shape[0],
                cx.unit(place.first(), Quantity::Speed),
            ));
        }
        all
    }
}
