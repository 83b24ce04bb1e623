//! A kinematic error of the gear that repeats with its turn, with the inertia that it shakes.

use super::spring::Springs;
use super::*;
use crate::diagnose::window::{FINE, fine_pair, fine_values};
use crate::signals::wiener::likewise;

/// Transmission error.
pub struct TransmissionError;

/// Its shapes have an order, and on a spring the natural frequency of the link, Hz.
const SPRUNG: u8 = 1;
/// Orders per turn of the motor that are tried on a spring.
const SPRUNG_ORDERS: [f64; 3] = [1.0, 2.0, 4.0];
/// Natural frequencies that are tried.
const FREQUENCIES: [f64; 4] = [20.0, 30.0, 45.0, 70.0];
/// Damping ratio of that spring.
const DAMPING: f64 = 0.05;

impl Effect for TransmissionError {
    fn card(&self) -> Card {
        Card {
            name: "transmission_error",
            title: "transmission error",
            equation: "M d²/dt² (a sin kNq + b cos kNq), or the same on a spring",
            source: "Tuttle & Seering 1996; Ghorbel, Gandhi & Alpeter 2001",
            aliases: &[],
            separated_by: "slow constant speed: a line in position; two speeds tell ripple from kinematic error",
        }
    }
    fn robots(&self) -> Robots {
        Robots::Open
    }

    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.singles()
    }

    fn shapes(&self, cx: &Context, place: &Place) -> Vec<Shape> {
        let mut all = super::cogging::orders(cx, place.first());
        let ratio = cx.data.plant.actuators()[place.first()].gear_ratio;
        let orders = all.iter().map(|s| s[0]);
        let few: Vec<f64> = match ratio {
            Some(ratio) => orders
                .filter(|k| SPRUNG_ORDERS.map(|n| n * ratio.abs()).contains(k))
                .collect(),
            None => orders.take(SPRUNG_ORDERS.len()).collect(),
        };
        // those on one spring together: what its load does is the same for all
        let sprung = |f: f64| few.iter().map(move |k| Shape::new(SPRUNG, &[*k, f]));
        all.extend(FREQUENCIES.into_iter().flat_map(sprung));
        all
    }

    fn forms(&self) -> u8 {
        2
    }

    fn refinable(&self, _shape: &Shape, k: usize) -> bool {
        k == 1
    }

    /// On a spring it comes with what the load makes the spring do, of which there is as much as of any joint's.
    fn plausible(&self, _cx: &Context, _place: &Place, shape: &Shape, eta: &[f64]) -> bool {
        shape.form != SPRUNG || eta[2] > 0.4 && eta[2] < 2.0
    }

    fn element(&self, _cx: &Context, e: &Estimate) -> Option<Element> {
        if e.shape.form == SPRUNG {
            return None;
        }
        let k = e.shape[0];
        let [sine, cosine, order] = [e.eta[0] / (k * k), e.eta[1] / (k * k), k].map(py);
        let lines = vec![
            format!("sine, cosine = xp.sin({order} * q), xp.cos({order} * q)"),
            format!("way = {sine} * sine + {cosine} * cosine"),
            format!("slope = {order} * ({sine} * cosine - {cosine} * sine)"),
            format!("return way, slope * dq, slope * ddq - {order} ** 2 * way * dq**2"),
        ];
        Some(Element::of(Kind::Displacement, e.place.first(), lines))
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, draft: bool) -> Vec<Column> {
        self.each(cx, place, std::slice::from_ref(shape), draft)
            .remove(0)
    }

    fn drafts(&self, cx: &Context, place: &Place, shapes: &[Shape]) -> Vec<Vec<Column>> {
        self.each(cx, place, shapes, true)
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place,
            shape,
            eta,
            std,
        } = e;
        let unit = cx.unit(place.first(), Quantity::Position);
        let scale = 1.0 / (shape[0] * shape[0]);
        let amplitude = eta[0].hypot(eta[1]);
        let per = cx.unit(place.first(), Quantity::Order);
        let mut all = vec![
            value(
                "amplitude",
                scale * amplitude,
                scale * std[0].max(std[1]),
                unit,
            ),
            value(
                "phase",
                eta[1].atan2(eta[0]),
                std[0].max(std[1]) / amplitude.max(1e-300),
                "rad",
            ),
            constant("per_position", shape[0], per),
        ];
        if shape.form == SPRUNG {
            all.push(constant("natural_frequency", shape[1], "Hz"));
        }
        all
    }
}

