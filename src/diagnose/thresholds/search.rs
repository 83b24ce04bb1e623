//! How far the search goes.

/// How far the search goes.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Search {
    /// Effects that a set may have. Unit: count. Source: by hand.
    pub members: usize,
    /// Candidates that have their turn in a forward step. Unit: count. Source: by hand.
    pub tried: usize,
    /// Challengers that are refined in a forward step. Unit: count. Source: by hand.
    pub forward: usize,
    /// The same when members are exchanged. Unit: count. Source: by hand.
    pub exchange: usize,
    /// The same when members are judged. Unit: count. Source: by hand.
    pub judged: usize,
    /// Places of an effect among the challengers. Unit: count. Source: by hand.
    pub places: usize,
    /// Places of an effect in the search of pairs. Unit: count. Source: by hand.
    pub pair_places: usize,
    /// Candidates in the search of pairs. Unit: count. Source: by hand.
    pub pairs: usize,
    /// What a pair must gain more than the set, of the whole gap. Unit: share. Source: by hand.
    pub pair_margin: f64,
    /// What a challenger must gain to replace a member, over what that one gains. Unit: ratio. Source: by hand.
    pub exchange_margin: f64,
    /// Gain over that of the best effect, from which on one that no machine can have is worth a word. Unit: share. Source:
    /// by hand.
    pub worth_a_word: f64,
    /// How many of those. Unit: count. Source: by hand.
    pub words: usize,
    /// Rounds of exchange. Unit: count. Source: by hand.
    pub rounds: usize,
    /// Speeds at which the friction of a joint must brake, over its largest. Unit: share. Source: by hand.
    pub brakes: [f64; 4],
    /// How much it may drive there, over what it brakes with at the largest speed. Unit: share. Source: a real UR10, whose shoulder
    /// was given nonlinear friction beside Coulomb friction of −32 to −42 N m, had 0.7 to 1.4.
    pub drives: f64,
}

pub(super) const SEARCH: Search = Search {
    members: 4,
    tried: 5,
    forward: 10,
    exchange: 6,
    judged: 14,
    places: 2,
    pair_places: 3,
    pairs: 22,
    pair_margin: 0.01,
    exchange_margin: 1.01,
    worth_a_word: 0.1,
    words: 8,
    rounds: 2,
    brakes: [0.0, 0.1, 0.3, 1.0],
    drives: 0.1,
};

/// How shapes are refined between the points of their grids.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Shapes {
    /// Gain from which on a shape is refined. Unit: noise variances. Source: by hand.
    pub refined: f64,
    /// Gain over that of the best candidate from which on a shape is refined. Unit: share. Source: by hand.
    pub near: f64,
    /// Gain over that of the best candidate from which on a second search of the same records looks at a whole grid again. Unit: share.
    /// Source: by hand.
    pub anew: f64,
    /// Factors of the steps. Unit: ratio. Source: by hand.
    pub steps: [f64; 3],
    /// How far below the grid a shape may lie. Unit: ratio. Source: by hand.
    pub below: f64,
    /// How far above the grid a shape may lie. Unit: ratio. Source: by hand.
    pub above: f64,
    /// Gain over the best so far that makes a step worth while. Unit: ratio. Source: by hand.
    pub better: f64,
}

pub(super) const SHAPES: Shapes = Shapes {
    refined: 20.0,
    near: 0.3,
    anew: 0.1,
    steps: [1.3, 1.12, 1.05],
    below: 1.5,
    above: 1.2,
    better: 1.0005,
};

/// How the model settles on an effect that moves the links.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Settle {
    /// Gain over that of the best effect, from which on the model is fitted beside an effect that moves the links. Unit: share.
    /// Source: by hand.
    pub near: f64,
    /// How many of those. Unit: count. Source: by hand.
    pub tried: usize,
    /// Rounds of each. Unit: count. Source: by hand.
    pub rounds: usize,
    /// Change of the gain from round to round below which it has settled. Unit: share. Source: by hand.
    pub still: f64,
    /// Gain that must be left of that of the best effect when it has. Unit: share. Source: by hand.
    pub least: f64,
    /// Gain from which on the shape is refined with the whole column. Unit: noise variances. Source: by hand.
    pub whole: f64,
    /// Factors of the steps of that. Unit: ratio. Source: by hand.
    pub steps: [f64; 2],
    /// Steps in one direction. Unit: count. Source: by hand.
    pub most: usize,
}

pub(super) const SETTLE: Settle = Settle {
    near: 0.4,
    tried: 3,
    rounds: 12,
    still: 0.0005,
    least: 0.8,
    whole: 500.0,
    steps: [1.05, 1.02],
    most: 6,
};
