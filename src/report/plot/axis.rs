//! Axes: ranges, ticks, and fewer points where there are more than can be seen.

use super::super::format::{power_of_ten, significant};

/// How values are spread along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Spread {
    /// evenly
    #[default]
    Linear,
    /// evenly, with ticks at whole numbers only
    Whole,
    /// by their logarithm; values that are not positive are left out
    Log,
}

/// One axis of a panel.
#[derive(Debug, Clone, Default)]
pub struct Axis {
    /// what it shows, with the unit
    pub label: String,
    /// linear or logarithmic
    pub spread: Spread,
    /// lowest and highest value shown; from the data where `None`
    pub range: Option<[f64; 2]>,
}

impl Axis {
    /// A linear axis with this label, its range from the data.
    pub fn linear(label: impl Into<String>) -> Self {
        Axis {
            label: label.into(),
            ..Axis::default()
        }
    }

    /// A logarithmic axis with this label, its range from the data.
    pub fn log(label: impl Into<String>) -> Self {
        Axis {
            label: label.into(),
            spread: Spread::Log,
            range: None,
        }
    }

    /// An axis of whole numbers with this label, its range from the data.
    pub fn whole(label: impl Into<String>) -> Self {
        Axis {
            label: label.into(),
            spread: Spread::Whole,
            range: None,
        }
    }

    /// Whether a value can be shown at all.
    pub(super) fn shows(&self, x: f64) -> bool {
        x.is_finite() && x.abs() < 1e300 && (self.spread != Spread::Log || x > 1e-300)
    }

    /// Lowest and highest of the values that can be shown, widened by a fraction at both ends.
    pub(super) fn fit(&self, values: impl Iterator<Item = f64>, widen: f64) -> [f64; 2] {
        if let Some([a, b]) = self.range
            && self.shows(a)
            && self.shows(b)
            && a < b
        {
            return [a, b];
        }
        let forward = |x: f64| match self.spread {
            Spread::Log => x.log10(),
            _ => x,
        };
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for x in values.filter(|x| self.shows(*x)).map(forward) {
            low = low.min(x);
            high = high.max(x);
        }
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        let least = match self.spread {
            Spread::Log => 0.3,
            Spread::Whole => 1.0,
            Spread::Linear => 1e-9 * low.abs().max(high.abs()),
        };
        if high - low <= least {
            let half = match self.spread {
                Spread::Linear if low == 0.0 => 0.5,
                Spread::Linear => 0.1 * low.abs().max(high.abs()),
                _ => 0.5 * least,
            };
            (low, high) = (0.5 * (low + high) - half, 0.5 * (low + high) + half);
        }
        let more = widen * (high - low);
        match self.spread {
            Spread::Log => [10f64.powf(low - more), 10f64.powf(high + more)],
            _ => [low - more, high + more],
        }
    }

    /// Ticks inside a range, about `target` of them, with their labels.
    pub(super) fn ticks(&self, range: [f64; 2], target: usize) -> Vec<(f64, String)> {
        match self.spread {
            Spread::Log => log_ticks(range, target),
            Spread::Linear | Spread::Whole => {
                linear_ticks(range, target, self.spread == Spread::Whole)
            }
        }
    }
}

/// Place of a value between two ends, in pixels.
pub(super) struct Scale {
    log: bool,
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Scale {
    pub(super) fn new(axis: &Axis, [low, high]: [f64; 2], from: f64, to: f64) -> Self {
        let log = axis.spread == Spread::Log;
        let forward = |x: f64| if log { x.log10() } else { x };
        Scale {
            log,
            low: forward(low),
            high: forward(high),
            from,
            to,
        }
    }

    /// Pixel of a value; what lies outside is brought to the end.
    pub(super) fn at(&self, x: f64) -> f64 {
        let x = if self.log { x.log10() } else { x };
        let part = ((x - self.low) / (self.high - self.low)).clamp(0.0, 1.0);
        self.from + part * (self.to - self.from)
    }
}

/// Multiples of 1, 2 or 5 times a power of ten.
fn linear_ticks([low, high]: [f64; 2], target: usize, whole: bool) -> Vec<(f64, String)> {
    let rough = (high - low) / target.max(1) as f64;
    if !(rough.is_finite() && rough > 0.0) {
        return Vec::new();
    }
    // the smallest step that gives no more than the target
    let power = 10f64.powf(rough.log10().floor() - 1.0);
    let step = [5.0, 10.0, 20.0, 50.0, 100.0, 200.0]
        .into_iter()
        .map(|m| {
            if whole {
                f64::max(m * power, 1.0)
            } else {
                m * power
            }
        })
        .find(|s| (high / s).floor() - (low / s).ceil() <= target as f64)
        .unwrap_or(200.0 * power);
    let (first, last) = ((low / step).ceil(), (high / step).floor());
    // with ranges of almost nothing beside their values, steps vanish in rounding
    let count = last - first + 1.0;
    if !(0.0..=100.0).contains(&count) {
        return Vec::new();
    }
    let decimals = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
    let large = low.abs().max(high.abs());
    (0..count as i64)
        .map(|k| (first + k as f64) * step)
        .map(|x| {
            let text = if !(1e-4..1e6).contains(&large) {
                significant(x, 3)
            } else {
                format!("{:.decimals$}", x + 0.0).replace('-', "−")
            };
            (
                x,
                if text.trim_start_matches(['−', '0', '.']).is_empty() {
                    "0".into()
                } else {
                    text
                },
            )
        })
        .collect()
}

/// Powers of ten, every so many; within one or two decades 2 and 5 times them too.
fn log_ticks([low, high]: [f64; 2], target: usize) -> Vec<(f64, String)> {
    let (a, b) = (low.log10(), high.log10());
    let decades = b - a;
    if !(decades.is_finite() && decades > 0.0) {
        return Vec::new();
    }
    let multiples: &[f64] = if decades < 1.0 {
        &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0]
    } else if decades < 2.5 {
        &[1.0, 2.0, 5.0]
    } else {
        &[1.0]
    };
    let stride = (decades / target.max(1) as f64).ceil().max(1.0) as i32;
    let (first, last) = (a.floor() as i32, b.ceil() as i32);
    (first..=last)
        .filter(|e| e.rem_euclid(stride) == 0)
        .flat_map(|e| multiples.iter().map(move |m| (*m, e)))
        .map(|(m, e)| {
            let x = m * 10f64.powi(e);
            let text = if (-3..5).contains(&e) {
                significant(x, 2)
            } else if m == 1.0 {
                power_of_ten(e)
            } else {
                significant(x, 2)
            };
            (x, text)
        })
        .filter(|(x, _)| (low..=high).contains(x))
        .collect()
}

