//! Designs keep clear of the robot itself and of what stands around it, and reports say how near a motion comes.

use excite::collision::scene::{Obstacle, Scene, poses};
use excite::design::{Design, Settings, design};
use excite::identifiability::json::json;
use excite::identifiability::page::{Grade, verdict};
use excite::identifiability::{Assessment, assess};
use excite::plant::parts::ClearanceCertificate;
use excite::trajectory::certificate::Proof;
use excite::trajectory::parts::Ends;
use excite::trajectory::parts::Series;
use excite::trajectory::{Fourier, Trajectory};
use excite::{Error, Plant, Robot};
use nalgebra::Vector3;
use std::collections::BTreeMap;

const INERTIA: &str = r#"<inertial><origin xyz="0.2 0 0"/><mass value="2"/><inertia ixx="0.005" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial>"#;
const CAPSULE: &str = r#"<collision><origin xyz="0.2 0 0" rpy="0 1.5707963267948966 0"/><geometry><capsule radius="0.05" length="0.4"/></geometry></collision>"#;
const BOX: &str = r#"<collision><origin xyz="0.2 0 0"/><geometry><box size="0.4 0.08 0.06"/></geometry></collision>"#;

/// Two links of 0.4 m in the vertical x-z plane on a column that stands on the floor; they reach the floor and,
/// folded, the column.
fn arm(more: &str) -> Plant {
    arm_on(0.3, "", more)
}

/// The same on a column of this height, whose upper end stays where it is, with `limb` beside.
fn arm_on(height: f64, limb: &str, more: &str) -> Plant {
    let middle = 0.3 - height / 2.0;
    let urdf = format!(
        r#"<robot name="arm">
<link name="column"><collision><origin xyz="0 0 {middle}"/><geometry><box size="0.2 0.2 {height}"/></geometry></collision></link>
<link name="upper">{INERTIA}{CAPSULE}</link>
<link name="lower">{INERTIA}{BOX}</link>
<joint name="shoulder" type="revolute"><parent link="column"/><child link="upper"/><origin xyz="0 0 0.4"/><axis xyz="0 -1 0"/><limit lower="-3" upper="3" velocity="3" effort="60"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/><axis xyz="0 -1 0"/><limit lower="-2.5" upper="2.5" velocity="4" effort="30"/></joint>
{limb}</robot>
"#
    );
    let toml = format!(
        "name = \"arm\"\nurdf = \"arm.urdf\"\n\
         [[joint]]\nname = \"shoulder\"\nacceleration = 15.0\njerk = 1500.0\ntorque_noise = 0.2\n\
         [[joint]]\nname = \"elbow\"\nacceleration = 20.0\njerk = 2000.0\ntorque_noise = 0.1\n{more}"
    );
    Robot::from_toml_str(&toml, &urdf, "robot.toml")
        .unwrap()
        .into()
}

fn settings() -> Settings {
    Settings::default().with(|set| set.starts = Some(2))
}

fn scene(plant: &Plant) -> std::sync::Arc<Scene> {
    plant.scene().unwrap().expect("volumes")
}

/// Least distance of every two names along a motion, looked at so many times a second.
fn brute(plant: &Plant, fourier: &Fourier, rate: f64) -> BTreeMap<[String; 2], f64> {
    let scene = scene(plant);
    let mut out = BTreeMap::new();
    let mut q = vec![0.0; plant.coordinates()];
    let mut at = Vec::new();
    let mut least = vec![f64::INFINITY; scene.pairs.len()];
    for i in 0..(rate * fourier.period) as usize {
        fourier.derivative(0, i as f64 / rate, &mut q);
        poses(plant.robot(), &q, &mut at);
        for (least, pair) in least.iter_mut().zip(&scene.pairs) {
            *least = least.min(scene.separation(pair, &at).distance);
        }
    }
    for (pair, least) in scene.pairs.iter().zip(least) {
        let known = out
            .entry(scene.names(pair).map(String::from))
            .or_insert(f64::INFINITY);
        *known = known.min(least);
    }
    out
}

