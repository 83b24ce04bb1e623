//! A mass on springs, with or without a gap between them.

use super::Context;
use crate::diagnose::column::Column;
use crate::diagnose::window::{FINE, sampled};

/// How much of the begin of a record without periods is run through first: s at most, and swings of the spring.
const BACK: (f64, f64) = (2.0, 15.0);
/// Damping ratios on that way.
const DRAINED: [f64; 3] = [0.1, 0.2, 0.3];

/// What a spring carries, sample by sample.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Carried<'a> {
    /// torque `τ_J` of the rigid bodies where the link is at the motor
    pub load: &'a [f64],
    /// inertia about the joint
    pub mass: &'a [f64],
    /// how the torque changes with the way of the link and with its rate, `∂τ_J/∂q` and `∂τ_J/∂q̇`; empty: not at all
    pub slopes: [&'a [f64]; 2],
    /// whether motion and torque of a sample rest on measured values; a record that is cut out of a motion has no
    /// accelerations at its ends
    pub measured: &'a [bool],
}

/// What a spring in joint `j` carries in record `k` (serial robots).
pub(crate) fn carried<'a>(cx: &'a Context, j: usize, k: usize) -> Carried<'a> {
    let span = cx.data.span(k);
    let slopes = cx.slopes(j);
    Carried {
        load: &cx.rigid[j][span.clone()],
        mass: &cx.mass[j][j][span.clone()],
        slopes: [0, 1].map(|rate| slopes[rate].get(span.clone()).unwrap_or(&[])),
        measured: &cx.data.records[k].measured,
    }
}

/// Springs of `M (2πf)²` with a damping ratio at both flanks of a gap.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Springs {
    /// gap `b`, rad or m; 0 for a spring
    pub gap: f64,
    /// natural frequency `f`, Hz
    pub frequency: f64,
    /// damping ratio
    pub damping: f64,
    /// by how much they are stiffer at the largest load
    pub cubic: f64,
}

impl Springs {
    /// A spring without a gap that does not stiffen.
    pub fn soft(frequency: f64, damping: f64) -> Self {
        Springs {
            gap: 0.0,
            frequency,
            damping,
            cubic: 0.0,
        }
    }

    fn omega(&self) -> f64 {
        2.0 * std::f64::consts::PI * self.frequency
    }

    /// Steps of a sub-step of the average: springs are followed more finely.
    fn steps(&self, dt: f64) -> usize {
        ((self.omega() * dt / FINE as f64 / 0.2).ceil() as usize).max(1)
    }
}

/// Way `δ` of the link against the motor, its rate and acceleration, `M δ̈ = T(δ) − τ_J − ∂τ_J/∂q δ − ∂τ_J/∂q̇ δ̇`, where
/// `T` is the torque of flanks at `±b/2` with springs; these stiffen by `cubic` at the largest load. Averaged as torque is
/// measured.
pub(crate) fn way(
    carried: Carried,
    dt: f64,
    springs: Springs,
    cycle: Option<usize>,
) -> [Vec<f64>; 3] {
    let [one] = ways(carried, dt, [springs], cycle, 0..3);
    one
}

/// Columns of the link of joint `j` on springs, whole.
pub(crate) fn whole(cx: &Context, j: usize, springs: Springs) -> Vec<Column> {
    vec![cx.displaced(j, |r, k| way(carried(cx, j, k), r.dt, springs, r.cycle))]
}

/// The same of several springs by inertia alone, as drafts; with `own_only` on the rows of the joint itself.
pub(crate) fn drafts(
    cx: &Context,
    j: usize,
    springs: &[Springs],
    own_only: bool,
) -> Vec<Vec<Column>> {
    let all = accelerations(cx, j, springs).into_iter();
    all.map(|a| vec![cx.inertial(j, &a, own_only)]).collect()
}

