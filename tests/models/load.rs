//! Loads from logs of the drives: exact where there is no noise, within the stated bounds with
//! residual friction and noise.

mod legs;
mod reference;
mod told;

use crate::common::compare::largest;
use crate::common::noise::normal;
use crate::common::parallel::{matrix, numbers, vector};
use crate::common::shared::checks;
use excite::dynamics::Samples;

use excite::load::parts::{LoadBody, Parameters};
use excite::load::two_step::PlatformSample;
use excite::load::{Identified, Loaded, Settings, from_records};
use excite::log::parts::{Payload, Purpose};
use excite::plant::Plant;
use excite::robot::Inertia;
use excite::signals::{Decimator, Prepared};
use nalgebra::{Matrix3, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

/// The load of Schulte & Gerland's experiment with a made-up centre and tensor.
const LOAD: [f64; 10] = [
    22.26, 0.03, -0.02, 0.12, 0.26, 0.012, -0.02, 0.29, 0.015, 0.33,
];

/// Sums of sines of several frequencies in every coordinate, other ones in each of a platform's.
fn multisine(plant: &Plant, count: usize, rate: f64, harmonics: &[f64], seed: u64) -> Samples {
    let mut r = ChaCha8Rng::seed_from_u64(seed);
    let n = plant.coordinates();
    let period = count as f64 / rate;
    let mut s = Samples::zeros(n, count);
    for j in 0..n {
        let (middle, half) = match plant.mechanism() {
            Some(m) => {
                let p = m.workspace[j].position;
                (m.home[j], 0.45 * (p[1] - p[0]))
            }
            None => (if j == 1 || j == 3 { -1.0 } else { 0.3 }, 0.8),
        };
        s.q[j * count..(j + 1) * count].fill(middle);
        for &h in harmonics {
            let h = match plant.mechanism() {
                Some(_) => h + j as f64 * period / 10.0,
                None => h,
            };
            let a = half / harmonics.len() as f64 * r.random_range(0.6..1.0);
            let phase = r.random_range(0.0..std::f64::consts::TAU);
            let w = std::f64::consts::TAU * h / period;
            for i in 0..count {
                let angle = w * i as f64 / rate + phase;
                s.q[j * count + i] += a * angle.sin();
                s.qd[j * count + i] += a * w * angle.cos();
                s.qdd[j * count + i] -= a * w * w * angle.sin();
            }
        }
    }
    s
}

/// Signals as they come out of the preparation, without any filter.
fn prepared(name: &str, x: &Samples, torque: Vec<f64>, rate: f64) -> Prepared {
    let count = x.count;
    let valid = vec![true; count];
    Prepared {
        name: name.into(),
        purpose: Purpose::Fit,
        rate,
        time: (0..count).map(|i| i as f64 / rate).collect(),
        motion: x.clone(),
        actuators: torque.len() / count,
        velocity_noise: vec![0.0; torque.len() / count],
        torque,
        filter: Decimator::new(f64::INFINITY, rate, &valid, true),
        valid,
        periods: None,
        position_cutoff: vec![f64::INFINITY; x.dof],
        cutoff_reason: String::new(),
        thin: None,
        warnings: Vec::new(),
    }
}

/// Torque of the plant with a load, and with other friction and noise.
struct Truth {
    load: Option<Inertia>,
    stribeck: f64,
    noise: f64,
    friction: [f64; 3],
    gain: Vec<f64>,
    /// added to the offset of each actuator
    zero: [f64; 6],
}

impl Default for Truth {
    fn default() -> Self {
        Truth {
            load: None,
            stribeck: 0.0,
            noise: 0.0,
            friction: [3.0, 4.0, 0.5],
            gain: Vec::new(),
            zero: [0.0; 6],
        }
    }
}

fn torque(plant: &Plant, x: &Samples, truth: &Truth, seed: u64) -> Vec<f64> {
    let mut r = ChaCha8Rng::seed_from_u64(seed);
    let mut tau = plant.nominal_torque(x).unwrap();
    let tool = plant.tool().unwrap();
    if let Some(load) = truth.load {
        let w = plant.body_columns(tool, x).unwrap();
        for (i, t) in tau.iter_mut().enumerate() {
            *t += (0..10).map(|k| w[(i, k)] * load.0[k]).sum::<f64>();
        }
    }
    let moved = plant.actuator_motion(x).unwrap();
    for a in 0..moved.dof {
        for i in 0..x.count {
            let v = moved.qd[a * x.count + i];
            let [c, f, o] = truth.friction;
            let peak = truth.stribeck * (-(v / 0.01).powi(2)).exp();
            let t = &mut tau[a * x.count + i];
            *t += (c + peak) * v.signum()
                + f * v
                + o
                + truth.zero[a % 6]
                + truth.noise * normal(&mut r);
            *t *= truth.gain.get(a).copied().unwrap_or(1.0);
        }
    }
    tau
}

fn loaded(record: Prepared, payload: Payload) -> Loaded {
    Loaded {
        record,
        payload,
        exchanged: None,
    }
}

/// Errors as the targets are stated: mass in percent, centre in mm, tensor in percent of
/// `√(I_ii I_jj)`.
fn errors(found: &[f64; 10], truth: &[f64; 10]) -> [f64; 10] {
    let size = |a: usize, b: usize| (truth[a] * truth[b]).sqrt();
    let scale = [
        truth[0] / 100.0,
        1e-3,
        1e-3,
        1e-3,
        size(4, 4) / 100.0,
        size(4, 7) / 100.0,
        size(4, 9) / 100.0,
        size(7, 7) / 100.0,
        size(7, 9) / 100.0,
        size(9, 9) / 100.0,
    ];
    std::array::from_fn(|i| (found[i] - truth[i]) / scale[i])
}

/// Errors of a load in units of what is stated of them.
fn in_stds(found: &LoadBody) -> [f64; 10] {
    let (v, s) = (found.values(), found.stds());
    std::array::from_fn(|k| (v[k] - LOAD[k]) / s[k])
}

/// With another motion without the load: errors of friction do not cancel.
fn hexapod(truth: &Truth, rate: f64, count: usize, seed: u64, settings: &Settings) -> Identified {
    hexapod_along([seed, seed + 500], truth, rate, count, seed, settings)
}

/// `motions`: seeds of the motions with and without the load.
fn hexapod_along(
    motions: [u64; 2],
    truth: &Truth,
    rate: f64,
    count: usize,
    seed: u64,
    settings: &Settings,
) -> Identified {
    let plant = Plant::load("hexapod").unwrap();
    // 0.3 to 1.8 Hz
    let base = count as f64 / rate / 10.0;
    let [x, z] = motions.map(|seed| {
        let harmonics = [3.0, 8.0, 13.0].map(|h| h * base);
        multisine(&plant, count, rate, &harmonics, seed)
    });
    let empty = Truth {
        load: None,
        gain: truth.gain.clone(),
        ..*truth
    };
    let records = vec![
        loaded(
            prepared("empty", &z, torque(&plant, &z, &empty, seed + 1000), rate),
            Payload::None,
        ),
        loaded(
            prepared("loaded", &x, torque(&plant, &x, truth, seed + 2000), rate),
            Payload::Unknown,
        ),
    ];
    from_records(&plant, records, settings).unwrap()
}

#[test]
fn both_methods_are_exact_without_noise() {
    let truth = Truth {
        load: Some(Inertia::from_quantities(&LOAD)),
        ..Truth::default()
    };
    let found = hexapod(&truth, 100.0, 500, 3, &Settings::default());
    let one = errors(&found.one_step.load.values(), &LOAD);
    let two = errors(&found.two_step.as_ref().unwrap().load.values(), &LOAD);
    println!(
        "one step {:.1e}, two steps {:.1e}",
        largest(&one),
        largest(&two)
    );
    // in percent and millimetres: 1e-10 of the quantities
    assert!(largest(&one) < 1e-8, "{one:?}");
    assert!(largest(&two) < 1e-7, "{two:?}");
    // the robot with the load: its platform of 30 kg carries 22.26 kg more, and a file can hold it
    let plant = Plant::load("hexapod").unwrap();
    let robot = found.loaded(&plant).unwrap();
    let platform = robot.bodies.iter().find(|b| b.name == "platform").unwrap();
    assert!((platform.inertia.mass() - 52.26).abs() < 1e-6);
    let text = excite::export::mechanism::toml(plant.mechanism().unwrap(), &robot, "").unwrap();
    assert!(text.contains("mass = 52.2"), "{text}");
    let friction = &found.one_step.records[1].friction[0];
    assert!((friction.coulomb - 28.0).abs() < 1e-8, "{friction:?}");
    // from the nominal platform alone
    let plant = Plant::load("hexapod").unwrap();
    let x = multisine(&plant, 500, 100.0, &[2.0, 5.0, 7.0], 8);
    let only = vec![loaded(
        prepared("loaded", &x, torque(&plant, &x, &truth, 1), 100.0),
        Payload::Unknown,
    )];
    let found = from_records(&plant, only, &Settings::default()).unwrap();
    assert!(largest(&errors(&found.load().values(), &LOAD)) < 1e-8);
    assert!(found.warnings.iter().any(|w| w.message.contains("nominal")));
}

/// The recursion ends where the fit of all rows ends, and knows more with every block.
#[test]
fn the_stream_ends_at_the_fit_of_all_rows() {
    let truth = Truth {
        load: Some(Inertia::from_quantities(&LOAD)),
        stribeck: 15.0,
        noise: 0.5,
        ..Truth::default()
    };
    let found = hexapod(&truth, 100.0, 1000, 4, &Settings::default());
    let one = &found.one_step;
    let steps = &one.stream;
    assert_eq!(
        steps.len(),
        12,
        "a record that does not repeat comes in twelve blocks"
    );
    let (last, whole, std) = (steps.last().unwrap(), one.load.values(), one.load.stds());
    for k in 0..10 {
        let away = (last.values[k] - whole[k]).abs() / std[k];
        // but for the mean over the walk of the constants, of which the stream takes one
        assert!(away < 0.5, "{k}: {away} standard deviations");
        assert!((last.stds[k] / std[k] - 1.0).abs() < 1e-6);
    }
    for pair in steps.windows(2) {
        assert!(pair[1].seconds > pair[0].seconds);
        assert!(
            pair[1].stds[0] <= pair[0].stds[0] * 1.001,
            "{:?}",
            pair[1].stds
        );
    }
    assert!(steps[0].stds[0] > 2.0 * last.stds[0]);
    // both records, 10 s each
    assert!((last.seconds - 20.0).abs() < 0.2, "{}", last.seconds);
    let json = excite::load::json::json(&found);
    let stream = json["stream"].as_array().unwrap();
    assert_eq!(stream.len(), 12);
    assert_eq!(stream[11]["mass"]["value"], last.values[0]);
    let page = excite::load::page::html(&found);
    assert!(page.contains("As it became known"));
}

#[test]
fn stribeck_friction_and_noise_stay_within_the_targets() {
    let truth = Truth {
        load: Some(Inertia::from_quantities(&LOAD)),
        stribeck: 15.0,
        // 2 N at 1 kHz: mean of 20 periods of 10 s, at 100 Hz
        noise: 0.14,
        ..Truth::default()
    };
    let (mut one, mut plain, mut two) = ([0.0f64; 3], [0.0f64; 3], [0.0f64; 3]);
    for seed in 0..5 {
        let found = hexapod(&truth, 100.0, 1000, seed, &Settings::default());
        let even = Settings::default().with(|set| set.weighted = false);
        let unweighted = hexapod(&truth, 100.0, 1000, seed, &even);
        let add = |to: &mut [f64; 3], v: &[f64; 10]| {
            let e = errors(v, &LOAD);
            to[0] = to[0].max(e[0].abs());
            to[1] = to[1].max(largest(&e[1..4]));
            to[2] = to[2].max(largest(&e[4..]));
        };
        add(&mut one, &found.one_step.load.values());
        add(&mut plain, &unweighted.one_step.load.values());
        add(&mut two, &found.two_step.as_ref().unwrap().load.values());
    }
    println!("worst of 5: mass %, centre mm, inertia %");
    println!("one step            {one:.3?}");
    println!("one step unweighted {plain:.3?}");
    println!("two steps           {two:.3?}");
    assert!(one[0] < 0.1 && one[1] < 0.3 && one[2] < 1.5, "{one:?}");
    assert!(two[2] > one[2] && two[1] > one[1]);
}

/// Friction that the two steps have no term for leaves the same in both records of one motion, and the load is their
/// difference: its errors are as large as is stated, neither much smaller nor larger.
#[test]
fn two_steps_know_what_records_of_one_motion_share() {
    let truth = Truth {
        load: Some(Inertia::from_quantities(&LOAD)),
        stribeck: 15.0,
        noise: 2.0,
        ..Truth::default()
    };
    let (mut square, mut inside, mut all) = (0.0, 0, 0);
    for seed in 20..28 {
        let found = hexapod_along([seed; 2], &truth, 100.0, 500, seed, &Settings::default());
        for off in in_stds(&found.two_step.as_ref().unwrap().load) {
            square += off * off;
            all += 1;
            inside += i32::from(off.abs() < 1.96);
        }
    }
    let (size, coverage) = (
        (square / f64::from(all)).sqrt(),
        f64::from(inside) / f64::from(all),
    );
    println!("two steps: errors {size:.2} of what is stated, coverage of 95 %: {coverage:.3}");
    assert!((0.5..1.3).contains(&size), "{size}");
    assert!(coverage > 0.88, "{coverage}");
}

#[test]
fn stated_deviations_cover_the_errors() {
    let truth = Truth {
        load: Some(Inertia::from_quantities(&LOAD)),
        noise: 2.0,
        ..Truth::default()
    };
    let (mut inside, mut all) = (0, 0);
    for seed in 20..28 {
        let found = hexapod(&truth, 100.0, 500, seed, &Settings::default());
        for off in in_stds(&found.one_step.load) {
            all += 1;
            inside += usize::from(off.abs() < 1.96);
        }
    }
    let coverage = inside as f64 / all as f64;
    println!("coverage of 95 %: {coverage:.3}");
    assert!((0.88..1.0).contains(&coverage), "{coverage}");
}

#[test]
fn payload_of_a_serial_robot() {
    let plant = Plant::load("ur10e").unwrap();
    let load = Inertia::from_quantities(&[
        4.2, 0.02, -0.03, 0.08, 0.02, 0.001, -0.002, 0.025, 0.0015, 0.018,
    ]);
    let truth = Truth {
        load: Some(load),
        ..Truth::default()
    };
    // other motions with and without the load
    let x = multisine(&plant, 600, 100.0, &[1.0, 2.0, 3.0, 4.0], 1);
    let z = multisine(&plant, 600, 100.0, &[1.0, 2.0, 3.0, 5.0], 2);
    let records = || {
        vec![
            loaded(
                prepared("empty", &x, torque(&plant, &x, &Truth::default(), 1), 100.0),
                Payload::None,
            ),
            loaded(
                prepared("loaded", &z, torque(&plant, &z, &truth, 2), 100.0),
                Payload::Unknown,
            ),
        ]
    };
    let found = from_records(&plant, records(), &Settings::default()).unwrap();
    let e = errors(&found.load().values(), &load.quantities());
    assert!(largest(&e) < 1e-5, "{e:?}");
    assert!(found.two_step.is_none() && !found.no_two_step.is_empty());
    // mass and centre of mass of a point mass
    let point = Inertia::from_com(3.0, Vector3::new(0.01, 0.02, 0.1), Matrix3::zeros());
    let truth = Truth {
        load: Some(point),
        ..Truth::default()
    };
    let only = vec![loaded(
        prepared("loaded", &z, torque(&plant, &z, &truth, 2), 100.0),
        Payload::Unknown,
    )];
    let settings = Settings::default().with(|set| set.parameters = Parameters::MassCom);
    let found = from_records(&plant, only, &settings).unwrap();
    let v = found.load().values();
    assert!(
        (v[0] - 3.0).abs() < 1e-8 && (v[3] - 0.1).abs() < 1e-8,
        "{v:?}"
    );
    let json = excite::load::json::json(&found);
    assert!(json["inertia_com"]["value"][0].is_null() && json["mass"]["value"].is_number());
}

#[test]
fn a_known_load_tells_the_drive_gains() {
    let plant = Plant::load("ur10e").unwrap();
    let known = [6.0, 0.0, 0.02, 0.1, 0.03, 0.0, 0.0, 0.03, 0.0, 0.02];
    let unknown = [4.0, 0.03, 0.0, 0.07, 0.02, 0.0, 0.0, 0.02, 0.0, 0.015];
    let truth = |load: Option<[f64; 10]>| Truth {
        load: load.map(|l| Inertia::from_quantities(&l)),
        noise: 0.05,
        gain: vec![1.0, 1.06, 1.0, 1.0, 1.0, 1.0],
        ..Truth::default()
    };
    let x = multisine(&plant, 1500, 100.0, &[1.0, 2.0, 3.0, 4.0], 1);
    let record = |name: &str, load: Option<[f64; 10]>, seed| {
        prepared(name, &x, torque(&plant, &x, &truth(load), seed), 100.0)
    };
    let payload = Payload::Known {
        mass: known[0],
        com: Some([known[1], known[2], known[3]]),
        inertia: Some(std::array::from_fn(|k| known[4 + k])),
    };
    let records = vec![
        loaded(record("empty", None, 1), Payload::None),
        loaded(record("known", Some(known), 2), payload),
        loaded(record("unknown", Some(unknown), 3), Payload::Unknown),
    ];
    let found = from_records(&plant, records, &Settings::default()).unwrap();
    let gain = found.gain.as_ref().unwrap();
    println!("{gain:?}");
    assert!(gain.corrected[1] && (gain.value[1] - 1.06).abs() < 0.02);
    assert!(gain.corrected.iter().filter(|c| **c).count() == 1);
    let v = found.load().values();
    assert!((v[0] - 4.0).abs() < 0.05, "{v:?}");
}
