//! The YAML beside the URDF in the public collection `example-parallel-robots` (Gepetto, LAAS-CNRS)
//! of robots with closed loops.
//!
//! ```yaml
//! closed_loop: [['loop1_A', 'loop1_B']]   # pairs of URDF links that coincide
//! type: ['6d']                            # '6d': pose, '3d': position; 6d where it is missing
//! name_mot: ['mot1', 'mot2']              # actuated joints
//! joint_name: ['ball1']                   # joints that stand for others …
//! joint_type: ['SPHERICAL']               # … ball (SPHERICAL), universal (CARDAN), FIXED
//! ```
//!
//! Only what such files use of YAML is read: keys with scalars, lists in brackets (nested, over
//! several lines) and lists of dashes.

use super::Coincide;
use crate::error::{Error, Result};
use std::path::Path;

/// What a joint stands for that a URDF cannot say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stand {
    /// a ball joint: three axes
    Spherical,
    /// a universal joint: the `x` and then the `y` axis of the link
    Cardan,
    /// held at zero
    Fixed,
}

/// Such a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Closures {
    /// pairs of links and what of them coincides
    pub loops: Vec<([String; 2], Coincide)>,
    /// actuated joints
    pub actuated: Vec<String>,
    /// joints that stand for others
    pub joints: Vec<(String, Stand)>,
}

/// A value: a scalar or a list, with the line it starts on.
#[derive(Debug, Clone, PartialEq)]
enum Value {
    Scalar(String, usize),
    List(Vec<Value>, usize),
}

impl Value {
    fn line(&self) -> usize {
        match self {
            Value::Scalar(_, line) | Value::List(_, line) => *line,
        }
    }
}

/// Reads the text of such a file; `file` is what errors call it.
///
/// # Errors
/// What is no such YAML, unknown keys or types, lists of different length: with the line.
pub fn read(text: &str, file: &Path) -> Result<Closures> {
    let error = |line: usize, message: String| Error::file(file, format!("line {line}"), message);
    let mut out = Closures::default();
    let mut types: Option<Vec<(String, usize)>> = None;
    let mut names: Vec<(String, usize)> = Vec::new();
    let mut stands: Vec<(String, usize)> = Vec::new();
    let mut pairs: Vec<([String; 2], usize)> = Vec::new();
    for (key, line, value) in entries(text).map_err(|(line, why)| error(line, why))? {
        let scalars = |value: &Value| match value {
            Value::List(all, _) => all
                .iter()
                .map(|v| match v {
                    Value::Scalar(s, line) => Ok((s.clone(), *line)),
                    Value::List(_, line) => {
                        Err(error(*line, format!("{key}: a list inside the list")))
                    }
                })
                .collect::<Result<Vec<_>>>(),
            Value::Scalar(_, line) => Err(error(*line, format!("{key} must be a list"))),
        };
        match key.as_str() {
            "closed_loop" => {
                let Value::List(all, _) = &value else {
                    return Err(error(line, "closed_loop must be a list of pairs".into()));
                };
                for pair in all {
                    let names = scalars(pair)?;
                    let [(a, _), (b, _)] = &names[..] else {
                        return Err(error(
                            pair.line(),
                            format!("a loop joins two frames, here are {}", names.len()),
                        ));
                    };
                    pairs.push(([a.clone(), b.clone()], pair.line()));
                }
            }
            "type" => types = Some(scalars(&value)?),
            "name_mot" => out.actuated = scalars(&value)?.into_iter().map(|n| n.0).collect(),
            "joint_name" => names = scalars(&value)?,
            "joint_type" => stands = scalars(&value)?,
            // names and types of constraints on the world and the like do not concern the loops
            other => {
                return Err(error(
                    line,
                    format!(
                        "key `{other}` is not known; known are closed_loop, type, name_mot, \
                         joint_name, joint_type"
                    ),
                ));
            }
        }
    }
    if let Some(types) = &types
        && types.len() != pairs.len()
    {
        let line = types.first().map_or(1, |t| t.1);
        return Err(error(
            line,
            format!("{} types for {} loops", types.len(), pairs.len()),
        ));
    }
    for (i, (pair, _)) in pairs.into_iter().enumerate() {
        let coincide = match types.as_ref().map(|t| (t[i].0.to_lowercase(), t[i].1)) {
            None => Coincide::Pose,
            Some((t, _)) if t == "6d" => Coincide::Pose,
            Some((t, _)) if t == "3d" => Coincide::Position,
            Some((t, line)) => {
                return Err(error(
                    line,
                    format!("type `{t}` is not known; 3d and 6d are"),
                ));
            }
        };
        out.loops.push((pair, coincide));
    }
    if names.len() != stands.len() {
        let line = names.iter().chain(&stands).next().map_or(1, |n| n.1);
        return Err(error(
            line,
            format!("{} joint_name for {} joint_type", names.len(), stands.len()),
        ));
    }
    for ((name, line), (stand, at)) in names.into_iter().zip(stands) {
        if out.joints.iter().any(|(n, _)| *n == name) {
            return Err(error(line, format!("joint `{name}` is listed twice")));
        }
        let stand = match stand.as_str() {
            "SPHERICAL" => Stand::Spherical,
            "CARDAN" => Stand::Cardan,
            "FIXED" => Stand::Fixed,
            other => {
                return Err(error(
                    at,
                    format!("joint_type `{other}` is not known; SPHERICAL, CARDAN and FIXED are"),
                ));
            }
        };
        out.joints.push((name, stand));
    }
    Ok(out)
}

