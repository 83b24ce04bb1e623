//! `load.json`.

use super::body::LoadBody;
use super::{Identified, Method};
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

fn body(b: &LoadBody) -> Value {
    let (v, s, k) = (b.values(), b.stds(), known(b));
    let number = |i: usize, x: f64| match k[i] && x.is_finite() {
        true => json!(x),
        false => Value::Null,
    };
    let list = |range: std::ops::Range<usize>, x: &[f64; 10]| -> Vec<Value> {
        range.map(|i| number(i, x[i])).collect()
    };
    json!({
        "mass": { "value": number(0, v[0]), "std": number(0, s[0]) },
        "com": { "value": list(1..4, &v), "std": list(1..4, &s) },
        "inertia_com": { "value": list(4..10, &v), "std": list(4..10, &s) },
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
    out["residual_spread"] = json!(one.spreads);
    out["records"] = one
        .records
        .iter()
        .map(|r| {
            json!({ "name": r.name, "loaded": r.loaded, "friction": r.friction,
                    "residuals": r.residuals })
        })
        .collect();
    if let Some(g) = &found.gain {
        out["drive_gain"] = json!(g);
    }
    out["warnings"] = json!(found.warnings);
    out
}
