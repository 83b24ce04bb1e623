//! Which set of effects explains the rows best.
//!
//! Of all sets, the one with the largest evidence is looked for: each effect costs [`PRICE`], for there are many that
//! could be. From nothing and from all dimensions together, effects are added, taken out and exchanged as long as that
//! helps. The factor on the expected size of an effect is chosen with it.

use super::catalogue::Place;
use super::problem::{Member, Problem, Solved};
use rayon::prelude::*;

/// What the evidence must gain for an effect more, natural logarithm: one of about fifty places and five sizes.
pub const PRICE: f64 = 6.0;
/// What the evidence must gain beyond that for a link that bends: gears and bearings of an arm give way twenty times as
/// often as its links.
const RARE: f64 = 3.0;
/// Factors on the expected size of an effect.
const SIZES: [f64; 5] = [0.3, 1.0, 3.0, 10.0, 30.0];
/// By how much another set must be better to be taken, natural logarithm.
const BETTER: f64 = 0.1;
/// Most members of a set.
const MOST: usize = 40;

/// Effects at places, each with the factor on its expected size.
pub type Set = Vec<(usize, f64)>;

/// A problem and its places.
pub struct Search<'a> {
    /// rows
    pub problem: &'a Problem,
    /// effects at places
    pub places: &'a [Place],
}

impl Search<'_> {
    /// A set, fitted; `None` where a number is negative that cannot be.
    pub fn solve(&self, set: &Set) -> Option<Solved> {
        let members: Vec<Member> = set
            .iter()
            .map(|(p, s)| (self.places[*p].columns.as_slice(), *s))
            .collect();
        let found = self.problem.solve(&members)?;
        let mut at = 0;
        for (p, _) in set {
            let place = &self.places[*p];
            if place.positive && found.mean[at] <= 0.0 {
                return None;
            }
            at += place.columns.len();
        }
        Some(found)
    }

    /// What the evidence must gain for a set.
    pub fn price(&self, set: &Set) -> f64 {
        let each = set.iter().map(|(p, _)| match self.places[*p].effect {
            "link_compliance" => PRICE + RARE,
            _ => PRICE,
        });
        each.sum()
    }

    /// Evidence less the price of its members.
    pub fn score(&self, set: &Set) -> f64 {
        match self.solve(set) {
            Some(s) => s.evidence - self.price(set),
            None => f64::NEG_INFINITY,
        }
    }

    /// The best size of a place beside a set.
    pub fn with(&self, set: &Set, place: usize) -> (f64, Set) {
        let each = SIZES.into_iter().map(|size| {
            let mut more = set.clone();
            more.push((place, size));
            (self.score(&more), more)
        });
        let none = (f64::NEG_INFINITY, Set::new());
        each.fold(none, |a, b| if b.0 > a.0 { b } else { a })
    }

    fn best_of(&self, sets: Vec<(Set, usize)>) -> Option<(f64, Set)> {
        let all: Vec<(f64, Set)> = sets.par_iter().map(|(s, p)| self.with(s, *p)).collect();
        all.into_iter()
            .reduce(|a, b| if b.0 > a.0 { b } else { a })
            .filter(|b| b.0.is_finite())
    }

    /// Adds, takes out and exchanges from a set on, without the places that are banned.
    pub fn climb(&self, start: Set, banned: &[usize]) -> (f64, Set) {
        let mut set = start;
        let mut score = self.score(&set);
        for _ in 0..4 * MOST {
            let free: Vec<usize> = (0..self.places.len())
                .filter(|p| !banned.contains(p) && !set.iter().any(|m| m.0 == *p))
                .collect();
            // what is not needed goes first
            let fewer = (0..set.len()).map(|k| {
                let mut s = set.clone();
                s.remove(k);
                (self.score(&s), s)
            });
            let fewer = fewer.reduce(|a, b| if b.0 > a.0 { b } else { a });
            if let Some((new, s)) = fewer
                && new > score
            {
                (score, set) = (new, s);
                continue;
            }
            let more = match set.len() < MOST {
                true => free.iter().map(|p| (set.clone(), *p)).collect(),
                false => Vec::new(),
            };
            let swaps = |set: &Set| {
                let mut all = Vec::new();
                for k in 0..set.len() {
                    let mut rest = set.clone();
                    rest.remove(k);
                    all.extend(free.iter().map(|p| (rest.clone(), *p)));
                }
                all
            };
            let mut next = self.best_of(more).filter(|n| n.0 > score + 1e-6);
            // exchanging is tried where nothing more can be added, and while sets are small
            if next.is_none() || set.len() <= 3 {
                let other = self.best_of(swaps(&set)).filter(|n| n.0 > score + 1e-6);
                next = match (next, other) {
                    (Some(a), Some(b)) if b.0 > a.0 => Some(b),
                    (None, b) => b,
                    (a, _) => a,
                };
            }
            match next {
                Some((new, s)) => (score, set) = (new, s),
                None => break,
            }
        }
        (score, set)
    }

    /// A better set without one of the members, where there is one: several others in its place are no single exchange.
    /// Dimensions are left as they are; they are many and seldom in doubt.
    pub fn aside(&self, set: &Set) -> Option<Set> {
        let score = self.score(set);
        let doubtful = |m: &&(usize, f64)| {
            let effect = self.places[m.0].effect;
            !matches!(effect, "link_geometry" | "leg_geometry")
        };
        let others = set.iter().filter(doubtful).map(|(own, _)| {
            let rest = set.iter().copied().filter(|m| m.0 != *own).collect();
            self.climb(rest, &[*own])
        });
        let best = others.reduce(|a, b| if b.0 > a.0 { b } else { a });
        let mut other = best.filter(|b| b.0 > score + BETTER)?.1;
        other.sort_by_key(|m| m.0);
        Some(other)
    }

    /// The best set.
    pub fn best(&self) -> Set {
        let geometry: Set = (0..self.places.len())
            .filter(|p| matches!(self.places[*p].effect, "link_geometry" | "leg_geometry"))
            .map(|p| (p, 1.0))
            .collect();
        let (a, from_nothing) = self.climb(Set::new(), &[]);
        // with few effects the other way round finds the same, and takes long
        let (b, from_geometry) = match from_nothing.len() > 2 {
            true => self.climb(geometry, &[]),
            false => (f64::NEG_INFINITY, Set::new()),
        };
        let mut best = if b > a { from_geometry } else { from_nothing };
        best.sort_by_key(|m| m.0);
        best
    }
}
