//! Friction that grows with the transmitted torque.

use super::*;

/// Load-dependent friction.
pub struct LoadDependentFriction;

/// The form whose load is all that the motor makes, friction and all, and not the bodies' torque alone.
const MOTOR: u8 = 1;

impl LoadDependentFriction {
    /// The load of a form, and the largest.
    fn load<'a>(cx: &'a Context, j: usize, form: u8) -> (&'a [f64], f64) {
        match form {
            MOTOR => {
                let load = &cx.model[j];
                let largest = peak(load);
                (load, largest)
            }
            _ => (&cx.rigid[j], cx.peak[j]),
        }
    }
}

impl Effect for LoadDependentFriction {
    fn card(&self) -> Card {
        Card {
            name: "load_dependent_friction",
            title: "load-dependent friction",
            equation: "β |τ_load|^e sgn q̇, or β |τ_motor|^e sgn q̇",
            source: "Hamon, Gautier, Garrec & Janot 2010; Bittencourt 2010",
            aliases: &[],
            separated_by: "the same speed with two payloads",
        }
    }
    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.singles()
    }

    fn shapes(&self, _cx: &Context, _place: &Place) -> Vec<Shape> {
        let bodies = [0.7, 1.0, 1.4, 2.0].map(|e| Shape::of(&[e]));
        let motor = [0.7, 1.0, 1.4].map(|e| Shape::new(MOTOR, &[e]));
        bodies.into_iter().chain(motor).collect()
    }

    fn forms(&self) -> u8 {
        2
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let j = e.place.first();
        let sharp = T.reversals.sharp * cx.data.speed[j];
        let (_, largest) = Self::load(cx, j, e.shape.form);
        let [level, largest, power] = [e.eta[0], largest, e.shape[0]].map(py);
        let load = match e.shape.form {
            MOTOR => {
                let [_, viscous, dry, offset] = cx.terms(j)?.map(py);
                let turns = format!("xp.tanh(dq / {})", py(sharp));
                format!("load + {offset} + {viscous} * dq + {dry} * {turns}")
            }
            _ => "load".into(),
        };
        let level = format!("{level} * (xp.abs({load}) / {largest}) ** {power}");
        Some(Element::dry(j, sharp, level))
    }

    fn at_reversals(&self, _shape: &Shape) -> bool {
        true
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let j = place.first();
        let (load, largest) = Self::load(cx, j, shape.form);
        let values = (cx.sign(j).iter().zip(load))
            .map(|(s, load)| s * (load.abs() / largest).powf(shape[0]))
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
        let (_, largest) = Self::load(cx, place.first(), shape.form);
        let reference = match shape.form {
            MOTOR => "reference_motor_torque",
            _ => "reference_load",
        };
        vec![
            value("torque_at_reference_load", eta[0], std[0], unit),
            constant(reference, largest, unit),
            constant("exponent", shape[0], ""),
        ]
    }
}
