//! What the search found in records, and whether another search of the same records stands for it.
//!
//! A delay of the torque and the time by which a simulator's dry friction reverses early are nearly the same, and a large effect
//! moves both. So where a delay is claimed, the records are searched once more with the time of a simulator's usual settings.

use super::catalogue::{Context, Effect};
use super::data::Data;
use super::evidence::{Evidence, Projected};
use super::search::{Candidate, singles};
use super::settle::settled;
use super::thresholds::THRESHOLDS as T;
use super::verdict::{Decision, Member, Verdict, decide, inflation};
use crate::error::Result;

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
    /// Searches records.
    ///
    /// # Errors
    /// Poses that cannot be reached.
    pub fn of(
        data: &'a Data<'a>,
        effects: &[Box<dyn Effect>],
        progress: &(dyn Fn(&str) + Sync),
    ) -> Result<Self> {
        let evidence = Evidence::new(data, 1.0);
        let phi = evidence.parameters(&[], &evidence.fit(&[]));
        let cx = Context::new(data, phi)?;
        progress("every effect at every place");
        let list = singles(&evidence, &cx, effects, &[]);
        let (cx, list) = settled(data, &evidence, effects, cx, list)?;
        let decision = decide(&evidence, &cx, effects, &list, progress);
        Ok(Searched {
            evidence,
            cx,
            list,
            decision,
        })
    }

    /// Whether what it claims may be the early friction of a simulator with its usual settings, which was not taken for
    /// found.
    pub fn may_be_early(&self, effects: &[Box<dyn Effect>]) -> bool {
        let data = self.evidence.data;
        data.may_lead() && data.lead != T.reversals.usual && self.late(effects) > 0
    }

    /// Whether it explains the records with fewer of the effects that the other claims: as well as what that one leaves
    /// allows, or, without any of them, all that counts, where the other took friction to reverse early, too.
    pub fn stands_for(&self, other: &Searched, effects: &[Box<dyn Effect>]) -> bool {
        let all = matches!(self.decision.verdict, Verdict::NoGap | Verdict::Explained);
        let as_well = || self.left() < other.left() + other.margin();
        let late = self.late(effects);
        let none = late == 0 && all && other.evidence.data.lead > 0.0;
        late < other.late(effects) && (none || as_well())
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

    /// `χ²` with them: what else was tried and not claimed takes a little, too.
    fn left(&self) -> f64 {
        let members: Vec<&Projected> = self.claimed().map(|m| &m.candidate.projected).collect();
        self.evidence.j0 - self.evidence.fit(&members).gain
    }

    /// By how much another `χ²` may be higher and count as no worse: deviations squared of what the set leaves.
    fn margin(&self) -> f64 {
        let members = self.decision.projected();
        let residual = (self.evidence).residual(&members, &self.evidence.fit(&members));
        let scale = inflation(&residual, self.evidence.data.fitted);
        (T.reversals.sure * scale).powi(2)
    }
}
