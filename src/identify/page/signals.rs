//! What was done to the signals of each record.

use crate::identify::Identification;
use crate::report::format::significant;
use crate::report::html::{self, Section};
use maud::{Markup, html};

pub(super) fn section(id: &Identification) -> Section {
    let rows: Vec<Vec<Markup>> = id
        .prepared
        .iter()
        .map(|p| {
            let cut: Vec<String> = p
                .position_cutoff
                .iter()
                .map(|f| {
                    if f.is_finite() {
                        significant(*f, 3)
                    } else {
                        "–".into()
                    }
                })
                .collect();
            vec![
                html! { (p.name) },
                html! { (significant(p.rate, 5)) },
                html! { (p.count()) },
                html! { @match &p.periods { Some(x) => (x.count), None => "–" } },
                html! { (cut.join(", ")) },
                html! { (significant(p.filter.cutoff, 3)) },
                html! { (p.outputs()) },
                html! { (p.cutoff_reason) },
            ]
        })
        .collect();
    let head = [
        "record",
        "rate, Hz",
        "samples",
        "periods averaged",
        "cut-off of positions, Hz",
        "cut-off of torque and regressor, Hz",
        "equations a joint",
        "why",
    ];
    Section::new("Signals", html::table(&head, &[4, 7], &rows))
}
