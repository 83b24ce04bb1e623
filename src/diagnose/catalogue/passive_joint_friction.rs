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
        let plant = cx.data.plant;
        let names = plant.coordinate_names();
        let passive: Vec<usize> = (0..plant.robot().dof())
            .filter(|c| {
                let joint = &plant.robot().joints[*c];
                !plant.actuated().contains(c)
                    && joint.motion == Motion::Revolute
                    && !names.contains(&joint.name)
            })
            .collect();
        let friction = |law: &dyn Fn(f64, f64) -> f64| {
            projected(cx, |motion| {
                let (tree, count) = (&motion.tree, motion.tree.count);
                let mut gamma = vec![0.0; tree.dof * count];
                for c in &passive {
                    let row = c * count..(c + 1) * count;
                    let rates = &tree.qd[row.clone()];
                    let top = rates.iter().fold(1e-9f64, |m, v| m.max(v.abs()));
                    for (g, v) in gamma[row].iter_mut().zip(rates) {
                        *g = law(*v, top);
                    }
                }
                gamma
            })
        };
        let dry = friction(&|v, top| crate::diagnose::data::sign(v, 2e-3 * top));
        let viscous = friction(&|v, _| v);
        dry.into_iter().chain(viscous).collect()
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
