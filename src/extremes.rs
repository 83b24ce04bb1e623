//! Smallest and largest values, many at a time.

/// Smallest and largest of the finite values; `[inf, -inf]` where there is none.
pub(crate) fn extremes(y: &[f64]) -> [f64; 2] {
    let all = ends(y);
    let infinite = all[0] == f64::NEG_INFINITY || all[1] == f64::INFINITY;
    match infinite {
        false => all,
        true => {
            let finite = y.iter().filter(|x| x.is_finite());
            finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| {
                [a.min(*x), b.max(*x)]
            })
        }
    }
}

/// Smallest and largest of all values but NaN.
fn ends(y: &[f64]) -> [f64; 2] {
    /// Values that are compared side by side.
    const WIDE: usize = 8;
    let (mut low, mut high) = ([f64::INFINITY; WIDE], [f64::NEG_INFINITY; WIDE]);
    let mut chunks = y.chunks_exact(WIDE);
    // one instruction each; comparisons with NaN are false
    let mut take = |k: usize, x: f64| {
        low[k] = if x < low[k] { x } else { low[k] };
        high[k] = if x > high[k] { x } else { high[k] };
    };
    for chunk in &mut chunks {
        (0..WIDE).for_each(|k| take(k, chunk[k]));
    }
    chunks.remainder().iter().for_each(|x| take(0, *x));
    [
        low.into_iter().fold(f64::INFINITY, f64::min),
        high.into_iter().fold(f64::NEG_INFINITY, f64::max),
    ]
}

/// Whether all values are finite.
pub(crate) fn all_finite(y: &[f64]) -> bool {
    const EXPONENT: u64 = 0x7FF0_0000_0000_0000;
    let others = |y: &[f64]| -> u64 {
        let other = |x: &f64| u64::from(x.to_bits() & EXPONENT == EXPONENT);
        y.iter().map(other).sum()
    };
    y.chunks(1 << 12).all(|y| others(y) == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_channel_is_finite_where_all_its_values_are() {
        let mut y: Vec<f64> = (0..9000).map(|i| (1.7 * i as f64).sin() * 1e300).collect();
        assert!(all_finite(&y) && all_finite(&[]));
        for (at, value) in [(0, f64::NAN), (4096, f64::INFINITY), (8999, -f64::INFINITY)] {
            let before = std::mem::replace(&mut y[at], value);
            assert!(!all_finite(&y), "{at}");
            y[at] = before;
        }
    }

    #[test]
    fn extremes_are_those_of_the_finite_values() {
        let mut y: Vec<f64> = (0..29).map(|i| (1.7 * i as f64).sin()).collect();
        let naive = |y: &[f64]| {
            let finite = || y.iter().copied().filter(|x| x.is_finite());
            [
                finite().fold(f64::INFINITY, f64::min),
                finite().fold(f64::NEG_INFINITY, f64::max),
            ]
        };
        for (at, value) in [
            (3, f64::NAN),
            (28, f64::INFINITY),
            (9, f64::NEG_INFINITY),
            (17, 9.0),
        ] {
            y[at] = value;
            assert_eq!(extremes(&y), naive(&y));
        }
        assert_eq!(extremes(&[f64::NAN; 3]), [f64::INFINITY, f64::NEG_INFINITY]);
    }
}
