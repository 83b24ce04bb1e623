//! The report of the diagnosis of a calibration.

use super::verdict::CLAIM;
use super::{Finding, PoseDiagnosis};
use crate::report::format::{NBSP, count, percent, significant};
use crate::report::html::{self, Section, Tone};
use crate::report::joints;
use crate::report::plot::{Axis, Colour, Figure, Panel, Rule, Series, Shape};
use maud::{Markup, html};

fn mm(x: f64) -> String {
    format!("{}{NBSP}mm", significant(1e3 * x, 3))
}

fn words(effect: &str) -> String {
    effect.replace('_', " ")
}

/// A share of the gap in words.
pub fn share(x: f64) -> String {
    match x {
        x if x <= 0.0 => "nothing".into(),
        x if x < 0.001 => format!("{}{NBSP}%", significant(100.0 * x, 1)),
        x => percent(x),
    }
}

/// The verdict in a sentence, and how good the news is.
pub fn sentence(d: &PoseDiagnosis) -> (Tone, String) {
    let rms = d.errors(true, 0).map_or(f64::NAN, |s| s.rms);
    let claimed: Vec<String> = claims(d)
        .map(|f| format!("{} ({})", words(f.effect), f.places.join(" or ")))
        .collect();
    let named = claimed.join(", ");
    let held = match d.found.holdout {
        Some(h) => format!(" On rows held out the gap shrinks by {}.", percent(h)),
        None => String::new(),
    };
    match d.found.verdict {
        "no_gap" => (
            Tone::Good,
            format!(
                "No gap: errors of {} rms are those of the noise ({}).",
                mm(rms),
                mm(d.noise)
            ),
        ),
        "explained" => (
            Tone::Good,
            format!(
                "Explained: errors of {} rms come from {named}.{held}",
                mm(rms)
            ),
        ),
        "partly_explained" => (
            Tone::Fair,
            format!(
                "Partly explained: of errors of {} rms {} stay beside {named}.{held}",
                mm(rms),
                percent(d.found.unexplained)
            ),
        ),
        _ => (
            Tone::Bad,
            format!(
                "Unknown: errors of {} rms, noise {}, and no effect of the catalogue that these rows would prove.{held}",
                mm(rms),
                mm(d.noise)
            ),
        ),
    }
}

/// Findings that are claimed.
pub fn claims(d: &PoseDiagnosis) -> impl Iterator<Item = &Finding> {
    d.found.findings.iter().filter(|f| f.confidence >= CLAIM)
}

/// The report as one HTML file.
pub fn html(d: &PoseDiagnosis) -> String {
    let (tone, verdict) = sentence(d);
    let mut sections = Vec::new();
    if !d.warnings.is_empty() {
        sections.push(Section {
            tone: Tone::Fair,
            ..Section::new(
                format!("Warnings ({})", d.warnings.len()),
                html! { ul { @for w in &d.warnings { li { strong { (w.subject) } ": " (w.message) } } } },
            )
        });
    }
    if !d.found.findings.is_empty() {
        sections.push(findings(d));
    }
    sections.push(errors(d));
    sections.push(along(d));
    if let Some(n) = &d.next {
        sections.push(Section::new(
            "What to measure next",
            html! {
                p { (count(n.postures.len(), "posture")) " in next.csv tell " (n.separates[0]) " from " (n.separates[1])
                    ": the second can imitate " (percent(n.overlap[0])) " of the first in these rows, and "
                    (percent(n.overlap[1])) " with them." }
            },
        ));
    }
    if !d.untestable.is_empty() {
        let rows: Vec<Vec<Markup>> = d
            .untestable
            .iter()
            .map(|(e, p)| {
                let about = super::catalogue::effect(e);
                vec![
                    html! { (words(e)) },
                    html! { (p) },
                    html! { (about.separated_by) },
                ]
            })
            .collect();
        sections.push(Section::new(
            "What these postures cannot show",
            html! {
                p { "An effect of its expected size would be lost in the noise, or in where camera, target or sockets are." }
                (html::details(
                    &count(rows.len(), "place"),
                    html::table(&["effect", "place", "what would show it"], &[0, 1, 2], &rows),
                ))
            },
        ));
    }
    sections.push(joints::order(d.joints.iter().map(String::as_str)));
    html::page(
        &format!("Diagnosis of poses: {}", d.robot),
        &format!("frame {}, {}", d.frame, count(d.lines.len(), "row")),
        (tone, &verdict),
        &sections,
    )
}

fn value(v: &super::verdict::Value) -> String {
    let (factor, unit) = match v.unit {
        "m" => (1e3, "mm"),
        "rad" => (1e3, "mrad"),
        "rad/(N m)" => (1e6, "µrad/(N m)"),
        "m/N" => (1e6, "µm/N"),
        other => (1.0, other),
    };
    format!(
        "{} {} ± {}{NBSP}{unit}",
        v.name.replace('_', " "),
        significant(factor * v.value, 3),
        significant(factor * 1.96 * v.std, 2)
    )
}

