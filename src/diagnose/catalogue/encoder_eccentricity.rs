//! The disc of an encoder runs out of true: its error repeats once a turn.

use super::*;

/// Encoder eccentricity.
pub struct EncoderEccentricity;

impl Effect for EncoderEccentricity {
    fn card(&self) -> Card {
        Card {
            name: "encoder_eccentricity",
            title: "encoder eccentricity",
            equation: "∂τ/∂(q, q̇, q̈) of a sin q + b cos q",
            source: "Hollerbach & Wampler 1996",
            aliases: &[],
            separated_by: "full turns of the joint",
        }
    }
    fn hides(&self) -> bool {
        true
    }

    fn robots(&self) -> Robots {
        Robots::Open
    }

    fn places(&self, cx: &Context) -> Vec<Place> {
        let turns = |j: &usize| cx.motion(*j) == Motion::Revolute;
        (0..cx.data.joints())
            .filter(turns)
            .map(Place::Actuator)
            .collect()
    }

    fn element(&self, _cx: &Context, e: &Estimate) -> Option<Element> {
        let [sine, cosine] = [e.eta[0], e.eta[1]].map(py);
        let lines = vec![
            format!("way = {sine} * xp.sin(q) + {cosine} * xp.cos(q)"),
            format!("slope = {sine} * xp.cos(q) - {cosine} * xp.sin(q)"),
            "return way, slope * dq, slope * ddq - way * dq**2".into(),
        ];
        Some(Element::of(Kind::Displacement, e.place.first(), lines))
    }

    fn columns(&self, cx: &Context, place: &Place, _shape: &Shape, _draft: bool) -> Vec<Column> {
        let j = place.first();
        let wave = |phase: f64| {
            cx.displaced(j, move |r, _| {
                let (q, v) = r.state(j);
                let a = r.acceleration(j);
                let value = q.iter().map(|q| (q + phase).sin()).collect();
                let first = q
                    .iter()
                    .zip(v)
                    .map(|(q, v)| (q + phase).cos() * v)
                    .collect();
                let second = (0..r.count)
                    .map(|i| {
                        let (s, c) = (q[i] + phase).sin_cos();
                        c * a[i] - s * v[i] * v[i]
                    })
                    .collect();
                [value, first, second]
            })
        };
        vec![wave(0.0), wave(std::f64::consts::FRAC_PI_2)]
    }

    fn plausible(&self, _cx: &Context, _place: &Place, _shape: &Shape, eta: &[f64]) -> bool {
        eta[0].hypot(eta[1]) < 0.12
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place, eta, std, ..
        } = e;
        let unit = cx.unit(place.first(), Quantity::Position);
        vec![
            value("sine", eta[0], std[0], unit),
            value("cosine", eta[1], std[1], unit),
        ]
    }
}
