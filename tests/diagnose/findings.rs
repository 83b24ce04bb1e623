//! The diagnosis on small simulated runs whose formulas are not those of its catalogue, and on
//! recordings of real robots and a withheld set where they are at hand.

#![allow(clippy::type_complexity)] // motions and laws are closures

use crate::common::noise::normal;
use crate::common::rng;
use crate::common::shared::shared;
use excite::diagnose::parts::{Posterior, Sample, Verdict};
use excite::diagnose::{Diagnosis, Settings, diagnose, json, of_logs, outside, page, prepare};
use excite::dynamics::{Samples, Tree};
use excite::export;
use excite::log::parts::{Payload, Purpose};
use excite::log::{Channels, Experiment, Record};
use excite::plant::Plant;
use excite::regressor::nominal_torque;
use excite::robot::Inertia;
use excite::robot::parts::{JointTerm, Prior};
use excite::trajectory::Fourier;
use excite::trajectory::parts::Series;
use rand::Rng;

const RATE: f64 = 200.0;
/// Period, whether it has odd harmonics only, and whether it is fitted, of the motions of a set of logs.
const MOTIONS: [(f64, bool, bool); 4] = [
    (4.0, true, true),
    (9.0, true, true),
    (5.0, false, true),
    (4.5, false, false),
];

/// A robot of two joints with friction; the model and a machine that differs in the ordinary way.
pub(super) fn robots() -> (Plant, excite::Robot) {
    let mut model = excite::Robot::load("planar2")
        .expect("a bundled robot")
        .with_terms(&JointTerm::ALL);
    for joint in &mut model.joints {
        joint.terms = [0.05, 0.6, 1.5, 0.0];
        joint.torque_noise = Some(0.1);
        joint.position_resolution = Some(1e-5);
    }
    let mut machine = model.clone();
    for (k, joint) in machine.joints.iter_mut().enumerate() {
        joint.terms = [0.045, 0.7 - 0.2 * k as f64, 1.65 - 0.3 * k as f64, 0.1];
    }
    for body in &mut machine.bodies {
        body.inertia.0.iter_mut().for_each(|v| *v *= 1.07);
    }
    (Plant::from(model), machine)
}

/// A motion of odd harmonics and one of others, each slow or fast.
fn motion(period: f64, odd: bool, seed: u64) -> Fourier {
    let mut rng = rng(seed);
    let harmonics: Vec<u32> = if odd {
        vec![1, 3, 5, 7]
    } else {
        vec![1, 2, 3, 4]
    };
    let mut series = || Series {
        constant: 0.3,
        sin: harmonics
            .iter()
            .map(|h| rng.random_range(0.25..0.6) / *h as f64)
            .collect(),
        cos: harmonics
            .iter()
            .map(|h| rng.random_range(-0.6..-0.2) / *h as f64)
            .collect(),
    };
    let joints = vec![series(), series()];
    Fourier::new(period, harmonics, joints).expect("a sound series")
}

/// A log of the machine: `extra` adds a torque to joint `j` from time, all positions, velocities and
/// torques so far.
fn log(
    machine: &excite::Robot,
    f: &Fourier,
    fit: bool,
    seed: u64,
    extra: &mut dyn FnMut(usize, f64, &[f64], &[f64], f64) -> f64,
) -> Record {
    let periods = 3;
    let per = (f.period * RATE).round() as usize;
    let count = per * periods;
    let mut x = Samples::zeros(2, count);
    let mut rng = rng(seed);
    let (mut q, mut v, mut a) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    let mut states = Vec::new();
    for i in 0..count {
        f.evaluate(i as f64 / RATE, [&mut q, &mut v, &mut a]);
        for j in 0..2 {
            x.q[j * count + i] = q[j];
            x.qd[j * count + i] = v[j];
            x.qdd[j * count + i] = a[j];
        }
        states.push((q, v));
    }
    let tau = nominal_torque(machine, &Tree::new(machine), &x);
    let mut raw = Channels {
        t: (0..count).map(|i| i as f64 / RATE).collect(),
        q: vec![Vec::new(); 2],
        tau: vec![Vec::new(); 2],
        qref: None,
    };
    for (i, (q, v)) in states.iter().enumerate() {
        for j in 0..2 {
            let clean = tau[j * count + i];
            let added = extra(j, i as f64 / RATE, q, v, clean);
            raw.tau[j].push(clean + added + 0.1 * normal(&mut rng));
            raw.q[j].push(((q[j] + 3e-6 * normal(&mut rng)) / 1e-5).round() * 1e-5);
        }
    }
    let purpose = if fit { Purpose::Fit } else { Purpose::Holdout };
    let (name, plant) = (format!("log {seed}"), Plant::from(machine.clone()));
    Record::from_channels(&name, raw, &plant, purpose, Some(f.period)).expect("a log")
}

fn logs(extra: &mut dyn FnMut(usize, f64, &[f64], &[f64], f64) -> f64) -> Vec<Record> {
    let machine = robots().1;
    logs_of([&machine; 4], extra)
}

/// Logs of four motions, each of a machine of its own; the last is not fitted to.
pub(super) fn logs_of(
    machines: [&excite::Robot; 4],
    extra: &mut dyn FnMut(usize, f64, &[f64], &[f64], f64) -> f64,
) -> Vec<Record> {
    MOTIONS
        .iter()
        .enumerate()
        .map(|(k, (period, odd, fit))| {
            log(
                machines[k],
                &motion(*period, *odd, k as u64 / 2),
                *fit,
                40 + k as u64,
                extra,
            )
        })
        .collect()
}

