//! The simulated robot obeys its equations, and what it logs is what happened.

mod written;

use excite::dynamics::Samples;
use excite::plant::Plant;
use excite::simulate::monte_carlo::monte_carlo;
use excite::simulate::parts::{Controller, Field};
use excite::simulate::record::{Columns, Sensors, measure, write_log};
use excite::simulate::{Dynamics, Effects, Run, Settings, simulate};
use excite::trajectory::parts::Series;
use excite::trajectory::{Fourier, Trajectory};
use nalgebra::DVector;
use std::process::Command;

/// A motion about the middle of the range of every coordinate, of moderate speed.
fn motion(plant: &Plant, period: f64, reach: f64, seed: u64) -> Fourier {
    let states = plant.random_states(200, 7);
    let n = plant.coordinates();
    let mut state = seed;
    let mut random = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 33) as f64 / (1u64 << 30) as f64 - 1.0
    };
    let joints = (0..n)
        .map(|j| {
            let row = &states.q[j * states.count..(j + 1) * states.count];
            let (low, high) = row
                .iter()
                .fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
            let middle = match plant.mechanism() {
                Some(m) => m.home[j],
                None => 0.5 * (low + high),
            };
            let half = 0.5 * (high - low) * reach / 3.0;
            Series {
                constant: middle,
                sin: (0..3).map(|_| half * random()).collect(),
                cos: (0..3).map(|_| half * random()).collect(),
            }
        })
        .collect();
    Fourier::new(period, vec![1, 2, 3], joints).unwrap()
}

fn frictionless(name: &str) -> Plant {
    let mut robot = excite::Robot::load(name).unwrap();
    for joint in &mut robot.joints {
        joint.terms[1..].fill(0.0);
        joint.limits.effort = f64::INFINITY;
    }
    Plant::from(robot)
}

fn quick() -> Settings {
    Settings::default().with(|set| {
        set.rate = 250.0;
        set.step = 5e-4;
        set.lead_in = 0;
    })
}

#[test]
fn equations_of_motion_are_those_of_the_inverse_dynamics() {
    for name in ["panda", "scara", "hexapod", "h4", "delta"] {
        let plant = Plant::load(name).unwrap();
        let states = plant.random_states(8, 3);
        let tau = plant.nominal_torque(&states).unwrap();
        let moved = plant.actuator_motion(&states).unwrap();
        let mut dynamics = Dynamics::nominal(&plant);
        for s in 0..states.count {
            let at = |a: &[f64]| DVector::from_fn(states.dof, |k, _| a[k * states.count + s]);
            let (x, xd, xdd) = (at(&states.q), at(&states.qd), at(&states.qdd));
            let terms = dynamics.terms(&x, &xd).unwrap();
            let mut rigid = DVector::from_fn(moved.dof, |a, _| tau[a * states.count + s]);
            for (a, joint) in plant.actuators().iter().enumerate() {
                let v = moved.qd[a * states.count + s];
                rigid[a] -= joint.terms[1] * v + joint.terms[2] * v.signum() + joint.terms[3];
            }
            let left = &terms.mass * &xdd + &terms.bias;
            let right = terms.d_a.tr_mul(&rigid);
            let error = (&left - &right).amax() / right.amax().max(1.0);
            assert!(error < 1e-9, "{name}: {error:.1e}");
            assert!(terms.mass.clone().cholesky().is_some(), "{name}");
        }
    }
}

