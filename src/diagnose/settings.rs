//! What a diagnosis is asked for.

/// What a diagnosis is asked for.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Settings {
    /// whether to design the next experiment where effects are not told apart
    pub next: bool,
    /// random steps by which that design is improved
    pub next_tries: usize,
    /// seed of random starts
    pub seed: u64,
}

crate::settings::changeable!(Settings);

impl Default for Settings {
    fn default() -> Self {
        Settings {
            next: true,
            next_tries: 64,
            seed: 1,
        }
    }
}
