//! `report.json` and `model.json`.

use super::{Identification, Settings, breakaway};
use crate::plant::{Column, Plant};
use serde_json::{Value, json};

/// A number, or null where it is none (JSON knows neither infinity nor NaN).
fn number(x: f64) -> Value {
    if x.is_finite() { json!(x) } else { Value::Null }
}

fn percent(std: f64, value: f64) -> Value {
    match value != 0.0 {
        true => number(100.0 * std / value.abs()),
        false => Value::Null,
    }
}

/// Parameters of kind `base`, `standard` and `joint`, in this order.
fn parameters(plant: &Plant, id: &Identification) -> Vec<Value> {
    let mut out = Vec::new();
    for a in 0..id.base.count() {
        out.push(json!({
            "name": id.base.name(a),
            "combination": id.base.combination(a),
            "value": number(id.pi_consistent[a]),
            "unconstrained": number(id.pi[a]),
            "std": number(id.std[a]),
            "relative_std_percent": percent(id.std[a], id.pi_consistent[a]),
            "predicted_std": number(id.predicted_std[a]),
            "essential": id.essential.kept.contains(&a),
            "unit": id.base.units[id.base.kept[a]],
            "kind": "base",
        }));
    }
    for kind in ["standard", "joint"] {
        for (u, p) in plant.parameters().iter().enumerate() {
            if (kind == "joint") != matches!(p.kind, Column::Term { .. }) {
                continue;
            }
            out.push(json!({
                "name": p.name,
                "value": number(id.phi[u]),
                "std": number(id.phi_std[u]),
                "relative_std_percent": percent(id.phi_std[u], id.phi[u]),
                "nominal": number(p.value),
                "identifiability": id.base.standard[u].identifiability,
                "unit": p.unit,
                "kind": kind,
            }));
        }
    }
    for v in breakaway::values(plant, id) {
        out.push(json!({
            "name": v.name,
            "value": number(v.value),
            "std": number(v.std),
            "relative_std_percent": percent(v.std, v.value),
            "nominal": number(v.nominal),
            "identifiability": "alone",
            "unit": v.unit,
            "kind": "joint",
        }));
    }
    out
}

/// Signals of each record: what was done to it.
fn records(id: &Identification) -> Vec<Value> {
    id.prepared
        .iter()
        .map(|p| {
            json!({
                "name": p.name,
                "use": p.purpose,
                "rate": p.rate,
                "samples": p.count(),
                "periods_averaged": p.periods.as_ref().map(|x| x.count),
                "position_cutoff": p.position_cutoff.iter().map(|f| number(*f)).collect::<Vec<_>>(),
                "cutoff": number(p.filter.cutoff),
                "decimation": p.filter.factor,
                "equations_per_joint": p.outputs(),
                "cutoff_reason": p.cutoff_reason,
            })
        })
        .collect()
}

/// `report.json`.
pub fn report(
    plant: &Plant,
    id: &Identification,
    settings: &Settings,
    verdict: &str,
    seconds: f64,
) -> Value {
    let pair = |(fit, holdout): (f64, Option<f64>)| json!({ "fit": number(fit), "holdout": holdout.map(number) });
    let v = &id.validation;
    let mut validation = json!({ "fit": v.fit });
    if let Some(h) = &v.holdout {
        validation["holdout"] = json!(h);
    }
    let b = id.base.count();
    let correlation: Vec<Value> = (0..b)
        .flat_map(|i| (0..i).map(move |j| (i, j)))
        .filter_map(|(i, j)| {
            let r = id.covariance[(i, j)] / (id.std[i] * id.std[j]);
            (r.abs() > 0.9).then(
                || json!({ "parameters": [id.base.name(i), id.base.name(j)], "correlation": r }),
            )
        })
        .collect();
    let mut out = json!({
        "robot": plant.name(),
        "joints": plant.actuators().iter().map(|j| j.name.as_str()).collect::<Vec<_>>(),
        "verdict": verdict,
        "method": settings.method,
        "consistency": settings.consistency,
        "base_parameters": b,
        "condition_number": { "weighted": number(id.condition) },
        "parameters": parameters(plant, id),
        "validation": validation,
        "relative_error": {
            "nominal": pair(v.nominal),
            "unconstrained": pair(v.plain),
            "essential": pair(v.essential),
        },
        "worse_than_nominal": super::doubts::predicts_worse(id).is_some(),
        "residual_goes_with": v.followers.iter().map(|f| json!({
            "joint": plant.actuators()[f.actuator].name, "what": f.what, "share": number(f.share),
        })).collect::<Vec<_>>(),
        "physically_consistent": id.consistent,
        "smallest_pseudo_inertia_eigenvalue": id.margin.as_ref().map(|(m, body)| json!({ "relative": number(*m), "body": body })),
        "prior": { "strength": id.prior_strength, "cross_validation": id.trials },
        "essential_parameters": {
            "count": id.essential.kept.len(),
            "removed": id.essential.removed.iter().map(|r| json!({
                "name": id.base.name(r.parameter),
                "relative_std_percent": number(r.relative_std_percent),
                "loss": number(r.loss),
            })).collect::<Vec<_>>(),
        },
        "correlations_above_0.9": correlation,
        "variance_inflation": number(id.inflation),
        "outliers": id.outliers,
        "records": records(id),
        "warnings": id.warnings,
        "seconds": seconds,
    });
    if !id.in_parts.is_empty() {
        out["read_in_parts"] = json!(id.in_parts);
    }
    if let Some(scene) = &id.scene {
        out["into"] = json!(scene);
    }
    out
}

/// `model.json`: everything that another program needs to use the model.
pub fn model(plant: &Plant, id: &Identification) -> Value {
    let rows = |m: &faer::Mat<f64>| -> Vec<Vec<Value>> {
        (0..m.nrows())
            .map(|i| (0..m.ncols()).map(|j| number(m[(i, j)])).collect())
            .collect()
    };
    json!({
        "robot": plant.name(),
        "robot_hash": plant.robot().hash,
        "gravity": plant.robot().gravity.as_slice(),
        "joints": plant.actuators().iter().map(|j| j.name.as_str()).collect::<Vec<_>>(),
        "parameters": plant.parameters().iter().enumerate().map(|(u, p)| json!({
            "name": p.name, "unit": p.unit, "value": number(id.phi[u]), "std": number(id.phi_std[u]), "nominal": number(p.value),
        })).collect::<Vec<_>>(),
        "base_parameters": (0..id.base.count()).map(|a| json!({
            "name": id.base.name(a), "combination": id.base.combination(a),
            "value": number(id.pi_consistent[a]), "unconstrained": number(id.pi[a]),
        })).collect::<Vec<_>>(),
        "base_covariance": rows(&id.covariance),
        "residual_covariance": rows(&id.residual_covariance),
        "physically_consistent": id.consistent,
    })
}
