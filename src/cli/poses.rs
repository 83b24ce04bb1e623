//! `excite poses ROBOT`.

use super::{Collisions, Folder, pretty, print, warn};
use clap::ValueEnum;
use excite::calibrate::parts::{Frame, Kind, Tolerances};
use excite::calibrate::{self, poses};
use excite::robot::holds_robot;
use excite::{Error, Result};
use nalgebra::Vector3;
use std::path::PathBuf;

/// Choose postures for a calibration.
#[derive(clap::Args)]
#[command(
    long_about = "Choose postures for a calibration: inside the limits, free of collision, and such that the tool is \
                  known best afterwards.\n\nROBOT is a robot.toml, a URDF or a bundled robot. Writes poses.csv (joint \
                  readings, in an order with a short way), report.json and report.html, which compares them with \
                  random ones.",
    after_help = "Examples:\n  excite poses ur5e --count 40\n  excite poses h4 --count 45 --std 0.0003 --angle-std \
                  0.00035 --rehearse 1\n  excite poses panda --kind point --point 0.5,0,0.1 --point 0.4,0.3,0.1\n  excite poses \
                  ur5e --camera 0.5,0,1.6,0.5,0,0.3 --view 50 --range 0.5,2\n  excite poses two_arms.urdf --kind loop --frame left_tool --other \
                  right_tool --grip 0,0,0.1,180,0,0"
)]
pub struct Args {
    /// Robot: a robot.toml, a URDF, or the name of a bundled one
    robot: String,
    /// Directory for poses.csv, report.json and report.html
    #[arg(short, long, default_value = "out")]
    output: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Number of postures
    #[arg(short = 'n', long, default_value_t = 50)]
    count: usize,
    /// What will be measured
    #[arg(long, value_enum, default_value = "pose")]
    kind: What,
    /// Link that the measurement sees [default: the last one]
    #[arg(long, value_name = "LINK")]
    frame: Option<String>,
    /// Link of the second arm, for --kind loop
    #[arg(long, value_name = "LINK")]
    other: Option<String>,
    /// Pose of that link in the frame while both hold the same thing, x,y,z,roll,pitch,yaw, m and degrees, for --kind loop
    #[arg(
        long,
        value_name = "POSE",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    grip: Vec<f64>,
    /// Fixed point for the frame's origin, x,y,z in the base, m; may be given several times
    #[arg(
        long,
        value_name = "X,Y,Z",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    point: Vec<f64>,
    /// Box that the frame's origin must stay in, such as what the camera sees:
    /// x0,x1,y0,y1,z0,z1 in the base, m
    #[arg(
        long,
        value_name = "BOX",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    within: Vec<f64>,
    /// Place of a fixed camera and a point that it looks at, x,y,z,x,y,z in the base, m: the target must be in its view and
    /// range and face it, with no volume of the robot in between
    #[arg(
        long,
        value_name = "CAMERA",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    camera: Vec<f64>,
    /// Angle of the camera's view, a cone, degrees
    #[arg(long, value_name = "DEG", default_value_t = 40.0, requires = "camera")]
    view: f64,
    /// Nearest and farthest distance at which the target is read, m
    #[arg(long, value_name = "NEAR,FAR", value_delimiter = ',', default_values_t = [0.2, 3.0], requires = "camera")]
    range: Vec<f64>,
    /// Place of the target on the frame, x,y,z, and normal of its face, x,y,z, in the frame's axes
    #[arg(
        long,
        value_name = "TARGET",
        value_delimiter = ',',
        allow_hyphen_values = true,
        default_values_t = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        requires = "camera"
    )]
    target: Vec<f64>,
    /// Largest angle between that normal and the line to the camera, degrees
    #[arg(long, value_name = "DEG", default_value_t = 60.0, requires = "camera")]
    facing: f64,
    /// Noise of a measured position, m
    #[arg(long, value_name = "M", default_value_t = 0.0003)]
    std: f64,
    /// Noise of a measured orientation, rad
    #[arg(long, value_name = "RAD", default_value_t = 0.00035)]
    angle_std: f64,
    /// Manufacturing tolerance of lengths, m
    #[arg(long, value_name = "M", default_value_t = 0.002)]
    length: f64,
    /// Manufacturing tolerance of angles, rad
    #[arg(long, value_name = "RAD", default_value_t = 0.005)]
    angle: f64,
    /// Random postures to choose from
    #[arg(long, default_value_t = 5000)]
    candidates: usize,
    /// Seed of all draws
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write also measured.csv and calibration.toml: what a camera or tracker would see of a robot whose geometry is off
    /// by these tolerances, with the noise, and 200 rows held out without it
    #[arg(long, value_name = "SEED")]
    rehearse: Option<u64>,
    #[command(flatten)]
    collisions: Collisions,
}

