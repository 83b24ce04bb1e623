//! Measured and predicted torque over time, over velocity and over frequency.

use super::force;
use crate::identify::Identification;
use crate::identify::trace::Trace;
use crate::log::Purpose;
use crate::plant::Plant;
use crate::report::html::{self, Section};
use crate::report::plot::{Axis, Colour, Figure, Panel, Rule, Series, Shape, time_series};
use crate::signals::fourier::welch;
use maud::html;

/// Records that are drawn; the others are in the tables.
const DRAWN: usize = 2;

/// The traces that are drawn: a fit record and a holdout record where there are both.
fn drawn(id: &Identification) -> Vec<&Trace> {
    let traces = &id.validation.traces;
    let first = |p: Purpose| traces.iter().find(|t| t.purpose == p);
    let mut out: Vec<&Trace> = [Purpose::Fit, Purpose::Holdout]
        .into_iter()
        .filter_map(first)
        .collect();
    out.truncate(DRAWN);
    out
}

fn titles(traces: &[&Trace]) -> Vec<String> {
    traces
        .iter()
        .map(|t| match t.purpose {
            Purpose::Fit => format!("{} (fit)", t.name),
            Purpose::Holdout => format!("{} (holdout)", t.name),
        })
        .collect()
}

/// A row for every joint, a column for every trace.
fn grid(
    plant: &Plant,
    traces: &[&Trace],
    panel: impl Fn(usize, &Trace, &str) -> Panel,
) -> Vec<Panel> {
    plant
        .actuators()
        .iter()
        .enumerate()
        .flat_map(|(a, j)| {
            let panel = &panel;
            traces.iter().map(move |t| panel(a, t, force(j.motion)))
        })
        .collect()
}

fn rows(plant: &Plant) -> Vec<String> {
    plant.actuators().iter().map(|j| j.name.clone()).collect()
}

fn points(x: &[f64], y: impl Iterator<Item = f64>) -> Vec<[f64; 2]> {
    x.iter().copied().zip(y).map(|(x, y)| [x, y]).collect()
}

fn part<'a>(t: &Trace, list: &'a [f64], a: usize) -> &'a [f64] {
    let n = t.time.len();
    &list[a * n..(a + 1) * n]
}

fn residual(t: &Trace, a: usize) -> Vec<f64> {
    let pairs = part(t, &t.measured, a).iter().zip(part(t, &t.predicted, a));
    pairs.map(|(m, p)| m - p).collect()
}

pub(super) fn torques(plant: &Plant, id: &Identification) -> Section {
    let traces = drawn(id);
    let panels = grid(plant, &traces, |a, t, unit| Panel {
        x: Axis::linear("t, s"),
        y: Axis::linear(unit),
        series: vec![
            Series::line(
                points(&t.time, part(t, &t.measured, a).iter().copied()),
                Colour::BLUE,
            ),
            Series::line(
                points(&t.time, part(t, &t.predicted, a).iter().copied()),
                Colour::ORANGE,
            ),
            Series {
                width: 1.0,
                ..Series::line(points(&t.time, residual(t, a).into_iter()), Colour::GREY)
            },
        ],
        ..Panel::default()
    });
    let svg = time_series(
        "measured and predicted torque over time",
        rows(plant),
        titles(&traces),
        panels,
    );
    let caption = html! {
        (html::legend(&[
            (Colour::BLUE, Shape::Line, "measured"),
            (Colour::ORANGE, Shape::Line, "predicted"),
            (Colour::GREY, Shape::Line, "difference"),
        ]))
    };
    Section::new(
        "Measured against predicted torque",
        html::figure(svg, caption),
    )
}

pub(super) fn over_time(plant: &Plant, id: &Identification) -> Section {
    let traces = drawn(id);
    let panels = grid(plant, &traces, |a, t, unit| Panel {
        x: Axis::linear("t, s"),
        y: Axis::linear(unit),
        series: vec![Series::line(
            points(&t.time, residual(t, a).into_iter()),
            Colour::BLUE,
        )],
        ..Panel::default()
    });
    let svg = time_series(
        "residual torque over time",
        rows(plant),
        titles(&traces),
        panels,
    );
    Section::new(
        "Residual over time",
        html::figure(
            svg,
            html! { "Measured less predicted torque. A drift is warming up; what repeats with the motion is a \
            missing term." },
        ),
    )
}

