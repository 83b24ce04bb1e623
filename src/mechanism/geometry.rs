//! What a mechanism has to state, and what follows from it for many samples at once.
//!
//! The author of a closed-form mechanism writes [`Kinematics`]: the inverse kinematics of
//! *positions*, from the task coordinates `x` to all tree coordinates `q = F(x)`, generic over
//! [`Scalar`]. [`ClosedForm`](super::parts::ClosedForm) turns that into a [`Geometry`]: motions, Jacobians and curvatures of
//! batches, exact and in packs of samples. Mechanisms without closed form
//! implement [`Geometry`] themselves.
//!
//! With `D = ∂F/∂x`:
//!
//! ```text
//! q = F(x)     q̇ = D ẋ     q̈ = D ẍ + F_xx[ẋ, ẋ]
//! ```

use super::dimensions::Dimensions;
use super::scalar::Scalar;
use crate::dynamics::Samples;
use crate::dynamics::lanes::Isa;
use nalgebra::{DMatrix, Vector3};

/// Takes the tree coordinates one by one, in any order.
pub trait Coordinates<S> {
    /// Coordinate `i` is `q`.
    fn put(&mut self, i: usize, q: S);

    /// Coordinates `to` are the angle `atan2(y, x)`, which nothing else follows from. What takes derivatives alone, or
    /// other coordinates alone, leaves the angle itself out.
    #[inline(always)]
    fn put_angle(&mut self, to: &[usize], y: S, x: S)
    where
        S: Scalar,
    {
        let angle = y.atan2(x);
        for &i in to {
            self.put(i, angle);
        }
    }
}

impl<S> Coordinates<S> for [S] {
    #[inline(always)]
    fn put(&mut self, i: usize, q: S) {
        self[i] = q;
    }
}

/// Enclosures of a coordinate and its derivatives over a stretch of time, as Taylor coefficients:
/// position, velocity, half the acceleration, a sixth of the jerk, a 24th of its derivative.
pub type Path = super::interval::Series<super::interval::Interval, 5>;

/// A line between two points of the mechanism, for pictures and distances.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Segment {
    /// what it is: `leg3`, `arm1`, `platform`
    pub name: String,
    /// its ends in base axes, m
    #[serde(serialize_with = "crate::output::points")]
    pub ends: [Vector3<f64>; 2],
}

/// The cone that a passive joint opens.
#[derive(Debug, Clone, PartialEq)]
pub struct Cone {
    /// which joint
    pub name: String,
    /// angle from the middle of its range, rad
    pub angle: f64,
    /// largest angle that it allows, rad; infinite where none is stated
    pub limit: f64,
}

/// Closed-form position kinematics: the one thing that a new mechanism has to bring.
pub trait Kinematics: std::fmt::Debug + Send + Sync {
    /// Number of tree coordinates.
    fn coordinates(&self) -> usize;

    /// `q = F(x)`: all tree coordinates from the task coordinates. Where the pose cannot be reached
    /// the result is not a number (the square root of something negative).
    fn inverse<S: Scalar, C: Coordinates<S> + ?Sized>(&self, x: &[S], q: &mut C);

    /// Why a pose cannot be reached, with the number that shows it; `None` where it can.
    fn unreachable(&self, x: &[f64]) -> Option<String>;

    /// Matrix of the conditions that hold the motions which the tree leaves out (tilts of a
    /// platform that only translates, spins of hinged bars); dimensionless, singular where the
    /// mechanism loses its shape. `None` where the tree leaves out nothing.
    fn constraint_block(&self, _x: &[f64]) -> Option<DMatrix<f64>> {
        None
    }

    /// The lines of the mechanism.
    fn segments(&self, x: &[f64]) -> Vec<Segment>;

    /// Opening of the passive joints.
    fn cones(&self, _x: &[f64]) -> Vec<Cone> {
        Vec::new()
    }

    /// Its dimensions, where they can be calibrated.
    #[doc(hidden)]
    fn dimensions(&self) -> Option<Dimensions> {
        None
    }