fn certificate(d: &Design) -> ClearanceCertificate {
    d.plant
        .clearance(&d.trajectory.fourier)
        .unwrap()
        .expect("volumes")
}

/// The margin is kept, and no instant is nearer than the certificate says.
#[track_caller]
fn kept(d: &Design, rate: f64) {
    let c = certificate(d);
    assert!(c.satisfied, "{:?}", c.pairs.first());
    assert_eq!(c.proof, Proof::Enclosed);
    let met = brute(&d.plant, &d.trajectory.fourier, rate);
    assert_eq!(met.len(), c.pairs.len());
    for p in &c.pairs {
        let met = met[&p.between];
        assert!(
            met >= p.bound - 1e-9 && p.bound >= p.margin - 1e-9,
            "{:?}: {met} met, {} proven, margin {}",
            p.between,
            p.bound,
            p.margin
        );
    }
    // the nearest pair is known closely
    let first = c.pairs.first().expect("a pair");
    assert!(
        first.least - first.bound < 1e-3 && first.least <= met[&first.between] + 1e-3,
        "{first:?}"
    );
}

/// Least distance of the two arms from something.
fn nearest(plant: &Plant, fourier: &Fourier, name: &str) -> f64 {
    let all = brute(plant, fourier, 1e3).into_iter();
    let of = all.filter(|(names, _)| names.iter().any(|n| n == name));
    of.map(|(_, d)| d).fold(f64::INFINITY, f64::min)
}

#[test]
fn a_design_keeps_its_margin_at_all_times() {
    let d = design(&arm(""), &settings()).unwrap();
    kept(&d, 1e4);
    let report = assessed(&d.plant, &d.trajectory).0;
    assert_eq!(report["proof"], "proven");
    assert_eq!(report["satisfied"], true);
}

#[test]
fn a_wider_margin_is_kept_as_well() {
    let plant = arm("[collision]\nmargin = 0.1\n");
    assert_eq!(scene(&plant).margin, 0.1);
    kept(&design(&plant, &settings()).unwrap(), 1e3);
}

#[test]
fn the_panda_keeps_clear_of_itself_and_of_the_floor() {
    let settings = Settings::default().with(|set| set.starts = Some(1));
    let plant = Plant::load("panda").unwrap();
    let names = scene(&plant);
    let floor = names.pairs.iter().any(|p| names.names(p)[1] == "floor");
    assert!(floor, "the floor is looked at");
    kept(&design(&plant, &settings).unwrap(), 1e3);
}

#[test]
fn the_floor_is_in_the_way_of_the_free_design() {
    let plant = arm("");
    let d = design(&plant.clone().without_collisions(), &settings()).unwrap();
    assert!(d.plant.clearance(&d.trajectory.fourier).unwrap().is_none());
    let least = nearest(&plant, &d.trajectory.fourier, "floor");
    assert!(least < 0.0, "{least}");
    let other = design(&plant, &settings()).unwrap();
    assert_ne!(other.trajectory.fourier, d.trajectory.fourier);
}

#[test]
fn a_start_posture_in_the_floor_is_refused() {
    let settings = settings().with(|set| set.start = Some(vec![-1.4, 0.0]));
    match design(&arm(""), &settings) {
        Err(Error::Infeasible(m)) => {
            assert!(m.contains("lower") && m.contains("floor"), "{m}");
        }
        other => panic!("{:?}", other.map(|d| d.value)),
    }
}

/// Where the floor of a robot is, if there is one, and what is said of it.
fn floor(plant: &Plant) -> (Option<f64>, Vec<String>) {
    let scene = scene(plant);
    let at = scene.obstacles.iter().find_map(|o| match o {
        Obstacle::Plane { name, offset, .. } if name == "floor" => Some(*offset),
        _ => None,
    });
    let about = |w: &&excite::Warning| w.message.contains("floor");
    let said = scene.warnings.iter().filter(about);
    (at, said.map(|w| w.message.clone()).collect())
}

