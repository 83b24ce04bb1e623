//! Moves against their limits, against another planner, and among walls; the rehearsal table.

mod among;
mod closed;
mod rehearsal;

use excite::collision::scene::{Obstacle, Pair, Partner, Scene, Volume, poses};
use excite::moves::parts::State;
use excite::moves::{Move, Rehearsal, Settings, rehearse};
use excite::robot::Robot;
use excite::robot::parts::JointTerm;
use excite::robot::parts::Limits;
use excite::solid::Shape;
use excite::trajectory::parts::Ends;
use excite::trajectory::parts::Series;
use excite::trajectory::{Basis, Fourier, Trajectory, extrema, samples};
use excite::{Error, Plant};
use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rsruckig::prelude::{
    InputParameter, Ruckig, Synchronization, ThrowErrorHandler, Trajectory as Profile,
};

const ROBOTS: [&str; 8] = [
    "panda", "ur10", "ur5e", "ur10e", "iiwa14", "puma560", "scara", "planar2",
];

fn full() -> Settings {
    Settings::default().with(|set| set.scale = 1.0)
}

/// The limits with what a move assumes where none is stated.
fn limits(plant: &Plant) -> Vec<Limits> {
    let assumed = |value: f64, other: f64| if value.is_finite() { value } else { other };
    let joints = plant.moved().joints.iter();
    joints
        .map(|j| {
            let mut l = j.limits;
            l.velocity = assumed(l.velocity, 1.0);
            l.acceleration = assumed(l.acceleration, l.velocity / 0.2);
            l.jerk = assumed(l.jerk, l.acceleration / 0.1);
            l
        })
        .collect()
}

fn posture(robot: &Robot, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let each = robot.joints.iter().map(|j| {
        let [low, high] = j.limits.position.map(|x| x.clamp(-3.0, 3.0));
        rng.random_range(low..high)
    });
    each.collect()
}

/// A motion that is free at its ends and uses a share of the limits.
fn motion(robot: &Robot, limits: &[Limits], share: f64, rng: &mut ChaCha8Rng) -> Fourier {
    let harmonics: Vec<u32> = vec![1, 2, 3];
    let basis = Basis::new(&harmonics, Ends::Free, robot.dof(), None).unwrap();
    let x: Vec<f64> = (0..basis.len())
        .map(|_| rng.random_range(-1.0..1.0))
        .collect();
    let mut f = basis.fourier(rng.random_range(2.0..8.0), &x);
    for (series, l) in f.joints.iter_mut().zip(limits) {
        let [low, high] = l.position.map(|x| x.clamp(-3.0, 3.0));
        series.constant = 0.0;
        let largest = |order| {
            extrema(f.period, &f.harmonics, series, order)
                .largest()
                .value
        };
        let factor = [
            0.5 * (high - low) / largest(0),
            l.velocity / largest(1),
            l.acceleration / largest(2),
            l.jerk / largest(3),
        ];
        let factor = share * factor.into_iter().fold(f64::INFINITY, f64::min);
        let all = series.sin.iter_mut().chain(&mut series.cos);
        all.for_each(|v| *v *= factor);
        series.constant = 0.5 * (low + high);
    }
    f
}

/// No limit is exceeded at 10 kHz, states belong together, the ends are met.
fn check(plant: &Plant, limits: &[Limits], m: &Move, rate: f64) {
    let s = m.sample(rate).unwrap();
    assert_eq!(s.t[s.len() - 1], m.duration);
    for (j, l) in limits.iter().enumerate() {
        let name = format!("{} joint {j}", plant.name());
        let last = s.len() - 1;
        for i in 0..=last {
            let (q, v, a) = (s.q[j][i], s.qd[j][i], s.qdd[j][i]);
            assert!(
                q >= l.position[0] - 1e-9 && q <= l.position[1] + 1e-9,
                "{name}: {q}"
            );
            assert!(v.abs() <= l.velocity * (1.0 + 1e-8), "{name}: {v}");
            assert!(a.abs() <= l.acceleration * (1.0 + 1e-8), "{name}: {a}");
            if i == 0 {
                continue;
            }
            let h = s.t[i] - s.t[i - 1];
            if h > 1e-7 {
                let jerk = (a - s.qdd[j][i - 1]).abs() / h;
                assert!(jerk <= l.jerk * (1.0 + 1e-6) + 1e-7, "{name}: {jerk}");
            }
            let (q0, v0) = (s.q[j][i - 1], s.qd[j][i - 1]);
            assert!((q - q0 - 0.5 * h * (v + v0)).abs() <= 0.25 * h.powi(3) * l.jerk + 1e-12);
            assert!((v - v0 - 0.5 * h * (a + s.qdd[j][i - 1])).abs() <= h * h * l.jerk + 1e-12);
        }
        // the state just inside of the ends, not only the one that is given back at them
        let near = 1e-12;
        let (mut q, mut v, mut a) = (vec![0.0; m.dof()], vec![0.0; m.dof()], vec![0.0; m.dof()]);
        for (t, end) in [(near, &m.from), (m.duration - near, &m.to)] {
            m.evaluate(t, [&mut q, &mut v, &mut a]);
            assert!(
                (q[j] - end.q[j]).abs() < 1e-9,
                "{name}: {} {}",
                q[j],
                end.q[j]
            );
            assert!((v[j] - end.qd[j]).abs() < 1e-9 + 2.0 * near * l.acceleration);
            assert!(
                (a[j] - end.qdd[j]).abs() < 1e-9 + 2.0 * near * l.jerk,
                "{name}"
            );
        }
        let p = &m.joints[j].peaks;
        let largest = |x: &[f64]| x.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
        assert!(p.velocity >= largest(&s.qd[j]) - 1e-12);
        assert!(p.acceleration >= largest(&s.qdd[j]) - 1e-12);
    }
    for t in &m.torques {
        assert!(
            t.used.is_none_or(|u| u <= 1.0 + 1e-6),
            "{}: {t:?}",
            plant.name()
        );
    }
}

