//! Numbers and units as people read them.

use crate::robot::Motion;
use crate::trajectory::certificate::Kind;

/// Space that does not break, between a number and its unit.
pub const NBSP: char = '\u{a0}';

/// A number with so many significant digits, without trailing zeros after the point and with a
/// true minus sign; powers of ten from a million up and below 0.001; `∞` from 1e300 up and `–` for
/// what is not a number.
pub fn significant(x: f64, digits: usize) -> String {
    if x.is_nan() {
        return "–".into();
    }
    let sign = if x < 0.0 { "−" } else { "" };
    let size = x.abs();
    if size >= 1e300 {
        return format!("{sign}∞");
    }
    if size == 0.0 {
        return "0".into();
    }
    let last = digits.saturating_sub(1);
    // rounded first, so that 9.996 counts as 10.0
    let scientific = format!("{size:.last$e}");
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-3..6).contains(&exponent) {
        let decimals = (last as i32 - exponent).max(0) as usize;
        return format!("{sign}{}", trimmed(&format!("{size:.decimals$}")));
    }
    format!("{sign}{}·{}", trimmed(mantissa), power_of_ten(exponent))
}

/// `10⁻³`.
pub fn power_of_ten(exponent: i32) -> String {
    let digits: String = exponent
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            // the other superscript digits follow one another
            _ => char::from_u32(0x2070 + c.to_digit(10).unwrap_or(0)).unwrap_or(c),
        })
        .collect();
    format!("10{digits}")
}

/// Without zeros at the end of a decimal fraction.
fn trimmed(text: &str) -> &str {
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.'),
        false => text,
    }
}

/// A fraction as percent with one decimal (none from 1000 % up): `99.9 %`. What is beyond 1
/// never reads as 100.0 %.
pub fn percent(fraction: f64) -> String {
    let x = 100.0 * fraction;
    if !x.is_finite() || x >= 1e6 {
        return format!("{}{NBSP}%", significant(x, 2));
    }
    let text = match x {
        x if x > 100.0 && x < 100.05 => significant(x, 12),
        x if x >= 1000.0 => format!("{x:.0}"),
        x if x.abs() < 0.05 => "0.0".to_string(),
        x => format!("{x:.1}"),
    };
    format!("{}{NBSP}%", text.replace('-', "−"))
}

/// Unit of a limited quantity.
pub fn unit_of(kind: Kind, motion: Motion) -> &'static str {
    match (kind, motion) {
        (Kind::Position, Motion::Revolute) => "rad",
        (Kind::Velocity | Kind::VelocityByPosition, Motion::Revolute) => "rad/s",
        (Kind::Acceleration, Motion::Revolute) => "rad/s²",
        (Kind::Jerk, Motion::Revolute) => "rad/s³",
        (Kind::Torque, Motion::Revolute) => "N m",
        (Kind::TorqueRate, Motion::Revolute) => "N m/s",
        (Kind::Position, Motion::Prismatic) => "m",
        (Kind::Velocity | Kind::VelocityByPosition, Motion::Prismatic) => "m/s",
        (Kind::Acceleration, Motion::Prismatic) => "m/s²",
        (Kind::Jerk, Motion::Prismatic) => "m/s³",
        (Kind::Torque, Motion::Prismatic) => "N",
        (Kind::TorqueRate, Motion::Prismatic) => "N/s",
        (Kind::ToolSpeed, _) => "m/s",
        (Kind::ToolAcceleration, _) => "m/s²",
        (Kind::Pose, _) => "",
    }
}

/// A unit in typographic form, kept on one line: `kg m^2` becomes `kg m²`.
pub fn unit(text: &str) -> String {
    text.replace("^2", "²")
        .replace("^3", "³")
        .replace(' ', "\u{a0}")
}

/// A number with its unit, kept on one line.
pub fn with_unit(x: f64, digits: usize, unit: &str) -> String {
    format!(
        "{}{NBSP}{}",
        significant(x, digits),
        unit.replace(' ', "\u{a0}")
    )
}

/// `1 period`, `3 periods`.
pub fn count(n: usize, noun: &str) -> String {
    let plural = if n == 1 { "" } else { "s" };
    format!("{n}{NBSP}{noun}{plural}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        for (x, digits, text) in [
            (0.0, 3, "0"),
            (1234.5678, 3, "1235"),
            (-0.0012345, 3, "−0.00123"),
            (9.996, 3, "10"),
            (2.1750, 4, "2.175"),
            (1.0e-9, 3, "1·10⁻⁹"),
            (4.567e12, 2, "4.6·10¹²"),
            (f64::INFINITY, 3, "∞"),
            (-1e300, 3, "−∞"),
            (f64::NAN, 3, "–"),
        ] {
            assert_eq!(significant(x, digits), text, "{x}");
        }
    }

    #[test]
    fn beyond_a_limit_never_reads_as_exactly_all_of_it() {
        assert_eq!(percent(0.9994), "99.9\u{a0}%");
        assert_eq!(percent(1.0), "100.0\u{a0}%");
        assert_eq!(percent(1.00001), "100.001\u{a0}%");
        assert_eq!(percent(1.108), "110.8\u{a0}%");
        assert_eq!(percent(1e300), "∞\u{a0}%");
        assert_eq!(percent(f64::NAN), "–\u{a0}%");
    }
}
