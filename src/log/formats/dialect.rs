//! How a text file of cells is laid out, found out from its first lines: delimiter, decimal comma, names,
//! lists in cells, columns of texts and of stamps.

use crate::error::listed;
use crate::log::number;
use crate::log::unit::unit;

/// Lines that are looked at.
const LINES: usize = 200;

/// What stands in a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cell {
    /// numbers
    Number,
    /// a date or a time of day
    Stamp,
    /// nothing in the lines that were looked at: numbers may come later
    Empty,
    /// anything else
    Text,
}

/// Layout of a file.
#[derive(Debug, Clone)]
pub(crate) struct Dialect {
    /// between cells; a space stands for any run of blanks
    pub delimiter: u8,
    /// whether numbers have a comma for a point
    pub comma: bool,
    /// whether lines are plain cells that can be parsed as they stand
    pub plain: bool,
    /// names of the columns, or their numbers from 1
    pub names: Vec<String>,
    /// what the columns hold
    pub cells: Vec<Cell>,
    /// the text that a column of texts holds in all lines that were looked at
    pub texts: Vec<Option<String>>,
    /// a column of texts that come in turn, and these: rows are of one joint each
    pub turns: Option<(String, Vec<String>)>,
    /// lines before the first of numbers
    pub head: usize,
    /// a line that looks like names and was not used, because it has so many for other columns
    pub unused: Option<String>,
}

/// Whether a line has nothing to read.
pub(super) fn idle(line: &[u8]) -> bool {
    let line = line.trim_ascii();
    line.is_empty() || matches!(line[0], b'#' | b'%') || line.starts_with(b"//")
}

/// The cells of a line in canonical form, see [`canonical`].
fn cells(line: &[u8], delimiter: u8, comma: bool) -> Vec<Vec<u8>> {
    let mut out = Vec::new();
    canonical(line, delimiter, comma, &mut out);
    out.split(|b| *b == b',').map(<[u8]>::to_vec).collect()
}

/// Appends a text with its cells separated by commas and decimal points in numbers: quotes and brackets
/// taken away, lists laid open to cells of their own, runs of blanks as one separator where blanks separate.
pub(super) fn canonical(text: &[u8], delimiter: u8, comma: bool, out: &mut Vec<u8>) {
    for line in text.split_inclusive(|b| *b == b'\n') {
        let (body, end) = match line.strip_suffix(b"\n") {
            Some(body) => (body.strip_suffix(b"\r").unwrap_or(body), &b"\n"[..]),
            None => (line, &b""[..]),
        };
        if idle(body) {
            out.extend(end);
            continue;
        }
        let blank = |b: &u8| b.is_ascii_whitespace() && (*b != delimiter || delimiter == b' ');
        let ends = body.iter().rev().take_while(|b| blank(b)).count();
        let body = &body[..body.len() - ends];
        let body = if delimiter == b' ' {
            body.trim_ascii_start()
        } else {
            body
        };
        if !body.iter().fold(false, |any, c| any | special(c)) {
            simple(body, delimiter, comma, out);
            out.extend(end);
            continue;
        }
        let (mut depth, mut quoted) = (0u32, None);
        // whether a separator is due before the next character
        let mut due = false;
        let mut empty_list = false;
        for &c in body {
            match c {
                b'"' | b'\'' if quoted == Some(c) => quoted = None,
                b'"' | b'\'' if quoted.is_none() => quoted = Some(c),
                b'(' if typed(out) => {
                    depth += 1;
                    empty_list = true;
                }
                b'[' | b'('
                    if quoted.is_some()
                        || depth > 0
                        || matches!(last(out), None | Some(b',' | b'\n'))
                        || due
                        || out.last() == Some(&b' ') =>
                {
                    depth += 1;
                    empty_list = true;
                }
                b']' | b')' if depth > 0 => {
                    depth -= 1;
                    due = false;
                }
                b',' | b';' | b' ' | b'\t' if depth > 0 => due = !empty_list,
                _ if depth == 0
                    && quoted.is_none()
                    && (c == delimiter || delimiter == b' ' && c == b'\t') =>
                {
                    match delimiter {
                        b' ' => due = true,
                        _ => out.push(b','),
                    }
                }
                b',' if quoted.is_some() && !comma => out.push(b' '),
                _ => {
                    if due {
                        out.push(b',');
                        due = false;
                    }
                    empty_list = false;
                    out.push(match c {
                        b',' if comma => b'.',
                        b',' => b' ',
                        other => other,
                    });
                }
            }
        }
        out.extend(end);
    }
}

