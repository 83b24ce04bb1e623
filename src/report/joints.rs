//! The order of the joints, as every report states it.

use super::html::{Section, details, table};
use maud::{Markup, html};

/// Which joint is `q1`, `q2`, … in logs, trajectories and sample files.
pub fn order<'a>(names: impl IntoIterator<Item = &'a str>) -> Section {
    let rows: Vec<Vec<Markup>> = names
        .into_iter()
        .enumerate()
        .map(|(k, name)| {
            let n = k + 1;
            vec![
                html! { "q" (n) },
                html! { (name) },
                html! { "qd" (n) ", qdd" (n) ", tau" (n) },
            ]
        })
        .collect();
    let short: Vec<String> = rows
        .iter()
        .map(|r| format!("{} = {}", r[0].0, r[1].0))
        .collect();
    let short = maud::PreEscaped(short.join(", "));
    let body = html! {
        @if rows.len() <= 12 {
            p { (short) }
        } @else {
            (details("All joints in order", table(&["position", "joint", "the others"], &[1, 2], &rows)))
        }
        p { "Files number the joints in this order: " code { "q1" } " is the position of the first, "
            code { "tau1" } " its torque or force." }
    };
    Section::new("Order of the joints", body)
}

#[cfg(test)]
mod tests {
    use super::order;

    #[test]
    fn names_are_numbered_and_escaped() {
        let text = order(["base", "a<b"]).body.into_string();
        assert!(text.contains("q1 = base, q2 = a&lt;b"), "{text}");
        let names: Vec<String> = (0..20).map(|k| format!("j{k}")).collect();
        let text = order(names.iter().map(String::as_str)).body.into_string();
        assert!(text.contains("q20") && text.contains("j19"), "{text}");
    }
}
