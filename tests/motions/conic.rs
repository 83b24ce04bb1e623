//! Conic programs with known answers, through the public interface of the library. That this file
//! links is itself a test: the routines of the semidefinite cones come from the library alone.
#![cfg(feature = "conic-blas")]

mod edges;

use excite::conic::{Problem, Settings, Solution, Status};
use faer::linalg::solvers::SelfAdjointEigen;
use faer::{Mat, Side};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn solved(problem: &Problem) -> Solution {
    let solution = problem.solve(&Settings::default()).expect("well posed");
    assert_eq!(solution.status, Status::Solved);
    solution
}

fn status(problem: &Problem) -> Status {
    let solution = problem.solve(&Settings::default()).expect("well posed");
    solution.status
}

fn refused(problem: &Problem) -> String {
    let error = problem.solve(&Settings::default()).expect_err("a mistake");
    assert!(error.is_argument());
    error.to_string()
}

fn symmetric(rng: &mut ChaCha8Rng, n: usize) -> Mat<f64> {
    let g = Mat::from_fn(n, n, |_, _| rng.random_range(-1.0..1.0));
    &g + g.transpose()
}

fn unit(n: usize, i: usize, j: usize) -> Mat<f64> {
    Mat::from_fn(n, n, |r, c| f64::from((r, c) == (i, j) || (c, r) == (i, j)))
}

fn inner(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
    let n = a.nrows();
    (0..n)
        .map(|j| (0..n).map(|i| a[(i, j)] * b[(i, j)]).sum::<f64>())
        .sum()
}

fn eigenvalues(a: &Mat<f64>) -> Vec<f64> {
    a.self_adjoint_eigenvalues(Side::Lower).expect("finite")
}

fn close(found: f64, wanted: f64, tolerance: f64) {
    assert!((found - wanted).abs() <= tolerance, "{found}, not {wanted}");
}

/// `min t` with `t 1 − A ⪰ 0`; the multiplier is the projector on the eigenvector.
#[test]
fn largest_eigenvalue_as_a_program() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for n in 2..=12 {
        let a = symmetric(&mut rng, n);
        let mut problem = Problem::new(1);
        problem.linear(0, 1.0);
        let cone = problem.semidefinite((-&a).as_ref(), &[(0, Mat::identity(n, n).as_ref())]);
        let solution = solved(&problem);
        let largest = eigenvalues(&a)[n - 1];
        close(solution.x[0], largest, 1e-6);
        close(solution.objective, largest, 1e-6);
        let z = solution.matrix(cone).expect("semidefinite");
        close((0..n).map(|i| z[(i, i)]).sum(), 1.0, 1e-6);
        close(inner(&a, &z), largest, 1e-5);
        assert!(eigenvalues(&z)[0] > -1e-8);
    }
}

/// `max t` with `T − t 1 ⪰ 0`, `T` the second difference of order 4: `2 − 2 cos(π/5)`.
#[test]
fn smallest_eigenvalue_of_a_chain_of_four() {
    let t = Mat::from_fn(4, 4, |i, j| match i.abs_diff(j) {
        0 => 2.0,
        1 => -1.0,
        _ => 0.0,
    });
    let mut problem = Problem::new(1);
    problem.linear(0, -1.0);
    problem.semidefinite(t.as_ref(), &[(0, (-Mat::<f64>::identity(4, 4)).as_ref())]);
    let wanted = 2.0 - 2.0 * (std::f64::consts::PI / 5.0).cos();
    close(solved(&problem).x[0], wanted, 1e-7);
}

/// The theta number of the pentagon is `√5` (Lovász 1979):
/// `min t` with `t 1 + Σ y_e E_e − J ⪰ 0` over the edges `e`.
#[test]
fn theta_number_of_the_pentagon() {
    let ones = Mat::from_fn(5, 5, |_, _| -1.0);
    let mut matrices = vec![Mat::identity(5, 5)];
    matrices.extend((0..5).map(|i| unit(5, i, (i + 1) % 5)));
    let terms: Vec<_> = matrices
        .iter()
        .enumerate()
        .map(|(k, a)| (k, a.as_ref()))
        .collect();
    let mut problem = Problem::new(6);
    problem.linear(0, 1.0);
    problem.semidefinite(ones.as_ref(), &terms);
    close(solved(&problem).objective, 5f64.sqrt(), 1e-6);
}

