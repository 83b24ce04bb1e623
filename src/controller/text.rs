//! Numbers and names in the files of controllers.

/// The fewest digits that read back as the same number, always with a point, so that no reader takes it for an integer
/// or (YAML 1.1) for a text.
pub(super) fn exact(value: f64) -> String {
    let text = format!("{value:?}");
    let Some((digits, exponent)) = text.split_once('e') else {
        return text;
    };
    let digits = match digits.contains('.') {
        true => digits.to_string(),
        false => format!("{digits}.0"),
    };
    match exponent.starts_with('-') {
        true => format!("{digits}e{exponent}"),
        false => format!("{digits}e+{exponent}"),
    }
}

/// Nine decimals: within 5e-10.
pub(super) fn nine(value: f64) -> String {
    format!("{value:.9}")
}

/// A number for people: up to three decimals.
pub(super) fn short(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

/// Numbers with commas between them.
pub(super) fn list(values: &[f64], number: fn(f64) -> String) -> String {
    let all: Vec<String> = values.iter().map(|v| number(*v)).collect();
    all.join(", ")
}

/// A name in double quotes, as JSON, YAML and Python read it.
pub(super) fn quoted(name: &str) -> String {
    serde_json::Value::from(name).to_string()
}

/// A name for a comment: one line of ASCII, nothing that ends a comment.
pub(super) fn plain(name: &str) -> String {
    let kept = name.chars().map(|c| match c {
        c if c.is_ascii_alphanumeric() || " _-.,:/()".contains(c) => c,
        _ => '_',
    });
    kept.collect()
}

/// A name for a program: letters, digits and underscores, no digit first.
pub(super) fn identifier(name: &str) -> String {
    let mut out: String = name
        .chars()
        .map(|c| match c.is_ascii_alphanumeric() {
            true => c.to_ascii_lowercase(),
            false => '_',
        })
        .collect();
    if !out.starts_with(|c: char| c.is_ascii_alphabetic()) {
        out.insert_str(0, "robot_");
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_a_point_and_read_back() {
        for value in [0.0, -0.0, 1.0, 1e-7, -1.5e-300, 1e22, 0.1 + 0.2, f64::MAX] {
            let text = exact(value);
            assert!(text.contains('.'), "{text}");
            let mantissa = text.split('e').next().unwrap_or_default();
            assert!(mantissa.contains('.'), "{text}");
            assert_eq!(text.parse::<f64>().map(f64::to_bits), Ok(value.to_bits()));
        }
        assert_eq!(
            (exact(1e-7), exact(1e22)),
            ("1.0e-7".into(), "1.0e+22".into())
        );
        assert_eq!([1000.0, 250.0 / 3.0].map(short), ["1000", "83.333"]);
    }

    #[test]
    fn names_end_no_comment_and_no_line() {
        assert_eq!(plain("a*/\nb \"ç\""), "a_/_b ___");
        assert_eq!(identifier("7 Axes-B"), "robot_7_axes_b");
        assert_eq!(quoted("a\"\n"), "\"a\\\"\\n\"");
    }
}
