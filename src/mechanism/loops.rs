//! General closed chains: a tree whose frames are closed to loops, and actuated joints.
//!
//! With the tree coordinates `q` and the conditions `Φ(q) = 0` of the [closures](Closure), `m`
//! actuated joints are taken as the independent ones, `x = q_a`, and the others follow,
//!
//! ```text
//! Φ(q_a, q_p) = 0     Φ_q = ∂Φ/∂q = [Φ_a Φ_p]     q̇_p = −Φ_p⁺ Φ_a q̇_a
//! q̈_p = −Φ_p⁺ (Φ_a q̈_a + Φ_qq[q̇, q̇])           D = ∂q/∂q_a = [1; −Φ_p⁺ Φ_a]
//! ```
//!
//! (Khalil & Dombre 2002, ch. 7; rows may be redundant, as those of a planar loop closed in space
//! are.) Positions are found by Newton's method from the sample before; derivatives of
//! all orders follow from the closures by the theorem of implicit functions, exactly, with `Φ`
//! evaluated in numbers that carry their derivatives ([`scalar`](super::scalar)).
//!
//! The number of degrees of freedom is `m = n − rank Φ_q`. More actuators than degrees of freedom are allowed (their
//! forces are then those of least norm); fewer, or actuators that leave a freedom unheld, are
//! errors.

mod closure;
mod least_squares;
mod newton;
pub mod yaml;

pub use closure::{Closure, Coincide, Frame};

use super::parameters::{Group, Pattern};
use super::{Mechanism, Setup, Source, Task};
use crate::dynamics::Tree;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::robot::{Motion, Robot};
use closure::Chain;
use nalgebra::{DMatrix, DVector};

/// Singular values below this fraction of the largest count as zero in the rank of `Φ_q`: far above
/// the rounding of the angles of a URDF, far below those of a mechanism that can be built.
pub const RANK: f64 = 1e-5;
/// A loop that stays open by more than this fraction of the characteristic length is not closed.
const OPEN: f64 = 1e-4;

/// A tree with loops.
#[derive(Debug, Clone)]
pub struct Loops {
    /// the tree
    pub robot: Robot,
    /// the loops
    pub closures: Vec<Closure>,
    /// indices of the actuated coordinates, in the order of the columns of logs
    pub actuated: Vec<usize>,
    /// where all coordinates are looked for at home: actuated ones stay there if the loops close
    pub start: Vec<f64>,
    /// indices of the bodies that are unknown; all with inertia where there are none
    pub unknown: Vec<usize>,
    /// characteristic length, m; from the tree where it is not stated
    pub length: Option<f64>,
}

impl Loops {
    /// The mechanism.
    ///
    /// # Errors
    /// Loops that do not close (with the distance that is left), an actuator missing, actuators
    /// that do not hold all degrees of freedom, and what [`Mechanism::new`] finds.
    pub fn build(&self) -> Result<Mechanism> {
        let (setup, warnings) = self.setup()?;
        let mut mechanism = Mechanism::new(setup)?;
        mechanism.warnings.extend(warnings);
        Ok(mechanism)
    }

