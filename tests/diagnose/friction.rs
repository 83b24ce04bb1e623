//! Robot files that state no friction: it is fitted first, and named; other effects are looked for beside it.

use super::findings::{claims, logs_of, of_folder, robots};
use crate::common::shared::shared;
use excite::diagnose::parts::Verdict;
use excite::diagnose::{Diagnosis, Settings, of_logs, page};
use excite::log::Record;
use excite::plant::Plant;
use excite::robot::parts::JointTerm;
use excite::{Robot, WarningKind};

/// The model as a file from CAD: bodies and rotors alone.
fn bare() -> Robot {
    let mut model = robots().0.robot().clone().with_terms(&[]);
    for joint in &mut model.joints {
        joint.terms = [0.05, 0.0, 0.0, 0.0];
    }
    model
}

fn diagnosed(model: &Robot, logs: &[Record]) -> Diagnosis {
    let settings = Settings::default().with(|set| set.next = false);
    of_logs(&Plant::from(model.clone()), logs, &settings, &|_| {}).expect("a diagnosis")
}

fn of_machine(machine: &Robot, extra: &mut dyn FnMut(usize, &[f64]) -> f64) -> Diagnosis {
    let logs = logs_of([machine; 4], &mut |j, _, _, v, _| extra(j, v));
    diagnosed(&bare(), &logs)
}

/// The findings that are friction and offsets of joints, with their values.
fn friction(d: &Diagnosis) -> Vec<(&str, usize, f64)> {
    let terms = ["viscous_friction", "coulomb_friction", "torque_offset"];
    let claimed = d.findings.iter().filter(|f| f.is_claim());
    claimed
        .filter(|f| terms.contains(&f.effect))
        .map(|f| (f.effect, f.place.first(), f.values[0].value))
        .collect()
}

fn others(d: &Diagnosis) -> Vec<&str> {
    let terms = ["viscous_friction", "coulomb_friction", "torque_offset"];
    let all = claims(d).into_iter().map(|c| c.0);
    all.filter(|name| !terms.contains(name)).collect()
}

/// Friction of the machine, each within a share of its value.
fn is_that_of(d: &Diagnosis, machine: &Robot, within: f64) {
    let found = friction(d);
    for (j, joint) in machine.joints.iter().enumerate() {
        let [_, viscous, coulomb, _] = joint.terms;
        for (name, value) in [("viscous_friction", viscous), ("coulomb_friction", coulomb)] {
            let own = found.iter().find(|f| (f.0, f.1) == (name, j));
            let own = own.unwrap_or_else(|| panic!("{name} of {j}: {found:?}"));
            assert!((own.2 / value - 1.0).abs() < within, "{own:?} {value}");
        }
    }
}

#[test]
fn friction_that_the_file_lacks_is_named_joint_by_joint() {
    let machine = robots().1;
    let d = of_machine(&machine, &mut |_, _| 0.0);
    assert_eq!(d.verdict, Verdict::Explained, "{:?}", claims(&d));
    is_that_of(&d, &machine, 0.1);
    assert!(others(&d).is_empty(), "{:?}", claims(&d));
    assert!(
        d.friction_found && d.unexplained < 0.01,
        "{}",
        d.unexplained
    );
    let kinds: Vec<_> = d.warnings.iter().map(|w| w.kind).collect();
    assert!(kinds.contains(&WarningKind::JointTermsAssumed), "{kinds:?}");
    // the gap is counted from the file, whose refit has no friction either
    for j in 0..2 {
        assert!(d.frozen[j].rms > 5.0 * d.frozen[j].noise);
        assert!(d.refit[j].rms > 5.0 * d.refit[j].noise);
        assert!(d.explained[j].rms < d.explained[j].noise);
    }
    let [before, after] = d.holdout.expect("a record held out");
    assert!(after < 0.01 * before, "{before} {after}");
    // the files hold it, and the report says where
    is_that_of(&d, &d.improved.robot, 1e-3);
    assert_eq!(d.improved.remarks.len(), friction(&d).len());
    assert!(
        d.improved
            .in_mujoco
            .iter()
            .all(|f| f.starts_with("robot.xml"))
    );
    // one name for all joints of one effect
    let said = page::sentence(&d).1;
    assert_eq!(said.matches("Coulomb friction").count(), 1, "{said}");
    assert!(!said.contains("100.0 % sure"), "{said}");
}

