//! How often a name is right that was given with some confidence.

use crate::score::Judged;
use plotters::prelude::*;
use std::fmt::Write as _;
use std::path::Path;

/// Borders of the bins of confidence.
const EDGES: [f64; 8] = [0.0, 0.1, 0.3, 0.5, 0.7, 0.85, 0.95, 1.0];
/// Quantile of the normal distribution of a two-sided interval of 95 %.
const Z: f64 = 1.96;

/// One bin.
#[derive(Debug, Clone, PartialEq)]
pub struct Bin {
    /// borders of the confidence
    pub edges: [f64; 2],
    /// number of names
    pub count: usize,
    /// those that are right
    pub right: usize,
    /// mean of the confidence that was stated
    pub stated: f64,
}

impl Bin {
    /// Share that is right, and its interval of 95 % (Wilson 1927).
    pub fn share(&self) -> (f64, [f64; 2]) {
        let n = self.count.max(1) as f64;
        let p = self.right as f64 / n;
        let middle = (p + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
        let half = Z * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt() / (1.0 + Z * Z / n);
        (p, [(middle - half).max(0.0), (middle + half).min(1.0)])
    }
}

/// Bins that hold a name.
pub fn bins(judged: &[Judged]) -> Vec<Bin> {
    let all: Vec<(f64, bool)> = judged.iter().flat_map(|c| c.names.clone()).collect();
    let last = EDGES[EDGES.len() - 1];
    let each = EDGES.windows(2).map(|w| {
        let own: Vec<&(f64, bool)> = (all.iter())
            .filter(|(c, _)| (w[0] <= *c && *c < w[1]) || (w[1] == last && *c == last))
            .collect();
        let count = own.len();
        Bin {
            edges: [w[0], w[1]],
            count,
            right: own.iter().filter(|(_, right)| *right).count(),
            stated: own.iter().map(|(c, _)| c).sum::<f64>() / count.max(1) as f64,
        }
    });
    each.filter(|b| b.count > 0).collect()
}

/// As Markdown.
pub fn table(judged: &[Judged]) -> String {
    let mut s = String::from(
        "\n| confidence | names | stated, mean | right | interval of 95 % |\n|---|---|---|---|---|\n",
    );
    for b in bins(judged) {
        let (share, [low, high]) = b.share();
        let _ = writeln!(
            s,
            "| {} to {} | {} | {:.0} % | {:.0} % ({}/{}) | {:.0} to {:.0} % |",
            b.edges[0],
            b.edges[1],
            b.count,
            100.0 * b.stated,
            100.0 * share,
            b.right,
            b.count,
            100.0 * low,
            100.0 * high
        );
    }
    s
}

/// As a picture.
///
/// # Errors
/// A file that cannot be written.
pub fn picture(judged: &[Judged], path: &Path) -> Result<(), String> {
    let mut svg = String::new();
    draw(&bins(judged), judged.len(), &mut svg).map_err(|e| e.to_string())?;
    std::fs::write(path, svg).map_err(|e| format!("{}: {e}", path.display()))
}

fn draw(
    bins: &[Bin],
    cases: usize,
    svg: &mut String,
) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let area = SVGBackend::with_string(svg, (620, 560)).into_drawing_area();
    let wrong = |e: &dyn std::fmt::Display| e.to_string();
    area.fill(&WHITE).map_err(|e| wrong(&e))?;
    let mut chart = ChartBuilder::on(&area)
        .caption(
            format!("How often names are right: {cases} withheld cases"),
            ("sans-serif", 20),
        )
        .margin(14)
        .x_label_area_size(44)
        .y_label_area_size(56)
        .build_cartesian_2d(0.0..1.0, 0.0..1.04)
        .map_err(|e| wrong(&e))?;
    chart
        .configure_mesh()
        .x_desc("confidence that was stated (beside each point: number of names; bars: 95 %)")
        .y_desc("share of the names that is right")
        .light_line_style(WHITE)
        .label_style(("sans-serif", 14))
        .draw()
        .map_err(|e| wrong(&e))?;
    let grey = RGBColor(150, 150, 150);
    let straight = LineSeries::new([(0.0, 0.0), (1.0, 1.0)], grey);
    chart.draw_series(straight).map_err(|e| wrong(&e))?;
    let blue = RGBColor(31, 98, 168);
    for b in bins {
        let (share, [low, high]) = b.share();
        let bar = LineSeries::new([(b.stated, low), (b.stated, high)], blue.stroke_width(2));
        chart.draw_series(bar).map_err(|e| wrong(&e))?;
        let point = Circle::new((b.stated, share), 5, blue.filled());
        let side = if b.stated > 0.85 { -24 } else { 9 };
        let number = EmptyElement::at((b.stated, share))
            + Text::new(format!("{}", b.count), (side, -6), ("sans-serif", 14));
        chart.draw_series([point]).map_err(|e| wrong(&e))?;
        chart.draw_series([number]).map_err(|e| wrong(&e))?;
    }
    area.present().map_err(|e| wrong(&e))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn case(names: &[(f64, bool)]) -> Judged {
        Judged {
            case: String::new(),
            kind: "single".into(),
            truth: String::new(),
            verdict: String::new(),
            answer: None,
            wrong: Vec::new(),
            outcomes: Vec::new(),
            names: names.to_vec(),
            seconds: 0.0,
        }
    }

    #[test]
    fn names_are_counted_in_the_bin_of_their_confidence() {
        let all = [
            case(&[(1.0, true), (0.05, false)]),
            case(&[(0.95, true), (0.9, false), (0.1, false)]),
        ];
        let found = bins(&all);
        let counts: Vec<[usize; 2]> = found.iter().map(|b| [b.count, b.right]).collect();
        assert_eq!(counts, [[1, 0], [1, 0], [1, 0], [2, 2]]);
        assert!((found[3].stated - 0.975).abs() < 1e-12);
        assert!(table(&all).contains("| 0.95 to 1 | 2 | 98 % | 100 % (2/2) |"));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.svg");
        picture(&all, &path).unwrap();
        assert!(
            std::fs::read_to_string(path)
                .unwrap()
                .contains("2 withheld cases")
        );
    }

    #[test]
    fn the_interval_of_a_share_is_that_of_wilson() {
        // 8 of 10, as in tables: 0.490 to 0.943
        let b = Bin {
            edges: [0.0, 1.0],
            count: 10,
            right: 8,
            stated: 0.8,
        };
        let (share, [low, high]) = b.share();
        assert!(share == 0.8 && (low - 0.490).abs() < 1e-3 && (high - 0.943).abs() < 1e-3);
    }
}
