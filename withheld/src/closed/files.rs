//! The files of a case: what the diagnosis may see, and apart from it the answers.

use super::case::{Case, Log};
use super::hexapod::Body;
use super::machine::Machine;
use crate::random::Random;
use nalgebra::{Matrix3, Vector3};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// Writes the folder of a case.
pub fn case(case: &Case, seed: u64, folder: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let mut rng = Random::new(seed, case.plan.index, 230);
    let text = robot(&case.machine, case.legs_known, 1.0, &mut rng);
    std::fs::write(folder.join("robot.toml"), text)?;
    let mut experiment = String::from("robot = \"robot.toml\"\n");
    for (record, log) in case.records.iter().zip(&case.logs) {
        let used = if record.fit { "fit" } else { "holdout" };
        let _ = write!(
            experiment,
            "\n[[record]]\nlog = \"{}.csv\"\nuse = \"{used}\"\nperiod = {:?}\n",
            record.name, record.period
        );
        std::fs::write(folder.join(format!("{}.csv", record.name)), csv(log))?;
    }
    std::fs::write(folder.join("experiment.toml"), experiment)
}

fn csv(log: &Log) -> String {
    let mut s = String::from("t,q1,q2,q3,q4,q5,q6,tau1,tau2,tau3,tau4,tau5,tau6\n");
    for ((t, q), f) in log.t.iter().zip(&log.q).zip(&log.force) {
        let _ = write!(s, "{t:.4}");
        q.iter().for_each(|v| {
            let _ = write!(s, ",{v:.7}");
        });
        f.iter().for_each(|v| {
            let _ = write!(s, ",{v:.4}");
        });
        s.push('\n');
    }
    s
}

fn list(v: &[f64]) -> String {
    let numbers: Vec<String> = v.iter().map(|v| format!("{v:.9}")).collect();
    format!("[{}]", numbers.join(", "))
}

fn entry(b: &Body) -> String {
    let i = &b.tensor;
    format!(
        "{{ mass = {:.8}, com = {}, inertia = {} }}",
        b.mass,
        list(b.centre.as_slice()),
        list(&[
            i[(0, 0)],
            i[(0, 1)],
            i[(0, 2)],
            i[(1, 1)],
            i[(1, 2)],
            i[(2, 2)]
        ])
    )
}

/// A body as a drawing or an earlier identification has it: mass and size off by `error`.
fn doubtful(b: &Body, error: f64, rng: &mut Random) -> Body {
    let (mass, size) = (rng.factor(error), rng.factor(0.5 * error));
    let shift = Vector3::new(rng.normal(), rng.normal(), rng.normal()) * (0.03 * error);
    Body {
        mass: b.mass * mass,
        centre: b.centre * size + shift,
        tensor: Matrix3::from(b.tensor * (mass * size * size)),
    }
}

/// The robot file, off by `doubt` times what is usual; 0: the machine as it is.
pub fn robot(m: &Machine, legs_known: bool, doubt: f64, rng: &mut Random) -> String {
    let error = doubt * if m.identified { 0.004 } else { 0.05 };
    let z = m.home[2];
    let terms = match m.offsets {
        true => r#"["viscous", "coulomb", "offset"]"#,
        false => r#"["viscous", "coulomb"]"#,
    };
    let mut s = format!(
        "name = \"hexapod\"\nmechanism = \"gough-stewart\"\nprior = \"{}\"\nhome = {}\nbodies = \"{}\"\n\
         [workspace]\nx = [-0.12, 0.12]\ny = [-0.12, 0.12]\nz = [{:.4}, {:.4}]\ntilt = 0.4\nyaw = [-0.35, 0.35]\n\
         velocity = 0.8\nacceleration = 6.0\nangular_velocity = 2.5\nangular_acceleration = 15.0\n\
         [platform]\n",
        if m.identified { "identified" } else { "cad" },
        list(&m.home),
        if legs_known { "legs" } else { "platform" },
        z - 0.12,
        z + 0.12,
    );
    let p = doubtful(&m.platform, error, rng);
    let body = entry(&p);
    let inner = body.trim_start_matches("{ ").trim_end_matches(" }");
    s.push_str(
        &inner
            .replace(", com = ", "\ncom = ")
            .replace(", inertia = ", "\ninertia = "),
    );
    s.push('\n');
    for (leg, zero) in m.legs.iter().zip(&m.zero) {
        let rows: Vec<String> = (0..3)
            .map(|r| list(&[leg.frame[(r, 0)], leg.frame[(r, 1)], leg.frame[(r, 2)]]))
            .collect();
        let _ = write!(
            s,
            "[[leg]]\nbase = {}\nplatform = {}\nrotation = [{}]\nzero = {zero:.9}\ncone = [1.2, 1.2]\n",
            list(leg.base.as_slice()),
            list(leg.platform.as_slice()),
            rows.join(", ")
        );
        if legs_known {
            let [c, r] = [&leg.cylinder, &leg.rod].map(|b| entry(&doubtful(b, error, rng)));
            let _ = write!(s, "cylinder = {c}\nrod = {r}\n");
        }
    }
    for (j, d) in m.drives.iter().enumerate() {
        let [dry, viscous, offset] = match m.identified {
            true => [0.03, 0.04, 0.3],
            false => [0.15, 0.2, 1.0],
        }
        .map(|e| doubt * e);
        let _ = write!(
            s,
            "[[joint]]\nname = \"leg{}\"\nposition = [-0.05, 0.5]\nvelocity = 1.2\nacceleration = 12.0\neffort = 1200.0\n\
             torque_noise = {:.3}\nposition_resolution = {:e}\nviscous = {:.4}\ncoulomb = {:.4}\noffset = {:.4}\n\
             identify = {terms}\n",
            j + 1,
            m.noise[0].hypot(m.noise[1]),
            m.step,
            d.viscous * rng.factor(viscous),
            d.dry * rng.factor(dry),
            d.offset
                + if m.offsets {
                    offset * rng.normal()
                } else {
                    0.0
                },
        );
    }
    s
}

/// Names that are as right as the effect's own.
fn equivalents(name: &str) -> Vec<&str> {
    match name {
        "all_leg_geometry" => vec!["leg_geometry"],
        // the platform is the last link
        "payload" => vec!["payload", "link_inertia"],
        // a Coulomb asymmetry is an offset
        "friction_asymmetry" => vec!["friction_asymmetry", "torque_offset"],
        other => vec![other],
    }
}

/// The answers to one case.
pub fn truth(case: &Case) -> Value {
    let legs: Vec<String> = case.legs.iter().map(|j| format!("leg{}", j + 1)).collect();
    let effects: Vec<Value> = case
        .plan
        .effect
        .iter()
        .map(|name| {
            json!({
                "name": name,
                "joints": legs,
                "equivalent": equivalents(name),
                "tolerated": [],
                "judged": "frozen",
                "level": case.level,
                "parameters": case.size,
            })
        })
        .collect();
    json!({
        "case": format!("case_{:03}", case.plan.index),
        "kind": case.plan.kind,
        "robot": "hexapod",
        "prior": if case.machine.identified { "identified" } else { "cad" },
        "offsets": case.machine.offsets,
        "effects": effects,
        "nuisance": if case.machine.identified { json!([]) } else {
            json!(["link_inertia", "viscous_friction", "coulomb_friction", "rotor_inertia", "torque_offset"])
        },
        "oracle": { "holdout": {} },
    })
}
