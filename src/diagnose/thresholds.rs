//! The constants that the verdict of a diagnosis rests on: one struct, one instance, all in one place.
//!
//! Every field states its meaning, its unit and its origin. Few come from theory; most were set by hand on
//! simulated cases, and how sensitive the results are to them was not studied. The same values are written
//! to `diagnosis.json` under `thresholds`, and the table of `docs/diagnosis-method.md` is made from these files.
//!
//! A field's comment ends with `Unit: …. Source: ….`, which a test reads.

mod gap;
mod gate;
mod motions;
mod records;
mod search;
mod second;
mod verdict;

pub use gap::{Forward, Gap, Improved, Measure};
pub use gate::Gate;
pub use motions::{Motions, Next};
pub use records::{Carried, Closeness, Controller, Load, Noise, Prior, Rest, Reversals, Window};
pub use search::{Search, Settle, Shapes};
pub use second::Second;
pub use verdict::{Confidence, Decoys, Entry, Hidden, Interval, Matters, Rivals};

/// All of them.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Thresholds {
    /// noise of the measured torque
    pub noise: Noise,
    /// robots that stand
    pub rest: Rest,
    /// a load that some records carry
    pub carried: Carried,
    /// what the torque channel makes of a signal
    pub window: Window,
    /// what a log may have about a reversal
    pub reversals: Reversals,
    /// deviations of the parameters a priori
    pub prior: Prior,
    /// an unknown load
    pub load: Load,
    /// what counts as a gap
    pub gap: Gap,
    /// what an effect must bring to enter the set
    pub entry: Entry,
    /// how large an effect must be to be worth a name
    pub matters: Matters,
    /// conditions whose product is the confidence
    pub confidence: Confidence,
    /// effects that show in the parameters of the nominal model alone
    pub hidden: Hidden,
    /// comparison with what could stand in the place of an effect
    pub rivals: Rivals,
    /// how far the search goes
    pub search: Search,
    /// how shapes are refined
    pub shapes: Shapes,
    /// how the model settles on an effect that moves the links
    pub settle: Settle,
    /// how the gap is measured
    pub measure: Measure,
    /// how close an identified model is
    pub closeness: Closeness,
    /// effects moved in time
    pub decoys: Decoys,
    /// interval of the share that an effect explains
    pub interval: Interval,
    /// the controller of the logs
    pub controller: Controller,
    /// forward simulation
    pub forward: Forward,
    /// choice of the next motion
    pub next: Next,
    /// motions that the next one is chosen from
    pub motions: Motions,
    /// second encoders
    pub second: Second,
    /// the improved robot
    pub improved: Improved,
}

/// The values that are used.
pub const THRESHOLDS: Thresholds = Thresholds {
    noise: records::NOISE,
    rest: records::REST,
    carried: records::CARRIED,
    window: records::WINDOW,
    reversals: records::REVERSALS,
    prior: records::PRIOR,
    load: records::LOAD,
    gap: gap::GAP,
    entry: verdict::ENTRY,
    matters: verdict::MATTERS,
    confidence: verdict::CONFIDENCE,
    hidden: verdict::HIDDEN,
    rivals: verdict::RIVALS,
    search: search::SEARCH,
    shapes: search::SHAPES,
    settle: search::SETTLE,
    measure: gap::MEASURE,
    closeness: records::CLOSENESS,
    decoys: verdict::DECOYS,
    interval: verdict::INTERVAL,
    controller: records::CONTROLLER,
    forward: gap::FORWARD,
    next: motions::NEXT,
    motions: motions::MOTIONS,
    second: second::SECOND,
    improved: gap::IMPROVED,
};