#[test]
fn an_effect_beside_friction_that_the_file_lacks() {
    let machine = robots().1;
    // Lorentzian instead of an exponential
    let d = of_machine(&machine, &mut |j, v| match j {
        1 => 1.2 * v[1].signum() / (1.0 + (v[1] / 0.08).powi(2)),
        _ => 0.0,
    });
    is_that_of(&d, &machine, 0.3);
    assert_eq!(others(&d), ["stribeck_friction"], "{:?}", claims(&d));
    assert!(claims(&d).contains(&("stribeck_friction", vec![1])));
    // shares are of the whole gap: the peak is a small part of it
    let peak = d.findings.iter().find(|f| f.effect == "stribeck_friction");
    let peak = peak.expect("it is claimed");
    assert!(peak.explains < 0.5, "{}", peak.explains);
    assert!(peak.interval[0] <= peak.explains && peak.explains <= peak.interval[1]);
}

#[test]
fn a_machine_without_friction_has_none() {
    let mut machine = robots().1;
    for joint in &mut machine.joints {
        joint.terms[JointTerm::Viscous as usize] = 0.0;
        joint.terms[JointTerm::Coulomb as usize] = 0.0;
        joint.terms[JointTerm::Offset as usize] = 0.0;
    }
    let d = of_machine(&machine, &mut |_, _| 0.0);
    assert_eq!(d.verdict, Verdict::NoGap, "{:?}", claims(&d));
    assert!(claims(&d).is_empty() && !d.friction_found);
}

/// A file that states Coulomb friction alone, as a simulator's may: the viscous one is fitted first, and named joint by joint.
#[test]
fn one_kind_of_friction_that_the_file_lacks_is_named() {
    let machine = robots().1;
    let logs = logs_of([&machine; 4], &mut |_, _, _, _, _| 0.0);
    let mut stated = bare();
    for (j, joint) in stated.joints.iter_mut().enumerate() {
        joint.terms[JointTerm::Coulomb as usize] = machine.joints[j].terms[2];
    }
    let d = diagnosed(&stated, &logs);
    assert_eq!(d.verdict, Verdict::Explained, "{:?}", claims(&d));
    let found = friction(&d);
    for (j, joint) in machine.joints.iter().enumerate() {
        let own = found.iter().find(|f| (f.0, f.1) == ("viscous_friction", j));
        let own = own.unwrap_or_else(|| panic!("{j}: {found:?}"));
        assert!((own.2 / joint.terms[1] - 1.0).abs() < 0.1, "{own:?}");
    }
    assert!(
        !found.iter().any(|f| f.0 == "coulomb_friction"),
        "{found:?}"
    );
    assert!(others(&d).is_empty(), "{:?}", claims(&d));
    let said = d
        .warnings
        .iter()
        .find(|w| w.kind == WarningKind::JointTermsAssumed);
    let said = said.expect("it is said").to_string();
    assert!(said.contains("states no viscous friction"), "{said}");
}

/// A file that lists friction to be identified, and states none, lacks it as one that lists nothing.
#[test]
fn friction_that_is_listed_without_a_value_is_lacking() {
    let machine = robots().1;
    let logs = logs_of([&machine; 4], &mut |_, _, _, _, _| 0.0);
    let fitted = bare().with_terms(&JointTerm::FRICTION);
    let d = diagnosed(&fitted, &logs);
    assert!(d.friction_found);
    is_that_of(&d, &machine, 0.1);
    assert!(others(&d).is_empty(), "{:?}", claims(&d));
}

