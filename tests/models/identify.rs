//! Identification: exact without noise, honest with it, possible always, and right on real robots.

use crate::common::compare::largest;
use crate::common::noise::normal;
use crate::common::rng;
use crate::common::shared::shared;
use excite::identify::parts::{Consistency, Method};
use excite::identify::{Identification, Settings, identify};
use excite::log::parts::{Payload, Purpose};
use excite::log::{Experiment, Record};
use excite::robot::JointTerm;
use excite::{Plant, Robot};
use rand::Rng;
use std::f64::consts::PI;
use std::path::PathBuf;

/// A robot with all joint terms, and values of its parameters that are not the nominal ones.
fn truth(name: &str, seed: u64) -> (Plant, Vec<f64>) {
    let mut robot = Robot::load(name).unwrap().with_terms(&JointTerm::ALL);
    let r = &mut rng(seed);
    for joint in &mut robot.joints {
        joint.terms = [0.1, 1.0, 0.7, 0.2].map(|x: f64| x * r.random_range(0.5..1.5));
    }
    let plant = Plant::from(robot);
    // the same factor for all ten of a body keeps it one that can exist
    let mut phi = plant.values();
    let bodies = plant.robot().bodies.len();
    for b in 0..bodies {
        let f = r.random_range(0.8..1.25);
        phi[10 * b..10 * (b + 1)].iter_mut().for_each(|x| *x *= f);
    }
    phi[10 * bodies..]
        .iter_mut()
        .for_each(|x| *x *= r.random_range(0.8..1.25));
    (plant, phi)
}

/// Periods of a Fourier motion of harmonics 1 to 5 of 5 s, with the torques of `phi` and noise of
/// AR(1) with this standard deviation; with rates where they are asked for.
#[derive(Clone, Copy)]
struct Run {
    periods: usize,
    rate: f64,
    noise: f64,
    memory: f64,
    rates: bool,
    seed: u64,
    motion: u64,
}

impl Default for Run {
    fn default() -> Self {
        Run {
            periods: 2,
            rate: 200.0,
            noise: 0.0,
            memory: 0.0,
            rates: false,
            seed: 1,
            motion: 11,
        }
    }
}

fn record(plant: &Plant, phi: &[f64], purpose: Purpose, run: &Run) -> Record {
    let period = 5.0;
    let (n, each) = (plant.coordinates(), (period * run.rate) as usize);
    let count = each * run.periods;
    let r = &mut rng(run.motion);
    let mut x = excite::dynamics::Samples::zeros(n, each);
    for j in 0..n {
        let [low, high] = plant.robot().joints[j].limits.position;
        let half = if (high - low).is_finite() {
            (0.2 * (high - low)).min(0.8)
        } else {
            0.8
        };
        let middle = if (high - low).is_finite() {
            0.5 * (low + high)
        } else {
            0.0
        };
        let waves: Vec<(f64, f64, f64)> = (1..=5)
            .map(|h| {
                (
                    f64::from(h) * 2.0 * PI / period,
                    half * r.random_range(0.1..0.4),
                    r.random_range(0.0..std::f64::consts::TAU),
                )
            })
            .collect();
        for i in 0..each {
            let t = i as f64 / run.rate;
            let at = j * each + i;
            x.q[at] = middle
                + waves
                    .iter()
                    .map(|(w, a, p)| a * (w * t + p).sin())
                    .sum::<f64>();
            x.qd[at] = waves
                .iter()
                .map(|(w, a, p)| a * w * (w * t + p).cos())
                .sum();
            x.qdd[at] = waves
                .iter()
                .map(|(w, a, p)| -a * w * w * (w * t + p).sin())
                .sum();
        }
    }
    let tau = plant.torque(&x, phi).unwrap();
    let rows = |list: &[f64]| -> Vec<Vec<f64>> {
        list.chunks_exact(each)
            .map(|row| row.iter().cycle().take(count).copied().collect())
            .collect()
    };
    let mut tau = rows(&tau);
    let r = &mut rng(run.seed);
    if run.noise > 0.0 {
        for row in &mut tau {
            let mut e = 0.0;
            for v in row.iter_mut() {
                e = run.memory * e + (1.0 - run.memory * run.memory).sqrt() * normal(r);
                *v += run.noise * e;
            }
        }
    }
    Record {
        name: format!("{purpose:?}").to_lowercase(),
        path: PathBuf::from("made.csv"),
        purpose,
        period: Some(period),
        payload: Payload::None,
        step: 1.0 / run.rate,
        t: (0..count).map(|i| i as f64 / run.rate).collect(),
        valid: vec![true; count],
        qref: Some(rows(&x.q)),
        q: rows(&x.q),
        tau,
        dq: run.rates.then(|| rows(&x.qd)),
        ddq: run.rates.then(|| rows(&x.qdd)),
        ql: None,
        pose: None,
        pressures: None,
        resampled: false,
        written: None,
        warnings: Vec::new(),
    }
}

