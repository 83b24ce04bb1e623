//! `report.html` of a survey.

use super::claim::Means;
use super::frame::{Course, Frame};
use super::{Survey, file_name};
use crate::error::counted;
use crate::report::format::significant;
use crate::report::html::{self, Section, Tone};
use crate::report::plot::{Axis, Colour, Panel, Rule, Series, Shape, time_series};
use maud::{Markup, html};

/// Points of a curve.
const POINTS: usize = 3000;

/// The page for people.
pub fn html(survey: &Survey) -> String {
    let known = survey
        .claims
        .iter()
        .filter(|c| c.means != Means::Other && c.confidence >= 0.5)
        .count();
    let has = |m: Means| {
        survey
            .claims
            .iter()
            .any(|c| c.means == m && c.confidence >= 0.5)
    };
    let (tone, use_) = match (
        has(Means::Position),
        has(Means::Torque),
        has(Means::Current),
    ) {
        (true, true, _) => (
            Tone::Good,
            "positions and torques are there: a model can be identified",
        ),
        (true, false, true) => (
            Tone::Fair,
            "positions and currents are there: state the gains of the drives",
        ),
        (true, false, false)
            if survey
                .claims
                .iter()
                .any(|c| matches!(c.means, Means::Torque | Means::Current)) =>
        {
            (
                Tone::Fair,
                "the positions are there, and the torques of some joints were not recognised: name their columns",
            )
        }
        (true, false, false) => (
            Tone::Bad,
            "there are positions and no torques: no model and no load can be identified",
        ),
        _ => (
            Tone::Bad,
            "the positions of some joints were not recognised: name their columns, or give the robot",
        ),
    };
    let verdict = format!(
        "{known} of {} columns are recognised; {use_}.{}",
        survey.claims.len(),
        match survey.warnings.len() {
            0 => String::new(),
            n => format!(" {n} warnings are below."),
        }
    );
    let mut sections = Vec::new();
    if !survey.warnings.is_empty() {
        let list = html! { ul { @for w in &survey.warnings { li { strong { (w.subject) } ": " (w.message) } } } };
        sections.push(Section {
            tone: Tone::Fair,
            ..Section::new(format!("Warnings ({})", survey.warnings.len()), list)
        });
    }
    for (frame, courses) in survey.frames.iter().zip(&survey.courses) {
        sections.push(record(survey, frame, courses));
    }
    sections.push(columns(survey));
    let names: Vec<String> = survey
        .frames
        .iter()
        .flat_map(|f| &f.paths)
        .map(|p| file_name(p))
        .collect();
    html::page(
        "What is in this log",
        &names.join(", "),
        (tone, &verdict),
        &sections,
    )
}

