//! What a second encoder is asked.

/// Deflection between two encoders of one joint.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Second {
    /// Length of the blocks that are left out in turn, less where that makes too few. Unit: s. Source: by hand.
    pub block: f64,
    /// Fewest blocks that decide. Unit: count. Source: by hand.
    pub blocks: usize,
    /// Most samples of a joint that are looked at. Unit: count. Source: by hand.
    pub rows: usize,
    /// What an effect must gain on blocks left out, over the standard error of the gain. Unit: ratio. Source: a normal
    /// test at 0.1 %, one-sided.
    pub gain: f64,
    /// What an effect must take off the mean square on blocks left out. Unit: share. Source: by hand.
    pub share: f64,
    /// Gain beside it up to which another effect could stand in its place. Unit: ratio to the standard error. Source:
    /// two standard errors.
    pub rival: f64,
    /// Transmitted torque below which the side of the play is not known, over the root mean square of that torque.
    /// Unit: share. Source: by hand.
    pub closed: f64,
    /// Proportion of the two positions, beyond 1, above which their scale is doubted. Unit: share. Source: by hand.
    pub scale: f64,
}

pub(super) const SECOND: Second = Second {
    block: 2.0,
    blocks: 6,
    rows: 40_000,
    gain: 3.1,
    share: 0.02,
    rival: 2.0,
    closed: 0.2,
    scale: 1e-3,
};
