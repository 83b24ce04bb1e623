//! Channels that cannot be what was measured: saturated, stuck, dropped, in other units.

use crate::error::{Warning, WarningKind};
use crate::extremes::extremes;
use crate::median::median;
use crate::robot::{Joint, Motion};
use std::f64::consts::PI;
use std::ops::Range;

/// Runs of equal neighbours.
fn runs(y: &[f64]) -> impl Iterator<Item = Range<usize>> + '_ {
    let mut start = 0;
    std::iter::from_fn(move || {
        if start >= y.len() {
            return None;
        }
        let length = y[start..].iter().take_while(|x| **x == y[start]).count();
        let run = start..start + length.max(1);
        start = run.end;
        Some(run)
    })
}

/// A torque channel that is clipped.
pub struct Clipped {
    /// where it stands there
    pub at: Vec<Range<usize>>,
    /// samples at the level where it stands more often
    pub count: usize,
    /// that level
    pub level: f64,
}

/// Samples of a run at the least that clipping is told by.
const SHORTEST: usize = 5;

/// The samples of a torque channel that stand at its largest or smallest value for long, as clipping makes them.
///
/// A channel that is merely coarse also dwells at its extremes, but no longer than elsewhere: what
/// counts are runs of at least five samples, four times as long as usual in this channel, that
/// make up at least 0.1 % of the record; or any such run at the effort limit.
pub fn saturated(y: &[f64], effort: f64) -> Option<Clipped> {
    saturated_within(y, extremes(y), effort)
}

/// The same of a channel whose smallest and largest values are known.
pub(super) fn saturated_within(y: &[f64], [low, high]: [f64; 2], effort: f64) -> Option<Clipped> {
    if high <= low || !(high - low).is_finite() {
        return None;
    }
    // found only where a run is long enough: few channels have one
    let mut usual = None;
    let mut worst: Option<Clipped> = None;
    for level in [high, low] {
        let near = |x: f64| (x - level).abs() <= 1e-9 * (high - low);
        // a run at the level, and not only of equal values, so that rounding does not hide it
        let mut found = Vec::new();
        // every run that is long enough holds one of these
        let mut probe = SHORTEST - 1;
        while probe < y.len() {
            if !near(y[probe]) {
                probe += SHORTEST;
                continue;
            }
            let before = y[..probe].iter().rev().take_while(|x| near(**x)).count();
            let i = probe - before;
            let length = before + y[probe..].iter().take_while(|x| near(**x)).count();
            if length >= SHORTEST {
                let usual = *usual.get_or_insert_with(|| median(runs(y).map(|r| r.len() as f64)));
                if length as f64 >= 4.0 * usual {
                    found.push(i..i + length);
                }
            }
            // the sample behind the run is not near
            probe = i + length + SHORTEST;
        }
        let count: usize = found.iter().map(Range::len).sum();
        let at_limit = level.abs() >= 0.98 * effort && count > 0;
        // a channel that rests at its extreme throughout is constant, not clipped
        if (count as f64 >= 1e-3 * y.len() as f64 && count * 2 < y.len()) || at_limit {
            let clipped = worst.get_or_insert(Clipped {
                at: Vec::new(),
                count,
                level,
            });
            if count > clipped.count {
                (clipped.count, clipped.level) = (count, level);
            }
            clipped.at.extend(found);
        }
    }
    worst
}

/// Runs of equal values longer than a tenth of a second while any of these joints moves (at at least half of the run).
pub fn stuck(y: &[f64], step: f64, joints: &[Moving]) -> Vec<Range<usize>> {
    stuck_where(y, step, |range| {
        let length = range.len();
        2 * range.filter(|i| joints.iter().any(|j| j.at(*i))).count() >= length
    })
}

/// Part of its whole range that a command must travel while an encoder stands still, for the
/// encoder to be stuck: a joint held by its friction about a reversal stands still, too.
const TRAVEL: f64 = 0.02;

/// Runs of equal values of an encoder longer than a tenth of a second while the command goes on.
pub fn stuck_encoder(y: &[f64], command: &[f64], step: f64) -> Vec<Range<usize>> {
    let extent = |y: &[f64]| {
        let [low, high] = extremes(y);
        high - low
    };
    let enough = TRAVEL * extent(command);
    stuck_where(y, step, |range| extent(&command[range]) > enough)
}

fn stuck_where(y: &[f64], step: f64, counts: impl Fn(Range<usize>) -> bool) -> Vec<Range<usize>> {
    let least = ((0.1 / step).ceil() as usize).max(20);
    let mut out = long_runs(y, least);
    out.retain(|run| counts(run.clone()));
    out
}

/// Runs of `least` equal neighbours or more, of two at least.
fn long_runs(y: &[f64], least: usize) -> Vec<Range<usize>> {
    let mut out = Vec::new();
    // every run that is long enough holds one of these and the sample before it
    let stride = least.max(2) - 1;
    let mut probe = stride;
    while probe < y.len() {
        let value = y[probe];
        if y[probe - 1] != value {
            probe += stride;
            continue;
        }
        let same = |x: &&f64| **x == value;
        let start = probe - y[..probe].iter().rev().take_while(same).count();
        let end = probe + y[probe..].iter().take_while(same).count();
        if end - start >= least {
            out.push(start..end);
        }
        probe = end + stride;
    }
    out
}

