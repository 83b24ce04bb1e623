//! What is done otherwise on a closed chain, each with its reason. Nothing else here asks for the kind of robot, but for the
//! effects that only one kind has ([`Effect::robots`](super::catalogue::Effect::robots)), and these ask here.

use super::data::Data;
use super::thresholds::THRESHOLDS as T;
use crate::plant::Plant;

impl Data<'_> {
    /// Whether drives may stand at a reversal while others move on: rows near it have no weight then, and what lies in
    /// them is not looked at. The joints of a tree pass through zero at once.
    pub fn sticks(&self) -> bool {
        closed(self.plant)
    }

    /// Whether a body anywhere may stand for the parameters of another, since one platform carries them all: rivals are then
    /// also weighed by what they leave of the residual.
    pub fn shared(&self) -> bool {
        closed(self.plant)
    }

    /// Variance that periods differ by beyond the noise, of this one in units of the noise: the excess of a tree's noise
    /// holds it already.
    pub fn differing(&self, variance: f64) -> f64 {
        match closed(self.plant) {
            true => (variance - 1.0).max(0.0),
            false => 0.0,
        }
    }

    /// Whether the encoder of actuator `j` is coarse: in a record that does not repeat or, of trees, in every record.
    pub fn coarse(&self, j: usize) -> bool {
        let every = || self.records.iter().all(|r| r.coarse.get(j) == Some(&true));
        self.filtered(j) || !closed(self.plant) && every()
    }

    /// Whether the gap of an actuator is counted on whitened rows: behind a coarse encoder of a tree. Of closed chains the rows that count
    /// least have no weight at all.
    pub fn counts_whitened(&self, j: usize) -> bool {
        !closed(self.plant) && self.coarse(j)
    }

    /// Whether the lead of a simulator's friction is looked for: it was seen on joints of trees alone.
    pub fn may_lead(&self) -> bool {
        !closed(self.plant)
    }
}

/// Whether friction that a robot file does not state is fitted first: of trees, whose joints all have a motor. The file of a closed chain
/// says which of its joints have any.
pub fn may_lack_friction(plant: &Plant) -> bool {
    !closed(plant)
}

/// Whether the links of legs have common axes, so that parameters of one stand for those of all: not of general closed
/// chains.
pub fn legs_alike(plant: &Plant) -> bool {
    !plant.looped()
}

/// How many harmonics the designs of the next motion have; `None`: no designs, since following loops in every step of the
/// optimiser takes minutes.
pub fn harmonics(plant: &Plant) -> Option<usize> {
    let each = T.motions.harmonics[usize::from(closed(plant))];
    legs_alike(plant).then_some(each)
}

pub(super) fn closed(plant: &Plant) -> bool {
    plant.closed()
}
