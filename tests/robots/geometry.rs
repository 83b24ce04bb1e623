//! Volumes of links, where they come from, and the pairs of them that are looked at.

mod mended;
mod meshes;
mod pairs;
mod stated;
mod walls;

use excite::collision::scene::{Obstacle, Scene};
use excite::robot::geometry::Origin;
use excite::solid::Shape;
use excite::{Error, Plant, Robot, Warning, WarningKind};
use nalgebra::{Rotation3, Vector3};
use std::path::Path;
use std::sync::Arc;
use tempfile::TempDir;

type V = Vector3<f64>;

const BASE: &str = r#"<collision><origin xyz="0 0 0.15"/><geometry><box size="0.2 0.2 0.3"/></geometry></collision>"#;
const UPPER: &str = r#"<collision><origin xyz="0.2 0 0" rpy="0 1.5707963267948966 0"/><geometry><capsule radius="0.05" length="0.4"/></geometry></collision>"#;
const LOWER: &str = UPPER;
const INERTIA: &str = r#"<inertial><origin xyz="0.2 0 0"/><mass value="2"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial>"#;

/// An arm in the vertical x-z plane, its shoulder 0.4 m above the ground; `more` goes before its end.
fn arm(base: &str, upper: &str, lower: &str, more: &str) -> String {
    format!(
        r#"<robot name="arm">
<link name="base">{base}</link>
<link name="upper">{INERTIA}{upper}</link>
<link name="lower">{INERTIA}{lower}</link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.4"/><axis xyz="0 -1 0"/><limit lower="-3" upper="3" velocity="3" effort="60"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/><axis xyz="0 -1 0"/><limit lower="-2" upper="2" velocity="4" effort="30"/></joint>
{more}</robot>
"#
    )
}

fn plain() -> String {
    arm(BASE, UPPER, LOWER, "")
}

/// The robot file: two lines and more.
fn toml(more: &str) -> String {
    format!("name = \"arm\"\nurdf = \"arm.urdf\"\n{more}")
}

fn stated(urdf: &str, more: &str) -> Robot {
    Robot::from_toml_str(&toml(more), urdf, "robot.toml").unwrap()
}

/// What a robot must not touch, and the warnings about it.
fn scene_of(robot: &Robot) -> Arc<Scene> {
    Plant::from(robot).scene().unwrap().expect("volumes")
}

/// Least signed distance of a point of a link's frame from the volumes of that link.
fn inside(robot: &Robot, link: &str, point: &V) -> f64 {
    let geometry = &robot.geometry;
    let index = geometry.link(link).unwrap();
    let at = geometry.links[index].pose.apply(point);
    let all = geometry.volumes().links.iter().filter(|v| v.link == index);
    all.flat_map(|v| &v.shapes)
        .map(|s| s.signed_distance(&at))
        .fold(f64::INFINITY, f64::min)
}

