//! What a column means, and how sure that is.

use crate::log::names;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Means {
    /// measured position
    Position,
    /// measured velocity
    Velocity,
    /// measured acceleration
    Acceleration,
    /// torque or force
    Torque,
    /// current of a motor
    Current,
    /// commanded position
    Command,
    /// time
    Time,
    /// not claimed
    Other,
}

/// A claim about a column: `sign · scale · value` is in SI units on the side of the joint.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Claim {
    /// name of the column, or its number from 1
    pub column: String,
    /// what it holds
    pub means: Means,
    /// number of the joint in the list of joints
    #[serde(skip)]
    pub at: Option<usize>,
    /// the column of positions whose derivative or command it is
    #[serde(skip)]
    pub of: Option<usize>,
    /// whether its name is that of something else than a joint has, or of a command that is no position
    #[serde(skip)]
    pub of_no_joint: bool,
    /// whether its name says what it is
    #[serde(skip)]
    pub named: bool,
    /// whether the gain of a current is the middle of those of other joints
    #[serde(skip)]
    pub gain_of_others: bool,
    /// name of the joint
    pub joint: Option<String>,
    /// 1 or -1
    pub sign: f64,
    /// whether the sign is told; otherwise all columns of the joint may be turned together
    pub sign_known: bool,
    /// positive factor
    pub scale: f64,
    /// unit that the factor comes from
    pub unit: Option<&'static str>,
    /// how much later than the positions of its row it was measured, s
    pub delay: f64,
    /// which side of the gear it was measured on
    pub side: Option<&'static str>,
    /// what a command commands: `position`, or `torque` (also a current)
    pub commands: Option<&'static str>,
    /// what has been taken off a torque
    pub without: Vec<&'static str>,
    /// probability that all of this is right
    pub confidence: f64,
    /// why, in words
    pub evidence: String,
}

impl Claim {
    /// A column of which nothing is known.
    pub fn none(column: &str) -> Self {
        Claim {
            column: column.into(),
            means: Means::Other,
            at: None,
            of: None,
            of_no_joint: names::of_no_joint(column),
            named: false,
            gain_of_others: false,
            joint: None,
            sign: 1.0,
            sign_known: true,
            scale: 1.0,
            unit: None,
            delay: 0.0,
            side: None,
            commands: None,
            without: Vec::new(),
            confidence: 0.0,
            evidence: String::new(),
        }
    }

    /// What makes a value one of the joint in SI units.
    pub fn factor(&self) -> f64 {
        self.sign * self.scale
    }

    /// Whether nothing is claimed yet, and its numbers may tell what it is.
    pub(super) fn free(&self) -> bool {
        self.means == Means::Other && !self.of_no_joint
    }

    /// Takes the claim back: what was said before is only evidence.
    pub fn abstain(&mut self, why: &str) {
        *self = Claim {
            evidence: why.into(),
            ..Claim::none(&self.column.clone())
        };
    }
}
