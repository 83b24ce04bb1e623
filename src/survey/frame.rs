//! A record as it is looked at: its columns on an even grid, without what cannot have been measured.

use super::claim::{Claim, Means};
use super::file_name;
use crate::error::{Error, Result, Warning, WarningKind, agreeing, counted};
use crate::extremes::extremes;
use crate::log::Table;
use crate::log::channels;
use crate::log::clock;
use crate::log::formats::Format;
use crate::log::layout::{Layout, Time, time_unit};
use crate::log::names;
use crate::log::place::Place;
use crate::log::record::{impossible, too_few, unmeasured};
use crate::log::resample::{Order, fill, interpolate};
use crate::log::turns;
use crate::median::median;
use crate::plant::Plant;
use rayon::prelude::*;
use std::collections::VecDeque;
use std::f64::consts::TAU;
use std::path::PathBuf;

/// Grid points of a record, in its rows.
const MOST: f64 = 3.0;

/// One record.
#[derive(Debug)]
pub struct Frame {
    /// its files
    pub paths: Vec<PathBuf>,
    /// rows of the file
    pub rows: usize,
    /// names of the columns
    pub names: Vec<String>,
    /// columns of texts that hold the same one throughout: their names, and what they hold
    pub labels: Vec<[String; 2]>,
    /// number of the column of the time
    pub time: Option<usize>,
    /// samples a second, where no column is a time and the velocities tell them
    pub rate: Option<f64>,
    /// unit of the time
    pub time_unit: &'static str,
    /// step of the grid, s
    pub step: f64,
    /// where the grid begins, s from the start of the record: 0 unless it is a part of a long one
    pub start: f64,
    /// length of the record, s
    pub length: f64,
    /// first and last stamp as logged, and what makes seconds of them
    pub(super) stamps: [f64; 2],
    pub(super) factor: f64,
    /// the columns on the grid
    pub columns: Vec<Vec<f64>>,
    /// from and to of each gap, s from the start
    pub gaps: Vec<[f64; 2]>,
    /// columns without any number
    pub silent: Vec<usize>,
    /// what was wrong
    pub warnings: Vec<Warning>,
}

/// What the time of a record is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ticks {
    /// number of its column
    column: Option<usize>,
    /// what makes seconds of it
    factor: f64,
    /// samples a second, where no column is a time
    rate: Option<f64>,
}

/// What a joint does in a record.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Course {
    /// when it moves, s from the start
    pub moves: Vec<[f64; 2]>,
    /// least and largest position, rad or m
    pub range: Option<[f64; 2]>,
    /// largest velocity, rad/s or m/s
    pub fastest: Option<f64>,
    /// samples at which its torque is saturated
    pub saturated: usize,
}

