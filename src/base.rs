//! Base parameters: what a robot can tell about its standard parameters at all.
//!
//! The `p` columns of the regressor are linearly dependent. With the columns permuted into kept
//! ones `W_b` (`b` of them, independent) and dropped ones `W_d = W_b K`,
//!
//! ```text
//! τ = W φ = W_b (φ_b + K φ_d) = W_b π_b
//! ```
//!
//! so exactly the `b` combinations `π_b` can be identified (Gautier 1991; Mayeda, Yoshida & Osuka
//! 1990). `W` is evaluated at random states.
//!
//! **The rank** `b` is counted on the singular values of `W` as it is, in kg, m and rad. Columns
//! scaled to unit length would hide the border: a column that is almost nothing becomes as large
//! as the others. The geometry is the one that the file means, without the rounding of its digits
//! (the file `robot/meant.rs`), and the states are inside the limits of position and equally
//! fast for all joints, so that no limit decides. What is left is a plain gap: values that count
//! may fall smoothly to 1e-7 of the largest (fingers that follow one motor), the others are
//! rounding of the arithmetic, 1e-15. The border is the first gap of a factor [`CLEAR`] that ends
//! below [`NEGLIGIBLE`] of the largest. Both sides of it are kept
//! ([`singular_value_above`](BaseParameters::singular_value_above) and
//! [`singular_value_below`](BaseParameters::singular_value_below)).
//!
//! **Which columns are kept.** Norms of dependent columns tie exactly (`Ixx` and `-Iyy` of a link
//! that turns about `z`, a mass and the first moments of its parent, …), so a pivoted QR would
//! let rounding choose, differently on another machine or for another seed. Ties are broken
//! towards the base: columns are taken in the order of [`Robot::columns`] (links from the base
//! outwards, joint terms last) and kept when they do not depend on those already kept. The same
//! robot gives the same base parameters everywhere, and every dropped parameter is grouped with
//! parameters nearer to the base, as in the grouping formulas of Khalil & Dombre (2002, ch. 9).
//!
//! The legs of a closed chain all feel the same platform, and the first columns that are independent
//! are nearly dependent: there the columns are gone through several times, and those that leave a
//! larger part of themselves unexplained are kept first. The order decides within a factor of two.

use crate::dynamics::{Samples, Tree};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::regressor::Regressor;
use crate::robot::{Column, JointTerm, Motion, Robot};
use faer::{Mat, MatRef};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Factor between two neighbouring singular values that makes a border of the rank.
#[doc(hidden)]
pub const CLEAR: f64 = 1e3;

/// Largest singular value below the border, relative to the largest of all: what is more is never
/// dropped at the first gap.
#[doc(hidden)]
pub const NEGLIGIBLE: f64 = 1e-6;

/// Rounding of the arithmetic, relative to the largest singular value.
const ROUNDING: f64 = 1e-15;

/// Residual of a unit column that counts, unless a wider gap lies elsewhere in [`WINDOW`].
const TOLERANCE: f64 = 3e-5;

/// Where the residual of a unit column that counts is first looked for.
const WINDOW: [f64; 2] = [1e-6, 1e-3];

/// What can be said about one standard parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Identifiability {
    /// it has a value of its own in the torques
    Alone,
    /// only a combination with others has
    Combination,
    /// it never acts on any joint
    None,
}

/// One standard parameter, classed.
#[derive(Debug, Clone, serde::Serialize)]
pub struct StandardParameter {
    /// name, `link3.mx`
    pub name: String,
    /// class
    pub identifiability: Identifiability,
    /// why, in words, where a simple reason exists; empty otherwise
    pub reason: String,
}

/// The base parameters of a robot. See the [module](self) documentation.
#[derive(Debug, Clone, serde::Serialize)]
pub struct BaseParameters {
    /// names of the standard parameters, in column order
    pub names: Vec<String>,
    /// units of the standard parameters
    pub units: Vec<&'static str>,
    /// kept columns, ascending
    pub kept: Vec<usize>,
    /// dropped columns, ascending
    pub dropped: Vec<usize>,
    /// `K`, `b × (p − b)`: `π_b = φ_kept + K φ_dropped`
    #[serde(serialize_with = "crate::output::rows")]
    pub k: Mat<f64>,
    /// orthonormal basis `V` (`p × b`) of the row space of `W`: `W V` has the non-zero singular
    /// values of `W`
    #[serde(serialize_with = "crate::output::rows")]
    pub row_space: Mat<f64>,
    /// singular values of `W` over random states, largest first, relative to the largest
    pub singular_values: Vec<f64>,
    /// the smallest of them that counts
    pub singular_value_above: f64,
    /// the largest that does not count; 0 where all count
    pub singular_value_below: f64,
    /// the former over the latter (or over the rounding of the largest of all, where that is more)
    pub rank_gap: f64,
    /// every standard parameter with its class and reason
    pub standard: Vec<StandardParameter>,
    /// doubts about the rank
    pub warnings: Vec<Warning>,
}

