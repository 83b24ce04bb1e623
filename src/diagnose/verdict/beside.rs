//! A member beside the others: fits and residuals without it and with it.

use super::super::evidence::{Fit, Projected};
use super::super::gap;
use super::super::search::Candidate;
use super::super::thresholds::THRESHOLDS as T;
use super::state::{State, energy, inflation, others};
use std::ops::Range;

/// What the judgement of a member rests on.
pub struct Beside<'a> {
    /// what the judgement of sets rests on
    pub st: &'a State<'a>,
    /// the whole set
    pub set: &'a [Candidate],
    /// the member
    pub member: &'a Candidate,
    /// its coefficients among those of the whole set
    pub own: Range<usize>,
    /// the others
    pub rest: Vec<Candidate>,
    /// fit of the whole set
    pub with: Fit,
    /// residual without the member and with it
    pub residual: [Vec<Vec<f64>>; 2],
    /// by how much `χ²` falls through the member
    pub gain: f64,
    /// by how much the penalty of the prior falls
    pub fall: f64,
    /// penalty of the prior without the member
    pub surprise_without: f64,
    /// penalty of the prior with all
    pub surprise_after: f64,
    /// gap by actuator on fitted records without the member
    pub without: Vec<f64>,
    /// the same with all
    pub after: &'a [f64],
    /// joints on whose rows it acts
    pub joints: Vec<usize>,
    /// whether it explains enough to be a finding, 0 to 1
    pub matters: f64,
    /// whether it shows in the parameters of the nominal model rather than in the residual
    pub frozen: bool,
}

impl<'a> Beside<'a> {
    /// Member `i` of a set; `after` is the gap with the set.
    pub fn new(
        st: &'a State<'a>,
        set: &'a [Candidate],
        i: usize,
        after: &'a [f64],
        surprise_after: f64,
    ) -> Self {
        let member = &set[i];
        let rest = others(set, i);
        let first = set[..i].iter().map(|c| c.eta.len()).sum();
        let (f0, r0) = st.fit(&rest);
        let (with, r1) = st.fit(set);
        let without = st.gap(&r0, true);
        let surprise_without = st.surprise(&f0, &r0);
        let mut out = Beside {
            matters: st.matters(
                member,
                set.len(),
                [&without, after],
                surprise_without - surprise_after,
            ),
            gain: with.gain - f0.gain,
            fall: surprise_without - surprise_after,
            residual: [r0, r1],
            joints: st.joints_of(member),
            frozen: false,
            st,
            set,
            member,
            own: first..first + member.eta.len(),
            rest,
            with,
            surprise_without,
            surprise_after,
            without,
            after,
        };
        let rows = st.evidence.data.fitted as f64;
        // what an effect explains of the residual may be too little to judge it by, although its
        // parameters stand out
        let faint = out.in_rows() * out.matters < T.hidden.faint;
        let little = (T.hidden.of_gain * out.gain)
            .max(T.hidden.of_entry * st.scale(set.len()) * T.entry.gain * rows);
        // nor is a residual that hardly falls, where most of what is unlikely of the parameters goes
        let unlikely = (surprise_without - st.freedoms).max(1.0);
        let lives_there = out.explains() < T.hidden.of_residual
            && out.fall > T.confidence.parameters.centre * unlikely;
        out.frozen = st.may_hide(set, i)
            && out.fall > T.hidden.surprise
            && (faint || out.gain_in_rows() < little || lives_there);
        out
    }

    /// Its coefficients in the fit of the whole set, and their standard deviations where what that leaves counts as noise.
    pub fn coefficients(&self) -> [Vec<f64>; 2] {
        let scale = inflation(&self.residual[1], self.st.evidence.data.fitted);
        let std = |k: usize| self.with.covariance[k][k].max(0.0).sqrt() * scale;
        let all = self.own.clone();
        [self.with.eta[all.clone()].to_vec(), all.map(std).collect()]
    }

    /// Columns of the others.
    pub fn beside(&self) -> Vec<&Projected> {
        self.rest.iter().map(|c| &c.projected).collect()
    }

    fn fitted(&self) -> f64 {
        self.st.evidence.data.fitted as f64
    }

    fn held(&self) -> usize {
        let data = self.st.evidence.data;
        data.rows() - data.fitted
    }

    /// Part of the gain that comes from the residual.
    fn gain_in_rows(&self) -> f64 {
        self.gain - self.fall
    }

    fn in_rows(&self) -> f64 {
        T.confidence
            .gain
            .scaled(self.st.scale(self.set.len()))
            .above(self.gain_in_rows() / self.fitted())
    }

