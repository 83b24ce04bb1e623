//! Parallel robots from the JSON of reference models, and where those lie.
#![allow(dead_code)]

use excite::mechanism::delta::Delta;
use excite::mechanism::gough_stewart::{self, GoughStewart, Leg};
use excite::mechanism::h4::{H4, Model};
use excite::mechanism::parallelogram::{self, Chain, motor_frame};
use excite::robot::{Inertia, Limits};
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;
use std::path::PathBuf;

/// The full set of reference cases, where it is at hand.
pub fn checks() -> Option<PathBuf> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let named = std::env::var_os("EXCITE_CHECKS").map(PathBuf::from);
    let shared = std::env::var_os("EXCITE_SHARED").map(|p| PathBuf::from(p).join("checks"));
    named
        .into_iter()
        .chain(shared)
        .chain(["../shared/checks", "../../shared/checks"].map(|p| root.join(p)))
        .find(|p| p.is_dir())
}

/// Model and cases of `sg`, `h4` or `delta`: the full set, or the few that come with the tests.
pub fn reference(name: &str) -> (Value, Vec<Value>) {
    let read = |path: PathBuf| -> Value {
        serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap()
    };
    match checks() {
        Some(folder) => {
            let cases = read(folder.join(format!("{name}_cases.json")));
            let model = read(folder.join(format!("{name}_model.json")));
            (model, cases["cases"].as_array().unwrap().clone())
        }
        None => {
            println!("reference folder absent: only the cases in tests/data");
            let own =
                read(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/parallel.json"));
            (
                own[name]["model"].clone(),
                own[name]["cases"].as_array().unwrap().clone(),
            )
        }
    }
}

pub fn numbers(v: &Value) -> Vec<f64> {
    v.as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect()
}
pub fn vector(v: &Value) -> Vector3<f64> {
    Vector3::from_column_slice(&numbers(v))
}
pub fn matrix(v: &Value) -> Matrix3<f64> {
    let rows: Vec<f64> = v.as_array().unwrap().iter().flat_map(numbers).collect();
    Matrix3::from_row_slice(&rows)
}
pub fn body(v: &Value) -> Inertia {
    Inertia::from_com(v["m"].as_f64().unwrap(), vector(&v["c"]), matrix(&v["Ic"]))
}

pub fn hexapod(model: &Value) -> GoughStewart {
    let legs = model["legs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|l| Leg {
            base: vector(&l["a"]),
            platform: vector(&l["b"]),
            rotation: matrix(&l["R0"]),
            zero: 0.0,
            limits: Limits::default(),
            terms: [0.0; 4],
            force_noise: None,
            cone: [f64::INFINITY; 2],
            cross: Inertia::default(),
            cylinder: body(&l["A"]),
            rod: body(&l["B"]),
        })
        .collect();
    GoughStewart {
        name: "sg".into(),
        legs,
        platform: body(&model["platform"]),
        home: [
            0.0,
            0.0,
            model["neutral_height"].as_f64().unwrap(),
            0.0,
            0.0,
            0.0,
        ],
        gravity: vector(&model["g"]),
        bodies: gough_stewart::Bodies::Legs,
        identical: false,
        axisymmetric: false,
        spherical: false,
        identify: vec![],
    }
}

pub fn chains(model: &Value) -> Vec<Chain> {
    let number = |k: &str| model[k].as_f64().unwrap();
    model["chains"]
        .as_array()
        .unwrap()
        .iter()
        .map(|c| Chain {
            motor: vector(&c["P"]),
            rotation: motor_frame(c["azimuth"].as_f64().unwrap()),
            arm_length: number("L"),
            rod_length: number("l"),
            width: number("w"),
            zero: 0.0,
            attachment: vector(&c["beta"]),
            hinge: c["plate"].as_u64().unwrap() as usize,
            limits: Limits::default(),
            terms: [c["armature"].as_f64().unwrap(), 0.0, 0.0, 0.0],
            torque_noise: None,
            arm: body(&c["arm"]),
            rods: [body(&c["rods"][0]), body(&c["rods"][1])],
        })
        .collect()
}

pub fn h4(model: &Value) -> H4 {
    H4 {
        name: "h4".into(),
        chains: chains(model),
        hinges: [vector(&model["hinges"][0]), vector(&model["hinges"][1])],
        platform: body(&model["D"]),
        bars: [body(&model["bars"][0]), body(&model["bars"][1])],
        home: [0.0, 0.0, -0.45, 0.0],
        gravity: vector(&model["g"]),
        model: Model::Rods,
        bodies: parallelogram::Bodies::Rods,
        identical: false,
        identify: vec![],
    }
}

pub fn delta(model: &Value) -> Delta {
    Delta {
        name: "delta".into(),
        chains: chains(model),
        platform: body(&model["D"]),
        home: [0.0, 0.0, -0.45],
        gravity: vector(&model["g"]),
        bodies: parallelogram::Bodies::Rods,
        identical: false,
        identify: vec![],
    }
}