impl TransmissionError {
    /// Columns of several shapes; of a draft only the rows of the joint itself.
    fn each(&self, cx: &Context, place: &Place, shapes: &[Shape], draft: bool) -> Vec<Vec<Column>> {
        let j = place.first();
        let column = |parts: &[Vec<f64>]| {
            let of = parts.iter().zip(&cx.data.records);
            // the acceleration of the motor, which nearly makes up for it where the motor is free to follow, ends there
            let all = of.flat_map(|(x, r)| likewise(x, r.cycle, r.dt));
            cx.inertial(j, &all.collect::<Vec<f64>>(), draft)
        };
        // what the load makes a spring do, for as long as the spring is the same
        let mut load: Option<(f64, Column)> = None;
        let mut of = |shape: &Shape| {
            let both = cx.data.records.iter().map(|r| match shape.form {
                SPRUNG => swung(r, j, [shape[0], shape[1]]),
                _ => shaken(r, j, shape[0]),
            });
            let (sines, cosines): (Vec<_>, Vec<_>) = both.map(|[s, c]| (s, c)).unzip();
            let mut columns = vec![column(&sines), column(&cosines)];
            if shape.form == SPRUNG {
                if load.as_ref().is_none_or(|l| l.0 != shape[1]) {
                    let springs = Springs::soft(shape[1], DAMPING);
                    let records = cx.data.records.iter().enumerate();
                    let swings = records.map(|(i, r)| {
                        let carried = spring::carried(cx, j, i);
                        let [.., a] = spring::way(carried, r.dt, springs, r.cycle);
                        a
                    });
                    load = Some((shape[1], column(&swings.collect::<Vec<_>>())));
                }
                columns.extend(load.iter().map(|l| l.1.clone()));
            }
            columns
        };
        shapes.iter().map(&mut of).collect()
    }
}

/// `1/k²` times the accelerations of `sin kq` and `cos kq`.
fn shaken(r: &Series, j: usize, k: f64) -> [Vec<f64>; 2] {
    let ((q, v), a) = (r.state(j), r.acceleration(j));
    let mut steps = 0..;
    // k q̈ cos kq − k² q̇² sin kq, and −k q̈ sin kq − k² q̇² cos kq
    fine_pair([q, v, a], r.dt, |q, v, _| {
        let step: usize = steps.next().unwrap_or_default();
        let a = a[(step / FINE).min(a.len() - 1)];
        let (sin, cos) = (k * q).sin_cos();
        [a / k * cos - v * v * sin, -a / k * sin - v * v * cos]
    })
}

/// `1/k²` times the accelerations of a link on a spring that `e = sin kq` and `e = cos kq` move the end of:
/// `ẍ = ω² (e − x) + 2 ζ ω (ė − ẋ)`.
fn swung(r: &Series, j: usize, [k, frequency]: [f64; 2]) -> [Vec<f64>; 2] {
    let ((q, v), a) = (r.state(j), r.acceleration(j));
    let omega = std::f64::consts::TAU * frequency;
    let h = r.dt / FINE as f64;
    let mut states: Option<[[f64; 2]; 2]> = None;
    let mut step = |q: f64, v: f64, _: f64| {
        let (sin, cos) = (k * q).sin_cos();
        let ends = [[sin, k * v * cos], [cos, -k * v * sin]];
        let states = states.get_or_insert(ends);
        [0, 1].map(|w| {
            let ([e, rate], [x, u]) = (ends[w], &mut states[w]);
            let a = omega * omega * (e - *x) + 2.0 * DAMPING * omega * (rate - *u);
            *u += h * a;
            *x += h * *u;
            a / (k * k)
        })
    };
    // a motion that repeats goes on as it was before
    if let Some(cycle) = r.cycle {
        let [q, v, a] = [q, v, a].map(|x| &x[..cycle]);
        fine_values(q, v, a, r.dt, |q, v, t| step(q, v, t)[0]);
    }
    fine_pair([q, v, a], r.dt, step)
}
