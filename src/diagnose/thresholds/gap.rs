//! What counts as a gap, and how it is measured.

/// Gap per row below which there is none.
pub(super) const SOUND: f64 = 0.5;

/// What counts as a gap.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Gap {
    /// Gap per row of a joint below which there is none: what windows, encoders and the shape of friction at
    /// reversals leave of a sound model. Unit: noise variances. Source: by hand.
    pub sound: f64,
    /// Gap per row that a sound model leaves; shares of the gap are of what lies above. Unit: noise variances.
    /// Source: by hand.
    pub floor: f64,
    /// Most that `floor` may be of the largest gap of a joint, where the gap itself is small. Unit: share.
    /// Source: by hand.
    pub floor_share: f64,
    /// Imperfection of a sound model per row that counts neither for nor against an effect. Unit: noise
    /// variances. Source: by hand.
    pub slack: f64,
    /// Least part of the gap on an effect's joints that stays after `slack` is taken off. Unit: share.
    /// Source: by hand.
    pub slack_share: f64,
    /// What a refit may leave of a joint in a verdict of no gap, with what does not repeat. Unit: noise variances.
    /// Source: `gap.sound` and the slack of `measure.broad`, rounded up.
    pub left: f64,
    /// Share of the gap that may stay in a gap that counts as explained. Unit: share. Source: by hand.
    pub unexplained: f64,
    /// The same of a single joint whose gap is far above the noise (`gap.far`). Unit: share. Source: by hand.
    pub of_joint: f64,
    /// Gap per row of a joint from which on the share that stays there, or on records held out, counts by itself. Unit:
    /// noise variances. Source: by hand.
    pub far: f64,
    /// Lags that the autocorrelation of a residual is summed over. Unit: samples. Source: by hand.
    pub lags: usize,
}

pub(super) const GAP: Gap = Gap {
    sound: SOUND,
    floor: 0.25,
    floor_share: 0.3,
    slack: 0.05,
    slack_share: 0.3,
    left: 1.0,
    unexplained: 0.15,
    of_joint: 0.5,
    far: 4.0,
    lags: 20,
};

/// How the gap is measured.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Measure {
    /// How far the gap of a record without periods may lie below zero, per row. Unit: noise variances. Source:
    /// by hand.
    pub negative: f64,
    /// Line of the spectrum between periods, over its median, above which it counts as a slow change. Unit:
    /// ratio. Source: by hand.
    pub slow: f64,
    /// Variance between periods above which what does not repeat is more than noise. Unit: noise variances.
    /// Source: by hand.
    pub broad: f64,
    /// Half width of the triangle that torque and residual pass for relative errors, about 20 Hz. Unit: s.
    /// Source: by hand.
    pub low_pass: f64,
    /// Power of even harmonics over the whole, below which a motion counts as odd. Unit: share. Source: by
    /// hand.
    pub odd: f64,
    /// Bins of position, and half those of velocity, for what a function of the state explains. Unit: count.
    /// Source: by hand.
    pub bins: usize,
    /// Pieces of a record without periods, for its cross-validation. Unit: count. Source: by hand.
    pub pieces: usize,
    /// Samples at zero that every bin is thought to hold. Unit: samples. Source: by hand.
    pub bin_prior: f64,
    /// Gap per row below which there is nothing for a function of the state to explain. Unit: noise variances.
    /// Source: by hand.
    pub least: f64,
}

pub(super) const MEASURE: Measure = Measure {
    negative: 0.1,
    slow: 1.6,
    broad: 1.25,
    low_pass: 0.024,
    odd: 1e-4,
    bins: 14,
    pieces: 8,
    bin_prior: 3.0,
    least: 0.02,
};

/// Forward simulation.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Forward {
    /// Longest part of a record that is simulated. Unit: s. Source: by hand, for the time it takes.
    pub longest: f64,
    /// Deviation over the range of the motion at which a simulation has failed. Unit: ratio. Source: by hand.
    pub far: f64,
}

pub(super) const FORWARD: Forward = Forward {
    longest: 20.0,
    far: 10.0,
};

/// The improved robot.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Improved {
    /// Change of its torque by bodies that can exist that is worth a warning. Unit: noise deviations. Source: by
    /// hand.
    pub seen: f64,
    /// Draws of one sample until one is a machine. Unit: count. Source: by hand.
    pub tries: usize,
    /// Longest part of a record that the report shows with the band of the samples. Unit: s. Source: by hand.
    pub shown: f64,
}

pub(super) const IMPROVED: Improved = Improved {
    seen: 0.1,
    tries: 20,
    shown: 10.0,
};
