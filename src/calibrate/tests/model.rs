//! Residuals and Jacobians against differences, and how many unknowns are seen.

use super::*;

/// Rows of all kinds of a robot that is not quite the nominal one, so that no residual vanishes.
fn mixed(opened: &Opened, r: &mut ChaCha8Rng) -> (Calibration, Start) {
    let kinds = [Kind::Pose, Kind::Position, Kind::Point, Kind::Gauge];
    let mut rows = Vec::new();
    for q in postures(opened, r, 8) {
        let frame = opened.kin.nominal(&q).unwrap();
        let m = rows.len() % 4;
        let off = Frame {
            r: exp(&random(r, 0.01)),
            p: random(r, 0.002),
        };
        let value = match kinds[m] {
            Kind::Pose => Value::Pose(frame.then(&off)),
            Kind::Position => Value::Position(frame.p + off.p),
            Kind::Gauge => Value::Reading(frame.p.z - 0.1),
            _ => Value::Contact,
        };
        rows.push(row(m, q, value, true));
    }
    let all = kinds.map(|k| measurement(k, k.name(), "all", [1e-3, 1e-3]));
    let mut c = input(all.to_vec(), rows, [0.002, 0.005]);
    c.distances.clear();
    let start = Start {
        socket: vec![Vector3::new(0.1, 0.2, 0.3); 4],
        plane: vec![(Vector3::z(), 0.1); 4],
        ..Start::none(4)
    };
    (c, start)
}

/// Where actuators are used, the whitening follows the unknowns, too, and the Jacobian leaves that out. So the poses of
/// a parallel robot are put where the unknowns have them: residuals vanish, and with them what is left out.
fn check(
    opened: &Opened,
    features: Vec<Feature>,
    torques: Option<&[Vec<f64>]>,
    mut c: Calibration,
    start: Start,
    settings: Settings,
) {
    let poses = nominal(opened, &c);
    let r = &mut ChaCha8Rng::seed_from_u64(7);
    let (x, values) = {
        let model = Model::new(
            &c,
            &opened.kin,
            features.clone(),
            torques,
            start.clone(),
            &poses,
            settings,
        );
        let x: Vec<f64> = model
            .unknowns
            .iter()
            .map(|u| 0.3 * u.scale.min(0.01) * r.random_range(-1.0..1.0))
            .collect();
        let value = |(i, row): (usize, &Row)| match (&row.value, &opened.kin) {
            (Value::Pose(_), Kin::Parallel(_)) => {
                let (m, frame) = (row.measurement, model.posed(i, &x).unwrap().frame);
                Value::Pose(model.camera(m, &x).then(&frame).then(&model.target(m, &x)))
            }
            _ => row.value,
        };
        let values: Vec<Value> = c.rows.iter().enumerate().map(value).collect();
        (x, values)
    };
    for (row, value) in c.rows.iter_mut().zip(values) {
        row.value = value;
    }
    let model = Model::new(&c, &opened.kin, features, torques, start, &poses, settings);
    for i in 0..c.rows.len() {
        let b = model.block(i, &x).unwrap();
        for (k, &column) in b.columns.iter().enumerate() {
            let h = 1e-4 * model.unknowns[column].scale.min(1e-2);
            let at = |d: f64| {
                let mut x = x.clone();
                x[column] += d;
                model.block(i, &x).unwrap().r
            };
            let quotient = (at(h) - at(-h)) / (2.0 * h);
            let size = quotient.norm().max(1.0 / model.unknowns[column].scale);
            let off = (quotient - b.j.column(k)).norm() / size;
            assert!(
                off < 1e-5,
                "row {i}, {}: {off:.1e}",
                model.unknowns[column].name
            );
        }
    }
}

