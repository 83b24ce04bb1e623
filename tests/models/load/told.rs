//! What a load cannot be, and what few axes or constant forces leave open.

use super::*;

#[test]
fn a_load_that_cannot_exist_is_moved_to_one_that_can() {
    // a thin rod whose estimate is drowned in noise
    let thin = [1.5, 0.0, 0.0, 0.02, 1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-6];
    let truth = Truth {
        load: Some(Inertia::from_quantities(&thin)),
        noise: 4.0,
        ..Truth::default()
    };
    let free = Settings::default().with(|set| set.consistent = false);
    let mut moved = 0;
    for seed in 0..6 {
        let raw = hexapod(&truth, 100.0, 300, seed, &free);
        let found = hexapod(&truth, 100.0, 300, seed, &Settings::default());
        let body = &found.one_step.load;
        assert!(body.inertia.realizability().0 > -1e-5, "{:?}", body.inertia);
        if body.projected {
            moved += 1;
            assert!(!raw.one_step.load.consistent && !raw.one_step.load.projected);
            assert!((body.inertia.mass() - raw.one_step.load.inertia.mass()).abs() < 0.5);
        }
    }
    assert!(moved >= 2, "{moved}");
}

#[test]
fn robots_with_few_axes_say_what_they_cannot_tell() {
    let plant = Plant::load("planar2").unwrap();
    let x = multisine(&plant, 400, 100.0, &[1.0, 2.0, 3.0], 1);
    let truth = Truth {
        load: Some(Inertia::from_quantities(&[
            1.0, 0.05, 0.02, 0.0, 0.01, 0.0, 0.0, 0.01, 0.0, 0.01,
        ])),
        ..Truth::default()
    };
    let records = vec![loaded(
        prepared("loaded", &x, torque(&plant, &x, &truth, 1), 100.0),
        Payload::Unknown,
    )];
    let found = from_records(&plant, records, &Settings::default()).unwrap();
    assert!(!found.one_step.unknown.is_empty());
    assert!(
        found
            .warnings
            .iter()
            .any(|w| w.message.contains("cannot tell"))
    );
    let page = excite::load::page::html(&found);
    assert!(page.contains("not identifiable"));
}

#[test]
fn what_cannot_be_is_refused_in_words() {
    let plant = Plant::load("hexapod").unwrap();
    let x = multisine(&plant, 100, 100.0, &[2.0, 3.0], 1);
    let tau = torque(&plant, &x, &Truth::default(), 1);
    let none = vec![loaded(prepared("a", &x, tau, 100.0), Payload::None)];
    let e = from_records(&plant, none, &Settings::default()).unwrap_err();
    assert!(e.to_string().contains("payload = \"unknown\""), "{e}");
    let mut silent = prepared("b", &x, Vec::new(), 100.0);
    silent.actuators = 6;
    let e = from_records(
        &plant,
        vec![loaded(silent, Payload::Unknown)],
        &Settings::default(),
    )
    .unwrap_err();
    assert!(e.to_string().contains("pressures"), "{e}");
}

/// Chamber pressures instead of forces: areas from the robot file, absolute pressures.
#[test]
fn pressures_give_forces() {
    let mut text = excite::mechanism::bundled::find("hexapod")
        .unwrap()
        .toml
        .to_string();
    text = text.replace(
        "[actuator]\n",
        "[actuator]\npiston = [1.963e-3, 1.649e-3]\n",
    );
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("hexapod.toml");
    std::fs::write(&path, text).unwrap();
    let plant = Plant::load(&path.to_string_lossy()).unwrap();
    assert_eq!(plant.actuators()[3].piston, Some([1.963e-3, 1.649e-3]));
    let mut csv = String::from("t,q1,q2,q3,q4,q5,q6");
    for j in 1..=6 {
        csv.push_str(&format!(",pa{j},pb{j}"));
    }
    csv.push('\n');
    let x = multisine(&plant, 200, 100.0, &[2.0, 3.0], 1);
    let q = plant.actuator_motion(&x).unwrap().q;
    for i in 0..200 {
        csv.push_str(&format!("{}", i as f64 / 100.0));
        for a in 0..6 {
            csv.push_str(&format!(",{}", q[a * 200 + i]));
        }
        for a in 0..6 {
            csv.push_str(&format!(
                ",{},{}",
                4e5 + 1e3 * (a + i % 7) as f64,
                3e5 - 500.0 * (i % 5) as f64
            ));
        }
        csv.push('\n');
    }
    let log = dir.path().join("log.csv");
    std::fs::write(&log, csv).unwrap();
    let record = excite::log::Record::read(&log, &plant, Purpose::Fit, None).unwrap();
    let forces = record.with_forces(&plant, 101_325.0).unwrap().unwrap();
    let wanted = (4e5 + 2e3 + 1e3) * 1.963e-3 - (3e5 - 500.0) * 1.649e-3 - 101_325.0 * 0.314e-3;
    assert!(
        (forces.tau[2][1] - wanted).abs() < 1e-9,
        "{} {wanted}",
        forces.tau[2][1]
    );
    let bare = Plant::load("hexapod").unwrap();
    let e = record.with_forces(&bare, 101_325.0).unwrap_err();
    assert!(e.to_string().contains("piston ="), "{e}");
}

