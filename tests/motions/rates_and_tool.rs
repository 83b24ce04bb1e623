//! Limits of the rate of torque and of the tool point: bounds against differences, designs that keep them, files.

use super::controller_limits::{URDF, one_start};
use excite::Plant;
use excite::collision::scene::poses;
use excite::dynamics::Samples;
use excite::moves::parts::State;
use excite::moves::{Move, Settings as MoveSettings};
use excite::regressor::term_factor;
use excite::robot::Robot;
use excite::robot::parts::JointTerm;
use excite::robot::parts::Tool;
use excite::trajectory::parts::SampledBound;
use excite::trajectory::parts::Series;
use excite::trajectory::{Fourier, rate_certificate};
use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Rates of the smooth torque at many times are inside the bound, whatever is spent on it.
#[test]
fn the_bound_of_the_rate_of_torque_holds() {
    for (name, samples) in [("panda", 3), ("panda", 300), ("scara", 2000), ("fr3", 2000)] {
        let mut robot = Robot::load(name).unwrap();
        for joint in &mut robot.joints {
            joint.limits.effort_rate = 50.0;
        }
        let plant = Plant::from(&robot);
        let n = robot.dof();
        let joints = (0..n).map(|j| {
            let phase = |k: f64| 0.3 / k * (1.3 * j as f64 + 2.0 * k).sin();
            Series {
                constant: 0.1 * j as f64,
                sin: vec![phase(1.0), phase(2.0), phase(3.5)],
                cos: vec![phase(1.4), phase(2.2), phase(3.1)],
            }
        });
        let fourier = Fourier::new(4.0, vec![1, 2, 3], joints.collect()).unwrap();
        let smooth = |q: &[f64], qd: &[f64], qdd: &[f64], tau: &mut [f64]| {
            let at = excite::dynamics::Samples::from_rows(
                n,
                &[&q.to_vec()],
                &[&qd.to_vec()],
                &[&qdd.to_vec()],
            );
            let all = plant.nominal_torque(&at).unwrap();
            for j in 0..n {
                let sign = if qd[j] == 0.0 { 0.0 } else { qd[j].signum() };
                tau[j] = all[j] - robot.joints[j].terms[2] * sign;
            }
        };
        let bounds = rate_certificate(&robot, &fourier, samples, &smooth).unwrap();
        let bounds: Vec<SampledBound> = bounds.into_iter().map(Option::unwrap).collect();
        let at = |t: f64| {
            let mut s = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
            let [q, qd, qdd] = &mut s;
            fourier.evaluate(t, [q, qd, qdd]);
            let mut tau = vec![0.0; n];
            smooth(q, qd, qdd, &mut tau);
            tau
        };
        let mut most = vec![0.0_f64; n];
        for i in 0..7919 {
            let (t, h) = (
                f64::from(i) * fourier.period / 7919.0,
                1e-5 * fourier.period,
            );
            let (a, b) = (at(t - h), at(t + h));
            for j in 0..n {
                most[j] = most[j].max(((b[j] - a[j]) / (2.0 * h)).abs());
            }
        }
        for (b, most) in bounds.iter().zip(most) {
            assert!(b.bound() >= most * (1.0 - 1e-6), "{name}: {most} {b:?}");
            assert!(
                samples < 2000 || b.max_on_grid >= 0.99 * most,
                "{name}: {most} {b:?}"
            );
        }
    }
}

#[test]
fn a_design_keeps_limits_of_the_rate_of_torque() {
    let mut robot = Robot::load("planar2").unwrap();
    let free = one_start(&Plant::from(&robot));
    let rate = |robot: &Robot, fourier: &Fourier| {
        let found = Plant::from(robot).certify(fourier, 1.0).unwrap();
        let all = found
            .actuators
            .joints
            .iter()
            .map(|c| c.torque_rate.clone().unwrap());
        (all.collect::<Vec<_>>(), found.satisfied())
    };
    for joint in &mut robot.joints {
        joint.limits.effort_rate = 1e6;
    }
    let without = rate(&robot, &free.trajectory.fourier).0;
    for (joint, r) in robot.joints.iter_mut().zip(&without) {
        joint.limits.effort_rate = 0.5 * r.max_on_grid;
    }
    assert!(!rate(&robot, &free.trajectory.fourier).1);
    let kept = one_start(&Plant::from(&robot));
    let (rates, satisfied) = rate(&robot, &kept.trajectory.fourier);
    assert!(satisfied && rates.iter().all(SampledBound::satisfied));
    // and are worth keeping: near one of them
    assert!(rates.iter().any(|r| r.used > 0.85), "{rates:?}");
}

