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

/// `a b:=1 c:=^ d:=^|'x y' *block`.
fn parameters(text: &str) -> Result<Vec<Parameter>, Wrong> {
    let mut out: Vec<Parameter> = Vec::new();
    let mut rest = text.trim_start();
    while !rest.is_empty() {
        let mut quote = None;
        let end = rest.find(|c: char| {
            match quote {
                Some(q) if c == q => quote = None,
                None if c == '\'' || c == '"' => quote = Some(c),
                None if c.is_whitespace() => return true,
                _ => {}
            }
            false
        });
        if quote.is_some() {
            return Err(format!("a quote in the parameters `{text}` is not closed"));
        }
        let (word, after) = rest.split_at(end.unwrap_or(rest.len()));
        rest = after.trim_start();
        let (name, value) = match word.split_once(":=").or_else(|| word.split_once('=')) {
            Some((name, value)) => (name, Some(value)),
            None => (word, None),
        };
        let (forward, default) = match value.map(|v| (v, v.strip_prefix('^'))) {
            None => (None, None),
            Some((_, Some(after))) => (Some(name.to_string()), after.strip_prefix('|')),
            Some((v, None)) => (None, Some(v)),
        };
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

impl Work {
    /// `xacro:macro`.
    pub(super) fn learn(&mut self, e: &Element) -> Result<(), Wrong> {
        let name = wanted(e, "name")?;
        let name = name.strip_prefix("xacro:").unwrap_or(name).to_string();
        let known = Macro {
            parameters: parameters(e.attribute("params").unwrap_or_default())?,
            body: e.children.clone(),
            file: self.files.last().cloned().unwrap_or_default(),
        };
        self.macros.insert(name, Rc::new(known));
        Ok(())
    }

    /// A call of a macro.
    pub(super) fn call(&mut self, name: &str, e: &Element) -> Result<Vec<Node>, Wrong> {
        let Some(called) = self.macros.get(name).cloned() else {
            let close = did_you_mean(name, self.macros.keys().map(String::as_str));
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
                    let scope = self.scopes.depth() - 1;
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
        self.scopes.open();
        let scope = self.scopes.depth() - 1;
        for (parameter, entry) in given {
            self.scopes.set(scope, &parameter, entry);
        }
        let line = self.line;
        self.files.push(called.file.clone());
        let out = self.nodes(&called.body)?;
        self.files.pop();
        self.line = line;
        self.scopes.close();
        Ok(out)
    }

    fn argument_of(&mut self, text: &str) -> Result<Entry, Wrong> {
        Ok(Entry::Value(match self.text(text)? {
            Value::Text(t) => Value::literal(&t),
            other => other,
        }))
    }
}
