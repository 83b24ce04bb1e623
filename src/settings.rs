//! Settings that can gain fields without breaking those who use them: made by `default()`, changed by `with`.

/// Gives `with` to settings, which other crates cannot write as a literal (`#[non_exhaustive]`).
macro_rules! changeable {
    ($($settings:ty),+) => {
        $(impl $settings {
            /// These settings after `change`, as in `Settings::default().with(|set| set.seed = 7)`.
            #[must_use]
            pub fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
                change(&mut self);
                self
            }
        })+
    };
}
pub(crate) use changeable;
