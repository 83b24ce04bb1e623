//! Factors, singular values and eigenvalues.

use super::*;

#[test]
fn cholesky_factors_solve_and_report_the_first_bad_minor() {
    let mut rng = rng();
    for n in 1..=30 {
        for (uplo, upper) in TRIANGLES {
            let a = symmetric(&mut rng, n, true);
            let mut factor = one_triangle(&a, upper);
            let untouched = factor.clone();
            let (uplo, ni) = (letter_of(uplo), n as c_int);
            let mut info = 7;
            // SAFETY: the matrix has the dimensions that are passed.
            unsafe {
                dpotrf_(
                    &uplo,
                    &ni,
                    factor.data.as_mut_ptr(),
                    &factor.ld(),
                    &mut info,
                )
            };
            assert_eq!(info, 0);
            factor.assert_padding();
            let l = |i: usize, j: usize| match i >= j {
                true => factor.op(upper, i, j),
                false => 0.0,
            };
            for j in 0..n {
                for i in 0..n {
                    let product: f64 = (0..n).map(|k| l(i, k) * l(j, k)).sum();
                    assert!(
                        (product - a.at(i, j)).abs() < TOLERANCE,
                        "L Lᵀ at ({i}, {j})"
                    );
                    if i != j && (i < j) != upper {
                        let (now, then) = (factor.at(i, j), untouched.at(i, j));
                        assert_eq!(now.to_bits(), then.to_bits(), "the other triangle");
                    }
                }
            }

            let rhs = random(&mut rng, n, 1 + n % 4);
            let mut x = rhs.clone();
            // SAFETY: the matrices have the dimensions that are passed.
            unsafe {
                dpotrs_(
                    &uplo,
                    &ni,
                    &(x.cols as c_int),
                    factor.data.as_ptr(),
                    &factor.ld(),
                    x.data.as_mut_ptr(),
                    &x.ld(),
                    &mut info,
                )
            };
            assert_eq!(info, 0);
            x.assert_padding();
            for c in 0..x.cols {
                for i in 0..n {
                    let product: f64 = (0..n).map(|j| a.at(i, j) * x.at(j, c)).sum();
                    assert!((product - rhs.at(i, c)).abs() < 1e-8, "A x at ({i}, {c})");
                }
            }

            for bad_value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
                let bad = rng.random_range(0..n);
                let mut a = symmetric(&mut rng, n, true);
                a.data[bad + bad * a.ld] = bad_value;
                // SAFETY: the matrix has the dimensions that are passed.
                unsafe { dpotrf_(&uplo, &ni, a.data.as_mut_ptr(), &a.ld(), &mut info) };
                assert_eq!(
                    info,
                    bad as c_int + 1,
                    "diagonal {bad} of {n} is {bad_value}"
                );
            }
        }
    }
}

#[test]
fn lu_solves_permuted_systems_and_reports_singular_ones() {
    let mut rng = rng();
    for n in 1..=30 {
        let mut a = random(&mut rng, n, n);
        // without pivoting this one would divide by zero
        a.data[0] = if n > 1 { 0.0 } else { 0.5 };
        let rhs = random(&mut rng, n, 1 + n % 3);
        let (mut lu, mut x, mut pivots, mut info) = (a.clone(), rhs.clone(), vec![0; n], 7);
        let solve = |lu: &mut Padded, x: &mut Padded, pivots: &mut Vec<c_int>, info: &mut c_int| {
            // SAFETY: the matrices have the dimensions that are passed.
            unsafe {
                dgesv_(
                    &(n as c_int),
                    &(x.cols as c_int),
                    lu.data.as_mut_ptr(),
                    &lu.ld(),
                    pivots.as_mut_ptr(),
                    x.data.as_mut_ptr(),
                    &x.ld(),
                    info,
                )
            }
        };
        solve(&mut lu, &mut x, &mut pivots, &mut info);
        assert_eq!(info, 0);
        lu.assert_padding();
        x.assert_padding();
        for c in 0..x.cols {
            for i in 0..n {
                let product: f64 = (0..n).map(|j| a.at(i, j) * x.at(j, c)).sum();
                assert!((product - rhs.at(i, c)).abs() < 1e-9, "A x at ({i}, {c})");
            }
        }
        // P A = L U, from the factors themselves
        let mut rows: Vec<usize> = (0..n).collect();
        (0..n).for_each(|j| rows.swap(j, pivots[j] as usize - 1));
        for j in 0..n {
            for (i, &row) in rows.iter().enumerate() {
                let l = |k: usize| if k == i { 1.0 } else { lu.at(i, k) };
                let product: f64 = (0..=i.min(j)).map(|k| l(k) * lu.at(k, j)).sum();
                assert!(
                    (product - a.at(row, j)).abs() < TOLERANCE,
                    "L U at ({i}, {j})"
                );
                assert!(
                    i <= j || lu.at(i, j).abs() <= 1.0,
                    "pivot {j} is not the largest"
                );
            }
        }

        let zero = rng.random_range(0..n);
        let mut singular = a.clone();
        singular.data[zero * a.ld..zero * a.ld + n].fill(0.0);
        solve(&mut singular, &mut rhs.clone(), &mut pivots, &mut info);
        assert_eq!(info, zero as c_int + 1, "column {zero} of {n} is zero");
    }
}