/// Work of the drives and of gravity is kinetic energy, to the order of the integrator.
#[test]
fn energy_balance() {
    for (name, step, limit) in [
        ("panda", 1e-3, 2e-5),
        ("panda", 5e-4, 2e-6),
        ("ur10e", 5e-4, 2e-6),
    ] {
        let plant = frictionless(name);
        let fourier = motion(&plant, 2.0, 0.5, 11);
        let settings = Settings::default().with(|set| {
            set.rate = 2000.0;
            set.step = step;
            set.lead_in = 0;

            // a wrong start is what the feedback must work on
            set.effects = Effects::default().with(|set| set.perturb = 0.3);
        });
        let run = simulate(&plant, &fourier, 1, &settings, &|_| {}).unwrap();
        let effects = &settings.effects;
        let armature = effects.terms(&plant, 0).iter().map(|t| t[0]).collect();
        let gravity = plant.robot().gravity;
        let mut real = Dynamics::new(&plant, effects.inertia(&plant, 0), armature, gravity);
        let n = run.t.len();
        let (mut power, mut kinetic) = (Vec::new(), Vec::new());
        for k in 0..n {
            let at = |a: &[f64]| DVector::from_fn(run.motion.dof, |j, _| a[j * n + k]);
            let (x, xd) = (at(&run.motion.q), at(&run.motion.qd));
            let terms = real.terms(&x, &xd).unwrap();
            power.push((at(&run.tau) - &terms.gravity).dot(&xd));
            kinetic.push(terms.kinetic_energy(&xd));
        }
        // Simpson over an even number of intervals
        let m = (n - 1) / 2 * 2;
        let mut work = power[0] + power[m];
        for (k, p) in power.iter().enumerate().take(m).skip(1) {
            work += p * if k % 2 == 1 { 4.0 } else { 2.0 };
        }
        work /= 3.0 * 2000.0;
        let top = kinetic.iter().cloned().fold(0.0, f64::max);
        let error = (kinetic[m] - kinetic[0] - work).abs() / top;
        assert!(error < limit, "{name} at {step}: {error:.2e}");
        assert!(top > 0.01);
    }
}

/// Worst difference of inverse dynamics on the true motion and the applied torque over sliding
/// samples, and whether sticking ones stay inside their friction; relative to the largest torque.
fn agreement(plant: &Plant, run: &Run) -> (f64, usize) {
    let tau = plant.nominal_torque(&run.motion).unwrap();
    let n = run.t.len();
    let (mut worst, mut stuck) = (0.0f64, 0);
    for (a, joint) in plant.actuators().iter().enumerate() {
        let top = run.tau[a * n..(a + 1) * n]
            .iter()
            .fold(0.0f64, |m, v| m.max(v.abs()));
        for k in 0..n {
            let v = run.actuators.qd[a * n + k];
            let e = run.tau[a * n + k] - tau[a * n + k];
            if v.abs() > 1e-6 {
                worst = worst.max(e.abs() / top);
            } else {
                stuck += 1;
                assert!(
                    e.abs() <= 2.0 * joint.terms[2] + 1e-6,
                    "{}: {e}",
                    joint.name
                );
            }
        }
    }
    (worst, stuck)
}

#[test]
fn inverse_dynamics_on_the_motion_gives_the_torque() {
    for name in ["panda", "ur10e", "scara", "hexapod", "h4", "delta"] {
        let plant = Plant::load(name).unwrap();
        let fourier = motion(&plant, 5.0, 0.4, 5);
        let run = simulate(&plant, &fourier, 1, &quick(), &|_| {}).unwrap();
        assert!(run.warnings.is_empty(), "{:?}", run.warnings);
        let (worst, _) = agreement(&plant, &run);
        assert!(worst < 1e-9, "{name}: {worst:.1e}");
        let n = run.t.len();
        let error = (0..run.reference.len())
            .map(|i| (run.reference[i] - run.actuators.q[i]).abs())
            .fold(0.0, f64::max);
        println!("{name}: torque to {worst:.1e}, tracking to {error:.1e}, {n} samples");
        assert!(error < 0.02, "{name}: {error}");
    }
}