/// Whether a position channel moves, from how far it is from a quarter of a tenth of a second before and after.
pub struct Moving<'a> {
    y: &'a [f64],
    /// samples to either side
    reach: usize,
    /// beyond which it moves; infinite for a channel that never does
    enough: f64,
}

impl<'a> Moving<'a> {
    /// Of a channel with its smallest and largest value, and this time between its samples, s.
    pub fn new(y: &'a [f64], [low, high]: [f64; 2], step: f64) -> Self {
        Moving {
            y,
            reach: ((0.025 / step) as usize).max(2),
            enough: match high > low {
                true => 1e-4 * (high - low),
                false => f64::INFINITY,
            },
        }
    }

    /// At a sample.
    pub fn at(&self, i: usize) -> bool {
        let last = self.y.len() - 1;
        let (a, b) = (i.saturating_sub(self.reach), i.saturating_add(self.reach));
        (self.y[b.min(last)] - self.y[a]).abs() > self.enough
    }

    /// Anywhere.
    pub fn ever(&self) -> bool {
        (0..self.y.len()).any(|i| self.at(i))
    }
}

/// What the smallest and largest position of a joint say about their unit, if anything.
pub fn position_unit(joint: &Joint, [low, high]: [f64; 2]) -> Option<Warning> {
    let limits = joint.limits.position;
    let span = limits[1] - limits[0];
    let fits = |scale: f64| {
        let slack = 0.02 * span.min(1e3);
        low * scale >= limits[0] - slack && high * scale <= limits[1] + slack
    };
    let bounded = span.is_finite();
    if bounded && fits(1.0) || !bounded && (high - low) < 8.0 * PI {
        return None;
    }
    let text = |why: &str| {
        Some(Warning::new(
            WarningKind::UnitSuspect,
            &joint.name,
            format!("its positions go from {low:.3} to {high:.3}, {why}"),
        ))
    };
    let revolute = joint.motion == Motion::Revolute;
    // a motor turns the gear's ratio times as far: far beyond the limits, and not a little
    let far = high - low > 1.5 * span;
    let geared = joint.gear_ratio.is_some_and(|gear| {
        gear.abs() > 1.5 && bounded && far && (fits(1.0 / gear) || fits(-1.0 / gear))
    });
    let degrees =
        revolute && high.abs().max(low.abs()) > 2.0 * PI && (fits(PI / 180.0) || !bounded);
    match (degrees, geared) {
        (true, true) => {
            return text(
                "which fits its limits as degrees, or after division by the gear ratio as positions of \
                 the motor; radians of the joint are expected",
            );
        }
        (true, false) => return text("which looks like degrees; radians are expected"),
        (false, true) => {
            return text(
                "which fits its limits only after division by the gear ratio: are they those of the motor?",
            );
        }
        (false, false) => {}
    }
    if !revolute && fits(1e-3) {
        return text("which looks like millimetres; metres are expected");
    }
    bounded
        .then(|| {
            text(&format!(
                "beyond its limits of {:.3} to {:.3}: another unit, another zero, another joint, or a limit that is \
                 narrower than the robot's?",
                limits[0], limits[1]
            ))
        })
        .flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run at the highest value is found wherever it begins, and not where it is a sample short.
    #[test]
    fn a_channel_that_is_clipped_is_found_wherever_it_is() {
        for (length, start) in (4..9).flat_map(|l| (0..40).map(move |s| (l, s))) {
            let wave = |i: usize| (0.37 * i as f64).sin();
            let mut y: Vec<f64> = (0..400).map(wave).collect();
            let second = start + length + 1 + start % 7;
            for from in [start, second] {
                y[from..from + length].fill(3.0);
            }
            let found = saturated(&y, 100.0).map(|c| c.at);
            let expected = vec![start..start + length, second..second + length];
            assert_eq!(found, (length >= SHORTEST).then_some(expected), "{start}");
        }
    }

    /// Long runs are those among all runs, wherever they begin and however long they are.
    #[test]
    fn long_runs_are_the_long_ones_of_all_runs() {
        let mut state = 5u64;
        let mut found = 0;
        for least in 1..9 {
            for _ in 0..200 {
                let mut y = Vec::new();
                while y.len() < 60 {
                    state = state.wrapping_mul(6364136223846793005).wrapping_add(1);
                    let length = 1 + (state >> 40) as usize % (2 * least);
                    let value = match state >> 60 {
                        0 => f64::NAN,
                        x => x as f64,
                    };
                    y.extend(std::iter::repeat_n(value, length));
                }
                let expected: Vec<_> = runs(&y).filter(|r| r.len() >= least.max(2)).collect();
                found += expected.len();
                assert_eq!(long_runs(&y, least.max(2)), expected, "{least}");
            }
        }
        assert!(found > 1000, "{found}");
    }
}