fn worst(id: &Identification, phi: &[f64], pi: &[f64]) -> f64 {
    let exact = id.base.project(phi);
    let size = largest(&exact);
    exact
        .iter()
        .zip(pi)
        .map(|(a, b)| (a - b).abs() / a.abs().max(1e-3 * size))
        .fold(0.0, f64::max)
}

#[test]
fn every_base_parameter_of_every_bundled_robot_comes_back_without_noise() {
    for name in excite::robot::bundled::list().iter().map(|b| b.name) {
        let plant = Plant::load(name).unwrap();
        if plant.mechanism().is_some() {
            continue;
        }
        let (plant, phi) = truth(name, 3);
        // positions alone (periods, frequency domain), and with the rates (as they stand)
        for rates in [false, true] {
            let r = record(
                &plant,
                &phi,
                Purpose::Fit,
                &Run {
                    rates,
                    periods: if rates { 1 } else { 2 },
                    ..Run::default()
                },
            );
            let settings = Settings::default().with(|set| set.prior_strength = Some(1e-2));
            let id = identify(&plant, &[r], &settings).unwrap();
            let e = worst(&id, &phi, &id.pi);
            assert!(e < 1e-8, "{name}, rates {rates}: {e:.2e}");
            assert!(id.consistent, "{name}");
            let e = worst(&id, &phi, &id.pi_consistent);
            assert!(e < 1e-3, "{name}, consistent: {e:.2e}");
        }
    }
}

/// The same for closed chains, from the positions of the actuators alone (forward kinematics, periods) and with
/// their measured rates (as they stand).
#[test]
fn every_base_parameter_of_every_bundled_parallel_robot_comes_back_without_noise() {
    for name in excite::mechanism::bundled::list().iter().map(|b| b.name) {
        let plant = Plant::load(name).unwrap();
        let Some(mechanism) = plant.mechanism() else {
            continue;
        };
        let mut phi = plant.values();
        phi.iter_mut().for_each(|x| *x *= 1.1);
        let (period, rate) = (5.0, 100.0);
        let (m, n, each) = (plant.coordinates(), plant.actuators().len(), 500);
        let r = &mut rng(21);
        let mut x = excite::dynamics::Samples::zeros(m, each);
        for k in 0..m {
            let [low, high] = mechanism.workspace[k].position;
            let half = 0.5 * (high - low).min(1.0);
            for h in 1..=4 {
                let w = f64::from(h) * 2.0 * PI / period;
                let (a, p) = (
                    half * r.random_range(0.05..0.2),
                    r.random_range(0.0..std::f64::consts::TAU),
                );
                for i in 0..each {
                    let t = i as f64 / rate;
                    x.q[k * each + i] += a * (w * t + p).sin();
                    x.qd[k * each + i] += a * w * (w * t + p).cos();
                    x.qdd[k * each + i] -= a * w * w * (w * t + p).sin();
                }
            }
            let middle = mechanism.home[k];
            x.q[k * each..(k + 1) * each]
                .iter_mut()
                .for_each(|v| *v += middle);
        }
        let tau = plant.torque(&x, &phi).unwrap();
        let motion = plant.actuator_motion(&x).unwrap();
        let twice = |list: &[f64]| -> Vec<Vec<f64>> {
            let rows = list.chunks_exact(each);
            rows.map(|row| [row, row].concat()).collect()
        };
        let record = Record {
            name: name.into(),
            path: PathBuf::from("made.csv"),
            purpose: Purpose::Fit,
            period: Some(period),
            payload: Payload::None,
            step: 1.0 / rate,
            t: (0..2 * each).map(|i| i as f64 / rate).collect(),
            valid: vec![true; 2 * each],
            q: twice(&motion.q),
            tau: twice(&tau),
            dq: None,
            ddq: None,
            qref: None,
            ql: None,
            pose: None,
            pressures: None,
            resampled: false,
            written: None,
            warnings: Vec::new(),
        };
        assert_eq!(record.actuators(), n);
        let settings = Settings::default().with(|set| set.prior_strength = Some(1e-2));
        let measured = Record {
            period: None,
            dq: Some(twice(&motion.qd)),
            ddq: Some(twice(&motion.qdd)),
            ..record.clone()
        };
        for r in [record, measured] {
            let rates = r.dq.is_some();
            let id = identify(&plant, &[r], &settings).unwrap();
            let e = worst(&id, &phi, &id.pi);
            println!("{name}, rates {rates}: {e:.1e}");
            assert!(e < 1e-8, "{name}, rates {rates}: {e:.2e}");
            assert!(id.consistent, "{name}: {:?}", id.margin);
            let unfiltered = id.prepared[0]
                .position_cutoff
                .iter()
                .all(|f| f.is_infinite());
            assert_eq!(unfiltered, rates, "{name}");
        }
    }
}