impl Frame {
    /// From a table; `like` is another part of the same log, which says what the time is.
    pub(super) fn new(
        paths: Vec<PathBuf>,
        mut table: Table,
        format: Format,
        like: Option<Ticks>,
    ) -> Result<Self> {
        let path = paths.first().cloned().unwrap_or_default();
        let rows = table.rows();
        let subject = file_name(&path);
        let mut warnings = std::mem::take(&mut table.warnings);
        for w in &mut warnings {
            w.subject = subject.clone();
        }
        if rows < 8 {
            return Err(Error::file(&path, "", too_few(rows, &warnings)));
        }
        let found = match (like, Layout::time_of(&table, format)) {
            (Some(like), _) => like.column.map(|k| (k, Some(like.factor))),
            (None, Some(Time::Column(Place::Number(k), factor))) => Some((k - 1, factor)),
            (None, _) => even(&table).map(|k| (k, None)),
        };
        let (raw, time_name, factor) = match found {
            Some((k, factor)) => {
                let (guess, name) = time_unit(&table.columns[k]);
                let factor = factor.unwrap_or(guess);
                let name = [
                    ("s", 1.0),
                    ("ms", 1e-3),
                    ("us", 1e-6),
                    ("ns", 1e-9),
                    ("min", 60.0),
                ]
                .into_iter()
                .find(|(_, f)| *f == factor)
                .map_or(name, |(n, _)| n);
                let column = &table.columns[k];
                let origin = column
                    .iter()
                    .copied()
                    .find(|x| x.abs() < 1e21)
                    .unwrap_or(0.0);
                let raw = column.iter().map(|x| (x - origin) * factor).collect();
                (raw, name, factor)
            }
            None => {
                let raw: Vec<f64> = (0..rows).map(|i| i as f64).collect();
                (raw, "none", 1.0)
            }
        };
        let clock = clock::repair(&raw, table.before, &subject);
        warnings.extend(
            clock
                .warnings
                .iter()
                .filter(|w| w.kind != WarningKind::UnitSuspect || found.is_some())
                .cloned(),
        );
        if clock.t.len() < 8 {
            let message = format!(
                "of {rows} rows only {} have a time stamp later than the one before; which column is the time?",
                clock.t.len()
            );
            return Err(Error::file(&path, "", message));
        }
        let first = clock.t[0];
        let stamps = found.map_or([0.0; 2], |(k, _)| {
            let row = |i: usize| clock.keep.as_ref().map_or(i, |keep| keep[i]);
            [0, clock.t.len() - 1].map(|i| table.columns[k][row(i)])
        });
        let t: Vec<f64> = clock.t.iter().map(|x| x - first).collect();
        let end = t[t.len() - 1];
        let count = (end / clock.step + 0.1).floor() as usize + 1;
        let step = match count as f64 > MOST * t.len() as f64 {
            true => end / (MOST * t.len() as f64),
            false => clock.step,
        };
        let count = (end / step + 0.1).floor() as usize + 1;
        let grid: Vec<f64> = (0..count).map(|i| i as f64 * step).collect();
        let mut columns = Vec::with_capacity(table.columns.len());
        let mut silent = Vec::new();
        for (k, column) in table.columns.iter_mut().enumerate() {
            let mut y: Vec<f64> = match &clock.keep {
                Some(keep) => keep.iter().map(|&i| column[i]).collect(),
                None => std::mem::take(column),
            };
            let wrong = match found {
                Some((time, _)) if time == k => Vec::new(),
                // another stamp, whatever its size
                _ if counts_up(&y) => Vec::new(),
                _ => impossible(&y),
            };
            if let Some(&at) = wrong.first() {
                let row = table.before + clock.keep.as_ref().map_or(at, |r| r[at]) + 1;
                warnings.push(Warning::new(
                    WarningKind::SamplesLeftOut,
                    format!("{subject}: {}", table.names[k]),
                    unmeasured(wrong.len(), row, y[at]),
                ));
            }
            wrong.iter().for_each(|&i| y[i] = f64::NAN);
            if found.is_none_or(|(time, _)| time != k)
                && let Some(count) = continuous(&mut y)
            {
                warnings.push(Warning::new(
                    WarningKind::TurnsCounted,
                    format!("{subject}: {}", table.names[k]),
                    format!(
                        "it jumps by a whole turn {}: it was made continuous",
                        counted(count, "time")
                    ),
                ));
            }
            let holes = y.iter().filter(|x| !x.is_finite()).count();
            if holes == y.len() {
                columns.push(vec![0.0; count]);
                silent.push(k);
                continue;
            }
            if holes > wrong.len() {
                warnings.push(Warning::new(
                    WarningKind::SamplesLeftOut,
                    format!("{subject}: {}", table.names[k]),
                    format!(
                        "of {} values {} missing",
                        y.len(),
                        agreeing(holes, "is", "are")
                    ),
                ));
            }
            fill(&t, &mut y, Order::Linear);
            columns.push(match clock.even && count == y.len() {
                true => y,
                false => interpolate(&t, &y, &grid, Order::Linear),
            });
        }
        let mut frame = Frame {
            paths,
            rows,
            names: table.names,
            labels: table.labels,
            time: found.map(|(k, _)| k),
            rate: None,
            time_unit: time_name,
            step,
            start: 0.0,
            length: step * (count - 1) as f64,
            stamps,
            factor,
            columns,
            gaps: clock
                .gaps
                .iter()
                .map(|g| [g[0] - first, g[1] - first])
                .collect(),
            silent,
            warnings,
        };
        if let Some(rate) = like.and_then(|l| l.rate) {
            frame.count_by(rate);
        }
        Ok(frame)
    }

