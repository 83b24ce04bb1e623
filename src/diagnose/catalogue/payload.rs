//! Payload: mass on the last link or the platform that the model does not have, `Y_n (m, m c)`.

use super::*;
use crate::report::format::significant;

/// Payload.
pub struct Payload;

/// Heaviest load of a robot, over the mass of its moving parts: small parallel robots carry more than they weigh.
const HEAVIEST: f64 = 3.0;
/// A point mass.
const POINT: u8 = 0;
/// With an inertia of its own.
const BODY: u8 = 1;

impl Effect for Payload {
    fn card(&self) -> Card {
        Card {
            name: "payload",
            title: "payload",
            equation: "Y_n(q, q̇, q̈) (m, m c)",
            source: "Khalil, Gautier & Lemoine 2007; Swevers et al. 2002",
            aliases: &["link_inertia"],
            separated_by: "the same motion with and without the load, and several static poses of the wrist",
        }
    }
    fn hides(&self) -> bool {
        true
    }

    fn moments(&self) -> usize {
        4
    }

    fn places(&self, cx: &Context) -> Vec<Place> {
        let plant = cx.data.plant;
        let place = |body| plant.driver(body).map_or(Place::Robot, Place::Actuator);
        plant.tool().map(place).into_iter().collect()
    }

    fn shapes(&self, _cx: &Context, _place: &Place) -> Vec<Shape> {
        vec![Shape::new(POINT, &[]), Shape::new(BODY, &[])]
    }

    fn forms(&self) -> u8 {
        2
    }

    fn familiarity(&self) -> f64 {
        2.0
    }

    fn apply(&self, cx: &Context, e: &Estimate, robot: &mut Robot) -> Option<Part> {
        let b = cx.data.plant.tool()?;
        let load = load(e);
        robot.bodies[b].inertia = robot.bodies[b].inertia + load;
        Some(Part::Bodies)
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        Some(Element::Load {
            body: cx.data.plant.tool()?,
            inertia: load(e),
        })
    }

    fn columns(&self, cx: &Context, _place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let Some(body) = cx.data.plant.tool() else {
            return Vec::new();
        };
        let count = if shape.form == POINT { 4 } else { 10 };
        let size = 10 * cx.data.plant.robot().bodies.len();
        let column = |k: usize| {
            let mut phi = vec![0.0; size];
            phi[10 * body + k] = 1.0;
            closed_column(cx, &phi)
        };
        let all: Option<Vec<Column>> = (0..count).map(column).collect();
        all.unwrap_or_else(|| link_inertia::body_columns(cx, body, count))
    }

    fn plausible(&self, _cx: &Context, _place: &Place, _shape: &Shape, eta: &[f64]) -> bool {
        eta[0] > 0.0
    }

    fn impossible(
        &self,
        cx: &Context,
        _place: &Place,
        _shape: &Shape,
        eta: &[f64],
    ) -> Option<String> {
        let bodies = cx.data.plant.robot().bodies.iter();
        let own: f64 = bodies.map(|b| b.inertia.mass()).sum();
        if own > 0.0 && eta[0] > HEAVIEST * own {
            return Some(format!(
                "it would be a load of {} kg on a robot whose moving parts have {} kg",
                significant(eta[0], 3),
                significant(own, 3)
            ));
        }
        let (away, reach) = (away(eta), T.carried.reach);
        (away > reach).then(|| {
            format!(
                "its centre of mass would be {} m from the frame that carries it, and loads are looked for within {reach} m",
                significant(away, 3)
            )
        })
    }

    fn values(&self, _cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate { eta, std, .. } = e;
        let m = eta[0];
        let com = |k: usize| {
            let s = (std[k] / m).hypot(eta[k] * std[0] / (m * m));
            (eta[k] / m, s)
        };
        let [(x, sx), (y, sy), (z, sz)] = [com(1), com(2), com(3)];
        vec![
            value("mass", m, std[0], "kg"),
            value("com_x", x, sx, "m"),
            value("com_y", y, sy, "m"),
            value("com_z", z, sz, "m"),
        ]
    }
}

/// Distance of the centre of mass from the frame that carries the load, from its mass and first moments, m.
pub fn away(eta: &[f64]) -> f64 {
    eta[1].hypot(eta[2]).hypot(eta[3]) / eta[0]
}

/// The load as a body.
fn load(e: &Estimate) -> Inertia {
    let load = Inertia(std::array::from_fn(|k| {
        e.eta.get(k).copied().unwrap_or(0.0)
    }));
    match (e.shape.form, load.com()) {
        // what was fitted is a mass and its moments; the inertia is that of a point
        (POINT, Some(c)) => Inertia::from_com(load.mass(), c, Default::default()),
        _ => load,
    }
}
