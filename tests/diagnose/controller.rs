//! What the diagnosis reads from the logs beside effects. The controller, and the simulation under the same
//! commands: gains that were set are found again, and the simulated model moves as it does when it is run
//! under that controller. And how close an identified model is.

use crate::common::rehearse::{self, Log, without_commands};
use crate::common::shared::shared;
use excite::diagnose::controller::{Feedback, Kind, identify};
use excite::diagnose::evidence::Evidence;
use excite::diagnose::parts::Verdict;
use excite::diagnose::{Diagnosis, Settings, of_logs, prepare};
use excite::log::{Channels, Experiment, Record};
use excite::plant::Plant;
use excite::robot::Inertia;
use excite::robot::parts::Prior;
use excite::simulate::parts::Controller;
use excite::simulate::record::{Sensors, measure};
use excite::simulate::{Effects, Settings as Simulation, simulate};
use excite::trajectory::Fourier;
use excite::trajectory::parts::Series;
use std::f64::consts::TAU;

const RATE: f64 = 250.0;
/// Noise, in units of what the robot file states.
const NOISE: f64 = 0.005;

fn motion(dof: usize, period: f64, size: f64) -> Fourier {
    let series = |j: usize| Series {
        constant: 0.2 * size,
        sin: vec![size, 0.3 * size * (j as f64 + 1.0).cos(), 0.1 * size],
        cos: vec![-0.3 * size, 0.2 * size, 0.15 * size * (j as f64).sin()],
    };
    let joints = (0..dof).map(series).collect();
    Fourier::new(period, vec![1, 3, 5], joints).unwrap()
}

fn settings(controller: Controller, bandwidth: f64, perturb: f64) -> Simulation {
    Simulation::default().with(|set| {
        set.rate = RATE;
        set.step = 5e-4;
        set.controller = controller;
        set.bandwidth = bandwidth;
        set.damping = 0.8;
        set.effects = Effects::default().with(|set| set.perturb = perturb);
        set.seed = 3;
    })
}

/// A log of the simulated robot with its commanded positions, and its true positions.
fn log(plant: &Plant, motion: &Fourier, fit: bool, settings: &Simulation, noise: f64) -> Log {
    rehearse::log(plant, motion, fit, settings, noise, 7)
}

fn feedback(plant: &Plant, raws: &[Record]) -> Result<Feedback, String> {
    let data = prepare(plant, raws).unwrap();
    let phi = Evidence::new(&data, 1.0).phi;
    identify(&data, &phi)
}

#[test]
fn inverse_dynamics_control_is_found_and_gives_the_motion_of_the_model() {
    let plant = Plant::load("ur5e").unwrap();
    let real = settings(Controller::Feedforward, 3.0, 0.1);
    let fast = motion(6, 4.0, 0.5);
    let slow = motion(6, 6.0, 0.4);
    let one = |motion: &Fourier, fit: bool| log(&plant, motion, fit, &real, NOISE);
    let (fitted, held) = (one(&fast, true), one(&slow, false));
    let (raws, truth) = ([fitted.record, held.record], held.truth);
    let found = feedback(&plant, &raws).unwrap();
    let omega = TAU * 3.0;
    assert_eq!(found.kind, Kind::InverseDynamics);
    let [kp, kd, ki] = found.gains[0];
    println!(
        "k_p {kp:.1} ({:.1}), k_d {kd:.2} ({:.2})",
        omega * omega,
        1.6 * omega
    );
    assert!((kp / (omega * omega) - 1.0).abs() < 0.05, "{kp}");
    assert!((kd / (1.6 * omega) - 1.0).abs() < 0.1, "{kd}");
    assert_eq!(ki, 0.0);

    // the model under this controller, by the simulator; and by the diagnosis, which has only the logs
    let model = settings(Controller::Feedforward, 3.0, 0.0);
    let moved = log(&plant, &slow, false, &model, NOISE).truth;
    let plain = Settings::default().with(|set| set.next = false);
    let d = of_logs(&plant, &raws, &plain, &|_| {}).unwrap();
    let f = &d.forward.records[0];
    let count = raws[1].t.len();
    let last = 2 * count / 3..count;
    let mut ratios = Vec::new();
    for j in 0..6 {
        let (mut square, mut off) = (0.0, 0.0);
        for i in last.clone() {
            let expected = moved[j * count + i] - truth[j * count + i];
            square += expected * expected;
            off += (f.deviation[0][j][i] - expected).powi(2);
        }
        let ratio = (off / square).sqrt();
        println!(
            "joint {j}: expected {:.2e} rad rms, off by {:.1} %",
            (square / last.len() as f64).sqrt(),
            100.0 * ratio
        );
        ratios.push(ratio);
    }
    // the noise of the recorded torque moves the last joint, which has next to no inertia
    ratios.sort_by(f64::total_cmp);
    assert!(ratios[3] < 0.05 && ratios[5] < 0.3, "{ratios:?}");
}

