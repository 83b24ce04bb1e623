//! Legs or forearms of a parallel robot whose inertia the model leaves out.

use super::*;
use crate::export;
use crate::robot::Inertia;
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
        // what the model knows of a part is not shared out
        let unknown = |name| unknowns(cx).iter().any(|u| u.name == name);
        if unknown("cylinder_m") && unknown("rod_m") {
            share(robot);
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

/// Most of `Izz` over what `Ixx` leaves for it. A leg is slender, and it hardly turns about its axis: forces say next to
/// nothing of `Izz`, and what a fit says of it may be anything.
const SLENDER: f64 = 0.1;

/// Shares between cylinder and rod of each leg what forces cannot tell apart, so that both can exist where any two can. Legs
/// that can exist, or are no bodies of revolution, stay as they are.
///
/// A cylinder turns about a point that stays where it is, and the rod turns with it: the mass of the cylinder counts for
/// nothing, and of `Ixx` and `Izz` only the sums do. With `m`, `h` the rod's mass and first moment and `h_c` that of the
/// cylinder, bodies exist if `Ixx − h²/m > Izz/2` for the rod and the same holds with `h_c` for the cylinder. Of what the sum
/// has more than that the cylinder gets the larger part: it need not be heavy then.
fn share(robot: &mut Robot) {
    let named = |kind: &str, i: usize| {
        let name = format!("{kind}{i}");
        robot.bodies.iter().position(|b| b.name == name)
    };
    let legs: Vec<[usize; 2]> = (1..)
        .map_while(|i| Some([named("cylinder", i)?, named("rod", i)?]))
        .collect();
    for [cylinder, rod] in legs {
        let both = [cylinder, rod].map(|b| robot.bodies[b].inertia);
        let exists = |i: &Inertia| i.mass() > 0.0 && export::possible(i) == *i;
        let turned =
            |Inertia(i): &Inertia| i[4] == i[7] && [1, 2, 5, 6, 8].iter().all(|k| i[*k] == 0.0);
        if both.iter().all(exists) || !both.iter().all(turned) {
            continue;
        }
        let both = both.map(|i| i.0);
        let [across, along] = [4, 9].map(|k| both[0][k] + both[1][k]);
        let (mass, moment, of_cylinder) = (both[1][0], both[1][3], both[0][3]);
        let own = moment * moment / mass;
        let most = across - own;
        if !(mass > 0.0 && most > 0.0) {
            continue;
        }
        let along = along.clamp(0.0, SLENDER * most);
        let room = most - 0.5 * along;
        for (b, across) in [(cylinder, 0.8 * room), (rod, 0.2 * room + own)] {
            let i = &mut robot.bodies[b].inertia.0;
            i[4] = across + 0.25 * along;
            i[7] = i[4];
            i[9] = 0.5 * along;
        }
        // the mass that leaves it half of its part
        robot.bodies[cylinder].inertia.0[0] = of_cylinder * of_cylinder / (0.4 * room);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanism::Mechanism;

    /// What is shared changes no force, and makes bodies that can exist of such as cannot.
    #[test]
    fn cylinder_and_rod_share_what_forces_cannot_tell_apart() {
        let mut m: Mechanism = plant::Plant::load("hexapod")
            .unwrap()
            .mechanism()
            .unwrap()
            .clone();
        for b in &mut m.robot.bodies {
            let i = &mut b.inertia.0;
            match &b.name {
                n if n.starts_with("cylinder") => {
                    *i = [0.0, 0.0, 0.0, 1.1, 0.7, 0.0, 0.0, 0.7, 0.0, -0.01];
                }
                n if n.starts_with("rod") => {
                    *i = [2.5, 0.0, 0.0, -0.6, 0.1, 0.0, 0.0, 0.1, 0.0, 0.03];
                }
                _ => {}
            }
        }
        let before = plant::Plant::from(m.clone());
        assert!(!export::impossible(&before, before.robot()).is_empty());
        share(&mut m.robot);
        let after = plant::Plant::from(m);
        assert_eq!(
            export::impossible(&after, after.robot()),
            Vec::<usize>::new()
        );
        let x = before.random_states(50, 3);
        let tau = [&before, &after].map(|p| p.nominal_torque(&x).unwrap());
        let largest = tau[0].iter().fold(0.0f64, |m, v| m.max(v.abs()));
        for (a, b) in tau[0].iter().zip(&tau[1]) {
            assert!((a - b).abs() < 1e-11 * largest, "{a} {b}");
        }
    }

    /// Legs that can exist are left as they were found, and so are those that are no bodies of revolution.
    #[test]
    fn legs_that_need_no_sharing_stay_as_they_are() {
        let plant = plant::Plant::load("hexapod").unwrap();
        let mut robot = plant.robot().clone();
        share(&mut robot);
        let inertias = |r: &Robot| r.bodies.iter().map(|b| b.inertia).collect::<Vec<_>>();
        assert!(inertias(&robot) == inertias(plant.robot()));
        for b in &mut robot.bodies {
            if b.name.starts_with("cylinder") {
                b.inertia = Inertia([0.0, 0.0, 0.0, 1.1, 0.7, 0.0, 0.0, 0.6, 0.0, 0.01]);
            }
        }
        let crooked = inertias(&robot);
        share(&mut robot);
        assert!(inertias(&robot) == crooked);
    }
}
