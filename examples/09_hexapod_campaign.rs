//! The whole campaign of a pneumatic hexapod whose log holds chamber pressures: design the motion for the load, rehearse it,
//! record it empty and loaded, identify the load, and ask what of the model is wrong (docs/load.md). The simulated machine is not
//! the one in the robot file: its platform is 5 % heavier, its friction is higher, and one leg sticks.
//!
//! `cargo run --release --example 09_hexapod_campaign [FOLDER]`

use excite::design::design;
use excite::design::parts::Question;
use excite::diagnose::diagnose;
use excite::identifiability::assess;
use excite::load;
use excite::log::Experiment;
use excite::mechanism::{Mechanism, bundled};
use excite::moves::rehearse;
use excite::robot::Inertia;
use excite::simulate::parts::Field;
use excite::simulate::parts::Sensors;
use excite::simulate::record::{Columns, write_log};
use excite::simulate::{Settings as Simulation, measure, simulate};
use excite::trajectory::Trajectory;
use excite::{Plant, Result};
use std::path::{Path, PathBuf};

/// Mass, centre of mass, tensor about it: what the machine carries.
const LOAD: [f64; 10] = [
    22.26, 0.03, -0.02, 0.12, 0.26, 0.012, -0.02, 0.29, 0.015, 0.33,
];
/// Cylinders of 50 mm with rods of 20 mm.
const PISTON: (&str, &str) = (
    "effort = 900.0\n",
    "effort = 900.0\npiston = [1.963e-3, 1.649e-3]\n",
);
/// What the machine has where the file says something else.
const TRUTH: [(&str, &str); 3] = [
    ("mass = 30.0", "mass = 31.5"),
    ("viscous = 80.0", "viscous = 95.0"),
    ("coulomb = 25.0", "coulomb = 32.0"),
];
/// Breakaway friction beyond Coulomb and its speed, of one leg.
const STICKING: &str = "leg4=40,0.015";

/// What was found.
pub struct Figures {
    /// mass, centre of mass, tensor: what was expected of one standard deviation before the run
    pub expected: [Option<f64>; 10],
    /// what was found, and one standard deviation of it
    pub found: [f64; 10],
    pub std: [f64; 10],
    /// effects that the diagnosis claims, with their legs
    pub claims: Vec<(String, Vec<String>)>,
}

fn hexapod(changes: &[(&str, &str)]) -> Result<(String, Plant)> {
    let mut text = bundled::find("hexapod").map_or("", |b| b.toml).to_string();
    for (from, to) in changes {
        assert!(text.contains(from), "`{from}` stands in the file");
        text = text.replacen(from, to, 1);
    }
    let plant = Plant::from(Mechanism::from_toml_str(&text, "hexapod")?);
    Ok((text, plant))
}

/// The machine on a motion, as its log.
fn record(
    truth: &Plant,
    motion: &Trajectory,
    load: Option<Inertia>,
    seed: u64,
    path: &Path,
) -> Result<()> {
    let mut settings = Simulation::default().with(|set| {
        set.rate = 500.0;
        set.step = 1e-3;
        set.seed = seed;
    });
    settings.effects.payload = load;
    settings.effects.set(truth, Field::Stribeck, STICKING)?;
    let run = simulate(truth, &motion.fourier, motion.periods, &settings, &|_| {})?;
    let (sensors, _) = Sensors::new(truth, 1.0);
    let measured = measure(&run, &sensors, &settings.effects, seed);
    let columns = Columns {
        derivatives: false,
        pose: false,
        pressures: Some(4e5),
    };
    write_log(path, true, truth, &run, &measured, columns)
}

