//! What the search found in records, and whether another search of the same records stands for it.
//!
//! A delay of the torque and the time by which a simulator's dry friction reverses early are nearly the same, and a large effect
//! moves both. So where a delay is claimed, or takes a part of a gap that is not explained, the records are searched once more with
//! the time of a simulator's usual settings. And what a motion shakes and no effect explains looks like a wide window of the torque:
//! where the widest is found and the gap is not explained, they are searched with that of plus and minus one sample.

use super::catalogue::{Context, Effect};
use super::channel::Assumed;
use super::data::Data;
use super::evidence::{Evidence, Projected};
use super::search::{Candidate, singles};
use super::settle::settled;
use super::thresholds::THRESHOLDS as T;
use super::verdict::{Decision, Member, Verdict, decide, inflation};
use crate::error::Result;
use std::cmp::Ordering;

/// What the search found in records.
pub struct Searched<'a> {
    /// the nominal model
    pub evidence: Evidence<'a>,
    /// what columns are made from
    pub cx: Context<'a>,
    /// all effects at all places
    pub list: Vec<Candidate>,
    /// those that are there
    pub decision: Decision,
}

impl<'a> Searched<'a> {
    /// Searches records, from what a search `before` has found in them.
    ///
    /// # Errors
    /// Poses that cannot be reached.
    pub fn of(
        data: &'a Data<'a>,
        effects: &[Box<dyn Effect>],
        before: Option<&Aside>,
        progress: &(dyn Fn(&str) + Sync),
    ) -> Result<Self> {
        let evidence = Evidence::new(data, 1.0);
        let phi = evidence.parameters(&[], &evidence.fit(&[]));
        let cx = Context::new(data, phi)?;
        progress("every effect at every place");
        let list = singles(&evidence, &cx, effects, before.map(|b| &b.list[..]));
        let (cx, mut list) = settled(data, &evidence, effects, cx, list)?;
        let decision = decide(&evidence, &cx, effects, &list, progress);
        // only their energies are asked for from here on
        list.iter_mut().for_each(|c| c.projected.forget());
        Ok(Searched {
            evidence,
            cx,
            list,
            decision,
        })
    }

    /// What else the log may be, where the search leaves doubts about it: early friction of a simulator with its usual settings,
    /// which was not taken for found and may pass for a delay that is claimed; a window that was found as wide as any.
    pub fn doubts(&self, effects: &[Box<dyn Effect>]) -> Vec<Assumed> {
        let data = self.evidence.data;
        // behind coarse encoders a time was looked for without a sign of a simulator, and a swinging base may pass for what another
        // one leaves
        let fine = !(0..data.joints()).any(|j| data.coarse(j));
        let part = |m: &Member| effects[m.candidate.effect].late() && fine && !self.all();
        let any = self.late(effects) > 0 || self.decision.members.iter().any(part);
        let late = data.may_lead() && data.lead != T.reversals.usual && any;
        let early = late.then_some(Assumed {
            lead: Some(T.reversals.usual),
            ..Assumed::default()
        });
        let wide = data.window >= T.window.widest && !self.all();
        let plain = wide.then_some(Assumed {
            window: Some(0.0),
            ..Assumed::default()
        });
        early.into_iter().chain(plain).collect()
    }

    /// Without the decomposed model, which is the most that a search holds, until it is taken up again.
    pub fn set_aside(self, effects: &[Box<dyn Effect>]) -> Aside<'a> {
        Aside {
            late: self.late(effects),
            left: self.left(),
            margin: self.margin(),
            data: self.evidence.data,
            cx: self.cx,
            list: self.list,
            decision: self.decision,
        }
    }

    /// Whether it explains the records with fewer of the effects that the other claims: as well as what that one leaves
    /// allows, or, without any of them, all that counts, where the other took friction to reverse early, too. Or with no more
    /// of them, and clearly better.
    pub fn stands_for(&self, other: &Aside, effects: &[Box<dyn Effect>]) -> bool {
        let all = self.all();
        let as_well = || self.left() < other.left + other.margin;
        let late = self.late(effects);
        let none = late == 0 && all && other.data.lead > 0.0;
        let better = || self.left() + other.margin < other.left;
        match late.cmp(&other.late) {
            Ordering::Less => none || as_well(),
            Ordering::Equal => better(),
            Ordering::Greater => false,
        }
    }

    /// Whether all that counts is explained.
    fn all(&self) -> bool {
        matches!(self.decision.verdict, Verdict::NoGap | Verdict::Explained)
    }

    /// How many effects it claims that dry friction that reverses early may pass for.
    fn late(&self, effects: &[Box<dyn Effect>]) -> usize {
        let late = |m: &&Member| effects[m.candidate.effect].late();
        self.claimed().filter(late).count()
    }

    /// The effects that it claims.
    fn claimed(&self) -> impl Iterator<Item = &Member> {
        let members = self.decision.members.iter();
        members.filter(|m| m.together >= T.confidence.claim)
    }

    /// What is left with them, with the penalty of the prior: what else was tried and not claimed takes a little, too. Where more
    /// is assumed wrongly, more counts as noise, so it is not counted in units of that.
    fn left(&self) -> f64 {
        let members: Vec<&Projected> = self.claimed().map(|m| &m.candidate.projected).collect();
        let fit = self.evidence.fit(&members);
        let residual = self.evidence.residual(&members, &fit);
        self.evidence.log_power(&residual) + self.evidence.surprise(&fit, &residual)
    }

    /// By how much another may leave more and count as no worse: deviations squared of what the set leaves.
    fn margin(&self) -> f64 {
        let members = self.decision.projected();
        let residual = (self.evidence).residual(&members, &self.evidence.fit(&members));
        let scale = inflation(&residual, self.evidence.data.fitted);
        (T.reversals.sure * scale).powi(2)
    }
}

/// What another search is compared with.
pub struct Aside<'a> {
    data: &'a Data<'a>,
    cx: Context<'a>,
    list: Vec<Candidate>,
    decision: Decision,
    /// effects that it claims and early friction may pass for
    late: usize,
    /// what is left with what it claims
    left: f64,
    /// by how much another may leave more and count as no worse
    margin: f64,
}

impl<'a> Aside<'a> {
    /// The search as it was.
    pub fn taken_up(self) -> Searched<'a> {
        Searched {
            evidence: Evidence::new(self.data, 1.0),
            cx: self.cx,
            list: self.list,
            decision: self.decision,
        }
    }
}
