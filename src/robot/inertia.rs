//! The ten inertial parameters of a rigid body: **the** definition used everywhere.
//!
//! `phi = [m, mx, my, mz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz]` with `mx = m·cx …` the first moment of
//! mass (kg m) and `I` the inertia tensor **about the origin of the link frame** (kg m²), all in
//! link axes. `Ixy`, `Ixz`, `Iyz` are tensor entries, i.e. minus the products of inertia:
//! `Ixy = -∫ x y dm`. Pinocchio's `toDynamicParameters` holds the same numbers in the order
//! `… Ixx, Ixy, Iyy, Ixz, Iyz, Izz`.

use nalgebra::{Matrix3, Matrix4, SymmetricEigen, Vector3};

/// Number of inertial parameters of a link.
pub const PARAMETERS: usize = 10;

/// Names of the ten, in order, as they appear after the link's name (`link3.mx`).
pub const NAMES: [&str; PARAMETERS] = [
    "m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz",
];

/// Units of the ten.
pub const UNITS: [&str; PARAMETERS] = [
    "kg", "kg m", "kg m", "kg m", "kg m^2", "kg m^2", "kg m^2", "kg m^2", "kg m^2", "kg m^2",
];

/// The ten inertial parameters of one body, about the origin and in the axes of its frame.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Inertia(pub [f64; PARAMETERS]);

/// Mass (kg), centre of mass x, y, z (m), tensor about it (kg m²) xx, xy, xz, yy, yz, zz: what people say of a body, as
/// in `load.json`.
pub type Quantities = [f64; PARAMETERS];

/// Skew-symmetric matrix: `skew(a) b = a × b`.
pub fn skew(a: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

impl Inertia {
    /// From mass (kg), centre of mass (m) and the tensor about the **centre of mass** (kg m²):
    /// `I_O = I_C + m (|c|² 1 − c cᵀ)`.
    pub fn from_com(mass: f64, com: Vector3<f64>, tensor_com: Matrix3<f64>) -> Self {
        let s = skew(&com);
        Self::from_origin(mass, com * mass, tensor_com - s * s * mass)
    }

    /// From mass, first moment (kg m) and the tensor about the **frame origin**.
    pub fn from_origin(mass: f64, first_moment: Vector3<f64>, tensor: Matrix3<f64>) -> Self {
        let (h, i) = (first_moment, tensor);
        Inertia([
            mass, h.x, h.y, h.z, i.m11, i.m12, i.m13, i.m22, i.m23, i.m33,
        ])
    }

    /// Mass, kg.
    pub fn mass(&self) -> f64 {
        self.0[0]
    }

    /// First moment of mass, kg m.
    pub fn first_moment(&self) -> Vector3<f64> {
        Vector3::new(self.0[1], self.0[2], self.0[3])
    }

    /// Inertia tensor about the frame origin, kg m².
    pub fn tensor(&self) -> Matrix3<f64> {
        let p = &self.0;
        Matrix3::new(p[4], p[5], p[6], p[5], p[7], p[8], p[6], p[8], p[9])
    }

    /// Centre of mass, m; `None` for a body without mass.
    pub fn com(&self) -> Option<Vector3<f64>> {
        (self.mass() != 0.0).then(|| self.first_moment() / self.mass())
    }

    /// Inertia tensor about the centre of mass, kg m² (about the origin for a massless body).
    pub fn tensor_com(&self) -> Matrix3<f64> {
        match self.com() {
            Some(c) => {
                let s = skew(&c);
                self.tensor() + s * s * self.mass()
            }
            None => self.tensor(),
        }
    }

    /// Mass, centre of mass, tensor about it: see `Quantities`.
    pub fn quantities(&self) -> Quantities {
        let c = self.com().unwrap_or_else(Vector3::zeros);
        let i = self.tensor_com();
        [
            self.mass(),
            c.x,
            c.y,
            c.z,
            i.m11,
            i.m12,
            i.m13,
            i.m22,
            i.m23,
            i.m33,
        ]
    }

    /// The body with these `Quantities`.
    pub fn from_quantities(v: &Quantities) -> Self {
        let tensor = Matrix3::new(v[4], v[5], v[6], v[5], v[7], v[8], v[6], v[8], v[9]);
        Self::from_com(v[0], Vector3::new(v[1], v[2], v[3]), tensor)
    }

    /// Derivatives of the `Quantities` (rows) by the ten parameters (columns), by central differences: the map is a
    /// rational function of low order.
    pub fn quantity_slopes(&self) -> [Quantities; PARAMETERS] {
        let scale = self.0.iter().fold(0.0f64, |m, v| m.max(v.abs())).max(1e-12);
        let h = 1e-6 * scale;
        let at = |k: usize, step: f64| {
            let mut p = self.0;
            p[k] += step;
            Inertia(p).quantities()
        };
        let columns: [Quantities; PARAMETERS] = std::array::from_fn(|k| {
            let (up, down) = (at(k, h), at(k, -h));
            std::array::from_fn(|i| (up[i] - down[i]) / (2.0 * h))
        });
        std::array::from_fn(|i| std::array::from_fn(|k| columns[k][i]))
    }

    /// This body seen from a parent frame `A`, when this frame `B` sits there with rotation
    /// `R_AB` and origin `p_AB_A`.
    pub fn in_parent(&self, rotation: &Matrix3<f64>, position: &Vector3<f64>) -> Self {
        let m = self.mass();
        let h_b = rotation * self.first_moment();
        let s = skew(position);
        let sh = skew(&h_b);
        let tensor = rotation * self.tensor() * rotation.transpose() - s * sh - sh * s - s * s * m;
        Self::from_origin(m, h_b + position * m, tensor)
    }

    /// Pseudo-inertia matrix (Wensing, Kim & Slotine 2018, eq. 8):
    /// `J = [[½ tr(I) 1 − I, h], [hᵀ, m]]`, positive definite exactly for a body that can exist.
    pub fn pseudo_inertia(&self) -> Matrix4<f64> {
        let i = self.tensor();
        let h = self.first_moment();
        let sigma = Matrix3::identity() * (0.5 * i.trace()) - i;
        let mut j = Matrix4::zeros();
        j.fixed_view_mut::<3, 3>(0, 0).copy_from(&sigma);
        j.fixed_view_mut::<3, 1>(0, 3).copy_from(&h);
        j.fixed_view_mut::<1, 3>(3, 0).copy_from(&h.transpose());
        j[(3, 3)] = self.mass();
        j
    }

    /// Smallest eigenvalue of the tensor about the centre of mass and by how much the triangle
    /// inequality of its principal moments is violated (0 where it holds), both relative to the
    /// largest principal moment. A body can exist when the first is ≥ 0 and the second 0.
    pub fn realizability(&self) -> (f64, f64) {
        let moments = SymmetricEigen::new(self.tensor_com()).eigenvalues;
        let (largest, sum, smallest) = (moments.max(), moments.sum(), moments.min());
        if largest <= 0.0 {
            return (if largest < 0.0 { -1.0 } else { 0.0 }, 0.0);
        }
        (
            smallest / largest,
            ((2.0 * largest - sum) / largest).max(0.0),
        )
    }
}

impl std::ops::Add for Inertia {
    type Output = Inertia;
    /// Two bodies rigidly joined, both expressed in the same frame: parameters add.
    fn add(self, other: Inertia) -> Inertia {
        Inertia(std::array::from_fn(|k| self.0[k] + other.0[k]))
    }
}