/// Whether a byte may begin or end more than itself.
fn special(c: &u8) -> bool {
    matches!(c, b'"' | b'\'' | b'[' | b'(')
}

/// [`canonical`] of a line without quotes and brackets, and without blanks at its ends.
fn simple(line: &[u8], delimiter: u8, comma: bool, out: &mut Vec<u8>) {
    let instead = if comma { b'.' } else { b' ' };
    let of = |c: u8| if c == b',' { instead } else { c };
    let parts = |c: u8| c == delimiter || delimiter == b' ' && c == b'\t';
    let pairs = line.iter().zip(line.iter().skip(1));
    let runs = delimiter == b' ' && pairs.fold(false, |any, (a, b)| any | (parts(*a) & parts(*b)));
    if !runs {
        out.extend(line.iter().map(|&c| if parts(c) { b',' } else { of(c) }));
        return;
    }
    let start = out.len();
    out.resize(start + line.len(), 0);
    let (mut at, mut before) = (start, false);
    for &c in line {
        // the next one overwrites what is not counted
        at -= usize::from(parts(c) & before);
        out[at] = if parts(c) { b',' } else { of(c) };
        at += 1;
        before = parts(c);
    }
    out.truncate(at);
}

/// Takes away the name of a type that Python writes before a value, as in `np.float64(0.5)` and `array([0.5])`; whether there
/// was one.
fn typed(out: &mut Vec<u8>) -> bool {
    let separates = |b: &u8| matches!(*b, b',' | b'\n');
    let from = out.iter().rposition(separates).map_or(0, |at| at + 1);
    let name = out[from..].trim_ascii();
    let numpy = [&b"np."[..], b"numpy."].iter().any(|m| name.starts_with(m));
    let known = numpy || matches!(name, b"array" | b"tensor");
    if known {
        out.truncate(from);
    }
    known
}

fn last(out: &[u8]) -> Option<u8> {
    out.iter().rev().find(|b| **b != b' ').copied()
}

/// A date, a time of day, or both, in seconds.
pub(crate) fn stamp(cell: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(cell).ok()?.trim().trim_matches('"');
    let half = |name: &str| {
        let at = text.len().checked_sub(2)?;
        let (before, end) = (text.get(..at)?, text.get(at..)?);
        end.eq_ignore_ascii_case(name).then(|| before.trim_end())
    };
    let (text, noon) = match (half("AM"), half("PM")) {
        (Some(text), _) => (text, Some(0.0)),
        (_, Some(text)) => (text, Some(12.0)),
        _ => (text, None),
    };
    let bytes = text.as_bytes();
    // a T of a month is none between date and time
    let between = |i: &usize| {
        bytes[*i] == b' ' || bytes[*i] == b'T' && *i > 0 && bytes[i - 1].is_ascii_digit()
    };
    let (date, time) = match (0..bytes.len()).find(between) {
        Some(at) => (text.get(..at), text.get(at + 1..)?.trim()),
        None => (None, text),
    };
    let days = match date {
        None => 0.0,
        Some(d) => day(d)?,
    };
    // the zone is the same throughout a log
    let time = time.trim_end_matches('Z').trim();
    let time = time.split(['+', '-']).next()?;
    let parts: Vec<&str> = time.trim().split(':').collect();
    let (h, m): (f64, f64) = (parts[0].parse().ok()?, parts.get(1)?.parse().ok()?);
    let h = noon.map_or(h, |noon| h % 12.0 + noon);
    // where commas do not separate cells, a blank stands for one
    let seconds = |s: &str| s.replace([',', ' '], ".").parse::<f64>().ok();
    let s = match parts[2..] {
        [] => 0.0,
        [s] => seconds(s)?,
        // milliseconds behind another colon
        [s, ms] if ms.len() == 3 => {
            s.parse::<u8>().ok()? as f64 + 1e-3 * f64::from(ms.parse::<u16>().ok()?)
        }
        _ => return None,
    };
    (h < 48.0 && m < 60.0 && s < 61.0).then_some(days * 86400.0 + h * 3600.0 + m * 60.0 + s)
}

