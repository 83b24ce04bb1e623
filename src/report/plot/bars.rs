//! A table of bars against a reference, such as how much of each limit is used.

use super::super::format::percent;
use super::Colour;
use super::canvas::{self, Anchor, Canvas, fitted};

/// One bar, as fractions of its reference.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bar {
    /// what is known to be used
    pub value: f64,
    /// what may be used beyond it
    pub more: f64,
    /// whether it is to stand out even though it may end before the reference
    pub alarm: bool,
}

/// Height of a row, pixels.
const ROW: f64 = 24.0;
/// Height of a bar.
const THICK: f64 = 11.0;
/// Room for the number behind a bar.
const NUMBER: f64 = 62.0;
/// What the length of a cell stands for: a little more than the reference.
const FULL: f64 = 1.15;

/// Table of bars as an SVG element: a row for every `rows`, a column for every `columns`, a cell
/// of `cells[row][column]`; `None` where there is nothing to compare with. The reference is a
/// line; what is beyond it is drawn in another colour, cut where the cell ends.
pub fn bars(
    description: &str,
    width: f64,
    rows: &[String],
    columns: &[String],
    cells: &[Vec<Option<Bar>>],
) -> String {
    let longest = rows.iter().map(|t| t.chars().count()).max().unwrap_or(0);
    let left = (7.2 * longest as f64 + 12.0).clamp(30.0, 160.0);
    let head = 24.0;
    let cell = (width - left) / columns.len().max(1) as f64;
    let height = head + ROW * rows.len() as f64 + 4.0;
    canvas::draw(width, height, description, |c| {
        for (k, title) in columns.iter().enumerate() {
            let at = (left + cell * k as f64, 8.0);
            c.text(title, at, Anchor::Start, 12.0, Colour::INK, true);
        }
        for (i, title) in rows.iter().enumerate() {
            let y = head + ROW * (i as f64 + 0.5);
            c.text(
                &fitted(title, left - 8.0, 12.0),
                (0.0, y),
                Anchor::Start,
                12.0,
                Colour::INK,
                true,
            );
            for k in 0..columns.len() {
                let from = left + cell * k as f64;
                let length = (cell - NUMBER).max(10.0);
                match cells.get(i).and_then(|r| r.get(k)).copied().flatten() {
                    Some(bar) => draw(c, bar, (from, y), length),
                    None => {
                        let at = (from, y);
                        c.text("no limit", at, Anchor::Start, 11.0, Colour::QUIET, false);
                    }
                }
            }
        }
    })
}

fn draw(c: &Canvas<'_>, bar: Bar, (left, y): (f64, f64), length: f64) {
    let (top, bottom) = (y - 0.5 * THICK, y + 0.5 * THICK);
    let one = length / FULL;
    let place = |x: f64| match x.is_nan() {
        true => left,
        false => left + one * x.clamp(0.0, FULL),
    };
    c.rectangle((left, top), (left + one, bottom), Colour::GRID, 1.0);
    let beyond = bar.alarm || bar.value.is_nan() || bar.value > 1.0 + 1e-9;
    let colour = if beyond {
        Colour::VERMILLION
    } else {
        Colour::BLUE
    };
    c.rectangle((left, top), (place(bar.value), bottom), colour, 1.0);
    let total = bar.value + bar.more.max(0.0);
    if total > bar.value {
        c.rectangle((place(bar.value), top), (place(total), bottom), colour, 0.4);
    }
    c.line(
        &[(left + one, top - 3.0), (left + one, bottom + 3.0)],
        Colour::QUIET,
        1.0,
    );
    let tone = if beyond {
        Colour::VERMILLION
    } else {
        Colour::INK
    };
    let at = (left + length + 6.0, y);
    c.text(&percent(bar.value), at, Anchor::Start, 11.0, tone, beyond);
}
