//! Moves among obstacles.

use super::*;

/// The two links of `planar2` as capsules, among balls in the plane of the arm.
fn among(balls: &[(&str, [f64; 2], f64)]) -> (Plant, Scene) {
    let plant = Plant::load("planar2").unwrap();
    let link = |body: usize| Volume {
        link: format!("link{}", body + 1),
        body: Some(body),
        shape: Shape::Capsule {
            from: Vector3::zeros(),
            to: Vector3::new(0.5, 0.0, 0.0),
            radius: 0.03,
        },
    };
    let ball = |(name, [x, z], radius): &(&str, [f64; 2], f64)| Obstacle::Solid {
        name: (*name).into(),
        shape: Shape::Sphere {
            centre: Vector3::new(*x, 0.0, *z),
            radius: *radius,
        },
    };
    let mut scene = Scene {
        volumes: vec![link(0), link(1)],
        obstacles: balls.iter().map(ball).collect(),
        margin: 0.02,
        ..Scene::default()
    };
    for volume in 0..2 {
        scene.pairs.extend((0..balls.len()).map(|o| Pair {
            volume,
            partner: Partner::Obstacle(o),
            margin: 0.02,
        }));
    }
    (plant, scene)
}

/// Least distance at samples.
fn sampled(plant: &Plant, scene: &Scene, m: &Move) -> f64 {
    let s = m.sample(2000.0).unwrap();
    let (mut q, mut at) = (vec![0.0; 2], Vec::new());
    let mut least = f64::INFINITY;
    for i in 0..s.len() {
        q.iter_mut().zip(&s.q).for_each(|(q, c)| *q = c[i]);
        poses(plant.robot(), &q, &mut at);
        for pair in &scene.pairs {
            least = least.min(scene.separation(pair, &at).distance);
        }
    }
    least
}

#[test]
fn a_way_round_a_ball_is_found_and_proven() {
    let (plant, scene) = among(&[("ball", [0.8, 0.0], 0.1)]);
    let (from, to) = (State::rest(&[-0.6, 0.0]), State::rest(&[0.6, 0.0]));
    let free = Move::plan(&plant, &from, &to, &Settings::default(), None).unwrap();
    assert!(free.via.is_empty() && free.clearance.is_none());
    assert!(sampled(&plant, &scene, &free) < 0.0);
    for scale in [0.2, 1.0] {
        let settings = Settings::default().with(|set| {
            set.scale = scale;
            set.rate = Some(250.0);
        });
        let m = Move::plan(&plant, &from, &to, &settings, Some(&scene)).unwrap();
        let steps = m.duration * 250.0;
        assert!((steps - steps.round()).abs() < 1e-6 && m.slowed == 1.0);
        assert!(
            !m.via.is_empty() && m.via.len() < 6 && m.tries > 0,
            "{:?}",
            m.via
        );
        check(&plant, &limits(&plant), &m, 2000.0);
        let found = m.clearance.as_ref().unwrap();
        let least = sampled(&plant, &scene, &m);
        assert!(found.bound >= 0.02 - 1e-4 && found.bound <= found.met);
        assert!(
            least >= found.bound && least - found.bound < 5e-3,
            "{least} {found:?}"
        );
        assert!(found.between[1] == "ball");
        // the same question has the same answer
        let again = Move::plan(&plant, &from, &to, &settings, Some(&scene)).unwrap();
        assert_eq!(again, m);
        // each speed is used somewhere
        let used = m.joints.iter().map(|j| j.used[0]).fold(0.0, f64::max);
        assert!(used > 0.5 * scale && used <= scale * (1.0 + 1e-9));
    }
}

#[test]
fn what_walls_a_posture_in_is_named() {
    let posts = [
        ("upper post", [0.3, 0.17], 0.08),
        ("lower post", [0.3, -0.17], 0.08),
    ];
    let (plant, scene) = among(&posts);
    let (from, to) = (State::rest(&[0.0, 0.0]), State::rest(&[2.0, 0.5]));
    let settings = Settings::default().with(|set| set.tries = 300);
    let plan = |from: &State, to: &State| Move::plan(&plant, from, to, &settings, Some(&scene));
    let error = plan(&from, &to).unwrap_err();
    assert!(matches!(error, Error::Infeasible(_)));
    let text = error.to_string();
    for part in ["300 random postures", "link1 and upper post", "in the way"] {
        assert!(text.contains(part), "{text}");
    }
    // an end that touches
    let text = plan(&State::rest(&[0.5, 0.0]), &to)
        .unwrap_err()
        .to_string();
    assert!(
        text.contains("start") && text.contains("link1 and upper post"),
        "{text}"
    );
    let text = plan(&from, &State::rest(&[-0.5, 0.0]))
        .unwrap_err()
        .to_string();
    assert!(
        text.contains("target") && text.contains("lower post"),
        "{text}"
    );
}

#[test]
fn into_and_out_of_a_motion_among_walls() {
    let (plant, scene) = among(&[("ball", [0.8, 0.0], 0.1)]);
    // begins above the ball, moving down towards it
    let series = |constant: f64, sin: f64| Series {
        constant,
        sin: vec![sin],
        cos: vec![0.0],
    };
    let f = Fourier::new(4.0, vec![1], vec![series(0.9, -0.3), series(0.0, 0.1)]).unwrap();
    let low = [-0.9, 0.3];
    let there = Move::approach(&plant, &low, &f, &Settings::default(), Some(&scene)).unwrap();
    let back = Move::retreat(&plant, &f, &low, &Settings::default(), Some(&scene)).unwrap();
    for m in [&there, &back] {
        check(&plant, &limits(&plant), m, 2000.0);
        assert!(sampled(&plant, &scene, m) >= m.clearance.as_ref().unwrap().bound);
        assert!(m.via.len() > 1);
    }
    assert!(there.to.qd[0] < -0.4 && back.from.qd[0] < -0.4);
}
