//! `diagnosis.json` of a calibration.

use super::{Finding, PoseDiagnosis, Stats};
use serde_json::{Map, Value, json};

fn number(x: f64) -> Value {
    if !x.is_finite() {
        return Value::Null;
    }
    json!(format!("{x:.4e}").parse::<f64>().unwrap_or(x))
}

fn stats(s: Option<Stats>) -> Value {
    s.map_or(Value::Null, |s| {
        json!({ "mean": number(s.mean), "median": number(s.median), "rms": number(s.rms), "p95": number(s.p95),
                "max": number(s.max) })
    })
}

fn finding(f: &Finding) -> Value {
    let mut parameters = Map::new();
    for v in &f.values {
        parameters.insert(
            v.name.clone(),
            json!({ "value": number(v.value), "std": number(v.std), "unit": v.unit }),
        );
    }
    let about = super::catalogue::effect(f.effect);
    let mut rivals: Vec<&str> = f.rivals.iter().map(|r| r.0).collect();
    rivals.sort_unstable();
    rivals.dedup();
    json!({
        "effect": f.effect,
        "joints": f.joints,
        "places": f.places,
        "confidence": number(f.confidence),
        "explains": number(f.explains),
        "explains_interval": f.interval.map(number),
        "holdout_shrink": f.holdout.map(number),
        "visibility": number(f.visibility),
        "parameters": parameters,
        "indistinguishable_from": rivals,
        "rivals": f.rivals.iter().map(|r| json!({ "effect": r.0, "place": r.1 })).collect::<Vec<_>>(),
        "equation": about.equation,
        "separated_by": about.separated_by,
    })
}

/// The file, with the keys of `docs/formats.md`.
pub fn json(d: &PoseDiagnosis, seconds: f64) -> Value {
    let f = &d.found;
    let rms = d.errors(true, 0).map_or(f64::NAN, |s| s.rms);
    let above = (rms * rms - d.noise * d.noise).max(0.0).sqrt();
    let groups: Vec<Value> = d
        .groups
        .iter()
        .enumerate()
        .map(|(g, name)| {
            let of = |after: usize| {
                let own = d.lines.iter().filter(|l| l.group == g && !l.stray);
                stats(Stats::of(&own.map(|l| l.errors[after]).collect::<Vec<_>>()))
            };
            let fit = d.lines.iter().any(|l| l.group == g && l.fit);
            json!({ "group": name, "use": if fit { "fit" } else { "holdout" }, "before": of(0), "after": of(1) })
        })
        .collect();
    let strays: Vec<usize> = (0..d.lines.len()).filter(|&i| d.lines[i].stray).collect();
    let mut out = json!({
        "of": "poses",
        "robot": d.robot,
        "frame": d.frame,
        "joints": d.joints,
        "verdict": f.verdict,
        "gap": {
            "unit": "m",
            "rms": number(above),
            "noise": number(d.noise),
            "noise_from": d.noise_from,
            "mean_square": f.squares.map(number),
            "fit": { "before": stats(d.errors(true, 0)), "after": stats(d.errors(true, 1)) },
            "holdout": { "before": stats(d.errors(false, 0)), "after": stats(d.errors(false, 1)) },
            "groups": groups,
        },
        "findings": f.findings.iter().map(finding).collect::<Vec<_>>(),
        "unexplained": number(f.unexplained),
        "holdout_shrink": f.holdout.map(number),
        "outliers": strays,
        "untestable": d.untestable.iter()
            .map(|(effect, place)| json!({ "effect": effect, "place": place })).collect::<Vec<_>>(),
        "warnings": d.warnings,
        "seconds": number(seconds),
    });
    if let Some(n) = &d.next {
        out["next_experiment"] = json!({
            "separates": n.separates, "postures": "next.csv", "overlap": n.overlap.map(number),
        });
    }
    out
}
