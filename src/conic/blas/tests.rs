//! Every routine against its definition, sizes 1 to 30, all letters, padded leading dimensions.

mod factors;

use super::*;
use faer::MatRef;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const TOLERANCE: f64 = 1e-11;

/// A column-major matrix with padding below each column, that must stay as it is.
#[derive(Clone)]
struct Padded {
    rows: usize,
    cols: usize,
    ld: usize,
    data: Vec<f64>,
}

impl Padded {
    fn new(rows: usize, cols: usize, pad: usize, mut entry: impl FnMut() -> f64) -> Self {
        let ld = rows.max(1) + pad;
        let mut data = vec![PADDING; ld * cols];
        for j in 0..cols {
            data[j * ld..j * ld + rows].fill_with(&mut entry);
        }
        Padded {
            rows,
            cols,
            ld,
            data,
        }
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.data[i + j * self.ld]
    }

    fn op(&self, transposed: bool, i: usize, j: usize) -> f64 {
        if transposed {
            self.at(j, i)
        } else {
            self.at(i, j)
        }
    }

    fn ld(&self) -> c_int {
        self.ld as c_int
    }

    fn assert_padding(&self) {
        for j in 0..self.cols {
            for i in self.rows..self.ld {
                assert_eq!(self.data[i + j * self.ld], PADDING, "padding of column {j}");
            }
        }
    }

    fn assert_eq(&self, expected: impl Fn(usize, usize) -> f64, what: &str) {
        self.assert_padding();
        for j in 0..self.cols {
            for i in 0..self.rows {
                let (found, wanted) = (self.at(i, j), expected(i, j));
                assert!(
                    (found - wanted).abs() <= TOLERANCE * (1.0 + wanted.abs()),
                    "{what}: entry ({i}, {j}) of {} by {} is {found}, not {wanted}",
                    self.rows,
                    self.cols,
                );
            }
        }
    }
}

const PADDING: f64 = 12345.0;

fn rng() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(11)
}

fn random(rng: &mut ChaCha8Rng, rows: usize, cols: usize) -> Padded {
    let pad = rng.random_range(0..4);
    Padded::new(rows, cols, pad, || rng.random_range(-1.0..1.0))
}

/// Output of a routine: NaN where `beta = 0` must not read, else random.
fn output(rng: &mut ChaCha8Rng, rows: usize, cols: usize, beta: f64) -> Padded {
    let mut c = random(rng, rows, cols);
    if beta == 0.0 {
        for j in 0..cols {
            c.data[j * c.ld..j * c.ld + rows].fill(f64::NAN);
        }
    }
    c
}

/// Symmetric with eigenvalues of either sign, or positive definite.
fn symmetric(rng: &mut ChaCha8Rng, n: usize, definite: bool) -> Padded {
    let g = random(rng, n, n);
    let mut a = random(rng, n, n);
    for j in 0..n {
        for i in 0..n {
            a.data[i + j * a.ld] = if definite {
                let gram: f64 = (0..n).map(|l| g.at(i, l) * g.at(j, l)).sum();
                gram + if i == j { 0.1 } else { 0.0 }
            } else {
                g.at(i, j) + g.at(j, i)
            };
        }
    }
    a
}

/// The same with NaN in the triangle that must not be read.
fn one_triangle(a: &Padded, upper: bool) -> Padded {
    let mut half = a.clone();
    for j in 0..a.cols {
        for i in 0..a.rows {
            if i != j && (i < j) != upper {
                half.data[i + j * a.ld] = f64::NAN;
            }
        }
    }
    half
}

fn letter_of(value: u8) -> c_char {
    value as c_char
}

const SCALES: [(f64, f64); 4] = [(1.0, 0.0), (-0.7, 1.0), (2.5, -0.3), (0.0, 0.5)];
const OPS: [(u8, bool); 2] = [(b'N', false), (b'T', true)];
const TRIANGLES: [(u8, bool); 2] = [(b'U', true), (b'L', false)];

