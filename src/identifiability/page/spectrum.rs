//! Singular values and the course of the design.

use crate::design::Question;
use crate::design::criterion::{Condition, Criterion};
use crate::design::record::{Record, Status};
use crate::design::settings::Settings;
use crate::identifiability::Assessment;
use crate::report::format::{count, significant};
use crate::report::html::{self, Section};
use crate::report::plot::{self, Colour, Figure, Panel, Shape};
use maud::{Markup, html};

/// Most starts that are drawn.
const DRAWN: usize = 300;

/// Singular values: how clear the rank is, and how evenly the trajectory excites.
pub(super) fn section(a: &Assessment) -> Section {
    let base = &a.base;
    let mut panels = vec![plot::singular_values(
        "Robot: how many parameters there are",
        "singular value, random states, relative",
        &base.singular_values,
        base.count(),
    )];
    if let Some(e) = &a.excitation {
        panels.push(plot::singular_values(
            "Trajectory: how evenly they are excited",
            "singular value over one period",
            &e.singular_values,
            e.singular_values.len(),
        ));
    }
    let svg = sheet("Singular values of the regressor", panels);
    let caption = html! {
        (html::legend(&[
            (Colour::BLUE, Shape::Dots, "counts"),
            (Colour::GREY, Shape::Dots, "rounding"),
            (Colour::VERMILLION, Shape::Line, "border"),
        ]))
        "Left: the regressor over random states inside the limits, with the geometry that the file "
        "means: what is a right angle but for rounding counts as one. "
        @if a.excitation.is_some() {
            "Right: the regressor of all standard parameters over one period."
        }
    };
    let gap = match significant(base.rank_gap, 2) {
        text if base.rank_gap < 1e300 => format!("a factor of {text}"),
        _ => "nothing but zeros".to_string(),
    };
    let body = html! {
        (html::figure(svg, caption))
        p {
            "The smallest singular value that counts is " (significant(base.singular_value_above, 2))
            " of the largest, the largest that does not is "
            (significant(base.singular_value_below, 2)) ": between them lies " (gap) "."
        }
        @if let Some(e) = &a.excitation {
            (conditions(&e.condition, e.log_det))
        }
    };
    Section::new("Singular values", body)
}

fn conditions(c: &crate::identifiability::ConditionNumbers, log_det: f64) -> Markup {
    let row = |name: &str, value: f64, what: &str| {
        vec![
            html! { (name) },
            html! { (significant(value, 4)) },
            html! { (what) },
        ]
    };
    let rows = [
        row(
            "invariant",
            c.invariant,
            "largest over smallest non-zero singular value, all standard parameters: does not \
             depend on the choice of base parameters",
        ),
        row("raw", c.raw, "of the columns kept as base parameters"),
        row("normalised", c.normalised, "the same with unit columns"),
        row(
            "weighted",
            c.weighted,
            "the same with rows divided by each joint's torque noise",
        ),
    ];
    html! {
        (html::table(&["condition number", "value", "what it is"], &[2], &rows))
        p {
            "The natural logarithm of the determinant of the weighted information matrix of one \
             period is " (significant(log_det, 5)) "."
        }
    }
}

fn sheet(description: &str, panels: Vec<Panel>) -> String {
    Figure {
        description: description.into(),
        height: 190.0,
        columns: panels.len(),
        column_titles: vec![],
        row_titles: vec![],
        panels,
        ..Figure::default()
    }
    .svg()
}

/// What the numbers of a history are.
fn criterion(s: &Settings) -> String {
    let matrix = match s.condition {
        Condition::Invariant => "invariant",
        Condition::Raw => "raw",
        Condition::Normalised => "column-normalised",
        Condition::Weighted => "noise-weighted",
    };
    match s.question {
        Some(Question::Legs) => {
            return "base parameters of the legs that will not be known to 10\u{a0}% (a soft count)"
                .into();
        }
        Some(q) => {
            return format!(
                "standard deviations for --for {}, over the accuracies that count as one",
                q.name()
            );
        }
        None => {}
    }
    match s.criterion {
        Criterion::Condition => format!("condition number ({matrix})"),
        Criterion::D => format!("D criterion: det^(−1/2r) ({matrix})"),
        Criterion::A => format!("A criterion: root of the mean variance ({matrix})"),
        Criterion::E => format!("E criterion: 1/smallest singular value ({matrix})"),
        Criterion::Known => {
            "base parameters that will not be known to 10\u{a0}% (a soft count)".to_string()
        }
    }
}

/// Criterion over iterations and starts.
pub(super) fn history(record: &Record) -> Section {
    let n = record.starts.len();
    let step = n.div_ceil(DRAWN).max(1);
    let drawn: Vec<(usize, &[f64])> = record
        .starts
        .iter()
        .enumerate()
        .filter(|(k, s)| k % step == 0 || s.number == record.best)
        .map(|(_, s)| (s.number, s.history.as_slice()))
        .collect();
    let label = criterion(&record.settings);
    let count_drawn = drawn.len();
    let svg = sheet(
        "Criterion over the iterations of every start",
        vec![plot::history(&label, &drawn, record.best)],
    );
    let end = match record.status {
        Status::Converged => "all of them to their end",
        Status::TimeLimit => {
            "until the time limit came; with more time, or on a faster machine, more may be reached"
        }
        Status::Interrupted => "until interrupted; the best so far was kept",
    };
    let best = record
        .starts
        .iter()
        .find(|s| s.number == record.best)
        .and_then(|s| s.history.last());
    let caption = html! {
        (html::legend(&[(Colour::BLUE, Shape::Line, "start that gave the result"), (Colour::GREY, Shape::Line, "other starts")]))
        "Less is better."
        @if count_drawn < n { " " (count_drawn) " of " (count(n, "start")) " are drawn." }
    };
    let body = html! {
        p {
            (count(n, "start")) " followed, " (end) "."
            @if let Some(best) = best {
                " Start " (record.best) " gave the best: " (significant(*best, 4)) "."
            }
        }
        (html::figure(svg, caption))
    };
    Section::new("How the design went", body)
}
