//! Identities of closed chains on random geometry: regressor and inverse dynamics, power balance,
//! gradients, forward after inverse kinematics, singular layouts, and what is said of bad input.

mod singular;

use crate::common;
use crate::common::parallel::{delta, h4, hexapod, reference, states};
use excite::dynamics::parts::Workspace;
use excite::dynamics::{Isa, Samples};
use excite::mechanism::gough_stewart::{Bodies, GoughStewart};
use excite::mechanism::h4::{H4, Model};
use excite::mechanism::parallelogram::motor_frame;
use excite::mechanism::parts::MechanismWorkspace;
use excite::mechanism::{Mechanism, MechanismMotion, TaskDerivatives};
use excite::robot::Body;
use excite::robot::parts::JointTerm;
use nalgebra::{Matrix3, Vector3};
use rand::Rng;

fn random_hexapod(seed: u64) -> GoughStewart {
    let r = &mut common::rng(seed);
    let mut robot = hexapod(&reference("sg").0);
    for leg in &mut robot.legs {
        leg.base += common::vector(r, 0.05);
        leg.platform += common::vector(r, 0.05);
        leg.rotation *= nalgebra::Rotation3::from_scaled_axis(common::vector(r, 0.1)).matrix();
        leg.zero = r.random_range(0.2..0.4);
        leg.terms = [r.random_range(1.0..3.0), 40.0, 5.0, -2.0];
        for body in [&mut leg.cross, &mut leg.cylinder, &mut leg.rod] {
            *body = common::inertia(r);
        }
    }
    robot.platform = common::inertia(r);
    robot.gravity = Vector3::new(0.5, -1.0, -9.6);
    robot.bodies = Bodies::Cross;
    robot.identify = JointTerm::ALL.to_vec();
    robot
}

fn random_h4(seed: u64) -> H4 {
    let r = &mut common::rng(seed);
    let mut robot = h4(&reference("h4").0);
    for chain in &mut robot.chains {
        chain.motor += common::vector(r, 0.01);
        chain.rotation *= nalgebra::Rotation3::from_scaled_axis(common::vector(r, 0.05)).matrix();
        chain.arm_length += r.random_range(-0.01..0.01);
        chain.zero = r.random_range(-0.2..0.2);
        chain.terms = [0.02, 0.3, 0.1, 0.05];
        chain.arm = common::inertia(r);
        chain.rods = [common::inertia(r), common::inertia(r)];
    }
    robot.identify = JointTerm::ALL.to_vec();
    robot
}

/// All kinds, with random geometry and inertia.
fn mechanisms() -> Vec<Mechanism> {
    let mut all: Vec<Mechanism> = (1..3).map(|s| random_hexapod(s).build().unwrap()).collect();
    all.push(random_h4(3).build().unwrap());
    all.push(delta(&reference("delta").0).build().unwrap());
    all.push(common::tripod::build(3, 4).unwrap());
    all.push(common::tripod::build(4, 5).unwrap());
    let mut shared = random_hexapod(6);
    shared.identical = true;
    shared.axisymmetric = true;
    shared.bodies = Bodies::Legs;
    all.push(shared.build().unwrap());
    shared.spherical = true;
    all.push(shared.build().unwrap());
    let mut lumped = h4(&reference("h4").0);
    lumped.model = Model::LumpedGravity;
    all.push(lumped.build().unwrap());
    for m in &mut all {
        let half: Vec<f64> = (0..m.freedoms())
            .map(|k| if m.task.is_angle(k) { 0.2 } else { 0.05 })
            .collect();
        for (k, w) in m.workspace.iter_mut().enumerate() {
            w.position = [m.home[k] - half[k], m.home[k] + half[k]];
        }
    }
    all
}

