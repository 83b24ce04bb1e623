//! What is taken from the records and the robot file before any effect: noise, window, reversals, prior.

use super::gate::{Gate, gate};

/// Noise of the measured torque.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Noise {
    /// Frequency below which differences between periods are not noise but slow changes. Unit: Hz. Source: by hand.
    pub slow: f64,
    /// Order of the whitening filters. Unit: count. Source: by hand.
    pub order: usize,
    /// Lines of a spectrum between 0 and half the sampling rate. Unit: count. Source: by hand.
    pub lines: usize,
    /// Up to how many times `slow` the level is taken that a spectrum is continued with below it. Unit: ratio.
    /// Source: by hand.
    pub level: f64,
    /// Least power of a line below `slow`, over that level. Unit: share. Source: by hand.
    pub flat: f64,
    /// Line over the median about it above which it is a disturbance with a frequency of its own. Unit: ratio.
    /// Source: by hand.
    pub lone: f64,
    /// Lines to either side that this median is taken of. Unit: count. Source: by hand.
    pub about: usize,
    /// Deviation between periods over the `torque_noise` of the robot file above which that one counts. Unit:
    /// ratio. Source: by hand.
    pub stated: f64,
    /// Frequency from which on a record without periods shows its noise, over the band of its motion. Unit: ratio.
    /// Source: by hand.
    pub above: f64,
    /// Lines that are left for that at least. Unit: count. Source: by hand.
    pub last: usize,
    /// Least power of a line over that of all. Unit: share. Source: by hand.
    pub least: f64,
    /// Deviation of the noise over the root mean square of the torques that stands for none. Unit: share. Source: by
    /// hand: torques of machines are not known better, and a simulator's log has no noise at all.
    pub of_torque: f64,
    /// Gap over the root mean square of the torques, both per row, that a coarse encoder leaves of a sound model. Unit: share.
    /// Source: clean hobby arms in MuJoCo left 0.3 % at most.
    pub of_coarse: f64,
    /// Share of what a coarse encoder makes unknown of the acceleration that may count as a gap: where a motion repeats, its
    /// steps do, too, as lines. Unit: share. Source: clean arms in MuJoCo with encoders of 12 bits left 0.16 at most.
    pub of_steps: f64,
    /// Most of that over the root mean square of the torques, both per row and as deviations. Unit: share. Source: the same arms left
    /// 0.026 at most, one with hidden cogging 0.12.
    pub most_of_steps: f64,
    /// Share of that below which a log has next to none. Unit: share. Source: by hand.
    pub none: f64,
    /// Frequency above which what encoders leave unknown of the acceleration grows no more. Unit: Hz. Source: by
    /// hand.
    pub resolved: f64,
    /// Lines to either side of the median of the residual that limits it. Unit: count. Source: by hand.
    pub excess: usize,
}

pub(super) const NOISE: Noise = Noise {
    slow: 4.0,
    order: 12,
    lines: 128,
    level: 3.0,
    flat: 0.5,
    lone: 4.0,
    about: 6,
    stated: 1.5,
    above: 2.0,
    last: 8,
    least: 1e-3,
    of_torque: 2e-3,
    of_coarse: 1e-2,
    of_steps: 0.2,
    most_of_steps: 0.04,
    none: 0.1,
    resolved: 60.0,
    excess: 5,
};

/// Robots that stand.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Rest {
    /// Time at which no joint moves that is worth a sentence. Unit: s. Source: by hand.
    pub least: f64,
    /// Deviation of a torque at rest over its noise from which on something pushes. Unit: ratio. Source: by hand.
    pub pushed: f64,
}

pub(super) const REST: Rest = Rest {
    least: 0.5,
    pushed: 3.0,
};

/// A load that some records carry and others do not.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Carried {
    /// Records up to which they are compared. Unit: count. Source: by hand, for the time it takes.
    pub records: usize,
    /// Farthest that its centre of mass may be from the frame of the body that carries it. Unit: m. Source: by hand.
    pub reach: f64,
    /// What a load of its own for either half of a record gains, over what one load gains. Unit: share. Source: by hand.
    pub unsteady: Gate,
    /// Share of the energy above the noise of its records that it takes away. Unit: share. Source: by hand.
    pub share: Gate,
    /// Part of its gain that a load in all records does not bring. Unit: share. Source: by hand.
    pub beyond: Gate,
    /// Its mass. Unit: standard deviations. Source: by hand: an arm with a spring that no model had got a load of 8 ± 93 g.
    pub mass: Gate,
}

pub(super) const CARRIED: Carried = Carried {
    records: 8,
    reach: 0.8,
    unsteady: gate(0.25, 0.03),
    share: gate(0.4, 0.05),
    beyond: gate(0.15, 0.03),
    mass: gate(4.0, 0.4),
};

