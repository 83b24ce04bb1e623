//! The report of a calibration.

mod known;

use super::Calibrated;
use super::judge::Stats;
use super::parts::{GroupResult, RowResult};
use crate::report::format::{count, percent, significant};
use crate::report::html::{self, Section, Tone};
use crate::report::joints;
use crate::report::plot::{Axis, Colour, Figure, Panel, Rule, Series, Shape};
use known::{identifiability, mean, mm, parameters, tool};
use maud::{Markup, html};

/// The report as one HTML file.
pub fn html(found: &Calibrated) -> String {
    let judged = found.errors(false, true)[0].is_empty();
    let [before, after] = found.errors(judged, true);
    let [_, sound] = found.errors(judged, false);
    let (a, b) = (mean(Stats::of(&before)), mean(Stats::of(&after)));
    let rows = match judged {
        true => "the rows it was fitted to; no row was held out, so this is no proof",
        false => "rows that took no part in the fit",
    };
    let tone = match (b < a, judged) {
        (true, false) => Tone::Good,
        (true, true) => Tone::Fair,
        _ => Tone::Bad,
    };
    let verdict = format!(
        "Mean error {} with the robot as in its file, {} calibrated, on {rows}{}.",
        mm(a),
        mm(b),
        match found.outliers.is_empty() {
            true => String::new(),
            false => format!(
                " ({} without what was spoiled)",
                mm(mean(Stats::of(&sound)))
            ),
        }
    );
    let mut sections = Vec::new();
    if !found.warnings.is_empty() {
        sections.push(Section {
            tone: Tone::Fair,
            ..Section::new(
                format!("Warnings ({})", found.warnings.len()),
                html! { ul { @for w in &found.warnings { li { strong { (w.subject) } ": " (w.message) } } } },
            )
        });
    }
    sections.push(accuracy(found));
    sections.push(residuals(found));
    if !found.outliers.is_empty() {
        sections.push(outliers(found));
    }
    if !found.distances.is_empty() {
        sections.push(distances(found));
    }
    if !found.trials.is_empty() {
        sections.push(effects(found));
    }
    sections.push(identifiability(found));
    sections.push(tool(found));
    sections.push(parameters(found));
    sections.push(joints::order(found.joints.iter().map(String::as_str)));
    html::page(
        &format!("Calibration: {}", found.robot),
        &format!("frame {}, {}", found.frame, count(found.rows.len(), "row")),
        (tone, &verdict),
        &sections,
    )
}

fn row(name: Markup, g: Option<Stats>) -> Vec<Markup> {
    let cell = |f: &dyn Fn(Stats) -> f64| html! { (significant(1e3 * g.map_or(f64::NAN, f), 3)) };
    vec![
        name,
        cell(&|s| s.mean),
        cell(&|s| s.median),
        cell(&|s| s.rms),
        cell(&|s| s.p95),
        cell(&|s| s.max),
    ]
}

fn accuracy(found: &Calibrated) -> Section {
    let mut rows = Vec::new();
    for (fit, name) in [(true, "fit"), (false, "holdout")] {
        let [before, after] = found.errors(fit, true);
        let [_, sound] = found.errors(fit, false);
        if before.is_empty() {
            continue;
        }
        rows.push(row(html! { (name) ", before" }, Stats::of(&before)));
        rows.push(row(html! { (name) ", after" }, Stats::of(&after)));
        if sound.len() < after.len() {
            rows.push(row(
                html! { (name) ", after, without outliers" },
                Stats::of(&sound),
            ));
        }
        let [a, b] = found.angles(fit);
        if !a.is_empty() {
            let milli =
                |l: &[f64]| Stats::of(&l.iter().map(|x| 1e-3 * x.to_degrees()).collect::<Vec<_>>());
            rows.push(row(html! { (name) ", before, degrees" }, milli(&a)));
            rows.push(row(html! { (name) ", after, degrees" }, milli(&b)));
        }
    }
    let each = |g: &GroupResult| {
        vec![
            html! { (g.name) @if g.spoiled { " " span class="bad-text" { "spoiled" } } },
            html! { (if g.fit { "fit" } else { "holdout" }) },
            html! { (g.rows) },
            html! { (g.outliers) },
            html! { (significant(1e3 * mean(g.before), 3)) },
            html! { (significant(1e3 * mean(g.after), 3)) },
            html! { (significant(1e3 * mean(g.sound), 3)) },
            html! { (significant(1e3 * g.after.map_or(f64::NAN, |s| s.max), 3)) },
        ]
    };
    let groups: Vec<Vec<Markup>> = found.groups.iter().map(each).collect();
    Section::new(
        "Accuracy",
        html! {
            (html::table(&["mm", "mean", "median", "RMS", "95th percentile", "maximum"], &[], &rows))
            @if found.groups.len() > 1 {
                h3 { "By group" }
                (html::table(
                    &["group", "use", "rows", "outliers", "mean before, mm", "mean after, mm",
                      "without outliers, mm", "maximum after, mm"],
                    &[1],
                    &groups,
                ))
            }
            p { "The error of a point is its distance from the mean of its socket, that of a pose its distance in \
                 position from where the target was seen. Before: the robot as in its file, with camera, target and \
                 sockets fitted to it." }
        },
    )
}

