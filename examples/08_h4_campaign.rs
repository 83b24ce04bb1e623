//! The whole campaign of an H4 (Renaud et al. 2006; Vivas et al. 2003): its geometry from pictures, then its dynamics
//! with that geometry.
//!
//! 1. 45 postures are chosen for the robot of the file.
//! 2. The true robot takes them. Its geometry is off by 2.5 mm and 6 mrad, its masses and friction by 8 to 20 %. A camera of
//!    this program projects a target, with 0.1 pixel of noise; 100 more pictures without noise are held out.
//! 3. The geometry is identified from the pixels.
//! 4. Motions are designed with the calibrated robot, the true robot runs them with encoder steps and torque noise.
//! 5. The dynamics are identified from the records, with the geometry of the file and with the calibrated one.
//!
//! ```text
//! cargo run --release --example 08_h4_campaign [FOLDER]
//! ```
//!
//! `FOLDER/robot.toml` is the calibrated robot, `FOLDER/calibration.toml` and the pictures are what `excite calibrate` takes.

use excite::calibrate::parts::{Kind, Stats, Tolerances};
use excite::calibrate::{self, Settings, poses, write};
use excite::design::parts::Condition;
use excite::design::{Settings as Design, design};
use excite::identify::{self, identify};
use excite::log::Record;
use excite::log::parts::Purpose;
use excite::mechanism::bundled;
use excite::simulate::parts::Sensors;
use excite::simulate::{self, measure, simulate, to_record};
use excite::trajectory::parts::Ends;
use excite::{Error, Plant, Result};
use nalgebra::{Rotation3, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::{Path, PathBuf};

/// Standard deviations of the true robot's dimensions: m, rad.
const ERRORS: [f64; 2] = [0.0025, 0.006];
/// Noise of a coordinate in a picture, pixels.
const PIXEL: f64 = 0.1;
/// Focal length and middle of the pictures, pixels, and radial distortion.
const LENS: [f64; 4] = [1500.0, 960.0, 600.0, -0.1];
/// Corners of the target in a row and in a column, and their distance, m.
const BOARD: ([usize; 2], f64) = ([9, 7], 0.015);
/// Period of the motions, s, and how many are recorded.
const PERIODS: (f64, u32) = (2.0, 6);
/// Masses and friction of the true robot.
const TRUTH: [[&str; 2]; 5] = [
    ["mass = 0.45\n", "mass = 0.52\n"],
    ["mass = 0.55,", "mass = 0.62,"],
    ["mass = 0.062,", "mass = 0.072,"],
    ["viscous = 0.05", "viscous = 0.06"],
    ["coulomb = 0.25", "coulomb = 0.22"],
];

/// What the campaign comes to.
pub struct Figures {
    /// errors of the pose held out with the robot of the file and with the calibrated one, m
    pub pose: [Stats; 2],
    /// what the identified model leaves of the measured torque held out, as a fraction of it: with the geometry of the
    /// file, with the calibrated one, and with the true one
    pub torque: [f64; 3],
}

fn normal(r: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| r.random_range(-0.5..0.5)).sum()
}

fn save(path: &Path, text: &str) -> Result<()> {
    std::fs::write(path, text).map_err(|e| Error::io(path, e))
}

/// The true robot: its file, in the folder.
fn true_robot(folder: &Path, r: &mut ChaCha8Rng) -> Result<PathBuf> {
    let mut text = bundled::find("h4").map_or("", |b| b.toml).to_string();
    for [from, to] in TRUTH {
        assert!(text.contains(from), "`{from}` stands in the file");
        text = text.replace(from, to);
    }
    let path = folder.join("true.toml");
    save(&path, &text)?;
    let opened = calibrate::open(&path.to_string_lossy(), None)?;
    let unknowns = opened.kin.unknowns(ERRORS);
    let x: Vec<f64> = unknowns.iter().map(|u| u.prior * normal(r)).collect();
    save(&path, &write::robot(&opened, &x)?[0].1)?;
    Ok(path)
}

