//! Convex conic programs, the subproblems of the sequential design loops.
//!
//! ```text
//! minimise    ½ xᵀP x + qᵀx
//! subject to  a·x = b                          equalities
//!             a·x ≤ b                          inequalities
//!             a₀·x + c₀ ≥ ‖(aᵢ·x + cᵢ)ᵢ‖₂      second-order cones
//!             A₀ + Σₖ xₖ Aₖ ⪰ 0                 semidefinite cones (linear matrix inequalities)
//! ```
//!
//! [`Problem`] collects the rows, [`Problem::solve`] hands them to clarabel, a primal-dual
//! interior-point method (Goulart and Chen, *Clarabel: An interior-point solver for conic programs
//! with quadratic objectives*, 2024). The answer depends on the problem and the [`Settings`] alone:
//! one thread, no state between solves. The cost is that of about ten to fifteen sparse
//! factorisations of the system of all variables and rows; a semidefinite cone of order `d` adds
//! `d(d+1)/2` rows, as a rule dense, and is meant for `d` up to about 20.
//!
//! ```
//! use excite::conic::{Problem, Settings, Status};
//!
//! // the point of the half-plane x + y ≥ 1 that is nearest to the origin
//! let mut problem = Problem::new(2);
//! problem.quadratic(0, 0, 2.0);
//! problem.quadratic(1, 1, 2.0);
//! problem.inequality([(0, -1.0), (1, -1.0)], -1.0);
//! let solution = problem.solve(&Settings::default())?;
//! assert_eq!(solution.status, Status::Solved);
//! assert!((solution.x[0] - 0.5).abs() < 1e-6 && (solution.objective - 0.5).abs() < 1e-6);
//! # Ok::<(), excite::Error>(())
//! ```

#[cfg(feature = "conic-blas")]
mod blas;
mod solution;
mod sparse;

use std::f64::consts::SQRT_2;

use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, SupportedConeT::NonnegativeConeT,
    SupportedConeT::PSDTriangleConeT, SupportedConeT::SecondOrderConeT, SupportedConeT::ZeroConeT,
};
use faer::MatRef;

use crate::error::{Error, Result};
use solution::Cone;
pub use solution::{Solution, Status};
use sparse::{Rows, compress, flaw};

/// `a·x + c` as the terms `(k, aₖ)` of `a` and the constant `c`.
pub type Affine<'a> = (&'a [(usize, f64)], f64);

/// When the solver stops, and how it scales.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// duality gap, absolute and relative to the objective, at which a problem counts as solved
    pub gap: f64,
    /// residual of the rows and of stationarity, relative to the data, at which it does
    pub feasibility: f64,
    /// most interior-point iterations
    pub max_iterations: u32,
    /// wall clock of one solve, s; anything but infinity makes the answer depend on the machine
    pub time_limit: f64,
    /// rounds of equilibration of rows and columns before the solve, 0 for none
    pub equilibration: u32,
    /// residual to which the linear systems are refined; well below the tolerances above
    pub refinement: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            gap: 1e-8,
            feasibility: 1e-8,
            max_iterations: 200,
            time_limit: f64::INFINITY,
            equilibration: 10,
            refinement: 1e-12,
        }
    }
}

impl Settings {
    /// For the inside of a loop that solves thousands: a tolerance of 1e-6 and less scaling and
    /// refinement, about a third faster.
    pub fn fast() -> Self {
        Settings {
            gap: 1e-6,
            feasibility: 1e-6,
            equilibration: 3,
            refinement: 1e-8,
            ..Self::default()
        }
    }
}

/// A convex conic program under construction.
///
/// The rows are kept as they are pushed, sparse; terms that name the same variable add up. The
/// first mistake of a caller (a variable that does not exist, a number that is not finite, a matrix
/// of the wrong size) is remembered and is the error of [`Problem::solve`].
#[derive(Debug, Clone)]
pub struct Problem {
    /// upper triangle (row ≤ column) of P
    p: Vec<(usize, usize, f64)>,
    q: Vec<f64>,
    equalities: Rows,
    inequalities: Rows,
    conic: Rows,
    cones: Vec<Cone>,
    mistake: Option<String>,
}

impl Problem {
    /// A problem in `n` variables, without objective and rows.
    pub fn new(n: usize) -> Self {
        Problem {
            p: Vec::new(),
            q: vec![0.0; n],
            equalities: Rows::default(),
            inequalities: Rows::default(),
            conic: Rows::default(),
            cones: Vec::new(),
            mistake: None,
        }
    }

