//! The design: exact derivatives of every criterion, limits between the samples, built-in ends, the
//! same answer on any number of threads, and the best so far on interruption.

use crate::common;
use crate::common::compare::largest;

use excite::base::BaseParameters;
use excite::design::criterion::{Condition, Criterion, Objective, Targets};
use excite::design::information::{Evaluation, Information};
use excite::design::parts::Control;
use excite::design::parts::Status;
use excite::design::{Design, Settings, design, design_with};
use excite::identifiability::assess;
use excite::robot::Robot;
use excite::robot::parts::JointTerm;
use excite::trajectory::Basis;
use excite::trajectory::parts::{Ends, Grid};
use excite::{Error, Plant, Result};
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use rand::Rng;
use std::sync::atomic::{AtomicBool, Ordering};

const CRITERIA: [Criterion; 4] = [
    Criterion::Condition,
    Criterion::D,
    Criterion::A,
    Criterion::E,
];
const CONDITIONS: [Condition; 4] = [
    Condition::Invariant,
    Condition::Raw,
    Condition::Normalised,
    Condition::Weighted,
];

fn run(robot: &Robot, settings: &Settings) -> Result<Design> {
    design(&robot.into(), settings)
}

/// A bundled robot that nothing stands in the way of: its limits alone bound the motion.
fn within_limits(name: &str) -> Plant {
    Plant::load(name).unwrap().without_collisions()
}

fn small(starts: usize) -> Settings {
    Settings::default().with(|set| set.starts = Some(starts))
}

/// A random point and the information matrix of a robot with all joint columns.
fn problem(seed: u64, condition: Condition) -> (Information<'static>, Vec<f64>) {
    let robot = common::robot(seed, 4, false).with_terms(&JointTerm::ALL);
    let base = BaseParameters::new(&robot).unwrap();
    let basis = Basis::new(&[1, 2, 3], Ends::Rest, robot.dof(), None).unwrap();
    let transform = match condition {
        Condition::Invariant => base.row_space.clone(),
        _ => base.selection(),
    };
    let noise: Vec<f64> = (0..robot.dof()).map(|j| 0.1 + 0.3 * j as f64).collect();
    let weights = (condition == Condition::Weighted).then_some(&noise[..]);
    let plant = Box::leak(Box::new(Plant::from(&robot)));
    let info = Information::new(plant, &basis, 3.0, 80, transform, weights);
    let r = &mut common::rng(seed + 1);
    let x = (0..info.len()).map(|_| r.random_range(-0.6..0.6)).collect();
    (info, x)
}

fn difference(x: &[f64], k: usize, f: &dyn Fn(&[f64]) -> f64) -> f64 {
    let h = 1e-6;
    let at = |s: f64| {
        let mut y = x.to_vec();
        y[k] += s * h;
        f(&y)
    };
    (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h)
}

#[test]
fn smoothed_gradients_match_differences() {
    for (seed, condition) in CONDITIONS.into_iter().enumerate() {
        for criterion in CRITERIA {
            let (info, x) = problem(seed as u64, condition);
            let objective = Objective {
                criterion,
                condition,
                targets: None,
            };
            let value = |x: &[f64]| {
                let mut e = Evaluation::default();
                info.evaluate(x, &mut e);
                objective.smooth_value(&objective.spectrum(&e.gram).unwrap(), 6.0)
            };
            let mut e = Evaluation::default();
            info.evaluate(&x, &mut e);
            let s = objective.spectrum(&e.gram).unwrap();
            let g = objective.smooth_gradient(&info, &mut e, &s, 6.0);
            let size = largest(&g);
            for (k, g) in g.iter().enumerate() {
                let d = difference(&x, k, &value);
                assert!(
                    (d - g).abs() < 2e-4 * size,
                    "{criterion:?} {condition:?} {k}: {d} {g}"
                );
            }
        }
    }
}

