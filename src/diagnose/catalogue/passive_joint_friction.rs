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
    fn robots(&self) -> Robots {
        Robots::Closed
    }

    fn places(&self, _cx: &Context) -> Vec<Place> {
        vec![Place::Robot]
    }

    fn apply(&self, cx: &Context, e: &Estimate, robot: &mut Robot) -> Option<Part> {
        for c in passive(cx) {
            let terms = &mut robot.joints[c].terms;
            terms[JointTerm::Coulomb as usize] += e.eta[0];
            terms[JointTerm::Viscous as usize] += e.eta[1];
        }
        Some(Part::Term(JointTerm::Coulomb))
    }

    fn columns(&self, cx: &Context, _place: &Place, _shape: &Shape, _draft: bool) -> Vec<Column> {
        let passive = passive(cx);
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
        let dry = friction(&|v, top| crate::diagnose::window::sign(v, 2e-3 * top));
        let viscous = friction(&|v, _| v);
        dry.into_iter().chain(viscous).collect()
    }

    fn plausible(&self, _cx: &Context, _place: &Place, _shape: &Shape, eta: &[f64]) -> bool {
        eta.iter().sum::<f64>() > 0.0
    }

    fn values(&self, _cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate { eta, std, .. } = e;
        vec![
            value("coulomb", eta[0], std[0], "N m"),
            value("viscous", eta[1], std[1], "N m s/rad"),
        ]
    }
}

/// Coordinates that turn and that no motor drives.
fn passive(cx: &Context) -> Vec<usize> {
    let plant = cx.data.plant;
    let names = plant.coordinate_names();
    (0..plant.robot().dof())
        .filter(|c| {
            let joint = &plant.robot().joints[*c];
            !plant.actuated().contains(c)
                && joint.motion == Motion::Revolute
                && !names.contains(&joint.name)
        })
        .collect()
}