/// What the torque channel makes of a signal.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Window {
    /// Sub-steps of a sampling interval over which what is not smooth is averaged. Unit: count. Source: by hand.
    pub fine: usize,
    /// Argument beyond which a hyperbolic tangent counts as ±1. Unit: none. Source: it is, to rounding.
    pub saturated: f64,
    /// Largest variance of the window. Unit: samples². Source: by hand.
    pub widest: f64,
    /// Variance, of a torque that is averaged over plus and minus one sample, that one taken at an instant lacks. Unit:
    /// samples². Source: the variance of a triangle of that width.
    pub instant: f64,
    /// How far a simulator's damping may take its velocity from the sample of its log. Unit: samples. Source: implicit
    /// integration takes that at the end of a step.
    pub within: f64,
    /// Most of it that one pass of a kernel of three points takes. Unit: samples². Source: by hand.
    pub pass: f64,
}

pub(super) const WINDOW: Window = Window {
    fine: 4,
    saturated: 20.0,
    widest: 3.0,
    instant: 1.0 / 6.0,
    within: 0.5,
    pass: 0.3,
};

/// What a log of any robot may have about a reversal.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Reversals {
    /// Width of the sign of dry friction in the nominal model, over the largest speed. Unit: share. Source: by
    /// hand.
    pub sharp: f64,
    /// Widths over which it may change its sign instead, over the largest speed. Unit: share. Source: by hand.
    pub rounded: [f64; 3],
    /// Deviation of these a priori, over the dry friction. Unit: share. Source: by hand.
    pub rounding: f64,
    /// Part of the dry friction by which a model may be off close to a reversal. Unit: share. Source: by hand.
    pub bent: f64,
    /// How long that lasts to either side, and how long it takes to fade. Unit: s. Source: by hand.
    pub near: f64,
    /// The same in samples, where those are so far apart that it is longer. Unit: count. Source: as many samples of a log of 200 Hz
    /// are as long; a clean arm in Pinocchio with 125 Hz, whose friction is fed forward, had a delay of −2.6 ms.
    pub unseen: f64,
    /// Deviations of its velocity within which a joint may move either way; twice as many where that fades. Unit: count.
    /// Source: by hand.
    pub blind: f64,
    /// Part of its fastest speed below which a drive of a closed chain may stand. Unit: share. Source: by hand.
    pub stands: f64,
    /// Step in which the time is looked for by which a simulator's dry friction reverses before the velocity does. Unit: s.
    /// Source: by hand.
    pub step: f64,
    /// Least such time that counts. Unit: s. Source: by hand.
    pub shortest: f64,
    /// Longest such time. Unit: s. Source: three times what MuJoCo's default gives.
    pub longest: f64,
    /// Least such time that counts in a log that does not look like a simulator's. Unit: s. Source: MuJoCo's default gives
    /// 9.5 ms; of the recordings of three machines one settles at 4.8 ms (the EMPS), the others at 0.
    pub early: f64,
    /// Such a time of a simulator whose settings nobody has changed: tried where a delay is claimed, and behind fine encoders where
    /// one takes a part of a gap that is not explained. Unit: s. Source: MuJoCo's
    /// default `solref`.
    pub usual: f64,
    /// Deviations from which on such a time may be there, although it is not taken for found. Unit: count. Source: an arm in MuJoCo had 4.6.
    pub perhaps: f64,
    /// Gap over dry friction that reverses early, as deviations, below which (times the root of `gap.sound`) its shape about reversals is
    /// not known. Unit: share. Source: clean arms in MuJoCo left 0.04 at most.
    pub shape: f64,
    /// How far the torque of a joint may be ahead through its own friction, over that time. Unit: ratio. Source: arms in MuJoCo whose
    /// joints were said to be ahead had 0.16 and 0.35.
    pub of_one: f64,
    /// Part of the deceleration by dry friction alone by which a simulator's friction gives way, `(1 − d)/d`. Unit: share.
    /// Source: MuJoCo's default `solimp`, `d` = 0.9.
    pub soft: f64,
    /// How far the refitted dry friction may be from that of the robot file where it says how soft it is, over the latter.
    /// Unit: share. Source: by hand; friction of CAD files is some tenths off.
    pub trusted: f64,
    /// Change of such a time below which it is not looked for again. Unit: s. Source: by hand.
    pub settled: f64,
    /// Rounds in which it is looked for. Unit: count. Source: by hand.
    pub rounds: usize,
    /// Least such time over its deviation. Unit: standard deviations. Source: by hand.
    pub sure: f64,
    /// The same where three and more joints have each said their own. Unit: standard deviations. Source: by hand: arms in MuJoCo
    /// with encoders of 12 bits had 6.9 and 7.3 where a delay or hysteresis hid in one of six joints.
    pub agreed: f64,
    /// Most that friction may rise towards standstill, over the dry friction of the model. Unit: ratio. Source: by hand.
    pub breakaway: f64,
    /// Time by which velocities from positions are blurred. Unit: s. Source: by hand.
    pub blur: f64,
}

