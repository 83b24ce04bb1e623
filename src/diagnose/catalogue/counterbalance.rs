//! A spring or cylinder that carries part of the weight of the arm.

use super::*;

/// Counterbalance.
pub struct Counterbalance;

impl Effect for Counterbalance {
    fn card(&self) -> Card {
        Card {
            name: "counterbalance",
            title: "counterbalance",
            equation: "a sin q + b cos q, and twice the angle",
            source: "Klimchik et al. 2013",
            aliases: &["cable_spring"],
            separated_by: "poses with and without payload; the pressure of the cylinder",
        }
    }
    fn hides(&self) -> bool {
        true
    }

    fn most(&self) -> f64 {
        // it holds what the drive cannot
        3.0
    }

    fn robots(&self) -> Robots {
        Robots::Open
    }

    fn places(&self, cx: &Context) -> Vec<Place> {
        let robot = cx.data.plant.robot();
        // only where weight acts
        (0..cx.data.joints())
            .filter(|j| cx.motion(*j) == Motion::Revolute && carries(cx, robot, *j))
            .map(Place::Actuator)
            .collect()
    }

    fn familiarity(&self) -> f64 {
        // a wide family that imitates others
        -0.5
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let j = e.place.first();
        let waves = [
            "xp.sin(q)",
            "xp.cos(q)",
            "xp.sin(2.0 * q)",
            "xp.cos(2.0 * q)",
        ];
        let parts = waves.iter().zip(&e.eta);
        let parts: Vec<String> = parts
            .map(|(w, eta)| format!("{} * {w}", py(*eta)))
            .collect();
        Some(Element::smooth(
            j,
            1e-3 * cx.data.speed[j],
            parts.join(" + "),
        ))
    }

    fn columns(&self, cx: &Context, place: &Place, _shape: &Shape, _draft: bool) -> Vec<Column> {
        let j = place.first();
        let of = |f: fn(f64) -> f64, k: f64| Column::on(j, cx.data.own(j, |q, _| f(k * q)));
        vec![
            of(f64::sin, 1.0),
            of(f64::cos, 1.0),
            of(f64::sin, 2.0),
            of(f64::cos, 2.0),
        ]
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place, eta, std, ..
        } = e;
        let unit = cx.torque_unit(place.first());
        let names = ["sine", "cosine", "sine_twice", "cosine_twice"];
        (0..4)
            .map(|k| value(names[k], eta[k], std[k], unit))
            .collect()
    }
}

/// Whether gravity acts on the links after a joint about its axis.
fn carries(cx: &Context, robot: &crate::Robot, j: usize) -> bool {
    let mut x = Samples::zeros(robot.dof(), 16);
    let r = &cx.data.records[0];
    for k in 0..x.dof {
        for i in 0..x.count {
            x.q[k * x.count + i] = r.x.q[k * r.count + i * (r.count - 1) / 15];
        }
    }
    let weight = crate::diagnose::rigid::rigid(cx.data.plant, &cx.phi, None, &x);
    weight.is_ok_and(|w| {
        let row = &w[j * x.count..(j + 1) * x.count];
        row.iter().any(|v| v.abs() > 0.02 * cx.peak[j])
    })
}