/// One sine about every axis and nothing else, as in the paper, empty and loaded.
fn rocking(seed: u64, zero: [f64; 6]) -> Identified {
    let plant = Plant::load("hexapod").unwrap();
    let (rate, count) = (50.0, 500);
    let mut x = Samples::zeros(6, count);
    for j in 0..6 {
        x.q[j * count..(j + 1) * count].fill(plant.home().unwrap()[j]);
        if j < 3 {
            continue;
        }
        let w = std::f64::consts::TAU * (0.1 + 0.1 * j as f64);
        for i in 0..count {
            let angle = w * i as f64 / rate + 1.3 * j as f64 + seed as f64;
            x.q[j * count + i] = 0.2 * angle.sin();
            x.qd[j * count + i] = 0.2 * w * angle.cos();
            x.qdd[j * count + i] = -0.2 * w * w * angle.sin();
        }
    }
    let empty = Truth {
        noise: 0.3,
        ..Truth::default()
    };
    let truth = Truth {
        load: Some(Inertia::from_quantities(&LOAD)),
        zero,
        noise: 0.3,
        ..Truth::default()
    };
    let records = vec![
        loaded(
            prepared("empty", &x, torque(&plant, &x, &empty, seed + 1000), rate),
            Payload::None,
        ),
        loaded(
            prepared("loaded", &x, torque(&plant, &x, &truth, seed + 2000), rate),
            Payload::Unknown,
        ),
    ];
    from_records(&plant, records, &Settings::default()).unwrap()
}

/// Kinds of the decisions about the constant forces.
fn kinds(found: &Identified) -> Vec<String> {
    let json = excite::load::json::json(found);
    let all = json["zeros"].as_array().unwrap();
    all.iter()
        .map(|z| z["kind"].as_str().unwrap().to_string())
        .collect()
}

#[test]
fn constant_forces_are_shared_where_the_records_allow_it() {
    let (mut inside, mut all, mut shared) = (0, 0, 0);
    let mut cover = |found: &Identified| {
        let (v, s) = (found.load().values(), found.load().stds());
        for k in 0..10 {
            all += 1;
            inside += usize::from((v[k] - LOAD[k]).abs() < 1.96 * s[k]);
        }
    };
    for seed in 0..3 {
        // zeros that stay: shared, and the mass is as good as that
        let found = rocking(seed, [0.0; 6]);
        shared += usize::from(kinds(&found).iter().all(|k| k == "shared"));
        let e = errors(&found.load().values(), &LOAD);
        println!(
            "shared: mass {:.3} %, centre {:.2} mm",
            e[0],
            largest(&e[1..4])
        );
        assert!(e[0].abs() < 0.1, "{e:?}");
        assert!(found.load().stds()[0] < 0.02);
        cover(&found);
        // zeros that move: drifting, and the interval tells what it costs
        let mut r = ChaCha8Rng::seed_from_u64(seed);
        let found = rocking(seed, std::array::from_fn(|_| normal(&mut r)));
        assert!(kinds(&found).iter().all(|k| k == "drifting"), "{seed}");
        assert!(found.load().stds()[0] > 0.03);
        cover(&found);
        // one that moves alone
        let found = rocking(seed, [0.0, 0.0, 8.0, 0.0, 0.0, 0.0]);
        let kinds = kinds(&found);
        assert_eq!(kinds[2], "free", "{seed}: {kinds:?}");
        assert!(kinds.iter().filter(|k| *k == "free").count() == 1);
        cover(&found);
    }
    let coverage = inside as f64 / all as f64;
    println!("coverage of 95 %: {coverage:.3}; shared {shared} of 3");
    // chance may show a drift that is not there; it is then a small one
    assert!(shared >= 2, "{shared}");
    assert!((0.9..1.0).contains(&coverage), "{coverage}");
}