#[test]
fn gemm_is_the_product_of_matrices() {
    let mut rng = rng();
    for round in 0..60 {
        let (m, n, k) = (
            1 + round % 30,
            rng.random_range(1..=30),
            rng.random_range(1..=30),
        );
        for (ta, ta_is) in OPS {
            for (tb, tb_is) in OPS {
                for (alpha, beta) in SCALES {
                    let (ra, ca) = if ta_is { (k, m) } else { (m, k) };
                    let (rb, cb) = if tb_is { (n, k) } else { (k, n) };
                    let (a, b) = (random(&mut rng, ra, ca), random(&mut rng, rb, cb));
                    let before = output(&mut rng, m, n, beta);
                    let mut c = before.clone();
                    // SAFETY: the matrices have the dimensions that are passed.
                    unsafe {
                        dgemm_(
                            &letter_of(ta),
                            &letter_of(tb),
                            &(m as c_int),
                            &(n as c_int),
                            &(k as c_int),
                            &alpha,
                            a.data.as_ptr(),
                            &a.ld(),
                            b.data.as_ptr(),
                            &b.ld(),
                            &beta,
                            c.data.as_mut_ptr(),
                            &c.ld(),
                        )
                    };
                    let product = |i: usize, j: usize| {
                        let sum: f64 = (0..k).map(|l| a.op(ta_is, i, l) * b.op(tb_is, l, j)).sum();
                        alpha * sum
                            + if beta == 0.0 {
                                0.0
                            } else {
                                beta * before.at(i, j)
                            }
                    };
                    c.assert_eq(product, "dgemm");
                }
            }
        }
    }
}

#[test]
fn matrix_times_vector_with_any_stride() {
    let mut rng = rng();
    for n in 1..=30 {
        let m = rng.random_range(1..=30);
        for (alpha, beta) in SCALES {
            for (incx, incy) in [(1, 1), (2, 3), (-1, 2), (3, -2)] {
                let a = random(&mut rng, m, n);
                let s = symmetric(&mut rng, n, false);
                for (t, t_is) in OPS {
                    let (rows, cols) = if t_is { (n, m) } else { (m, n) };
                    check_vector(
                        &mut rng,
                        (rows, cols),
                        (incx, incy),
                        (alpha, beta),
                        |x, y| {
                            // SAFETY: the arrays have the dimensions that are passed.
                            unsafe {
                                dgemv_(
                                    &letter_of(t),
                                    &(m as c_int),
                                    &(n as c_int),
                                    &alpha,
                                    a.data.as_ptr(),
                                    &a.ld(),
                                    x.as_ptr(),
                                    &incx,
                                    &beta,
                                    y.as_mut_ptr(),
                                    &incy,
                                )
                            };
                            Box::new(|i, j| a.op(t_is, i, j))
                        },
                    );
                }
                for (uplo, upper) in TRIANGLES {
                    let half = one_triangle(&s, upper);
                    check_vector(&mut rng, (n, n), (incx, incy), (alpha, beta), |x, y| {
                        // SAFETY: the arrays have the dimensions that are passed.
                        unsafe {
                            dsymv_(
                                &letter_of(uplo),
                                &(n as c_int),
                                &alpha,
                                half.data.as_ptr(),
                                &half.ld(),
                                x.as_ptr(),
                                &incx,
                                &beta,
                                y.as_mut_ptr(),
                                &incy,
                            )
                        };
                        Box::new(|i, j| s.at(i, j))
                    });
                }
            }
        }
    }
}

/// Entry (i, j) of a matrix.
type Entry<'a> = Box<dyn Fn(usize, usize) -> f64 + 'a>;

