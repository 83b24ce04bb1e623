//! Errors of all rows, and which of them do not belong to the rest.

use super::frame::{log, middle};
use super::kind::Kind;
use super::model::Model;
use super::row::Value;
use nalgebra::Vector3;

/// Mean, median, root mean square, 95th percentile and maximum of errors.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Stats {
    /// mean
    pub mean: f64,
    /// half of the errors are no larger
    pub median: f64,
    /// root mean square
    pub rms: f64,
    /// 95 % of the errors are no larger
    pub p95: f64,
    /// largest
    pub max: f64,
}

impl Stats {
    /// Of some errors; `None` of none.
    pub fn of(errors: &[f64]) -> Option<Self> {
        let mut e: Vec<f64> = errors.iter().copied().filter(|x| x.is_finite()).collect();
        e.sort_by(f64::total_cmp);
        let n = e.len();
        let max = *e.last()?;
        Some(Stats {
            mean: e.iter().sum::<f64>() / n as f64,
            median: e[n / 2],
            rms: (e.iter().map(|x| x * x).sum::<f64>() / n as f64).sqrt(),
            p95: e[((0.95 * n as f64).ceil() as usize).clamp(1, n) - 1],
            max,
        })
    }
}

/// Errors by row. Where a posture cannot be taken they are not numbers.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct Errors {
    /// m: distance of a point from the mean of its socket, of a target from where it was seen, of a point from its
    /// plane, of a second arm from where the first one holds it
    pub distance: Vec<f64>,
    /// rad; `None` where no orientation was measured
    pub angle: Vec<Option<f64>>,
    /// the same distance with the middle of the socket, which strays do not move, m
    pub robust: Vec<f64>,
}

/// Errors at `x`.
pub fn errors(model: &Model, x: &[f64]) -> Errors {
    let rows = &model.input.rows;
    let n = rows.len();
    let mut out = Errors {
        distance: vec![f64::NAN; n],
        angle: vec![None; n],
        robust: vec![f64::NAN; n],
    };
    let posed: Vec<_> = (0..n)
        .map(|i| model.posed(i, x).ok().map(|p| p.frame))
        .collect();
    for m in 0..model.input.measurements.len() {
        let own: Vec<usize> = (0..n).filter(|&i| rows[i].measurement == m).collect();
        match model.input.measurements[m].kind {
            Kind::Point => {
                let at: Vec<(usize, Vector3<f64>)> = own
                    .iter()
                    .filter_map(|&i| Some((i, posed[i].as_ref()?.p)))
                    .collect();
                let points: Vec<Vector3<f64>> = at.iter().map(|p| p.1).collect();
                let mean = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
                let centre = middle(&points);
                for (i, p) in at {
                    out.distance[i] = (p - mean).norm();
                    out.robust[i] = (p - centre).norm();
                }
            }
            Kind::Loop | Kind::Ball => {
                for i in own {
                    if let Some((gap, turn)) = model.misclosure(i, x) {
                        out.distance[i] = gap;
                        out.robust[i] = gap;
                        out.angle[i] = turn;
                    }
                }
            }
            Kind::Plane | Kind::Gauge => {
                for i in own {
                    if let Some(b) = model.block(i, x) {
                        let e = b.r[0] * model.input.measurements[m].std[0] * model.noise;
                        out.distance[i] = e.abs();
                        out.robust[i] = e.abs();
                    }
                }
            }
            Kind::Pose | Kind::Position => {
                let (camera, target) = (model.camera(m, x), model.target(m, x));
                for i in own {
                    let Some(frame) = &posed[i] else { continue };
                    let seen = camera.then(frame).then(&target);
                    let (p, r) = match &rows[i].value {
                        Value::Pose(f) => (f.p, Some(f.r)),
                        Value::Position(p) => (*p, None),
                        _ => continue,
                    };
                    out.distance[i] = (seen.p - p).norm();
                    out.robust[i] = out.distance[i];
                    out.angle[i] = r.map(|r| log(&(seen.r * r.transpose())).norm());
                }
            }
        }
    }
    out
}

/// Length of `m` whitened residuals from which on a row is called an outlier, in standard deviations: one of five
/// thousand rows of normal noise goes beyond.
pub fn outlier(m: usize) -> f64 {
    (m as f64).sqrt() + 2.8
}

/// Median length of `m` normal residuals.
pub fn median_length(m: usize) -> f64 {
    match m {
        1 => 0.674,
        3 => 1.538,
        6 => 2.313,
        m => (m as f64 - 0.66).max(0.1).sqrt(),
    }
}

/// A group whose errors are this many times those of the others was spoiled as a whole.
const SPOILED: f64 = 2.2;

/// What a group of rows is like.
#[derive(Debug, Clone)]
pub struct Group {
    /// name
    pub name: String,
    /// whether unknowns were identified with it
    pub fit: bool,
    /// whether its errors are out of all proportion to those of the other groups
    pub spoiled: bool,
    /// standard deviation of its errors, m
    pub noise: f64,
}

/// Standard deviation of a row's position in one direction, as the fit takes it, m.
fn stated(model: &Model, row: usize) -> f64 {
    let r = &model.input.rows[row];
    let std = match r.covariance {
        Some(c) => ((c[(0, 0)] + c[(1, 1)] + c[(2, 2)]) / 3.0).sqrt(),
        None => model.input.measurements[r.measurement].std[0],
    };
    std * model.noise
}

/// Groups, and the rows that do not belong to theirs.
pub fn strays(model: &Model, errors: &Errors) -> (Vec<Group>, Vec<usize>) {
    let input = model.input;
    let names: Vec<String> = input.groups().iter().map(|s| s.to_string()).collect();
    let of: Vec<usize> = input.rows.iter().map(|r| input.group_of(r)).collect();
    let dims = |i: usize| match input.measurements[input.rows[i].measurement].kind {
        Kind::Plane | Kind::Gauge => 1,
        _ => 3,
    };
    let level = |g: usize| {
        let list: Vec<f64> = (0..of.len())
            .filter(|&i| of[i] == g)
            .map(|i| errors.robust[i] / median_length(dims(i)))
            .collect();
        crate::median::median(list.iter().copied())
    };
    let levels: Vec<f64> = (0..names.len()).map(level).collect();
    let mut groups = Vec::new();
    for (g, name) in names.iter().enumerate() {
        let others: Vec<f64> = (0..names.len())
            .filter(|&o| o != g)
            .map(|o| levels[o])
            .collect();
        let fit = input.rows.iter().zip(&of).any(|(r, &o)| o == g && r.fit);
        groups.push(Group {
            name: name.clone(),
            fit,
            spoiled: others.len() >= 2
                && levels[g] > SPOILED * crate::median::median(others.iter().copied()),
            noise: levels[g],
        });
    }
    let sound: Vec<f64> = groups
        .iter()
        .filter(|g| !g.spoiled)
        .map(|g| g.noise)
        .collect();
    let usual = crate::median::median(sound.iter().copied());
    let rows = (0..of.len())
        .filter(|&i| {
            let g = &groups[of[i]];
            // rows held out may be better than those that are fitted, and say nothing of their noise
            let scale = g.noise.max(usual).max(stated(model, i));
            g.spoiled || !(errors.robust[i] <= outlier(dims(i)) * scale)
        })
        .collect();
    (groups, rows)
}
