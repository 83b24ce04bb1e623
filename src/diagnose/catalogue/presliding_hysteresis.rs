//! Friction that builds up over the displacement since the last reversal.

use super::*;
use crate::diagnose::window::{fine_values, sampled, sign};

/// Springs of the form with many strengths.
const ELEMENTS: usize = 8;

/// Displacement over which friction builds up that is looked at, over the range of the motion.
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
        let grid = ladder(6e-4 * (b - a), WIDEST * (b - a), 9);
        let with = |form: u8| grid.iter().map(move |s| Shape::new(form, &[*s]));
        (0..3).flat_map(with).collect()
    }

    fn refinable(&self, k: usize) -> bool {
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
        let [level, reach] = [e.eta[0], e.shape[0]].map(py);
        let (start, mut lines) = match e.shape.form {
            2 => {
                let slips: Vec<String> = (0..ELEMENTS)
                    .map(|k| py(2.0 * e.shape[0] * (k as f64 + 0.5) / ELEMENTS as f64))
                    .collect();
                let step = format!(
                    "memory = (q,) + tuple(xp.clip(z + d / s, -1.0, 1.0) for z, s in zip(memory[1:], [{}]))",
                    slips.join(", ")
                );
                let sum = format!("z = sum(memory[1:]) / {ELEMENTS}");
                (format!("(q,) + {ELEMENTS} * (0.0 * q,)"), vec![step, sum])
            }
            form => {
                let z = match form {
                    0 => format!(
                        "xp.sign(d) + (memory[1] - xp.sign(d)) * xp.exp(-xp.abs(d) / {reach})"
                    ),
                    _ => format!("xp.clip(memory[1] + d / {reach}, -1.0, 1.0)"),
                };
                let after = "memory = (q, z)".to_string();
                ("(q, 0.0 * q)".to_string(), vec![format!("z = {z}"), after])
            }
        };
        lines.insert(0, "d = q - memory[0]".into());
        // what builds up takes the place of what turns at once
        lines.push(format!("return -{level}, {level} * z, memory"));
        Some(Element::memory(
            j,
            1e-3 * cx.data.speed[j],
            &start,
            false,
            lines,
        ))
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let j = place.first();
        let width = 1e-3 * cx.data.speed[j];
        let values = cx.data.each(|r, _| {
            let (q, v) = r.state(j);
            let a = r.acceleration(j);
            // the state of the last period is that of the first: run once to settle
            let mut z = Bristles::new(shape[0], shape.form, q[0]);
            let settle = r.cycle.unwrap_or(0);
            for q in &q[..settle] {
                z.step(*q);
            }
            let values = fine_values(q, v, a, r.dt, |q, v, _| z.step(q) - sign(v, width));
            sampled(&values, r.count)
        });
        vec![Column::on(j, values)]
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

/// Normalised friction force of bristles, between −1 and 1.
struct Bristles {
    /// displacement over which it builds up
    reach: f64,
    /// 0 exponential (Dahl), 1 one spring that slips, 2 springs of many strengths
    form: u8,
    at: f64,
    z: [f64; ELEMENTS],
}

impl Bristles {
    fn new(reach: f64, form: u8, at: f64) -> Self {
        Bristles {
            reach,
            form,
            at,
            z: [0.0; ELEMENTS],
        }
    }

    fn step(&mut self, q: f64) -> f64 {
        let d = q - self.at;
        self.at = q;
        match self.form {
            0 => {
                let s = d.signum();
                if d != 0.0 {
                    // dz/dq = (1 − z sgn)/s, exactly over the step
                    self.z[0] = s + (self.z[0] - s) * (-d.abs() / self.reach).exp();
                }
                self.z[0]
            }
            1 => {
                self.z[0] = (self.z[0] + d / self.reach).clamp(-1.0, 1.0);
                self.z[0]
            }
            _ => {
                let n = self.z.len() as f64;
                let mut sum = 0.0;
                for (k, z) in self.z.iter_mut().enumerate() {
                    // elements slip at displacements from small to twice the mean
                    let slip = 2.0 * self.reach * (k as f64 + 0.5) / n;
                    *z = (*z + d / slip).clamp(-1.0, 1.0);
                    sum += *z;
                }
                sum / n
            }
        }
    }
}