    /// What its time is.
    pub(super) fn ticks(&self) -> Ticks {
        Ticks {
            column: self.time,
            factor: self.factor,
            rate: self.rate,
        }
    }

    /// Counts time by so many samples a second.
    fn count_by(&mut self, rate: f64) {
        let longer = 1.0 / (rate * self.step);
        self.rate = Some(rate);
        self.step *= longer;
        self.length *= longer;
        self.start *= longer;
    }

    /// Counts time by so many samples a second, where no column is one.
    pub(super) fn paced(&mut self, rate: Option<f64>) -> Option<Warning> {
        if self.time.is_some() {
            return None;
        }
        let message = match rate {
            Some(rate) => {
                self.count_by(rate);
                format!(
                    "no column is a time: with {rate} samples a second the velocities are the derivatives of the positions, \
                     and so they were counted; state another time = {{ rate = … }} where it is wrong"
                )
            }
            None => "no column is a time: its samples are counted, and all rates are for a step of one second; state \
                     time = { rate = … }"
                .into(),
        };
        let subject = self.paths.first().map_or(String::new(), |p| file_name(p));
        Some(Warning::new(WarningKind::TimeRepaired, subject, message))
    }

    /// Warnings of the channels that were not recorded.
    pub(super) fn unrecorded(&self) -> Vec<Warning> {
        let file = self.paths.first().map_or(String::new(), |p| file_name(p));
        let warning = |k: &usize| {
            Warning::new(
                WarningKind::SamplesLeftOut,
                format!("{file}: {}", self.names[*k]),
                "it holds no number at all: the channel was not recorded",
            )
        };
        self.silent.iter().map(warning).collect()
    }

    /// Length of the record, s.
    pub fn duration(&self) -> f64 {
        self.length
    }

    /// From and to of its grid, s from the start of the record.
    pub(super) fn looked_at(&self) -> [f64; 2] {
        let length = self.step * self.len().saturating_sub(1) as f64;
        [self.start, self.start + length]
    }

    /// What the time is in, in words.
    pub(super) fn clock(&self) -> String {
        match (self.time, self.rate) {
            (Some(_), _) => format!("time in {}", self.time_unit),
            (None, Some(_)) => "no time, counted by the velocities".into(),
            (None, None) => "no time".into(),
        }
    }

    /// How many rows a second there are, in words: by the usual step, and in the mean where that is another.
    pub(super) fn pace(&self) -> String {
        let usual = 1.0 / self.step;
        let mean = self.rows.saturating_sub(1) as f64 / self.duration();
        match (mean / usual - 1.0).abs() > 0.02 && mean.is_finite() {
            true => format!("{mean:.1} Hz in the mean, {usual:.1} Hz by the usual step"),
            false => format!("{usual:.1} Hz"),
        }
    }

