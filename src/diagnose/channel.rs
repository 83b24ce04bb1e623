//! What stands between a torque and its place in the log: the window of the torque channel, the time at which a
//! simulator's friction reverses, and the filter that positions of coarse encoders have passed.
//!
//! A coarse encoder (12 bits, say) does not resolve a motion up to the cut-off of the derivatives. Its positions pass a
//! Wiener filter `H` ([`crate::signals::wiener::Filter`]), so `M H q̈` lacks what the torque and the sign of the velocity
//! still have. Torque and model alike pass the same `H`, as in the parallel filtering of an identification (Khalil &
//! Dombre 2002, ch. 12).
//!
//! A simulator regularises dry friction by a velocity and an acceleration, so that friction opposes `q̇ + T q̈` and
//! reverses before the velocity does; MuJoCo's `solref` gives `T` of about 10 ms. With `S(T)` the torque of dry friction at
//! a lead `T`, `c` the second and `s` the first difference of the modelled torque,
//!
//! ```text
//! τ − W φ = w_j c/2 + d s + κ_j (S(T + h) − S(T))        T ← T + h median κ_j
//! ```
//!
//! Window and lead are those of all joints. So each joint gives its own `w_j` and `κ_j`, and the median stands, in which each
//! counts by its variance: an effect of one joint that no column here has does not move it.
//!
//! That friction is no sharp sign of it either: a constraint of softness `(1 − d)/d` gives
//! `F_c clamp((q̇ + T q̈)/w)` with `w = T F_c (M⁻¹)_jj (1 − d)/d`, which is some hundredths of the speed of a light wrist.

use super::column::Column;
use super::data::Data;
use super::evidence::{Evidence, Projected};
use super::thresholds::THRESHOLDS as T;
use super::verdict::inflation;
use crate::error::Result;
use crate::median::median;
use std::borrow::Cow;

/// What is not looked for in a log, but assumed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Assumed {
    /// time by which dry friction reverses early, s
    pub lead: Option<f64>,
    /// variance of the window of the torque beyond plus and minus one sample, samples squared
    pub window: Option<f64>,
}

/// What the records say of it.
struct Channel {
    /// variance of the window beyond plus and minus one sample, samples squared
    window: f64,
    /// time by which dry friction reverses before the velocity does, s
    lead: f64,
    /// where they would have it, sure or not, s
    next: f64,
    /// its deviation where what the model leaves counts as noise, s; infinite where it was not looked for
    deviation: f64,
    /// parameters of the refitted nominal model
    phi: Vec<f64>,
}

impl Channel {
    /// From records with the window and the lead found so far; with `leads` another lead is looked for.
    fn of(data: &Data, leads: bool) -> Channel {
        let e = Evidence::new(data, 1.0);
        let phi = e.parameters(&[], &e.fit(&[]));
        let model = data.model_torque(&phi);
        let curved = e.project(&by_joint(data.curvature(&model)));
        let coarse = (0..data.joints()).any(|j| data.coarse(j));
        // positions that noise is on bend where the torque does not: no window can be seen then
        let found = match coarse {
            true => 0.0,
            false => agreed(&e, &[], &curved).value,
        };
        let (mut lead, mut next, mut deviation) = (data.lead, data.lead, f64::INFINITY);
        if leads {
            let step = T.reversals.step;
            let slope = e.project(&[data.slope(&model)]);
            let earlier = e.project(&by_joint(data.earlier(&phi, step)));
            let found = agreed(&e, &[&curved, &slope], &earlier);
            next = (lead + step * found.value).clamp(0.0, T.reversals.longest);
            deviation = step * found.deviation;
            // joints that disagree have widened what they agree on already
            let times = match earlier.z.len() {
                1 => T.reversals.sure,
                _ => T.reversals.agreed,
            };
            let sure = times * step * found.sure;
            if next > T.reversals.shortest.max(sure) {
                lead = next;
            }
        }
        Channel {
            window: window(data.window + found),
            lead,
            next,
            deviation,
            phi,
        }
    }
}

