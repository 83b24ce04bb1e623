//! What changed in a scene, for people.

use super::{Change, Edited};
use crate::report::html::table;
use maud::{Markup, html};

/// Longest text of a value in the table, characters.
const LONGEST: usize = 90;

fn short(text: Option<&String>) -> String {
    let Some(text) = text else {
        return "–".into();
    };
    let numbers = text.split_whitespace().map(|t| match t.parse::<f64>() {
        Ok(x) => crate::report::format::significant(x, 6),
        Err(_) => t.to_string(),
    });
    let text = numbers.collect::<Vec<_>>().join(" ");
    match text.chars().count() > LONGEST {
        true => format!("{} …", text.chars().take(LONGEST).collect::<String>()),
        false => text,
    }
}

/// The changes as a table, and what the file does not hold.
pub(crate) fn page(edited: &Edited) -> Markup {
    let row = |c: &Change| {
        vec![
            html! { (c.element) },
            html! { code { (c.attribute) } },
            html! { (short(c.old.as_ref())) },
            html! { (short(c.new.as_ref())) },
            html! { (c.file) ":" (c.line) },
        ]
    };
    let rows: Vec<Vec<Markup>> = edited.changes.iter().map(row).collect();
    html! {
        p {
            code { (edited.file) } " is " code { (edited.scene.display()) } " with the model in it: "
            (crate::report::format::count(rows.len(), "change")) ". Everything else is as it was written."
        }
        @if !rows.is_empty() {
            (table(&["element", "attribute", "was", "is", "line of the file as it was"], &[1, 2, 3, 4], &rows))
        }
        @if !edited.left_out.is_empty() {
            p { "Not in it:" }
            ul { @for line in &edited.left_out { li { (line) } } }
        }
    }
}