/// Both forms of the criterion that counts known parameters, soft and softer, have exact gradients; its count is
/// that of the covariance, whatever way that is computed.
#[test]
fn the_count_of_known_parameters_has_exact_gradients() {
    for seed in 0..3 {
        let (info, x) = problem(30 + seed, Condition::Weighted);
        let r = info.order();
        // nominal values of many sizes, so that some are known, some not, some out of reach
        let nominal: Vec<f64> = (0..r)
            .map(|k| 10f64.powf(-1.0 + 0.25 * (k % 9) as f64))
            .collect();
        let kappa = 3.0;
        let objective = Objective {
            criterion: Criterion::Known,
            condition: Condition::Weighted,
            targets: Some(Targets::new(&nominal, &vec!["kg"; r], kappa)),
        };
        for p in [10.0, 40.0] {
            let value = |x: &[f64]| {
                let mut e = Evaluation::default();
                info.evaluate(x, &mut e);
                objective.smooth_value(&objective.spectrum(&e.gram).unwrap(), p)
            };
            let mut e = Evaluation::default();
            info.evaluate(&x, &mut e);
            let s = objective.spectrum(&e.gram).unwrap();
            let g = objective.smooth_gradient(&info, &mut e, &s, p);
            let size = largest(&g);
            for (k, g) in g.iter().enumerate() {
                let d = difference(&x, k, &value);
                assert!((d - g).abs() < 2e-4 * size, "{p} {k}: {d} {g}");
            }
        }
        let mut e = Evaluation::default();
        info.evaluate(&x, &mut e);
        let prior = |k: usize| 1.0 / nominal[k].powi(2);
        let precision = Mat::from_fn(r, r, |i, j| {
            kappa * e.gram[(i, j)] + if i == j { prior(i) } else { 0.0 }
        });
        let covariance = precision
            .llt(Side::Lower)
            .unwrap()
            .solve(Mat::<f64>::identity(r, r));
        let missed: f64 = (0..r)
            .map(|k| {
                let rho = covariance[(k, k)] / (0.1 * nominal[k]).powi(2);
                rho * rho / (1.0 + rho * rho)
            })
            .sum();
        let value = objective.value(&objective.spectrum(&e.gram).unwrap());
        assert!(
            (value.exp() - missed).abs() < 1e-9 * missed,
            "{value} {missed}"
        );
    }
}

/// The default of the command line knows more parameters than the best condition number does.
#[test]
fn more_parameters_are_known_where_they_are_counted() {
    let plant = within_limits("ur5e");
    let count = |criterion| {
        let settings = small(3).with(|set| set.criterion = criterion);
        let d = design(&plant, &settings).unwrap();
        let report = assess(&d.plant, Some(&d.trajectory)).unwrap();
        let e = report.excitation.unwrap();
        assert!(e.elsewhere.std.iter().all(|s| s.is_finite() && *s > 0.0));
        e.known(10.0).0
    };
    let (known, condition) = (count(Criterion::Known), count(Criterion::Condition));
    assert!(known > condition, "{known} {condition}");
}

/// The first-order model of the group of extreme eigenvalues: its extreme eigenvalue follows the
/// true one along any direction, to first order, also for the second in the group.
#[test]
fn clusters_predict_eigenvalues_to_first_order() {
    for (seed, condition) in CONDITIONS.into_iter().enumerate() {
        let (info, x) = problem(10 + seed as u64, condition);
        let objective = Objective {
            criterion: Criterion::Condition,
            condition,
            targets: None,
        };
        let mut e = Evaluation::default();
        info.evaluate(&x, &mut e);
        let s = objective.spectrum(&e.gram).unwrap();
        let model = objective.model(&info, &mut e, &s);
        let last = s.values.len() - 1;
        for (cluster, at) in [(model.lower.unwrap(), 0), (model.upper.unwrap(), last)] {
            let reference = s.values[at];
            for k in 0..x.len() {
                let d = difference(&x, k, &|x| {
                    let mut e = Evaluation::default();
                    info.evaluate(x, &mut e);
                    objective.spectrum(&e.gram).unwrap().values[at]
                });
                let size = cluster.gradients[0]
                    .iter()
                    .fold(0.0f64, |m, g| m.max(g.abs()));
                let predicted = cluster.gradients[0][k];
                assert!(
                    (d / reference - predicted).abs() < 2e-4 * size,
                    "{condition:?} {k}"
                );
            }
        }
    }
}

