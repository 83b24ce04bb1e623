//! Noise of the torque of every actuator, from the records: first from the scatter between periods, then
//! limited by what a residual shows.

// several arrays share the index of an actuator or a sample
#![allow(clippy::needless_range_loop)]

use super::data::Data;
use super::noise::{LINES, Noise, Source, between_periods, spectrum};
use super::thresholds::THRESHOLDS as T;
use crate::signals::series::Series;

impl Data<'_> {
    pub(super) fn first_noise(&self, j: usize) -> Noise {
        // holdout records may hold what the fitted ones do not: only where those do not repeat
        let repeats = self.records.iter().any(|r| r.fit && r.cycle.is_some());
        let used = || self.records.iter().filter(|r| r.fit || !repeats);
        let parts: Vec<(Vec<f64>, usize)> = used()
            .filter_map(|r| Some((between_periods(r, r.torque(j))?, r.sound())))
            .collect();
        let dt = used().find(|r| r.cycle.is_some()).map(|r| r.dt);
        if let Some(dt) = dt {
            let mut noise = Noise::from_periods(&parts, dt);
            noise.limit(self.plant.actuators()[j].torque_noise);
            let excess = self.position_excess(j);
            noise.with_excess(&excess);
            return noise;
        }
        // without repetition: the torque above the band of the motion
        let longest = self.records.iter().max_by_key(|r| r.count);
        // `prepare` refuses an experiment without a record to fit to
        let r = longest.expect("there are records");
        Noise::from_residual(r.torque(j), r.dt, T.noise.above * r.band)
    }

    /// Spectrum of the torque that unresolved acceleration makes.
    fn position_excess(&self, j: usize) -> Vec<f64> {
        let mut out = vec![0.0; LINES + 1];
        let repeats = self.records.iter().any(|r| r.fit && r.cycle.is_some());
        let counts = |r: &&Series| r.cycle.is_some() && (r.fit || !repeats);
        let records: Vec<&Series> = self.records.iter().filter(counts).collect();
        for r in &records {
            let variance = (self.inertia[j] * r.position_noise[j]).powi(2) / records.len() as f64;
            for (l, out) in out.iter_mut().enumerate() {
                let f = l as f64 / (2.0 * r.dt * LINES as f64);
                *out += variance * (2.0 * std::f64::consts::PI * f.min(T.noise.resolved)).powi(4);
            }
        }
        out
    }

    /// The same limited by what a residual shows.
    pub fn limit_excess(&mut self, residual: &[Vec<f64>]) {
        for j in 0..self.joints() {
            if self.noise[j].source != Source::Periods {
                let r = &self.records[0];
                let (dt, band) = (r.dt, T.noise.above * r.band);
                let mut e = residual[j][..self.fitted].to_vec();
                let fits = self.records.iter().filter(|r| r.fit);
                let sound: usize = fits.map(Series::sound).sum();
                if sound < self.fitted {
                    // the power of what was measured
                    let scale = (self.fitted as f64 / sound.max(1) as f64).sqrt();
                    e.iter_mut().for_each(|v| *v *= scale);
                }
                self.noise[j] = Noise::from_residual(&e, dt, band);
                continue;
            }
            let mut seen = vec![0.0; LINES + 1];
            let mut weight = 0.0;
            for k in 0..self.records.len() {
                if !self.records[k].fit {
                    continue;
                }
                let piece = &residual[j][self.span(k)];
                for (s, v) in seen.iter_mut().zip(spectrum(piece)) {
                    *s += v * piece.len() as f64;
                }
                weight += self.records[k].sound() as f64;
            }
            let possible = self.position_excess(j);
            let excess: Vec<f64> = (0..=LINES)
                .map(|l| {
                    // median of neighbours: a line of its own is a gap, not noise
                    let (lo, hi) = (
                        l.saturating_sub(T.noise.excess),
                        (l + T.noise.excess).min(LINES),
                    );
                    let mut near: Vec<f64> = seen[lo..=hi].iter().map(|v| v / weight).collect();
                    near.sort_by(f64::total_cmp);
                    let seen = near[near.len() / 2] - self.noise[j].torque[l];
                    possible[l].min(seen.max(0.0))
                })
                .collect();
            self.noise[j].with_excess(&excess);
        }
    }
}
