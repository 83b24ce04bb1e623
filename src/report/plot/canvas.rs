//! The sheet that is drawn on: plotters' SVG backend in units of CSS pixels.
//!
//! The backend rounds to whole pixels, so everything is drawn [`SCALE`] times larger and brought
//! back by the view box.

use super::Colour;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Drawing units per CSS pixel.
const SCALE: f64 = 10.0;

/// Where a text stands relative to its point.
#[derive(Clone, Copy)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// A sheet to draw on; lengths in CSS pixels from the upper left corner.
pub(super) struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
}

/// Draws on a sheet of this size and returns it as an SVG element that fills the width it is
/// given, up to its own.
pub(super) fn draw(
    width: f64,
    height: f64,
    description: &str,
    work: impl FnOnce(&Canvas<'_>),
) -> String {
    let size = (unit(width).max(1) as u32, unit(height).max(1) as u32);
    let mut text = String::new();
    {
        let canvas = Canvas {
            area: SVGBackend::with_string(&mut text, size).into_drawing_area(),
        };
        work(&canvas);
        // writing into a string cannot fail
        canvas.area.present().ok();
    }
    let body = text.split_once('\n').map_or("", |(_, body)| body);
    // what every text and shape would repeat is said once (attribute values are escaped, so the
    // quotation marks show that this cannot be a text)
    let body = body
        .replace(" font-family=\"sans-serif\"", "")
        .replace(" opacity=\"1\"", "");
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" viewBox=\"0 0 {} {}\" \
         style=\"width:100%;max-width:{}px;height:auto;display:block\" \
         font-family=\"system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',Arial,sans-serif\">\
         <title>{}</title>\n{}",
        size.0,
        size.1,
        width.round(),
        escaped(description),
        body.trim_end()
    )
}

/// Pixels to drawing units; anything absurd is brought to the edge of a very large sheet.
fn unit(x: f64) -> i32 {
    let x = if x.is_finite() { x } else { 0.0 };
    (x * SCALE).round().clamp(-1e6, 1e6) as i32
}

fn point((x, y): (f64, f64)) -> (i32, i32) {
    (unit(x), unit(y))
}

/// Text without the characters that mean something in XML, or nothing.
fn escaped(text: &str) -> String {
    text.chars()
        .map(|c| match c {
            '&' => "&amp;".into(),
            '<' => "&lt;".into(),
            '>' => "&gt;".into(),
            c if c.is_control() => " ".into(),
            c => c.to_string(),
        })
        .collect()
}

impl Canvas<'_> {
    /// A polyline.
    pub(super) fn line(&self, points: &[(f64, f64)], colour: Colour, width: f64) {
        if points.len() < 2 {
            return;
        }
        let points: Vec<_> = points.iter().map(|p| point(*p)).collect();
        let style = style(colour, 1.0).stroke_width(unit(width).max(1) as u32);
        self.area.draw(&PathElement::new(points, style)).ok();
    }

    /// A filled rectangle, `alpha` from 0 (invisible) to 1.
    pub(super) fn rectangle(&self, from: (f64, f64), to: (f64, f64), colour: Colour, alpha: f64) {
        let corners = [point(from), point(to)];
        let style = style(colour, alpha).filled();
        self.area.draw(&Rectangle::new(corners, style)).ok();
    }

    /// A filled disc with a white rim, so that it stands out from a curve.
    pub(super) fn disc(&self, at: (f64, f64), radius: f64, colour: Colour) {
        for (r, c) in [(radius + 1.0, Colour::WHITE), (radius, colour)] {
            let disc = Circle::new(point(at), unit(r), style(c, 1.0).filled());
            self.area.draw(&disc).ok();
        }
    }

    /// A text whose middle line is at the height of the point.
    pub(super) fn text(
        &self,
        text: &str,
        at: (f64, f64),
        anchor: Anchor,
        size: f64,
        colour: Colour,
        bold: bool,
    ) {
        if text.is_empty() {
            return;
        }
        let text: String = text
            .chars()
            .map(|c| if c.is_control() { ' ' } else { c })
            .collect();
        let weight = if bold {
            FontStyle::Bold
        } else {
            FontStyle::Normal
        };
        let horizontal = match anchor {
            Anchor::Start => HPos::Left,
            Anchor::Middle => HPos::Center,
            Anchor::End => HPos::Right,
        };
        // the backend divides sizes by 1.24
        let font = FontDesc::new(FontFamily::SansSerif, size * SCALE * 1.24, weight);
        let colour = RGBColor(colour.0, colour.1, colour.2);
        let style = TextStyle::from(font)
            .color(&colour)
            .pos(Pos::new(horizontal, VPos::Center));
        self.area.draw_text(&text, &style, point(at)).ok();
    }
}

fn style(colour: Colour, alpha: f64) -> ShapeStyle {
    ShapeStyle {
        color: RGBColor(colour.0, colour.1, colour.2).mix(alpha),
        filled: false,
        stroke_width: SCALE as u32,
    }
}

/// A text cut to the width it may take, with an ellipsis in its middle where names differ least.
pub(super) fn fitted(text: &str, width: f64, size: f64) -> String {
    // a wide guess at the mean width of a letter: there are no font metrics here
    let most = (width / (0.58 * size)).floor().max(1.0) as usize;
    let letters: Vec<char> = text.chars().collect();
    if letters.len() <= most {
        return text.to_string();
    }
    let keep = most.saturating_sub(1);
    let (head, tail) = (keep / 3, keep - keep / 3);
    let mut out: String = letters[..head].iter().collect();
    out.push('…');
    out.extend(&letters[letters.len() - tail..]);
    out
}