/// Checks a finished design at 100 kHz against its limits and its end conditions.
fn check_limits(d: &Design) {
    let f = &d.trajectory.fourier;
    let count = (1e5 * f.period) as usize;
    let table = excite::trajectory::Table::new(f.period, &f.harmonics, count);
    let mut values = vec![0.0; count];
    for (series, joint) in f.joints.iter().zip(&d.plant.robot().joints) {
        let l = &joint.limits;
        let bands = [
            (0, l.position[0], l.position[1]),
            (1, -l.velocity, l.velocity),
            (2, -l.acceleration, l.acceleration),
            (3, -l.jerk, l.jerk),
        ];
        for (order, low, high) in bands {
            table.series(series, order, &mut values);
            let least = values.iter().cloned().fold(f64::INFINITY, f64::min);
            let most = values.iter().cloned().fold(f64::NEG_INFINITY, f64::max);
            let room = if (high - low).is_finite() {
                1e-9 * (high - low)
            } else {
                0.0
            };
            assert!(
                least >= low - room && most <= high + room,
                "{} order {order}: {least} … {most}, limits {low} … {high}",
                joint.name
            );
            if d.trajectory.ends == Ends::Rest && (order == 1 || order == 2) {
                assert!(values[0].abs() < 1e-9, "{} starts at rest", joint.name);
            }
        }
    }
}

#[test]
fn designs_stay_inside_every_limit_at_100_khz() {
    let cases = [
        ("panda", small(2)),
        (
            "scara",
            small(2).with(|set| {
                set.grid = Grid::Odd;
                set.harmonics = 4;
                set.period = 6.0;
            }),
        ),
        (
            "ur10",
            small(1).with(|set| {
                set.derate = 0.7;
                set.criterion = Criterion::D;
            }),
        ),
        (
            "planar2",
            small(2).with(|set| {
                set.ends = Ends::Free;
                set.condition = Condition::Weighted;
            }),
        ),
    ];
    for (name, settings) in cases {
        let d = design(&within_limits(name), &settings).unwrap();
        check_limits(&d);
        let e = assess(&d.plant, Some(&d.trajectory))
            .unwrap()
            .excitation
            .unwrap();
        assert!(e.certificate.satisfied, "{name}");
        let used = e.certificate.worst.unwrap().used;
        assert!(used <= settings.derate + 1e-6, "{name} uses {used}");
        assert!(
            used > 0.9 * settings.derate,
            "{name} leaves its limits unused: {used}"
        );
    }
}

#[test]
fn the_reference_problems_are_solved() {
    // one round of starts gets well below what general solvers over other models reach (10)
    for (name, bound) in [("panda", 7.2), ("ur10", 7.2)] {
        let d = design(&within_limits(name), &small(4)).unwrap();
        assert!(d.value < bound, "{name}: {}", d.value);
        let e = assess(&d.plant, Some(&d.trajectory))
            .unwrap()
            .excitation
            .unwrap();
        // what the optimiser minimised is what the report says
        assert!((e.condition.invariant / d.value - 1.0).abs() < 0.02);
    }
}

#[test]
fn same_seed_same_answer_on_any_number_of_threads() {
    let robot = Robot::load("scara").unwrap();
    let with = |threads, seed| {
        run(
            &robot,
            &small(5).with(|set| {
                set.threads = threads;
                set.seed = seed;
            }),
        )
        .unwrap()
        .trajectory
        .fourier
    };
    let one = with(1, 3);
    assert_eq!(one, with(2, 3));
    assert_eq!(one, with(5, 3));
    assert_ne!(one, with(1, 4));
}

#[test]
fn start_posture_is_kept() {
    let robot = Robot::load("planar2").unwrap();
    let start = vec![0.4, -0.7];
    let settings = small(2).with(|set| set.start = Some(start.clone()));
    let d = run(&robot, &settings).unwrap();
    let mut q = vec![0.0; 2];
    d.trajectory.fourier.derivative(0, 0.0, &mut q);
    for (q, s) in q.iter().zip(&start) {
        assert!((q - s).abs() < 1e-12);
    }
    check_limits(&d);
}

