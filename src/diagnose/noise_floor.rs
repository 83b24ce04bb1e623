//! Noise of the torque of every actuator, from the records: first from the scatter between periods, then
//! limited by what a residual shows.

// several arrays share the index of an actuator or a sample
#![allow(clippy::needless_range_loop)]

use super::data::Data;
use super::noise::{LINES, Noise, Source, between_periods, spectrum};
use super::thresholds::THRESHOLDS as T;
use crate::signals::series::Series;
use std::borrow::Cow;

impl Data<'_> {
    pub(super) fn first_noise(&self, j: usize) -> Noise {
        let used = || self.telling();
        let parts: Vec<(Vec<f64>, usize)> = used()
            .filter_map(|r| {
                let heard = self.heard(r, j);
                let sound = heard.iter().filter(|h| **h).count();
                Some((between_periods(r, &heard, r.torque(j))?, sound))
            })
            .collect();
        let dt = used().find(|r| r.cycle.is_some()).map(|r| r.dt);
        let mut noise = match dt {
            Some(dt) => {
                let mut noise = Noise::from_periods(&parts, dt);
                noise.limit(self.plant.actuators()[j].torque_noise);
                noise
            }
            None => self.noise_above_the_band(j),
        };
        self.floored(&mut noise, j);
        noise.with_excess(&self.position_excess(j));
        noise
    }

    /// No less noise than a share of the torque: where there is next to none, behind a coarse encoder, and where no period repeats. A
    /// drive smooths its torque, and what is left above the band of the motion then says little of what lies in it.
    fn floored(&self, noise: &mut Noise, j: usize) {
        let always = self.filtered(j) || noise.source == Source::HighBand;
        noise.at_least(self.least_noise(j), always);
    }

    /// Without repetition: the torque above the band of the motion, where the actuator moves.
    fn noise_above_the_band(&self, j: usize) -> Noise {
        let longest = self.records.iter().max_by_key(|r| r.counts(j));
        // `prepare` refuses an experiment without a record to fit to
        let r = longest.expect("there are records");
        let x = match longest_run(&r.counted(j)) {
            run if run.len() >= 2 * LINES => &r.torque(j)[run],
            _ => r.torque(j),
        };
        Noise::from_residual(x, r.dt, T.noise.above * r.band)
    }

    /// Records that tell the noise. Those of the holdout may hold what the fitted ones do not: only where those do not
    /// repeat.
    fn telling(&self) -> impl Iterator<Item = &Series> {
        let repeats = self.records.iter().any(|r| r.fit && r.cycle.is_some());
        self.records.iter().filter(move |r| r.fit || !repeats)
    }

    /// Samples that tell the noise of an actuator: those that count, or, where it stands in all those records, all that
    /// were measured. A torque sensor is as noisy at rest.
    fn heard<'r>(&self, r: &'r Series, j: usize) -> Cow<'r, [bool]> {
        match self.telling().any(|r| r.counts(j) > 0) {
            true => r.counted(j),
            false => Cow::Borrowed(&r.measured),
        }
    }

    /// Least noise of an actuator: a share of the torques in the fitted records. A simulator's log has none at all, and
    /// what its steps leave would be a gap.
    fn least_noise(&self, j: usize) -> f64 {
        T.noise.of_torque * self.torque_rms(j)
    }

    /// Root mean square of the torques of an actuator in the fitted records.
    pub(super) fn torque_rms(&self, j: usize) -> f64 {
        let (mut power, mut count) = (0.0, 0.0f64);
        for r in self.records.iter().filter(|r| r.fit) {
            let heard = self.heard(r, j);
            let kept = r.torque(j).iter().zip(heard.iter()).filter(|(_, c)| **c);
            kept.for_each(|(v, _)| {
                power += v * v;
                count += 1.0;
            });
        }
        (power / count.max(1.0)).sqrt()
    }

    /// Power of a share of the torques of an actuator in the fitted records, in units of its noise variance.
    fn share_of_torque(&self, j: usize, share: f64) -> f64 {
        (share * self.torque_rms(j) / self.noise[j].std).powi(2)
    }

    /// Factor on the gap per row that a sound model may leave on an actuator, as it is counted: more than 1 where its
    /// encoder is coarse, for what repeats of its steps is no noise but no gap of the model either, and where friction reverses early, for a
    /// simulator's shape of it about reversals is known in part.
    pub(super) fn allowance(&self, j: usize) -> f64 {
        if self.turns_in_part(j) {
            let dry = self.plant.actuators()[j].terms[2];
            let shape = T.reversals.shape * dry / self.noise[j].std;
            return shape.powi(2).max(1.0);
        }
        if self.counts_whitened(j) || !self.coarse(j) {
            return 1.0;
        }
        let steps = 1.0 + T.noise.of_steps * self.noise[j].excess;
        let most = self.share_of_torque(j, T.noise.most_of_steps);
        steps
            .min(most)
            .max(self.share_of_torque(j, T.noise.of_coarse).max(1.0))
    }

    /// Whether dry friction of an actuator reverses early and its encoder shows how, which is known in part only.
    pub(super) fn turns_in_part(&self, j: usize) -> bool {
        self.lead > 0.0 && !self.coarse(j)
    }

    /// Spectrum of the torque that unresolved acceleration makes.
    fn position_excess(&self, j: usize) -> Vec<f64> {
        let mut out = vec![0.0; LINES + 1];
        let records: Vec<&Series> = (self.telling())
            .filter(|r| r.cycle.is_some() || r.filter(j).is_some())
            .collect();
        for r in &records {
            let variance = (self.inertia[j] * r.position_noise[j]).powi(2) / records.len() as f64;
            for (l, out) in out.iter_mut().enumerate() {
                let f = l as f64 / (2.0 * r.dt * LINES as f64);
                // the model from positions that passed a filter passes it once more
                let passed = r.filter(j).map(|filter| filter.gain(f * r.dt).powi(4));
                let left = passed.unwrap_or(1.0);
                let w = 2.0 * std::f64::consts::PI * f.min(T.noise.resolved);
                *out += left * variance * w.powi(4);
            }
        }
        out
    }

    /// The residual of an actuator in the fitted records: with zeros where nothing was measured, scaled to the
    /// power of what was; without the rows at its ends and between where the actuator stood.
    fn counted_residual(&self, j: usize, residual: &[f64]) -> Vec<f64> {
        let (mut e, mut count) = (Vec::new(), 0);
        for (k, r) in self.records.iter().enumerate().filter(|(_, r)| r.fit) {
            let piece = &residual[self.span(k)];
            match r.standing.is_empty() {
                true => e.extend_from_slice(piece),
                false => {
                    // the rows that count, joined: their seams are few
                    let counted = r.counted(j);
                    let kept = piece.iter().zip(counted.iter()).filter(|(_, c)| **c);
                    e.extend(kept.map(|(v, _)| *v));
                }
            }
            count += r.counts(j);
        }
        if count < e.len() {
            let scale = (e.len() as f64 / count.max(1) as f64).sqrt();
            e.iter_mut().for_each(|v| *v *= scale);
        }
        e
    }

    /// A residual of an actuator in record `k`, and how many of its rows count. At reversals the drives of a closed
    /// chain may stick: those rows have no weight, and their peaks are of all frequencies.
    fn away_from_reversals<'r>(
        &self,
        j: usize,
        k: usize,
        residual: &'r [f64],
    ) -> (Cow<'r, [f64]>, f64) {
        let span = self.span(k);
        let piece = &residual[span.clone()];
        if !self.sticks() {
            return (Cow::Borrowed(piece), self.records[k].counts(j) as f64);
        }
        let rows = piece.iter().zip(&self.weights[j][span]);
        let kept: Vec<f64> = rows.map(|(v, w)| if *w > 0.0 { *v } else { 0.0 }).collect();
        let count = kept.iter().filter(|v| **v != 0.0).count();
        (Cow::Owned(kept), count as f64)
    }

    /// The same limited by what a residual shows.
    pub fn limit_excess(&mut self, residual: &[Vec<f64>]) {
        for j in 0..self.joints() {
            if self.noise[j].source != Source::Periods {
                let r = &self.records[0];
                let (dt, band) = (r.dt, T.noise.above * r.band);
                // with what the filters of coarse encoders took: the noise of the channel is above them, too
                let passed = self.torque(j);
                let taken = self.tau[j].iter().zip(passed.iter());
                let rows = taken.zip(&residual[j]);
                let whole: Vec<f64> = rows.map(|((raw, left), e)| raw - left + e).collect();
                let e = self.counted_residual(j, &whole);
                if !e.is_empty() {
                    let mut noise = Noise::from_residual(&e, dt, band);
                    self.floored(&mut noise, j);
                    self.noise[j] = noise;
                }
            }
            let mut seen = vec![0.0; LINES + 1];
            let mut weight = 0.0;
            for k in 0..self.records.len() {
                if !self.records[k].fit {
                    continue;
                }
                let (piece, counts) = self.away_from_reversals(j, k, &residual[j]);
                for (s, v) in seen.iter_mut().zip(spectrum(&piece)) {
                    *s += v * piece.len() as f64;
                }
                weight += counts;
            }
            let possible = self.position_excess(j);
            let about = if self.filtered(j) { 1 } else { T.noise.excess };
            let excess: Vec<f64> = (0..=LINES)
                .map(|l| {
                    // median of neighbours: a line of its own is a gap, not noise
                    let (lo, hi) = (l.saturating_sub(about), (l + about).min(LINES));
                    let mut near: Vec<f64> =
                        seen[lo..=hi].iter().map(|v| v / weight.max(1.0)).collect();
                    near.sort_by(f64::total_cmp);
                    let seen = near[near.len() / 2] - self.noise[j].torque[l];
                    possible[l].min(seen.max(0.0))
                })
                .collect();
            self.noise[j].with_excess(&excess);
        }
    }
}

/// The longest run of samples that count.
fn longest_run(counted: &[bool]) -> std::ops::Range<usize> {
    let (mut best, mut from) = (0..0, 0);
    for (i, c) in counted.iter().enumerate() {
        match c {
            true if i + 1 - from > best.len() => best = from..i + 1,
            true => {}
            false => from = i + 1,
        }
    }
    best
}
