//! What is done otherwise on a closed chain, each with its reason. Nothing else here asks for the kind of robot, but for the
//! effects that only one kind has ([`Effect::robots`](super::catalogue::Effect::robots)).

use super::data::Data;

impl Data<'_> {
    /// Whether drives may stand at a reversal while others move on: rows near it have no weight then, and what lies in
    /// them is not looked at. The joints of a tree pass through zero at once.
    pub fn sticks(&self) -> bool {
        closed(self)
    }

    /// Whether a body anywhere may stand for the parameters of another, since one platform carries them all: rivals are then
    /// also weighed by what they leave of the residual.
    pub fn shared(&self) -> bool {
        closed(self)
    }

    /// Variance that periods differ by beyond the noise, of this one in units of the noise: the excess of a tree's noise
    /// holds it already.
    pub fn differing(&self, variance: f64) -> f64 {
        match closed(self) {
            true => (variance - 1.0).max(0.0),
            false => 0.0,
        }
    }

    /// Whether the lead of a simulator's friction is looked for: it was seen on joints of trees alone.
    pub fn may_lead(&self) -> bool {
        !closed(self)
    }
}

fn closed(data: &Data) -> bool {
    data.plant.closed()
}
