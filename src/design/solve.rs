//! Sequential convex programming from one start.
//!
//! At a feasible `x` the criterion is modelled, the limits are rows that hold exactly or to second
//! order, limits along the path are linearised, and clarabel solves the conic program in the scaled step
//! `z_k = δ_k / s_k`
//!
//! ```text
//! minimise   gᵀz + ½(a − b) + ½ zᵀ(B + μ 1) z
//! subject to a 1 ⪰ U_0 + Σ z_k U_k,   L_0 + Σ z_k L_k ⪰ b 1,
//!            limits(x + δ),   h + ∂h δ ≤ 1
//! ```
//!
//! in two phases. First the extreme eigenvalues are smoothed by p-norms, `g` is their exact
//! gradient and `B` a damped BFGS matrix (Powell 1978): this travels far. Then `g = 0`, `B = 0`
//! and the groups of extreme eigenvalues stand as linear matrix inequalities, exact to first order
//! where eigenvalues meet (see [`criterion`](super::criterion)): this settles the rest. Smooth
//! criteria (D, A) need the first phase only.
//!
//! `μ` is the trust region: it falls when the model predicts well and rises when it does not. A
//! step that leaves a limit between the rows gets that instant as another row and is solved again;
//! what excess is left, of second order, is taken away by shrinking
//! ([`Limits::pull_inside`]). Every iterate is feasible, so the best one can be returned at any
//! moment.

use super::criterion::{Cluster, Criterion, Model, Objective};
use super::information::{Evaluation, Information};
use super::limits::{ExtremaWork, Limits, Rows};
use super::path::{PathLimits, PathMemory, PathRow};
use crate::conic::{Problem, Settings as ConicSettings};
use crate::dot::dot;
use crate::error::Result;
use faer::Mat;
use std::time::Instant;

/// One start's problem: all parts are shared between threads.
pub struct Task<'a> {
    /// information matrix and derivatives
    pub info: &'a Information<'a>,
    /// what is minimised
    pub objective: &'a Objective,
    /// joint limits
    pub limits: &'a Limits,
    /// limits along the path: torques, actuators of closed chains
    pub path: Option<&'a dyn PathLimits>,
    /// size of a unit step of each joint in `x`
    pub scale: &'a [f64],
    /// when a conic solve is broken off
    pub deadline: Option<Instant>,
}

/// How a phase models the criterion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Phase {
    /// extreme eigenvalues smoothed by p-norms
    Smooth(f64),
    /// groups of extreme eigenvalues as matrix inequalities
    Exact,
}

/// A start on its way.
#[derive(Debug, Clone)]
pub struct Iterate {
    /// free numbers of the best feasible trajectory
    pub x: Vec<f64>,
    /// its true criterion (logarithmic)
    pub value: f64,
    /// true criterion after each iteration
    pub history: Vec<f64>,
    /// BFGS matrix in scaled coordinates, carried from phase to phase
    hessian: Option<Mat<f64>>,
    /// weight of the squared step
    damping: f64,
}

/// When a phase ends.
#[derive(Debug, Clone, Copy)]
pub struct Stop {
    /// most iterations
    pub iterations: usize,
    /// ends when eight iterations together gained less than this (logarithmic)
    pub gain: f64,
}

/// Damping at the start, and the largest before a phase gives up.
const DAMPING: (f64, f64) = (2.0, 1e7);
/// Rows are kept for instants that use more than this of a limit.
const NEAR: f64 = 0.55;
/// Rounds in which a subproblem may be given more rows.
const ROUNDS: usize = 3;

impl Iterate {
    /// At a feasible `x`.
    pub fn new(task: &Task, x: Vec<f64>) -> Self {
        let value = task
            .objective
            .evaluate(task.info, &x, &mut Evaluation::default());
        Iterate {
            x,
            value,
            history: vec![value],
            hessian: None,
            damping: DAMPING.0,
        }
    }

