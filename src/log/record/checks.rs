//! What is wrong with the channels of a log: dropped, stuck and saturated values, units, periods.

use super::numbered;
use crate::error::{Error, Result, Warning, WarningKind, agreeing, counted};
use crate::extremes::{all_finite, extremes};
use crate::log::Record;
use crate::log::channels::{self, Moving};
use crate::log::clock::Clock;
use crate::log::resample::fill;
use crate::log::turns;
use crate::robot::{Joint, Motion};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::ops::Range;

/// Shortest period of a motion, in samples.
const SHORTEST: f64 = 4.0;

/// Longest period of a motion, in lengths of the record.
const LONGEST: f64 = 1e3;

/// Most that a channel moved in time misses at its ends, s.
const ENDS: f64 = 0.2;

impl Record {
    /// Makes the angles of joints continuous that wrap at a whole turn, and takes those beyond the limits by whole turns in
    /// the turn of the limits; `ends` hold the smallest and largest value of each channel.
    pub(super) fn count_turns(&mut self, joints: &[&Joint], clock: &Clock, ends: &mut [[f64; 2]]) {
        let path = self.path.display().to_string();
        let mut warnings = Vec::new();
        // commands and second encoders go where the encoder is
        let mut middle = vec![0.0; joints.len()];
        for ((name, _, y), ends) in self.channels().into_iter().zip(ends) {
            let angle = numbered(&name).filter(|(group, _)| ["q", "qref", "ql"].contains(group));
            let Some((group, j)) = angle.map(|(group, k)| (group, k - 1)) else {
                continue;
            };
            if joints[j].motion != Motion::Revolute {
                continue;
            }
            let mut said = None;
            if turns::may_wrap(*ends, TAU)
                && let Some((count, first)) = turns::unwrap(y, TAU)
            {
                *ends = extremes(y);
                let row = clock.before + clock.keep.as_ref().map_or(first, |k| k[first]) + 1;
                said = Some(format!(
                    "it jumps by a whole turn {}, first in row {row}: it was made continuous",
                    counted(count, "time")
                ));
            }
            let centre = 0.5 * (ends[0] + ends[1]);
            let by = match group {
                "q" => turns::to_add(joints[j], *ends),
                _ => ((middle[j] - centre) / TAU).round(),
            };
            if by != 0.0 {
                y.iter_mut().for_each(|x| *x += by * TAU);
                *ends = ends.map(|x| x + by * TAU);
                let here = format!(
                    "it was taken {} {}",
                    counted(by.abs() as usize, "turn"),
                    if by < 0.0 { "less" } else { "more" }
                );
                said = Some(match (said, group) {
                    (Some(said), _) => said,
                    (None, "q") => format!(
                        "it goes from {:.3} to {:.3}, beyond the limits of {} and within them in another turn: {here}",
                        ends[0] - by * TAU,
                        ends[1] - by * TAU,
                        joints[j].name
                    ),
                    (None, _) => format!("it is more than half a turn from the positions: {here}"),
                });
            }
            if group == "q" {
                middle[j] = 0.5 * (ends[0] + ends[1]);
            }
            let said =
                said.map(|s| Warning::new(WarningKind::TurnsCounted, format!("{path}: {name}"), s));
            warnings.extend(said);
        }
        self.warnings.extend(warnings);
    }