/// Random states inside the limits (±π, 2 rad/s, 10 rad/s² or the like where there are none),
/// uniform, from a fixed stream.
pub fn random_states(robot: &Robot, count: usize, seed: u64) -> Samples {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut s = Samples::zeros(robot.dof(), count);
    for (j, joint) in robot.joints.iter().enumerate() {
        let reach = if joint.motion == Motion::Revolute {
            std::f64::consts::PI
        } else {
            0.5
        };
        let [low, high] = joint.limits.position;
        let (low, high) = match (low.is_finite(), high.is_finite()) {
            (true, true) => (low, high),
            (true, false) => (low, low + 2.0 * reach),
            (false, true) => (high - 2.0 * reach, high),
            (false, false) => (-reach, reach),
        };
        let (middle, half) = (0.5 * (low + high), (0.5 * (high - low)).clamp(1e-3, reach));
        let finite = |x: f64, other: f64| if x.is_finite() && x > 0.0 { x } else { other };
        let v = finite(joint.limits.velocity, 2.0).min(100.0);
        let a = finite(joint.limits.acceleration, 10.0).min(1000.0);
        for i in 0..count {
            let k = j * count + i;
            s.q[k] = middle + half * rng.random_range(-1.0..1.0);
            s.qd[k] = v * rng.random_range(-1.0..1.0);
            s.qdd[k] = a * rng.random_range(-1.0..1.0);
        }
    }
    s
}

impl BaseParameters {
    /// Base parameters of a robot with the joint columns it asks for.
    ///
    /// ```
    /// use excite::Robot;
    /// use excite::base::{BaseParameters, Identifiability};
    ///
    /// let base = BaseParameters::new(&Robot::load("planar2")?)?;
    /// for p in &base.standard {
    ///     if p.identifiability == Identifiability::None {
    ///         println!("{}: {}", p.name, p.reason);
    ///     }
    /// }
    /// # Ok::<(), excite::Error>(())
    /// ```
    ///
    /// # Errors
    /// When the decomposition fails, which needs numbers that are not finite.
    pub fn new(robot: &Robot) -> Result<Self> {
        let meant = robot.as_meant();
        let robot = meant.as_ref().unwrap_or(robot);
        let tree = Tree::new(robot);
        let p = robot.parameter_count();
        let count = (3 * p / robot.dof().max(1)).max(60);
        let states = |robot: &Robot| random_states(robot, count, 0x0e_4c17e);
        let w = Regressor::with_tree(robot, &tree, &states(robot));
        let even = Regressor::with_tree(robot, &tree, &states(&equally_fast(robot)));
        let mut base = Self::of(
            robot
                .columns()
                .iter()
                .map(|c| robot.column_name(*c))
                .collect(),
            robot
                .columns()
                .iter()
                .map(|c| robot.column_unit(*c))
                .collect(),
            w.mat(),
            even.mat(),
            &[],
        )?;
        for (k, column) in robot.columns().into_iter().enumerate() {
            base.standard[k].reason = base.reason(robot, k, column);
        }
        Ok(base)
    }

    /// Base parameters from any regressor over random states (closed chains hand in theirs), well
    /// conditioned columns first; see the [module](self) documentation.
    ///
    /// # Errors
    /// When the matrix has fewer rows than columns or numbers that are not finite.
    pub fn from_matrix(
        names: Vec<String>,
        units: Vec<&'static str>,
        w: MatRef<'_, f64>,
    ) -> Result<Self> {
        Self::of(names, units, w, w, &PASSES)
    }