/// Days of a date since 1970: year, month and day as ISO 8601 has them, day, month and year with points or hyphens between them and
/// the month in figures or by its English name, month, day and year with slashes. A year of two digits is one of this century.
fn day(date: &str) -> Option<f64> {
    let parts: Vec<&str> = date.split(['-', '/', '.']).collect();
    let [a, b, c] = parts[..] else { return None };
    let (y, m, d) = match (a.len() == 4, date.contains('/')) {
        (true, _) => (a, b, c),
        // a day above 12 cannot be a month
        (_, true) if a.parse::<u8>().is_ok_and(|a| a <= 12) => (c, a, b),
        _ => (c, b, a),
    };
    let month = match m.parse::<i64>() {
        Ok(m) => m,
        Err(_) => {
            let begins = |name: &&str| {
                m.len() >= 3 && m.get(..3).is_some_and(|m| m.eq_ignore_ascii_case(name))
            };
            MONTHS.iter().position(begins)? as i64 + 1
        }
    };
    let century = if y.len() == 2 { 2000 } else { 0 };
    let (y, d) = (y.parse::<i64>().ok()?, d.parse::<i64>().ok()?);
    let y = y.saturating_add(century);
    if !(1..=12).contains(&month) || !(1..=31).contains(&d) || !(1900..3000).contains(&y) {
        return None;
    }
    // days of the civil calendar (proleptic Gregorian)
    let (y, m) = if month > 2 {
        (y, month - 3)
    } else {
        (y - 1, month + 9)
    };
    Some((365 * y + y / 4 - y / 100 + y / 400 + (153 * m + 2) / 5 + d - 1 - 719_468) as f64)
}

/// English names of months, three letters of each.
const MONTHS: [&str; 12] = [
    "jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec",
];

impl Dialect {
    /// The dialect of a file that begins with `text`; `None` where it has no line of numbers.
    pub fn of(text: &[u8]) -> Option<Self> {
        let text = strip(text);
        let lines: Vec<&[u8]> = text
            .split(|b| *b == b'\n')
            .map(|l| l.strip_suffix(b"\r").unwrap_or(l))
            .take(LINES)
            .collect();
        let whole = match text.iter().filter(|b| **b == b'\n').take(LINES).count() {
            // the last line may be cut by the end of the block
            n if n + 1 == lines.len() && n > 1 => &lines[..n],
            _ => &lines[..],
        };
        let mut best: Option<(f64, Self)> = None;
        for (delimiter, comma) in [
            (b',', false),
            (b';', false),
            (b'\t', false),
            (b'|', false),
            (b' ', false),
            (b';', true),
            (b'\t', true),
            (b' ', true),
        ] {
            if let Some((score, dialect)) = Self::with(whole, delimiter, comma)
                && best.as_ref().is_none_or(|(s, _)| score > *s)
            {
                best = Some((score, dialect));
            }
        }
        best.map(|(_, d)| d)
    }