    /// Interpolates dropped values, marks them, and names their channels; `extent` holds the smallest and largest value of each.
    pub(super) fn fill_dropped(&mut self, clock: &Clock, extent: &mut [[f64; 2]]) -> Result<()> {
        let path = self.path.clone();
        let mut valid = std::mem::take(&mut self.valid);
        let (mut warnings, mut ends, mut missing) = (Vec::new(), Vec::new(), 0);
        let channels = self.channels();
        let holes = |y: &[f64]| match all_finite(y) {
            true => Vec::new(),
            false => (0..y.len()).filter(|&i| !y[i].is_finite()).collect(),
        };
        let all: Vec<Vec<usize>> = channels.par_iter().map(|(.., c)| holes(c)).collect();
        for (((name, order, column), holes), extent) in channels.into_iter().zip(all).zip(extent) {
            let Some(&first) = holes.first() else {
                continue;
            };
            if holes.len() == column.len() {
                let message = "it holds no number at all: the channel was not recorded";
                return Err(Error::file(&path, format!("column {name}"), message));
            }
            fill(&clock.t, column, order);
            *extent = extremes(column);
            for &i in &holes {
                valid[i] = false;
            }
            let n = column.len();
            let head = holes
                .iter()
                .enumerate()
                .take_while(|(k, i)| *k == **i)
                .count();
            let tail = holes.iter().rev().enumerate();
            let tail = tail.take_while(|(k, i)| **i + 1 + *k == n).count();
            let at_ends = head + tail == holes.len() && holes.len() as f64 * clock.step < ENDS;
            if at_ends {
                ends.push(name);
                missing = missing.max(holes.len());
                continue;
            }
            warnings.push(Warning::new(
                WarningKind::SamplesLeftOut,
                format!("{}: {name}", path.display()),
                format!(
                    "of {n} values {} dropped, the first at {:.4} s; interpolated for the filters and left out of \
                     the fit",
                    agreeing(holes.len(), "was", "were"),
                    clock.t[first]
                ),
            ));
        }
        if !ends.is_empty() {
            warnings.push(Warning::new(
                WarningKind::SamplesLeftOut,
                format!("{}: {}", path.display(), ends.join(", ")),
                format!(
                    "no more than {} at the ends of the record missing, as a stated `delay` leaves them; left out of the fit",
                    counted(missing, "value")
                ),
            ));
        }
        self.valid = valid;
        self.warnings.extend(warnings);
        Ok(())
    }

    /// Looks for saturated and stuck channels, joints that do not move, and other units; with the smallest and largest value of
    /// each channel.
    pub(super) fn check_channels(&mut self, joints: &[&Joint], ends: &[[f64; 2]]) -> Result<()> {
        let ends = ends.split_at(self.q.len().min(ends.len()));
        let subject = self.path.display().to_string();
        let step = self.step;
        let with_ends = self.q.iter().zip(ends.0);
        let moving = with_ends.map(|(q, ends)| Moving::new(q, *ends, step));
        let moving: Vec<Moving> = moving.collect();
        let still: Vec<usize> = (0..joints.len()).filter(|&j| !moving[j].ever()).collect();
        if still.len() == joints.len() {
            return Err(Error::file(
                &self.path,
                "",
                "nothing moves in it: no position changes",
            ));
        }
        for &j in &still {
            self.warnings.push(Warning::new(
                WarningKind::JointNotMoving,
                format!("{subject}: q{}", j + 1),
                format!(
                    "{} does not move; only what the others show of it can be identified",
                    joints[j].name
                ),
            ));
        }
        let check = |(j, joint): (usize, &&Joint)| self.check_actuator(j, joint, &moving, ends);
        let found: Vec<(Vec<Warning>, Vec<Range<usize>>)> =
            joints.par_iter().enumerate().map(check).collect();
        for (warnings, out) in found {
            self.warnings.extend(warnings);
            for range in out {
                self.valid[range].fill(false);
            }
        }
        let bad = self.valid.iter().filter(|v| !**v).count();
        if 2 * bad > self.valid.len() {
            self.warnings.push(Warning::new(
                WarningKind::FewSoundSamples,
                subject,
                format!(
                    "only {} of {} samples are sound in all channels",
                    self.valid.len() - bad,
                    self.valid.len()
                ),
            ));
        }
        Ok(())
    }

