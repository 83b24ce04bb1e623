//! What a model has that a format may not be able to hold.

use super::{Format, Part};
use std::collections::BTreeMap;

/// An effect of a model, in words.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Remark {
    /// name of the effect
    pub effect: &'static str,
    /// where it is
    pub place: String,
    /// what it adds to the torque
    pub equation: &'static str,
    /// its parameters with units
    pub values: Vec<String>,
    /// part of the model that holds it
    pub held: Option<Part>,
    /// how a format can state it, by [`Format::name`]
    pub notes: BTreeMap<&'static str, String>,
}

/// Lines that say what was found, and how a format can state what is not in it.
pub fn lines(remarks: &[Remark], format: &dyn Format) -> Vec<String> {
    let mut out = Vec::new();
    for r in remarks {
        out.push(format!("{} ({}): {}", r.effect, r.place, r.equation));
        out.extend(r.values.iter().map(|v| format!("  {v}")));
        out.push(match (r.held, r.notes.get(format.name())) {
            (Some(part), _) if format.has(part) => "  in the values of this model".into(),
            (_, Some(note)) => format!("  not in the values of this model; {note}"),
            _ => "  not in the values of this model".into(),
        });
    }
    if !out.is_empty() {
        out.insert(0, "Effects found by `excite diagnose`:".into());
    }
    out
}