    /// Runs one phase until it converges (then returns true), or until `halt` says so.
    ///
    /// # Errors
    /// Only when numbers are not finite.
    pub fn run(
        &mut self,
        task: &Task,
        phase: Phase,
        stop: Stop,
        halt: &(dyn Fn() -> bool + Sync),
    ) -> Result<bool> {
        let phase = match task.objective.criterion {
            Criterion::D | Criterion::A | Criterion::Known if phase == Phase::Exact => {
                return Ok(true);
            }
            _ => phase,
        };
        let mut state = State::new(task);
        let mut here = state.visit(task, phase, &self.x)?;
        let mut merits = vec![here.merit];
        self.damping = self.damping.min(DAMPING.0);
        for _ in 0..stop.iterations {
            if halt() {
                return Ok(false);
            }
            let matrix = (phase != Phase::Exact)
                .then_some(self.hessian.as_ref())
                .flatten();
            let Some(step) = state.step(task, &here, matrix, self.damping, &self.x)? else {
                self.damping *= 10.0;
                if self.damping > DAMPING.1 {
                    return Ok(true);
                }
                continue;
            };
            let there = match step.fits {
                true => Some(state.visit(task, phase, &step.x)?),
                false => None,
            };
            let decrease = there
                .as_ref()
                .map_or(f64::NEG_INFINITY, |t| here.merit - t.merit);
            let ratio = decrease / step.predicted.max(1e-300);
            if ratio < 0.1 {
                self.damping = (self.damping * 4.0).max(1e-3);
            } else if ratio > 0.6 {
                self.damping *= 0.4;
            }
            if let (Some(there), Phase::Smooth(_)) = (&there, phase)
                && there.merit.is_finite()
            {
                let z = task.scaled(&step.x, &self.x);
                let y: Vec<f64> = there
                    .model
                    .gradient
                    .iter()
                    .zip(&here.model.gradient)
                    .map(|(a, b)| a - b)
                    .collect();
                bfgs(&mut self.hessian, &z, &y);
            }
            if let Some(there) = there
                && decrease > 0.0
            {
                self.x = step.x;
                if there.value < self.value || phase != Phase::Exact {
                    self.value = there.value;
                }
                here = there;
            }
            self.history.push(self.value);
            merits.push(here.merit);
            let n = merits.len();
            let settled = n > 8 && merits[n - 9] - here.merit < stop.gain;
            if settled || step.predicted < 1e-8 || self.damping > DAMPING.1 {
                return Ok(true);
            }
        }
        Ok(true)
    }
}

impl Task<'_> {
    /// Settings of a conic solve, which ends at the deadline.
    pub(super) fn conic(&self) -> ConicSettings {
        let mut settings = ConicSettings::fast();
        if let Some(deadline) = self.deadline {
            let left = deadline.saturating_duration_since(Instant::now());
            settings.time_limit = left.as_secs_f64().max(1e-3);
        }
        settings
    }

    /// Free numbers a joint.
    fn free(&self) -> usize {
        self.info.len() / self.scale.len()
    }

    /// `(a − b) / s`, component by component.
    fn scaled(&self, a: &[f64], b: &[f64]) -> Vec<f64> {
        let m = self.free();
        a.iter()
            .zip(b)
            .enumerate()
            .map(|(k, (a, b))| (a - b) / self.scale[k / m])
            .collect()
    }
}

/// A visited point: merit, true value and model (gradients in scaled coordinates).
struct Point {
    merit: f64,
    value: f64,
    model: Model,
    path_rows: Vec<PathRow>,
}

/// A step of the subproblem.
struct Step {
    x: Vec<f64>,
    predicted: f64,
    /// whether the limits along the path hold
    fits: bool,
}

/// Memory of one start.
struct State {
    evaluation: Evaluation,
    work: ExtremaWork,
    path: PathMemory,
    problem: Problem,
}