/// Joints from which on one that is off does not decide what they have in common.
const JOINTS: usize = 3;

/// A column of each joint that has one; of fewer than three joints one of all.
fn by_joint(column: Column) -> Vec<Column> {
    let moving = |x: &[f64]| x.iter().any(|v| *v != 0.0);
    let rows = column.rows.into_iter().filter(|(_, x)| moving(x));
    let rows: Vec<(usize, Vec<f64>)> = rows.collect();
    match rows.len() < JOINTS {
        true => vec![Column { rows }],
        false => rows.into_iter().map(|(j, x)| Column::on(j, x)).collect(),
    }
}

/// What columns [`by_joint`] have in common.
struct Agreed {
    /// their coefficient: the median of theirs, each counting by its variance, so that an effect of one
    /// joint does not move it
    value: f64,
    /// its deviation by the noise where one column stands for all joints; else as `deviation`
    sure: f64,
    /// its deviation where what the model leaves counts as noise; where the joints disagree as much larger
    deviation: f64,
}

/// What columns [`by_joint`] have in common, fitted `beside` others.
fn agreed(e: &Evidence, beside: &[&Projected], own: &Projected) -> Agreed {
    let set = [beside, &[own]].concat();
    let fit = e.fit(&set);
    let residual = e.residual(&set, &fit);
    let first: usize = beside.iter().map(|a| a.z.len()).sum();
    let bare = |k: usize| fit.covariance[k][k].max(0.0).sqrt();
    if let [_] = own.z[..] {
        let sure = bare(first);
        return Agreed {
            value: fit.eta[first],
            sure,
            deviation: sure * inflation(&residual, e.data.fitted),
        };
    }
    let said = own.z.iter().zip(first..).filter_map(|(column, k)| {
        let (joint, _) = column.rows.first()?;
        let left = std::slice::from_ref(&residual[*joint]);
        let sure = bare(k) * inflation(left, e.data.fitted);
        (fit.eta[k].is_finite() && sure.is_finite() && sure > 0.0).then_some([fit.eta[k], sure])
    });
    let [value, deviation] = common(said.collect());
    Agreed {
        value,
        sure: deviation,
        deviation,
    }
}

/// The median of estimates with their deviations, each counting by its variance, and its deviation.
fn common(mut said: Vec<[f64; 2]>) -> [f64; 2] {
    let weight = |[_, s]: &[f64; 2]| 1.0 / (s * s);
    let all: f64 = said.iter().map(weight).sum();
    said.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut below = 0.0;
    let half = said.iter().find(|x| {
        below += weight(x);
        below >= 0.5 * all
    });
    let Some([value, _]) = half else {
        return [0.0, f64::INFINITY];
    };
    let apart = median(said.iter().map(|[x, s]| (x - value).abs() / s));
    // that median is 0.6745 of a deviation of the normal distribution
    [*value, (apart / 0.6745).max(1.0) / all.sqrt()]
}

/// The variance of the window beyond plus and minus one sample, from an estimate: that of an instant where the
/// estimate is nearer to it.
fn window(found: f64) -> f64 {
    match found < -0.5 * T.window.instant {
        true => -T.window.instant,
        false => found.clamp(0.0, T.window.widest),
    }
}

