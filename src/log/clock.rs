//! Time stamps: what is wrong with them, and what can be repaired safely.
//!
//! | finding | repair |
//! |---|---|
//! | a stamp that is no number | the row is left out |
//! | a jump back by a whole counter (wrap) or to another origin (restart) | the later stamps are moved so that they follow by one usual step |
//! | a stamp not after the one before (duplicate, out of order) | the row is left out |
//! | many equal stamps (a coarse clock) | stamps are spread evenly |
//! | jitter | resampling to an even grid |
//! | a stamp far from both its neighbours | the row is left out |
//! | a jump ahead by far more than the log is long | the later stamps are moved back, so that a gap of ten steps is left |
//! | a gap | interpolated over so that filters run through, but marked as not measured |

use crate::error::{Warning, WarningKind, agreeing, counted};
use crate::median::median;

/// Stamps after repair.
#[derive(Debug, Clone, Default)]
pub struct Clock {
    /// rows of the file that come before the first
    pub before: usize,
    /// rows that are kept, from that one on; `None` for all
    pub keep: Option<Vec<usize>>,
    /// increasing time of the kept rows, s
    pub t: Vec<f64>,
    /// usual step, s
    pub step: f64,
    /// whether the stamps lie on an even grid to 2 % of a step
    pub even: bool,
    /// from and to of each gap
    pub gaps: Vec<[f64; 2]>,
    /// what was found and done
    pub warnings: Vec<Warning>,
}

/// Steps longer than this many usual ones are gaps.
const GAP: f64 = 2.5;
/// Steps longer than this many usual ones, ahead or back, need an explanation.
const JUMP: f64 = 20.0;
/// Rows within which the time returns to its sequence after a wrong stamp.
const WRONG: usize = 10;
/// Samples that all gaps together may be filled with, in rows of the log: what is interpolated grows
/// with the file, not with a number in it.
const FILLED: f64 = 10.0;
/// Steps that are left of a gap longer than that.
const CLOSED: f64 = 10.0;
/// A step that is too long to be seconds.
const LONG: f64 = 0.5;
/// How far stamps may lie beside an even grid, in steps.
const EVEN: f64 = 0.02;
/// Stamps larger than this are no times (a clock of nanoseconds is at 2e18).
const LARGEST: f64 = 1e21;

/// Counters that wrap: modulus and name.
fn counter(jump: f64) -> Option<&'static str> {
    let moduli = [
        (65.536e-3, "16 bit of microseconds"),
        (65.536, "16 bit of milliseconds"),
        (4.294967296, "32 bit of nanoseconds"),
        (4294.967296, "32 bit of microseconds"),
        (4294967.296, "32 bit of milliseconds"),
        (2147.483648, "31 bit of microseconds"),
        (60.0, "a minute"),
        (3600.0, "an hour"),
        (86400.0, "a day"),
    ];
    moduli
        .into_iter()
        .find(|(m, _)| (jump - m).abs() < 0.002 * m)
        .map(|(_, name)| name)
}

/// The step of an even grid, from the first stamp to the last, if all stamps lie on it.
fn grid(t: &[f64]) -> Option<f64> {
    let [first, .., last] = t[..] else {
        return None;
    };
    let step = (last - first) / (t.len() - 1) as f64;
    let near = |(i, x): (usize, &f64)| (x - first - step * i as f64).abs() <= EVEN * step;
    t.iter().enumerate().all(near).then_some(step)
}

/// The clock of stamps with which nothing is wrong, as most are: each where an even grid has it, and steps that can be
/// seconds. `None` where they need a closer look.
fn sound(raw: &[f64], before: usize) -> Option<Clock> {
    let step = grid(raw).filter(|step| *step > 0.0 && *step < 0.9 * LONG)?;
    // what lies between them is a time as well
    (is_time(raw[0]) && is_time(raw[raw.len() - 1])).then(|| Clock {
        before,
        keep: None,
        t: raw.to_vec(),
        step,
        even: true,
        gaps: Vec::new(),
        warnings: Vec::new(),
    })
}

/// Looks through the stamps `raw` of the log called `subject`, of which so many rows come `before`.
pub fn repair(raw: &[f64], before: usize, subject: &str) -> Clock {
    sound(raw, before).unwrap_or_else(|| looked_through(raw, before, subject))
}