    /// Columns are chosen on `w`, the rank is counted on `even`.
    fn of(
        names: Vec<String>,
        units: Vec<&'static str>,
        w: MatRef<'_, f64>,
        even: MatRef<'_, f64>,
        passes: &[f64],
    ) -> Result<Self> {
        let p = w.ncols();
        if w.nrows() < p {
            return Err(Error::Argument(format!(
                "{} rows cannot decide the rank of {p} columns: use more random states",
                w.nrows()
            )));
        }
        let norms: Vec<f64> = (0..p).map(|j| w.col(j).norm_l2()).collect();
        if norms.iter().any(|n| !n.is_finite()) {
            return Err(Error::Infeasible(
                "the regressor holds numbers that are not finite: check masses, lengths and limits"
                    .into(),
            ));
        }
        // a column that is rounding noise beside the column of the same kind is zero
        let largest = norms.iter().cloned().fold(0.0, f64::max);
        let live: Vec<usize> = (0..p).filter(|&j| norms[j] > 1e-9 * largest).collect();
        let scaled = Mat::from_fn(w.nrows(), live.len(), |i, j| {
            w[(i, live[j])] / norms[live[j]]
        });
        let sv = relative_singular_values(even)?;
        let rank = rank(&sv);
        let above = rank.checked_sub(1).map_or(1.0, |k| sv[k]);
        let below = sv.get(rank).copied().unwrap_or(0.0);
        // what is below the rounding of the largest is rounding
        let rank_gap = above / below.max(f64::EPSILON);
        let mut warnings = Vec::new();
        if rank_gap < CLEAR {
            warnings.push(Warning::new(
                WarningKind::RankGap,
                "rank",
                format!(
                    "the border between identifiable and not is blurred: singular value {rank} is \
                     {above:.1e} and the next {below:.1e} of the largest; look for nearly aligned \
                     axes or rounded lengths and angles, and write all their digits",
                ),
            ));
        }

        let r = scaled.qr().thin_R().to_owned();
        let tolerance = tolerance(&relative_singular_values(r.as_ref())?, rank);
        let (kept, k) = keep(&r, rank, tolerance, passes);
        if kept.len() != rank {
            warnings.push(Warning::new(
                WarningKind::RankGap,
                "rank",
                format!(
                    "{rank} parameters are independent, and only {} columns could be told to be; \
                     scale the file to metres and kilograms",
                    kept.len()
                ),
            ));
        }
        let kept_columns: Vec<usize> = kept.iter().map(|&j| live[j]).collect();
        let dropped: Vec<usize> = (0..p).filter(|j| !kept_columns.contains(j)).collect();
        // back to unscaled columns: K_unscaled = D_b⁻¹ K D_d
        let k = Mat::from_fn(kept.len(), dropped.len(), |a, d| {
            match live.iter().position(|&j| j == dropped[d]) {
                Some(j) => {
                    let x = k[(a, j)];
                    if x.abs() < 1e-10 {
                        0.0
                    } else {
                        x * norms[dropped[d]] / norms[kept_columns[a]]
                    }
                }
                None => 0.0,
            }
        });
        let row_space = row_space(p, &kept_columns, &dropped, &k);
        let standard = (0..p)
            .map(|j| StandardParameter {
                name: names[j].clone(),
                identifiability: if norms[j] <= 1e-9 * largest {
                    Identifiability::None
                } else if touches_null_space(j, &kept_columns, &dropped, &k, &norms) {
                    Identifiability::Combination
                } else {
                    Identifiability::Alone
                },
                reason: String::new(),
            })
            .collect();
        Ok(BaseParameters {
            names,
            units,
            kept: kept_columns,
            dropped,
            k,
            row_space,
            singular_values: sv,
            singular_value_above: above,
            singular_value_below: below,
            rank_gap,
            standard,
            warnings,
        })
    }

    /// Number of base parameters `b`.
    pub fn count(&self) -> usize {
        self.kept.len()
    }

    /// Base parameters of given standard parameters: `π_b = φ_kept + K φ_dropped`. Terms that
    /// cancel to rounding (below 1e-12 of their size) give exactly 0, so that nothing is taken
    /// relative to what is left of them.
    pub fn project(&self, phi: &[f64]) -> Vec<f64> {
        (0..self.count())
            .map(|a| {
                let first = phi[self.kept[a]];
                let (mut sum, mut size) = (first, first.abs());
                for (d, &j) in self.dropped.iter().enumerate() {
                    let term = self.k[(a, d)] * phi[j];
                    sum += term;
                    size += term.abs();
                }
                if sum.abs() <= 1e-12 * size { 0.0 } else { sum }
            })
            .collect()
    }

