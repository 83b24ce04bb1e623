//! Meshes: found, scaled, enclosed, or told.

use super::*;

#[track_caller]
fn holds_wedge(robot: &Robot, corners: &[V], scale: V) {
    assert!(
        robot.geometry.volumes().warnings.is_empty(),
        "{:?}",
        robot.geometry.volumes().warnings
    );
    holds(robot, corners, scale);
}

#[track_caller]
fn holds(robot: &Robot, corners: &[V], scale: V) {
    for c in corners {
        let p = c.component_mul(&scale) + V::new(0.0, 0.02, 0.0);
        let d = inside(robot, "upper", &p);
        assert!((-0.2..=1e-9).contains(&d), "{c}: {d}");
    }
}

#[test]
fn meshes_are_found_and_enclosed() {
    let (text, corners) = wedge(0.1);
    let one = V::repeat(1.0);
    let package = "package://arm_description/meshes/part.obj";
    for (named, lies) in [
        ("part.obj", "part.obj"),
        ("meshes/part.obj", "meshes/part.obj"),
        (package, "arm_description/meshes/part.obj"),
        (package, "meshes/part.obj"),
    ] {
        let urdf = arm(BASE, &mesh(named, ""), LOWER, "");
        let dir = folder(&[("arm.urdf", &urdf), (lies, &text)]);
        holds_wedge(load(&dir, "arm.urdf").robot(), &corners, one);
    }
    let urdf = arm(BASE, &mesh(package, ""), LOWER, "");
    let lies = "elsewhere/arm_description/meshes/part.obj";
    let file = toml("[collision]\nmeshes = [\"elsewhere\"]\n");
    let dir = folder(&[
        ("arm.urdf", &urdf),
        ("robot.toml", &file),
        (lies, text.as_str()),
    ]);
    holds_wedge(load(&dir, "robot.toml").robot(), &corners, one);
    // the same file without the statement, and with the folder given to the plant
    let plant = load(&dir, "arm.urdf");
    assert_eq!(plant.scene().unwrap().unwrap().unseen, ["upper"]);
    let plant = plant.with_meshes(&[dir.path().join("elsewhere")]);
    holds_wedge(plant.robot(), &corners, one);
    assert!(plant.scene().unwrap().unwrap().unseen.is_empty());
}

#[test]
fn meshes_are_scaled_as_the_urdf_says() {
    let (text, corners) = wedge(100.0);
    let urdf = arm(
        BASE,
        &mesh("part.obj", " scale=\"0.001 0.002 -0.001\""),
        LOWER,
        "",
    );
    let dir = folder(&[("arm.urdf", &urdf), ("part.obj", &text)]);
    holds_wedge(
        load(&dir, "arm.urdf").robot(),
        &corners,
        V::new(0.001, 0.002, -0.001),
    );
}

#[test]
fn meshes_that_cannot_be_read_are_told_and_the_robot_is_used_all_the_same() {
    for (name, content, word) in [
        ("part.stl", None, "not found"),
        ("part.stl", Some(""), "no triangle"),
        ("part.obj", Some(""), "no triangle"),
        ("part.stl", Some("this is no mesh\nat all"), "no triangle"),
        ("part.obj", Some("f a b c\n"), "line 1"),
        ("part.obj", Some("v 0 zero 0\n"), "line 1"),
        (
            "part.obj",
            Some("v 0 0 NaN\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
            "not finite",
        ),
        ("part.dae", Some("<COLLADA/>"), "visual_scene"),
        ("part.ply", Some("ply"), ".ply"),
    ] {
        let urdf = arm(BASE, &mesh(name, ""), LOWER, "");
        let dir = folder(&[("arm.urdf", &urdf)]);
        if let Some(content) = content {
            put(dir.path(), name, content);
        }
        let plant = load(&dir, "arm.urdf");
        let scene = plant.scene().unwrap().expect("the other links");
        warned(
            &scene.warnings,
            WarningKind::GeometryUnread,
            &["link `upper`", word],
        );
        warned(
            &scene.warnings,
            WarningKind::CollisionNotChecked,
            &["upper"],
        );
        assert_eq!(scene.unseen, ["upper"], "{name} {content:?}");
        assert!(plant.base().unwrap().count() > 0);
    }
}

#[test]
fn a_mesh_in_millimetres_is_told_and_scaled() {
    let (text, corners) = wedge(100.0);
    let urdf = arm(BASE, &mesh("part.obj", ""), LOWER, "");
    let dir = folder(&[("arm.urdf", &urdf), ("part.obj", &text)]);
    let plant = load(&dir, "arm.urdf");
    let scene = plant.scene().unwrap().unwrap();
    let words = ["link `upper`", "millimetres", "0.001 0.001 0.001"];
    warned(&scene.warnings, WarningKind::GeometryUnread, &words);
    assert!(scene.unseen.is_empty(), "{:?}", scene.unseen);
    holds(plant.robot(), &corners, V::repeat(0.001));
}
