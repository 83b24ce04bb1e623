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

use crate::error::{Warning, WarningKind};
use crate::median::median;

/// Stamps after repair.
#[derive(Debug, Clone, Default)]
pub struct Clock {
    /// rows that are kept; `None` for all
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

/// Looks through the stamps `raw` of the log called `subject`.
pub fn repair(raw: &[f64], subject: &str) -> Clock {
    let mut out = Clock::default();
    let mut warn = |kind, message: String| out.warnings.push(Warning::new(kind, subject, message));
    let steps = || raw.windows(2).map(|w| w[1] - w[0]);
    let time = |x: f64| x.is_finite() && x.abs() < LARGEST;
    let usual = median(steps().filter(|d| *d > 0.0));
    if !usual.is_finite() {
        return out;
    }
    let same = steps().filter(|d| *d == 0.0).count();
    let coarse = same as f64 > 0.1 * raw.len() as f64;

    let mut keep = Vec::with_capacity(raw.len());
    let mut t: Vec<f64> = Vec::with_capacity(raw.len());
    let (mut shift, mut lost, mut twice, mut back, mut wraps) = (0.0, 0, 0, 0, 0);
    let mut wrap_text = String::new();
    let mut first_lost = usize::MAX;
    let (mut wrong, mut ahead) = (Vec::new(), Vec::new());
    let mut room = FILLED * raw.len() as f64;
    // whether a stamp after row i goes on where those before it were, at `last`
    let returns = |i: usize, last: f64, now: f64, shift: f64| {
        let later = raw[i + 1..].iter().take(WRONG).filter(|x| time(**x));
        later.zip(2..).any(|(x, k)| {
            let x = x + shift;
            x > last && x - last < JUMP * f64::from(k) * usual && (x < now || now < last)
        })
    };
    for (i, &x) in raw.iter().enumerate() {
        if !time(x) {
            first_lost = first_lost.min(i);
            lost += 1;
            continue;
        }
        let mut now = x + shift;
        if t.is_empty()
            && let [next, after] = raw[i + 1..]
                .iter()
                .filter(|y| time(**y))
                .take(2)
                .collect::<Vec<_>>()[..]
            && (next - x < -JUMP * usual || next - x > room * usual)
            && (after - next).abs() <= JUMP * usual
        {
            wrong.push((i, x));
            continue;
        }
        if let Some(&last) = t.last() {
            let step = now - last;
            let far = step < -JUMP * usual || step > room.max(JUMP) * usual;
            let at_the_end = far && i + 1 == raw.len();
            if step.abs() > JUMP * usual && (at_the_end || returns(i, last, now, shift)) {
                wrong.push((i, x));
                continue;
            }
            if step > JUMP * usual {
                if far {
                    ahead.push((i, step));
                    shift -= step - CLOSED * usual;
                    now = last + CLOSED * usual;
                } else {
                    room -= step / usual;
                }
            }
            if step < -JUMP * usual {
                // the clock began anew: the next sample follows by one usual step
                let jump = -step + usual;
                if wraps == 0 {
                    wrap_text = match counter(jump) {
                        Some(name) => format!("a counter of {name} that wrapped"),
                        None => "a clock that was set back or began anew".into(),
                    };
                    wrap_text = format!("by {jump:.6} s at row {}: {wrap_text}", i + 1);
                }
                wraps += 1;
                shift += jump;
                now += jump;
            } else if step == 0.0 && !coarse {
                twice += 1;
                continue;
            } else if step < 0.0 {
                back += 1;
                continue;
            }
        }
        keep.push(i);
        t.push(now);
    }
    if lost > 0 {
        warn(
            WarningKind::RowsLeftOut,
            format!(
                "{lost} rows have no time stamp and were left out, the first is row {}",
                first_lost + 1
            ),
        );
    }
    if let Some((row, x)) = wrong.first() {
        warn(
            WarningKind::RowsLeftOut,
            format!(
                "{} time stamps are far from those around them and their rows were left out, the first at row {} \
                 ({x:e} s)",
                wrong.len(),
                row + 1
            ),
        );
    }
    if let Some((row, by)) = ahead.first() {
        let more = match ahead.len() {
            1 => String::new(),
            n => format!(" (and {} times more)", n - 1),
        };
        warn(
            WarningKind::TimeRepaired,
            format!(
                "the time jumps ahead by {by:.6} s at row {}{more}, by far more than the log is long: the clock \
                 was set, or the recording stopped; the stamps after it were moved back to follow by {CLOSED} steps",
                row + 1
            ),
        );
    }
    if wraps > 0 {
        let more = match wraps {
            1 => String::new(),
            n => format!(" (and {} times more)", n - 1),
        };
        warn(
            WarningKind::TimeRepaired,
            format!(
                "the time jumps back {wrap_text}{more}; the stamps after it were moved to follow by one step"
            ),
        );
    }
    if twice > 0 {
        warn(
            WarningKind::RowsLeftOut,
            format!("{twice} time stamps repeat the one before; those rows were left out"),
        );
    }
    if back > 0 {
        warn(
            WarningKind::RowsLeftOut,
            format!("{back} time stamps are earlier than the one before; those rows were left out"),
        );
    }
    if coarse && t.len() > 1 {
        warn(
            WarningKind::TimeRepaired,
            format!(
                "{same} of {} time stamps equal the one before: the clock is coarser than the sampling; \
             the stamps were spread evenly",
                raw.len()
            ),
        );
        let (a, b, n) = (t[0], t[t.len() - 1], t.len() - 1);
        t.iter_mut()
            .enumerate()
            .for_each(|(i, x)| *x = a + (b - a) * i as f64 / n as f64);
    }
    let step = median(t.windows(2).map(|w| w[1] - w[0]));
    if step >= 0.5 {
        warn(
            WarningKind::UnitSuspect,
            format!(
                "the usual step of the time is {step:.4}: is it in milliseconds or microseconds? \
             Seconds are expected"
            ),
        );
    }
    let mut missing = 0.0;
    for w in t.windows(2) {
        let d = w[1] - w[0];
        if d > GAP * step {
            out.gaps.push([w[0], w[1]]);
            missing += d / step - 1.0;
        }
    }
    if !out.gaps.is_empty() {
        let longest = out.gaps.iter().map(|g| g[1] - g[0]).fold(0.0, f64::max);
        let warning = format!(
            "{} gaps in the time, about {missing:.0} samples missing, the longest {longest:.4} s; they \
             are interpolated for the filters and left out of the fit",
            out.gaps.len()
        );
        out.warnings
            .push(Warning::new(WarningKind::TimeGaps, subject, warning));
    }
    // even: against the line from first to last stamp; a grid with gaps is not
    if let [first, .., last] = t[..] {
        let mean = (last - first) / (t.len() - 1) as f64;
        let worst = t
            .iter()
            .enumerate()
            .map(|(i, x)| (x - first - mean * i as f64).abs())
            .fold(0.0, f64::max);
        out.even = worst <= 0.02 * mean;
        if out.even {
            out.step = mean;
        } else {
            out.step = step;
            let spread: Vec<f64> = t
                .windows(2)
                .map(|w| w[1] - w[0])
                .filter(|d| *d <= GAP * step)
                .collect();
            let rms = (spread.iter().map(|d| (d - step) * (d - step)).sum::<f64>()
                / spread.len().max(1) as f64)
                .sqrt();
            if rms > 0.01 * step {
                out.warnings.push(Warning::new(
                    WarningKind::Resampled,
                    subject,
                    format!(
                        "the time stamps jitter by {:.1} % of the usual step of {step:.6} s (rms); \
                         resampled to an even grid",
                        100.0 * rms / step
                    ),
                ));
            }
        }
    }
    out.keep = (keep.len() < raw.len()).then_some(keep);
    out.t = t;
    out
}
