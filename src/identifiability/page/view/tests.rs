use super::*;
use crate::collision::scene::{Pair, Partner};
use crate::identifiability::assess;
use crate::trajectory::{Fourier, Series, Trajectory, sample_period};

/// A sphere at the end of the arm, a floor, and a box in its way.
fn scene(plant: &Plant) -> Scene {
    let last = plant.robot().bodies.len() - 1;
    let ball = |x: f64| Shape::Sphere {
        centre: Vector3::new(x, 0.0, 0.0),
        radius: 0.05,
    };
    let crate_ = Shape::Box {
        pose: Pose {
            rotation: Rotation3::from_euler_angles(0.0, 0.0, 0.3).into_inner(),
            position: Vector3::new(5.0, 0.0, 0.0),
        },
        half: Vector3::new(0.1, 0.2, 0.3),
    };
    let volume = |link: &str, body: Option<usize>, shape: Shape| scene::Volume {
        link: link.into(),
        body,
        shape,
    };
    let volumes = vec![
        volume("base", None, ball(0.0)),
        volume("hand", Some(last), ball(0.1)),
    ];
    let obstacles = vec![
        scene::Obstacle::Plane {
            name: "floor".into(),
            normal: Vector3::z(),
            offset: -3.0,
        },
        scene::Obstacle::Solid {
            name: "crate".into(),
            shape: crate_,
        },
    ];
    let partners = [
        Partner::Volume(0),
        Partner::Obstacle(0),
        Partner::Obstacle(1),
    ];
    let pairs = partners.map(|partner| Pair {
        volume: 1,
        partner,
        margin: 0.0,
    });
    Scene {
        volumes,
        obstacles,
        pairs: pairs.to_vec(),
        ..Scene::default()
    }
}

fn swing(n: usize) -> Fourier {
    let one = Series {
        constant: 0.2,
        sin: vec![0.3],
        cos: vec![0.1],
    };
    Fourier::new(4.0, vec![1], vec![one; n]).expect("a series")
}

#[test]
fn volumes_obstacles_and_the_nearest_pair_are_those_of_the_scene() {
    let plant = Plant::load("planar2").expect("bundled");
    let scene = scene(&plant);
    let fourier = swing(2);
    let motion = sample_period(&fourier);
    let view = fill(&plant, 4.0, &motion, &motion, &[], Some(&scene)).expect("a view");
    assert_eq!(view.times.len(), 81);
    assert_eq!((view.times[0], view.times[80]), (0.0, 4.0));
    assert_eq!((view.volumes[0].body, view.volumes[1].body), (-1, 1));
    assert_eq!((view.volumes.len(), view.obstacles.len()), (2, 2));
    assert_eq!(
        (view.frames.len(), view.used.len(), view.path.len()),
        (81, 81, 81)
    );
    assert_eq!(view.nearest.len(), 81);
    let mut at = Vec::new();
    for (s, n) in view.nearest.iter().enumerate() {
        let mut q = [0.0; 2];
        fourier.evaluate(view.times[s], [&mut q]);
        scene::poses(plant.robot(), &q, &mut at);
        let pair = &scene.pairs[n.pair];
        assert!((scene.separation(pair, &at).distance - n.distance).abs() < 1e-9);
        for other in &scene.pairs {
            assert!(scene.separation(other, &at).distance >= n.distance - 1e-9);
        }
        // the points are that far apart, and the frame is where the body is
        let [a, b] = n.points.map(Vector3::from);
        assert!(((a - b).norm() - n.distance.abs()).abs() < 1e-9);
        let frame = &view.frames[s][1];
        assert!((Vector3::from(frame.position) - at[1].position).norm() < 1e-12);
        let [w, i, j, k] = frame.turn;
        let back = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, i, j, k));
        let difference = back.to_rotation_matrix().into_inner() - at[1].rotation;
        assert!(difference.norm() < 1e-12);
    }
    assert_eq!(
        view.pairs[view.nearest[0].pair],
        ["hand", "base"].map(String::from)
    );
    let page = section(&view).expect("a section").body.into_string();
    assert!(page.contains("\"crate\"") && page.contains("nearest pair"));
}

#[test]
fn quaternions_keep_their_sign_and_uses_their_largest() {
    let plant = Plant::load("panda").expect("bundled");
    let trajectory = Trajectory::new(plant.robot(), swing(7));
    let a = assess(&plant, Some(&trajectory)).expect("an assessment");
    let e = a.excitation.expect("a trajectory");
    let view = e.view.expect("a view");
    for pair in view.frames.windows(2) {
        for (x, y) in pair[0].iter().zip(&pair[1]) {
            let dot: f64 = x.turn.iter().zip(&y.turn).map(|(a, b)| a * b).sum();
            assert!(dot > 0.9, "{dot}");
        }
    }
    // what is shown never exceeds what the certificate knows, and nearly reaches it
    let worst = e.certificate.worst.expect("there are limits").used;
    let most = view
        .used
        .iter()
        .flatten()
        .map(|u| u.most)
        .fold(0.0, f64::max);
    assert!(
        most <= worst + 1e-9 && most > 0.8 * worst,
        "{most} of {worst}"
    );
}

#[test]
fn long_motions_and_many_bodies_are_shown_more_coarsely() {
    assert_eq!(samples(1000, 10.0, 50).len(), 201);
    assert_eq!(samples(6000, 60.0, 50).len(), 401);
    assert!(samples(6000, 60.0, 7 * 100).len() < 132);
    for (count, period) in [(20, 0.2), (1, 1e-3), (5000, 1e4), (20, 20.0)] {
        let all = samples(count, period, 50);
        assert!(all[0] == 0 && all[all.len() - 1] == count && all.len() <= 402);
    }
}

#[test]
fn legs_are_lit_by_their_actuators() {
    let plant = Plant::load("hexapod").expect("bundled");
    assert_eq!(line("leg3", &plant).joint, 2);
    assert_eq!(
        (line("platform", &plant).joint, line("leg9", &plant).joint),
        (-1, -1)
    );
    let bodies = &plant.robot().bodies;
    let platform = bodies
        .iter()
        .position(|b| b.name == "platform")
        .expect("a platform");
    assert_eq!(lit(&plant, platform), -1);
    let actuated = plant.actuated()[3];
    let rod = bodies
        .iter()
        .position(|b| b.coordinate == actuated)
        .expect("a body");
    assert_eq!(lit(&plant, rod), 3);
    // the passive joints between the base and it
    assert_eq!(lit(&plant, bodies[rod].parent.expect("a parent")), 3);
}

#[test]
fn the_rods_of_a_parallelogram_are_joined() {
    let plant = Plant::load("delta").expect("bundled");
    let home = plant.home().expect("a home");
    let plain = plant.mechanism().expect("closed").geometry().segments(home);
    let all = with_bars(plain.clone());
    assert_eq!(all.len(), plain.len() + 6);
    for bar in &all[plain.len()..] {
        assert!(bar.name.starts_with("rod") && bar.name.len() == 4);
        let touches = |end: &Vector3<f64>| plain.iter().any(|s| s.ends.contains(end));
        assert!(bar.ends.iter().all(touches));
    }
}