    /// `W_b`: the kept columns of a stacked regressor.
    pub fn select(&self, w: MatRef<'_, f64>) -> Mat<f64> {
        Mat::from_fn(w.nrows(), self.count(), |i, a| w[(i, self.kept[a])])
    }

    /// The selection as a matrix `p × b`: `W_b = W S`.
    pub fn selection(&self) -> Mat<f64> {
        let mut s = Mat::zeros(self.names.len(), self.count());
        for (a, &j) in self.kept.iter().enumerate() {
            s[(j, a)] = 1.0;
        }
        s
    }

    /// Name of base parameter `a`: that of its kept column.
    pub fn name(&self, a: usize) -> &str {
        &self.names[self.kept[a]]
    }

    /// Readable linear combination, `link2.Izz + link3.m·0.0998 − …`. Coefficients that are
    /// rounding noise (below 1e-6 of what the parameter itself carries) are left out.
    pub fn combination(&self, a: usize) -> String {
        let mut text = self.name(a).to_string();
        for (d, &j) in self.dropped.iter().enumerate() {
            let c = self.k[(a, d)];
            if c.abs() < 1e-5 {
                continue;
            }
            text.push_str(if c < 0.0 { " - " } else { " + " });
            let c = c.abs();
            if (c - 1.0).abs() > 1e-5 {
                text.push_str(&format!("{}·", short(c)));
            }
            text.push_str(&self.names[j]);
        }
        text
    }

    /// Why a parameter is what it is, where that can be said simply.
    fn reason(&self, robot: &Robot, index: usize, column: Column) -> String {
        match (self.standard[index].identifiability, column) {
            (Identifiability::Alone, _) => String::new(),
            (Identifiability::None, Column::Inertial { body, k }) => none_reason(robot, body, k),
            (Identifiability::None, _) => String::new(),
            (Identifiability::Combination, _) => {
                let partners = self.partners(index);
                let mut text = if partners.is_empty() {
                    String::new()
                } else {
                    format!("felt only together with {}", list(&partners, 4))
                };
                if let Column::Term {
                    joint,
                    term: JointTerm::Armature,
                } = column
                    && robot
                        .bodies
                        .iter()
                        .any(|b| b.coordinate == joint && b.parent.is_none())
                {
                    text = format!("the rotor of a first joint turns exactly as its link: {text}");
                }
                text
            }
        }
    }

    /// Fills in the simple reasons, for regressors of any kind.
    pub fn explain_all(&mut self) {
        for index in 0..self.standard.len() {
            self.standard[index].reason = match self.standard[index].identifiability {
                Identifiability::Alone => String::new(),
                Identifiability::None => "it never acts on an actuator".into(),
                Identifiability::Combination => {
                    let partners = self.partners(index);
                    match partners.is_empty() {
                        true => String::new(),
                        false => format!("felt only together with {}", list(&partners, 4)),
                    }
                }
            };
        }
    }

    /// Names of the parameters that share a base parameter with this one.
    fn partners(&self, index: usize) -> Vec<&str> {
        let significant = |a: usize, d: usize| self.k[(a, d)].abs() > 1e-5;
        let mut all: Vec<usize> = Vec::new();
        if let Ok(a) = self.kept.binary_search(&index) {
            all.extend(
                (0..self.dropped.len())
                    .filter(|&d| significant(a, d))
                    .map(|d| self.dropped[d]),
            );
        }
        if let Ok(d) = self.dropped.binary_search(&index) {
            all.extend(
                (0..self.count())
                    .filter(|&a| significant(a, d))
                    .map(|a| self.kept[a]),
            );
        }
        all.iter().map(|&j| self.names[j].as_str()).collect()
    }
}

/// Four significant digits without trailing zeros.
fn short(x: f64) -> String {
    let digits = (3 - x.abs().log10().floor() as i32).clamp(0, 8) as usize;
    let s = format!("{x:.digits$}");
    match s.contains('.') {
        true => s.trim_end_matches('0').trim_end_matches('.').to_string(),
        false => s,
    }
}

fn list(names: &[&str], most: usize) -> String {
    match names.len() {
        0 => String::new(),
        n if n <= most => names.join(", "),
        n => format!("{} and {} more", names[..most].join(", "), n - most),
    }
}

