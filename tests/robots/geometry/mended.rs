//! Robots of which random postures are hardly ever free of contact.

use super::*;

/// A slider with a ball of 10 mm between two walls that stand `gap` apart, above the floor.
fn between_walls(gap: f64) -> Robot {
    let wall = |name: &str, side: f64| {
        format!(
            r#"<link name="{name}"><collision><origin xyz="{} 0 1"/><geometry><box size="0.1 0.2 0.2"/></geometry></collision></link>
<joint name="to_{name}" type="fixed"><parent link="base"/><child link="{name}"/></joint>"#,
            side * (0.5 * gap + 0.05)
        )
    };
    let urdf = format!(
        r#"<robot name="slider"><link name="base"/>{}{}
<link name="ball">{INERTIA}<collision><origin xyz="0 0 1"/><geometry><sphere radius="0.01"/></geometry></collision></link>
<joint name="slide" type="prismatic"><parent link="base"/><child link="ball"/><axis xyz="1 0 0"/><limit lower="-0.05" upper="0.05" velocity="1" effort="100"/></joint>
</robot>"#,
        wall("left", -1.0),
        wall("right", 1.0)
    );
    stated(&urdf, "")
}

/// Every pair of a scene keeps its margin in every posture that is called free.
fn all_free(robot: &Robot, scene: &Scene) {
    let mut at = Vec::new();
    for q in &scene.free {
        excite::collision::scene::poses(robot, q, &mut at);
        for pair in &scene.pairs {
            let room = scene.separation(pair, &at).distance - pair.margin;
            assert!(room >= 0.0, "{:?}: {room} in {q:?}", scene.names(pair));
        }
        for (joint, q) in robot.joints.iter().zip(q) {
            let [low, high] = joint.limits.position;
            assert!((low..=high).contains(q), "{}: {q}", joint.name);
        }
    }
}

fn warned(scene: &Scene) -> Option<&Warning> {
    let mut warnings = scene.warnings.iter();
    warnings.find(|w| w.message.starts_with("no posture keeps everything apart"))
}

/// Each of five postures, all in contact, becomes one that is free: no random posture has to be.
#[test]
fn links_are_moved_apart_where_no_posture_is_free() {
    let robot = stated(&plain(), "");
    let touching = [
        [-1.4, 0.3],
        [-1.2, -0.4],
        [0.4, -1.9],
        [2.9, 1.2],
        [-2.2, 0.6],
    ];
    let touching: Vec<Vec<f64>> = touching.map(|q| q.to_vec()).into();
    let scene = excite::collision::build::scene(&robot, &touching).unwrap();
    let scene = scene.expect("volumes");
    assert!(!scene.free.is_empty());
    all_free(&robot, &scene);
    assert_eq!(warned(&scene), None);
    // those that are not told apart from these five are few: the lower arm and the floor are looked at
    assert!(looked_at(&scene, "lower", "floor"));
}

/// A ball that fits between two walls, but not with the margin to both.
#[test]
fn a_margin_that_cannot_be_kept_is_reduced_and_said() {
    // 15 mm on both sides in the middle, where 20 mm are asked for
    let robot = between_walls(0.05);
    let scene = scene_of(&robot);
    all_free(&robot, &scene);
    assert!(!scene.free.is_empty());
    let warning = warned(&scene).expect("a warning");
    assert_eq!(warning.kind, WarningKind::MarginReduced);
    for wall in ["left", "right"] {
        let pair = scene.pairs.iter().find(|p| scene.names(p).contains(&wall));
        let margin = pair.expect("looked at").margin;
        assert!((0.006..0.0085).contains(&margin), "{wall}: {margin}");
    }
    // with room for all nothing is reduced
    let wide = scene_of(&between_walls(0.1));
    assert!(wide.pairs.iter().all(|p| p.margin == wide.margin));
    assert_eq!(warned(&wide), None);
}

/// A ball that is larger than the gap: nothing can be done, and the message says what is in the way and how to go on.
#[test]
fn what_overlaps_in_every_posture_is_named() {
    let error = Plant::from(&between_walls(0.015)).scene().unwrap_err();
    assert!(matches!(error, Error::Infeasible(_)), "{error:?}");
    let text = error.to_string();
    let parts = [
        "margin of 0.02 m",
        "too near: ",
        "ball and left",
        "`lock`",
        "--no-collision",
    ];
    for part in parts {
        assert!(text.contains(part), "{part} in {text}");
    }
}