fn findings(d: &PoseDiagnosis) -> Section {
    let rows: Vec<Vec<Markup>> = d
        .found
        .findings
        .iter()
        .map(|f| {
            let claimed = f.confidence >= CLAIM;
            let rivals: Vec<String> = f
                .rivals
                .iter()
                .take(6)
                .map(|(e, p)| format!("{} ({p})", words(e)))
                .collect();
            let values: Vec<String> = f.values.iter().map(value).collect();
            vec![
                html! { @if claimed { strong { (words(f.effect)) } } @else { (words(f.effect)) } },
                html! { (f.places.join(" or ")) },
                html! { (percent(f.confidence)) },
                html! { (share(f.explains)) " (" (share(f.interval[0])) " to " (share(f.interval[1])) ")" },
                html! { @if let Some(h) = f.holdout { (share(h)) } @else { "–" } },
                html! { (values.join("; ")) },
                html! { (rivals.join(", ")) },
            ]
        })
        .collect();
    Section::new(
        "Findings",
        html! {
            (html::table(
                &["effect", "where", "confidence", "explains", "on rows held out", "values, with 95 % intervals",
                  "cannot be told from"],
                &[0, 1, 5, 6],
                &rows,
            ))
            p { "Claims are in bold: no other explanation of these rows is as likely, and rows held out agree. Shares \
                 are of the square of the gap above the noise, with the other findings free: one hundredth of it is a tenth in length." }
        },
    )
}

fn dots(points: Vec<[f64; 2]>, colour: Colour) -> Series {
    Series {
        points,
        colour,
        width: 1.6,
        shape: Shape::Dots,
    }
}

fn legend() -> Markup {
    html::legend(&[
        (Colour::BLUE, Shape::Dots, "fit"),
        (Colour::ORANGE, Shape::Dots, "holdout"),
        (Colour::VERMILLION, Shape::Dots, "does not belong"),
    ])
}

fn errors(d: &PoseDiagnosis) -> Section {
    let panel = |title: &str, after: usize, rules: Vec<Rule>| {
        let of = |wanted: &dyn Fn(&super::Line) -> bool| -> Vec<[f64; 2]> {
            let own = d.lines.iter().enumerate().filter(|(_, l)| wanted(l));
            own.map(|(i, l)| [i as f64, 1e3 * l.errors[after]])
                .collect()
        };
        Panel {
            title: title.into(),
            x: Axis::whole("row"),
            y: Axis::log("error, mm"),
            rules,
            series: vec![
                dots(of(&|l| l.fit && !l.stray), Colour::BLUE),
                dots(of(&|l| !l.fit && !l.stray), Colour::ORANGE),
                dots(of(&|l| l.stray), Colour::VERMILLION),
            ],
            ..Panel::default()
        }
    };
    let noise = Rule {
        at: 1e3 * d.noise,
        upright: false,
        colour: Colour::GREY,
        label: "noise".into(),
    };
    let figure = Figure {
        description: "errors of all rows without and with the findings".into(),
        height: 190.0,
        columns: 1,
        share_x: true,
        panels: vec![
            panel("robot of the file", 0, vec![noise.clone()]),
            panel("with the findings", 1, vec![noise]),
        ],
        ..Figure::default()
    };
    let mut rows = Vec::new();
    for (fit, name) in [(true, "fit"), (false, "holdout")] {
        for (after, when) in [(0, "robot of the file"), (1, "with the findings")] {
            if let Some(s) = d.errors(fit, after) {
                let cell = |x: f64| html! { (significant(1e3 * x, 3)) };
                rows.push(vec![
                    html! { (name) ", " (when) },
                    cell(s.mean),
                    cell(s.rms),
                    cell(s.p95),
                    cell(s.max),
                ]);
            }
        }
    }
    Section::new(
        "Errors",
        html! {
            (html::table(&["mm", "mean", "RMS", "95th percentile", "maximum"], &[], &rows))
            (html::figure(figure.svg(), legend()))
        },
    )
}

fn along(d: &PoseDiagnosis) -> Section {
    let panels = d.joints.iter().enumerate().flat_map(|(k, name)| {
        [(0, "file"), (1, "findings")].map(|(after, when)| {
            let of = |fit: bool| -> Vec<[f64; 2]> {
                let own = d.lines.iter().filter(|l| l.fit == fit && !l.stray);
                own.map(|l| [l.q[k], 1e3 * l.errors[after]]).collect()
            };
            Panel {
                title: format!("{name}, {when}"),
                x: Axis::linear("rad or m"),
                y: Axis::linear("error, mm"),
                series: vec![
                    dots(of(true), Colour::BLUE),
                    dots(of(false), Colour::ORANGE),
                ],
                ..Panel::default()
            }
        })
    });
    let figure = Figure {
        description: "errors over the readings of each joint".into(),
        height: 120.0,
        columns: 4,
        panels: panels.collect(),
        ..Figure::default()
    };
    Section::new(
        "Errors over the readings",
        html! {
            (html::figure(figure.svg(), html! {
                "Each joint with the robot of the file, and with the findings. What still follows a reading is not explained."
            }))
        },
    )
}
