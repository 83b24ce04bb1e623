//! What columns mean, where names, units and signs are stated.

use super::blind::simulated;
use crate::common::shared::shared;
use excite::survey::{Means, check, survey};
use excite::{Plant, WarningKind};

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
