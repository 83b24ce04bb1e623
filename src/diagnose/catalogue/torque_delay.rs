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
    fn places(&self, cx: &Context) -> Vec<Place> {
        let mut all = vec![Place::Robot];
        if cx.data.joints() > 1 {
            all.extend(cx.singles());
        }
        all
    }

    fn shapes(&self, cx: &Context, _place: &Place) -> Vec<Shape> {
        let dt = cx.data.records[0].dt;
        let mut all = Vec::new();
        for d in [0.4, 0.7, 1.0, 1.4, 2.0, 3.0] {
            all.push(Shape::of(&[d * dt]));
            all.push(Shape::of(&[-d * dt]));
        }
        all
    }

    fn refinable(&self, _shape: &Shape, _k: usize) -> bool {
        true
    }

    fn is_alike(&self) -> bool {
        true
    }

    fn late(&self) -> bool {
        true
    }

    fn ahead(&self, shape: &Shape, eta: &[f64]) -> Option<f64> {
        Some(-shape[0] * eta[0]).filter(|t| *t > 0.0)
    }

    /// A torque that comes late leaves a gap that it explains. One ahead of the positions is close to what many effects leave in
    /// part: soft friction that reverses early, a wheel that runs out of true, an elastic gear.
    fn of_a_part(&self, shape: &Shape) -> bool {
        shape[0] > 0.0
    }

    fn moves_parameters(&self, shape: &Shape) -> bool {
        shape[0] > 0.0
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        Some(Element::Delay {
            joints: e.place.actuators(cx.data.joints()),
            seconds: e.shape[0] * e.eta[0],
        })
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let rows = (0..cx.data.joints())
            .filter(|j| place.includes(*j))
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

    fn plausible(&self, _cx: &Context, _place: &Place, _shape: &Shape, eta: &[f64]) -> bool {
        eta[0] > 0.5 && eta[0] < 1.6
    }

    fn values(&self, _cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            shape, eta, std, ..
        } = e;
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
