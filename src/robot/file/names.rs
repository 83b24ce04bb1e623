//! Names in messages: lists, and the one that was probably meant.

/// Names for a message, at most twenty.
pub(crate) fn listed(names: &[&str]) -> String {
    let more = if names.len() > 20 { ", …" } else { "" };
    format!(
        "{}{more}",
        names
            .iter()
            .take(20)
            .copied()
            .collect::<Vec<_>>()
            .join(", ")
    )
}

/// ` (did you mean …?)` where a name is close.
pub(crate) fn did_you_mean<'a>(name: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    match closest(name, names) {
        Some(close) => format!(" (did you mean `{close}`?)"),
        None => String::new(),
    }
}

/// The name at the smallest edit distance, if that is at most half of its length.
fn closest<'a>(name: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let wanted: Vec<char> = name.to_lowercase().chars().take(64).collect();
    names
        .into_iter()
        .map(|n| {
            (
                distance(
                    &wanted,
                    &n.to_lowercase().chars().take(64).collect::<Vec<_>>(),
                ),
                n,
            )
        })
        .filter(|(d, n)| 2 * d <= n.chars().count())
        .min_by_key(|(d, _)| *d)
        .map(|(_, n)| n)
}

/// Levenshtein distance.
fn distance(a: &[char], b: &[char]) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut diagonal = i;
        let mut left = i + 1;
        for (y, cell) in b.iter().zip(row.iter_mut().skip(1)) {
            let change = diagonal + usize::from(x != y);
            diagonal = *cell;
            left = change.min(diagonal + 1).min(left + 1);
            *cell = left;
        }
        if let Some(first) = row.first_mut() {
            *first = i + 1;
        }
    }
    row.last().copied().unwrap_or(a.len())
}
