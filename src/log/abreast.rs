//! Rows of plain numbers of two texts at the same time: while one waits for where its number ends, the other goes on.
//!
//! With AVX2 a cell is looked at as a whole: where it ends, whether it is digits with one point among them, and the number that
//! they make (pairs of digits, pairs of pairs, and so on, as in [`number`]). The numbers are the same to the bit.

use super::number;

/// Rows that there is room for at first.
const FEW: usize = 64;

/// Reads rows of plain numbers from the beginning of two texts, a number a column, into columns that are empty, up to the first
/// line of either that is something else. Returns where it stopped in each, and the number of rows.
pub(super) fn rows(
    texts: [&[u8]; 2],
    delimiter: u8,
    columns: [&mut [Vec<f64>]; 2],
) -> ([usize; 2], usize) {
    #[cfg(all(target_arch = "x86_64", feature = "wide"))]
    if wide::there_is() {
        // SAFETY: the machine has what it asks for
        return unsafe { wide::rows(texts, delimiter, columns) };
    }
    // SAFETY: it asks for nothing
    unsafe { rows_by::<Narrow>(texts, delimiter, columns) }
}

/// A way to read a number of each of two texts.
trait Numbers {
    /// The numbers that start at these places, and where their cells end, as [`number::plain`]. `brief` is of the column, and
    /// true at first.
    ///
    /// # Safety
    /// The machine must have the instructions that are used.
    unsafe fn two(
        texts: [&[u8]; 2],
        at: [usize; 2],
        delimiter: u8,
        brief: &mut [bool; 2],
    ) -> Option<[(f64, usize); 2]>;
}

/// With what every machine has.
struct Narrow;

impl Numbers for Narrow {
    #[inline(always)]
    unsafe fn two(
        texts: [&[u8]; 2],
        at: [usize; 2],
        delimiter: u8,
        brief: &mut [bool; 2],
    ) -> Option<[(f64, usize); 2]> {
        let a = number::plain(texts[0], at[0], delimiter, &mut brief[0]);
        let b = number::plain(texts[1], at[1], delimiter, &mut brief[1]);
        Some([a?, b?])
    }
}

/// [`rows`] in one of the ways.
///
/// # Safety
/// As [`Numbers::two`].
#[inline(always)]
unsafe fn rows_by<N: Numbers>(
    texts: [&[u8]; 2],
    delimiter: u8,
    [x, y]: [&mut [Vec<f64>]; 2],
) -> ([usize; 2], usize) {
    let n = x.len();
    let mut brief = vec![[true; 2]; n];
    let (mut at, mut done) = ([0; 2], 0);
    let mut room = x.iter().map(Vec::capacity).min().unwrap_or(0).max(FEW);
    if n == 0 {
        return (at, done);
    }
    'rows: loop {
        (x.iter_mut().chain(&mut *y)).for_each(|column| column.resize(room, 0.0));
        let mut to: Vec<[&mut [f64]; 2]> = (x.iter_mut().zip(&mut *y))
            .map(|(x, y)| [x.as_mut_slice(), y.as_mut_slice()])
            .collect();
        while done < room {
            let mut next = at;
            for (k, (to, brief)) in to.iter_mut().zip(&mut brief).enumerate() {
                // SAFETY: by the caller's promise
                let found = unsafe { N::two(texts, next, delimiter, brief) };
                let Some([(u, a), (v, b)]) = found else {
                    break 'rows;
                };
                let last = k + 1 == n;
                if (texts[0][a] == b'\n') != last || (texts[1][b] == b'\n') != last {
                    break 'rows;
                }
                (to[0][done], to[1][done]) = (u, v);
                next = [a + 1, b + 1];
            }
            at = next;
            done += 1;
        }
        room += room / 2;
    }
    (x.iter_mut().chain(y)).for_each(|column| column.truncate(done));
    (at, done)
}

#[cfg(all(target_arch = "x86_64", feature = "wide"))]
mod wide {
    use super::{Narrow, Numbers, number, rows_by};
    use std::arch::x86_64::*;

    /// Bytes of a cell without its sign, at most.
    const CELL: usize = 16;
    /// Bytes in which a cell must end.
    const AHEAD: usize = 32;

    /// Sixteen zeros and sixteen times 0xFF: from `length` on, a mask that keeps the last `length` of sixteen bytes.
    static LAST: [u8; 2 * CELL] = {
        let mut all = [0; 2 * CELL];
        let mut k = CELL;
        while k < 2 * CELL {
            all[k] = 0xFF;
            k += 1;
        }
        all
    };

    /// Where each of sixteen digits comes from if a point stands before the last so many: bytes before it move by one.
    static JOINED: [[u8; CELL]; CELL] = {
        let mut all = [[0x80; CELL]; CELL];
        let mut point = 0;
        while point < CELL {
            let mut k = 1;
            while k < CELL {
                all[point][k] = if k >= CELL - point { k } else { k - 1 } as u8;
                k += 1;
            }
            point += 1;
        }
        all
    };

