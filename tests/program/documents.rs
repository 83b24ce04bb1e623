//! What the documents promise: every key that the program writes is in `docs/formats.md` and the
//! other way round, examples in it are read, links lead somewhere, sentences are short.

mod words;

use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn document(name: &str) -> String {
    std::fs::read_to_string(root().join("docs").join(name)).expect("the document is there")
}

/// The text under a heading, up to the next one of the same level or above.
fn section<'a>(text: &'a str, heading: &str) -> &'a str {
    let start = text
        .find(&format!("\n{heading}\n"))
        .unwrap_or_else(|| panic!("no heading `{heading}`"));
    let body = &text[start + heading.len() + 2..];
    let level = heading.split(' ').next().map_or(0, str::len);
    let end = (1..=level)
        .filter_map(|l| body.find(&format!("\n{} ", "#".repeat(l))))
        .min();
    &body[..end.unwrap_or(body.len())]
}

/// `a.{b,c}[].d` as `a.b[].d` and `a.c[].d`.
fn expand(path: &str) -> Vec<String> {
    let Some((before, rest)) = path.split_once('{') else {
        return vec![path.to_string()];
    };
    let (list, after) = rest.split_once('}').expect("a brace is closed");
    list.split(',')
        .flat_map(|one| expand(&format!("{before}{one}{after}")))
        .collect()
}

/// Keys in the first column of the tables of a section.
fn documented(section: &str) -> Vec<String> {
    section
        .lines()
        .filter_map(|l| l.strip_prefix("| `"))
        .flat_map(|l| {
            let cell = l.split(" | ").next().expect("a row has a first cell");
            format!("`{cell}")
                .split('`')
                .skip(1)
                .step_by(2)
                .flat_map(expand)
                .collect::<Vec<_>>()
        })
        .collect()
}

/// Paths of all keys in a value: `a.b[].c`.
fn keys(value: &Value, at: &str, out: &mut BTreeSet<String>) {
    match value {
        Value::Object(map) => {
            for (key, inner) in map {
                let path = match at {
                    "" => key.clone(),
                    _ => format!("{at}.{key}"),
                };
                keys(inner, &path, out);
                out.insert(path);
            }
        }
        Value::Array(list) => list.iter().for_each(|v| keys(v, &format!("{at}[]"), out)),
        _ => {}
    }
}

/// Whether a documented path stands for a written one; `NAME` stands for any key.
fn is(documented: &str, written: &str) -> bool {
    let (d, w): (Vec<_>, Vec<_>) = (
        documented.split('.').collect(),
        written.split('.').collect(),
    );
    d.len() == w.len() && d.iter().zip(&w).all(|(d, w)| *d == "NAME" || d == w)
}

