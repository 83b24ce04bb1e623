//! Two joints share a part of their transmission.

use super::*;

/// Coupling of two joints.
pub struct JointCoupling;

impl Effect for JointCoupling {
    fn card(&self) -> Card {
        Card {
            name: "joint_coupling",
            title: "coupling of two joints",
            equation: "F_v (q̇_j ± q̇_k) + F_c sgn(q̇_j ± q̇_k) + I_a (q̈_j ± q̈_k) on both",
            source: "Gautier & Janot (Stäubli RX, TX wrists)",
            aliases: &[],
            separated_by: "one of the two joints moved with the other still, and both with opposite speed",
        }
    }
    fn robots(&self) -> Robots {
        Robots::Open
    }

    fn places(&self, cx: &Context) -> Vec<Place> {
        let n = cx.data.joints();
        (1..n)
            .filter(|k| cx.motion(*k) == cx.motion(k - 1))
            .map(|k| Place::Pair(k - 1, k))
            .collect()
    }

    fn shapes(&self, _cx: &Context, _place: &Place) -> Vec<Shape> {
        vec![Shape::of(&[1.0]), Shape::of(&[-1.0])]
    }

    fn element(&self, _cx: &Context, e: &Estimate) -> Option<Element> {
        let Place::Pair(j, k) = e.place else {
            return None;
        };
        Some(Element::Coupling {
            joints: [j, k],
            ratio: e.shape[0],
            coulomb: e.eta[0],
            viscous: e.eta[1],
            inertia: e.eta[2],
        })
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let Place::Pair(j, k) = *place else {
            return Vec::new();
        };
        let s = shape[0];
        let width = 1e-3 * (cx.data.speed[j] + cx.data.speed[k]);
        let sum = |r: &Series, of: fn(&Series, usize) -> Vec<f64>| -> Vec<f64> {
            of(r, j)
                .iter()
                .zip(of(r, k))
                .map(|(a, b)| a + s * b)
                .collect()
        };
        let position = |r: &Series, i: usize| r.state(i).0.to_vec();
        let velocity = |r: &Series, i: usize| r.state(i).1.to_vec();
        let acceleration = |r: &Series, i: usize| r.acceleration(i).to_vec();
        let both = |x: Vec<f64>| Column {
            rows: vec![(j, x.clone()), (k, x.iter().map(|v| s * v).collect())],
        };
        let mut coulomb = Vec::with_capacity(cx.data.rows());
        for r in &cx.data.records {
            let (q, v, a) = (sum(r, position), sum(r, velocity), sum(r, acceleration));
            let f = |_, v| crate::diagnose::window::sign(v, width);
            crate::diagnose::window::fine(&q, &v, &a, r.dt, f, &mut coulomb);
        }
        vec![
            both(coulomb),
            both(cx.data.each(|r, _| smooth(&sum(r, velocity)))),
            both(cx.data.each(|r, _| smooth(&sum(r, acceleration)))),
        ]
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place,
            shape,
            eta,
            std,
        } = e;
        let [viscous, inertia] = match cx.motion(place.first()) {
            Motion::Revolute => ["N m s/rad", "kg m^2"],
            Motion::Prismatic => ["N s/m", "kg"],
        };
        vec![
            value("coulomb", eta[0], std[0], cx.torque_unit(place.first())),
            value("viscous", eta[1], std[1], viscous),
            value("inertia", eta[2], std[2], inertia),
            constant("ratio", shape[0], ""),
        ]
    }
}
