//! What a calibration gives: unknowns, rows, groups, outliers, distances.

use super::file::Distance;
use super::fit::Plan;
use super::frame::{self, Frame};
use super::identifiable::Identifiability;
use super::judge::{Errors, Group, Stats};
use super::kind::Kind;
use super::model::Model;
use super::row::Row;
use super::select::Trial;
use super::serial::Posed;
use super::unknown::Unknown;
use crate::error::Warning;
use faer::Mat;
use nalgebra::DMatrix;

/// One identified unknown.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Identified {
    /// name, unit, prior
    pub unknown: Unknown,
    /// deviation from the robot file, or from the start of the set-up
    pub value: f64,
    /// standard deviation behind the measurement
    pub std: f64,
}

/// What a group of rows shows.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct GroupResult {
    /// name
    pub name: String,
    /// whether unknowns were identified with it
    pub fit: bool,
    /// whether it was spoiled as a whole
    pub spoiled: bool,
    /// number of rows
    pub rows: usize,
    /// rows that do not belong to the others
    pub outliers: usize,
    /// with the geometry of the robot file, m
    pub before: Option<Stats>,
    /// with the calibrated geometry, m
    pub after: Option<Stats>,
    /// the same without the outliers, m
    pub sound: Option<Stats>,
}

/// A row that does not belong to the others.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Outlier {
    /// index among all rows, from 0
    pub row: usize,
    /// its file
    pub file: String,
    /// its line there
    pub line: usize,
    /// its error, m
    pub error: f64,
    /// what it seems to be
    pub note: String,
}

/// A known distance and what came out.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct DistanceResult {
    /// the two files
    pub between: [String; 2],
    /// as stated, m
    pub value: f64,
    /// of the means of the points, before and after, m
    pub found: [f64; 2],
}

/// A calibrated robot.
#[derive(Debug)]
#[non_exhaustive]
pub struct Calibrated {
    /// name of the robot
    pub robot: String,
    /// the frame that was measured
    pub frame: String,
    /// joints whose readings were used
    pub joints: Vec<String>,
    /// what can be told
    pub identifiability: Identifiability,
    /// all unknowns
    pub unknowns: Vec<Identified>,
    /// errors of the joints that the data bear out, and those that were tried
    pub trials: Vec<Trial>,
    /// rows: group, whether fitted, errors before and after
    pub rows: Vec<RowResult>,
    /// by group
    pub groups: Vec<GroupResult>,
    /// what does not belong
    pub outliers: Vec<Outlier>,
    /// known distances
    pub distances: Vec<DistanceResult>,
    /// camera or tracker and target, by instrument: base in the instrument's frame, target on the frame
    pub setups: Vec<(String, Frame, Frame)>,
    /// factor between the noise that was found and the one that was stated or assumed
    pub noise: f64,
    /// steps of the last fit
    pub steps: usize,
    /// what the torques of gravity come from
    pub gravity: Option<String>,
    /// files of the calibrated robot
    pub files: Vec<(&'static str, String)>,
    /// what was imperfect
    pub warnings: Vec<Warning>,
}

/// One row.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct RowResult {
    /// index of its group
    pub group: usize,
    /// whether unknowns were identified with it
    pub fit: bool,
    /// whether it is an outlier
    pub outlier: bool,
    /// error with the geometry of the robot file, m
    pub before: f64,
    /// error with the calibrated geometry, m
    pub after: f64,
    /// the same in orientation, rad
    pub angles: Option<[f64; 2]>,
    /// joint readings, rad or m
    pub q: Vec<f64>,
    /// position of the frame in the base, m
    pub position: [f64; 3],
    /// standard deviation of the tool's position that the unknowns leave, m
    pub predicted: f64,
}

impl Calibrated {
    /// Errors of all rows of one kind, before and after, m; with or without the outliers.
    pub fn errors(&self, fit: bool, all: bool) -> [Vec<f64>; 2] {
        let rows = || {
            self.rows
                .iter()
                .filter(|r| r.fit == fit && (all || !r.outlier))
        };
        [
            rows().map(|r| r.before).collect(),
            rows().map(|r| r.after).collect(),
        ]
    }

    /// Angles of all rows of one kind, before and after, rad.
    pub fn angles(&self, fit: bool) -> [Vec<f64>; 2] {
        let rows = || {
            self.rows
                .iter()
                .filter(|r| r.fit == fit)
                .filter_map(|r| r.angles)
        };
        [
            rows().map(|a| a[0]).collect(),
            rows().map(|a| a[1]).collect(),
        ]
    }
}

pub(super) fn row_results(
    model: &Model,
    x: &[f64],
    groups: &[Group],
    strays: &[usize],
    [before, after]: [&Errors; 2],
    covariance: Option<&Mat<f64>>,
) -> Vec<RowResult> {
    let input = model.input;
    let n = model.of_robot;
    let posed: Vec<Option<Posed>> = (0..input.rows.len())
        .map(|i| model.posed(i, x).ok())
        .collect();
    let predicted = tool_stds(&posed, covariance, n);
    let each = |(i, r): (usize, &Row)| {
        let angles = before.angle[i].zip(after.angle[i]);
        RowResult {
            group: input.group_of(r).min(groups.len().saturating_sub(1)),
            fit: r.fit,
            outlier: strays.contains(&i),
            before: before.distance[i],
            after: after.distance[i],
            angles: angles.map(|(a, b)| [a, b]),
            q: r.q.clone(),
            position: posed[i]
                .as_ref()
                .map_or([f64::NAN; 3], |p| p.frame.p.into()),
            predicted: predicted[i],
        }
    };
    input.rows.iter().enumerate().map(each).collect()
}