#[test]
fn the_floor_is_where_the_base_ends() {
    assert_eq!(floor(&arm("")), (Some(0.0), vec![]));
    let (at, said) = floor(&arm_on(0.5, "", ""));
    assert!((at.unwrap() + 0.2).abs() < 1e-12, "{at:?}");
    assert!(
        said[0].contains("at z = -0.200 m, and not at z = 0"),
        "{said:?}"
    );
    let (at, said) = floor(&arm_on(0.5, "", "[collision]\nfloor = true\n"));
    assert_eq!((at, said), (Some(0.0), vec![]));
    // the trunk of something with two limbs does not stand on its lowest point
    let limb = format!(
        r#"<link name="other">{INERTIA}</link>
<joint name="hip" type="revolute"><parent link="column"/><child link="other"/><axis xyz="0 -1 0"/><limit lower="-1" upper="1" velocity="1" effort="60"/></joint>
"#
    );
    let more =
        "[[joint]]\nname = \"hip\"\nacceleration = 15.0\njerk = 1500.0\ntorque_noise = 0.2\n";
    let (at, said) = floor(&arm_on(0.5, &limb, more));
    assert_eq!(at, None);
    assert!(said[0].contains("no floor is assumed"), "{said:?}");
}

/// End of the arm.
fn tip(fourier: &Fourier, t: f64) -> Vector3<f64> {
    let mut q = [0.0; 2];
    fourier.derivative(0, t, &mut q);
    let (a, b) = (q[0], q[0] + q[1]);
    Vector3::new(
        0.4 * (a.cos() + b.cos()),
        0.0,
        0.4 + 0.4 * (a.sin() + b.sin()),
    )
}

/// Three links of which the drives bear the weight near the vertical only, in few of the postures that touch nothing.
#[test]
fn starts_are_postures_that_the_drives_can_hold() {
    let mut joints = String::new();
    for (name, parent, child, at, effort) in [
        ("one", "column", "first", "0 0 0.4", 5.0),
        ("two", "first", "second", "0.4 0 0", 2.5),
        ("three", "second", "third", "0.4 0 0", 0.8),
    ] {
        joints += &format!(
            r#"<link name="{child}">{INERTIA}{BOX}</link><joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="{at}"/><axis xyz="0 -1 0"/><limit lower="-3" upper="3" velocity="3" effort="{effort}"/></joint>"#
        );
    }
    let urdf = format!(
        r#"<robot name="weak"><link name="column"><collision><origin xyz="0 0 0.15"/><geometry><box size="0.2 0.2 0.3"/></geometry></collision></link>{joints}</robot>"#
    );
    let limits = ["one", "two", "three"].map(|name| {
        format!(
            "[[joint]]\nname = \"{name}\"\nacceleration = 15.0\njerk = 1500.0\ntorque_noise = 0.1\n"
        )
    });
    let toml = format!("name = \"weak\"\nurdf = \"weak.urdf\"\n{}", limits.concat());
    let plant: Plant = Robot::from_toml_str(&toml, &urdf, "robot.toml")
        .unwrap()
        .into();
    for seed in [1, 3] {
        let settings = settings().with(|set| set.seed = seed);
        let d = design(&plant, &settings).unwrap();
        kept(&d, 2000.0);
        assert_eq!(d.record.starts.len(), 2, "both starts were found");
    }
}

#[test]
fn an_obstacle_in_the_way_changes_the_design() {
    let free = design(&arm(""), &settings()).unwrap().trajectory.fourier;
    // where the arm reaches furthest
    let shoulder = Vector3::new(0.0, 0.0, 0.4);
    let times = (0..1000).map(|i| tip(&free, f64::from(i) * free.period / 1000.0));
    let far = times
        .max_by(|a, b| (a - shoulder).norm().total_cmp(&(b - shoulder).norm()))
        .unwrap();
    let plant = arm(&format!(
        "[[obstacle]]\nname = \"post\"\nkind = \"sphere\"\ncentre = [{:?}, 0.0, {:?}]\nradius = 0.05\n",
        far.x, far.z
    ));
    assert!(nearest(&plant, &free, "post") < 0.0);
    let d = design(&plant, &settings()).unwrap();
    assert_ne!(d.trajectory.fourier, free);
    kept(&d, 1e3);
    assert!(nearest(&plant, &d.trajectory.fourier, "post") >= 0.02 - 1e-9);
}