#[test]
fn jacobians_of_a_serial_robot_are_those_of_differences() {
    let r = &mut ChaCha8Rng::seed_from_u64(1);
    for name in ["ur5e", "scara"] {
        let opened = open(name, None).unwrap();
        let (c, start) = mixed(&opened, r);
        let gravity = super::effects::Gravity::of(
            opened.plant.robot().clone(),
            &opened.joints,
            String::new(),
        )
        .unwrap();
        let q: Vec<Vec<f64>> = c.rows.iter().map(|r| r.q.clone()).collect();
        let t = gravity.torques(&q);
        let motions = opened.kin.motions(opened.joints.len());
        let all = [Part::Compliance, Part::Eccentricity, Part::Backlash]
            .into_iter()
            .flat_map(|p| features(p, &opened.joints, &motions, &t))
            .collect();
        check(&opened, all, Some(&t), c, start, Settings::default());
    }
}

#[test]
fn jacobians_of_parallel_robots_are_those_of_differences() {
    let r = &mut ChaCha8Rng::seed_from_u64(2);
    for name in ["h4", "hexapod", "delta"] {
        let opened = open(name, None).unwrap();
        for algorithm in [Algorithm::Inverse, Algorithm::Implicit, Algorithm::Forward] {
            let (c, start) = mixed(&opened, r);
            let settings = Settings {
                algorithm,
                orientation: true,
            };
            check(&opened, Vec::new(), None, c, start, settings);
        }
    }
}

#[test]
fn dimensions_give_the_actuators_of_the_mechanism() {
    let r = &mut ChaCha8Rng::seed_from_u64(3);
    for name in ["h4", "hexapod", "delta"] {
        let opened = open(name, None).unwrap();
        let Kin::Parallel(p) = &opened.kin else {
            panic!("{name} is a parallel robot")
        };
        let zeros = vec![0.0; p.errors()];
        for q in postures(&opened, r, 20) {
            let at = p.nominal(&q).unwrap();
            for implicit in [false, true] {
                let a = p.actuators_at(&at, &q, &zeros, implicit);
                assert!(a.value.amax() < 1e-9, "{name}: {}", a.value);
            }
        }
    }
}

/// Rank and number of unknowns of poses seen by a camera.
fn count(name: &str, rows: usize) -> Identifiability {
    let r = &mut ChaCha8Rng::seed_from_u64(4);
    let opened = open(name, None).unwrap();
    let list: Vec<Row> = postures(&opened, r, rows)
        .into_iter()
        .map(|q| {
            let frame = opened.kin.nominal(&q).unwrap();
            row(0, q, Value::Pose(frame), true)
        })
        .collect();
    let c = input(
        vec![measurement(Kind::Pose, "poses", "poses", [3e-4, 3.5e-4])],
        list,
        [0.002, 0.005],
    );
    let poses = nominal(&opened, &c);
    let start = Start {
        camera: vec![Frame {
            r: exp(&Vector3::new(0.3, -2.0, 0.7)),
            p: Vector3::new(0.3, 0.2, 1.5),
        }],
        target: vec![Frame {
            r: exp(&Vector3::new(0.1, 0.2, 0.7)),
            p: Vector3::new(0.01, 0.02, -0.05),
        }],
        ..Start::none(1)
    };
    let settings = Settings {
        orientation: false,
        ..Settings::default()
    };
    let mut model = Model::new(&c, &opened.kin, Vec::new(), None, start, &poses, settings);
    model.consistent = true;
    let plan = Plan {
        weights: vec![1.0; rows],
        free: vec![true; model.count()],
        robust: false,
    };
    let x = vec![0.0; model.count()];
    identifiable::assess(&model, &plan, &x).unwrap()
}

#[test]
fn counts_are_those_of_the_literature() {
    let h4 = count("h4", 60);
    assert_eq!([h4.rank, h4.total], [36, 62], "{:?}", h4.singular_values);
    assert!(h4.gap > 1e6 && !h4.gauge().is_empty());
    let hexapod = count("hexapod", 60);
    assert_eq!(
        [hexapod.rank, hexapod.total],
        [42, 54],
        "{:?}",
        hexapod.singular_values
    );
    // four for each joint that turns, and six for camera and target together (Mooring, Roth & Driels 1991)
    let ur5e = count("ur5e", 60);
    assert_eq!(
        [ur5e.rank, ur5e.total],
        [4 * 6 + 6, 6 * 6 + 12],
        "{:?}",
        ur5e.singular_values
    );
}
