//! Energies of the gap: what a set of effects takes from it, joint by joint.

use super::super::catalogue::{Context, Effect};
use super::super::evidence::{Evidence, Fit, Projected, Set};
use super::super::gap;
use super::super::search::{Candidate, Finder};
use super::super::thresholds::THRESHOLDS as T;
use std::ops::Range;

/// What the judgement of sets rests on.
pub struct State<'a> {
    /// whitened records with the nominal model
    pub evidence: &'a Evidence<'a>,
    /// what columns of effects are made from
    pub cx: &'a Context<'a>,
    /// the catalogue
    pub effects: &'a [Box<dyn Effect>],
    /// what a sound model leaves, per row
    pub floor: f64,
    /// gap of the refitted nominal model above that, fitted records
    pub total: f64,
    /// what the prior expects its own penalty to be
    pub freedoms: f64,
    /// factor on the gap per row that a sound model may leave, by actuator
    allowance: Vec<f64>,
}

impl<'a> State<'a> {
    /// Starts from the fit of no effect: the gap of the refitted nominal model.
    pub fn new(
        evidence: &'a Evidence<'a>,
        cx: &'a Context<'a>,
        effects: &'a [Box<dyn Effect>],
    ) -> Self {
        let data = evidence.data;
        let allowance = (0..data.joints()).map(|j| data.allowance(j));
        let mut st = State {
            evidence,
            cx,
            effects,
            floor: 0.0,
            total: 0.0,
            freedoms: evidence.freedoms(),
            allowance: allowance.collect(),
        };
        let rows = evidence.data.fitted as f64;
        let before = st.gap(&st.fit(&[]).1, true);
        // no more than a part of a gap that is small itself
        let largest = before.iter().fold(0.0f64, |m, v| m.max(*v)) / rows;
        st.floor = T.gap.floor.min(T.gap.floor_share * largest);
        st.total = st.above(&before, true);
        st
    }
}

