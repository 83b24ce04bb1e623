//! Values of properties: those of Python that a description uses, and YAML files as such.

use std::rc::Rc;
use yaml_rust2::parser::{Event, MarkedEventReceiver, Parser};
use yaml_rust2::scanner::{Marker, TScalarStyle};

/// Deepest nesting of a YAML file.
const DEEPEST: usize = 64;

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

/// Nodes of a YAML file that are not closed yet.
#[derive(Default)]
struct Reader {
    open: Vec<(Vec<Value>, bool, usize)>,
    anchors: Vec<(usize, Value)>,
    done: Option<Value>,
    wrong: Option<String>,
}

impl MarkedEventReceiver for Reader {
    fn on_event(&mut self, event: Event, mark: Marker) {
        match event {
            Event::Scalar(text, style, anchor, tag) => {
                let plain = matches!(style, TScalarStyle::Plain);
                let mut value = if plain {
                    plain_scalar(&text)
                } else {
                    text.as_str().into()
                };
                if let Some(tag) = tag.filter(|t| t.handle == "!") {
                    match tagged(&tag.suffix, &value, &text) {
                        Some(v) => value = v,
                        None => {
                            let line = mark.line();
                            let more =
                                format!("line {line}: `!{} {text}` is not known", tag.suffix);
                            self.wrong.get_or_insert(more);
                        }
                    }
                }
                self.put(value, anchor);
            }
            Event::Alias(id) => {
                let found = self.anchors.iter().find(|(i, _)| *i == id);
                let value = found.map_or(Value::None, |(_, v)| v.clone());
                self.put(value, 0);
            }
            Event::SequenceStart(anchor, _) => self.begin(false, anchor, mark),
            Event::MappingStart(anchor, _) => self.begin(true, anchor, mark),
            Event::SequenceEnd | Event::MappingEnd => {
                if let Some((all, map, anchor)) = self.open.pop() {
                    let value = match map {
                        false => Value::List(Rc::new(all)),
                        true => {
                            let mut pairs: Vec<(Value, Value)> = Vec::new();
                            let mut rest = all.into_iter();
                            while let (Some(k), Some(v)) = (rest.next(), rest.next()) {
                                pairs.push((k, v));
                            }
                            Value::Dict(Rc::new(pairs))
                        }
                    };
                    self.put(value, anchor);
                }
            }
            _ => {}
        }
    }
}

impl Reader {
    fn begin(&mut self, map: bool, anchor: usize, mark: Marker) {
        if self.open.len() > DEEPEST {
            self.wrong
                .get_or_insert(format!("line {}: it is nested too deeply", mark.line()));
        }
        self.open.push((Vec::new(), map, anchor));
    }

    fn put(&mut self, value: Value, anchor: usize) {
        if anchor > 0 {
            self.anchors.push((anchor, value.clone()));
        }
        match self.open.last_mut() {
            Some((all, _, _)) => all.push(value),
            None => {
                self.done.get_or_insert(value);
            }
        }
    }
}

/// A scalar without quotes.
fn plain_scalar(text: &str) -> Value {
    match text {
        "" | "~" | "null" | "Null" | "NULL" => Value::None,
        "true" | "True" | "TRUE" | "yes" | "Yes" | "on" | "On" => Value::Bool(true),
        "false" | "False" | "FALSE" | "no" | "No" | "off" | "Off" => Value::Bool(false),
        _ => match text.parse::<i64>() {
            Ok(i) => Value::Int(i),
            Err(_) => number(text).map_or_else(|| text.into(), Value::Float),
        },
    }
}

/// The units of descriptions in YAML: in rad, m, s.
fn tagged(unit: &str, value: &Value, text: &str) -> Option<Value> {
    let factor = match unit {
        "radians" | "meters" | "seconds" => 1.0,
        "degrees" => std::f64::consts::PI / 180.0,
        "millimeters" => 1e-3,
        "inches" => 0.0254,
        "foot" => 0.3048,
        "yards" => 0.9144,
        _ => return None,
    };
    let x = match value.number() {
        Some(x) => x,
        // such as 2*pi
        None => super::expression::constant(text)?.number()?,
    };
    Some(Value::Float(factor * x))
}

/// A YAML file.
pub(super) fn yaml(text: &str) -> Result<Value, String> {
    let mut reader = Reader::default();
    let mut parser = Parser::new_from_str(text);
    parser.load(&mut reader, false).map_err(|e| e.to_string())?;
    match reader.wrong {
        Some(why) => Err(why),
        None => Ok(reader.done.unwrap_or(Value::None)),
    }
}
