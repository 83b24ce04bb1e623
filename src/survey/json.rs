//! `log.json`.

use super::Survey;
use super::claim::Means;
use serde_json::{Value, json};

/// The file for machines.
pub fn json(survey: &Survey) -> Value {
    let first = survey.frames.first();
    let claims: Vec<Value> = survey
        .claims
        .iter()
        .map(|c| {
            let mut value = serde_json::to_value(c).unwrap_or(Value::Null);
            // a claim is at least as likely as not
            if c.means == Means::Other || c.confidence < 0.5 {
                value["means"] = json!("other");
                value["joint"] = Value::Null;
                value["confidence"] = json!(c.confidence.min(0.49));
            }
            value
        })
        .collect();
    json!({
        "format": survey.format.name(),
        "topic": survey.topic,
        "rate": first.map(|f| 1.0 / f.step),
        "rows": first.map(|f| f.rows),
        "duration": first.map(super::Frame::duration),
        "joints": survey.joints,
        "columns": claims,
        "records": survey.frames.iter().zip(&survey.courses).map(|(f, courses)| json!({
            "files": f.paths,
            "rows": f.rows,
            "rate": 1.0 / f.step,
            "duration": f.duration(),
            "time_unit": f.time_unit,
            "gaps": f.gaps,
            "joints": courses,
        })).collect::<Vec<_>>(),
        "warnings": survey.warnings,
    })
}
