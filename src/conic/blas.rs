//! The eleven BLAS and LAPACK routines that clarabel's semidefinite cones call, in Rust.
//!
//! Clarabel leaves its dense algebra to whatever BLAS the program is linked with. Its matrices are
//! as small as the cone (4×4 for a pseudo-inertia), so plain loops and the sequential faer take that
//! place here, and nothing has to be installed. The routines follow the Fortran conventions: every
//! argument by address, column-major storage with leading dimensions, `beta = 0` writes without
//! reading, `lwork = -1` asks for the size of the workspace, `info = -k` says that argument `k` is
//! wrong. Only what a reference BLAS also accepts is accepted, and of that the job letters that
//! clarabel can send (`dsyevr` computes the whole spectrum, the SVDs do not overwrite `a`).
//!
//! One deliberate difference: where a spectrum or an SVD cannot be computed (the matrix is not
//! finite, or the iteration does not converge), the results are NaN and `info = 0`. Clarabel panics
//! on any other `info`, while a NaN makes it stop with a numerical error, which is a status.
//!
//! **Clash.** The symbols (`dgemm_`, …) are exported from the program under their usual names. If it
//! also links a BLAS statically they are defined twice: turn the cargo feature `conic-blas` off
//! (`default-features = false`), and clarabel uses that BLAS instead.

#![allow(clippy::too_many_arguments)]

use std::ffi::{c_char, c_int};

use lapack::{dgesdd_, dgesv_, dgesvd_, dpotrf_, dpotrs_, dsyevr_};

/// Names every routine, so that a program that calls this one keeps them all: a linker takes from a
/// library only what was asked for before it, and clarabel asks after us.
pub(super) fn keep() {
    std::hint::black_box([
        dgemm_ as *const (),
        dgemv_ as *const (),
        dsymv_ as *const (),
        dsyrk_ as *const (),
        dsyr2k_ as *const (),
        dpotrf_ as *const (),
        dpotrs_ as *const (),
        dgesv_ as *const (),
        dgesdd_ as *const (),
        dgesvd_ as *const (),
        dsyevr_ as *const (),
    ]);
}

/// An argument, if it is valid, or else the end of the routine (with `info`, where it has one).
macro_rules! valid {
    ($argument:expr) => {
        match $argument {
            Some(value) => value,
            None => return,
        }
    };
    ($argument:expr, $info:ident = $number:literal) => {
        match $argument {
            Some(value) => value,
            None => return *$info = $number,
        }
    };
}

mod lapack;
#[cfg(test)]
mod tests;

/// `op(A)` of a column-major matrix.
#[derive(Clone, Copy)]
struct Op<'a> {
    a: &'a [f64],
    ld: usize,
    transposed: bool,
}

impl Op<'_> {
    fn at(&self, i: usize, j: usize) -> f64 {
        if self.transposed {
            self.a[j + i * self.ld]
        } else {
            self.a[i + j * self.ld]
        }
    }
}

/// A letter argument, in upper case.
fn letter(c: &c_char) -> u8 {
    (*c as u8).to_ascii_uppercase()
}

/// Whether a transpose letter transposes; `None` if it is not one.
fn transposed(c: &c_char) -> Option<bool> {
    match letter(c) {
        b'N' => Some(false),
        b'T' | b'C' => Some(true),
        _ => None,
    }
}

/// Whether a triangle letter says upper; `None` if it is not one.
fn is_upper(c: &c_char) -> Option<bool> {
    match letter(c) {
        b'U' => Some(true),
        b'L' => Some(false),
        _ => None,
    }
}

/// A dimension; `None` if negative.
fn dim(n: &c_int) -> Option<usize> {
    usize::try_from(*n).ok()
}

/// A leading dimension for columns of `rows`; `None` if too short.
fn leading(ld: &c_int, rows: usize) -> Option<usize> {
    dim(ld).filter(|&ld| ld >= rows.max(1))
}

/// Number of entries between the first and the last of a column-major matrix.
fn extent(rows: usize, cols: usize, ld: usize) -> usize {
    if rows == 0 || cols == 0 {
        0
    } else {
        ld * (cols - 1) + rows
    }
}

/// The `len` numbers at `p`; empty, whatever `p`, if there are none.
///
/// # Safety
/// `p` is valid for reads of `len` numbers for as long as the slice is used.
unsafe fn slice<'a>(p: *const f64, len: usize) -> &'a [f64] {
    if len == 0 {
        return &[];
    }
    // SAFETY: as promised by the caller.
    unsafe { std::slice::from_raw_parts(p, len) }
}