/// At most about `most` of the points of a curve: of every stretch the lowest and the highest, in
/// their order, so that no peak is lost.
pub(super) fn thin(points: &[[f64; 2]], most: usize) -> Vec<[f64; 2]> {
    let n = points.len();
    if n <= most.max(4) {
        return points.to_vec();
    }
    let stretches = (most / 2).max(2);
    let mut out = Vec::with_capacity(2 * stretches + 2);
    out.extend(points.first());
    for s in 0..stretches {
        let (from, to) = (s * n / stretches, (s + 1) * n / stretches);
        let by = |a: &usize, b: &usize| points[*a][1].total_cmp(&points[*b][1]);
        let low = (from..to).min_by(by).unwrap_or(from);
        let high = (from..to).max_by(by).unwrap_or(from);
        for k in [low.min(high), low.max(high)] {
            if out.last() != Some(&points[k]) {
                out.push(points[k]);
            }
        }
    }
    if out.last() != points.last() {
        out.extend(points.last());
    }
    out
}

/// The stretches of a curve between points that cannot be shown.
pub(super) fn runs<'a>(
    points: &'a [[f64; 2]],
    x: &'a Axis,
    y: &'a Axis,
) -> impl Iterator<Item = &'a [[f64; 2]]> {
    points
        .split(|p| !(x.shows(p[0]) && y.shows(p[1])))
        .filter(|run| !run.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, range: [f64; 2]) -> Vec<String> {
        axis.ticks(range, 4).into_iter().map(|(_, t)| t).collect()
    }

    #[test]
    fn ticks_are_round_numbers() {
        let linear = Axis::linear("");
        assert_eq!(labels(&linear, [-2.9, 2.9]), ["−2", "−1", "0", "1", "2"]);
        assert_eq!(labels(&linear, [0.0, 0.11]), ["0", "0.05", "0.10"]);
        assert_eq!(labels(&linear, [-93.0, 93.0]), ["−50", "0", "50"]);
        assert_eq!(labels(&Axis::whole(""), [0.0, 2.0]), ["0", "1", "2"]);
        assert_eq!(labels(&Axis::log(""), [1e-8, 1.5]), ["10⁻⁶", "0.001", "1"]);
        assert_eq!(labels(&Axis::log(""), [4.0, 60.0]), ["5", "10", "20", "50"]);
    }

    #[test]
    fn absurd_ranges_give_few_ticks_and_no_panic() {
        for range in [
            [0.0, f64::INFINITY],
            [f64::NAN, 1.0],
            [1.0, 1.0 + 1e-16],
            [-1e299, 1e299],
            [1e-299, 1e299],
            [5.0, 4.0],
        ] {
            for axis in [Axis::linear(""), Axis::whole(""), Axis::log("")] {
                assert!(axis.ticks(range, 5).len() <= 101, "{range:?}");
            }
        }
    }

    #[test]
    fn a_range_fits_what_can_be_shown_and_is_never_empty() {
        let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
        for axis in [Axis::linear(""), Axis::whole(""), Axis::log("")] {
            for values in [&bad[..], &[0.0], &[3.0, 3.0], &[-1.0]] {
                let [a, b] = axis.fit(values.iter().copied(), 0.05);
                assert!(a < b && a.is_finite() && b.is_finite());
            }
        }
        let [a, b] = Axis::linear("").fit([1.0, f64::NAN, 5.0].into_iter(), 0.0);
        assert_eq!([a, b], [1.0, 5.0]);
    }

    #[test]
    fn thinning_keeps_ends_and_extremes() {
        let mut points: Vec<[f64; 2]> = (0..100_000)
            .map(|i| [f64::from(i), (f64::from(i) * 0.01).sin()])
            .collect();
        points[77_777][1] = 9.0;
        points[33_333][1] = -9.0;
        let few = thin(&points, 500);
        assert!(few.len() <= 502);
        assert_eq!(few.first(), points.first());
        assert_eq!(few.last(), points.last());
        assert!(few.contains(&points[77_777]) && few.contains(&points[33_333]));
        assert!(few.windows(2).all(|w| w[0][0] < w[1][0]));
        assert_eq!(thin(&points[..4], 1), points[..4]);
    }
}