fn diagnosed(logs: &[Record]) -> Diagnosis {
    let settings = Settings::default().with(|set| set.next = false);
    of_logs(&robots().0, logs, &settings, &|_| {}).expect("a diagnosis")
}

fn run(extra: &mut dyn FnMut(usize, f64, &[f64], &[f64], f64) -> f64) -> Diagnosis {
    diagnosed(&logs(extra))
}

pub(super) fn claims(d: &Diagnosis) -> Vec<(&str, Vec<usize>)> {
    d.findings
        .iter()
        .filter(|f| f.confidence >= 0.5)
        .map(|f| (f.effect, f.place.named()))
        .collect()
}

#[test]
fn ordinary_errors_are_no_effect() {
    let d = run(&mut |_, _, _, _, _| 0.0);
    assert_eq!(d.verdict, Verdict::NoGap, "{:?}", claims(&d));
    assert!(claims(&d).is_empty(), "{:?}", claims(&d));
    // frozen, the same records do show a gap: parameters are off, and the refit removes it
    assert!(d.frozen.iter().all(|g| g.rms > 2.0 * g.noise));
    assert!(d.refit.iter().all(|g| g.rms < 0.5 * g.noise));
}

#[test]
fn stribeck_friction_of_another_formula() {
    // Lorentzian instead of an exponential
    let d = run(&mut |j, _, _, v, _| match j {
        1 => 1.2 * v[1].signum() / (1.0 + (v[1] / 0.08).powi(2)),
        _ => 0.0,
    });
    assert_eq!(
        claims(&d).first(),
        Some(&("stribeck_friction", vec![1])),
        "{:?}",
        claims(&d)
    );
    let f = &d.findings[0];
    let holdout = f.holdout.unwrap_or(0.0);
    assert!(holdout > 0.7, "shrinks {holdout}");
    assert!(f.decoys.is_some_and(|d| d < 0.1), "{:?}", f.decoys);
    // an interval about the share, and a simulated robot that follows the log more closely
    assert!(f.interval[0] <= f.explains && f.explains <= f.interval[1]);
    assert!(f.interval[1] - f.interval[0] < 0.4, "{:?}", f.interval);
    let simulated = &d.forward.records[0];
    assert!(!simulated.fit && d.forward.failed.is_empty());
    let joint = |m: usize| simulated.rms[m].as_ref().expect("a run")[1];
    assert!(joint(2) < 0.5 * joint(1), "{} {}", joint(1), joint(2));
    let v = f
        .values
        .iter()
        .find(|v| v.name == "stribeck_velocity")
        .expect("a parameter");
    assert!(v.value > 0.02 && v.value < 0.25, "{}", v.value);
}

/// LuGre friction of the first joint in steps of its own, in the place of Coulomb friction of 1.65 N m: `rise` over it below a
/// Stribeck velocity of 0.08 rad/s, and bristles of a `stiffness` in N m/rad.
fn lugre(stiffness: f64, rise: f64) -> Diagnosis {
    let mut z = 0.0f64;
    let mut last = (f64::INFINITY, 0.0);
    run(&mut |j, t, _, v, _| {
        if j != 0 {
            return 0.0;
        }
        if t < last.0 {
            (z, last.1) = (0.0, v[0]);
        }
        let from = last.1;
        last = (t, v[0]);
        let steps = 50;
        let h = 1.0 / (RATE * f64::from(steps));
        for k in 0..steps {
            let v = from + (v[0] - from) * (f64::from(k) + 0.5) / f64::from(steps);
            let level = 1.65 + rise * (-(v / 0.08).powi(2)).exp();
            // exact at a constant velocity
            let steady = level / stiffness * v.signum();
            z = steady + (z - steady) * (-stiffness * v.abs() / level * h).exp();
        }
        stiffness * z - 1.65 * v[0].signum()
    })
}

#[test]
fn hysteresis_of_a_lugre_joint() {
    let d = lugre(40.0, 0.0);
    assert_eq!(
        claims(&d).first(),
        Some(&("presliding_hysteresis", vec![0])),
        "{:?}",
        claims(&d)
    );
}

#[test]
fn stribeck_friction_of_a_lugre_joint() {
    // bristles that bend by 0.1 and by 1 mrad before they slip
    for stiffness in [16_500.0, 1650.0] {
        let d = lugre(stiffness, 0.6);
        assert_eq!(claims(&d), [("stribeck_friction", vec![0])]);
        let f = &d.findings[0];
        assert!(f.explains > 0.9, "{}", f.explains);
        let value = |name: &str| {
            let found = f.values.iter().find(|v| v.name == name);
            found.unwrap_or_else(|| panic!("no {name}")).value
        };
        let near = |what: &str, found: f64, truth: f64, off: f64| {
            assert!((found / truth - 1.0).abs() < off, "{what}: {found} {truth}");
        };
        // the peak itself is within the bristles: exponents are not told, what slides is
        let slides = |v: f64| {
            let [rise, scale, power] = ["rise", "stribeck_velocity", "exponent"].map(value);
            rise * (-(v / scale).powf(power)).exp()
        };
        for v in [0.04f64, 0.06] {
            near(
                "above Coulomb friction",
                slides(v),
                0.6 * (-(v / 0.08).powi(2)).exp(),
                0.25,
            );
        }
        near("level", value("level"), 1.65, 0.25);
        near("presliding", value("presliding"), 1.65 / stiffness, 0.3);
    }
}