/// `τ = k_p e + k_d ė` without feedforward: the command that makes just this torque is computed.
#[test]
fn gains_of_single_joints_are_found() {
    let plant = Plant::load("ur5e").unwrap();
    let sim = settings(Controller::Feedforward, 20.0, 0.05);
    let (gains, n) = (
        [
            [900.0, 60.0],
            [2000.0, 90.0],
            [1500.0, 80.0],
            [300.0, 15.0],
            [250.0, 12.0],
            [200.0, 10.0],
        ],
        6,
    );
    let periodic = motion(n, 4.0, 0.5);
    let run = simulate(&plant, &periodic, 3, &sim, &|_| {}).unwrap();
    let count = run.t.len();
    let seen = measure(&run, &Sensors::new(&plant, NOISE).0, &sim.effects, 7);
    let columns = |x: &[f64]| -> Vec<Vec<f64>> { x.chunks(count).map(<[f64]>::to_vec).collect() };
    // e over a period from ė = (τ − k_p e)/k_d, until it repeats
    let dt = 1.0 / RATE;
    let commanded: Vec<Vec<f64>> = (0..n)
        .map(|j| {
            let [kp, kd] = gains[j];
            let tau = |i: usize| run.tau[j * count + i % count];
            let mut e = tau(0) / kp;
            let mut out = vec![0.0; count];
            for pass in 0..2 {
                for (i, out) in out.iter_mut().enumerate() {
                    if pass == 1 {
                        *out = run.actuators.q[j * count + i] + e;
                    }
                    // exact for a torque that is linear between samples
                    let (a, b) = (tau(i), (tau(i + 1) - tau(i)) / dt);
                    let r = kp / kd;
                    let steady = |t: f64| (a + b * t) / kp - b / (kp * r);
                    e = steady(dt) + (e - steady(0.0)) * (-r * dt).exp();
                }
            }
            out
        })
        .collect();
    let channels = Channels {
        t: run.t.clone(),
        q: columns(&seen.q),
        tau: columns(&seen.tau),
        qref: Some(commanded),
    };
    let raw = rehearse::record(&plant, 4.0, true, channels);
    let found = feedback(&plant, std::slice::from_ref(&raw)).unwrap();
    assert_eq!(found.kind, Kind::Actuators);
    assert!(found.soft.len() < 2, "{:?}", found.soft);
    let soft = &found.soft;
    for (j, (found, set)) in found.gains.iter().zip(&gains).enumerate() {
        if soft.contains(&j) {
            continue;
        }
        println!("joint {j}: {found:?}, set {set:?}");
        for k in 0..2 {
            assert!(
                (found[k] / set[k] - 1.0).abs() < 0.1,
                "joint {j}: {found:?}, set {set:?}"
            );
        }
    }
    // without the commands there is no controller, and the diagnosis says so
    let blind = without_commands(Log {
        record: raw,
        truth: Vec::new(),
    });
    assert!(feedback(&plant, &[blind]).unwrap_err().contains("qref1"));
}

