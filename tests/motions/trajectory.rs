//! Trajectories against whole robots: limits and torque bounds.

mod certificate;

use excite::robot::parts::Limits;
use excite::robot::parts::{Motion, Prior};
use excite::robot::{Body, Inertia, Joint, Robot};
use excite::trajectory::certificate::Kind;
use excite::trajectory::jets::{Jet, Norms};
use excite::trajectory::parts::Series;
use excite::trajectory::parts::{Ends, Grid};
use excite::trajectory::{Basis, Fourier, certify, torque_certificate};
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn joint(name: &str, motion: Motion, limits: Limits) -> Joint {
    Joint {
        limits,
        ..Joint::new(name, motion)
    }
}

fn robot(bodies: Vec<Body>, joints: Vec<Joint>) -> Robot {
    Robot {
        name: "test".into(),
        bodies,
        joints,
        gravity: Vector3::new(0.0, 0.0, -9.81),
        prior: Prior::Cad,
        warnings: Vec::new(),
        path: None,
        hash: String::new(),
        geometry: Default::default(),
        tool: None,
    }
}

fn body(parent: Option<usize>, motion: Motion, coordinate: usize) -> Body {
    Body {
        name: format!("link{coordinate}"),
        joint_name: format!("joint{coordinate}"),
        parent,
        motion,
        axis: Vector3::z(),
        rotation: Matrix3::identity(),
        position: Vector3::zeros(),
        inertia: Inertia::default(),
        merged: Vec::new(),
        coordinate,
        ratio: 1.0,
        offset: 0.0,
        meant: None,
    }
}

/// A tree with revolute and prismatic joints, arbitrary axes, the last body following coordinate 0.
/// A sparse one has many zeros, so that single terms of the dynamics stand alone.
fn random_tree(seed: u64, count: usize, sparse: bool) -> Robot {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut zeros = ChaCha8Rng::seed_from_u64(!seed);
    let mut keep = move || {
        if sparse && zeros.random_bool(0.5) {
            0.0
        } else {
            1.0
        }
    };
    let mut r = move |a: f64, b: f64| rng.random_range(a..b);
    let mut bodies = Vec::new();
    let mut joints = Vec::new();
    for i in 0..count {
        let parent = if i == 0 || r(0.0, 1.0) < 0.1 {
            None
        } else if r(0.0, 1.0) < 0.7 {
            Some(i - 1)
        } else {
            Some(r(0.0, i as f64) as usize)
        };
        let motion = if r(0.0, 1.0) < 0.25 {
            Motion::Prismatic
        } else {
            Motion::Revolute
        };
        let mut v = |s: f64| Vector3::new(r(-s, s), r(-s, s), r(-s, s));
        let (axis, rotation, position, com, half) = (v(1.0), v(2.0), v(0.5), v(0.2), v(0.1));
        let mass = r(0.1, 5.0);
        let mut b = body(parent, motion, i);
        b.axis = axis.normalize();
        b.rotation = *Rotation3::new(rotation).matrix();
        b.position = position * keep();
        let (mass, com, half) = (mass * keep(), com * keep(), half * keep());
        let tensor = half * half.transpose() * mass + Matrix3::identity() * (0.001 * mass);
        let tensor = Matrix3::identity() * tensor.trace() - tensor;
        b.inertia = Inertia::from_com(mass, com, tensor);
        if i + 1 == count
            && count > 1
            && motion == bodies.first().map_or(motion, |f: &Body| f.motion)
        {
            (b.coordinate, b.ratio, b.offset) = (0, r(-1.5, 1.5), r(-0.5, 0.5));
        } else {
            let limits = Limits {
                effort: r(5.0, 200.0),
                ..Limits::default()
            };
            let mut j = joint(&format!("joint{i}"), motion, limits);
            j.terms = [
                r(0.0, 0.3) * keep(),
                r(0.0, 2.0) * keep(),
                r(0.0, 1.0),
                r(-1.0, 1.0) * keep(),
            ];
            joints.push(j);
        }
        bodies.push(b);
    }
    let mut robot = robot(bodies, joints);
    robot.gravity *= keep();
    robot
}

