//! `excite torque ROBOT SAMPLES.csv`.

use excite::dynamics::{Samples, Tree};
use excite::regressor::nominal_torque;
use excite::trajectory::samples::read_samples;
use excite::{Result, Robot};
use std::fmt::Write;

/// Print the inverse dynamics of a sampled motion.
#[derive(clap::Args)]
#[command(
    long_about = "Print the inverse dynamics of a sampled motion as CSV with the columns t, tau1, … \
                  (N m or N): rigid bodies, armature, viscous and Coulomb friction and offset of \
                  the nominal model.\n\nSAMPLES.csv has the columns t, q1…, dq1…, ddq1… in rad or m \
                  and seconds; other columns are ignored.",
    after_help = "Example:\n  excite torque panda out/samples.csv > torques.csv"
)]
pub struct Args {
    /// Bundled robot, robot.toml or URDF
    robot: String,
    /// Sampled motion
    samples: String,
}

pub fn run(args: Args) -> Result<()> {
    let robot = Robot::load(&args.robot)?;
    super::warn(&robot.warnings);
    let samples = read_samples(&args.samples, robot.dof())?;
    let motion = Samples {
        dof: robot.dof(),
        count: samples.len(),
        q: samples.q.concat(),
        qd: samples.qd.concat(),
        qdd: samples.qdd.concat(),
    };
    let tau = nominal_torque(&robot, &Tree::new(&robot), &motion);
    let mut text = String::from("t");
    for j in 1..=robot.dof() {
        let _ = write!(text, ",tau{j}");
    }
    text.push('\n');
    for i in 0..motion.count {
        let _ = write!(text, "{}", samples.t[i]);
        for j in 0..robot.dof() {
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
