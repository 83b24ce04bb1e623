//! Drawing of panels and of the grid they stand in.

use super::axis::{Scale, runs, thin};
use super::canvas::{self, Anchor, Canvas, fitted};
use super::{Colour, Figure, Panel, Series, Shape};

/// Room for the numbers of the vertical axis, pixels.
const GUTTER: f64 = 44.0;
/// Room to the right of a panel.
const RIGHT: f64 = 14.0;
/// Room for one line of text above a panel.
const LINE: f64 = 17.0;
/// Room for numbers and label of the horizontal axis.
const FOOT: f64 = 36.0;
/// Room between rows without numbers between them.
const GAP: f64 = 9.0;
/// Sizes of texts.
const TITLE: f64 = 12.0;
const TEXT: f64 = 11.0;
const TICK: f64 = 10.0;
/// Points of all curves of a figure together, about.
const POINTS: usize = 40_000;
/// Least part of the height that a curve must keep when its limits are shown.
const LEAST: f64 = 0.12;

/// A figure as an SVG element.
pub(super) fn figure(f: &Figure) -> String {
    let columns = f.columns.max(1);
    let rows = f.panels.len().div_ceil(columns);
    let longest = f
        .row_titles
        .iter()
        .map(|t| t.chars().count())
        .max()
        .unwrap_or(0);
    let left = match longest {
        0 => 0.0,
        n => (0.6 * TITLE * n as f64 + 8.0).clamp(30.0, 130.0),
    };
    let cell = (f.width - left) / columns as f64;
    let head = if f.column_titles.is_empty() {
        0.0
    } else {
        LINE + 4.0
    };
    // a line for the heading where there is one, a line for the label of the axis
    let captions = if f.panels.iter().any(|p| !p.title.is_empty()) {
        2.0 * LINE
    } else {
        LINE
    };
    let pitch = captions + f.height + if f.share_x { GAP } else { FOOT };
    let foot = if f.share_x { FOOT - GAP } else { 0.0 };
    let height = head + pitch * rows as f64 + foot;
    let curves = f.panels.iter().map(|p| p.series.len()).sum::<usize>();
    let most = (POINTS / curves.max(1)).clamp(24, (2.0 * cell).max(24.0) as usize);

    canvas::draw(f.width, height, &f.description, |c| {
        for (k, title) in f.column_titles.iter().take(columns).enumerate() {
            let at = (left + cell * k as f64 + GUTTER, 0.5 * LINE);
            c.text(title, at, Anchor::Start, TITLE, Colour::INK, true);
        }
        for (k, panel) in f.panels.iter().enumerate() {
            let (row, column) = (k / columns, k % columns);
            let top = head + pitch * row as f64;
            if column == 0
                && let Some(title) = f.row_titles.get(row)
            {
                let title = fitted(title, left - 4.0, TITLE);
                let at = (0.0, top + captions + 0.5 * f.height);
                c.text(&title, at, Anchor::Start, TITLE, Colour::INK, true);
            }
            let from = (left + cell * column as f64 + GUTTER, top + captions);
            let to = (left + cell * (column + 1) as f64 - RIGHT, from.1 + f.height);
            let last = !f.share_x || k + columns >= f.panels.len();
            draw(c, panel, from, to, most, last);
        }
    })
}

/// Range of the vertical axis: data and markers, and limits where the curve stays visible.
fn range(p: &Panel) -> [f64; 2] {
    let values = || {
        let curves = p.series.iter().flat_map(|s| s.points.iter());
        let rules = p.rules.iter().filter(|r| !r.upright).map(|r| r.at);
        curves
            .map(|q| q[1])
            .chain(p.markers.iter().map(|m| m.at[1]))
            .chain(rules)
    };
    let tight = p.y.fit(values(), 0.0);
    let mut near: Vec<f64> = p.limits.into_iter().flatten().collect();
    near.retain(|l| {
        let span = tight[1].max(*l) - tight[0].min(*l);
        tight[1] - tight[0] >= LEAST * span
    });
    if near.len() == 2 && tight[1] - tight[0] < LEAST * (near[1] - near[0]) {
        near.clear();
    }
    p.y.fit(values().chain(near), 0.07)
}

