//! Decimal numbers from bytes, exactly rounded.

/// Powers of ten that are exact as `f64`.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// Digits with or without a point among them.
struct Decimal {
    /// the digits as one number; wrong where more than 19 are left from the first that is not zero on
    mantissa: u64,
    /// how many there are
    digits: usize,
    /// how many of them stand behind the point
    point: usize,
    /// where they end
    end: usize,
}

/// Up to eight digits at the beginning of eight bytes: how many there are, and the number that they make.
///
/// All bytes are looked at at once: pairs of digits are joined, then pairs of pairs (Lemire, "Quickly parsing eight digits",
/// 2018), with zeros put before what is shorter.
#[inline(always)]
fn eight(bytes: [u8; 8]) -> (usize, u64) {
    let (x, count) = digits(bytes);
    if count == 0 {
        return (0, 0);
    }
    (count, joined(x << (64 - 8 * count)))
}

/// Eight bytes less the character zero, and how many of them are digits before the first other one.
#[inline(always)]
fn digits(bytes: [u8; 8]) -> (u64, usize) {
    let x = u64::from_le_bytes(bytes) ^ 0x3030_3030_3030_3030;
    // the highest bit of each byte above 9; what a sum carries over comes after the first of these
    let others = (x.wrapping_add(0x7676_7676_7676_7676) | x) & 0x8080_8080_8080_8080;
    (x, others.trailing_zeros() as usize / 8)
}

/// The number that eight digits make, one in a byte, the first in the lowest.
#[inline(always)]
fn joined(x: u64) -> u64 {
    let pairs = x.wrapping_mul(10).wrapping_add(x >> 8);
    let even = (pairs & 0x0000_00FF_0000_00FF).wrapping_mul(0x000F_4240_0000_0064);
    let odd = ((pairs >> 16) & 0x0000_00FF_0000_00FF).wrapping_mul(0x0000_2710_0000_0001);
    even.wrapping_add(odd) >> 32
}

/// Powers of ten that are whole numbers.
const WHOLE: [u64; 20] = {
    let mut all = [1; 20];
    let mut k = 1;
    while k < 20 {
        all[k] = 10 * all[k - 1];
        k += 1;
    }
    all
};

/// Powers of ten whose products with 64 bits are rounded here.
const LARGEST: i32 = 54;

/// The first 128 bits of `5^q` and of its inverses, for `q` from −[`LARGEST`] to [`LARGEST`], high half first; inverses of up to
/// `5^27` are rounded up, everything else down.
static FIVES: [[u64; 2]; 2 * LARGEST as usize + 1] = {
    const fn halves(x: u128) -> [u64; 2] {
        [(x >> 64) as u64, x as u64]
    }
    let mut all = [[1 << 63, 0]; 2 * LARGEST as usize + 1];
    let (mut five, mut q) = (1u128, 1);
    while q <= LARGEST as usize {
        five *= 5;
        all[LARGEST as usize + q] = halves(five << five.leading_zeros());
        // long division of a power of two, until there are 128 bits of quotient
        let (mut rest, mut quotient) = (1u128, 0u128);
        while quotient >> 127 == 0 {
            rest *= 2;
            let one = rest >= five;
            quotient = 2 * quotient + one as u128;
            rest -= if one { five } else { 0 };
        }
        all[LARGEST as usize - q] = halves(quotient + (q <= 27) as u128);
        q += 1;
    }
    all
};

/// `mantissa · 10^power`, to the nearest `f64`; `None` for zero, for other powers than those of [`FIVES`], and where 128 bits do not
/// tell (Lemire, "Number parsing at a gigabyte per second", 2021).
#[inline(always)]
fn product(mantissa: u64, power: i32) -> Option<f64> {
    if mantissa == 0 || power.abs() > LARGEST {
        return None;
    }
    let [high, low] = FIVES[(power + LARGEST) as usize];
    let zeros = mantissa.leading_zeros();
    let whole = mantissa << zeros;
    let mut all = u128::from(whole) * u128::from(high);
    // the nine bits below those that are kept: only if all are set may what was left off carry into them
    if (all >> 64) as u64 & 0x1FF == 0x1FF {
        all = all.wrapping_add((u128::from(whole) * u128::from(low)) >> 64);
    }
    let (bits, rest) = ((all >> 64) as u64, all as u64);
    if rest == u64::MAX && !(-27..=55).contains(&power) {
        return None;
    }
    let upper = (bits >> 63) as u32;
    let shift = upper + 9;
    let mut kept = bits >> shift;
    // log₂ 10 is 217706/2¹⁶
    let mut exponent = ((power * 217_706) >> 16) + 63 + upper as i32 - zeros as i32;
    // halfway between two numbers: to the even one
    if rest <= 1 && (-4..=23).contains(&power) && kept & 3 == 1 && kept << shift == bits {
        kept -= 1;
    }
    kept = (kept + (kept & 1)) >> 1;
    if kept >> 53 == 1 {
        kept >>= 1;
        exponent += 1;
    }
    let exponent = (exponent + 1023) as u64;
    Some(f64::from_bits(kept & !(1 << 52) | exponent << 52))
}

