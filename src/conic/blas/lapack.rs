//! The LAPACK half: factorisations, by plain loops, and spectra, by faer.

use std::ffi::{c_char, c_int};
use std::mem::MaybeUninit;

use faer::dyn_stack::{MemStack, StackReq};
use faer::linalg::evd::{self, ComputeEigenvectors};
use faer::linalg::svd::{self, ComputeSvdVectors};
use faer::{ColMut, MatMut, MatRef, Par};

use super::{Op, dim, extent, is_upper, leading, letter, slice, slice_mut, triangle};

/// Cholesky factor in place: `A = L Lᵀ` (lower) or `A = Uᵀ U` (upper); the other triangle is left
/// as it is. `info = j`: the leading minor of order `j` is not positive (or not finite).
///
/// # Safety
/// `a` is as large as the dimensions say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dpotrf_(
    uplo: &c_char,
    n: &c_int,
    a: *mut f64,
    lda: &c_int,
    info: &mut c_int,
) {
    let upper = valid!(is_upper(uplo), info = -1);
    let n = valid!(dim(n), info = -2);
    let ld = valid!(leading(lda, n), info = -4);
    // SAFETY: the caller's array has these dimensions.
    let a = unsafe { slice_mut(a, extent(n, n, ld)) };
    // entry (i, j), i ≥ j, of the lower factor
    let at = |i: usize, j: usize| if upper { j + i * ld } else { i + j * ld };
    *info = 0;
    for j in 0..n {
        for i in j..n {
            let sum: f64 = (0..j).map(|l| a[at(i, l)] * a[at(j, l)]).sum();
            let rest = a[at(i, j)] - sum;
            if i > j {
                a[at(i, j)] = rest / a[at(j, j)];
            } else if rest > 0.0 && rest.is_finite() {
                a[at(j, j)] = rest.sqrt();
            } else {
                return *info = j as c_int + 1;
            }
        }
    }
}

/// Solves `A X = B` with the factor of [`dpotrf_`]; `X` replaces `B`.
///
/// # Safety
/// The arrays are as large as the dimensions say and do not overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dpotrs_(
    uplo: &c_char,
    n: &c_int,
    nrhs: &c_int,
    a: *const f64,
    lda: &c_int,
    b: *mut f64,
    ldb: &c_int,
    info: &mut c_int,
) {
    let upper = valid!(is_upper(uplo), info = -1);
    let n = valid!(dim(n), info = -2);
    let nrhs = valid!(dim(nrhs), info = -3);
    let lda = valid!(leading(lda, n), info = -5);
    let ldb = valid!(leading(ldb, n), info = -7);
    // SAFETY: the caller's arrays have these dimensions and do not overlap.
    let (a, b) = unsafe {
        (
            slice(a, extent(n, n, lda)),
            slice_mut(b, extent(n, nrhs, ldb)),
        )
    };
    let l = Op {
        a,
        ld: lda,
        transposed: upper,
    };
    *info = 0;
    if n == 0 {
        return;
    }
    for r in 0..nrhs {
        let x = &mut b[r * ldb..r * ldb + n];
        for i in 0..n {
            let sum: f64 = (0..i).map(|j| l.at(i, j) * x[j]).sum();
            x[i] = (x[i] - sum) / l.at(i, i);
        }
        for i in (0..n).rev() {
            let sum: f64 = (i + 1..n).map(|j| l.at(j, i) * x[j]).sum();
            x[i] = (x[i] - sum) / l.at(i, i);
        }
    }
}

/// Solves `A X = B` by LU with row pivoting; the factors replace `A`, `X` replaces `B`.
/// `info = j`: the pivot `j` is zero and nothing was solved.
///
/// # Safety
/// The arrays are as large as the dimensions say and do not overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dgesv_(
    n: &c_int,
    nrhs: &c_int,
    a: *mut f64,
    lda: &c_int,
    ipiv: *mut c_int,
    b: *mut f64,
    ldb: &c_int,
    info: &mut c_int,
) {
    let n = valid!(dim(n), info = -1);
    let nrhs = valid!(dim(nrhs), info = -2);
    let lda = valid!(leading(lda, n), info = -4);
    let ldb = valid!(leading(ldb, n), info = -7);
    // SAFETY: the caller's arrays have these dimensions and do not overlap.
    let (a, b, ipiv) = unsafe {
        (
            slice_mut(a, extent(n, n, lda)),
            slice_mut(b, extent(n, nrhs, ldb)),
            slice_mut(ipiv, n),
        )
    };
    *info = 0;
    for j in 0..n {
        let larger = |p: usize, i: usize| {
            if a[i + j * lda].abs() > a[p + j * lda].abs() {
                i
            } else {
                p
            }
        };
        let p = (j..n).fold(j, larger);
        ipiv[j] = p as c_int + 1;
        if a[p + j * lda] == 0.0 {
            if *info == 0 {
                *info = j as c_int + 1;
            }
            continue;
        }
        if p != j {
            (0..n).for_each(|c| a.swap(j + c * lda, p + c * lda));
        }
        for i in j + 1..n {
            a[i + j * lda] /= a[j + j * lda];
            let factor = a[i + j * lda];
            for c in j + 1..n {
                a[i + c * lda] -= factor * a[j + c * lda];
            }
        }
    }
    if *info != 0 || n == 0 {
        return;
    }
    for r in 0..nrhs {
        let x = &mut b[r * ldb..r * ldb + n];
        (0..n).for_each(|j| x.swap(j, ipiv[j] as usize - 1));
        for i in 0..n {
            let sum: f64 = (0..i).map(|j| a[i + j * lda] * x[j]).sum();
            x[i] -= sum;
        }
        for i in (0..n).rev() {
            let sum: f64 = (i + 1..n).map(|j| a[i + j * lda] * x[j]).sum();
            x[i] = (x[i] - sum) / a[i + i * lda];
        }
    }
}

