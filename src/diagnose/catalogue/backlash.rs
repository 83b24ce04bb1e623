//! A gap in the transmission: the link falls from flank to flank when the transmitted torque changes sign.

use super::spring::Springs;
use super::*;

/// Backlash.
pub struct Backlash;

impl Effect for Backlash {
    fn card(&self) -> Card {
        Card {
            name: "backlash",
            title: "backlash",
            equation: "M δ̈ with δ the way through a dead zone b onto springs",
            source: "Nordin & Gutman 2002",
            aliases: &[],
            separated_by: "a bias torque by gravity: backlash vanishes, Coulomb friction stays",
        }
    }
    fn robots(&self) -> Robots {
        Robots::Open
    }

    fn places(&self, cx: &Context) -> Vec<Place> {
        // the transmitted torque must change its sign
        let crosses = |j: &usize| {
            let (lo, hi) = cx.rigid[*j]
                .iter()
                .fold((0.0f64, 0.0f64), |(a, b), v| (a.min(*v), b.max(*v)));
            lo < -0.01 * cx.peak[*j] && hi > 0.01 * cx.peak[*j]
        };
        (0..cx.data.joints())
            .filter(crosses)
            .map(Place::Actuator)
            .collect()
    }

    fn shapes(&self, _cx: &Context, _place: &Place) -> Vec<Shape> {
        let mut all = Vec::new();
        for frequency in [8.0, 16.0, 32.0, 60.0] {
            for gap in ladder(6e-4, 3e-2, 6) {
                for damping in [0.03, 0.15] {
                    all.push(Shape::of(&[gap, frequency, damping]));
                }
            }
        }
        all
    }

    fn refinable(&self, _shape: &Shape, _k: usize) -> bool {
        true
    }

    fn sways(&self) -> bool {
        true
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let joint = e.place.first();
        let [stiffness, damping, _] = spring::constants(cx, joint, e.shape[1], e.shape[2]);
        Some(Element::Twist {
            joint,
            stiffness,
            cubic: 0.0,
            damping,
            gap: e.shape[0],
        })
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, draft: bool) -> Vec<Column> {
        match draft {
            true => self
                .drafts(cx, place, std::slice::from_ref(shape))
                .remove(0),
            false => spring::whole(cx, place.first(), springs(shape)),
        }
    }

    fn drafts(&self, cx: &Context, place: &Place, shapes: &[Shape]) -> Vec<Vec<Column>> {
        let springs: Vec<Springs> = shapes.iter().map(springs).collect();
        spring::drafts(cx, place.first(), &springs, true)
    }

    fn plausible(&self, _cx: &Context, _place: &Place, _shape: &Shape, eta: &[f64]) -> bool {
        eta[0] > 0.3 && eta[0] < 2.5
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place,
            shape,
            eta,
            std,
        } = e;
        let j = place.first();
        let mass = cx.mass[j][j].iter().sum::<f64>() / cx.data.rows() as f64;
        let stiffness = mass * (2.0 * std::f64::consts::PI * shape[1]).powi(2);
        let unit = cx.unit(j, Quantity::Stiffness);
        vec![
            constant("gap", shape[0], cx.unit(j, Quantity::Position)),
            constant("contact_stiffness", stiffness, unit),
            value("scale", eta[0], std[0], ""),
        ]
    }
}

/// Gap, natural frequency of the link on a flank, damping ratio.
fn springs(shape: &Shape) -> Springs {
    Springs {
        gap: shape[0],
        frequency: shape[1],
        damping: shape[2],
        cubic: 0.0,
    }
}