#[test]
fn a_hose_that_pulls_and_rubs_is_one_effect() {
    let (mut z, mut last) = (0.0, (f64::INFINITY, 0.0));
    let d = run(&mut |j, t, q, _, _| {
        if j != 0 {
            return 0.0;
        }
        if t < last.0 {
            (z, last.1) = (0.0, q[0]);
        }
        let way: f64 = q[0] - last.1;
        z = way.signum() + (z - way.signum()) * (-way.abs() / 0.08).exp();
        last = (t, q[0]);
        3.0 * (q[0] - 0.2) + 0.9 * z
    });
    assert_eq!(claims(&d), [("cable_spring", vec![0])]);
    let value = |name: &str| d.findings[0].values.iter().find(|v| v.name == name);
    let [level, reach] = ["level", "presliding"].map(|n| value(n).expect("it rubs").value);
    assert!((level / 0.9 - 1.0).abs() < 0.3, "{level}");
    assert!((reach / 0.08 - 1.0).abs() < 0.4, "{reach}");
}

/// A joint whose friction falls as it warms up with a `time` in s; a pause leaves a share of the warmth.
fn warming(time: f64, kept: f64) -> Diagnosis {
    let (mut warm, mut last) = (0.0f64, f64::INFINITY);
    run(&mut |j, t, _, v, _| {
        if j != 1 {
            return 0.0;
        }
        if t < last {
            warm *= kept;
        }
        last = t;
        warm += ((v[1] / 0.8).powi(2) - warm) / (time * RATE);
        (1.2 * v[1].signum() + 0.6 * v[1]) * (-2.0 * warm).exp()
    })
}

#[test]
fn a_joint_that_warms_up_and_cools_in_pauses() {
    let d = warming(15.0, 0.4);
    assert_eq!(claims(&d), [("thermal_friction", vec![1])]);
    let values = &d.findings[0].values;
    let kept = values.iter().find(|v| v.name == "lasts_over_records");
    let kept = kept.expect("a share").value;
    assert!(kept > 0.1 && kept < 0.9, "{kept}");
}

#[test]
fn a_joint_that_is_warm_when_the_holdout_record_begins() {
    // the record that is held out hardly shows it
    let d = warming(4.0, 0.95);
    assert_eq!(claims(&d), [("thermal_friction", vec![1])]);
}

/// A refit takes all of it, and leaves nothing but a parameter that an identified model does not have.
#[test]
fn a_term_that_changed_since_it_was_identified() {
    let mut model = robots().0.robot().clone();
    model.prior = Prior::Identified;
    let changes = [
        ("viscous_friction", JointTerm::Viscous, 1.0),
        ("coulomb_friction", JointTerm::Coulomb, 0.8),
        ("torque_offset", JointTerm::Offset, 0.7),
    ];
    let named = |term: Option<(JointTerm, f64)>| {
        let mut machine = model.clone();
        if let Some((term, by)) = term {
            machine.joints[1].terms[term as usize] += by;
        }
        let logs = logs_of([&machine; 4], &mut |_, _, _, _, _| 0.0);
        let settings = Settings::default().with(|set| set.next = false);
        of_logs(&Plant::from(model.clone()), &logs, &settings, &|_| {}).expect("a diagnosis")
    };
    let sound = named(None);
    assert_eq!(sound.verdict, Verdict::NoGap, "{:?}", claims(&sound));
    let mut green = 0;
    for (effect, term, by) in changes {
        let mut d = named(Some((term, by)));
        assert_eq!(claims(&d), [(effect, vec![1])], "{effect}");
        assert_eq!(d.verdict, Verdict::Explained, "{effect}");
        // with the same verdict much may stay only where it does not count
        let (tone, said) = page::sentence(&d);
        assert!(!said.contains("above the noise"), "{said}");
        let good = said.starts_with("Explained");
        assert_eq!(format!("{tone:?}"), if good { "Good" } else { "Fair" });
        green += usize::from(good);
        d.unexplained = 0.7;
        let (tone, said) = page::sentence(&d);
        assert_eq!(format!("{tone:?}"), "Fair");
        assert!(said.contains("stays, not far above the noise."), "{said}");
        let whole = model.joints[1].terms[term as usize] + by;
        let told = d.findings[0].values[0].value;
        assert!((told - whole).abs() < 0.1, "{effect}: {told} for {whole}");
    }
    assert!(green > 0, "none is sure");
}

/// What it reports grows far beyond what it makes. The torque that is missing is no torque that a drive would have to make.
#[test]
fn a_drive_at_its_limit() {
    let mut most = 0.0f64;
    logs(&mut |j, _, _, _, tau| {
        most = most.max(if j == 1 { tau.abs() } else { 0.0 });
        0.0
    });
    let limit = 1.0005 * most;
    let d = run(&mut |j, _, _, _, tau| match j {
        1 => limit * (tau / limit).atanh() - tau,
        _ => 0.0,
    });
    assert_eq!(claims(&d), [("torque_saturation", vec![1])]);
    let f = &d.findings[0];
    assert!(f.explains > 0.95, "explains {}", f.explains);
    let told = |name: &str| f.values.iter().find(|v| v.name == name).map(|v| v.value);
    let close = |v: f64| (v / limit - 1.0).abs() < 0.05;
    assert!(
        told("limit").is_some_and(close),
        "{:?} for {limit}",
        f.values
    );
    assert!(
        told("peak").is_some_and(|p| p > 3.0 * limit),
        "{:?}",
        f.values
    );
}

#[test]
fn a_force_from_outside_has_no_name() {
    let d = run(&mut |j, t, q, _, _| {
        let f = 6.0 * (2.0 * std::f64::consts::PI * 0.737 * t + 0.4).sin();
        if j == 0 {
            f * (0.6 * q[0].cos() + 0.4 * (q[0] + q[1]).cos())
        } else {
            f * 0.4 * (q[0] + q[1]).cos()
        }
    });
    assert_eq!(d.verdict, Verdict::Unknown, "{:?}", claims(&d));
    assert!(claims(&d).is_empty(), "{:?}", claims(&d));
    assert!(
        d.shares.non_periodic.is_some_and(|s| s > 0.4),
        "{:?}",
        d.shares
    );
    // the files hold what was found
    let file = json::json(&d, 1.0);
    assert_eq!(file["verdict"], "unknown");
    assert!(file["gap"]["rms"].as_f64().is_some_and(|v| v > 0.5));
    assert!(page::html(&d).contains("Unknown"));
}

