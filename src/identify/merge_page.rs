//! The report of a model from condensed records.

use super::merge::Merged;
use crate::plant::Plant;
use crate::report::format::{count, percent, significant, unit};
use crate::report::html::{self, Section, Tone};
use maud::{Markup, html};

impl Merged {
    /// `report.html`.
    pub fn html(&self, plant: &Plant) -> String {
        let [fit, holdout] = [0, 1].map(|p| {
            let of = |k: usize| self.errors[p][k].as_ref().map(|e| e.relative_error);
            of(0).zip(of(1))
        });
        let said = |pair: Option<(f64, f64)>| match pair {
            Some((before, after)) => format!("{} (nominal {})", percent(after), percent(before)),
            None => "not known, no record".into(),
        };
        let tone = match (fit, holdout) {
            (_, Some((before, after))) if after < before => Tone::Good,
            (_, Some(_)) => Tone::Bad,
            _ => Tone::Fair,
        };
        let base: Vec<Vec<Markup>> = (0..self.base.count())
            .map(|k| {
                vec![
                    html! { span class="code" { (self.base.combination(k)) } },
                    html! { (significant(self.pi_consistent[k], 4)) },
                    html! { (significant(self.pi[k], 4)) },
                    html! { (significant(self.std[k], 2)) },
                    html! { (unit(self.base.units[self.base.kept[k]])) },
                ]
            })
            .collect();
        let mut sections = vec![
            Section::new(
                "Torque error",
                html! {
                    p { "Residual over measured torque of the filtered equations. Fit: " (said(fit)) ". Holdout: "
                        (said(holdout)) "." }
                    p { "Records for the fit: " (self.records[0].join(", ")) ". Predicted only: "
                        @if self.records[1].is_empty() { "none" } @else { (self.records[1].join(", ")) } "." }
                    p { "Condition number " (significant(self.condition, 3)) "; prior strength "
                        (significant(self.prior_strength, 3)) "; variance through correlated residuals "
                        (significant(self.inflation, 3)) ", mean of those of the records alone." }
                },
            ),
            Section::new(
                "Base parameters",
                html::table(
                    &["base parameter", "value", "least squares", "std", "unit"],
                    &[4],
                    &base,
                ),
            ),
        ];
        if !self.warnings.is_empty() {
            let list = html! { ul { @for w in &self.warnings { li { strong { (w.subject) } ": " (w.message) } } } };
            let mut s = Section::new("Warnings", list);
            s.tone = Tone::Fair;
            sections.push(s);
        }
        let line = format!(
            "from {} that were condensed",
            count(self.records[0].len(), "record")
        );
        let verdict = format!(
            "The model leaves {} of the torque on holdout.",
            said(holdout)
        );
        let verdict = if holdout.is_some() {
            verdict
        } else {
            "No record says how well the model predicts.".into()
        };
        html::page(
            &format!("Identification of {}", plant.name()),
            &line,
            (tone, &verdict),
            &sections,
        )
    }
}
