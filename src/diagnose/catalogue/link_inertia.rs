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

    fn columns(&self, cx: &Context, place: &[usize], _shape: &[f64], _draft: bool) -> Vec<Column> {
        let robot = cx.data.plant.robot();
        let body = robot.bodies.iter().position(|b| b.coordinate == place[0]);
        body.map_or_else(Vec::new, |b| body_columns(cx, b, 10))
    }

    fn values(
        &self,
        _cx: &Context,
        _place: &[usize],
        _shape: &[f64],
        eta: &[f64],
        std: &[f64],
    ) -> Vec<Value> {
        let names = [
            "m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz",
        ];
        (0..10)
            .map(|k| value(names[k], eta[k], std[k], crate::robot::inertia::UNITS[k]))
            .collect()
    }
}

/// The first columns of the regressor of one body.
pub(crate) fn body_columns(cx: &Context, body: usize, count: usize) -> Vec<Column> {
    (0..count)
        .filter_map(|k| {
            let kind = Kind::Inertial { body, k };
            let c = cx.data.parameters.iter().position(|p| p.kind == kind)?;
            let rows = (0..cx.data.joints())
                .map(|j| (j, cx.data.w[j].col(c).iter().copied().collect()))
                .collect();
            Some(prune(Column { rows }, 0))
        })
        .collect()
}