    /// The same with the joints of its legs moved: deviations as [`Dimensions`] has them, those of zeros left out.
    /// `None` where the bodies of the tree would change with them.
    #[doc(hidden)]
    fn deformed(&self, _off: &[f64]) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }
}

/// Kinematics of batches, with their derivatives; object-safe. All arrays are sample-fastest:
/// entry `(i, k)` of sample `s` of an `n × m` matrix at `(i·m + k)·count + s`.
pub trait Geometry: std::fmt::Debug + Send + Sync {
    /// Number of tree coordinates.
    fn coordinates(&self) -> usize;

    /// Number of task coordinates.
    fn task(&self) -> usize;

    /// Positions, velocities and accelerations of all tree coordinates into `motion` (sized
    /// already), and `D` into `d`. Numbers that are not finite where a pose cannot be reached.
    fn motion(&self, isa: Isa, x: &Samples, motion: &mut Samples, d: &mut [f64]);

    /// Coordinates `rows` of one pose into `q`, and their rows of `D` into `d`, row by row: what forward kinematics asks for in
    /// every step.
    fn rows(&self, x: &[f64], rows: &[usize], q: &mut [f64], d: &mut [f64]) {
        let (n, m) = (self.coordinates(), self.task());
        let mut still = Samples::zeros(m, 1);
        still.q.copy_from_slice(x);
        let (mut tree, mut all) = (Samples::zeros(n, 1), vec![0.0; n * m]);
        self.motion(Isa::Scalar, &still, &mut tree, &mut all);
        for (r, &i) in rows.iter().enumerate() {
            q[r] = tree.q[i];
            d[r * m..(r + 1) * m].copy_from_slice(&all[i * m..(i + 1) * m]);
        }
    }

    /// `∂q̇/∂x` and `∂q̈/∂x` at fixed `ẋ, ẍ` (and, for use as it comes, `D`): with
    /// `∂q̇/∂ẋ = ∂q̈/∂ẍ = D` and `∂q̈/∂ẋ = 2 ∂q̇/∂x` all that a gradient needs.
    fn sensitivity(&self, isa: Isa, x: &Samples, d: &mut [f64], dqd: &mut [f64], dqdd: &mut [f64]);

    /// `F_xx[u, ·]`, the derivative of `D u` with respect to `x` at fixed `u`; `u` holds task
    /// coordinate `k` of sample `s` at `k·count + s`.
    fn curvature(&self, isa: Isa, x: &Samples, u: &[f64], out: &mut [f64]);

    /// As [`Kinematics::unreachable`].
    fn unreachable(&self, x: &[f64]) -> Option<String>;

    /// As [`Kinematics::constraint_block`].
    fn constraint_block(&self, x: &[f64]) -> Option<DMatrix<f64>>;

    /// As [`Kinematics::segments`].
    fn segments(&self, x: &[f64]) -> Vec<Segment>;

    /// As [`Kinematics::cones`].
    fn cones(&self, x: &[f64]) -> Vec<Cone>;

    /// As [`Kinematics::dimensions`].
    #[doc(hidden)]
    fn dimensions(&self) -> Option<Dimensions> {
        None
    }

    /// As [`Kinematics::deformed`].
    #[doc(hidden)]
    fn deformed(&self, _off: &[f64]) -> Option<Box<dyn Geometry>> {
        None
    }

    /// Taylor coefficients of all tree coordinates over a stretch of time, from enclosures of those
    /// of the task coordinates; `None` where the kinematics has no closed form.
    fn enclosure(&self, _x: &[Path]) -> Option<Vec<Path>> {
        None
    }

    /// Where the task coordinates are joints: which of the tree coordinates they are. `None`: the
    /// first actuators.
    fn task_joints(&self) -> Option<&[usize]> {
        None
    }

    /// Whether each sample starts from the solution of the one before, so that a batch must not be
    /// cut into pieces.
    fn sequential(&self) -> bool {
        false
    }
}
