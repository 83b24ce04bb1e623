//! Which of the files for MuJoCo holds what.

use super::closed::Closed;
use super::element::{Element, FUNCTIONS, Form};
use super::mujoco::Mujoco;
use super::{Format, Part, Remark};
use crate::plant::Plant;

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
        let along = element.is_some_and(Element::is_function);
        Some(match form {
            Form::Native if along => {
                format!("{native}: {what}; {} for inverse dynamics", FUNCTIONS)
            }
            Form::Native => format!("{native}: {what}"),
            Form::Callback if in_both => format!("{native} and {}: {what}", FUNCTIONS),
            Form::Callback => format!("{}: {what}", FUNCTIONS),
            Form::None => return None,
        })
    }
}

/// The format of `robot.xml` for robots of this kind, where there is one.
pub(super) fn of(plant: &Plant) -> Option<&'static dyn Format> {
    let both: [&dyn Format; 2] = [&Mujoco, &Closed];
    both.into_iter().find(|f| f.holds(plant))
}

/// How the files for MuJoCo hold something.
pub fn in_mujoco(plant: &Plant, held: Option<Part>, element: Option<&Element>) -> Form {
    let Some(native) = of(plant) else {
        return Form::None;
    };
    if held.is_some_and(|part| native.has(part)) {
        return Form::Native;
    }
    element.map_or(Form::None, |e| match native.element(e) {
        Form::None if e.is_function() => Form::Callback,
        form => form,
    })
}
