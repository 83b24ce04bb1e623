//! What columns mean, where names, units and signs are stated.

use super::blind::simulated;
use crate::common::shared::shared;
use excite::robot::parts::Motion;
use excite::survey::{Means, check, survey};
use excite::{Plant, WarningKind};
use std::path::{Path, PathBuf};

/// What is stated wrongly is said before a model is identified.
#[test]
fn wrong_statements_are_named_before_a_model_is_made() {
    let plant = Plant::load("ur5e").unwrap();
    let columns = simulated(&plant, 4);
    let n = 6;
    let of = |means: Means| -> Vec<Vec<f64>> {
        (0..n)
            .map(|j| {
                columns
                    .iter()
                    .find(|c| c.means == means && c.joint == j)
                    .unwrap()
                    .values
                    .clone()
            })
            .collect()
    };
    let (q, tau) = (of(Means::Position), of(Means::Torque));
    let record = |q: Vec<Vec<f64>>, tau: Vec<Vec<f64>>| {
        let channels = excite::log::Channels {
            t: columns[0].values.clone(),
            q,
            tau,
            qref: None,
        };
        excite::log::Record::from_channels(
            "log",
            channels,
            &plant,
            excite::log::parts::Purpose::Fit,
            None,
        )
        .unwrap()
    };
    assert_eq!(
        check(&plant, &[record(q.clone(), tau.clone())]).unwrap(),
        []
    );
    // swapped joints
    let mut swapped = q.clone();
    swapped.swap(1, 2);
    let said = check(&plant, &[record(swapped, tau.clone())]).unwrap();
    assert!(
        said.iter()
            .any(|w| w.kind == WarningKind::UnitSuspect && w.message.contains("swapped")),
        "{said:?}"
    );
    // the positions of one joint turned, and the torques of another
    let mut turned = q.clone();
    turned[1].iter_mut().for_each(|x| *x = -*x);
    let said = check(&plant, &[record(turned, tau.clone())]).unwrap();
    assert!(
        said.iter()
            .any(|w| w.subject.contains("shoulder_lift") && w.message.contains("turned")),
        "{said:?}"
    );
    let mut against = tau.clone();
    against[2].iter_mut().for_each(|x| *x = -*x);
    let said = check(&plant, &[record(q.clone(), against)]).unwrap();
    assert!(
        said.iter()
            .any(|w| w.subject.contains("tau3") && w.message.contains("sign is turned")),
        "{said:?}"
    );
    // degrees are refused
    let degrees = q
        .iter()
        .map(|y| y.iter().map(|x| x.to_degrees()).collect())
        .collect();
    let e = check(&plant, &[record(degrees, tau)])
        .unwrap_err()
        .to_string();
    assert!(e.contains("deg"), "{e}");
}

/// The size of a load is no torque.
#[test]
fn a_robot_without_torques_is_said_to_have_none() {
    let Some(folder) = shared("data/so101/chirp_sweep") else {
        return;
    };
    let files = ["state_motor.csv", "control.csv"].map(|f| folder.join(f));
    let found = survey(&files, None).unwrap();
    let count = |m: Means| {
        found
            .claims
            .iter()
            .filter(|c| c.means == m && c.confidence >= 0.5)
            .count()
    };
    assert_eq!(
        [
            count(Means::Position),
            count(Means::Command),
            count(Means::Torque)
        ],
        [6, 6, 0]
    );
    assert!(
        found
            .warnings
            .iter()
            .any(|w| w.message.contains("There is no torque here"))
    );
}

