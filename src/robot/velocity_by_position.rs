//! A limit of velocity that shrinks towards the ends of the range, so that the joint can always brake.
//!
//! With a deceleration `d`, an offset `o` and ends `[q_min, q_max]`
//!
//! ```text
//! q̇ ≤  max(0, √(2 d (q_max − q)) − o)         q̇ ≥ −max(0, √(2 d (q − q_min)) − o)
//! ```
//!
//! as Franka Research 3 enforces it beside its constant limit of velocity (Franka Control Interface
//! documentation, *Limits for Franka Research 3*). A motion that respects it never reaches the ends: it
//! turns at `q_max − o²/(2 d)` at the latest.

/// Limit of velocity by position; its module has the equations.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct VelocityByPosition {
    /// `d`, rad/s² or m/s²
    pub deceleration: f64,
    /// `o`, rad/s or m/s
    pub offset: f64,
    /// `[q_min, q_max]`, rad or m
    pub position: [f64; 2],
}

/// The limit on one side: `q̇ ≤ max(0, √(2 d (end − q)) − o)` in coordinates in which it is the upper one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Side {
    /// 1: the upper side; −1: the lower one, positions and velocities negated
    pub sign: f64,
    /// `d`
    pub deceleration: f64,
    /// `o`
    pub offset: f64,
    /// the end, negated on the lower side
    pub end: f64,
}

impl VelocityByPosition {
    /// The upper and the lower side.
    pub(crate) fn sides(&self) -> [Side; 2] {
        let [low, high] = self.position;
        [(1.0, high), (-1.0, -low)].map(|(sign, end)| Side {
            sign,
            deceleration: self.deceleration,
            offset: self.offset,
            end,
        })
    }

    /// Least and largest velocity that are allowed at a position, not more than zero and not less.
    pub fn at(&self, q: f64) -> [f64; 2] {
        let [up, down] = self.sides().map(|s| s.allowed(s.sign * q).max(0.0));
        [-down, up]
    }

    /// Share of the velocity allowed at `q` that `v` uses; infinite where none is allowed.
    pub fn share(&self, q: f64, v: f64) -> f64 {
        let [low, high] = self.at(q);
        let allowed = if v > 0.0 { high } else { -low };
        match (v == 0.0, allowed > 0.0) {
            (true, _) => 0.0,
            (_, true) => v.abs() / allowed,
            (_, false) => f64::INFINITY,
        }
    }

    /// Positions between which a motion stays that respects it: where `at` leaves no velocity outwards.
    pub fn range(&self) -> [f64; 2] {
        let [up, down] = self.sides().map(|s| s.turn());
        [-down, up]
    }

    /// What is wrong with the ends, in words.
    pub(crate) fn flaw(&self) -> Option<String> {
        let [low, high] = self.position;
        if !(low.is_finite() && high.is_finite()) {
            return Some("needs both ends of the range of positions".into());
        }
        let [a, b] = self.range();
        // false where one of them is not a number
        (!(a < b)).then(|| {
            format!("leaves no room to move: a motion in [{low}, {high}] would turn at {b:.4} and at {a:.4}")
        })
    }

    /// Velocities times a factor at every position, see [`Limits::derated`](super::Limits::derated).
    pub(super) fn derated(&self, factor: f64) -> Self {
        VelocityByPosition {
            deceleration: self.deceleration * factor * factor,
            offset: self.offset * factor,
            ..*self
        }
    }
}

impl Side {
    /// `√(2 d (end − q)) − o`, negative beyond [`Side::turn`]; −o at the end and beyond.
    pub fn allowed(&self, q: f64) -> f64 {
        (2.0 * self.deceleration * (self.end - q)).max(0.0).sqrt() - self.offset
    }

    /// Where no velocity outwards is left.
    pub fn turn(&self) -> f64 {
        self.end - self.offset * self.offset / (2.0 * self.deceleration)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_is_that_of_its_formula() {
        // joint 1 of Franka Research 3, its formula written out
        let l = VelocityByPosition {
            deceleration: 6.0,
            offset: 0.6599,
            position: [-2.9007, 2.9007],
        };
        for q in [-2.95, -2.9, -2.87, -2.0, 0.0, 1.0, 2.5, 2.86, 2.9] {
            let upper = f64::max(0.0, -0.6599 + f64::max(0.0, 12.0 * (2.9007 - q)).sqrt());
            let lower = f64::min(0.0, 0.6599 - f64::max(0.0, 12.0 * (2.9007 + q)).sqrt());
            let [a, b] = l.at(q);
            assert!(
                (a - lower).abs() < 1e-15 && (b - upper).abs() < 1e-15,
                "{q}"
            );
        }
        let [low, high] = l.range();
        assert!((l.at(high - 1e-6)[1] > 0.0) && l.at(high + 1e-12)[1] == 0.0);
        assert!((l.at(low + 1e-6)[0] < 0.0) && l.at(low - 1e-12)[0] == 0.0);
        let half = l.derated(0.5);
        assert!((half.at(1.3)[1] - 0.5 * l.at(1.3)[1]).abs() < 1e-15);
        assert_eq!(half.position, l.position);
    }
}