/// One panel between two corners of its plotting area.
fn draw(c: &Canvas<'_>, p: &Panel, from: (f64, f64), to: (f64, f64), most: usize, foot: bool) {
    let curves = || p.series.iter().flat_map(|s| s.points.iter());
    let x_range = {
        let rules = p.rules.iter().filter(|r| r.upright).map(|r| r.at);
        let markers = p.markers.iter().map(|m| m.at[0]);
        p.x.fit(curves().map(|q| q[0]).chain(markers).chain(rules), 0.0)
    };
    let y_range = range(p);
    let x = Scale::new(&p.x, x_range, from.0, to.0);
    let y = Scale::new(&p.y, y_range, to.1, from.1);

    // captions
    let caption = from.1 - 0.5 * LINE;
    if !p.title.is_empty() {
        let at = (from.0, caption - LINE);
        let title = fitted(&p.title, to.0 - from.0, TITLE);
        c.text(&title, at, Anchor::Start, TITLE, Colour::INK, true);
    }
    let label = (from.0, caption);
    c.text(&p.y.label, label, Anchor::Start, TICK, Colour::QUIET, false);
    let tone = if p.alarm {
        Colour::VERMILLION
    } else {
        Colour::QUIET
    };
    c.text(&p.note, (to.0, caption), Anchor::End, TICK, tone, p.alarm);

    // grid and numbers
    for (value, text) in
        p.y.ticks(y_range, ((to.1 - from.1) / 20.0).max(2.0) as usize)
    {
        let at = y.at(value);
        c.line(&[(from.0, at), (to.0, at)], Colour::GRID, 1.0);
        c.text(
            &text,
            (from.0 - 5.0, at),
            Anchor::End,
            TICK,
            Colour::QUIET,
            false,
        );
    }
    for (value, text) in
        p.x.ticks(x_range, ((to.0 - from.0) / 55.0).max(2.0) as usize)
    {
        let at = x.at(value);
        c.line(&[(at, from.1), (at, to.1)], Colour::GRID, 1.0);
        if foot {
            c.text(
                &text,
                (at, to.1 + 10.0),
                Anchor::Middle,
                TICK,
                Colour::QUIET,
                false,
            );
        }
    }
    if foot {
        let at = (0.5 * (from.0 + to.0), to.1 + 25.0);
        c.text(&p.x.label, at, Anchor::Middle, TICK, Colour::QUIET, false);
    }

    // limits: what is beyond is shaded
    for (limit, edge, end) in [
        (p.limits[0], y_range[0], to.1),
        (p.limits[1], y_range[1], from.1),
    ] {
        if let Some(limit) = limit
            && limit > y_range[0]
            && limit < y_range[1]
            && edge != limit
        {
            let at = y.at(limit);
            let (a, b) = (at.min(end), at.max(end));
            c.rectangle((from.0, a), (to.0, b), Colour::VERMILLION, 0.12);
            c.line(&[(from.0, at), (to.0, at)], Colour::VERMILLION, 1.0);
        }
    }
    for rule in &p.rules {
        if rule.upright {
            if !p.x.shows(rule.at) {
                continue;
            }
            let at = x.at(rule.at);
            c.line(&[(at, from.1), (at, to.1)], rule.colour, 1.0);
            // on the side with more room
            let (shift, anchor) = if at < 0.5 * (from.0 + to.0) {
                (5.0, Anchor::Start)
            } else {
                (-5.0, Anchor::End)
            };
            // inside on the right there may be data; texts there stand above it
            let at = (at + shift, from.1 + 8.0);
            c.text(&rule.label, at, anchor, TEXT, rule.colour, false);
        } else if p.y.shows(rule.at) {
            let at = y.at(rule.at);
            c.line(&[(from.0, at), (to.0, at)], rule.colour, 1.0);
            let at = (to.0 - 4.0, at - 7.0);
            c.text(&rule.label, at, Anchor::End, TEXT, rule.colour, false);
        }
    }
    c.line(
        &[(from.0, from.1), (from.0, to.1), (to.0, to.1)],
        Colour::GREY,
        1.0,
    );

    for s in &p.series {
        series(c, p, s, (&x, &y), to.1, most);
    }
    for marker in &p.markers {
        let [a, b] = marker.at;
        if !(p.x.shows(a) && p.y.shows(b)) {
            continue;
        }
        let at = (x.at(a), y.at(b));
        c.disc(at, 3.0, marker.colour);
        let right = at.0 > 0.5 * (from.0 + to.0);
        let (shift, anchor) = if right {
            (-7.0, Anchor::End)
        } else {
            (7.0, Anchor::Start)
        };
        // above the point, below where there is no room
        let up = if at.1 - from.1 > 16.0 { -10.0 } else { 10.0 };
        let at = (at.0 + shift, at.1 + up);
        c.text(&marker.label, at, anchor, TEXT, marker.colour, true);
    }
}

/// One curve.
fn series(
    c: &Canvas<'_>,
    p: &Panel,
    s: &Series,
    (x, y): (&Scale, &Scale),
    bottom: f64,
    most: usize,
) {
    for run in runs(&s.points, &p.x, &p.y) {
        // each stretch gets its share of the points
        let share = (most * run.len()).div_ceil(s.points.len().max(1)).max(4);
        let path: Vec<(f64, f64)> = thin(run, share)
            .iter()
            .map(|q| (x.at(q[0]), y.at(q[1])))
            .collect();
        match s.shape {
            Shape::Line if path.len() > 1 => c.line(&path, s.colour, s.width),
            // a point between two gaps would be invisible as a line
            Shape::Line | Shape::Dots => path
                .iter()
                .for_each(|at| c.disc(*at, 1.5 * s.width, s.colour)),
            Shape::Stems => path.iter().for_each(|at| {
                c.line(&[(at.0, bottom), *at], s.colour, 0.8 * s.width);
                c.disc(*at, 1.5 * s.width, s.colour);
            }),
        }
    }
}
