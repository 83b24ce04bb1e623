//! Rows of plain numbers of two texts at the same time: while one waits for where its number ends, the other goes on.
//!
//! With AVX2 a cell is looked at as a whole: where it ends, whether it is digits with one point among them, and the number that
//! they make (pairs of digits, pairs of pairs, and so on, as in [`number`]). The numbers are the same to the bit.

use super::number;

/// Rows that there is room for at first.
const FEW: usize = 64;

/// Whether a line that begins so may be a remark, or hold nothing.
#[inline(always)]
pub(super) fn may_be_idle(first: u8) -> bool {
    matches!(first, b'\n' | b'\r' | b'#' | b'%' | b'/' | b' ')
}

/// Reads rows of plain numbers from the beginning of two texts, a number a column that is kept, into columns that are empty, up
/// to the first line of either that is something else. Returns where it stopped in each, and the number of rows.
pub(super) fn rows(
    texts: [&[u8]; 2],
    delimiter: u8,
    keep: &[bool],
    columns: [&mut [Vec<f64>]; 2],
) -> ([usize; 2], usize) {
    #[cfg(all(target_arch = "x86_64", feature = "wide"))]
    if wide::there_is() {
        // SAFETY: the machine has what it asks for
        return unsafe { wide::rows(texts, delimiter, keep, columns) };
    }
    // SAFETY: it asks for nothing
    unsafe { rows_by::<Narrow>(texts, delimiter, keep, columns) }
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

    /// Where the cell ends that stands at this place.
    ///
    /// # Safety
    /// As [`Numbers::two`].
    unsafe fn end(text: &[u8], at: usize, delimiter: u8) -> Option<usize>;
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

    #[inline(always)]
    unsafe fn end(text: &[u8], at: usize, delimiter: u8) -> Option<usize> {
        let mut rest = text[at..].iter();
        rest.position(|c| *c == delimiter || *c == b'\n')
            .map(|size| at + size)
    }
}

