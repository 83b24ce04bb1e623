//! `load.json`.

use super::body::LoadBody;
use super::{Identified, Method, controller};
use serde_json::{Value, json};

/// Which of mass, centre and tensor are known, from which of the ten are.
pub(super) fn known(body: &LoadBody) -> [bool; 10] {
    let k = &body.known;
    let centre = k[0];
    let tensor = centre && k[1] && k[2] && k[3];
    std::array::from_fn(|i| match i {
        0 => k[0],
        1..=3 => centre && k[i],
        _ => tensor && k[i],
    })
}

/// Which of mass, centre and tensor are determined: within half of the mass; a decimetre of the centre; and half of the
/// tensor's size (that of its row and column), at 95 %.
pub fn determined(body: &LoadBody) -> [bool; 10] {
    const FAR: f64 = 0.1;
    let (v, s, k) = (body.values(), body.stds(), known(body));
    const PAIRS: [(usize, usize); 6] = [(4, 4), (4, 7), (4, 9), (7, 7), (7, 9), (9, 9)];
    std::array::from_fn(|i| {
        let size = match i {
            0 => 0.5 * v[0].abs(),
            1..=3 => FAR,
            _ => {
                let (a, b) = PAIRS[i - 4];
                0.5 * (v[a] * v[b]).abs().sqrt()
            }
        };
        k[i] && 1.96 * s[i] <= size
    })
}

fn body(b: &LoadBody) -> Value {
    let (v, s, k) = (b.values(), b.stds(), known(b));
    let number = |i: usize, x: f64| match k[i] && x.is_finite() {
        true => json!(x),
        false => Value::Null,
    };
    let sure = determined(b);
    let list = |range: std::ops::Range<usize>, x: &[f64; 10]| -> Vec<Value> {
        range.map(|i| number(i, x[i])).collect()
    };
    json!({
        "mass": { "value": number(0, v[0]), "std": number(0, s[0]) },
        "com": { "value": list(1..4, &v), "std": list(1..4, &s) },
        "inertia_com": { "value": list(4..10, &v), "std": list(4..10, &s) },
        "determined": {
            "mass": sure[0],
            "com": sure[1..4],
            "inertia_com": sure[4..],
        },
        "parameters": b.inertia.0.to_vec(),
        "physically_consistent": b.consistent || b.projected,
        "projected": b.projected,
    })
}

/// `load.json`.
pub fn json(found: &Identified) -> Value {
    let mut out = body(found.load());
    let one = &found.one_step;
    let name = |m: Method| match m {
        Method::OneStep => "one_step",
        Method::TwoStep => "two_step",
    };
    out["method"] = json!(name(found.method));
    out["frame"] = json!(found.frame);
    out["robot"] = json!(found.robot);
    out["joints"] = json!(found.joints);
    out["condition_number"] = json!(one.condition.min(1e300));
    out["methods"] = json!({ "one_step": body(&one.load) });
    if let Some(two) = &found.two_step {
        let mut b = body(&two.load);
        b["mass_bias_of_1_over_m"] = json!(two.bias);
        b["standstill_velocity"] = json!(two.standstill);
        out["methods"]["two_step"] = b;
    }
    let sure = known(found.load());
    out["stream"] = one
        .stream
        .iter()
        .map(|s| {
            let number = |i: usize, x: f64| match sure[i] && x.is_finite() {
                true => json!(x),
                false => Value::Null,
            };
            let list = |range: std::ops::Range<usize>, x: &[f64; 10]| -> Vec<Value> {
                range.map(|i| number(i, x[i])).collect()
            };
            json!({
                "record": s.record,
                "seconds": s.seconds,
                "mass": { "value": number(0, s.values[0]), "std": number(0, s.stds[0]) },
                "com": { "value": list(1..4, &s.values), "std": list(1..4, &s.stds) },
                "inertia_com": { "value": list(4..10, &s.values), "std": list(4..10, &s.stds) },
            })
        })
        .collect();
    out["geometry_std"] = json!(one.geometry);
    out["residual_spread"] = json!(one.spreads);
    out["zeros"] = found
        .joints
        .iter()
        .zip(&one.zeros)
        .map(|(joint, zero)| {
            let mut z = json!(zero);
            z["joint"] = json!(joint);
            z
        })
        .collect();
    out["records"] = one
        .records
        .iter()
        .map(|r| {
            let friction: Vec<Value> = r
                .friction
                .iter()
                .map(|f| {
                    let mut v = json!(f);
                    v["stribeck_determined"] = json!(f.stribeck_determined());
                    v
                })
                .collect();
            json!({ "name": r.name, "loaded": r.loaded, "cutoff": r.cutoff.is_finite().then_some(r.cutoff), "friction": friction,
                    "residuals": r.residuals })
        })
        .collect();
    if let Some(g) = &found.gain {
        out["drive_gain"] = json!(g);
    }
    let flange = &found.flange;
    out["controllers"] = json!({
        "flange": flange,
        "franka_desk": controller::franka(&found.load().inertia, flange).ok(),
        "urscript": controller::urscript(&found.load().inertia, flange).ok(),
        "kuka": controller::kuka(&found.load().inertia, flange).ok(),
    });
    out["warnings"] = json!(found.warnings);
    out
}
