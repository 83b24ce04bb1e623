//! Figures: all drawing of all reports.
//!
//! A [`Figure`] is a grid of [`Panel`]s, each with curves, limits and marked points; [`bars`] is a
//! table of bars against a reference. Both return an SVG element to be put into a page: texts stay
//! texts, lengths are CSS pixels, and the whole shrinks with the page. Values that are not finite
//! leave a gap in a curve, whatever else they come with; long curves are thinned such that every
//! peak stays.
//!
//! One palette for all (Okabe & Ito 2008, distinguishable with any colour vision): data blue,
//! what is compared orange, limits vermillion, context grey.

mod axis;
mod bars;
mod canvas;
mod panel;
mod wireframe;

pub use axis::Axis;
pub use bars::{Bar, bars};
pub use wireframe::{Drawing, Line, wireframes};

/// A colour: red, green, blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Colour(pub u8, pub u8, pub u8);

impl Colour {
    /// data
    pub const BLUE: Colour = Colour(0, 114, 178);
    /// what data are compared with
    pub const ORANGE: Colour = Colour(230, 159, 0);
    /// limits and what is beyond them
    pub const VERMILLION: Colour = Colour(213, 94, 0);
    /// what is well
    pub const GREEN: Colour = Colour(0, 158, 115);
    /// a further series
    pub const SKY: Colour = Colour(86, 180, 233);
    /// a further series
    pub const PURPLE: Colour = Colour(204, 121, 167);
    /// context
    pub const GREY: Colour = Colour(176, 182, 189);
    /// texts and marked points
    pub const INK: Colour = Colour(31, 41, 51);
    /// texts of lesser weight
    pub const QUIET: Colour = Colour(97, 110, 124);
    /// grid lines
    pub const GRID: Colour = Colour(232, 235, 239);
    /// background
    pub const WHITE: Colour = Colour(255, 255, 255);

    /// The palette for series in order.
    pub const SERIES: [Colour; 6] = [
        Colour::BLUE,
        Colour::ORANGE,
        Colour::GREEN,
        Colour::PURPLE,
        Colour::SKY,
        Colour::VERMILLION,
    ];

    /// As CSS writes it, `#0072b2`.
    pub fn css(self) -> String {
        format!("#{:02x}{:02x}{:02x}", self.0, self.1, self.2)
    }
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shape {
    /// points joined by straight lines
    #[default]
    Line,
    /// a dot a point
    Dots,
    /// a dot on a stem from the bottom of the panel
    Stems,
}

/// A curve or a set of points.
#[derive(Debug, Clone)]
pub struct Series {
    /// `(x, y)`; not finite where there is a gap
    pub points: Vec<[f64; 2]>,
    /// colour
    pub colour: Colour,
    /// width of the line in pixels; dots are 1.5 times as wide in radius
    pub width: f64,
    /// line, dots or stems
    pub shape: Shape,
}

impl Series {
    /// A line of the usual width.
    pub fn line(points: Vec<[f64; 2]>, colour: Colour) -> Self {
        Series {
            points,
            colour,
            width: 1.4,
            shape: Shape::Line,
        }
    }

