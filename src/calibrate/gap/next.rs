//! Postures that tell two rivals apart.
//!
//! With the information of the rows at hand, the postures are chosen one after another that leave most of the first
//! effect when set-up, the other findings and the rival are free: `max ln det Λ_{e|s,r}`.

use super::catalogue::{self, Catalogue};
use super::conditions::Conditions;
use super::linear::Bed;
use super::verdict::Found;
use crate::calibrate::bend;
use crate::calibrate::effects::Gravity;
use crate::calibrate::frame::Frame;
use crate::calibrate::kin::Kin;
use crate::calibrate::kind::Kind;
use crate::calibrate::layout::{Layout, Start};
use crate::calibrate::model::Model;
use crate::calibrate::open::Opened;
use crate::calibrate::poses::{self, candidates};
use crate::error::Result;
use nalgebra::{DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Postures that are proposed.
const COUNT: usize = 12;
/// Postures to choose from.
const CANDIDATES: usize = 400;
/// Postures that bring less are not worth the way: the overlap must fall by this.
const WORTH: f64 = 0.02;

/// Postures that tell rivals apart.
#[derive(Debug, Clone)]
pub struct Next {
    /// the two effects
    pub separates: [String; 2],
    /// joint readings, and the side that each joint comes from where that matters
    pub postures: Vec<(Vec<f64>, Vec<f64>)>,
    /// share of the first that the second can imitate: now, and with them
    pub overlap: [f64; 2],
}

impl Next {
    /// `next.csv`.
    pub fn csv(&self) -> String {
        let n = self.postures.first().map_or(0, |p| p.0.len());
        let sides = self.postures.first().map_or(0, |p| p.1.len());
        let q = (1..=n).map(|k| format!("q{k}"));
        let s = (1..=sides).map(|k| format!("approach{k}"));
        let mut out = q.chain(s).collect::<Vec<_>>().join(",") + "\n";
        for (q, s) in &self.postures {
            let cells = q.iter().chain(s).map(f64::to_string);
            out += &(cells.collect::<Vec<_>>().join(",") + "\n");
        }
        out
    }
}

/// Information of `own` beside `rest`, whose prior has the inverse variances `precision`.
fn beside(
    gram: &DMatrix<f64>,
    own: &[usize],
    rest: &[usize],
    precision: &[f64],
) -> Option<DMatrix<f64>> {
    let pick =
        |a: &[usize], b: &[usize]| DMatrix::from_fn(a.len(), b.len(), |i, k| gram[(a[i], b[k])]);
    let mut inner = pick(rest, rest);
    for (k, c) in rest.iter().enumerate() {
        inner[(k, k)] += precision[*c];
    }
    let across = pick(rest, own);
    let carried = inner.cholesky()?.solve(&across);
    Some(pick(own, own) - across.tr_mul(&carried))
}

/// What the candidates would measure, as an addition to the information of the rows.
struct Wanted {
    own: Vec<usize>,
    rest: Vec<usize>,
    rival: Vec<usize>,
    precision: Vec<f64>,
    value: DVector<f64>,
}

impl Wanted {
    fn score(&self, gram: &DMatrix<f64>) -> f64 {
        let all: Vec<usize> = self.rest.iter().chain(&self.rival).copied().collect();
        let Some(mut m) = beside(gram, &self.own, &all, &self.precision) else {
            return f64::NEG_INFINITY;
        };
        for &mut d in m.diagonal().iter_mut() {
            if !d.is_finite() {
                return f64::NEG_INFINITY;
            }
        }
        m += DMatrix::identity(self.own.len(), self.own.len()) * 1e-3;
        m.cholesky().map_or(f64::NEG_INFINITY, |c| {
            c.l().diagonal().iter().map(|d| d.ln()).sum()
        })
    }

    /// Share of the first effect that the second can imitate.
    fn overlap(&self, gram: &DMatrix<f64>) -> f64 {
        let all: Vec<usize> = self.rest.iter().chain(&self.rival).copied().collect();
        let energy = |rest: &[usize]| {
            let m = beside(gram, &self.own, rest, &self.precision)?;
            Some(self.value.dot(&(m * &self.value)).max(0.0))
        };
        match (energy(&self.rest), energy(&all)) {
            (Some(a), Some(b)) if a > 0.0 => (1.0 - b / a).clamp(0.0, 1.0),
            _ => 1.0,
        }
    }
}

/// Postures for the first finding that has a rival; `None` where there is none, or where none helps.
///
/// # Errors
/// As choosing postures.
pub(super) fn next(
    opened: &Opened,
    bed: &Bed,
    found: &Found,
    gravity: Option<&Gravity>,
    seed: u64,
) -> Result<Option<Next>> {
    let index = |r: &(&'static str, String)| {
        let same = |p: &super::catalogue::Place| p.effect == r.0 && p.name == r.1;
        bed.places.iter().position(same)
    };
    let pair = found.findings.iter().find_map(|f| {
        let rival = f
            .rivals
            .iter()
            .filter(|r| r.0 != "base_pose")
            .find_map(index)?;
        (f.effect != "base_pose").then_some((f, rival))
    });
    let Some((finding, rival)) = pair else {
        return Ok(None);
    };
    let own = bed.places[finding.place].columns.clone();
    let (robot, count) = (bed.model.of_robot, bed.model.count());
    let mut precision = vec![1.0; count + bed.moved.len()];
    for (k, p) in precision.iter_mut().enumerate().take(count).skip(robot) {
        let u = &bed.model.unknowns[k];
        *p = (u.scale / u.prior).powi(2).max(1e-9);
    }
    let mut rest: Vec<usize> = (robot..count).collect();
    for (p, size) in found.set.iter().filter(|m| m.0 != finding.place) {
        for &c in &bed.places[*p].columns {
            precision[c] = 1.0 / (size * size);
            rest.push(c);
        }
    }
    let taken: Vec<usize> = rest.iter().chain(&own).copied().collect();
    let rival_columns: Vec<usize> = bed.places[rival]
        .columns
        .iter()
        .copied()
        .filter(|c| !taken.contains(c))
        .collect();
    for &c in &rival_columns {
        precision[c] = 1e-2;
    }
    let value = DVector::from_iterator(
        own.len(),
        finding
            .values
            .iter()
            .zip(&own)
            .map(|(v, &c)| v.value / bed.scale(c)),
    );
    let wanted = Wanted {
        own,
        rest,
        rival: rival_columns,
        precision,
        value,
    };
    let mut gram = bed.lines()?.gram;
    let now = wanted.overlap(&gram);
    let Some(pool) = pool(opened, bed, gravity, seed)? else {
        return Ok(None);
    };
    let mut chosen: Vec<usize> = Vec::new();
    while chosen.len() < COUNT {
        let scores: Vec<(f64, usize)> = (0..pool.postures.len())
            .into_par_iter()
            .filter(|i| !chosen.contains(i))
            .map(|i| (wanted.score(&(&gram + pool.add(i, &gram))), i))
            .collect();
        let best = scores
            .into_iter()
            .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
        let Some((_, i)) = best else { break };
        gram += pool.add(i, &gram);
        chosen.push(i);
    }
    let overlap = [now, wanted.overlap(&gram)];
    if chosen.is_empty() || overlap[0] - overlap[1] < WORTH {
        return Ok(None);
    }
    let approach = [finding.place, rival].iter().any(|p| {
        bed.places[*p]
            .columns
            .iter()
            .any(|&c| catalogue::by_approach(&bed.name(c).0))
    });
    let name = |effect: &str, place: &str| format!("{effect} ({place})");
    Ok(Some(Next {
        separates: [
            name(finding.effect, &bed.places[finding.place].name),
            name(bed.places[rival].effect, &bed.places[rival].name),
        ],
        postures: chosen
            .iter()
            .map(|&i| match approach {
                true => pool.postures[i].clone(),
                false => (pool.postures[i].0.clone(), Vec::new()),
            })
            .collect(),
        overlap,
    }))
}

/// Candidates with their columns, numbered as those of the rows.
struct Pool {
    postures: Vec<(Vec<f64>, Vec<f64>)>,
    lines: Vec<(Vec<usize>, DMatrix<f64>)>,
}

impl Pool {
    fn add(&self, i: usize, like: &DMatrix<f64>) -> DMatrix<f64> {
        let (columns, j) = &self.lines[i];
        let mut out = DMatrix::zeros(like.nrows(), like.ncols());
        let jtj = j.tr_mul(j);
        for (a, &ca) in columns.iter().enumerate() {
            for (b, &cb) in columns.iter().enumerate() {
                out[(ca, cb)] += jtj[(a, b)];
            }
        }
        out
    }
}

/// Postures that the robot can take, measured as the first measurement is.
fn pool(opened: &Opened, bed: &Bed, gravity: Option<&Gravity>, seed: u64) -> Result<Option<Pool>> {
    let input = bed.model.input;
    let measured = &input.measurements[0];
    if measured.kind.is_line() || measured.kind == Kind::Ball {
        // where the gauge would stand is not known; a ball leaves the turns open
        return Ok(None);
    }
    let points: Vec<usize> = match measured.kind {
        Kind::Point => (0..input.measurements.len())
            .filter(|&m| input.measurements[m].kind == Kind::Point)
            .collect(),
        _ => Vec::new(),
    };
    let request = poses::Request {
        count: COUNT,
        kind: measured.kind,
        points: points
            .iter()
            .map(|&m| bed.model.socket(m, &bed.x))
            .collect(),
        grip: (measured.kind == Kind::Loop).then(|| bed.model.grip(0, &bed.x).0),
        region: None,
        sight: None,
        std: measured.std,
        tolerances: input.prior,
        candidates: CANDIDATES,
        seed,
    };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let search = candidates::Search::new(opened, &request)?;
    let (found, _) = search.draw(&mut rng, CANDIDATES);
    if found.len() < COUNT {
        return Ok(None);
    }
    let calibration = poses::calibration(opened, &request, &found);
    let q: Vec<Vec<f64>> = found.iter().map(|c| c.q.clone()).collect();
    let side = |rng: &mut ChaCha8Rng| if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    let joints = opened.joints.len();
    let mut conditions = Conditions {
        torque: gravity.map(|g| g.torques(&q)),
        bends: gravity.and_then(|g| match &opened.kin {
            Kin::Arm(arm) => Some(bend::bends(g, &arm.names(), &q)),
            Kin::Parallel(_) => None,
        }),
        approach: (0..q.len())
            .map(|_| (0..joints).map(|_| side(&mut rng)).collect())
            .collect(),
        q,
        ..Conditions::default()
    };
    conditions.statics(opened);
    let tolerance = [input.prior.length, input.prior.angle];
    let catalogue = Catalogue::new(opened, &conditions, tolerance);
    let nominal: Vec<Option<Frame>> = found.iter().map(|c| Some(c.frame)).collect();
    let many = calibration.measurements.len();
    let start = Start {
        camera: vec![bed.model.camera(0, &bed.x); many],
        target: vec![bed.model.target(0, &bed.x); many],
        socket: request.points.clone(),
        grip: vec![bed.model.grip(0, &bed.x).0; many],
        ..Start::none(many)
    };
    let mut model = Model::new(
        &calibration,
        &opened.kin,
        catalogue.features.clone(),
        None,
        start,
        &nominal,
        bed.model.settings,
    );
    model.rates.clone_from(&catalogue.rates);
    model.noise = bed.model.noise;
    model.consistent = true;
    // columns of this model among those of the rows
    let place: Vec<Option<usize>> = (0..model.count())
        .map(|k| {
            let unknown = &model.unknowns[k];
            if k < model.of_robot {
                return bed.model.unknowns[..bed.model.of_robot]
                    .iter()
                    .position(|u| u.name == unknown.name);
            }
            let pairs = [
                (&model.layout.camera, &bed.model.layout.camera, 6),
                (&model.layout.target, &bed.model.layout.target, 6),
                (
                    &model.layout.contact,
                    &bed.model.layout.contact,
                    Layout::width(measured.kind),
                ),
            ];
            pairs.iter().find_map(|(here, there, width)| {
                (0..many).find_map(|m| {
                    let at = here[m].filter(|&c| (c..c + width).contains(&k))?;
                    let from = points.get(m).copied().unwrap_or(0);
                    Some(there[from]? + k - at)
                })
            })
        })
        .collect();
    let zeros = vec![0.0; model.count()];
    let line = |i: usize| {
        let b = model.block(i, &zeros)?;
        let kept: Vec<(usize, usize)> = b
            .columns
            .iter()
            .enumerate()
            .filter_map(|(k, &c)| Some((k, place[c]?)))
            .collect();
        let j = DMatrix::from_fn(b.r.len(), kept.len(), |r, k| {
            b.j[(r, kept[k].0)] * bed.scale(kept[k].1)
        });
        Some((kept.iter().map(|k| k.1).collect(), j))
    };
    let mut pool = Pool {
        postures: Vec::new(),
        lines: Vec::new(),
    };
    for (i, c) in found.iter().enumerate() {
        if let Some(own) = line(i) {
            pool.lines.push(own);
            pool.postures
                .push((c.q.clone(), conditions.approach[i].clone()));
        }
    }
    Ok(Some(pool))
}