impl State {
    fn new(task: &Task) -> Self {
        State {
            evaluation: Evaluation::default(),
            work: ExtremaWork::default(),
            path: PathMemory::default(),
            problem: Problem::new(task.info.len() + 2),
        }
    }

    /// Evaluates the criterion and its model.
    fn visit(&mut self, task: &Task, phase: Phase, x: &[f64]) -> Result<Point> {
        let e = &mut self.evaluation;
        task.info.evaluate(x, e);
        let spectrum = task.objective.spectrum(&e.gram)?;
        let value = task.objective.value(&spectrum);
        let (merit, mut model) = match phase {
            Phase::Smooth(p) => {
                let merit = task.objective.smooth_value(&spectrum, p);
                let gradient = task.objective.smooth_gradient(task.info, e, &spectrum, p);
                (
                    merit,
                    Model {
                        value: merit,
                        gradient,
                        upper: None,
                        lower: None,
                    },
                )
            }
            Phase::Exact => (value, task.objective.model(task.info, e, &spectrum)),
        };
        let m = task.free();
        let scale = |g: &mut Vec<f64>| {
            g.iter_mut()
                .enumerate()
                .for_each(|(k, g)| *g *= task.scale[k / m]);
        };
        scale(&mut model.gradient);
        for c in [&mut model.upper, &mut model.lower].into_iter().flatten() {
            c.gradients.iter_mut().for_each(scale);
        }
        let path_rows = match task.path {
            Some(limits) => limits.rows(task.info, x, e, 0.8),
            None => Vec::new(),
        };
        Ok(Point {
            merit,
            value,
            model,
            path_rows,
        })
    }

    /// Solves the subproblem at a point: the new trajectory, inside all joint limits, and the
    /// predicted decrease; nothing where the solver found none.
    fn step(
        &mut self,
        task: &Task,
        here: &Point,
        hessian: Option<&Mat<f64>>,
        damping: f64,
        x: &[f64],
    ) -> Result<Option<Step>> {
        let (n, m) = (x.len(), task.free());
        let mut rows = task.limits.rows(x, NEAR, &mut self.work);
        let mut path_rows = here.path_rows.clone();
        for round in 1.. {
            self.fill(task, here, hessian, damping, (&rows, &path_rows));
            let solution = self.problem.solve(&task.conic())?;
            if !solution.status.is_solved() {
                return Ok(None);
            }
            let mut next: Vec<f64> = (0..n)
                .map(|k| x[k] + solution.x[k] * task.scale[k / m])
                .collect();
            if round < ROUNDS {
                let before = rows.len();
                task.limits.cut(x, &next, &mut rows, &mut self.work);
                let mut more = match task.path {
                    Some(path) if round == 1 => path.cuts(task.info, x, &next),
                    _ => Vec::new(),
                };
                let missed = !more.is_empty();
                path_rows.append(&mut more);
                if rows.len() > before || missed {
                    continue;
                }
            }
            task.limits.pull_inside(&mut next, &mut self.work);
            let free =
                f64::from(here.model.lower.is_some()) - f64::from(here.model.upper.is_some());
            let predicted = -(solution.objective + 0.5 * free);
            let fits = self.fit_path(task, x, &mut next);
            return Ok(Some(Step {
                x: next,
                predicted,
                fits,
            }));
        }
        Ok(None)
    }

    /// Writes the conic program.
    fn fill(
        &mut self,
        task: &Task,
        here: &Point,
        hessian: Option<&Mat<f64>>,
        damping: f64,
        (rows, path_rows): (&Rows, &[PathRow]),
    ) {
        let (n, m) = (task.info.len(), task.free());
        let p = &mut self.problem;
        p.clear();
        for k in 0..n {
            p.linear(k, here.model.gradient[k]);
            p.quadratic(k, k, damping);
        }
        if let Some(b) = hessian {
            for j in 0..n {
                (0..=j).for_each(|i| p.quadratic(i, j, b[(i, j)]));
            }
        }
        // a 1 − U ⪰ 0 with ½a minimised, L − b 1 ⪰ 0 with ½b maximised
        for (slot, cluster, sign) in [
            (n, &here.model.upper, -1.0),
            (n + 1, &here.model.lower, 1.0),
        ] {
            match cluster {
                Some(c) => matrix_inequality(p, c, n, slot, sign),
                None => {
                    p.equality([(slot, 1.0)], 0.0);
                }
            }
        }
        rows.write(p, m, task.scale);
        for row in path_rows {
            let scaled = row.gradient.iter().enumerate();
            p.inequality(scaled.map(|(k, g)| (k, g * task.scale[k / m])), row.slack);
        }
    }

