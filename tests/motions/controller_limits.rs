//! Limits as controllers enforce them: velocities that depend on the position, rates of torque. What is checked is
//! the controller's own formula at 10 kHz, with its figures written here.

use excite::design::{Design, Settings, design};
use excite::moves::parts::State;
use excite::moves::{Move, Settings as MoveSettings, rehearse};
use excite::robot::Robot;
use excite::robot::parts::VelocityByPosition;
use excite::trajectory::Fourier;
use excite::{Error, Plant, WarningKind};

/// Franka Research 3, from the tables of the Franka Control Interface: ends of the ranges, constant limit,
/// offset, deceleration.
const FR3: [([f64; 2], f64, f64, f64); 7] = [
    ([-2.9007, 2.9007], 2.62, 0.6599, 6.0),
    ([-1.8361, 1.8361], 2.62, 0.2517, 2.585),
    ([-2.9007, 2.9007], 2.62, 0.2000, 3.5),
    ([-3.0770, -0.1169], 2.62, 0.3533, 4.0),
    ([-2.8763, 2.8763], 5.26, 0.5757, 17.0),
    ([0.4398, 4.6216], 4.18, 0.4878, 5.5),
    ([-3.0508, 3.0508], 5.26, 0.4628, 17.0),
];

/// Share of the velocity that the controller allows joint `j`, as its documentation writes it.
fn share(j: usize, q: f64, v: f64) -> f64 {
    let ([low, high], most, offset, deceleration) = FR3[j];
    let upper = most.min(f64::max(
        0.0,
        -offset + f64::max(0.0, 2.0 * deceleration * (high - q)).sqrt(),
    ));
    let lower = (-most).max(f64::min(
        0.0,
        offset - f64::max(0.0, 2.0 * deceleration * (q - low)).sqrt(),
    ));
    match v {
        v if v > 0.0 => v / upper,
        v if v < 0.0 => v / lower,
        _ => 0.0,
    }
}

/// Largest share at 10 kHz, and whose it is.
fn largest(fourier: &Fourier) -> (f64, usize) {
    let n = fourier.dof();
    let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
    let mut worst = (0.0, 0);
    for i in 0..(fourier.period * 1e4) as usize {
        fourier.evaluate(i as f64 * 1e-4, [&mut q, &mut v]);
        for j in 0..n {
            let share = share(j, q[j], v[j]);
            if share > worst.0 {
                worst = (share, j);
            }
        }
    }
    worst
}

pub fn one_start(plant: &Plant) -> Design {
    let settings = Settings::default().with(|set| {
        set.starts = Some(1);
        set.period = 5.0;
    });
    design(plant, &settings).unwrap()
}

#[test]
fn a_design_keeps_what_the_controller_of_the_fr3_enforces() {
    let plant = Plant::load("fr3").unwrap();
    let d = one_start(&plant);
    let (used, joint) = largest(&d.trajectory.fourier);
    assert!(used <= 1.0, "joint {} at {used}", joint + 1);
    // it uses them, and the certificate knows how much
    let found = plant.certify(&d.trajectory.fourier, 1.0).unwrap();
    assert!(found.satisfied());
    let mut most = 0.0_f64;
    for c in &found.actuators.joints {
        let p = c
            .velocity_by_position
            .expect("every joint has such a limit");
        assert!(p.used <= p.bound && p.bound <= 1.0 + 1e-9, "{p:?}");
        most = most.max(p.used).max(c.velocity.used.unwrap());
        let rate = c
            .torque_rate
            .as_ref()
            .expect("and a limit of the rate of torque");
        assert!(rate.limit == 1000.0 && rate.satisfied() && rate.max_on_grid > 0.0);
    }
    assert!((most - used).abs() < 1e-4, "{most} {used}");
    assert!(most > 0.6, "{most}");
}

#[test]
fn a_design_that_ignores_it_is_refused() {
    let mut robot = Robot::load("fr3").unwrap();
    for joint in &mut robot.joints {
        joint.limits.velocity_by_position = None;
    }
    let free = one_start(&Plant::from(robot).without_collisions());
    let (used, joint) = largest(&free.trajectory.fourier);
    assert!(used > 1.0, "{used}");
    let plant = Plant::load("fr3").unwrap().without_collisions();
    let found = plant.certify(&free.trajectory.fourier, 1.0).unwrap();
    assert!(!found.satisfied());
    let refused = found.actuators.joints[joint].velocity_by_position.unwrap();
    assert!(!refused.satisfied() && refused.used >= used * (1.0 - 1e-6));
    let kind = serde_json::to_value(found.actuators.worst.unwrap().kind).unwrap();
    assert_eq!(kind, "velocity_by_position");
}

