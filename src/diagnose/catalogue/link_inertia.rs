//! Inertial parameters of one link far from their nominal values.

use super::*;

/// Link inertia error.
pub struct LinkInertia;

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

    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        if !cx.serial() {
            return Vec::new();
        }
        cx.data
            .plant
            .robot()
            .bodies
            .iter()
            .map(|b| vec![b.coordinate])
            .collect()
    }

    fn shapes(&self, _cx: &Context, _place: &[usize]) -> Vec<Vec<f64>> {
        // all ten parameters in proportion, a point mass, or all ten
        vec![vec![1.0], vec![4.0], vec![10.0]]
    }

    fn columns(&self, cx: &Context, place: &[usize], shape: &[f64], _draft: bool) -> Vec<Column> {
        let robot = cx.data.plant.robot();
        let body = robot.bodies.iter().position(|b| b.coordinate == place[0]);
        body.map_or_else(Vec::new, |b| match shape[0] as usize {
            1 => in_proportion(cx, b).into_iter().collect(),
            count => body_columns(cx, b, count),
        })
    }

    fn values(
        &self,
        cx: &Context,
        place: &[usize],
        shape: &[f64],
        eta: &[f64],
        std: &[f64],
    ) -> Vec<Value> {
        let names = [
            "m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz",
        ];
        let unit = |k: usize| crate::robot::inertia::UNITS[k];
        if shape[0] == 1.0 {
            let robot = cx.data.plant.robot();
            let body = robot.bodies.iter().find(|b| b.coordinate == place[0]);
            let m = body.map_or(0.0, |b| b.inertia.mass());
            return vec![
                value("m", eta[0] * m, std[0] * m.abs(), unit(0)),
                value("share_of_nominal", eta[0], std[0], ""),
            ];
        }
        (0..eta.len())
            .map(|k| value(names[k], eta[k], std[k], unit(k)))
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
            let kind = Kind::Inertial { body, k };
            let c = cx.data.parameters.iter().position(|p| p.kind == kind)?;
            let rows = (0..cx.data.joints())
                .map(|j| (j, cx.data.w[j].col(c).iter().copied().collect()))
                .collect();
            let live = prune(Column { rows });
            Some(match live.rows.is_empty() {
                true => Column::on(0, vec![0.0; cx.data.rows()]),
                false => live,
            })
        })
        .collect()
}
