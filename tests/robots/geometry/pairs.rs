//! Pairs that are looked at, and those that are left out.

use super::*;

/// The robot file that is written leaves the same pairs out, wherever it goes.
#[test]
fn a_written_robot_file_knows_its_srdf() {
    let file = toml("[collision]\nsrdf = \"arm.srdf\"\n");
    let dir = folder(&[("arm.urdf", &plain()), ("robot.toml", &file)]);
    let pair = r#"<robot name="arm"><disable_collisions link1="base" link2="lower"/></robot>"#;
    put(dir.path(), "arm.srdf", pair);
    let urdf = dir.path().join("arm.urdf");
    let written = load(&dir, "robot.toml")
        .robot()
        .to_toml_template(&urdf.to_string_lossy());
    let other = folder(&[("again.toml", &written)]);
    let scene = load(&other, "again.toml").scene().unwrap().unwrap();
    assert!(!looked_at(&scene, "base", "lower"));
}

#[test]
fn an_srdf_leaves_pairs_out() {
    let file = toml("[collision]\nsrdf = \"arm.srdf\"\n");
    let with = |pairs: &[[&str; 2]]| {
        let mut text = String::from("<robot name=\"arm\">");
        for [a, b] in pairs {
            text += &format!(r#"<disable_collisions link1="{a}" link2="{b}" reason="Never"/>"#);
        }
        let urdf = plain();
        let dir = folder(&[("arm.urdf", &urdf), ("robot.toml", &file)]);
        put(dir.path(), "arm.srdf", &(text + "</robot>"));
        load(&dir, "robot.toml").scene()
    };
    let scene = with(&[]).unwrap().unwrap();
    assert!(looked_at(&scene, "base", "lower"));
    let scene = with(&[["lower", "base"]]).unwrap().unwrap();
    assert!(!looked_at(&scene, "base", "lower"));
    assert_eq!(
        left_out(&scene, "base", "lower"),
        Some("named by the robot file")
    );

    let scene = with(&[["lower", "base"], ["lower", "gripper"]]).unwrap();
    let scene = scene.unwrap();
    assert!(!looked_at(&scene, "base", "lower"));
    let words = ["`gripper`", "1 of its 2 pairs", "arm.srdf"];
    warned(&scene.warnings, WarningKind::EntryIgnored, &words);

    let message = with(&[["link1", "link2"]]).unwrap_err().to_string();
    assert!(
        message.contains("another robot") && message.contains("`link1`"),
        "{message}"
    );
    let urdf = plain();
    let dir = folder(&[("arm.urdf", &urdf), ("robot.toml", &file)]);
    let message = load(&dir, "robot.toml").scene().unwrap_err().to_string();
    assert!(message.contains("arm.srdf"), "{message}");
    for text in ["<robot", "<sdf/>"] {
        put(dir.path(), "arm.srdf", text);
        let message = load(&dir, "robot.toml").scene().unwrap_err().to_string();
        assert!(message.contains("arm.srdf"), "{message}");
    }
}

#[test]
fn links_that_a_joint_joins_are_left_out() {
    let robot = Robot::from_urdf_str(&plain(), "arm.urdf").unwrap();
    let scene = scene_of(&robot);
    for (a, b) in [("base", "upper"), ("upper", "lower")] {
        assert_eq!(left_out(&scene, a, b), Some("joined by a joint"));
        assert!(!looked_at(&scene, a, b));
    }
    assert!(looked_at(&scene, "base", "lower"));
    assert!(looked_at(&scene, "upper", "floor") && looked_at(&scene, "lower", "floor"));
    assert!(!looked_at(&scene, "base", "floor"));
    // what carries a link without volume stands for it
    let scene = scene_of(&stated(&arm(BASE, "", LOWER, ""), ""));
    assert_eq!(left_out(&scene, "base", "lower"), Some("joined by a joint"));
    assert_eq!(scene.unseen, ["upper"]);
}

#[test]
fn pairs_that_no_posture_keeps_apart_are_left_out() {
    let large = r#"<collision><geometry><sphere radius="0.6"/></geometry></collision>"#;
    let robot = stated(&arm(BASE, UPPER, large, ""), "[collision]\nfloor = false\n");
    let scene = scene_of(&robot);
    assert_eq!(
        left_out(&scene, "base", "lower"),
        Some("nearer than the margin in every posture")
    );
    assert!(!looked_at(&scene, "base", "lower"));
}

#[test]
fn fingers_that_follow_one_joint_are_left_out() {
    let finger = |name: &str, y: &str, mimic: &str| {
        format!(
            r#"<link name="{name}"><collision><geometry><box size="0.1 0.02 0.02"/></geometry></collision></link>
<joint name="{name}_joint" type="prismatic"><parent link="lower"/><child link="{name}"/><origin xyz="0.5 0 0"/><axis xyz="0 {y} 0"/><limit lower="0" upper="0.04" velocity="0.1" effort="10"/>{mimic}</joint>
"#
        )
    };
    let more = finger("left", "1", "") + &finger("right", "-1", r#"<mimic joint="left_joint"/>"#);
    let robot = Robot::from_urdf_str(&arm(BASE, UPPER, LOWER, &more), "arm.urdf").unwrap();
    let scene = scene_of(&robot);
    assert_eq!(
        left_out(&scene, "left", "right"),
        Some("both follow one joint")
    );
    assert!(looked_at(&scene, "left", "upper") && looked_at(&scene, "right", "floor"));
}
