//! Kinematic calibration: the geometry of a robot from joint readings and what a camera, a tracker, a socket, a plane
//! or a gauge says of its tool.
//!
//! ```text
//! minimise over x   Σ ρ(|Σ_r^(−1/2) r(q, y; x)|)  +  |P^(−1/2) x|²
//! ```
//!
//! with the residuals of `model`, the prior `P` of the manufacturing tolerances, and a loss `ρ` that strays do not
//! bend (`fit`). Which effects of the joints stand beside the geometry is decided by cross-validation of the rows
//! that are fitted; the rows held out judge the result and nothing else.

mod effects;
mod file;
mod fit;
mod frame;
mod identifiable;
#[doc(hidden)]
pub mod json;
mod judge;
mod model;
mod open;
#[doc(hidden)]
pub mod page;
mod parallel;
#[doc(hidden)]
pub mod poses;
mod rows;
mod select;
mod serial;
mod start;
#[cfg(test)]
mod tests;
mod unknown;
#[doc(hidden)]
pub mod write;
mod write_parallel;

pub use file::{Calibration, Distance, EFFECTS, Kind, Measurement, Tolerances};
pub use frame::Frame;
pub use identifiable::{Confounded, Identifiability};
pub use judge::{Errors, Stats};
pub use model::{Algorithm, Settings};
pub use open::{Opened, open};
pub use select::Trial;
pub use unknown::{Part, Unknown};

use crate::error::{Error, Result, Warning, WarningKind};
use crate::robot::{Robot, bundled};
use effects::Gravity;
use faer::Mat;
use fit::Plan;
use judge::Group;
use model::Model;
use nalgebra::DMatrix;
use std::path::Path;

/// One identified unknown.
#[derive(Debug, Clone, serde::Serialize)]
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

/// Rounds of fitting and leaving out.
const ROUNDS: usize = 6;

/// Reads a `calibration.toml`, its robot and its rows.
///
/// # Errors
/// As [`Calibration::read`] and [`open()`].
pub fn read(path: impl AsRef<Path>) -> Result<(Calibration, Opened)> {
    Calibration::read(path.as_ref(), |robot, frame| {
        let opened = open(robot, frame)?;
        let joints = opened.joints.clone();
        Ok((opened, joints))
    })
}

/// Inertia that tells the torques of gravity: of the robot that is named, of the robot itself, or of a bundled
/// robot with the same joints.
fn gravity(
    input: &Calibration,
    opened: &Opened,
    warnings: &mut Vec<Warning>,
) -> Result<Option<Gravity>> {
    if let Some(spec) = &input.gravity {
        let robot = Robot::load(spec)?;
        let found = Gravity::of(robot, &opened.joints, spec.clone()).ok_or_else(|| {
            Error::Infeasible(format!(
                "gravity = \"{spec}\": that robot has no mass, or lacks one of the joints {}",
                opened.joints.join(", ")
            ))
        })?;
        return Ok(Some(found));
    }
    let own = Gravity::of(
        opened.plant.robot().clone(),
        &opened.joints,
        "the robot file".into(),
    );
    if own.is_some() {
        return Ok(own);
    }
    for b in bundled::list() {
        let robot = b.load()?;
        if robot.dof() < opened.joints.len() {
            continue;
        }
        if let Some(found) = Gravity::of(robot, &opened.joints, format!("the bundled {}", b.name)) {
            warnings.push(Warning::new(
                WarningKind::NominalModelAssumed,
                opened.plant.name(),
                format!(
                    "its file states no inertia; torques of gravity are those of the bundled {}, whose joints have \
                     the same names. Name another robot by gravity = \"robot.toml\" beside robot",
                    b.name
                ),
            ));
            return Ok(Some(found));
        }
    }
    let model::Kin::Arm(arm) = &opened.kin else {
        return Ok(None);
    };
    warnings.push(Warning::new(
        WarningKind::NominalModelAssumed,
        opened.plant.name(),
        "its file states no inertia; torques of gravity are those of even rods of 1 kg/m between its joints. What is \
         said of joint compliance holds in kind, its values do not. Name a robot with masses by gravity = \"robot.toml\"",
    ));
    let rods = effects::rods(opened.plant.robot(), &arm.links, &arm.tip.p);
    Ok(Gravity::of(
        rods,
        &opened.joints,
        "even rods of 1 kg/m".into(),
    ))
}

