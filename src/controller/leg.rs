//! Moves before and after the periodic motion, as rows of samples.
//!
//! Between two rows a leg is the quintic through both states, so that it is known at every instant and its velocity,
//! acceleration and jerk have bounds: those of the control points of each piece.

use super::deviation::{bezier, derived, quintic};
use crate::error::{Error, Result};
use crate::trajectory::Samples;
use crate::trajectory::samples::read_samples;
use std::path::Path;

/// Below this step, s, differences of positions are rounding: straight lines between the states take their place.
const SHORT: f64 = 1e-4;

/// Position, velocity or acceleration that no robot has.
const HUGE: f64 = 1e12;

/// By how much a step may differ from what its velocities say, rad or m: rounding, jumps of the jerk.
const JUMP: f64 = 1e-3;

/// A sampled move of the joints (of the actuators of a parallel robot), in the order of the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Leg {
    samples: Samples,
}

impl Leg {
    /// A leg from its samples; the first one is at its time zero.
    ///
    /// # Errors
    /// [`Error::Argument`] if there are fewer than two samples, the times do not increase, columns differ in length, a
    /// number is one that no robot has, or positions jump.
    pub fn new(mut samples: Samples) -> Result<Self> {
        let n = samples.len();
        if n < 2 {
            return Err(Error::Argument(format!(
                "a move needs at least two samples, not {n}"
            )));
        }
        let columns = [&samples.q, &samples.qd, &samples.qdd];
        if columns.iter().any(|c| c.len() != samples.q.len())
            || columns.iter().any(|c| c.iter().any(|x| x.len() != n))
        {
            return Err(Error::Argument(
                "the columns of a move differ in length".into(),
            ));
        }
        if let Some(i) = (1..n).find(|&i| samples.t[i] <= samples.t[i - 1]) {
            return Err(Error::Argument(format!(
                "the time does not increase at sample {} ({} s after {} s)",
                i + 1,
                samples.t[i],
                samples.t[i - 1]
            )));
        }
        for (name, columns) in [
            ("q", &samples.q),
            ("dq", &samples.qd),
            ("ddq", &samples.qdd),
        ] {
            for (j, column) in columns.iter().enumerate() {
                if let Some(i) = column.iter().position(|x| x.is_nan() || x.abs() >= HUGE) {
                    return Err(Error::Argument(format!(
                        "{name}{} is {:e} in sample {}; rad or m and seconds are expected",
                        j + 1,
                        column[i],
                        i + 1
                    )));
                }
            }
        }
        for j in 0..samples.q.len() {
            for i in 1..n {
                // Euler-Maclaurin: exact for a polynomial of degree four
                let at = |c: &[Vec<f64>], i: usize| c[j][i];
                let (q, v, a) = (&samples.q, &samples.qd, &samples.qdd);
                let h = samples.t[i] - samples.t[i - 1];
                let way = 0.5 * h * (at(v, i - 1) + at(v, i));
                let way = way + h * h / 12.0 * (at(a, i - 1) - at(a, i));
                let off = at(q, i) - at(q, i - 1) - way;
                let speed = at(v, i - 1).abs() + at(v, i).abs();
                if off.abs() > JUMP + 0.1 * h * speed {
                    return Err(Error::Argument(format!(
                        "q{} jumps between samples {i} and {}: by {off:.2e} more than dq{} and ddq{} say; \
                         they must be its derivatives by time in s",
                        j + 1,
                        i + 1,
                        j + 1,
                        j + 1
                    )));
                }
            }
        }
        let start = samples.t[0];
        samples.t.iter_mut().for_each(|t| *t -= start);
        Ok(Leg { samples })
    }

    /// Reads a leg of `dof` joints: columns `t`, `q1 …`, `dq1 …`, `ddq1 …`, others ignored.
    ///
    /// # Errors
    /// As [`read_samples`] and [`Leg::new`], with the file.
    pub fn read(path: impl AsRef<Path>, dof: usize) -> Result<Self> {
        let path = path.as_ref();
        Leg::new(read_samples(path, dof)?).map_err(|e| Error::file(path, "", e.to_string()))
    }

    /// Number of joints.
    pub fn dof(&self) -> usize {
        self.samples.dof()
    }