/// The campaign in a folder, with `periods` periods of 5 s a record.
pub fn campaign(folder: &Path, periods: u32) -> Result<Figures> {
    // 1. the robot file
    let (text, plant) = hexapod(&[PISTON])?;
    let mut changes = vec![PISTON];
    changes.extend(TRUTH);
    let (_, truth) = hexapod(&changes)?;
    let write = |name: &str, text: &str| {
        std::fs::write(folder.join(name), text).expect("the folder can be written to")
    };
    write("robot.toml", &text);
    // 2. a motion for the load, and another that is only predicted
    let settings = |seed: u64| {
        Question::Load.settings().with(|set| {
            set.periods = periods;
            set.payload = Some(LOAD);
            set.derate = 0.9;
            set.starts = Some(2);
            set.seed = seed;
        })
    };
    let motion = design(&plant, &settings(1))?.trajectory;
    let other = design(&plant, &settings(2))?.trajectory;
    let report = assess(&plant, Some(&motion))?;
    let expected = report.load.map_or([None; 10], |l| l.shared);
    // 3. rehearse it: what the drives will bear
    for speed in rehearse(&plant, &motion, 500.0, &[0.3, 1.0])?.speeds {
        if let Some((leg, what, used)) = speed.most() {
            println!(
                "rehearsed at {:.0} %: {what} of {leg} at {:.0} % of its limit",
                100.0 * speed.speed,
                100.0 * used
            );
        }
    }
    // 4. record: empty, another motion, loaded
    let load = Inertia::from_quantities(&LOAD);
    record(&truth, &motion, None, 1, &folder.join("empty.csv"))?;
    record(&truth, &other, None, 2, &folder.join("holdout.csv"))?;
    record(&truth, &motion, Some(load), 3, &folder.join("loaded.csv"))?;
    let entry = |log: &str, purpose: &str, payload: &str| {
        format!(
            "\n[[record]]\nlog = \"{log}.csv\"\nuse = \"{purpose}\"\nperiod = 5.0\npayload = \"{payload}\"\n"
        )
    };
    let experiment = format!(
        "robot = \"robot.toml\"\n{}{}{}",
        entry("empty", "fit", "none"),
        entry("holdout", "holdout", "none"),
        entry("loaded", "fit", "unknown")
    );
    write("experiment.toml", &experiment);
    // 5. the load
    let mut experiment = Experiment::read(folder.join("experiment.toml"))?;
    let found = load::identify(&experiment, &load::Settings::default())?;
    // 6. what of the model is wrong
    experiment.press(load::Settings::default().atmosphere)?;
    let diagnosis = diagnose(&experiment, &Default::default(), &|_| {})?;
    println!("diagnosis: {:?}", diagnosis.verdict);
    let claims = diagnosis.findings.iter().filter(|f| f.is_claim());
    Ok(Figures {
        expected,
        found: found.load().values(),
        std: found.load().stds(),
        claims: claims
            .map(|f| (f.effect.to_string(), f.joints.clone()))
            .collect(),
    })
}

fn main() -> Result<()> {
    // a number is for the examples that repeat themselves at random
    let folder = std::env::args()
        .nth(1)
        .filter(|a| a.parse::<f64>().is_err());
    let folder = match folder {
        Some(folder) => PathBuf::from(folder),
        None => std::env::temp_dir().join("hexapod_campaign"),
    };
    std::fs::create_dir_all(&folder).expect("the folder can be made");
    let figures = campaign(&folder, 12)?;
    println!(
        "{:<10} {:>9} {:>9} {:>9} {:>9}",
        "", "truth", "found", "±", "expected"
    );
    let names = ["mass", "x", "y", "z", "xx", "xy", "xz", "yy", "yz", "zz"];
    for (k, name) in names.iter().enumerate() {
        println!(
            "{name:<10} {:>9.4} {:>9.4} {:>9.4} {:>9}",
            LOAD[k],
            figures.found[k],
            1.96 * figures.std[k],
            figures.expected[k].map_or("-".into(), |s| format!("{:.4}", 1.96 * s))
        );
    }
    for (effect, legs) in &figures.claims {
        println!("claimed: {effect} {}", legs.join(", "));
    }
    println!("logs and files in {}", folder.display());
    Ok(())
}