    /// How well this layout fits: the share of cells that are numbers, in lines of the usual count.
    fn with(lines: &[&[u8]], delimiter: u8, comma: bool) -> Option<(f64, Self)> {
        let split: Vec<(usize, Vec<Vec<u8>>)> = lines
            .iter()
            .enumerate()
            .filter(|(_, l)| !idle(l))
            .map(|(i, l)| (i, cells(l, delimiter, comma)))
            .collect();
        let number = |c: &Vec<u8>| !c.trim_ascii().is_empty() && number::parse(c).is_some();
        let numbers = |row: &[Vec<u8>]| row.iter().filter(|c| number(c)).count();
        // lines of data: at least a third of their cells are numbers
        let data = |row: &[Vec<u8>]| 3 * numbers(row) >= row.len();
        let mut counts: Vec<usize> = split
            .iter()
            .filter(|(_, r)| data(r))
            .map(|(_, r)| r.len())
            .collect();
        counts.sort_unstable();
        let n = *counts
            .chunk_by(|a, b| a == b)
            .max_by_key(|c| (c.len(), c[0]))?
            .first()?;
        let rows: Vec<&(usize, Vec<Vec<u8>>)> = split
            .iter()
            .filter(|(_, r)| r.len() == n && data(r))
            .collect();
        let first = rows.first()?.0;
        let mut kinds = Vec::with_capacity(n);
        for k in 0..n {
            let of = |test: &dyn Fn(&[u8]) -> bool| {
                let full = rows.iter().map(|r| &r.1[k]);
                full.filter(|c| !c.trim_ascii().is_empty() && test(c))
                    .count()
            };
            // empty cells say nothing
            let full = of(&|_| true);
            let numbers = of(&|c| number::parse(c).is_some());
            let stamps = of(&|c| stamp(c).is_some());
            kinds.push(match (2 * numbers >= full, 2 * stamps >= full) {
                _ if full == 0 => Cell::Empty,
                (true, _) => Cell::Number,
                (_, true) => Cell::Stamp,
                _ => Cell::Text,
            });
        }
        let same = |(k, kind): (usize, &Cell)| {
            if *kind != Cell::Text {
                return None;
            }
            let mut all = rows.iter().map(|r| text(&r.1[k]));
            let one = all.next().filter(|t| !t.is_empty())?;
            all.all(|t| t == one).then_some(one)
        };
        let texts: Vec<Option<String>> = kinds.iter().enumerate().map(same).collect();
        let turns = (0..n).find_map(|k| Some((k, in_turn(&rows, &kinds, k)?)));
        let total = split.iter().filter(|(i, _)| *i >= first).count().max(1);
        let full: usize = rows.iter().map(|r| numbers(&r.1)).sum();
        let cells_seen: usize = split
            .iter()
            .filter(|(i, _)| *i >= first)
            .map(|(_, r)| r.len())
            .sum();
        let score = rows.len() as f64 / total as f64 * full as f64 / cells_seen.max(1) as f64
            * (1.0 - 0.5 / n as f64);
        let open = kinds.last() == Some(&Cell::Empty);
        let Names {
            mut names,
            named,
            unused,
        } = names(lines, &split, first, n, delimiter, open);
        if !named
            && let Some(echoed) = echoed(&kinds, &texts)
            && rows.iter().all(|r| stamped(&r.1))
        {
            names = echoed;
        }
        // what stands behind a delimiter at the end of each line
        if let Some(last) = kinds.last_mut().filter(|_| open && named)
            && names.last() == Some(&n.to_string())
        {
            *last = Cell::Text;
        }
        let turns = turns.map(|(k, turn)| (names.get(k).cloned().unwrap_or_default(), turn));
        let plain = !comma
            && delimiter != b' '
            && !(lines.iter().skip(first)).any(|l| !idle(l) && l.iter().any(special));
        Some((
            score,
            Dialect {
                delimiter,
                comma,
                plain,
                names,
                cells: kinds,
                texts,
                turns,
                head: first,
                unused,
            },
        ))
    }
}

/// Texts that come in turn in column `k`, each turn at one time, by a column that is the same in all of its rows and in no two turns.
fn in_turn(rows: &[&(usize, Vec<Vec<u8>>)], kinds: &[Cell], k: usize) -> Option<Vec<String>> {
    if kinds[k] != Cell::Text {
        return None;
    }
    let all: Vec<String> = rows.iter().map(|r| text(&r.1[k])).collect();
    let period = all.iter().skip(1).position(|t| *t == all[0])? + 1;
    let mut different = all[..period].to_vec();
    different.sort_unstable();
    different.dedup();
    let repeats = all.len() >= 4 * period && all.windows(period + 1).all(|w| w[0] == w[period]);
    if period < 2 || different.len() < period || !repeats {
        return None;
    }
    let timed = |k: usize| {
        let mut last = None;
        rows.chunks_exact(period).all(|turn| {
            let first = &turn[0].1[k];
            let next = last != Some(first) && turn.iter().all(|r| r.1[k] == *first);
            last = Some(first);
            next
        })
    };
    let mut others = (0..kinds.len()).filter(|&k| kinds[k] != Cell::Text);
    others.any(timed).then(|| all[..period].to_vec())
}