/// Calibrates.
///
/// # Errors
/// Too few rows, rows that contradict the robot, a robot whose geometry cannot be calibrated.
pub fn calibrate(input: &Calibration, opened: &Opened, settings: Settings) -> Result<Calibrated> {
    let mut warnings: Vec<Warning> = opened.plant.warnings().to_vec();
    // what a calibration does not use is not worth a word
    warnings.retain(|w| {
        !matches!(
            w.kind,
            WarningKind::InertiaMissing | WarningKind::LimitsMissing
        )
    });
    warnings.extend(input.warnings.iter().cloned());
    let fitted = input.rows.iter().filter(|r| r.fit).count();
    if fitted < 3 {
        return Err(Error::file(
            &input.path,
            "",
            format!(
                "{fitted} rows are for the fit; at least 3 are needed, and several times the unknowns are good"
            ),
        ));
    }
    let gravity = match &opened.kin {
        model::Kin::Arm(_) => gravity(input, opened, &mut warnings)?,
        model::Kin::Parallel(_) => None,
    };
    let postures: Vec<Vec<f64>> = input.rows.iter().map(|r| r.q.clone()).collect();
    let torques = gravity.as_ref().map(|g| g.torques(&postures));
    let poses: Vec<Option<Frame>> = input
        .rows
        .iter()
        .map(|r| opened.kin.nominal(&r.q).ok())
        .collect();
    unreached(input, &poses, &mut warnings)?;
    let start = start::start(input, &opened.kin, &poses)?;
    let make = |features: Vec<effects::Feature>| {
        let start = start.clone();
        Model::new(
            input,
            &opened.kin,
            features,
            torques.as_deref(),
            start,
            &poses,
            settings,
        )
    };
    let nominal = make(Vec::new());
    let x0 = vec![0.0; nominal.count()];
    let mut plan = Plan {
        weights: (input.rows.iter().zip(&poses))
            .map(|(r, p)| f64::from(u8::from(r.fit && p.is_some())))
            .collect(),
        free: vec![false; nominal.count()],
        robust: true,
    };
    let x_before = set_up(&nominal, &plan, &x0)?;
    let before = judge::errors(&nominal, &x_before);
    suspicious(input, &before, &mut warnings);
    unmoved(input, &opened.joints, &mut warnings);
    let names = &opened.joints;
    let motions = opened.kin.motions(names.len());
    let columns = |part: Part| {
        let none = || vec![vec![0.0; names.len()]; input.rows.len()];
        match opened.kin {
            model::Kin::Parallel(_) => Vec::new(),
            model::Kin::Arm(_) => match &torques {
                Some(t) => effects::features(part, names, &motions, t),
                None => effects::features(part, names, &motions, &none()),
            },
        }
    };
    let chosen = select::choose(input, &make, &columns)?;
    let mut model = make(chosen.features);
    let mut x = extend(&nominal, &model, &x_before);
    plan.free = seen(&model, &plan);
    let identifiability = {
        // what can be told hangs on geometry and postures, not on noise; the algorithms of the paper see no orientation
        let mut exact = model.clone();
        exact.consistent = true;
        exact.settings.orientation = false;
        identifiable::assess(&exact, &plan, &x)?
    };
    if identifiability.gap < 1e3 && identifiability.rank < identifiability.total {
        warnings.push(Warning::new(
            WarningKind::RankGap,
            "identifiability",
            format!(
                "the border between what can be told and what cannot is blurred (gap {})",
                crate::error::number(identifiability.gap)
            ),
        ));
    }
    let residuals: usize = (0..input.rows.len())
        .filter(|&i| input.rows[i].fit)
        .map(|i| model.residuals(i))
        .sum();
    if residuals < identifiability.total {
        warnings.push(Warning::new(
            WarningKind::NotExcited,
            "rows",
            format!(
                "{residuals} numbers were measured for {} unknowns; tolerances decide the rest. Record more postures",
                identifiability.total
            ),
        ));
    }
    let fit = robustly(&mut model, &mut plan, &x)?;
    if !fit.converged {
        warnings.push(Warning::new(
            WarningKind::NotExcited,
            "fit",
            format!(
                "it did not come to rest within {} steps; the result is where it stood",
                fit.steps
            ),
        ));
    }
    x = fit.x;
    let x = set_up_rest(&model, &plan, &x)?;
    let after = judge::errors(&model, &x);
    let (groups, strays) = judge::strays(&model, &after);
    let covariance = fit::covariance(&model, &plan, &x);
    if covariance.is_none() {
        warnings.push(Warning::new(
            WarningKind::NotIdentifiable,
            "uncertainty",
            "the information matrix has no inverse; standard deviations are not known",
        ));
    }
    let std = |k: usize| {
        covariance
            .as_ref()
            .map_or(f64::NAN, |c| c[(k, k)].max(0.0).sqrt())
    };
    let rows = row_results(
        &model,
        &x,
        &groups,
        &strays,
        [&before, &after],
        covariance.as_ref(),
    );
    let groups = group_results(&groups, &rows);
    for g in groups.iter().filter(|g| g.spoiled) {
        warnings.push(Warning::new(
            WarningKind::RecordLeftOut,
            g.name.clone(),
            format!(
                "its errors are out of proportion to those of all other groups (mean {} mm): it was spoiled while it \
                 was recorded, a socket or camera moved, say. It is not counted among the sound ones",
                crate::error::number(1e3 * g.after.map_or(f64::NAN, |s| s.mean))
            ),
        ));
    }
    let outliers = outliers(&model, &x, &strays, &after);
    let distances = distances(&nominal, &x_before, &model, &x);
    let mut setups: Vec<(String, Frame, Frame)> = Vec::new();
    for (m, measured) in input.measurements.iter().enumerate() {
        if measured.kind.has_instrument() && !setups.iter().any(|s| s.0 == measured.instrument) {
            setups.push((
                measured.instrument.clone(),
                model.camera(m, &x),
                model.target(m, &x),
            ));
        }
    }
    let files = write::robot(opened, &x[..opened.kin.errors()])?;
    Ok(Calibrated {
        robot: opened.plant.name().to_string(),
        frame: opened.frame.clone(),
        joints: opened.joints.clone(),
        identifiability,
        unknowns: (0..model.count())
            .filter(|&k| plan.free[k])
            .map(|k| Identified {
                unknown: model.unknowns[k].clone(),
                value: x[k],
                std: std(k),
            })
            .collect(),
        trials: chosen.trials,
        rows,
        groups,
        outliers,
        distances,
        setups,
        noise: model.noise,
        steps: fit.steps,
        gravity: gravity.map(|g| g.source),
        files,
        warnings,
    })
}

