//! Inertial parameters of one link far from their nominal values.

use super::*;

/// Link inertia error.
pub struct LinkInertia;

/// All ten parameters in proportion.
const SHARE: u8 = 0;
/// Mass and first moments.
const POINT: u8 = 1;
/// All ten parameters, each by itself.
const WHOLE: u8 = 2;

impl Effect for LinkInertia {
    fn card(&self) -> Card {
        Card {
            name: "link_inertia",
            title: "link inertia error",
            equation: "Y_k(q, q̇, q̈) Δφ_k",
            source: "Atkeson, An & Hollerbach 1986",
            aliases: &["payload"],
            separated_by: "motions that move the link in several poses of the joints before it",
        }
    }
    fn hides(&self) -> bool {
        true
    }

    fn moments(&self) -> usize {
        4
    }

    fn robots(&self) -> Robots {
        Robots::Open
    }

    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.data
            .plant
            .robot()
            .bodies
            .iter()
            .map(|b| Place::Actuator(b.coordinate))
            .collect()
    }

    fn shapes(&self, _cx: &Context, _place: &Place) -> Vec<Shape> {
        [SHARE, POINT, WHOLE]
            .map(|form| Shape::new(form, &[]))
            .to_vec()
    }

    fn forms(&self) -> u8 {
        3
    }

    fn familiarity(&self) -> f64 {
        // a wide family that imitates others
        -2.0
    }

    fn apply(&self, cx: &Context, e: &Estimate, robot: &mut Robot) -> Option<Part> {
        let nominal = &cx.data.plant.robot().bodies;
        let b = nominal
            .iter()
            .position(|b| b.coordinate == e.place.first())?;
        let more = match e.shape.form {
            SHARE => Inertia(nominal[b].inertia.0.map(|x| e.eta[0] * x)),
            _ => Inertia(std::array::from_fn(|k| {
                e.eta.get(k).copied().unwrap_or(0.0)
            })),
        };
        robot.bodies[b].inertia = robot.bodies[b].inertia + more;
        Some(Part::Bodies)
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let robot = cx.data.plant.robot();
        let body = robot
            .bodies
            .iter()
            .position(|b| b.coordinate == place.first());
        body.map_or_else(Vec::new, |b| match shape.form {
            SHARE => in_proportion(cx, b).into_iter().collect(),
            POINT => body_columns(cx, b, 4),
            _ => body_columns(cx, b, 10),
        })
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place,
            shape,
            eta,
            std,
        } = e;
        use crate::robot::inertia::NAMES;
        let unit = |k: usize| crate::robot::inertia::UNITS[k];
        if shape.form == SHARE {
            let robot = cx.data.plant.robot();
            let body = robot.bodies.iter().find(|b| b.coordinate == place.first());
            let m = body.map_or(0.0, |b| b.inertia.mass());
            return vec![
                value("m", eta[0] * m, std[0] * m.abs(), unit(0)),
                value("share_of_nominal", eta[0], std[0], ""),
            ];
        }
        (0..eta.len())
            .map(|k| value(NAMES[k], eta[k], std[k], unit(k)))
            .collect()
    }
}

/// What a body adds when all its parameters grow in proportion.
fn in_proportion(cx: &Context, body: usize) -> Option<Column> {
    let inertia = cx.data.plant.robot().bodies[body].inertia.0;
    let parts = body_columns(cx, body, 10);
    let mut rows = vec![vec![0.0; cx.data.rows()]; cx.data.joints()];
    for (part, scale) in parts.iter().zip(inertia) {
        for (j, values) in &part.rows {
            rows[*j]
                .iter_mut()
                .zip(values)
                .for_each(|(r, v)| *r += scale * v);
        }
    }
    let column = prune(Column {
        rows: rows.into_iter().enumerate().collect(),
    });
    (!column.rows.is_empty()).then_some(column)
}

/// The first columns of the regressor of one body; a parameter that never acts has a column of zeros.
pub(crate) fn body_columns(cx: &Context, body: usize, count: usize) -> Vec<Column> {
    (0..count)
        .filter_map(|k| {
            let kind = plant::Column::Inertial { body, k };
            let c = cx.data.parameters.iter().position(|p| p.kind == kind)?;
            let rows = (0..cx.data.joints())
                .filter_map(|j| Some((j, cx.data.w[j].get(c)?.to_vec())))
                .collect();
            let live = prune(Column { rows });
            Some(match live.rows.is_empty() {
                true => Column::on(0, vec![0.0; cx.data.rows()]),
                false => live,
            })
        })
        .collect()
}