/// Runs `y = alpha A x + beta y` on random strided vectors and compares with the entries of `A`.
fn check_vector<'a>(
    rng: &mut ChaCha8Rng,
    (rows, cols): (usize, usize),
    (incx, incy): (c_int, c_int),
    (alpha, beta): (f64, f64),
    run: impl FnOnce(&[f64], &mut [f64]) -> Entry<'a>,
) {
    let place = |i: usize, n: usize, inc: c_int| {
        let first = if inc < 0 {
            (1 - n as i64) * i64::from(inc)
        } else {
            0
        };
        (first + i as i64 * i64::from(inc)) as usize
    };
    let x: Vec<f64> = (0..cols * 3).map(|_| rng.random_range(-1.0..1.0)).collect();
    let before: Vec<f64> = (0..rows * 3)
        .map(|_| {
            if beta == 0.0 {
                f64::NAN
            } else {
                rng.random_range(-1.0..1.0)
            }
        })
        .collect();
    let mut y = before.clone();
    let entry = run(&x, &mut y);
    let mut touched = vec![false; y.len()];
    for i in 0..rows {
        let at = place(i, rows, incy);
        touched[at] = true;
        let sum: f64 = (0..cols)
            .map(|j| entry(i, j) * x[place(j, cols, incx)])
            .sum();
        let wanted = alpha * sum + if beta == 0.0 { 0.0 } else { beta * before[at] };
        assert!(
            (y[at] - wanted).abs() < TOLERANCE,
            "element {i}: {} and {wanted}",
            y[at]
        );
    }
    for (at, touched) in touched.into_iter().enumerate() {
        assert!(
            touched || y[at].to_bits() == before[at].to_bits(),
            "gap {at} was written"
        );
    }
}

#[test]
fn rank_k_and_rank_2k_updates_write_one_triangle() {
    let mut rng = rng();
    for n in 1..=30 {
        let k = rng.random_range(1..=30);
        for (t, t_is) in OPS {
            for (uplo, upper) in TRIANGLES {
                for (alpha, beta) in SCALES {
                    let (rows, cols) = if t_is { (k, n) } else { (n, k) };
                    let (a, b) = (random(&mut rng, rows, cols), random(&mut rng, rows, cols));
                    let before = output(&mut rng, n, n, beta);
                    let (mut c, mut c2) = (before.clone(), before.clone());
                    let (uplo, t) = (letter_of(uplo), letter_of(t));
                    let (ni, ki) = (n as c_int, k as c_int);
                    // SAFETY: the matrices have the dimensions that are passed.
                    unsafe {
                        dsyrk_(
                            &uplo,
                            &t,
                            &ni,
                            &ki,
                            &alpha,
                            a.data.as_ptr(),
                            &a.ld(),
                            &beta,
                            c.data.as_mut_ptr(),
                            &c.ld(),
                        );
                        dsyr2k_(
                            &uplo,
                            &t,
                            &ni,
                            &ki,
                            &alpha,
                            a.data.as_ptr(),
                            &a.ld(),
                            b.data.as_ptr(),
                            &b.ld(),
                            &beta,
                            c2.data.as_mut_ptr(),
                            &c2.ld(),
                        );
                    }
                    let product = |x: &Padded, y: &Padded, i: usize, j: usize| -> f64 {
                        (0..k).map(|l| x.op(t_is, i, l) * y.op(t_is, j, l)).sum()
                    };
                    for (what, c, sum) in [
                        (
                            "dsyrk",
                            &c,
                            &(|i, j| product(&a, &a, i, j)) as &dyn Fn(usize, usize) -> f64,
                        ),
                        ("dsyr2k", &c2, &|i, j| {
                            product(&a, &b, i, j) + product(&b, &a, i, j)
                        }),
                    ] {
                        c.assert_padding();
                        for j in 0..n {
                            for i in 0..n {
                                let old = before.at(i, j);
                                if (i <= j) == upper || i == j {
                                    let kept = if beta == 0.0 { 0.0 } else { beta * old };
                                    let wanted = alpha * sum(i, j) + kept;
                                    assert!((c.at(i, j) - wanted).abs() < TOLERANCE, "{what}");
                                } else {
                                    assert_eq!(c.at(i, j).to_bits(), old.to_bits(), "{what}");
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}