/// Names of the columns that `ros2 topic echo --csv` writes of a `JointState`, without a header: stamp in seconds and nanoseconds,
/// frame, and the lists of names, positions, velocities and efforts. `None` for anything else.
fn echoed(kinds: &[Cell], texts: &[Option<String>]) -> Option<Vec<String>> {
    const FIRST: usize = 3;
    let head = kinds.get(..FIRST)?;
    let joints: Vec<&String> = texts[FIRST..].iter().map_while(Option::as_ref).collect();
    let n = joints.len();
    let rest = &kinds[FIRST + n..];
    let sound = head[..2] == [Cell::Number; 2] && matches!(head[2], Cell::Text | Cell::Empty);
    let distinct = (1..n).all(|k| !joints[..k].contains(&joints[k]));
    let numbers = rest.iter().all(|k| matches!(k, Cell::Number | Cell::Empty));
    if n == 0 || !sound || !distinct || !numbers || rest.len() != n && rest.len() != 3 * n {
        return None;
    }
    let lists = ["name", "position", "velocity", "effort"];
    let of = |list: &'static str| (0..n).map(move |k| format!("{list}[{k}]"));
    let head = ["stamp.sec", "stamp.nanosec", "frame_id"].map(|name| format!("header.{name}"));
    let lists = lists.into_iter().take(1 + rest.len() / n).flat_map(of);
    Some(head.into_iter().chain(lists).collect())
}

/// Whether a row begins with a stamp in seconds and nanoseconds.
fn stamped(row: &[Vec<u8>]) -> bool {
    let below = |(cell, most): (&Vec<u8>, f64)| {
        number::parse(cell).is_some_and(|x| x >= 0.0 && x < most && x.fract() == 0.0)
    };
    row.len() > 1 && row.iter().zip([1e10, 1e9]).all(below)
}

/// The text of a cell, without quotes.
fn text(cell: &[u8]) -> String {
    let text = String::from_utf8_lossy(cell);
    text.trim().trim_matches(['"', '\'']).trim().to_string()
}

/// Names of columns.
struct Names {
    names: Vec<String>,
    /// whether they stand in the file
    named: bool,
    /// names that are not of so many columns
    unused: Option<String>,
}