/// All of the source in one text.
fn source(folder: &Path, out: &mut String) {
    for entry in std::fs::read_dir(folder).expect("src is there").flatten() {
        let path = entry.path();
        if path.is_dir() {
            source(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push_str(&std::fs::read_to_string(&path).unwrap_or_default());
        }
    }
}

/// Compares the keys of files that the program wrote with a section of `formats.md`.
fn compare(heading: &str, files: &[PathBuf]) {
    let text = document("formats.md");
    let documented = documented(section(&text, heading));
    let mut written = BTreeSet::new();
    for file in files {
        let text =
            std::fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        keys(
            &serde_json::from_str(&text).expect("it is JSON"),
            "",
            &mut written,
        );
    }
    assert!(!written.is_empty());
    let missing: Vec<&String> = written
        .iter()
        .filter(|w| {
            // an object is documented by its keys
            let inside = [format!("{w}."), format!("{w}[].")];
            !documented.iter().any(|d| {
                is(d, w)
                    || inside.iter().any(|i| d.starts_with(i))
                    // `parameters.NAME` is documented by what it holds
                    || d.split_once(".NAME")
                        .is_some_and(|(head, _)| w.strip_prefix(head).is_some_and(|rest| rest.matches('.').count() == 1))
            })
        })
        .collect();
    assert!(
        missing.is_empty(),
        "the program writes keys that docs/formats.md, `{heading}`, does not have: {missing:#?}"
    );
    // what this rehearsal does not write must at least be written somewhere in the source
    let mut code = String::new();
    source(&root().join("src"), &mut code);
    let invented: Vec<&String> = documented
        .iter()
        .filter(|d| !written.iter().any(|w| is(d, w)))
        .filter(|d| {
            let last = d.rsplit('.').next().expect("a path has a last key");
            let last = last.trim_end_matches("[]");
            !code.contains(&format!("\"{last}\"")) && !code.contains(&format!("pub {last}:"))
        })
        .collect();
    assert!(
        invented.is_empty(),
        "docs/formats.md, `{heading}`, has keys that nothing writes: {invented:#?}"
    );
}

/// Runs the program in a folder; its standard error where it fails.
fn excite(folder: &Path, arguments: &str) {
    let run = Command::new(env!("CARGO_BIN_EXE_excite"))
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .output()
        .expect("the program starts");
    assert!(
        run.status.success(),
        "excite {arguments}: {}",
        String::from_utf8_lossy(&run.stderr)
    );
}

#[test]
fn keys_of_a_serial_robots_files_are_documented() {
    let dir = tempfile::tempdir().expect("a folder");
    let at = dir.path();
    excite(
        at,
        "design planar2 --diagnostic --starts 1 --period 4 --harmonics 3 --identify viscous,coulomb --output d",
    );
    excite(at, "identifiability planar2 --output robot");
    for (motion, purpose) in [("trajectory", "fit"), ("holdout", "holdout")] {
        excite(
            at,
            &format!(
                "simulate planar2 d/{motion}.json --rate 200 --step 0.001 --perturb 0.1 --seed 1 \
                 --nonlinear-viscous-friction joint1=1 --output log/{motion}.csv --experiment log/experiment.toml --use {purpose}"
            ),
        );
    }
    excite(
        at,
        "simulate planar2 d/trajectory.json --rate 100 --step 0.001 --monte-carlo 3 --output m.csv",
    );
    excite(
        at,
        "move planar2 d/trajectory.json --from 0.1,-0.2 --output d",
    );
    excite(at, "rehearse planar2 d/trajectory.json --output d");
    excite(at, "export planar2 --to mujoco --output mine");
    excite(
        at,
        "identify log/experiment.toml --output model --into mine/robot.xml --also sdf,usd",
    );
    excite(
        at,
        "diagnose log/experiment.toml --no-next --output gap --into mine/robot.xml --also isaac-lab",
    );
    for file in [
        "model/robot.sdf",
        "model/robot.usda",
        "gap/actuators.py",
        "gap/scene_robot.xml",
    ] {
        assert!(at.join(file).is_file(), "{file} was not written");
    }
    excite(at, "condense log/experiment.toml --output all.factor");
    excite(at, "merge all.factor --output merged --into mine/robot.xml");
    compare(
        "## Condensed records: `.factor`, and `merged.json`",
        &[at.join("merged/merged.json")],
    );
    compare(
        "## Report before the run: `report.json`",
        &[at.join("d/report.json"), at.join("robot/report.json")],
    );
    compare(
        "## Trajectory: `trajectory.json`",
        &[at.join("d/trajectory.json")],
    );
    compare(
        "## Report after the run: `report.json`",
        &[at.join("model/report.json")],
    );
    compare("## Model: `model.json`", &[at.join("model/model.json")]);
    compare("## Moves: `moves.json`", &[at.join("d/moves.json")]);
    compare(
        "## Rehearsal table: `rehearsal.json`",
        &[at.join("d/rehearsal.json")],
    );
    compare(
        "## Diagnosis: `diagnosis.json`",
        &[at.join("gap/diagnosis.json")],
    );
    compare(
        "## Simulated logs: `excite simulate`",
        &[at.join("m_monte_carlo.json")],
    );
    let text = document("formats.md");
    let table = section(&text, "### Names of effects");
    let names = documented(table);
    let catalogue: Vec<String> = excite::diagnose::catalogue::all()
        .iter()
        .map(|e| e.card().name.to_string())
        .collect();
    assert_eq!(names, catalogue, "names of effects in docs/formats.md");
    // parameters that an effect reports are named in its file
    for line in table.lines().filter(|l| l.starts_with("| `")) {
        let words: Vec<&str> = line.split('`').skip(1).step_by(2).collect();
        let mut code = String::new();
        source(&root().join("src/robot"), &mut code);
        let file = format!("src/diagnose/catalogue/{}.rs", words[0]);
        code += &std::fs::read_to_string(root().join(file)).expect("an effect has a file");
        for parameter in &words[1..] {
            assert!(
                code.contains(&format!("\"{parameter}\"")),
                "{}: no parameter {parameter}",
                words[0]
            );
        }
    }
}

#[test]
fn keys_of_a_parallel_robots_files_are_documented() {
    let dir = tempfile::tempdir().expect("a folder");
    let at = dir.path();
    excite(
        at,
        "design hexapod --starts 1 --harmonics 3 --period 5 --time-limit 2 --output d",
    );
    for (log, payload) in [("empty", ""), ("loaded", "--payload 22,0.03,-0.02,0.12")] {
        excite(
            at,
            &format!(
                "simulate hexapod d/trajectory.json --rate 200 --step 0.002 --output log/{log}.csv \
                 --experiment log/experiment.toml {payload}"
            ),
        );
    }
    excite(at, "load log/experiment.toml --output load");
    compare(
        "## Report before the run: `report.json`",
        &[at.join("d/report.json")],
    );
    compare(
        "## Trajectory: `trajectory.json`",
        &[at.join("d/trajectory.json")],
    );
    compare("## Load: `load.json`", &[at.join("load/load.json")]);
}

/// The example of an `experiment.toml` is read, with every key of its table, and every column of the
/// table of the log is known.
#[test]
fn the_example_of_an_experiment_is_read() {
    let text = document("formats.md");
    let section_ = section(&text, "## Experiment: `experiment.toml`");
    let example = section_
        .split("```toml\n")
        .nth(1)
        .and_then(|t| t.split("```").next())
        .expect("an example");
    let examples: String = section_
        .split("```toml\n")
        .skip(1)
        .filter_map(|t| t.split("```").next())
        .collect();
    for key in documented(section_) {
        let name = key.trim_matches(['[', ']']);
        assert!(examples.contains(name), "`{key}` is in no example");
    }
    let plant = excite::Plant::load("planar2").expect("bundled");
    let joints = plant.actuators().len();
    let mut columns = Vec::new();
    for group in documented(section(&text, "## Log: CSV")) {
        for column in group.split(' ').filter(|c| !c.ends_with('n')) {
            match column.strip_suffix('1') {
                Some(stem) => columns.extend((1..=joints).map(|j| format!("{stem}{j}"))),
                None => columns.push(column.to_string()),
            }
        }
    }
    for name in [
        "t", "q2", "tau2", "dq2", "ddq2", "qref2", "ql2", "pa2", "pb2", "qw",
    ] {
        assert!(
            columns.iter().any(|c| c == name),
            "no {name} in {columns:?}"
        );
    }
    let dir = tempfile::tempdir().expect("a folder");
    std::fs::write(dir.path().join("experiment.toml"), example).expect("written");
    let mut log = columns.join(",") + "\n";
    for i in 0..4000 {
        let t = 0.005 * f64::from(i);
        let row: Vec<String> = columns
            .iter()
            .enumerate()
            .map(|(k, c)| match c.as_str() {
                "t" => t.to_string(),
                // whole harmonics of 20 s repeat after 4 s and 5 s where they are multiples of both
                _ => (0.1 * k as f64 + (std::f64::consts::TAU * t).sin()).to_string(),
            })
            .collect();
        log += &(row.join(",") + "\n");
    }
    for name in example.lines().filter_map(|l| l.strip_prefix("log = ")) {
        std::fs::write(dir.path().join(name.trim_matches('"')), &log).expect("written");
    }
    let experiment = excite::log::Experiment::read(dir.path().join("experiment.toml"))
        .expect("the example is an experiment");
    assert_eq!(experiment.records.len(), 4);
    let record = &experiment.records[0];
    assert!(record.dq.is_some() && record.ddq.is_some() && record.qref.is_some());
    assert!(record.ql.is_some() && record.pose.is_some() && record.pressures.is_some());
    assert_eq!(record.period, Some(4.0));
    for w in experiment.warnings() {
        assert!(!w.message.contains("not known"), "{w}");
    }
}

/// Every module stands in the diagram, and imports only what stands before it.
#[test]
fn imports_run_one_way() {
    let text = document("design.md");
    let diagram = section(&text, "## The house on one page")
        .split("```")
        .nth(1)
        .expect("a diagram")
        .to_string();
    let order: Vec<&str> = diagram
        .lines()
        .skip(1)
        .filter_map(|l| l.split("   ").next())
        .flat_map(str::split_whitespace)
        .collect();
    let place = |name: &str| order.iter().position(|m| *m == name);
    let mut against = BTreeSet::new();
    for entry in std::fs::read_dir(root().join("src"))
        .expect("src")
        .flatten()
    {
        let file = entry.file_name().to_string_lossy().into_owned();
        let module = file.trim_end_matches(".rs");
        if ["lib", "main", "documentation"].contains(&module) {
            continue;
        }
        let at = place(module)
            .unwrap_or_else(|| panic!("{module} is not in the diagram of docs/design.md"));
        let mut code = String::new();
        match entry.path().is_dir() {
            true => source(&entry.path(), &mut code),
            false => code = std::fs::read_to_string(entry.path()).expect("read"),
        }
        let code: String = code
            .lines()
            .map(|l| l.split("//").next().unwrap_or_default())
            .collect::<Vec<_>>()
            .join("\n");
        for prefix in ["crate::", "excite::"] {
            for rest in code.split(prefix).skip(1) {
                let names = match rest.strip_prefix('{') {
                    Some(list) => list.split('}').next().unwrap_or_default(),
                    None => rest
                        .split(|c: char| !c.is_alphanumeric() && c != '_')
                        .next()
                        .unwrap_or_default(),
                };
                for name in names.split(|c: char| !c.is_alphanumeric() && c != '_') {
                    if place(name).is_some_and(|p| p > at) {
                        against.insert((module.to_string(), name.to_string()));
                    }
                }
            }
        }
    }
    assert!(
        against.is_empty(),
        "imports of what stands later in docs/design.md: {against:?}"
    );
}
