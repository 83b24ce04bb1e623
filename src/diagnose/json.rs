//! `diagnosis.json`.

use super::controller::BANDWIDTH;
use super::finding::Finding;
use super::forward::MODELS;
use super::result::Diagnosis;
use super::second_encoder::SecondEncoder;
use super::thresholds::THRESHOLDS;
use serde_json::{Map, Value, json};

/// A number with five significant digits, `null` where it is not finite.
fn number(x: f64) -> Value {
    if !x.is_finite() {
        return Value::Null;
    }
    json!(format!("{x:.4e}").parse::<f64>().unwrap_or(x))
}

fn numbers(x: &[f64]) -> Value {
    x.iter().map(|v| number(*v)).collect()
}

fn finding(f: &Finding) -> Value {
    let mut parameters = Map::new();
    for v in &f.values {
        parameters.insert(
            v.name.to_string(),
            json!({ "value": number(v.value), "std": v.std.map(number), "unit": v.unit }),
        );
    }
    json!({
        "effect": f.effect,
        "joints": f.joints,
        "records": f.records,
        "confidence": number(f.confidence),
        "explains": number(f.explains),
        "explains_interval": numbers(&f.interval),
        "holdout_shrink": f.holdout.map(number),
        "visibility": number(f.visibility),
        "decoys": f.decoys.map(number),
        "unsteady": f.unsteady.map(number),
        "uneven": f.uneven.map(number),
        "parameters": parameters,
        "simulator": { "mujoco": f.mujoco },
        "indistinguishable_from": f.same,
        "in_the_set": f.member,
        "seen_in": if f.frozen { "frozen" } else { "refit" },
        "equation": f.equation,
        "separated_by": f.separated_by,
    })
}

/// What the second encoder of a joint shows.
fn second(s: &SecondEncoder) -> Value {
    let seen = s.seen.iter().map(|e| {
        json!({
            "effect": e.effect, "value": number(e.value), "std": number(e.std), "unit": e.unit,
            "explains": number(e.share), "indistinguishable_from": e.same,
        })
    });
    json!({
        "joint": s.joint,
        "unit": s.unit,
        "rms": number(s.rms),
        "left": number(s.left),
        "delay": { "value": number(s.delay[0]), "std": number(s.delay[1]), "unit": "s" },
        "scale": { "value": number(1.0 + s.scale[0]), "std": number(s.scale[1]) },
        "effects": seen.collect::<Vec<_>>(),
        "holdout": s.holdout.map(number),
        "not_asked": s.unasked,
    })
}

/// Deviation of the simulated robot from the log.
fn forward(d: &Diagnosis) -> Value {
    let f = &d.forward;
    let records: Vec<Value> = f
        .records
        .iter()
        .map(|r| {
            let of = |rms: &[Option<Vec<f64>>; 3], model: usize, j: usize| {
                rms[model].as_ref().map(|rms| number(rms[j]))
            };
            let joints: Vec<Value> = (0..d.joints.len())
                .map(|j| {
                    let mut out = json!({ "joint": d.joints[j], "unit": f.units[j] });
                    for (m, model) in MODELS.into_iter().enumerate() {
                        out[model] = json!(of(&r.rms, m, j));
                        if let Some(Ok(_)) = f.held {
                            out["torque"][model] = json!(of(&r.torque, m, j));
                        }
                    }
                    out
                })
                .collect();
            json!({
                "record": r.record,
                "use": if r.fit { "fit" } else { "holdout" },
                "seconds": number(r.t.last().copied().unwrap_or(0.0)),
                "joints": joints,
            })
        })
        .collect();
    let mut out = json!({
        "quantity": "rms deviation of the position from the log",
        "records": records,
        "not_simulated": f.failed,
    });
    match &f.held {
        Some(Ok(c)) => {
            out["driven_by"] = json!("commanded positions");
            out["controller"] = json!({
                "kind": c.kind,
                "gains": c.gains.iter().map(|g| numbers(g)).collect::<Vec<_>>(),
                "left_of_torque": numbers(&c.left),
                "soft_springs": c.soft.iter().map(|j| &d.joints[*j]).collect::<Vec<_>>(),
            });
        }
        Some(Err(why)) => {
            out["driven_by"] = json!("recorded torques, with a soft spring");
            out["bandwidth"] = json!(BANDWIDTH);
            out["controller_unknown"] = json!(why);
        }
        None => {}
    }
    out
}

