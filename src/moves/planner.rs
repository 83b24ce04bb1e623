//! A way between two postures where the straight one is blocked.
//!
//! Two trees of free straight lines grow from the ends towards random postures and towards each other
//! (RRT-Connect: Kuffner & LaValle, ICRA 2000). Every line is proven free, not sampled. What is found
//! is cut short afterwards: two random points on the way are joined where the line between them is free.
//! The random numbers come from a seed, so that the same question has the same answer.

use super::guard::{Guard, Line};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Longest line that is tried at once, as a part of the diagonal of the box of all postures.
const STEP: f64 = 0.15;
/// How often a blocked line is halved before it is given up.
const HALVINGS: u32 = 3;
/// Attempts to cut the way short.
const CUTS: usize = 120;

/// A way, or what was in it.
pub struct Found {
    /// postures between the ends; `None` where no way was found
    pub via: Option<Vec<Vec<f64>>>,
    /// random postures tried
    pub tries: usize,
    /// pairs that blocked lines, the most frequent first, with how often they did
    pub blocked: Vec<(usize, usize)>,
}

struct Tree {
    nodes: Vec<(Vec<f64>, usize)>,
}

/// Where a tree got to.
enum Grown {
    /// its new node is the target
    Reached,
    /// it has a new node on the way
    Advanced,
    /// it has none
    Trapped,
}

struct Search<'a, 'b> {
    guard: &'a Guard<'b>,
    span: &'a [[f64; 2]],
    counts: Vec<usize>,
}

impl Search<'_, '_> {
    /// Distance with every coordinate in parts of its range.
    fn apart(&self, a: &[f64], b: &[f64]) -> f64 {
        let each = a.iter().zip(b).zip(self.span);
        let squares = each.map(|((a, b), [low, high])| ((b - a) / (high - low)).powi(2));
        squares.sum::<f64>().sqrt()
    }

    fn free(&mut self, from: &[f64], to: &[f64]) -> bool {
        match self.guard.free(&Line { from, to }) {
            Ok(()) => true,
            Err(blocked) => {
                self.counts[blocked.pair] += 1;
                false
            }
        }
    }

    /// One line from the nearest node of a tree towards a posture.
    fn extend(&mut self, tree: &mut Tree, to: &[f64], diagonal: f64) -> Grown {
        let distances = tree.nodes.iter().map(|(q, _)| self.apart(q, to));
        let nearest = distances
            .enumerate()
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap_or((0, 0.0));
        let (at, distance) = nearest;
        let from = tree.nodes[at].0.clone();
        let mut part = (STEP * diagonal / distance.max(1e-12)).min(1.0);
        for _ in 0..=HALVINGS {
            let target: Vec<f64> = (from.iter().zip(to))
                .map(|(a, b)| if part < 1.0 { a + part * (b - a) } else { *b })
                .collect();
            if self.free(&from, &target) {
                tree.nodes.push((target, at));
                return match part < 1.0 {
                    true => Grown::Advanced,
                    false => Grown::Reached,
                };
            }
            part *= 0.5;
        }
        Grown::Trapped
    }

    /// Joins random points of a way, then leaves out postures that are not needed.
    fn shorten(&mut self, way: &mut Vec<Vec<f64>>, rng: &mut ChaCha8Rng) {
        for _ in 0..CUTS {
            let lines = way.len() - 1;
            if lines < 2 {
                return;
            }
            let (mut i, mut k) = (rng.random_range(0..lines), rng.random_range(0..lines));
            if i == k {
                continue;
            }
            if i > k {
                std::mem::swap(&mut i, &mut k);
            }
            let mut point = |i: usize| -> Vec<f64> {
                let s: f64 = rng.random_range(0.0..1.0);
                let ends = way[i].iter().zip(&way[i + 1]);
                ends.map(|(a, b)| a + s * (b - a)).collect()
            };
            let (a, b) = (point(i), point(k));
            let first = self.apart(&a, &way[i + 1]);
            let inner: f64 = (i + 1..k).map(|m| self.apart(&way[m], &way[m + 1])).sum();
            let old = first + inner + self.apart(&way[k], &b);
            if self.apart(&a, &b) < 0.999 * old && self.free(&a, &b) {
                way.splice(i + 1..=k, [a, b]);
            }
        }
        let mut k = 1;
        while k + 1 < way.len() {
            let (before, after) = (way[k - 1].clone(), way[k + 1].clone());
            match self.free(&before, &after) {
                true => drop(way.remove(k)),
                false => k += 1,
            }
        }
    }
}

/// Searches a way from one free posture to another inside a box of postures.
pub fn search(
    guard: &Guard,
    span: &[[f64; 2]],
    from: &[f64],
    to: &[f64],
    tries: usize,
    seed: u64,
) -> Found {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let counts = vec![0; guard.scene.pairs.len()];
    let mut s = Search {
        guard,
        span,
        counts,
    };
    let diagonal = (span.len() as f64).sqrt();
    let root = |q: &[f64]| Tree {
        nodes: vec![(q.to_vec(), 0)],
    };
    let (mut a, mut b) = (root(from), root(to));
    let mut swapped = false;
    let mut made = 0;
    let mut via = match s.free(from, to) {
        true => Some(Vec::new()),
        false => None,
    };
    while via.is_none() && made < tries {
        made += 1;
        let random: Vec<f64> = (span.iter())
            .map(|[low, high]| low + (high - low) * rng.random_range(0.0..1.0))
            .collect();
        if !matches!(s.extend(&mut a, &random, diagonal), Grown::Trapped) {
            let target = a.nodes.last().map(|n| n.0.clone()).unwrap_or_default();
            let mut grown = Grown::Advanced;
            while matches!(grown, Grown::Advanced) {
                grown = s.extend(&mut b, &target, diagonal);
            }
            if matches!(grown, Grown::Reached) {
                let (first, second) = if swapped { (&b, &a) } else { (&a, &b) };
                let mut way = branch(first);
                way.reverse();
                way.extend(branch(second).into_iter().skip(1));
                s.shorten(&mut way, &mut rng);
                way.pop();
                way.remove(0);
                via = Some(way);
            }
        }
        std::mem::swap(&mut a, &mut b);
        swapped = !swapped;
    }
    let mut blocked: Vec<(usize, usize)> = (s.counts.iter().copied().enumerate())
        .filter(|(_, count)| *count > 0)
        .collect();
    blocked.sort_by_key(|(pair, count)| (std::cmp::Reverse(*count), *pair));
    Found {
        via,
        tries: made,
        blocked,
    }
}

/// From the last node of a tree to its root.
fn branch(tree: &Tree) -> Vec<Vec<f64>> {
    let mut out = Vec::new();
    let mut at = tree.nodes.len() - 1;
    loop {
        out.push(tree.nodes[at].0.clone());
        if at == 0 {
            return out;
        }
        at = tree.nodes[at].1;
    }
}
