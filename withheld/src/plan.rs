//! Which cases a set holds.

use crate::case::Plan;
use crate::effects::{CATALOGUE, OUTSIDE};
use crate::random::Random;

/// A mixed set: of twenty cases three without an effect, eleven with one, three with two and three
/// with one that the catalogue does not know. Every effect comes before any comes again.
pub fn mixed(seed: u64, count: usize) -> Vec<Plan> {
    let mut rng = Random::new(seed, 0x00FF_FFFF, 0);
    let mut singles: Vec<&'static str> = CATALOGUE.iter().map(|e| e.0).collect();
    let mut outside = OUTSIDE.to_vec();
    rng.shuffle(&mut singles);
    rng.shuffle(&mut outside);
    let pairs: Vec<&'static str> = {
        // effects that a refit absorbs need a close prior: not beside another
        let mut p: Vec<_> = CATALOGUE.iter().filter(|e| !e.1).map(|e| e.0).collect();
        rng.shuffle(&mut p);
        p
    };
    let order = [
        "single", "clean", "single", "outside", "single", "double", "single", "single", "clean",
        "single", "outside", "single", "double", "single", "single", "clean", "single", "outside",
        "double", "single",
    ];
    let (mut one, mut two, mut out) = (0, 0, 0);
    (0..count)
        .map(|i| {
            let kind = order[i % order.len()];
            let near = rng.chance(0.2);
            let mut target = if near {
                rng.log_range(0.2, 0.8)
            } else {
                rng.log_range(1.5, 8.0)
            };
            let effects = match kind {
                "single" => {
                    one += 1;
                    let name = singles[(one - 1) % singles.len()];
                    if CATALOGUE.iter().any(|e| e.0 == name && e.1) {
                        target *= 2.5;
                    }
                    vec![name]
                }
                "double" => {
                    target = target.max(1.5);
                    let a = pairs[two % pairs.len()];
                    let step = 1 + rng.index(pairs.len() - 1);
                    let b = pairs[(two + step) % pairs.len()];
                    two += 2;
                    vec![a, b]
                }
                "outside" => {
                    target = target.max(1.5);
                    out += 1;
                    vec![outside[(out - 1) % outside.len()]]
                }
                _ => Vec::new(),
            };
            Plan {
                index: i + 1,
                kind,
                effects,
                target,
            }
        })
        .collect()
}

/// Every effect at five sizes, to find where its detection starts.
pub fn ladder(names: &[&'static str]) -> Vec<Plan> {
    let mut out = Vec::new();
    for name in names {
        for target in [0.15, 0.4, 1.0, 2.5, 6.0] {
            out.push(Plan {
                index: out.len() + 1,
                kind: "single",
                effects: vec![name],
                target,
            });
        }
    }
    out
}
