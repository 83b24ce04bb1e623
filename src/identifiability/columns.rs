//! The columns that are estimated along a motion, over the noise of the drives.
//!
//! Bodies that are asked for, Coulomb and viscous friction of every drive, and its constant. Where the robot file states
//! breakaway friction `F exp(−(q̇/v_s)²) sign(q̇)` of a drive, its slopes by `F` and `v_s` at the values of the file are
//! columns, too: it is linear in `F` and not in `v_s`.

use crate::dynamics::Samples;
use crate::error::Result;
use crate::plant::Plant;
use crate::regressor::term_factor;
use crate::robot::{JointTerm, Stribeck};
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef, Side};

/// What keeps the information matrix regular where a column does not act, of its diagonal of ones.
const RIDGE: f64 = 1e-12;
/// Variance, of what the column would have alone, from which a column is not told from the others.
const LOST: f64 = 1e10;

/// What a column of a drive stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    /// a joint term
    Term(JointTerm),
    /// force of its breakaway friction
    Force,
    /// speed at which that has fallen to `1/e`
    Speed,
}

/// Slopes of the breakaway friction that a robot file states, or that `identify` is to estimate.
pub(super) fn breakaway(plant: &Plant, speeds: bool) -> Vec<(usize, Kind, Stribeck)> {
    let joints = plant.actuators();
    let all = joints.iter().enumerate().map(|(a, j)| (a, j.stribeck));
    let stated = all.filter(|(_, s)| s.fit || s.force != 0.0);
    stated
        .flat_map(|(a, s)| {
            let speed = speeds && s.force != 0.0;
            let force = Some((a, Kind::Force, s));
            force
                .into_iter()
                .chain(speed.then_some((a, Kind::Speed, s)))
        })
        .collect()
}

/// Slope of the breakaway friction by its force or its speed.
pub(super) fn slope(kind: Kind, s: Stribeck, velocity: f64) -> f64 {
    let [force, speed] = s.slopes(velocity);
    match kind {
        Kind::Speed => speed,
        _ => force,
    }
}

/// Columns along one period, over the noise of the drives.
pub(super) struct Columns {
    /// bodies first, then [`Columns::drives`]
    pub rows: Mat<f64>,
    /// columns of the bodies
    pub bodies: usize,
    /// drive and meaning of each further column; the constants are the last
    pub drives: Vec<(usize, Kind)>,
    /// drives
    pub actuators: usize,
    /// samples of each drive
    pub count: usize,
}

impl Columns {
    /// Of these columns of bodies, whose rows are those of the drives one after another. `speeds`: whether the speed of
    /// breakaway friction counts.
    pub fn new(
        plant: &Plant,
        bodies: MatRef<'_, f64>,
        motion: &Samples,
        speeds: bool,
    ) -> Result<Self> {
        let moved = plant.actuator_motion(motion)?;
        let noise = plant.torque_noise().0;
        let (na, count, n) = (noise.len(), motion.count, bodies.ncols());
        let steady: [JointTerm; 2] = [JointTerm::Coulomb, JointTerm::Viscous];
        let mut drives: Vec<(usize, Kind)> = steady
            .into_iter()
            .flat_map(|t| (0..na).map(move |a| (a, Kind::Term(t))))
            .collect();
        let peaks = breakaway(plant, speeds);
        drives.extend(peaks.iter().map(|(a, kind, _)| (*a, *kind)));
        drives.extend((0..na).map(|a| (a, Kind::Term(JointTerm::Offset))));
        let own: Vec<Stribeck> = plant.actuators().iter().map(|j| j.stribeck).collect();
        let rows = Mat::from_fn(na * count, n + drives.len(), |r, c| {
            let (a, s) = (r / count, r % count);
            let value = match c.checked_sub(n) {
                None => bodies[(r, c)],
                Some(d) if drives[d].0 != a => 0.0,
                Some(d) => match drives[d].1 {
                    Kind::Term(term) => term_factor(term, moved.at(a, s)),
                    kind => slope(kind, own[a], moved.at(a, s)[1]),
                },
            };
            value / noise[a]
        });
        Ok(Columns {
            rows,
            bodies: n,
            drives,
            actuators: na,
            count,
        })
    }

    /// Covariance of all columns from so many periods, with or without constants of the drives among the unknowns. Infinite
    /// on the diagonal where the motion does not tell a column from the others, `None` where it tells none.
    pub fn covariance(&self, constants: bool, periods: f64) -> Option<Mat<f64>> {
        let n = self.rows.ncols() - if constants { 0 } else { self.actuators };
        let rows = self.rows.subcols(0, n);
        let information = rows.transpose() * rows;
        let scale: Vec<f64> = (0..n)
            .map(|k| match information[(k, k)] {
                d if d > 0.0 => 1.0 / d.sqrt(),
                _ => 1.0,
            })
            .collect();
        let unit = Mat::from_fn(n, n, |i, j| {
            information[(i, j)] * scale[i] * scale[j] + if i == j { RIDGE } else { 0.0 }
        });
        let factor = unit.llt(Side::Lower).ok()?;
        let inverse = factor.solve(Mat::<f64>::identity(n, n));
        let lost = |k: usize| information[(k, k)] <= 0.0 || inverse[(k, k)] > LOST;
        Some(Mat::from_fn(n, n, |i, j| match i == j && lost(i) {
            true => f64::INFINITY,
            false => inverse[(i, j)] * scale[i] * scale[j] / periods,
        }))
    }
}

/// Rows, over the noise of the drives, without what the breakaway friction that `identify` estimates can take from them.
pub(super) fn beside_breakaway(
    plant: &Plant,
    motion: &Samples,
    rows: Mat<f64>,
) -> Result<Mat<f64>> {
    let mut peaks = breakaway(plant, true);
    peaks.retain(|(_, _, s)| s.fit);
    if peaks.is_empty() {
        return Ok(rows);
    }
    let moved = plant.actuator_motion(motion)?;
    let count = motion.count;
    let columns = Mat::from_fn(rows.nrows(), peaks.len(), |r, c| {
        let (a, kind, s) = peaks[c];
        match r / count == a {
            true => slope(kind, s, moved.qd[r]),
            false => 0.0,
        }
    });
    // columns of unit length; those that do not act take nothing
    let acting: Vec<usize> = (0..peaks.len())
        .filter(|&c| columns.col(c).norm_l2() > 0.0)
        .collect();
    let unit = Mat::from_fn(rows.nrows(), acting.len(), |r, c| {
        let c = acting[c];
        columns[(r, c)] / columns.col(c).norm_l2()
    });
    let q = unit.qr().compute_thin_Q();
    Ok(&rows - &q * (q.transpose() * &rows))
}
