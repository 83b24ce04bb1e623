//! The map from actuators to joints, `A = D_a⁺` and `G = D A`, sample by sample.

use super::Mechanism;
use super::batch::{Pass, run};
use super::motion::{MechanismMotion, finite};
use crate::dynamics::lanes::{Isa, Lanes};
use nalgebra::DMatrix;

/// `A = D_a⁻¹` by Gram-Schmidt (twice, so that `Q` is orthogonal to rounding) and `G = D A`, in
/// packs: no pivot has to be chosen.
struct ActuationPass<'a, const N: usize> {
    actuated: &'a [usize],
    coordinates: usize,
    count: usize,
    d: *const f64,
    a: *mut f64,
    g: *mut f64,
}

impl<const N: usize> Pass for ActuationPass<'_, N> {
    #[inline(always)]
    unsafe fn pack<L: Lanes>(&self, s: usize) {
        let zero = L::splat(0.0);
        // columns of D_a become Q; R above its diagonal, 1/R on it
        let mut q = [[zero; N]; N];
        let mut r = [[zero; N]; N];
        // SAFETY: by the caller's promise
        unsafe {
            for k in 0..N {
                for (i, &c) in self.actuated.iter().enumerate().take(N) {
                    q[k][i] = L::load(self.d.add((c * N + k) * self.count + s));
                }
            }
        }
        for k in 0..N {
            for _ in 0..2 {
                for j in 0..k {
                    let mut dot = zero;
                    for i in 0..N {
                        dot = dot + q[j][i] * q[k][i];
                    }
                    for i in 0..N {
                        q[k][i] = q[k][i] - q[j][i] * dot;
                    }
                    r[j][k] = r[j][k] + dot;
                }
            }
            let mut norm = zero;
            for i in 0..N {
                norm = norm + q[k][i] * q[k][i];
            }
            r[k][k] = L::splat(1.0) / norm.sqrt();
            for i in 0..N {
                q[k][i] = q[k][i] * r[k][k];
            }
        }
        // rows of A = R⁻¹ Qᵀ replace Q from below
        for k in (0..N).rev() {
            for j in k + 1..N {
                for i in 0..N {
                    q[k][i] = q[k][i] - q[j][i] * r[k][j];
                }
            }
            for i in 0..N {
                q[k][i] = q[k][i] * r[k][k];
            }
        }
        // SAFETY: by the caller's promise
        unsafe {
            for k in 0..N {
                for i in 0..N {
                    q[k][i].store(self.a.add((k * N + i) * self.count + s));
                }
            }
            for c in 0..self.coordinates {
                let mut row = [zero; N];
                for k in 0..N {
                    let d = L::load(self.d.add((c * N + k) * self.count + s));
                    for i in 0..N {
                        row[i] = row[i] + d * q[k][i];
                    }
                }
                for i in 0..N {
                    row[i].store(self.g.add((c * N + i) * self.count + s));
                }
            }
        }
    }
}

/// `(AᵀA)⁻¹Aᵀ` by orthogonal triangularisation with column pivots; not numbers where the columns
/// depend on each other.
fn left_inverse(a: DMatrix<f64>) -> DMatrix<f64> {
    let (rows, columns) = a.shape();
    let singular = DMatrix::from_element(columns, rows, f64::NAN);
    if rows < columns {
        return singular;
    }
    let qr = a.col_piv_qr();
    let (q, r) = (qr.q(), qr.r());
    let pivots = r.diagonal().abs();
    let mut inverse = q.transpose();
    if pivots.min() <= 1e-13 * pivots.max() || !r.solve_upper_triangular_mut(&mut inverse) {
        return singular;
    }
    qr.p().inv_permute_rows(&mut inverse);
    inverse
}

impl Mechanism {
    pub(super) fn actuation<const N: usize>(
        &self,
        isa: Isa,
        count: usize,
        out: &mut MechanismMotion,
    ) {
        let pass = ActuationPass::<N> {
            actuated: &self.actuated,
            coordinates: out.tree.dof,
            count,
            d: out.d.as_ptr(),
            a: out.a.as_mut_ptr(),
            g: out.g.as_mut_ptr(),
        };
        // SAFETY: the arrays were sized for N task coordinates and N actuators
        unsafe { run(isa, &pass, count) }
    }

    /// Any numbers of actuators and freedoms: pseudo-inverse sample by sample.
    pub(super) fn actuation_any(&self, count: usize, out: &mut MechanismMotion) {
        let (n, m, na) = (out.tree.dof, self.freedoms(), self.actuators());
        for s in 0..count {
            let d = DMatrix::from_fn(n, m, |i, k| out.d[(i * m + k) * count + s]);
            let da = DMatrix::from_fn(na, m, |i, k| d[(self.actuated[i], k)]);
            let a = match finite(da.as_slice()) {
                true => left_inverse(da),
                false => DMatrix::from_element(m, na, f64::NAN),
            };
            let g = &d * &a;
            for k in 0..m {
                for i in 0..na {
                    out.a[(k * na + i) * count + s] = a[(k, i)];
                }
            }
            for c in 0..n {
                for i in 0..na {
                    out.g[(c * na + i) * count + s] = g[(c, i)];
                }
            }
        }
    }
}

/// `out_k += Σ_i M_ik x_i` sample by sample.
pub(super) fn contract(
    matrix: &[f64],
    x: &[f64],
    n: usize,
    m: usize,
    count: usize,
    out: &mut [f64],
) {
    for i in 0..n {
        let x = &x[i * count..][..count];
        for k in 0..m {
            let row = &matrix[(i * m + k) * count..][..count];
            let out = &mut out[k * count..][..count];
            for s in 0..count {
                out[s] += row[s] * x[s];
            }
        }
    }
}

/// `out_i += Σ_k M_ik x_k` sample by sample.
pub(super) fn spread(matrix: &[f64], x: &[f64], n: usize, m: usize, count: usize, out: &mut [f64]) {
    for i in 0..n {
        for k in 0..m {
            let row = &matrix[(i * m + k) * count..][..count];
            let x = &x[k * count..][..count];
            let out = &mut out[i * count..][..count];
            for s in 0..count {
                out[s] += row[s] * x[s];
            }
        }
    }
}