fn looked_through(raw: &[f64], before: usize, subject: &str) -> Clock {
    let steps = || raw.windows(2).map(|w| w[1] - w[0]);
    let usual = median(steps().filter(|d| *d > 0.0));
    if !usual.is_finite() {
        return Clock::default();
    }
    let same = same(raw);
    let coarse = coarse(raw);
    let mut scan = Scan::new(raw, before, usual, coarse);
    for i in 0..raw.len() {
        scan.take(i);
    }
    let Scan {
        keep, mut t, found, ..
    } = scan;
    let mut warnings = found.warnings(subject);
    let mut warn = |kind, message: String| warnings.push(Warning::new(kind, subject, message));
    if coarse && t.len() > 1 {
        warn(
            WarningKind::TimeRepaired,
            format!(
                "{same} of {} time stamps equal the one before: the clock is coarser than the sampling; \
             the stamps were spread evenly",
                raw.len()
            ),
        );
        spread(&mut t);
    }
    let step = median(t.windows(2).map(|w| w[1] - w[0]));
    if step >= LONG {
        warn(
            WarningKind::UnitSuspect,
            format!(
                "the usual step of the time is {step:.4}: is it in milliseconds or microseconds? \
             Seconds are expected"
            ),
        );
    }
    let gaps = gaps(&t, step);
    warnings.extend(missing(&gaps, step, subject));
    let (step, even, jitter) = evenness(&t, step);
    warnings.extend(jitter.map(|share| {
        let message = format!(
            "the time stamps jitter by {:.1} % of the usual step of {step:.6} s (rms); \
             resampled to an even grid",
            100.0 * share
        );
        Warning::new(WarningKind::Resampled, subject, message)
    }));
    Clock {
        before,
        keep: (keep.len() < raw.len()).then_some(keep),
        t,
        step,
        even,
        gaps,
        warnings,
    }
}

/// How many stamps equal the one before.
pub(super) fn same(t: &[f64]) -> usize {
    t.windows(2).filter(|w| w[1] == w[0]).count()
}

/// Whether so many are equal that the clock is coarser than the sampling.
pub(super) fn coarse(t: &[f64]) -> bool {
    same(t) as f64 > 0.1 * t.len() as f64
}

/// Stamps of a coarse clock at even distances: where it goes on for the first and for the last time it is right; in which
/// part of a stamp the record begins and ends nobody knows.
fn spread(t: &mut [f64]) {
    let mut on = (1..t.len()).filter(|&i| t[i] > t[i - 1]);
    let (from, to) = match (on.next(), on.next_back()) {
        (Some(a), Some(b)) => (a, b),
        _ => (0, t.len() - 1),
    };
    let (a, b) = (t[from], t[to]);
    let step = (b - a) / (to - from) as f64;
    t.iter_mut()
        .enumerate()
        .for_each(|(i, x)| *x = a + (i as f64 - from as f64) * step);
}

/// Whether a step is far longer than the usual one.
pub(crate) fn is_gap(ahead: f64, step: f64) -> bool {
    ahead > GAP * step
}

/// From and to of each step that is far too long.
fn gaps(t: &[f64], step: f64) -> Vec<[f64; 2]> {
    let long = |w: &&[f64]| is_gap(w[1] - w[0], step);
    t.windows(2).filter(long).map(|w| [w[0], w[1]]).collect()
}

fn missing(gaps: &[[f64; 2]], step: f64, subject: &str) -> Option<Warning> {
    let longest = gaps.iter().map(|g| g[1] - g[0]).reduce(f64::max)?;
    let missing: f64 = gaps.iter().map(|g| (g[1] - g[0]) / step - 1.0).sum();
    let message = format!(
        "{} in the time, about {} missing, the longest {longest:.4} s; interpolated for the filters and left out of the fit",
        counted(gaps.len(), "gap"),
        counted(missing.round() as usize, "sample")
    );
    Some(Warning::new(WarningKind::TimeGaps, subject, message))
}

/// Step of the grid, whether the stamps lie on it, and how far they jitter, as a share of it, where that is worth a
/// word. Even is meant against the line from first to last stamp; a grid with gaps is not.
fn evenness(t: &[f64], step: f64) -> (f64, bool, Option<f64>) {
    if t.len() < 2 {
        return (0.0, false, None);
    }
    if let Some(step) = grid(t) {
        return (step, true, None);
    }
    let spread: Vec<f64> = t
        .windows(2)
        .map(|w| w[1] - w[0])
        .filter(|d| *d <= GAP * step)
        .collect();
    let rms = (spread.iter().map(|d| (d - step) * (d - step)).sum::<f64>()
        / spread.len().max(1) as f64)
        .sqrt();
    (step, false, (rms > 0.01 * step).then_some(rms / step))
}

