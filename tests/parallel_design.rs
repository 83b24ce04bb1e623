//! Design for parallel robots: derivatives, limits between the samples, conditions reached.

mod common;

use common::parallel;
use excite::Plant;
use excite::design::criterion::{Condition, Criterion, Objective};
use excite::design::information::{Evaluation, Information};
use excite::design::{Design, Settings, design_closed};
use excite::dynamics::Samples;
use excite::identifiability::Assessment;
use excite::mechanism::{Mechanism, closed_certificate};
use excite::robot::{JointTerm, Limits};
use excite::trajectory::{Basis, Ends, Fourier, Trajectory};
use rand::Rng;
use std::sync::atomic::AtomicBool;

/// Hexapod of the reference model with friction, limits and cones.
fn hexapod() -> Mechanism {
    let (model, _) = parallel::reference("sg");
    let mut hexapod = parallel::hexapod(&model);
    hexapod.axisymmetric = true;
    hexapod.identical = true;
    hexapod.identify = vec![JointTerm::Viscous, JointTerm::Coulomb];
    for leg in &mut hexapod.legs {
        leg.terms = [0.3, 50.0, 20.0, 0.0];
        leg.cone = [0.5, 0.6];
        leg.limits = Limits {
            velocity: 0.35,
            acceleration: 1.5,
            jerk: 12.0,
            effort: 500.0,
            ..Limits::default()
        };
    }
    hexapod.build().unwrap()
}

fn bundled(name: &str) -> Plant {
    Plant::load(name).unwrap()
}

fn mechanism(plant: &Plant) -> &Mechanism {
    plant.mechanism().expect("a parallel robot")
}

fn run(mechanism: &Mechanism, settings: &Settings) -> Design {
    design_closed(mechanism, settings, &AtomicBool::new(false), &|_| {}).unwrap()
}

fn quick(starts: usize) -> Settings {
    Settings {
        starts: Some(starts),
        condition: Condition::Normalised,
        ..Settings::default()
    }
}

#[test]
fn gradients_are_the_differences_of_the_criterion() {
    for (mechanism, condition) in [
        (hexapod(), Condition::Normalised),
        (hexapod(), Condition::Weighted),
    ] {
        let base = mechanism.base().unwrap();
        let basis = Basis::new(&[1, 2, 3], Ends::Rest, 6, None).unwrap();
        let noise = [1.0, 2.0, 1.5, 3.0, 1.0, 2.5];
        let weights = (condition == Condition::Weighted).then_some(&noise[..]);
        let info = Information::closed(&mechanism, &basis, 4.0, 60, base.selection(), weights);
        let m = basis.free();
        let r = &mut common::rng(4);
        let mut x = Vec::new();
        for k in 0..6 {
            let h = basis.harmonics.len();
            let mut c = vec![0.0; 2 * h + 1];
            c[0] = mechanism.home[k];
            let mut own = basis.parameters(k, &c).as_slice().to_vec();
            let scale = if k < 3 { 0.03 } else { 0.08 };
            for (i, v) in own.iter_mut().enumerate() {
                if i > 0 || m == 1 {
                    *v += scale * r.random_range(-1.0..1.0);
                }
            }
            x.extend(own);
        }
        let objective = Objective {
            criterion: Criterion::D,
            condition,
        };
        let mut e = Evaluation::default();
        let value = objective.evaluate(&info, &x, &mut e);
        assert!(value.is_finite());
        let spectrum = objective.spectrum(&e.gram).unwrap();
        let gradient = objective.smooth_gradient(&info, &mut e, &spectrum, 10.0);
        let size = gradient.iter().fold(0.0f64, |m, g| m.max(g.abs()));
        for k in (0..x.len()).step_by(3) {
            let at = |h: f64| {
                let mut y = x.clone();
                y[k] += h;
                objective.evaluate(&info, &y, &mut Evaluation::default())
            };
            // the determinant is right to some 1e-9 only: a wide step of high order
            let h = 4e-5;
            let difference = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
            assert!(
                (gradient[k] - difference).abs() < 1e-4 * size,
                "{k}: {} {difference}",
                gradient[k]
            );
        }
    }
}

