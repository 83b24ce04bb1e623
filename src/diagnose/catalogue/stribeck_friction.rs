//! Friction that rises towards standstill.

use super::bristles::{Bristles, DAHL};
use super::presliding_hysteresis::SHORTEST;
use super::*;
use crate::diagnose::window::sign;

/// Form of a shape where friction also builds up over the displacement since the last reversal (LuGre).
const BRISTLES: u8 = 1;
/// Displacements over which it does so, lowest and highest, over the range of the motion.
const REACH: [f64; 2] = [SHORTEST, 1e-3];
/// Share of Coulomb friction that the rise has at least there: less of it is pre-sliding hysteresis.
const RISE: f64 = 0.1;

/// Stribeck friction.
pub struct StribeckFriction;

impl Effect for StribeckFriction {
    fn card(&self) -> Card {
        Card {
            name: "stribeck_friction",
            title: "Stribeck friction",
            equation: "(F_s − F_c) e^{−|q̇/v_s|^δ} sgn q̇, or with bristles: F_c (z − sgn q̇) + (F_s − F_c) e^{−|q̇/v_s|^δ} z, \
                       ż = q̇/s (1 − z sgn q̇)",
            source: "Bo & Pavelescu 1982; Armstrong-Hélouvry, Dupont & Canudas de Wit 1994; Canudas de Wit, Olsson, Åström & \
                     Lischinsky 1995",
            aliases: &[],
            separated_by: "slow constant speeds below the Stribeck velocity",
        }
    }
    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.singles()
    }

    fn shapes(&self, cx: &Context, place: &Place) -> Vec<Shape> {
        let v = cx.data.speed[place.first()];
        let [low, high] = cx.data.range[place.first()];
        let (least, most) = (0.006 * v, 0.31 * v);
        let mut all = Vec::new();
        for power in [1.0, 2.0] {
            all.extend(
                ladder(least, most, 10)
                    .iter()
                    .map(|v| Shape::of(&[*v, power])),
            );
        }
        for reach in REACH.map(|r| r * (high - low)) {
            for power in [1.0, 2.0] {
                let with = |v: &f64| Shape::new(BRISTLES, &[*v, power, reach]);
                all.extend(ladder(least, most, 5).iter().map(with));
            }
        }
        all
    }

    fn refinable(&self, _shape: &Shape, k: usize) -> bool {
        k != 1
    }

    fn forms(&self) -> u8 {
        2
    }

    fn freedoms(&self, shape: &Shape) -> usize {
        // the exponent, and how far bristles bend
        shape.constants.len()
    }

    fn at_reversals(&self, _shape: &Shape) -> bool {
        true
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let j = e.place.first();
        let [rise, v, power] = [e.eta[0], e.shape[0], e.shape[1]].map(py);
        let level = format!("{rise} * xp.exp(-(xp.abs(dq) / {v}) ** {power})");
        let width = 1e-3 * cx.data.speed[j];
        if e.shape.form != BRISTLES {
            return Some(Element::dry(j, width, level));
        }
        let coulomb = py(e.eta[1]);
        let (start, mut lines) = Bristles::lines(DAHL, e.shape[2]);
        lines.push(format!(
            "return -{coulomb}, ({coulomb} + {level}) * z, memory"
        ));
        Some(Element::memory(j, width, &start, 0.0, lines))
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let j = place.first();
        let mut all = vec![rise(cx, j, shape)];
        if shape.form == BRISTLES {
            all.push(Bristles::late(cx, j, DAHL, shape[2]));
        }
        all
    }

    fn drafts(&self, cx: &Context, place: &Place, shapes: &[Shape]) -> Vec<Vec<Column>> {
        let j = place.first();
        // by how much bristles make Coulomb friction late is the same for every Stribeck velocity
        let mut last = Last::none();
        let of = |shape: &Shape| {
            let mut all = vec![rise(cx, j, shape)];
            if shape.form == BRISTLES {
                let reach = shape[2];
                let late = last.of(reach, || Bristles::late(cx, j, DAHL, reach));
                all.push(late.clone());
            }
            all
        };
        shapes.iter().map(of).collect()
    }

    // a fit about reversals can ask for many times what slides
    fn plausible(&self, cx: &Context, place: &Place, shape: &Shape, eta: &[f64]) -> bool {
        let coulomb = cx.data.plant.actuators()[place.first()].terms[2].abs();
        let most = match coulomb > 0.0 {
            true => T.reversals.breakaway * coulomb,
            false => f64::INFINITY,
        };
        let enough = shape.form != BRISTLES || (eta[1] > 0.0 && eta[0] > RISE * eta[1]);
        eta[0] > 0.0 && eta[0] < most && enough
    }

    fn friction(
        &self,
        _cx: &Context,
        _place: &Place,
        shape: &Shape,
        eta: &[f64],
        speed: f64,
    ) -> Option<f64> {
        Some(eta[0] * (-(speed / shape[0]).powf(shape[1])).exp())
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place,
            shape,
            eta,
            std,
        } = e;
        let mut all = vec![
            value("rise", eta[0], std[0], cx.torque_unit(place.first())),
            constant(
                "stribeck_velocity",
                shape[0],
                cx.unit(place.first(), Quantity::Speed),
            ),
            constant("exponent", shape[1], ""),
        ];
        if shape.form == BRISTLES {
            let (unit, way) = (
                cx.torque_unit(place.first()),
                cx.unit(place.first(), Quantity::Position),
            );
            all.push(value("level", eta[1], std[1], unit));
            all.push(constant("presliding", shape[2], way));
        }
        all
    }
}

/// What the rise adds per unit of it.
fn rise(cx: &Context, j: usize, shape: &Shape) -> Column {
    // one or two: a general power takes several times as long
    let power = shape[1] as i32;
    let fall = |v: f64| (-(v.abs() / shape[0]).powi(power)).exp();
    let values = match shape.form {
        BRISTLES => Bristles::column(cx, j, DAHL, shape[2], |z, v| z * fall(v)),
        _ => {
            let width = 1e-3 * cx.data.speed[j];
            cx.data.added(j, |_, v| sign(v, width) * fall(v))
        }
    };
    Column::on(j, values)
}