    /// Whether the machine has what [`rows`] asks for.
    pub fn there_is() -> bool {
        is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
    }

    /// [`super::rows`].
    ///
    /// # Safety
    /// The machine must have AVX2 and both sets of bit manipulation: [`there_is`].
    #[target_feature(enable = "avx2,bmi1,bmi2")]
    pub unsafe fn rows(
        texts: [&[u8]; 2],
        delimiter: u8,
        columns: [&mut [Vec<f64>]; 2],
    ) -> ([usize; 2], usize) {
        // SAFETY: by the caller's promise
        unsafe { rows_by::<Wide>(texts, delimiter, columns) }
    }

    /// With AVX2.
    struct Wide;

    impl Numbers for Wide {
        #[inline(always)]
        unsafe fn two(
            texts: [&[u8]; 2],
            at: [usize; 2],
            delimiter: u8,
            brief: &mut [bool; 2],
        ) -> Option<[(f64, usize); 2]> {
            if brief[0] {
                // SAFETY: by the caller's promise
                let cells = unsafe {
                    [
                        Cell::at(texts[0], at[0], delimiter),
                        Cell::at(texts[1], at[1], delimiter),
                    ]
                };
                if let [Some(a), Some(b)] = cells {
                    // SAFETY: by the caller's promise
                    return Some(unsafe { numbers(&a, &b) });
                }
                // a column of other numbers, but for the beginning of a text
                brief[0] = at[0].min(at[1]) < CELL;
            }
            // SAFETY: it asks for nothing
            unsafe { Narrow::two(texts, at, delimiter, &mut [false; 2]) }
        }
    }

    /// A cell of digits with a point among them.
    struct Cell {
        /// its digits, in the last bytes of sixteen
        digits: __m128i,
        negative: bool,
        /// digits behind the point
        point: usize,
        end: usize,
    }

    impl Cell {
        /// The one that starts at a place, if it is digits with one point and there are no more than fifteen; none at the very
        /// beginning and the end of a text, where sixteen bytes before its end and 32 from its beginning are not all there.
        ///
        /// # Safety
        /// The machine must have AVX2.
        #[inline(always)]
        unsafe fn at(text: &[u8], at: usize, delimiter: u8) -> Option<Cell> {
            if at < CELL || at + AHEAD > text.len() {
                return None;
            }
            // SAFETY: 32 bytes are there
            let ahead = unsafe { _mm256_loadu_si256(text.as_ptr().add(at).cast()) };
            let negative = text[at] == b'-';
            // SAFETY: by the caller's promise
            let ends = unsafe {
                _mm256_movemask_epi8(_mm256_or_si256(
                    _mm256_cmpeq_epi8(ahead, _mm256_set1_epi8(delimiter as i8)),
                    _mm256_cmpeq_epi8(ahead, _mm256_set1_epi8(b'\n' as i8)),
                ))
            };
            let size = ends.trailing_zeros() as usize;
            let length = size.wrapping_sub(usize::from(negative));
            // a digit and a point at least
            if !(2..=CELL).contains(&length) {
                return None;
            }
            let end = at + size;
            // SAFETY: the end is beyond the sixteenth byte and within the text, and `length` is at most 16
            let digits = unsafe {
                _mm_and_si128(
                    _mm_xor_si128(
                        _mm_loadu_si128(text.as_ptr().add(end - CELL).cast()),
                        _mm_set1_epi8(b'0' as i8),
                    ),
                    _mm_loadu_si128(LAST.as_ptr().add(length).cast()),
                )
            };
            // SAFETY: by the caller's promise
            let [others, points] = unsafe {
                [
                    _mm_cmpeq_epi8(_mm_max_epu8(digits, _mm_set1_epi8(10)), digits),
                    _mm_cmpeq_epi8(digits, _mm_set1_epi8((b'.' ^ b'0') as i8)),
                ]
                .map(|m| _mm_movemask_epi8(m) as u32)
            };
            if others != points || !others.is_power_of_two() {
                return None;
            }
            let point = CELL - 1 - others.trailing_zeros() as usize;
            // SAFETY: by the caller's promise
            let digits =
                unsafe { _mm_shuffle_epi8(digits, _mm_loadu_si128(JOINED[point].as_ptr().cast())) };
            Some(Cell {
                digits,
                negative,
                point,
                end,
            })
        }
    }

