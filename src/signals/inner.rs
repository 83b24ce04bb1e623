//! Inner products with a kernel: one, or four side by side, to the same bits on every machine.
//!
//! Each is made of eight partial sums `s_k = Σ_i w_{8i+k} x_{8i+k}`, so that wide instructions give what narrow ones give.

use crate::dynamics::lanes::{Isa, Lanes, Portable4};

/// Windows that [`Inner::four`] takes.
pub const AT_ONCE: usize = 4;
/// Partial sums of a product.
const SUMS: usize = 8;

/// Inner products with the widest instructions of this machine.
#[derive(Clone, Copy)]
pub struct Inner(Isa);

impl Inner {
    /// For this machine.
    pub fn new() -> Self {
        Inner(Isa::detect())
    }

    /// Inner product of a kernel and a window of its length.
    ///
    /// # Panics
    /// If the window is shorter.
    pub fn one(self, kernel: &[f64], x: &[f64]) -> f64 {
        let [y] = products::<Portable4, 1, 2>(kernel, [x]);
        y
    }

    /// Those of four windows: while one waits for its sum, the others go on.
    ///
    /// # Panics
    /// If a window is shorter than the kernel.
    pub fn four(self, kernel: &[f64], x: [&[f64]; AT_ONCE]) -> [f64; AT_ONCE] {
        match self.0 {
            Isa::Scalar | Isa::Portable => products::<Portable4, AT_ONCE, 2>(kernel, x),
            #[cfg(all(target_arch = "x86_64", feature = "wide"))]
            // SAFETY: the machine has AVX2
            Isa::Avx2 => unsafe { four_avx2(kernel, x) },
            #[cfg(all(target_arch = "x86_64", feature = "wide"))]
            // SAFETY: the machine has AVX-512
            Isa::Avx512 => unsafe { four_avx512(kernel, x) },
        }
    }
}

#[cfg(all(target_arch = "x86_64", feature = "wide"))]
#[target_feature(enable = "avx2")]
unsafe fn four_avx2(kernel: &[f64], x: [&[f64]; AT_ONCE]) -> [f64; AT_ONCE] {
    products::<crate::dynamics::lanes::Avx2, AT_ONCE, 2>(kernel, x)
}

#[cfg(all(target_arch = "x86_64", feature = "wide"))]
#[target_feature(enable = "avx512f,avx512dq")]
unsafe fn four_avx512(kernel: &[f64], x: [&[f64]; AT_ONCE]) -> [f64; AT_ONCE] {
    products::<crate::dynamics::lanes::Avx512, AT_ONCE, 1>(kernel, x)
}

/// Inner products of `N` windows with `P` packs of partial sums each; `P` packs are [`SUMS`] numbers.
#[inline(always)]
fn products<L: Lanes, const N: usize, const P: usize>(kernel: &[f64], x: [&[f64]; N]) -> [f64; N] {
    const { assert!(P * L::WIDTH == SUMS) };
    let length = kernel.len();
    let whole = length / SUMS * SUMS;
    // where a window is shorter, this panics
    let x = x.map(|x| &x[..length]);
    let mut sums = [[L::splat(0.0); N]; P];
    let mut at = 0;
    while at < whole {
        for (p, sums) in sums.iter_mut().enumerate() {
            let from = at + p * L::WIDTH;
            // SAFETY: `from + WIDTH` is at most `whole`, and the kernel is at least as long
            let w = unsafe { L::load(kernel.as_ptr().add(from)) };
            for (sum, x) in sums.iter_mut().zip(x) {
                // SAFETY: as for the kernel
                *sum = *sum + w * unsafe { L::load(x.as_ptr().add(from)) };
            }
        }
        at += SUMS;
    }
    let mut out = [0.0; N];
    for (n, (out, x)) in out.iter_mut().zip(x).enumerate() {
        let mut s = [0.0; SUMS];
        for (p, sums) in sums.iter().enumerate() {
            // SAFETY: `P` packs are `SUMS` numbers
            unsafe { sums[n].store(s.as_mut_ptr().add(p * L::WIDTH)) };
        }
        let rest = kernel[whole..].iter().zip(&x[whole..]);
        let rest: f64 = rest.map(|(x, y)| x * y).sum();
        *out = rest + ((s[0] + s[4]) + (s[1] + s[5])) + ((s[2] + s[6]) + (s[3] + s[7]));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::Inner;
    use crate::dynamics::lanes::Isa;

    #[test]
    fn four_side_by_side_are_four_alone_to_the_bit() {
        let x: Vec<f64> = (0..300).map(|i| (0.7 * i as f64).sin() / 3.0).collect();
        for length in [1, 7, 8, 9, 63, 64, 201] {
            let kernel: Vec<f64> = (0..length).map(|i| (1.3 * i as f64).cos() / 7.0).collect();
            let windows = [0, 3, 40, 99].map(|at| &x[at..at + length]);
            let alone = windows.map(|w| Inner::new().one(&kernel, w));
            for isa in Isa::available() {
                let four = Inner(isa).four(&kernel, windows);
                assert_eq!(four.map(f64::to_bits), alone.map(f64::to_bits), "{isa:?}");
            }
            let plain = windows.map(|w| kernel.iter().zip(w).map(|(a, b)| a * b).sum::<f64>());
            for (a, b) in alone.iter().zip(plain) {
                assert!((a - b).abs() < 1e-13, "{a} {b}");
            }
        }
    }
}
