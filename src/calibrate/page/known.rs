//! What is known of the geometry: of combinations, at the tool, parameter by parameter.

use crate::calibrate::Calibrated;
use crate::calibrate::parts::{Identified, RowResult, Stats};
use crate::report::format::{NBSP, percent, significant};
use crate::report::html::{self, Section};
use crate::report::plot::{Axis, Colour, Figure, Panel, Series, Shape, singular_values};
use maud::{Markup, html};

/// Millimetres with their unit.
pub(super) fn mm(x: f64) -> String {
    format!("{}{NBSP}mm", significant(1e3 * x, 3))
}

pub(super) fn mean(s: Option<Stats>) -> f64 {
    s.map_or(f64::NAN, |s| s.mean)
}

pub(super) fn identifiability(found: &Calibrated) -> Section {
    let i = &found.identifiability;
    let o = i.observability;
    let figure = Figure {
        description: "singular values of the scaled Jacobian".into(),
        height: 190.0,
        columns: 1,
        panels: vec![singular_values(
            "whitened residuals a tolerance",
            "singular value",
            &i.singular_values,
            i.rank,
        )],
        ..Figure::default()
    };
    let rows: Vec<Vec<Markup>> = i
        .confounded
        .iter()
        .map(|c| {
            let with: Vec<String> = c
                .with
                .iter()
                .take(6)
                .map(|(n, f)| format!("{} × {n}", significant(*f, 3)))
                .collect();
            let more = if c.with.len() > 6 { ", …" } else { "" };
            vec![
                html! { (c.parameter) },
                html! { (if c.gauge { "choice of frames" } else { "geometry" }) },
                html! { span class="code" { (with.join(", ")) (more) } },
            ]
        })
        .collect();
    Section::new(
        format!("What can be told: {} of {}", i.rank, i.total),
        html! {
            (html::figure(figure.svg(), html! {
                "Each is the length of the residuals that one tolerance makes, in standard deviations of the noise. \
                 Gap at the border of the rank: " (significant(i.gap, 2)) "."
            }))
            p {
                "Observability: O1 " (significant(o[0], 3)) ", O2 " (significant(o[1], 3)) ", O3 "
                (significant(o[2], 3)) ", O4 " (significant(o[3], 3)) ", O5 " (significant(o[4], 3)) "."
            }
            @if !rows.is_empty() {
                (html::details(
                    "Directions that no row tells; tolerances decide them",
                    html::table(&["one", "what", "can be traded against"], &[1, 2], &rows),
                ))
            }
        },
    )
}

pub(super) fn tool(found: &Calibrated) -> Section {
    let of = |f: &dyn Fn(&RowResult) -> f64| -> Vec<[f64; 2]> {
        found
            .rows
            .iter()
            .map(|r| [f(r), 1e3 * r.predicted])
            .collect()
    };
    let panel = |label: &str, f: &dyn Fn(&RowResult) -> f64| Panel {
        x: Axis::linear(label),
        y: Axis::linear("standard deviation, mm"),
        series: vec![Series {
            points: of(f),
            colour: Colour::BLUE,
            width: 1.6,
            shape: Shape::Dots,
        }],
        ..Panel::default()
    };
    let figure = Figure {
        description: "predicted uncertainty of the tool over the workspace".into(),
        height: 170.0,
        columns: 2,
        panels: vec![
            panel("distance from the base axis, m", &|r| {
                r.position[0].hypot(r.position[1])
            }),
            panel("height in the base, m", &|r| r.position[2]),
        ],
        ..Figure::default()
    };
    let all: Vec<f64> = found.rows.iter().map(|r| r.predicted).collect();
    let s = Stats::of(&all);
    Section::new(
        "Uncertainty of the tool",
        html! {
            (html::figure(figure.svg(), html! {
                "Standard deviation of the tool's position that the unknowns leave, in the recorded postures: mean "
                (mm(mean(s))) ", largest " (mm(s.map_or(f64::NAN, |s| s.max))) ". It holds as far as the model does. \
                 Rigid motions of all postures together are taken out: nothing tells where the base stands."
            }))
        },
    )
}

pub(super) fn parameters(found: &Calibrated) -> Section {
    let each = |u: &Identified| {
        let (factor, unit) = match u.unknown.unit {
            "m" => (1e3, "mm"),
            "rad" => (1e3, "mrad"),
            "rad/(N m)" => (1e6, "µrad/(N m)"),
            other => (1.0, other),
        };
        vec![
            html! { (u.unknown.name) },
            html! { (significant(factor * u.value, 4)) },
            html! { (significant(factor * u.std, 2)) },
            html! { (significant(factor * u.unknown.prior, 3)) },
            html! { (unit) },
            html! { (percent((u.std / u.unknown.prior).powi(2).min(1.0))) },
        ]
    };
    let (robot, rest): (Vec<_>, Vec<_>) = found.unknowns.iter().partition(|u| u.unknown.of_robot());
    let head = [
        "unknown",
        "value",
        "standard deviation",
        "tolerance",
        "unit",
        "share of the prior",
    ];
    let table = |list: &[&Identified]| {
        html::table(
            &head,
            &[4],
            &list.iter().map(|u| each(u)).collect::<Vec<_>>(),
        )
    };
    Section::new(
        "Unknowns",
        html! {
            p { "Deviations from the robot file. Where the share of the prior is near 100 %, the rows say nothing of \
                 this one alone; combinations may be known well. The noise was found to be "
                (significant(found.noise, 3)) " times the stated or assumed one." }
            (html::details("Of the robot", table(&robot)))
            (html::details("Of the set-up", table(&rest)))
        },
    )
}