/// The motion at uniform instants, in pieces.
fn pieces(fourier: &Fourier, count: usize, mut see: impl FnMut(usize, &Samples)) {
    let dof = fourier.dof();
    for from in (0..count).step_by(1000) {
        let n = 1000.min(count - from);
        let mut s = Samples::zeros(dof, n);
        let (mut q, mut qd, mut qdd) = (vec![0.0; dof], vec![0.0; dof], vec![0.0; dof]);
        for i in 0..n {
            let t = (from + i) as f64 * fourier.period / count as f64;
            fourier.evaluate(t, [&mut q[..], &mut qd, &mut qdd]);
            for k in 0..dof {
                s.q[k * n + i] = q[k];
                s.qd[k * n + i] = qd[k];
                s.qdd[k * n + i] = qdd[k];
            }
        }
        see(from, &s);
    }
}

/// Nothing exceeds its bound at 100 kHz, and the bounds are close.
fn check_at_100_khz(mechanism: &Mechanism, fourier: &Fourier) {
    let c = closed_certificate(mechanism, fourier, 1.0).unwrap();
    assert!(c.proven);
    let count = (fourier.period * 1e5) as usize;
    let na = mechanism.actuators();
    let mut most = vec![[0.0f64; 4]; na];
    let mut range = vec![[f64::INFINITY, f64::NEG_INFINITY]; na];
    let mut last: Option<Vec<f64>> = None;
    let pairs = mechanism.pairs();
    let mut worst = vec![f64::NEG_INFINITY; c.pose.len()];
    pieces(fourier, count, |_, s| {
        let motion = mechanism.motion(s).unwrap().tree;
        let tau = mechanism.nominal_torque(s).unwrap();
        let n = s.count;
        for (a, &j) in mechanism.actuated.iter().enumerate() {
            for i in 0..n {
                let q = motion.q[j * n + i];
                range[a] = [range[a][0].min(q), range[a][1].max(q)];
                let m = &mut most[a];
                m[0] = m[0].max(motion.qd[j * n + i].abs());
                m[1] = m[1].max(motion.qdd[j * n + i].abs());
                let before = match (i, &last) {
                    (0, Some(last)) => last[a],
                    (0, None) => motion.qdd[j * n],
                    _ => motion.qdd[j * n + i - 1],
                };
                m[2] = m[2].max((motion.qdd[j * n + i] - before).abs() * 1e5);
                m[3] = m[3].max(tau[a * n + i].abs());
            }
        }
        last = Some(
            mechanism
                .actuated
                .iter()
                .map(|&j| motion.qdd[j * n + n - 1])
                .collect(),
        );
        // poses at 10 kHz are slow enough to look at
        for i in (0..n).step_by(10) {
            let x: Vec<f64> = (0..s.dof).map(|k| s.q[k * n + i]).collect();
            for (w, u) in worst.iter_mut().zip(mechanism.pose_uses(&x, &pairs)) {
                *w = w.max(u.used());
            }
        }
    });
    for (a, joint) in c.actuators.joints.iter().enumerate() {
        let p = &joint.position;
        assert!(range[a][0] >= p.bounds[0] && range[a][1] <= p.bounds[1]);
        let width = p.bounds[1] - p.bounds[0];
        assert!(
            width < 1.02 * (range[a][1] - range[a][0]) + 1e-6,
            "{}",
            joint.joint
        );
        for (k, peak) in [&joint.velocity, &joint.acceleration, &joint.jerk]
            .into_iter()
            .enumerate()
        {
            let rounding = if k == 2 { 1e-6 } else { 0.0 };
            assert!(
                most[a][k] <= peak.bound * (1.0 + rounding) + rounding,
                "{} order {}: {} beyond {}",
                joint.joint,
                k + 1,
                most[a][k],
                peak.bound
            );
        }
        let force = joint.torque.as_ref().unwrap();
        assert!(
            most[a][3] <= force.bound() * (1.0 + 1e-9),
            "{}",
            joint.joint
        );
    }
    for (p, worst) in c.pose.iter().zip(worst) {
        let bound = match p.kind {
            excite::mechanism::PoseKind::PassiveJoint => p.bound / p.limit,
            _ => p.limit / p.bound,
        };
        assert!(worst <= bound * (1.0 + 1e-9), "{}: {worst} {bound}", p.name);
    }
}

