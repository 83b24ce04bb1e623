//! Legs or forearms of a parallel robot whose inertia the model leaves out.

use super::*;
use crate::robot::inertia::UNITS;

/// Neglected leg inertia.
pub struct LegInertia;

impl Effect for LegInertia {
    fn card(&self) -> Card {
        Card {
            name: "leg_inertia",
            title: "neglected leg inertia",
            equation: "Gᵀ Y_leg φ_leg, all legs alike, their parts bodies of revolution",
            source: "Vivas et al. 2003; Codourey 1996",
            aliases: &[],
            separated_by: "large rotations of the platform",
        }
    }
    fn hides(&self) -> bool {
        true
    }

    fn robots(&self) -> Robots {
        Robots::Closed
    }

    fn places(&self, cx: &Context) -> Vec<Place> {
        match unknowns(cx).is_empty() {
            true => Vec::new(),
            false => vec![Place::Robot],
        }
    }

    fn apply(&self, cx: &Context, e: &Estimate, robot: &mut Robot) -> Option<Part> {
        for (u, eta) in unknowns(cx).iter().zip(&e.eta) {
            for b in &u.bodies {
                u.parts
                    .iter()
                    .for_each(|k| robot.bodies[*b].inertia.0[*k] += eta);
            }
        }
        Some(Part::Bodies)
    }

    fn columns(&self, cx: &Context, _place: &Place, _shape: &Shape, _draft: bool) -> Vec<Column> {
        legs(cx).unwrap_or_default()
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate { eta, std, .. } = e;
        let unknowns = unknowns(cx);
        let numbers = eta.iter().zip(std);
        unknowns
            .iter()
            .zip(numbers)
            .map(|(u, (eta, std))| value(u.name, *eta, *std, u.unit))
            .collect()
    }
}

/// One inertial parameter that bodies of a kind share.
struct Unknown {
    name: &'static str,
    unit: &'static str,
    bodies: Vec<usize>,
    /// places among the ten of a body that are equal
    parts: &'static [usize],
}

/// Parts of a leg by the beginning of their name, with the names of `m`, `mz`, `Ixx = Iyy`, `Izz`.
const KINDS: [(&str, [&str; 4]); 4] = [
    (
        "cylinder",
        ["cylinder_m", "cylinder_mz", "cylinder_Ixx", "cylinder_Izz"],
    ),
    ("rod", ["rod_m", "rod_mz", "rod_Ixx", "rod_Izz"]),
    ("arm", ["arm_m", "arm_mz", "arm_Ixx", "arm_Izz"]),
    ("bar", ["bar_m", "bar_mz", "bar_Ixx", "bar_Izz"]),
];
const REVOLUTION: [&[usize]; 4] = [&[0], &[3], &[4, 7], &[9]];

/// Parameters of the parts of the legs of a hexapod, H4 or Delta that are neither the platform nor stood for by an unknown of
/// the nominal model; where some have no mass in it, only of those. Crosses of universal joints
/// count as massless.
fn unknowns(cx: &Context) -> Vec<Unknown> {
    if !chain::legs_alike(cx.data.plant) {
        return Vec::new();
    }
    let stands = |body: usize| {
        cx.data
            .parameters
            .iter()
            .any(|p| matches!(p.kind, plant::Column::Inertial { body: b, .. } if b == body))
    };
    let bodies = &cx.data.plant.robot().bodies;
    let of = |kind: &str| -> Vec<usize> {
        let fits = |b: &usize| {
            let name = &bodies[*b].name;
            name.starts_with(kind) && !name.ends_with("_cross")
        };
        (0..bodies.len()).filter(fits).collect()
    };
    // bodies that share their unknowns are known by the first of them
    let free: Vec<(Vec<usize>, [&'static str; 4])> = KINDS
        .iter()
        .map(|(kind, names)| (of(kind), *names))
        .filter(|(list, _)| !list.is_empty() && !list.iter().any(|b| stands(*b)))
        .collect();
    let massless = |list: &[usize]| list.iter().all(|b| bodies[*b].inertia.mass() == 0.0);
    let some = free.iter().any(|(list, _)| massless(list));
    free.into_iter()
        .filter(|(list, _)| !some || massless(list))
        .flat_map(|(list, names)| {
            let one = move |(name, parts): (&'static str, &'static [usize])| Unknown {
                name,
                unit: UNITS[parts[0]],
                bodies: list.clone(),
                parts,
            };
            names.into_iter().zip(REVOLUTION).map(one)
        })
        .collect()
}

fn legs(cx: &Context) -> Option<Vec<Column>> {
    let count = 10 * cx.data.plant.robot().bodies.len();
    unknowns(cx)
        .iter()
        .map(|u| {
            let mut phi = vec![0.0; count];
            for body in &u.bodies {
                u.parts.iter().for_each(|k| phi[10 * body + k] = 1.0);
            }
            closed_column(cx, &phi)
        })
        .collect()
}