    /// Forgets objective and rows and keeps the variables and the memory.
    pub fn clear(&mut self) {
        self.p.clear();
        self.q.fill(0.0);
        self.equalities.clear();
        self.inequalities.clear();
        self.conic.clear();
        self.cones.clear();
        self.mistake = None;
    }

    /// Number of variables.
    pub fn variables(&self) -> usize {
        self.q.len()
    }

    /// Adds `value` to `P_ij` and, off the diagonal, to `P_ji`: `½ value xᵢ²` or `value xᵢ xⱼ` of
    /// objective. `P` must be positive semidefinite; that is not checked, and a problem that is not
    /// convex ends as [`Status::Failed`] or in a point without meaning.
    pub fn quadratic(&mut self, i: usize, j: usize, value: f64) {
        if self.valid("P", [(i, value), (j, value)], 0.0) {
            self.p.push((i.min(j), i.max(j), value));
        }
    }

    /// Adds the symmetric part of an `n × n` matrix to `P`.
    pub fn quadratic_matrix(&mut self, p: MatRef<'_, f64>) {
        let n = self.variables();
        if p.nrows() != n || p.ncols() != n {
            let message = format!("P is {} by {} for {n} variables", p.nrows(), p.ncols());
            return self.blame(message);
        }
        for j in 0..n {
            for i in 0..=j {
                self.quadratic(i, j, 0.5 * (p[(i, j)] + p[(j, i)]));
            }
        }
    }

    /// Adds `value` to `qᵢ`.
    pub fn linear(&mut self, i: usize, value: f64) {
        if self.valid("q", [(i, value)], 0.0) {
            self.q[i] += value;
        }
    }

    /// Adds the row `a·x = b`, and returns its number among the equalities.
    pub fn equality(&mut self, a: impl IntoIterator<Item = (usize, f64)>, b: f64) -> usize {
        self.equalities.push(a, b);
        self.equalities.len() - 1
    }

    /// Adds the row `a·x ≤ b`, and returns its number among the inequalities.
    pub fn inequality(&mut self, a: impl IntoIterator<Item = (usize, f64)>, b: f64) -> usize {
        self.inequalities.push(a, b);
        self.inequalities.len() - 1
    }

    /// Adds `lower ≤ xᵢ ≤ upper` as up to two inequalities, upper first; an infinite bound adds none.
    pub fn bounds(&mut self, i: usize, lower: f64, upper: f64) {
        if upper != f64::INFINITY {
            self.inequality([(i, 1.0)], upper);
        }
        if lower != f64::NEG_INFINITY {
            self.inequality([(i, -1.0)], -lower);
        }
    }

