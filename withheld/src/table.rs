//! The results as CSV and as Markdown.

use crate::score::{CLEAR, Judged, Outcome};
use std::collections::BTreeMap;
use std::fmt::Write as _;

fn percent(hits: usize, of: usize) -> String {
    if of == 0 {
        return "–".into();
    }
    format!("{:.0} % ({hits}/{of})", 100.0 * hits as f64 / of as f64)
}

fn count<T>(items: &[T], f: impl Fn(&T) -> bool) -> usize {
    items.iter().filter(|x| f(x)).count()
}

fn median(mut x: Vec<f64>) -> Option<f64> {
    x.sort_by(f64::total_cmp);
    let n = x.len();
    (n > 0).then(|| 0.5 * (x[(n - 1) / 2] + x[n / 2]))
}

/// One line per case.
pub fn csv(judged: &[Judged]) -> String {
    let mut s = String::from(
        "case,kind,truth,level,verdict,answer,rank,claimed,in_set,joint,wrong_claims,shrink_over_possible,seconds\n",
    );
    for c in judged {
        let join =
            |f: &dyn Fn(&Outcome) -> String| c.outcomes.iter().map(f).collect::<Vec<_>>().join("+");
        let _ = writeln!(
            s,
            "{},{},{},{},{},{},{},{},{},{},{},{},{:.1}",
            c.case,
            c.kind,
            c.truth,
            join(&|o| format!("{:.3}", o.level)),
            c.verdict,
            c.answer.as_deref().unwrap_or(""),
            join(&|o| o.rank.map_or(String::new(), |r| (r + 1).to_string())),
            join(&|o| o.claimed.to_string()),
            join(&|o| o.in_set.to_string()),
            join(&|o| o.joint.map_or(String::new(), |j| j.to_string())),
            c.wrong.join("+"),
            join(&|o| o.shrink.map_or(String::new(), |x| format!("{x:.3}"))),
            c.seconds
        );
    }
    s
}

/// Truth against the first claim, as CSV: rows the truth, columns the answers.
pub fn confusion(judged: &[Judged]) -> String {
    let cells = cells(judged);
    let mut columns: Vec<String> = cells.keys().map(|k| k.1.clone()).collect();
    columns.sort();
    columns.dedup();
    let mut rows: Vec<String> = cells.keys().map(|k| k.0.clone()).collect();
    rows.dedup();
    let mut s = format!("truth,{}\n", columns.join(","));
    for r in rows {
        let line: Vec<String> = columns
            .iter()
            .map(|c| {
                cells
                    .get(&(r.clone(), c.clone()))
                    .copied()
                    .unwrap_or(0)
                    .to_string()
            })
            .collect();
        let _ = writeln!(s, "{r},{}", line.join(","));
    }
    s
}

fn cells(judged: &[Judged]) -> BTreeMap<(String, String), usize> {
    let mut cells = BTreeMap::new();
    for c in judged {
        let truth = match c.kind.as_str() {
            "clean" => "(none)".into(),
            "outside" => format!("(outside) {}", c.truth),
            _ => c.truth.clone(),
        };
        let answer = c.answer.clone().unwrap_or_else(|| "(no claim)".into());
        *cells.entry((truth, answer)).or_insert(0) += 1;
    }
    cells
}