/// Why an inertial parameter never acts.
fn none_reason(robot: &Robot, body: usize, k: usize) -> String {
    let mut chain = vec![body];
    while let Some(p) = robot.bodies[chain[chain.len() - 1]].parent {
        chain.push(p);
    }
    let turns = chain
        .iter()
        .filter(|&&i| robot.bodies[i].motion == Motion::Revolute)
        .count();
    if turns == 0 {
        return match k {
            0 => "the link only slides at right angles to gravity and force".into(),
            _ => "the link only slides: only its mass is felt".into(),
        };
    }
    if chain.len() == 1 {
        let b = &robot.bodies[body];
        let axis = b.rotation * b.axis;
        let along = robot.gravity.cross(&axis).norm() < 1e-4 * robot.gravity.norm();
        let why = if robot.gravity.norm() == 0.0 {
            "without gravity"
        } else if along {
            "parallel to gravity"
        } else {
            "through its own origin"
        };
        return format!("first joint: the link turns about a fixed axis {why}");
    }
    let parallel = chain.windows(2).all(|w| {
        let b = &robot.bodies[w[0]];
        let up = &robot.bodies[w[1]];
        up.motion == Motion::Prismatic
            || b.motion == Motion::Prismatic
            || (b.rotation * b.axis).cross(&up.axis).norm() < 1e-4
    });
    if parallel && turns > 0 {
        return "all axes up to this link are parallel: it moves in a plane and does not feel what \
                lies across it"
            .into();
    }
    String::new()
}

/// The same robot with equal limits of velocity and acceleration for all joints.
fn equally_fast(robot: &Robot) -> Robot {
    let mut robot = robot.clone();
    for joint in &mut robot.joints {
        joint.limits.velocity = f64::INFINITY;
        joint.limits.acceleration = f64::INFINITY;
    }
    robot
}

/// Singular values, largest first, relative to the largest.
fn relative_singular_values(m: MatRef<'_, f64>) -> Result<Vec<f64>> {
    // R of a plain QR has the singular values of the whole and is small
    let r = m.qr().thin_R().to_owned();
    let sv = r
        .singular_values()
        .map_err(|_| Error::Infeasible("singular values did not converge".into()))?;
    let top = sv.first().copied().unwrap_or(0.0).max(f64::MIN_POSITIVE);
    Ok(sv.iter().map(|s| s / top).collect())
}

/// Rank from relative singular values (descending): the first gap of [`CLEAR`] that ends below
/// [`NEGLIGIBLE`]; where there is none, the widest.
fn rank(sv: &[f64]) -> usize {
    let below = |r: usize| sv.get(r).copied().unwrap_or(0.0).max(ROUNDING);
    let gap = |r: usize| sv[r - 1] / below(r);
    let counted = sv.iter().take_while(|s| **s > ROUNDING).count();
    (1..=counted)
        .find(|&r| below(r) <= NEGLIGIBLE && gap(r) >= CLEAR)
        .or_else(|| (1..=counted).max_by(|&a, &b| gap(a).total_cmp(&gap(b))))
        .unwrap_or(0)
}

/// Residual that a unit column must leave to count: the widest gap of the singular values of the
/// unit columns (relative, descending) whose border lies inside [`WINDOW`]; where that contradicts
/// the rank, the middle of the border of the rank.
fn tolerance(sv: &[f64], rank: usize) -> f64 {
    let [low, high] = WINDOW;
    let mut best = (0.0, 0, TOLERANCE);
    for r in 1..=sv.len() {
        let above = sv[r - 1].min(high);
        let below = sv.get(r).copied().unwrap_or(0.0).max(low);
        let gap = above / below;
        if gap > best.0 {
            best = (gap, r, (above * below).sqrt());
        }
    }
    match rank.checked_sub(1).and_then(|k| sv.get(k)) {
        Some(above) if best.1 != rank => {
            let below = sv.get(rank).copied().unwrap_or(0.0).max(ROUNDING);
            (above.max(ROUNDING) * below).sqrt()
        }
        _ => best.2,
    }
}

/// Residuals (of unit columns) that closed chains ask of a column, one pass over the columns each:
/// two of one pass differ by little, what is left for the last is nearly dependent.
const PASSES: [f64; 8] = [0.43, 0.21, 0.11, 0.053, 0.027, 0.013, 0.0067, 0.0033];

