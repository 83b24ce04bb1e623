//! The motion against its limits: curves, certified extrema, and how much of each limit is used.

use super::verdict::violations;
use crate::identifiability::{Excitation, Platform};
use crate::report::format::{percent, significant, unit_of};
use crate::report::html::{self, Section};
use crate::report::plot::{self, Axis, Bar, Colour, Marker, Panel, Series, Shape};
use crate::robot::{Motion, Robot};
use crate::trajectory::RATE;
use crate::trajectory::Space;
use crate::trajectory::ToolCertificate;
use crate::trajectory::certificate::{Kind, Peak};
use maud::{Markup, html};

/// Share of a limit beyond which it does not matter how far.
const FAR: f64 = 10.0;
/// Limits that do not hold which are listed at once.
const LISTED: usize = 8;

/// Heading of a kind; forces where all joints slide or some do.
fn heading(kind: Kind, robot: &Robot) -> &'static str {
    let slides = |m: Motion| m == Motion::Prismatic;
    match kind {
        Kind::Position => "Position",
        Kind::Velocity => "Velocity",
        Kind::Acceleration => "Acceleration",
        Kind::Jerk => "Jerk",
        Kind::Torque if robot.joints.iter().all(|j| slides(j.motion)) => "Force",
        Kind::Torque if robot.joints.iter().any(|j| slides(j.motion)) => "Torque or force",
        Kind::Torque => "Torque",
        Kind::VelocityByPosition => "… by position",
        Kind::TorqueRate => "Rate of torque",
        Kind::ToolSpeed => "Speed of the tool point",
        Kind::ToolAcceleration => "Acceleration of the tool point",
        Kind::Pose => "Margin",
    }
}

/// Position, velocity, acceleration and torque of every joint against their limits.
pub(super) fn curves(robot: &Robot, e: &Excitation) -> Section {
    const KINDS: [Kind; 4] = [
        Kind::Position,
        Kind::Velocity,
        Kind::Acceleration,
        Kind::Torque,
    ];
    let panels = (0..robot.dof())
        .flat_map(|j| KINDS.map(|kind| panel(robot, e, j, kind)))
        .collect();
    let svg = plot::time_series(
        "Position, velocity, acceleration and torque of every joint over one period, with limits",
        robot.joint_names(),
        KINDS.map(|k| heading(k, robot).to_string()).to_vec(),
        panels,
    );
    let broken = violations(robot, e);
    let body = html! {
        @if !broken.is_empty() {
            ul { @for text in broken.iter().take(LISTED) { li class="bad-text" { (text) } } }
            @if broken.len() > LISTED {
                (html::details(
                    &format!("{} more limits that do not hold", broken.len() - LISTED),
                    html! { ul { @for text in broken.iter().skip(LISTED) { li { (text) } } } },
                ))
            }
        }
        (html::figure(svg, html! {
            (html::legend(&[
                (Colour::BLUE, Shape::Line, "one period"),
                (Colour::VERMILLION, Shape::Line, "limit (not drawn where it is far away)"),
                (Colour::INK, Shape::Dots, "extremum over all time"),
            ]))
            "The percentage is the part of the limit that is used."
        }))
        @if let Some(p) = &e.platform { p { (between_samples(p)) } } @else { p {
            "Extrema of position, velocity, acceleration and jerk are those of the Fourier series \
             itself, found as roots of its derivative, not the largest of some samples. Torque is \
             that of the nominal model at " (significant(RATE, 4)) " Hz in the figure; its largest \
             value is sought on a finer grid and comes with a rigorous bound of what may happen \
             between the samples. Coulomb friction counts with the sign that makes the torque \
             larger at all times."
        } }
        (html::details("Certified extrema in numbers", numbers(robot, e)))
    };
    let title = match e.platform {
        Some(_) => "Actuators and limits",
        None => "Motion and limits",
    };
    Section::new(title, body)
}

/// What is proven of a closed chain, and what is stated.
fn between_samples(p: &Platform) -> &'static str {
    match (p.space, p.certificate.proven()) {
        (Space::Actuators, true) => {
            "These are the actuators, whose positions are the Fourier series: extrema of position, \
             velocity, acceleration and jerk are those of the series itself, found as roots of its \
             derivative. Forces are those of the nominal model at 4000 instants; between two of \
             them they are bounded by twice the largest second difference, which is stated, not \
             proven. Coulomb friction counts with the sign that makes the force larger."
        }
        (Space::Platform, true) => {
            "These are the actuators. Their positions, velocities, accelerations and jerks hold at \
             all times: they are enclosed over every stretch of time by interval arithmetic on the \
             kinematics. Forces are those of the nominal model at 4000 instants; between two of \
             them they are bounded by twice the largest second difference, which is stated, not \
             proven. Coulomb friction counts with the sign that makes the force larger."
        }
        (_, false) => {
            "These are the actuators, at 4000 instants. Between two of them everything is bounded \
             by twice the largest second difference: this mechanism has no closed-form kinematics, \
             so that bound is stated, not proven. Coulomb friction counts with the sign that makes \
             the force larger."
        }
    }
}

