//! `excite torque ROBOT SAMPLES.csv`.

use excite::{Plant, Result};
use std::fmt::Write;

/// Print the inverse dynamics of a sampled motion.
#[derive(clap::Args)]
#[command(
    long_about = "Print the inverse dynamics of a sampled motion as CSV with the columns t, tau1, … \
                  (N m or N): rigid bodies, armature, viscous and Coulomb friction and offset of \
                  the nominal model.\n\nSAMPLES.csv has the columns t, q1…, dq1…, ddq1… in rad or m \
                  and seconds; other columns are ignored.\n\nOf a parallel robot it \
                  has t and the motion of the platform: x y z qw qx qy qz (pose, scalar first), vx \
                  vy vz wx wy wz and ax ay az alx aly alz (twist and acceleration of the \
                  platform's origin, base axes), or the task coordinates and their derivatives: x \
                  y z theta dx … ddtheta (H4), x y z dx … ddz (Delta), x y z roll pitch yaw dx … \
                  ddyaw (hexapod). Mechanisms of kind `loops` have joints: q1… of the independent \
                  actuators.",
    after_help = "Example:\n  excite torque panda out/samples.csv > torques.csv\n  excite torque hexapod motion.csv > forces.csv"
)]
pub struct Args {
    /// Bundled robot, robot.toml or URDF
    robot: String,
    /// Sampled motion
    samples: String,
}

pub fn run(args: Args) -> Result<()> {
    let plant = Plant::load(&args.robot)?;
    super::warn(plant.warnings());
    let (t, motion) = plant.read_motion(&args.samples)?;
    let tau = plant.nominal_torque(&motion)?;
    let actuators = plant.actuated().len();
    let mut text = String::from("t");
    for j in 1..=actuators {
        let _ = write!(text, ",tau{j}");
    }
    text.push('\n');
    for (i, time) in t.iter().enumerate() {
        let _ = write!(text, "{time}");
        for j in 0..actuators {
            let _ = write!(text, ",{}", tau[j * motion.count + i]);
        }
        text.push('\n');
        if text.len() > 1 << 20 {
            super::print(&text)?;
            text.clear();
        }
    }
    super::print(&text)
}