#[test]
fn regressor_times_parameters_is_inverse_dynamics() {
    for (i, m) in mechanisms().iter().enumerate() {
        let x = states(m, 300, i as u64, 5.0);
        let w = m.regressor(&x).unwrap();
        let phi = m.parameters.values();
        let tau = m.torque(&x, &phi).unwrap();
        let mut nominal = m.nominal_torque(&x).unwrap();
        // bodies and terms that are not unknowns are in the nominal torque alone
        let known = m.torque(&x, &vec![0.0; phi.len()]).unwrap();
        let mut worst = 0.0f64;
        for row in 0..w.nrows() {
            let sum: f64 = (0..phi.len()).map(|c| w[(row, c)] * phi[c]).sum();
            let size: f64 = (0..phi.len()).map(|c| (w[(row, c)] * phi[c]).abs()).sum();
            worst = worst.max((sum - (tau[row] - known[row])).abs() / (1.0 + size));
        }
        println!("{} {i}: {worst:.1e}", m.source.name());
        assert!(worst < 1e-13, "{} {i}: {worst:e}", m.source.name());
        if m.source.name() == "gough-stewart" && m.parameters.plain || m.source.name() == "tripod" {
            nominal.iter_mut().zip(&tau).for_each(|(a, b)| *a -= b);
            assert!(nominal.iter().all(|d| d.abs() < 1e-9));
        }
    }
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let m = random_hexapod(1).build().unwrap();
    let x = states(&m, 77, 9, 5.0);
    let mut first: Option<(MechanismMotion, Vec<f64>)> = None;
    for isa in Isa::available() {
        let mut closed = MechanismMotion::default();
        m.motion_into(isa, &x, &mut closed).unwrap();
        let rows = 6 * x.count;
        let mut w = vec![0.0; rows * m.parameters.raw_count()];
        m.raw_regressor(
            &mut Workspace::with_isa(isa),
            &closed,
            &mut w,
            rows,
            x.count,
        );
        match &first {
            None => first = Some((closed, w)),
            Some((c, y)) => {
                assert_eq!(c.tree, closed.tree, "{isa:?}");
                assert_eq!(c.g, closed.g, "{isa:?}");
                assert_eq!(*y, w, "{isa:?}");
            }
        }
    }
}

/// `q, q̇, q̈, D` from each other by differences along a path.
#[test]
fn velocities_accelerations_and_jacobian_are_derivatives_of_positions() {
    for m in mechanisms() {
        let x = states(&m, 1, 11, 5.0);
        let at = |s: f64| {
            let p: Vec<f64> = (0..x.dof)
                .map(|k| x.q[k] + x.qd[k] * s + 0.5 * x.qdd[k] * s * s)
                .collect();
            m.inverse(&p).unwrap()
        };
        let closed = m.motion(&x).unwrap();
        let h = 1e-4;
        let (a, b, c) = (at(-h), at(0.0), at(h));
        for i in 0..m.robot.dof() {
            let v = (c[i] - a[i]) / (2.0 * h);
            let w = (c[i] - 2.0 * b[i] + a[i]) / (h * h);
            assert!(
                (closed.tree.qd[i] - v).abs() < 1e-5 * (1.0 + v.abs()),
                "{} {i}",
                m.source.name()
            );
            assert!(
                (closed.tree.qdd[i] - w).abs() < 1e-4 * (1.0 + w.abs()),
                "{} {i}",
                m.source.name()
            );
            for k in 0..x.dof {
                let step = |h: f64| {
                    let mut p = x.q.clone();
                    p[k] += h;
                    m.inverse(&p).unwrap()[i]
                };
                let d = (step(1e-6) - step(-1e-6)) / 2e-6;
                assert!((closed.d[i * x.dof + k] - d).abs() < 1e-7 * (1.0 + d.abs()));
            }
        }
    }
}