/// Names of `n` columns from the line before the first row `first`, be it a comment or not, with the units where they
/// have a line of their own. A list in a cell stands under one name; where the lines are `open`, nothing stands in the
/// last cell.
fn names(
    lines: &[&[u8]],
    split: &[(usize, Vec<Vec<u8>>)],
    first: usize,
    n: usize,
    delimiter: u8,
    open: bool,
) -> Names {
    let numbered = |unused: Option<String>| Names {
        names: (1..=n).map(|k| k.to_string()).collect(),
        named: false,
        unused,
    };
    let named = |names: Vec<String>| Names {
        names: unique(names),
        named: true,
        unused: None,
    };
    // header cells without regard to brackets, which are part of names
    let plain = |line: &[u8], delimiter: u8| -> Vec<String> {
        match delimiter {
            b' ' => line
                .split(|b| b.is_ascii_whitespace())
                .filter(|c| !c.is_empty())
                .map(text)
                .collect(),
            d => unquoted(line, d).into_iter().map(text).collect(),
        }
    };
    // the nearest line above that can be names; a comment only if it has as many words as there are columns
    let mut found: Vec<String> = Vec::new();
    let mut units: Option<Vec<String>> = None;
    for line in lines[..first].iter().rev() {
        let line = line.trim_ascii();
        if line.is_empty() {
            continue;
        }
        if !idle(line) {
            found = plain(line, delimiter);
            // a row of another number of cells
            if 2 * found.iter().filter(|c| c.parse::<f64>().is_ok()).count() > found.len() {
                found.clear();
                continue;
            }
            if units.is_none() && all_units(&found) {
                units = Some(std::mem::take(&mut found));
                continue;
            }
            break;
        }
        let marks = line.iter().take_while(|c| matches!(c, b'#' | b'%' | b'/'));
        let body = line[marks.count()..].trim_ascii();
        let fits = [delimiter, b',', b' ', b';', b'\t']
            .into_iter()
            .map(|d| plain(body, d))
            .find(|c| c.len() == n && n > 1);
        if let Some(fits) = fits {
            found = fits;
            break;
        }
    }
    let units = match units {
        // no names above them: the columns are called so
        Some(units) if found.len() != units.len() => {
            found = units;
            None
        }
        units => units,
    };
    for (name, unit) in found.iter_mut().zip(units.iter().flatten()) {
        let unit = bare(unit);
        if !unit.is_empty() && unit != "-" && !name.contains(['[', '(']) {
            *name = format!("{name} [{unit}]");
        }
    }
    if found.is_empty() {
        return numbered(None);
    }
    if open && found.len() + 1 == n {
        found.push(String::new());
    }
    // a comma at the end of each line makes a column without name
    while found.len() > n && found.last().is_some_and(String::is_empty) {
        found.pop();
    }
    if found.iter().all(|c| c.parse::<f64>().is_ok()) {
        return numbered(None);
    }
    if found.len() == n {
        return named(found);
    }
    let unused = (found.len() > 1)
        .then(|| format!("{} names for {n} columns ({})", found.len(), listed(&found)));
    if found.len() > n {
        return numbered(unused);
    }
    // lists: how many cells each name stands over, from the first row as it is written
    let Some(row) = split.iter().find(|(i, r)| *i == first && r.len() == n) else {
        return numbered(unused);
    };
    let widths = widths(lines[row.0], delimiter);
    if widths.len() != found.len() || widths.iter().sum::<usize>() != n {
        return numbered(unused);
    }
    let mut out = Vec::new();
    for (name, width) in found.iter().zip(widths) {
        match width {
            1 => out.push(name.clone()),
            w => out.extend((0..w).map(|k| format!("{name}[{k}]"))),
        }
    }
    named(out)
}

/// A unit without its brackets.
fn bare(cell: &str) -> &str {
    cell.trim_matches(['[', ']', '(', ')']).trim()
}

/// Whether all cells of a line are units or nothing, and more than one is a unit.
fn all_units(cells: &[String]) -> bool {
    let known = |c: &&String| unit(bare(c)).is_some();
    let none = |c: &&String| matches!(bare(c), "" | "-");
    let units = cells.iter().filter(known).count();
    units > 1 && cells.iter().all(|c| known(&c) || none(&c))
}

/// The cells of a line, quoted ones whole.
fn unquoted(line: &[u8], delimiter: u8) -> Vec<&[u8]> {
    let mut quoted = false;
    line.split(|b| {
        quoted ^= *b == b'"';
        *b == delimiter && !quoted
    })
    .collect()
}

/// Number of cells that each cell of a line becomes when its list is laid open.
fn widths(line: &[u8], delimiter: u8) -> Vec<usize> {
    let (mut depth, mut quoted) = (0, false);
    let mut parts: Vec<Vec<u8>> = vec![Vec::new()];
    for &c in line {
        match c {
            b'"' => quoted = !quoted,
            b'[' | b'(' => depth += 1,
            b']' | b')' => depth -= 1,
            c if c == delimiter && depth == 0 && !quoted => {
                parts.push(Vec::new());
                continue;
            }
            _ => {}
        }
        if let Some(p) = parts.last_mut() {
            p.push(c);
        }
    }
    parts
        .iter()
        .map(|p| cells(p, delimiter, false).len())
        .collect()
}

/// Names of which none stands there twice and none is empty.
fn unique(names: Vec<String>) -> Vec<String> {
    let mut out: Vec<String> = Vec::with_capacity(names.len());
    for (k, name) in names.into_iter().enumerate() {
        let name = if name.is_empty() {
            (k + 1).to_string()
        } else {
            name
        };
        let mut other = name.clone();
        let mut n = 2;
        while out.contains(&other) {
            other = format!("{name}#{n}");
            n += 1;
        }
        out.push(other);
    }
    out
}

