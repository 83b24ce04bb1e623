//! Robots whose effect is withheld from the diagnosis: another simulation, other formulas, other code than the library's.
//! See `docs/withheld.md`.

pub mod attach;
pub mod case;
pub mod chain;
pub mod closed;
pub mod disturb;
pub mod effects;
pub mod friction;
pub mod motion;
pub mod plan;
pub mod plant;
pub mod random;
pub mod refit;
pub mod reliability;
pub mod robots;
pub mod score;
pub mod simulate;
pub mod table;
pub mod write;
