//! Velocities that may not exceed what a joint's position leaves of them, in the subproblems.
//!
//! On one side the limit is `q̇ ≤ √(2 d (E − q)) − o`. It holds at an instant of the next trajectory when
//!
//! ```text
//! (q̇ + o)² ≤ 2 d (E − q)         with q, q̇ affine in the free numbers:
//! ‖( 2 w/κ, u/κ² − 1 )‖ ≤ u/κ² + 1        w = q̇ + o,  u = 2 d (E − q)
//! ```
//!
//! a second-order cone, `κ²` being `u` at the present trajectory. The cone asks for `q̇ ≥ −o − √u` too, which
//! the limit does not; so it stands only at instants where the joint moves outwards, or inwards more slowly
//! than `o`.
//!
//! About a resting position `r` the motion of a joint has the gauge, the factor by which it must shrink,
//!
//! ```text
//! g = ( b + √(b² + q̇² c) ) / c        b = q̇ o + d (q − r),  c = 2 d (E − r) − o²
//! ```
//!
//! the positive root of `(q̇/g + o)² = 2 d (E − r − (q − r)/g)`.

use crate::conic::Problem;
use crate::robot::Side;
use crate::trajectory::by_position::golden;
use crate::trajectory::{Series, Table, evaluate_series};

/// One cone: the position and the velocity of joint `joint` at an instant, as they change with its free
/// numbers.
#[derive(Debug, Clone)]
pub struct Cone {
    /// joint
    pub joint: usize,
    /// coefficients of `w`
    pub speed: Vec<f64>,
    /// `w` at the present trajectory
    pub w: f64,
    /// coefficients of `u`
    pub room: Vec<f64>,
    /// `u` at the present trajectory
    pub u: f64,
}

impl Cone {
    /// Of rows that give signed position and velocity, and their present values.
    pub fn new(joint: usize, side: &Side, rows: [&[f64]; 2], [q, v]: [f64; 2]) -> Self {
        let turn = |row: &[f64], f: f64| row.iter().map(|x| f * side.sign * x).collect();
        let w = v + side.offset;
        let u = 2.0 * side.deceleration * (side.end - q);
        Cone {
            joint,
            speed: turn(rows[1], 1.0),
            w,
            room: turn(rows[0], -2.0 * side.deceleration),
            // rounding must not leave the present trajectory outside
            u: u.max(w * w),
        }
    }

    /// Writes the cone; the `k`-th free number of the joint is variable `first + k`, times `scale`.
    pub fn write(&self, problem: &mut Problem, first: usize, scale: f64) {
        let square = self.u.max(f64::MIN_POSITIVE);
        let kappa = square.sqrt();
        let entries = |row: &[f64], f: f64| -> Vec<(usize, f64)> {
            let each = row.iter().enumerate();
            each.map(|(k, x)| (first + k, x * f * scale)).collect()
        };
        let speed = entries(&self.speed, 2.0 / kappa);
        let room = entries(&self.room, 1.0 / square);
        problem.second_order(
            (&room, 2.0),
            &[(&speed, 2.0 * self.w / kappa), (&room, 0.0)],
        );
    }
}

/// The gauge of an instant about the rest `r` (all signed), 0 where the joint moves inwards.
pub fn gauge(side: &Side, r: f64, q: f64, v: f64) -> f64 {
    match v >= 0.0 {
        true => signed_gauge(side, r, q, v),
        false => 0.0,
    }
}

/// The same of the whole parabola, see the [module](self).
fn signed_gauge(side: &Side, r: f64, q: f64, v: f64) -> f64 {
    let (d, o) = (side.deceleration, side.offset);
    let c = 2.0 * d * (side.end - r) - o * o;
    if !(c > 0.0) {
        return f64::INFINITY;
    }
    let b = v * o + d * (q - r);
    (b + (b * b + v * v * c).sqrt()) / c
}

/// Whether a cone stands at an instant: it uses more than `near` of the limit, and the joint moves outwards or
/// inwards slowly.
pub fn stands(side: &Side, r: f64, [q, v]: [f64; 2], near: f64) -> bool {
    v > -side.offset && signed_gauge(side, r, q, v) > near
}

