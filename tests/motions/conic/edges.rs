//! Problems that are odd, mistaken or wild.

use super::*;

#[test]
fn terms_of_the_same_variable_add_up() {
    let mut problem = Problem::new(2);
    problem.quadratic(0, 0, 0.5);
    problem.quadratic(1, 1, 2.0);
    problem.quadratic(0, 0, 1.5);
    problem.quadratic(0, 1, 1.0);
    problem.quadratic(1, 0, -1.0);
    problem.linear(0, -3.0);
    problem.linear(0, 1.0);
    // 2 x ≤ 1 and y ≥ 4 in pieces
    problem.inequality([(0, 0.5), (1, 3.0), (0, 1.5), (1, -3.0)], 1.0);
    problem.inequality([(1, -0.5), (1, -0.5)], -4.0);
    let solution = solved(&problem);
    close(solution.x[0], 0.5, 1e-6);
    close(solution.x[1], 4.0, 1e-6);
    close(solution.objective, 0.25 - 1.0 + 16.0, 1e-6);
}

#[test]
fn a_problem_without_rows_is_solved() {
    let mut problem = Problem::new(1);
    problem.quadratic(0, 0, 2.0);
    problem.linear(0, -3.0);
    let solution = solved(&problem);
    close(solution.x[0], 1.5, 1e-6);
    assert!(solution.z.is_empty());
}

#[test]
fn a_limit_that_is_reached_is_a_failure() {
    let problem = Mixed::new(9, 2).problem();
    for settings in [
        Settings {
            max_iterations: 2,
            ..Settings::default()
        },
        Settings {
            time_limit: 0.0,
            ..Settings::default()
        },
    ] {
        let solution = problem.solve(&settings).expect("well posed");
        assert_eq!(solution.status, Status::Failed);
        assert!(solution.iterations <= 2);
    }
}

#[test]
fn mistakes_are_named() {
    let mut problem = Problem::new(2);
    problem.inequality([(0, 1.0)], 0.0);
    problem.inequality([(2, 1.0)], 0.0);
    assert!(refused(&problem).contains("inequality 1: there is no variable 2, the problem has 2"));

    problem.clear();
    problem.equality([(1, f64::NAN)], 0.0);
    assert!(refused(&problem).contains("equality 0: the coefficient of variable 1 is NaN"));

    problem.clear();
    problem.bounds(0, f64::NAN, 1.0);
    assert!(refused(&problem).contains("inequality 1: the constant is NaN"));

    problem.clear();
    problem.quadratic(0, 7, 1.0);
    problem.linear(9, 1.0);
    assert!(refused(&problem).contains("P: there is no variable 7"));

    problem.clear();
    problem.quadratic_matrix(Mat::identity(3, 3).as_ref());
    assert!(refused(&problem).contains("P is 3 by 3 for 2 variables"));

    problem.clear();
    problem.semidefinite(
        Mat::identity(3, 3).as_ref(),
        &[(0, Mat::identity(2, 2).as_ref())],
    );
    assert!(refused(&problem).contains("matrices of cone 0"));

    problem.clear();
    let wrong = Settings {
        gap: 0.0,
        ..Settings::default()
    };
    assert!(
        problem
            .solve(&wrong)
            .expect_err("a mistake")
            .to_string()
            .contains("`gap` is 0")
    );
    assert!(refused(&Problem::new(0)).contains("no variables"));
}

/// Data far outside any sensible scale may fail, but ends in a status and never in a panic.
#[test]
fn wild_numbers_end_in_a_status() {
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    for round in 0..60 {
        let mixed = Mixed::new(6, round);
        let mut problem = Problem::new(6);
        let mut wild = || 10f64.powf(rng.random_range(-200.0..200.0));
        mixed.push(&mut problem);
        problem.linear(0, wild());
        problem.quadratic(1, 1, wild());
        problem.inequality([(2, wild()), (3, -wild())], wild());
        let matrices: Vec<Mat<f64>> = (0..6)
            .map(|i| wild() * unit(5, i % 5, (i * i) % 5))
            .collect();
        let terms: Vec<_> = matrices
            .iter()
            .enumerate()
            .map(|(k, a)| (k, a.as_ref()))
            .collect();
        problem.semidefinite((wild() * Mat::<f64>::identity(5, 5)).as_ref(), &terms);
        let solution = problem.solve(&Settings::default()).expect("finite");
        if solution.status == Status::Solved {
            assert!(solution.x.iter().all(|x| x.is_finite()), "round {round}");
        }
    }
}
