//! JSON: one object a line (JSON Lines), a list of objects, or one object of lists.
//!
//! | text | columns |
//! |---|---|
//! | `{"t": 0.1, "q": [0.2, 0.3]}`, one a line or in a list | `t`, `q[0]`, `q[1]`; `state.q[0]` of objects in objects |
//! | `{"t": [0.1, …], "q": [[0.2, 0.3], …]}` | as NumPy's arrays of these names |
//! | `{"t": {"0": 0.1, "1": …}, …}`, as pandas writes a table | `t`, … |
//!
//! A text that stays the same in all rows is a label, as `name[0]` beside `position[0]`; a date is a number of seconds.

use super::arrays::{self, Array};
use super::csv::{self, Left};
use super::{dialect, source};
use crate::error::{Error, Result};
use crate::log::Table;
use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use std::collections::HashMap;
use std::fmt;
use std::io::Read as _;
use std::path::Path;

/// Columns at the most.
const COLUMNS: usize = 10_000;

/// Whether a text begins as an object, or as a list of objects, and not as a cell of a table.
pub(super) fn begins(head: &[u8]) -> bool {
    let mut signs = head.iter().filter(|b| !b.is_ascii_whitespace());
    matches!(
        (signs.next(), signs.next()),
        (Some(b'{'), Some(b'"' | b'}')) | (Some(b'['), Some(b'{'))
    )
}

pub(super) fn read(path: &Path) -> Result<Table> {
    let mut text = String::new();
    source::open(path)
        .and_then(|mut s| s.read.read_to_string(&mut text))
        .map_err(|e| Error::io(path, e))?;
    let mut lines = (text.lines().enumerate()).filter(|(_, line)| !line.trim().is_empty());
    let (first, second) = (lines.next(), lines.next());
    let row = |line: &str| match serde_json::from_str(line) {
        Ok(row @ Node::Object(_)) => Ok(row),
        Ok(_) => Err("it is no object".to_string()),
        Err(e) => Err(e.to_string()),
    };
    let several = second.is_some() && first.is_some_and(|(_, line)| row(line).is_ok());
    let mut table = match several {
        true => {
            let mut rows = Rows::default();
            let mut left = Left::default();
            for (i, line) in first.into_iter().chain(second).chain(lines) {
                match row(line) {
                    Ok(row) => rows.push(&row, path)?,
                    Err(what) => {
                        left.count += 1;
                        left.name(|| format!("line {}: {what}", i + 1));
                    }
                }
            }
            let count = rows.count;
            let mut table = rows.table();
            if let Some(first) = left.first.first() {
                if left.count > count {
                    let all = left.count + count;
                    let message = format!("{} of {all} lines are no JSON; {first}", left.count);
                    return Err(Error::file(path, "", message));
                }
                table.warnings.push(left.warning(path));
            }
            table
        }
        false => match serde_json::from_str(&text) {
            Ok(whole) => of_whole(whole, path)?,
            Err(e) => {
                let at = format!("line {}", e.line());
                return Err(Error::file(path, at, format!("it is no JSON: {e}")));
            }
        },
    };
    csv::whole_stamp(&mut table);
    Ok(table)
}

/// A list of rows, or an object that holds columns or one list of rows.
fn of_whole(whole: Node, path: &Path) -> Result<Table> {
    if let Node::List(list) = &whole {
        return of_rows(list, path);
    }
    let mut found = Found::default();
    found.gather("", whole);
    match found.rows.pop() {
        // a head beside the rows
        Some(rows) if found.longest() < rows.len() => of_rows(&rows, path),
        _ => arrays::table(found.arrays, path),
    }
}

fn of_rows(list: &[Node], path: &Path) -> Result<Table> {
    let mut rows = Rows::default();
    list.iter().try_for_each(|row| rows.push(row, path))?;
    Ok(rows.table())
}

/// A value; the members of an object in the order of the file.
enum Node {
    Nothing,
    Number(f64),
    Text(String),
    List(Vec<Node>),
    Object(Vec<(String, Node)>),
}

impl Node {
    /// A number, also in a text, or a date; NaN where it is missing.
    fn number(&self) -> Option<f64> {
        match self {
            Node::Nothing => Some(f64::NAN),
            Node::Number(x) => Some(*x),
            Node::Text(text) => text
                .trim()
                .parse()
                .ok()
                .or_else(|| dialect::stamp(text.as_bytes())),
            _ => None,
        }
    }

