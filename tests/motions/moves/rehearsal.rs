//! Work, power and ratings.

use super::*;

/// Potential energy, J.
fn potential(robot: &Robot, q: &[f64]) -> f64 {
    let mut at = Vec::new();
    poses(robot, q, &mut at);
    let each = robot.bodies.iter().zip(&at).map(|(body, pose)| {
        let [m, x, y, z] = [0, 1, 2, 3].map(|k| body.inertia.0[k]);
        let moment = pose.rotation * Vector3::new(x, y, z) + pose.position * m;
        -robot.gravity.dot(&moment)
    });
    each.sum()
}

#[test]
fn the_work_of_a_move_is_the_change_of_energy() {
    let plant = Plant::load("planar2").unwrap();
    let (a, b) = ([-0.8, 0.4], [0.9, -1.0]);
    let m = Move::plan(&plant, &State::rest(&a), &State::rest(&b), &full(), None).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("move.csv");
    m.write(&plant, &file, false, 5000.0).unwrap();
    let names = ["t", "dq1", "dq2", "tau1", "tau2"].map(String::from);
    let c = excite::trajectory::samples::read_columns(&file, &names).unwrap();
    let power = |i: usize| c[1][i] * c[3][i] + c[2][i] * c[4][i];
    let work: f64 = (1..c[0].len())
        .map(|i| 0.5 * (c[0][i] - c[0][i - 1]) * (power(i) + power(i - 1)))
        .sum();
    let rise = potential(plant.robot(), &b) - potential(plant.robot(), &a);
    assert!((work - rise).abs() < 1e-5 * rise.abs(), "{work} {rise}");
}

#[test]
fn the_rehearsal_balances_power_and_counts_bytes() {
    let mut robot = Robot::load("panda").unwrap();
    robot
        .joints
        .iter_mut()
        .for_each(|j| j.terms = [0.05, 0.0, 0.0, 0.0]);
    robot.joints[3].continuous_torque = Some(10.0);
    robot.joints[3].continuous_power = Some(5.0);
    let plant = Plant::from(&robot);
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let fourier = motion(&robot, &limits(&plant), 0.9, &mut rng);
    let mut trajectory = Trajectory::new(&robot, fourier);
    trajectory.periods = 2;
    let table = rehearse(&plant, &trajectory, 250.0, &Rehearsal::SPEEDS).unwrap();
    assert_eq!(table.speeds.len(), 3);
    for (s, share) in table.speeds.iter().zip(Rehearsal::SPEEDS) {
        let through: f64 = s.joints.iter().map(|l| l.mean_power).sum::<f64>() * s.seconds / 2.0;
        assert!(s.work.abs() < 1e-10 * through, "{} of {through}", s.work);
        assert!((s.seconds - trajectory.duration() / share).abs() < 1e-9);
        // what is counted is what is written
        let slow = Fourier {
            period: trajectory.fourier.period / share,
            ..trajectory.fourier.clone()
        };
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("slow.csv");
        let times = samples::times(2.0 * slow.period, 250.0).unwrap();
        let at = |t: f64, out: [&mut [f64]; 3]| slow.evaluate(t, out);
        samples::write_along(&file, false, slow.dof(), &times, &at, None).unwrap();
        assert_eq!(times.len(), s.samples);
        assert_eq!(std::fs::metadata(&file).unwrap().len(), s.bytes as u64);
        for (l, joint) in s.joints.iter().zip(&robot.joints) {
            assert!(l.rms_torque <= l.torque && l.mean_power <= l.peak_power);
            assert!((l.torque_used.unwrap() - l.torque / joint.limits.effort).abs() < 1e-12);
        }
        let rated = &s.joints[3];
        assert!((rated.rms_used.unwrap() - rated.rms_torque / 10.0).abs() < 1e-12);
        assert!((rated.mean_power_used.unwrap() - rated.mean_power / 5.0).abs() < 1e-12);
        assert!(s.joints[0].rms_used.is_none());
    }
    let [slow, _, fast] = &table.speeds[..] else {
        panic!()
    };
    for (a, b) in slow.joints.iter().zip(&fast.joints) {
        assert!((10.0 * a.velocity - b.velocity).abs() < 1e-12);
        assert!((100.0 * a.acceleration - b.acceleration).abs() < 1e-10);
    }
    // friction takes F_v ∫ q̇² dt
    let k = JointTerm::Viscous as usize;
    robot.joints.iter_mut().for_each(|j| j.terms[k] = 2.0);
    let viscous = rehearse(&Plant::from(&robot), &trajectory, 250.0, &[0.3]).unwrap();
    let f = &trajectory.fourier;
    let omega = std::f64::consts::TAU * 0.3 / f.period;
    let taken: f64 = (f.joints.iter())
        .flat_map(|s| s.sin.iter().zip(&s.cos).zip(&f.harmonics))
        .map(|((s, c), &h)| (s * s + c * c) * (f64::from(h) * omega).powi(2))
        .sum::<f64>()
        * (f.period / 0.3);
    let work = viscous.speeds[0].work;
    assert!((work - taken).abs() < 1e-9 * taken, "{work} {taken}");
    assert!(
        rehearse(&plant, &trajectory, 250.0, &[0.0])
            .unwrap_err()
            .is_argument()
    );
}

#[test]
fn continuous_ratings_are_read_and_written() {
    let b = excite::robot::bundled::list()
        .iter()
        .find(|b| b.name == "planar2")
        .unwrap();
    let with = |line: &str| b.toml.replacen("gear_ratio = 50.0", line, 1);
    let text = with("continuous_torque = 12.5\ncontinuous_power = 80.0");
    let robot = Robot::from_toml_str(&text, b.urdf, "planar2").unwrap();
    let ratings = |r: &Robot| -> Vec<[Option<f64>; 2]> {
        let joints = r.joints.iter();
        joints
            .map(|j| [j.continuous_torque, j.continuous_power])
            .collect()
    };
    assert_eq!(ratings(&robot), [[Some(12.5), Some(80.0)], [None, None]]);
    let again = robot.to_toml_template("planar2.urdf");
    let again = Robot::from_toml_str(&again, b.urdf, "planar2").unwrap();
    assert_eq!(ratings(&again), ratings(&robot));
    for line in ["continuous_torque = -1.0", "continuous_power = inf"] {
        let error = Robot::from_toml_str(&with(line), b.urdf, "planar2").unwrap_err();
        let key = line.split(' ').next().unwrap();
        assert!(error.to_string().contains(key), "{error}");
    }
}