/// Newton-Euler in base axes, with armature, viscous friction and offset: as plain as possible.
fn torque(robot: &Robot, q: &[f64], qd: &[f64], qdd: &[f64], tau: &mut [f64]) {
    struct State {
        r: Matrix3<f64>,
        p: Vector3<f64>,
        axis: Vector3<f64>,
        w: Vector3<f64>,
        dw: Vector3<f64>,
        a: Vector3<f64>,
        v: Vector3<f64>,
    }
    let mut all: Vec<State> = Vec::new();
    let zero = Vector3::zeros();
    for b in &robot.bodies {
        let (x, dx, ddx) = (
            b.ratio * q[b.coordinate] + b.offset,
            b.ratio * qd[b.coordinate],
            b.ratio * qdd[b.coordinate],
        );
        let (rp, pp, wp, dwp, ap, vp) = match b.parent {
            Some(i) => {
                let s = &all[i];
                (s.r, s.p, s.w, s.dw, s.a, s.v)
            }
            None => (Matrix3::identity(), zero, zero, zero, -robot.gravity, zero),
        };
        let axis = rp * b.rotation * b.axis;
        let state = match b.motion {
            Motion::Revolute => {
                let turn = Rotation3::from_axis_angle(&Unit::new_normalize(b.axis), x);
                let arm = rp * b.position;
                State {
                    r: rp * b.rotation * turn.matrix(),
                    p: pp + arm,
                    axis,
                    w: wp + axis * dx,
                    dw: dwp + axis * ddx + wp.cross(&axis) * dx,
                    a: ap + dwp.cross(&arm) + wp.cross(&wp.cross(&arm)),
                    v: vp + wp.cross(&arm),
                }
            }
            Motion::Prismatic => {
                let arm = rp * b.position + axis * x;
                State {
                    r: rp * b.rotation,
                    p: pp + arm,
                    axis,
                    w: wp,
                    dw: dwp,
                    a: ap
                        + dwp.cross(&arm)
                        + wp.cross(&wp.cross(&arm))
                        + wp.cross(&axis) * (2.0 * dx)
                        + axis * ddx,
                    v: vp + wp.cross(&arm) + axis * dx,
                }
            }
        };
        all.push(state);
    }
    for (j, joint) in robot.joints.iter().enumerate() {
        tau[j] = joint.terms[0] * qdd[j] + joint.terms[1] * qd[j] + joint.terms[3];
    }
    let count = robot.bodies.len();
    let (mut force, mut moment) = (vec![zero; count], vec![zero; count]);
    for i in (0..count).rev() {
        let (b, s) = (&robot.bodies[i], &all[i]);
        let (m, h) = (b.inertia.mass(), s.r * b.inertia.first_moment());
        let tensor = s.r * b.inertia.tensor() * s.r.transpose();
        force[i] += s.a * m + s.dw.cross(&h) + s.w.cross(&s.w.cross(&h));
        moment[i] += h.cross(&s.a) + tensor * s.dw + s.w.cross(&(tensor * s.w));
        let along = match b.motion {
            Motion::Revolute => s.axis.dot(&moment[i]),
            Motion::Prismatic => s.axis.dot(&force[i]),
        };
        tau[b.coordinate] += b.ratio * along;
        if let Some(parent) = b.parent {
            let arm = s.p - all[parent].p;
            let (f, n) = (force[i], moment[i]);
            force[parent] += f;
            moment[parent] += n + arm.cross(&f);
        }
    }
}

