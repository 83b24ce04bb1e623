//! Legs whose joints are not where the robot file says.

use super::*;

/// The bundled hexapod with joints of the base moved at random, by so much each.
fn hexapod(off: f64, seed: u64) -> Plant {
    let mut r = ChaCha8Rng::seed_from_u64(seed);
    let mut text = include_str!("../../../src/mechanism/bundled/hexapod.toml").to_string();
    let near = [-0.2085, 0.2085];
    for k in 0..6 {
        let angle = near[k % 2] + (k / 2) as f64 * std::f64::consts::TAU / 3.0;
        let [x, y, z] =
            [0.6 * angle.cos(), 0.6 * angle.sin(), 0.0].map(|v| v + off * normal(&mut r));
        text += &format!("[[leg]]\nbase = [{x}, {y}, {z}]\n");
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("robot.toml");
    std::fs::write(&file, text).unwrap();
    Plant::load(file.to_str().unwrap()).unwrap()
}

/// What is found with the bundled file from the logs of a machine.
fn found(machine: &Plant, seed: u64) -> Identified {
    let nominal = Plant::load("hexapod").unwrap();
    let (rate, count) = (50.0, 1000);
    let load = Some(Inertia::from_quantities(&LOAD));
    let record = |load: Option<Inertia>, seed: u64| {
        let truth = Truth {
            load,
            noise: 2.0,
            ..Truth::default()
        };
        let x = multisine(machine, count, rate, &[6.0, 16.0, 26.0], seed);
        let tau = torque(machine, &x, &truth, seed + 1000);
        // what the file makes of the lengths that the machine reads
        let read = machine.actuator_motion(&x).unwrap();
        let seen = nominal.coordinate_motion(&read, None).unwrap();
        let (name, payload) = match load {
            Some(_) => ("loaded", Payload::Unknown),
            None => ("empty", Payload::None),
        };
        loaded(prepared(name, &seen, tau, rate), payload)
    };
    let records = vec![record(None, seed), record(load, seed + 500)];
    from_records(&nominal, records, &Settings::default()).unwrap()
}

#[test]
fn joints_that_are_off_are_seen_and_counted() {
    let (mut inside, mut all) = (0, 0);
    for seed in 0..4 {
        let found = found(&hexapod(1e-3, seed), 10 * seed);
        let off = found.one_step.geometry.expect("the forces show it");
        // the lengths are right, and joints of the platform
        assert!((3e-4..2e-3).contains(&off), "{off}");
        let kind = excite::WarningKind::GeometrySuspect;
        assert!(found.warnings.iter().any(|w| w.kind == kind));
        for off in in_stds(found.load()) {
            all += 1;
            inside += usize::from(off.abs() < 1.96);
        }
    }
    println!("{inside} of {all} inside of 95 %");
    assert!(inside >= 34, "{inside} of {all}");
}

#[test]
fn joints_that_are_right_are_not_suspected() {
    for seed in 0..4 {
        let found = found(&hexapod(0.0, seed), 10 * seed);
        assert_eq!(found.one_step.geometry, None);
    }
}
