//! Logs that are written and read back.

use super::*;

#[test]
fn a_log_is_read_back() {
    let plant = Plant::load("hexapod").unwrap();
    let fourier = motion(&plant, 2.0, 0.4, 2);
    let run = simulate(&plant, &fourier, 2, &quick(), &|_| {}).unwrap();
    let (sensors, _) = Sensors::new(&plant, 1.0);
    let measured = measure(&run, &sensors, &Effects::default(), 1);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("log.csv");
    let columns = Columns {
        derivatives: true,
        pose: true,
        ..Columns::default()
    };
    write_log(&path, false, &plant, &run, &measured, columns).unwrap();
    assert!(write_log(&path, false, &plant, &run, &measured, columns).is_err());
    let record =
        excite::log::Record::read(&path, &plant, excite::log::parts::Purpose::Fit, Some(2.0))
            .unwrap();
    assert_eq!(record.len(), run.t.len());
    assert!(record.pose.is_some() && record.qref.is_some() && record.ddq.is_some());
    let n = run.t.len();
    for a in 0..6 {
        for k in 0..n {
            assert!((record.q[a][k] - measured.q[a * n + k]).abs() < 1e-12);
            assert!((record.tau[a][k] - measured.tau[a * n + k]).abs() < 1e-9);
        }
    }
}

fn excite(args: &[&str]) -> (i32, String, String) {
    let out = Command::new(env!("CARGO_BIN_EXE_excite"))
        .args(args)
        .output()
        .unwrap();
    (
        out.status.code().unwrap(),
        String::from_utf8_lossy(&out.stdout).into_owned(),
        String::from_utf8_lossy(&out.stderr).into_owned(),
    )
}

#[test]
fn the_command_writes_a_log_and_an_experiment_and_refuses_nonsense() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).to_string_lossy().into_owned();
    let plant = Plant::load("planar2").unwrap();
    let mut trajectory = Trajectory::new(plant.robot(), motion(&plant, 2.0, 0.5, 3));
    trajectory.periods = 2;
    trajectory.write(at("t.json"), false).unwrap();
    let (t, log, toml) = (at("t.json"), at("log.csv"), at("experiment.toml"));
    let base = ["simulate", "planar2", &t, "--rate", "200", "--output", &log];
    let with = |more: &[&str]| excite(&[&base[..], more].concat());
    let (code, out, err) = with(&["--experiment", &toml]);
    assert_eq!(code, 0, "{err}");
    assert!(
        out.contains("800 samples") && out.contains("tracking error"),
        "{out}"
    );
    let experiment = excite::log::Experiment::read(&toml).unwrap();
    assert_eq!(experiment.records[0].len(), 800);
    assert_eq!(experiment.records[0].period, Some(2.0));
    let (code, _, err) = with(&[]);
    assert!(code == 1 && err.contains("--force"), "{err}");
    for (more, wanted) in [
        (&["--stribeck-friction", "no=1,0.1"][..], "no actuator `no`"),
        (&["--stribeck-friction", "1"], "EXTRA,VELOCITY"),
        (&["--payload", "-1,0,0,0"], "mass > 0"),
        (&["--payload", "1,2"], "numbers"),
        (&["--rate", "0"], "positive"),
        (&["--perturb", "2"], "fraction"),
        (&["--pose"], "no platform"),
        (&["--gravity-direction", "1"], "RX,RY"),
        (&["--lead-in", "4000000000"], "too many steps"),
        (&["--step", "1e-300"], "too many steps"),
        (&["--rate", "1e9"], "can be simulated"),
        (&["--monte-carlo", "1"], "from 2 to"),
    ] {
        let other = at("other.csv");
        let args = [&["simulate", "planar2", &t, "--output", &other], more].concat();
        let (code, _, err) = excite(&args);
        assert!(code == 2 && err.contains(wanted), "{more:?}: {code} {err}");
        let _ = std::fs::remove_file(&other);
    }
    let (code, _, err) = excite(&["simulate", "panda", &t, "--output", &at("p.csv")]);
    assert!(code == 1 && err.contains("planar2"), "{err}");
    let (code, out, err) = excite(&[
        "simulate",
        "planar2",
        &t,
        "--rate",
        "200",
        "--output",
        &at("m.csv"),
        "--monte-carlo",
        "5",
    ]);
    assert!(code == 0 && out.contains("5 rehearsals"), "{out}{err}");
    assert!(dir.path().join("m_monte_carlo.json").exists());
}

#[test]
fn samples_of_another_robot_are_refused() {
    let plant = Plant::load("panda").unwrap();
    let other = Plant::load("planar2").unwrap();
    let fourier = motion(&other, 2.0, 0.5, 3);
    let e = simulate(&plant, &fourier, 1, &quick(), &|_| {}).unwrap_err();
    assert!(e.is_argument() && e.to_string().contains("panda"));
    let _ = Samples::zeros(1, 1);
}

#[test]
fn pressures_are_the_forces() {
    let dir = tempfile::tempdir().unwrap();
    let text = include_str!("../../../src/mechanism/bundled/hexapod.toml");
    let piston = "[actuator]\npiston = [1.9635e-3, 1.6493e-3]";
    let robot = dir.path().join("robot.toml");
    std::fs::write(&robot, text.replace("[actuator]", piston)).unwrap();
    let plant = Plant::load(robot.to_str().unwrap()).unwrap();
    let fourier = motion(&plant, 2.0, 0.4, 2);
    let run = simulate(&plant, &fourier, 1, &quick(), &|_| {}).unwrap();
    let (sensors, _) = Sensors::new(&plant, 1.0);
    let measured = measure(&run, &sensors, &Effects::default(), 1);
    let path = dir.path().join("log.csv");
    let columns = Columns {
        pressures: Some(4e5),
        ..Columns::default()
    };
    write_log(&path, false, &plant, &run, &measured, columns).unwrap();
    let record =
        excite::log::Record::read(&path, &plant, excite::log::parts::Purpose::Fit, None).unwrap();
    assert!(record.tau.is_empty() && record.pressures.is_some());
    let forces = record.with_forces(&plant, 101_325.0).unwrap().unwrap();
    let flat: Vec<f64> = forces.tau.concat();
    assert_eq!(flat.len(), measured.tau.len());
    for (a, b) in flat.iter().zip(&measured.tau) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
    // a mean that is too low, and a robot without pistons
    let low = Columns {
        pressures: Some(1e3),
        ..columns
    };
    assert!(write_log(&path, true, &plant, &run, &measured, low).is_err());
    let bare = Plant::load("hexapod").unwrap();
    assert!(write_log(&path, true, &bare, &run, &measured, columns).is_err());
}
