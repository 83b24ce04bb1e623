//! From evidence to a verdict: which effects are there, how sure that is, and what they leave.
//!
//! 1. The set of effects grows forwards; each step tries every effect at every place beside those found,
//!    improves the shapes of all, and is also compared with the best of all pairs (two effects may mask
//!    each other). A step must explain a share of the gap that stands out on the records *not* fitted to.
//! 2. Every member of the set is challenged: with the others kept, each rival takes its place with its
//!    best shape. A rival that loses little more than the member is indistinguishable from it, and the
//!    two share the confidence.
//! 3. The confidence of a member is a product of conditions: it explains enough of the gap on its joints, also
//!    on holdout records, it predicts them, it beats its decoys, it is the same in every record. The product
//!    is divided by one plus the weights of its rivals.
//!
//! All constants stand in [`super::thresholds`].

mod beside;
mod grow;
mod judge;
mod predict;
mod rivals;
mod state;

pub use judge::Member;
pub(super) use state::{State, inflation};

use super::catalogue::{Context, Effect};
use super::evidence::{Evidence, Projected};
use super::search::Candidate;
use super::thresholds::THRESHOLDS as T;
use rayon::prelude::*;

/// Verdict of a diagnosis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// nothing above noise and ordinary parameter errors
    NoGap,
    /// named effects explain it
    Explained,
    /// named effects explain part of it
    PartlyExplained,
    /// no effect of the catalogue explains it
    Unknown,
}

/// Result of the search.
pub struct Decision {
    /// verdict
    pub verdict: Verdict,
    /// effects by falling confidence
    pub members: Vec<Member>,
    /// gap energy on holdout records before and after; zero where they show none
    pub holdout: [f64; 2],
    /// what the prior says against the refitted parameters, before and after
    pub surprise: [f64; 2],
    /// share of the gap that stays
    pub unexplained: f64,
    /// actuators on which it stays for the most part
    pub stay: Vec<usize>,
    /// whether the refit leaves more on a joint than a sound model does
    pub stands_out: bool,
}

impl Decision {
    /// Columns of the members.
    pub fn projected(&self) -> Vec<&Projected> {
        let members = self.members.iter();
        members.map(|m| &m.candidate.projected).collect()
    }
}

/// Decides. `list` are all effects at all places with their best shapes alone.
pub fn decide(
    evidence: &Evidence,
    cx: &Context,
    effects: &[Box<dyn Effect>],
    list: &[Candidate],
    progress: &dyn Fn(&str),
) -> Decision {
    let st = State::new(evidence, cx, effects);
    let (none, residual) = st.fit(&[]);
    let [before, hold_before] = [true, false].map(|fit| st.gap(&residual, fit));
    let surprise = st.surprise(&none, &residual);

    let set = grow::forwards(&st, list, progress);
    let set = grow::exchange(&st, list, set);

    progress("rivals");
    let (fit, residual) = st.fit(&set);
    let [after, hold_after] = [true, false].map(|fit| st.gap(&residual, fit));
    let surprise_after = st.surprise(&fit, &residual);
    let mut members: Vec<Member> = (0..set.len())
        .into_par_iter()
        .with_max_len(1)
        .map(|i| judge::judge(&st, list, &set, i, &after, surprise_after))
        .collect();
    members.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));

    // what is claimed decides what the verdict is measured against: an effect that hides in the parameters
    // against the frozen model
    let claims = |m: &Member| m.together >= T.confidence.claim;
    let hides = members.iter().any(|m| m.frozen && claims(m));
    let [of_joints, of_joints_held] = match hides {
        true => [true, false].map(|fit| st.gap(&evidence.r, fit)),
        false => [before.clone(), hold_before],
    };
    let [base, base_held] = [st.above(&of_joints, true), st.above(&of_joints_held, false)];
    let held = st.above(&hold_after, false);
    let unexplained = (st.above(&after, true) / base.max(1e-9)).min(1.0);
    let surprising = surprise > T.hidden.surprise + T.hidden.per_parameter * st.freedoms;
    // a set that cannot be told apart explains as well as its one right member
    let claimed = members.iter().any(claims);
    let shows = stands_out(&st, &before);
    let left_there = held_out(&st, &hold_after);
    let stay = staying(&st, &after, &of_joints);
    let remains = stands_out(&st, &after) && unexplained > T.gap.unexplained
        || left_there && held / base_held.max(1e-9) > T.gap.unexplained
        || !stay.is_empty();
    // a gap that is on other joints than the claims, and too small to count, says nothing of them
    let told = !claimed || members.iter().any(|m| claims(m) && m.holdout.is_some());
    let verdict = match (shows || surprising, claimed) {
        (false, false) => Verdict::NoGap,
        (_, false) => Verdict::Unknown,
        _ if remains => Verdict::PartlyExplained,
        _ => Verdict::Explained,
    };
    Decision {
        verdict,
        members,
        holdout: match st.shows_held(base_held) && (told || left_there) {
            true => [base_held, held],
            false => [0.0; 2],
        },
        surprise: [surprise, surprise_after],
        unexplained,
        stay,
        stands_out: shows,
    }
}

/// Whether the gap of any joint is larger than a sound model leaves.
fn stands_out(st: &State, gap: &[f64]) -> bool {
    st.largest(gap) > T.gap.sound * st.evidence.data.fitted as f64
}

/// Actuators whose gap is far above the noise and stays for the most part, however small it is beside those of others.
fn staying(st: &State, after: &[f64], before: &[f64]) -> Vec<usize> {
    let least = T.gap.far * st.evidence.data.fitted as f64;
    let stays = |j: &usize| after[*j] > (T.gap.of_joint * before[*j]).max(least);
    (0..after.len()).filter(stays).collect()
}

/// Whether the gap of any joint on records held out is far above the noise.
fn held_out(st: &State, gap: &[f64]) -> bool {
    let rows = st.evidence.data.rows() - st.evidence.data.fitted;
    let least = T.gap.far * rows as f64;
    st.evidence.data.predicts() && gap.iter().any(|v| *v > least)
}