/// Accelerations `δ̈` of the link of joint `j` on one spring after another, over all records (serial robots).
fn accelerations(cx: &Context, j: usize, springs: &[Springs]) -> Vec<Vec<f64>> {
    let mut all = vec![Vec::with_capacity(cx.data.rows()); springs.len()];
    for (k, r) in cx.data.records.iter().enumerate() {
        let carried = carried(cx, j, k);
        let mut first = 0;
        while first < springs.len() {
            // side by side: those that take the same steps
            let same = |s: &&Springs| s.steps(r.dt) == springs[first].steps(r.dt);
            let rest = springs[first..].iter();
            let group: Vec<Springs> = rest.take(SIDE).take_while(same).copied().collect();
            let lanes: [Springs; SIDE] = std::array::from_fn(|l| group[l.min(group.len() - 1)]);
            let found = match group.len() {
                1 => ways(carried, r.dt, [group[0]], r.cycle, 2..3).to_vec(),
                _ => ways(carried, r.dt, lanes, r.cycle, 2..3).to_vec(),
            };
            let into = all[first..].iter_mut().take(group.len());
            into.zip(found).for_each(|(all, [_, _, a])| all.extend(a));
            first += group.len();
        }
    }
    all
}

/// Springs that are followed side by side.
const SIDE: usize = 4;

/// Ways on several springs that take the same steps, side by side: each waits for its own last step only. Of `wanted` of way,
/// rate and acceleration the others stay empty.
fn ways<const N: usize>(
    carried: Carried,
    dt: f64,
    springs: [Springs; N],
    cycle: Option<usize>,
    wanted: std::ops::Range<usize>,
) -> [[Vec<f64>; 3]; N] {
    let Carried {
        load,
        mass,
        slopes: [stiff, drag],
        measured,
    } = carried;
    // once it has settled a motion that repeats is followed for one period, and the window at its end
    let count = load.len();
    let n = cycle.map_or(count, |cycle| count.min(cycle + 2));
    let sub = springs[0].steps(dt);
    let h = dt / (FINE * sub) as f64;
    let mean = mass.iter().sum::<f64>() / count as f64;
    let each = springs.map(|s| Spring {
        k: mean * s.omega() * s.omega(),
        gap: s.gap,
        mean,
        omega: s.omega(),
        h,
        steps: FINE * sub,
    });
    let k = each.each_ref().map(|s| s.k);
    let d = springs.map(|s| 2.0 * s.damping * mean * s.omega());
    let largest = load.iter().fold(1e-12f64, |m, v| m.max(v.abs()));
    let twist = k.map(|k| largest / k);
    let half = springs.map(|s| s.gap / 2.0);
    let cubic = springs.map(|s| s.cubic);
    // what lies between the ends that say nothing
    let (first, last) = match (cycle, measured.iter().position(|m| *m)) {
        (None, Some(first)) => (first, measured.iter().rposition(|m| *m).unwrap_or(n - 1)),
        _ => (0, count - 1),
    };
    let (mut x, mut v) = ([0.0; N], [0.0; N]);
    for l in 0..N {
        let Springs {
            gap,
            frequency,
            damping,
            ..
        } = springs[l];
        let back = (first + (BACK.0.min(BACK.1 / frequency) / dt) as usize).min(last);
        let begin = match cycle {
            Some(_) => load[0],
            None => load[back],
        };
        (x[l], v[l]) = (-half[l] * begin.signum() - begin / k[l], 0.0);
        if cycle.is_none() {
            let (spring, start) = (&each[l], (x[l], v[l]));
            // a record may begin in the middle of a motion: backwards through its begin, so that nothing swings from the start
            (x[l], v[l]) = match gap == 0.0 {
                false => spring.backwards([0.5], start, &carried, first..back)[0],
                // seen backwards, a swing is fed: from three that are drained towards the one that is not, by a parabola
                true => {
                    let weight = |i: usize| -> f64 {
                        let others = (0..DRAINED.len()).filter(|&j| j != i);
                        others
                            .map(|j| (-damping - DRAINED[j]) / (DRAINED[i] - DRAINED[j]))
                            .product()
                    };
                    let states = spring.backwards(DRAINED, start, &carried, first..back);
                    (0..DRAINED.len()).fold((0.0, 0.0), |sum, i| {
                        let (state, w) = (states[i], weight(i));
                        (sum.0 + w * state.0, sum.1 + w * state.1)
                    })
                }
            };
        }
    }
    let settle = cycle.unwrap_or(0).min(count - 1);
    let fine = (n - 1) * FINE + 1;
    let mut values: [[Vec<f64>; 3]; N] = std::array::from_fn(|_| {
        std::array::from_fn(|q| Vec::with_capacity(if wanted.contains(&q) { fine } else { 0 }))
    });
    let mut push = |now: [[f64; N]; 3], times: usize| {
        for (l, of) in values.iter_mut().enumerate() {
            for q in wanted.clone() {
                of[q].extend(std::iter::repeat_n(now[q][l], times));
            }
        }
    };
    for pass in 0..2 {
        let upto = if pass == 0 { settle } else { n };
        if pass == 1 {
            push([x, v, [0.0; N]], first * FINE);
        }
        for i in first..upto {
            let next = (i + 1).min(last);
            let inverse = 1.0 / mass[i].max(0.05 * mean);
            let (stiff, drag) = (slope(stiff, i), slope(drag, i));
            for s in 0..FINE {
                let mut sum = [0.0; N];
                let begin = (x, v);
                for u in 0..sub {
                    let w = (s * sub + u) as f64 / (FINE * sub) as f64;
                    let tau = load[i.min(last)] + w * (load[next] - load[i.min(last)]);
                    for l in 0..N {
                        // without a gap all of the way
                        let beyond = x[l] - x[l].max(-half[l]).min(half[l]);
                        let stiffer = (beyond / twist[l]) * (beyond / twist[l]);
                        let bare = -k[l] * beyond * (1.0 + cubic[l] * stiffer.min(9.0));
                        let damped = bare - d[l] * v[l];
                        // flanks push only while they touch
                        let touches = half[l] == 0.0 || damped * bare > 0.0;
                        let t = if touches { damped } else { 0.0 };
                        let a = (t - tau - stiff * x[l] - drag * v[l]) * inverse;
                        sum[l] += a;
                        v[l] += h * a;
                        x[l] += h * v[l];
                    }
                }
                if pass == 1 {
                    push([begin.0, begin.1, sum.map(|sum| sum / sub as f64)], 1);
                }
                if pass == 1 && i + 1 == n {
                    break;
                }
            }
        }
    }
    values.map(|of| {
        of.map(|mut all| {
            if all.is_empty() {
                return all;
            }
            all.truncate(fine);
            let out = sampled(&all, n);
            match cycle.filter(|cycle| n < count && *cycle + 1 < n) {
                // its first sample is that after the period: the window of the very first has one side only
                Some(cycle) => (0..count)
                    .map(|i| out[(i + cycle - 1) % cycle + 1])
                    .collect(),
                None => out,
            }
        })
    })
}

