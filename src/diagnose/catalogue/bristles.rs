//! Friction that builds up over the displacement since the last reversal.

use super::{Column, Context, py};
use crate::diagnose::window::{fine_values, sampled, sign};

/// Springs of the form with many strengths.
const ELEMENTS: usize = 8;
/// The form that builds up exponentially.
pub(super) const DAHL: u8 = 0;

/// Normalised friction force of bristles, between −1 and 1.
pub(super) struct Bristles {
    /// displacement over which it builds up
    reach: f64,
    /// [`DAHL`], 1 one spring that slips, 2 springs of many strengths
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

    /// Values of a function of their force and of the velocity, over the records.
    pub fn column(
        cx: &Context,
        j: usize,
        form: u8,
        reach: f64,
        f: impl Fn(f64, f64) -> f64 + Sync,
    ) -> Vec<f64> {
        cx.data.each(|r, _| {
            let (q, v) = r.state(j);
            // the state of the last period is that of the first: run once to settle
            let mut bristles = Bristles::new(reach, form, q[0]);
            for q in &q[..r.cycle.unwrap_or(0)] {
                bristles.step(*q);
            }
            let a = r.acceleration(j);
            let values = fine_values(q, v, a, r.dt, |q, v, _| f(bristles.step(q), v));
            sampled(&values, r.count)
        })
    }

    /// Their force less that of friction that turns at once.
    pub fn late(cx: &Context, j: usize, form: u8, reach: f64) -> Column {
        let width = 1e-3 * cx.data.speed[j];
        let values = Bristles::column(cx, j, form, reach, |z, v| z - sign(v, width));
        Column::on(j, values)
    }

    /// Lines of a function with a memory up to their force `z`, and what the memory starts with.
    pub fn lines(form: u8, reach: f64) -> (String, Vec<String>) {
        let (start, mut lines) = match form {
            2 => {
                let slips: Vec<String> = (0..ELEMENTS)
                    .map(|k| py(2.0 * reach * (k as f64 + 0.5) / ELEMENTS as f64))
                    .collect();
                let step = format!(
                    "memory = (q,) + tuple(xp.clip(z + d / s, -1.0, 1.0) for z, s in zip(memory[1:], [{}]))",
                    slips.join(", ")
                );
                let sum = format!("z = sum(memory[1:]) / {ELEMENTS}");
                (format!("(q,) + {ELEMENTS} * (0.0 * q,)"), vec![step, sum])
            }
            form => {
                let reach = py(reach);
                let z = match form {
                    DAHL => format!(
                        "xp.sign(d) + (memory[1] - xp.sign(d)) * xp.exp(-xp.abs(d) / {reach})"
                    ),
                    _ => format!("xp.clip(memory[1] + d / {reach}, -1.0, 1.0)"),
                };
                let after = "memory = (q, z)".to_string();
                ("(q, 0.0 * q)".to_string(), vec![format!("z = {z}"), after])
            }
        };
        lines.insert(0, "d = q - memory[0]".into());
        (start, lines)
    }

    fn step(&mut self, q: f64) -> f64 {
        let d = q - self.at;
        self.at = q;
        match self.form {
            DAHL => {
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
