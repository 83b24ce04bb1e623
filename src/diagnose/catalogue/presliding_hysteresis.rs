//! Friction that builds up over the displacement since the last reversal.

use super::bristles::Bristles;
use super::*;

/// Displacements over which friction builds up that are looked at, over the range of the motion.
pub(super) const SHORTEST: f64 = 3e-5;
const WIDEST: f64 = 0.15;

/// Pre-sliding hysteresis.
pub struct PreslidingHysteresis;

impl Effect for PreslidingHysteresis {
    fn card(&self) -> Card {
        Card {
            name: "presliding_hysteresis",
            title: "pre-sliding hysteresis",
            equation: "F (z − sgn q̇),  ż = q̇/s (1 − z sgn q̇)^n or Maxwell slip",
            source: "Dahl 1968; Al-Bender, Lampaert & Swevers 2005",
            aliases: &[],
            separated_by: "the same reversal at three speeds: a loop of constant width in position is hysteresis, in time a delay",
        }
    }
    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.singles()
    }

    fn shapes(&self, cx: &Context, place: &Place) -> Vec<Shape> {
        let [a, b] = cx.data.range[place.first()];
        let grid = ladder(SHORTEST * (b - a), WIDEST * (b - a), 13);
        let with = |form: u8| grid.iter().map(move |s| Shape::new(form, &[*s]));
        (0..3).flat_map(with).collect()
    }

    fn refinable(&self, _shape: &Shape, k: usize) -> bool {
        k == 0
    }

    fn forms(&self) -> u8 {
        3
    }

    fn at_reversals(&self, _shape: &Shape) -> bool {
        true
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let j = e.place.first();
        let level = py(e.eta[0]);
        let (start, mut lines) = Bristles::lines(e.shape.form, e.shape[0]);
        // what builds up takes the place of what turns at once
        lines.push(format!("return -{level}, {level} * z, memory"));
        let width = 1e-3 * cx.data.speed[j];
        Some(Element::memory(j, width, &start, 0.0, lines))
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let late = Bristles::late(cx, place.first(), shape.form, shape[0]);
        vec![late]
    }

    fn plausible(&self, _cx: &Context, _place: &Place, _shape: &Shape, eta: &[f64]) -> bool {
        eta[0] > 0.0
    }

    fn impossible(
        &self,
        cx: &Context,
        place: &Place,
        shape: &Shape,
        _eta: &[f64],
    ) -> Option<String> {
        let [a, b] = cx.data.range[place.first()];
        let share = shape[0] / (b - a).max(1e-9);
        (share >= WIDEST).then(|| {
            format!(
                "its friction would build up over {:.0} % of the range and more: that is no pre-sliding",
                100.0 * WIDEST
            )
        })
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place,
            shape,
            eta,
            std,
        } = e;
        vec![
            value("level", eta[0], std[0], cx.torque_unit(place.first())),
            constant(
                "presliding",
                shape[0],
                cx.unit(place.first(), Quantity::Position),
            ),
        ]
    }
}
