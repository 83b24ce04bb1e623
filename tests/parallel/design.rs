//! Design for parallel robots: derivatives, limits between the samples, conditions reached.

use crate::common;
use crate::common::compare::largest;

use common::parallel::{self, check_at_100_khz};
use excite::Plant;
use excite::design::criterion::{Condition, Criterion, Objective};
use excite::design::information::{Evaluation, Information};
use excite::design::{Design, Settings, design};
use excite::dynamics::Samples;
use excite::identifiability::assess;
use excite::mechanism::Mechanism;
use excite::robot::parts::{JointTerm, Limits};
use excite::trajectory::parts::{Ends, Space};
use excite::trajectory::{Basis, Fourier, Trajectory, certify};
use rand::Rng;

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
    design(&Plant::from(mechanism), settings).unwrap()
}

fn quick(starts: usize) -> Settings {
    Settings::default().with(|set| {
        set.starts = Some(starts);
        set.condition = Condition::Normalised;
    })
}

#[test]
fn gradients_are_the_differences_of_the_criterion() {
    for (mechanism, condition) in [
        (hexapod(), Condition::Normalised),
        (hexapod(), Condition::Weighted),
        (hexapod().in_actuators().unwrap(), Condition::Normalised),
    ] {
        let base = mechanism.base().unwrap();
        let basis = Basis::new(&[1, 2, 3], Ends::Rest, 6, None).unwrap();
        let noise = [1.0, 2.0, 1.5, 3.0, 1.0, 2.5];
        let weights = (condition == Condition::Weighted).then_some(&noise[..]);
        let plant = Plant::from(&mechanism);
        let info = Information::new(&plant, &basis, 4.0, 60, base.selection(), weights);
        let m = basis.free();
        let r = &mut common::rng(4);
        let mut x = Vec::new();
        for k in 0..6 {
            let h = basis.harmonics.len();
            let mut c = vec![0.0; 2 * h + 1];
            c[0] = mechanism.home[k];
            let mut own = basis.parameters(k, &c).as_slice().to_vec();
            let scale = if mechanism.is_angle(k) { 0.08 } else { 0.03 };
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
            targets: None,
        };
        let mut e = Evaluation::default();
        let value = objective.evaluate(&info, &x, &mut e);
        assert!(value.is_finite());
        let spectrum = objective.spectrum(&e.gram).unwrap();
        let gradient = objective.smooth_gradient(&info, &mut e, &spectrum, 10.0);
        let size = largest(&gradient);
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

#[test]
fn limits_hold_at_100_khz_for_designs_that_use_them() {
    let hexapod = hexapod().with_workspace(&[0.1, 0.1, 0.1, 0.25, 0.25, 0.25]);
    let settings = quick(1).with(|set| {
        set.period = 4.0;
        set.harmonics = 4;
    });
    let design = run(&hexapod, &settings);
    let c = hexapod.certify(&design.trajectory.fourier, 1.0).unwrap();
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
        let a = assess(&plant, Some(&design.trajectory)).unwrap();
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

/// Largest deviation of velocities and accelerations from differences of the positions.
fn differences(fourier: &Fourier, motion: impl Fn(&Samples) -> Samples) -> [f64; 2] {
    let h = 1e-4;
    let mut off = [0.0f64; 2];
    for i in 0..20 {
        let t = fourier.period * (0.03 + 0.047 * f64::from(i));
        let state = |t: f64| {
            let mut s = Samples::zeros(fourier.dof(), 1);
            fourier.evaluate(t, [&mut s.q[..], &mut s.qd, &mut s.qdd]);
            motion(&s)
        };
        let near = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| state(t + k * h));
        for k in 0..near[2].dof {
            let slope = |of: fn(&Samples) -> &[f64]| {
                let [a, b, _, c, d] = near.each_ref().map(|s| of(s)[k]);
                (8.0 * (c - b) - (d - a)) / (12.0 * h)
            };
            off[0] = off[0].max((slope(|s| &s.q) - near[2].qd[k]).abs());
            off[1] = off[1].max((slope(|s| &s.qd) - near[2].qdd[k]).abs());
        }
    }
    off
}

#[test]
fn series_of_the_actuators_keep_all_limits_and_move_the_platform() {
    for (name, most) in [("delta", 40.0), ("h4", 40.0), ("hexapod", 150.0)] {
        let plant = bundled(name);
        let own = mechanism(&plant).in_actuators().unwrap();
        let settings = quick(1).with(|set| {
            set.period = 4.0;
            set.harmonics = 3;
        });
        let design = run(&own, &settings);
        let t = &design.trajectory;
        assert_eq!(t.space, Some(Space::Actuators));
        assert_eq!(t.joints, own.actuator_names());
        let c = own.certify(&t.fourier, 1.0).unwrap();
        assert!(c.satisfied && c.proven(), "{:?}", c.actuators.worst);
        // the series are the actuators: the certificate of a serial robot
        let exact = certify(&own.actuator_robot(), &t.fourier).unwrap();
        for (a, b) in c.actuators.joints.iter().zip(&exact.joints) {
            assert_eq!(a.position.bounds, b.position.bounds);
            assert_eq!(a.jerk.bound, b.jerk.bound);
        }
        // the platform follows exactly
        let at = |s: &Samples| own.platform_motion(s).unwrap().into_owned();
        let [velocity, acceleration] = differences(&t.fourier, at);
        println!("{name}: differences {velocity:.1e} {acceleration:.1e}");
        assert!(velocity < 1e-8 && acceleration < 1e-6);
        // the same torques as in the coordinates of the platform
        let s = t.fourier.motion(50);
        let (a, b) = (
            own.nominal_torque(&s).unwrap(),
            mechanism(&plant).nominal_torque(&at(&s)).unwrap(),
        );
        // at rest, sample 0, the sign of Coulomb friction is that of rounding
        let off = (0..a.len())
            .filter(|i| i % 50 != 0)
            .map(|i| (a[i] - b[i]).abs());
        assert!(off.fold(0.0, f64::max) < 1e-8);
        // judged from the file, by the robot as it is loaded
        let read = Trajectory::parse(&t.to_json().unwrap(), "t.json").unwrap();
        assert_eq!(read, *t);
        let condition = |t: &Trajectory| {
            let a = assess(&plant, Some(t)).unwrap();
            let e = a.excitation.unwrap();
            assert!(e.certificate.satisfied, "{:?}", e.certificate.worst);
            e.condition.normalised
        };
        let platform = run(mechanism(&plant), &settings).trajectory;
        let [actuators, platform] = [condition(&read), condition(&platform)];
        println!("{name}: condition of actuator series {actuators:.1}, platform {platform:.1}");
        assert!(actuators < most && actuators < 3.0 * platform, "{name}");
        if name == "delta" {
            check_at_100_khz(&own, &t.fourier);
        }
    }
}

#[test]
fn actuators_that_are_redundant_have_no_series_of_their_own() {
    let e = common::tripod::build(4, 1).unwrap().in_actuators();
    assert!(e.unwrap_err().to_string().contains("4 actuators"));
    let three = common::tripod::build(3, 1).unwrap().in_actuators().unwrap();
    let again = three.in_actuators().unwrap();
    assert_eq!(again.task_names, ["slide0", "slide1", "slide2"]);
    assert_eq!(again.platform().task_names, ["x", "y", "z"]);
}

#[test]
fn the_answer_does_not_depend_on_the_number_of_threads() {
    let plant = bundled("delta");
    let designed = [1, 2].map(|threads| {
        let settings = quick(3).with(|set| {
            set.threads = threads;
            set.harmonics = 3;
        });
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
        let settings = quick(8).with(|set| {
            set.ends = Ends::Free;
            set.time_limit = Some(30.0);
        });
        let design = run(&m, &settings);
        let w = m
            .regressor(&excite::trajectory::sample_period(
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
