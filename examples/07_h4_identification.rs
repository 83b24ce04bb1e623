//! An H4 simulated with a body for every rod, encoder steps and torque noise, then identified from its motor
//! positions and torques alone: with every rod, and with lumped forearms (docs/parallel.md). Its masses, tensors and
//! friction are 8 to 20 % off those of the robot file that the identification starts from.
//!
//! `cargo run --release --example 07_h4_identification`

use excite::design::parts::Condition;
use excite::design::{Settings as Design, design};
use excite::identify::{Settings, identify};
use excite::log::Record;
use excite::log::parts::Purpose;
use excite::mechanism::{Mechanism, bundled};
use excite::simulate::parts::Sensors;
use excite::simulate::{Run, Settings as Simulation, measure, simulate, to_record};
use excite::trajectory::parts::Ends;
use excite::{Plant, Result};

/// Period of the motions, s.
const PERIOD: f64 = 2.0;

/// What the simulated robot has where the robot file says something else.
const TRUTH: [(&str, &str); 8] = [
    ("mass = 0.45\n", "mass = 0.52\n"),
    ("mass = 0.22\n", "mass = 0.19\n"),
    ("mass = 0.55,", "mass = 0.62,"),
    ("mass = 0.062,", "mass = 0.072,"),
    (
        "[0.0033, 0.0, 0.0, 0.0033, 0.0, 0.0005]",
        "[0.0036, 0.0, 0.0, 0.0036, 0.0, 0.0006]",
    ),
    (
        "[0.00125, 0.0, 0.0, 0.00125,",
        "[0.00135, 0.0, 0.0, 0.00135,",
    ),
    ("viscous = 0.05", "viscous = 0.06"),
    ("coulomb = 0.25", "coulomb = 0.22"),
];

/// A base parameter.
pub struct Parameter {
    pub combination: String,
    pub truth: f64,
    pub identified: f64,
    /// standard deviation that identification states, percent of the identified value
    pub std: f64,
}

/// What a model leaves of the torque of a motion that was not fitted, as a fraction of it.
pub struct TorqueError {
    pub model: &'static str,
    pub parameters: usize,
    /// of the measured torque, both as filtered; it contains the sensors' noise
    pub measured: f64,
    /// of the torque that the drives applied, unfiltered and without noise, along the true motion
    pub applied: f64,
}

pub struct Figures {
    /// base parameters of the model with every rod
    pub parameters: Vec<Parameter>,
    pub errors: Vec<TorqueError>,
}

/// The bundled H4 with these replacements in its file.
fn h4(replacements: &[(&str, &str)]) -> Result<Plant> {
    let mut text = bundled::find("h4").map_or("", |b| b.toml).to_string();
    for (from, to) in replacements {
        assert!(text.contains(from), "`{from}` stands in the file");
        text = text.replace(from, to);
    }
    let mechanism = Mechanism::from_toml_str(&text, "h4")?;
    Ok(Plant::from(mechanism))
}

/// A designed motion, run by the true robot and measured.
fn record(
    nominal: &Plant,
    truth: &Plant,
    purpose: Purpose,
    seed: u64,
    periods: u32,
) -> Result<(Run, Record)> {
    let settings = Design::default().with(|set| {
        set.period = PERIOD;
        set.ends = Ends::Free;
        set.condition = Condition::Weighted;
        set.starts = Some(2);
        set.seed = seed;
    });
    let motion = design(nominal, &settings)?.trajectory;
    let settings = Simulation::default().with(|set| {
        set.seed = seed;
        set.step = 1e-3;
    });
    let run = simulate(truth, &motion.fourier, periods, &settings, &|_| {})?;
    let (sensors, _) = Sensors::new(truth, 1.0);
    let measured = measure(&run, &sensors, &settings.effects, seed);
    let record = to_record(&run, &measured, purpose, PERIOD);
    Ok((run, record))
}

/// All figures, from `periods` periods of a motion that is fitted and one that is not.
pub fn figures(periods: u32) -> Result<Figures> {
    let (nominal, truth) = (h4(&[])?, h4(&TRUTH)?);
    let (_, fit) = record(&nominal, &truth, Purpose::Fit, 1, periods)?;
    let (other, holdout) = record(&nominal, &truth, Purpose::Holdout, 2, periods)?;
    let records = [fit, holdout];
    let mut figures = Figures {
        parameters: Vec::new(),
        errors: Vec::new(),
    };
    for model in ["rods", "lumped-gravity", "lumped"] {
        let plant = h4(&[("model = \"rods\"", &format!("model = \"{model}\""))])?;
        let id = identify(&plant, &records, &Settings::default())?;
        if model == "rods" {
            let exact = id.base.project(&truth.values());
            figures.parameters = (0..id.base.count())
                .map(|a| Parameter {
                    combination: id.base.combination(a),
                    truth: exact[a],
                    identified: id.pi_consistent[a],
                    std: 100.0 * id.std[a] / id.pi_consistent[a].abs(),
                })
                .collect();
        }
        let predicted = plant.torque(&other.motion, &id.phi)?;
        let left = predicted
            .iter()
            .zip(&other.tau)
            .map(|(p, t)| (p - t).powi(2));
        let all = other.tau.iter().map(|t| t * t);
        figures.errors.push(TorqueError {
            model,
            parameters: id.base.count(),
            measured: id.validation.holdout.map_or(f64::NAN, |h| h.relative_error),
            applied: (left.sum::<f64>() / all.sum::<f64>()).sqrt(),
        });
    }
    Ok(figures)
}

fn main() -> Result<()> {
    let figures = figures(30)?;
    let (known, rest): (Vec<_>, Vec<_>) = figures.parameters.iter().partition(|p| p.std < 2.0);
    println!(
        "base parameters known to 2 % or better (stated standard deviation): {} of {}",
        known.len(),
        figures.parameters.len()
    );
    println!(
        "{:>10} {:>11} {:>7} {:>8}   combination",
        "true", "identified", "off, %", "std, %"
    );
    for p in known {
        let name: String = p.combination.chars().take(60).collect();
        let off = 100.0 * (p.identified / p.truth - 1.0);
        println!(
            "{:>10.5} {:>11.5} {off:>7.2} {:>8.2}   {name}",
            p.truth, p.identified, p.std
        );
    }
    println!("the others, all but nothing beside them:");
    for p in rest {
        let name: String = p.combination.chars().take(60).collect();
        println!(
            "{:>10.5} {:>11.5} {:>16}   {name}",
            p.truth, p.identified, ""
        );
    }
    println!("\ntorque error on a motion that was not fitted, percent");
    println!(
        "{:<16} {:>15} {:>18} {:>18}",
        "model", "base parameters", "of measured torque", "of applied torque"
    );
    for e in &figures.errors {
        println!(
            "{:<16} {:>15} {:>18.2} {:>18.2}",
            e.model,
            e.parameters,
            100.0 * e.measured,
            100.0 * e.applied
        );
    }
    Ok(())
}
