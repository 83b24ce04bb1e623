//! How well the motion will tell the platform, the legs or the friction that it was designed for.

use crate::design::Question;
use crate::identifiability::Answer;
use crate::report::format::{NBSP, significant, unit, with_unit};
use crate::report::html::{self, Section};
use maud::{Markup, html};

/// What the question asks for, in words.
pub(super) fn subject(question: Question) -> &'static str {
    match question {
        Question::Load => "a load",
        Question::Platform => "the platform",
        Question::Legs => "the legs",
        Question::Friction => "the friction of the drives",
    }
}

/// Table of the values.
pub(super) fn section(a: &Answer) -> Section {
    let rows: Vec<Vec<Markup>> = a
        .expected
        .iter()
        .map(|e| {
            let relative = |s: f64| match e.value {
                0.0 => "–".into(),
                v => format!("{}{NBSP}%", significant(196.0 * s / v.abs(), 2)),
            };
            let (plus, percent) = match e.std {
                Some(s) => (significant(1.96 * s, 2), relative(s)),
                None => ("not determined".into(), "–".into()),
            };
            vec![
                html! { span class="code" { (e.name) } },
                html! { (significant(e.value, 4)) },
                html! { (plus) },
                html! { (unit(&e.unit)) },
                html! { (percent) },
            ]
        })
        .collect();
    let body = html! {
        p {
            "Expected of one record of " (with_unit(a.seconds, 3, "s")) " of this motion, evaluated with " code { "excite identify" }
            ". ± is the 95\u{a0}% interval at the torque noise of the robot file, white. Coulomb and viscous friction and a constant of every \
             drive are estimated along; breakaway friction, too, with its speed, where the robot file states it. "
            (bodies(a.question))
        }
        (html::table(&["value", "in the robot file", "±", "unit", "relative"], &[2, 3, 5], &rows))
    };
    Section::new(
        format!("What this motion tells of {}", subject(a.question)),
        body,
    )
}

/// What is done about the bodies that are not asked for.
fn bodies(question: Question) -> &'static str {
    match question {
        Question::Load => "The robot itself is known from its records without a load.",
        Question::Platform => {
            "The other bodies count as known; with unknown legs a part of their mass adds to the platform's."
        }
        Question::Legs => "The platform is estimated along.",
        Question::Friction => "All bodies are estimated along.",
    }
}
