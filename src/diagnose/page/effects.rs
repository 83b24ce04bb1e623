//! Which effects were found, and how far the gap shrinks with them.

use super::Diagnosis;
use crate::diagnose::finding::Finding;
use crate::diagnose::verdict::Verdict;
use crate::report::format::{percent, significant};
use crate::report::html::{details, table};
use maud::{Markup, html};

pub(super) fn effects(d: &Diagnosis) -> Markup {
    if d.findings.is_empty() {
        return html! { p { "No effect stands out: " (match d.verdict {
            Verdict::NoGap => "there is nothing to explain.",
            _ => "none of the catalogue explains a share of the gap that holds on holdout records.",
        }) } };
    }
    let row = |f: &Finding| {
        vec![
            html! {
                @if f.is_claim() { strong { (f.title) } } @else { (f.title) }
                div class="code" { (f.equation) }
            },
            html! { @if f.joints.is_empty() { "whole robot" } @else { (f.joints.join(", ")) } },
            html! { (percent(f.confidence)) },
            html! { (percent(f.explains)) @if f.member { div { small { (percent(f.interval[0])) "–" (percent(f.interval[1])) } } } },
            html! { (held(f)) },
            html! { (percent(f.visibility)) @if f.frozen { div { small { "against the prior" } } } },
            html! {
                @if let Some(d) = f.decoys { (percent(d)) } @else { "–" }
                div { small { @if let Some(u) = f.unsteady { "unsteady " (percent(u)) } } }
                div { small { @if let Some(u) = f.uneven { "uneven " (percent(u)) } } }
            },
            html! {
                (values(f))
                @if !f.same.is_empty() { div { small { "not told from " (f.same.join(", ").replace('_', " ")) } } }
            },
        ]
    };
    let head = [
        "effect",
        "where",
        "confidence",
        "explains",
        "on holdout",
        "visible",
        "decoys",
        "parameters (95 %)",
    ];
    let (set, rest): (Vec<&Finding>, Vec<&Finding>) = d.findings.iter().partition(|f| f.member);
    html! {
        p { "An effect is claimed from a confidence of 50 % on. " strong { "Explains" } " is the share of the gap above the \
            noise that goes when the effect is added to the others; " strong { "visible" } " the share of the effect that the \
            nominal model cannot absorb by other parameters; " strong { "decoys" } " the most that the effect explains of its own when it \
            is moved in time, over what it explains in place: near 100 % it is as good as any signal; " strong { "unsteady" } " \
            what coefficients of their own for every record would add to that, near 0 % where it is the same in all; " strong { "uneven" } " \
            the same of a delay of the whole robot, with one of its own for every joint." }
        @if d.friction_found {
            p { "Friction that the robot file leaves out has a row for each joint. Viscous and Coulomb friction of a joint that were both \
                left out have one share, which is that of both." }
        }
        (table(&head, &[1, 7], &set.iter().map(|f| row(f)).collect::<Vec<_>>()))
        @if !rest.is_empty() {
            (details("Rivals: what else could stand in their place", table(&head, &[1, 7],
                &rest.iter().map(|f| row(f)).collect::<Vec<_>>())))
        }
    }
}

/// The share on holdout records, where these show a gap.
fn held(f: &Finding) -> String {
    f.holdout.map_or("–".into(), percent)
}

/// A value whose interval is so many times as wide is not determined.
const WIDE: f64 = 10.0;

fn values(f: &Finding) -> Markup {
    html! {
        @for v in &f.values {
            @let half = v.std.map_or(0.0, |s| 1.96 * s);
            div class="value" {
                (v.name.replace('_', " ")) " "
                @if half > WIDE * v.value.abs() {
                    "not determined"
                } @else if v.is_unknown_mass() {
                    "not determined (" (significant(v.value, 2)) " ± " (significant(half, 2)) " " (v.unit) ")"
                } @else {
                    (significant(v.value, 4))
                    @if half > 0.0 { " ± " (significant(half, 2)) }
                    " " (v.unit)
                }
            }
        }
    }
}

pub(super) fn shrink(d: &Diagnosis) -> Markup {
    let rows: Vec<Vec<Markup>> = d
        .records
        .iter()
        .map(|r| {
            let mean = |i: usize| {
                let n = r.joints.len() as f64;
                (r.joints.iter().map(|v| v[i]).sum::<f64>() / n).sqrt()
            };
            let [a, b, c] = [mean(0), mean(1), mean(2)];
            let share = (b > 0.0).then(|| 1.0 - (c / b).powi(2));
            vec![
                html! { (r.name) @for remark in &r.remarks { div { small { (remark) } } } },
                html! { (if r.fit { "fit" } else { "holdout" }) },
                html! { (significant(a, 3)) },
                html! { (significant(b, 3)) },
                html! { (significant(c, 3)) },
                html! { (share.map_or("–".into(), |s| percent(s.max(0.0)))) },
            ]
        })
        .collect();
    let members = || d.findings.iter().filter(|f| f.member);
    let mut steps: Vec<Vec<Markup>> = members()
        .map(|f| {
            vec![
                html! { (f.title) @if !f.joints.is_empty() { " on " (f.joints.join(" and ")) } @if !f.is_claim() { div { small { "not claimed" } } } },
                html! { (percent(f.explains)) },
                html! { (held(f)) },
            ]
        })
        .collect();
    if members().count() > 1 {
        let gone = d.shrink().map_or("–".into(), percent);
        steps.push(vec![
            html! { strong { "all together" } },
            html! { (percent(1.0 - d.unexplained)) },
            html! { (gone) },
        ]);
    }
    html! {
        p { "Gap of all joints in multiples of their noise (root of the mean energy above the noise), record by record. Holdout records were \
            not fitted to." }
        (table(&["record", "use", "frozen", "refitted", "with the effects", "of the energy gone"], &[1], &rows))
        @if !steps.is_empty() {
            h3 { "Effect by effect" }
            @if steps.len() > 1 { p { "Each is what comes back when that effect alone is taken out: the shares need not add up." } }
            (table(&["effect", "of the fitted gap", "of the holdout gap"], &[], &steps))
        }
    }
}
