//! Links and sentences of the documents.

use super::*;

/// Files that a document links to, and headings within itself.
#[test]
fn links_lead_somewhere() {
    let mut paths = vec![root().join("README.md")];
    let docs = std::fs::read_dir(root().join("docs")).expect("docs is there");
    paths.extend(docs.flatten().map(|e| e.path()));
    for path in paths
        .iter()
        .filter(|p| p.extension().is_some_and(|e| e == "md"))
    {
        let text = std::fs::read_to_string(path).expect("read");
        let folder = path.parent().expect("a file is in a folder");
        let inline = text.split("](").skip(1).filter_map(|l| l.split(')').next());
        let definitions = text.lines().filter_map(|l| {
            l.strip_prefix('[')
                .and_then(|l| l.split_once("]: "))
                .map(|(_, target)| target)
        });
        for target in inline.chain(definitions).filter(|t| !t.contains("://")) {
            let (file, heading) = target.split_once('#').unwrap_or((target, ""));
            assert!(
                file.is_empty() || folder.join(file).exists(),
                "{}: {target} is not there",
                path.display()
            );
            if file.is_empty() {
                let found = text.lines().filter(|l| l.starts_with('#')).any(|l| {
                    let id: String = l
                        .trim_start_matches('#')
                        .trim()
                        .to_lowercase()
                        .chars()
                        .filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'))
                        .map(|c| if c == ' ' { '-' } else { c })
                        .collect();
                    id == heading
                });
                assert!(found, "{}: no heading for #{heading}", path.display());
            }
        }
        // a reference needs its definition
        for reference in text
            .split('[')
            .skip(1)
            .filter_map(|r| r.split_once(']'))
            .filter(|(_, after)| !after.starts_with('('))
            .map(|(reference, _)| reference)
            .filter(|r| r.ends_with(".md") && !r.contains('('))
        {
            assert!(
                text.contains(&format!("\n[{reference}]: ")),
                "{}: [{reference}] has no definition",
                path.display()
            );
        }
    }
}

/// Words of each sentence of the running text: without code blocks, tables and headings.
fn sentences(text: &str) -> Vec<(usize, String)> {
    let mut paragraphs = vec![String::new()];
    let mut code = false;
    for line in text.lines() {
        let item = line.trim_start().starts_with("- ")
            || line
                .split_once(". ")
                .is_some_and(|(n, _)| n.parse::<u32>().is_ok());
        if line.starts_with("```") {
            code = !code;
            paragraphs.push(String::new());
        } else if code {
        } else if line.is_empty() || line.starts_with(['|', '#', '!']) {
            paragraphs.push(String::new());
        } else {
            if item {
                paragraphs.push(String::new());
            }
            if let Some(last) = paragraphs.last_mut() {
                *last += line.trim();
                *last += " ";
            }
        }
    }
    let mut out = Vec::new();
    for p in paragraphs {
        // code within a line counts as one word
        let plain: String = p
            .split('`')
            .enumerate()
            .map(|(i, s)| if i % 2 == 0 { s } else { "X" })
            .collect();
        for s in plain.split_inclusive(". ") {
            let words = s
                .split_whitespace()
                .filter(|w| w.chars().any(char::is_alphanumeric))
                .count();
            out.push((words, s.to_string()));
        }
    }
    out.retain(|(words, _)| *words > 0);
    out
}

#[test]
fn sentences_of_the_documents_are_short() {
    for entry in std::fs::read_dir(root().join("docs"))
        .expect("docs")
        .flatten()
    {
        let name = entry.file_name().to_string_lossy().into_owned();
        if !name.ends_with(".md") {
            continue;
        }
        let all = sentences(&document(&name));
        if let Some((words, s)) = all.iter().find(|(words, _)| *words > 45) {
            panic!("docs/{name}: {words} words in one sentence: {s}");
        }
        let mean = all.iter().map(|(w, _)| *w).sum::<usize>() as f64 / all.len() as f64;
        let most = if name == "diagnosis.md" { 18.0 } else { 22.0 };
        assert!(mean < most, "docs/{name}: {mean:.1} words a sentence");
    }
}
