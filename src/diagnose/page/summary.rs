//! The tiles at the top, and what the data cannot say.

use super::Diagnosis;
use crate::report::format::{percent, significant};
use crate::report::html::{details, table, tiles};
use maud::{Markup, html};

pub(super) fn summary(d: &Diagnosis) -> Markup {
    let worst = (0..d.joints.len())
        .max_by(|a, b| d.refit[*a].share.total_cmp(&d.refit[*b].share))
        .unwrap_or(0);
    let g = &d.refit[worst];
    // what no effect was found for is gone by the refit alone
    let found = d.findings.iter().any(|f| f.member);
    let shrink = d.shrink().filter(|_| found);
    let share = |s: Option<f64>| s.map_or("–".to_string(), percent);
    let all = [
        (
            format!("{} ×", significant(g.rms / g.noise, 3)),
            "gap over noise after a refit".into(),
            format!(
                "{}: {} {} rms over a noise of {}",
                g.joint,
                significant(g.rms, 3),
                d.units[worst],
                significant(g.noise, 3)
            ),
        ),
        (
            shrink.map_or("–".into(), |s| percent(s.max(0.0))),
            "of the gap gone on holdout records".into(),
            match shrink {
                Some(_) => "with the effects found, parameters from the fitted records".into(),
                None if d.holdout.is_some() && found => "holdout records show no gap".into(),
                None if d.holdout.is_some() => "no effect was found".into(),
                None => {
                    "there is no holdout record in which anything moves: this cannot be said".into()
                }
            },
        ),
        (
            format!(
                "{} / {} / {}",
                share(d.shares.odd),
                share(d.shares.even),
                share(d.shares.non_periodic)
            ),
            "odd / even / not repeating".into(),
            match (d.shares.odd, d.shares.non_periodic) {
                (None, None) => "no record repeats: this cannot be said".into(),
                (None, _) => "odd and even need a motion of odd harmonics".into(),
                _ => "shares of the refitted gap".to_string(),
            },
        ),
        (
            d.bound.map_or("–".into(), percent),
            "any function of the state could explain".into(),
            match d.records.iter().any(|r| r.fit && r.repeats) {
                true => {
                    "bins of position and velocity of each joint, tried on other periods".into()
                }
                false => "no record repeats: this cannot be said".into(),
            },
        ),
    ];
    tiles(&all)
}

pub(super) fn limits(d: &Diagnosis) -> Markup {
    html! {
        @if d.untestable.is_empty() {
            p { "Every effect of the catalogue shows in this motion by more than one percent." }
        } @else {
            p { "The nominal model absorbs more than 99 % of these effects in this motion. They are untestable here, not absent:" }
            (details("Untestable effects", table(&["effect", "where", "visible"], &[1],
                &d.untestable.iter().map(|(e, p, v)| vec![
                    html! { (e.replace('_', " ")) },
                    html! { @if p.is_empty() { "whole robot" } @else { (p) } },
                    html! { (percent(*v)) },
                ]).collect::<Vec<_>>())))
        }
        @if !d.ruled_out.is_empty() {
            p { "These would explain a part of the gap, with values that no machine can have or that are not looked for. They are not named, for the reason beside each:" }
            ul { @for r in &d.ruled_out {
                li { (r.title) @if !r.joints.is_empty() { " on " (r.joints.join(" and ")) } ": " (r.why) "." }
            } }
        }
        @if !d.warnings.is_empty() {
            h3 { "Warnings" }
            ul { @for w in &d.warnings { li { (w.to_string()) } } }
        }
    }
}