/// Where the cells end that stand at a place of each of two texts.
///
/// # Safety
/// As [`Numbers::two`].
#[inline(always)]
unsafe fn both_ends<N: Numbers>(
    texts: [&[u8]; 2],
    at: [usize; 2],
    delimiter: u8,
) -> Option<[usize; 2]> {
    // SAFETY: by the caller's promise
    unsafe {
        Some([
            N::end(texts[0], at[0], delimiter)?,
            N::end(texts[1], at[1], delimiter)?,
        ])
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
    keep: &[bool],
    [x, y]: [&mut [Vec<f64>]; 2],
) -> ([usize; 2], usize) {
    let n = keep.len();
    let mut brief = vec![[true; 2]; n];
    let (mut at, mut done) = ([0; 2], 0);
    let kept = x.iter().zip(keep).filter(|(_, keep)| **keep);
    let Some(room) = kept.map(|(c, _)| c.capacity()).min() else {
        return (at, done);
    };
    let mut room = room.max(FEW);
    'rows: loop {
        let columns = (x.iter_mut().zip(&mut *y)).zip(keep);
        let mut to: Vec<Option<[&mut [f64]; 2]>> = columns
            .map(|((x, y), keep)| {
                keep.then(|| {
                    [x, y].map(|column| {
                        column.resize(room, 0.0);
                        column.as_mut_slice()
                    })
                })
            })
            .collect();
        while done < room {
            let mut next = at;
            // a line that has to begin with a number is no remark
            let idle = |k: usize| texts[k].get(next[k]).is_some_and(|c| may_be_idle(*c));
            if !keep[0] && (idle(0) || idle(1)) {
                break 'rows;
            }
            for (k, (to, brief)) in to.iter_mut().zip(&mut brief).enumerate() {
                // SAFETY: by the caller's promise
                let ends = unsafe {
                    match to {
                        Some([x, y]) => {
                            N::two(texts, next, delimiter, brief).map(|[(u, a), (v, b)]| {
                                (x[done], y[done]) = (u, v);
                                [a, b]
                            })
                        }
                        None => both_ends::<N>(texts, next, delimiter),
                    }
                };
                let Some([a, b]) = ends else {
                    break 'rows;
                };
                let last = k + 1 == n;
                if (texts[0][a] == b'\n') != last || (texts[1][b] == b'\n') != last {
                    break 'rows;
                }
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
        keep: &[bool],
        columns: [&mut [Vec<f64>]; 2],
    ) -> ([usize; 2], usize) {
        // SAFETY: by the caller's promise
        unsafe { rows_by::<Wide>(texts, delimiter, keep, columns) }
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
            if brief[1] {
                // SAFETY: by the caller's promise
                let cells = unsafe {
                    [
                        Long::at(texts[0], at[0], delimiter),
                        Long::at(texts[1], at[1], delimiter),
                    ]
                };
                let found = match &cells {
                    // SAFETY: by the caller's promise
                    [Some(a), Some(b)] => unsafe { long_numbers(a, b) },
                    _ => None,
                };
                if found.is_some() {
                    return found;
                }
                brief[1] = at[0].min(at[1]) < CELL;
            }
            // SAFETY: it asks for nothing
            unsafe { Narrow::two(texts, at, delimiter, &mut [false; 2]) }
        }

        #[inline(always)]
        unsafe fn end(text: &[u8], at: usize, delimiter: u8) -> Option<usize> {
            let mut from = at;
            while from + AHEAD <= text.len() {
                // SAFETY: 32 bytes are there
                let ends = unsafe { ends(text, from, delimiter) };
                if ends != 0 {
                    return Some(from + ends.trailing_zeros() as usize);
                }
                from += AHEAD;
            }
            // SAFETY: it asks for nothing
            unsafe { Narrow::end(text, from, delimiter) }
        }
    }

    /// Which of 32 bytes end a cell.
    ///
    /// # Safety
    /// They must be there, and the machine must have AVX2.
    #[inline(always)]
    unsafe fn ends(text: &[u8], from: usize, delimiter: u8) -> u32 {
        // SAFETY: by the caller's promise
        unsafe {
            let ahead = _mm256_loadu_si256(text.as_ptr().add(from).cast());
            let ends = _mm256_or_si256(
                _mm256_cmpeq_epi8(ahead, _mm256_set1_epi8(delimiter as i8)),
                _mm256_cmpeq_epi8(ahead, _mm256_set1_epi8(b'\n' as i8)),
            );
            _mm256_movemask_epi8(ends) as u32
        }
    }

    /// Whether the number of a cell is negative, where it begins behind a blank and a sign, and where the cell ends. `None` at the very beginning and the
    /// end of a text, where sixteen bytes before it and 33 from its beginning are not all there, and of longer cells.
    ///
    /// # Safety
    /// The machine must have AVX2.
    #[inline(always)]
    unsafe fn bounds(text: &[u8], at: usize, delimiter: u8) -> Option<(bool, usize, usize)> {
        if at < CELL || at + AHEAD >= text.len() {
            return None;
        }
        let at = at + usize::from(text[at] == b' ');
        // SAFETY: 32 bytes are there
        let size = unsafe { ends(text, at, delimiter) }.trailing_zeros() as usize;
        let negative = text[at] == b'-';
        (size < AHEAD).then_some((negative, at + usize::from(negative), at + size))
    }

    /// The last `length` of sixteen digits before a place, or all of them, with zeros in front.
    ///
    /// # Safety
    /// The place must be in the text, behind sixteen bytes, and the machine must have AVX2.
    #[inline(always)]
    unsafe fn digits(text: &[u8], stop: usize, length: usize) -> __m128i {
        // SAFETY: by the caller's promise, and of the mask there are sixteen bytes from sixteen or less on
        unsafe {
            let all = _mm_loadu_si128(text.as_ptr().add(stop - CELL).cast());
            let mask = _mm_loadu_si128(LAST.as_ptr().add(length.min(CELL)).cast());
            _mm_and_si128(_mm_xor_si128(all, _mm_set1_epi8(b'0' as i8)), mask)
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
        /// The one that starts at a place, if it is digits with one point and there are no more than fifteen.
        ///
        /// # Safety
        /// The machine must have AVX2.
        #[inline(always)]
        unsafe fn at(text: &[u8], at: usize, delimiter: u8) -> Option<Cell> {
            // SAFETY: by the caller's promise
            let (negative, first, end) = unsafe { bounds(text, at, delimiter) }?;
            let length = end - first;
            // a digit and a point at least
            if !(2..=CELL).contains(&length) {
                return None;
            }
            // SAFETY: the end is beyond the sixteenth byte and within the text
            let digits = unsafe { digits(text, end, length) };
            // SAFETY: by the caller's promise
            let [others, points] = unsafe { strangers(digits) };
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

    /// A cell of more digits, or with an exponent.
    struct Long {
        /// its last digits, in the last bytes of sixteen
        digits: __m128i,
        /// what the digits before them add
        more: u64,
        /// power of ten of the last digit
        power: i32,
        negative: bool,
        end: usize,
    }

    impl Long {
        /// The one that starts at a place, if it is up to nineteen digits, with one point among them or none, and perhaps
        /// `e±dd`.
        ///
        /// # Safety
        /// The machine must have AVX2.
        #[inline(always)]
        unsafe fn at(text: &[u8], at: usize, delimiter: u8) -> Option<Long> {
            // SAFETY: by the caller's promise
            let (negative, first, end) = unsafe { bounds(text, at, delimiter) }?;
            let mut stop = end - usize::from(text[end - 1] == b'\r' && text[end] == b'\n');
            let mut power = 0;
            if let [e, sign, tens, ones] = text[stop - 4..stop]
                && e | 0x20 == b'e'
            {
                let [tens, ones] = [tens, ones].map(|c| i32::from(c.wrapping_sub(b'0')));
                if tens > 9 || ones > 9 || !matches!(sign, b'-' | b'+') {
                    return None;
                }
                power = if sign == b'-' { -1 } else { 1 } * (10 * tens + ones);
                stop -= 4;
            }
            let length = stop.checked_sub(first)?;
            // SAFETY: it stops behind its first byte, which is beyond the sixteenth of the text
            let low = unsafe { digits(text, stop, length) };
            // SAFETY: by the caller's promise
            let [others, points] = unsafe { strangers(low) };
            let (mut before, mut behind) = (0, None);
            for c in &text[first..first.max(stop - CELL)] {
                match c {
                    b'0'..=b'9' => before = 10 * before + u64::from(c - b'0'),
                    b'.' if behind.is_none() => behind = Some(0),
                    _ => return None,
                }
                behind = behind.map(|n| n + i32::from(*c != b'.'));
            }
            if others == 0 {
                // no point, or one further in front
                let digits = length - usize::from(behind.is_some());
                power -= behind.map_or(0, |n| n + CELL as i32);
                let sound = digits > 0 && before < 1000;
                return sound.then(|| Long {
                    digits: low,
                    more: before * 10_000_000_000_000_000,
                    power,
                    negative,
                    end,
                });
            }
            if others != points || !others.is_power_of_two() || behind.is_some() || length < 2 {
                return None;
            }
            let point = CELL - 1 - others.trailing_zeros() as usize;
            // SAFETY: by the caller's promise
            let digits =
                unsafe { _mm_shuffle_epi8(low, _mm_loadu_si128(JOINED[point].as_ptr().cast())) };
            (before < 10_000).then(|| Long {
                digits,
                more: before * 1_000_000_000_000_000,
                power: power - point as i32,
                negative,
                end,
            })
        }
    }

    /// Which of sixteen digits are none, and which of them are points.
    ///
    /// # Safety
    /// The machine must have AVX2.
    #[inline(always)]
    unsafe fn strangers(digits: __m128i) -> [u32; 2] {
        // SAFETY: by the caller's promise
        unsafe {
            let others = _mm_cmpeq_epi8(_mm_max_epu8(digits, _mm_set1_epi8(10)), digits);
            let points = _mm_cmpeq_epi8(digits, _mm_set1_epi8((b'.' ^ b'0') as i8));
            [
                _mm_movemask_epi8(others) as u32,
                _mm_movemask_epi8(points) as u32,
            ]
        }
    }

    /// The numbers that twice sixteen digits make.
    ///
    /// # Safety
    /// The machine must have AVX2.
    #[inline(always)]
    unsafe fn wholes(a: __m128i, b: __m128i) -> [u64; 2] {
        // SAFETY: by the caller's promise
        unsafe {
            let pairs = _mm256_maddubs_epi16(_mm256_set_m128i(b, a), _mm256_set1_epi16(0x010A));
            let fours = _mm256_madd_epi16(pairs, _mm256_set1_epi32(0x0001_0064));
            let fours = _mm256_packus_epi32(fours, fours);
            let eights = _mm256_madd_epi16(fours, _mm256_set1_epi32(0x0001_2710));
            let high = _mm256_mul_epu32(eights, _mm256_set1_epi64x(100_000_000));
            let all = _mm256_add_epi64(high, _mm256_srli_epi64(eights, 32));
            [_mm256_extract_epi64(all, 0), _mm256_extract_epi64(all, 2)].map(|x| x as u64)
        }
    }

    /// The numbers of two cells, and where these end.
    ///
    /// # Safety
    /// The machine must have AVX2.
    #[inline(always)]
    unsafe fn numbers(a: &Cell, b: &Cell) -> [(f64, usize); 2] {
        // SAFETY: by the caller's promise
        let whole = unsafe { wholes(a.digits, b.digits) };
        [(a, whole[0]), (b, whole[1])].map(|(cell, whole)| {
            let x = number::quotient_of_few(whole, cell.point);
            let sign = u64::from(cell.negative) << 63;
            (f64::from_bits(x.to_bits() | sign), cell.end)
        })
    }

    /// The same of long ones; `None` where they are not told.
    ///
    /// # Safety
    /// The machine must have AVX2.
    #[inline(always)]
    unsafe fn long_numbers(a: &Long, b: &Long) -> Option<[(f64, usize); 2]> {
        // SAFETY: by the caller's promise
        let whole = unsafe { wholes(a.digits, b.digits) };
        let (x, y) = (
            number::nearest(a.more + whole[0], a.power)?,
            number::nearest(b.more + whole[1], b.power)?,
        );
        Some([
            (if a.negative { -x } else { x }, a.end),
            (if b.negative { -y } else { y }, b.end),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A text of so many rows of six cells, of kinds that are mostly plain, and what each is; the fifth is anything.
    fn text(rng: &mut ChaCha8Rng, lines: usize, end: &str) -> (String, Vec<Vec<f64>>) {
        let (mut out, mut all) = (String::new(), Vec::new());
        for _ in 0..lines {
            let cells: Vec<String> = (0..6)
                .map(|k| {
                    let x = rng.random_range(-1.0..1.0) * 10f64.powi(rng.random_range(-4..8));
                    match (k, rng.random_range(0..40)) {
                        (0, _) => format!("{:.3}", x.abs()),
                        (4, n) => {
                            ["", "#", "1.5", "AUTO", "2026-01-05 08:00:30"][n % 5].repeat(n / 8)
                        }
                        (_, 0) => format!("{}", x as f32),
                        (_, 1) => format!("{}", x as i64),
                        (_, 2) => format!("{x:.0}."),
                        (_, 3) => format!("{x:.10}"),
                        (_, 4) => format!(" {x:.3}"),
                        (_, 5) => format!("   {x:e}"),
                        (_, 6) => format!("{x:.18E}"),
                        (2, _) => x.to_string(),
                        (3, _) => format!("{:.6}", x).replacen("0.", ".", 1),
                        _ => format!("{x:.6}"),
                    }
                })
                .collect();
            let number = |c: &String| c.trim().parse().unwrap_or(f64::NAN);
            all.push(cells.iter().map(number).collect());
            out += &cells.join(",");
            out += end;
        }
        (out, all)
    }

    type Way = fn([&[u8]; 2], &[bool], [&mut [Vec<f64>]; 2]) -> ([usize; 2], usize);

    fn ways() -> [Way; 2] {
        // SAFETY: the narrow way asks for nothing, and the other one is chosen where it can be
        [
            |t, k, c| unsafe { rows_by::<Narrow>(t, b',', k, c) },
            |t, k, c| rows(t, b',', k, c),
        ]
    }

    #[test]
    fn rows_of_two_texts_are_those_of_their_cells() {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        for case in 0..200 {
            let lines = [1, 3, 70, 500][case % 4];
            let end = ["\n", "\r\n"][case / 4 % 2];
            let (a, all) = text(&mut rng, lines, end);
            let (b, others) = text(&mut rng, lines, end);
            let mut keep = [true, true, true, true, false, true];
            keep[5 * (case / 8 % 2)] = case % 3 > 0;
            for way in ways() {
                let [mut x, mut y] = [(); 2].map(|()| vec![Vec::new(); 6]);
                let texts = [a.as_bytes(), b.as_bytes()];
                let (at, rows) = way(texts, &keep, [&mut x, &mut y]);
                assert_eq!((rows, at), (lines, [a.len(), b.len()]), "{case}");
                for (columns, all) in [(&x, &all), (&y, &others)] {
                    for (k, column) in columns.iter().enumerate() {
                        let theirs = all.iter().filter(|_| keep[k]).map(|row| row[k]);
                        let theirs: Vec<u64> = theirs.map(f64::to_bits).collect();
                        let ours: Vec<u64> = column.iter().map(|v| v.to_bits()).collect();
                        assert_eq!(ours, theirs, "{case}, column {k}");
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
            "1.5,2.25e,3.125\n",
            "1.5,2.25e-123456,3.125\n",
            "1.5,2.25 ,3.125\n",
            "1.5,2.25,3.125\r,\n",
            "1.5,2.25\r,3.125\n",
            "1.5,  ,3.125\n",
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
                    let (at, rows) = way(bytes, &[true; 3], [&mut x, &mut y]);
                    assert_eq!((rows, at), (18, [2 * plain.len(); 2]), "{bad:?} {k}");
                    assert!(x.iter().chain(&y).all(|c| c.len() == 18), "{bad:?} {k}");
                }
            }
        }
        let [mut x, mut y] = [(); 2].map(|()| Vec::new());
        let [x, y] = [&mut x, &mut y];
        assert_eq!(rows([b"1.5\n"; 2], b',', &[], [x, y]), ([0; 2], 0));
    }

    /// A remark is no row, also where its line has as many cells and the first one is passed over.
    #[test]
    fn remarks_stop_both() {
        for remark in [
            "# pause,2.5\n",
            "  # pause,2.5\n",
            "// pause,2.5\n",
            "%,2.5\n",
        ] {
            let text = "AUTO,1.5\n".repeat(4) + remark + &"AUTO,1.5\n".repeat(9);
            for way in ways() {
                let [mut x, mut y] = [(); 2].map(|()| vec![Vec::new(); 2]);
                let found = way([text.as_bytes(); 2], &[false, true], [&mut x, &mut y]);
                assert_eq!(found, ([36; 2], 4), "{remark}");
            }
        }
    }
}
