//! Macros: parameters, defaults, blocks.

use super::directive::wanted;
use super::scope::Entry;
use super::tree::{Element, Node};
use super::value::Value;
use super::{Work, Wrong};
use crate::robot::file::names::did_you_mean;
use std::path::PathBuf;
use std::rc::Rc;

/// A macro.
pub(super) struct Macro {
    parameters: Vec<Parameter>,
    body: Vec<Node>,
    /// the file that it stands in
    file: PathBuf,
}

/// A parameter; of a block, `name` begins with one or two stars.
#[derive(Debug, PartialEq)]
struct Parameter {
    name: String,
    /// a property outside by which it is given
    forward: Option<String>,
    default: Option<String>,
}

/// `a b:=1 c:=^ d:=^|'x y' e:=${2 * b} *block`, with or without spaces around `:=`.
fn parameters(text: &str) -> Result<Vec<Parameter>, Wrong> {
    let mut out: Vec<Parameter> = Vec::new();
    let mut rest = text.trim_start();
    while !rest.is_empty() {
        let end = rest.find(|c: char| c.is_whitespace() || c == ':' || c == '=');
        let (name, behind) = rest.split_at(end.unwrap_or(rest.len()));
        let behind = behind.trim_start();
        let stated = behind
            .strip_prefix(":=")
            .or_else(|| behind.strip_prefix('='));
        let (mut forward, mut default) = (None, None);
        match stated {
            None => rest = behind,
            Some(mut value) => {
                value = value.trim_start();
                if let Some(after) = value.strip_prefix('^') {
                    forward = Some(name.to_string());
                    value = after.strip_prefix('|').unwrap_or(after);
                }
                let end = length(value)
                    .ok_or_else(|| format!("a default in the parameters `{text}` is not closed"))?;
                default = Some(&value[..end]).filter(|v| !v.is_empty());
                rest = value[end..].trim_start();
            }
        }
        let bare = name.trim_start_matches('*');
        if bare.is_empty() || out.iter().any(|p| p.name == name) {
            return Err(format!(
                "the parameter `{name}` has no name, or stands there twice"
            ));
        }
        out.push(Parameter {
            name: name.to_string(),
            forward,
            default: default.map(str::to_string),
        });
    }
    Ok(out)
}

/// Length of a default up to white space, of which quotes and expressions may have some; `None` where they are not closed.
fn length(text: &str) -> Option<usize> {
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        let close = match c {
            '\'' | '"' => c,
            '$' if rest.starts_with("${") => '}',
            '$' if rest.starts_with("$(") => ')',
            _ if c.is_whitespace() => break,
            _ => {
                at += c.len_utf8();
                continue;
            }
        };
        at += c.len_utf8() + rest[c.len_utf8()..].find(close)? + close.len_utf8();
    }
    Some(at)
}

impl Work {
    /// `xacro:macro`.
    pub(super) fn learn(&mut self, e: &Element) -> Result<(), Wrong> {
        let name = wanted(e, "name")?;
        let name = name.strip_prefix("xacro:").unwrap_or(name).to_string();
        if name == "call" || name.contains('.') {
            return Err(format!(
                "a macro cannot be called `{name}`: xacro:call and points have a meaning of their own"
            ));
        }
        let known = Macro {
            parameters: parameters(e.attribute("params").unwrap_or_default())?,
            body: e.children.clone(),
            file: self.files.last().cloned().unwrap_or_default(),
        };
        self.scopes.learn(name, Rc::new(known));
        Ok(())
    }

    /// A call of a macro.
    pub(super) fn call(&mut self, name: &str, e: &Element) -> Result<Vec<Node>, Wrong> {
        let Some((sees, called)) = self.scopes.called(name) else {
            let known = self.scopes.names();
            let close = did_you_mean(name, known.iter().map(String::as_str));
            return Err(format!("there is no macro `{name}`{close}"));
        };
        let mut given: Vec<(String, Entry)> = Vec::new();
        for (parameter, text) in &e.attributes {
            if !called.parameters.iter().any(|p| p.name == *parameter) {
                return Err(format!("the macro `{name}` has no parameter `{parameter}`"));
            }
            given.push((parameter.clone(), self.argument_of(text)?));
        }
        let mut blocks = self
            .nodes(&e.children)?
            .into_iter()
            .filter_map(|n| match n {
                Node::Element(e) => Some(e),
                Node::Text(_) => None,
            });
        self.line = e.line;
        for p in &called.parameters {
            if given.iter().any(|(n, _)| *n == p.name) {
                continue;
            }
            let entry = match (&p.forward, &p.default) {
                _ if p.name.starts_with('*') => {
                    let block = blocks.next().ok_or_else(|| {
                        format!("the macro `{name}` needs the block `{}`", p.name)
                    })?;
                    Entry::Block(match p.name.starts_with("**") {
                        true => block.children,
                        false => vec![Node::Element(block)],
                    })
                }
                (Some(outer), default) => {
                    let scope = self.scopes.here();
                    match (self.property(outer, scope)?, default) {
                        (Some(v), _) => Entry::Value(v),
                        (None, Some(text)) => self.argument_of(text)?,
                        (None, None) => {
                            return Err(format!(
                                "the macro `{name}` needs the property `{outer}`, which is not defined"
                            ));
                        }
                    }
                }
                (None, Some(text)) => self.argument_of(text)?,
                (None, None) => {
                    return Err(format!(
                        "the macro `{name}` needs the parameter `{}`",
                        p.name
                    ));
                }
            };
            given.push((p.name.clone(), entry));
        }
        if blocks.next().is_some() {
            return Err(format!(
                "the macro `{name}` has no parameter for a block that is given"
            ));
        }
        let before = self.scopes.open(sees);
        let scope = self.scopes.here();
        for (parameter, entry) in given {
            self.scopes.set(scope, &parameter, entry);
        }
        let line = self.line;
        self.files.push(called.file.clone());
        let out = self.nodes(&called.body)?;
        self.files.pop();
        self.line = line;
        self.scopes.close(before);
        Ok(out)
    }

    fn argument_of(&mut self, text: &str) -> Result<Entry, Wrong> {
        Ok(Entry::Value(match self.text(text)? {
            Value::Text(t) => Value::literal(&t),
            other => other,
        }))
    }
}
