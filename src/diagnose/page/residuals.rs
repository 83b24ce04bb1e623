//! Where the gap lies: over time, over what the joint does, over frequency.

use super::{Diagnosis, unit, worst};
use crate::diagnose::gap::JointGap;
use crate::diagnose::thresholds::THRESHOLDS as T;
use crate::report::format::{percent, significant};
use crate::report::html::{figure, legend, table};
use crate::report::plot::{Axis, Colour, Figure, Panel, Rule, Series, Shape};
use maud::{Markup, html};

pub(super) fn residuals(d: &Diagnosis) -> Markup {
    let panels: Vec<Panel> = (0..d.joints.len())
        .map(|j| {
            let t = &d.traces[j];
            let line = |y: &[f64], colour| {
                let points = t.t.iter().zip(y).map(|(t, y)| [*t, *y]).collect();
                Series::line(points, colour)
            };
            let noise = d.refit[j].noise;
            let level = |at: f64, label: &str| Rule {
                at,
                upright: false,
                colour: Colour::GREY,
                label: label.into(),
            };
            Panel {
                title: d.joints[j].clone(),
                note: format!("{} of the gap", percent(d.refit[j].share)),
                x: Axis::linear("time, s"),
                y: Axis::linear(unit("residual", d.units[j])),
                rules: vec![level(2.0 * noise, "2σ noise"), level(-2.0 * noise, "")],
                series: vec![
                    line(&t.before, Colour::BLUE),
                    line(&t.after, Colour::ORANGE),
                ],
                ..Panel::default()
            }
        })
        .collect();
    let svg = Figure {
        description: "residual of each joint over a period, before and after".into(),
        height: 120.0,
        columns: if d.joints.len() > 1 { 2 } else { 1 },
        panels,
        ..Figure::default()
    }
    .svg();
    let rows: Vec<Vec<Markup>> = (0..d.joints.len())
        .map(|j| {
            let cell = |g: &JointGap| {
                html! { (significant(g.rms, 3)) " " (d.units[j])
                div { small { (of_torque(g)) " of the torque, " (significant(g.rms / g.noise, 2)) " × noise" } } }
            };
            vec![
                html! { (d.joints[j]) },
                html! { (significant(d.refit[j].noise, 3)) " " (d.units[j]) },
                cell(&d.frozen[j]),
                cell(&d.refit[j]),
                cell(&d.explained[j]),
                html! { (percent(d.refit[j].share)) },
            ]
        })
        .collect();
    html! {
        (figure(svg, html! {
            (legend(&[(Colour::BLUE, Shape::Line, "refitted nominal model"), (Colour::ORANGE, Shape::Line, "with the effects found")]))
            "Mean over the periods of the first fitted record."
        }))
        (table(&["joint", "noise", "frozen model", "refitted", "with the effects", "share"], &[], &rows))
        p { "rms above the noise over the fitted records. The noise floor comes from " (d.noise_source) ". The refit moves the \
            nominal parameters within what is ordinary for a model of this origin (its prior)."
            @if d.closeness.iter().any(|c| *c < 1.0) {
                " The records agree with this identified model so well that its links are allowed less: "
                (percent(d.closeness[0])) " of that in mass, first moment and rotors, "
                (percent(d.closeness[1])) " in tensors."
            }
            @if d.turns_in_part {
                " Dry friction of this log reverses " (significant(1e3 * d.lead, 2)) " ms before the velocity does, as that of a \
                 simulator. How it turns is known in part only: up to "
                (percent(T.reversals.shape * T.gap.sound.sqrt())) " of the friction of a joint (rms) count as no gap there."
            }
        }
    }
}

/// The residual over the measured torque. No limit: what is a trace above 100 % is 100 %.
fn of_torque(g: &JointGap) -> String {
    percent((1e3 * g.relative).round() / 1e3)
}

pub(super) fn maps(d: &Diagnosis) -> Markup {
    let few = worst(d, 3);
    let mut panels = Vec::new();
    for &j in &few {
        let t = &d.traces[j];
        let step = (t.t.len() / 1500).max(1);
        let dots = |x: &[f64], y: &[f64], colour| Series {
            points: x
                .iter()
                .zip(y)
                .step_by(step)
                .map(|(x, y)| [*x, *y])
                .collect(),
            colour,
            width: 0.8,
            shape: Shape::Dots,
        };
        for (k, (label, x)) in [
            ("velocity", &t.velocity),
            ("position", &t.position),
            ("torque", &t.torque),
        ]
        .into_iter()
        .enumerate()
        {
            let position = d.forward.units[j];
            let of = [format!("{position}/s"), position.into(), d.units[j].into()][k].clone();
            panels.push(Panel {
                title: if k == 0 {
                    d.joints[j].clone()
                } else {
                    String::new()
                },
                x: Axis::linear(unit(label, &of)),
                y: Axis::linear(unit("residual", d.units[j])),
                series: vec![
                    dots(x, &t.before, Colour::BLUE),
                    dots(x, &t.after, Colour::ORANGE),
                ],
                ..Panel::default()
            });
        }
        let drift = |k: usize, colour| Series {
            points: t.drift.iter().map(|p| [p[0], p[k]]).collect(),
            colour,
            width: 1.8,
            shape: Shape::Line,
        };
        panels.push(Panel {
            x: Axis::linear("time over all records, s"),
            y: Axis::linear(unit("rms of a period", d.units[j])),
            series: vec![drift(1, Colour::BLUE), drift(2, Colour::ORANGE)],
            ..Panel::default()
        });
    }
    let svg = Figure {
        description: "residual over velocity, position, torque and time".into(),
        height: 150.0,
        columns: 4,
        panels,
        ..Figure::default()
    }
    .svg();
    figure(
        svg,
        html! {
            (legend(&[(Colour::BLUE, Shape::Dots, "refitted nominal model"), (Colour::ORANGE, Shape::Dots, "with the effects found")]))
            "The joints with the largest share of the gap, first fitted record (mean period); at the right the course over all records."
        },
    )
}

pub(super) fn spectra(d: &Diagnosis) -> Markup {
    let few = worst(d, 3);
    let panels = few
        .iter()
        .map(|&j| {
            let t = &d.traces[j];
            let line = |k: usize, colour| {
                let points = t.spectrum.iter().skip(1).map(|p| [p[0], p[k]]).collect();
                Series::line(points, colour)
            };
            Panel {
                title: d.joints[j].clone(),
                x: Axis::linear("frequency, Hz"),
                y: Axis::log(unit("amplitude", d.units[j])),
                series: vec![
                    line(3, Colour::GREY),
                    line(1, Colour::BLUE),
                    line(2, Colour::ORANGE),
                ],
                ..Panel::default()
            }
        })
        .collect();
    let svg = Figure {
        description: "spectrum of the residual before and after".into(),
        height: 170.0,
        columns: few.len().max(1),
        panels,
        ..Figure::default()
    }
    .svg();
    figure(
        svg,
        html! {
            (legend(&[(Colour::GREY, Shape::Line, "noise"), (Colour::BLUE, Shape::Line, "refitted nominal model"), (Colour::ORANGE, Shape::Line, "with the effects found")]))
        },
    )
}