/// The file, with the keys of `docs/formats.md`.
pub fn json(d: &Diagnosis, seconds: f64) -> Value {
    // the gap that is diagnosed: after a refit, unless all of it hides in the parameters
    let frozen = d.findings.iter().any(|f| f.member && f.frozen);
    let gaps = if frozen { &d.frozen } else { &d.refit };
    let rms = |of: &dyn Fn(usize) -> f64| -> f64 {
        let n = gaps.len() as f64;
        ((0..gaps.len()).map(|j| of(j).powi(2)).sum::<f64>() / n).sqrt()
    };
    let total = rms(&|j| gaps[j].rms);
    let part = |share: Option<f64>| share.map(|s| number(total * s.max(0.0).sqrt()));
    let joints: Vec<Value> = (0..gaps.len())
        .map(|j| {
            json!({
                "joint": d.joints[j],
                "rms": number(gaps[j].rms),
                "noise": number(gaps[j].noise),
                "share": number(gaps[j].share),
                "relative": number(gaps[j].relative),
                "frozen_rms": number(d.frozen[j].rms),
                "refit_rms": number(d.refit[j].rms),
                "explained_rms": number(d.explained[j].rms),
                "frozen_relative": number(d.frozen[j].relative),
                "refit_relative": number(d.refit[j].relative),
                "explained_relative": number(d.explained[j].relative),
                "unit": d.units[j],
            })
        })
        .collect();
    let records: Vec<Value> = d
        .records
        .iter()
        .map(|r| {
            let of = |i: usize| -> Value { r.joints.iter().map(|v| number(v[i])).collect() };
            json!({
                "record": r.name,
                "use": if r.fit { "fit" } else { "holdout" },
                "repeats": r.repeats,
                "frozen": of(0),
                "refit": of(1),
                "explained": of(2),
                "remarks": r.remarks,
            })
        })
        .collect();
    let mut out = json!({
        "robot": d.robot,
        "joints": d.joints,
        "verdict": d.verdict,
        "gap": {
            "rms": number(total),
            "noise": number(rms(&|j| gaps[j].noise)),
            "mode": if frozen { "frozen" } else { "refit" },
            "odd": part(d.shares.odd),
            "even": part(d.shares.even),
            "non_periodic": part(d.shares.non_periodic),
            "noise_from": d.noise_source,
            "any_function_of_the_state": d.bound.map(number),
            "joints": joints,
        },
        "findings": d.findings.iter().map(finding).collect::<Vec<_>>(),
        "unexplained": number(d.unexplained),
        "stays_on": d.stays_on,
        "holdout_shrink": d.shrink().map(number),
        "at_rest": d.at_rest.iter().map(|r| json!({
            "record": r.record,
            "use": if r.fit { "fit" } else { "holdout" },
            "all": r.all,
            "seconds": number(r.seconds),
            "of": number(r.of),
            "torque_changes": r.pushed.iter().map(|(joint, std, unit)| json!({
                "joint": joint, "std": number(*std), "unit": unit,
            })).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "second_encoder": d.second_encoder.iter().map(second).collect::<Vec<_>>(),
        "records": records,
        "untestable": d.untestable.iter().map(|(effect, place, v)| json!({
            "effect": effect, "joints": place, "visibility": number(*v),
        })).collect::<Vec<_>>(),
        "ruled_out": d.ruled_out.iter().map(|r| json!({
            "effect": r.effect, "joints": r.joints, "why": r.why,
        })).collect::<Vec<_>>(),
        "forward_simulation": forward(d),
        "prior_surprise": numbers(&d.surprise),
        "prior_closeness": numbers(&d.closeness),
        "torque_window": number(d.window),
        "friction_lead": number(d.lead),
        "thresholds": THRESHOLDS,
        "files": d.improved.files,
        "changed": d.improved.remarks.iter().zip(&d.improved.in_mujoco).map(|(r, files)| json!({
            "effect": r.effect, "place": r.place, "mujoco": files,
        })).collect::<Vec<_>>(),
        "warnings": d.warnings,
        "seconds": number(seconds),
    });
    if let Some(scene) = &d.improved.scene {
        out["into"] = json!(scene);
    }
    if let Some(p) = &d.posterior {
        out["samples"] = json!({
            "count": p.samples.len(),
            "missing": p.missing,
            "table": super::posterior::TABLE,
            "columns": p.columns.iter().map(|(name, unit)| json!({ "name": name, "unit": unit })).collect::<Vec<_>>(),
            "effects": p.samples.iter().map(|s| s.remarks.iter().map(|r| json!({
                "effect": r.effect, "place": r.place,
            })).collect::<Vec<_>>()).collect::<Vec<_>>(),
            "covered": p.covered().map(number),
            "joints": p.band.iter().map(|b| json!({
                "joint": b.joint, "covered": number(b.covered), "left": number(b.left),
                "spread": number(b.spread), "twenty_percent": number(b.twenty),
            })).collect::<Vec<_>>(),
        });
    }
    if let Some(n) = &d.next {
        out["next_experiment"] = json!({
            "separates": n.separates,
            "trajectory": "next.json",
            "overlap": numbers(&n.overlap),
            "why": n.why,
        });
    }
    out
}
