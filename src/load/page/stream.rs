//! The load as it became known, and what was filtered away.

use crate::load::Identified;
use crate::load::json::known;
use crate::report::format::{significant, with_unit};
use crate::report::html::{self, Section};
use crate::report::plot::{Axis, Colour, Figure, Panel, Series, Shape};
use maud::html;

/// Title, factor, quantities with their colours.
type Drawn = (&'static str, f64, &'static [(usize, Colour)]);

/// What is drawn.
const PANELS: [Drawn; 3] = [
    ("mass, kg", 1.0, &[(0, Colour::BLUE)]),
    (
        "centre of mass, mm",
        1e3,
        &[(1, Colour::BLUE), (2, Colour::ORANGE), (3, Colour::GREEN)],
    ),
    (
        "xx, yy, zz of the tensor, kg m²",
        1.0,
        &[(4, Colour::BLUE), (7, Colour::ORANGE), (9, Colour::GREEN)],
    ),
];

/// Estimate over time; `None` where there are fewer than two blocks.
pub(super) fn section(found: &Identified) -> Option<Section> {
    let steps = &found.one_step.stream;
    if steps.len() < 2 {
        return None;
    }
    let sure = known(&found.one_step.load);
    let mut panels = Vec::new();
    for (title, factor, list) in PANELS {
        let mut series = Vec::new();
        for &(k, colour) in list.iter().filter(|(k, _)| sure[*k]) {
            let line = |side: f64| -> Vec<[f64; 2]> {
                let at = |s: &crate::load::one_step::Step| {
                    [s.seconds, factor * (s.values[k] + side * 1.96 * s.stds[k])]
                };
                steps.iter().map(at).filter(|p| p[1].is_finite()).collect()
            };
            series.push(Series::line(line(0.0), colour));
            for side in [-1.0, 1.0] {
                series.push(Series {
                    width: 0.5,
                    ..Series::line(line(side), colour)
                });
            }
        }
        panels.push(Panel {
            title: title.into(),
            x: Axis::linear("motion recorded, s"),
            y: Axis::linear(""),
            series,
            ..Panel::default()
        });
    }
    let svg = Figure {
        description: "Mass, centre of mass and tensor of the load over the motion recorded".into(),
        width: Figure::WIDTH,
        height: 170.0,
        columns: 3,
        panels,
        ..Figure::default()
    }
    .svg();
    let cutoffs: Vec<String> = found
        .one_step
        .records
        .iter()
        .map(|r| match r.cutoff.is_finite() {
            true => format!("{} at {}", r.name, with_unit(r.cutoff, 3, "Hz")),
            false => format!("{} not", r.name),
        })
        .collect();
    let halved = steps
        .iter()
        .find(|s| s.stds[0] < 2.0 * steps[steps.len() - 1].stds[0]);
    Some(Section::new(
        "As it became known",
        html! {
            (html::figure(svg, html! {
                (html::legend(&[
                    (Colour::BLUE, Shape::Line, "mass; x; xx"),
                    (Colour::ORANGE, Shape::Line, "y; yy"),
                    (Colour::GREEN, Shape::Line, "z; zz"),
                ]))
                "Recursive weighted least squares, block by block (a period each where the motion repeats); thin lines: 95\u{a0}% \
                 interval. Records of the empty robot count first. Weights and friction speeds are those of the whole fit."
            }))
            @if let Some(s) = halved {
                p { "Half of the final certainty of the mass was there after " (significant(s.seconds, 3)) " s of motion." }
            }
            p { "Low-passed: " (cutoffs.join(", ")) "." }
        },
    ))
}
