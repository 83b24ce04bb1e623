//! The base tilts on springs under the moment that the robot exerts on it: `M δ̈ + D δ̇ + K δ = −τ_base`
//! about each axis, with the inertia `M` of the robot about the base.

use super::spring::{Carried, Springs};
use super::*;
use rayon::prelude::*;

/// Base compliance.
pub struct BaseCompliance;

impl Effect for BaseCompliance {
    fn card(&self) -> Card {
        Card {
            name: "base_compliance",
            title: "base compliance",
            equation: "tilt of M δ̈ + D δ̇ + K δ = −M_base, with its gravity and inertia",
            source: "Klimchik, Caro & Pashkevich 2013",
            aliases: &[],
            separated_by: "the same pose with another moment on the base",
        }
    }
    fn robots(&self) -> Robots {
        Robots::Open
    }

    fn places(&self, _cx: &Context) -> Vec<Place> {
        vec![Place::Robot]
    }

    fn shapes(&self, _cx: &Context, _place: &Place) -> Vec<Shape> {
        // natural frequency of the robot on its base, damping ratio
        let mut all = Vec::new();
        for frequency in [4.0, 6.0, 9.0, 13.0, 20.0, 40.0] {
            for damping in [0.05, 0.15] {
                all.push(Shape::of(&[frequency, damping]));
            }
        }
        all
    }

    fn refinable(&self, _shape: &Shape, _k: usize) -> bool {
        true
    }

    fn rings(&self, _shape: &Shape) -> bool {
        true
    }

    fn sways(&self) -> bool {
        true
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let base = cx.base();
        let omega = 2.0 * std::f64::consts::PI * e.shape[0];
        // a coefficient below 1 is a base that is heavy itself; none is one that does not tilt
        let of = |axis: usize| {
            let mean = base.mass[axis].iter().sum::<f64>() / base.mass[axis].len() as f64;
            let share = e.eta[axis].max(0.0);
            let stiffness = mean * omega * omega / share;
            let damping = 2.0 * e.shape[1] * mean * omega / share;
            [stiffness, damping, mean * (1.0 / share - 1.0)]
        };
        let [x, y] = [of(0), of(1)];
        Some(Element::Base {
            stiffness: [x[0], y[0]],
            damping: [x[1], y[1]],
            inertia: [x[2], y[2]],
        })
    }

    fn columns(&self, cx: &Context, _place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let load = cx.base();
        tilted(cx, |r, k, axis| {
            let span = cx.data.span(k);
            let carried = Carried {
                load: &load.moment[axis][span.clone()],
                mass: &load.mass[axis][span],
                slopes: [&[], &[]],
                measured: &r.measured,
            };
            let springs = Springs::soft(shape[0], shape[1]);
            spring::way(carried, r.dt, springs, r.cycle)
        })
    }

    fn plausible(&self, _cx: &Context, _place: &Place, shape: &Shape, eta: &[f64]) -> bool {
        // a coefficient below 1 is a base that is heavy itself; one that swings slowly cannot be
        let largest = eta.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        eta.iter().all(|t| *t > -0.3 * largest) && (largest > 0.4 || shape[0] > 25.0)
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            shape, eta, std, ..
        } = e;
        let omega = 2.0 * std::f64::consts::PI * shape[0];
        let soft = |axis: usize| {
            let mass = &cx.base().mass[axis];
            let mass = mass.iter().sum::<f64>() / mass.len() as f64;
            1.0 / (mass * omega * omega)
        };
        vec![
            value(
                "compliance_x",
                eta[0] * soft(0),
                std[0] * soft(0),
                "rad/(N m)",
            ),
            value(
                "compliance_y",
                eta[1] * soft(1),
                std[1] * soft(1),
                "rad/(N m)",
            ),
            constant("natural_frequency", shape[0], "Hz"),
        ]
    }
}

/// The robot on two more joints without mass that tilt its base about x and y.
fn on_joints(robot: &crate::Robot) -> crate::Robot {
    use nalgebra::{Matrix3, Vector3};
    let mut out = robot.clone();
    let (Some(body), Some(joint)) = (robot.bodies.first(), robot.joints.first()) else {
        return out;
    };
    for b in &mut out.bodies {
        b.parent = Some(b.parent.map_or(1, |p| p + 2));
        b.coordinate += 2;
    }
    for (k, axis) in [Vector3::y(), Vector3::x()].into_iter().enumerate() {
        let mut tilt = body.clone();
        tilt.parent = (k == 1).then_some(0);
        tilt.motion = Motion::Revolute;
        tilt.axis = axis;
        tilt.rotation = Matrix3::identity();
        tilt.position = Vector3::zeros();
        tilt.inertia = crate::robot::Inertia([0.0; 10]);
        tilt.coordinate = 1 - k;
        (tilt.ratio, tilt.offset) = (1.0, 0.0);
        tilt.meant = None;
        out.bodies.insert(k, tilt);
        out.joints.insert(0, joint.clone());
    }
    out
}