/// The motion is what integrates to itself: positions against integrated velocities.
#[test]
fn velocity_and_acceleration_are_derivatives() {
    let plant = Plant::load("ur10e").unwrap();
    let fourier = motion(&plant, 3.0, 0.5, 5);
    let settings = Settings::default().with(|set| {
        set.rate = 4000.0;
        set.step = 2.5e-4;
        set.lead_in = 0;
    });
    let run = simulate(&plant, &fourier, 1, &settings, &|_| {}).unwrap();
    let n = run.t.len();
    for j in 0..run.motion.dof {
        let (q, qd) = (
            &run.motion.q[j * n..(j + 1) * n],
            &run.motion.qd[j * n..(j + 1) * n],
        );
        for k in 1..n - 1 {
            let slope = (q[k + 1] - q[k - 1]) * 2000.0;
            assert!((slope - qd[k]).abs() < 1e-4, "{j} {k}: {slope} {}", qd[k]);
        }
    }
}

#[test]
fn a_perfect_model_without_friction_is_followed_exactly() {
    let plant = frictionless("ur10e");
    let fourier = motion(&plant, 3.0, 0.5, 5);
    let run = simulate(&plant, &fourier, 1, &quick(), &|_| {}).unwrap();
    for i in 0..run.reference.len() {
        assert!((run.reference[i] - run.actuators.q[i]).abs() < 1e-7);
    }
}

#[test]
fn a_joint_with_much_friction_sticks_and_breaks_away() {
    let mut robot = excite::Robot::load("planar2").unwrap();
    for joint in &mut robot.joints {
        joint.terms = [0.0, 0.1, 2.0, 0.0];
    }
    let plant = Plant::from(robot);
    let still = |a: f64| Series {
        constant: 0.3,
        sin: vec![a],
        cos: vec![0.0],
    };
    let fourier = Fourier::new(4.0, vec![1], vec![still(0.4), still(0.02)]).unwrap();
    let settings = Settings::default().with(|set| {
        set.controller = Controller::Pd;
        set.bandwidth = 3.0;
        set.lead_in = 0;
    });
    let run = simulate(&plant, &fourier, 2, &settings, &|_| {}).unwrap();
    let n = run.t.len();
    let (worst, stuck) = agreement(&plant, &run);
    assert!(worst < 1e-9 && stuck > n / 10, "{worst:.1e} {stuck} of {n}");
    // while it sticks it does not creep
    let q = &run.actuators.q[n..];
    let qd = &run.actuators.qd[n..];
    let mut longest = 0;
    let mut from = 0;
    for k in 1..n {
        if qd[k].abs() > 1e-8 || qd[k - 1].abs() > 1e-8 {
            from = k;
        }
        longest = longest.max(k - from);
        assert!((q[k] - q[from]).abs() < 1e-7 || qd[k].abs() > 1e-8);
    }
    assert!(longest > 50, "{longest}");
    assert!(qd.iter().any(|v| v.abs() > 1e-4));
}

#[test]
fn stribeck_friction_and_payload_show_in_the_torque() {
    let plant = Plant::load("hexapod").unwrap();
    let fourier = motion(&plant, 4.0, 0.6, 9);
    let mut settings = quick();
    let plain = simulate(&plant, &fourier, 1, &settings, &|_| {}).unwrap();
    settings
        .effects
        .set(&plant, Field::Stribeck, "15,0.01")
        .unwrap();
    settings.effects.payload =
        Some(excite::simulate::effects::parse_payload("22.26,0.03,-0.02,0.12").unwrap());
    let run = simulate(&plant, &fourier, 1, &settings, &|_| {}).unwrap();
    let n = run.t.len();
    let mean = |r: &Run| {
        (0..6)
            .map(|a| r.tau[a * n..(a + 1) * n].iter().sum::<f64>())
            .sum::<f64>()
            / n as f64
    };
    // legs that stand almost upright share the weight of the load
    let more = mean(&run) - mean(&plain);
    assert!(more > 22.26 * 9.81 && more < 1.6 * 22.26 * 9.81, "{more}");
    // with the load and the friction taken off, the model fits
    let mut mechanism = Plant::load("hexapod").unwrap().mechanism().unwrap().clone();
    let body = mechanism
        .robot
        .bodies
        .iter()
        .position(|b| b.name == "platform")
        .unwrap();
    let load = settings.effects.payload.unwrap();
    mechanism.robot.bodies[body].inertia = mechanism.robot.bodies[body].inertia + load;
    let tau = mechanism.nominal_torque(&run.motion).unwrap();
    for a in 0..6 {
        for k in 0..n {
            let v = run.actuators.qd[a * n + k];
            let stribeck = 15.0 * (-(v / 0.01f64).powi(2)).exp() * v.signum();
            if v.abs() > 1e-6 {
                let e = run.tau[a * n + k] - tau[a * n + k] - stribeck;
                assert!(e.abs() < 1e-6, "{a} {k}: {e}");
            }
        }
    }
}

