//! `calibration.json`.

use super::judge::Stats;
use super::{Calibrated, Frame};
use serde_json::{Value, json};

fn number(x: f64) -> Value {
    match x.is_finite() {
        true => json!(x),
        false => Value::Null,
    }
}

fn stats(s: Option<Stats>) -> Value {
    s.map_or(Value::Null, |s| json!(s))
}

fn frame(f: &Frame) -> Value {
    json!({ "xyz": [f.p.x, f.p.y, f.p.z], "rpy": f.rpy() })
}

/// Errors of fitted or held-out rows; `null` where there are none.
fn part(found: &Calibrated, fit: bool) -> Value {
    let [before, after] = found.errors(fit, true);
    let [_, sound] = found.errors(fit, false);
    if before.is_empty() {
        return Value::Null;
    }
    let mut out = json!({
        "before": stats(Stats::of(&before)),
        "after": stats(Stats::of(&after)),
        "without_outliers": stats(Stats::of(&sound)),
    });
    let [a, b] = found.angles(fit);
    if !a.is_empty() {
        let degrees = |l: Vec<f64>| -> Vec<f64> { l.iter().map(|x| x.to_degrees()).collect() };
        out["angle"] = json!({
            "before": stats(Stats::of(&degrees(a))),
            "after": stats(Stats::of(&degrees(b))),
        });
    }
    out
}

/// The file for machines.
pub fn json(found: &Calibrated) -> Value {
    let i = &found.identifiability;
    let o = i.observability;
    let groups: Vec<Value> = found
        .groups
        .iter()
        .map(|g| {
            json!({ "group": g.name, "use": if g.fit { "fit" } else { "holdout" }, "rows": g.rows,
                    "outliers": g.outliers, "spoiled": g.spoiled, "before": stats(g.before),
                    "after": stats(g.after), "without_outliers": stats(g.sound) })
        })
        .collect();
    let unknowns: Vec<Value> = found
        .unknowns
        .iter()
        .map(|u| {
            json!({ "name": u.unknown.name, "part": u.unknown.part, "unit": u.unknown.unit,
                    "value": number(u.value), "std": number(u.std), "prior_std": number(u.unknown.prior) })
        })
        .collect();
    let confounded: Vec<Value> = i
        .confounded
        .iter()
        .map(|c| {
            let with: Vec<Value> = c
                .with
                .iter()
                .map(|(n, f)| json!({ "parameter": n, "factor": f }))
                .collect();
            json!({ "parameter": c.parameter, "gauge": c.gauge, "with": with })
        })
        .collect();
    let outliers: Vec<Value> = found
        .outliers
        .iter()
        .map(|o| {
            json!({ "row": o.row, "file": o.file, "line": o.line, "error": number(o.error), "note": o.note })
        })
        .collect();
    let distances: Vec<Value> = found
        .distances
        .iter()
        .map(|d| {
            json!({ "between": d.between, "value": d.value, "before": number(d.found[0]),
                    "after": number(d.found[1]) })
        })
        .collect();
    let setups: Vec<Value> = found
        .setups
        .iter()
        .map(|(n, camera, target)| json!({ "instrument": n, "base": frame(camera), "target": frame(target) }))
        .collect();
    let tool: Vec<f64> = found.rows.iter().map(|r| r.predicted).collect();
    json!({
        "robot": found.robot,
        "frame": found.frame,
        "joints": found.joints,
        "identifiable": i.rank,
        "parameters_total": i.total,
        "rank_gap": number(i.gap),
        "gauge": i.gauge(),
        "confounded": confounded,
        "observability": { "O1": number(o[0]), "O2": number(o[1]), "O3": number(o[2]), "O4": number(o[3]),
                           "O5": number(o[4]) },
        "fit": part(found, true),
        "holdout": part(found, false),
        "groups": groups,
        "outliers": found.outliers.iter().map(|o| o.row).collect::<Vec<_>>(),
        "outlier_rows": outliers,
        "distances": distances,
        "effects": found.trials.iter().map(|t| json!({
            "effect": t.effect, "without": number(t.without), "with": number(t.with),
            "significance": number(t.significance), "evidence": number(t.evidence), "kept": t.kept,
        })).collect::<Vec<_>>(),
        "gravity": found.gravity,
        "noise_factor": number(found.noise),
        "tool_std": stats(Stats::of(&tool)),
        "setups": setups,
        "parameters": unknowns,
        "warnings": found.warnings,
    })
}