/// Motion of that robot: tilts of the base first (x, then y).
fn extended(r: &Series, tilts: [&[Vec<f64>; 3]; 2]) -> Samples {
    let mut x = Samples::zeros(r.x.dof + 2, r.count);
    for (k, tilt) in tilts.iter().enumerate() {
        let row = k * r.count..(k + 1) * r.count;
        x.q[row.clone()].copy_from_slice(&tilt[0]);
        x.qd[row.clone()].copy_from_slice(&tilt[1]);
        x.qdd[row].copy_from_slice(&tilt[2]);
    }
    let at = 2 * r.count;
    x.q[at..].copy_from_slice(&r.x.q);
    x.qd[at..].copy_from_slice(&r.x.qd);
    x.qdd[at..].copy_from_slice(&r.x.qdd);
    x
}

/// Bodies of the extended robot: two without mass, then those of the model with the load of record `k`.
fn bodies(cx: &Context, k: usize) -> Vec<f64> {
    let mut phi = vec![0.0; 20];
    phi.extend(&cx.phi[..10 * cx.data.plant.robot().bodies.len()]);
    if let (Some(load), Some(tool)) = (cx.data.load(k, &cx.phi), cx.data.plant.tool()) {
        let body = phi[20 + 10 * tool..].iter_mut().zip(load);
        body.for_each(|(b, l)| *b += l);
    }
    phi
}

/// What the robot exerts on its base, over all records, for the axes x and y.
pub struct Load {
    /// moment that the base exerts on the robot, N m
    pub moment: [Vec<f64>; 2],
    /// inertia of the robot about the axis, kg m²
    pub mass: [Vec<f64>; 2],
}

impl Load {
    /// Of the nominal model of a serial or tree robot.
    pub fn of(cx: &Context) -> Self {
        let robot = cx.data.plant.robot();
        let tree = crate::dynamics::Tree::new(&on_joints(robot));
        let mut out = Load {
            moment: Default::default(),
            mass: Default::default(),
        };
        for (k, r) in cx.data.records.iter().enumerate() {
            let phi = bodies(cx, k);
            let still = [vec![0.0; r.count], vec![0.0; r.count], vec![0.0; r.count]];
            let mut turning = still.clone();
            turning[2].fill(1.0);
            let mut work = Default::default();
            let mut torque = |tilts: [&[Vec<f64>; 3]; 2]| -> Vec<f64> {
                let x = extended(r, tilts);
                let mut tau = vec![0.0; x.dof * x.count];
                tree.inverse_dynamics(&mut work, &phi, &x, &mut tau);
                tau
            };
            let rest = torque([&still, &still]);
            let more = [torque([&turning, &still]), torque([&still, &turning])];
            for (k, more) in more.iter().enumerate() {
                let row = k * r.count..(k + 1) * r.count;
                out.moment[k].extend_from_slice(&rest[row.clone()]);
                let pairs = more[row.clone()].iter().zip(&rest[row]);
                out.mass[k].extend(pairs.map(|(a, b)| a - b));
            }
        }
        out
    }
}

/// Columns for tilts of the base about x and about y; `motion` gives angle, rate and acceleration
/// of a tilt of record `k` about axis 0 or 1, per unit of its coefficient.
pub(crate) fn tilted(
    cx: &Context,
    motion: impl Fn(&Series, usize, usize) -> [Vec<f64>; 3] + Sync,
) -> Vec<Column> {
    let robot = cx.data.plant.robot();
    let tree = crate::dynamics::Tree::new(&on_joints(robot));
    let records = &cx.data.records;
    // torques of the joints for one axis and record
    let torques = |axis: usize, k: usize| -> Vec<f64> {
        let (r, phi) = (&records[k], bodies(cx, k));
        let full = motion(r, k, axis);
        let largest = full[0].iter().fold(1e-12f64, |m, v| m.max(v.abs()));
        let step = 1e-4 / largest;
        let still = [vec![0.0; r.count], vec![0.0; r.count], vec![0.0; r.count]];
        let side = |sign: f64| {
            let tilt: [Vec<f64>; 3] =
                std::array::from_fn(|d| full[d].iter().map(|v| sign * step * v).collect());
            let tilts = match axis {
                0 => [&tilt, &still],
                _ => [&still, &tilt],
            };
            let x = extended(r, tilts);
            let mut tau = vec![0.0; x.dof * x.count];
            tree.inverse_dynamics(&mut Default::default(), &phi, &x, &mut tau);
            tau.split_off(2 * r.count)
        };
        let (mut plus, minus) = (side(1.0), side(-1.0));
        let both = plus.iter_mut().zip(&minus);
        both.for_each(|(a, b)| *a = (*a - b) / (2.0 * step));
        plus
    };
    let all = (0..2 * records.len()).into_par_iter().with_max_len(1);
    let all: Vec<Vec<f64>> = all
        .map(|i| torques(i / records.len(), i % records.len()))
        .collect();
    all.chunks(records.len())
        .map(|of| {
            let mut rows = vec![Vec::with_capacity(cx.data.rows()); cx.data.joints()];
            for (torques, r) in of.iter().zip(records) {
                let each = rows.iter_mut().zip(torques.chunks_exact(r.count));
                each.for_each(|(row, torque)| row.extend_from_slice(torque));
            }
            prune(Column {
                rows: rows.into_iter().enumerate().collect(),
            })
        })
        .collect()
}
