//! Lines of a table in text.

/// Lines that hold something, with their numbers from one; comments begin with `#`.
pub fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let bare = text.strip_prefix('\u{feff}').unwrap_or(text);
    bare.lines()
        .enumerate()
        .map(|(i, l)| (i + 1, l.trim()))
        .filter(|(_, l)| !l.is_empty() && !l.starts_with('#'))
}

/// Cells of a line: between commas, semicolons or spaces, without quotes.
pub fn split(line: &str) -> Vec<String> {
    let cells: Vec<&str> = match (line.contains(','), line.contains(';')) {
        (true, _) => line.split(',').collect(),
        (_, true) => line.split(';').collect(),
        _ => line.split_whitespace().collect(),
    };
    cells
        .iter()
        .map(|c| c.trim().trim_matches('"').to_string())
        .collect()
}