/// What another planner says: the time of all together, and the fastest of each joint alone.
fn reference(from: &State, to: &State, limits: &[Limits]) -> (f64, f64) {
    let n = limits.len();
    let mut input = InputParameter::<0>::new(Some(n));
    input.synchronization = Synchronization::Time;
    for (k, l) in limits.iter().enumerate() {
        input.current_position[k] = from.q[k];
        input.current_velocity[k] = from.qd[k];
        input.current_acceleration[k] = from.qdd[k];
        input.target_position[k] = to.q[k];
        input.target_velocity[k] = to.qd[k];
        input.target_acceleration[k] = to.qdd[k];
        input.max_velocity[k] = l.velocity.max(to.qd[k].abs());
        input.max_acceleration[k] = l.acceleration;
        input.max_jerk[k] = l.jerk;
    }
    let mut planner = Ruckig::<0, ThrowErrorHandler>::new(Some(n), 1.0);
    let mut out = Profile::<0>::new(Some(n));
    planner.calculate(&input, &mut out).unwrap();
    let slowest = (0..n).map(|k| out.independent_min_durations[k]);
    (out.duration, slowest.fold(0.0, f64::max))
}

#[test]
fn random_moves_keep_every_limit_at_10_khz_and_are_time_optimal() {
    let (mut made, mut refused, mut slowed, mut raised) = (0, Vec::new(), 0, 0);
    let (mut ratio, mut moving_ratio) = (0.0_f64, 0.0_f64);
    for (r, name) in ROBOTS.iter().enumerate() {
        let plant = Plant::load(name).unwrap();
        let robot = plant.robot();
        let limits = limits(&plant);
        let mut rng = ChaCha8Rng::seed_from_u64(r as u64);
        for k in 0..64 {
            let settings =
                Settings::default().with(|set| set.scale = if k % 2 == 0 { 1.0 } else { 0.2 });
            let a = State::rest(&posture(robot, &mut rng));
            let b = match k % 3 {
                0 => State::rest(&posture(robot, &mut rng)),
                _ => {
                    let share = if k % 4 < 2 { 0.5 } else { 0.9 };
                    State::start_of(&motion(robot, &limits, share, &mut rng))
                }
            };
            let (from, to) = if k % 3 == 2 { (&b, &a) } else { (&a, &b) };
            let m = match Move::plan(&plant, from, to, &settings, None) {
                Ok(m) => m,
                Err(e) => {
                    refused.push(format!("{name} {k}: {e}"));
                    continue;
                }
            };
            check(&plant, &limits, &m, 10_000.0);
            made += 1;
            slowed += usize::from(m.slowed > 1.0);
            raised += usize::from(m.scale > settings.scale);
            let asked: Vec<Limits> = limits
                .iter()
                .map(|l| Limits {
                    velocity: settings.scale * l.velocity,
                    acceleration: settings.scale * l.acceleration,
                    jerk: settings.scale * l.jerk,
                    ..*l
                })
                .collect();
            if m.slowed > 1.0 || !m.via.is_empty() || m.scale != settings.scale {
                continue;
            }
            if k % 3 == 0 {
                let (_, slowest) = reference(from, to, &asked);
                ratio = ratio.max((m.duration / slowest - 1.0).abs());
                let used = m.joints.iter().flat_map(|j| j.used).fold(0.0, f64::max);
                assert!(used <= settings.scale * (1.0 + 1e-9), "{name} {k}: {used}");
            } else if settings.scale == 1.0 {
                let (together, slowest) = reference(from, to, &asked);
                assert!(m.duration >= slowest * 0.999, "{name} {k}");
                moving_ratio = moving_ratio.max(m.duration / together - 1.0);
            }
        }
    }
    println!(
        "{made} moves, {slowed} slowed, {raised} faster than asked, {} refused; {ratio} and {moving_ratio} \
         above the reference",
        refused.len()
    );
    refused.iter().for_each(|e| println!("{e}"));
    assert!(made >= 505, "{refused:?}");
    assert!(
        ratio < 1e-2 && moving_ratio < 1e-2,
        "{ratio} {moving_ratio}"
    );
}

