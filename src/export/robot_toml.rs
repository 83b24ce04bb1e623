//! `robot.toml`, which every command reads.

use super::{Format, Model, Part, mechanism, remark, urdf};
use crate::error::Result;
use std::fmt::Write;

/// The robot file of excite: that of a serial robot refers to the URDF beside it, that of a parallel one
/// is the file it was read from with other values.
pub struct RobotToml;

impl Format for RobotToml {
    fn name(&self) -> &'static str {
        "robot.toml"
    }

    fn file(&self) -> &'static str {
        "robot.toml"
    }

    fn holds(&self, _plant: &crate::plant::Plant) -> bool {
        true
    }

    fn has(&self, _part: Part) -> bool {
        // with the URDF that it refers to
        true
    }

    fn write(&self, model: &Model) -> Result<String> {
        let mut out = match model.plant.mechanism() {
            None => {
                let robot = model.plant.lend_volumes(model.robot);
                robot.to_toml_template(urdf::FILE)
            }
            Some(m) => mechanism::toml(m, model.robot, urdf::FILE)?,
        };
        let lines = remark::lines(model.remarks, self);
        for (i, line) in lines.iter().enumerate() {
            let gap = if i == 0 { "\n" } else { "" };
            let _ = writeln!(out, "{gap}# {line}");
        }
        Ok(out)
    }
}