fn residuals(found: &Calibrated) -> Section {
    let points = |fit: bool, stray: bool, f: &dyn Fn(&RowResult) -> f64| -> Vec<[f64; 2]> {
        let own = found.rows.iter().enumerate();
        own.filter(|(_, r)| r.fit == fit && r.outlier == stray)
            .map(|(i, r)| [i as f64, 1e3 * f(r)])
            .collect()
    };
    let dots = |points: Vec<[f64; 2]>, colour: Colour| Series {
        points,
        colour,
        width: 1.6,
        shape: Shape::Dots,
    };
    let mut rules = Vec::new();
    for (g, group) in found.groups.iter().enumerate() {
        if let Some(first) = found.rows.iter().position(|r| r.group == g) {
            rules.push(Rule {
                at: first as f64 - 0.5,
                upright: true,
                colour: Colour::GREY,
                label: match found.groups.len() {
                    1 => String::new(),
                    _ => group.name.clone(),
                },
            });
        }
    }
    let panel = |title: &str, f: &dyn Fn(&RowResult) -> f64, rules: Vec<Rule>| Panel {
        title: title.into(),
        x: Axis::whole("row"),
        y: Axis::log("error, mm"),
        rules,
        series: vec![
            dots(points(true, false, f), Colour::BLUE),
            dots(points(false, false, f), Colour::ORANGE),
            dots(
                [points(true, true, f), points(false, true, f)].concat(),
                Colour::VERMILLION,
            ),
        ],
        ..Panel::default()
    };
    let errors = Figure {
        description: "errors of all rows before and after".into(),
        height: 190.0,
        columns: 1,
        share_x: true,
        panels: vec![
            panel("before", &|r| r.before, Vec::new()),
            panel("after", &|r| r.after, rules),
        ],
        ..Figure::default()
    };
    let along = found.joints.iter().enumerate().map(|(k, name)| {
        let of = |fit: bool| -> Vec<[f64; 2]> {
            let own = found.rows.iter().filter(|r| r.fit == fit && !r.outlier);
            own.map(|r| [r.q[k], 1e3 * r.after]).collect()
        };
        Panel {
            x: Axis::linear(format!("{name}, rad or m")),
            y: Axis::linear("error, mm"),
            series: vec![
                dots(of(true), Colour::BLUE),
                dots(of(false), Colour::ORANGE),
            ],
            ..Panel::default()
        }
    });
    let spread = Figure {
        description: "errors over the readings of each joint".into(),
        height: 120.0,
        columns: 4,
        panels: along.collect(),
        ..Figure::default()
    };
    let legend = html::legend(&[
        (Colour::BLUE, Shape::Dots, "fit"),
        (Colour::ORANGE, Shape::Dots, "holdout"),
        (
            Colour::VERMILLION,
            Shape::Dots,
            "outlier, or of a spoiled group",
        ),
    ]);
    Section::new(
        "Residuals",
        html! {
            (html::figure(errors.svg(), html! { (legend) }))
            (html::figure(spread.svg(), html! {
                "Sound rows after calibration. Errors that follow the reading of a joint are not of the geometry."
            }))
        },
    )
}

fn outliers(found: &Calibrated) -> Section {
    let spoiled: Vec<&str> = found
        .groups
        .iter()
        .filter(|g| g.spoiled)
        .map(|g| g.name.as_str())
        .collect();
    let single = found
        .outliers
        .iter()
        .filter(|o| !found.groups[found.rows[o.row].group].spoiled);
    let rows: Vec<Vec<Markup>> = single
        .map(|o| {
            vec![
                html! { (o.row) },
                html! { (o.file) },
                html! { (o.line) },
                html! { (significant(1e3 * o.error, 3)) },
                html! { (o.note) },
            ]
        })
        .collect();
    Section {
        tone: Tone::Fair,
        ..Section::new(
            "What does not belong",
            html! {
                @if !spoiled.is_empty() {
                    p { "Spoiled as a whole: " strong { (spoiled.join(", ")) } ". Their errors are out of proportion \
                         to those of all other groups." }
                }
                @if !rows.is_empty() {
                    p { "Single rows that do not fit the others of their group; they took no part in the fit." }
                    (html::table(&["row", "file", "line", "error, mm", ""], &[1, 4], &rows))
                }
            },
        )
    }
}

fn distances(found: &Calibrated) -> Section {
    let rows: Vec<Vec<Markup>> = found
        .distances
        .iter()
        .map(|d| {
            let off = |k: usize| html! { (significant(1e3 * (d.found[k] - d.value), 3)) };
            vec![
                html! { (d.between[0]) " – " (d.between[1]) },
                html! { (significant(1e3 * d.value, 5)) },
                off(0),
                off(1),
            ]
        })
        .collect();
    Section::new(
        "Known distances",
        html::table(
            &["points", "stated, mm", "wrong by before, mm", "after, mm"],
            &[],
            &rows,
        ),
    )
}

fn effects(found: &Calibrated) -> Section {
    let rows: Vec<Vec<Markup>> = found
        .trials
        .iter()
        .map(|t| {
            vec![
                html! { (t.effect.replace('_', " ")) },
                html! { (significant(1e3 * t.without, 4)) },
                html! { (significant(1e3 * t.with, 4)) },
                html! { (percent(1.0 - t.with / t.without)) },
                html! { (significant(t.significance, 3)) },
                html! { (significant(t.evidence, 3)) },
                html! { (if t.kept { "kept" } else { "left out" }) },
            ]
        })
        .collect();
    Section::new(
        "Effects of the joints beside the geometry",
        html! {
            p { "Each was judged by fitted rows that were left out in turn; the rows held out took no part." }
            (html::table(
                &["effect", "error without, mm", "with, mm", "less by", "standard errors", "ln evidence", ""],
                &[6],
                &rows,
            ))
            @if let Some(g) = &found.gravity {
                p { "Torques of gravity: " (g) "." }
            }
        },
    )
}