/// 95 % intervals hold the truth in 95 % of the runs, with white noise and with correlated noise.
#[test]
fn intervals_cover() {
    for memory in [0.0, 0.95] {
        let (plant, phi) = truth("planar2", 5);
        let (mut inside, mut total) = (0, 0);
        for seed in 0..80 {
            let run = Run {
                noise: 0.3,
                memory,
                seed: 100 + seed,
                periods: 4,
                rate: 400.0,
                ..Run::default()
            };
            let mut r = record(&plant, &phi, Purpose::Fit, &run);
            // exact rates, so that only the torque is noisy
            r.period = None;
            let exact = record(&plant, &phi, Purpose::Fit, &Run { rates: true, ..run });
            (r.dq, r.ddq) = (exact.dq, exact.ddq);
            let settings = Settings::default().with(|set| set.prior_strength = Some(1.0));
            let id = identify(&plant, &[r], &settings).unwrap();
            for ((x, s), exact) in id.pi.iter().zip(&id.std).zip(id.base.project(&phi)) {
                inside += usize::from((x - exact).abs() <= 1.96 * s);
                total += 1;
            }
        }
        let share = f64::from(inside as u32) / f64::from(total as u32);
        println!(
            "memory {memory}: {:.1} % of {total} intervals hold the truth",
            100.0 * share
        );
        assert!((0.90..0.985).contains(&share), "memory {memory}: {share}");
    }
}

#[test]
fn all_methods_agree_where_they_should() {
    let (plant, phi) = truth("planar2", 9);
    let run = Run {
        noise: 0.2,
        periods: 5,
        ..Run::default()
    };
    let fit = record(&plant, &phi, Purpose::Fit, &run);
    let holdout = record(
        &plant,
        &phi,
        Purpose::Holdout,
        &Run {
            motion: 12,
            noise: 0.0,
            ..run
        },
    );
    for method in [
        Method::Ols,
        Method::Wls,
        Method::Robust,
        Method::Ml,
        Method::Iv,
    ] {
        let settings = Settings::default().with(|set| set.method = method);
        let id = identify(&plant, &[fit.clone(), holdout.clone()], &settings).unwrap();
        let far = id
            .pi
            .iter()
            .zip(id.base.project(&phi))
            .zip(&id.std)
            .map(|((x, y), s)| (x - y).abs() / s)
            .fold(0.0, f64::max);
        assert!(far < 5.0, "{method:?}: {far}");
        assert!(
            id.validation.holdout.as_ref().unwrap().relative_error < 0.02,
            "{method:?}"
        );
        assert!(id.consistent);
    }
    // without periods there is no scatter, without command no instruments
    let mut bare = fit.clone();
    (bare.period, bare.qref) = (None, None);
    for (method, word) in [(Method::Ml, "period"), (Method::Iv, "qref1")] {
        let settings = Settings::default().with(|set| set.method = method);
        let e = identify(&plant, &[bare.clone()], &settings)
            .unwrap_err()
            .to_string();
        assert!(e.contains(word), "{e}");
    }
}

#[test]
fn outliers_do_not_move_the_robust_estimate() {
    let (plant, phi) = truth("planar2", 9);
    let mut r = record(
        &plant,
        &phi,
        Purpose::Fit,
        &Run {
            noise: 0.05,
            rates: true,
            periods: 1,
            ..Run::default()
        },
    );
    r.period = None;
    let n = r.len();
    for k in (0..n).filter(|k| (k / 40) % 9 == 4) {
        r.tau[0][k] += 30.0;
    }
    let error = |method: Method| {
        let settings = Settings::default().with(|set| {
            set.method = method;
            set.prior_strength = Some(1.0);
        });
        let id = identify(&plant, &[r.clone()], &settings).unwrap();
        worst(&id, &phi, &id.pi)
    };
    let (plain, robust) = (error(Method::Wls), error(Method::Robust));
    assert!(robust < 0.2 * plain, "{robust} {plain}");
}