    /// What the mechanism is put together from, and what was imperfect.
    ///
    /// # Errors
    /// As [`Loops::build`].
    pub fn setup(&self) -> Result<(Setup, Vec<Warning>)> {
        let name = &self.robot.name;
        let bad = |why: String| Error::Infeasible(format!("{name}: {why}"));
        let n = self.robot.dof();
        if self.closures.is_empty() {
            return Err(bad("no loops: it is a tree; leave out `mechanism`".into()));
        }
        if self.start.len() != n || self.start.iter().any(|x| !x.is_finite()) {
            return Err(bad(format!("the start must be {n} finite positions")));
        }
        let mut seen = vec![false; n];
        for &a in &self.actuated {
            let Some(seen) = seen.get_mut(a) else {
                return Err(bad(format!("there is no coordinate {a} to be actuated")));
            };
            if std::mem::replace(seen, true) {
                let joint = &self.robot.joints[a].name;
                return Err(bad(format!("actuator `{joint}` is listed twice")));
            }
        }
        let chain = Chain::new(
            Tree::new(&self.robot),
            &self.robot,
            self.closures.clone(),
            self.length,
        );
        let mut warnings = Vec::new();
        let home = self.assemble(&chain).map_err(bad)?;
        let (open, which) = chain.open(&home);
        if open > 1e-9 * chain.length {
            warnings.push(Warning::new(
                WarningKind::LoopOpen,
                format!("loop {which}"),
                format!(
                    "it stays open by {open:.1e} m: its closure asks for more than the axes of \
                     the tree allow (rounded angles?); closed as well as it goes"
                ),
            ));
        }
        let j = chain.scaled(&chain.jacobian(&home));
        let rank = self.rank(&chain, &home);
        if rank == 0 {
            return Err(bad("the closures hold nothing: it is a tree".into()));
        }
        let m = n - rank;
        let na = self.actuated.len();
        if na < m {
            return Err(bad(format!(
                "an actuator is missing: {m} freedoms ({n} joints, closures of rank {rank}) but \
                 {na} actuated joints"
            )));
        }
        if m == 0 {
            return Err(bad(format!(
                "it cannot move: {n} joints, closures of rank {rank}"
            )));
        }
        let independent = self.independent(&j, m).map_err(bad)?;
        let groups = self.groups();
        let x: Vec<f64> = independent.iter().map(|&i| home[i]).collect();
        let length = chain.length;
        let geometry = newton::LoopGeometry::new(chain, independent, home, open);
        let setup = Setup {
            source: Source::Loops(self.closures.clone()),
            robot: self.robot.clone(),
            actuated: self.actuated.clone(),
            task: Task::Joints(m),
            geometry: Box::new(geometry),
            groups,
            home: x,
            length,
        };
        Ok((setup, warnings))
    }

    /// A closed configuration near the start: with the actuated joints where they are (with more
    /// actuators than degrees of freedom: as many as determine it) if that is possible, else the nearest.
    fn assemble(&self, chain: &Chain) -> Result<Vec<f64>, String> {
        let stated = self.actuated.iter().any(|&a| self.start[a] != 0.0);
        let mut first = String::new();
        for held in (0..=self.actuated.len()).rev() {
            let held = &self.actuated[..held];
            let free: Vec<usize> = (0..self.start.len())
                .filter(|i| !held.contains(i))
                .collect();
            match project(chain, &self.start, &free) {
                Ok(q) if first.is_empty() || !stated => return Ok(q),
                Ok(q) if held.len() + self.rank(chain, &q) >= q.len() => return Ok(q),
                Ok(_) => {
                    return Err(format!(
                        "the loops cannot be closed with the actuated joints where `home` and \
                         `start` put them: {first}"
                    ));
                }
                Err(why) if first.is_empty() => first = why,
                Err(_) => {}
            }
        }
        Err(format!(
            "the loops cannot be closed: {first}; check the frames, or state where the joints are \
             with start = {{ joint = position }}"
        ))
    }

    /// Rank of the closures: the largest of home and some configurations nearby, so that a home in
    /// a singularity is not taken for a further freedom.
    fn rank(&self, chain: &Chain, home: &[f64]) -> usize {
        let all: Vec<usize> = (0..home.len()).collect();
        let rank_at = |q: &[f64]| {
            let j = chain.scaled(&chain.jacobian(q));
            if j.iter().any(|x| !x.is_finite()) {
                return 0;
            }
            let sv = j.singular_values();
            let top = sv.max();
            sv.iter().filter(|s| **s > RANK * top).count()
        };
        let mut best = rank_at(home);
        for round in 1..4 {
            let near: Vec<f64> = home
                .iter()
                .enumerate()
                .map(|(i, q)| {
                    let size = match self.robot.joints[i].motion {
                        Motion::Revolute => 0.1,
                        Motion::Prismatic => 0.1 * chain.length,
                    };
                    q + size * ((i + 1) as f64 * 2.399_963 * f64::from(round)).sin()
                })
                .collect();
            if let Ok(q) = project(chain, &near, &all) {
                best = best.max(rank_at(&q));
            }
        }
        best
    }