#[test]
fn sensors_round_and_add_noise_reproducibly() {
    let plant = Plant::load("panda").unwrap();
    let fourier = motion(&plant, 2.0, 0.4, 2);
    let mut settings = Settings::default().with(|set| {
        set.rate = 1000.0;
        set.step = 1e-3;
        set.lead_in = 0;
    });
    settings.effects.torque_delay = 0.004;
    settings
        .effects
        .set(&plant, Field::TorqueGain, "panda_joint2=1.05")
        .unwrap();
    let run = simulate(&plant, &fourier, 1, &settings, &|_| {}).unwrap();
    let (sensors, _) = Sensors::new(&plant, 1.0);
    let one = measure(&run, &sensors, &settings.effects, 1);
    assert_eq!(one, measure(&run, &sensors, &settings.effects, 1));
    let two = measure(&run, &sensors, &settings.effects, 2);
    assert_ne!(one.tau, two.tau);
    let n = run.t.len();
    for a in 0..7 {
        let gain = if a == 1 { 1.05 } else { 1.0 };
        // sampled at 1 kHz: a delay of four samples
        let e: Vec<f64> = (4..n)
            .map(|k| one.tau[a * n + k] - gain * run.tau[a * n + k - 4])
            .collect();
        let rms = (e.iter().map(|x| x * x).sum::<f64>() / e.len() as f64).sqrt();
        assert!(
            (rms / sensors.torque_noise[a] - 1.0).abs() < 0.15,
            "{a}: {rms}"
        );
        for k in 0..n {
            assert!(
                (one.q[a * n + k] - run.actuators.q[a * n + k]).abs()
                    <= 0.5001 * sensors.resolution[a]
            );
        }
    }
    // ideal sensors
    let (ideal, _) = Sensors::new(&plant, 0.0);
    let plain = measure(&run, &ideal, &Effects::default(), 3);
    assert_eq!(plain.q, run.actuators.q);
}

#[test]
fn achieved_spread_is_the_predicted_one_where_the_model_is_right() {
    let plant = frictionless("planar2");
    let fourier = motion(&plant, 2.0, 0.5, 4);
    let settings = Settings::default().with(|set| {
        set.rate = 500.0;
        set.step = 1e-3;
        set.lead_in = 0;
    });
    let run = simulate(&plant, &fourier, 2, &settings, &|_| {}).unwrap();
    let (sensors, _) = Sensors::new(&plant, 1.0);
    let result = monte_carlo(&plant, &fourier, &run, &settings, &sensors, 200).unwrap();
    println!("{result:#?}");
    for p in &result.parameters {
        let ratio = p.achieved / p.predicted;
        assert!((0.8..1.4).contains(&ratio), "{}: {ratio}", p.parameter);
        assert!(
            p.bias.abs() < 0.5 * p.predicted,
            "{}: {}",
            p.parameter,
            p.bias
        );
    }
    assert!(monte_carlo(&plant, &fourier, &run, &settings, &sensors, 1).is_err());
}