/// A table of a motion with two joints.
fn table(dir: &Path, name: &str, head: &str, row: impl Fn(f64) -> Vec<f64>) -> PathBuf {
    let mut text = format!("{head}\n");
    for i in 0..3000 {
        let t = 0.002 * i as f64;
        let cells: Vec<String> = row(t).iter().map(|x| format!("{x:.9}")).collect();
        text += &format!("{t:.3},{}\n", cells.join(","));
    }
    let path = dir.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

fn q(t: f64) -> [f64; 2] {
    [
        0.6 * (2.0 * t).sin() + 0.2 * (5.0 * t).cos(),
        0.5 * (3.0 * t).cos(),
    ]
}

fn dq(t: f64) -> [f64; 2] {
    [
        1.2 * (2.0 * t).cos() - (5.0 * t).sin(),
        -1.5 * (3.0 * t).sin(),
    ]
}

/// How far a command is ahead is the controller's doing; a velocity that comes late is late.
#[test]
fn a_command_that_is_ahead_is_not_late() {
    let dir = tempfile::tempdir().unwrap();
    let head = "t,q1,q2,dq1,dq2,qref1,qref2";
    let path = table(dir.path(), "run.csv", head, |t| {
        [q(t), dq(t - 0.01), q(t + 0.02)].concat()
    });
    let found = survey(&[path], None).unwrap();
    for name in ["dq1", "dq2", "qref1", "qref2"] {
        let c = found.claims.iter().find(|c| c.column == name).unwrap();
        let late = if c.means == Means::Velocity {
            0.01
        } else {
            0.0
        };
        assert!((c.delay - late).abs() < 5e-4, "{c:?}");
        assert!(late > 0.0 || c.evidence.contains("20.0 ms ahead"), "{c:?}");
    }
}

/// What follows a position in degrees is in degrees, and of its joint.
#[test]
fn columns_without_names_have_the_unit_of_their_position() {
    let dir = tempfile::tempdir().unwrap();
    let deg = f64::to_degrees;
    let angles = "t,Joint 1 angle [deg],Joint 2 angle [deg]";
    let velocities = table(dir.path(), "v.csv", &format!("{angles},ch_a,ch_b"), |t| {
        [q(t), dq(t)].concat().into_iter().map(deg).collect()
    });
    let commands = table(dir.path(), "c.csv", &format!("{angles},ch_a,ch_b"), |t| {
        [q(t), q(t + 0.02)].concat().into_iter().map(deg).collect()
    });
    for (path, means) in [(velocities, Means::Velocity), (commands, Means::Command)] {
        let found = survey(&[path], None).unwrap();
        for (name, joint) in [("ch_a", 0), ("ch_b", 1)] {
            let c = found.claims.iter().find(|c| c.column == name).unwrap();
            assert_eq!((c.means, c.at), (means, Some(joint)), "{c:?}");
            assert!((c.factor().to_degrees() - 1.0).abs() < 1e-6, "{c:?}");
        }
    }
}

/// A channel without a number is no position that stands still.
#[test]
fn a_channel_without_numbers_is_not_recognised() {
    let dir = tempfile::tempdir().unwrap();
    let path = table(dir.path(), "run.csv", "t,q1,q2", |t| {
        vec![q(t)[0], f64::NAN]
    });
    let found = survey(&[path], None).unwrap();
    let c = found.claims.iter().find(|c| c.column == "q2").unwrap();
    assert!(
        c.confidence < 0.5 && c.evidence.contains("no number"),
        "{c:?}"
    );
}

/// A name that stands in the header twice says what its columns are, not of which joint; velocities that are named do.
#[test]
fn names_that_stand_twice_tell_no_joint() {
    let dir = tempfile::tempdir().unwrap();
    let named = |head: &str, rows: &dyn Fn(f64) -> Vec<f64>| {
        let path = table(dir.path(), "run.csv", head, rows);
        let found = survey(&[path], None).unwrap();
        let claims = ["q1", "q1#2"].map(|name| {
            let mut all = found.claims.iter();
            all.find(|c| c.column == name).unwrap().clone()
        });
        (claims, found)
    };
    let (claims, _) = named("t,q1,q1,dq1,dq2", &|t| [q(t), dq(t)].concat());
    assert_eq!(claims.map(|c| c.at), [Some(0), Some(1)]);
    let (claims, found) = named("t,q1,q1", &|t| q(t).to_vec());
    for c in claims {
        assert!(c.at.is_none() && c.confidence < 0.5, "{c:?}");
    }
    let said = |w: &excite::Warning| w.subject == "q1" && w.message.contains("2 columns");
    assert!(found.warnings.iter().any(said), "{:?}", found.warnings);
}

/// A joint that slides in millimetres, beside others in degrees.
#[test]
fn millimetres_are_told_by_the_limits() {
    let plant = Plant::load("scara").unwrap();
    let joints = plant.actuators();
    let dir = tempfile::tempdir().unwrap();
    let names: Vec<String> = (1..=joints.len()).map(|k| format!("q{k}")).collect();
    let head = format!("t,{}", names.join(","));
    let path = table(dir.path(), "run.csv", &head, |t| {
        let of = |(j, joint): (usize, &&excite::robot::Joint)| {
            let [a, b] = joint.limits.position.map(|x| x.clamp(-3.0, 3.0));
            let x = 0.5 * (a + b) + 0.45 * (b - a) * (2.0 * t + j as f64).sin();
            match joint.motion == Motion::Prismatic {
                true => 1e3 * x,
                false => x.to_degrees(),
            }
        };
        joints.iter().enumerate().map(of).collect()
    });
    let found = survey(&[path], Some(&plant)).unwrap();
    for (j, joint) in joints.iter().enumerate() {
        let (unit, factor) = match joint.motion == Motion::Prismatic {
            true => ("mm", 1e-3),
            false => ("deg", 1f64.to_radians()),
        };
        let c = found.claims.iter().find(|c| c.column == names[j]).unwrap();
        assert_eq!(c.unit, Some(unit), "{c:?}");
        assert!((c.factor() / factor - 1.0).abs() < 1e-9, "{c:?}");
    }
    assert!(
        found
            .warnings
            .iter()
            .any(|w| w.message.contains("millimetres"))
    );
}