#[derive(Clone, Copy, ValueEnum)]
enum What {
    Pose,
    Position,
    Point,
    Loop,
}

pub fn run(args: Args) -> Result<()> {
    for (name, value) in [
        ("std", args.std),
        ("angle-std", args.angle_std),
        ("length", args.length),
        ("angle", args.angle),
    ] {
        if !(value.is_finite() && value > 0.0) {
            return Err(Error::Argument(format!(
                "--{name} must be positive, not {value}"
            )));
        }
    }
    const MOST: usize = 200_000;
    if args.candidates == 0 || args.candidates > MOST || args.count > 2000 {
        return Err(Error::Argument(format!(
            "--candidates is between 1 and {MOST}, --count at most 2000"
        )));
    }
    let finite = args.point.iter().chain(&args.within).all(|v| v.is_finite());
    if !finite || !args.point.len().is_multiple_of(3) || !matches!(args.within.len(), 0 | 6) {
        return Err(Error::Argument(
            "--point takes three numbers, --within six, separated by commas".into(),
        ));
    }
    let kind = match args.kind {
        What::Pose => Kind::Pose,
        What::Position => Kind::Position,
        What::Point => Kind::Point,
        What::Loop => Kind::Loop,
    };
    if (kind == Kind::Point) == args.point.is_empty() {
        return Err(Error::Argument(
            "--kind point needs a --point X,Y,Z or several, and other kinds have none".into(),
        ));
    }
    let region = match args.within[..] {
        [a, b, c, d, e, f] => {
            if !(a < b && c < d && e < f) {
                return Err(Error::Argument(
                    "--within: each lower end must be below the upper".into(),
                ));
            }
            Some([[a, b], [c, d], [e, f]])
        }
        _ => None,
    };
    let sight = sight(&args)?;
    let grip = grip(&args)?;
    let mut opened = match &args.other {
        None => calibrate::open(&args.robot, args.frame.as_deref())?,
        Some(other) => calibrate::open_pair(&args.robot, args.frame.as_deref(), other)?,
    };
    opened.plant = args.collisions.apply(opened.plant);
    let request = poses::Request {
        count: args.count,
        kind,
        points: args
            .point
            .chunks(3)
            .map(Vector3::from_column_slice)
            .collect(),
        grip,
        region,
        sight,
        std: [args.std, args.angle_std],
        tolerances: Tolerances {
            length: args.length,
            angle: args.angle,
            ..Tolerances::default()
        },
        candidates: args.candidates,
        seed: args.seed,
    };
    if args.rehearse.is_some() && kind == Kind::Point {
        return Err(Error::Argument(
            "--rehearse is of poses, positions and loops, not of points".into(),
        ));
    }
    let all = [
        "poses.csv",
        "report.json",
        "report.html",
        "measured.csv",
        "calibration.toml",
    ];
    let names = &all[..if args.rehearse.is_some() { 5 } else { 3 }];
    let folder = Folder::new(&args.output, names, args.force)?;
    let found = poses::choose(&opened, &request)?;
    warn(&found.warnings);
    let mut files = vec![
        folder.write(names[0], &found.csv())?,
        folder.write(names[1], &pretty(&found.json()))?,
        folder.write(names[2], &poses::page::html(&found))?,
    ];
    if let Some(seed) = args.rehearse {
        let robot = match std::fs::canonicalize(&args.robot) {
            Ok(path) if holds_robot(&path) => path.to_string_lossy().into_owned(),
            _ => args.robot.clone(),
        };
        let frames = [args.frame.as_deref(), args.other.as_deref()];
        let text = poses::toml(&robot, frames, &request, all[3]);
        files.push(folder.write(all[3], &poses::rehearse(&opened, &request, &found, seed)?)?);
        files.push(folder.write(all[4], &text)?);
    }
    let mut out = format!(
        "{}: {} postures leave the tool uncertain by {:.4} mm, as many random ones by {:.4} mm\n",
        found.robot,
        found.postures.len(),
        1e3 * found.predicted,
        1e3 * found.random_middle()
    );
    for f in files {
        out += &format!("wrote {}\n", f.display());
    }
    print(&out)
}

