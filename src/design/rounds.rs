//! Rounds of starts: eight random ones are each improved, the best three are followed to the end; later
//! rounds also start from disturbed copies of the best so far.

use super::record;
use super::solve::{Iterate, Phase, Stop};
use super::start;
use crate::error::Result;
use rayon::prelude::*;

/// Starts in a round, and how many of them are followed to the end.
pub(super) const ROUND: (usize, usize) = (8, 3);
/// Random candidates of which the best becomes a start.
const CANDIDATES: usize = 24;
/// … and where there is something to touch, so that each is moved clear of it first.
const CROWDED: usize = 6;
/// Exponents of the p-norms that smooth the extreme eigenvalues, first and second phase.
const NORMS: (f64, f64) = (10.0, 40.0);

/// State of the rounds.
#[derive(Default)]
pub(super) struct Search {
    pub next: usize,
    pub best: Option<(usize, Iterate)>,
    pub starts: Vec<record::Start>,
}

impl Search {
    /// One round: starts, first phase, the best to the end.
    pub fn round(
        &mut self,
        source: &start::Source,
        most: usize,
        halt: &(dyn Fn() -> bool + Sync),
        report: &(dyn Fn(usize, f64) + Sync),
    ) -> Result<()> {
        let task = source.task;
        let first = self.next;
        let size = ROUND.0.min(most - first);
        self.next += size;
        let candidates = match source.crowded() {
            true => CROWDED,
            false => CANDIDATES,
        };
        let incumbent = self.best.as_ref().map(|(_, b)| b);
        let begun: Vec<Option<(usize, Iterate, bool)>> = (first..first + size)
            .into_par_iter()
            .map(|number| {
                if (incumbent.is_some() || number > first) && halt() {
                    return Ok(None);
                }
                // every other start of the later rounds disturbs the best so far, and three of four where random
                // motions are rarely good
                let again = match source.crowded() {
                    true => !number.is_multiple_of(4),
                    false => number % 2 == 1,
                };
                let x = match incumbent {
                    Some(b) if again => Some(source.disturbed(&b.x, number, halt)?),
                    _ => source.random(number, candidates, halt)?,
                };
                let Some(x) = x else { return Ok(None) };
                let mut it = Iterate::new(task, x);
                if !it.value.is_finite() {
                    // as good as standing still: nothing to improve on
                    return Ok(None);
                }
                let stop = Stop {
                    iterations: 120,
                    gain: if source.rough { 5e-2 } else { 1e-2 },
                };
                it.run(task, Phase::Smooth(NORMS.0), stop, halt)?;
                Ok(Some((number, it, false)))
            })
            .collect::<Result<_>>()?;
        let mut begun: Vec<_> = begun.into_iter().flatten().collect();
        begun.sort_by(|a, b| a.1.value.total_cmp(&b.1.value).then(a.0.cmp(&b.0)));
        begun
            .par_iter_mut()
            .take(if source.rough { 0 } else { ROUND.1 })
            .try_for_each(|(_, it, done)| -> Result<()> {
                let stop = Stop {
                    iterations: 150,
                    gain: 2e-3,
                };
                it.run(task, Phase::Smooth(NORMS.1), stop, halt)?;
                let stop = Stop {
                    iterations: 60,
                    gain: 5e-4,
                };
                *done = it.run(task, Phase::Exact, stop, halt)?;
                Ok(())
            })?;
        begun.sort_by_key(|b| b.0);
        for (number, it, converged) in begun {
            let history = it.history.iter().map(|v| v.exp().min(1e300)).collect();
            self.starts.push(record::Start {
                number,
                history,
                converged,
            });
            if self.best.as_ref().is_none_or(|(_, b)| it.value < b.value) {
                self.best = Some((number, it));
            }
        }
        if let Some((_, b)) = &self.best {
            report(self.next, b.value);
        }
        Ok(())
    }
}
