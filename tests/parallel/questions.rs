//! Motions for a question: derivatives of what is asked, what the report states before the run, limits with the load.

use crate::common;
use crate::common::compare::largest;

use excite::design::criterion::Objective;
use excite::design::information::{Evaluation, Information};
use excite::design::parts::Question;
use excite::design::question::asked;
use excite::design::{Settings, design};
use excite::identifiability::assess;
use excite::identifiability::parts::LoadAccuracy;
use excite::regressor::term_factor;
use excite::robot::Inertia;
use excite::robot::parts::JointTerm;
use excite::trajectory::parts::Ends;
use excite::trajectory::{Basis, Trajectory, sample_period};
use excite::{Error, Plant};
use faer::Mat;
use rand::Rng;

const LOAD: [f64; 10] = [
    8.0, 0.03, -0.02, 0.1, 0.05, 0.004, -0.006, 0.06, 0.005, 0.07,
];

fn plant(name: &str) -> Plant {
    Plant::load(name).unwrap().without_collisions()
}

fn questions(name: &str) -> Vec<Question> {
    match name {
        "hexapod" => vec![
            Question::Load,
            Question::Platform,
            Question::Legs,
            Question::Friction,
        ],
        _ => vec![Question::Load, Question::Friction],
    }
}

/// A motion about home (or the middle of the ranges), `size` of what the robot could do.
fn motion(plant: &Plant, settings: &Settings, seed: u64, size: f64) -> (Basis, Vec<f64>) {
    let harmonics: Vec<u32> = (1..=settings.harmonics as u32).collect();
    let basis = Basis::new(&harmonics, Ends::Rest, plant.coordinates(), None).unwrap();
    let r = &mut common::rng(seed);
    let mut x = Vec::new();
    for (k, joint) in plant.moved().joints.iter().enumerate() {
        let [low, high] = joint.limits.position;
        let middle = plant.home().map_or(0.5 * (low + high), |h| h[k]);
        let mut c = vec![0.0; 2 * harmonics.len() + 1];
        c[0] = middle;
        let half = 0.5 * (high - low);
        for (i, c) in c[1..].iter_mut().enumerate() {
            *c = size * half / (1.0 + (i % harmonics.len()) as f64) * r.random_range(-1.0..1.0);
        }
        x.extend(basis.parameters(k, &c).iter());
    }
    (basis, x)
}

#[test]
fn what_is_asked_has_exact_gradients() {
    for name in ["hexapod", "ur5e"] {
        let plant = plant(name);
        for question in questions(name) {
            let settings = question.settings().with(|set| set.harmonics = 3);
            let a = asked(question, &plant, &settings, |_| 90).unwrap();
            let (basis, x) = motion(&a.plant, &settings, 3, 0.2);
            let noise = a.plant.torque_noise().0;
            let info = Information::new(
                &a.plant,
                &basis,
                settings.period,
                90,
                a.transform,
                Some(&noise),
            );
            let objective = Objective {
                criterion: question.criterion(),
                condition: settings.condition,
                targets: a.targets,
            };
            let value = |x: &[f64]| {
                let mut e = Evaluation::default();
                info.evaluate(x, &mut e);
                objective.smooth_value(&objective.spectrum(&e.gram).unwrap(), 40.0)
            };
            let mut e = Evaluation::default();
            info.evaluate(&x, &mut e);
            let s = objective.spectrum(&e.gram).unwrap();
            let g = objective.smooth_gradient(&info, &mut e, &s, 40.0);
            assert!(
                value(&x).is_finite() && largest(&g) > 0.0,
                "{name} {question:?}"
            );
            for k in (0..x.len()).step_by(5) {
                let at = |step: f64| {
                    let mut x = x.clone();
                    x[k] += step;
                    value(&x)
                };
                let d = (at(1e-5) - at(-1e-5)) / 2e-5;
                let scale = largest(&g);
                assert!(
                    (d - g[k]).abs() < 2e-3 * scale,
                    "{name} {question:?} {k}: {d} {}",
                    g[k]
                );
            }
        }
    }
}