/// Forms of 0.1 m radius and 0.3 m length, points of their surface, and how far a volume may lie outside.
fn forms() -> Vec<(&'static str, Vec<V>, f64)> {
    let rim = |z: f64| {
        (0..24).map(move |k| {
            let (s, c) = (f64::from(k) * 0.2618).sin_cos();
            V::new(0.1 * c, 0.1 * s, z)
        })
    };
    let signs = [-1.0, 1.0];
    let corners = signs.into_iter().flat_map(|x| {
        signs.into_iter().flat_map(move |y| {
            let size = move |z: f64| V::new(0.05 * x, 0.1 * y, 0.15 * z);
            signs.map(size)
        })
    });
    let tips = [V::z() * 0.25, V::z() * -0.25];
    vec![
        (r#"<sphere radius="0.1"/>"#, rim(0.0).collect(), 1e-9),
        (r#"<box size="0.1 0.2 0.3"/>"#, corners.collect(), 1e-9),
        (
            r#"<capsule radius="0.1" length="0.3"/>"#,
            rim(-0.15).chain(rim(0.15)).chain(tips).collect(),
            1e-9,
        ),
        (
            r#"<cylinder radius="0.1" length="0.3"/>"#,
            rim(-0.15).chain(rim(0.15)).collect(),
            0.1,
        ),
    ]
}

#[test]
fn forms_are_enclosed_where_their_origin_puts_them() {
    let turn = Rotation3::from_euler_angles(0.4, -0.5, 0.6);
    let shift = V::new(0.1, -0.2, 0.3);
    for (form, surface, outside) in forms() {
        let upper = format!(
            r#"<collision><origin xyz="0.1 -0.2 0.3" rpy="0.4 -0.5 0.6"/><geometry>{form}</geometry></collision>"#
        );
        let robot = Robot::from_urdf_str(&arm(BASE, &upper, LOWER, ""), "arm.urdf").unwrap();
        for p in surface {
            let d = inside(&robot, "upper", &(turn * p + shift));
            assert!(d <= 1e-9 && d >= -outside, "{form} {p}: {d}");
        }
        assert!(inside(&robot, "upper", &(turn * V::x() * 0.5 + shift)) > 0.2);
    }
}

/// A link on the upper one, held by a joint of this type.
fn covered(kind: &str, form: &str) -> String {
    let more = format!(
        r#"<link name="cover"><collision><origin xyz="0 0.05 0"/><geometry>{form}</geometry></collision></link>
<joint name="hinge" type="{kind}"><parent link="upper"/><child link="cover"/><origin xyz="0.3 0.1 0" rpy="0 0.3 0"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
"#
    );
    arm(BASE, UPPER, LOWER, &more)
}

#[test]
fn links_that_are_held_have_their_volumes_on_the_body_that_holds_them() {
    for (form, surface, outside) in forms() {
        let fixed = Robot::from_urdf_str(&covered("fixed", form), "arm.urdf").unwrap();
        let locked = stated(&covered("revolute", form), "lock = { hinge = 0.7 }\n");
        for (robot, angle) in [(fixed, 0.0), (locked, 0.7)] {
            let geometry = &robot.geometry;
            let cover = geometry.link("cover").unwrap();
            assert_eq!(geometry.links[cover].body, Some(0));
            let volumes = &geometry.volumes().links;
            let own = volumes.iter().find(|v| v.link == cover).unwrap();
            // from the form to the body, by hand
            for p in &surface {
                let in_link = p + V::new(0.0, 0.05, 0.0);
                let turned = Rotation3::from_axis_angle(&V::z_axis(), angle) * in_link;
                let at = Rotation3::from_axis_angle(&V::y_axis(), 0.3) * turned;
                let at = at + V::new(0.3, 0.1, 0.0);
                let each = own.shapes.iter().map(|s| s.signed_distance(&at));
                let d = each.fold(f64::INFINITY, f64::min);
                assert!(d <= 1e-9 && d >= -outside, "{form} at {angle}: {d}");
            }
        }
    }
}

#[test]
fn visual_geometry_counts_only_where_there_is_no_other() {
    let visual = r#"<visual><geometry><sphere radius="0.3"/></geometry></visual>"#;
    let alone = Robot::from_urdf_str(&arm(BASE, visual, LOWER, ""), "arm.urdf").unwrap();
    assert!((inside(&alone, "upper", &V::zeros()) + 0.3).abs() < 1e-12);
    let both = format!("{visual}{UPPER}");
    let both = Robot::from_urdf_str(&arm(BASE, &both, LOWER, ""), "arm.urdf").unwrap();
    assert!((inside(&both, "upper", &V::zeros()) + 0.05).abs() < 1e-9);
}

/// A wedge of unequal sides as an OBJ, and its corners.
fn wedge(size: f64) -> (String, Vec<V>) {
    let corners = [
        [0.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [2.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 0.5],
        [0.0, 1.0, 0.5],
    ]
    .map(|[x, y, z]| V::new(x, y, z) * size);
    let mut text = String::new();
    for c in &corners {
        text += &format!("v {} {} {}\n", c.x, c.y, c.z);
    }
    text += "f 1 4 3 2\nf 1 2 5\nf 3 4 6\nf 2 3 6 5\nf 1 5 6 4\n";
    (text, corners.to_vec())
}

fn mesh(file: &str, scale: &str) -> String {
    format!(
        r#"<collision><origin xyz="0 0.02 0"/><geometry><mesh filename="{file}"{scale}/></geometry></collision>"#
    )
}

/// A folder with these files.
fn folder(files: &[(&str, &str)]) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    for (name, content) in files {
        put(dir.path(), name, content);
    }
    dir
}

fn put(dir: &Path, name: &str, content: &str) {
    let path = dir.join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, content).unwrap();
}

fn load(dir: &TempDir, name: &str) -> Plant {
    Plant::load(dir.path().join(name).to_str().unwrap()).unwrap()
}

#[track_caller]
fn warned<'a>(all: &'a [Warning], kind: WarningKind, words: &[&str]) -> &'a Warning {
    let fits = |w: &&Warning| {
        let text = w.to_string();
        w.kind == kind && words.iter().all(|word| text.contains(word))
    };
    let found = all.iter().find(fits);
    found.unwrap_or_else(|| panic!("no {kind:?} with {words:?} in {all:?}"))
}

