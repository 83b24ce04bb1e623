//! The files of the improved model, and what changed in them.

use super::Diagnosis;
use crate::error::WarningKind;
use crate::report::html::table;
use maud::{Markup, html};

pub(super) fn simulators(d: &Diagnosis) -> Markup {
    let held = d.improved.remarks.iter().zip(&d.improved.in_mujoco);
    let rows: Vec<Vec<Markup>> = held
        .map(|(r, files)| {
            vec![
                html! { (r.effect.replace('_', " ")) },
                html! { (r.place) },
                html! { (files) },
                html! { @for v in &r.values { div class="value" { (v) } } },
            ]
        })
        .collect();
    html! {
        p {
            "Written beside this report: "
            @for (i, file) in d.improved.files.iter().enumerate() { @if i > 0 { ", " } code { (file) } }
            (match d.warnings.iter().any(|w| w.kind == WarningKind::InertiaImpossible) {
                true => ". Bodies with the refitted parameters cannot exist: the files hold the nearest that can.",
                false => ". All hold the refitted parameters.",
            })
            @if d.improved.files.contains(&"effects.py") {
                " " code { "effects.install(model)" } " makes MuJoCo add what " code { "robot.xml" } " has no element for; "
                code { "effects.inverse(model, q, dq, ddq, dt)" } " gives the torque along a motion with all of it."
            }
        }
        @if let Some(scene) = &d.improved.scene { (crate::export::scene_page(scene)) }
        @match rows.is_empty() {
            true => p { "No effect is claimed, so that nothing else is in them." },
            false => (table(&["effect", "where", "in MuJoCo", "with"], &[1, 2, 3], &rows)),
        }
    }
}