#[test]
fn a_load_that_sloshes_has_no_name() {
    // a mass on a soft spring that the motion of the first joint shakes: on the lines of the motion, and
    // no function of its state
    let (mut x, mut u, mut last) = (0.0, 0.0, 0.0);
    let mut force = 0.0;
    let d = run(&mut |j, t, _, v, _| {
        if j == 0 {
            if t == 0.0 {
                (x, u, last) = (0.0, 0.0, v[0]);
            }
            let w = 2.0 * std::f64::consts::PI * 0.9;
            u += (-w * w * x - 0.1 * w * u) / RATE - (v[0] - last);
            x += u / RATE;
            last = v[0];
            force = 0.8 * w * w * x;
        }
        if j == 0 { force } else { 0.4 * force }
    });
    assert_ne!(d.verdict, Verdict::Explained, "{:?}", claims(&d));
    assert!(claims(&d).is_empty(), "{:?}", claims(&d));
    // what was tried gains as much where it makes no sense
    let decoys: Vec<f64> = d.findings.iter().filter_map(|f| f.decoys).collect();
    assert!(decoys.iter().all(|v| *v > 0.5), "{decoys:?}");
}

/// What a log says of samples that were not measured holds for the diagnosis, too: a torque channel
/// that stood still, dropped positions and a gap in the time leave no trace in the gap.
#[test]
fn what_was_not_measured_has_no_weight() {
    let machine = robots().1;
    let sound = logs(&mut |_, _, _, _, _| 0.0);
    let damaged: Vec<Record> = sound
        .iter()
        .enumerate()
        .map(|(k, r)| {
            let mut c = Channels {
                t: r.t.clone(),
                q: r.q.clone(),
                tau: r.tau.clone(),
                qref: None,
            };
            // held for a quarter of a second, four times, each time in another part of the period
            for at in [150usize, 520, 1111, 1600] {
                let (value, until) = (c.tau[0][at], (at + 50).min(c.t.len()));
                c.tau[0][at.min(until)..until].fill(value);
            }
            c.q[1][300..330].fill(f64::NAN);
            c.q[1][900..940].fill(f64::NAN);
            if k == 1 {
                // rows that were never written
                for x in [&mut c.t].into_iter().chain(&mut c.q).chain(&mut c.tau) {
                    x.drain(700..760);
                }
            }
            let plant = Plant::from(machine.clone());
            let read = Record::from_channels(&r.name, c, &plant, r.purpose, r.period);
            read.expect("a log with holes")
        })
        .collect();
    assert!(damaged.iter().all(|r| r.valid.contains(&false)));
    let (a, b) = (diagnosed(&sound), diagnosed(&damaged));
    assert_eq!(a.verdict, Verdict::NoGap, "{:?}", claims(&a));
    assert_eq!(b.verdict, Verdict::NoGap, "{:?}", claims(&b));
    for (a, b) in a.frozen.iter().zip(&b.frozen) {
        println!(
            "{}: {:.4} {:.4}, noise {:.4} {:.4}",
            a.joint, a.rms, b.rms, a.noise, b.noise
        );
        assert!((b.rms / a.rms - 1.0).abs() < 0.1, "{} {}", a.rms, b.rms);
        assert!(
            (b.noise / a.noise - 1.0).abs() < 0.1,
            "{} {}",
            a.noise,
            b.noise
        );
    }
}

/// The same where the motion does not repeat.
#[test]
fn what_was_not_measured_has_no_weight_without_periods() {
    let machine = robots().1;
    let of = |damage: bool| -> Vec<Record> {
        let all = logs(&mut |_, _, _, _, _| 0.0);
        let one = |r: &Record| {
            let mut c = Channels {
                t: r.t.clone(),
                q: r.q.clone(),
                tau: r.tau.clone(),
                qref: None,
            };
            if damage {
                for at in [150usize, 520, 1111, 1600] {
                    let (value, until) = (c.tau[0][at], (at + 50).min(c.t.len()));
                    c.tau[0][at.min(until)..until].fill(value);
                }
                c.q[1][300..330].fill(f64::NAN);
            }
            let plant = Plant::from(machine.clone());
            Record::from_channels(&r.name, c, &plant, r.purpose, None).expect("a log")
        };
        all.iter().map(one).collect()
    };
    let (a, b) = (diagnosed(&of(false)), diagnosed(&of(true)));
    assert_eq!(a.verdict, b.verdict);
    for (a, b) in a.refit.iter().zip(&b.refit) {
        println!(
            "{}: {:.4} {:.4}, noise {:.4} {:.4}",
            a.joint, a.rms, b.rms, a.noise, b.noise
        );
        // a tenth of the rows is out, so the two differ by what these rows would have said
        // nothing may be left above the noise at all
        let apart = (b.rms - a.rms).abs();
        assert!(apart < 0.1 * a.rms.max(a.noise), "{} {}", a.rms, b.rms);
        assert!(
            (b.noise / a.noise - 1.0).abs() < 0.1,
            "{} {}",
            a.noise,
            b.noise
        );
    }
}