/// Local maxima of the gauge on a side that exceed `above`: times and values.
pub fn peaks(
    table: &Table,
    series: &Series,
    side: &Side,
    rest: f64,
    above: f64,
    samples: &mut [Vec<f64>; 2],
) -> Vec<(f64, f64)> {
    let n = table.len();
    for (order, list) in samples.iter_mut().enumerate() {
        list.resize(n, 0.0);
        table.series(series, order as u32, list);
    }
    let r = side.sign * rest;
    let [q, v] = &*samples;
    let at = |i: usize| gauge(side, r, side.sign * q[i % n], side.sign * v[i % n]);
    let step = table.period() / n as f64;
    let exact = |t: f64| {
        let [q, v] = evaluate_series(series, table.harmonics(), table.omega(), t);
        gauge(side, r, side.sign * q, side.sign * v)
    };
    let mut out = Vec::new();
    let (mut before, mut here) = (at(n - 1), at(0));
    for i in 0..n {
        let after = at(i + 1);
        // between two samples a peak can be higher than both: by how much falls with the square of their distance
        if here >= before && here > after && here > 0.9 * above {
            let t = i as f64 * step;
            let (time, value) = match here.is_finite() {
                true => {
                    let best = golden(t - step, t + step, &exact);
                    (best, exact(best))
                }
                false => (t, here),
            };
            let found = if value > here {
                (time, value)
            } else {
                (t, here)
            };
            if found.1 > above {
                out.push(found);
            }
        }
        (before, here) = (here, after);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conic::{Settings, Status};

    const SIDE: Side = Side {
        sign: 1.0,
        deceleration: 6.0,
        offset: 0.66,
        end: 2.9,
    };

    #[test]
    fn shrunk_by_its_gauge_a_motion_uses_all_of_the_limit() {
        let r = 0.3;
        for (q, v) in [(2.0, 1.0), (2.7, 0.9), (-1.0, 4.0), (2.8, 0.0), (1.0, 9.0)] {
            let g = gauge(&SIDE, r, q, v);
            let (q, v) = (r + (q - r) / g, v / g);
            assert!((v - SIDE.allowed(q)).abs() < 1e-12, "{q} {v} {g}");
        }
        assert_eq!(gauge(&SIDE, r, 2.8, -0.1), 0.0);
        assert_eq!(gauge(&SIDE, 2.89, 2.8, 0.1), f64::INFINITY);
    }

    #[test]
    fn the_cone_is_the_limit() {
        // the largest velocity at a position, by the solver: free numbers are position and velocity
        for (sign, q) in [(1.0, 2.5), (1.0, -1.0), (-1.0, -2.2)] {
            let side = Side { sign, ..SIDE };
            let here = [sign * q, 0.1];
            let cone = Cone::new(0, &side, [&[1.0, 0.0], &[0.0, 1.0]], here);
            let mut problem = Problem::new(2);
            problem.linear(1, -sign);
            problem.equality([(0, 1.0)], 0.0);
            cone.write(&mut problem, 0, 1.0);
            let solution = problem.solve(&Settings::default()).unwrap();
            assert_eq!(solution.status, Status::Solved);
            let v = 0.1 + sign * solution.x[1];
            assert!((v - side.allowed(sign * q)).abs() < 1e-6, "{v}");
        }
    }

    #[test]
    fn peaks_between_samples_are_found() {
        let series = Series {
            constant: 0.2,
            sin: vec![2.2, 0.1, 0.3],
            cos: vec![0.3, -0.2, 0.15],
        };
        let table = Table::new(7.0, &[1, 2, 5], 120);
        let found = peaks(&table, &series, &SIDE, 0.1, 0.0, &mut Default::default());
        let best = found.iter().map(|p| p.1).fold(0.0, f64::max);
        let dense = (0..200_000).map(|i| {
            let t = f64::from(i) * 7.0 / 200_000.0;
            let [q, v] = evaluate_series(&series, &[1, 2, 5], table.omega(), t);
            gauge(&SIDE, 0.1, q, v)
        });
        let dense = dense.fold(0.0, f64::max);
        assert!(best >= dense && best - dense < 1e-7, "{best} {dense}");
    }
}
