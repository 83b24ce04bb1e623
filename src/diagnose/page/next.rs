//! What to run next.

use super::{Diagnosis, unit};
use crate::diagnose::finding::Finding;
use crate::diagnose::next::Proposal;
use crate::report::format::{percent, significant};
use crate::report::html::figure;
use crate::report::plot::{Axis, Colour, Figure, Panel, Series};
use maud::{Markup, html};

/// The coordinates of the proposed motion over a period.
fn proposed(n: &Proposal) -> Markup {
    const POINTS: usize = 400;
    let motion = n.trajectory.fourier.motion(POINTS);
    let step = n.trajectory.fourier.period / POINTS as f64;
    let curves = motion.q.chunks_exact(POINTS).zip(&n.trajectory.joints);
    let panels = curves
        .zip(&n.units)
        .map(|((q, name), of)| {
            let points = q.iter().enumerate().map(|(i, q)| [i as f64 * step, *q]);
            Panel {
                title: name.clone(),
                x: Axis::linear("time, s"),
                y: Axis::linear(unit("position", of)),
                series: vec![Series::line(points.collect(), Colour::BLUE)],
                ..Panel::default()
            }
        })
        .collect();
    let svg = Figure {
        description: "coordinates of the proposed motion over a period".into(),
        height: 110.0,
        columns: n.units.len().clamp(1, 3),
        panels,
        ..Figure::default()
    }
    .svg();
    figure(
        svg,
        html! { "The proposed motion: joints of a serial robot, the platform of a parallel one." },
    )
}

pub(super) fn next(d: &Diagnosis) -> Markup {
    html! {
        @match &d.next {
            Some(n) => {
                p { (n.why) "." }
                p { "The motion is in " code { "next.json" } ": period " (significant(n.trajectory.fourier.period, 3)) " s, run "
                    (n.trajectory.periods) " times, inside all limits of the robot file. Overlap " (percent(n.overlap[0]))
                    " in the present records, " (percent(n.overlap[1])) " predicted. "
                    code { "excite identifiability" } " shows how far it uses each limit." }
                (proposed(n))
            }
            None => {
                p { @if d.findings.iter().any(Finding::is_claim) {
                    "The effects that are claimed are told apart from their rivals by the records at hand."
                } @else { "No pair of effects is near enough to the gap to be worth separating." } }
            }
        }
        @for f in d.findings.iter().filter(|f| f.member && !f.same.is_empty()) {
            p { "To tell " (f.title) " from " (f.same.join(", ").replace('_', " ")) ": " (f.separated_by) "." }
        }
    }
}
