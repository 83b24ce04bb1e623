//! What a model has that a format may not be able to hold.

use super::element::{Element, FUNCTIONS, Form};
use super::{Format, Part};

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
    /// what it is beside the values of bodies and joints
    pub element: Option<Element>,
}

/// Lines that say what was found, and how a format can state what is not in it.
pub fn lines(remarks: &[Remark], format: &dyn Format) -> Vec<String> {
    let mut out = Vec::new();
    for r in remarks {
        out.push(format!("{} ({}): {}", r.effect, r.place, r.equation));
        out.extend(r.values.iter().map(|v| format!("  {v}")));
        let element = r.element.as_ref().map_or(Form::None, |e| format.element(e));
        out.push(match (r.held, element) {
            (Some(part), _) if format.has(part) => "  in the values of this model".into(),
            (_, Form::Native) => "  an element of this model".into(),
            _ if r.element.as_ref().is_some_and(Element::is_function) => {
                format!("  not in the values of this model; a function of {FUNCTIONS}")
            }
            _ => "  not in the values of this model".into(),
        });
    }
    if !out.is_empty() {
        out.insert(0, "Effects found by `excite diagnose`:".into());
    }
    out
}