pub(super) const REVERSALS: Reversals = Reversals {
    sharp: 1e-3,
    rounded: [2e-3, 4e-3, 8e-3],
    rounding: 0.5,
    bent: 0.1,
    near: 0.012,
    unseen: 2.4,
    blind: 1.0,
    stands: 0.01,
    step: 0.004,
    shortest: 0.002,
    longest: 0.03,
    early: 0.006,
    usual: 0.0095,
    perhaps: 3.0,
    shape: 0.06,
    of_one: 0.5,
    soft: 1.0 / 9.0,
    trusted: 0.5,
    settled: 5e-4,
    rounds: 5,
    sure: 8.0,
    agreed: 5.0,
    breakaway: 4.0,
    blur: 0.015,
};

/// Standard deviations of the parameters a priori. Of two values the first is that of an identified model, the second that
/// of one from CAD.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Prior {
    /// Mass of a link, over its mass; identified, CAD. Unit: share. Source: by hand.
    pub mass: [f64; 2],
    /// First moment of a link, over its mass times its length; identified, CAD. Unit: share. Source: by hand.
    pub first: [f64; 2],
    /// Inertia tensor of a link, over its mass times its length squared; identified, CAD. Unit: share. Source: by hand.
    pub second: [f64; 2],
    /// Inertia of a rotor, over its value; identified, CAD. Unit: share. Source: by hand.
    pub armature: [f64; 2],
    /// Viscous friction, over its value; identified, CAD. Unit: share. Source: by hand.
    pub viscous: [f64; 2],
    /// Coulomb friction, over its value; identified, CAD. Unit: share. Source: by hand.
    pub coulomb: [f64; 2],
    /// Torque offset, over the friction (`at_speed`); identified, CAD. Unit: share. Source: by hand.
    pub offset: [f64; 2],
    /// Part of viscous friction at the largest speed that counts beside Coulomb friction there. Unit: share. Source: by hand.
    pub at_speed: f64,
    /// Least deviation of a torque offset, over that of the torque noise; identified, CAD. Unit: ratio. Source: by
    /// hand.
    pub offset_noise: [f64; 2],
    /// Least deviation of a joint term, over that of the torque noise. Unit: ratio. Source: by hand.
    pub noise: f64,
    /// Mass that a link counts with at least, over that of the heaviest. Unit: share. Source: by hand.
    pub lightest: f64,
    /// Mass that a link counts with at least. Unit: kg. Source: by hand.
    pub light: f64,
    /// Length that a link counts with at least. Unit: m. Source: by hand.
    pub short: f64,
}

pub(super) const PRIOR: Prior = Prior {
    mass: [0.015, 0.2],
    first: [0.006, 0.1],
    second: [0.008, 0.12],
    armature: [0.06, 0.3],
    viscous: [0.15, 0.4],
    coulomb: [0.06, 0.35],
    offset: [0.04, 0.2],
    at_speed: 0.3,
    offset_noise: [0.3, 1.0],
    noise: 0.02,
    lightest: 0.02,
    light: 1e-3,
    short: 0.03,
};

/// How close an identified model is to its robot.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Closeness {
    /// Factors on the deviations of the prior that are tried. Unit: ratio. Source: by hand.
    pub scales: [f64; 7],
    /// How far a factor may lie above the likeliest. Unit: −2 ln p. Source: 95 % point of χ² with one freedom.
    pub likely: f64,
    /// By how much the factors of moments and of tensors may differ: robots of few joints hardly distinguish
    /// them, and one must not be taken for exact because the other can stand for it. Unit: ratio. Source: by
    /// hand.
    pub apart: f64,
}

pub(super) const CLOSENESS: Closeness = Closeness {
    scales: [1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.125],
    likely: 3.84,
    apart: 3.0,
};

/// An unknown load.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Load {
    /// Deviation of its mass a priori, at least: wide enough to leave it free. Unit: kg. Source: by hand.
    pub lightest: f64,
    /// Lever of that mass in the deviations of first moments and, squared, of the tensor. Unit: m. Source: by hand.
    pub lever: f64,
    /// Mass below which a motion shows nothing of it. Unit: kg. Source: by hand.
    pub least: f64,
}

pub(super) const LOAD: Load = Load {
    lightest: 10.0,
    lever: 0.5,
    least: 1e-6,
};

/// The controller of the logs.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Controller {
    /// Natural frequency of the spring that takes its place where it is unknown. Unit: Hz. Source: by hand.
    pub bandwidth: f64,
    /// How many of its standard deviations a gain must be. Unit: ratio. Source: by hand.
    pub certain: f64,
    /// Most that the controller may leave of the torque, rms over rms. Unit: share. Source: by hand.
    pub left: f64,
    /// The same in standard deviations of the torque noise. Unit: ratio. Source: by hand.
    pub noise: f64,
    /// What an inverse-dynamics controller must leave less than one of single joints. Unit: ratio. Source: by
    /// hand.
    pub plain: f64,
    /// Velocity below which the sign of Coulomb friction is smoothed, over the fastest. Unit: share. Source:
    /// by hand.
    pub slow: f64,
}

pub(super) const CONTROLLER: Controller = Controller {
    bandwidth: 2.0,
    certain: 6.0,
    left: 0.1,
    noise: 3.0,
    plain: 1.02,
    slow: 0.02,
};