/// The tree closes: rods and legs end where the platform has their joints.
#[test]
fn chains_end_on_the_platform() {
    let robot = random_hexapod(2);
    let m = robot
        .build()
        .unwrap()
        .with_workspace(&[0.1, 0.1, 0.1, 0.3, 0.3, 0.3]);
    let x = states(&m, 1, 5, 5.0);
    let poses = common::poses(&m.robot, &m.inverse(&x.q).unwrap());
    let find = |name: &str| m.robot.bodies.iter().position(|b| b.name == name).unwrap();
    let (r, p) = poses[find("platform")];
    for (i, leg) in robot.legs.iter().enumerate() {
        let tip = poses[find(&format!("rod{}", i + 1))].1;
        assert!((tip - (p + r * leg.platform)).norm() < 1e-14);
    }
    let robot = random_h4(3);
    let m = robot
        .build()
        .unwrap()
        .with_workspace(&[0.05, 0.05, 0.05, 0.4]);
    let x = states(&m, 1, 6, 5.0);
    let poses = common::poses(&m.robot, &m.inverse(&x.q).unwrap());
    let find = |name: &str| m.robot.bodies.iter().position(|b| b.name == name).unwrap();
    for (i, chain) in robot.chains.iter().enumerate() {
        let (bar, at) = poses[find(&format!("bar{}", chain.hinge + 1))];
        assert!(
            (bar - Matrix3::identity()).norm() < 1e-14,
            "bars keep their orientation"
        );
        for (rod, side) in [("a", 0.5), ("b", -0.5)] {
            let (r, p) = poses[find(&format!("rod{}{rod}", i + 1))];
            let end = p + r * Vector3::new(0.0, 0.0, chain.rod_length);
            let joint = at + chain.attachment + chain.rotation.column(0) * (side * chain.width);
            assert!((end - joint).norm() < 1e-13);
        }
    }
}

/// Energy of the tree along a path of the task coordinates, from poses alone.
fn energy(m: &Mechanism, path: &dyn Fn(f64) -> Vec<f64>, s: f64) -> f64 {
    let h = 1e-5;
    let at = |s: f64| common::poses(&m.robot, &m.inverse(&path(s)).unwrap());
    let (minus, here, plus) = (at(s - h), at(s), at(s + h));
    let mut total = 0.0;
    for (i, body) in m.robot.bodies.iter().enumerate() {
        let Body { inertia, .. } = body;
        let (r, p) = here[i];
        let skew = r.transpose() * (plus[i].0 - minus[i].0) / (2.0 * h);
        let w = Vector3::new(skew.m32, skew.m13, skew.m21);
        let v = r.transpose() * (plus[i].1 - minus[i].1) / (2.0 * h);
        let (mass, mc) = (inertia.mass(), inertia.first_moment());
        total += 0.5 * mass * v.norm_squared()
            + v.dot(&w.cross(&mc))
            + 0.5 * w.dot(&(inertia.tensor() * w));
        total -= m.robot.gravity.dot(&(p * mass + r * mc));
    }
    total
}

#[test]
fn actuator_power_is_the_change_of_energy() {
    for m in mechanisms() {
        if m.source.name() == "h4" && m.parameters.list.len() < 20 {
            continue; // the lumped model is no set of bodies
        }
        let x = states(&m, 1, 21, 5.0);
        let path = |s: f64| -> Vec<f64> {
            (0..x.dof)
                .map(|k| x.q[k] + x.qd[k] * s + 0.5 * x.qdd[k] * s * s)
                .collect()
        };
        let h = 1e-3;
        let change = (energy(&m, &path, h) - energy(&m, &path, -h)) / (2.0 * h);
        // rigid bodies alone
        let closed = m.motion(&x).unwrap();
        let phi: Vec<f64> = m.robot.bodies.iter().flat_map(|b| b.inertia.0).collect();
        let mut gamma = vec![0.0; m.robot.dof()];
        m.tree()
            .inverse_dynamics(&mut Workspace::default(), &phi, &closed.tree, &mut gamma);
        let tau = m.project(&closed, &gamma);
        let power: f64 = m
            .actuated
            .iter()
            .zip(&tau)
            .map(|(&a, t)| t * closed.tree.qd[a])
            .sum();
        assert!(
            (power - change).abs() < 1e-3 * (1.0 + power.abs()),
            "{}: {power} {change}",
            m.source.name()
        );
    }
}

