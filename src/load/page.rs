//! The report of a load.

mod friction;
mod stream;

use super::Identified;
use super::body::LoadBody;
use super::controller;
use super::json::{determined, known};
use crate::report::format::{percent, significant, with_unit};
use crate::report::html::{self, Section, Tone};
use crate::report::joints;
use crate::report::plot::{Axis, Colour, Figure, Panel, Rule, Series, Shape, time_series};
use maud::{Markup, html};

const NAMES: [&str; 10] = [
    "mass",
    "centre x",
    "centre y",
    "centre z",
    "Ixx about the centre",
    "Ixy",
    "Ixz",
    "Iyy",
    "Iyz",
    "Izz",
];

/// Value and spread as text.
fn cell(b: &LoadBody, i: usize) -> Markup {
    let (v, s, k) = (b.values(), b.stds(), known(b));
    if !k[i] {
        return html! { "not identifiable" };
    }
    if !determined(b)[i] {
        return html! { "not determined" };
    }
    let unit = ["kg", "mm", "kg m²"][usize::from(i > 0) + usize::from(i > 3)];
    let factor = if (1..4).contains(&i) { 1e3 } else { 1.0 };
    html! { (significant(v[i] * factor, 5)) " ± " (significant(1.96 * s[i] * factor, 2)) " " (unit) }
}

/// The report as one HTML file.
pub fn html(found: &Identified) -> String {
    let load = found.load();
    let (v, s) = (load.values(), load.stds());
    let relative = s[0] / v[0].abs().max(1e-12);
    let sound = v[0] > 0.0 && relative < 0.05 && !load.projected;
    let tone = match (sound, v[0] > 0.0 && relative < 0.3) {
        (true, _) => Tone::Good,
        (_, true) => Tone::Fair,
        _ => Tone::Bad,
    };
    let verdict = match known(load)[0] {
        true => format!(
            "The load is {} ± {} kg with its centre of mass at ({}, {}, {}) mm in the frame of {}.{}",
            significant(v[0], 5),
            significant(1.96 * s[0], 2),
            significant(1e3 * v[1], 4),
            significant(1e3 * v[2], 4),
            significant(1e3 * v[3], 4),
            found.frame,
            match (load.projected, sound) {
                (true, _) =>
                    " The estimate itself was no body that can exist; this is the nearest.",
                (_, false) => " The mass is uncertain: excite more, or log longer.",
                _ => "",
            }
        ),
        false => format!(
            "The mass of the load cannot be told by this robot; what can is below. {}",
            found.one_step.unknown.join("; ")
        ),
    };
    let mut sections = Vec::new();
    if !found.warnings.is_empty() {
        sections.push(Section {
            tone: Tone::Fair,
            ..Section::new(
                format!("Warnings ({})", found.warnings.len()),
                html! { ul { @for w in &found.warnings { li { strong { (w.subject) } ": " (w.message) } } } },
            )
        });
    }
    sections.push(tiles(found));
    sections.push(methods(found));
    sections.extend(stream::section(found));
    sections.push(torques(found));
    sections.push(speeds(found));
    if let Some(zeros) = friction::zeros(found) {
        sections.push(zeros);
    }
    sections.push(friction::section(found));
    if let Some(g) = &found.gain {
        let rows: Vec<Vec<Markup>> = (0..g.joints.len())
            .map(|j| {
                vec![
                    html! { (g.joints[j]) },
                    html! { (significant(g.value[j], 5)) },
                    html! { (significant(1.96 * g.std[j], 2)) },
                    html! { (significant(g.used[j], 5)) " ± " (significant(1.96 * g.used_std[j], 2)) },
                ]
            })
            .collect();
        sections.push(Section::new(
            "Drive gains",
            html! {
                (html::table(&["joint", "measured over true torque", "± at 95 %", "used"], &[], &rows))
                p { "From the records with a known load (Gautier & Briot 2014). Torques are divided by the gain that is used: the estimate \
                     drawn towards 1 by its uncertainty, as far as drives ordinarily differ from their data sheet (10 %). What stays uncertain \
                     of them is in the ± of the load." }
            },
        ));
    }
    sections.push(controllers(found));
    sections.push(joints::order(found.joints.iter().map(String::as_str)));
    let records: Vec<&str> = found
        .one_step
        .records
        .iter()
        .map(|r| r.name.as_str())
        .collect();
    html::page(
        &format!("Load: {}", found.robot),
        &format!("records {}", records.join(", ")),
        (tone, &verdict),
        &sections,
    )
}

