//! Friction that rises towards standstill.

use super::*;
use crate::diagnose::window::sign;

/// Stribeck friction.
pub struct StribeckFriction;

impl Effect for StribeckFriction {
    fn card(&self) -> Card {
        Card {
            name: "stribeck_friction",
            title: "Stribeck friction",
            equation: "(F_s − F_c) e^{−|q̇/v_s|^δ} sgn q̇",
            source: "Bo & Pavelescu 1982; Armstrong-Hélouvry, Dupont & Canudas de Wit 1994",
            aliases: &[],
            separated_by: "slow constant speeds below the Stribeck velocity",
        }
    }
    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.singles()
    }

    fn shapes(&self, cx: &Context, place: &Place) -> Vec<Shape> {
        let v = cx.data.speed[place.first()];
        let grid = ladder(0.006 * v, 0.31 * v, 10);
        let with = |d: f64| grid.iter().map(move |v| Shape::of(&[*v, d]));
        with(1.0).chain(with(2.0)).collect()
    }

    fn refinable(&self, k: usize) -> bool {
        k == 0
    }

    fn at_reversals(&self, _shape: &Shape) -> bool {
        true
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let j = e.place.first();
        let [rise, v, power] = [e.eta[0], e.shape[0], e.shape[1]].map(py);
        let level = format!("{rise} * xp.exp(-(xp.abs(dq) / {v}) ** {power})");
        Some(Element::dry(j, 1e-3 * cx.data.speed[j], level))
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let j = place.first();
        let width = 1e-3 * cx.data.speed[j];
        // one or two: a general power takes several times as long
        let power = shape[1] as i32;
        let rise = |v: f64| sign(v, width) * (-(v.abs() / shape[0]).powi(power)).exp();
        vec![Column::on(j, cx.data.added(j, |_, v| rise(v)))]
    }

    // a fit about reversals can ask for many times what slides
    fn plausible(&self, cx: &Context, place: &Place, _shape: &Shape, eta: &[f64]) -> bool {
        let coulomb = cx.data.plant.actuators()[place.first()].terms[2].abs();
        let most = match coulomb > 0.0 {
            true => T.reversals.breakaway * coulomb,
            false => f64::INFINITY,
        };
        eta[0] > 0.0 && eta[0] < most
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place,
            shape,
            eta,
            std,
        } = e;
        vec![
            value("rise", eta[0], std[0], cx.torque_unit(place.first())),
            constant(
                "stribeck_velocity",
                shape[0],
                cx.unit(place.first(), Quantity::Speed),
            ),
            constant("exponent", shape[1], ""),
        ]
    }
}