#[test]
fn bodies_stay_possible_when_the_data_are_poor() {
    let (plant, phi) = truth("panda", 4);
    let run = Run {
        noise: 20.0,
        periods: 1,
        rate: 100.0,
        rates: true,
        ..Run::default()
    };
    let r = record(&plant, &phi, Purpose::Fit, &run);
    for consistency in [Consistency::Entropic, Consistency::Lmi] {
        let settings = Settings::default().with(|set| {
            set.consistency = consistency;
            set.prior_strength = Some(1.0);
        });
        let id = identify(&plant, std::slice::from_ref(&r), &settings).unwrap();
        assert!(id.consistent, "{consistency:?} {:?}", id.margin);
        let robot = plant.with_values(&id.phi);
        for b in &robot.bodies {
            let (smallest, violated) = b.inertia.realizability();
            assert!(
                smallest > 0.0 && violated < 1e-9,
                "{}: {smallest} {violated}",
                b.name
            );
        }
        for j in &robot.joints {
            assert!(
                j.terms[..3].iter().all(|x| *x >= -1e-9),
                "{}: {:?}",
                j.name,
                j.terms
            );
        }
    }
    let free = Settings::default().with(|set| set.consistency = Consistency::Free);
    assert!(
        !identify(&plant, &[r], &free).unwrap().consistent,
        "this noise makes impossible bodies"
    );
}

#[test]
fn what_the_motion_does_not_show_is_named() {
    let (plant, phi) = truth("planar2", 4);
    let mut r = record(
        &plant,
        &phi,
        Purpose::Fit,
        &Run {
            rates: true,
            periods: 1,
            ..Run::default()
        },
    );
    r.period = None;
    // joint 1 stands still: its armature, viscous and Coulomb friction have no effect
    let n = r.len();
    r.q[0] = vec![0.3; n];
    r.dq.as_mut().unwrap()[0] = vec![0.0; n];
    r.ddq.as_mut().unwrap()[0] = vec![0.0; n];
    let x = excite::dynamics::Samples {
        dof: 2,
        count: n,
        q: r.q.concat(),
        qd: r.dq.as_ref().unwrap().concat(),
        qdd: r.ddq.as_ref().unwrap().concat(),
    };
    let tau = plant.torque(&x, &phi).unwrap();
    r.tau = tau.chunks_exact(n).map(<[f64]>::to_vec).collect();
    let id = identify(
        &plant,
        &[r],
        &Settings::default().with(|set| set.prior_strength = Some(1.0)),
    )
    .unwrap();
    let text: Vec<String> = id.warnings.iter().map(ToString::to_string).collect();
    let name = format!("{}.viscous", plant.robot().joints[0].name);
    assert!(
        text.iter()
            .any(|t| t.contains("says nothing") && t.contains(&name)),
        "{text:#?}"
    );
    assert!(id.phi.iter().all(|x| x.is_finite()) && id.consistent);
}