/// One quantity of one joint.
fn panel(robot: &Robot, e: &Excitation, j: usize, kind: Kind) -> Panel {
    let (joint, series) = (&robot.joints[j], &e.motion);
    let count = series.count;
    let values = match kind {
        Kind::Position => &series.q,
        Kind::Velocity => &series.qd,
        Kind::Acceleration => &series.qdd,
        _ => &e.torque,
    };
    let values = values.get(j * count..(j + 1) * count).unwrap_or_default();
    let period = e.trajectory.fourier.period;
    let dx = period / count.max(1) as f64;
    let mut curve = Series::sampled(values, dx, Colour::BLUE);
    if let Some(first) = values.first() {
        curve.points.push([period, *first]);
    }
    let [lower, upper] = joint.limits.position;
    let both = |limit: f64| [-limit, limit];
    let limits = match kind {
        Kind::Position => [lower, upper],
        Kind::Velocity => both(joint.limits.velocity),
        Kind::Acceleration => both(joint.limits.acceleration),
        _ => both(joint.limits.effort),
    };
    // sign of a magnitude: that of the curve nearby
    let signed = |time: f64, value: f64| {
        let i = (time / dx).round() as usize % count.max(1);
        [time, value * values.get(i).copied().unwrap_or(1.0).signum()]
    };
    let c = e.certificate.joints.get(j);
    let (used, satisfied, points) = match (kind, c) {
        (_, None) => (None, true, vec![]),
        (Kind::Position, Some(c)) => {
            let p = &c.position;
            let points = [p.min, p.max].map(|x| [x.time, x.value]).to_vec();
            (p.used, p.satisfied(), points)
        }
        (Kind::Torque, Some(c)) => match &c.torque {
            Some(t) => {
                let (used, holds) = (t.used, t.satisfied());
                (used, holds, vec![signed(t.time, t.max_on_grid + t.coulomb)])
            }
            None => (None, true, vec![]),
        },
        (_, Some(c)) => {
            let p = if kind == Kind::Velocity {
                &c.velocity
            } else {
                &c.acceleration
            };
            (p.used, p.satisfied(), vec![signed(p.time, p.value)])
        }
    };
    Panel {
        note: used.map_or("no limit".into(), percent),
        alarm: !satisfied,
        x: Axis {
            range: Some([0.0, period]),
            ..Axis::linear("time, s")
        },
        y: Axis::linear(unit_of(kind, joint.motion)),
        limits: limits.map(|l| l.is_finite().then_some(l)),
        series: vec![curve],
        markers: points
            .into_iter()
            .map(|at| Marker {
                at,
                colour: Colour::INK,
                label: String::new(),
            })
            .collect(),
        ..Panel::default()
    }
}

/// Certified extrema as a table.
fn numbers(robot: &Robot, e: &Excitation) -> Markup {
    let at = |value: f64, time: f64| {
        html! { (significant(value, 4)) br; small { "t = " (significant(time, 4)) "\u{a0}s" } }
    };
    let peak = |p: &Peak| at(p.value, p.time);
    let rows: Vec<Vec<Markup>> = robot
        .joints
        .iter()
        .zip(&e.certificate.joints)
        .map(|(joint, c)| {
            let angle = unit_of(Kind::Position, joint.motion);
            let force = unit_of(Kind::Torque, joint.motion);
            vec![
                html! { (c.joint) br; small { (angle) ", " (force) } },
                at(c.position.min.value, c.position.min.time),
                at(c.position.max.value, c.position.max.time),
                match &c.velocity_by_position {
                    Some(p) => html! {
                        (peak(&c.velocity)) br;
                        small {
                            (significant(p.velocity, 4)) " of " (significant(p.limit, 4)) " allowed" br;
                            "at " (significant(p.position, 4)) ", t = " (significant(p.time, 4)) "\u{a0}s"
                        }
                    },
                    None => peak(&c.velocity),
                },
                peak(&c.acceleration),
                peak(&c.jerk),
                match &c.torque {
                    Some(t) => at(t.max_on_grid, t.time),
                    None => html! { "–" },
                },
                match &c.torque {
                    Some(t) => html! { (significant(t.between_grid_bound, 2)) },
                    None => html! { "–" },
                },
                match &c.torque {
                    Some(t) => html! { (significant(t.coulomb, 3)) },
                    None => html! { "–" },
                },
            ]
        })
        .collect();
    let head = [
        "joint",
        "position from",
        "to",
        "velocity",
        "acceleration",
        "jerk",
        "smooth torque",
        "between samples +",
        "Coulomb ±",
    ];
    html::table(&head, &[], &rows)
}