/// `min ½‖X − A‖²` over `X ⪰ 0` cuts the negative eigenvalues off.
#[test]
fn nearest_semidefinite_matrix() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for n in 1..=7 {
        let a = symmetric(&mut rng, n);
        let entries: Vec<(usize, usize)> =
            (0..n).flat_map(|j| (0..=j).map(move |i| (i, j))).collect();
        let matrices: Vec<Mat<f64>> = entries.iter().map(|&(i, j)| unit(n, i, j)).collect();
        let terms: Vec<_> = matrices
            .iter()
            .enumerate()
            .map(|(k, a)| (k, a.as_ref()))
            .collect();
        let mut problem = Problem::new(entries.len());
        for (k, &(i, j)) in entries.iter().enumerate() {
            let count = if i == j { 1.0 } else { 2.0 };
            problem.quadratic(k, k, count);
            problem.linear(k, -count * a[(i, j)]);
        }
        problem.semidefinite(Mat::zeros(n, n).as_ref(), &terms);
        let solution = solved(&problem);

        let spectrum = SelfAdjointEigen::new(a.as_ref(), Side::Lower).expect("finite");
        let (u, w) = (spectrum.U(), spectrum.S());
        for (k, &(i, j)) in entries.iter().enumerate() {
            let wanted: f64 = (0..n).map(|l| u[(i, l)] * w[l].max(0.0) * u[(j, l)]).sum();
            close(solution.x[k], wanted, 1e-5);
        }
        let cut: f64 = (0..n).map(|l| w[l].min(0.0).powi(2)).sum();
        close(solution.objective + 0.5 * inner(&a, &a), 0.5 * cut, 1e-6);
    }
}

/// `min cᵀx` over the ball of radius `r` about `m`: `cᵀm − r ‖c‖` at `m − r c/‖c‖`.
#[test]
fn linear_objective_over_a_ball() {
    let (c, m, r) = ([1.0, -2.0, 2.0], [0.5, 1.0, -3.0], 2.5);
    let mut problem = Problem::new(3);
    c.iter()
        .enumerate()
        .for_each(|(k, &c)| problem.linear(k, c));
    let axes: Vec<[(usize, f64); 1]> = (0..3).map(|k| [(k, 1.0)]).collect();
    let inside: Vec<_> = axes
        .iter()
        .zip(m)
        .map(|(axis, m)| (&axis[..], -m))
        .collect();
    let ball = problem.second_order((&[], r), &inside);
    let solution = solved(&problem);
    close(solution.objective, 0.5 - 2.0 - 6.0 - r * 3.0, 1e-6);
    for k in 0..3 {
        close(solution.x[k], m[k] - r * c[k] / 3.0, 1e-6);
    }
    let z = solution.cone(ball).expect("there");
    close(z[0], 3.0, 1e-6);
    assert!(solution.matrix(ball).is_none() && solution.cone(1).is_none());
}

/// The cone's bound may depend on `x`: the distance from a line to a point is `min t`.
#[test]
fn distance_from_a_line_to_a_point() {
    // x on the line (1, 0) + s (1, 1), point (0, 3): 4/√2
    let mut problem = Problem::new(2);
    problem.linear(1, 1.0);
    problem.second_order(
        (&[(1, 1.0)], 0.0),
        &[(&[(0, 1.0)], 1.0), (&[(0, 1.0)], -3.0)],
    );
    let solution = solved(&problem);
    close(solution.x[0], 1.0, 1e-5);
    close(solution.x[1], 8f64.sqrt(), 1e-6);
}