    /// The numbers of two cells, and where these end.
    ///
    /// # Safety
    /// The machine must have AVX2.
    #[inline(always)]
    unsafe fn numbers(a: &Cell, b: &Cell) -> [(f64, usize); 2] {
        // SAFETY: by the caller's promise
        let whole = unsafe {
            let pairs = _mm256_maddubs_epi16(
                _mm256_set_m128i(b.digits, a.digits),
                _mm256_set1_epi16(0x010A),
            );
            let fours = _mm256_madd_epi16(pairs, _mm256_set1_epi32(0x0001_0064));
            let fours = _mm256_packus_epi32(fours, fours);
            let eights = _mm256_madd_epi16(fours, _mm256_set1_epi32(0x0001_2710));
            let high = _mm256_mul_epu32(eights, _mm256_set1_epi64x(100_000_000));
            let all = _mm256_add_epi64(high, _mm256_srli_epi64(eights, 32));
            [_mm256_extract_epi64(all, 0), _mm256_extract_epi64(all, 2)]
        };
        [(a, whole[0]), (b, whole[1])].map(|(cell, whole)| {
            let x = number::quotient_of_few(whole as u64, cell.point);
            let sign = u64::from(cell.negative) << 63;
            (f64::from_bits(x.to_bits() | sign), cell.end)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A text of so many rows of five cells, of kinds that are mostly plain, and what each is.
    fn text(rng: &mut ChaCha8Rng, lines: usize) -> (String, Vec<Vec<f64>>) {
        let (mut out, mut all) = (String::new(), Vec::new());
        for _ in 0..lines {
            let cells: Vec<String> = (0..5)
                .map(|k| {
                    let x = rng.random_range(-1.0..1.0) * 10f64.powi(rng.random_range(-4..8));
                    match (k, rng.random_range(0..40)) {
                        (0, _) => format!("{:.3}", x.abs()),
                        (_, 0) => format!("{}", x as f32),
                        (_, 1) => format!("{}", x as i64),
                        (_, 2) => format!("{x:.0}."),
                        (_, 3) => format!("{x:.10}"),
                        (3, _) => format!("{:.6}", x).replacen("0.", ".", 1),
                        _ => format!("{x:.6}"),
                    }
                })
                .collect();
            all.push(cells.iter().map(|c| c.parse().unwrap()).collect());
            out += &cells.join(",");
            out += "\n";
        }
        (out, all)
    }

    type Way = fn([&[u8]; 2], u8, [&mut [Vec<f64>]; 2]) -> ([usize; 2], usize);

    fn ways() -> [Way; 2] {
        // SAFETY: the narrow way asks for nothing, and the other one is chosen where it can be
        [
            |t, d, c| unsafe { rows_by::<Narrow>(t, d, c) },
            |t, d, c| rows(t, d, c),
        ]
    }

    #[test]
    fn rows_of_two_texts_are_those_of_their_cells() {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        for case in 0..200 {
            let lines = [1, 3, 70, 500][case % 4];
            let (a, all) = text(&mut rng, lines);
            let (b, others) = text(&mut rng, lines);
            for way in ways() {
                let [mut x, mut y] = [(); 2].map(|()| vec![Vec::new(); 5]);
                let texts = [a.as_bytes(), b.as_bytes()];
                let (at, rows) = way(texts, b',', [&mut x, &mut y]);
                assert_eq!((rows, at), (lines, [a.len(), b.len()]), "{case}");
                for (columns, all) in [(&x, &all), (&y, &others)] {
                    for (r, row) in all.iter().enumerate() {
                        let bits = |v: f64| v.to_bits();
                        let ours: Vec<u64> = columns.iter().map(|c| bits(c[r])).collect();
                        let theirs: Vec<u64> = row.iter().map(|v| bits(*v)).collect();
                        assert_eq!(ours, theirs, "{case}, row {r}");
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_no_row_of_plain_numbers_stops_both() {
        let plain = "1.5,-2.25,3.125\n".repeat(9);
        for bad in [
            "1.5,nan,3.125\n",
            "1.5,-2.25\n",
            "1.5,-2.25,3.125,4.0\n",
            "1.5,--2.25,3.125\n",
            "1.5,-2.2.5,3.125\n",
            "1.5,-,3.125\n",
            "1.5,.,3.125\n",
            "1.5,-.,3.125\n",
            "1.5,+2.25,3.125\n",
            "1.5,2.25e3,3.125\n",
            "1.5,2.25,3.125\r\n",
            "1.5, 2.25,3.125\n",
            "1.5,12345678901234567890.5,3.125\n",
            "# 1.5,2.25,3.125\n",
            "\n",
        ] {
            for (k, way) in ways().into_iter().enumerate() {
                let text = format!("{}{bad}{}", plain.repeat(2), plain.repeat(3));
                let good = plain.repeat(6);
                for texts in [[&text, &good], [&good, &text]] {
                    let [mut x, mut y] = [(); 2].map(|()| vec![Vec::new(); 3]);
                    let bytes = texts.map(|t| t.as_bytes());
                    let (at, rows) = way(bytes, b',', [&mut x, &mut y]);
                    assert_eq!((rows, at), (18, [2 * plain.len(); 2]), "{bad:?} {k}");
                    assert!(x.iter().chain(&y).all(|c| c.len() == 18), "{bad:?} {k}");
                }
            }
        }
        let [mut x, mut y] = [(); 2].map(|()| Vec::new());
        assert_eq!(rows([b"1.5\n"; 2], b',', [&mut x, &mut y]), ([0; 2], 0));
    }
}