/// SVD `A = U diag(s) Vᵀ` of an m×n matrix, singular values falling. `jobz`: `S` the first
/// `min(m, n)` vectors, `A` all, `N` none.
///
/// # Safety
/// The arrays are as large as the dimensions and `lwork` say and do not overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dgesdd_(
    jobz: &c_char,
    m: &c_int,
    n: &c_int,
    a: *mut f64,
    lda: &c_int,
    s: *mut f64,
    u: *mut f64,
    ldu: &c_int,
    vt: *mut f64,
    ldvt: &c_int,
    work: *mut f64,
    lwork: &c_int,
    _iwork: *mut c_int,
    info: &mut c_int,
) {
    // SAFETY: passed on from the caller.
    unsafe {
        dgesvd_(
            jobz, jobz, m, n, a, lda, s, u, ldu, vt, ldvt, work, lwork, info,
        )
    }
    // one job letter here, two there
    if *info < -1 {
        *info += 1;
    }
}

/// As [`dgesdd_`], with a job letter each for `U` and `Vᵀ`. `A` is left as it is.
///
/// # Safety
/// The arrays are as large as the dimensions and `lwork` say and do not overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dgesvd_(
    jobu: &c_char,
    jobvt: &c_char,
    m: &c_int,
    n: &c_int,
    a: *mut f64,
    lda: &c_int,
    s: *mut f64,
    u: *mut f64,
    ldu: &c_int,
    vt: *mut f64,
    ldvt: &c_int,
    work: *mut f64,
    lwork: &c_int,
    info: &mut c_int,
) {
    let vectors = |job| match letter(job) {
        b'N' => Some(ComputeSvdVectors::No),
        b'S' => Some(ComputeSvdVectors::Thin),
        b'A' => Some(ComputeSvdVectors::Full),
        _ => None,
    };
    let count = |job, full: usize, thin: usize| match job {
        ComputeSvdVectors::No => 0,
        ComputeSvdVectors::Thin => thin,
        ComputeSvdVectors::Full => full,
    };
    let jobu = valid!(vectors(jobu), info = -1);
    let jobvt = valid!(vectors(jobvt), info = -2);
    let m = valid!(dim(m), info = -3);
    let n = valid!(dim(n), info = -4);
    let k = m.min(n);
    let (nu, nv) = (count(jobu, m, k), count(jobvt, n, k));
    let lda = valid!(leading(lda, m), info = -6);
    let ldu = valid!(leading(ldu, if nu == 0 { 0 } else { m }), info = -9);
    let ldvt = valid!(leading(ldvt, nv), info = -11);
    let need = svd::svd_scratch::<f64>(m, n, jobu, jobvt, Par::Seq, Default::default());
    *info = 0;
    // SAFETY: the caller's workspace has `lwork` numbers, or one for a query.
    let Some(stack) = (unsafe { workspace(need, work, *lwork) }) else {
        return *info = if *lwork == -1 { 0 } else { -13 };
    };
    // SAFETY: the caller's arrays have these dimensions and do not overlap.
    let (a, s, u, vt) = unsafe {
        (
            slice(a, extent(m, n, lda)),
            slice_mut(s, k),
            slice_mut(u, extent(m, nu, ldu)),
            slice_mut(vt, extent(nv, n, ldvt)),
        )
    };
    if k == 0 {
        return;
    }
    let finite = a
        .chunks(lda)
        .all(|column| column[..m].iter().all(|v| v.is_finite()));
    // where faer completes a basis it expects zeros
    fill(u, m, ldu, 0.0);
    fill(vt, nv, ldvt, 0.0);
    let done = finite && {
        let a = MatRef::from_column_major_slice_with_stride(a, m, n, lda);
        let u =
            (nu > 0).then(|| MatMut::from_column_major_slice_with_stride_mut(&mut *u, m, nu, ldu));
        let v = (nv > 0).then(|| {
            MatMut::from_column_major_slice_with_stride_mut(&mut *vt, nv, n, ldvt).transpose_mut()
        });
        let s = ColMut::from_slice_mut(&mut *s).as_diagonal_mut();
        svd::svd(a, s, u, v, Par::Seq, stack, Default::default()).is_ok()
    };
    if !done {
        s.fill(f64::NAN);
        fill(u, m, ldu, f64::NAN);
        fill(vt, nv, ldvt, f64::NAN);
    }
}