impl State<'_> {
    /// Factor on what counts per row, for a member of a set of so many. A second name must stand out as on any robot:
    /// what a first one leaves of a large gap is not all of its shape.
    pub fn scale(&self, members: usize) -> f64 {
        match self.evidence.data.sticks() && members == 1 {
            true => T.matters.closed,
            false => 1.0,
        }
    }

    /// Looks for shapes beside a set.
    pub fn finder<'b>(&'b self, beside: &'b Set<'b>) -> Finder<'b> {
        Finder {
            cx: self.cx,
            effects: self.effects,
            beside,
        }
    }

    /// By how much `χ²` falls with a set.
    pub fn gain(&self, set: &[Candidate]) -> f64 {
        let set: Vec<&Projected> = set.iter().map(|c| &c.projected).collect();
        self.evidence.fit(&set).gain
    }

    /// Fit of a set, and its whitened residual.
    pub fn fit(&self, set: &[Candidate]) -> (Fit, Vec<Vec<f64>>) {
        let set: Vec<&Projected> = set.iter().map(|c| &c.projected).collect();
        let fit = self.evidence.fit(&set);
        let residual = self.evidence.residual(&set, &fit);
        (fit, residual)
    }

    /// Gap by actuator on fitted records, or on the others. Behind a coarse encoder most of what a sound model leaves is
    /// what the encoder makes unknown, and the gap in units of the torque's noise is a small difference of large numbers: it is counted on whitened rows.
    pub fn gap(&self, residual: &[Vec<f64>], fitted: bool) -> Vec<f64> {
        let data = self.evidence.data;
        let counted = self.evidence.as_counted(residual);
        let all = gap::energies(data, &counted, |r| r.fit == fitted);
        let records = || (0..data.records.len()).filter(|k| data.records[*k].fit == fitted);
        let of = |(j, [repeating, other]): (usize, [f64; 2])| match data.counts_whitened(j) {
            true => records()
                .map(|k| self.evidence.beyond(j, &counted[j], k))
                .sum(),
            false => repeating + other,
        };
        all.into_iter().enumerate().map(of).collect()
    }

    /// The largest gap of an actuator over what a sound model may leave beside the noise of its torque.
    pub fn largest(&self, gap: &[f64]) -> f64 {
        let joints = gap.iter().zip(&self.allowance);
        joints.map(|(v, allowed)| v / allowed).fold(0.0, f64::max)
    }

    /// Gap of all actuators above what a sound model leaves.
    pub fn above(&self, gap: &[f64], fitted: bool) -> f64 {
        let data = self.evidence.data;
        let rows = match fitted {
            true => data.fitted,
            false => data.rows() - data.fitted,
        };
        gap.iter()
            .map(|v| (v - self.floor * rows as f64).max(0.0))
            .sum()
    }

    /// Whether a gap on holdout records is one that shares can be taken of.
    pub fn shows_held(&self, gap: f64) -> bool {
        let data = self.evidence.data;
        data.predicts() && gap > T.entry.negligible * (data.rows() - data.fitted) as f64
    }

    /// Penalty of the prior with a set.
    pub fn surprise(&self, fit: &Fit, residual: &[Vec<f64>]) -> f64 {
        self.evidence.surprise(fit, residual)
    }

    /// Whether member `i` may show in nothing but the parameters that the nominal model would need.
    /// Not where another one shows on its joints, or hides there and is far larger: what that one's
    /// formula misses moves them, too.
    pub fn may_hide(&self, set: &[Candidate], i: usize) -> bool {
        let hides = |c: &Candidate| self.effects[c.effect].hides();
        let larger = |c: &Candidate| !hides(c) || c.gain > T.hidden.far * set[i].gain;
        let shown = |c: &Candidate| larger(c) && c.place.meets(&set[i].place);
        hides(&set[i]) && !set.iter().any(shown)
    }

    /// Share of the whole gap that goes between two gaps by actuator, fitted records.
    pub fn explains(&self, without: &[f64], with: &[f64]) -> f64 {
        (self.above(without, true) - self.above(with, true)) / self.total.max(1e-9)
    }

    /// How far the parameters tell of an effect, 0 to 1, whose gap is small: it explains a share of that, and takes `fall` from the
    /// penalty of the prior.
    pub fn told_by_parameters(&self, c: &Candidate, explains: f64, fall: f64) -> f64 {
        match self.effects[c.effect].moves_parameters(&c.shape) {
            true => T.hidden.whole.above(explains) * T.confidence.surprise.above(fall),
            false => 0.0,
        }
    }

    /// Joints on whose rows an effect acts most.
    pub fn joints_of(&self, c: &Candidate) -> Vec<usize> {
        c.place.actuators(self.evidence.data.joints())
    }

    /// Whether an effect depends on what went on before a record began.
    pub fn remembers(&self, c: &Candidate) -> bool {
        self.effects[c.effect].remembers()
    }

    /// Whether holdout records do not show an effect that depends on what was before a record, as that of a joint which is warm in
    /// them: from its gain per row on holdout records and on fitted ones.
    pub fn unseen(&self, c: &Candidate, [held, fitted]: [f64; 2]) -> bool {
        self.remembers(c) && held.abs() < T.entry.unseen * fitted
    }

    /// Whether an effect explains enough to be a finding, 0 to 1, from the gap by actuator without it
    /// and with it. An effect that explains almost nothing is not a finding, nor is one in a gap no larger
    /// than a sound model leaves, unless the `fall` of the prior's penalty [tells of it](Self::told_by_parameters). `members` are in the set.
    pub fn matters(
        &self,
        c: &Candidate,
        members: usize,
        [without, with]: [&[f64]; 2],
        fall: f64,
    ) -> f64 {
        let rows = self.evidence.data.fitted as f64;
        let joints = self.joints_of(c);
        let over = |gap: &[f64]| -> f64 {
            let floor = self.floor * rows;
            joints.iter().map(|j| (gap[*j] - floor).max(0.0)).sum()
        };
        let explains = self.explains(without, with);
        // a refit moves what lives in parameters to other joints
        let moved = over(without) == 0.0 && self.effects[c.effect].hides();
        let seen = match moved {
            true => explains,
            false => (over(without) - over(with)) / over(without).max(1e-9),
        };
        let there = self.largest(without) / rows;
        let own = joints.iter().fold(0.0f64, |m, j| m.max(without[*j])) / rows;
        let ringing = match self.effects[c.effect].rings(&c.shape) {
            true => T.matters.ringing.above(own),
            false => 1.0,
        };
        let enough = match self.effects[c.effect].explains_itself(&c.shape) {
            true => T.matters.itself.above(seen),
            false => T.matters.of_joints.above(seen),
        };
        let shown = enough
            * T.matters.of_all.above(explains)
            * T.matters.gap.scaled(self.scale(members)).above(there)
            * ringing;
        shown.max(self.told_by_parameters(c, explains, fall))
    }
}

/// A set without member `i`.
pub fn others(set: &[Candidate], i: usize) -> Vec<Candidate> {
    set.iter()
        .enumerate()
        .filter(|(k, _)| *k != i)
        .map(|(_, c)| c.clone())
        .collect()
}

/// Squares of a residual on some rows of every actuator.
pub fn energy(residual: &[Vec<f64>], rows: Range<usize>) -> f64 {
    let of = |e: &Vec<f64>| e[rows.clone()].iter().map(|v| v * v).sum::<f64>();
    residual.iter().map(of).sum()
}

/// By how much coefficients are less certain than independent samples of unit noise would make them.
pub fn inflation(residual: &[Vec<f64>], fitted: usize) -> f64 {
    let mut power = 0.0;
    let mut rho = 0.0;
    for e in residual {
        let e = &e[..fitted];
        power += e.iter().map(|v| v * v).sum::<f64>();
        for lag in 1..=T.gap.lags {
            let c: f64 = e[lag..].iter().zip(e).map(|(a, b)| a * b).sum();
            rho += 2.0 * c.max(0.0);
        }
    }
    let n = (residual.len() * fitted) as f64;
    (power / n).max(1.0).sqrt() * (1.0 + rho / power.max(1e-300)).max(1.0).sqrt()
}
