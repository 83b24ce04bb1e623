//! The base stands inclined: gravity has another direction in its axes.

use super::*;
use crate::dynamics::Tree;
use nalgebra::{Rotation3, Vector3};

/// Gravity direction (base tilt).
pub struct GravityDirection;

impl Effect for GravityDirection {
    fn card(&self) -> Card {
        Card {
            name: "gravity_direction",
            title: "gravity direction (base tilt)",
            equation: "∂τ_g/∂g₀ δg",
            source: "Khalil & Dombre 2002",
            aliases: &[],
            separated_by: "a slow full turn of a vertical first joint with the arm stretched, with two payloads",
        }
    }
    fn hides(&self) -> bool {
        true
    }

    fn places(&self, _cx: &Context) -> Vec<Place> {
        vec![Place::Robot]
    }

    fn apply(&self, _cx: &Context, e: &Estimate, robot: &mut Robot) -> Option<Part> {
        // in axes of the base that tilted, gravity turns back
        let back = -Vector3::new(e.eta[0], e.eta[1], 0.0);
        robot.gravity = Rotation3::from_scaled_axis(back) * robot.gravity;
        Some(Part::Gravity)
    }

    fn columns(&self, cx: &Context, _place: &Place, _shape: &Shape, _draft: bool) -> Vec<Column> {
        turned(cx).unwrap_or_else(|| {
            base_compliance::tilted(cx, |r, _, _| {
                [vec![1.0; r.count], vec![0.0; r.count], vec![0.0; r.count]]
            })
        })
    }

    fn plausible(&self, _cx: &Context, _place: &Place, _shape: &Shape, eta: &[f64]) -> bool {
        eta.iter().all(|t| t.abs() < 0.5)
    }

    fn values(&self, _cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate { eta, std, .. } = e;
        vec![
            value("tilt_x", eta[0], std[0], "rad"),
            value("tilt_y", eta[1], std[1], "rad"),
        ]
    }
}

/// Forces of a closed chain at rest under the change of gravity in base axes for tilts of the base
/// about its `x` and `y`: `δg = −e × g₀`.
fn turned(cx: &Context) -> Option<Vec<Column>> {
    let plant = cx.data.plant;
    let values = &cx.phi[..plant.parameters().len()];
    let bodies = plant.with_values(values).bodies;
    let phi: Vec<f64> = bodies.iter().flat_map(|b| b.inertia.0).collect();
    [Vector3::x(), Vector3::y()]
        .iter()
        .map(|axis| {
            let mut robot = plant.robot().clone();
            robot.gravity = -axis.cross(&robot.gravity);
            let tree = Tree::new(&robot);
            projected(cx, |motion| {
                let mut rest = motion.tree.clone();
                rest.qd.fill(0.0);
                rest.qdd.fill(0.0);
                let mut gamma = vec![0.0; rest.dof * rest.count];
                tree.inverse_dynamics(&mut Default::default(), &phi, &rest, &mut gamma);
                gamma
            })
        })
        .collect()
}