fn record(survey: &Survey, frame: &Frame, courses: &[Course]) -> Section {
    let names: Vec<String> = frame.paths.iter().map(|p| file_name(p)).collect();
    let moving = |c: &Course| c.moves.iter().map(|m| m[1] - m[0]).sum::<f64>();
    let rows: Vec<Vec<Markup>> = survey
        .joints
        .iter()
        .zip(courses)
        .map(|(name, c)| {
            vec![
                html! { (name) },
                html! { @if let Some([a, b]) = c.range { (significant(a, 4)) " to " (significant(b, 4)) } @else { "no position" } },
                html! { @if let Some(v) = c.fastest { (significant(v, 3)) } },
                html! { @if c.moves.is_empty() { "stands still" } @else {
                    (significant(moving(c), 3)) " s, from " (significant(c.moves[0][0], 3)) " to "
                    (significant(c.moves[c.moves.len() - 1][1], 3)) " s"
                } },
                html! { (c.saturated) },
            ]
        })
        .collect();
    let mut panels = Vec::new();
    let kinds: Vec<(Means, &str)> = [
        (Means::Position, "position"),
        (Means::Velocity, "velocity"),
        (Means::Torque, "torque"),
        (Means::Current, "current, as torque where its gain is known"),
    ]
    .into_iter()
    .filter(|(m, _)| (0..courses.len()).any(|j| frame.channel(&survey.claims, *m, j).is_some()))
    .collect();
    for (j, course) in courses.iter().enumerate() {
        for (means, label) in &kinds {
            panels.push(panel(frame, survey, course, *means, label, j));
        }
    }
    let body = html! {
        p { (frame.rows) " rows, " (significant(frame.duration(), 4)) " s at " (frame.pace())
            ", " (frame.clock()) "; " (counted(frame.gaps.len(), "gap"))
            @if let Some(longest) = frame.gaps.iter().map(|g| g[1] - g[0]).max_by(f64::total_cmp) {
                ", the longest " (significant(longest, 3)) " s"
            } "." }
        (html::table(&["joint", "positions", "fastest", "moves", "saturated samples"], &[3], &rows))
        @if !panels.is_empty() {
            (html::figure(
                time_series(
                    "positions, velocities and torques over time",
                    survey.joints.clone(),
                    kinds.iter().map(|(_, n)| n.to_string()).collect(),
                    panels,
                ),
                html! { (html::legend(&[
                    (Colour::BLUE, Shape::Line, "moves"),
                    (Colour::GREY, Shape::Line, "the joint stands still"),
                    (Colour::VERMILLION, Shape::Line, "begin of a gap"),
                ])) },
            ))
        }
    };
    Section::new(names.join(" + "), body)
}

fn panel(
    frame: &Frame,
    survey: &Survey,
    course: &Course,
    means: Means,
    label: &str,
    j: usize,
) -> Panel {
    let mut series = Vec::new();
    if let Some(y) = frame.channel(&survey.claims, means, j) {
        let each = (y.len() / POINTS).max(1);
        let moving = |t: f64| course.moves.iter().any(|m| t >= m[0] && t <= m[1]);
        let points = |on: bool| -> Vec<[f64; 2]> {
            (0..y.len())
                .step_by(each)
                .map(|i| {
                    let t = frame.start + i as f64 * frame.step;
                    [t, if moving(t) == on { y[i] } else { f64::NAN }]
                })
                .collect()
        };
        series.push(Series::line(points(false), Colour::GREY));
        series.push(Series::line(points(true), Colour::BLUE));
    }
    let rules = frame
        .gaps
        .iter()
        .filter(|g| g[0] >= frame.looked_at()[0] && g[0] <= frame.looked_at()[1])
        .take(50)
        .map(|g| Rule {
            at: g[0],
            upright: true,
            colour: Colour::VERMILLION,
            label: String::new(),
        })
        .collect();
    Panel {
        x: Axis {
            range: Some(frame.looked_at()),
            ..Axis::linear("time, s")
        },
        y: Axis::linear(label.split(',').next().unwrap_or(label)),
        series,
        rules,
        ..Panel::default()
    }
}

fn columns(survey: &Survey) -> Section {
    let rows: Vec<Vec<Markup>> = survey
        .claims
        .iter()
        .map(|c| {
            let claimed = c.means != Means::Other && c.confidence >= 0.5;
            let means = serde_json::to_value(c.means).ok().and_then(|v| v.as_str().map(String::from));
            vec![
                html! { code { (c.column) } },
                html! { @if claimed { (means.unwrap_or_default()) } @else { "not known" } },
                html! { @if claimed { (c.joint.clone().unwrap_or_default()) } },
                html! { @if claimed { (significant(c.factor(), 5)) } },
                html! { @if claimed && c.delay != 0.0 { (significant(1e3 * c.delay, 3)) } },
                html! { @if claimed { (significant(c.confidence, 2)) } },
                html! { (c.evidence) @if !c.without.is_empty() { "; without " (c.without.join(" and ")) } },
            ]
        })
        .collect();
    Section::new(
        "Columns",
        html! {
            (html::table(&["column", "means", "joint", "factor to SI", "delay, ms", "confidence", "why"], &[1, 2, 6], &rows))
            p { "The factor times a value is in SI units on the side of the joint. A column is claimed at a confidence of 0.5 or more." }
        },
    )
}
