//! The constants of the diagnosis are documented, each with unit and origin, and stand in no other place.

use excite::diagnose::thresholds::THRESHOLDS;
use serde_json::Value;
use std::path::{Path, PathBuf};

const BEGIN: &str = "<!-- thresholds: begin -->";
const END: &str = "<!-- thresholds: end -->";

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Fields of the structs in the source: struct, field, type, comment.
fn fields(source: &str) -> Vec<[String; 4]> {
    let (mut out, mut of, mut comment) = (Vec::new(), String::new(), String::new());
    for line in source.lines().map(str::trim) {
        if let Some(text) = line.strip_prefix("///") {
            comment = format!("{comment} {}", text.trim());
            continue;
        }
        if let Some(rest) = line.strip_prefix("pub struct ") {
            of = rest.trim_end_matches(" {").into();
        } else if let Some((name, kind)) = line
            .strip_prefix("pub ")
            .and_then(|f| f.strip_suffix(','))
            .and_then(|f| f.split_once(": "))
        {
            out.push([of.clone(), name.into(), kind.into(), comment.trim().into()]);
        }
        if !line.starts_with("#[") {
            comment.clear();
        }
    }
    out
}

fn shown(value: &Value) -> String {
    match value {
        Value::Object(gate) => format!("{}, width {}", gate["centre"], gate["width"]),
        // no brackets: they would be a link
        Value::Array(all) => all.iter().map(shown).collect::<Vec<_>>().join(", "),
        other => other.to_string(),
    }
}

/// The files that the constants stand in.
fn sources() -> Vec<PathBuf> {
    let mut files = vec![root().join("src/diagnose/thresholds.rs")];
    files.extend(inside("src/diagnose/thresholds"));
    files
}

/// The files of a folder, in order.
fn inside(folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(root().join(folder)).expect("a folder of the sources");
    let mut files: Vec<PathBuf> = entries.map(|e| e.expect("an entry").path()).collect();
    files.sort();
    files
}

/// The table of `docs/diagnosis-method.md`.
fn table() -> String {
    let texts: Vec<String> = sources().iter().map(|f| read(f)).collect();
    let fields = fields(&texts.concat());
    let all = serde_json::to_value(THRESHOLDS).expect("numbers");
    let groups = all.as_object().expect("a struct");
    let named = fields.iter().filter(|f| f[0] == "Thresholds").count();
    assert_eq!(named, groups.len());
    let mut rows = vec![
        "| constant | value | unit | meaning | source |".to_string(),
        "|---|---|---|---|---|".to_string(),
    ];
    for [_, group, kind, _] in fields.iter().filter(|f| f[0] == "Thresholds") {
        let values = groups[group].as_object().expect("a struct");
        let mine: Vec<_> = fields.iter().filter(|f| &f[0] == kind).collect();
        assert_eq!(mine.len(), values.len(), "{group}");
        for field in mine {
            let name = &field[1];
            let (meaning, rest) = field[3]
                .split_once(" Unit: ")
                .unwrap_or_else(|| panic!("{group}.{name} has no unit"));
            let (unit, source) = rest
                .split_once(". Source: ")
                .unwrap_or_else(|| panic!("{group}.{name} has no source"));
            let value = shown(&values[name]);
            let source = source.trim_end_matches('.');
            rows.push(format!(
                "| `{group}.{name}` | {value} | {unit} | {meaning} | {source} |"
            ));
        }
    }
    rows.join("\n")
}

/// With `EXCITE_WRITE_DOCS=1` the table is written, otherwise compared.
#[test]
fn every_threshold_is_in_the_document_with_value_unit_and_source() {
    let path = root().join("docs/diagnosis-method.md");
    let text = read(&path);
    let (before, rest) = text.split_once(BEGIN).expect("the table's begin");
    let (stated, after) = rest.split_once(END).expect("the table's end");
    let table = table();
    if std::env::var_os("EXCITE_WRITE_DOCS").is_some() {
        let text = format!("{before}{BEGIN}\n{table}\n{END}{after}");
        std::fs::write(&path, text).expect("docs/diagnosis-method.md can be written");
        return;
    }
    for (line, want) in stated.trim().lines().zip(table.lines()) {
        assert_eq!(line, want, "run this test with EXCITE_WRITE_DOCS=1");
    }
    assert_eq!(stated.trim().lines().count(), table.lines().count());
}

