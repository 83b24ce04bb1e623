//! Rigid displacements, and the derivatives of rotation vectors.

use nalgebra::{Matrix3, Rotation3, Vector3};

/// A frame in another: turns and shifts points of its own axes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Frame {
    /// rotation
    pub r: Matrix3<f64>,
    /// position, m
    pub p: Vector3<f64>,
}

/// Matrix of the cross product with `v`.
pub fn skew(v: &Vector3<f64>) -> Matrix3<f64> {
    v.cross_matrix()
}

/// `exp(w)`: rotation by the rotation vector `w`, rad.
pub fn exp(w: &Vector3<f64>) -> Matrix3<f64> {
    *Rotation3::new(*w).matrix()
}

/// Rotation vector of a rotation, rad; at most π long.
pub fn log(r: &Matrix3<f64>) -> Vector3<f64> {
    let axis = Vector3::new(
        r[(2, 1)] - r[(1, 2)],
        r[(0, 2)] - r[(2, 0)],
        r[(1, 0)] - r[(0, 1)],
    ) * 0.5;
    let (sine, cosine) = (axis.norm(), 0.5 * (r.trace() - 1.0));
    let angle = sine.atan2(cosine);
    if sine > 1e-9 {
        return axis * (angle / sine);
    }
    if cosine > 0.0 {
        return axis;
    }
    // half a turn: (R + 1)/2 = n nᵀ
    let square = (r + Matrix3::identity()) * 0.5;
    let k = square.diagonal().imax();
    let n = square.column(k) / square[(k, k)].max(1e-12).sqrt();
    n.normalize() * std::f64::consts::PI
}

/// Right Jacobian of the exponential: `exp(w + dw) = exp(w) exp(J_r(w) dw)` to first order.
pub fn right_jacobian(w: &Vector3<f64>) -> Matrix3<f64> {
    let t2 = w.norm_squared();
    let k = skew(w);
    let (a, b) = match t2 < 1e-8 {
        true => (0.5 - t2 / 24.0, 1.0 / 6.0 - t2 / 120.0),
        false => {
            let t = t2.sqrt();
            ((1.0 - t.cos()) / t2, (t - t.sin()) / (t2 * t))
        }
    };
    Matrix3::identity() - k * a + k * k * b
}

/// Inverse of the left Jacobian: `log(exp(dw) exp(e)) = e + J_l⁻¹(e) dw` to first order.
pub fn left_jacobian_inverse(e: &Vector3<f64>) -> Matrix3<f64> {
    let t2 = e.norm_squared();
    let k = skew(e);
    let b = match t2 < 1e-6 {
        true => 1.0 / 12.0 + t2 / 720.0,
        false => {
            let t = t2.sqrt();
            let half = 0.5 * t;
            (1.0 - half * half.cos() / half.sin().max(1e-9)) / t2
        }
    };
    Matrix3::identity() - k * 0.5 + k * k * b
}

impl Frame {
    /// Nothing is turned or shifted.
    pub fn identity() -> Self {
        Frame {
            r: Matrix3::identity(),
            p: Vector3::zeros(),
        }
    }

    /// By position (m) and roll, pitch, yaw (rad).
    pub fn at(p: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Self {
        Frame {
            r: *Rotation3::from_euler_angles(roll, pitch, yaw).matrix(),
            p: p.into(),
        }
    }

    /// A small displacement: shift by the first three numbers, then turn by the rotation vector of the last.
    pub fn small(x: &[f64]) -> Self {
        Frame {
            r: exp(&Vector3::new(x[3], x[4], x[5])),
            p: Vector3::new(x[0], x[1], x[2]),
        }
    }

    /// `self · other`.
    pub fn then(&self, other: &Frame) -> Frame {
        Frame {
            r: self.r * other.r,
            p: self.p + self.r * other.p,
        }
    }

    /// The inverse displacement.
    pub fn inverse(&self) -> Frame {
        let r = self.r.transpose();
        Frame {
            r,
            p: -(r * self.p),
        }
    }

    /// Roll, pitch and yaw, rad.
    pub fn rpy(&self) -> [f64; 3] {
        let (roll, pitch, yaw) = Rotation3::from_matrix_unchecked(self.r).euler_angles();
        [roll, pitch, yaw]
    }
}

/// The rotation nearest to a matrix, by its singular values; and whether the matrix is rather a mirror.
pub fn nearest_rotation(m: &Matrix3<f64>) -> Option<(Matrix3<f64>, bool)> {
    if m.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let svd = m.svd(true, true);
    let (u, vt) = (svd.u?, svd.v_t?);
    let mirrored = (u * vt).determinant() < 0.0;
    let mut d = Matrix3::identity();
    if mirrored {
        // the direction of the smallest singular value is turned about
        let k = svd.singular_values.imin();
        d[(k, k)] = -1.0;
    }
    Some((u * d * vt, mirrored))
}

/// The median of points, coordinate by coordinate, of two middle ones the mean; zero of none. (`crate::median` is a
/// measure of noise and takes one that is there.)
pub fn middle(points: &[Vector3<f64>]) -> Vector3<f64> {
    Vector3::from_fn(|k, _| {
        let mut c: Vec<f64> = points.iter().map(|p| p[k]).collect();
        c.sort_by(f64::total_cmp);
        match c.len() {
            0 => 0.0,
            n if n % 2 == 1 => c[n / 2],
            n => 0.5 * (c[n / 2 - 1] + c[n / 2]),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotation_vectors_and_their_jacobians() {
        for w in [
            Vector3::new(0.3, -0.2, 0.5),
            Vector3::new(1e-6, 2e-6, -1e-6),
            Vector3::new(1.5, 2.0, -1.0),
            Vector3::new(0.0, std::f64::consts::PI, 0.0),
        ] {
            assert!((exp(&log(&exp(&w))) - exp(&w)).norm() < 1e-9);
            let h = 1e-6;
            for k in 0..3 {
                let mut dw = Vector3::zeros();
                dw[k] = h;
                let q = log(&(exp(&(w - dw)).transpose() * exp(&(w + dw)))) / (2.0 * h);
                assert!((q - right_jacobian(&w).column(k)).norm() < 1e-7, "{w} {k}");
                if w.norm() < 2.5 {
                    let q = (log(&(exp(&dw) * exp(&w))) - log(&(exp(&-dw) * exp(&w)))) / (2.0 * h);
                    let exact = left_jacobian_inverse(&w).column(k).into_owned();
                    assert!((q - exact).norm() < 1e-6, "{w} {k}: {q} {exact}");
                }
            }
        }
    }
}
