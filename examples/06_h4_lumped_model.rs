//! What the lumped model of an H4 leaves: its 14 parameters, identified without noise from torques
//! of the model in which every rod is a body, and the torque error that remains; and the same with
//! all rods, which remains with none.
//!
//! `cargo run --release --example 06_h4_lumped_model`

use excite::Result;
use excite::dynamics::Samples;
use excite::mechanism::{Mechanism, bundled};
use nalgebra::{DMatrix, DVector};

/// Random states over the workspace with up to 30 m/s².
fn states(mechanism: &mut Mechanism, seed: u64) -> Samples {
    let rates = [[1.5, 30.0], [1.5, 30.0], [1.5, 30.0], [3.5, 80.0]];
    for (limits, [velocity, acceleration]) in mechanism.workspace.iter_mut().zip(rates) {
        limits.velocity = velocity;
        limits.acceleration = acceleration;
    }
    mechanism.random_states(1000, seed)
}

/// Parameters that explain `tau` best; of least norm where some cannot be told apart.
fn identify(mechanism: &Mechanism, x: &Samples, tau: &[f64]) -> Result<Vec<f64>> {
    let w = mechanism.regressor(x)?;
    let w = DMatrix::from_fn(w.nrows(), w.ncols(), |i, k| w[(i, k)]);
    // columns of size one, so that kg and kg m² count alike
    let size: Vec<f64> = w.column_iter().map(|c| c.norm().max(1e-12)).collect();
    let scaled = DMatrix::from_fn(w.nrows(), w.ncols(), |i, k| w[(i, k)] / size[k]);
    let phi = scaled
        .svd(true, true)
        .solve(&DVector::from_column_slice(tau), 1e-7)
        .map_err(|e| excite::Error::Infeasible(e.into()))?;
    Ok(phi.iter().zip(size).map(|(p, s)| p / s).collect())
}

fn relative(own: &[f64], truth: &[f64]) -> f64 {
    let norm = |x: &mut dyn Iterator<Item = f64>| x.map(|v| v * v).sum::<f64>().sqrt();
    norm(&mut own.iter().zip(truth).map(|(a, b)| a - b)) / norm(&mut truth.iter().copied())
}

fn main() -> Result<()> {
    let text = bundled::find("h4").map_or("", |b| b.toml);
    let mut rods = Mechanism::from_toml_str(text, "h4")?;
    let (fit, other) = (states(&mut rods, 1), states(&mut rods, 2));
    let (tau_fit, tau_other) = (rods.nominal_torque(&fit)?, rods.nominal_torque(&other)?);
    println!("torque error against all rods, accelerations up to 30 m/s^2, no noise\n");
    println!("model            parameters   nominal values   identified     on other states");
    for model in ["lumped", "lumped-gravity", "rods"] {
        let file = text.replace("model = \"rods\"", &format!("model = \"{model}\""));
        let mechanism = Mechanism::from_toml_str(&file, "h4")?;
        let phi = identify(&mechanism, &fit, &tau_fit)?;
        println!(
            "{model:<16} {:>10}   {:>12.1e} % {:>10.1e} % {:>17.1e} %",
            phi.len(),
            100.0 * relative(&mechanism.nominal_torque(&fit)?, &tau_fit),
            100.0 * relative(&mechanism.torque(&fit, &phi)?, &tau_fit),
            100.0 * relative(&mechanism.torque(&other, &phi)?, &tau_other),
        );
        if model == "lumped-gravity" {
            println!("    nominal values with the weight of the arms: the figure quoted as 6 %");
        }
        if model == "lumped" {
            for (p, value) in mechanism.parameters.list.iter().zip(&phi) {
                println!(
                    "    {:<18} {value:>8.4} {:<7} nominal {:.4}",
                    p.name, p.unit, p.value
                );
            }
        }
    }
    Ok(())
}