/// Logs of which some carry a load: marked as `payload`, or as nothing.
fn loaded(with: [bool; 4], payload: Payload) -> Vec<Record> {
    let empty = robots().1;
    let mut machine = empty.clone();
    let com = nalgebra::Vector3::new(0.1, 0.02, 0.0);
    let load = Inertia::from_com(0.8, com, nalgebra::Matrix3::zeros());
    let body = machine.bodies.last_mut().expect("a body");
    for (b, l) in body.inertia.0.iter_mut().zip(load.0) {
        *b += l;
    }
    let machines = with.map(|w| if w { &machine } else { &empty });
    let mut all = logs_of(machines, &mut |_, _, _, _, _| 0.0);
    for (r, w) in all.iter_mut().zip(with) {
        r.payload = if w { payload } else { Payload::None };
    }
    all
}

/// A load that the experiment states belongs to the model of its records.
#[test]
fn a_known_load_is_no_gap() {
    let known = Payload::Known {
        mass: 0.8,
        com: Some([0.1, 0.02, 0.0]),
        inertia: None,
    };
    let [bare, stated] =
        [Payload::None, known].map(|p| diagnosed(&loaded([false, true, true, true], p)));
    let empty = diagnosed(&loaded([false; 4], Payload::None));
    let rms = |d: &Diagnosis| d.frozen.iter().map(|g| g.rms).collect::<Vec<_>>();
    println!("{:?} {:?} {:?}", rms(&empty), rms(&stated), rms(&bare));
    assert_eq!(stated.verdict, Verdict::NoGap, "{:?}", claims(&stated));
    for (s, e) in rms(&stated).iter().zip(rms(&empty)) {
        assert!((s / e - 1.0).abs() < 0.15, "{s} {e}");
    }
    // where nothing states it, it is found to be in these records, and not in the robot
    carries(&bare, 0.8);
    assert!(empty.findings.iter().all(|f| f.records.is_empty()));
}

/// A load that is looked for nearer than it is gets no name, and the report says what it would have been.
#[test]
fn a_load_out_of_reach_is_ruled_out_and_said() {
    let mut machine = robots().1;
    let com = nalgebra::Vector3::new(1.1, 0.3, 0.0);
    let load = Inertia::from_com(0.8, com, nalgebra::Matrix3::zeros());
    let mut model = robots().0.robot().clone();
    model.prior = Prior::Identified;
    for (k, body) in machine.bodies.iter_mut().enumerate() {
        body.inertia = model.bodies[k].inertia;
        if k == 1 {
            body.inertia
                .0
                .iter_mut()
                .zip(load.0)
                .for_each(|(b, l)| *b += l);
        }
    }
    let logs = logs_of([&machine; 4], &mut |_, _, _, _, _| 0.0);
    let settings = Settings::default().with(|set| set.next = false);
    let d = of_logs(&Plant::from(model), &logs, &settings, &|_| {}).expect("a diagnosis");
    assert!(
        claims(&d).iter().all(|c| c.0 != "payload"),
        "{:?}",
        claims(&d)
    );
    let ruled = d.ruled_out.iter().find(|r| r.effect == "payload");
    let why = &ruled.expect("a load that was ruled out").why;
    assert!(why.starts_with("its centre of mass would be 1.1"), "{why}");
}

/// Logs of a sound machine whose dry friction reverses `lead` seconds before the velocity does.
fn reversing_early(lead: f64) -> Vec<Record> {
    let machine = robots().1;
    let of = |(k, (period, odd, fit)): (usize, &(f64, bool, bool))| {
        let f = motion(*period, *odd, k as u64);
        let (mut q, mut v, mut a) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        let mut early = |j: usize, t: f64, _: &[f64], now: &[f64], _: f64| {
            f.evaluate(t + lead, [&mut q, &mut v, &mut a]);
            machine.joints[j].terms[2] * (v[j].signum() - now[j].signum())
        };
        log(&machine, &f, *fit, 50 + k as u64, &mut early)
    };
    MOTIONS.iter().enumerate().map(of).collect()
}

/// A simulator's friction opposes `q̇ + T q̈`. That is the simulator's, and no delay of the torque.
#[test]
fn friction_that_reverses_early_is_a_simulators() {
    let plant = robots().0;
    let lead = |seconds: f64| {
        let logs = reversing_early(seconds);
        prepare(&plant, &logs).expect("records").lead
    };
    assert!((lead(0.0095) - 0.0095).abs() < 0.001, "{}", lead(0.0095));
    // what a machine may have
    assert_eq!(lead(0.003), 0.0);
    assert_eq!(lead(0.0), 0.0);
    let settings = Settings::default().with(|set| set.next = false);
    let d = of_logs(&plant, &reversing_early(0.0095), &settings, &|_| {}).expect("a diagnosis");
    assert_eq!(
        (claims(&d), d.verdict),
        (vec![], Verdict::NoGap),
        "{:?}",
        d.findings
    );
}