/// Rows whose joint readings no pose gives are left out, with a warning; too many of them are an error.
fn unreached(
    input: &Calibration,
    poses: &[Option<Frame>],
    warnings: &mut Vec<Warning>,
) -> Result<()> {
    let lost: Vec<usize> = (0..poses.len()).filter(|&i| poses[i].is_none()).collect();
    let Some(&first) = lost.first() else {
        return Ok(());
    };
    let row = &input.rows[first];
    let file = &input.measurements[row.measurement].file;
    if 2 * lost.len() > poses.len() {
        return Err(Error::file(
            &input.path,
            format!("{file}, line {}", row.line),
            format!(
                "{} of {} rows have joint readings that no pose of the robot gives: are they in rad and m, in the \
                 order of the joints, and from zero where the file has it?",
                lost.len(),
                poses.len()
            ),
        ));
    }
    warnings.push(Warning::new(
        WarningKind::RowsLeftOut,
        file.clone(),
        format!(
            "{} rows have joint readings that no pose of this assembly mode gives; they were left out, the first in \
             line {}",
            lost.len(),
            row.line
        ),
    ));
    Ok(())
}

/// Unknowns that some row of the plan sees.
fn seen(model: &Model, plan: &Plan) -> Vec<bool> {
    let mut free: Vec<bool> = (0..model.count()).map(|k| k < model.of_robot).collect();
    for (i, row) in model.input.rows.iter().enumerate() {
        if plan.weights[i] > 0.0 {
            own(model, row.measurement, |k| free[k] = true);
        }
    }
    free
}

