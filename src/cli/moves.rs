//! `excite move ROBOT TRAJECTORY`.

use super::{Folder, pretty, print, warn};
use excite::moves::{Move, Settings};
use excite::trajectory::Trajectory;
use excite::trajectory::parts::Proof;
use excite::{Error, Plant, Result, Warning};
use std::fmt::Write;
use std::path::PathBuf;

const FILES: [&str; 3] = ["approach.csv", "return.csv", "moves.json"];

/// Plan the moves to the start of a trajectory and back.
#[derive(clap::Args)]
#[command(
    long_about = "Plan the moves to the start of a trajectory and from its end to a park posture: \
                  jerk-limited, all joints arriving together, each leg the fastest within a share of \
                  the limits of velocity, acceleration and jerk (--scale, 20 % by default), within \
                  the limits of position and torque, and free of collisions where the robot has \
                  volumes.\n\nWrites approach.csv, return.csv (columns as samples.csv) and moves.json.",
    after_help = "Examples:\n  excite move panda out/trajectory.json --from 0,-0.78,0,-2.36,0,1.57,0.78\n  \
                  excite move ur5e out/trajectory.json --from 0,-1.57,0,-1.57,0,0 --scale 0.5 --output out"
)]
pub struct Args {
    /// Bundled robot, robot.toml or URDF
    robot: String,
    /// trajectory.json of `excite design`
    trajectory: PathBuf,
    /// Posture before the run, rad or m, in the order of the joints
    #[arg(
        long,
        value_name = "Q1,Q2,…",
        value_delimiter = ',',
        required = true,
        allow_hyphen_values = true
    )]
    from: Vec<f64>,
    /// Posture after the run [default: as --from]
    #[arg(
        long,
        value_name = "Q1,Q2,…",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    to: Option<Vec<f64>>,
    /// Share of the limits of velocity, acceleration and jerk
    #[arg(long, default_value_t = 0.2, allow_negative_numbers = true)]
    scale: f64,
    /// Rate of the samples in Hz
    #[arg(long, default_value_t = 1000.0, allow_negative_numbers = true)]
    rate: f64,
    /// Most random postures that are tried to find a way
    #[arg(long, default_value_t = 3000)]
    tries: usize,
    /// Seed of the random postures
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    collisions: super::Collisions,
    /// Directory for the files
    #[arg(short, long, default_value = "out")]
    output: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Print moves.json to standard output instead of a summary
    #[arg(long)]
    json: bool,
}

/// The robot in the coordinates of a trajectory file, and that trajectory.
pub fn read(robot: &str, path: &PathBuf) -> Result<(Plant, Trajectory, Option<Warning>)> {
    let trajectory = Trajectory::read(path)?;
    let of_file = |e: Error| Error::file(path, "", e.to_string());
    let plant = Plant::load(robot)?;
    let plant = plant.in_space(trajectory.space).map_err(of_file)?;
    let changed = trajectory.matches(plant.moved()).map_err(of_file)?;
    Ok((plant, trajectory, changed))
}

pub fn run(args: Args) -> Result<()> {
    let (plant, trajectory, changed) = read(&args.robot, &args.trajectory)?;
    let plant = args.collisions.apply(plant);
    let settings = Settings {
        scale: args.scale,
        tries: args.tries,
        seed: args.seed,
        rate: Some(args.rate),
    };
    let folder = Folder::new(&args.output, &FILES, args.force)?;
    let park = args.to.as_ref().unwrap_or(&args.from);
    let fourier = &trajectory.fourier;
    let scene = plant.scene()?;
    let scene = scene.as_deref();
    let there = Move::approach(&plant, &args.from, fourier, &settings, scene)?;
    let back = Move::retreat(&plant, fourier, park, &settings, scene)?;
    // what was assumed is the same for both
    let all = plant.warnings().iter().chain(&changed);
    let all = all.chain(scene.iter().flat_map(|s| &s.warnings));
    let warnings: Vec<Warning> = all.chain(&there.warnings).cloned().collect();
    warn(&warnings);
    let mut text = format!(
        "{}: moves at {:.0} % of the limits\n",
        plant.name(),
        100.0 * args.scale
    );
    let mut moves = Vec::new();
    for (name, file, m) in [("approach", FILES[0], &there), ("return", FILES[1], &back)] {
        let path = folder.path(file);
        let samples = m.write(&plant, &path, args.force, args.rate)?;
        text.push_str(&summary(name, m));
        let _ = writeln!(text, "wrote {}: {samples} samples", path.display());
        moves.push(m.json(name, file, samples));
    }
    let json = serde_json::json!({
        "robot": plant.name(),
        "robot_hash": plant.robot().hash,
        "joints": plant.coordinate_names(),
        "settings": settings,
        "moves": moves,
        "warnings": warnings,
    });
    let path = folder.write(FILES[2], &pretty(&json))?;
    let _ = writeln!(text, "wrote {}", path.display());
    match args.json {
        true => print(&pretty(&json)),
        false => print(&text),
    }
}

/// What is printed of a move.
fn summary(name: &str, m: &Move) -> String {
    let mut out = format!("{name}: {:.3} s", m.duration);
    match m.via.len() {
        0 => out.push_str(", direct"),
        n => {
            let _ = write!(out, ", by {n} postures ({} random ones tried)", m.tries);
        }
    }
    if m.slowed > 1.0 {
        let _ = write!(
            out,
            ", slowed {:.2} times for limits that no constant bounds",
            m.slowed
        );
    }
    out.push('\n');
    let fastest = (m.joints.iter()).max_by(|a, b| a.used[0].total_cmp(&b.used[0]));
    if let Some(joint) = fastest {
        let _ = write!(
            out,
            "  fastest {} at {:.1} % of its velocity",
            joint.joint,
            100.0 * joint.used[0]
        );
    }
    let strongest =
        (m.torques.iter().filter_map(|t| Some((t, t.used?)))).max_by(|a, b| a.1.total_cmp(&b.1));
    if let Some((torque, used)) = strongest {
        let _ = write!(
            out,
            "; largest torque {} at {:.1} %",
            torque.joint,
            100.0 * used
        );
        if let Some((bound, limit)) = torque.bound.zip(torque.limit) {
            let _ = write!(out, ", never above {:.1} %", 100.0 * bound / limit);
        }
    }
    out.push('\n');
    let _ = match &m.clearance {
        Some(c) => writeln!(
            out,
            "  closest: {} and {}, {:.1} mm at {:.2} s (never below {:.1} mm{})",
            c.between[0],
            c.between[1],
            1e3 * c.met,
            c.time,
            1e3 * c.bound,
            match c.proof {
                Proof::Stated => ", a stated bound",
                _ => "",
            }
        ),
        None => writeln!(out, "  collisions were not looked at"),
    };
    out
}