    /// The members of an object whose keys count from 0, as a list.
    fn counted(self) -> Node {
        match self {
            Node::Object(all) if !all.is_empty() => {
                let counts = |(i, (key, _)): (usize, &(String, Node))| *key == i.to_string();
                match all.iter().enumerate().all(counts) {
                    true => Node::List(all.into_iter().map(|(_, v)| v).collect()),
                    false => Node::Object(all),
                }
            }
            other => other,
        }
    }
}

impl<'de> Deserialize<'de> for Node {
    fn deserialize<D: Deserializer<'de>>(from: D) -> std::result::Result<Self, D::Error> {
        struct Any;
        impl<'de> Visitor<'de> for Any {
            type Value = Node;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a value")
            }
            fn visit_unit<E>(self) -> std::result::Result<Node, E> {
                Ok(Node::Nothing)
            }
            fn visit_bool<E>(self, x: bool) -> std::result::Result<Node, E> {
                Ok(Node::Number(f64::from(u8::from(x))))
            }
            fn visit_f64<E>(self, x: f64) -> std::result::Result<Node, E> {
                Ok(Node::Number(x))
            }
            fn visit_i64<E>(self, x: i64) -> std::result::Result<Node, E> {
                Ok(Node::Number(x as f64))
            }
            fn visit_u64<E>(self, x: u64) -> std::result::Result<Node, E> {
                Ok(Node::Number(x as f64))
            }
            fn visit_str<E>(self, x: &str) -> std::result::Result<Node, E> {
                Ok(Node::Text(x.into()))
            }
            fn visit_seq<A: SeqAccess<'de>>(
                self,
                mut all: A,
            ) -> std::result::Result<Node, A::Error> {
                let mut list = Vec::new();
                while let Some(one) = all.next_element()? {
                    list.push(one);
                }
                Ok(Node::List(list))
            }
            fn visit_map<A: MapAccess<'de>>(
                self,
                mut all: A,
            ) -> std::result::Result<Node, A::Error> {
                let mut list = Vec::new();
                while let Some(one) = all.next_entry()? {
                    list.push(one);
                }
                Ok(Node::Object(list))
            }
        }
        from.deserialize_any(Any)
    }
}

/// Rows, each an object or a list.
#[derive(Default)]
struct Rows {
    at: HashMap<String, usize>,
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
    /// texts by name, and nothing once they change
    texts: Vec<(String, Option<String>)>,
    count: usize,
}

impl Rows {
    fn push(&mut self, row: &Node, path: &Path) -> Result<()> {
        self.count += 1;
        match row {
            // columns without names are counted
            Node::List(cells) => (cells.iter().enumerate())
                .for_each(|(k, cell)| self.cell(&(k + 1).to_string(), cell)),
            other => self.cell("", other),
        }
        if self.names.len() > COLUMNS {
            let message = format!("it has more than {COLUMNS} columns: is it a log?");
            return Err(Error::file(path, format!("row {}", self.count), message));
        }
        Ok(())
    }

    fn cell(&mut self, name: &str, node: &Node) {
        match node {
            Node::Object(all) => all
                .iter()
                .for_each(|(key, v)| self.cell(&within(name, key), v)),
            Node::List(all) => {
                (all.iter().enumerate()).for_each(|(k, v)| self.cell(&format!("{name}[{k}]"), v))
            }
            Node::Nothing => {}
            one => match (one.number(), one) {
                (Some(x), _) => self.number(name, x),
                (None, Node::Text(text)) => self.text(name, text),
                _ => {}
            },
        }
    }

    fn number(&mut self, name: &str, x: f64) {
        let next = self.names.len();
        let k = match self.at.get(name) {
            Some(k) => *k,
            None if next > COLUMNS => return,
            None => {
                self.at.insert(name.into(), next);
                self.names.push(name.into());
                self.columns.push(Vec::new());
                next
            }
        };
        let column = &mut self.columns[k];
        column.resize(self.count - 1, f64::NAN);
        column.push(x);
    }

    fn text(&mut self, name: &str, text: &str) {
        let known = self.texts.iter_mut().find(|(n, _)| n == name);
        if let Some((_, known)) = known {
            if known.as_deref() != Some(text) {
                *known = None;
            }
        } else if self.texts.len() <= COLUMNS {
            self.texts.push((name.into(), Some(text.into())));
        }
    }

    fn table(mut self) -> Table {
        for column in &mut self.columns {
            column.resize(self.count, f64::NAN);
        }
        let labels = self.texts.into_iter();
        Table {
            names: self.names,
            columns: self.columns,
            labels: labels
                .filter_map(|(name, text)| Some([name, text?]))
                .collect(),
            ..Table::default()
        }
    }
}

/// Name of a member of an object.
fn within(name: &str, key: &str) -> String {
    match name.is_empty() {
        true => key.into(),
        false => format!("{name}.{key}"),
    }
}

