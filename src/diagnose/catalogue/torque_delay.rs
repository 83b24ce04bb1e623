//! Torque and position are not of the same instant.

use super::*;

/// Delay of the torque.
pub struct TorqueDelay;

impl Effect for TorqueDelay {
    fn card(&self) -> Card {
        Card {
            name: "torque_delay",
            title: "delay of the torque",
            equation: "τ(t − δ) − τ(t)",
            source: "PACE; Janot, Gautier & Brunot 2019",
            aliases: &[],
            separated_by: "high frequencies; the same delay on all joints",
        }
    }
    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        let mut all = vec![Vec::new()];
        if cx.data.joints() > 1 {
            all.extend(cx.singles());
        }
        all
    }

    fn shapes(&self, cx: &Context, _place: &[usize]) -> Vec<Vec<f64>> {
        let dt = cx.data.records[0].dt;
        let mut all: Vec<Vec<f64>> = Vec::new();
        for d in [0.4, 0.7, 1.0, 1.4, 2.0, 3.0] {
            all.push(vec![d * dt]);
            all.push(vec![-d * dt]);
        }
        all
    }

    fn refinable(&self, _k: usize) -> bool {
        true
    }

    fn columns(&self, cx: &Context, place: &[usize], shape: &[f64], _draft: bool) -> Vec<Column> {
        let rows = (0..cx.data.joints())
            .filter(|j| place.is_empty() || place.contains(j))
            .map(|j| {
                let values = cx.data.each(|r, k| {
                    let x = &cx.model[j][cx.data.span(k)];
                    later(x, shape[0] / r.dt, r.cycle.is_some())
                });
                (j, values)
            })
            .collect();
        vec![Column { rows }]
    }

    fn plausible(&self, _cx: &Context, _place: &[usize], _shape: &[f64], eta: &[f64]) -> bool {
        eta[0] > 0.5 && eta[0] < 1.6
    }

    fn values(
        &self,
        _cx: &Context,
        _place: &[usize],
        shape: &[f64],
        eta: &[f64],
        std: &[f64],
    ) -> Vec<Value> {
        vec![value(
            "delay",
            shape[0] * eta[0],
            (shape[0] * std[0]).abs(),
            "s",
        )]
    }
}

/// `x(t − d) − x(t)` with `d` in samples, by linear interpolation.
fn later(x: &[f64], d: f64, wrap: bool) -> Vec<f64> {
    let n = x.len() as isize;
    let at = |i: isize| {
        x[if wrap {
            i.rem_euclid(n)
        } else {
            i.clamp(0, n - 1)
        } as usize]
    };
    let whole = d.floor();
    let w = d - whole;
    (0..n)
        .map(|i| {
            let i0 = i - whole as isize;
            (1.0 - w) * at(i0) + w * at(i0 - 1) - at(i)
        })
        .collect()
}