impl Data<'_> {
    /// With what the log makes of a torque, as far as it is not assumed, and then with what the encoders cannot resolve.
    ///
    /// # Errors
    /// As [`Data::reverse_early`].
    pub fn completed(mut self, assumed: Assumed) -> Result<Self> {
        let phi = self.values();
        self.reverse_early(assumed.lead.unwrap_or(0.0), &phi)?;
        let leads = assumed.lead.is_none() && self.find_lead()?;
        for pass in 0..2 {
            let channel = Channel::of(&self, leads);
            self.window = assumed.window.unwrap_or(channel.window);
            self.reverse_early(channel.lead, &channel.phi)?;
            if pass == 0 {
                let residual = self.gap_to(&self.model_torque(&channel.phi));
                self.limit_excess(&residual);
            }
            self.start_from_load(&channel.phi);
        }
        Ok(self)
    }

    /// Takes dry friction to reverse as early as the records show; whether another lead may still be found. Less
    /// than `reversals.early`, which a machine may have, counts only where the log looks like a simulator's: coarse
    /// encoders, or no noise. Elsewhere it must also exceed eight deviations of what the model leaves, so that no large
    /// effect passes for it.
    ///
    /// # Errors
    /// As [`Data::reverse_early`].
    fn find_lead(&mut self) -> Result<bool> {
        if !self.may_lead() {
            return Ok(false);
        }
        let plain = (0..self.joints()).any(|j| self.coarse(j) || self.noise[j].assumed);
        if plain {
            self.start_lead()?;
        }
        let mut least = T.reversals.early;
        for _ in 0..T.reversals.rounds {
            let Channel {
                lead,
                next,
                deviation,
                phi,
                ..
            } = Channel::of(self, true);
            least = T.reversals.early.max(T.reversals.sure * deviation);
            self.perhaps_early = next > T.reversals.shortest.max(T.reversals.perhaps * deviation);
            let done = (lead - self.lead).abs() < T.reversals.settled;
            self.reverse_early(lead, &phi)?;
            if done {
                break;
            }
        }
        // the longest that is looked for is no time that was found
        if !plain && !(least..T.reversals.longest).contains(&self.lead) {
            let phi = self.values();
            self.reverse_early(0.0, &phi)?;
        }
        Ok(plain || self.lead > 0.0)
    }

    /// Starts from the time of a simulator's usual settings where the refitted model leaves less with it. Every joint
    /// counts by the logarithm of what is left there, as with a noise of its own that is not known, so that an effect of one does not decide.
    ///
    /// # Errors
    /// As [`Data::reverse_early`].
    fn start_lead(&mut self) -> Result<()> {
        let nominal = self.values();
        let mut left = [0.0; 2];
        let both = [0.0, T.reversals.usual];
        for (lead, left) in both.into_iter().zip(&mut left) {
            self.reverse_early(lead, &nominal)?;
            let e = Evidence::new(self, 1.0);
            let residual = e.residual(&[], &e.fit(&[]));
            *left = e.log_power(&residual);
        }
        let better = usize::from(left[1] < left[0]);
        self.reverse_early(both[better], &nominal)
    }

    /// By how much torque may be ahead of the positions where nothing but dry friction reverses early, s: not all joints have the
    /// same time, and where none was taken for found there may yet be that of a simulator's usual settings.
    pub fn early_friction_within(&self) -> f64 {
        match (self.lead > 0.0, self.perhaps_early) {
            (true, _) => T.reversals.of_one * self.lead,
            (false, true) => T.reversals.usual,
            (false, false) => 0.0,
        }
    }

    /// A modelled signal of all records as the torque channel would show it, whitened.
    pub fn modelled(&self, j: usize, x: &[f64]) -> Vec<f64> {
        if self.window == 0.0 && !self.filtered(j) {
            return self.whiten(j, x);
        }
        self.whiten(j, &self.shown(j, x))
    }

    /// Measured torque of actuator `j`, which has passed what the positions of a coarse encoder passed: else it would hold
    /// what no model from those positions can show.
    pub fn torque(&self, j: usize) -> Cow<'_, [f64]> {
        match self.filtered(j) {
            true => Cow::Owned(self.passed(j, self.tau[j].clone())),
            false => Cow::Borrowed(&self.tau[j]),
        }
    }

    /// A modelled signal of all records as [`Data::torque`] would show it.
    pub fn shown(&self, j: usize, x: &[f64]) -> Vec<f64> {
        self.passed(j, self.windowed(x))
    }

    /// Whether the positions of actuator `j` have passed a filter in any record: those of a coarse encoder in a motion that does not repeat.
    pub(super) fn filtered(&self, j: usize) -> bool {
        self.records.iter().any(|r| r.filter(j).is_some())
    }

    /// What the filters of the positions leave of a signal.
    fn passed(&self, j: usize, mut x: Vec<f64>) -> Vec<f64> {
        for (k, r) in self.records.iter().enumerate() {
            if let Some(filter) = r.filter(j) {
                let span = self.span(k);
                let piece = filter.pass(&x[span.clone()]);
                x[span].copy_from_slice(&piece);
            }
        }
        x
    }

    /// A modelled signal of all records as the torque channel would show it: passes of the kernel
    /// `[c/2, 1 − c, c/2]` until their variances sum to the window's.
    pub fn windowed(&self, x: &[f64]) -> Vec<f64> {
        let passes = (self.window.abs() / T.window.pass).ceil() as usize;
        let mut x = x.to_vec();
        if passes == 0 {
            return x;
        }
        let half = 0.5 * self.window / passes as f64;
        let mean = |[before, here, after]: [f64; 3]| here + half * (before - 2.0 * here + after);
        let mut to = x.clone();
        for _ in 0..passes {
            for k in 0..self.records.len() {
                let (x, to) = (&x[self.span(k)], &mut to[self.span(k)]);
                let last = x.len() - 1;
                to[0] = mean([x[0], x[0], x[1.min(last)]]);
                let inner = to.iter_mut().skip(1).zip(x.windows(3));
                inner.for_each(|(to, w)| *to = mean([w[0], w[1], w[2]]));
                if last > 0 {
                    to[last] = mean([x[last - 1], x[last], x[last]]);
                }
            }
            std::mem::swap(&mut x, &mut to);
        }
        x
    }

    /// Second differences of a modelled torque: what a wider window would change.
    pub fn curvature(&self, model: &[Vec<f64>]) -> Column {
        self.differences(model, |[before, here, after]| {
            0.5 * (before - 2.0 * here + after)
        })
    }

    /// First differences of a modelled torque: what a stamp that is late by a sample would change.
    pub fn slope(&self, model: &[Vec<f64>]) -> Column {
        self.differences(model, |[before, _, after]| 0.5 * (after - before))
    }

    /// A difference of a modelled torque from three samples each; 0 at the ends of records.
    fn differences(&self, model: &[Vec<f64>], of: impl Fn([f64; 3]) -> f64) -> Column {
        let rows = model.iter().enumerate().map(|(j, model)| {
            let mut out = vec![0.0; self.rows()];
            for k in 0..self.records.len() {
                let span = self.span(k);
                for i in span.start + 1..span.end - 1 {
                    out[i] = of([model[i - 1], model[i], model[i + 1]]);
                }
            }
            (j, out)
        });
        Column {
            rows: rows.collect(),
        }
    }

    /// Residuals of all records where rows of a coarse encoder count as much as they tell: near reversals it does not say
    /// when a joint turned, and its filter spreads that.
    pub fn told(&self, mut residual: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let rows = residual.iter_mut().enumerate();
        rows.for_each(|(j, row)| self.tell(j, row));
        residual
    }

    /// The same of one actuator.
    pub fn tell(&self, j: usize, row: &mut [f64]) {
        if self.filtered(j) {
            let rows = row.iter_mut().zip(&self.weights[j]);
            rows.for_each(|(v, w)| *v *= w);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One that is far off moves neither the common value nor says that it is sure; where most disagree none is.
    #[test]
    fn what_most_say_stands() {
        let most = [[1.0, 0.1], [1.1, 0.1], [0.9, 0.1], [1.0, 0.2]];
        let [value, sure] = common(most.to_vec());
        assert!((value - 1.0).abs() < 1e-12 && sure < 0.1, "{value} {sure}");
        let one_off = [&most[..], &[[9.0, 0.1]]].concat();
        let [value, sure] = common(one_off);
        assert!((value - 1.0).abs() < 0.11 && sure < 0.15, "{value} {sure}");
        let none_alike = [[0.0, 0.1], [5.0, 0.1], [-4.0, 0.1], [9.0, 0.1]];
        assert!(common(none_alike.to_vec())[1] > 1.0);
        assert_eq!(common(vec![[1.0, 0.25]]), [1.0, 0.25]);
        assert_eq!(common(Vec::new()), [0.0, f64::INFINITY]);
    }
}
