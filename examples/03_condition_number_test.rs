//! A condition number asserted in an automated test, as a user would write it: the trajectory that
//! is checked in must keep exciting the robot, and must stay inside its limits.
//!
//! `cargo test --release --example 03_condition_number_test`

use excite::identifiability::Excitation;
use excite::trajectory::Trajectory;
use excite::{Error, Plant};

fn excitation() -> Result<Excitation, Error> {
    let plant = Plant::load("panda")?;
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/trajectories/panda/trajectory.json"
    );
    let trajectory = Trajectory::read(path)?;
    excite::identifiability::assess(&plant, Some(&trajectory))?
        .excitation
        .ok_or_else(|| Error::Argument("no trajectory".into()))
}

fn main() -> Result<(), Error> {
    let e = excitation()?;
    println!(
        "condition number {:.3}, limits hold: {}",
        e.condition.invariant, e.certificate.satisfied
    );
    Ok(())
}

#[test]
fn panda_trajectory_excites_and_is_safe() {
    let e = excitation().expect("robot and trajectory are there");
    assert!(e.condition.invariant < 9.0, "{}", e.condition.invariant);
    assert!(e.certificate.satisfied);
}