/// What one object holds.
#[derive(Default)]
struct Found {
    arrays: Vec<Array>,
    /// lists of objects
    rows: Vec<Vec<Node>>,
}

impl Found {
    fn gather(&mut self, name: &str, node: Node) {
        match node.counted() {
            Node::Object(all) => {
                (all.into_iter()).for_each(|(key, node)| self.gather(&within(name, &key), node))
            }
            Node::List(list) => {
                if list.iter().any(|v| matches!(v, Node::Object(_))) {
                    self.rows.push(list);
                    self.rows.sort_by_key(Vec::len);
                } else if let Some(array) = array(name, &list) {
                    self.arrays.push(array);
                }
            }
            _ => {}
        }
    }

    /// Samples of the longest array.
    fn longest(&self) -> usize {
        self.arrays.iter().map(|a| a.rows).max().unwrap_or(0)
    }
}

/// A list of numbers, or of lists of as many numbers each.
fn array(name: &str, list: &[Node]) -> Option<Array> {
    let name = name.to_string();
    let numbers: Option<Vec<f64>> = list.iter().map(Node::number).collect();
    if let Some(values) = numbers {
        let rows = values.len();
        return Some(Array {
            name,
            rows,
            columns: 1,
            values,
        });
    }
    let rows: Option<Vec<Vec<f64>>> = list
        .iter()
        .map(|row| match row {
            Node::List(row) => row.iter().map(Node::number).collect(),
            _ => None,
        })
        .collect();
    let rows = rows?;
    let columns = rows.first()?.len();
    if rows.iter().any(|r| r.len() != columns) {
        return None;
    }
    let values = (0..columns).flat_map(|k| rows.iter().map(move |r| r[k]));
    Some(Array {
        name,
        rows: rows.len(),
        columns,
        values: values.collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Result<Table> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.json");
        std::fs::write(&path, text).unwrap();
        assert!(begins(&text.as_bytes()[..text.len().min(132)]));
        read(&path)
    }

    const LINE: &str = r#"{"header": {"sec": 5, "nanosec": 250000000}, "name": ["b", "a"], "q": [1.5, 2], "ok": true}"#;

    #[test]
    fn lines_of_objects_are_rows() {
        let text = format!(
            "{LINE}\n\n{LINE}\nnonsense\n{}",
            LINE.replace("1.5", "null")
        );
        let table = table(&text).unwrap();
        assert_eq!(
            table.names,
            ["header.sec", "header.nanosec", "q[0]", "q[1]", "ok"]
        );
        assert_eq!(table.columns[0], [5.25; 3]);
        assert_eq!(table.columns[2][..2], [1.5; 2]);
        assert!(table.columns[2][2].is_nan());
        assert_eq!(table.labels[1], ["name[1]".to_string(), "a".into()]);
        assert!(
            table.warnings[0].message.contains("line 4"),
            "{:?}",
            table.warnings
        );
    }

    #[test]
    fn lists_of_objects_and_objects_of_lists_are_tables() {
        let list = table(r#"[{"t": 0, "z": 1, "b": 7}, {"t": 0.1, "z": 2, "b": 8}]"#).unwrap();
        assert_eq!(list.names, ["t", "z", "b"]);
        assert_eq!(list.columns[0], [0.0, 0.1]);
        let head = table(r#"{"rate": 10, "data": [{"t": 0}, {"t": 0.1}]}"#).unwrap();
        assert_eq!(head.columns, [[0.0, 0.1]]);
        let columns =
            table(r#"{"t": [0, 0.1, 0.2], "arm": {"q": [[1, 2], [3, 4], [5, 6]]}}"#).unwrap();
        assert_eq!(columns.names, ["t", "arm.q[0]", "arm.q[1]"]);
        assert_eq!(columns.columns[2], [2.0, 4.0, 6.0]);
        let pandas = table(r#"{"t": {"0": 0, "1": 0.1}, "q1": {"0": 3, "1": 4}}"#).unwrap();
        assert_eq!(pandas.names, ["t", "q1"]);
        assert_eq!(pandas.columns[1], [3.0, 4.0]);
    }

    #[test]
    fn what_is_no_log_is_refused() {
        for (text, why) in [
            ("{\"t\": [1, 2", "line 1"),
            ("{}", "no array"),
            ("{\"a\": 1}\n{\"a\"\n{\"a\"\n", "of 3 lines"),
        ] {
            let e = table(text).unwrap_err().to_string();
            assert!(e.contains(why), "{e}");
        }
        assert!(!begins(b"[0.1, 0.2];[1, 2]") && !begins(b"t,q1,tau1") && !begins(b""));
    }
}
