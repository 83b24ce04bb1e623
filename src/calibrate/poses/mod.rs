//! Postures for a calibration: reachable, inside the limits, free of collision, and such that the tool is known best
//! afterwards.
//!
//! With the whitened Jacobians `J_i` of candidate postures, the information `Λ = P⁻¹ + Σ J_iᵀ J_i` of those chosen and
//! `L` the Jacobian of what is predicted over the workspace,
//!
//! ```text
//! minimise   √(tr(L Λ⁻¹ Lᵀ) / K)                 standard deviation of the tool, over K postures of the workspace
//! ```
//!
//! One after another greedily, each from a random part of the candidates (Mirzasoleiman et al. 2015), then by
//! exchange, then by small steps of single postures. Last they are put in an order with a short way. For sockets
//! the rigid motions of all predictions together are taken out of `L`: no contact tells where the base stands. For
//! loops what is predicted is where the second arm's tool meets the first one.

pub(super) mod candidates;
mod criterion;
mod order;
pub mod page;
mod reach;
mod rehearse;
mod sight;

#[cfg(test)]
pub(super) use reach::{Wanted, reach};
pub use rehearse::{rehearse, toml};
pub use sight::Sight;

use super::file::{Calibration, Measurement, Tolerances};
use super::frame::Frame;
use super::kind::Kind;
use super::layout::Start;
use super::model::{Model, Settings};
use super::open::Opened;
use super::row::{Row, Value};
use crate::error::{Error, Result, Warning};
use candidates::{Candidate, Search};
use criterion::{Chosen, Problem};
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::path::PathBuf;

/// What is asked for.
#[derive(Debug, Clone)]
pub struct Request {
    /// number of postures
    pub count: usize,
    /// what will be measured
    pub kind: Kind,
    /// points to reach, base axes, m; for sockets
    pub points: Vec<Vector3<f64>>,
    /// how the second arm's frame sits in that of the first; for a loop
    pub grip: Option<Frame>,
    /// what the frame's origin must stay in, base axes, m: what the camera sees
    pub region: Option<[[f64; 2]; 3]>,
    /// a fixed camera that must see the target
    pub sight: Option<Sight>,
    /// noise of the measurement, m and rad
    pub std: [f64; 2],
    /// manufacturing tolerances
    pub tolerances: Tolerances,
    /// candidates
    pub candidates: usize,
    /// seed of all draws
    pub seed: u64,
}

/// Chosen postures.
#[derive(Debug)]
pub struct Poses {
    /// name of the robot
    pub robot: String,
    /// frame that is measured
    pub frame: String,
    /// joints
    pub joints: Vec<String>,
    /// names of the task coordinates of a parallel robot; empty for others
    pub task: Vec<String>,
    /// the postures in their order
    pub postures: Vec<Candidate>,
    /// predicted standard deviation of the tool, m
    pub predicted: f64,
    /// the same of as many random candidates, several draws, m
    pub random: Vec<f64>,
    /// before any measurement, m
    pub before: f64,
    /// with one posture, two, …, in the order they were chosen, m
    pub course: Vec<f64>,
    /// way through all of them, sum of the largest joint moves, rad or m, and in the order drawn
    pub way: [f64; 2],
    /// candidates that were found, of so many draws
    pub found: [usize; 2],
    /// the camera that sees them
    pub sight: Option<Sight>,
    /// what was imperfect
    pub warnings: Vec<Warning>,
}

/// Most candidates that reach a point or close a loop: each takes a search of its own.
const REACHING: usize = 1000;
/// Draws of random postures to compare with.
const DRAWS: usize = 20;
/// Postures over which the tool's uncertainty is averaged.
const WORKSPACE: usize = 150;

/// Chooses postures.
///
/// # Errors
/// Fewer candidates than postures: limits, region or points leave no room.
pub fn choose(opened: &Opened, request: &Request) -> Result<Poses> {
    if request.count < 3 {
        return Err(Error::Argument(format!(
            "--count {} is too few; a calibration takes 3 postures at least, 20 to 60 are usual",
            request.count
        )));
    }
    let mut rng = ChaCha8Rng::seed_from_u64(request.seed);
    let search = Search::new(opened, request)?;
    let wanted = match request.kind {
        Kind::Point | Kind::Loop => request.candidates.min(REACHING),
        _ => request.candidates,
    };
    let (found, draws) = search.draw(&mut rng, wanted.max(2 * request.count));
    if found.len() < request.count {
        return Err(Error::Infeasible(format!(
            "{}: of {draws} random postures {} are inside the limits, free of collision and where they are wanted or \
             seen; {} were asked for. Widen the region, the view or the limits, move the points or the camera, or ask for \
             fewer",
            opened.plant.name(),
            found.len(),
            request.count
        )));
    }
    let calibration = calibration(opened, request, &found);
    let nominal: Vec<Option<Frame>> = found.iter().map(|c| Some(c.frame)).collect();
    let start = start(request, calibration.measurements.len());
    let settings = Settings::default();
    let mut model = Model::new(
        &calibration,
        &opened.kin,
        Vec::new(),
        None,
        start,
        &nominal,
        settings,
    );
    model.consistent = true;
    let every = (found.len() / WORKSPACE).max(1);
    let view: Vec<usize> = (0..found.len()).step_by(every).collect();
    let mut problem = Problem::new(&model, &view, request.kind)?;
    let mut chosen: Chosen = problem.greedy(request.count, &mut rng);
    problem.exchange(&mut chosen, &mut rng);
    let course = problem.course(&chosen.rows);
    let random: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let rows = rand::seq::index::sample(&mut rng, found.len(), request.count);
            problem.value(&rows.into_vec())
        })
        .collect();
    let mut postures: Vec<Candidate> = chosen.rows.iter().map(|&i| found[i].clone()).collect();
    let predicted = refine(&search, &mut problem, &mut chosen, &mut postures, &mut rng);
    let drawn = order::way(&postures);
    order::shorten(&mut postures, search.rest());
    Ok(Poses {
        robot: opened.plant.name().to_string(),
        frame: opened.frame.clone(),
        joints: opened.joints.clone(),
        task: search.task_names(),
        way: [order::way(&postures), drawn],
        postures,
        predicted,
        random,
        before: problem.value(&[]),
        course,
        found: [found.len(), draws],
        sight: request.sight.clone(),
        warnings: search.warnings,
    })
}

