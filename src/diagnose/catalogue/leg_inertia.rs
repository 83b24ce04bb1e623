//! Legs or forearms of a parallel robot whose inertia the model leaves out.

use super::*;

/// Neglected leg inertia.
pub struct LegInertia;

impl Effect for LegInertia {
    fn card(&self) -> Card {
        Card {
            name: "leg_inertia",
            title: "neglected leg inertia",
            equation: "Gᵀ Y_leg φ_leg, all legs alike",
            source: "Vivas et al. 2003; Codourey 1996",
            aliases: &[],
            separated_by: "large rotations of the platform",
        }
    }
    fn hides(&self) -> bool {
        true
    }

    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        if cx.serial() {
            Vec::new()
        } else {
            vec![Vec::new()]
        }
    }

    fn columns(&self, cx: &Context, _place: &[usize], _shape: &[f64], _draft: bool) -> Vec<Column> {
        legs(cx).unwrap_or_default()
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
        (0..eta.len().min(10))
            .map(|k| value(names[k], eta[k], std[k], crate::robot::inertia::UNITS[k]))
            .collect()
    }
}

/// Columns of one set of inertial parameters for every body that is neither the platform nor stood
/// for by an unknown of the nominal model.
fn legs(cx: &Context) -> Option<Vec<Column>> {
    let mechanism = cx.data.plant.mechanism()?;
    let known = |body: usize| {
        cx.data.parameters.iter().any(|p| match p.kind {
            Kind::Inertial { body: b, .. } => b == body,
            Kind::Term { .. } => false,
        })
    };
    let moves = |body: usize| {
        let joint = &mechanism.robot.joints[mechanism.robot.bodies[body].coordinate];
        !mechanism.task_names.contains(&joint.name)
    };
    let legs: Vec<usize> = (0..mechanism.robot.bodies.len())
        .filter(|b| moves(*b) && !known(*b))
        .collect();
    if legs.is_empty() {
        return None;
    }
    let n = cx.data.joints();
    let mut columns = vec![vec![Vec::with_capacity(cx.data.rows()); n]; 10];
    for r in &cx.data.records {
        let motion = mechanism.motion(&r.x).ok()?;
        for (k, column) in columns.iter_mut().enumerate() {
            let mut phi = vec![0.0; 10 * mechanism.robot.bodies.len()];
            legs.iter().for_each(|b| phi[10 * b + k] = 1.0);
            let mut gamma = vec![0.0; motion.tree.dof * r.count];
            mechanism.tree().inverse_dynamics(
                &mut Default::default(),
                &phi,
                &motion.tree,
                &mut gamma,
            );
            let tau = mechanism.project(&motion, &gamma);
            for (j, out) in column.iter_mut().enumerate() {
                out.extend(smooth(&tau[j * r.count..(j + 1) * r.count]));
            }
        }
    }
    Some(
        columns
            .into_iter()
            .map(|rows| Column {
                rows: rows.into_iter().enumerate().collect(),
            })
            .collect(),
    )
}