/// A joint that is held by its friction for half of the record, its encoder trembling, does not spoil the fit.
#[test]
fn standstill_is_left_out() {
    let (plant, phi) = truth("planar2", 4);
    let mut run = record(&plant, &phi, Purpose::Fit, &Run::default());
    run.period = None;
    let n = run.len();
    // the first joint runs through its motion, then stays where that began; the second goes on
    let half = n / 2;
    let fifth = run.q[0][0];
    let blend = |i: usize| {
        let x = ((i as f64 - half as f64) / 200.0).clamp(0.0, 1.0);
        1.0 - x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)
    };
    run.q[0] = (0..n)
        .map(|i| fifth + (run.q[0][i] - fifth) * blend(i))
        .collect();
    let exact: Vec<Vec<f64>> = run.q.clone();
    let rates = |q: &[f64]| -> Vec<f64> {
        let at = |i: usize, d: isize| q[(i as isize + d).clamp(0, n as isize - 1) as usize];
        (0..n)
            .map(|i| (at(i, 1) - at(i, -1)) / (2.0 * run.step))
            .collect()
    };
    let qd: Vec<Vec<f64>> = exact.iter().map(|q| rates(q)).collect();
    let x = excite::dynamics::Samples {
        dof: 2,
        count: n,
        qdd: qd.iter().flat_map(|v| rates(v)).collect(),
        qd: qd.concat(),
        q: exact.concat(),
    };
    let tau = plant.torque(&x, &phi).unwrap();
    run.tau = tau.chunks_exact(n).map(<[f64]>::to_vec).collect();
    let index = |name: &str| {
        plant
            .parameters()
            .iter()
            .position(|p| p.name == name)
            .unwrap()
    };
    let joint = plant.robot().joints[0].name.clone();
    let coulomb = phi[index(&format!("{joint}.coulomb"))];
    for i in half + 200..n {
        // at rest friction holds most of what it can
        run.tau[0][i] += 0.9 * coulomb;
    }
    let r = &mut rng(8);
    for q in run.q.iter_mut().flatten() {
        *q += 2e-6 * normal(r);
    }
    let settings = Settings::default().with(|set| set.prior_strength = Some(1e-2));
    let id = identify(&plant, &[run], &settings).unwrap();
    let told: Vec<String> = id.warnings.iter().map(ToString::to_string).collect();
    assert!(
        told.iter()
            .any(|t| t.contains("standstill") && t.contains(&joint)),
        "{told:#?}"
    );
    let exact = id.base.project(&phi);
    for (k, (a, b)) in exact.iter().zip(&id.pi).enumerate() {
        let name = id.base.name(k);
        println!("{name}: {a:.4} {b:.4}");
        if name == format!("{joint}.offset") || name == format!("{joint}.coulomb") {
            assert!((a - b).abs() < 0.05 * coulomb, "{name}: {a} {b}");
        }
    }
}

#[test]
fn torques_in_other_units_are_suspected() {
    let (plant, phi) = truth("planar2", 4);
    let mut r = record(&plant, &phi, Purpose::Fit, &Run::default());
    r.tau[1].iter_mut().for_each(|x| *x *= -1.0);
    r.tau[0].iter_mut().for_each(|x| *x *= 0.01);
    let id = identify(&plant, &[r], &Settings::default()).unwrap();
    let text: Vec<String> = id.warnings.iter().map(ToString::to_string).collect();
    assert!(text.iter().any(|t| t.contains("opposite")), "{text:#?}");
    assert!(
        text.iter().any(|t| t.contains("times the model's")),
        "{text:#?}"
    );
}

fn recorded(name: &str) -> Option<Experiment> {
    let folder = shared(&format!("data/{name}"))?;
    Some(Experiment::read(folder.join("experiment.toml")).unwrap())
}

/// Without the recordings a test passes, and is not silent: the line is there although nothing asks for the output.
#[test]
fn a_test_without_its_recordings_says_so() {
    let nothing = tempfile::tempdir().unwrap();
    let out = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["identify::emps_gives_the_published_values", "--exact"])
        .env("EXCITE_SHARED", nothing.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{said}");
    assert!(said.contains("skipped: ../shared/data/emps"), "{said}");
}

#[test]
fn emps_gives_the_published_values() {
    let Some(e) = recorded("emps") else { return };
    // a strength at which the prior, which holds the published values, does nothing
    let settings = Settings::default().with(|set| set.prior_strength = Some(1e-2));
    let id = identify(&e.plant, &e.records, &settings).unwrap();
    for (name, value) in [
        ("carriage.m", 95.1),
        ("slide.viscous", 203.5),
        ("slide.coulomb", 20.4),
        ("slide.offset", -3.16),
    ] {
        let k = (0..id.base.count())
            .find(|&k| id.base.name(k) == name)
            .unwrap();
        for x in [id.pi[k], id.pi_consistent[k]] {
            assert!((x / value - 1.0).abs() < 0.01, "{name}: {x}");
        }
    }
    let v = &id.validation;
    println!(
        "emps: fit {:.4}, holdout {:?}",
        v.fit.relative_error, v.plain.1
    );
    assert!(v.fit.relative_error < 0.0408 && v.plain.1.unwrap() < 0.046);
    // the published 2475 samples of 24.75 s hold a band of 50 Hz
    let mut settings = settings;
    settings.signals.cutoff = Some(50.0);
    let id = identify(&e.plant, &e.records, &settings).unwrap();
    let error = id.validation.fit.relative_error;
    println!("emps, 50 Hz: fit {error:.4}");
    assert!((error - 0.0408).abs() < 0.0005, "{error}");
}

