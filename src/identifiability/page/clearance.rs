//! How near the robot comes to itself and to what stands around it.

use crate::identifiability::{Clearances, Excitation};
use crate::plant::PairClearance;
use crate::report::format::{count, significant, with_unit};
use crate::report::html::{self, Section};
use crate::report::plot::{Axis, Colour, Figure, Marker, Panel, Series, Shape};
use crate::robot::geometry::Origin;
use crate::trajectory::Proof;
use maud::{Markup, html};

/// Pairs that are listed at once.
const LISTED: usize = 10;

/// A sentence on the nearest pair: what is known, and how well.
pub(super) fn sentence(c: &Clearances) -> String {
    let Some(p) = c.certificate.pairs.first() else {
        return "no two volumes can touch".into();
    };
    let [a, b] = &p.between;
    let how = match c.certificate.proof {
        Proof::Stated => "by a stated bound between the samples",
        _ => "at any time",
    };
    format!(
        "no pair that was looked at comes nearer than {} {how} (closest: {a} and {b}, {} at {})",
        millimetres(p.bound),
        millimetres(p.least),
        with_unit(p.time, 3, "s"),
    )
}

/// A length for people.
pub(super) fn millimetres(x: f64) -> String {
    with_unit(1000.0 * x, 3, "mm")
}

/// The section; what was not looked at where there are no clearances.
pub(super) fn section(e: &Excitation) -> Section {
    if let Some(p) = e.platform.as_ref().and_then(|p| p.nearest_axes()) {
        let body = html! { p {
            "The axes of legs, arms, rods and platform that do not meet in a joint come no nearer than "
            (millimetres(p.bound)) ", by a stated bound between the samples (closest: " (p.name) ", "
            (millimetres(p.value)) " at " (with_unit(p.time, 3, "s")) "; " code { "[margins] distance" } " asks for "
            (millimetres(p.limit)) "). Choose that distance so that it holds both thicknesses. What stands around "
            "the robot was not looked at."
        } };
        return Section::new("Clearance", body);
    }
    let Some(c) = &e.clearance else {
        let body = html! { p {
            "Collisions were not looked at: the robot's files tell no volume of any link, or this was asked for. \
             Name the meshes' folder by " code { "--meshes" } ", or state volumes as " code { "[[volume]]" }
            " in robot.toml."
        } };
        return Section::new("Clearance", body);
    };
    let body = html! {
        (figure(e, c))
        p { (claim(c)) }
        (table(&c.certificate.pairs[..c.certificate.pairs.len().min(LISTED)]))
        @if c.certificate.pairs.len() > LISTED {
            (html::details(
                &format!("{} more pairs", c.certificate.pairs.len() - LISTED),
                table(&c.certificate.pairs[LISTED..]),
            ))
        }
        (html::details("Volumes of the links", volumes(c)))
        (html::details(
            &format!("{} that are not looked at", count(c.left_out.len(), "pair")),
            html! { ul { @for l in &c.left_out { li { (l.between[0]) " and " (l.between[1]) ": " (l.why) } } } },
        ))
    };
    Section::new("Clearance", body)
}

/// What the figures stand on.
fn claim(c: &Clearances) -> Markup {
    let text = match c.certificate.proof {
        Proof::Stated => {
            "Distances are those at 2000 instants; between two of them they are bounded by twice the largest \
             second difference, which is stated, not proven."
        }
        _ => {
            "Distances hold at all times: between two instants no point of a link moves farther than the \
             certified speeds of the joints allow, and stretches of time where that is not enough are halved."
        }
    };
    html! {
        (text) " They are distances of the volumes listed below, which enclose the links as their files show them; \
        cables, what the robot carries and people are not in them."
        @if !c.certificate.unseen.is_empty() {
            " The volume of " (c.certificate.unseen.join(", ")) " is not known: what touches there is not seen."
        }
    }
}

fn figure(e: &Excitation, c: &Clearances) -> Markup {
    let period = e.trajectory.fourier.period;
    let dx = period / c.least.len().max(1) as f64;
    let mm: Vec<f64> = c.least.iter().map(|d| 1000.0 * d).collect();
    let nearest = c.certificate.pairs.first();
    let panel = Panel {
        x: Axis {
            range: Some([0.0, period]),
            ..Axis::linear("time, s")
        },
        y: Axis::linear("least distance, mm"),
        limits: [nearest.map(|p| 1000.0 * p.margin), None],
        series: vec![Series::sampled(&mm, dx, Colour::BLUE)],
        markers: nearest
            .iter()
            .map(|p| Marker {
                at: [p.time, 1000.0 * p.least],
                colour: Colour::INK,
                label: format!("{} – {}", p.between[0], p.between[1]),
            })
            .collect(),
        ..Panel::default()
    };
    let svg = Figure {
        description: "Least distance of any two volumes over one period".into(),
        height: 150.0,
        columns: 1,
        share_x: true,
        panels: vec![panel],
        ..Figure::default()
    }
    .svg();
    html::figure(
        svg,
        html! {
            (html::legend(&[
                (Colour::BLUE, Shape::Line, "nearest pair at each instant"),
                (Colour::VERMILLION, Shape::Line, "margin"),
            ]))
        },
    )
}

fn table(pairs: &[PairClearance]) -> Markup {
    let rows: Vec<Vec<Markup>> = pairs
        .iter()
        .map(|p| {
            vec![
                html! { (p.between[0]) },
                html! { (p.between[1]) },
                html! { (significant(1000.0 * p.least, 4)) },
                html! { (significant(p.time, 4)) },
                html! { (significant(1000.0 * p.bound, 4)) },
                html! { (significant(1000.0 * p.margin, 3)) },
            ]
        })
        .collect();
    html::table(
        &[
            "",
            "",
            "least, mm",
            "at, s",
            "never below, mm",
            "margin, mm",
        ],
        &[0, 1],
        &rows,
    )
}

fn volumes(c: &Clearances) -> Markup {
    let rows: Vec<Vec<Markup>> = c
        .volumes
        .iter()
        .map(|v| {
            let origin = match v.origin {
                Origin::Stated => "stated",
                Origin::Urdf => "as in the URDF",
                Origin::Fitted => "fitted",
            };
            let number = |x: Option<f64>| x.map_or(String::new(), |x| significant(x, 3));
            vec![
                html! { (v.link) },
                html! { (origin) },
                html! { (v.shapes) },
                html! { (number(v.tightness)) },
                html! { (number(v.protrusion.map(|p| 1000.0 * p))) },
            ]
        })
        .collect();
    html::table(
        &[
            "link",
            "origin",
            "volumes",
            "of the convex hull's volume",
            "reach outside it, mm",
        ],
        &[0, 1],
        &rows,
    )
}