#[test]
fn gradients_are_those_of_difference_quotients() {
    for m in mechanisms() {
        let (count, na, dof) = (3, m.actuators(), m.freedoms());
        let x = states(&m, count, 31, 5.0);
        let r = &mut common::rng(32);
        let each = m.parameters.raw_count();
        let raw: Vec<f64> = (0..2 * each).map(|_| r.random_range(-1.0..1.0)).collect();
        let rates: Vec<f64> = (0..2 * na * count)
            .map(|_| r.random_range(-1.0..1.0))
            .collect();
        let mut out = TaskDerivatives::default();
        m.gradients(
            &mut MechanismWorkspace::default(),
            &raw,
            &x,
            &rates,
            &mut out,
        )
        .unwrap();
        // Σ r τ of vector v at sample s, from the raw regressor
        let value = |x: &Samples, v: usize, s: usize| -> f64 {
            let closed = m.motion(x).unwrap();
            let rows = na * count;
            let mut w = vec![0.0; rows * each];
            m.raw_regressor(&mut Workspace::default(), &closed, &mut w, rows, count);
            (0..na)
                .map(|a| {
                    let tau: f64 = (0..each)
                        .map(|c| w[c * rows + a * count + s] * raw[v * each + c])
                        .sum();
                    rates[(v * na + a) * count + s] * tau
                })
                .sum()
        };
        for v in 0..2 {
            for (order, ours) in [&out.x, &out.xd, &out.xdd].iter().enumerate() {
                for k in 0..dof {
                    let s = 1;
                    let h = 1e-5;
                    let moved = |h: f64| {
                        let mut y = x.clone();
                        [&mut y.q, &mut y.qd, &mut y.qdd][order][k * count + s] += h;
                        value(&y, v, s)
                    };
                    let quotient = (moved(h) - moved(-h)) / (2.0 * h);
                    let g = ours[(v * dof + k) * count + s];
                    let scale = 1.0 + quotient.abs() + value(&x, v, s).abs();
                    assert!(
                        (g - quotient).abs() < 2e-6 * scale,
                        "{} order {order} k {k}: {g} {quotient}",
                        m.source.name()
                    );
                }
            }
        }
    }
}

#[test]
fn forward_after_inverse_is_the_identity() {
    for m in mechanisms() {
        let x = states(&m, 20, 41, 5.0);
        for s in 0..20 {
            let pose: Vec<f64> = (0..x.dof).map(|k| x.q[k * 20 + s]).collect();
            let q = m.actuator_positions(&pose).unwrap();
            let back = m.forward(&q, &m.home).unwrap();
            assert!(back.residual < 1e-11 && back.iterations < 40);
            for (a, b) in back.x.iter().zip(&pose) {
                assert!(
                    (a - b).abs() < 1e-10,
                    "{}: {:?} {pose:?}",
                    m.source.name(),
                    back.x
                );
            }
        }
    }
}

#[test]
fn forward_kinematics_stays_in_its_assembly_mode() {
    let m = hexapod(&reference("sg").0).build().unwrap();
    let sign = |x: &[f64]| m.actuation_jacobian(x).unwrap().determinant().signum();
    // beyond the singularity at a yaw of a right angle the determinant has the other sign
    let mut beyond = m.home.clone();
    beyond[5] = 2.1;
    assert_ne!(sign(&m.home), sign(&beyond));
    let q = m.actuator_positions(&beyond).unwrap();
    match m.forward(&q, &m.home) {
        Ok(other) => {
            assert_eq!(sign(&other.x), sign(&m.home));
            assert!((other.x[5] - 2.1).abs() > 0.1);
        }
        Err(e) => assert!(e.to_string().contains("assembly mode"), "{e}"),
    }
    // from nearby it is found
    let mut near = beyond.clone();
    near[5] = 2.0;
    assert!((m.forward(&q, &near).unwrap().x[5] - 2.1).abs() < 1e-10);
    // lengths that cannot be
    let mut long = m.actuator_positions(&m.home).unwrap();
    long[0] += 3.0;
    let e = m.forward(&long, &m.home).unwrap_err().to_string();
    assert!(e.contains("no pose of this assembly mode"), "{e}");
}