/// `mantissa / 10^point` of no more than 15 digits, and of zero: both numbers are exact, and the quotient is rounded once.
#[inline(always)]
pub(super) fn quotient_of_few(mantissa: u64, point: usize) -> f64 {
    // below 2⁵³, and signed numbers convert in one instruction
    mantissa as i64 as f64 / POWERS[point]
}

/// The digits that start at a place of a text.
#[inline(always)]
fn decimal(text: &[u8], start: usize) -> Decimal {
    let mut mantissa: u64 = 0;
    let mut digits_from = |mut i: usize| {
        while let Some(bytes) = text.get(i..i + 8).and_then(|b| b.try_into().ok()) {
            let (count, value) = eight(bytes);
            mantissa = mantissa.wrapping_mul(WHOLE[count]).wrapping_add(value);
            i += count;
            if count < 8 {
                return i;
            }
        }
        while i < text.len() && text[i].is_ascii_digit() {
            mantissa = mantissa
                .wrapping_mul(10)
                .wrapping_add(u64::from(text[i] - b'0'));
            i += 1;
        }
        i
    };
    let mut end = digits_from(start);
    let (mut digits, mut point) = (end - start, 0);
    if end < text.len() && text[end] == b'.' {
        let from = end + 1;
        end = digits_from(from);
        point = end - from;
        digits += point;
    }
    Decimal {
        mantissa,
        digits,
        point,
        end,
    }
}

/// A cell of a table as a number; a dropped one (empty, `nan`, `null`, `inf`, `-`) is NaN, and what
/// is no number at all is `None`.
///
/// What is rounded here is rounded once; everything else goes through the standard library, so that the result is always the
/// nearest `f64`.
#[inline]
pub fn parse(cell: &[u8]) -> Option<f64> {
    let mut i = 0;
    let negative = match cell.first() {
        Some(b'-') => {
            i = 1;
            true
        }
        Some(b'+') => {
            i = 1;
            false
        }
        _ => false,
    };
    match unsigned(cell, i) {
        Some((x, end)) if end == cell.len() => Some(if negative { -x } else { x }),
        _ => slow(cell),
    }
}

/// The number without a sign that starts at a place of a text, and where it ends; `None` of one that is rounded elsewhere, or none.
#[inline(always)]
fn unsigned(text: &[u8], at: usize) -> Option<(f64, usize)> {
    let Decimal {
        mantissa,
        digits,
        point,
        mut end,
    } = decimal(text, at);
    if digits == 0 || digits > 19 && significant(&text[at..end]) > 19 {
        return None;
    }
    let mut power = -(point as i32);
    if text.get(end).is_some_and(|c| c | 0x20 == b'e') {
        let (e, behind) = exponent_of(text, end)?;
        power += e;
        end = behind;
    }
    Some((nearest(mantissa, power)?, end))
}

/// Digits of a decimal from the first that is not zero on.
#[cold]
fn significant(decimal: &[u8]) -> usize {
    let from = decimal.iter().position(|b| matches!(b, b'1'..=b'9'));
    let rest = from.map_or(&[][..], |from| &decimal[from..]);
    rest.iter().filter(|b| b.is_ascii_digit()).count()
}

/// The exponent of an `e` at a place of a text, up to five digits, and where it ends.
#[inline(always)]
fn exponent_of(text: &[u8], at: usize) -> Option<(i32, usize)> {
    let sign = *text.get(at + 1)?;
    let from = at + 1 + usize::from(matches!(sign, b'-' | b'+'));
    let digits = text[from..].iter().take(6);
    let digits = digits.take_while(|b| b.is_ascii_digit());
    let (count, e) = digits.fold((0, 0), |(n, e), b| (n + 1, 10 * e + i32::from(b - b'0')));
    let found = (1..6).contains(&count);
    found.then_some((if sign == b'-' { -e } else { e }, from + count))
}

/// `mantissa · 10^power`, to the nearest `f64`. A mantissa below 2⁵³ with a power of ten up to 22 is one exact product or quotient
/// (Clinger 1990); `None` where [`product`] does not tell.
#[inline(always)]
pub(super) fn nearest(mantissa: u64, power: i32) -> Option<f64> {
    if mantissa >= 1 << 53 || !(-22..=22).contains(&power) {
        return product(mantissa, power);
    }
    let m = mantissa as i64 as f64;
    Some(match power < 0 {
        true => m / POWERS[power.unsigned_abs() as usize],
        false => m * POWERS[power as usize],
    })
}