/// Unknowns of the set-up of one measurement.
fn own(model: &Model, m: usize, mut each: impl FnMut(usize)) {
    let l = &model.layout;
    let last = match model.input.measurements[m].kind {
        Kind::Pose => 6,
        _ => 3,
    };
    l.camera[m]
        .into_iter()
        .flat_map(|c| c..c + 6)
        .for_each(&mut each);
    l.target[m]
        .into_iter()
        .flat_map(|t| t..t + last)
        .for_each(&mut each);
    l.contact[m]
        .into_iter()
        .flat_map(|c| c..c + 3)
        .for_each(&mut each);
}

/// The set-up alone, for the robot as it is: fitted rows first, then what only held-out rows see.
fn set_up(model: &Model, plan: &Plan, x: &[f64]) -> Result<Vec<f64>> {
    let mut free = seen(model, plan);
    free[..model.of_robot].fill(false);
    let only = Plan {
        free,
        ..plan.clone()
    };
    // without it nothing holds the tilt of a camera before a robot that keeps its own
    let mut model = model.clone();
    model.settings.orientation = true;
    let x = fit::solve(&model, &only, x)?.x;
    set_up_rest(&model, plan, &x)
}

/// What only held-out rows see: their sockets and planes.
fn set_up_rest(model: &Model, plan: &Plan, x: &[f64]) -> Result<Vec<f64>> {
    let known = seen(model, plan);
    let mut rest = Plan {
        weights: vec![0.0; plan.weights.len()],
        free: vec![false; model.count()],
        robust: true,
    };
    for (i, row) in model.input.rows.iter().enumerate() {
        let mut new = false;
        own(model, row.measurement, |k| {
            if !known[k] {
                rest.free[k] = true;
                new = true;
            }
        });
        rest.weights[i] = f64::from(u8::from(new && model.nominal[i].is_some()));
    }
    match rest.free.contains(&true) {
        true => Ok(fit::solve(model, &rest, x)?.x),
        false => Ok(x.to_vec()),
    }
}

/// Unknowns of one model as a start for another with more features.
fn extend(from: &Model, to: &Model, x: &[f64]) -> Vec<f64> {
    let errors = from.of_robot;
    let mut out = vec![0.0; to.count()];
    out[..errors].copy_from_slice(&x[..errors]);
    let (a, b) = (from.of_robot, to.of_robot);
    out[b..].copy_from_slice(&x[a..]);
    out
}