    /// Goes back along the step until the limits along the path hold; false if they do not.
    fn fit_path(&mut self, task: &Task, x: &[f64], next: &mut [f64]) -> bool {
        let Some(limits) = task.path else {
            return true;
        };
        for _ in 0..10 {
            let motion = &mut self.evaluation.motion;
            task.info.sample(next, motion);
            if limits.used(task.info, next, motion, &mut self.path) <= 1.0 {
                return true;
            }
            next.iter_mut()
                .zip(x)
                .for_each(|(n, x)| *n = x + 0.6 * (*n - x));
        }
        false
    }
}

/// The linear matrix inequality of a cluster, `sign (A_0 + Σ z_k A_k − slot 1) ⪰ 0`, and its bound
/// in the objective.
fn matrix_inequality(problem: &mut Problem, cluster: &Cluster, n: usize, slot: usize, sign: f64) {
    let s = cluster.values.len();
    let a0 = Mat::from_fn(s, s, |i, j| {
        if i == j {
            sign * cluster.values[i]
        } else {
            0.0
        }
    });
    let pair = |i: usize, j: usize| {
        let (i, j) = (i.min(j), i.max(j));
        &cluster.gradients[j * (j + 1) / 2 + i]
    };
    let terms: Vec<Mat<f64>> = (0..n)
        .map(|k| Mat::from_fn(s, s, |i, j| sign * pair(i, j)[k]))
        .collect();
    let identity = Mat::from_fn(s, s, |i, j| if i == j { -sign } else { 0.0 });
    let mut list: Vec<_> = terms
        .iter()
        .enumerate()
        .map(|(k, a)| (k, a.as_ref()))
        .collect();
    list.push((slot, identity.as_ref()));
    problem.semidefinite(a0.as_ref(), &list);
    problem.linear(slot, -0.5 * sign);
}

/// Damped BFGS update (Powell 1978; Nocedal & Wright 2006, procedure 18.2): keeps the matrix
/// positive definite whatever the curvature.
fn bfgs(hessian: &mut Option<Mat<f64>>, z: &[f64], y: &[f64]) {
    let n = z.len();
    let (zz, zy, yy) = (dot(z, z), dot(z, y), dot(y, y));
    if zz < 1e-18 || !yy.is_finite() {
        return;
    }
    let b = hessian.get_or_insert_with(|| {
        let size = if zy > 0.0 {
            (yy / zy).clamp(1e-3, 1e3)
        } else {
            (yy / zz).sqrt()
        };
        Mat::from_fn(n, n, |i, j| if i == j { size } else { 0.0 })
    });
    let bz: Vec<f64> = (0..n)
        .map(|i| (0..n).map(|j| b[(j, i)] * z[j]).sum())
        .collect();
    let zbz = dot(z, &bz);
    let theta = if zy >= 0.2 * zbz {
        1.0
    } else {
        0.8 * zbz / (zbz - zy)
    };
    let r: Vec<f64> = (0..n)
        .map(|k| theta * y[k] + (1.0 - theta) * bz[k])
        .collect();
    let zr = dot(z, &r);
    if !(zr > 0.0 && zbz > 0.0) {
        return;
    }
    for j in 0..n {
        for i in 0..n {
            b[(i, j)] += r[i] * r[j] / zr - bz[i] * bz[j] / zbz;
        }
    }
}