    /// What is wrong with the channels of actuator `j`, and which samples are left out for it; `moving` says when each moves, and `ends` hold
    /// the smallest and largest value of the positions and of the torques.
    fn check_actuator(
        &self,
        j: usize,
        joint: &Joint,
        moving: &[Moving],
        ends: (&[[f64; 2]], &[[f64; 2]]),
    ) -> (Vec<Warning>, Vec<Range<usize>>) {
        let subject = self.path.display();
        let (q, step) = (&self.q[j], self.step);
        let mut warnings: Vec<Warning> = channels::position_unit(joint, ends.0[j])
            .into_iter()
            .collect();
        let mut out = Vec::new();
        if let Some(tau) = self.tau.get(j) {
            let name = format!("{subject}: tau{}", j + 1);
            if let Some(clipped) = channels::saturated_within(tau, ends.1[j], joint.limits.effort) {
                let message = format!(
                    "it stands at {:.6} for {} samples as a saturated channel does; they were left out of the fit",
                    clipped.level, clipped.count
                );
                warnings.push(Warning::new(
                    WarningKind::SamplesLeftOut,
                    name.clone(),
                    message,
                ));
                out.extend(clipped.at);
            }
            let runs = channels::stuck(tau, step, moving);
            warnings.extend(stuck(name, &runs, step));
            out.extend(runs);
        }
        // an encoder that stands still is stuck if the command goes on
        if let Some(qref) = &self.qref {
            let runs = channels::stuck_encoder(q, &qref[j], step);
            warnings.extend(stuck(format!("{subject}: q{}", j + 1), &runs, step));
            out.extend(runs);
        }
        (warnings, out)
    }

    /// A stated period that samples cannot resolve, or that is far longer than the record of
    /// `duration` seconds, is none.
    pub(super) fn drop_wrong_period(&mut self, step: f64, duration: f64) {
        let Some(period) = self.period else { return };
        let found = if period < SHORTEST * step {
            format!("is shorter than {SHORTEST} samples ({step:.6} s each)")
        } else if period > LONGEST * duration {
            format!("is more than {LONGEST} times as long as the record ({duration:.3} s)")
        } else {
            return;
        };
        self.warnings.push(Warning::new(
            WarningKind::NotPeriodic,
            self.path.display().to_string(),
            format!(
                "the stated period of {period} s {found}: it is treated as not periodic; period is in seconds"
            ),
        ));
        self.period = None;
    }

    /// Whether the motion repeats with the period that was stated.
    pub(super) fn check_period(&mut self) {
        let Some((each, count)) = self.periods() else {
            return;
        };
        let subject = self.path.display().to_string();
        let period = self.period.unwrap_or_default();
        if count < 2 {
            self.warnings.push(Warning::new(
                WarningKind::NotPeriodic,
                subject,
                format!(
                    "it is {:.3} s long, less than two periods of {period} s: nothing to average",
                    self.step * self.len() as f64
                ),
            ));
            return;
        }
        // scatter against the mean period, relative to the motion, from the second period on
        let (mut scatter, mut motion) = (0.0, 0.0);
        for q in &self.q {
            let from = q.len() - each * (count - 1);
            for i in 0..each {
                let values = (0..count - 1).map(|p| q[from + p * each + i]);
                let mean = values.clone().sum::<f64>() / (count - 1) as f64;
                let first = q[from - each + i];
                scatter += values.map(|x| (x - mean) * (x - mean)).sum::<f64>()
                    + 0.25 * (first - mean).powi(2);
            }
            let mean = q.iter().sum::<f64>() / q.len() as f64;
            motion += q.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>();
        }
        if scatter > 0.02 * motion {
            self.warnings.push(Warning::new(WarningKind::NotPeriodic,
                subject,
                format!(
                    "the motion does not repeat after the stated period of {period} s (scatter {:.0} % of \
                     the motion); it is treated as not periodic",
                    100.0 * (scatter / motion).sqrt()
                ),
            ));
            self.period = None;
        }
    }
}

fn stuck(name: String, runs: &[Range<usize>], step: f64) -> Option<Warning> {
    let first = runs.first()?.start;
    let samples: usize = runs.iter().map(Range::len).sum();
    Some(Warning::new(
        WarningKind::SamplesLeftOut,
        name,
        format!(
            "it stands still {}, {} in all, while the robot moves (first at \
             {:.3} s): stuck or dropped; left out of the fit",
            agreeing(runs.len(), "time", "times"),
            counted(samples, "sample"),
            first as f64 * step
        ),
    ))
}
