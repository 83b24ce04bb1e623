//! Loops over packs of samples, for the instruction set at hand.

#[cfg(all(target_arch = "x86_64", feature = "wide"))]
use crate::dynamics::lanes;
use crate::dynamics::lanes::{Isa, Lanes, Portable4};

/// A loop body over packs of samples.
pub(crate) trait Pass {
    /// # Safety
    /// `s .. s + L::WIDTH` must be samples of the batch.
    unsafe fn pack<L: Lanes>(&self, s: usize);
}

#[inline(always)]
unsafe fn sweep<L: Lanes, P: Pass>(pass: &P, from: usize, to: usize) -> usize {
    let mut s = from;
    while s + L::WIDTH <= to {
        // SAFETY: s .. s + WIDTH lies in from .. to
        unsafe { pass.pack::<L>(s) };
        s += L::WIDTH;
    }
    s
}

#[cfg(all(target_arch = "x86_64", feature = "wide"))]
#[target_feature(enable = "avx2")]
unsafe fn sweep_avx2<P: Pass>(pass: &P, from: usize, to: usize) -> usize {
    // SAFETY: the caller made sure of AVX2
    unsafe { sweep::<lanes::Avx2, P>(pass, from, to) }
}

#[cfg(all(target_arch = "x86_64", feature = "wide"))]
#[target_feature(enable = "avx512f,avx512dq")]
unsafe fn sweep_avx512<P: Pass>(pass: &P, from: usize, to: usize) -> usize {
    // SAFETY: the caller made sure of AVX-512
    unsafe { sweep::<lanes::Avx512, P>(pass, from, to) }
}

/// Runs a pass over `count` samples with the widest packs of `isa`.
///
/// # Safety
/// All of them must be samples of the pass.
///
/// # Panics
/// If the machine does not have these instructions.
pub(crate) unsafe fn run<P: Pass>(isa: Isa, pass: &P, count: usize) {
    assert!(isa.is_available(), "{isa:?} is not available");
    // SAFETY: the machine has the instructions
    unsafe {
        let done = match isa {
            Isa::Scalar => 0,
            Isa::Portable => sweep::<Portable4, P>(pass, 0, count),
            #[cfg(all(target_arch = "x86_64", feature = "wide"))]
            Isa::Avx2 => sweep_avx2(pass, 0, count),
            #[cfg(all(target_arch = "x86_64", feature = "wide"))]
            Isa::Avx512 => {
                let done = sweep_avx512(pass, 0, count);
                done + if count - done >= 4 {
                    sweep_avx2(pass, done, count) - done
                } else {
                    0
                }
            }
        };
        sweep::<f64, P>(pass, done, count);
    }
}
