//! Robots that the records do not exclude.

use super::{Diagnosis, unit};
use crate::diagnose::posterior::{Band, Posterior, TABLE};
use crate::report::format::{percent, significant};
use crate::report::html::{figure, table};
use crate::report::plot::{Axis, Colour, Figure, Panel, Series};
use maud::{Markup, html};

pub(super) fn samples(d: &Diagnosis) -> Markup {
    let Some(p) = &d.posterior else {
        return html! {
            p { "None were drawn; " code { "--samples 20" } " draws robots that these records do not exclude, and writes their files." }
        };
    };
    let rows: Vec<Vec<Markup>> = occurrences(p)
        .into_iter()
        .map(|(effect, place, count)| {
            vec![
                html! { (effect.replace('_', " ")) },
                html! { (place) },
                html! { (count) " of " (p.samples.len()) },
            ]
        })
        .collect();
    html! {
        p { (p.samples.len()) " robots that these records do not exclude: " code { (TABLE) } " holds their values, a folder each \
            their files. Members of the set and their rivals stand in them as often as they are believed; parameters are drawn from \
            what records and prior leave open beside them." }
        @if p.missing > 0 { p { (p.missing) " more were asked for; what was drawn for them is no machine." } }
        @match rows.is_empty() {
            true => p { "No effect is in any of them." },
            false => (table(&["effect", "where", "in"], &[1], &rows)),
        }
        (band(d, p))
    }
}

/// How often each effect stands in the samples, most often first.
fn occurrences(p: &Posterior) -> Vec<(&'static str, &str, usize)> {
    let mut all: Vec<(&'static str, &str, usize)> = Vec::new();
    for r in p.samples.iter().flat_map(|s| &s.remarks) {
        match all.iter_mut().find(|a| (a.0, a.1) == (r.effect, &r.place)) {
            Some(one) => one.2 += 1,
            None => all.push((r.effect, &r.place, 1)),
        }
    }
    all.sort_by_key(|a| std::cmp::Reverse(a.2));
    all
}

/// How the band of the samples does on records held out.
fn band(d: &Diagnosis, p: &Posterior) -> Markup {
    if p.band.is_empty() {
        return html! {
            p { "No record is held out in which anything moves, so that nothing says whether their band holds." }
        };
    }
    let unit_of = |b: &Band| {
        let at = d.joints.iter().position(|j| *j == b.joint);
        at.map_or("", |j| d.units[j])
    };
    let rows: Vec<Vec<Markup>> = p
        .band
        .iter()
        .map(|b| {
            vec![
                html! { (b.joint) },
                html! { (percent(b.covered)) },
                html! { (significant(b.spread, 3)) " " (unit_of(b)) },
                html! { (significant(b.left, 3)) " " (unit_of(b)) },
                html! { (significant(b.twenty, 3)) " " (unit_of(b)) },
            ]
        })
        .collect();
    let panels: Vec<Panel> = p
        .band
        .iter()
        .filter(|b| b.part.len() > 1)
        .map(|b| {
            let line = |of: &dyn Fn(&[f64; 3]) -> f64| {
                b.part.iter().map(|r| [r[0], of(r)]).collect::<Vec<_>>()
            };
            Panel {
                title: format!("{}: {} in the band", b.joint, percent(b.covered)),
                x: Axis::linear("time, s"),
                y: Axis::linear(unit("torque less mean", unit_of(b))),
                series: vec![
                    Series::line(line(&|r| r[1]), Colour::BLUE),
                    Series::line(line(&|r| r[2]), Colour::INK),
                    Series::line(line(&|r| -r[2]), Colour::INK),
                ],
                ..Panel::default()
            }
        })
        .collect();
    let columns = panels.len().clamp(1, 2);
    let svg = Figure {
        description: "torque of a held-out record less the mean of the samples, and their band"
            .into(),
        height: 130.0,
        columns,
        panels,
        ..Figure::default()
    }
    .svg();
    html! {
        h3 { "Their band on records held out" }
        (table(&["joint", "inside", "samples differ by", "the fit leaves", "±20 % on every parameter"], &[], &rows))
        (figure(svg, html! { "Measured torque of a record that was held out, less the mean of the samples (blue), and the band for \
            95 % (black): the samples and what the fit leaves on fitted records. Samples and ±20 % are root mean squares of a standard \
            deviation." }))
    }
}
