//! Line drawings in space: what a mechanism looks like in some of its poses.

use super::Colour;
use super::canvas::{self, Anchor};

/// One drawing: a heading and its lines.
#[derive(Debug, Clone)]
pub struct Drawing {
    /// what it shows
    pub title: String,
    /// lines
    pub lines: Vec<Line>,
}

/// A line in space.
#[derive(Debug, Clone)]
pub struct Line {
    /// its ends, `x, y, z`
    pub ends: [[f64; 3]; 2],
    /// colour
    pub colour: Colour,
    /// width, pixels
    pub width: f64,
}

/// Direction of the view: turned about the vertical and tilted, rad.
const VIEW: (f64, f64) = (0.55, 0.42);

/// Right and up of a point, in the plane of the drawing (parallel projection).
fn project([x, y, z]: [f64; 3]) -> [f64; 2] {
    let ((st, ct), (sp, cp)) = (VIEW.0.sin_cos(), VIEW.1.sin_cos());
    [ct * x - st * y, cp * z + sp * (st * x + ct * y)]
}

/// Drawings side by side, all to the same scale, as an SVG element.
pub fn wireframes(description: &str, width: f64, drawings: &[Drawing]) -> String {
    const HEAD: f64 = 20.0;
    const MARGIN: f64 = 12.0;
    let cell = width / drawings.len().max(1) as f64;
    let flat: Vec<Vec<[[f64; 2]; 2]>> = drawings
        .iter()
        .map(|d| d.lines.iter().map(|l| l.ends.map(project)).collect())
        .collect();
    let points = || flat.iter().flatten().flatten();
    let range = |k: usize| {
        points().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], p| {
            [a.min(p[k]), b.max(p[k])]
        })
    };
    let ([x0, x1], [y0, y1]) = (range(0), range(1));
    let (wide, high) = ((x1 - x0).max(1e-9), (y1 - y0).max(1e-9));
    let scale = ((cell - 2.0 * MARGIN) / wide).min(300.0 / high);
    let height = HEAD + high * scale + 2.0 * MARGIN;
    canvas::draw(width, height, description, |c| {
        for (i, (drawing, lines)) in drawings.iter().zip(&flat).enumerate() {
            let left = cell * i as f64;
            let title = canvas::fitted(&drawing.title, cell - MARGIN, 12.0);
            let at = (left + MARGIN, 0.5 * HEAD);
            c.text(&title, at, Anchor::Start, 12.0, Colour::INK, true);
            let shift = 0.5 * (cell - wide * scale);
            let place = |p: [f64; 2]| {
                let x = left + shift + (p[0] - x0) * scale;
                (x, HEAD + MARGIN + (y1 - p[1]) * scale)
            };
            for (line, ends) in drawing.lines.iter().zip(lines) {
                c.line(&ends.map(place), line.colour, line.width);
            }
        }
    })
}
