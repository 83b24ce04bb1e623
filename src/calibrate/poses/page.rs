//! The report of chosen postures.

use super::Poses;
use crate::report::format::{NBSP, count, significant};
use crate::report::html::{self, Section, Tone};
use crate::report::plot::{Axis, Colour, Figure, Panel, Rule, Series, Shape};
use maud::html;

/// The report as one HTML file.
pub fn html(found: &Poses) -> String {
    let mm = |x: f64| format!("{}{NBSP}mm", significant(1e3 * x, 3));
    let random = found.random_middle();
    let verdict = format!(
        "{} leave the tool uncertain by {}; as many random ones by {}.",
        count(found.postures.len(), "posture"),
        mm(found.predicted),
        mm(random)
    );
    let tone = match found.predicted < random {
        true => Tone::Good,
        false => Tone::Fair,
    };
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
    let points = found
        .course
        .iter()
        .enumerate()
        .map(|(k, v)| [(k + 1) as f64, 1e3 * v])
        .collect();
    let course = Figure {
        description: "predicted uncertainty over the number of postures".into(),
        height: 200.0,
        columns: 1,
        panels: vec![Panel {
            x: Axis::whole("postures"),
            y: Axis::log("standard deviation of the tool, mm"),
            rules: vec![Rule {
                at: 1e3 * random,
                upright: false,
                colour: Colour::ORANGE,
                label: format!("{} random ones", found.postures.len()),
            }],
            series: vec![Series::line(points, Colour::BLUE)],
            ..Panel::default()
        }],
        ..Figure::default()
    };
    sections.push(Section::new(
        "How well the tool will be known",
        html! {
            (html::figure(course.svg(), html! {
                "Predicted standard deviation of the tool's position, root mean square over the workspace, with the \
                 noise and tolerances that were stated. Before any measurement: " (mm(found.before)) ". Of twenty \
                 random sets the best has " (mm(found.random.iter().copied().fold(f64::INFINITY, f64::min))) "."
            }))
        },
    ));
    let dots = |a: usize, b: usize| Panel {
        x: Axis::linear(["x, m", "y, m", "z, m"][a]),
        y: Axis::linear(["x, m", "y, m", "z, m"][b]),
        series: vec![
            Series {
                points: found
                    .postures
                    .iter()
                    .map(|c| [c.frame.p[a], c.frame.p[b]])
                    .collect(),
                colour: Colour::GREY,
                width: 0.8,
                shape: Shape::Line,
            },
            Series {
                points: found
                    .postures
                    .iter()
                    .map(|c| [c.frame.p[a], c.frame.p[b]])
                    .collect(),
                colour: Colour::BLUE,
                width: 2.0,
                shape: Shape::Dots,
            },
        ],
        ..Panel::default()
    };
    let places = Figure {
        description: "where the frame is in the postures, from above and from the side".into(),
        height: 260.0,
        columns: 2,
        panels: vec![dots(0, 1), dots(0, 2)],
        ..Figure::default()
    };
    sections.push(Section::new(
        "Where they are",
        html! {
            (html::figure(places.svg(), html! {
                "Origin of " (found.frame) " in the base frame, in the order of the file. The way through all of them is "
                (significant(found.way[0], 3)) " of the joint that moves most, " (significant(found.way[1], 3))
                " in the order they were found."
            }))
            p { (found.found[0]) " candidates of " (found.found[1]) " draws are inside the limits and free of collision"
                @if found.sight.is_some() { ", with the target in view of the camera and facing it" } "." }
        },
    ));
    let head: Vec<String> = std::iter::once("posture".to_string())
        .chain(found.joints.iter().cloned())
        .collect();
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    let rows: Vec<Vec<maud::Markup>> = found
        .postures
        .iter()
        .enumerate()
        .map(|(k, c)| {
            let mut cells = vec![html! { (k + 1) }];
            cells.extend(c.q.iter().map(|q| html! { (significant(*q, 4)) }));
            cells
        })
        .collect();
    sections.push(Section::new(
        "Postures",
        html::details("All readings, rad or m", html::table(&head, &[], &rows)),
    ));
    html::page(
        &format!("Postures: {}", found.robot),
        &format!("frame {}", found.frame),
        (tone, &verdict),
        &sections,
    )
}