/// As [`slice`], for writing.
///
/// # Safety
/// `p` is valid for reads and writes of `len` numbers that nobody else uses meanwhile.
unsafe fn slice_mut<'a, T>(p: *mut T, len: usize) -> &'a mut [T] {
    if len == 0 {
        return &mut [];
    }
    // SAFETY: as promised by the caller.
    unsafe { std::slice::from_raw_parts_mut(p, len) }
}

/// `beta · c`, without reading `c` if `beta = 0`.
fn scaled(beta: f64, c: f64) -> f64 {
    if beta == 0.0 { 0.0 } else { beta * c }
}

/// Rows of column `j` that belong to a triangle of order `n`.
fn triangle(upper: bool, j: usize, n: usize) -> std::ops::Range<usize> {
    if upper { 0..j + 1 } else { j..n }
}

/// Position of element `i` of a vector of `n` with stride `inc`, which counts backwards if negative.
fn strided(i: usize, n: usize, inc: c_int) -> usize {
    let step = inc.unsigned_abs() as usize;
    if inc > 0 {
        i * step
    } else {
        (n - 1 - i) * step
    }
}

/// `C = alpha op(A) op(B) + beta C`, `op(A)` is m×k, `op(B)` k×n.
///
/// # Safety
/// The arrays are as large as the dimensions say, and `c` overlaps neither `a` nor `b`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dgemm_(
    transa: &c_char,
    transb: &c_char,
    m: &c_int,
    n: &c_int,
    k: &c_int,
    alpha: &f64,
    a: *const f64,
    lda: &c_int,
    b: *const f64,
    ldb: &c_int,
    beta: &f64,
    c: *mut f64,
    ldc: &c_int,
) {
    let (ta, tb) = (valid!(transposed(transa)), valid!(transposed(transb)));
    let (m, n, k) = (valid!(dim(m)), valid!(dim(n)), valid!(dim(k)));
    let (ra, ca) = if ta { (k, m) } else { (m, k) };
    let (rb, cb) = if tb { (n, k) } else { (k, n) };
    let (lda, ldb, ldc) = (
        valid!(leading(lda, ra)),
        valid!(leading(ldb, rb)),
        valid!(leading(ldc, m)),
    );
    // SAFETY: the caller's arrays have these dimensions and do not overlap.
    let (a, b, c) = unsafe {
        (
            slice(a, extent(ra, ca, lda)),
            slice(b, extent(rb, cb, ldb)),
            slice_mut(c, extent(m, n, ldc)),
        )
    };
    let b = Op {
        a: b,
        ld: ldb,
        transposed: tb,
    };
    if m == 0 {
        return;
    }
    for j in 0..n {
        let column = &mut c[j * ldc..j * ldc + m];
        column.iter_mut().for_each(|c| *c = scaled(*beta, *c));
        if *alpha == 0.0 || k == 0 {
            continue;
        }
        if ta {
            for (i, c) in column.iter_mut().enumerate() {
                let ai = &a[i * lda..i * lda + k];
                *c += alpha
                    * ai.iter()
                        .enumerate()
                        .map(|(l, a)| a * b.at(l, j))
                        .sum::<f64>();
            }
        } else {
            for l in 0..k {
                let t = alpha * b.at(l, j);
                let al = &a[l * lda..l * lda + m];
                column.iter_mut().zip(al).for_each(|(c, a)| *c += t * a);
            }
        }
    }
}

/// `y = alpha op(A) x + beta y`, `A` is m×n.
///
/// # Safety
/// The arrays are as large as the dimensions say, and `y` overlaps neither `a` nor `x`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dgemv_(
    trans: &c_char,
    m: &c_int,
    n: &c_int,
    alpha: &f64,
    a: *const f64,
    lda: &c_int,
    x: *const f64,
    incx: &c_int,
    beta: &f64,
    y: *mut f64,
    incy: &c_int,
) {
    let (t, m, n) = (valid!(transposed(trans)), valid!(dim(m)), valid!(dim(n)));
    let lda = valid!(leading(lda, m));
    // SAFETY: the caller's array has these dimensions.
    let a = unsafe { slice(a, extent(m, n, lda)) };
    let a = Op {
        a,
        ld: lda,
        transposed: t,
    };
    let (rows, cols) = if t { (n, m) } else { (m, n) };
    if m == 0 || n == 0 {
        return;
    }
    // SAFETY: passed on from the caller.
    unsafe {
        multiply(
            rows,
            cols,
            *alpha,
            |i, j| a.at(i, j),
            x,
            *incx,
            *beta,
            y,
            *incy,
        )
    }
}