/// Eigenvalues (rising) and, with `jobz = V`, eigenvectors of a symmetric matrix of which one
/// triangle is read. `range` must be `A`, all of them; the triangle is overwritten.
///
/// # Safety
/// The arrays are as large as the dimensions, `lwork` and `liwork` say and do not overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dsyevr_(
    jobz: &c_char,
    range: &c_char,
    uplo: &c_char,
    n: &c_int,
    a: *mut f64,
    lda: &c_int,
    _vl: &f64,
    _vu: &f64,
    _il: &c_int,
    _iu: &c_int,
    _abstol: &f64,
    m: &mut c_int,
    w: *mut f64,
    z: *mut f64,
    ldz: &c_int,
    isuppz: *mut c_int,
    work: *mut f64,
    lwork: &c_int,
    iwork: *mut c_int,
    liwork: &c_int,
    info: &mut c_int,
) {
    let vectors = match letter(jobz) {
        b'N' => ComputeEigenvectors::No,
        b'V' => ComputeEigenvectors::Yes,
        _ => return *info = -1,
    };
    if letter(range) != b'A' {
        return *info = -2;
    }
    let upper = valid!(is_upper(uplo), info = -3);
    let n = valid!(dim(n), info = -4);
    let nz = if vectors == ComputeEigenvectors::Yes {
        n
    } else {
        0
    };
    let lda = valid!(leading(lda, n), info = -6);
    let ldz = valid!(leading(ldz, nz), info = -15);
    let need = evd::self_adjoint_evd_scratch::<f64>(n, vectors, Par::Seq, Default::default());
    *info = 0;
    if *lwork == -1 || *liwork == -1 {
        // SAFETY: a query has room for one number in each workspace.
        unsafe {
            workspace(need, work, -1);
            *iwork = 1;
        }
        return;
    }
    // SAFETY: the caller's workspace has `lwork` numbers.
    let stack = valid!(unsafe { workspace(need, work, *lwork) }, info = -18);
    // SAFETY: the caller's arrays have these dimensions and do not overlap.
    let (a, w, z, support) = unsafe {
        (
            slice_mut(a, extent(n, n, lda)),
            slice_mut(w, n),
            slice_mut(z, extent(n, nz, ldz)),
            slice_mut(isuppz, 2 * nz),
        )
    };
    *m = n as c_int;
    support
        .chunks_exact_mut(2)
        .for_each(|s| s.copy_from_slice(&[1, n as c_int]));
    if n == 0 {
        return;
    }
    let mut finite = true;
    for j in 0..n {
        for i in triangle(upper, j, n) {
            finite &= a[i + j * lda].is_finite();
            // faer reads the lower triangle
            if upper {
                a[j + i * lda] = a[i + j * lda];
            }
        }
    }
    let done = finite && {
        let a = MatRef::from_column_major_slice_with_stride(a, n, n, lda);
        let w = ColMut::from_slice_mut(&mut *w).as_diagonal_mut();
        let z =
            (nz > 0).then(|| MatMut::from_column_major_slice_with_stride_mut(&mut *z, n, nz, ldz));
        evd::self_adjoint_evd(a, w, z, Par::Seq, stack, Default::default()).is_ok()
    };
    if !done {
        w.fill(f64::NAN);
        fill(z, n, ldz, f64::NAN);
    }
}

/// The caller's workspace as faer's stack; `None` if it is too small or if this is a query
/// (`lwork = -1`), which writes the size that is needed.
///
/// # Safety
/// `work` has `lwork` numbers that nobody else uses meanwhile, one if `lwork = -1`.
unsafe fn workspace<'a>(need: StackReq, work: *mut f64, lwork: c_int) -> Option<&'a mut MemStack> {
    // the stack may start anywhere, and is aligned inside
    let bytes = need.unaligned_bytes_required();
    let numbers = bytes.div_ceil(size_of::<f64>()).max(1);
    if lwork == -1 {
        // SAFETY: a query has room for one number.
        unsafe { *work = numbers as f64 };
        return None;
    }
    let size = dim(&lwork).filter(|&size| size >= numbers)?;
    // SAFETY: the caller's `size` numbers as raw bytes; any byte pattern is a number again after.
    let bytes = unsafe { slice_mut(work.cast::<MaybeUninit<u8>>(), size * size_of::<f64>()) };
    Some(MemStack::new(bytes))
}

/// Sets all entries of a column-major matrix.
fn fill(a: &mut [f64], rows: usize, ld: usize, value: f64) {
    a.chunks_mut(ld)
        .for_each(|column| column[..rows].fill(value));
}
