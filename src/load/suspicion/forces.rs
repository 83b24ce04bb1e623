//! Legs and signs: the forces of a log against what the same log would be if it were wired otherwise.
//!
//! Of a thinned record, the forces of the actuators are fitted with everything that the robot may be: rigid model, any body
//! on the platform, Coulomb and viscous friction of every drive, and a small constant. Then one thing is changed: the
//! force of one drive or of all turned round, those of two drives exchanged, or their positions, or both. A log that is
//! right fits best as it is stated. Where another reading leaves much less ([`BETTER`]) and the body is one that a robot
//! may have, that is what the log is; changes are collected until no further one helps.

use crate::dynamics::Samples;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::load::system::System;
use crate::plant::Plant;
use crate::regressor::sign;
use faer::Mat;
use faer::linalg::solvers::SolveLstsq;

/// Samples that are looked at.
const SAMPLES: usize = 240;
/// What another reading leaves, at most, of what the stated one leaves.
const BETTER: f64 = 0.7;
/// Above this share of the forces, a residual is worth a warning whatever the reading.
const MUCH: f64 = 0.3;
/// Changes that are collected at most.
const CHANGES: usize = 6;

/// A record, thinned, with everything that it may be fitted with.
pub(super) struct Probe<'a> {
    plant: &'a Plant,
    tool: usize,
    kept: &'a [usize],
    count: usize,
    /// forces of the actuators, actuator-major
    pub torque: Vec<f64>,
    /// the same with the chambers exchanged, where they come from pressures
    exchanged: Option<Vec<f64>>,
    /// motion of the actuators, and that of the coordinates
    moved: Samples,
    motion: Samples,
}

/// What a fit leaves.
pub(super) struct Left {
    /// share of the forces
    pub share: f64,
    /// share of the forces of every actuator
    drives: Vec<f64>,
    /// mass beside that of the robot file, kg; 0 where it does not act
    pub mass: f64,
}

/// Forces with one constant each, and columns of a motion.
struct Model {
    rigid: Vec<f64>,
    columns: Mat<f64>,
    moved: Samples,
}

/// One change of what is stated.
#[derive(Clone, Copy, PartialEq)]
enum Change {
    Turned(usize),
    AllTurned,
    Chambers(usize),
    AllChambers,
    Forces(usize, usize),
    Positions(usize, usize),
    Legs(usize, usize),
}

impl<'a> Probe<'a> {
    /// Of one record.
    pub fn new(plant: &'a Plant, tool: usize, system: &'a System, p: usize) -> Result<Self> {
        let part = &system.parts[p];
        let step = part.count.div_ceil(SAMPLES).max(1);
        let at: Vec<usize> = (0..part.count).step_by(step).collect();
        let count = at.len();
        let thin = |x: &[f64]| -> Vec<f64> {
            x.chunks_exact(part.count.max(1))
                .flat_map(|row| at.iter().map(move |&i| row[i]))
                .collect()
        };
        let motion = Samples {
            dof: part.motion.dof,
            count,
            q: thin(&part.motion.q),
            qd: thin(&part.motion.qd),
            qdd: thin(&part.motion.qdd),
        };
        Ok(Probe {
            plant,
            tool,
            kept: &system.base.kept,
            count,
            torque: thin(&part.torque),
            exchanged: part.exchanged.as_deref().map(thin),
            moved: plant.actuator_motion(&motion)?,
            motion,
        })
    }

    /// The model of a motion.
    fn model(&self, motion: &Samples, moved: &Samples) -> Result<Model> {
        Ok(Model {
            rigid: crate::load::system::rigid_torque(self.plant, motion, moved)?,
            columns: self.plant.body_columns(self.tool, motion)?,
            moved: moved.clone(),
        })
    }

    /// The fit as stated, of these forces.
    pub fn fit(&self, torque: &[f64]) -> Option<Left> {
        let model = self.model(&self.motion, &self.moved).ok()?;
        self.left(&model, torque)
    }