/// What is wrong with the stamps of a log.
#[derive(Default)]
struct Found {
    /// rows without a time, and the number of the first of them in the file, from 1, as all rows here
    lost: usize,
    first_lost: Option<usize>,
    /// rows with a stamp far from those around them
    wrong: Vec<(usize, f64)>,
    /// rows at which the time jumps ahead, and by how much
    ahead: Vec<(usize, f64)>,
    /// how often it jumps back, and what the first jump is
    wraps: usize,
    wrap: String,
    twice: usize,
    back: usize,
}

/// A pass over the stamps.
struct Scan<'a> {
    raw: &'a [f64],
    /// rows of the file that come before the first
    before: usize,
    /// usual step, s
    usual: f64,
    /// whether equal stamps come from a coarse clock
    coarse: bool,
    /// rows that are kept, and their times
    keep: Vec<usize>,
    t: Vec<f64>,
    /// by which stamps are moved from here on, s
    shift: f64,
    /// steps that gaps may still take
    room: f64,
    found: Found,
}

fn is_time(x: f64) -> bool {
    x.is_finite() && x.abs() < LARGEST
}

impl<'a> Scan<'a> {
    fn new(raw: &'a [f64], before: usize, usual: f64, coarse: bool) -> Self {
        Scan {
            raw,
            before,
            usual,
            coarse,
            keep: Vec::with_capacity(raw.len()),
            t: Vec::with_capacity(raw.len()),
            shift: 0.0,
            room: FILLED * raw.len() as f64,
            found: Found::default(),
        }
    }

    /// The number of row `i` in the file, from 1.
    fn row(&self, i: usize) -> usize {
        self.before + i + 1
    }

    /// Keeps row `i` and its time, or leaves it out and remembers why.
    fn take(&mut self, i: usize) {
        let x = self.raw[i];
        if !is_time(x) {
            self.found.lost += 1;
            let row = self.row(i);
            self.found.first_lost.get_or_insert(row);
            return;
        }
        let now = match self.t.last() {
            None if self.strays(i) => {
                self.found.wrong.push((self.row(i), x));
                None
            }
            None => Some(x + self.shift),
            Some(&last) => self.after(i, last),
        };
        if let Some(now) = now {
            self.keep.push(i);
            self.t.push(now);
        }
    }

    /// Whether the first stamp is far from the next two, which are near one another.
    fn strays(&self, i: usize) -> bool {
        let x = self.raw[i];
        let mut later = self.raw[i + 1..].iter().filter(|y| is_time(**y));
        let (Some(next), Some(after)) = (later.next(), later.next()) else {
            return false;
        };
        (next - x < -JUMP * self.usual || next - x > self.room * self.usual)
            && (after - next).abs() <= JUMP * self.usual
    }

    /// Whether a stamp after row `i` goes on where those before it were, at `last`.
    fn returns(&self, i: usize, last: f64, now: f64) -> bool {
        let near = self.raw[i + 1..].iter().take(WRONG);
        let mut later = near.filter(|x| is_time(**x)).zip(2..);
        later.any(|(x, k)| {
            let x = x + self.shift;
            x > last && x - last < JUMP * f64::from(k) * self.usual && (x < now || now < last)
        })
    }

    /// Time of row `i` that follows `last`; `None` where it is left out.
    fn after(&mut self, i: usize, last: f64) -> Option<f64> {
        let (x, usual) = (self.raw[i], self.usual);
        let now = x + self.shift;
        let step = now - last;
        let far = step < -JUMP * usual || step > self.room.max(JUMP) * usual;
        let at_the_end = far && i + 1 == self.raw.len();
        if step.abs() > JUMP * usual && (at_the_end || self.returns(i, last, now)) {
            self.found.wrong.push((self.row(i), x));
            return None;
        }
        if step > JUMP * usual && far {
            self.found.ahead.push((self.row(i), step));
            self.shift -= step - CLOSED * usual;
            return Some(last + CLOSED * usual);
        }
        if step > JUMP * usual {
            self.room -= step / usual;
        } else if step < -JUMP * usual {
            // the clock began anew: the next sample follows by one usual step
            let jump = -step + usual;
            if self.found.wraps == 0 {
                let what = match counter(jump) {
                    Some(name) => format!("a counter of {name} that wrapped"),
                    None => "a clock that was set back or began anew".into(),
                };
                self.found.wrap = format!("by {jump:.6} s at row {}: {what}", self.row(i));
            }
            self.found.wraps += 1;
            self.shift += jump;
            return Some(now + jump);
        } else if step == 0.0 && !self.coarse {
            self.found.twice += 1;
            return None;
        } else if step < 0.0 {
            self.found.back += 1;
            return None;
        }
        Some(now)
    }
}