/// `y = alpha A x + beta y`, `A` symmetric, of which one triangle is read.
///
/// # Safety
/// The arrays are as large as the dimensions say, and `y` overlaps neither `a` nor `x`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dsymv_(
    uplo: &c_char,
    n: &c_int,
    alpha: &f64,
    a: *const f64,
    lda: &c_int,
    x: *const f64,
    incx: &c_int,
    beta: &f64,
    y: *mut f64,
    incy: &c_int,
) {
    let (upper, n) = (valid!(is_upper(uplo)), valid!(dim(n)));
    let lda = valid!(leading(lda, n));
    // SAFETY: the caller's array has these dimensions.
    let a = unsafe { slice(a, extent(n, n, lda)) };
    let at = |i: usize, j: usize| {
        if (i <= j) == upper {
            a[i + j * lda]
        } else {
            a[j + i * lda]
        }
    };
    // SAFETY: passed on from the caller.
    unsafe { multiply(n, n, *alpha, at, x, *incx, *beta, y, *incy) }
}

/// `y = alpha A x + beta y` with `A` given entry by entry.
///
/// # Safety
/// `x` has `cols` numbers at stride `incx` and `y` has `rows` at stride `incy`, without overlap.
unsafe fn multiply(
    rows: usize,
    cols: usize,
    alpha: f64,
    at: impl Fn(usize, usize) -> f64,
    x: *const f64,
    incx: c_int,
    beta: f64,
    y: *mut f64,
    incy: c_int,
) {
    if rows == 0 || cols == 0 || incx == 0 || incy == 0 {
        return;
    }
    // SAFETY: the last element of a strided vector is the one farthest from its address.
    let (x, y) = unsafe {
        (
            slice(x, 1 + (cols - 1) * incx.unsigned_abs() as usize),
            slice_mut(y, 1 + (rows - 1) * incy.unsigned_abs() as usize),
        )
    };
    for i in 0..rows {
        let y = &mut y[strided(i, rows, incy)];
        *y = scaled(beta, *y);
        if alpha != 0.0 {
            *y += alpha
                * (0..cols)
                    .map(|j| at(i, j) * x[strided(j, cols, incx)])
                    .sum::<f64>();
        }
    }
}

/// `C = alpha op(A) op(A)ᵀ + beta C`, one triangle of the symmetric n×n `C`; `op(A)` is n×k.
///
/// # Safety
/// The arrays are as large as the dimensions say, and `c` does not overlap `a`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dsyrk_(
    uplo: &c_char,
    trans: &c_char,
    n: &c_int,
    k: &c_int,
    alpha: &f64,
    a: *const f64,
    lda: &c_int,
    beta: &f64,
    c: *mut f64,
    ldc: &c_int,
) {
    // SAFETY: passed on from the caller; ½ (A Aᵀ + A Aᵀ) is A Aᵀ, and both are read only.
    unsafe {
        dsyr2k_(
            uplo,
            trans,
            n,
            k,
            &(0.5 * alpha),
            a,
            lda,
            a,
            lda,
            beta,
            c,
            ldc,
        )
    }
}

/// `C = alpha (op(A) op(B)ᵀ + op(B) op(A)ᵀ) + beta C`, one triangle of the symmetric n×n `C`.
///
/// # Safety
/// The arrays are as large as the dimensions say, and `c` overlaps neither `a` nor `b`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dsyr2k_(
    uplo: &c_char,
    trans: &c_char,
    n: &c_int,
    k: &c_int,
    alpha: &f64,
    a: *const f64,
    lda: &c_int,
    b: *const f64,
    ldb: &c_int,
    beta: &f64,
    c: *mut f64,
    ldc: &c_int,
) {
    let (upper, t) = (valid!(is_upper(uplo)), valid!(transposed(trans)));
    let (n, k) = (valid!(dim(n)), valid!(dim(k)));
    let (rows, cols) = if t { (k, n) } else { (n, k) };
    let (lda, ldb, ldc) = (
        valid!(leading(lda, rows)),
        valid!(leading(ldb, rows)),
        valid!(leading(ldc, n)),
    );
    // SAFETY: the caller's arrays have these dimensions, and `c` overlaps neither of the others.
    let (a, b, c) = unsafe {
        (
            slice(a, extent(rows, cols, lda)),
            slice(b, extent(rows, cols, ldb)),
            slice_mut(c, extent(n, n, ldc)),
        )
    };
    let (a, b) = (
        Op {
            a,
            ld: lda,
            transposed: t,
        },
        Op {
            a: b,
            ld: ldb,
            transposed: t,
        },
    );
    for j in 0..n {
        for i in triangle(upper, j, n) {
            let c = &mut c[i + j * ldc];
            *c = scaled(*beta, *c);
            if *alpha != 0.0 {
                let entry = |l| a.at(i, l) * b.at(j, l) + b.at(i, l) * a.at(j, l);
                *c += alpha * (0..k).map(entry).sum::<f64>();
            }
        }
    }
}