#[test]
fn torques_slow_a_move_down_and_what_cannot_be_held_is_named() {
    let mut robot = Robot::load("planar2").unwrap();
    // 31.9 N m hold the stretched arm
    robot.joints[0].limits.effort = 34.0;
    let brisk = Settings::default().with(|set| set.scale = 0.3);
    let plant = Plant::from(&robot);
    let (from, to) = (State::rest(&[-0.3, 0.0]), State::rest(&[0.6, 0.0]));
    let free = Move::plan(&Plant::load("planar2").unwrap(), &from, &to, &brisk, None).unwrap();
    let m = Move::plan(&plant, &from, &to, &brisk, None).unwrap();
    assert!(m.slowed > 1.0 && free.slowed == 1.0);
    assert!((m.duration - free.duration * m.slowed).abs() < 1e-9);
    let used = m.torques[0].used.unwrap();
    assert!(used > 0.97 && used < 1.0 + 1e-6, "{used}");
    check(&plant, &limits(&plant), &m, 1000.0);
    robot.joints[0].limits.effort = 30.0;
    let error = Move::plan(&Plant::from(&robot), &from, &to, &brisk, None).unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains("torque of joint1") && text.contains("however slow"),
        "{text}"
    );
}

#[test]
fn missing_limits_and_unusable_states() {
    let mut robot = Robot::load("panda").unwrap();
    let q: Vec<f64> = vec![0.0, -0.5, 0.0, -2.0, 0.0, 1.5, 0.7];
    let p: Vec<f64> = q.iter().map(|x| x + 0.1).collect();
    let rest = State::rest;
    let plant = Plant::from(&robot);
    let same = Move::plan(&plant, &rest(&q), &rest(&q), &full(), None).unwrap();
    assert_eq!((same.duration, same.sample(100.0).unwrap().len()), (0.0, 1));
    let refused = |robot: &Robot, a: &State, b: &State, settings: &Settings| {
        let error = Move::plan(&Plant::from(robot), a, b, settings, None).unwrap_err();
        assert!(error.is_argument());
        error.to_string()
    };
    let mut far = q.clone();
    far[2] = 4.0;
    let far = refused(&robot, &rest(&q), &rest(&far), &full());
    assert!(far.contains("joint3") && far.contains("target") && far.contains("position limits"));
    let nan = refused(&robot, &rest(&[f64::NAN; 7]), &rest(&q), &full());
    assert!(nan.contains("joint1") && nan.contains("not finite"));
    assert!(refused(&robot, &rest(&q[..6]), &rest(&q), &full()).contains("start"));
    for scale in [0.0, 1.1, f64::NAN, -1.0] {
        let settings = Settings::default().with(|set| set.scale = scale);
        assert!(refused(&robot, &rest(&q), &rest(&p), &settings).contains("share"));
    }
    robot.joints[2].limits.velocity = f64::INFINITY;
    robot.joints[2].limits.acceleration = f64::INFINITY;
    robot.joints[2].limits.jerk = f64::INFINITY;
    robot.joints[4].limits.position = [f64::NEG_INFINITY, f64::INFINITY];
    let plant = Plant::from(&robot);
    let m = Move::plan(&plant, &rest(&q), &rest(&p), &full(), None).unwrap();
    assert_eq!(m.warnings.len(), 1);
    let text = m.warnings[0].to_string();
    assert!(
        text.contains("panda_joint3") && text.contains("acceleration 5 rad/s^2"),
        "{text}"
    );
    check(&plant, &limits(&plant), &m, 1000.0);
    robot.joints[6].limits.jerk = -1.0;
    assert!(refused(&robot, &rest(&q), &rest(&p), &full()).contains("joint7"));
}

#[test]
fn parallel_robots_move_inside_the_limits_of_their_actuators() {
    for name in ["hexapod", "delta", "h4"] {
        let plant = Plant::load(name).unwrap();
        let home = plant.home().unwrap().to_vec();
        let mut to = home.clone();
        to[0] += 0.03;
        to[2] -= 0.02;
        let settings = Settings::default();
        let m = Move::plan(
            &plant,
            &State::rest(&home),
            &State::rest(&to),
            &settings,
            None,
        )
        .unwrap();
        let s = m.sample(1000.0).unwrap();
        let x = excite::dynamics::Samples {
            dof: s.dof(),
            count: s.len(),
            q: s.q.concat(),
            qd: s.qd.concat(),
            qdd: s.qdd.concat(),
        };
        let moved = plant.actuator_motion(&x).unwrap();
        for (a, joint) in plant.actuators().iter().enumerate() {
            let l = joint.limits;
            for i in 0..x.count {
                let [_, v, w] = moved.at(a, i);
                assert!(v.abs() <= 0.2 * l.velocity * 1.001, "{name}");
                assert!(w.abs() <= 0.2 * l.acceleration * 1.001, "{name}");
            }
        }
        assert!(
            m.duration > 0.05 && m.duration < 20.0,
            "{name} {}",
            m.duration
        );
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("move.csv");
        assert_eq!(
            m.write(&plant, &file, false, 100.0).unwrap(),
            m.sample(100.0).unwrap().len()
        );
    }
}