    /// The first `m` actuated joints that determine the motion together.
    fn independent(&self, j: &DMatrix<f64>, m: usize) -> Result<Vec<usize>, String> {
        let n = j.ncols();
        if j.iter().any(|x| !x.is_finite()) {
            return Err(
                "the closures are not finite where the joints are; check start and frames".into(),
            );
        }
        // rows of zeros, so that the decomposition has all of the null space
        let mut padded = DMatrix::zeros(j.nrows().max(n), n);
        padded.view_mut((0, 0), j.shape()).copy_from(j);
        let Some(vt) = padded.svd(false, true).v_t else {
            return Err("the closures cannot be decomposed".into());
        };
        let free = vt.rows(n - m, m).transpose();
        let mut basis: Vec<DVector<f64>> = Vec::new();
        let mut chosen = Vec::new();
        let mut weakest = f64::INFINITY;
        for &a in &self.actuated {
            if chosen.len() == m {
                break;
            }
            let mut row: DVector<f64> = free.row(a).transpose();
            for b in &basis {
                row -= b * b.dot(&row);
            }
            let left = row.norm();
            if left > 1e-3 * free.norm() {
                basis.push(row / left);
                chosen.push(a);
            } else {
                weakest = weakest.min(left);
            }
        }
        if chosen.len() < m {
            return Err(format!(
                "an actuator is missing: the {} actuated joints hold {} of {m} freedoms only (what \
                 the others add: {weakest:.1e})",
                self.actuated.len(),
                chosen.len()
            ));
        }
        Ok(chosen)
    }

    fn groups(&self) -> Vec<Group> {
        let massive = |b: &usize| self.robot.bodies[*b].inertia.0 != [0.0; 10];
        let bodies: Vec<usize> = match self.unknown.is_empty() {
            true => (0..self.robot.bodies.len()).filter(massive).collect(),
            false => self.unknown.clone(),
        };
        bodies
            .into_iter()
            .map(|b| Group::one(&self.robot.bodies[b].name, b, Pattern::Full))
            .collect()
    }
}

/// Moves the coordinates `free` of a configuration to the nearest one with closed loops: damped
/// Gauss-Newton with steps of least norm.
fn project(chain: &Chain, start: &[f64], free: &[usize]) -> Result<Vec<f64>, String> {
    let mut q = start.to_vec();
    let mut r = chain.residual_of(&q);
    let steps = if free.is_empty() { 0 } else { 200 };
    for _ in 0..steps {
        let j = chain.jacobian(&q).select_columns(free);
        let top = j.norm();
        if !(top.is_finite() && r.iter().all(|x| x.is_finite())) {
            break;
        }
        let Ok(step) = j.svd(true, true).solve(&r, 1e-7 * top.max(1e-300)) else {
            break;
        };
        let size = step.amax();
        if !size.is_finite() || size < 1e-12 {
            break;
        }
        let mut fraction = (0.4 / size).min(1.0);
        let before = r.norm();
        let mut moved = false;
        while fraction > 1e-4 {
            let mut next = q.clone();
            for (k, &i) in free.iter().enumerate() {
                next[i] -= fraction * step[k];
            }
            let rn = chain.residual_of(&next);
            if rn.norm() < before || size * fraction < 1e-9 {
                (q, r, moved) = (next, rn, true);
                break;
            }
            fraction *= 0.5;
        }
        if !moved {
            break;
        }
    }
    let (open, which) = chain.open(&q);
    match open <= OPEN * chain.length {
        true => Ok(q),
        false => Err(format!(
            "loop {which} stays open by {open:.4} m at the closest that was found"
        )),
    }
}