#[test]
fn derated_it_keeps_the_share() {
    let plant = Plant::load("fr3").unwrap().without_collisions();
    let settings = Settings::default().with(|set| {
        set.starts = Some(1);
        set.period = 5.0;
        set.derate = 0.7;
    });
    let d = design(&plant, &settings).unwrap();
    let (used, _) = largest(&d.trajectory.fourier);
    assert!(used <= 0.7 + 1e-9 && used > 0.4, "{used}");
}

#[test]
fn a_start_beyond_the_last_position_is_refused() {
    let plant = Plant::load("fr3").unwrap().without_collisions();
    let mut start = vec![0.0, 0.0, 0.0, -1.6, 0.0, 2.5, 0.0];
    start[0] = 2.89; // inside the range, where no velocity outwards is left
    let settings = Settings::default().with(|set| set.start = Some(start));
    let e = design(&plant, &settings).map(|d| d.value).unwrap_err();
    assert!(
        e.is_argument() && e.to_string().contains("fr3_joint1"),
        "{e}"
    );
}

#[test]
fn moves_keep_it_at_every_instant() {
    let plant = Plant::load("fr3").unwrap();
    let settings = MoveSettings::default().with(|set| set.scale = 1.0);
    let ready = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785];
    for q in [
        [2.8, 1.7, -2.8, -0.4, 2.7, 4.4, -2.9],
        [-2.6, -1.75, 2.85, -2.9, -2.8, 0.6, 3.0],
    ] {
        for (from, to) in [(ready, q), (q, ready), (q, q.map(|x| 0.3 * x - 1.0))] {
            let kept = |j: usize, q: f64| q.clamp(FR3[j].0[0] + 0.1, FR3[j].0[1] - 0.1);
            let to: [f64; 7] = std::array::from_fn(|j| kept(j, to[j]));
            let (from, to): ([f64; 7], [f64; 7]) = (from, to);
            let there = Move::plan(
                &plant,
                &State::rest(&from),
                &State::rest(&to),
                &settings,
                None,
            )
            .unwrap();
            let samples = there.sample(1e4).unwrap();
            let mut most = 0.0_f64;
            for j in 0..7 {
                for (q, v) in samples.q[j].iter().zip(&samples.qd[j]) {
                    // what rounding leaves of none
                    if v.abs() > 1e-8 {
                        most = most.max(share(j, *q, *v));
                    }
                }
            }
            assert!(most <= 1.0 + 1e-9, "{most}");
            let told = there.joints.iter().map(|j| {
                assert!(j.velocity_by_position.is_some_and(|s| s <= 1.0 + 1e-6));
                j.velocity_by_position.unwrap().max(j.used[0])
            });
            assert!(told.fold(0.0, f64::max) >= most - 1e-9);
            assert!(
                there
                    .torques
                    .iter()
                    .all(|t| t.rate_used.is_some_and(|r| r <= 1.0 + 1e-6))
            );
        }
    }
    let mut beyond = ready;
    beyond[0] = 2.88;
    let e = Move::plan(
        &plant,
        &State::rest(&ready),
        &State::rest(&beyond),
        &settings,
        None,
    );
    match e {
        Err(Error::Infeasible(m)) => {
            assert!(m.contains("fr3_joint1") && m.contains("2.864"), "{m}")
        }
        other => panic!("{:?}", other.map(|m| m.duration)),
    }
    // the way back from there is free
    Move::plan(
        &plant,
        &State::rest(&beyond),
        &State::rest(&ready),
        &settings,
        None,
    )
    .unwrap();
}

#[test]
fn a_rehearsal_tells_the_share() {
    let plant = Plant::load("fr3").unwrap().without_collisions();
    let d = one_start(&plant);
    let table = rehearse(&plant, &d.trajectory, 1000.0, &[0.5, 1.0]).unwrap();
    let found = plant.certify(&d.trajectory.fourier, 1.0).unwrap();
    for (j, c) in found.actuators.joints.iter().enumerate() {
        let [half, full] = [0, 1].map(|s| &table.speeds[s].joints[j]);
        let used = full.velocity_by_position_used.unwrap();
        let proven = c.velocity_by_position.unwrap();
        assert!(used <= proven.bound && used > 0.99 * proven.used);
        assert!((half.velocity_by_position_used.unwrap() - 0.5 * used).abs() < 1e-9);
        let rate = full.torque_rate_used.unwrap();
        let bound = c.torque_rate.as_ref().unwrap();
        assert!(rate <= bound.bound() / bound.limit && rate > 0.9 * bound.used);
    }
}