    /// What a model leaves of forces.
    fn left(&self, model: &Model, torque: &[f64]) -> Option<Left> {
        let (n, na, nk) = (self.count, self.moved.dof, self.kept.len());
        let width = nk + 3 * na;
        let size = |x: &[f64]| (x.iter().map(|v| v * v).sum::<f64>() / n.max(1) as f64).sqrt();
        let sizes: Vec<f64> = (0..na).map(|a| size(&torque[a * n..(a + 1) * n])).collect();
        let mean = sizes.iter().sum::<f64>() / na.max(1) as f64;
        if mean.is_nan() || mean <= 0.0 || n < 10 {
            return None;
        }
        let mut a = Mat::<f64>::zeros(na * n + width, width);
        let mut y = Mat::<f64>::zeros(na * n + width, 1);
        for r in 0..na * n {
            let (j, i) = (r / n, r % n);
            for (c, &k) in self.kept.iter().enumerate() {
                a[(r, c)] = model.columns[(r, k)];
            }
            let v = model.moved.qd[j * n + i];
            a[(r, nk + 3 * j)] = sign(v);
            a[(r, nk + 3 * j + 1)] = v;
            a[(r, nk + 3 * j + 2)] = 1.0;
            y[(r, 0)] = torque[r] - model.rigid[r];
        }
        for c in 0..width {
            // the constants count as much as a quarter of the samples
            a[(na * n + c, c)] = match c >= nk && (c - nk) % 3 == 2 {
                true => 0.5 * (n as f64).sqrt(),
                false => 1e-9 * a.col(c).norm_l2().max(1e-3),
            };
        }
        let x = a.qr().solve_lstsq(&y);
        let mut drives = Vec::with_capacity(na);
        let mut square = 0.0;
        for j in 0..na {
            let mut own = 0.0;
            for r in j * n..(j + 1) * n {
                let fit: f64 = (0..width).map(|c| a[(r, c)] * x[(c, 0)]).sum();
                own += (y[(r, 0)] - fit).powi(2);
            }
            square += own;
            drives.push((own / n as f64).sqrt() / sizes[j].max(1e-12));
        }
        let all: f64 = torque.iter().map(|t| t * t).sum();
        let mass = (self.kept.iter().position(|&k| k == 0)).map_or(0.0, |c| x[(c, 0)]);
        let share = (square / all).sqrt();
        share.is_finite().then_some(Left {
            share,
            drives,
            mass,
        })
    }

    /// Forces and positions after changes.
    fn changed(&self, changes: &[Change]) -> Option<(Vec<f64>, Model)> {
        let n = self.count;
        let mut torque = self.torque.clone();
        let mut moved = self.moved.clone();
        let swap = |x: &mut [f64], a: usize, b: usize| {
            for i in 0..n {
                x.swap(a * n + i, b * n + i);
            }
        };
        let mut other = false;
        for &change in changes {
            match change {
                Change::Turned(a) => torque[a * n..(a + 1) * n].iter_mut().for_each(|t| *t = -*t),
                Change::AllTurned => torque.iter_mut().for_each(|t| *t = -*t),
                Change::Chambers(a) => {
                    let rows = a * n..(a + 1) * n;
                    torque[rows.clone()].copy_from_slice(&self.exchanged.as_ref()?[rows]);
                }
                Change::AllChambers => torque.clone_from(self.exchanged.as_ref()?),
                Change::Forces(a, b) => swap(&mut torque, a, b),
                Change::Positions(a, b) | Change::Legs(a, b) => {
                    other = true;
                    for x in [&mut moved.q, &mut moved.qd, &mut moved.qdd] {
                        swap(x, a, b);
                    }
                    if matches!(change, Change::Legs(..)) {
                        swap(&mut torque, a, b);
                    }
                }
            }
        }
        let model = match other {
            false => self.model(&self.motion, &self.moved).ok()?,
            true => {
                let motion = self.plant.coordinate_motion(&moved, None).ok()?;
                let again = self.plant.actuator_motion(&motion).ok()?;
                self.model(&motion, &again).ok()?
            }
        };
        Some((torque, model))
    }
}

/// What several records leave, together.
fn share(probes: &[Probe], changes: &[Change], stated: f64) -> Option<(f64, Vec<f64>)> {
    let (mut square, mut drives) = (0.0, Vec::new());
    for probe in probes {
        let (torque, model) = probe.changed(changes)?;
        let left = probe.left(&model, &torque)?;
        // a body lighter than nothing is none
        if left.mass + stated < 0.0 && stated > 0.0 {
            return None;
        }
        square += left.share * left.share;
        if drives.is_empty() {
            drives = vec![0.0; left.drives.len()];
        }
        for (all, own) in drives.iter_mut().zip(&left.drives) {
            *all = f64::max(*all, *own);
        }
    }
    Some(((square / probes.len().max(1) as f64).sqrt(), drives))
}