/// How the second arm's frame sits in that of the first.
fn grip(args: &Args) -> Result<Option<Frame>> {
    let asked = matches!(args.kind, What::Loop);
    if !asked {
        return match (&args.other, args.grip.is_empty()) {
            (None, true) => Ok(None),
            _ => Err(Error::Argument(
                "--other and --grip are for --kind loop".into(),
            )),
        };
    }
    match (&args.other, &args.frame, &args.grip[..]) {
        (Some(_), Some(_), &[x, y, z, roll, pitch, yaw])
            if args.grip.iter().all(|v| v.is_finite()) =>
        {
            let angles = [roll, pitch, yaw].map(f64::to_radians);
            Ok(Some(Frame::at([x, y, z], angles)))
        }
        _ => Err(Error::Argument(
            "--kind loop needs --frame LINK and --other LINK, the tools of both arms, and --grip X,Y,Z,ROLL,PITCH,YAW: the pose of \
             the second in the first, m and degrees"
                .into(),
        )),
    }
}

/// The camera that is asked for.
fn sight(args: &Args) -> Result<Option<poses::Sight>> {
    let [a, b, c, d, e, f] = args.camera[..] else {
        return match args.camera.is_empty() {
            true => Ok(None),
            false => Err(Error::Argument(
                "--camera takes six numbers separated by commas: its place, and a point that it looks at".into(),
            )),
        };
    };
    let wrong = |what: &str| Err(Error::Argument(what.into()));
    let all = args.camera.iter().chain(&args.range).chain(&args.target);
    if !all.chain([&args.view, &args.facing]).all(|v| v.is_finite()) {
        return wrong("--camera, --range, --target, --view and --facing take finite numbers");
    }
    let [x, y, z, nx, ny, nz] = args.target[..] else {
        return wrong(
            "--target takes six numbers separated by commas: its place on the frame, and its normal",
        );
    };
    let (camera, towards) = (Vector3::new(a, b, c), Vector3::new(d, e, f));
    let normal = Vector3::new(nx, ny, nz);
    if !(normal.norm() > 1e-6 && (towards - camera).norm() > 1e-6) {
        return wrong(
            "--camera: its place and the point that it looks at must differ; --target: its normal must not vanish",
        );
    }
    let [near, far] = args.range[..] else {
        return wrong("--range takes two numbers separated by a comma");
    };
    if !(0.0 <= near && near < far) {
        return wrong("--range: the nearest distance must be below the farthest, and not negative");
    }
    if !(args.view > 0.0 && args.view < 180.0 && args.facing > 0.0 && args.facing <= 90.0) {
        return wrong("--view is between 0 and 180 degrees, --facing above 0 and at most 90");
    }
    Ok(Some(poses::Sight {
        camera,
        towards,
        half_view: 0.5 * args.view.to_radians(),
        range: [near, far],
        target: Vector3::new(x, y, z),
        normal: normal.normalize(),
        facing: args.facing.to_radians(),
    }))
}