/// The number that starts at a place of a text, and where its cell ends, if it is a decimal of no more than 19 digits behind
/// leading zeros and the delimiter or the end of the line follows it: what most cells of a log are. The same bits as [`parse`] of the cell.
///
/// `brief` says whether numbers of no more than eight digits are expected, which are read faster; it is cleared where that is
/// wrong.
#[inline(always)]
pub fn plain(text: &[u8], at: usize, delimiter: u8, brief: &mut bool) -> Option<(f64, usize)> {
    if *brief && let Some(found) = short(text, at, delimiter) {
        return Some(found);
    }
    let found = long(text, at, delimiter)?;
    *brief = false;
    Some(found)
}

/// [`plain`] of no more than eight digits with a point among them, which are joined at once; `None` for all others.
#[inline(always)]
fn short(text: &[u8], at: usize, delimiter: u8) -> Option<(f64, usize)> {
    // a sign, eight bytes with the point among them, eight more, and what follows: 18
    let cell: &[u8; 24] = text.get(at..at + 24)?.try_into().ok()?;
    let eight = |i: usize| cell.get(i..i + 8)?.try_into().ok();
    let negative = cell[0] == b'-';
    let first = usize::from(negative);
    let (whole, before) = digits(eight(first)?);
    let dot = first + before;
    if before == 8 || cell[dot] != b'.' {
        return None;
    }
    let (part, point) = digits(eight(dot + 1)?);
    let (all, end) = (before + point, dot + 1 + point);
    if all == 0 || all > 8 {
        return None;
    }
    let next = cell[end];
    if next != delimiter && next != b'\n' {
        return None;
    }
    let together = whole & ((1 << (8 * before)) - 1) | part << (8 * before);
    let x = quotient_of_few(joined(together << (64 - 8 * all)), point);
    let sign = u64::from(negative) << 63;
    Some((f64::from_bits(x.to_bits() | sign), at + end))
}

/// [`plain`] of any number of digits.
#[inline]
fn long(text: &[u8], at: usize, delimiter: u8) -> Option<(f64, usize)> {
    let mut at = at;
    while *text.get(at)? == b' ' {
        at += 1;
    }
    let negative = text[at] == b'-';
    let (x, mut end) = unsigned(text, at + usize::from(negative))?;
    let mut next = *text.get(end)?;
    if next == b'\r' {
        end += 1;
        next = *text.get(end)?;
    }
    if next != b'\n' && (next != delimiter || text[end - 1] == b'\r') {
        return None;
    }
    Some((if negative { -x } else { x }, end))
}