/// Compares the log with other readings of it.
///
/// # Errors
/// A reading that fits where the stated one does not, with both residuals.
pub fn check(plant: &Plant, tool: usize, system: &System) -> Result<Vec<Warning>> {
    let na = system.actuators;
    let probes = (0..system.parts.len())
        .map(|p| Probe::new(plant, tool, system, p))
        .collect::<Result<Vec<_>>>()?;
    if na < 2 || probes.iter().any(|p| p.count < 20) {
        return Ok(Vec::new());
    }
    let stated = plant.robot().bodies[tool].inertia.mass();
    let as_is = share(&probes, &[], 0.0);
    let Some((before, drives)) = as_is else {
        return Ok(Vec::new());
    };
    let possible = share(&probes, &[], stated).is_some();
    // forces from pressures have the sign that the chambers give them
    let mut all: Vec<Change> = match probes.iter().all(|p| p.exchanged.is_some()) {
        true => (0..na)
            .map(Change::Chambers)
            .chain([Change::AllChambers])
            .collect(),
        false => (0..na)
            .map(Change::Turned)
            .chain([Change::AllTurned])
            .collect(),
    };
    for a in 0..na {
        for b in a + 1..na {
            all.extend([
                Change::Forces(a, b),
                Change::Positions(a, b),
                Change::Legs(a, b),
            ]);
        }
    }
    let mut taken: Vec<Change> = Vec::new();
    // a body that is lighter than nothing fits nothing
    let mut best = if possible { before } else { f64::INFINITY };
    for _ in 0..CHANGES {
        use rayon::prelude::*;
        let found = all
            .par_iter()
            .filter(|c| !taken.contains(c))
            .filter_map(|c| {
                let mut with = taken.clone();
                with.push(*c);
                Some((share(&probes, &with, stated)?.0, *c))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match found {
            Some((left, change)) if left < BETTER * best => {
                best = left;
                taken.push(change);
            }
            _ => break,
        }
    }
    let joints = plant.actuators();
    if !taken.is_empty() && best < BETTER * before.max(MUCH) {
        let drives: Vec<&str> = joints.iter().map(|j| j.name.as_str()).collect();
        let words: Vec<String> = taken.iter().map(|c| said(*c, &drives)).collect();
        let names: Vec<&str> = system.parts.iter().map(|p| p.name.as_str()).collect();
        return Err(Error::Infeasible(format!(
            "{}: forces and motion do not fit the robot as the log is stated ({:.1} % of the forces are left{}), and they do \
             with {} ({:.1} %): correct the columns or the robot file; --unchecked goes on all the same",
            names.join(", "),
            100.0 * before,
            if possible {
                ""
            } else {
                ", by a body of negative mass"
            },
            words.join(", and "),
            100.0 * best
        )));
    }
    if before > MUCH {
        let worst = (0..na)
            .max_by(|a, b| drives[*a].total_cmp(&drives[*b]))
            .unwrap_or(0);
        return Ok(vec![Warning::new(
            WarningKind::LogSuspect,
            joints[worst].name.clone(),
            format!(
                "{:.0} % of the forces are left by any body on the platform and any friction, most of this drive ({:.0} %): \
                 the log is not of this robot, or its columns, units or geometry are not what they are stated to be; do not \
                 believe the load",
                100.0 * before,
                100.0 * drives[worst]
            ),
        )]);
    }
    Ok(Vec::new())
}

/// A change in words.
fn said(change: Change, names: &[&str]) -> String {
    match change {
        Change::Turned(a) => format!("the sign of the force of {} turned", names[a]),
        Change::AllTurned => "the signs of all forces turned".into(),
        Change::Chambers(a) => format!("chambers a and b of {} exchanged", names[a]),
        Change::AllChambers => "chambers a and b of all drives exchanged".into(),
        Change::Forces(a, b) => {
            format!("the forces of {} and {} exchanged", names[a], names[b])
        }
        Change::Positions(a, b) => {
            format!("the positions of {} and {} exchanged", names[a], names[b])
        }
        Change::Legs(a, b) => format!(
            "{} and {} exchanged, positions and forces alike",
            names[a], names[b]
        ),
    }
}
