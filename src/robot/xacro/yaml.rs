//! Values of YAML files, with the units that descriptions give there.

use super::expression::constant;
use super::value::{Value, number};
use std::rc::Rc;
use yaml_rust2::parser::{Event, MarkedEventReceiver, Parser};
use yaml_rust2::scanner::{Marker, TScalarStyle};

/// Deepest nesting of a YAML file.
const DEEPEST: usize = 64;

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
                        true => mapping(all),
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

/// Keys and values in turn, as Python reads them: of a key that stands there twice the last value counts, and what is
/// merged in with `<<` gives way to what is stated.
fn mapping(all: Vec<Value>) -> Value {
    let mut pairs: Vec<(Value, Value)> = Vec::new();
    let mut merged: Vec<(Value, Value)> = Vec::new();
    let mut rest = all.into_iter();
    while let (Some(k), Some(v)) = (rest.next(), rest.next()) {
        match (&k, v) {
            (Value::Text(t), Value::Dict(others)) if &**t == "<<" => {
                merged.extend(others.iter().cloned());
            }
            (Value::Text(t), Value::List(all)) if &**t == "<<" => {
                for one in all.iter() {
                    if let Value::Dict(others) = one {
                        merged.extend(others.iter().cloned());
                    }
                }
            }
            (_, v) => match pairs.iter_mut().find(|(known, _)| *known == k) {
                Some((_, value)) => *value = v,
                None => pairs.push((k, v)),
            },
        }
    }
    for (k, v) in merged {
        if !pairs.iter().any(|(known, _)| *known == k) {
            pairs.push((k, v));
        }
    }
    Value::Dict(Rc::new(pairs))
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
        None => constant(text)?.number()?,
    };
    Some(Value::Float(factor * x))
}

/// A YAML file.
pub(super) fn read(text: &str) -> Result<Value, String> {
    let mut reader = Reader::default();
    let mut parser = Parser::new_from_str(text);
    parser.load(&mut reader, false).map_err(|e| e.to_string())?;
    match reader.wrong {
        Some(why) => Err(why),
        None => Ok(reader.done.unwrap_or(Value::None)),
    }
}