#[test]
fn interruption_keeps_the_best_so_far() {
    let plant = Plant::load("scara").unwrap();
    let stop = AtomicBool::new(false);
    let first = Control {
        cancel: &stop,
        progress: &|_| stop.store(true, Ordering::Relaxed),
    };
    let d = design_with(&plant, &small(400), &first).unwrap();
    assert_eq!(d.record.status, Status::Interrupted);
    assert!(d.record.starts.len() < 400);
    check_limits(&d);
    // even when it comes before anything was done
    let plant = Plant::load("ur5e").unwrap();
    let before = Control {
        cancel: &AtomicBool::new(true),
        ..Control::default()
    };
    let d = design_with(&plant, &small(400), &before).unwrap();
    assert_eq!(d.record.status, Status::Interrupted);
    check_limits(&d);
}

#[test]
fn impossible_problems_are_refused_with_the_reason() {
    let robot = Robot::load("panda").unwrap();
    let argument = |s: Settings, word: &str| match run(&robot, &s) {
        Err(Error::Argument(m)) => assert!(m.contains(word), "{m}"),
        other => panic!("{word}: {:?}", other.map(|d| d.value)),
    };
    argument(small(1).with(|set| set.period = 0.0), "period");
    argument(small(1).with(|set| set.period = f64::NAN), "period");
    argument(small(1).with(|set| set.harmonics = 1), "harmonics");
    argument(small(1).with(|set| set.derate = 1.5), "derate");
    argument(small(1).with(|set| set.periods = 0), "periods");
    argument(
        small(1).with(|set| set.time_limit = Some(-1.0)),
        "time limit",
    );
    argument(
        small(1).with(|set| set.start = Some(vec![0.0; 3])),
        "posture",
    );
    argument(
        small(1).with(|set| set.start = Some(vec![9.0; 7])),
        "panda_joint1",
    );

    let mut weak = Robot::load("planar2").unwrap();
    // it cannot move against its own friction
    weak.joints[1].limits.effort = 0.5;
    weak.joints[1].terms[2] = 0.6;
    let joint = weak.joints[1].name.clone();
    match run(&weak, &small(1)) {
        Err(Error::Infeasible(m)) => assert!(m.contains(&joint), "{m}"),
        other => panic!("{:?}", other.map(|d| d.value)),
    }
}

/// In the middle of the range of joint 1 the arm lies flat and needs more torque than there is; a
/// motion that is shrunk towards it gets worse. What is returned keeps the limit, or nothing is.
#[test]
fn what_is_not_certified_is_not_a_result() {
    let urdf = excite::robot::bundled::find("planar2").unwrap().urdf;
    let toml = r#"
        name = "tight"
        urdf = "planar2.urdf"
        [[joint]]
        name = "joint1"
        velocity = 8.0
        acceleration = 400.0
        jerk = 40000.0
        effort = 31.0
        [[joint]]
        name = "joint2"
        position = [-3.1, 3.1]
        velocity = 8.0
        acceleration = 400.0
        jerk = 40000.0
        effort = 20.0"#;
    let robot = Robot::from_toml_str(toml, urdf, "tight.toml").unwrap();
    let mut designed = 0;
    for (criterion, seed) in [
        (Criterion::D, 1),
        (Criterion::D, 2),
        (Criterion::Condition, 1),
    ] {
        let settings = small(2).with(|set| {
            set.harmonics = 2;
            set.period = 4.0;
            set.ends = Ends::Free;
            set.criterion = criterion;
            set.seed = seed;
        });
        match run(&robot, &settings) {
            Ok(d) => {
                let c = d.plant.certify(&d.trajectory.fourier, 1.0).unwrap();
                assert!(c.satisfied(), "{criterion:?} {seed}: {:?}", c.broken());
                designed += 1;
            }
            Err(e) => {
                let message = e.to_string();
                assert!(
                    message.contains("torque of joint1 at 1") && message.contains('%'),
                    "{message}"
                );
            }
        }
    }
    assert!(designed > 0, "no design at all was found");
}