/// A simulator's friction turns over a speed that goes with its lead and with what friction alone decelerates: 2 % of the
/// speed of this light forearm. Taken as sharp it would be friction that rises towards standstill. The mass matrix is that
/// where all positions are zero, and the friction is the machine's: that of the model is a quarter off.
#[test]
fn soft_friction_of_a_light_forearm_is_a_simulators() {
    let (plant, mut machine) = robots();
    let mut model = plant.robot().clone();
    for robot in [&mut model, &mut machine] {
        let forearm = &mut robot.bodies[1].inertia;
        forearm.0.iter_mut().for_each(|v| *v *= 0.05);
        robot.joints[1].terms[0] = 0.01;
    }
    for (joint, off) in model.joints.iter_mut().zip([1.3, 0.8]) {
        joint.terms[2] *= off;
    }
    let (lead, bodies) = (0.0095, Plant::from(machine.clone()));
    let phi = bodies.values();
    let mut logs = Vec::new();
    for (k, (period, odd, fit)) in MOTIONS.iter().enumerate() {
        let f = motion(*period, *odd, k as u64);
        let (mut q, mut v, mut a) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        let mut soft = |j: usize, t: f64, _: &[f64], now: &[f64], _: f64| {
            f.evaluate(t, [&mut q, &mut v, &mut a]);
            // columns of the mass matrix, by unit accelerations
            let mut x = Samples::zeros(2, 3);
            (0..2).for_each(|i| x.qdd[3 * i + i] = 1.0);
            let tau = bodies.rigid_torque(&x, &phi).expect("a torque");
            let mass = |i: usize, k: usize| {
                let rotor = if i == k {
                    machine.joints[i].terms[0]
                } else {
                    0.0
                };
                tau[3 * i + k] - tau[3 * i + 2] + rotor
            };
            let det = mass(0, 0) * mass(1, 1) - mass(0, 1) * mass(1, 0);
            let friction = machine.joints[j].terms[2];
            let turns = lead * friction * mass(1 - j, 1 - j) / det / 9.0;
            let felt = (v[j] + lead * a[j]) / turns;
            friction * (felt.clamp(-1.0, 1.0) - now[j].signum())
        };
        logs.push(log(&machine, &f, *fit, 70 + k as u64, &mut soft));
    }
    let settings = Settings::default().with(|set| set.next = false);
    let plant = Plant::from(model);
    let found = prepare(&plant, &logs).expect("records").lead;
    assert!((found - lead).abs() < 4e-4, "{found}");
    let d = of_logs(&plant, &logs, &settings, &|_| {}).expect("a diagnosis");
    assert_eq!(
        (claims(&d), d.verdict),
        (vec![], Verdict::NoGap),
        "{:?}",
        d.findings
    );
}

/// A large effect that the model lacks does not pass for reversals that come early.
#[test]
fn a_large_effect_is_no_early_reversal() {
    let model = robots().0.robot().clone();
    let plant = Plant::from(model.with_terms(&[JointTerm::Coulomb, JointTerm::Offset]));
    let machine = robots().1;
    let more = &mut |j: usize, _: f64, _: &[f64], v: &[f64], _: f64| match j {
        1 => 8.0 * v[1],
        _ => 0.0,
    };
    let logs = logs_of([&machine; 4], more);
    assert_eq!(prepare(&plant, &logs).expect("records").lead, 0.0);
    let settings = Settings::default().with(|set| set.next = false);
    let d = of_logs(&plant, &logs, &settings, &|_| {}).expect("a diagnosis");
    assert_eq!(
        claims(&d)[0],
        ("viscous_friction", vec![1]),
        "{:?}",
        d.findings
    );
}

/// What a simulator's reversals are sharper than those of the log does not count when its torques are judged, as it does
/// not in the diagnosis; any other error does.
#[test]
fn reversals_of_a_simulator_may_be_sharper_than_those_of_the_log() {
    let (plant, _) = robots();
    let robot = plant.robot();
    let friction = robot.joints[0].terms[2];
    let round = |v: f64| friction * ((v / 0.025).tanh() - v.signum());
    let logs = logs_of([robot; 4], &mut |j, _, _, v, _| round(v[j]));
    let data = prepare(&plant, &logs).expect("records");
    let (rows, mut sharp) = (data.rows(), vec![Vec::new(); 2]);
    for r in &data.records {
        let count = r.torque(0).len();
        let mut x = Samples::zeros(2, count);
        for j in 0..2 {
            let span = j * count..(j + 1) * count;
            x.q[span.clone()].copy_from_slice(r.state(j).0);
            x.qd[span.clone()].copy_from_slice(r.state(j).1);
            x.qdd[span].copy_from_slice(r.acceleration(j));
        }
        let tau = nominal_torque(robot, &Tree::new(robot), &x);
        sharp
            .iter_mut()
            .zip(tau.chunks(count))
            .for_each(|(all, tau)| all.extend_from_slice(tau));
    }
    let raw = |j: usize| {
        let left = data.tau[j]
            .iter()
            .zip(&sharp[j])
            .map(|(a, b)| (a - b).powi(2));
        left.sum::<f64>() / rows as f64 / data.noise[j].std.powi(2) - 1.0
    };
    let of = |model: &[Vec<f64>]| outside::energies(&data, model);
    let allowed = of(&sharp);
    let mut other = sharp.clone();
    for (j, tau) in other.iter_mut().enumerate() {
        let speed = data.records.iter().flat_map(|r| r.state(j).1);
        tau.iter_mut()
            .zip(speed)
            .for_each(|(t, v)| *t -= if *v > 0.0 { 0.2 } else { 0.0 });
    }
    let wrong = of(&other);
    for j in 0..2 {
        assert!(raw(j) > 3.0, "{}", raw(j));
        for (k, r) in data.records.iter().enumerate() {
            let (least, more) = (allowed[k][j], wrong[k][j]);
            // what is left are samples whose velocity has the wrong sign
            assert!(
                least < 0.3 * raw(j),
                "{} {j}: {least} of {}",
                r.name,
                raw(j)
            );
            // 0.2 N m half of the time, noise of 0.1 N m
            assert!(
                (1.0..2.6).contains(&(more - least)),
                "{} {j}: {more}",
                r.name
            );
        }
    }
}

/// Samples of what the records leave open, of a drive whose gain is off.
fn drawn(seed: u64) -> (Diagnosis, Posterior) {
    let logs = logs(&mut |j, _, _, _, tau| if j == 0 { 0.12 * tau } else { 0.0 });
    let settings = Settings::default().with(|set| {
        set.next = false;
        set.samples = 200;
        set.seed = seed;
    });
    let d = of_logs(&robots().0, &logs, &settings, &|_| {}).expect("a diagnosis");
    let posterior = d.posterior.clone().expect("samples");
    (d, posterior)
}