    /// Duration, s.
    pub fn duration(&self) -> f64 {
        self.samples.t.last().copied().unwrap_or(0.0)
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Never: a leg has at least two samples.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Position, velocity and acceleration of a joint in row `i`.
    pub fn row(&self, i: usize, joint: usize) -> [f64; 3] {
        let s = &self.samples;
        [s.q[joint][i], s.qd[joint][i], s.qdd[joint][i]]
    }

    /// Position, velocity and acceleration of a joint at `t`, s from the beginning of the leg.
    pub fn at(&self, t: f64, joint: usize) -> [f64; 3] {
        let times = &self.samples.t;
        let after = times.partition_point(|&x| x <= t);
        let (i, j) = match after {
            0 => return self.row(0, joint),
            n if n == times.len() => return self.row(n - 1, joint),
            n => (n - 1, n),
        };
        let h = times[j] - times[i];
        let u = (t - times[i]) / h;
        let (a, b) = (self.row(i, joint), self.row(j, joint));
        if h < SHORT {
            return std::array::from_fn(|k| a[k] + u * (b[k] - a[k]));
        }
        let points = quintic(h, a, b);
        let first: [f64; 5] = derived(points, h);
        let second: [f64; 4] = derived(first, h);
        [bezier(points, u), bezier(first, u), bezier(second, u)]
    }

    /// Bounds of velocity, acceleration and jerk of a joint over all of the leg.
    pub fn largest(&self, joint: usize) -> [f64; 3] {
        let times = &self.samples.t;
        let mut most = [0.0f64; 3];
        for i in 1..times.len() {
            let h = times[i] - times[i - 1];
            let (a, b) = (self.row(i - 1, joint), self.row(i, joint));
            let points = quintic(h, a, b);
            let first: [f64; 5] = derived(points, h);
            let second: [f64; 4] = derived(first, h);
            let third: [f64; 3] = derived(second, h);
            let all: [&[f64]; 3] = match h < SHORT {
                true => [&[a[1], b[1]], &[a[2], b[2]], &[(b[2] - a[2]) / h]],
                false => [&first, &second, &third],
            };
            for (most, points) in most.iter_mut().zip(all) {
                *most = points.iter().fold(*most, |m, p| m.max(p.abs()));
            }
        }
        most
    }

    /// The same path at a fraction of the speed: velocities times the fraction, accelerations times its square.
    pub fn at_speed(mut self, fraction: f64) -> Self {
        let s = &mut self.samples;
        s.t.iter_mut().for_each(|t| *t /= fraction);
        s.qd.iter_mut().flatten().for_each(|v| *v *= fraction);
        s.qdd
            .iter_mut()
            .flatten()
            .for_each(|a| *a *= fraction * fraction);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A polynomial of degree five, sampled unevenly.
    fn leg() -> (Leg, impl Fn(f64) -> [f64; 3]) {
        let state = |t: f64| {
            [
                t.powi(5) - 2.0 * t.powi(3) + 1.0,
                5.0 * t.powi(4) - 6.0 * t * t,
                20.0 * t.powi(3) - 12.0 * t,
            ]
        };
        let mut samples = Samples::with_capacity(1, 5);
        for t in [0.0, 0.1, 0.35, 0.8, 1.2] {
            let [q, v, a] = state(t);
            samples.push(t + 7.0, &[q], &[v], &[a]);
        }
        (Leg::new(samples).unwrap(), state)
    }

    #[test]
    fn a_quintic_is_met_at_every_instant() {
        let (leg, state) = leg();
        assert!((leg.duration() - 1.2).abs() < 1e-12);
        for i in 0..=240 {
            let t = f64::from(i) / 200.0;
            for (x, y) in leg.at(t, 0).iter().zip(state(t)) {
                assert!((x - y).abs() < 1e-9, "{t}: {x} {y}");
            }
        }
        assert_eq!(leg.at(9.0, 0), leg.row(4, 0));
        // bounds hold, and are not far off: |q⃛| = |60 t² − 12| is 74.4 at the end
        let [v, a, j] = leg.largest(0);
        for i in 0..=1200 {
            let [_, dq, ddq] = state(f64::from(i) / 1000.0);
            assert!(dq.abs() <= v + 1e-9 && ddq.abs() <= a + 1e-9);
        }
        assert!((j - 74.4).abs() < 1e-6, "{j}");
    }

    #[test]
    fn half_the_speed_takes_twice_the_time() {
        let (leg, state) = leg();
        let slow = leg.at_speed(0.5);
        assert!((slow.duration() - 2.4).abs() < 1e-12);
        let [q, v, a] = slow.at(1.0, 0);
        let [rq, rv, ra] = state(0.5);
        assert!((q - rq).abs() < 1e-9 && (v - 0.5 * rv).abs() < 1e-9);
        assert!((a - 0.25 * ra).abs() < 1e-9);
    }

    #[test]
    fn what_is_no_move_is_refused() {
        let mut one = Samples::with_capacity(1, 1);
        one.push(0.0, &[0.0], &[0.0], &[0.0]);
        assert!(Leg::new(one.clone()).unwrap_err().is_argument());
        one.push(0.0, &[0.0], &[0.0], &[0.0]);
        let message = Leg::new(one.clone()).unwrap_err().to_string();
        assert!(
            message.contains("does not increase at sample 2"),
            "{message}"
        );
        one.t[1] = 1.0;
        one.q[0][1] = 0.1;
        let message = Leg::new(one.clone()).unwrap_err().to_string();
        assert!(
            message.contains("q1 jumps between samples 1 and 2"),
            "{message}"
        );
        one.q[0][1] = 1e300;
        let message = Leg::new(one.clone()).unwrap_err().to_string();
        assert!(message.contains("q1 is 1e300 in sample 2"), "{message}");
        one.q[0].pop();
        assert!(Leg::new(one).is_err());
    }
}