/// Largest speed and acceleration of a point by differences of its position, from the poses of the bodies.
fn by_differences(robot: &Robot, tool: &Tool, fourier: &Fourier) -> [f64; 2] {
    let at = |t: f64| {
        let mut q = vec![0.0; robot.dof()];
        fourier.derivative(0, t, &mut q);
        let mut all = Vec::new();
        poses(robot, &q, &mut all);
        all[tool.body].rotation * tool.point + all[tool.body].position
    };
    let h = 1e-4 * fourier.period;
    let each = (0..10_000).map(|i| {
        let t = f64::from(i) * h;
        let (a, b, c) = (at(t - h), at(t), at(t + h));
        [
            ((c - a) / (2.0 * h)).norm(),
            ((a - 2.0 * b + c) / (h * h)).norm(),
        ]
    });
    each.fold([0.0; 2], |m, x| [m[0].max(x[0]), m[1].max(x[1])])
}

#[test]
fn the_tool_point_keeps_its_limits() {
    let mut robot = Robot::load("planar2").unwrap();
    let tool = |speed, acceleration| Tool {
        frame: "tip".into(),
        body: 1,
        point: Vector3::new(0.3, 0.05, -0.1),
        speed,
        acceleration,
    };
    robot.tool = Some(tool(1e3, 1e3));
    let free = one_start(&Plant::from(&robot)).trajectory.fourier;
    let known = |robot: &Robot, fourier: &Fourier| {
        let found = Plant::from(robot).certify(fourier, 1.0).unwrap();
        (
            found.actuators.tool.clone().unwrap(),
            found.satisfied(),
            found.actuators.worst,
        )
    };
    let (t, satisfied, _) = known(&robot, &free);
    assert!(satisfied);
    let both = [t.speed.unwrap(), t.acceleration.unwrap()];
    let sampled = by_differences(&robot, robot.tool.as_ref().unwrap(), &free);
    for (bound, sampled) in both.iter().zip(sampled) {
        assert!(
            bound.bound() >= sampled * (1.0 - 1e-6),
            "{bound:?} {sampled}"
        );
        assert!(bound.max_on_grid >= 0.99 * sampled, "{bound:?} {sampled}");
    }
    for half in [[0.5, f64::INFINITY], [f64::INFINITY, 0.5], [0.6, 0.7]] {
        let limits = [half[0] * sampled[0], half[1] * sampled[1]];
        robot.tool = Some(tool(limits[0], limits[1]));
        let (t, satisfied, worst) = known(&robot, &free);
        assert!(!satisfied && !t.satisfied());
        assert!(worst.is_some_and(|w| w.joint == "tip" && w.used > 1.0));
        let kept = one_start(&Plant::from(&robot)).trajectory.fourier;
        let (t, satisfied, _) = known(&robot, &kept);
        assert!(satisfied && t.satisfied());
        let now = by_differences(&robot, robot.tool.as_ref().unwrap(), &kept);
        let used = [now[0] / limits[0], now[1] / limits[1]];
        assert!(used.iter().all(|u| *u <= 1.0 + 1e-6), "{used:?}");
        assert!(used.iter().any(|u| *u > 0.85), "{used:?}");
    }
    // a move with the same limits
    robot.tool = Some(tool(0.4, 2.0));
    let settings = MoveSettings::default().with(|set| set.scale = 1.0);
    let (from, to) = (State::rest(&[-0.6, 0.9]), State::rest(&[0.9, -0.8]));
    let there = Move::plan(&Plant::from(&robot), &from, &to, &settings, None).unwrap();
    let peak = there.tool.clone().unwrap();
    assert!(there.slowed > 1.0);
    let most = peak
        .speed_used
        .unwrap()
        .max(peak.acceleration_used.unwrap());
    assert!(most <= 1.0 + 1e-6 && most > 0.95, "{most}");
}

#[test]
fn files_state_the_tool_point() {
    let read = |table: &str| {
        let toml = format!("urdf = \"one.urdf\"\n[tool]\n{table}");
        Robot::from_toml_str(&toml, URDF, "robot.toml").map_err(|e| e.to_string())
    };
    let robot = read("frame = \"arm\"\npoint = [0.1, 0.0, 0.2]\nspeed = 0.5\n").unwrap();
    let tool = robot.tool.clone().unwrap();
    assert_eq!(
        (tool.speed, tool.acceleration, tool.body),
        (0.5, f64::INFINITY, 0)
    );
    assert_eq!(tool.point, Vector3::new(0.1, 0.0, 0.2));
    let again =
        Robot::from_toml_str(&robot.to_toml_template("one.urdf"), URDF, "again.toml").unwrap();
    assert_eq!(again.tool, robot.tool);
    for (table, words) in [
        (
            "frame = \"arn\"\nspeed = 1.0",
            ["line 3", "did you mean `arm`"],
        ),
        ("frame = \"base\"\nspeed = 1.0", ["line 3", "does not move"]),
        ("frame = \"arm\"", ["line 3", "states no limit"]),
        (
            "frame = \"arm\"\npoint = [1.0]\nspeed = 1.0",
            ["line 4", "three numbers"],
        ),
        ("frame = \"arm\"\nspeed = -1.0", ["line 4", "positive"]),
        ("frame = \"arm\"\nspeeds = 1.0", ["line 4", "speeds"]),
    ] {
        let e = read(table).unwrap_err();
        assert!(words.iter().all(|w| e.contains(w)), "{e}");
    }
}