/// Keeps `rank` independent columns of the upper triangular `R` and expresses all columns in them:
/// returns their indices, ascending, and `K` (`rank × columns`).
///
/// Gram-Schmidt with reorthogonalisation. Each pass over the columns keeps those that leave a
/// residual of more than its threshold, first come first kept; the threshold of the last pass
/// starts at the rank tolerance and is adapted until the count is the rank.
fn keep(r: &Mat<f64>, rank: usize, tolerance: f64, passes: &[f64]) -> (Vec<usize>, Mat<f64>) {
    let n = r.ncols();
    let choose = |last: f64| -> Vec<usize> {
        let mut q: Vec<Vec<f64>> = Vec::new();
        let mut kept: Vec<usize> = Vec::new();
        for &threshold in passes.iter().filter(|t| **t > last).chain([&last]) {
            for j in 0..n {
                if kept.contains(&j) {
                    continue;
                }
                let mut x: Vec<f64> = (0..r.nrows()).map(|i| r[(i, j)]).collect();
                for _ in 0..2 {
                    for e in &q {
                        let s: f64 = e.iter().zip(&x).map(|(a, b)| a * b).sum();
                        x.iter_mut().zip(e).for_each(|(x, e)| *x -= s * e);
                    }
                }
                let norm = x.iter().map(|v| v * v).sum::<f64>().sqrt();
                if norm > threshold {
                    x.iter_mut().for_each(|v| *v /= norm);
                    q.push(x);
                    kept.push(j);
                }
            }
        }
        kept
    };
    let mut threshold = tolerance;
    let mut kept = choose(threshold);
    for _ in 0..60 {
        if kept.len() == rank {
            break;
        }
        threshold *= if kept.len() > rank { 1.5 } else { 1.0 / 1.6 };
        kept = choose(threshold);
    }
    kept.sort_unstable();
    let basis = Mat::from_fn(r.nrows(), kept.len(), |i, a| r[(i, kept[a])]);
    use faer::linalg::solvers::SolveLstsq;
    let k = basis.qr().solve_lstsq(r);
    let k = Mat::from_fn(kept.len(), n, |i, j| k[(i, j)]);
    (kept, k)
}

/// Orthonormal basis of the range of `[1; Kᵀ]` in the order of the columns.
fn row_space(p: usize, kept: &[usize], dropped: &[usize], k: &Mat<f64>) -> Mat<f64> {
    let mut m = Mat::zeros(p, kept.len());
    for (a, &j) in kept.iter().enumerate() {
        m[(j, a)] = 1.0;
        for (d, &j) in dropped.iter().enumerate() {
            m[(j, a)] = k[(a, d)];
        }
    }
    m.qr().compute_thin_Q()
}

/// Whether changing parameter `j` can be undone by others: whether it takes part in a null vector
/// `[−K e_d; e_d]`, measured in units of the columns it moves.
fn touches_null_space(
    j: usize,
    kept: &[usize],
    dropped: &[usize],
    k: &Mat<f64>,
    norms: &[f64],
) -> bool {
    match kept.binary_search(&j) {
        Err(_) => true,
        Ok(a) => dropped
            .iter()
            .enumerate()
            .any(|(d, &i)| norms[i] > 0.0 && (k[(a, d)] * norms[j] / norms[i]).abs() > 1e-5),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rank_ends_at_a_clear_gap() {
        assert_eq!(rank(&[1.0, 0.1, 2e-3, 1e-16]), 3);
        assert_eq!(rank(&[1.0, 1e-4, 1e-15]), 2);
        assert_eq!(rank(&[1.0, 0.5]), 2);
        assert_eq!(rank(&[]), 0);
        // two parameters that exist by rounding
        assert_eq!(rank(&[1.0, 6e-2, 4e-7, 3e-8, 1e-16]), 2);
        // small, but no border before the rounding of the arithmetic
        let smooth: Vec<f64> = (0..30).map(|k| 0.55f64.powi(k)).collect();
        let all = [&smooth[..], &[2e-16, 1e-16]].concat();
        assert_eq!(rank(&all), 30);
        // a slow joint beside fast ones
        assert_eq!(rank(&[1.0, 0.5, 3e-4, 1e-4, 1e-15]), 4);
    }

    #[test]
    fn short_numbers() {
        assert_eq!(short(0.316), "0.316");
        assert_eq!(short(0.099_856_3), "0.09986");
        assert_eq!(short(2.0), "2");
        assert_eq!(short(1234.6), "1235");
    }
}
