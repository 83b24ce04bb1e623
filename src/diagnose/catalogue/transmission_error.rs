//! A kinematic error of the gear that repeats with its turn, with the inertia that it shakes.

use super::*;

/// Transmission error.
pub struct TransmissionError;

impl Effect for TransmissionError {
    fn card(&self) -> Card {
        Card {
            name: "transmission_error",
            title: "transmission error",
            equation: "M d²/dt² (a sin kNq + b cos kNq)",
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
        super::cogging::orders(cx, place.first())
    }

    fn element(&self, _cx: &Context, e: &Estimate) -> Option<Element> {
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
        let (j, k) = (place.first(), shape[0]);
        // second derivative of sin kq: k q̈ cos kq − k² q̇² sin kq; per 1/k² to keep numbers near 1
        let shaken = |phase: f64| {
            let mut all = Vec::with_capacity(cx.data.rows());
            for r in &cx.data.records {
                let (q, v) = r.state(j);
                let a = r.acceleration(j);
                let mut i = 0;
                let values = crate::diagnose::window::fine_values(q, v, a, r.dt, |q, v, _| {
                    let a = a[(i / crate::diagnose::window::FINE).min(a.len() - 1)];
                    i += 1;
                    a / k * (k * q + phase).cos() - v * v * (k * q + phase).sin()
                });
                crate::diagnose::window::from_fine(&values, r.count, &mut all);
            }
            cx.inertial(j, &all, draft)
        };
        vec![shaken(0.0), shaken(std::f64::consts::FRAC_PI_2)]
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
        vec![
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
        ]
    }
}
