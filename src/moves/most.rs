//! The limit that is used most.

/// Share of a limit that counts as kept.
const KEPT: f64 = 1.0 + 1e-6;

/// The limit that is used most.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Most {
    /// share; 1 at the limit
    pub used: f64,
    /// what it is about
    pub what: String,
}

impl Most {
    /// Takes another share into account, and what it is about.
    pub fn offer(&mut self, used: f64, what: impl FnOnce() -> String) {
        // what is not a number is beyond every limit
        if used > self.used || used.is_nan() {
            self.used = if used.is_nan() { f64::INFINITY } else { used };
            self.what = what();
        }
    }

    /// Whether the limit holds.
    pub fn kept(&self) -> bool {
        self.used <= KEPT
    }
}
