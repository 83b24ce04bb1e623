//! What a model has that a format may not be able to hold.

use super::effects::{self, Effects};
use super::element::{Element, Form};
use super::mujoco::Mujoco;
use super::{Format, Part};
use crate::plant::Plant;

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

impl Remark {
    /// The files for MuJoCo that hold it, and what they say.
    pub fn in_files(&self, plant: &Plant) -> String {
        let form = in_mujoco(plant, self.held, self.element.as_ref());
        self.changed(form).unwrap_or_else(|| "not at all".into())
    }

    fn changed(&self, form: Form) -> Option<String> {
        let what = match (self.held, &self.element) {
            (Some(part), _) => part.words(),
            (None, Some(element)) => element.words(),
            (None, None) => return None,
        };
        let element = self.element.as_ref().filter(|_| self.held.is_none());
        let native = Mujoco.file();
        let in_both = matches!(element, Some(Element::Twist { gap, .. }) if *gap > 0.0);
        let along = element.is_some_and(|e| Effects.element(e) != Form::None);
        Some(match form {
            Form::Native if along => {
                format!("{native}: {what}; {} for inverse dynamics", effects::FILE)
            }
            Form::Native => format!("{native}: {what}"),
            Form::Callback if in_both => format!("{native} and {}: {what}", effects::FILE),
            Form::Callback => format!("{}: {what}", effects::FILE),
            Form::None => return None,
        })
    }
}

/// How the files for MuJoCo hold something.
pub fn in_mujoco(plant: &Plant, held: Option<Part>, element: Option<&Element>) -> Form {
    if !Mujoco.holds(plant) {
        return Form::None;
    }
    if held.is_some_and(|part| Mujoco.has(part)) {
        return Form::Native;
    }
    element.map_or(Form::None, |e| match Mujoco.element(e) {
        Form::None => Effects.element(e),
        form => form,
    })
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
            _ if r
                .element
                .as_ref()
                .is_some_and(|e| Effects.element(e) != Form::None) =>
            {
                format!(
                    "  not in the values of this model; a function of {}",
                    effects::FILE
                )
            }
            _ => "  not in the values of this model".into(),
        });
    }
    if !out.is_empty() {
        out.insert(0, "Effects found by `excite diagnose`:".into());
    }
    out
}