    /// A line of values against `0, dx, 2 dx …`.
    pub fn sampled(values: &[f64], dx: f64, colour: Colour) -> Self {
        Self::line(
            values
                .iter()
                .enumerate()
                .map(|(i, y)| [i as f64 * dx, *y])
                .collect(),
            colour,
        )
    }
}

/// A point of its own, such as an extremum.
#[derive(Debug, Clone)]
pub struct Marker {
    /// `(x, y)`
    pub at: [f64; 2],
    /// colour
    pub colour: Colour,
    /// text beside it; may be empty
    pub label: String,
}

/// A line across the panel with a label.
#[derive(Debug, Clone)]
pub struct Rule {
    /// where, in units of the axis
    pub at: f64,
    /// whether it stands at an `x` instead of lying at a `y`
    pub upright: bool,
    /// colour
    pub colour: Colour,
    /// text beside it; may be empty
    pub label: String,
}

/// One plot.
#[derive(Debug, Clone, Default)]
pub struct Panel {
    /// heading; may be empty
    pub title: String,
    /// short remark at the upper right, such as how much of a limit is used
    pub note: String,
    /// whether the remark is a bad one
    pub alarm: bool,
    /// horizontal axis
    pub x: Axis,
    /// vertical axis; its label stands at the upper left
    pub y: Axis,
    /// lower and upper limit of `y`. What is beyond is shaded. A limit that is so far away that
    /// the curve would become flat is not shown.
    pub limits: [Option<f64>; 2],
    /// further lines
    pub rules: Vec<Rule>,
    /// curves, the first drawn first
    pub series: Vec<Series>,
    /// points of their own, on top
    pub markers: Vec<Marker>,
}

/// A grid of panels, row by row.
#[derive(Debug, Clone)]
pub struct Figure {
    /// one sentence for those who cannot see it
    pub description: String,
    /// width, pixels
    pub width: f64,
    /// height of each panel without its captions, pixels
    pub height: f64,
    /// panels in a row
    pub columns: usize,
    /// headings of the columns; may be empty
    pub column_titles: Vec<String>,
    /// headings of the rows; may be empty
    pub row_titles: Vec<String>,
    /// whether the panels of a column have the same `x` axis, labelled once at the bottom
    pub share_x: bool,
    /// panels, row by row
    pub panels: Vec<Panel>,
}

impl Default for Figure {
    /// Takes the whole page, one panel a row, no headings.
    fn default() -> Self {
        Figure {
            description: String::new(),
            width: Figure::WIDTH,
            height: 150.0,
            columns: 1,
            column_titles: Vec::new(),
            row_titles: Vec::new(),
            share_x: false,
            panels: Vec::new(),
        }
    }
}

impl Figure {
    /// Width of a figure that takes the whole page, pixels.
    pub const WIDTH: f64 = 1040.0;

    /// Figure as an SVG element.
    pub fn svg(&self) -> String {
        panel::figure(self)
    }
}

/// Small multiples over time: a row for every `rows`, a column for every `columns`, panels row by
/// row.
pub fn time_series(
    description: impl Into<String>,
    rows: Vec<String>,
    columns: Vec<String>,
    panels: Vec<Panel>,
) -> String {
    Figure {
        description: description.into(),
        width: Figure::WIDTH,
        height: 84.0,
        columns: columns.len().max(1),
        column_titles: columns,
        row_titles: rows,
        share_x: true,
        panels,
    }
    .svg()
}

/// Stems of singular values, largest first, on a logarithmic axis; where `rank` lies inside, the
/// values beyond it are grey and the border is marked. What is less than 1e-17 of the largest
/// stands at the bottom.
pub fn singular_values(title: &str, label: &str, values: &[f64], rank: usize) -> Panel {
    let floor = values.iter().copied().fold(0.0, f64::max) * 1e-17;
    let stems = |from: usize, to: usize, colour| Series {
        points: (from..to)
            .map(|k| [(k + 1) as f64, values[k].max(floor)])
            .collect(),
        colour,
        width: 1.4,
        shape: Shape::Stems,
    };
    let rank = rank.min(values.len());
    let rules = if rank < values.len() {
        vec![Rule {
            at: rank as f64 + 0.5,
            upright: true,
            colour: Colour::VERMILLION,
            label: format!("rank {rank}"),
        }]
    } else {
        Vec::new()
    };
    Panel {
        title: title.into(),
        x: Axis {
            range: Some([0.0, values.len() as f64 + 1.0]),
            ..Axis::whole("number")
        },
        y: Axis::log(label),
        rules,
        series: vec![
            stems(rank, values.len(), Colour::GREY),
            stems(0, rank, Colour::BLUE),
        ],
        ..Panel::default()
    }
}

/// Course of a criterion over the iterations of several starts, on a logarithmic axis: all in
/// grey, the one numbered `best` in front, its last value marked.
pub fn history(label: &str, starts: &[(usize, &[f64])], best: usize) -> Panel {
    let curve = |values: &[f64], colour, width| Series {
        width,
        ..Series::sampled(values, 1.0, colour)
    };
    let mut series: Vec<Series> = starts
        .iter()
        .filter(|(number, _)| *number != best)
        .map(|(_, values)| curve(values, Colour::GREY, 1.0))
        .collect();
    let mut markers = Vec::new();
    if let Some((_, values)) = starts.iter().find(|(number, _)| *number == best) {
        series.push(curve(values, Colour::BLUE, 2.0));
        if let Some(last) = values.last() {
            markers.push(Marker {
                at: [values.len() as f64 - 1.0, *last],
                colour: Colour::BLUE,
                label: super::format::significant(*last, 4),
            });
        }
    }
    Panel {
        x: Axis::whole("iteration"),
        y: Axis::log(label),
        series,
        markers,
        ..Panel::default()
    }
}

#[cfg(test)]
mod tests;
