//! The platform of a parallel robot: its path, the mechanism in its extreme poses, passive joints
//! and distance from singularities.

use crate::identifiability::{Excitation, Platform};
use crate::mechanism::PoseKind;
use crate::report::format::{percent, significant};
use crate::report::html::{self, Section};
use crate::report::plot::wireframes;
use crate::report::plot::{self, Axis, Colour, Drawing, Figure, Line, Panel, Rule, Series, Shape};
use crate::trajectory::certificate::Peak;
use maud::{Markup, html};

/// Picture of the mechanism, platform path, passive joints and singularities.
pub(super) fn sections(e: &Excitation, p: &Platform) -> Vec<Section> {
    vec![
        Section::new("The mechanism", picture(p)),
        Section::new("Platform", path(e, p)),
        Section::new("Passive joints and singularities", margins(e, p)),
    ]
}

/// Home and the extreme poses, with the path of the platform.
fn picture(p: &Platform) -> Markup {
    let n = p.motion.count;
    let platform = |s: usize| -> [f64; 3] {
        std::array::from_fn(|k| p.motion.q.get(k * n + s).copied().unwrap_or(0.0))
    };
    let moves = p.motion.dof >= 3 && !p.poses.iter().all(|(_, lines)| lines.is_empty());
    let drawings: Vec<Drawing> = p
        .poses
        .iter()
        .map(|(title, segments)| {
            let mut lines: Vec<Line> = Vec::new();
            if moves && matches!(p.names.first().map(String::as_str), Some("x")) {
                lines.extend((0..n).map(|s| Line {
                    ends: [platform(s), platform((s + 1) % n)],
                    colour: Colour::ORANGE,
                    width: 0.8,
                }));
            }
            lines.extend(segments.iter().map(|s| Line {
                ends: s.ends.map(|e| [e.x, e.y, e.z]),
                colour: match s.name.as_str() {
                    "platform" => Colour::BLUE,
                    _ => Colour::INK,
                },
                width: if s.name == "platform" { 2.4 } else { 1.6 },
            }));
            Drawing {
                title: title.clone(),
                lines,
            }
        })
        .collect();
    let svg = wireframes(
        "The mechanism in its home pose and in extreme poses of the motion",
        Figure::WIDTH,
        &drawings,
    );
    html::figure(
        svg,
        html! {
            (html::legend(&[
                (Colour::INK, Shape::Line, "legs, arms and rods (axes)"),
                (Colour::BLUE, Shape::Line, "platform"),
                (Colour::ORANGE, Shape::Line, "path of its origin"),
            ]))
            "All to the same scale."
        },
    )
}

/// Task coordinates over time against the workspace box.
fn path(e: &Excitation, p: &Platform) -> Markup {
    let n = p.motion.count;
    let period = e.trajectory.fourier.period;
    let dx = period / n.max(1) as f64;
    let mut panels = Vec::new();
    for (k, c) in p.certificate.platform.joints.iter().enumerate() {
        let angle = p.task.is_angle(k);
        let units = match angle {
            true => ["rad", "rad/s", "rad/s²"],
            false => ["m", "m/s", "m/s²"],
        };
        let peak = |q: &Peak| (q.used, q.satisfied(), [q.limit.map(|l| -l), q.limit]);
        let position = (
            c.position.used,
            c.position.satisfied(),
            [c.position.lower, c.position.upper],
        );
        let rows = [
            (&p.motion.q, position),
            (&p.motion.qd, peak(&c.velocity)),
            (&p.motion.qdd, peak(&c.acceleration)),
        ];
        for ((values, (used, holds, limits)), unit) in rows.into_iter().zip(units) {
            panels.push(Panel {
                note: used.map_or("no limit".into(), percent),
                alarm: !holds,
                x: time(period),
                y: Axis::linear(unit),
                limits,
                series: vec![Series::sampled(
                    &values[k * n..(k + 1) * n],
                    dx,
                    Colour::BLUE,
                )],
                ..Panel::default()
            });
        }
    }
    let svg = plot::time_series(
        "Position, velocity and acceleration of the platform over one period, with the workspace box",
        p.names.clone(),
        ["Position", "Velocity", "Acceleration"]
            .map(String::from)
            .to_vec(),
        panels,
    );
    html::figure(
        svg,
        html! {
            (html::legend(&[
                (Colour::BLUE, Shape::Line, "one period"),
                (Colour::VERMILLION, Shape::Line, "workspace box (not drawn where it is far away)"),
            ]))
            @if p.names.iter().any(|n| n == "roll") {
                "Orientation: R = Rz(yaw) Ry(pitch) Rx(roll). "
            }
            (match p.names == e.trajectory.joints {
                true => "The coordinates are Fourier series; their extrema are exact.",
                false => "The platform follows from the series of the actuators by forward \
                    kinematics, at 4000 instants; between two of them it is bounded by twice the \
                    largest second difference, which is stated, not proven.",
            })
        },
    )
}