pub(super) fn over_velocity(plant: &Plant, id: &Identification) -> Section {
    let traces = drawn(id);
    let panels = grid(plant, &traces, |a, t, unit| {
        let e = residual(t, a);
        let v = part(t, &t.velocity, a);
        // mean in forty bins of velocity, where there is something to average
        let (low, high) = v
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| {
                (l.min(*x), h.max(*x))
            });
        let mut bins = vec![(0.0, 0usize); 40];
        for (x, y) in v.iter().zip(&e) {
            let k = ((x - low) / (high - low).max(1e-300) * 40.0) as usize;
            let bin = &mut bins[k.min(39)];
            bin.0 += y;
            bin.1 += 1;
        }
        let mean: Vec<[f64; 2]> = bins
            .iter()
            .enumerate()
            .filter(|(_, b)| b.1 > 4)
            .map(|(k, b)| {
                [
                    low + (k as f64 + 0.5) / 40.0 * (high - low),
                    b.0 / b.1 as f64,
                ]
            })
            .collect();
        let step = v.len().div_ceil(1500).max(1);
        let dots: Vec<[f64; 2]> = v
            .iter()
            .zip(&e)
            .step_by(step)
            .map(|(x, y)| [*x, *y])
            .collect();
        Panel {
            x: Axis::linear("velocity, rad/s or m/s"),
            y: Axis::linear(unit),
            series: vec![
                Series {
                    width: 0.7,
                    shape: Shape::Dots,
                    ..Series::line(dots, Colour::GREY)
                },
                Series {
                    width: 2.0,
                    ..Series::line(mean, Colour::VERMILLION)
                },
            ],
            rules: vec![Rule {
                at: 0.0,
                upright: false,
                colour: Colour::QUIET,
                label: String::new(),
            }],
            ..Panel::default()
        }
    });
    let svg = Figure {
        description: "residual torque over joint velocity".into(),
        height: 110.0,
        columns: traces.len().max(1),
        column_titles: titles(&traces),
        row_titles: rows(plant),
        panels,
        ..Figure::default()
    }
    .svg();
    let caption = html! {
        (html::legend(&[(Colour::GREY, Shape::Dots, "samples"), (Colour::VERMILLION, Shape::Line, "mean")]))
        " A step at zero is Coulomb friction, a hump beside it Stribeck's, a bend far out nonlinear viscous friction."
    };
    Section::new("Residual over velocity", html::figure(svg, caption))
}

pub(super) fn spectra(plant: &Plant, id: &Identification) -> Section {
    let traces = drawn(id);
    let panels = grid(plant, &traces, |a, t, unit| {
        let length = t.time.len().min(512.max(t.time.len() / 4));
        let density = |x: &[f64]| {
            let (f, d) = welch(x, t.rate, length);
            let list: Vec<[f64; 2]> = f
                .into_iter()
                .zip(d)
                .skip(1)
                .map(|(f, d)| [f, d.sqrt()])
                .collect();
            list
        };
        Panel {
            x: Axis::log("Hz"),
            y: Axis::log(format!("{unit}/√Hz")),
            series: vec![
                Series::line(density(part(t, &t.measured, a)), Colour::GREY),
                Series::line(density(&residual(t, a)), Colour::BLUE),
            ],
            ..Panel::default()
        }
    });
    let svg = time_series(
        "spectrum of measured torque and residual",
        rows(plant),
        titles(&traces),
        panels,
    );
    let caption = html! {
        (html::legend(&[(Colour::GREY, Shape::Line, "measured"), (Colour::BLUE, Shape::Line, "residual")]))
        " Where both meet, the model explains nothing."
    };
    Section::new("Spectrum of the residual", html::figure(svg, caption))
}