type Fault = (usize, String);

/// Keys of the top level with their values.
fn entries(text: &str) -> Result<Vec<(String, usize, Value)>, Fault> {
    let lines: Vec<&str> = text.lines().map(without_comment).collect();
    let mut out = Vec::new();
    let mut at = 0;
    while at < lines.len() {
        let (line, number) = (lines[at], at + 1);
        at += 1;
        if line.trim().is_empty() || line.trim() == "---" {
            continue;
        }
        let Some((key, rest)) = line
            .split_once(':')
            .filter(|_| !line.starts_with([' ', '\t']))
        else {
            return Err((number, "a key with a colon is expected here".into()));
        };
        let key = unquoted(key.trim());
        let mut value = rest.trim().to_string();
        if !value.is_empty() {
            // a list in brackets may go on over further lines
            while depth(&value) > 0 {
                let Some(next) = lines.get(at) else {
                    return Err((number, format!("{key}: a bracket is not closed")));
                };
                value.push(' ');
                value.push_str(next.trim());
                at += 1;
            }
            out.push((key, number, flow(&value, number)?));
            continue;
        }
        let mut items = Vec::new();
        while let Some(next) = lines.get(at) {
            let item = next.trim();
            if item.is_empty() {
                at += 1;
                continue;
            }
            let Some(mut item) = item.strip_prefix('-').map(str::trim) else {
                break;
            };
            // `- - a` opens a list in the list, further dashes of which are indented deeper
            if let Some(first) = item.strip_prefix("- ") {
                let outer = next.len() - next.trim_start().len();
                let mut inner = vec![flow(first.trim(), at + 1)?];
                let start = at + 1;
                at += 1;
                while let Some(more) = lines.get(at)
                    && more.len() - more.trim_start().len() > outer
                    && let Some(more) = more.trim().strip_prefix('-')
                {
                    inner.push(flow(more.trim(), at + 1)?);
                    at += 1;
                }
                items.push(Value::List(inner, start));
                continue;
            }
            if item.is_empty() {
                item = "''";
            }
            items.push(flow(item, at + 1)?);
            at += 1;
        }
        out.push((key, number, Value::List(items, number)));
    }
    Ok(out)
}

/// The line up to a comment.
fn without_comment(line: &str) -> &str {
    let mut quote = None;
    for (i, c) in line.char_indices() {
        match (quote, c) {
            (None, '\'' | '"') => quote = Some(c),
            (Some(q), c) if q == c => quote = None,
            (None, '#') if i == 0 || line[..i].ends_with([' ', '\t']) => return &line[..i],
            _ => {}
        }
    }
    line
}