    /// Whether the gain is large enough, 0 to 1.
    pub fn size(&self) -> f64 {
        match self.frozen {
            true => T.confidence.surprise.above(self.fall),
            false => {
                let [explains, fall] = [self.explains(), self.fall];
                let told = self.st.told_by_parameters(self.member, explains, fall);
                self.in_rows().max(told)
            }
        }
    }

    /// Share of the gap on its joints that goes. The least that counts is taken off.
    fn share_of(&self, without: &[f64], with: &[f64], rows: f64) -> f64 {
        let sum = |v: &[f64]| self.joints.iter().map(|j| v[*j].max(0.0)).sum::<f64>();
        let (w, a) = (sum(without), sum(with));
        let slack = T.gap.slack * rows * self.joints.len() as f64;
        let there = (w - slack).max(w * T.gap.slack_share).max(1e-9);
        ((w - a) / there).min(1.0)
    }

    /// Share that it takes away of the gap on its joints or, where it is hidden, of the unlikeliness of the
    /// parameters.
    pub fn share(&self) -> f64 {
        match self.frozen {
            true => self.fall / (self.surprise_without - self.st.freedoms).max(1.0),
            false => self.share_of(&self.without, self.after, self.fitted()),
        }
    }

    /// The same on holdout records.
    pub fn share_held(&self) -> f64 {
        let held = self.held();
        if held == 0 || self.frozen {
            return self.share();
        }
        let [w, a] = self.residual.each_ref().map(|e| self.st.gap(e, false));
        self.share_of(&w, &a, held as f64)
    }

    /// Gain on holdout records per row against that on fitted ones: 1 where the same effect is at work there. Behind coarse encoders
    /// noise is not the same part of what filters leave of records that repeat and of others: a late torque counts over what stays of each.
    pub fn repeats(&self) -> f64 {
        let (data, held) = (self.st.evidence.data, self.held());
        if held == 0 || self.frozen {
            return 1.0;
        }
        let [w, a] = &self.residual;
        let kept = |e: &[Vec<f64>]| energy(e, data.fitted..data.rows());
        let rows = [0..data.fitted, data.fitted..data.rows()];
        let count = rows.clone().map(|rows| data.weighted(rows).max(1.0));
        let stays = |k: usize| {
            let own = self.joints.iter().map(|j| &a[*j][rows[k].clone()]);
            own.flatten().map(|v| v * v).sum::<f64>() / count[k]
        };
        let coarse = self.joints.iter().all(|j| data.counts_whitened(*j));
        let late = self.st.effects[self.member.effect].moves_parameters(&self.member.shape);
        let scale = match coarse && late {
            true => (stays(0) / stays(1).max(1e-9)).max(1.0),
            false => 1.0,
        };
        let there = self.gain_in_rows() / count[0];
        scale * (kept(w) - kept(a)) / count[1] / there.max(1e-9)
    }

    /// Whether holdout records do not [show it](State::unseen).
    pub fn unseen(&self) -> bool {
        let held = self.held() > 0 && !self.frozen;
        held && self.st.unseen(self.member, [self.repeats(), 1.0])
    }

    /// What it leaves on its joints, as the tests count it. Unit: noise variances.
    pub fn energy_left(&self) -> f64 {
        let data = self.st.evidence.data;
        let rows = self.fitted();
        let all = gap::energies(data, &self.residual[1], |r| r.fit);
        self.joints
            .iter()
            .map(|j| all[*j][0] + all[*j][1] + data.noise[*j].excess * rows)
            .map(|v| v.max(0.0))
            .sum()
    }

    /// What stays unlikely of the parameters.
    pub fn unlikely_left(&self) -> f64 {
        (self.surprise_after - self.st.freedoms).max(0.0)
    }

    /// Share of the whole gap that it explains: of the frozen model's, where it hides in the parameters.
    pub fn explains(&self) -> f64 {
        let st = self.st;
        match self.frozen {
            true => 1.0 - st.above(self.after, true) / self.whole(&st.evidence.r, true).max(1e-9),
            false => st.explains(&self.without, self.after),
        }
    }

    /// The same on holdout records, where these show a gap on its joints.
    pub fn explains_held(&self) -> Option<f64> {
        let st = self.st;
        let [w, a] = &self.residual;
        let without = match self.frozen {
            true => &st.evidence.r,
            false => w,
        };
        let without = st.gap(without, false);
        let own: f64 = self.joints.iter().map(|j| without[*j].max(0.0)).sum();
        if !st.shows_held(own) {
            return None;
        }
        let here = st.above(&without, false);
        let before = match self.frozen {
            true => here,
            false => self.whole(&st.fit(&[]).1, false),
        };
        (st.shows_held(before)).then(|| (here - self.whole(a, false)) / before)
    }

    fn whole(&self, residual: &[Vec<f64>], fit: bool) -> f64 {
        self.st.above(&self.st.gap(residual, fit), fit)
    }
}
