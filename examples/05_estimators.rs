//! Which estimator? Monte Carlo over rehearsed runs of a UR5e with friction: torque error on a motion that
//! was not fitted, without noise, for every estimator and four kinds of trouble.
//!
//! `cargo run --release --example 05_estimators [RUNS]`, 20 runs a row

use excite::dynamics::Samples;
use excite::identify::parts::{Consistency, Method};
use excite::identify::{Settings, identify};
use excite::log::Record;
use excite::log::parts::{Payload, Purpose};
use excite::robot::parts::JointTerm;
use excite::{Plant, Robot};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

const PERIOD: f64 = 5.0;
const RATE: f64 = 100.0;

/// Standard deviations of torque and position noise, share of outliers, memory of the torque noise.
struct Trouble(&'static str, f64, f64, f64, f64);

fn normal(r: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| r.random_range(-0.5..0.5)).sum()
}

fn motion(plant: &Plant, seed: u64) -> Samples {
    let mut r = ChaCha8Rng::seed_from_u64(seed);
    let (n, count) = (plant.coordinates(), (PERIOD * RATE) as usize);
    let mut x = Samples::zeros(n, count);
    for j in 0..n {
        for h in 1..=5 {
            let (w, a, p) = (
                f64::from(h) * 2.0 * PI / PERIOD,
                r.random_range(0.1..0.4),
                r.random_range(0.0..std::f64::consts::TAU),
            );
            for i in 0..count {
                let t = i as f64 / RATE;
                x.q[j * count + i] += a * (w * t + p).sin();
                x.qd[j * count + i] += a * w * (w * t + p).cos();
                x.qdd[j * count + i] -= a * w * w * (w * t + p).sin();
            }
        }
    }
    x
}

fn record(plant: &Plant, phi: &[f64], trouble: &Trouble, seed: u64) -> excite::Result<Record> {
    let x = motion(plant, 7);
    let tau = plant.torque(&x, phi)?;
    let r = &mut ChaCha8Rng::seed_from_u64(seed);
    let count = 4 * x.count;
    let mut noisy = |list: &[f64], sigma: f64, outliers: f64, memory: f64| -> Vec<Vec<f64>> {
        list.chunks_exact(x.count)
            .map(|row| {
                let mut e = 0.0;
                let mut bad = 0;
                (0..count)
                    .map(|i| {
                        e = memory * e + (1.0 - memory * memory).sqrt() * normal(r);
                        if r.random_range(0.0..1.0) < outliers / 20.0 {
                            bad = 20;
                        }
                        bad -= i32::from(bad > 0);
                        row[i % x.count] + sigma * e * if bad > 0 { 30.0 } else { 1.0 }
                    })
                    .collect()
            })
            .collect()
    };
    let Trouble(_, torque, position, outliers, memory) = *trouble;
    Ok(Record {
        name: "fit".into(),
        path: "fit.csv".into(),
        purpose: Purpose::Fit,
        period: Some(PERIOD),
        payload: Payload::None,
        step: 1.0 / RATE,
        t: (0..count).map(|i| i as f64 / RATE).collect(),
        valid: vec![true; count],
        q: noisy(&x.q, position, 0.0, 0.0),
        tau: noisy(&tau, torque, outliers, memory),
        qref: Some(noisy(&x.q, 0.0, 0.0, 0.0)),
        dq: None,
        ddq: None,
        ql: None,
        pose: None,
        pressures: None,
        resampled: false,
        written: None,
        warnings: Vec::new(),
    })
}

fn main() -> excite::Result<()> {
    let runs: u64 = std::env::args()
        .nth(1)
        .and_then(|a| a.parse().ok())
        .unwrap_or(20);
    let mut robot = Robot::load("ur5e")?.with_terms(&JointTerm::ALL);
    for joint in &mut robot.joints {
        joint.terms = [0.3, 5.0, 4.0, 0.5];
    }
    let plant = Plant::from(robot);
    // the robot is not its CAD model: every body and term is off by up to a quarter
    let mut r = ChaCha8Rng::seed_from_u64(3);
    let mut phi = plant.values();
    let bodies = 10 * plant.robot().bodies.len();
    phi[..bodies].chunks_exact_mut(10).for_each(|b| {
        let f = r.random_range(0.75..1.25);
        b.iter_mut().for_each(|x| *x *= f);
    });
    phi[bodies..]
        .iter_mut()
        .for_each(|x| *x *= r.random_range(0.75..1.25));
    let other = motion(&plant, 8);
    let exact = plant.torque(&other, &phi)?;
    let base = plant.base()?;
    let w = base.select(plant.regressor(&other)?.as_ref());
    let norm = exact.iter().map(|x| x * x).sum::<f64>().sqrt();
    let error = |pi: &[f64]| -> f64 {
        let y = &w * faer::ColRef::from_slice(pi);
        (0..exact.len())
            .map(|i| (y[i] - exact[i]).powi(2))
            .sum::<f64>()
            .sqrt()
            / norm
    };
    let troubles = [
        Trouble("white torque noise 1 N m", 1.0, 0.0, 0.0, 0.0),
        Trouble("coloured torque noise 1 N m", 1.0, 0.0, 0.0, 0.98),
        Trouble("outliers, 2 % at 30 N m", 1.0, 0.0, 0.02, 0.0),
        Trouble("position noise 1 mrad", 1.0, 1e-3, 0.0, 0.0),
    ];
    println!(
        "{:<30}{:>9}{:>9}{:>9}{:>9}{:>9}{:>12}{:>9}",
        "torque error, percent", "ols", "wls", "robust", "ml", "iv", "consistent", "lmi"
    );
    for trouble in &troubles {
        let mut sums = [0.0; 7];
        for run in 0..runs {
            let fit = [record(&plant, &phi, trouble, 1000 + run)?];
            let methods = [
                Method::Ols,
                Method::Wls,
                Method::Robust,
                Method::Ml,
                Method::Iv,
            ];
            for (k, method) in methods.into_iter().enumerate() {
                let settings = Settings::default().with(|set| {
                    set.method = method;
                    set.prior_strength = Some(4.0);
                });
                let id = identify(&plant, &fit, &settings)?;
                sums[k] += error(&id.pi).powi(2);
                if method == Method::Wls {
                    sums[5] += error(&id.pi_consistent).powi(2);
                    let lmi = settings.with(|set| set.consistency = Consistency::Lmi);
                    sums[6] += error(&identify(&plant, &fit, &lmi)?.pi_consistent).powi(2);
                }
            }
        }
        let [a, b, c, d, e, f, g] = sums.map(|s| 100.0 * (s / runs as f64).sqrt());
        println!(
            "{:<30}{a:>9.3}{b:>9.3}{c:>9.3}{d:>9.3}{e:>9.3}{f:>12.3}{g:>9.3}",
            trouble.0
        );
    }
    Ok(())
}
