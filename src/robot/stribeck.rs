//! Friction that falls as a joint begins to move.

/// `F exp(−(q̇/v_s)²) sign(q̇)` beside Coulomb friction, with `sign(0) = 0`: what it takes to break away beyond Coulomb friction,
/// and the speed at which that has fallen to `1/e`. A known part of the torque: it is not linear in `v_s`, so that no column
/// stands for it; `identify` estimates it on its own where that is asked for.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Stribeck {
    /// `F`, N m or N
    pub force: f64,
    /// `v_s`, rad/s or m/s
    pub velocity: f64,
    /// whether `identify` estimates both
    pub fit: bool,
}

/// `v_s` where a file states a force alone, rad/s or m/s.
const SPEED: f64 = 0.01;

impl Default for Stribeck {
    fn default() -> Self {
        Stribeck {
            force: 0.0,
            velocity: SPEED,
            fit: false,
        }
    }
}

impl Stribeck {
    /// Magnitude at a speed, N m or N.
    pub fn level(self, velocity: f64) -> f64 {
        match self.force == 0.0 {
            true => 0.0,
            false => self.force * (-(velocity / self.velocity).powi(2)).exp(),
        }
    }

    /// Torque or force against the motion.
    pub fn torque(self, velocity: f64) -> f64 {
        match velocity == 0.0 {
            true => 0.0,
            false => self.level(velocity) * velocity.signum(),
        }
    }

    /// Slopes of [`Stribeck::torque`] by `force` and by `velocity`; it is linear in the first.
    pub fn slopes(self, velocity: f64) -> [f64; 2] {
        let u = velocity / self.velocity;
        let one = Stribeck { force: 1.0, ..self };
        [
            one.torque(velocity),
            2.0 * u * u / self.velocity * self.torque(velocity),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_falls_with_the_speed_and_turns_with_its_sign() {
        let s = Stribeck {
            force: 15.0,
            velocity: 0.02,
            fit: false,
        };
        assert_eq!(s.torque(0.0), 0.0);
        assert_eq!(s.level(0.0), 15.0);
        assert!((s.torque(0.02) - 15.0 / std::f64::consts::E).abs() < 1e-12);
        assert_eq!(s.torque(-0.02), -s.torque(0.02));
        assert_eq!(Stribeck::default().torque(1e-9), 0.0);
    }
}