pub const URDF: &str = r#"<robot name="one"><link name="base"/>
<link name="arm"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="1.5" velocity="3" effort="40"/>
<position_based_velocity_limits deceleration_limit="6.0" velocity_offset="0.3"/></joint></robot>"#;

fn limit(toml: &str, urdf: &str) -> std::result::Result<Option<VelocityByPosition>, String> {
    let toml = format!("urdf = \"one.urdf\"\n{toml}");
    let robot = Robot::from_toml_str(&toml, urdf, "robot.toml").map_err(|e| e.to_string())?;
    let again =
        Robot::from_toml_str(&robot.to_toml_template("one.urdf"), urdf, "again.toml").unwrap();
    assert_eq!(
        again.joints[0].limits, robot.joints[0].limits,
        "the template is the robot"
    );
    Ok(robot.joints[0].limits.velocity_by_position)
}

#[test]
fn files_state_it() {
    let of = |deceleration, offset, position| {
        Some(VelocityByPosition {
            deceleration,
            offset,
            position,
        })
    };
    let own = "[[joint]]\nname = \"j\"\n";
    assert_eq!(limit("", URDF).unwrap(), of(6.0, 0.3, [-2.0, 1.5]));
    // a range that is narrowed does not move the ends that the controller knows
    let narrow = format!(
        "{own}position = [-1.0, 1.0]\nvelocity_by_position = {{ deceleration = 2.0, position = [-2.0, 1.5] }}"
    );
    assert_eq!(limit(&narrow, URDF).unwrap(), of(2.0, 0.0, [-2.0, 1.5]));
    let short = format!(
        "{own}velocity_by_position = {{ deceleration = 2.0, offset = 0.1 }}\neffort_rate = 500.0"
    );
    assert_eq!(limit(&short, URDF).unwrap(), of(2.0, 0.1, [-2.0, 1.5]));
    let refused = |toml: &str, urdf: &str, words: &[&str]| {
        let e = limit(toml, urdf).unwrap_err();
        assert!(words.iter().all(|w| e.contains(w)), "{e}");
    };
    refused(
        "",
        &URDF.replace("\"6.0\"", "\"0\""),
        &["line 6", "deceleration_limit", "robot.toml"],
    );
    refused(
        "",
        &URDF.replace(" velocity_offset=\"0.3\"", ""),
        &["velocity_offset", "missing"],
    );
    refused(
        "",
        &URDF.replace("\"0.3\"", "\"5.0\""),
        &["no room", "robot.toml"],
    );
    refused(
        &format!("{own}velocity_by_position = {{ deceleration = -1.0 }}"),
        URDF,
        &["line 4", "positive"],
    );
    refused(
        &format!("{own}velocity_by_position = {{ deceleration = 1.0, position = [1.0] }}"),
        URDF,
        &["two numbers"],
    );
    refused(
        &format!("{own}velocity_by_position = {{ decel = 1.0 }}"),
        URDF,
        &["line 4", "decel"],
    );
    refused(
        &format!("{own}effort_rate = 0.0"),
        URDF,
        &["effort_rate", "positive"],
    );
    let endless = URDF
        .replace("revolute", "continuous")
        .replace(" lower=\"-2\" upper=\"1.5\"", "");
    refused("", &endless, &["both ends"]);
    let follower = URDF.replace(
        "</joint></robot>",
        r#"</joint><link name="tip"/><joint name="k" type="revolute"><parent link="arm"/><child link="tip"/>
        <limit lower="-1" upper="1" velocity="1" effort="1"/><mimic joint="j"/>
        <position_based_velocity_limits deceleration_limit="6.0" velocity_offset="0.3"/></joint></robot>"#,
    );
    let robot = Robot::from_urdf_str(&follower, "one.urdf").unwrap();
    let told = |w: &excite::Warning| {
        w.kind == WarningKind::LimitsContradict && w.message.contains("velocity_by_position")
    };
    assert!(robot.warnings.iter().any(told), "{:?}", robot.warnings);
}

#[test]
fn parallel_robots_refuse_what_they_do_not_keep() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("robot.toml");
    let text = excite::mechanism::bundled::find("hexapod").unwrap().toml;
    for line in [
        "effort_rate = 100.0",
        "velocity_by_position = { deceleration = 1.0, position = [0.0, 1.0] }",
    ] {
        std::fs::write(
            &file,
            text.replace("[actuator]", &format!("[actuator]\n{line}")),
        )
        .unwrap();
        let e = Plant::load(file.to_str().unwrap())
            .map(|p| p.name().to_string())
            .unwrap_err();
        assert!(e.to_string().contains("serial and tree robots only"), "{e}");
    }
}