/// Torques, their rates and the tool point of random legs at 100 kHz: within the limits, and below what the move
/// says is exceeded at no time.
#[test]
fn moves_keep_their_limits_between_samples() {
    let mut rng = ChaCha8Rng::seed_from_u64(23);
    let mut slowed = 0;
    for name in ["panda", "ur5e", "scara", "planar2"] {
        let mut robot = Robot::load(name).unwrap();
        let n = robot.dof();
        let tool = |speed, acceleration| Tool {
            frame: "tip".into(),
            body: n - 1,
            point: Vector3::new(0.3, 0.05, -0.1),
            speed,
            acceleration,
        };
        robot.tool = Some(tool(1e6, 1e6));
        robot.joints.iter_mut().for_each(|j| {
            j.limits.effort = 1e6;
            j.limits.effort_rate = 1e9;
        });
        let mut posture = || -> Vec<f64> {
            let each = robot.joints.iter().map(|j| {
                let [low, high] = j.limits.position.map(|x| x.clamp(-1.0, 1.0));
                rng.random_range(low..=high)
            });
            each.collect()
        };
        let (from, to) = (State::rest(&posture()), State::rest(&posture()));
        let settings = MoveSettings::default().with(|set| set.scale = 1.0);
        let free = Move::plan(&Plant::from(&robot), &from, &to, &settings, None).unwrap();
        let peak = free.tool.clone().unwrap();
        robot.tool = Some(tool(0.9 * peak.speed, 0.9 * peak.acceleration));
        for (joint, peak) in robot.joints.iter_mut().zip(&free.torques) {
            joint.limits.effort = 1.02 * peak.value + 1e-3;
            joint.limits.effort_rate = 0.6 * peak.rate.unwrap() + 1.0;
        }
        let plant = Plant::from(&robot);
        for m in [
            free,
            Move::plan(&plant, &from, &to, &settings, None).unwrap(),
        ] {
            let limited = m.slowed > 1.0;
            slowed += usize::from(limited);
            let s = m.sample(1e5).unwrap();
            let count = s.len();
            let mut x = Samples::zeros(n, count);
            x.q = s.q.concat();
            x.qd = s.qd.concat();
            x.qdd = s.qdd.concat();
            let tau = plant.nominal_torque(&x).unwrap();
            for (a, joint) in robot.joints.iter().enumerate() {
                let (peak, limits) = (&m.torques[a], joint.limits);
                let (bound, fastest) = (peak.bound.unwrap(), peak.rate_bound.unwrap());
                assert!(peak.value <= bound * (1.0 + 1e-9), "{name} {peak:?}");
                if limited {
                    assert!(bound <= limits.effort * (1.0 + 1e-6), "{name} {peak:?}");
                    assert!(fastest <= limits.effort_rate * (1.0 + 1e-6));
                }
                let dry = |i: usize| {
                    let jump = joint.terms[JointTerm::Coulomb as usize];
                    jump * term_factor(JointTerm::Coulomb, x.at(a, i))
                };
                for i in 0..count {
                    let now = tau[a * count + i];
                    assert!(
                        now.abs() <= bound * (1.0 + 1e-9),
                        "{name} {a}: {now} {bound}"
                    );
                    let h = if i == 0 { 0.0 } else { s.t[i] - s.t[i - 1] };
                    if h > 5e-6 {
                        let rate = (now - dry(i) - tau[a * count + i - 1] + dry(i - 1)) / h;
                        assert!(
                            rate.abs() <= fastest * (1.0 + 1e-6) + 1e-4,
                            "{name} {a}: {rate} {fastest}"
                        );
                    }
                }
            }
            let peak = m.tool.clone().unwrap();
            let (speed, acceleration) =
                (peak.speed_bound.unwrap(), peak.acceleration_bound.unwrap());
            let tool = robot.tool.as_ref().unwrap();
            if limited {
                assert!(speed <= tool.speed * (1.0 + 1e-6));
                assert!(acceleration <= tool.acceleration * (1.0 + 1e-6));
            }
            let at = |i: usize| {
                let q: Vec<f64> = s.q.iter().map(|q| q[i]).collect();
                let mut all = Vec::new();
                poses(&robot, &q, &mut all);
                all[tool.body].rotation * tool.point + all[tool.body].position
            };
            for i in 1..count {
                let h = s.t[i] - s.t[i - 1];
                if h > 5e-6 {
                    let now = (at(i) - at(i - 1)).norm() / h;
                    assert!(now <= speed * (1.0 + 1e-6), "{name}: {now} {speed}");
                }
            }
        }
    }
    assert!(slowed >= 4, "{slowed}");
}