/// Every joint at the same largest speed, some of them still in a sparse motion.
fn random_motion(seed: u64, dof: usize, speed: f64, sparse: bool) -> Fourier {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0xabcd);
    let count = rng.random_range(2..6);
    let harmonics = Grid::Full.harmonics(count, 0);
    let basis = Basis::new(&harmonics, Ends::Rest, dof, None).unwrap();
    let x: Vec<f64> = (0..basis.len())
        .map(|_| rng.random_range(-1.0..1.0))
        .collect();
    let mut f = basis.fourier(rng.random_range(1.0..6.0), &x);
    for series in &mut f.joints {
        let largest = excite::trajectory::extrema(f.period, &f.harmonics, series, 1)
            .largest()
            .value;
        let still = sparse && rng.random_bool(0.4);
        let factor = if still { 0.0 } else { speed / largest };
        series
            .sin
            .iter_mut()
            .chain(&mut series.cos)
            .for_each(|v| *v *= factor);
    }
    f
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(100) })]

    /// The bound of `τ̈` against second differences of the torque, on the whole period.
    #[test]
    fn torque_curvature_is_bounded(seed in any::<u64>(), count in 1usize..7, speed in 0.1..4.0f64,
                                    sparse in any::<bool>()) {
        let robot = random_tree(seed, count, sparse);
        let f = random_motion(seed, robot.dof(), speed, sparse);
        let n = robot.dof();
        let jets: Vec<Jet> = f.joints.iter().map(|s| {
            std::array::from_fn(|k| {
                excite::trajectory::extrema(f.period, &f.harmonics, s, k as u32).magnitude_bound()
            })
        }).collect();
        let bounds = Norms::new(&robot).torque_derivatives(&jets);
        let h = 1e-3 * f.period;
        let at = |t: f64| {
            let mut s = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
            let [q, qd, qdd] = &mut s;
            f.evaluate(t, [q, qd, qdd]);
            let mut tau = vec![0.0; n];
            torque(&robot, q, qd, qdd, &mut tau);
            tau
        };
        for i in 0..1000 {
            let t = i as f64 * h;
            let (a, b, c, d) = (at(t - h), at(t), at(t + h), at(t + 2.0 * h));
            for j in 0..n {
                let third = (d[j] - 3.0 * c[j] + 3.0 * b[j] - a[j]) / (h * h * h);
                let rounding = 1e-10 * (1.0 + b[j].abs()) / (h * h * h);
                prop_assert!(third.abs() <= bounds[j][1] + rounding, "{} > {}", third, bounds[j][1]);
                // a second difference is a mean of the second derivative
                let second = (a[j] - 2.0 * b[j] + c[j]) / (h * h);
                let rounding = 1e-11 * (1.0 + b[j].abs()) / (h * h);
                prop_assert!(second.abs() <= bounds[j][0] + rounding, "{} > {}", second, bounds[j][0]);
            }
        }
    }

    /// The bound of the torque holds at every one of many times, whatever the samples spent.
    #[test]
    fn torque_bound_holds(seed in any::<u64>(), count in 1usize..7, speed in 0.1..4.0f64,
                          sparse in any::<bool>(), samples in prop_oneof![Just(3usize), Just(200), Just(3000)]) {
        let robot = random_tree(seed, count, sparse);
        let f = random_motion(seed, robot.dof(), speed, sparse);
        let smooth = |q: &[f64], qd: &[f64], qdd: &[f64], tau: &mut [f64]| {
            torque(&robot, q, qd, qdd, tau)
        };
        let bounds = torque_certificate(&robot, &f, samples, &smooth).unwrap();
        let fine = f.sample(7919);
        let mut tau = vec![0.0; robot.dof()];
        for i in 0..7919 {
            let column = |m: &nalgebra::DMatrix<f64>| m.column(i).iter().copied().collect::<Vec<_>>();
            let (q, qd, qdd) = (column(&fine.q), column(&fine.qd), column(&fine.qdd));
            torque(&robot, &q, &qd, &qdd, &mut tau);
            for (j, b) in bounds.iter().enumerate() {
                let friction = robot.joints[j].terms[2] * qd[j].signum();
                let slack = 1e-9 * b.bound();
                prop_assert!((tau[j] + friction).abs() <= b.bound() + slack);
            }
        }
        for (b, j) in bounds.iter().zip(&robot.joints) {
            prop_assert!(b.samples <= samples.max(1));
            prop_assert_eq!(b.coulomb, j.terms[2]);
            prop_assert!((b.used.unwrap() * b.limit.unwrap() - b.max_on_grid - b.coulomb).abs() < 1e-9);
        }
    }
}

/// Seven joints with the Panda's geometry and similar masses.
fn arm() -> Robot {
    let geometry = [
        ([0.0, 0.0, 0.333], 0.0, 4.97, [0.0, -0.03, -0.12], 87.0),
        ([0.0, 0.0, 0.0], -1.0, 0.65, [0.0, -0.03, 0.01], 87.0),
        ([0.0, -0.316, 0.0], 1.0, 3.23, [0.03, 0.04, -0.07], 87.0),
        ([0.0825, 0.0, 0.0], 1.0, 3.59, [-0.05, 0.10, 0.03], 87.0),
        (
            [-0.0825, 0.384, 0.0],
            -1.0,
            1.23,
            [-0.01, 0.04, -0.04],
            12.0,
        ),
        ([0.0, 0.0, 0.0], 1.0, 1.67, [0.06, -0.01, -0.01], 12.0),
        ([0.088, 0.0, 0.0], 1.0, 0.74, [0.01, 0.0, 0.06], 12.0),
    ];
    let (mut bodies, mut joints) = (Vec::new(), Vec::new());
    for (i, (position, quarter, mass, com, effort)) in geometry.into_iter().enumerate() {
        let mut b = body(i.checked_sub(1), Motion::Revolute, i);
        b.position = Vector3::from(position);
        b.rotation =
            *Rotation3::from_axis_angle(&Vector3::x_axis(), quarter * std::f64::consts::FRAC_PI_2)
                .matrix();
        let tensor = Matrix3::from_diagonal(&Vector3::new(0.006, 0.005, 0.004)) * mass;
        b.inertia = Inertia::from_com(mass, Vector3::from(com), tensor);
        bodies.push(b);
        let limits = Limits {
            position: [-2.8, 2.8],
            velocity: 2.175,
            acceleration: 15.0,
            jerk: 7500.0,
            effort,
            ..Limits::default()
        };
        joints.push(joint(&format!("joint{}", i + 1), Motion::Revolute, limits));
    }
    robot(bodies, joints)
}

#[test]
fn torque_bound_of_a_fast_arm_is_tight() {
    let robot = arm();
    for seed in 0..4 {
        let f = random_motion(seed, 7, 2.0, false);
        let smooth =
            |q: &[f64], qd: &[f64], qdd: &[f64], tau: &mut [f64]| torque(&robot, q, qd, qdd, tau);
        let bounds = torque_certificate(&robot, &f, 20_000, &smooth).unwrap();
        for b in &bounds {
            assert!(b.between_grid_bound <= 0.0021 * b.limit.unwrap(), "{b:?}");
        }
    }
}