/// Where the camera sees a point of its own frame.
fn pinhole(p: &Vector3<f64>) -> [f64; 2] {
    let [focal, u, v, k1] = LENS;
    let (a, b) = (p.x / p.z, p.y / p.z);
    let stretch = 1.0 + k1 * (a * a + b * b);
    [u + focal * stretch * a, v + focal * stretch * b]
}

/// Pictures of the target on the platform of a robot, below which the camera looks up.
fn pictures(robot: &Plant, q: &[Vec<f64>], noise: f64, r: &mut ChaCha8Rng) -> Result<String> {
    let camera = Rotation3::from_euler_angles(0.05, -0.08, 0.6);
    let target = Rotation3::from_euler_angles(0.12, 0.06, 0.7);
    let ([columns, rows], pitch) = BOARD;
    let names = (1..=columns * rows).map(|k| format!("u{k},v{k}"));
    let mut out = format!("q1,q2,q3,q4,{}\n", names.collect::<Vec<_>>().join(","));
    let mechanism = robot.mechanism().expect("an H4");
    for q in q {
        let x = mechanism.forward(q, &mechanism.home)?.x;
        let turned = Rotation3::from_euler_angles(0.0, 0.0, x[3]);
        let mut cells = q.clone();
        for k in 0..columns * rows {
            let corner = Vector3::new((k % columns) as f64, (k / columns) as f64, 0.0) * pitch;
            let platform = target * corner - Vector3::new(0.06, 0.045, 0.03);
            let base = Vector3::new(x[0], x[1], x[2]) + turned * platform;
            let seen = camera * base + Vector3::new(0.02, -0.03, 1.05);
            cells.extend(pinhole(&seen).map(|v| v + noise * normal(r)));
        }
        let cells: Vec<String> = cells.iter().map(f64::to_string).collect();
        out += &(cells.join(",") + "\n");
    }
    Ok(out)
}

/// The calibration of the H4 from such pictures, in the folder.
fn calibrated(folder: &Path, truth: &Plant, r: &mut ChaCha8Rng) -> Result<calibrate::Calibrated> {
    let robot = calibrate::open("h4", None)?;
    let request = |count, seed| poses::Request {
        count,
        kind: Kind::Pose,
        points: Vec::new(),
        grip: None,
        region: None,
        sight: None,
        std: [3e-4, 3.5e-4],
        tolerances: Tolerances {
            length: ERRORS[0],
            angle: ERRORS[1],
            ..Tolerances::default()
        },
        candidates: 2000,
        seed,
    };
    let chosen = poses::choose(&robot, &request(45, 1))?;
    println!(
        "45 postures: tool known to {:.3} mm, by random ones to {:.3} mm",
        1e3 * chosen.predicted,
        1e3 * chosen.random_middle()
    );
    let readings: Vec<Vec<f64>> = chosen.postures.iter().map(|c| c.q.clone()).collect();
    // any other postures, to judge by
    let (workspace, mechanism) = match truth.mechanism() {
        Some(m) => (&m.workspace, m),
        None => unreachable!("an H4"),
    };
    let mut others = Vec::new();
    while others.len() < 100 {
        let draw = workspace
            .iter()
            .map(|w| r.random_range(w.position[0]..w.position[1]));
        others.extend(mechanism.actuator_positions(&draw.collect::<Vec<_>>()).ok());
    }
    let ([columns, rows], pitch) = BOARD;
    let corner = |k: usize| {
        let (x, y) = ((k % columns) as f64, (k / columns) as f64);
        format!("{},{}\n", pitch * x, pitch * y)
    };
    let target: String = (0..columns * rows).map(corner).collect();
    save(&folder.join("target.csv"), &format!("x,y\n{target}"))?;
    save(
        &folder.join("fit.csv"),
        &pictures(truth, &readings, PIXEL, r)?,
    )?;
    save(
        &folder.join("holdout.csv"),
        &pictures(truth, &others, 0.0, r)?,
    )?;
    let [focal, u, v, k1] = LENS;
    let entry = |name: &str| {
        format!(
            "[[measurement]]\nkind = \"pixels\"\nfile = \"{name}.csv\"\nuse = \"{name}\"\nstd = {PIXEL}\ntarget = \"target.csv\"\n\
             camera = {{ fx = {focal}, fy = {focal}, cx = {u}, cy = {v}, k1 = {k1} }}\n\n"
        )
    };
    let text = format!(
        "robot = \"h4\"\n\n{}{}[prior]\nlength = {}\nangle = {}\n",
        entry("fit"),
        entry("holdout"),
        ERRORS[0],
        ERRORS[1]
    );
    let file = folder.join("calibration.toml");
    save(&file, &text)?;
    let (input, robot) = calibrate::read(&file)?;
    let found = calibrate::calibrate(&input, &robot, Settings::default())?;
    for (name, text) in &found.files {
        save(&folder.join(name), text)?;
    }
    Ok(found)
}

