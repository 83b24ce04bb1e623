//! Friction that grows with another power of the speed.

use super::*;

/// Nonlinear viscous friction.
pub struct NonlinearViscousFriction;

impl Effect for NonlinearViscousFriction {
    fn card(&self) -> Card {
        Card {
            name: "nonlinear_viscous_friction",
            title: "nonlinear viscous friction",
            equation: "F_α |q̇|^α sgn q̇",
            source: "Bittencourt & Gunnarsson 2012; Simoni et al. 2017",
            aliases: &[],
            separated_by: "constant speeds over the whole range",
        }
    }
    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.singles()
    }

    fn shapes(&self, _cx: &Context, _place: &Place) -> Vec<Shape> {
        [0.35, 0.5, 0.7, 1.35, 1.7, 2.0, 2.5, 3.0]
            .map(|a| Shape::of(&[a]))
            .to_vec()
    }

    /// A power below one is steepest there.
    fn at_reversals(&self, shape: &Shape) -> bool {
        shape[0] < 1.0
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let (joint, power) = (e.place.first(), e.shape[0]);
        let top = cx.data.speed[joint];
        if power == 2.0 || power == 3.0 {
            return Some(Element::Drag {
                joint,
                power: power as u8,
                factor: e.eta[0] / top.powf(power),
            });
        }
        let [level, at, power] = [e.eta[0], top, power].map(py);
        let torque = format!("{level} * xp.sign(dq) * (xp.abs(dq) / {at}) ** {power}");
        Some(Element::smooth(joint, 1e-3 * top, torque))
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let j = place.first();
        let top = cx.data.speed[j];
        let power = |v: f64| v.signum() * (v.abs() / top).powf(shape[0]);
        vec![Column::on(j, cx.data.own(j, |_, v| power(v)))]
    }

    fn friction(
        &self,
        cx: &Context,
        place: &Place,
        shape: &Shape,
        eta: &[f64],
        speed: f64,
    ) -> Option<f64> {
        let top = cx.data.speed[place.first()];
        Some(eta[0] * (speed / top).powf(shape[0]))
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place,
            shape,
            eta,
            std,
        } = e;
        vec![
            value(
                "torque_at_reference_speed",
                eta[0],
                std[0],
                cx.torque_unit(place.first()),
            ),
            constant(
                "reference_speed",
                cx.data.speed[place.first()],
                cx.unit(place.first(), Quantity::Speed),
            ),
            constant("exponent", shape[0], ""),
        ]
    }
}
