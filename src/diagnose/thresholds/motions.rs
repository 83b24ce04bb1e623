//! The next motion.

/// Choice of the next motion.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Next {
    /// Visibility below which an effect is invisible in a motion. Unit: share. Source: by hand.
    pub invisible: f64,
    /// Overlap that is good enough. Unit: share. Source: by hand.
    pub apart: f64,
    /// Part of the present overlap that a motion must come below to be worth a run. Unit: share. Source: by
    /// hand.
    pub better: f64,
    /// Overlap of a pair in all first motions from which on no motion distinguishes it. Unit: share. Source:
    /// by hand.
    pub alias: f64,
    /// Size of the first random steps, their decay, and the smallest. Unit: share. Source: by hand.
    pub step: [f64; 3],
    /// Rivals of an effect that are looked at. Unit: count. Source: by hand.
    pub rivals: usize,
    /// Invisible effects that are looked at. Unit: count. Source: by hand.
    pub hidden: usize,
    /// Confidence from which on an effect is worth a motion. Unit: 0 to 1. Source: by hand.
    pub believed: f64,
    /// Confidence of a rival over that of its effect from which on it is worth a motion. Unit: share. Source:
    /// by hand.
    pub near: f64,
    /// Energy per row that the believed effect must have in a motion. Unit: noise variances. Source: by hand.
    pub seen: f64,
    /// Most samples of a period, and shapes of an effect, while motions are compared. Unit: count. Source: by
    /// hand, for the time it takes.
    pub coarse: [usize; 2],
    /// The same in the last prediction. Unit: count. Source: by hand, for the time it takes.
    pub fine: [usize; 2],
    /// Least samples of a period. Unit: count. Source: by hand.
    pub least_samples: usize,
    /// Band that a motion is thought to be recorded in. Unit: Hz. Source: by hand.
    pub band: f64,
}

pub(super) const NEXT: Next = Next {
    invisible: 0.01,
    apart: 0.02,
    better: 0.95,
    alias: 0.995,
    step: [0.3, 0.8, 0.05],
    rivals: 2,
    hidden: 8,
    believed: 0.02,
    near: 0.08,
    seen: 0.05,
    coarse: [1500, 5],
    fine: [12_000, 24],
    least_samples: 64,
    band: 20.0,
};

/// Motions that the next one is chosen from.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Motions {
    /// Periods that a motion is run. Unit: count. Source: by hand.
    pub periods: u32,
    /// Period of the designed motions. Unit: s. Source: by hand.
    pub period: f64,
    /// Factors on it. Unit: ratio. Source: by hand.
    pub slower: [f64; 3],
    /// Harmonics of the designed motions, of joints and of a platform. Unit: count. Source: by hand, for the
    /// time it takes.
    pub harmonics: [usize; 2],
    /// Periods of the random motions. Unit: s. Source: by hand.
    pub random: [f64; 3],
    /// Random motions of each period. Unit: count. Source: by hand.
    pub draws: usize,
    /// Harmonics of the random motions. Unit: none. Source: odd ones, which separate odd from even.
    pub lines: [u32; 4],
    /// Range of the records over the largest amplitude of a random motion. Unit: ratio. Source: by hand.
    pub spread: f64,
    /// Factor by which a motion shrinks about its middle while it breaks a limit. Unit: ratio. Source: by hand.
    pub shrink: f64,
    /// How often it may shrink: a random motion, and one that was inside before it was changed. Unit: count.
    /// Source: by hand.
    pub often: [usize; 2],
}

pub(super) const MOTIONS: Motions = Motions {
    periods: 3,
    period: 8.0,
    slower: [1.0, 2.5, 6.0],
    harmonics: [5, 3],
    random: [4.0, 10.0, 24.0],
    draws: 2,
    lines: [1, 3, 5, 7],
    spread: 3.0,
    shrink: 0.8,
    often: [16, 4],
};