#[test]
fn quadratic_program_with_bounds_and_an_equality() {
    // min ½(x² + y² + z²) + xy, x + y + z = 3, z ≤ 1: x + y = 2 at any split, z = 1
    let mut problem = Problem::new(3);
    (0..3).for_each(|k| problem.quadratic(k, k, 1.0));
    problem.quadratic(1, 0, 1.0);
    let sum = problem.equality([(0, 1.0), (1, 1.0), (2, 1.0)], 3.0);
    problem.bounds(2, f64::NEG_INFINITY, 1.0);
    let solution = solved(&problem);
    close(solution.objective, 2.0 + 0.5, 1e-6);
    close(solution.x[0] + solution.x[1], 2.0, 1e-6);
    // stationarity: x + y + ν = 0 and z + ν + λ = 0
    assert_eq!(
        (
            sum,
            solution.equalities().len(),
            solution.inequalities().len()
        ),
        (0, 1, 1)
    );
    close(solution.equalities()[0], -2.0, 1e-6);
    close(solution.inequalities()[0], 1.0, 1e-6);
}

#[test]
fn contradictions_are_infeasible() {
    let mut line = Problem::new(1);
    line.bounds(0, 1.0, 0.0);
    assert_eq!(status(&line), Status::Infeasible);

    let mut matrix = Problem::new(1);
    // diag(x, −x − 1, 1, 1) is never semidefinite
    let at = |i: usize| unit(4, i, i);
    let a0 = at(2) + at(3) - at(1);
    matrix.semidefinite(a0.as_ref(), &[(0, (at(0) - at(1)).as_ref())]);
    assert_eq!(status(&matrix), Status::Infeasible);

    let mut ball = Problem::new(1);
    ball.second_order((&[], 1.0), &[(&[(0, 1.0)], 0.0), (&[], 2.0)]);
    let solution = ball.solve(&Settings::default()).expect("well posed");
    assert_eq!(solution.status, Status::Infeasible);
    assert!(!solution.status.is_solved() && solution.objective.is_nan());
}

#[test]
fn objectives_without_end_are_unbounded() {
    let mut line = Problem::new(2);
    line.linear(0, 1.0);
    line.bounds(0, f64::NEG_INFINITY, 1.0);
    assert_eq!(status(&line), Status::Unbounded);

    let mut matrix = Problem::new(1);
    matrix.linear(0, -1.0);
    matrix.semidefinite(
        Mat::identity(5, 5).as_ref(),
        &[(0, Mat::identity(5, 5).as_ref())],
    );
    assert_eq!(status(&matrix), Status::Unbounded);
}

/// Two matrix inequalities, a ball, inequalities, an equality and a dense quadratic objective.
struct Mixed {
    p: Mat<f64>,
    q: Vec<f64>,
    rows: Vec<(Vec<f64>, f64)>,
    equality: Vec<f64>,
    cones: Vec<(Mat<f64>, Vec<Mat<f64>>)>,
}

const RADIUS: f64 = 0.6;

impl Mixed {
    fn new(n: usize, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let g = Mat::from_fn(n, n, |_, _| rng.random_range(-1.0..1.0));
        let mut vector = |n| -> Vec<f64> { (0..n).map(|_| rng.random_range(-1.0..1.0)).collect() };
        let q = vector(n).into_iter().map(|q| 5.0 * q).collect();
        let rows = (0..6).map(|_| (vector(n), 0.2)).collect();
        let equality = vector(n);
        let cones = [6, 4].map(|d| {
            let terms = (0..n).map(|_| symmetric(&mut rng, d)).collect();
            (0.5 * Mat::<f64>::identity(d, d), terms)
        });
        Mixed {
            p: &g * g.transpose(),
            q,
            rows,
            equality,
            cones: cones.into(),
        }
    }

    fn problem(&self) -> Problem {
        let n = self.q.len();
        let mut problem = Problem::new(n);
        self.push(&mut problem);
        problem
    }

    fn push(&self, problem: &mut Problem) {
        let sparse = |row: &[f64]| row.iter().copied().enumerate().collect::<Vec<_>>();
        for (a0, terms) in &self.cones {
            let terms: Vec<_> = terms
                .iter()
                .enumerate()
                .map(|(k, a)| (k, a.as_ref()))
                .collect();
            problem.semidefinite(a0.as_ref(), &terms);
        }
        self.rows
            .iter()
            .for_each(|(a, b)| _ = problem.inequality(sparse(a), *b));
        let axes: Vec<_> = (0..self.q.len()).map(|k| [(k, 1.0)]).collect();
        let inside: Vec<_> = axes.iter().map(|axis| (&axis[..], 0.0)).collect();
        problem.second_order((&[], RADIUS), &inside);
        problem.quadratic_matrix(self.p.as_ref());
        problem.equality(sparse(&self.equality), 0.05);
        self.q
            .iter()
            .enumerate()
            .for_each(|(k, &q)| problem.linear(k, q));
    }
}