    /// Samples of the grid.
    pub fn len(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The column of a joint that means this, in SI units.
    pub(super) fn channel(&self, claims: &[Claim], means: Means, joint: usize) -> Option<Vec<f64>> {
        let k = claims
            .iter()
            .position(|c| c.means == means && c.at == Some(joint))
            .filter(|k| !self.silent.contains(k))?;
        let factor = claims[k].factor();
        Some(self.columns.get(k)?.iter().map(|x| x * factor).collect())
    }

    /// How far each joint goes in a moment, at the most: what tells motion from noise.
    pub(super) fn strides(&self, claims: &[Claim], joints: usize) -> Vec<f64> {
        let of = |j: usize| {
            let q = self.channel(claims, Means::Position, j);
            q.map_or(0.0, |q| largest(&travel(&q, moment(&q, self.step))))
        };
        (0..joints).into_par_iter().map(of).collect()
    }

    /// What each joint does; `strides` are those of a part of the record in which it moves, or none.
    pub(super) fn courses(
        &self,
        claims: &[Claim],
        joints: usize,
        robot: Option<&Plant>,
        strides: &[f64],
    ) -> Vec<Course> {
        (0..joints)
            .into_par_iter()
            .map(|j| {
                let q = self.channel(claims, Means::Position, j);
                let (moves, fastest) = match &q {
                    Some(q) => {
                        let stride = strides.get(j).copied().unwrap_or_default();
                        let moving = still_aware(q, self.step, stride);
                        let k = ((0.02 / self.step) as usize).max(1);
                        let fastest = (k..q.len())
                            .map(|i| (q[i] - q[i - k]).abs() / (k as f64 * self.step))
                            .fold(0.0, f64::max);
                        (intervals(&moving, self.step), Some(fastest))
                    }
                    None => (Vec::new(), None),
                };
                let tau = self.channel(claims, Means::Torque, j);
                let effort = robot.map_or(f64::INFINITY, |p| p.actuators()[j].limits.effort);
                let clipped = tau.and_then(|tau| channels::saturated(&tau, effort));
                let saturated = clipped.map_or(0, |c| c.count);
                Course {
                    moves,
                    range: q.as_deref().map(|q| in_turn(extremes(q), robot, j)),
                    fastest,
                    saturated,
                }
            })
            .collect()
    }
}

/// Smallest and largest position of a joint in the turn in which it is read.
fn in_turn(range: [f64; 2], robot: Option<&Plant>, j: usize) -> [f64; 2] {
    let joint = robot.and_then(|p| p.actuators().get(j).copied());
    let by = joint.map_or(0.0, |joint| turns::to_add(joint, range));
    range.map(|x| x + by * TAU)
}

/// Makes a column continuous that is an angle in rad or degrees which wraps at a whole turn; how often it jumps.
fn continuous(y: &mut [f64]) -> Option<usize> {
    let ends = extremes(y);
    let turn = [TAU, 360.0]
        .into_iter()
        .find(|turn| turns::may_wrap(ends, *turn))?;
    turns::unwrap(y, turn).map(|(count, _)| count)
}

/// The record in which the columns change most, each measured by its largest range in any record.
pub(super) fn richest(frames: &[Frame]) -> Option<&Frame> {
    let width = |f: &Frame, k: usize| {
        let [a, b] = extremes(f.columns.get(k).map_or(&[], Vec::as_slice));
        (b - a).max(0.0)
    };
    let columns = frames.first()?.columns.len();
    let most: Vec<f64> = (0..columns)
        .map(|k| frames.iter().map(|f| width(f, k)).fold(0.0, f64::max))
        .collect();
    let worth = |f: &Frame| -> f64 {
        (0..columns)
            .filter(|&k| Some(k) != f.time && most[k] > 0.0)
            .map(|k| width(f, k) / most[k])
            .sum()
    };
    frames.iter().max_by(|a, b| worth(a).total_cmp(&worth(b)))
}

/// Largest less smallest value among the `k` samples to both sides of each.
fn travel(q: &[f64], k: usize) -> Vec<f64> {
    // samples that can still be the largest of a window, the largest first, and likewise the smallest
    let mut ends = [VecDeque::new(), VecDeque::new()];
    let beyond: [fn(f64, f64) -> bool; 2] = [|a, b| a >= b, |a, b| a <= b];
    let mut next = 0;
    let mut out = Vec::with_capacity(q.len());
    for i in 0..q.len() {
        while next < (i + k + 1).min(q.len()) {
            for (end, beyond) in ends.iter_mut().zip(beyond) {
                while end.back().is_some_and(|&j: &usize| beyond(q[next], q[j])) {
                    end.pop_back();
                }
                if !q[next].is_nan() {
                    end.push_back(next);
                }
            }
            next += 1;
        }
        for end in &mut ends {
            while end.front().is_some_and(|&j| j + k < i) {
                end.pop_front();
            }
        }
        let [high, low] = [0, 1].map(|e: usize| ends[e].front().map(|&j| q[j]));
        out.push(high.zip(low).map_or(f64::NEG_INFINITY, |(a, b)| a - b));
    }
    out
}

/// Samples of a moment, in which a joint that moves shows that it does.
fn moment(q: &[f64], step: f64) -> usize {
    ((0.1 / step) as usize).clamp(2, (q.len() / 4).max(2))
}

fn largest(travel: &[f64]) -> f64 {
    travel.iter().copied().fold(0.0, f64::max)
}

/// Whether a joint moves, sample by sample: by more than a hundredth of its usual speed, and by more than the steps of
/// its encoder. `stride` is how far it goes in a moment elsewhere.
fn still_aware(q: &[f64], step: f64, stride: f64) -> Vec<bool> {
    let travel = travel(q, moment(q, step));
    let largest = largest(&travel).max(stride);
    let noise = median(
        q.windows(2)
            .map(|w| (w[1] - w[0]).abs())
            .filter(|d| *d > 0.0),
    );
    let least = (0.01 * largest).max(if noise.is_finite() { 4.0 * noise } else { 0.0 });
    // the noise of a moving joint is its motion: never more than a fifth of the largest
    let least = least.min(0.2 * largest).max(1e-6);
    travel.iter().map(|x| *x > least).collect()
}

/// A joint that stands for less has not stopped, s.
pub(super) const PAUSE: f64 = 0.3;

/// Runs of `true` as times; those shorter than a tenth of a second are left out.
fn intervals(moving: &[bool], step: f64) -> Vec<[f64; 2]> {
    let mut out: Vec<[f64; 2]> = Vec::new();
    let mut from = None;
    for (i, m) in moving.iter().chain([&false]).enumerate() {
        match (m, from) {
            (true, None) => from = Some(i),
            (false, Some(f)) => {
                let [a, b] = [f as f64 * step, (i - 1) as f64 * step];
                match out.last_mut() {
                    Some(last) if a - last[1] < PAUSE => last[1] = b,
                    _ if b - a >= 0.1 => out.push([a, b]),
                    _ => {}
                }
                from = None;
            }
            _ => {}
        }
    }
    out
}

/// Whether a column never goes back, and on from nearly each row to the next.
fn counts_up(y: &[f64]) -> bool {
    let on = y.windows(2).filter(|w| w[1] > w[0]).count();
    y.windows(2).all(|w| w[1] >= w[0]) && on as f64 > 0.97 * y.len() as f64
}

/// The column that is a time by its numbers: it increases by even steps. One with a name, which is none of a time, that counts
/// by one says how many rows there are and not when they were taken.
fn even(table: &Table) -> Option<usize> {
    let header = table.names.iter().any(|n| n.parse::<f64>().is_err());
    let counts = |name: &str, y: &[f64]| {
        let by_one = y.windows(2).filter(|w| w[1] - w[0] == 1.0).count();
        header && by_one as f64 > 0.9 * y.len() as f64 && !names::in_unit_of_time(name)
    };
    let mut best: Option<(usize, f64)> = None;
    for (k, y) in table.columns.iter().enumerate() {
        let n = y.len();
        if n < 8 || counts(&table.names[k], y) {
            continue;
        }
        let steps: Vec<f64> = y.windows(2).map(|w| w[1] - w[0]).collect();
        let up = steps.iter().filter(|d| **d > 0.0).count();
        if (up as f64) < 0.97 * steps.len() as f64 {
            continue;
        }
        let usual = median(steps.iter().copied());
        let spread = median(steps.iter().map(|d| (d - usual).abs())) / usual;
        if spread < 0.3 && best.is_none_or(|(_, s)| spread < s) {
            best = Some((k, spread));
        }
    }
    best.map(|(k, _)| k)
}

#[cfg(test)]
mod tests {
    use super::travel;

    #[test]
    fn travel_is_that_of_every_window() {
        let mut q: Vec<f64> = (0..200).map(|i| ((i * i) as f64 * 0.37).sin()).collect();
        q[50..60].fill(0.25);
        q[90] = f64::NAN;
        for k in [1, 2, 7, 60, 300] {
            let found = travel(&q, k);
            for i in 0..q.len() {
                let part = &q[i.saturating_sub(k)..(i + k + 1).min(q.len())];
                let high = part.iter().fold(f64::NEG_INFINITY, |m, x| m.max(*x));
                let low = part.iter().fold(f64::INFINITY, |m, x| m.min(*x));
                assert_eq!(found[i], high - low, "{i} of windows of {k}");
            }
        }
        assert_eq!(travel(&[f64::NAN; 3], 1), [f64::NEG_INFINITY; 3]);
    }
}