/// Fits, estimates the noise, leaves out what does not belong, and again until nothing changes.
fn robustly(model: &mut Model, plan: &mut Plan, x: &[f64]) -> Result<fit::Fit> {
    let wanted = plan.weights.clone();
    let mut fit = fit::solve(model, plan, x)?;
    for _ in 0..ROUNDS {
        let lengths: Vec<Option<(f64, usize)>> = (0..wanted.len())
            .map(|i| {
                let b = model.block(i, &fit.x).filter(|_| wanted[i] > 0.0)?;
                Some((b.r.norm(), b.r.len()))
            })
            .collect();
        let scaled: Vec<f64> = lengths
            .iter()
            .flatten()
            .map(|(d, m)| d / judge::median_length(*m))
            .collect();
        let count: usize = lengths.iter().flatten().map(|l| l.1).sum();
        // parameters take their share of the residuals; where there are few rows, half at most
        let taken = plan.free.iter().filter(|f| **f).count().min(count / 2);
        let found = judge::middle(&scaled) * (count as f64 / (count - taken).max(1) as f64).sqrt();
        let before = model.noise;
        let new = (before * found).max(match model.input.noise_stated {
            true => 1.0,
            false => 1e-3,
        });
        model.noise = new;
        let ratio = before / new;
        let weights: Vec<f64> = lengths
            .iter()
            .map(|l| match l {
                Some((d, m)) => f64::from(u8::from(d * ratio <= judge::outlier(*m))),
                None => 0.0,
            })
            .collect();
        let still = weights == plan.weights && (ratio - 1.0).abs() < 0.02;
        plan.weights = weights;
        fit = fit::solve(model, plan, &fit.x)?;
        if still {
            break;
        }
    }
    Ok(fit)
}

/// Warnings about rows that the nominal robot is far from.
fn suspicious(input: &Calibration, before: &Errors, warnings: &mut Vec<Warning>) {
    for (m, measured) in input.measurements.iter().enumerate() {
        let own: Vec<f64> = input
            .rows
            .iter()
            .zip(&before.robust)
            .filter(|(r, _)| r.measurement == m)
            .map(|(_, e)| *e)
            .collect();
        let typical = judge::middle(&own);
        if typical > 0.05 {
            warnings.push(Warning::new(
                WarningKind::UnitSuspect,
                measured.file.clone(),
                format!(
                    "with the robot as in its file the frame is off by {} mm in the middle of its rows: are the \
                     joint readings radians, in the order of the joints, and is this the robot and the frame?",
                    crate::error::number((1e3 * typical).round())
                ),
            ));
        }
    }
}

/// Joints that hardly move from one fitted row to the next.
fn unmoved(input: &Calibration, joints: &[String], warnings: &mut Vec<Warning>) {
    /// rad or m
    const LITTLE: f64 = 0.02;
    for (k, name) in joints.iter().enumerate() {
        let all = || input.rows.iter().filter(|r| r.fit).map(|r| r.q[k]);
        let range = all().fold(f64::NEG_INFINITY, f64::max) - all().fold(f64::INFINITY, f64::min);
        if range < LITTLE {
            warnings.push(Warning::new(
                WarningKind::JointNotMoving,
                name.clone(),
                format!(
                    "it moves by {} between the fitted rows: its errors cannot be told from those of its neighbours. \
                     Record postures that differ",
                    crate::error::number(range)
                ),
            ));
        }
    }
}

fn row_results(
    model: &Model,
    x: &[f64],
    groups: &[Group],
    strays: &[usize],
    [before, after]: [&Errors; 2],
    covariance: Option<&Mat<f64>>,
) -> Vec<RowResult> {
    let input = model.input;
    let n = model.of_robot;
    let posed: Vec<Option<serial::Posed>> = (0..input.rows.len())
        .map(|i| model.posed(i, x).ok())
        .collect();
    let predicted = tool_stds(&posed, covariance, n);
    let each = |(i, r): (usize, &rows::Row)| {
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
fn tool_stds(posed: &[Option<serial::Posed>], covariance: Option<&Mat<f64>>, n: usize) -> Vec<f64> {
    let Some(c) = covariance else {
        return vec![f64::NAN; posed.len()];
    };
    let known: Vec<(usize, &serial::Posed)> = posed
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

fn group_results(groups: &[Group], rows: &[RowResult]) -> Vec<GroupResult> {
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

fn outliers(model: &Model, x: &[f64], strays: &[usize], after: &Errors) -> Vec<Outlier> {
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

fn distances(nominal: &Model, x0: &[f64], model: &Model, x: &[f64]) -> Vec<DistanceResult> {
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
