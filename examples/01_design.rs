//! The main job as a library call: a robot, a trajectory, a proof.

use excite::design::{Settings, design};
use excite::identifiability::assess;
use excite::{Error, Plant};

fn main() -> Result<(), Error> {
    let plant = Plant::load("ur10e")?;
    let settings = Settings::default().with(|set| set.starts = Some(4));
    let result = design(&plant, &settings)?;

    let report = assess(&result.plant, Some(&result.trajectory))?;
    let Some(excitation) = &report.excitation else {
        return Ok(());
    };
    println!("base parameters   {}", report.base.count());
    println!("condition number  {:.3}", excitation.condition.invariant);
    println!("inside all limits {}", excitation.certificate.satisfied);
    for p in excitation.predictions.iter().take(3) {
        println!(
            "hardest           {} (std {:.2e} {})",
            p.combination, p.std, p.unit
        );
    }
    Ok(())
}