fn unquoted(s: &str) -> String {
    for q in ['\'', '"'] {
        if let Some(inner) = s.strip_prefix(q).and_then(|s| s.strip_suffix(q)) {
            return inner.to_string();
        }
    }
    s.to_string()
}

/// Brackets that are open at the end.
fn depth(text: &str) -> i32 {
    let mut quote = None;
    let mut depth = 0;
    for c in text.chars() {
        match (quote, c) {
            (None, '\'' | '"') => quote = Some(c),
            (Some(q), c) if q == c => quote = None,
            (None, '[') => depth += 1,
            (None, ']') => depth -= 1,
            _ => {}
        }
    }
    depth
}

/// A scalar or a list in brackets.
fn flow(text: &str, line: usize) -> Result<Value, Fault> {
    let text = text.trim();
    let Some(inner) = text.strip_prefix('[') else {
        if text.starts_with(['{', '&', '*', '!', '|', '>']) {
            return Err((line, format!("`{text}` is more YAML than such files use")));
        }
        return Ok(Value::Scalar(unquoted(text), line));
    };
    let Some(inner) = inner.strip_suffix(']').filter(|_| depth(text) == 0) else {
        return Err((line, format!("brackets of `{text}` do not match")));
    };
    let mut items = Vec::new();
    let (mut quote, mut depth, mut start) = (None, 0, 0);
    for (i, c) in inner.char_indices() {
        match (quote, c) {
            (None, '\'' | '"') => quote = Some(c),
            (Some(q), c) if q == c => quote = None,
            (None, '[') if depth > 16 => return Err((line, "lists nested too deep".into())),
            (None, '[') => depth += 1,
            (None, ']') => depth -= 1,
            (None, ',') if depth == 0 => {
                items.push(flow(&inner[start..i], line)?);
                start = i + 1;
            }
            _ => {}
        }
        if depth < 0 {
            return Err((line, format!("brackets of `{text}` do not match")));
        }
    }
    if !inner[start..].trim().is_empty() {
        items.push(flow(&inner[start..], line)?);
    }
    Ok(Value::List(items, line))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flow_and_block_lists_say_the_same() {
        let flow = "# a robot\nclosed_loop: [['a_1', 'b_1'],\n  [\"a 2\", b2]]  # two\n\
                    type: ['6d', '3D']\nname_mot: ['m1', 'm2']\njoint_name: ['s']\n\
                    joint_type: ['SPHERICAL']\n";
        let block = "closed_loop:\n- - a_1\n  - b_1\n- ['a 2', b2]\ntype:\n  - 6d\n  - 3d\n\
                     name_mot:\n- m1\n- m2\njoint_name: [s]\njoint_type:\n- SPHERICAL\n";
        let read = |t: &str| read(t, Path::new("robot.yaml"));
        let first = read(flow).unwrap();
        assert_eq!(first, read(block).unwrap());
        assert_eq!(first.loops[1].0, ["a 2", "b2"]);
        assert_eq!(first.loops[1].1, Coincide::Position);
        assert_eq!(first.loops[0].1, Coincide::Pose);
        assert_eq!(first.joints, [("s".to_string(), Stand::Spherical)]);
        for (text, words) in [
            ("closed_loop: [['a']]", "line 1: a loop joins two frames"),
            (
                "closed_loop: [['a', 'b']]\ntype: ['7d']",
                "line 2: type `7d`",
            ),
            ("closed_loop: [['a', 'b'", "not closed"),
            ("closed_loop: [['a', 'b']]]", "do not match"),
            ("type: ['6d']", "1 types for 0 loops"),
            ("name_mot: mot", "must be a list"),
            ("nam_mot: ['a']", "key `nam_mot` is not known"),
            (
                "joint_name: ['a', 'a']\njoint_type: ['FIXED', 'FIXED']",
                "listed twice",
            ),
            ("joint_name: ['a']\njoint_type: []", "1 joint_name for 0"),
            ("just words", "a key with a colon"),
            ("closed_loop: &x [a]", "more YAML"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