/// The load as controllers take it.
fn controllers(found: &Identified) -> Section {
    let load = &found.load().inertia;
    let texts = [
        ("URScript", controller::urscript(load, &found.flange)),
        ("KUKA load data", controller::kuka(load, &found.flange)),
        (
            "Franka Desk, endeffector-config.json",
            controller::franka(load, &found.flange).map(|v| v.to_string()),
        ),
    ];
    let at = found.flange.map(|x| significant(x, 4)).join(", ");
    Section::new(
        "For the controller of the robot",
        html! {
            @for (name, text) in texts {
                h3 { (name) }
                @match text {
                    Ok(text) => pre { (text) },
                    Err(why) => p { (why.to_string()) },
                }
            }
            p { "In the frame of the flange, which is taken at (" (at) ") in the frame of " (found.frame) " (x y z in m, roll pitch yaw \
                 in rad; --flange)." }
        },
    )
}

fn tiles(found: &Identified) -> Section {
    let load = found.load();
    let (v, s) = (load.values(), load.stds());
    let far = s[1..4].iter().fold(0.0f64, |m, x| m.max(*x));
    let loaded: Vec<_> = found.one_step.records.iter().filter(|r| r.loaded).collect();
    let worst = loaded
        .iter()
        .flat_map(|r| r.residuals.iter().map(|j| j.relative))
        .fold(0.0f64, f64::max);
    let tiles = [
        (
            with_unit(v[0], 5, "kg"),
            "mass".to_string(),
            format!(
                "± {} %",
                significant(196.0 * s[0] / v[0].abs().max(1e-12), 2)
            ),
        ),
        (
            with_unit(1.96e3 * far, 2, "mm"),
            "least certain coordinate of the centre".to_string(),
            "± at 95 %".to_string(),
        ),
        (
            significant(found.one_step.condition, 3),
            "condition number".to_string(),
            "columns of the load, friction and robot projected out".to_string(),
        ),
        (
            percent(worst),
            "largest residual".to_string(),
            "of a drive's torque, loaded records".to_string(),
        ),
    ];
    Section::new("", html::tiles(&tiles))
}

fn methods(found: &Identified) -> Section {
    let one = &found.one_step.load;
    let two = found.two_step.as_ref();
    let mut head = vec!["", "one step"];
    if two.is_some() {
        head.extend(["two steps (Schulte & Gerland)", "difference"]);
    }
    let rows: Vec<Vec<Markup>> = (0..10)
        .map(|i| {
            let mut row = vec![html! { (NAMES[i]) }, cell(one, i)];
            if let Some(t) = two {
                let (a, b) = (one.values(), t.load.values());
                let size = match i {
                    0 => a[0].abs(),
                    1..=3 => 1e-3,
                    _ => {
                        let pair = [(4, 4), (4, 7), (4, 9), (7, 7), (7, 9), (9, 9)][i - 4];
                        (a[pair.0] * a[pair.1]).abs().sqrt()
                    }
                };
                row.push(cell(&t.load, i));
                let both = determined(one)[i] && determined(&t.load)[i];
                row.push(match i {
                    _ if !both => html! { "–" },
                    1..=3 => html! { (significant((b[i] - a[i]) / size, 2)) " mm" },
                    _ => html! { (significant(100.0 * (b[i] - a[i]) / size, 2)) " %" },
                });
            }
            row
        })
        .collect();
    let body = html! {
        (html::table(&head, &[], &rows))
        p {
            "Centre of mass and tensor in the frame of " (found.frame) ", the tensor about the centre of \
             mass. ± is the 95 % interval: it counts noise, friction and constant forces, and gains where a known \
             load tells them. "
            (match found.one_step.geometry {
                Some(off) => format!(
                    "It counts joints of the legs that are not where the robot file says, by {} mm (standard deviation): what \
                     the model leaves of the forces looks like that. ",
                    significant(1e3 * off, 1)
                ),
                None => "A geometry that is not that of the robot file is not in it. ".to_string(),
            })
            "Differences of the tensor \
             are relative to the geometric mean of the moments of its row and column."
        }
        @match two {
            Some(t) => p {
                "Two steps: 1/m and the centre of mass from Newton's equation, then the tensor from \
                 Euler's, weighted by the mean piston speed (half of the weight is reached at "
                (with_unit(0.912 * t.standstill, 2, "m/s")) "). Noise of the forces makes the total mass \
                 of this form too large by about " (significant(100.0 * t.bias, 2)) " %. Both methods \
                 use the same records; friction of these steps is fitted without weights and without a Stribeck term."
            },
            None => p { (found.no_two_step) "." },
        }
    };
    Section::new("The load, by both methods", body)
}