/// ` (and 2 times more)` of three.
fn more(count: usize) -> String {
    match count {
        1 => String::new(),
        n => format!(" (and {} more)", agreeing(n - 1, "time", "times")),
    }
}

impl Found {
    fn warnings(&self, subject: &str) -> Vec<Warning> {
        let mut out = Vec::new();
        let mut warn = |kind, message: String| out.push(Warning::new(kind, subject, message));
        if let Some(first) = self.first_lost {
            warn(
                WarningKind::RowsLeftOut,
                format!(
                    "{} no time stamp: left out, the first is row {}",
                    agreeing(self.lost, "row has", "rows have"),
                    first
                ),
            );
        }
        if let Some((row, x)) = self.wrong.first() {
            warn(
                WarningKind::RowsLeftOut,
                format!(
                    "{} far from those around; left out with all of the row, the first at row {} ({x:e} s)",
                    agreeing(self.wrong.len(), "time stamp is", "time stamps are"),
                    row
                ),
            );
        }
        if let Some((row, by)) = self.ahead.first() {
            warn(
                WarningKind::TimeRepaired,
                format!(
                    "the time jumps ahead by {by:.6} s at row {}{}, by far more than the log is long: the clock \
                     was set, or the recording stopped; the stamps after it were moved back to follow by {CLOSED} steps",
                    row,
                    more(self.ahead.len())
                ),
            );
        }
        if self.wraps > 0 {
            warn(
                WarningKind::TimeRepaired,
                format!(
                    "the time jumps back {}{}; the stamps after it were moved to follow by one step",
                    self.wrap,
                    more(self.wraps)
                ),
            );
        }
        if self.twice > 0 {
            warn(
                WarningKind::RowsLeftOut,
                format!(
                    "{} the one before: left out with all of the row",
                    agreeing(self.twice, "time stamp repeats", "time stamps repeat")
                ),
            );
        }
        if self.back > 0 {
            warn(
                WarningKind::RowsLeftOut,
                format!(
                    "{} earlier than the one before: left out with all of the row",
                    agreeing(self.back, "time stamp is", "time stamps are")
                ),
            );
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The quick look finds what the whole one does, and leaves to it whatever is wrong.
    #[test]
    fn a_sound_clock_needs_no_closer_look() {
        let mut quick = 0;
        for case in 0..600usize {
            let jitter = 0.03 * (case % 4) as f64 / 3.0;
            let step = [0.001, 0.004, 0.46, 0.6][case % 4 / 2 + case % 3 / 2];
            let stamp = |i: usize| {
                let off = ((i * 7919 + case) % 1000) as f64 / 1000.0 - 0.5;
                (case % 7) as f64 * 100.0 + step * (i as f64 + 2.0 * jitter * off)
            };
            let mut t: Vec<f64> = (0..200).map(stamp).collect();
            match case % 10 {
                0 => t[50] = f64::NAN,
                1 => t[50] = t[49],
                2 => t[120] += 0.5 * step,
                3 => t[199] = f64::INFINITY,
                4 => t.iter_mut().skip(90).for_each(|x| *x += 9.0 * step),
                5 => t[0] = 2.7e157,
                _ => {}
            }
            if let Some(sound) = sound(&t, 0) {
                let whole = looked_through(&t, 0, "log");
                quick += 1;
                assert_eq!((sound.keep, sound.t), (whole.keep, whole.t), "case {case}");
                assert_eq!((sound.step, sound.even), (whole.step, whole.even));
                assert!(whole.gaps.is_empty() && whole.warnings.is_empty());
                assert!(case % 10 > 5, "case {case}");
            }
        }
        assert!((60..400).contains(&quick), "{quick}");
        assert!(sound(&[1.0], 0).is_none() && sound(&[2.0, 1.0], 0).is_none());
    }
}
