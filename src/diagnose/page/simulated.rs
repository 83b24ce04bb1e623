//! Forward simulation: the deviation from the log, and what drove the simulated robot.

use super::{Diagnosis, unit, worst};
use crate::diagnose::controller::{BANDWIDTH, Kind};
use crate::diagnose::forward::LONGEST;
use crate::report::format::{percent, significant};
use crate::report::html::{figure, legend, table};
use crate::report::plot::{Axis, Colour, Figure, Panel, Series, Shape};
use maud::{Markup, html};

/// Forward simulation of the first record: curves of the joints that stray most, and all rms.
pub(super) fn simulated(d: &Diagnosis) -> Markup {
    let f = &d.forward;
    let Some(first) = f.records.first() else {
        return html! { p { "No record was simulated." } };
    };
    let colours = [Colour::GREY, Colour::BLUE, Colour::ORANGE];
    let names = ["nominal", "refitted", "improved"];
    let step = (first.t.len() / 1500).max(1);
    let panels = worst(d, 3)
        .into_iter()
        .map(|j| {
            let curves = (0..3).filter(|m| !first.deviation[*m].is_empty());
            let line = |m: usize| {
                let points = first.t.iter().zip(&first.deviation[m][j]);
                let points = points.step_by(step).map(|(t, y)| [*t, *y]).collect();
                Series::line(points, colours[m])
            };
            Panel {
                title: d.joints[j].clone(),
                x: Axis::linear("time, s"),
                y: Axis::linear(unit("deviation", f.units[j])),
                series: curves.map(line).collect(),
                ..Panel::default()
            }
        })
        .collect();
    let svg = Figure {
        description: "deviation of the simulated robot from the log".into(),
        height: 150.0,
        columns: d.joints.len().clamp(1, 3),
        panels,
        ..Figure::default()
    }
    .svg();
    let mut rows = Vec::new();
    for r in &f.records {
        for j in 0..d.joints.len() {
            let figure = |of: &Option<Vec<f64>>, unit: &str| match of {
                Some(rms) => html! { (significant(rms[j], 3)) " " (unit) },
                None => html! { "–" },
            };
            // what the controller sends for it, where there is one
            let cell = |m: usize| {
                html! {
                    (figure(&r.rms[m], f.units[j]))
                    @if let Some(Ok(_)) = f.held { ", " (figure(&r.torque[m], d.units[j])) }
                }
            };
            let shrinks = match (&r.rms[1], &r.rms[2]) {
                (Some(a), Some(b)) if a[j] > 0.0 => percent(1.0 - b[j] / a[j]),
                _ => "–".to_string(),
            };
            rows.push(vec![
                html! { (r.record) },
                html! { (d.joints[j]) },
                cell(0),
                cell(1),
                cell(2),
                html! { (shrinks) },
            ]);
        }
    }
    let kind = match first.fit {
        true => "first fitted record (no record is kept out)",
        false => "holdout records",
    };
    html! {
        p { "Simulated: the " (kind) ", at most " (significant(LONGEST, 2)) " s of each; rms of the deviation from \
            the recorded position. " (driven(d)) " The improved model is that of the files, with bodies that can exist. Effects act as the torque that they have along the recorded motion." }
        @if first.deviation.iter().any(|m| !m.is_empty()) {
            (figure(svg, html! {
                (legend(&[0, 1, 2].map(|m| (colours[m], Shape::Line, names[m]))))
                "The joints with the largest share of the gap in " (first.record) "."
            }))
        }
        @if f.records.iter().any(|r| r.rms.iter().any(Option::is_some)) {
            (table(&["record", "joint", names[0], names[1], names[2], "less than refitted by"], &[0, 1], &rows))
        }
        @for why in &f.failed { p { "Not simulated: " (why) } }
    }
}

/// What drives the simulated robot.
fn driven(d: &Diagnosis) -> Markup {
    match &d.forward.held {
        Some(Ok(c)) => {
            let known = (0..c.left.len()).filter(|j| !c.soft.contains(j));
            let left = known.map(|j| c.left[j]).fold(0.0, f64::max);
            html! {
                "The simulated robot is under the same commands: its controller, identified from the commanded positions and the torques of \
                 the logs " @match c.kind {
                    Kind::Actuators => { "(feedback of every joint on its own; " }
                    Kind::InverseDynamics => { "(inverse dynamics; " }
                } "it leaves at most " (percent(left)) " of a joint's torque), sends what was recorded less its answer to the deviation, whose rms stands beside."
                @if !c.soft.is_empty() {
                    " The gains of " (c.soft.iter().map(|j| d.joints[*j].as_str()).collect::<Vec<_>>().join(", "))
                    " are not certain; a soft spring stands in their place."
                }
            }
        }
        held => html! {
            "The recorded torque drives the simulated robot, and a soft spring and damper of "
            (significant(BANDWIDTH, 2)) " Hz hold it, for no model stays on a path that is driven by torque alone; so the \
             figures compare models, and are no tracking errors under the robot's own controller"
            @if let Some(Err(why)) = held { ": " (why) } "."
        },
    }
}
