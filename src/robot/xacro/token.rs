//! Names, numbers, texts and signs of an expression.

use super::value::{Value, number};

/// A token.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Token {
    Number(Value),
    Text(String),
    Name(String),
    Sign(&'static str),
}

/// Signs, the longer ones first.
const SIGNS: [&str; 24] = [
    "**", "//", "==", "!=", "<=", ">=", "<", ">", "+", "-", "*", "/", "%", "(", ")", "[", "]", "{",
    "}", ",", ":", ".", "=", "|",
];

/// The tokens of an expression.
pub(super) fn tokens(text: &str) -> Result<Vec<Token>, String> {
    let mut out = Vec::new();
    let mut rest = text.trim_start();
    while let Some(c) = rest.chars().next() {
        let follows = rest[c.len_utf8()..].chars().next();
        let used;
        if c.is_ascii_digit() || c == '.' && follows.is_some_and(|d| d.is_ascii_digit()) {
            let bytes = rest.as_bytes();
            let mut end = 0;
            while end < bytes.len() {
                let b = bytes[end];
                let sign =
                    (b == b'+' || b == b'-') && end > 0 && matches!(bytes[end - 1], b'e' | b'E');
                if !(b.is_ascii_digit() || matches!(b, b'.' | b'e' | b'E' | b'_') || sign) {
                    break;
                }
                end += 1;
            }
            let word = rest[..end].replace('_', "");
            let value = match word.parse::<i64>() {
                Ok(i) => Value::Int(i),
                Err(_) => {
                    Value::Float(number(&word).ok_or_else(|| format!("`{word}` is not a number"))?)
                }
            };
            out.push(Token::Number(value));
            used = end;
        } else if c.is_alphabetic() || c == '_' {
            let end = rest
                .find(|c: char| !c.is_alphanumeric() && c != '_')
                .unwrap_or(rest.len());
            out.push(Token::Name(rest[..end].to_string()));
            used = end;
        } else if c == '\'' || c == '"' {
            let mut value = String::new();
            let mut chars = rest.char_indices().skip(1);
            let end = loop {
                match chars.next() {
                    Some((i, d)) if d == c => break i + 1,
                    Some((_, '\\')) => match chars.next() {
                        Some((_, 'n')) => value.push('\n'),
                        Some((_, 't')) => value.push('\t'),
                        Some((_, d)) => value.push(d),
                        None => return Err("a quote is not closed".into()),
                    },
                    Some((_, d)) => value.push(d),
                    None => return Err("a quote is not closed".into()),
                }
            };
            out.push(Token::Text(value));
            used = end;
        } else {
            let sign = SIGNS.iter().find(|s| rest.starts_with(**s));
            let sign = sign.ok_or_else(|| format!("`{c}` is not understood"))?;
            out.push(Token::Sign(sign));
            used = sign.len();
        }
        rest = rest[used..].trim_start();
    }
    Ok(out)
}