#[test]
fn samples_hold_an_effect_and_its_rivals_as_often_as_they_are_believed() {
    let ((d, p), plant) = (drawn(1), robots().0);
    assert_eq!((p.samples.len(), p.missing), (200, 0));
    let main = &d.findings[0];
    assert_eq!(
        (main.effect, main.place.named()),
        ("torque_constant", vec![0])
    );
    // the confidence, less what the same effect on the other joint takes
    let place = main.joints.join(", ");
    let with = |s: &&Sample| {
        s.remarks
            .iter()
            .any(|r| (r.effect, &r.place) == (main.effect, &place))
    };
    let own = p.samples.iter().filter(with).count() as f64 / 200.0;
    let any = p.samples.iter().filter(|s| !s.remarks.is_empty()).count() as f64 / 200.0;
    println!(
        "confidence {}, in {own}, any effect in {any}",
        main.confidence
    );
    assert!(own < main.confidence + 0.1 && any > main.confidence - 0.1);
    assert!(p.samples.iter().any(|s| !with(&s)), "a rival or nothing");
    // its coefficient scatters as the report says, about what the report says
    let column = format!("torque_constant/{place}/{}", main.values[0].name);
    let at = p.columns.iter().position(|c| c.0 == column).expect(&column);
    let values: Vec<f64> = p
        .samples
        .iter()
        .map(|s| s.values[at])
        .filter(|v| v.is_finite())
        .collect();
    assert_eq!(
        values.len() as f64,
        200.0 * own,
        "a number where the effect is, none elsewhere"
    );
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let std = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt();
    let (value, said) = (
        main.values[0].value,
        main.values[0].std.expect("a deviation"),
    );
    println!("{mean} ± {std}, reported {value} ± {said}");
    assert!((mean - value).abs() < 0.3 * said && (std / said - 1.0).abs() < 0.3);
    // a row of the table is the robot of the files, whose bodies can exist
    for s in &p.samples {
        assert!(export::impossible(&plant, &s.robot).is_empty());
        let held = plant.values_in(&s.robot);
        assert_eq!(held, s.values[..held.len()]);
    }
    // what was held out lies in the band, of which the samples are a small part: reversals are what the fit leaves
    for b in &p.band {
        assert!(
            b.covered > 0.9 && b.covered < 0.999,
            "{}: {}",
            b.joint,
            b.covered
        );
        assert!(
            b.spread < 0.1 * b.twenty,
            "{}: {} {}",
            b.joint,
            b.spread,
            b.twenty
        );
    }
    let lines: Vec<_> = p.csv().lines().map(|l| l.split(',').count()).collect();
    assert!(lines.len() == 201 && lines.iter().all(|n| *n == 1 + p.columns.len()));
}

#[test]
fn samples_are_those_of_their_seed_on_any_number_of_threads() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let one = pool.expect("a pool").install(|| drawn(2)).1;
    assert_eq!(one.csv(), drawn(2).1.csv());
    assert_ne!(one.csv(), drawn(3).1.csv());
}

/// The first finding is a load of this mass in some of the records.
fn carries(d: &Diagnosis, mass: f64) {
    let first = d.findings.first().expect("a finding");
    assert!(first.effect == "payload" && first.is_claim(), "{first:?}");
    assert!(!first.records.is_empty(), "{first:?}");
    let value = first.values.iter().find(|v| v.name == "mass");
    let value = value.map_or(0.0, |v| v.value);
    assert!((value / mass - 1.0).abs() < 0.1, "{value} kg");
    assert_ne!(d.verdict, Verdict::NoGap);
}

/// Records with an unknown load and records of the empty robot are one robot: the load is free, and what
/// else is wrong is found on all of them.
#[test]
fn an_unknown_load_is_estimated_beside_the_effects() {
    let with = [false, true, false, true];
    let sound = diagnosed(&loaded(with, Payload::Unknown));
    assert_eq!(sound.verdict, Verdict::NoGap, "{:?}", claims(&sound));
    assert!(
        !sound
            .findings
            .iter()
            .any(|f| f.effect == "payload" && f.confidence >= 0.5)
    );
    let remark = sound
        .records
        .iter()
        .flat_map(|r| &r.remarks)
        .find(|r| r.contains("unknown load"));
    let remark = remark.expect("what was found of the load");
    println!("{remark}");
    let mass: f64 = remark
        .split(" kg")
        .next()
        .and_then(|t| t.rsplit(' ').next())
        .expect("a mass")
        .parse()
        .expect("a number");
    assert!((mass / 0.8 - 1.0).abs() < 0.1, "{remark}");
    // the same load, which nothing states, is named
    carries(&diagnosed(&loaded(with, Payload::None)), 0.8);
}

/// Logs of which some carry 0.8 kg, mounted at another place each time.
fn mounted_at(places: [Option<[f64; 2]>; 4], payload: Payload) -> Vec<Record> {
    let empty = robots().1;
    let machines = places.map(|place| {
        let mut machine = empty.clone();
        if let Some([x, y]) = place {
            let com = nalgebra::Vector3::new(x, y, 0.0);
            let load = Inertia::from_com(0.8, com, nalgebra::Matrix3::zeros());
            let body = machine.bodies.last_mut().expect("a body");
            for (b, l) in body.inertia.0.iter_mut().zip(load.0) {
                *b += l;
            }
        }
        machine
    });
    let mut all = logs_of(machines.each_ref(), &mut |_, _, _, _, _| 0.0);
    for (r, place) in all.iter_mut().zip(places) {
        r.payload = match place {
            Some(_) => payload,
            None => Payload::None,
        };
    }
    all
}

