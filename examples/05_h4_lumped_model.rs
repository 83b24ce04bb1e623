//! What the lumped model of an H4 leaves: its 14 parameters, identified without noise from torques
//! of the model in which every rod is a body, and the torque error that remains; and the same with
//! all rods, which remains with none.
//!
//! `cargo run --release --example 05_h4_lumped_model`

use excite::Result;
use excite::dynamics::Samples;
use excite::mechanism::{Mechanism, bundled};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// A multisine of the platform that reaches 30 m/s² and ±8 cm, ±0.4 rad.
fn motion(mechanism: &Mechanism, shift: f64) -> Samples {
    let (count, period, harmonics) = (1000, 1.5, 5);
    let mut x = Samples::zeros(4, count);
    for k in 0..4 {
        let size = if k == 3 { 0.4 } else { 0.08 };
        for s in 0..count {
            let t = s as f64 / count as f64 * period;
            let at = k * count + s;
            x.q[at] = mechanism.home[k];
            for h in 1..=harmonics {
                let w = TAU * f64::from(h) / period;
                let a = size / f64::from(h * h);
                let phase = shift + 2.4 * f64::from(h * h) + 1.7 * k as f64 * f64::from(h);
                x.q[at] += 0.7 * a * (w * t + phase).sin();
                x.qd[at] += 0.7 * a * w * (w * t + phase).cos();
                x.qdd[at] -= 0.7 * a * w * w * (w * t + phase).sin();
            }
        }
    }
    x
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
    let rods = Mechanism::from_toml_str(text, "h4")?;
    let (fit, other) = (motion(&rods, 0.0), motion(&rods, 1.0));
    let (tau_fit, tau_other) = (rods.nominal_torque(&fit)?, rods.nominal_torque(&other)?);
    let top = (0..3 * fit.count).fold(0.0f64, |m, i| m.max(fit.qdd[i].abs()));
    println!("accelerations up to {top:.0} m/s^2, no noise\n");
    println!("model            parameters   torque error   on another motion");
    for model in ["lumped", "lumped-gravity", "rods"] {
        let file = text.replace("model = \"rods\"", &format!("model = \"{model}\""));
        let mechanism = Mechanism::from_toml_str(&file, "h4")?;
        let phi = identify(&mechanism, &fit, &tau_fit)?;
        println!(
            "{model:<16} {:>10}   {:>10.2e} %   {:>10.2e} %",
            phi.len(),
            100.0 * relative(&mechanism.torque(&fit, &phi)?, &tau_fit),
            100.0 * relative(&mechanism.torque(&other, &phi)?, &tau_other),
        );
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