/// Rounds of small steps, and the size of the first, as a fraction of the range of each joint.
const ROUNDS: usize = 4;
const STEP: f64 = 0.06;

/// Small random steps of single postures; those that make the tool better known stay.
fn refine(
    search: &Search,
    problem: &mut Problem,
    chosen: &mut Chosen,
    postures: &mut [Candidate],
    rng: &mut ChaCha8Rng,
) -> f64 {
    let mut step = STEP;
    for _ in 0..ROUNDS {
        #[allow(clippy::needless_range_loop)]
        for k in 0..postures.len() {
            let Some(near) = search.near(&postures[k], step, rng) else {
                continue;
            };
            if problem.replace(chosen, k, &near) {
                postures[k] = near;
            }
        }
        step *= 0.6;
    }
    problem.now(chosen)
}

/// A calibration whose rows are the candidates.
pub(super) fn calibration(opened: &Opened, request: &Request, found: &[Candidate]) -> Calibration {
    let files = request.points.len().max(1);
    let measurements = (0..files)
        .map(|k| Measurement {
            kind: request.kind,
            file: match request.kind {
                Kind::Point => format!("point{}", k + 1),
                kind => kind.name().to_string(),
            },
            group: format!("point{}", k + 1),
            std: request.std,
            instrument: "camera".into(),
            grip: None,
            base_at: None,
            target_at: None,
        })
        .collect();
    let row = |c: &Candidate| Row {
        measurement: c.point,
        line: 0,
        q: c.q.clone(),
        value: match request.kind {
            Kind::Pose => Value::Pose(c.frame),
            Kind::Position => Value::Position(c.frame.p),
            _ => Value::Contact,
        },
        covariance: None,
        approach: Vec::new(),
        fit: true,
    };
    Calibration {
        path: PathBuf::new(),
        robot: opened.plant.name().to_string(),
        frame: None,
        gravity: None,
        effects: None,
        other: None,
        measurements,
        distances: Vec::new(),
        rows: found.iter().map(row).collect(),
        prior: request.tolerances,
        noise_stated: true,
        warnings: Vec::new(),
    }
}

fn start(request: &Request, count: usize) -> Start {
    Start {
        socket: (0..count)
            .map(|k| request.points.get(k).copied().unwrap_or_default())
            .collect(),
        grip: vec![request.grip.unwrap_or(Frame::identity()); count],
        ..Start::none(count)
    }
}

impl Poses {
    /// `poses.csv`: joint readings, and for parallel robots the pose to be commanded.
    pub fn csv(&self) -> String {
        let q = (1..=self.joints.len()).map(|k| format!("q{k}"));
        let set = self.task.iter().map(|n| format!("set_{n}"));
        let mut out = q.chain(set).collect::<Vec<_>>().join(",") + "\n";
        for p in &self.postures {
            let cells = p.q.iter().chain(&p.x).map(f64::to_string);
            out += &(cells.collect::<Vec<_>>().join(",") + "\n");
        }
        out
    }

    /// Middle of the random draws, m.
    pub fn random_middle(&self) -> f64 {
        crate::median::median(self.random.iter().copied())
    }

    /// `report.json`.
    pub fn json(&self) -> serde_json::Value {
        let of = |k: usize| serde_json::json!(self.found[k]);
        serde_json::json!({
            "robot": self.robot,
            "frame": self.frame,
            "joints": self.joints,
            "postures": self.postures.len(),
            "tool_std": self.predicted,
            "tool_std_random": self.random_middle(),
            "tool_std_before": self.before,
            "course": self.course,
            "way": self.way[0],
            "way_unordered": self.way[1],
            "candidates": of(0),
            "draws": of(1),
            "sight": self.sight.as_ref().map(Sight::json),
            "warnings": self.warnings,
        })
    }
}