/// A load that is mounted again in between differs by record; which record is held out does not matter.
#[test]
fn a_load_that_is_remounted_differs_by_record() {
    let near = [Some([0.1, 0.02]), Some([0.13, -0.02])];
    for (second, third) in [(near, None), ([near[0], None], near[1])] {
        let places = [None, second[0], second[1], third];
        let stated = diagnosed(&mounted_at(places, Payload::Unknown));
        assert_eq!(stated.verdict, Verdict::NoGap, "{:?}", claims(&stated));
        let remarks = stated.records.iter().flat_map(|r| &r.remarks);
        let own = remarks.filter(|r| r.contains("load of its own")).count();
        assert_eq!(own, 2, "{:?}", claims(&stated));

        let found = diagnosed(&mounted_at(places, Payload::None));
        let loads: Vec<_> = (found.findings.iter())
            .filter(|f| f.effect == "payload" && f.is_claim())
            .collect();
        assert_eq!(loads.len(), 2, "{:?}", claims(&found));
        for f in loads {
            let value = |name: &str| f.values.iter().find(|v| v.name == name).map(|v| v.value);
            let mass = value("mass").expect("a mass");
            assert!((mass / 0.8 - 1.0).abs() < 0.1, "{mass} kg");
            assert_eq!(f.records.len(), 1, "{:?}", f.records);
        }
        assert!(
            claims(&found)
                .iter()
                .all(|c| format!("{c:?}").contains("payload"))
        );
    }
}

/// A load that only holdout records carry cannot be predicted.
#[test]
fn a_load_that_nothing_can_tell_is_refused() {
    let plant = robots().0;
    let logs = loaded([false, false, false, true], Payload::Unknown);
    let Err(e) = prepare(&plant, &logs) else {
        panic!("a load that no fitted record carries");
    };
    let text = e.to_string();
    assert!(
        text.contains("payload is unknown") && text.contains("mass"),
        "{text}"
    );
}

/// A record that was changed in memory counts as it is, whatever the file says that it was read from.
#[test]
fn a_record_in_memory_is_not_read_again() {
    let plant = robots().0;
    let clean = logs(&mut |_, _, _, _, _| 0.0).swap_remove(0);
    let path = std::env::temp_dir().join(format!("excite_memory_{}.csv", std::process::id()));
    let mut text = String::from("t,q1,q2,tau1,tau2\n");
    for i in 0..clean.len() {
        let row = [
            clean.t[i],
            clean.q[0][i],
            clean.q[1][i],
            clean.tau[0][i],
            clean.tau[1][i],
        ];
        text += &row.map(|v| v.to_string()).join(",");
        text.push('\n');
    }
    std::fs::write(&path, text).expect("a file");
    let mut record =
        Record::read(&path, &plant, Purpose::Fit, clean.period).expect("the log again");
    let torque = |r: &Record| {
        let data = prepare(&plant, std::slice::from_ref(r)).expect("a record");
        data.tau[1][200]
    };
    let before = torque(&record);
    record.tau[1].iter_mut().for_each(|v| *v += 3.0);
    let after = torque(&record);
    std::fs::remove_file(&path).expect("the file is there");
    assert!((after - before - 3.0).abs() < 1e-9, "{before} {after}");
}

pub(super) fn of_folder(folder: &str) -> Option<Diagnosis> {
    let path = shared(folder)?;
    let experiment = Experiment::read(path.join("experiment.toml")).expect("an experiment");
    let settings = Settings::default().with(|set| set.next = false);
    Some(diagnose(&experiment, &settings, &|_| {}).expect("a diagnosis"))
}

#[test]
fn the_wrist_of_a_real_arm_is_coupled() {
    let Some(d) = of_folder("data/tx40") else {
        return;
    };
    let f = &d.findings[0];
    assert_eq!((f.effect, f.place.named()), ("joint_coupling", vec![4, 5]));
    assert!(f.confidence > 0.5, "{}", f.confidence);
    // published: 1.95 N m, 0.616 N m s, 0.00964 kg m²
    let value = |name: &str| f.values.iter().find(|v| v.name == name).map(|v| v.value);
    assert!((value("coulomb").expect("a value") - 1.95).abs() < 0.3);
    assert!((value("viscous").expect("a value") - 0.616).abs() < 0.1);
    assert!((value("inertia").expect("a value") - 0.00964).abs() < 0.004);
}

#[test]
fn a_real_axis_has_asymmetric_friction_and_more() {
    let Some(d) = of_folder("data/emps") else {
        return;
    };
    assert_eq!(d.findings[0].effect, "friction_asymmetry");
    assert!(
        d.findings[0].confidence >= 0.5,
        "{}",
        d.findings[0].confidence
    );
    assert_eq!(d.verdict, Verdict::PartlyExplained);
    assert!(
        d.explained[0].relative < 0.0311 + 5e-4,
        "{}",
        d.explained[0].relative
    );
}

#[test]
fn a_withheld_set() {
    // one case of each kind; the whole set is scored by `cargo run -p withheld`
    let Some(clean) = of_folder("withheld-dev/case_014") else {
        return;
    };
    assert!(claims(&clean).is_empty(), "{:?}", claims(&clean));
    let single = of_folder("withheld-dev/case_008").expect("it is there");
    assert_eq!(
        claims(&single).first(),
        Some(&("friction_asymmetry", vec![1]))
    );
    let outside = of_folder("withheld-dev/case_013").expect("it is there");
    assert_eq!(outside.verdict, Verdict::Unknown);
}