fn time(period: f64) -> Axis {
    Axis {
        range: Some([0.0, period]),
        ..Axis::linear("time, s")
    }
}

/// Opening of the passive joints, singular values and distances along the path.
fn margins(e: &Excitation, p: &Platform) -> Markup {
    let n = p.motion.count;
    let period = e.trajectory.fourier.period;
    let dx = period / n.max(1) as f64;
    let mut panels = Vec::new();
    for (kind, title, label) in [
        (
            PoseKind::PassiveJoint,
            "Opening of the passive joints",
            "rad",
        ),
        (PoseKind::Distance, "Distance between legs", "m"),
    ] {
        let of: Vec<usize> = (0..p.uses.first().map_or(0, Vec::len))
            .filter(|&k| p.uses[0][k].kind == kind)
            .collect();
        if of.is_empty() {
            continue;
        }
        let mut limits: Vec<f64> = of.iter().map(|&k| p.uses[0][k].limit).collect();
        limits.dedup();
        panels.push(Panel {
            title: title.into(),
            x: time(period),
            y: Axis::linear(label),
            rules: limits.into_iter().map(|at| limit(at, "limit")).collect(),
            series: of
                .iter()
                .enumerate()
                .map(|(i, &k)| {
                    let values: Vec<f64> = p.uses.iter().map(|u| u[k].value).collect();
                    let colour = Colour::SERIES[i % Colour::SERIES.len()];
                    Series::sampled(&values, dx, colour)
                })
                .collect(),
            ..Panel::default()
        });
    }
    for (which, kind, title) in [
        (
            0,
            PoseKind::Actuation,
            "Do the actuators hold the platform?",
        ),
        (
            1,
            PoseKind::Constraint,
            "Do the passive joints hold the rest?",
        ),
    ] {
        let values: Vec<f64> = p.sigma.iter().filter_map(|s| s[which]).collect();
        if values.len() != n {
            continue;
        }
        let peak = p.certificate.pose.iter().find(|q| q.kind == kind);
        panels.push(Panel {
            title: title.into(),
            note: peak.map_or(String::new(), |q| percent(q.used)),
            alarm: peak.is_some_and(|q| !q.satisfied),
            x: time(period),
            y: Axis::linear("smallest singular value"),
            rules: peak.map(|q| limit(q.limit, "margin")).into_iter().collect(),
            series: vec![Series::sampled(&values, dx, Colour::BLUE)],
            ..Panel::default()
        });
    }
    let svg = Figure {
        description: "Passive joints and singular values along the path".into(),
        height: 150.0,
        columns: panels.len().clamp(1, 3),
        panels,
        ..Figure::default()
    }
    .svg();
    let rows: Vec<Vec<Markup>> = p
        .certificate
        .pose
        .iter()
        .map(|q| {
            vec![
                html! { (q.name) },
                html! { (significant(q.value, 4)) br; small { "t = " (significant(q.time, 4)) "\u{a0}s" } },
                html! { (significant(q.bound, 4)) },
                html! { (match q.kind { PoseKind::PassiveJoint => "at most ", _ => "at least " })
                    (significant(q.limit, 4)) },
                html! { (percent(q.used)) },
            ]
        })
        .collect();
    let head = [
        "what",
        "worst",
        "stated bound between samples",
        "limit",
        "used",
    ];
    html! {
        (html::figure(svg, html! {
            "Singular values of the Jacobian of the actuators with lengths scaled by the size of the \
             platform: at 0 the actuators no longer hold it. Those of the passive joints hold the \
             freedoms that the tree leaves out."
        }))
        @if !rows.is_empty() { (html::details("In numbers", html::table(&head, &[], &rows))) }
    }
}

fn limit(at: f64, label: &str) -> Rule {
    Rule {
        at,
        upright: false,
        colour: Colour::VERMILLION,
        label: label.into(),
    }
}
