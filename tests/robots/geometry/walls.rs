//! Frames kept in a box, and obstacles that leave no room.

use super::*;

#[test]
fn a_frame_is_kept_in_a_box_without_margin() {
    let more = "[[keep_in]]\nframe = \"lower\"\nlow = [-1.0, -inf, 0.1]\nhigh = [0.3, inf, inf]\n";
    let scene = scene_of(&stated(&plain(), more));
    let kept = scene.pairs.iter().filter(|p| p.margin == 0.0);
    let mut names: Vec<_> = kept.map(|p| scene.names(p).join(", ")).collect();
    names.sort();
    assert_eq!(
        names,
        [
            // x never leaves its low side, and is looked at all the same
            "origin of lower, keep_in high x",
            "origin of lower, keep_in low x",
            "origin of lower, keep_in low z",
        ]
    );
    for q in &scene.free {
        // the elbow from the shoulder
        assert!(0.4 * q[0].cos() <= 0.3 && 0.4 + 0.4 * q[0].sin() >= 0.1);
    }
    assert!(!scene.free.is_empty());
}

#[track_caller]
fn no_room(more: &str, names: &[&str]) {
    let robot = stated(&plain(), more);
    let found = Plant::from(robot).scene().map(|s| s.map(|s| s.free.len()));
    match found {
        Err(Error::Infeasible(message)) => {
            for name in names {
                assert!(message.contains(name), "no {name} in: {message}");
            }
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn two_walls_without_room_between_them_are_an_error() {
    let wall = |name: &str, x: f64| {
        format!(
            "[[obstacle]]\nname = \"{name}\"\nkind = \"plane\"\nnormal = [{x:?}, 0, 0]\noffset = 0.1\n"
        )
    };
    let more = wall("behind", 1.0) + &wall("ahead", -1.0);
    no_room(&more, &["lower", "behind", "ahead"]);
}

#[test]
fn an_obstacle_around_everything_is_an_error() {
    let more = "[[obstacle]]\nname = \"crate\"\nkind = \"box\"\nsize = [10, 10, 10]\n";
    no_room(more, &["upper", "lower", "crate"]);
}