/// Feasibility, signs of the multipliers, complementarity and stationarity, from the data itself.
#[test]
fn mixed_cones_satisfy_the_optimality_conditions() {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    for (n, seed) in [(5, 1), (9, 2), (20, 3), (20, 4)] {
        let mixed = Mixed::new(n, seed);
        let solution = solved(&mixed.problem());
        let x = &solution.x;
        let mut gradient: Vec<f64> = (0..n)
            .map(|i| mixed.q[i] + (0..n).map(|j| mixed.p[(i, j)] * x[j]).sum::<f64>())
            .collect();
        let mut active = 0;

        for ((a, b), &z) in mixed.rows.iter().zip(solution.inequalities()) {
            let slack = b - dot(a, x);
            assert!(slack > -1e-7 && z > -1e-9);
            close(slack * z, 0.0, 1e-6);
            active += usize::from(z > 1e-3);
            gradient.iter_mut().zip(a).for_each(|(g, a)| *g += z * a);
        }
        close(dot(&mixed.equality, x), 0.05, 1e-7);
        let nu = solution.equalities()[0];
        gradient
            .iter_mut()
            .zip(&mixed.equality)
            .for_each(|(g, a)| *g += nu * a);

        for (cone, (a0, terms)) in mixed.cones.iter().enumerate() {
            let slack = terms
                .iter()
                .zip(x)
                .fold(a0.clone(), |sum, (a, &x)| sum + x * a);
            let z = solution.matrix(cone).expect("semidefinite");
            assert!(eigenvalues(&slack)[0] > -1e-7 && eigenvalues(&z)[0] > -1e-7);
            close(inner(&slack, &z), 0.0, 1e-6);
            active += usize::from(inner(&z, &z) > 1e-3);
            gradient
                .iter_mut()
                .zip(terms)
                .for_each(|(g, a)| *g -= inner(a, &z));
        }

        let z = solution.cone(2).expect("the ball");
        let norm = dot(x, x).sqrt();
        assert!(norm < RADIUS + 1e-7 && z[0] > dot(&z[1..], &z[1..]).sqrt() - 1e-7);
        close(RADIUS * z[0] + dot(x, &z[1..]), 0.0, 1e-6);
        gradient.iter_mut().zip(&z[1..]).for_each(|(g, z)| *g -= z);

        assert!(active >= 2, "the constraints do not bind: {active}");
        gradient.iter().for_each(|&g| close(g, 0.0, 1e-6));
        let objective: f64 = (0..n)
            .map(|i| {
                x[i] * (mixed.q[i]
                    + 0.5 * dot(&(0..n).map(|j| mixed.p[(i, j)]).collect::<Vec<_>>(), x))
            })
            .sum();
        close(solution.objective, objective, 1e-9);
    }
}

#[test]
fn the_answer_is_a_function_of_the_problem() {
    let mixed = Mixed::new(12, 8);
    let settings = Settings::fast();
    let first = mixed.problem().solve(&settings).expect("well posed");
    assert_eq!(first.status, Status::Solved);

    // in a problem that held another one before, and on other threads
    let mut reused = Problem::new(12);
    Mixed::new(12, 9).push(&mut reused);
    reused.linear(99, 0.0);
    reused.clear();
    mixed.push(&mut reused);
    let answers = std::thread::scope(|scope| {
        let runs: Vec<_> = (0..3)
            .map(|_| scope.spawn(|| reused.solve(&settings).expect("well posed")))
            .collect();
        runs.into_iter()
            .map(|run| run.join().expect("no panic"))
            .collect::<Vec<_>>()
    });
    for answer in answers {
        assert_eq!((&answer.x, &answer.z), (&first.x, &first.z));
        assert_eq!(answer.iterations, first.iterations);
    }
    let exact = solved(&mixed.problem());
    close(first.objective, exact.objective, 1e-5);
    assert!(first.iterations < exact.iterations);
}