/// A slope of the load at a sample; none where it has none.
fn slope(of: &[f64], i: usize) -> f64 {
    of.get(i).copied().unwrap_or(0.0)
}

/// A spring, and how finely it is followed.
struct Spring {
    k: f64,
    gap: f64,
    mean: f64,
    omega: f64,
    h: f64,
    /// steps of a sample
    steps: usize,
}

impl Spring {
    /// How far the link is beyond a flank.
    fn beyond(&self, x: f64) -> f64 {
        match self.gap == 0.0 {
            true => x,
            false => x - x.clamp(-self.gap / 2.0, self.gap / 2.0),
        }
    }

    /// Way and rate at the first of these samples, from those at the last: what swings there was drained on the way back,
    /// with each of these damping ratios.
    fn backwards<const N: usize>(
        &self,
        ratios: [f64; N],
        start: (f64, f64),
        carried: &Carried,
        samples: std::ops::Range<usize>,
    ) -> [(f64, f64); N] {
        let (load, stiff) = (carried.load, carried.slopes[0]);
        let inverse = |i: usize| carried.mass[i].max(0.05 * self.mean);
        let drained = ratios.map(|ratio| 2.0 * ratio * self.mean * self.omega);
        let mut states = [start; N];
        for i in samples.clone().rev() {
            let (inverse, stiff) = (1.0 / inverse(i), slope(stiff, i));
            for s in 0..self.steps {
                let tau = load[i + 1] + s as f64 / self.steps as f64 * (load[i] - load[i + 1]);
                // side by side: each waits for its own last step only
                for ((x, v), drained) in states.iter_mut().zip(drained) {
                    let tau = tau + stiff * *x;
                    *v += self.h * (-self.k * self.beyond(*x) - drained * *v - tau) * inverse;
                    *x += self.h * *v;
                }
            }
        }
        // rates of the scheme are those half a step ago, here half a step ahead
        let first = samples.start;
        states.map(|(x, v)| {
            let tau = load[first] + slope(stiff, first) * x;
            (
                x,
                -v + self.h * (self.k * self.beyond(x) + tau) / inverse(first),
            )
        })
    }
}

