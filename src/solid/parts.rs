//! A mesh in parts, split one at a time where that saves most.

/// What a split saves, and its halves.
pub(super) type Split<P> = (f64, [P; 2]);

/// The parts, and the best way to split each: found once, and only where it is needed.
pub(super) struct Parts<P> {
    pub(super) all: Vec<P>,
    ways: Vec<Option<Split<P>>>,
}

impl<P> Parts<P> {
    /// One part.
    pub(super) fn new(whole: P) -> Self {
        Parts {
            all: vec![whole],
            ways: Vec::new(),
        }
    }

    /// Splits the part whose split saves most, the first of equals, and says what it saves; `None` where no part can be
    /// split.
    pub(super) fn split(&mut self, way: impl Fn(&P) -> Option<Split<P>>) -> Option<f64> {
        self.ways
            .extend(self.all[self.ways.len()..].iter().map(way));
        let saving = |i: &usize| self.ways[*i].as_ref().map_or(f64::NEG_INFINITY, |w| w.0);
        let most = |a: &usize, b: &usize| saving(a).total_cmp(&saving(b));
        let i = (0..self.all.len()).rev().max_by(most)?;
        let (saved, halves) = self.ways.remove(i)?;
        self.all.remove(i);
        self.all.extend(halves);
        Some(saved)
    }
}