/// The whole result.
pub fn markdown(judged: &[Judged], failed: &[(String, String)]) -> String {
    let of = |kind: &str| judged.iter().filter(|c| c.kind == kind).collect::<Vec<_>>();
    let (single, double, clean, outside) = (of("single"), of("double"), of("clean"), of("outside"));
    let clear: Vec<&Outcome> = single
        .iter()
        .flat_map(|c| &c.outcomes)
        .filter(|o| o.level >= CLEAR)
        .collect();
    let mut s = String::from("| question | result | goal |\n|---|---|---|\n");
    let mut line = |q: &str, r: String, goal: &str| {
        let _ = writeln!(s, "| {q} | {r} | {goal} |");
    };
    line(
        "cases",
        format!("{} judged, {} diagnoses failed", judged.len(), failed.len()),
        "",
    );
    let n = clear.len();
    line(
        "clear single effects: right name first",
        percent(count(&clear, |o| o.rank == Some(0)), n),
        "80 %",
    );
    line(
        "… first, or in the set that the first cannot be told from",
        percent(count(&clear, |o| o.in_set), n),
        "",
    );
    line(
        "… among the first three",
        percent(count(&clear, |o| o.rank.is_some_and(|r| r < 3)), n),
        "95 %",
    );
    line("… claimed", percent(count(&clear, |o| o.claimed), n), "");
    let tied: Vec<bool> = clear.iter().filter_map(|o| o.joint).collect();
    line(
        "… right joints where the name is right",
        percent(count(&tied, |j| *j), tied.len()),
        "90 %",
    );
    let both = |c: &&&Judged| c.outcomes.iter().all(|o| o.rank.is_some_and(|r| r < 3));
    let visible: Vec<&&Judged> = double
        .iter()
        .filter(|c| c.outcomes.iter().all(|o| o.level >= CLEAR))
        .collect();
    line(
        "clear pairs: both among the first three",
        percent(visible.iter().filter(|c| both(c)).count(), visible.len()),
        "most",
    );
    line(
        "… both claimed",
        percent(
            count(&visible, |c| c.outcomes.iter().all(|o| o.claimed)),
            visible.len(),
        ),
        "",
    );
    line(
        "clean data: cases with a false name",
        percent(count(&clean, |c| !c.wrong.is_empty()), clean.len()),
        "2 %",
    );
    line(
        "outside the catalogue: cases with a confident wrong name",
        percent(count(&outside, |c| !c.wrong.is_empty()), outside.len()),
        "10 %",
    );
    line(
        "… verdict `unknown` or `partly_explained`",
        percent(
            count(&outside, |c| {
                c.verdict == "unknown" || c.verdict == "partly_explained"
            }),
            outside.len(),
        ),
        "",
    );
    line(
        "single and double: cases with a confident wrong name",
        percent(
            count(&single, |c| !c.wrong.is_empty()) + count(&double, |c| !c.wrong.is_empty()),
            single.len() + double.len(),
        ),
        "",
    );
    let shrink = median(clear.iter().filter_map(|o| o.shrink).collect());
    line(
        "held-out shrink over that of the true structure, median where the right name is found",
        shrink.map_or("–".into(), |x| format!("{:.0} %", 100.0 * x)),
        "90 %",
    );
    let claimed = clear
        .iter()
        .map(|o| o.shrink.filter(|_| o.claimed).unwrap_or(0.0));
    let shrink = median(claimed.collect());
    line(
        "… where nothing right is claimed, 0",
        shrink.map_or("–".into(), |x| format!("{:.0} %", 100.0 * x)),
        "90 %",
    );
    let slowest = judged.iter().map(|c| c.seconds).fold(0.0, f64::max);
    line("longest diagnosis", format!("{slowest:.0} s"), "30 s");
    limits(&mut s, judged);
    answers(&mut s, judged);
    s.push_str(&crate::reliability::table(judged));
    for (case, why) in failed {
        let _ = writeln!(s, "\n{case} failed: {why}");
    }
    s
}

/// Where detection starts: pooled over the effects, and for each.
fn limits(s: &mut String, judged: &[Judged]) {
    let all: Vec<&Outcome> = judged.iter().flat_map(|c| &c.outcomes).collect();
    s.push_str("\n| level over noise | effects | claimed |\n|---|---|---|\n");
    let edges = [0.0, 0.3, 0.6, 1.0, 2.0, 4.0, f64::INFINITY];
    for w in edges.windows(2) {
        let bin: Vec<&&Outcome> = all
            .iter()
            .filter(|o| (w[0]..w[1]).contains(&o.level))
            .collect();
        let name = if w[1].is_finite() {
            format!("{} to {}", w[0], w[1])
        } else {
            format!("over {}", w[0])
        };
        let _ = writeln!(
            s,
            "| {name} | {} | {} |",
            bin.len(),
            percent(count(&bin, |o| o.claimed), bin.len())
        );
    }
    let mut per: BTreeMap<&str, Vec<&Outcome>> = BTreeMap::new();
    for o in all {
        per.entry(&o.name).or_default().push(o);
    }
    s.push_str("\n| effect | cases | right first | claimed | detected from | largest missed |\n|---|---|---|---|---|---|\n");
    for (name, list) in per {
        let missed = list
            .iter()
            .filter(|o| !o.claimed)
            .map(|o| o.level)
            .fold(0.0, f64::max);
        // the smallest level above which nothing was missed
        let from = list
            .iter()
            .filter(|o| o.claimed && o.level > missed)
            .map(|o| o.level)
            .fold(f64::INFINITY, f64::min);
        let show = |x: f64| {
            if x.is_finite() && x > 0.0 {
                format!("{x:.2}")
            } else {
                "–".into()
            }
        };
        let _ = writeln!(
            s,
            "| `{name}` | {} | {} | {} | {} | {} |",
            list.len(),
            count(&list, |o| o.rank == Some(0)),
            count(&list, |o| o.claimed),
            show(from),
            show(missed)
        );
    }
}

/// The confusion matrix by its cells that are not zero.
fn answers(s: &mut String, judged: &[Judged]) {
    s.push_str("\n| truth | first claim | cases |\n|---|---|---|\n");
    for ((truth, answer), n) in cells(judged) {
        let _ = writeln!(s, "| {truth} | {answer} | {n} |");
    }
}