/// Torque of the load, measured and identified.
fn torques(found: &Identified) -> Section {
    let Some(r) = found.one_step.records.iter().find(|r| r.loaded) else {
        return Section::new("", html! {});
    };
    let n = r.count;
    let na = r.residuals.len();
    let panels = (0..na)
        .map(|a| {
            let points = |y: &[f64]| -> Vec<[f64; 2]> {
                (0..n).map(|i| [r.time[i], y[a * n + i]]).collect()
            };
            Panel {
                x: Axis::linear("time, s"),
                y: Axis::linear(""),
                note: format!("residual {}", significant(r.residuals[a].rms, 2)),
                series: vec![
                    Series::line(points(&r.carried), Colour::ORANGE),
                    Series::line(points(&r.load), Colour::BLUE),
                ],
                ..Panel::default()
            }
        })
        .collect();
    let rows = found.joints.clone();
    let svg = time_series(
        "Torque or force that the load takes, measured and identified",
        rows,
        vec![format!("{}: what the load takes, N m or N", r.name)],
        panels,
    );
    Section::new(
        "What the load takes of the drives",
        html::figure(
            svg,
            html! {
                (html::legend(&[
                    (Colour::ORANGE, Shape::Line, "measured, minus robot and friction"),
                    (Colour::BLUE, Shape::Line, "load as identified"),
                ]))
            },
        ),
    )
}

/// Residual over speed, with the spread that gave the weights.
fn speeds(found: &Identified) -> Section {
    let one = &found.one_step;
    let na = one.spreads.len();
    let panels = (0..na)
        .map(|a| {
            let mut points = Vec::new();
            for r in &one.records {
                for i in a * r.count..(a + 1) * r.count {
                    points.push([r.speed[i], r.carried[i] - r.load[i]]);
                }
            }
            let fastest = points.iter().fold(0.0f64, |m, p| m.max(p[0].abs()));
            let curve = |sign: f64| {
                let line = (-100..=100)
                    .map(|i| {
                        let v = fastest * f64::from(i) / 100.0;
                        [v, sign * one.spreads[a].variance(v).sqrt()]
                    })
                    .collect();
                Series::line(line, Colour::VERMILLION)
            };
            Panel {
                title: found.joints[a].clone(),
                x: Axis::linear("velocity, rad/s or m/s"),
                y: Axis::linear("residual, N m or N"),
                rules: vec![Rule {
                    at: 0.0,
                    upright: false,
                    colour: Colour::GREY,
                    label: String::new(),
                }],
                series: vec![
                    Series {
                        points,
                        colour: Colour::BLUE,
                        width: 0.9,
                        shape: Shape::Dots,
                    },
                    curve(1.0),
                    curve(-1.0),
                ],
                ..Panel::default()
            }
        })
        .collect();
    let svg = Figure {
        description: "Residual of every drive over its velocity".into(),
        width: Figure::WIDTH,
        height: 130.0,
        columns: 3,
        panels,
        ..Figure::default()
    }
    .svg();
    Section::new(
        "What is left, over speed",
        html::figure(
            svg,
            html! {
                (html::legend(&[
                    (Colour::BLUE, Shape::Dots, "residual"),
                    (Colour::VERMILLION, Shape::Line, "one standard deviation: rows count with its inverse square"),
                ]))
            },
        ),
    )
}