    /// Adds the cone `bound ≥ ‖inside‖₂`, and returns its number among the cones.
    pub fn second_order(&mut self, bound: Affine<'_>, inside: &[Affine<'_>]) -> usize {
        let start = self.conic.len();
        for (a, c) in std::iter::once(&bound).chain(inside) {
            self.conic.push(a.iter().map(|&(k, v)| (k, -v)), *c);
        }
        self.cones.push(Cone {
            semidefinite: false,
            order: inside.len() + 1,
            start,
        });
        self.cones.len() - 1
    }

    /// Adds the linear matrix inequality `A₀ + Σₖ xₖ Aₖ ⪰ 0`, and returns its number among the
    /// cones. `terms` are the pairs `(k, Aₖ)`, all of the size of `A₀`; of each matrix the
    /// symmetric part counts.
    ///
    /// The rows are the upper triangle column by column, off-diagonal entries times `√2`, so that
    /// the inner product of two of them is that of the matrices.
    pub fn semidefinite(
        &mut self,
        a0: MatRef<'_, f64>,
        terms: &[(usize, MatRef<'_, f64>)],
    ) -> usize {
        let (start, order) = (self.conic.len(), a0.nrows());
        self.cones.push(Cone {
            semidefinite: true,
            order,
            start,
        });
        let cone = self.cones.len() - 1;
        let square = |a: &MatRef<'_, f64>| a.nrows() == order && a.ncols() == order;
        if order == 0 || !square(&a0) || !terms.iter().all(|(_, a)| square(a)) {
            let shape = format!("{} by {}", a0.nrows(), a0.ncols());
            self.blame(format!(
                "the matrices of cone {cone} are not all square, A0 is {shape}"
            ));
            return cone;
        }
        for j in 0..order {
            for i in 0..=j {
                let scale = if i == j { 0.5 } else { 0.5 * SQRT_2 };
                let packed = |a: &MatRef<'_, f64>| scale * (a[(i, j)] + a[(j, i)]);
                self.conic
                    .push(terms.iter().map(|(k, a)| (*k, -packed(a))), packed(&a0));
            }
        }
        cone
    }

    /// Solves the problem.
    ///
    /// That it has no solution, or that none was found, is a [`Status`].
    ///
    /// # Errors
    /// [`Error::Argument`]: a row names a variable that does not exist, a number is not finite, the
    /// matrices of a cone differ in size, or a tolerance is not positive.
    pub fn solve(&self, settings: &Settings) -> Result<Solution> {
        #[cfg(feature = "conic-blas")]
        blas::keep();
        self.check(settings)?;

        let n = self.variables();
        let mut p = self.p.clone();
        p.sort_by_key(|&(i, j, _)| (j, i));
        let p = compress(n, n, || p.iter().copied());
        let parts = [&self.equalities, &self.inequalities, &self.conic];
        let starts = [0, parts[0].len(), parts[0].len() + parts[1].len()];
        let rows = starts[2] + self.conic.len();
        let a = compress(rows, n, || {
            parts.into_iter().zip(starts).flat_map(|(part, start)| {
                part.triplets()
                    .map(move |(row, column, value)| (start + row, column, value))
            })
        });
        let b: Vec<f64> = parts
            .iter()
            .flat_map(|part| part.b.iter().copied())
            .collect();
        let mut cones = vec![
            ZeroConeT(self.equalities.len()),
            NonnegativeConeT(self.inequalities.len()),
        ];
        cones.extend(self.cones.iter().map(|cone| match cone.semidefinite {
            true => PSDTriangleConeT(cone.order),
            false => SecondOrderConeT(cone.order),
        }));

        let failed = |e| Error::Argument(format!("conic problem: {e}"));
        let mut solver =
            DefaultSolver::new(&p, &self.q, &a, &b, &cones, options(settings)).map_err(failed)?;
        solver.solve();
        let found = solver.solution;
        Ok(Solution {
            status: Status::of(found.status),
            x: found.x,
            objective: found.obj_val,
            z: found.z,
            iterations: found.iterations,
            starts,
            cones: self.cones.clone(),
        })
    }

    /// Remembers the first mistake.
    fn blame(&mut self, message: String) {
        self.mistake.get_or_insert(message);
    }

    /// Whether the terms name variables and the numbers are finite; remembers if not.
    fn valid(
        &mut self,
        what: &str,
        terms: impl IntoIterator<Item = (usize, f64)>,
        constant: f64,
    ) -> bool {
        match flaw(self.variables(), terms, constant) {
            Some(message) => {
                self.blame(format!("{what}: {message}"));
                false
            }
            None => true,
        }
    }

    /// What was wrong with the calls so far, the rows and the settings.
    fn check(&self, settings: &Settings) -> Result<()> {
        let error = |message: String| Err(Error::Argument(format!("conic problem: {message}")));
        if let Some(message) = &self.mistake {
            return error(message.clone());
        }
        let n = self.variables();
        if n == 0 {
            return error("there are no variables".into());
        }
        for (what, rows) in [
            ("equality", &self.equalities),
            ("inequality", &self.inequalities),
            ("row of the cones", &self.conic),
        ] {
            let mut start = 0;
            for (row, (&end, &b)) in rows.end.iter().zip(&rows.b).enumerate() {
                if let Some(message) = flaw(n, rows.entries[start..end].iter().copied(), b) {
                    return error(format!("{what} {row}: {message}"));
                }
                start = end;
            }
        }
        for (name, value) in [
            ("gap", settings.gap),
            ("feasibility", settings.feasibility),
            ("refinement", settings.refinement),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return error(format!(
                    "the tolerance `{name}` is {value}; it must be positive"
                ));
            }
        }
        Ok(())
    }
}

/// Clarabel's settings. Its chordal decomposition is for large sparse cones and stays off.
fn options(settings: &Settings) -> DefaultSettings<f64> {
    DefaultSettings {
        verbose: false,
        max_threads: 1,
        direct_solve_method: "qdldl".into(),
        max_iter: settings.max_iterations,
        time_limit: settings.time_limit,
        tol_gap_abs: settings.gap,
        tol_gap_rel: settings.gap,
        tol_feas: settings.feasibility,
        equilibrate_enable: settings.equilibration > 0,
        equilibrate_max_iter: settings.equilibration,
        iterative_refinement_abstol: settings.refinement,
        iterative_refinement_reltol: 0.1 * settings.refinement,
        chordal_decomposition_enable: false,
        ..DefaultSettings::default()
    }
}