/// Which of the two routines, and the job letter.
fn run_svd(
    divide: bool,
    job: u8,
    a: &mut Padded,
    s: &mut [f64],
    u: &mut Padded,
    vt: &mut Padded,
    room: Option<usize>,
) -> c_int {
    let (m, n) = (a.rows as c_int, a.cols as c_int);
    let (job, mut info, mut work) = (letter_of(job), 7, vec![0.0; 1]);
    let mut iwork = vec![0; 8 * a.rows.min(a.cols)];
    let mut call = |work: &mut [f64], lwork: c_int, info: &mut c_int| {
        let (lda, ldu, ldvt) = (a.ld(), u.ld(), vt.ld());
        let (a, s, u, vt) = (
            a.data.as_mut_ptr(),
            s.as_mut_ptr(),
            u.data.as_mut_ptr(),
            vt.data.as_mut_ptr(),
        );
        let (work, iwork) = (work.as_mut_ptr(), iwork.as_mut_ptr());
        // SAFETY: the matrices and the workspace have the sizes that are passed.
        unsafe {
            if divide {
                dgesdd_(
                    &job, &m, &n, a, &lda, s, u, &ldu, vt, &ldvt, work, &lwork, iwork, info,
                )
            } else {
                dgesvd_(
                    &job, &job, &m, &n, a, &lda, s, u, &ldu, vt, &ldvt, work, &lwork, info,
                )
            }
        }
    };
    call(&mut work, -1, &mut info);
    assert_eq!(info, 0);
    work.resize(room.unwrap_or(work[0] as usize), 0.0);
    let lwork = work.len() as c_int;
    call(&mut work, lwork, &mut info);
    info
}

#[test]
fn svd_rebuilds_the_matrix_from_orthonormal_vectors() {
    let mut rng = rng();
    let mut sizes: Vec<(usize, usize)> = (1..=30).map(|n| (n, n)).collect();
    sizes.extend((1..=30).map(|m| (m, rng.random_range(1..=30))));
    for (m, n) in sizes {
        let k = m.min(n);
        for divide in [true, false] {
            for job in [b'S', b'A', b'N'] {
                let a = random(&mut rng, m, n);
                let (nu, nv) = match job {
                    b'S' => (k, k),
                    b'A' => (m, n),
                    _ => (0, 0),
                };
                let (mut u, mut vt) = (random(&mut rng, m, nu), random(&mut rng, nv, n));
                let mut s = vec![0.0; k];
                let info = run_svd(divide, job, &mut a.clone(), &mut s, &mut u, &mut vt, None);
                assert_eq!(info, 0);
                assert!(
                    s.windows(2).all(|w| w[0] >= w[1]) && s[k - 1] >= 0.0,
                    "order of {s:?}"
                );
                u.assert_padding();
                vt.assert_padding();

                let view = MatRef::from_column_major_slice_with_stride(&a.data, m, n, a.ld);
                let reference = view.singular_values().expect("finite");
                for (s, r) in s.iter().zip(&reference) {
                    assert!((s - r).abs() < TOLERANCE, "{s} and {r}");
                }
                for j in 0..nu {
                    for i in 0..nu {
                        let dot: f64 = (0..m).map(|l| u.at(l, i) * u.at(l, j)).sum();
                        assert!((dot - f64::from(i == j)).abs() < TOLERANCE, "UᵀU");
                    }
                }
                for j in 0..nv {
                    for i in 0..nv {
                        let dot: f64 = (0..n).map(|l| vt.at(i, l) * vt.at(j, l)).sum();
                        assert!((dot - f64::from(i == j)).abs() < TOLERANCE, "VᵀV");
                    }
                }
                if nu > 0 {
                    let usv = |i: usize, j: usize| -> f64 {
                        (0..k).map(|l| u.at(i, l) * s[l] * vt.at(l, j)).sum()
                    };
                    a.assert_eq(usv, "U diag(s) Vᵀ");
                }
            }
        }
    }
}

