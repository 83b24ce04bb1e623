//! What the second encoders show, joint by joint.

use super::Diagnosis;
use crate::diagnose::second_encoder::{SecondEncoder, Seen};
use crate::report::format::{percent, significant};
use crate::report::html::{figure, legend, table};
use crate::report::plot::{Axis, Colour, Figure, Panel, Series, Shape};
use maud::{Markup, html};

pub(super) fn second_encoder(d: &Diagnosis) -> Markup {
    if d.second_encoder.is_empty() {
        return html! {};
    }
    let panels: Vec<Panel> = d.second_encoder.iter().map(|s| panel(d, s)).collect();
    let svg = Figure {
        description:
            "deflection between the two encoders of each joint against the torque that it transmits"
                .into(),
        height: 150.0,
        columns: if panels.len() > 1 { 2 } else { 1 },
        panels,
        ..Figure::default()
    }
    .svg();
    let rows: Vec<Vec<Markup>> = d.second_encoder.iter().map(row).collect();
    html! {
        p { "The deflection of a joint is the position of the link less that of the motor, " code { "ql - q" } ". It shows what lies \
             between them without any model of friction. Zeros, a delay between the encoders and their scale are \
             estimated along and left out here." }
        (table(&["joint", "deflection, rms", "what it shows (± at 95 %)", "predicted on holdout", "left"], &[2], &rows))
        (figure(svg, legend(&[(Colour::BLUE, Shape::Dots, "deflection"), (Colour::ORANGE, Shape::Dots, "left by what was found")])))
        @for s in &d.second_encoder {
            @for why in &s.unasked { p { small { (s.joint) ": " (why) "." } } }
        }
    }
}

fn panel(d: &Diagnosis, s: &SecondEncoder) -> Panel {
    let dots = |k: usize, colour| Series {
        points: s.points.iter().map(|p| [p[0], 1e3 * p[k]]).collect(),
        colour,
        width: 0.9,
        shape: Shape::Dots,
    };
    Panel {
        title: s.joint.clone(),
        x: Axis::linear(format!("transmitted torque, {}", d.units[s.index])),
        y: Axis::linear(format!("deflection, m{}", s.unit)),
        series: vec![dots(1, Colour::BLUE), dots(2, Colour::ORANGE)],
        ..Panel::default()
    }
}

fn row(s: &SecondEncoder) -> Vec<Markup> {
    let milli = |x: f64| format!("{} m{}", significant(1e3 * x, 3), s.unit);
    let one = |e: &Seen| {
        let (value, std) = (significant(e.value, 3), significant(1.96 * e.std, 1));
        let alike = e.same.join(" or ").replace('_', " ");
        html! {
            div { (e.effect.replace('_', " ")) ": " (value) " ± " (std) " " (e.unit)
                @if !alike.is_empty() { small { " (or " (alike) ")" } }
                small { " " (percent(e.share)) " of the mean square" } }
        }
    };
    vec![
        html! { (s.joint) },
        html! { (milli(s.rms)) },
        html! {
            @if s.seen.is_empty() { "nothing that is more than chance" }
            @for e in &s.seen { (one(e)) }
        },
        html! { (s.holdout.filter(|_| !s.seen.is_empty()).map_or("–".to_string(), |h| percent(h.max(0.0)))) },
        html! { (milli(s.left)) },
    ]
}
