//! `excite rehearse ROBOT TRAJECTORY`.

use super::moves::read;
use super::{pretty, print, warn, write};
use excite::moves::{Rehearsal, rehearse};
use excite::output::prepare_dir;
use excite::{Error, Result};
use std::fmt::Write;
use std::path::PathBuf;

/// Tabulate a trajectory at several speeds: torques, power, samples, bytes.
#[derive(clap::Args)]
#[command(
    long_about = "Tabulate a trajectory at 10, 30 and 100 % of its speed: largest torque and share of \
                  the limits, root mean square torque, largest and mean mechanical power of every \
                  actuator, compared with continuous_torque and continuous_power of the robot file \
                  where they are given; and the number of samples, bytes and seconds. The torques are \
                  those of the nominal model.\n\nWrites rehearsal.json.",
    after_help = "Examples:\n  excite rehearse panda out/trajectory.json\n  excite rehearse ur10 \
                  out/trajectory.json --rate 500 --speeds 0.2,1"
)]
pub struct Args {
    /// Bundled robot, robot.toml or URDF
    robot: String,
    /// trajectory.json of `excite design`
    trajectory: PathBuf,
    /// Samples a second, Hz
    #[arg(long, default_value_t = 1000.0, allow_negative_numbers = true)]
    rate: f64,
    /// Shares of the speed
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = Rehearsal::SPEEDS)]
    speeds: Vec<f64>,
    /// Directory for rehearsal.json
    #[arg(short, long, default_value = "out")]
    output: PathBuf,
    /// Replace the file that exists
    #[arg(long)]
    force: bool,
    /// Print rehearsal.json to standard output instead of a table
    #[arg(long)]
    json: bool,
}

/// Largest share of the designed speed that is tabulated.
const FASTEST: f64 = 5.0;

pub fn run(args: Args) -> Result<()> {
    if let Some(s) = args.speeds.iter().find(|s| **s > FASTEST) {
        return Err(Error::Argument(format!(
            "--speeds are shares of the designed speed, not percent: {s} is {:.0} %",
            100.0 * s
        )));
    }
    let (plant, trajectory, changed) = read(&args.robot, &args.trajectory)?;
    let files = prepare_dir(&args.output, &["rehearsal.json"], args.force)?;
    let found = rehearse(&plant, &trajectory, args.rate, &args.speeds)?;
    let all = plant.warnings().iter().chain(&changed);
    warn(&all.cloned().collect::<Vec<_>>());
    let value = serde_json::to_value(&found)
        .map_err(|e| Error::Infeasible(format!("rehearsal.json: {e}")))?;
    write(&files[0], args.force, &pretty(&value))?;
    match args.json {
        true => print(&pretty(&value)),
        false => print(&format!("{}wrote {}\n", table(&found), files[0].display())),
    }
}

/// The table that is printed.
fn table(found: &Rehearsal) -> String {
    let mut out = String::new();
    let percent = |used: Option<f64>| match used {
        Some(x) => format!("{:.1}", 100.0 * x),
        None => "-".into(),
    };
    for s in &found.speeds {
        let _ = writeln!(
            out,
            "{} at {:.0} % speed: {:.3} s, {} samples at {} Hz, {} bytes",
            found.robot,
            100.0 * s.speed,
            s.seconds,
            s.samples,
            found.rate,
            s.bytes
        );
        let _ = writeln!(
            out,
            "{:<20} {:>9} {:>6} {:>6} {:>6} {:>9} {:>6} {:>9} {:>9} {:>6}",
            "actuator", "torque", "%", "vel %", "acc %", "rms", "%", "peak W", "mean W", "%"
        );
        for l in &s.joints {
            let name: String = l.joint.chars().take(20).collect();
            let velocity = match (l.velocity_used, l.velocity_by_position_used) {
                (Some(a), Some(b)) => Some(a.max(b)),
                (a, b) => a.or(b),
            };
            let _ = writeln!(
                out,
                "{name:<20} {:>9.3} {:>6} {:>6} {:>6} {:>9.3} {:>6} {:>9.3} {:>9.3} {:>6}",
                l.torque,
                percent(l.torque_used),
                percent(velocity),
                percent(l.acceleration_used),
                l.rms_torque,
                percent(l.rms_used),
                l.peak_power,
                l.mean_power,
                percent(l.mean_power_used)
            );
        }
        if let Some((joint, what, used)) = s.most() {
            let _ = writeln!(out, "most used: {what} of {joint}, {:.1} %", 100.0 * used);
        }
        out.push('\n');
    }
    out
}
