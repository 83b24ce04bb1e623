//! Decimal numbers from bytes, exactly rounded.

/// Powers of ten that are exact as `f64`.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// Digits with or without a point among them.
struct Decimal {
    /// the digits as one number; wrong where there are more than 19
    mantissa: u64,
    /// how many there are
    digits: usize,
    /// how many of them stand behind the point
    point: usize,
    /// where they end
    end: usize,
}

/// The digits that start at a place of a text.
#[inline(always)]
fn decimal(text: &[u8], start: usize) -> Decimal {
    let mut mantissa: u64 = 0;
    let mut digits_from = |mut i: usize| {
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
/// A mantissa below 2⁵³ with a power of ten up to 22 is one exact product or quotient (Clinger
/// 1990); everything else goes through the standard library, so that the result is always the
/// nearest `f64`.
#[inline]
pub fn parse(cell: &[u8]) -> Option<f64> {
    let mut i = 0;
    let n = cell.len();
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
    let Decimal {
        mantissa,
        digits,
        point,
        end,
    } = decimal(cell, i);
    i = end;
    let mut exponent = -(point as i32);
    if digits == 0 || digits > 19 {
        return slow(cell);
    }
    if i < n && (cell[i] | 0x20) == b'e' {
        i += 1;
        let minus = match cell.get(i) {
            Some(b'-') => {
                i += 1;
                true
            }
            Some(b'+') => {
                i += 1;
                false
            }
            _ => false,
        };
        let at = i;
        let mut e = 0i32;
        while i < n && cell[i].is_ascii_digit() && i - at < 6 {
            e = e * 10 + i32::from(cell[i] - b'0');
            i += 1;
        }
        if i == at {
            return slow(cell);
        }
        exponent += if minus { -e } else { e };
    }
    if i != n {
        return slow(cell);
    }
    if mantissa >= 1 << 53 || !(-22..=22).contains(&exponent) {
        // a sound number of more digits, as programs write them that keep every bit
        let x: f64 = std::str::from_utf8(cell).ok()?.parse().ok()?;
        return Some(if x.is_finite() { x } else { f64::NAN });
    }
    let m = mantissa as f64;
    let x = match exponent < 0 {
        true => m / POWERS[(-exponent) as usize],
        false => m * POWERS[exponent as usize],
    };
    Some(if negative { -x } else { x })
}

/// The number that starts at a place of a text, and where its cell ends, if it is a decimal without an exponent of no more
/// than 19 digits and the delimiter or the end of the line follows it: what most cells of a log are. The same bits as [`parse`]
/// of the cell.
#[inline(always)]
pub fn plain(text: &[u8], at: usize, delimiter: u8) -> Option<(f64, usize)> {
    let negative = *text.get(at)? == b'-';
    let Decimal {
        mantissa,
        digits,
        point,
        end,
    } = decimal(text, at + usize::from(negative));
    let next = *text.get(end)?;
    let ends = next == delimiter || next == b'\n';
    if !ends || digits == 0 || digits > 19 {
        return None;
    }
    if mantissa >= 1 << 53 {
        let x: f64 = std::str::from_utf8(&text[at..end]).ok()?.parse().ok()?;
        return Some((x, end));
    }
    let x = mantissa as f64 / POWERS[point];
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
        let mut plainly = 0;
        for k in 0..20_000u64 {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            let x = (state >> 12) as f64 * 10f64.powi(-((state % 19) as i32));
            let sign = if k % 3 == 0 { "-" } else { "" };
            let cell = match k % 4 {
                0 => format!("{sign}{x:.6}"),
                1 => format!("{sign}{x}"),
                2 => format!("{sign}{x:e}"),
                _ => format!("{sign}{:.22}", x),
            };
            for end in [",", "\n"] {
                let text = format!("7,{cell}{end}1");
                if let Some((y, at)) = plain(text.as_bytes(), 2, b',') {
                    let slowly = parse(cell.as_bytes()).unwrap();
                    assert_eq!(
                        (y.to_bits(), at),
                        (slowly.to_bits(), 2 + cell.len()),
                        "{cell}"
                    );
                    plainly += 1;
                }
            }
        }
        assert!(plainly > 8_000, "{plainly}");
        for other in [
            "", "-", ".", "-.,", "1", "1.5", "1.5 ,", "nan,", "1e5,", "+1,", "1.2.3,", "1;",
            "1\r\n",
        ] {
            assert!(plain(other.as_bytes(), 0, b',').is_none(), "{other}");
        }
        let digits = format!("{},", "1".repeat(400));
        assert!(plain(digits.as_bytes(), 0, b',').is_none());
        let digits = format!("0.{},", "1".repeat(400));
        assert!(plain(digits.as_bytes(), 0, b',').is_none());
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