/// Numbers in code: neither in comments nor in strings, nor part of a name.
fn numbers(source: &str) -> Vec<(usize, String)> {
    let mut out = Vec::new();
    for (at, line) in source.lines().enumerate() {
        let code: String = line.split("//").next().unwrap_or("").into();
        let code: String = code.split('"').step_by(2).collect();
        let mut before = ' ';
        let mut chars = code.chars().peekable();
        while let Some(c) = chars.next() {
            if c.is_ascii_digit() && !(before.is_alphanumeric() || before == '_') {
                let mut number = c.to_string();
                while let Some(n) = chars.peek().copied() {
                    let exponent = n == '-' && number.ends_with('e');
                    // `0..n` is a range, `x.0.y` a field
                    let point = n == '.' && !number.contains('.') && {
                        let mut ahead = chars.clone();
                        ahead.next();
                        ahead.peek().is_some_and(char::is_ascii_digit)
                    };
                    if !(n.is_ascii_alphanumeric() || n == '_' || exponent || point) {
                        break;
                    }
                    number.push(n);
                    chars.next();
                }
                before = number.chars().last().unwrap_or(' ');
                let number = number.replace('_', "");
                let number = ["f64", "usize", "i32"]
                    .iter()
                    .fold(number.as_str(), |n, t| n.trim_end_matches(t))
                    .to_string();
                out.push((at + 1, number));
            } else {
                before = c;
            }
        }
    }
    out
}

#[test]
fn the_scanner_sees_numbers_and_nothing_else() {
    let source = "let x = 0.35 * y2 + f1.0 - 1e-9; // 17\nlet t = (\"12\", 4..n, a[3], 6_f64);";
    let found: Vec<String> = numbers(source).into_iter().map(|n| n.1).collect();
    assert_eq!(found, ["0.35", "0", "1e-9", "4", "3", "6"]);
}

/// Numbers that decide nothing: 1e-9, 1e-12 and 1e-300 keep divisions away from zero, 100 makes percents.
const HARMLESS: [f64; 8] = [0.0, 1.0, 2.0, 0.5, 1e-9, 1e-12, 1e-300, 100.0];

/// Fails for each number of a file, tests left out, that `counts` and is neither harmless nor one of a
/// `formula`.
fn none_left(file: &Path, formula: &[f64], counts: impl Fn(&str) -> bool) {
    let text = read(file);
    let code = text.split("#[cfg(test)]").next().unwrap_or("");
    for (line, number) in numbers(code).into_iter().filter(|n| counts(&n.1)) {
        let value: f64 = number
            .parse()
            .unwrap_or_else(|_| panic!("{number} in {}", file.display()));
        assert!(
            HARMLESS.contains(&value) || formula.contains(&value),
            "{}:{line}: {number} belongs into src/diagnose/thresholds",
            file.display()
        );
    }
}

#[test]
fn no_bare_number_is_left_in_the_verdict() {
    let mut files = vec![root().join("src/diagnose/verdict.rs")];
    files.extend(inside("src/diagnose/verdict"));
    assert!(files.len() > 5);
    files.iter().for_each(|f| none_left(f, &[], |_| true));
}

/// Whole numbers there are lengths of arrays and indices. Formulas have numbers of their own: the golden
/// ratio, the polynomial of Hermite, the mean over a triangle.
#[test]
fn no_bare_fraction_is_left_in_the_stages_about_the_verdict() {
    let stages = [
        "gap",
        "search",
        "closeness",
        "interval",
        "controller",
        "forward",
        "next",
        "next/trial",
        "next/motions",
        "prior",
        "reversal",
        "noise",
        "noise_floor",
        "window",
        "finding",
        "decoy",
        "data",
        "payload",
        "improve",
        "carried",
        "at_rest",
        "result",
    ];
    let formulas: [f64; 4] = [0.618_033_988_749_895, 3.0, 10.0, 12.0];
    for stage in stages {
        let file = root().join(format!("src/diagnose/{stage}.rs"));
        let formula: &[f64] = match stage {
            "decoy" => &formulas[..1],
            "window" => &formulas[1..],
            _ => &[],
        };
        none_left(&file, formula, |n| n.contains(['.', 'e']));
    }
}