/// What a file states and does not list is taken at its word where the records agree: of one joint with three times the friction, that is
/// named. Where all joints are a fifth off it is as well known as the bodies, and that is ordinary.
#[test]
fn stated_friction_that_is_not_listed_may_be_off() {
    let machine = robots().1;
    let logs = logs_of([&machine; 4], &mut |_, _, _, _, _| 0.0);
    let with = |factor: [f64; 2]| {
        let mut model = bare();
        for (j, joint) in model.joints.iter_mut().enumerate() {
            joint.terms = machine.joints[j].terms;
            let own = &mut joint.terms[JointTerm::Coulomb as usize];
            *own *= factor[j];
        }
        diagnosed(&model, &logs)
    };
    let near = with([0.8, 1.2]);
    assert_eq!(near.verdict, Verdict::NoGap, "{:?}", claims(&near));
    assert!(claims(&near).is_empty() && !near.friction_found);
    let far = with([1.0, 0.3]);
    assert_eq!(
        claims(&far),
        [("coulomb_friction", vec![1])],
        "{:?} {:?}",
        far.verdict,
        far.findings
            .iter()
            .map(|f| (f.effect, f.joints.clone(), f.confidence))
            .collect::<Vec<_>>()
    );
    assert!(!far.friction_found);
    // the whole term, not what lies beyond the file
    let whole = friction(&far)[0].2;
    let true_value = machine.joints[1].terms[JointTerm::Coulomb as usize];
    assert!((whole / true_value - 1.0).abs() < 0.1, "{whole}");
}

/// Friction that a single joint lacks is an effect of this joint: nothing is fitted first.
#[test]
fn friction_that_one_joint_lacks_is_an_effect() {
    let machine = robots().1;
    let logs = logs_of([&machine; 4], &mut |_, _, _, _, _| 0.0);
    let mut stated = bare().with_terms(&JointTerm::ALL);
    for (j, joint) in stated.joints.iter_mut().enumerate() {
        joint.terms = machine.joints[j].terms;
    }
    stated.joints[1].terms[JointTerm::Coulomb as usize] = 0.0;
    stated.joints[1].identify[JointTerm::Coulomb as usize] = false;
    let d = diagnosed(&stated, &logs);
    assert!(!d.friction_found);
    assert_eq!(claims(&d), [("coulomb_friction", vec![1])]);
}

/// A Panda with joint torque sensors and its bundled file, which states no friction: every joint has its own, and no two of them
/// are coupled.
#[test]
fn the_friction_of_a_real_arm_is_that_of_its_joints() {
    let Some(d) = of_folder("data/panda") else {
        return;
    };
    let found = friction(&d);
    for j in [4, 5, 6] {
        let own = found.iter().find(|f| f.0 == "coulomb_friction" && f.1 == j);
        assert!(own.is_some_and(|f| f.2 > 0.1 && f.2 < 0.8), "{found:?}");
    }
    assert!(!others(&d).contains(&"joint_coupling"), "{:?}", claims(&d));
}

/// A case of another simulator whose robot file states friction, without it.
#[test]
fn a_withheld_effect_has_its_name_without_friction_in_the_file() {
    let case = |name: &str| {
        let path = shared(&format!("withheld-dev/{name}"))?;
        let file = path.join("experiment.toml");
        let e = excite::log::Experiment::read(file).expect("an experiment");
        let mut robot = e.plant.robot().clone().with_terms(&[]);
        for joint in &mut robot.joints {
            joint.terms[1..].fill(0.0);
        }
        Some(diagnosed(&robot, &e.records))
    };
    let Some(clean) = case("case_014") else {
        return;
    };
    assert!(others(&clean).is_empty(), "{:?}", claims(&clean));
    assert!(friction(&clean).len() > 3, "{:?}", claims(&clean));
    let single = case("case_008").expect("it is there");
    assert_eq!(others(&single), ["friction_asymmetry"]);
    assert!(claims(&single).contains(&("friction_asymmetry", vec![1])));
}
