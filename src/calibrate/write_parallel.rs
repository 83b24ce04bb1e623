//! The calibrated parallel robot: its file with other dimensions and nothing else changed but its layout.

use super::open::Opened;
use super::parallel::Parallel;
use crate::error::{Error, Result};
use crate::mechanism::dimensions::Dimensions;
use crate::mechanism::parallelogram::motor_frame_about;
use nalgebra::Vector3;
use toml::{Table, Value};

/// Name of the file that refers to it, where the robot was read from one.
pub const TOML: &str = "robot.toml";

fn numbers(v: &Vector3<f64>) -> Value {
    Value::Array(v.iter().map(|&x| Value::Float(x)).collect())
}

/// The tables of an array of tables; made where there are none.
fn tables<'a>(file: &'a mut Table, key: &str, count: usize) -> Vec<&'a mut Table> {
    let empty = || Value::Array(vec![Value::Table(Table::new()); count]);
    let list = file.entry(key).or_insert_with(empty).as_array_mut();
    list.into_iter()
        .flatten()
        .filter_map(Value::as_table_mut)
        .collect()
}

/// Removes what all chains share, since every one now has its own.
fn unshare(file: &mut Table, key: &str, names: &[&str]) {
    if let Some(all) = file.get_mut(key).and_then(Value::as_table_mut) {
        names.iter().for_each(|n| drop(all.remove(*n)));
    }
}

/// File of the calibrated robot: its name and text. `x` are the errors of the dimensions.
///
/// # Errors
/// A robot without a text that its dimensions could be written into.
pub fn robot(p: &Parallel, opened: &Opened, x: &[f64]) -> Result<Vec<(&'static str, String)>> {
    let none = || {
        Error::Infeasible(format!(
            "{}: no robot file to write into",
            opened.plant.name()
        ))
    };
    let text = opened.toml.as_deref().ok_or_else(none)?;
    let mut file: Table = toml::from_str(text).map_err(|_| none())?;
    match &p.dimensions {
        Dimensions::Legs(legs) => {
            unshare(&mut file, "legs", &["base", "platform", "zero"]);
            for (i, t) in tables(&mut file, "leg", legs.len()).into_iter().enumerate() {
                let e = &x[7 * i..7 * i + 7];
                let base = legs[i].base + Vector3::new(e[0], e[1], e[2]);
                let platform = legs[i].platform + Vector3::new(e[3], e[4], e[5]);
                t.insert("base".into(), numbers(&base));
                t.insert("platform".into(), numbers(&platform));
                t.insert("zero".into(), (legs[i].zero + e[6]).into());
            }
        }
        Dimensions::Chains(chains, hinges) => {
            let names = ["motors", "attachments", "arm_length", "rod_length", "zero"];
            unshare(&mut file, "chains", &names);
            for (i, t) in tables(&mut file, "chain", chains.len())
                .into_iter()
                .enumerate()
            {
                let (e, c) = (&x[11 * i..11 * i + 11], &chains[i]);
                let azimuth = match t.get("azimuth").and_then(Value::as_float) {
                    Some(a) => a,
                    None => c.rotation[(1, 2)].atan2(c.rotation[(0, 2)]),
                };
                let tilted = c.tilted(e);
                let axis = tilted.column(0).into_owned();
                let frame = motor_frame_about(&axis, azimuth).ok_or_else(none)?;
                // the file says where the arm at zero points by the azimuth alone; what is left goes to the offset
                let r = tilted.column(2);
                let rest = (-r.dot(&frame.column(1))).atan2(r.dot(&frame.column(2)));
                t.insert("azimuth".into(), azimuth.into());
                t.insert("axis".into(), numbers(&axis));
                t.insert(
                    "motor".into(),
                    numbers(&(c.motor + Vector3::new(e[0], e[1], e[2]))),
                );
                t.insert("zero".into(), (c.zero + e[5] + rest).into());
                t.insert("arm_length".into(), (c.arm + e[6]).into());
                t.insert("rod_length".into(), (c.rod + e[7]).into());
                let end = c.attachment + Vector3::new(e[8], e[9], e[10]);
                t.insert("attachment".into(), numbers(&end));
            }
            let at = 11 * chains.len();
            for (k, t) in tables(&mut file, "bar", hinges.len())
                .into_iter()
                .enumerate()
            {
                if let Some(h) = hinges.get(k) {
                    let e = &x[at + 3 * k..at + 3 * k + 3];
                    t.insert(
                        "hinge".into(),
                        numbers(&(h + Vector3::new(e[0], e[1], e[2]))),
                    );
                }
            }
        }
    }
    let out = toml::to_string(&file).map_err(|e| Error::Infeasible(e.to_string()))?;
    Ok(vec![(
        TOML,
        format!("# Calibrated. SI units: rad, m, s, kg, N, N m.\n{out}"),
    )])
}
