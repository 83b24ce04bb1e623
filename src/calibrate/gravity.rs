//! Where the torques of gravity come from.

use super::effects::{self, Gravity};
use super::file::Calibration;
use super::kin::Kin;
use super::open::Opened;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::robot::{Robot, bundled};

/// Inertia that tells the torques of gravity: of the robot that is named, of the robot itself, or of a bundled
/// robot with the same joints.
pub(super) fn gravity(
    input: &Calibration,
    opened: &Opened,
    warnings: &mut Vec<Warning>,
) -> Result<Option<Gravity>> {
    if let Some(spec) = &input.gravity {
        let robot = Robot::load(spec)?;
        let found = Gravity::of(robot, &opened.joints, spec.clone()).ok_or_else(|| {
            Error::Infeasible(format!(
                "gravity = \"{spec}\": that robot has no mass, or lacks one of the joints {}",
                opened.joints.join(", ")
            ))
        })?;
        return Ok(Some(found));
    }
    let own = Gravity::of(
        opened.plant.robot().clone(),
        &opened.joints,
        "the robot file".into(),
    );
    if own.is_some() {
        return Ok(own);
    }
    for b in bundled::list() {
        let robot = b.load()?;
        if robot.dof() < opened.joints.len() {
            continue;
        }
        if let Some(found) = Gravity::of(robot, &opened.joints, format!("the bundled {}", b.name)) {
            warnings.push(Warning::new(
                WarningKind::NominalModelAssumed,
                opened.plant.name(),
                format!(
                    "its file states no inertia; torques of gravity are those of the bundled {}, whose joints have \
                     the same names. Name another robot by gravity = \"robot.toml\" beside robot",
                    b.name
                ),
            ));
            return Ok(Some(found));
        }
    }
    let Kin::Arm(arm) = &opened.kin else {
        return Ok(None);
    };
    warnings.push(Warning::new(
        WarningKind::NominalModelAssumed,
        opened.plant.name(),
        "its file states no inertia; torques of gravity are those of even rods of 1 kg/m between its joints. What is \
         said of joint compliance holds in kind, its values do not. Name a robot with masses by gravity = \"robot.toml\"",
    ));
    let rods = effects::rods(opened.plant.robot(), arm);
    Ok(Gravity::of(
        rods,
        &opened.joints,
        "even rods of 1 kg/m".into(),
    ))
}