/// How much of each limit is used.
pub(super) fn usage(robot: &Robot, e: &Excitation) -> Section {
    let mut kinds = vec![
        Kind::Position,
        Kind::Velocity,
        Kind::Acceleration,
        Kind::Jerk,
        Kind::Torque,
    ];
    let joints = &e.certificate.joints;
    if joints.iter().any(|c| c.velocity_by_position.is_some()) {
        // beside the velocity
        kinds.insert(2, Kind::VelocityByPosition);
    }
    if joints.iter().any(|c| c.torque_rate.is_some()) {
        kinds.push(Kind::TorqueRate);
    }
    let cells: Vec<Vec<Option<Bar>>> = e
        .certificate
        .joints
        .iter()
        .map(|c| {
            let peak = |p: &Peak| {
                p.used.map(|value| Bar {
                    value,
                    more: 0.0,
                    alarm: !p.satisfied(),
                })
            };
            let torque = c.torque.as_ref().and_then(|t| {
                t.used.zip(t.limit).map(|(value, limit)| Bar {
                    value,
                    more: t.between_grid_bound / limit,
                    alarm: !t.satisfied(),
                })
            });
            let position = c.position.used.map(|value| Bar {
                value,
                more: 0.0,
                alarm: !c.position.satisfied(),
            });
            let by_position = c.velocity_by_position.map(|p| Bar {
                value: p.used.min(FAR),
                more: 0.0,
                alarm: !p.satisfied(),
            });
            let rate = c.torque_rate.as_ref().map(|t| Bar {
                value: t.used,
                more: t.between_grid_bound / t.limit,
                alarm: !t.satisfied(),
            });
            let bar = |kind: &Kind| match kind {
                Kind::Position => position,
                Kind::Velocity => peak(&c.velocity),
                Kind::Acceleration => peak(&c.acceleration),
                Kind::Jerk => peak(&c.jerk),
                Kind::VelocityByPosition => by_position,
                Kind::TorqueRate => rate,
                _ => torque,
            };
            kinds.iter().map(bar).collect()
        })
        .collect();
    let headings: Vec<String> = kinds.iter().map(|k| heading(*k, robot).into()).collect();
    let svg = plot::bars(
        "How much of each limit every joint uses",
        plot::Figure::WIDTH,
        &robot.joint_names(),
        &headings,
        &cells,
    );
    let caption = html! {
        (html::legend(&[
            (Colour::BLUE, Shape::Line, "used over all time"),
            (Colour::VERMILLION, Shape::Line, "beyond the limit or not proven"),
        ]))
        "The line is the whole limit. Position counts from the middle of the range. The pale end of \
         a bar of torque or of its rate is what may be missing between samples."
        @if joints.iter().any(|c| c.velocity_by_position.is_some()) {
            " Velocity by position is the share of the velocity that the controller allows where the joint is, at \
             the worst instant. It is proven for all time."
        }
    };
    let body = html! {
        (html::figure(svg, caption))
        @if let Some(t) = &e.certificate.tool { (tool_point(t)) }
    };
    Section::new("How much of each limit is used", body)
}

/// Speed and acceleration of the tool point against their limits.
fn tool_point(t: &ToolCertificate) -> Markup {
    let both = [
        ("speed", &t.speed, "m/s"),
        ("acceleration", &t.acceleration, "m/s²"),
    ];
    let rows: Vec<Vec<Markup>> = both
        .into_iter()
        .filter_map(|(what, bound, unit)| {
            let b = bound.as_ref()?;
            Some(vec![
                html! { (t.frame) " " (what) br; small { (unit) } },
                html! { (significant(b.max_on_grid, 4)) br; small { "t = " (significant(b.time, 4)) "\u{a0}s" } },
                html! { (significant(b.between_grid_bound, 2)) },
                html! { (significant(b.limit, 4)) },
                html! { (percent(b.used)) },
            ])
        })
        .collect();
    let head = [
        "tool point",
        "largest",
        "between samples +",
        "limit",
        "used",
    ];
    html::table(&head, &[], &rows)
}
