//! What a diagnosis is asked for.

/// What a diagnosis is asked for.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Settings {
    /// whether to design the next experiment where effects are not told apart
    pub next: bool,
    /// random steps by which that design is improved
    pub next_tries: usize,
    /// robots to draw from what the records do not exclude, none unless asked for
    pub samples: usize,
    /// seed of random starts and of these draws
    pub seed: u64,
}

crate::settings::changeable!(Settings);

impl Default for Settings {
    fn default() -> Self {
        Settings {
            next: true,
            next_tries: 64,
            samples: 0,
            seed: 1,
        }
    }
}