/// The accuracy stated before the run is that of the whole system of both records, deviations of the empty robot included.
#[test]
fn the_accuracy_of_a_load_is_that_of_both_records() {
    for name in ["hexapod", "ur5e"] {
        let plant = plant(name);
        let settings = Question::Load.settings();
        let (basis, x) = motion(&plant, &settings, 5, 0.15);
        let trajectory = Trajectory {
            space: plant.space(),
            periods: 4,
            ..Trajectory::new(plant.moved(), basis.fourier(settings.period, &x))
        };
        let load = Inertia::from_quantities(&LOAD);
        let stated = LoadAccuracy::of(&plant, &trajectory, &load, true).unwrap();
        let motion = sample_period(&trajectory.fourier);
        let moved = plant.actuator_motion(&motion).unwrap();
        let noise = plant.torque_noise().0;
        let (na, n) = (noise.len(), motion.count);
        let ten = plant.body_columns(plant.tool().unwrap(), &motion).unwrap();
        let base = plant.clone().with_terms(&[]).base().unwrap();
        let all = plant.clone().with_terms(&[]).regressor(&motion).unwrap();
        let w = base.select(all.as_ref());
        for (free, found) in [(false, &stated.shared), (true, &stated.free)] {
            // deviations, load, Coulomb and viscous friction of each record, constants
            let d = w.ncols();
            let own = 2 * na;
            let columns = d + 10 + 2 * own + if free { 2 * na } else { na };
            let mut a = Mat::<f64>::zeros(2 * na * n, columns);
            for record in 0..2 {
                for i in 0..na * n {
                    let (j, s) = (i / n, i % n);
                    let row = record * na * n + i;
                    for c in 0..d {
                        a[(row, c)] = w[(i, c)];
                    }
                    for c in 0..10 {
                        a[(row, d + c)] = record as f64 * ten[(i, c)];
                    }
                    let at = d + 10 + own * record;
                    for (t, term) in [JointTerm::Coulomb, JointTerm::Viscous]
                        .into_iter()
                        .enumerate()
                    {
                        a[(row, at + t * na + j)] = term_factor(term, moved.at(j, s));
                    }
                    let at = d + 10 + 2 * own + if free { record * na } else { 0 };
                    a[(row, at + j)] = 1.0;
                    for c in 0..columns {
                        a[(row, c)] *= f64::from(trajectory.periods).sqrt() / noise[j];
                    }
                }
            }
            let scale: Vec<f64> = (0..columns)
                .map(|c| a.col(c).norm_l2().max(1e-300))
                .collect();
            let unit = Mat::from_fn(a.nrows(), columns, |r, c| a[(r, c)] / scale[c]);
            let svd = unit.thin_svd().unwrap();
            let s = svd.S().column_vector();
            let cutoff = 1e-9 * s[0];
            let covariance = |i: usize, j: usize| -> f64 {
                let v = svd.V();
                let sum = |k: usize| v[(i, k)] * v[(j, k)] / (s[k] * s[k]);
                (0..columns)
                    .filter(|&k| s[k] > cutoff)
                    .map(sum)
                    .sum::<f64>()
                    / (scale[i] * scale[j])
            };
            let slopes = load.quantity_slopes();
            for q in 0..10 {
                let mut variance = 0.0;
                for i in 0..10 {
                    for j in 0..10 {
                        variance += slopes[q][i] * covariance(d + i, d + j) * slopes[q][j];
                    }
                }
                let (std, found) = (variance.sqrt(), found[q].unwrap());
                assert!(
                    (std / found - 1.0).abs() < 1e-3,
                    "{name} {free} {q}: {std} {found}"
                );
            }
        }
        // equal errors of all gains scale the load; independent ones at most that
        let mass = stated.gains[0].unwrap() / LOAD[0];
        assert!(mass > 1e-4 && mass < 0.0101, "{name}: {mass}");
    }
}

/// A motion designed for a load tells more of it than one for all parameters, in the same time.
#[test]
fn a_motion_for_a_load_tells_more_of_it() {
    let plant = plant("hexapod");
    let load = Inertia::from_quantities(&LOAD);
    let judge = |settings: Settings| {
        let d = design(&plant, &settings).unwrap();
        let seconds = d.trajectory.duration();
        let stated = LoadAccuracy::of(&plant, &d.trajectory, &load, true).unwrap();
        assert!(stated.broken.is_none(), "{:?}", stated.broken);
        assert_eq!(seconds, 60.0);
        (d, stated)
    };
    let (d, own) = judge(Question::Load.settings().with(|set| {
        set.payload = Some(LOAD);
        set.starts = Some(2);
    }));
    let (_, other) = judge(Settings::default().with(|set| {
        set.periods = 6;
        set.starts = Some(2);
    }));
    let [a, b] = [&own, &other].map(|l| l.in_short(&l.shared).map(|x| x.unwrap()));
    println!("mass, centre, tensor: {a:?} for the load, {b:?} for all parameters");
    for k in 0..3 {
        assert!(a[k] < b[k], "{a:?} {b:?}");
    }
    assert!(a[2] < 0.5 * b[2], "{a:?} {b:?}");
    // the report finds the question in the trajectory
    let report = assess(&d.plant, Some(&d.trajectory)).unwrap();
    assert_eq!(report.load.unwrap(), own);
}

#[test]
fn limits_hold_with_the_load_and_without() {
    let mut robot = plant("planar2").robot().clone();
    for joint in &mut robot.joints {
        joint.limits.effort = 60.0;
    }
    let plant = Plant::from(robot);
    let settings = Question::Load.settings().with(|set| {
        set.payload = Some([3.0, 0.1, 0.0, 0.0, 0.01, 0.0, 0.0, 0.01, 0.0, 0.01]);
        set.starts = Some(2);
    });
    let d = design(&plant, &settings).unwrap();
    let load = settings.load(&plant);
    for robot in [&plant, &plant.carrying(&load)] {
        let c = robot.certify(&d.trajectory.fourier, 1.0).unwrap();
        assert!(c.satisfied(), "{:?}", c.broken());
    }
    // the limit counts: twice the load breaks it
    let twice = Inertia(load.0.map(|x| 2.0 * x));
    let c = plant
        .carrying(&twice)
        .certify(&d.trajectory.fourier, 1.0)
        .unwrap();
    assert!(!c.satisfied());
    let stated = LoadAccuracy::of(&d.plant, &d.trajectory, &twice, true).unwrap();
    assert!(stated.broken.is_some());
}

#[test]
fn questions_that_mean_nothing_are_refused() {
    for (name, question) in [("ur5e", Question::Platform), ("ur5e", Question::Legs)] {
        let settings = question.settings().with(|set| set.starts = Some(1));
        match design(&plant(name), &settings) {
            Err(Error::Argument(why)) => assert!(why.contains("no parallel robot"), "{why}"),
            other => panic!("{other:?}"),
        }
    }
}