/// Stiffness and damping of a spring on which the link of an actuator swings with a frequency, Hz, and a damping
/// ratio, and its twist under the largest load: what [`way`] takes them for.
pub(crate) fn constants(cx: &Context, j: usize, frequency: f64, damping: f64) -> [f64; 3] {
    let omega = 2.0 * std::f64::consts::PI * frequency;
    let mean = cx.mass[j][j].iter().sum::<f64>() / cx.data.rows() as f64;
    let stiffness = mean * omega * omega;
    [
        stiffness,
        2.0 * damping * mean * omega,
        cx.peak[j] / stiffness,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Springs, gaps and springs that stiffen do side by side what each does alone.
    #[test]
    fn springs_side_by_side_do_what_each_does_alone() {
        let n = 1500;
        let (load, mass) = (load(n), vec![1.2; n]);
        let carried = Carried {
            load: &load,
            mass: &mass,
            slopes: [&vec![-20.0; n], &vec![0.3; n]],
            measured: &vec![true; n],
        };
        let lanes = [[0.0, 0.0], [0.0, 0.5], [0.002, 0.0], [0.01, 0.0]].map(|[gap, cubic]| {
            let spring = Springs::soft(6.5, 0.06);
            Springs {
                gap,
                cubic,
                ..spring
            }
        });
        for cycle in [Some(1000), None] {
            let together = ways(carried, 0.004, lanes, cycle, 0..3);
            for (alone, together) in lanes.iter().zip(&together) {
                assert_eq!(&way(carried, 0.004, *alone, cycle), together);
            }
            let [[way, rate, a], ..] = ways(carried, 0.004, lanes, cycle, 2..3);
            assert!(way.is_empty() && rate.is_empty());
            assert_eq!(a, together[0][2]);
        }
    }

    /// Four periods of a load with a harmonic at a third of the resonance, 250 Hz.
    fn load(n: usize) -> Vec<f64> {
        let at = |i: usize, f: f64| (2.0 * std::f64::consts::PI * f * i as f64 / 250.0).sin();
        (0..n)
            .map(|i| 20.0 * at(i, 0.25) + 6.0 * at(i, 2.25) - 9.0)
            .collect()
    }

    /// A record that was cut out of a motion swings as the motion that repeats does, from its first sample on, whatever
    /// its ends say.
    #[test]
    fn a_record_that_is_cut_out_of_a_motion_swings_as_the_motion_does() {
        let (n, cycle) = (4000, 1000);
        let (good, mass, stiff) = (load(n), vec![1.2; n], vec![-30.0; n]);
        let whole = Carried {
            load: &good,
            mass: &mass,
            slopes: [&stiff, &[]],
            measured: &vec![true; n],
        };
        let truth = way(whole, 0.004, Springs::soft(6.5, 0.06), Some(cycle));
        // 26 samples at either end have no accelerations
        let (mut spoiled, mut measured) = (good.clone(), vec![true; n]);
        for i in (0..26).chain(n - 26..n) {
            spoiled[i] += if i < 26 { -19.0 } else { 19.0 };
            measured[i] = false;
        }
        let cut = Carried {
            load: &spoiled,
            measured: &measured,
            ..whole
        };
        let found = way(cut, 0.004, Springs::soft(6.5, 0.06), None);
        for (k, name) in ["way", "rate", "acceleration"].iter().enumerate() {
            let size = truth[k].iter().fold(0.0f64, |m, v| m.max(v.abs()));
            let off = (30..n - 30).fold(0.0f64, |m, i| m.max((found[k][i] - truth[k][i]).abs()));
            assert!(off < 0.03 * size, "{name}: {off} of {size}");
        }
    }

    /// Under a constant load with a slope the link stands where spring, load and slope balance.
    #[test]
    fn the_slope_of_the_load_makes_a_spring_softer() {
        let n = 2000;
        let (load, mass, stiff) = (vec![-10.0; n], vec![1.0; n], vec![-100.0; n]);
        let carried = Carried {
            load: &load,
            mass: &mass,
            slopes: [&stiff, &[]],
            measured: &vec![true; n],
        };
        let k = (2.0 * std::f64::consts::PI * 5.0f64).powi(2);
        let found = way(carried, 0.004, Springs::soft(5.0, 0.1), None);
        let stands = 10.0 / (k - 100.0);
        assert!((found[0][n - 1] / stands - 1.0).abs() < 1e-3);
    }
}
