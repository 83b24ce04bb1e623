//! What a controller makes of a course: how far it may leave it, and whether it can start and end it.

use super::{Course, Way};
use crate::controller::deviation::{Deviation, Interpolation};
use crate::controller::leg::Leg;
use crate::error::Result;
use crate::trajectory::extrema;
use crate::trajectory::samples::times;

/// Deviation that is always small enough, rad or m.
pub const AIM: f64 = 1e-5;
/// Part of its peak below which a velocity or an acceleration counts as none.
const REST: f64 = 1e-4;
/// Velocity and acceleration that are none in any case, rad/s or m/s, rad/s² or m/s².
const NONE: f64 = 1e-9;
/// Instants that are tried between two points where there is no bound.
const TRIED: usize = 8;

impl Course<'_> {
    /// How far a controller may leave the motion of each joint that takes points at `rate` hertz.
    ///
    /// # Errors
    /// As [`times`] and [`Course::sample`].
    pub fn deviations(&self, way: Interpolation, rate: f64) -> Result<Vec<Deviation>> {
        let step = 1.0 / rate;
        let mut all = match self.way {
            Way::Series => self.bounded(way, step),
            Way::Kinematics(_) => self.tried(way, rate)?,
        };
        let series = |j: usize, order: u32| match self.way {
            Way::Series => {
                let f = &self.fourier;
                extrema(f.period, &f.harmonics, &f.joints[j], order).magnitude_bound()
            }
            // tried points have no bound beside them
            Way::Kinematics(_) => 0.0,
        };
        let legs: Vec<&Leg> = [&self.approach, &self.retreat]
            .into_iter()
            .flatten()
            .collect();
        for (j, deviation) in all.iter_mut().enumerate() {
            for leg in &legs {
                // a step may begin in one part and end in the next
                let mut largest = leg.largest(j);
                for (most, order) in largest.iter_mut().zip(1..) {
                    *most = most.max(series(j, order));
                }
                deviation.value = deviation.value.max(way.bound_with_jumps(step, largest));
            }
        }
        Ok(all)
    }

    fn aim(&self, joint: usize) -> f64 {
        self.joints[joint].resolution.unwrap_or(0.0).max(AIM)
    }

    /// From the exact extrema of the series.
    fn bounded(&self, way: Interpolation, step: f64) -> Vec<Deviation> {
        let f = &self.fourier;
        let one = |(j, series)| {
            let largest = extrema(f.period, &f.harmonics, series, way.order()).magnitude_bound();
            Deviation {
                value: way.bound(step, largest),
                aim: self.aim(j),
                proven: true,
            }
        };
        f.joints.iter().enumerate().map(one).collect()
    }

    /// The largest of many instants between the points of one period.
    fn tried(&self, way: Interpolation, rate: f64) -> Result<Vec<Deviation>> {
        let fine = times(self.fourier.period, rate * TRIED as f64)?;
        let s = self.periodic(&fine)?;
        let step = 1.0 / rate;
        let one = |j: usize| {
            let state = |i: usize| [s.q[j][i], s.qd[j][i], s.qdd[j][i]];
            let mut value = 0.0f64;
            let mut at = 0;
            while at + TRIED < s.len() {
                let (a, b) = (state(at), state(at + TRIED));
                for k in 1..TRIED {
                    let u = k as f64 / TRIED as f64;
                    let e = way.between(u, step, a, b) - s.q[j][at + k];
                    value = value.max(e.abs());
                }
                if way == Interpolation::Hold {
                    value = value.max((b[0] - a[0]).abs());
                }
                at += TRIED;
            }
            Deviation {
                value,
                aim: self.aim(j),
                proven: false,
            }
        };
        Ok((0..self.joints.len()).map(one).collect())
    }

    /// Joints that move at the start or at the end of all of it: which, where, and how fast.
    ///
    /// # Errors
    /// As [`Course::sample`].
    pub fn moving_ends(&self) -> Result<Vec<(String, &'static str, f64, f64)>> {
        let ends = self.sample(&[0.0, self.duration()])?;
        let period = self.fourier.period;
        let many: Vec<f64> = (0..256).map(|i| period * f64::from(i) / 256.0).collect();
        let many = self.periodic(&many)?;
        let none = |column: &[f64]| REST * column.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let mut found = Vec::new();
        for (j, joint) in self.joints.iter().enumerate() {
            let (slow, weak) = (none(&many.qd[j]) + NONE, none(&many.qdd[j]) + NONE);
            for (i, place) in ["starts", "ends"].into_iter().enumerate() {
                let (v, a) = (ends.qd[j][i], ends.qdd[j][i]);
                if v.abs() > slow || a.abs() > weak {
                    found.push((joint.name.clone(), place, v, a));
                }
            }
        }
        Ok(found)
    }
}
