//! Friction in the joints of a parallel robot that no motor drives.

use super::*;

/// Friction of passive joints.
pub struct PassiveJointFriction;

impl Effect for PassiveJointFriction {
    fn card(&self) -> Card {
        Card {
            name: "passive_joint_friction",
            title: "friction of passive joints",
            equation: "Gᵀ (F_c sgn q̇_p + F_v q̇_p)",
            source: "Grotjahn, Heimann & Abdellatif 2004; Farhat et al. 2008",
            aliases: &[],
            separated_by: "rotations of the platform at constant leg speed",
        }
    }
    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        if cx.serial() {
            Vec::new()
        } else {
            vec![Vec::new()]
        }
    }

    fn columns(&self, cx: &Context, _place: &[usize], _shape: &[f64], _draft: bool) -> Vec<Column> {
        let Some(mechanism) = cx.data.plant.mechanism() else {
            return Vec::new();
        };
        let n = cx.data.joints();
        let mut columns = vec![vec![Vec::new(); n]; 2];
        for r in &cx.data.records {
            let Ok(motion) = mechanism.motion(&r.x) else {
                return Vec::new();
            };
            let tree = &motion.tree;
            let passive = |c: usize| {
                !mechanism.actuated.contains(&c)
                    && mechanism.robot.joints[c].motion == Motion::Revolute
                    && !mechanism
                        .task_names
                        .contains(&mechanism.robot.joints[c].name)
            };
            for (which, column) in columns.iter_mut().enumerate() {
                let mut gamma = vec![0.0; tree.dof * r.count];
                for c in (0..tree.dof).filter(|c| passive(*c)) {
                    let row = &tree.qd[c * r.count..(c + 1) * r.count];
                    let top = row.iter().fold(1e-9f64, |m, v| m.max(v.abs()));
                    for (i, v) in row.iter().enumerate() {
                        gamma[c * r.count + i] = match which {
                            0 => crate::diagnose::data::sign(*v, 2e-3 * top),
                            _ => *v,
                        };
                    }
                }
                let tau = mechanism.project(&motion, &gamma);
                for (j, out) in column.iter_mut().enumerate() {
                    out.extend(smooth(&tau[j * r.count..(j + 1) * r.count]));
                }
            }
        }
        columns
            .into_iter()
            .map(|rows| Column {
                rows: rows.into_iter().enumerate().collect(),
            })
            .collect()
    }

    fn plausible(&self, _cx: &Context, _place: &[usize], _shape: &[f64], eta: &[f64]) -> bool {
        eta.iter().sum::<f64>() > 0.0
    }

    fn values(
        &self,
        _cx: &Context,
        _place: &[usize],
        _shape: &[f64],
        eta: &[f64],
        std: &[f64],
    ) -> Vec<Value> {
        vec![
            value("coulomb", eta[0], std[0], "N m"),
            value("viscous", eta[1], std[1], "N m s/rad"),
        ]
    }
}
