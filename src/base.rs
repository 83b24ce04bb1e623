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

pub mod parts;
mod rank;
mod states;
mod words;

pub(crate) use parts::{Identifiability, StandardParameter};
#[doc(hidden)]
pub use rank::{CLEAR, NEGLIGIBLE};
#[doc(hidden)]
pub use states::random_states;

use crate::dynamics::Tree;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::regressor::Regressor;
use crate::robot::Robot;
use faer::{Mat, MatRef};
use rank::{
    PASSES, keep, rank, relative_singular_values, row_space, tolerance, touches_null_space,
};
use states::equally_fast;

/// The base parameters of a robot. See the [module](self) documentation.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
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

impl BaseParameters {
    /// Base parameters of a robot with the joint columns it asks for.
    ///
    /// ```
    /// use excite::Robot;
    /// use excite::base::BaseParameters;
    /// use excite::base::parts::Identifiability;
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
}