/// Standard deviation of the tool's position in every row, m: `√tr(L Σ Lᵀ)`, with the rigid motions of all rows
/// together taken out of `L`.
pub(super) fn tool_stds(
    posed: &[Option<Posed>],
    covariance: Option<&Mat<f64>>,
    n: usize,
) -> Vec<f64> {
    let Some(c) = covariance else {
        return vec![f64::NAN; posed.len()];
    };
    let known: Vec<(usize, &Posed)> = posed
        .iter()
        .enumerate()
        .filter_map(|(i, p)| Some((i, p.as_ref()?)))
        .collect();
    let mut l = DMatrix::zeros(3 * known.len(), n);
    let mut rigid = DMatrix::zeros(3 * known.len(), 6);
    for (k, (_, p)) in known.iter().enumerate() {
        l.view_mut((3 * k, 0), (3, n))
            .copy_from(&p.jacobian.rows(0, 3));
        rigid
            .view_mut((3 * k, 0), (3, 3))
            .copy_from(&nalgebra::Matrix3::identity());
        rigid
            .view_mut((3 * k, 3), (3, 3))
            .copy_from(&(-frame::skew(&p.frame.p)));
    }
    if known.len() > 2 {
        let q = rigid.qr().q();
        l -= &q * q.tr_mul(&l);
    }
    let c = DMatrix::from_fn(n, n, |a, b| c[(a, b)]);
    let lc = &l * c;
    let mut out = vec![f64::NAN; posed.len()];
    for (k, (i, _)) in known.iter().enumerate() {
        let square: f64 = (0..3)
            .map(|d| lc.row(3 * k + d).dot(&l.row(3 * k + d)))
            .sum();
        out[*i] = square.max(0.0).sqrt();
    }
    out
}

pub(super) fn group_results(groups: &[Group], rows: &[RowResult]) -> Vec<GroupResult> {
    let each = |(g, group): (usize, &Group)| {
        let own: Vec<&RowResult> = rows.iter().filter(|r| r.group == g).collect();
        let of = |f: &dyn Fn(&RowResult) -> Option<f64>| {
            Stats::of(&own.iter().filter_map(|r| f(r)).collect::<Vec<_>>())
        };
        GroupResult {
            name: group.name.clone(),
            fit: group.fit,
            spoiled: group.spoiled,
            rows: own.len(),
            outliers: own.iter().filter(|r| r.outlier).count(),
            before: of(&|r| Some(r.before)),
            after: of(&|r| Some(r.after)),
            sound: of(&|r| (!r.outlier).then_some(r.after)),
        }
    };
    groups.iter().enumerate().map(each).collect()
}

pub(super) fn outliers(model: &Model, x: &[f64], strays: &[usize], after: &Errors) -> Vec<Outlier> {
    let input = model.input;
    let each = |&row: &usize| {
        let r = &input.rows[row];
        let own = &input.measurements[r.measurement];
        let mut note = String::new();
        if own.kind == Kind::Point
            && let Ok(posed) = model.posed(row, x)
        {
            let nearest = (0..input.measurements.len())
                .filter(|&m| m != r.measurement && input.measurements[m].kind == Kind::Point)
                .map(|m| ((posed.frame.p - model.socket(m, x)).norm(), m))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((far, m)) = nearest
                && far < 0.2 * after.robust[row]
            {
                note = format!(
                    "sits in the point of {}: mislabelled",
                    input.measurements[m].file
                );
            }
        }
        if !after.robust[row].is_finite() {
            note = "no pose of this assembly has these joint readings".into();
        }
        Outlier {
            row,
            file: own.file.clone(),
            line: r.line,
            error: after.robust[row],
            note,
        }
    };
    strays.iter().map(each).collect()
}

pub(super) fn distances(
    nominal: &Model,
    x0: &[f64],
    model: &Model,
    x: &[f64],
) -> Vec<DistanceResult> {
    let input = model.input;
    let each = |d: &Distance| {
        let [a, b] = d.between;
        let between = |model: &Model, x: &[f64]| (model.socket(a, x) - model.socket(b, x)).norm();
        DistanceResult {
            between: d.between.map(|m| input.measurements[m].file.clone()),
            value: d.value,
            found: [between(nominal, x0), between(model, x)],
        }
    };
    input.distances.iter().map(each).collect()
}

/// The free unknowns with their standard deviations.
pub(super) fn identified(
    model: &Model,
    plan: &Plan,
    x: &[f64],
    covariance: Option<&Mat<f64>>,
) -> Vec<Identified> {
    let std = |k: usize| covariance.map_or(f64::NAN, |c| c[(k, k)].max(0.0).sqrt());
    (0..model.count())
        .filter(|&k| plan.free[k])
        .map(|k| Identified {
            unknown: model.unknowns[k].clone(),
            value: x[k],
            std: std(k),
        })
        .collect()
}

/// Name, camera and target of each instrument.
pub(super) fn setups(model: &Model, x: &[f64]) -> Vec<(String, Frame, Frame)> {
    let mut setups: Vec<(String, Frame, Frame)> = Vec::new();
    for (m, measured) in model.input.measurements.iter().enumerate() {
        if measured.kind.has_instrument() && !setups.iter().any(|s| s.0 == measured.instrument) {
            setups.push((
                measured.instrument.clone(),
                model.camera(m, x),
                model.target(m, x),
            ));
        }
    }
    setups
}
