//! Kinematic calibration of an H4 from vision, from choosing postures to the calibrated file (Renaud et al. 2006):
//! postures are chosen, a robot with errors of 2 mm and 5 mrad is seen by a camera with 0.3 mm and 0.02° of noise, and
//! its geometry is identified by the inverse kinematic model, with and without the orientation residual.
//!
//! ```text
//! cargo run --release --example 08_h4_calibration [FOLDER]
//! excite calibrate FOLDER/calibration.toml --output FOLDER/calibrated
//! excite design FOLDER/calibrated/robot.toml --output FOLDER/design       # and on to the dynamics: 07_h4_identification
//! ```

use excite::calibrate::{self, Kind, Settings, Stats, Tolerances, poses};
use std::path::PathBuf;

fn main() -> excite::Result<()> {
    // a number is the number of repetitions of the other examples, and no folder
    let named = std::env::args()
        .nth(1)
        .filter(|a| a.parse::<f64>().is_err());
    let folder = PathBuf::from(named.unwrap_or("target/h4_calibration".into()));
    std::fs::create_dir_all(&folder).map_err(|e| excite::Error::io(&folder, e))?;
    let robot = calibrate::open("h4", None)?;
    let noise = [3e-4, 0.02_f64.to_radians()];
    let request = poses::Request {
        count: 45,
        kind: Kind::Pose,
        points: Vec::new(),
        region: None,
        sight: None,
        std: noise,
        tolerances: Tolerances::default(),
        candidates: 5000,
        seed: 1,
    };
    let chosen = poses::choose(&robot, &request)?;
    println!(
        "45 postures: tool known to {:.3} mm, by random ones to {:.3} mm",
        1e3 * chosen.predicted,
        1e3 * chosen.random_middle()
    );
    let seen = poses::rehearse(&robot, &request, &chosen, 7)?;
    let file = folder.join("calibration.toml");
    let text = poses::toml("h4", None, &request, "measured.csv");
    for (path, text) in [(folder.join("measured.csv"), seen), (file.clone(), text)] {
        std::fs::write(&path, text).map_err(|e| excite::Error::io(&path, e))?;
    }
    let (input, robot) = calibrate::read(&file)?;
    for (name, orientation) in [
        ("inverse model alone", false),
        ("with the orientation residual", true),
    ] {
        let settings = Settings::default().with(|set| set.orientation = orientation);
        let found = calibrate::calibrate(&input, &robot, settings)?;
        let [before, after] = found.errors(false, true).map(|e| Stats::of(&e));
        if let (Some(a), Some(b)) = (before, after) {
            println!(
                "{name}: held out, median {:.3} -> {:.3} mm, 95 % {:.3} -> {:.3} mm; {} of {} can be told",
                1e3 * a.median,
                1e3 * b.median,
                1e3 * a.p95,
                1e3 * b.p95,
                found.identifiability.rank,
                found.identifiability.total
            );
        }
    }
    Ok(())
}