/// Why a pair is left out, in either order.
fn left_out<'a>(scene: &'a Scene, a: &str, b: &str) -> Option<&'a str> {
    let found = (scene.left_out.iter()).find(|l| {
        let [x, y] = &l.between;
        (x == a && y == b) || (x == b && y == a)
    });
    found.map(|l| l.why.as_str())
}

fn looked_at(scene: &Scene, a: &str, b: &str) -> bool {
    let mut names = scene.pairs.iter().map(|p| scene.names(p));
    names.any(|n| n == [a, b] || n == [b, a])
}

fn floors(scene: &Scene) -> usize {
    let plane = |o: &&Obstacle| matches!(o, Obstacle::Plane { name, .. } if name == "floor");
    scene.obstacles.iter().filter(plane).count()
}

#[test]
fn a_base_that_stands_on_its_own_frame_has_a_floor() {
    let stands = scene_of(&stated(&plain(), ""));
    assert_eq!(floors(&stands), 1);
    assert!(stands.warnings.is_empty(), "{:?}", stands.warnings);
    let without = scene_of(&stated(&plain(), "[collision]\nfloor = false\n"));
    assert_eq!(floors(&without), 0);
    assert!(without.warnings.is_empty(), "{:?}", without.warnings);

    let deep = arm(&BASE.replace("0 0 0.15", "0 0 0.05"), UPPER, LOWER, "");
    let scene = scene_of(&stated(&deep, ""));
    // where the base ends, and that is said
    assert_eq!(floors(&scene), 1);
    warned(
        &scene.warnings,
        WarningKind::CollisionNotChecked,
        &["floor", "0.100 m below", "at z = -0.100 m"],
    );
    let scene = scene_of(&stated(&deep, "[collision]\nfloor = true\n"));
    assert_eq!(floors(&scene), 1);
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn a_plant_without_collisions_has_no_scene() {
    let plant = Plant::from(Robot::from_urdf_str(&plain(), "arm.urdf").unwrap());
    assert!(plant.scene().unwrap().is_some());
    assert!(plant.without_collisions().scene().unwrap().is_none());
    let unchecked = stated(&plain(), "[collision]\ncheck = false\n");
    assert!(Plant::from(unchecked).scene().unwrap().is_none());
    let bare = Robot::from_urdf_str(&arm("", "", "", ""), "arm.urdf").unwrap();
    assert!(Plant::from(bare).scene().unwrap().is_none());
}

#[test]
fn the_template_states_volumes_that_enclose_the_same() {
    let (text, _) = wedge(0.1);
    let lower = r#"<collision><origin xyz="0.1 0 0" rpy="0.3 0.2 0.1"/><geometry><cylinder radius="0.05" length="0.3"/></geometry></collision>
<collision><origin rpy="1.5707963267948966 1.5707963267948966 0.3"/><geometry><box size="0.1 0.123456 0.3"/></geometry></collision>"#.to_string();
    let cover = r#"<link name="cover"><collision><origin xyz="0.0123456 0 0"/><geometry><sphere radius="0.0654321"/></geometry></collision></link>
<joint name="bolt" type="fixed"><parent link="upper"/><child link="cover"/><origin xyz="0.3 0.1 0" rpy="0.7 0.3 0.2"/></joint>
"#;
    let urdf = arm(BASE, &mesh("part.obj", ""), &lower, cover);
    let dir = folder(&[("arm.urdf", &urdf), ("part.obj", &text)]);
    let plant = load(&dir, "arm.urdf");
    let before = plant.robot();
    let again = before.to_toml_template("arm.urdf");
    let after = Robot::from_toml_str(&again, &urdf, "robot.toml").unwrap();
    for link in ["base", "upper", "lower", "cover"] {
        for i in 0..1000 {
            let [x, y, z] = [1, 10, 100].map(|k| 0.1 * f64::from(i / k % 10) - 0.45);
            let p = V::new(x, y, z);
            let (old, new) = (inside(before, link, &p), inside(&after, link, &p));
            assert!(
                new <= old + 1e-9 && new >= old - 1e-3,
                "{link} {p}: {old} then {new}"
            );
        }
    }
    let stated = after.geometry.volumes().links.iter().map(|v| v.origin);
    assert!(stated.into_iter().all(|o| o == Origin::Stated));
    let count = |r: &Robot| -> usize {
        let links = r.geometry.volumes().links.iter();
        links.map(|v| v.shapes.len()).sum()
    };
    assert_eq!(count(before), count(&after));
    // a sphere stays one
    let cover = after.geometry.link("cover").unwrap();
    let links = &after.geometry.volumes().links;
    let cover = links.iter().find(|v| v.link == cover).unwrap();
    assert!(matches!(cover.shapes[..], [Shape::Sphere { .. }]));
}

/// A ring of 24 blocks about the z axis, each 30 mm thick, their inner faces 0.1 m from it.
fn ring() -> String {
    let mut text = String::new();
    for k in 0..24 {
        for turn in [k, k + 1] {
            let (s, c) = (f64::from(turn) * std::f64::consts::TAU / 24.0).sin_cos();
            for r in [0.101, 0.13] {
                for z in [-0.05, 0.05] {
                    text += &format!("v {} {} {z}\n", r * c, r * s);
                }
            }
        }
        let corner = |i: i32| 8 * k + i;
        for face in [
            [1, 2, 4, 3],
            [5, 6, 8, 7],
            [1, 2, 6, 5],
            [3, 4, 8, 7],
            [1, 3, 7, 5],
            [2, 4, 8, 6],
        ] {
            let [a, b, c, d] = face.map(corner);
            text += &format!("f {a} {b} {c} {d}\n");
        }
    }
    text
}

/// A ring that turns about a post: whatever the posture, 40 mm are between them.
#[test]
fn tighter_volumes_are_tried_where_coarse_ones_are_always_near() {
    let post = r#"<collision><origin xyz="0 0 0.5"/><geometry><cylinder radius="0.06" length="1"/></geometry></collision>"#;
    let arm = r#"<collision><origin xyz="0 0.25 0"/><geometry><box size="0.05 0.05 0.05"/></geometry></collision>"#;
    let urdf = format!(
        r#"<robot name="carousel"><link name="post">{post}</link><link name="arm">{INERTIA}{arm}</link>
<link name="ring">{INERTIA}<collision><geometry><mesh filename="ring.obj"/></geometry></collision></link>
<joint name="j1" type="revolute"><parent link="post"/><child link="arm"/><origin xyz="0 0 0.7"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="3" effort="60"/></joint>
<joint name="j2" type="revolute"><parent link="arm"/><child link="ring"/><origin xyz="0 0 -0.4"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="3" effort="60"/></joint>
</robot>"#
    );
    let dir = folder(&[("arm.urdf", &urdf), ("ring.obj", &ring())]);
    let plant = load(&dir, "arm.urdf");
    let robot = plant.robot();
    // the capsules and boxes of the first fit fill the ring
    assert!(inside(robot, "ring", &V::new(0.075, 0.0, 0.0)) < 0.0);
    let scene = plant.scene().unwrap().unwrap();
    assert!(scene.always_near.is_empty(), "{:?}", scene.always_near);
    assert!(looked_at(&scene, "post", "ring"));
    let hull = |v: &&excite::collision::scene::Volume| matches!(v.shape, Shape::Hull(_));
    assert!(scene.volumes.iter().filter(hull).count() > 1);
    // what is written says the same
    let lent = plant.lend_volumes(robot);
    assert!(inside(&lent, "ring", &V::new(0.075, 0.0, 0.0)) > 0.0);
    let written = lent.to_toml_template("arm.urdf");
    assert!(written.contains("kind = \"hull\""), "{written}");
    let again = Robot::from_toml_str(&written, &urdf, "robot.toml").unwrap();
    let scene = scene_of(&again);
    assert!(scene.always_near.is_empty() && looked_at(&scene, "post", "ring"));
}

/// A slider of 4 m with a post in the middle: it passes on neither side, but stands free on both.
#[test]
fn long_slides_are_looked_at_over_their_whole_range() {
    let urdf = format!(
        r#"<robot name="gantry"><link name="rail"/>
<link name="carriage">{INERTIA}<collision><origin xyz="0 0 1"/><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
<joint name="slide" type="prismatic"><parent link="rail"/><child link="carriage"/><axis xyz="1 0 0"/><limit lower="0" upper="4" velocity="1" effort="100"/></joint>
</robot>"#
    );
    let post = "[[obstacle]]\nname = \"post\"\nkind = \"box\"\nsize = [1.2, 0.5, 0.5]\npose = [2, 0, 1, 0, 0, 0]\n";
    let scene = scene_of(&stated(&urdf, post));
    assert_eq!(left_out(&scene, "carriage", "post"), None);
    assert!(looked_at(&scene, "carriage", "post"));
}