/// A command that has nothing to do with the torque is not taken for a controller.
#[test]
fn torque_without_feedback_gives_no_gains() {
    let plant = Plant::load("planar2").unwrap();
    let sim = settings(Controller::Feedforward, 10.0, 0.1);
    let mut raw = log(&plant, &motion(2, 3.0, 0.6), true, &sim, NOISE).record;
    let shifted = raw.t.len() / 5;
    for q in raw.qref.iter_mut().flatten() {
        q.rotate_left(shifted);
    }
    let why = feedback(&plant, &[raw]).unwrap_err();
    assert!(why.contains("no linear feedback"), "{why}");
}

/// Published controller of the EMPS (Janot, Gautier & Brunot 2019): `u = k_v (k_p (q_r − q) − q̇)` with
/// k_p = 160.18 /s, so that the ratio of the two gains is known whatever the scale of the torque.
#[test]
fn the_controller_of_the_emps() {
    let Some(folder) = shared("data/emps") else {
        return;
    };
    let experiment = Experiment::read(folder.join("experiment.toml")).unwrap();
    let found = feedback(&experiment.plant, &experiment.records).unwrap();
    let [kp, kd, _] = found.gains[0];
    println!(
        "EMPS: k_p/k_d {:.1} 1/s (published 160.18), leaves {:?}",
        kp / kd,
        found.left
    );
    assert!((kp / kd / 160.18 - 1.0).abs() < 0.05, "{kp} {kd}");
    assert!(found.left[0] < 0.02);
}

/// An identified six-axis arm whose machine differs by `perturb`, with a load or none.
fn identified(perturb: f64, load: Option<f64>) -> Diagnosis {
    let mut robot = excite::Robot::load("ur5e").unwrap();
    robot.prior = Prior::Identified;
    let plant = Plant::from(robot);
    let mut sim = settings(Controller::Feedforward, 15.0, perturb);
    sim.effects.payload = load.map(|m| {
        let com = nalgebra::Vector3::new(0.02, 0.0, 0.06);
        Inertia::from_com(m, com, nalgebra::Matrix3::identity() * (1e-4 * m))
    });
    let raws: Vec<Record> = [(4.0, 0.6, true), (6.5, 0.5, true), (5.0, 0.55, false)]
        .map(|(period, size, fit)| {
            without_commands(log(&plant, &motion(6, period, size), fit, &sim, 1.0))
        })
        .into();
    let plain = Settings::default().with(|set| set.next = false);
    of_logs(&plant, &raws, &plain, &|_| {}).unwrap()
}

/// How far a model may be off is read from the records: what a looser prior takes for an ordinary error is seen
/// on a model that has none, and ordinary errors of a looser model are not sold as an effect.
#[test]
fn a_close_model_shows_what_a_loose_one_hides() {
    let names = |d: &Diagnosis| -> Vec<&str> {
        let claims = d.findings.iter().filter(|f| f.confidence >= 0.5);
        claims.map(|f| f.effect).collect()
    };
    let close = identified(0.001, None);
    let loose = identified(0.015, None);
    let loaded = identified(0.001, Some(0.05));
    for (what, d) in [("close", &close), ("loose", &loose), ("loaded", &loaded)] {
        let frozen = d.frozen.iter().map(|g| g.rms / g.noise).fold(0.0, f64::max);
        println!(
            "{what}: closeness {:?}, frozen gap {frozen:.2} of the noise, {:?} {:?}",
            d.closeness,
            d.verdict,
            names(d)
        );
    }
    assert!(names(&close).is_empty() && close.verdict == Verdict::NoGap);
    assert!(close.closeness[0] < 0.5, "{:?}", close.closeness);
    assert!(names(&loose).is_empty(), "{:?}", names(&loose));
    assert!(loose.closeness[0] > close.closeness[0]);
    assert!(
        names(&loaded).contains(&"payload"),
        "{:?} {:?}",
        loaded.closeness,
        names(&loaded)
    );
}