/// A motion designed with `robot`, run by the true one and measured.
fn record(robot: &Plant, truth: &Plant, purpose: Purpose, seed: u64) -> Result<Record> {
    let settings = Design::default().with(|set| {
        set.period = PERIODS.0;
        set.ends = Ends::Free;
        set.condition = Condition::Weighted;
        set.starts = Some(1);
        set.seed = seed;
    });
    let motion = design(robot, &settings)?.trajectory;
    let settings = simulate::Settings::default().with(|set| {
        set.seed = seed;
        set.step = 1e-3;
    });
    let run = simulate(truth, &motion.fourier, PERIODS.1, &settings, &|_| {})?;
    let (sensors, _) = Sensors::new(truth, 1.0);
    let measured = measure(&run, &sensors, &settings.effects, seed);
    Ok(to_record(&run, &measured, purpose, PERIODS.0))
}

/// The campaign, with its files in a folder.
pub fn campaign(folder: &Path, seed: u64) -> Result<Figures> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
    let r = &mut ChaCha8Rng::seed_from_u64(seed);
    let truth = Plant::load(&true_robot(folder, r)?.to_string_lossy())?;
    let found = calibrated(folder, &truth, r)?;
    let pose = found.errors(false, true).map(|e| Stats::of(&e));
    let [Some(before), Some(after)] = pose else {
        return Err(Error::Infeasible("no picture is held out".into()));
    };
    let calibrated = Plant::load(&folder.join(write::TOML).to_string_lossy())?;
    let records = [
        record(&calibrated, &truth, Purpose::Fit, 1)?,
        record(&calibrated, &truth, Purpose::Holdout, 2)?,
    ];
    let torque = |robot: &Plant| -> Result<f64> {
        let id = identify(robot, &records, &identify::Settings::default())?;
        Ok(id.validation.holdout.map_or(f64::NAN, |h| h.relative_error))
    };
    Ok(Figures {
        pose: [before, after],
        torque: [
            torque(&Plant::load("h4")?)?,
            torque(&calibrated)?,
            torque(&truth)?,
        ],
    })
}

fn main() -> Result<()> {
    // a number is the number of repetitions of the other examples, and no folder
    let named = std::env::args()
        .nth(1)
        .filter(|a| a.parse::<f64>().is_err());
    let folder = PathBuf::from(named.unwrap_or("target/h4_campaign".into()));
    let figures = campaign(&folder, 7)?;
    let names = ["of the file", "calibrated", "true geometry"];
    println!("\npose held out, mm     median    95 %");
    for (name, s) in names.iter().zip(&figures.pose) {
        println!("{name:<18} {:>9.3} {:>7.3}", 1e3 * s.median, 1e3 * s.p95);
    }
    println!("\ntorque held out, % of the measured one");
    for (name, t) in names.iter().zip(figures.torque) {
        println!("{name:<18} {:>9.2}", 100.0 * t);
    }
    Ok(())
}