#[test]
fn a_frame_stays_in_its_box() {
    let plant = arm("[[keep_in]]\nframe = \"lower\"\nlow = [-inf, -inf, 0.5]\n");
    let d = design(&plant, &settings()).unwrap();
    kept(&d, 1e3);
    let mut q = [0.0; 2];
    for i in 0..10_000 {
        let t = f64::from(i) * d.trajectory.fourier.period / 1e4;
        d.trajectory.fourier.derivative(0, t, &mut q);
        assert!(0.4 + 0.4 * q[0].sin() >= 0.5 - 1e-9);
    }
}

#[test]
fn the_answer_does_not_depend_on_the_number_of_threads() {
    let with = |threads| {
        let settings = settings().with(|set| set.threads = threads);
        design(&arm(""), &settings).unwrap().trajectory.fourier
    };
    assert_eq!(with(1), with(4));
}

/// Both joints swing about zero.
fn swing(robot: &Robot, shoulder: f64) -> Trajectory {
    let joints = [shoulder, 0.1].map(|a| Series {
        constant: 0.0,
        sin: vec![a],
        cos: vec![0.0],
    });
    let fourier = Fourier::new(20.0, vec![1], joints.to_vec()).unwrap();
    Trajectory {
        ends: Ends::Free,
        ..Trajectory::new(robot, fourier)
    }
}

/// `clearance` of the report, and the assessment.
fn assessed(plant: &Plant, trajectory: &Trajectory) -> (serde_json::Value, Assessment) {
    let a = assess(plant, Some(trajectory)).unwrap();
    let report = json(&a, None, 0.0);
    (report["clearance"].clone(), a)
}

#[test]
fn a_motion_that_touches_is_judged_unsafe() {
    let plant = arm("");
    let (report, a) = assessed(&plant, &swing(plant.robot(), 1.2));
    assert_eq!(report["satisfied"], false);
    assert_eq!(report["proof"], "proven");
    assert_eq!(report["between"], serde_json::json!(["lower", "floor"]));
    assert!(report["least"].as_f64().unwrap() < -0.3, "{report}");
    let v = verdict(&a);
    assert_eq!(v.grade, Grade::Unsafe);
    for word in ["Do not run", "lower and floor overlap by"] {
        assert!(v.text.contains(word), "{}", v.text);
    }
    let certified = plant
        .certify(&swing(plant.robot(), 1.2).fourier, 1.0)
        .unwrap();
    assert!(!certified.satisfied());
    let broken = certified.broken().unwrap();
    assert!(broken.contains("lower and floor"), "{broken}");
}

#[test]
fn a_motion_within_its_margin_is_not_unsafe() {
    let plant = arm("");
    let (report, a) = assessed(&plant, &swing(plant.robot(), 0.2));
    assert_eq!(report["satisfied"], true);
    let v = verdict(&a);
    assert_ne!(v.grade, Grade::Unsafe, "{}", v.text);
    assert!(!v.text.contains("not checked"), "{}", v.text);
    let clearances = a.excitation.unwrap().clearance.unwrap();
    let least = clearances
        .least
        .iter()
        .copied()
        .fold(f64::INFINITY, f64::min);
    let bound = clearances.certificate.pairs.iter().map(|p| p.bound);
    assert!(least >= bound.fold(f64::INFINITY, f64::min) - 1e-9);
}

#[test]
fn what_was_not_looked_at_is_said() {
    let unchecked = arm("[collision]\ncheck = false\n");
    for plant in [unchecked, arm("").without_collisions()] {
        let (report, a) = assessed(&plant, &swing(plant.robot(), 0.2));
        assert_eq!(report["proof"], "not_checked");
        assert!(report["least"].is_null());
        let text = verdict(&a).text;
        assert!(text.contains("were not checked"), "{text}");
    }
}
