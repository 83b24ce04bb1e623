//! What an information matrix asks of a robot.

use super::memory::Evaluation;
use crate::robot::Robot;
use faer::MatRef;

/// Regressor and adjoint products of a robot, `transform` being `B`.
pub(super) trait Model: std::fmt::Debug + Send + Sync {
    /// `Λ` of the motion in the memory; zeros where the robot cannot make it.
    fn evaluate(&self, e: &mut Evaluation, transform: MatRef<'_, f64>);

    /// Derivatives of `uᵀ Λ u` by positions, velocities and accelerations of the coordinates at the
    /// samples, for each column `u`: vector `v`, coordinate `k`, sample `s` at
    /// `(v·coordinates + k)·count + s`. Needs [`Model::evaluate`] at the same point before.
    fn quadratic_gradients<'e>(
        &self,
        e: &'e mut Evaluation,
        transform: MatRef<'_, f64>,
        vectors: MatRef<'_, f64>,
    ) -> [&'e [f64]; 3];
}

/// Width over which `sign(q̇)` is rounded, so that it has a derivative: a hundredth of the velocity
/// limit, 0.02 rad/s or m/s where there is none.
pub(super) fn sign_width(robot: &Robot) -> Vec<f64> {
    robot
        .joints
        .iter()
        .map(|j| match j.limits.velocity.is_finite() {
            true => 0.01 * j.limits.velocity,
            false => 0.02,
        })
        .collect()
}