#[test]
fn limits_hold_at_100_khz_for_designs_that_use_them() {
    let hexapod = hexapod().with_workspace(&[0.1, 0.1, 0.1, 0.25, 0.25, 0.25]);
    let settings = Settings {
        period: 4.0,
        harmonics: 4,
        ..quick(1)
    };
    let design = run(&hexapod, &settings);
    let c = closed_certificate(&hexapod, &design.trajectory.fourier, 1.0).unwrap();
    assert!(c.satisfied, "{:?}", c.actuators.worst);
    let worst = c.actuators.worst.as_ref().unwrap();
    assert!(worst.used > 0.9, "limits are meant to be used: {worst:?}");
    check_at_100_khz(&hexapod, &design.trajectory.fourier);
}

#[test]
fn bundled_parallel_robots_are_designed_inside_their_limits() {
    for (name, most) in [("hexapod", 60.0), ("h4", 20.0), ("delta", 40.0)] {
        let plant = bundled(name);
        let m = mechanism(&plant);
        let design = run(m, &quick(1));
        let a = Assessment::with_plant(&plant, &design.trajectory).unwrap();
        let e = a.excitation.unwrap();
        assert!(e.certificate.satisfied, "{name}: {:?}", e.certificate.worst);
        println!("{name}: {:?}", e.condition);
        assert!(
            e.condition.normalised < most,
            "{name}: {}",
            e.condition.normalised
        );
        let p = e.platform.unwrap();
        assert!(p.certificate.satisfied && p.poses.len() == 3);
        // a file of it reads back as a trajectory of this robot
        let text = design.trajectory.to_json().unwrap();
        let read = Trajectory::parse(&text, "t.json").unwrap();
        assert_eq!(read.matches(&m.task_robot()).unwrap(), None);
        // ends at rest
        let n = m.freedoms();
        let (mut q, mut qd, mut qdd) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        read.fourier.evaluate(0.0, [&mut q[..], &mut qd, &mut qdd]);
        assert!(qd.iter().chain(&qdd).all(|v| v.abs() < 1e-12));
    }
}

#[test]
fn the_answer_does_not_depend_on_the_number_of_threads() {
    let plant = bundled("delta");
    let designed = [1, 2].map(|threads| {
        let settings = Settings {
            threads,
            harmonics: 3,
            ..quick(3)
        };
        run(mechanism(&plant), &settings).trajectory.fourier
    });
    assert_eq!(designed[0], designed[1]);
}

/// Condition numbers (unit columns) for which the best of 25 random multisines is known: 6-UPS, 5
/// harmonics, 10 s, ±0.1 m, ±0.25 rad.
#[test]
#[ignore = "takes a minute and more"]
fn conditions_are_well_below_those_of_random_multisines() {
    use excite::mechanism::gough_stewart::Bodies;
    let (model, _) = parallel::reference("sg");
    let friction = [JointTerm::Viscous, JointTerm::Coulomb];
    for (what, bodies, identical, axisymmetric, terms, best) in [
        (
            "platform 10",
            Bodies::Platform,
            false,
            false,
            &friction[..0],
            1.8,
        ),
        ("10 + 12", Bodies::Platform, false, false, &friction, 3.9),
        ("14 + 12", Bodies::Legs, true, true, &friction, 79.0),
        ("34 + 12", Bodies::Legs, false, true, &friction, 416.0),
        ("82 + 12", Bodies::Legs, false, false, &friction, 5475.0),
    ] {
        let mut hexapod = parallel::hexapod(&model);
        hexapod.bodies = bodies;
        hexapod.identical = identical;
        hexapod.axisymmetric = axisymmetric;
        hexapod.identify = terms.to_vec();
        let m = hexapod
            .build()
            .unwrap()
            .with_workspace(&[0.1, 0.1, 0.1, 0.25, 0.25, 0.25]);
        let settings = Settings {
            ends: Ends::Free,
            time_limit: Some(30.0),
            ..quick(8)
        };
        let design = run(&m, &settings);
        let w = m
            .regressor(&excite::identifiability::sample_period(
                &design.trajectory.fourier,
            ))
            .unwrap();
        let base = m.base().unwrap();
        let (c, ..) =
            excite::identifiability::condition_numbers(&base, w.as_ref(), &[1.0; 6]).unwrap();
        println!(
            "{what}: {} base parameters, {:.2} of {best} in {:.1} s",
            base.count(),
            c.normalised,
            design.record.seconds
        );
        assert!(c.normalised < 0.6 * best, "{what}: {}", c.normalised);
    }
}