fn run_eigen(
    job: u8,
    uplo: u8,
    a: &mut Padded,
    w: &mut [f64],
    z: &mut Padded,
    room: Option<usize>,
) -> (c_int, c_int, Vec<c_int>) {
    let n = a.rows as c_int;
    let (mut m, mut info, mut support) = (7, 7, vec![0; 2 * a.rows]);
    let (mut work, mut iwork) = (vec![0.0; 1], vec![0; 1]);
    for query in [true, false] {
        let (lwork, liwork) = match query {
            true => (-1, -1),
            false => (work.len() as c_int, iwork.len() as c_int),
        };
        // SAFETY: the matrices and the workspace have the sizes that are passed.
        unsafe {
            dsyevr_(
                &letter_of(job),
                &letter_of(b'A'),
                &letter_of(uplo),
                &n,
                a.data.as_mut_ptr(),
                &a.ld(),
                &0.0,
                &0.0,
                &0,
                &0,
                &-1.0,
                &mut m,
                w.as_mut_ptr(),
                z.data.as_mut_ptr(),
                &z.ld(),
                support.as_mut_ptr(),
                work.as_mut_ptr(),
                &lwork,
                iwork.as_mut_ptr(),
                &liwork,
                &mut info,
            )
        };
        if query {
            assert_eq!(info, 0);
            work.resize(room.unwrap_or(work[0] as usize), 0.0);
            iwork.resize(iwork[0] as usize, 0);
        }
    }
    (info, m, support)
}

#[test]
fn eigenvalues_rise_and_vectors_diagonalise() {
    let mut rng = rng();
    for n in 1..=30 {
        for (uplo, upper) in TRIANGLES {
            for job in [b'N', b'V'] {
                let a = symmetric(&mut rng, n, false);
                let mut half = one_triangle(&a, upper);
                let mut z = random(&mut rng, n, if job == b'V' { n } else { 1 });
                let (before, mut w) = (z.clone(), vec![0.0; n]);
                let (info, m, support) = run_eigen(job, uplo, &mut half, &mut w, &mut z, None);
                assert_eq!((info, m), (0, n as c_int));
                half.assert_padding();
                z.assert_padding();
                let view = MatRef::from_column_major_slice_with_stride(&a.data, n, n, a.ld);
                let reference = view
                    .self_adjoint_eigenvalues(faer::Side::Lower)
                    .expect("finite");
                for (w, r) in w.iter().zip(&reference) {
                    assert!((w - r).abs() < TOLERANCE, "{w} and {r}");
                }
                if job == b'N' {
                    assert_eq!(z.data, before.data);
                    continue;
                }
                assert!(support.chunks(2).all(|s| s == [1, n as c_int]));
                for (j, w) in w.iter().enumerate() {
                    for i in 0..n {
                        let az: f64 = (0..n).map(|l| a.at(i, l) * z.at(l, j)).sum();
                        assert!((az - w * z.at(i, j)).abs() < TOLERANCE, "A z = w z");
                        let dot: f64 = (0..n).map(|l| z.at(l, i) * z.at(l, j)).sum();
                        assert!((dot - f64::from(i == j)).abs() < TOLERANCE, "ZᵀZ");
                    }
                }
            }
        }
    }
}

#[test]
fn what_is_not_finite_gives_nan_and_no_error() {
    let mut rng = rng();
    for n in [4, 7] {
        for value in [f64::NAN, f64::INFINITY] {
            let mut a = symmetric(&mut rng, n, true);
            a.data[1 + 2 * a.ld] = value;
            let (mut w, mut z) = (vec![0.0; n], random(&mut rng, n, n));
            let (info, ..) = run_eigen(b'V', b'U', &mut a.clone(), &mut w, &mut z, None);
            assert!(info == 0 && w.iter().all(|w| w.is_nan()));
            z.assert_padding();
            let (mut u, mut vt) = (random(&mut rng, n, n), random(&mut rng, n, n));
            let info = run_svd(true, b'S', &mut a, &mut w, &mut u, &mut vt, None);
            assert!(info == 0 && w.iter().all(|w| w.is_nan()));
            assert!(u.at(0, 0).is_nan() && vt.at(n - 1, n - 1).is_nan());
            u.assert_padding();
            vt.assert_padding();
        }
    }
}

#[test]
fn wrong_arguments_are_numbered() {
    let mut rng = rng();
    let a = symmetric(&mut rng, 4, true);
    let (mut w, mut z, mut vt) = (vec![0.0; 4], a.clone(), a.clone());
    assert_eq!(
        run_eigen(b'V', b'U', &mut a.clone(), &mut w, &mut z, Some(1)).0,
        -18
    );
    assert_eq!(
        run_svd(true, b'S', &mut a.clone(), &mut w, &mut z, &mut vt, Some(1)),
        -12
    );
    assert_eq!(
        run_svd(
            false,
            b'S',
            &mut a.clone(),
            &mut w,
            &mut z,
            &mut vt,
            Some(1)
        ),
        -13
    );

    let mut info = 0;
    let mut factor = a.clone();
    for (uplo, n, ld, wanted) in [(b'X', 4, 4, -1), (b'U', -1, 4, -2), (b'L', 4, 3, -4)] {
        // SAFETY: the arguments are wrong, and the array is not touched.
        unsafe {
            dpotrf_(
                &letter_of(uplo),
                &n,
                factor.data.as_mut_ptr(),
                &ld,
                &mut info,
            )
        };
        assert_eq!(info, wanted);
    }
    assert_eq!(factor.data, a.data);
}