/// A text without the mark of its byte order.
pub(super) fn strip(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a line without quotes and brackets becomes is what the way for all lines makes of it.
    #[test]
    fn lines_without_quotes_are_canonical_alike() {
        let of = |text: &str, delimiter: u8, comma: bool| {
            let mut out = Vec::new();
            canonical(text.as_bytes(), delimiter, comma, &mut out);
            String::from_utf8(out).unwrap()
        };
        for (text, delimiter, comma, expected) in [
            ("1,5;2;-3,25 \r\n;;\n", b';', true, "1.5;2;-3.25\n;;\n"),
            ("1.5\t 2\t3,4\t\n", b'\t', false, "1.5; 2;3 4;\n"),
            ("1.5 2 -3\n", b' ', false, "1.5;2;-3\n"),
            (
                "  1.5   2 \t -3  \n\t4\t\t5 6\n",
                b' ',
                false,
                "1.5;2;-3\n4;5;6\n",
            ),
            ("1,5  2\n", b' ', true, "1.5;2\n"),
            ("a b,c\n", b' ', false, "a;b c\n"),
            ("1.5, 2\n# 1, 2\n\n3,4", b',', false, "1.5; 2\n\n\n3;4"),
        ] {
            let expected = expected.replace(';', ",");
            assert_eq!(of(text, delimiter, comma), expected, "{text:?}");
            // a quoted cell at the end makes a line one for the other way
            let quoted = format!("{}{}\"x\"", text.trim(), char::from(delimiter));
            let both = format!("{},x", expected.trim_end_matches(['\n', ',']));
            if !text.trim().contains('\n') {
                assert_eq!(of(&quoted, delimiter, comma), both);
            }
        }
    }

    #[test]
    fn types_that_python_writes_are_taken_away() {
        let of = |text: &str| {
            let mut out = Vec::new();
            canonical(text.as_bytes(), b',', false, &mut out);
            String::from_utf8(out).unwrap()
        };
        assert_eq!(of("np.float64(0.5),np.int64(3),0.1"), "0.5,3,0.1");
        let lists = "0.1,\"[np.float32(0.5), np.float32(-1e-3)]\",array([1., 2.])";
        assert_eq!(of(lists), "0.1,0.5,-1e-3,1.,2.");
        assert_eq!(of("q1(rad),dq1(rad/s)"), "q1(rad),dq1(rad/s)");
    }

    #[test]
    fn stamps_of_many_programs_are_one_time() {
        let of = |text: &str| stamp(text.as_bytes());
        let one = of("2026-01-05T08:00:30.010Z").unwrap();
        assert_eq!(one, 20_458.0 * 86_400.0 + 8.0 * 3600.0 + 30.01);
        for text in [
            "2026-01-05 08:00:30,010",
            "2026-01-05 08:00:30 010",
            "2026/01/05 08:00:30.010",
            "05.01.2026 08:00:30.010",
            "05.01.26 08:00:30,010",
            "5-Jan-2026 08:00:30.010",
            "05-OCT-2026 08:00:30.010",
            "01/05/2026 08:00:30.010",
            "1/5/2026 8:00:30.010 AM",
            "2026-01-05T08:00:30:010",
            "2026-01-05T08:00:30.010+01:00",
        ] {
            let months = if text.contains("OCT") { 273.0 } else { 0.0 };
            let found = of(text).unwrap_or_else(|| panic!("{text}"));
            assert!((found - one - months * 86_400.0).abs() < 1e-6, "{text}");
        }
        // a day above 12 cannot be a month
        assert_eq!(of("25/12/2026 1:00:00"), of("12/25/2026 01:00:00"));
        assert_eq!(of("08:00:30:010"), Some(28_830.010));
        for text in [
            "",
            "8",
            "1.2.3",
            "1.2.3 4:5",
            "32.01.2026 08:00:00",
            "5-Foo-2026 08:00:00",
            "a:b",
            "T",
            " ",
            "8:00:00:1",
        ] {
            assert_eq!(of(text), None, "{text}");
        }
    }
}
