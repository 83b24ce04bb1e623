//! The memory of one thread, for the instruction set that it runs with.

use super::kernel::Scratch;
#[cfg(all(target_arch = "x86_64", feature = "wide"))]
use super::lanes;
use super::lanes::{Isa, Portable4};

/// Memory of one thread. Grows at first use and is then reused.
#[derive(Clone)]
pub struct Workspace {
    pub(super) isa: Isa,
    pub(super) one: Scratch<f64>,
    pub(super) portable: Scratch<Portable4>,
    #[cfg(all(target_arch = "x86_64", feature = "wide"))]
    pub(super) avx2: Scratch<lanes::Avx2>,
    #[cfg(all(target_arch = "x86_64", feature = "wide"))]
    pub(super) avx512: Scratch<lanes::Avx512>,
}

impl Default for Workspace {
    fn default() -> Self {
        Self::with_isa(Isa::detect())
    }
}

impl Workspace {
    /// The instruction set that it runs with.
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// A workspace for a given instruction set (for tests and benchmarks).
    ///
    /// # Panics
    /// If this machine does not have it.
    pub fn with_isa(isa: Isa) -> Self {
        assert!(
            Isa::available().contains(&isa),
            "{isa:?} is not available on this machine"
        );
        Workspace {
            isa,
            one: Scratch::default(),
            portable: Scratch::default(),
            #[cfg(all(target_arch = "x86_64", feature = "wide"))]
            avx2: Scratch::default(),
            #[cfg(all(target_arch = "x86_64", feature = "wide"))]
            avx512: Scratch::default(),
        }
    }
}