/// Everything that is not a plain short decimal.
#[cold]
fn slow(cell: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(cell)
        .ok()?
        .trim()
        .trim_matches('"')
        .trim();
    if let Ok(x) = text.parse::<f64>() {
        return Some(if x.is_finite() { x } else { f64::NAN });
    }
    let dropped = [
        "",
        "-",
        "na",
        "n/a",
        "null",
        "none",
        "nan",
        "-nan",
        "nan(ind)",
        "-nan(ind)",
    ];
    dropped
        .contains(&text.to_ascii_lowercase().as_str())
        .then_some(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_standard_library() {
        for text in [
            "0",
            "-0.0",
            "1",
            "-1.5",
            "3.14159265358979",
            "0.1",
            "1e-5",
            "7.45e-06",
            "1E22",
            "1e23",
            "9007199254740993",
            "123456789012345678901234567890",
            "0.000000000000000000000000001",
            "2.2250738585072014e-308",
            "+4.25",
            ".5",
            "5.",
            "1.7976931348623157e308",
            "179.99999999999997",
        ] {
            let x = parse(text.as_bytes()).unwrap();
            assert_eq!(
                x.to_bits(),
                text.parse::<f64>().unwrap().to_bits(),
                "{text}"
            );
        }
        let mut state = 1u64;
        for _ in 0..20_000 {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            let x = f64::from_bits(state);
            if x.is_finite() {
                for text in [
                    format!("{x:e}"),
                    format!("{:.9}", (state >> 20) as f64 * 1e-9),
                ] {
                    let y = parse(text.as_bytes()).unwrap();
                    assert_eq!(y, text.parse::<f64>().unwrap(), "{text}");
                }
            }
        }
    }

    #[test]
    fn what_is_read_in_one_pass_is_what_the_cell_is() {
        let mut state = 7u64;
        let (mut plainly, mut briefly) = (0, 0);
        for k in 0..20_000u64 {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            let x = (state >> 12) as f64 * 10f64.powi(-((state % 19) as i32));
            let sign = if k % 3 == 0 { "-" } else { "" };
            let cell = match k % 5 {
                // up to 19 digits, the point anywhere among them
                4 => {
                    let mut digits = state.to_string();
                    digits.truncate(16 + (k % 4) as usize);
                    digits.insert((state % 13) as usize, '.');
                    format!("{sign}{digits}")
                }
                0 => format!("{sign}{x:.6}"),
                1 if k % 2 == 0 => format!(" {sign}{x:.18e}"),
                1 => format!("{sign}{x}"),
                2 => format!("{sign}{x:e}"),
                _ => format!("{sign}{:.22}", x),
            };
            for end in [",", "\n", "\r\n"] {
                let text = format!("7,{cell}{end}1");
                // with and without what follows it, as at the end of a piece
                let more = format!("{text},2.5,3.5,4.5,5.5,6.5");
                let (mut brief, mut not) = (true, false);
                let found = plain(more.as_bytes(), 2, b',', &mut brief);
                assert_eq!(found, plain(text.as_bytes(), 2, b',', &mut not), "{cell}");
                briefly += usize::from(brief && found.is_some());
                if let Some((y, at)) = found {
                    let slowly = parse(cell.as_bytes()).unwrap();
                    let library: f64 = cell.trim().parse().unwrap();
                    let bits = [slowly, library].map(f64::to_bits);
                    assert_eq!(bits, [y.to_bits(); 2], "{cell}");
                    assert_eq!(at, 1 + cell.len() + end.len(), "{cell}");
                    plainly += 1;
                }
            }
        }
        assert!(plainly > 8_000 && briefly > 2_000, "{plainly}, {briefly}");
        for other in [
            "",
            "-",
            ".",
            "-.,",
            "1",
            "1.5",
            "1.5 ,",
            "nan,",
            "1e,",
            "1e5",
            "1e+,",
            "1e5.,",
            "+1,",
            "1.2.3,",
            "1;",
            "1\r",
            "1\r,",
            "  ",
            "  ,",
            "1e123456,",
        ] {
            assert!(
                plain(other.as_bytes(), 0, b',', &mut true).is_none(),
                "{other}"
            );
        }
        let digits = format!("{},", "1".repeat(400));
        assert!(plain(digits.as_bytes(), 0, b',', &mut true).is_none());
        let digits = format!("0.{},", "1".repeat(400));
        assert!(plain(digits.as_bytes(), 0, b',', &mut true).is_none());
    }

    /// Of all powers that are rounded here, and beside them.
    #[test]
    fn products_with_powers_of_ten_are_those_of_the_standard_library() {
        let (mut state, mut told) = (5u64, 0);
        for k in 0..200_000 {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            let mantissa = state >> (k % 60);
            let power = k % 130 - 65;
            let library: f64 = format!("{mantissa}e{power}").parse().unwrap();
            if let Some(x) = product(mantissa, power) {
                assert_eq!(x.to_bits(), library.to_bits(), "{mantissa}e{power}");
                told += 1;
            }
        }
        assert!(told > 150_000, "{told}");
    }

    /// Halfway between two numbers, and a digit to either side of it.
    #[test]
    fn long_decimals_are_rounded_once() {
        let mut state = 11u64;
        for k in 0..20_000u64 {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            // 54 bits whose lowest is set: halfway
            let halfway = (1 << 53) + 2 * (state >> 12) + 1;
            for mantissa in [halfway - 1, halfway, halfway + 1, state | 1 << 53] {
                let point = (state >> 3) as usize % 20;
                let library: f64 = format!("{mantissa}e-{point}").parse().unwrap();
                if mantissa < 10_000_000_000_000_000_000 {
                    let ours = product(mantissa, -(point as i32)).map(f64::to_bits);
                    assert_eq!(ours, Some(library.to_bits()), "{mantissa}e-{point} {k}");
                }
            }
        }
    }

    #[test]
    fn digits_end_where_something_else_stands() {
        for (count, end) in (0..=8usize).flat_map(|n| (0..=255u8).map(move |c| (n, c))) {
            if end.is_ascii_digit() && count < 8 {
                continue;
            }
            let mut text = *b"90718253";
            text[count.min(7)..].fill(if count < 8 { end } else { b'3' });
            let digits = std::str::from_utf8(&text[..count]).unwrap();
            assert_eq!(eight(text), (count, digits.parse().unwrap_or(0)), "{end}");
        }
    }

    #[test]
    fn what_was_dropped_is_nan_and_what_is_no_number_is_none() {
        for text in ["", "nan", "NaN", "-nan(ind)", "null", "inf", " "] {
            assert!(parse(text.as_bytes()).unwrap().is_nan(), "{text}");
        }
        for text in ["abc", "1.2.3", "1e", "--1", "1,5", "0x10", "1e5x"] {
            assert!(parse(text.as_bytes()).is_none(), "{text}");
        }
        assert_eq!(parse(b" 1.5 "), Some(1.5));
        assert_eq!(parse(b"\"1.5\""), Some(1.5));
    }
}
