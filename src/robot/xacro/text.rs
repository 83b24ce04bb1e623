//! `${…}` and `$(…)` in text.

use super::expression::{Names, evaluate};
use super::scope::Entry;
use super::value::Value;
use super::{DEEPEST, Work, Wrong, packages, yaml};
use std::rc::Rc;

impl Work {
    /// Text with what stands in it, seen from the innermost scope: a value where it is one expression alone.
    pub(super) fn text(&mut self, text: &str) -> Result<Value, Wrong> {
        self.text_in(text, self.scopes.here())
    }

    pub(super) fn text_in(&mut self, text: &str, scope: usize) -> Result<Value, Wrong> {
        if !text.contains('$') {
            return Ok(text.into());
        }
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err("properties need themselves without end".into());
        }
        let mut parts: Vec<Value> = Vec::new();
        let mut plain = String::new();
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            plain.push_str(&rest[..at]);
            let here = &rest[at..];
            let dollars = here.bytes().take_while(|b| *b == b'$').count();
            let close = match here.as_bytes().get(dollars) {
                Some(b'{') => '}',
                Some(b'(') => ')',
                _ => {
                    plain.push_str(&here[..dollars]);
                    rest = &here[dollars..];
                    continue;
                }
            };
            if dollars > 1 {
                // one more than it takes says that it is text
                plain.push_str(&here[1..=dollars]);
                rest = &here[dollars + 1..];
                continue;
            }
            let Some(end) = here.find(close) else {
                return Err(format!("`{here}` is not closed"));
            };
            let inside = &here[2..end];
            if !plain.is_empty() {
                parts.push(plain.as_str().into());
                plain.clear();
            }
            parts.push(match close {
                '}' => self.expression(inside, scope)?,
                _ => self.substitution(inside, scope)?,
            });
            rest = &here[end + 1..];
        }
        plain.push_str(rest);
        if !plain.is_empty() {
            parts.push(plain.as_str().into());
        }
        self.depth -= 1;
        match <[Value; 1]>::try_from(parts) {
            Ok([one]) => Ok(one),
            Err(all) => {
                let all: Vec<String> = all.iter().map(Value::to_string).collect();
                Ok(all.concat().as_str().into())
            }
        }
    }

    /// What stands in `${…}`.
    fn expression(&mut self, text: &str, scope: usize) -> Result<Value, Wrong> {
        let inside = self.text_in(text, scope)?.to_string();
        evaluate(&inside, &mut Seen { work: self, scope }).map_err(|e| match e.contains("${") {
            // where it stands is said already
            true => e,
            false => format!("${{{inside}}}: {e}"),
        })
    }

    /// What stands in `$(…)`.
    fn substitution(&mut self, text: &str, scope: usize) -> Result<Value, Wrong> {
        let inside = self.text_in(text, scope)?.to_string();
        let (what, rest) = inside
            .trim()
            .split_once(char::is_whitespace)
            .unwrap_or((inside.trim(), ""));
        let rest = rest.trim();
        let variable = |name: &str| std::env::var(name).ok();
        let value: String = match what {
            "arg" => {
                self.asked.insert(rest.to_string());
                match self.arguments.get(rest) {
                    Some(v) => v.clone(),
                    None => {
                        return Err(format!(
                            "the argument `{rest}` has no value; state it behind the name of the file, as in \
                             \"robot.urdf.xacro {rest}:=…\""
                        ));
                    }
                }
            }
            "find" => self.package(rest)?,
            "env" => variable(rest).ok_or_else(|| format!("the environment has no `{rest}`"))?,
            "optenv" => {
                let (name, otherwise) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
                variable(name).unwrap_or_else(|| otherwise.trim().to_string())
            }
            "dirname" => {
                let folder = self.files.last().and_then(|f| f.parent());
                folder.map_or_else(String::new, |f| f.display().to_string())
            }
            "cwd" => std::env::current_dir()
                .map_err(|e| e.to_string())?
                .display()
                .to_string(),
            "eval" => return self.expression(rest, scope),
            _ => return Err(format!("`$({inside})` is not known")),
        };
        Ok(value.as_str().into())
    }

    fn package(&mut self, name: &str) -> Result<String, Wrong> {
        if let Some(found) = self.packages.get(name) {
            return Ok(found.display().to_string());
        }
        let near = self
            .files
            .iter()
            .rev()
            .find_map(|file| packages::find(name, file));
        let found = near.ok_or_else(|| {
            format!("there is no package `{name}` above the file; name the folder that it lies in in ROS_PACKAGE_PATH")
        })?;
        let text = found.display().to_string();
        self.packages.insert(name.to_string(), found);
        Ok(text)
    }

    /// Value of a property; `None` where there is none.
    pub(super) fn property(&mut self, name: &str, scope: usize) -> Result<Option<Value>, Wrong> {
        let Some((at, entry)) = self.scopes.find(name, scope) else {
            return Ok(None);
        };
        match entry {
            Entry::Value(v) => Ok(Some(v.clone())),
            Entry::Space(of) => Ok(Some(Value::Space(*of))),
            Entry::Busy => Err(format!("the property `{name}` needs itself")),
            Entry::Block(_) => Err(format!(
                "the property `{name}` holds elements; use xacro:insert_block"
            )),
            Entry::Later(text) => {
                let text = text.clone();
                self.scopes.set(at, name, Entry::Busy);
                let value = match self.text_in(&text, at)? {
                    Value::Text(t) => Value::literal(&t),
                    other => other,
                };
                self.scopes.set(at, name, Entry::Value(value.clone()));
                Ok(Some(value))
            }
        }
    }
}

/// The names that an expression sees.
struct Seen<'a> {
    work: &'a mut Work,
    scope: usize,
}

impl Names for Seen<'_> {
    fn value(&mut self, name: &str) -> Result<Option<Value>, String> {
        self.work.property(name, self.scope)
    }

    fn inside(&mut self, space: usize, name: &str) -> Result<Option<Value>, String> {
        self.work.property(name, space)
    }

    fn function(&mut self, name: &str, args: &[Value]) -> Result<Option<Value>, String> {
        let one = args.first().map(Value::to_string).unwrap_or_default();
        Ok(Some(match name {
            "load_yaml" => {
                let (path, text) = self.work.open(&one)?;
                yaml::read(&text).map_err(|e| format!("{}: {e}", path.display()))?
            }
            "abs_filename" => {
                let folder = self.work.files.last().and_then(|f| f.parent());
                let path = folder.unwrap_or(std::path::Path::new("")).join(&one);
                path.display().to_string().as_str().into()
            }
            "arg" => {
                // text, whatever it looks like
                self.work.substitution(&format!("arg {one}"), self.scope)?
            }
            "dotify" => args.first().cloned().unwrap_or(Value::Dict(Rc::default())),
            // said to whoever expands it by hand
            "message" | "warning" => "".into(),
            "error" | "fatal" => return Err(format!("the description refuses this: {one}")),
            _ => return Ok(None),
        }))
    }
}
