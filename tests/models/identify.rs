//! Identification: exact without noise, honest with it, possible always, and right on real robots.

mod command;
mod recorded;
mod told;

use crate::common::compare::largest;
use crate::common::noise::normal;
use crate::common::rng;
use crate::common::shared::shared;
use excite::identify::parts::{Consistency, Method};
use excite::identify::{Identification, Settings, identify};
use excite::log::parts::{Payload, Purpose};
use excite::log::{Experiment, Record};
use excite::robot::parts::JointTerm;
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