#[test]
fn panda_predicts_its_second_half() {
    let Some(e) = recorded("panda") else { return };
    let terms = [JointTerm::Viscous, JointTerm::Coulomb, JointTerm::Offset];
    let plant = e.plant.with_terms(&terms);
    let id = identify(&plant, &e.records, &Settings::default()).unwrap();
    let h = id.validation.holdout.as_ref().unwrap().relative_error;
    println!(
        "panda: fit {:.4} holdout {h:.4}, plain {:?}",
        id.validation.fit.relative_error, id.validation.plain
    );
    assert!(h < 0.015 && id.consistent);
}

#[test]
fn tx40_is_better_than_plain_least_squares_and_says_what_is_left() {
    let Some(e) = recorded("tx40") else { return };
    let id = identify(&e.plant, &e.records, &Settings::default()).unwrap();
    let v = &id.validation;
    let h = v.holdout.as_ref().unwrap().relative_error;
    println!(
        "tx40: fit {:.4} holdout {h:.4}, plain {:?}, {:?}",
        v.fit.relative_error, v.plain, v.followers
    );
    assert!(h < 0.155 && id.consistent);
    // the coupled wrist: the residual of axis 5 goes with axis 6
    assert!(
        v.followers
            .iter()
            .any(|f| f.actuator == 4 && f.what.contains("joint_6")),
        "{:?}",
        v.followers
    );
}

/// The program: files, exit status, nothing replaced, and a robot.toml that is the model.
#[test]
fn the_command_writes_a_model_that_is_the_model() {
    let dir = tempfile::tempdir().unwrap();
    let (plant, phi) = truth("planar2", 6);
    let run = Run {
        noise: 0.05,
        periods: 3,
        ..Run::default()
    };
    for (name, motion) in [("fit", 11), ("holdout", 12)] {
        let r = record(&plant, &phi, Purpose::Fit, &Run { motion, ..run });
        let mut text = String::from("t,q1,q2,tau1,tau2\n");
        for i in 0..r.len() {
            text += &format!(
                "{},{},{},{},{}\n",
                r.t[i], r.q[0][i], r.q[1][i], r.tau[0][i], r.tau[1][i]
            );
        }
        std::fs::write(dir.path().join(format!("{name}.csv")), text).unwrap();
    }
    let experiment = dir.path().join("experiment.toml");
    std::fs::write(
        &experiment,
        "robot = \"planar2\"\n[[record]]\nlog = \"fit.csv\"\nuse = \"fit\"\nperiod = 5.0\n[[record]]\n\
         log = \"holdout.csv\"\nuse = \"holdout\"\n",
    )
    .unwrap();
    let out = dir.path().join("out");
    let excite = |more: &[&str]| {
        let mut c = assert_cmd::Command::cargo_bin("excite").unwrap();
        c.arg("identify").arg(&experiment).arg("--output").arg(&out);
        c.args(["--identify", "armature,viscous,coulomb,offset"])
            .args(more);
        c
    };
    excite(&[]).assert().success();
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    let report: serde_json::Value = serde_json::from_str(&read("report.json")).unwrap();
    assert!(
        report["validation"]["holdout"]["relative_error"]
            .as_f64()
            .unwrap()
            < 0.01
    );
    assert_eq!(report["physically_consistent"], true);
    let base = report["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|p| p["kind"] == "base")
        .count();
    assert_eq!(report["base_parameters"], base);
    // the written robot has the torques of the model
    let model: serde_json::Value = serde_json::from_str(&read("model.json")).unwrap();
    let values: Vec<f64> = model["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| p["value"].as_f64().unwrap())
        .collect();
    let written = Plant::load(out.join("robot.toml").to_str().unwrap()).unwrap();
    let states = plant.random_states(40, 5);
    let (a, b) = (
        plant.torque(&states, &values).unwrap(),
        written.nominal_torque(&states).unwrap(),
    );
    for (a, b) in a.iter().zip(&b) {
        assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{a} {b}");
    }
    assert!(read("robot.xml").contains("frictionloss") && read("report.html").contains("</html>"));
    // nothing is replaced without --force
    excite(&[]).assert().code(1);
    excite(&["--force", "--method", "robust"])
        .assert()
        .success();
    excite(&["--force", "--method", "magic"]).assert().code(2);
    excite(&["--force", "--prior", "-1"]).assert().code(2);
}
