//! Values of properties: those of Python that a description uses.

use std::rc::Rc;

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    None,
    Bool(bool),
    Int(i64),
    Float(f64),
    Text(Rc<str>),
    List(Rc<Vec<Value>>),
    Dict(Rc<Vec<(Value, Value)>>),
    /// the name space of an included file, by number
    Space(usize),
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Value::Text(text.into())
    }
}

/// As Python prints it.
impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let inner = |v: &Value| match v {
            Value::Text(t) => format!("'{t}'"),
            other => other.to_string(),
        };
        match self {
            Value::None => f.write_str("None"),
            Value::Bool(b) => f.write_str(if *b { "True" } else { "False" }),
            Value::Int(i) => write!(f, "{i}"),
            Value::Float(x) => write!(f, "{x:?}"),
            Value::Text(t) => f.write_str(t),
            Value::Space(_) => f.write_str("(a name space)"),
            Value::List(all) => {
                let all: Vec<String> = all.iter().map(inner).collect();
                write!(f, "[{}]", all.join(", "))
            }
            Value::Dict(all) => {
                let pair = |(k, v): &(Value, Value)| format!("{}: {}", inner(k), inner(v));
                let all: Vec<String> = all.iter().map(pair).collect();
                write!(f, "{{{}}}", all.join(", "))
            }
        }
    }
}

impl Value {
    /// What a property of this text holds: a number or a truth value where it is one, the text otherwise.
    pub(super) fn literal(text: &str) -> Value {
        let quoted = |q: char| text.len() >= 2 && text.starts_with(q) && text.ends_with(q);
        if quoted('\'') {
            return text[1..text.len() - 1].into();
        }
        let trimmed = text.trim();
        if text.contains('_') {
            return text.into();
        }
        if let Ok(i) = trimmed.parse::<i64>() {
            return Value::Int(i);
        }
        if let Some(x) = number(trimmed) {
            return Value::Float(x);
        }
        match text {
            "true" | "True" => Value::Bool(true),
            "false" | "False" => Value::Bool(false),
            _ => text.into(),
        }
    }

    /// As Python's `bool`.
    pub(super) fn truth(&self) -> bool {
        match self {
            Value::None => false,
            Value::Bool(b) => *b,
            Value::Int(i) => *i != 0,
            Value::Float(x) => *x != 0.0,
            Value::Text(t) => !t.is_empty(),
            Value::List(all) => !all.is_empty(),
            Value::Dict(all) => !all.is_empty(),
            Value::Space(_) => true,
        }
    }

    /// Whether a condition holds; `None` where it is no truth value.
    pub(super) fn condition(&self) -> Option<bool> {
        match self {
            Value::Text(t) => match &**t {
                "true" | "True" => Some(true),
                "false" | "False" => Some(false),
                other => other.trim().parse::<i64>().ok().map(|i| i != 0),
            },
            other => Some(other.truth()),
        }
    }

    pub(super) fn number(&self) -> Option<f64> {
        match self {
            Value::Bool(b) => Some(f64::from(u8::from(*b))),
            Value::Int(i) => Some(*i as f64),
            Value::Float(x) => Some(*x),
            _ => None,
        }
    }

    /// What it is, in messages.
    pub(super) fn kind(&self) -> &'static str {
        match self {
            Value::None => "None",
            Value::Bool(_) => "a truth value",
            Value::Int(_) | Value::Float(_) => "a number",
            Value::Text(_) => "text",
            Value::List(_) => "a list",
            Value::Dict(_) => "a dictionary",
            Value::Space(_) => "the name space of a file",
        }
    }

    /// The entry of a dictionary.
    pub(super) fn get(&self, key: &Value) -> Option<&Value> {
        match self {
            Value::Dict(all) => all.iter().find(|(k, _)| k == key).map(|(_, v)| v),
            _ => None,
        }
    }
}

/// A number as Python reads it; names such as `nan` and `inf` are none.
pub(super) fn number(text: &str) -> Option<f64> {
    let digits = text.chars().any(|c| c.is_ascii_digit());
    let able = text
        .chars()
        .all(|c| c.is_ascii_digit() || "+-.eE".contains(c));
    (digits && able).then(|| text.parse().ok()).flatten()
}
