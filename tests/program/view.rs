//! The view in space: its data in the page, and what it does in a browser.

use excite::Plant;
use excite::identifiability::assess;
use excite::identifiability::page::html;
use excite::trajectory::Trajectory;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

fn stored(robot: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    root.join(format!("trajectories/{robot}/trajectory.json"))
}

fn page(robot: &str) -> String {
    let trajectory = Trajectory::read(stored(robot)).expect("a trajectory");
    let plant = Plant::load(robot).expect("bundled");
    html(
        &assess(&plant, Some(&trajectory)).expect("an assessment"),
        None,
    )
}

/// The data of the view in a page, and how long it is with its script.
fn view(page: &str) -> (Value, usize) {
    let from = page.find("<div class=\"view\"").expect("a view");
    let data = page[from..]
        .split("<script type=\"application/json\">")
        .nth(1);
    let data = data
        .and_then(|d| d.split("</script>").next())
        .expect("data");
    let script = page[from..].split("<script>").nth(1);
    let script = script
        .and_then(|d| d.split("</script>").next())
        .expect("a script");
    let value = serde_json::from_str(data).expect("JSON");
    (value, data.len() + script.len())
}

fn list<'a>(value: &'a Value, key: &str) -> &'a Vec<Value> {
    value[key]
        .as_array()
        .unwrap_or_else(|| panic!("{key} is no list"))
}

/// A column of differences as numbers.
fn column(differences: &Value) -> Vec<f64> {
    let mut sum = 0;
    let all = differences.as_array().expect("a column").iter();
    all.map(|d| {
        sum += d.as_i64().expect("a whole number");
        1e-5 * sum as f64
    })
    .collect()
}

#[test]
fn the_view_shows_every_robot_and_is_small() {
    for robot in ["panda", "ur10", "scara", "hexapod", "delta", "h4"] {
        let page = page(robot);
        let (data, size) = view(&page);
        assert!(size < 1_000_000, "{robot}: {size}");
        let times = column(&data["times"]);
        assert!(
            (20..=401).contains(&times.len()),
            "{robot}: {} samples",
            times.len()
        );
        assert!(
            times[0] == 0.0 && times.windows(2).all(|w| w[1] > w[0]),
            "{robot}"
        );
        for key in ["uses", "which"] {
            assert_eq!(
                list(&data, key).len(),
                list(&data, "joints").len(),
                "{robot}"
            );
        }
        // what moves: bodies as poses, or lines as ends
        let (bodies, lines) = (list(&data, "frames"), list(&data, "ends"));
        assert!(bodies.len() + lines.len() > 1, "{robot}");
        assert_eq!(bodies.len(), list(&data, "bodies").len());
        for (all, columns) in [(bodies, 7), (lines, 6)] {
            for part in all {
                let part = part.as_array().expect("columns");
                assert_eq!(part.len(), columns);
                for c in part {
                    let c = column(c);
                    assert_eq!(c.len(), times.len(), "{robot}");
                    // the motion comes round
                    assert!((c[0] - c[c.len() - 1]).abs() < 2e-5, "{robot}");
                }
            }
        }
        let path: Vec<Vec<f64>> = list(&data, "path").iter().map(column).collect();
        assert_eq!(path.len(), 3);
        assert!(
            path.iter().flatten().any(|x| (x - path[0][0]).abs() > 0.01),
            "{robot}"
        );
        // limits that hold are not passed, and some come near
        let uses: Vec<f64> = list(&data, "uses")
            .iter()
            .flat_map(|u| u.as_array().expect("a row"))
            .map(|u| u.as_f64().expect("a number"))
            .collect();
        let most = uses.iter().copied().fold(0.0, f64::max);
        assert!((300.0..=1001.0).contains(&most), "{robot}: {most}");
        assert!(page.contains("The robot in motion"));
    }
}

#[test]
fn a_robot_alone_has_no_view() {
    let a = assess(&Plant::load("panda").expect("bundled"), None).expect("an assessment");
    assert!(!html(&a, None).contains("<script"));
}

/// A browser and what drives it, where both are there.
fn browser() -> Option<&'static str> {
    let runs = |program: &str| {
        Command::new(program)
            .arg("--version")
            .output()
            .is_ok_and(|o| o.status.success())
    };
    let found = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    found
        .into_iter()
        .find(|b| runs(b))
        .filter(|_| runs("python3"))
}

/// A reader presses play, pulls the slider, turns, comes closer, and nothing is on the console.
#[test]
fn the_view_plays_in_a_browser() {
    let Some(chromium) = browser() else {
        eprintln!("skipped: no chromium, or no python3 to drive it");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    for (robot, flags, renderer) in [
        ("panda", "", "webgl"),
        ("hexapod", "", "webgl"),
        ("panda", "--disable-3d-apis", "canvas"),
    ] {
        let file = folder.path().join("report.html");
        std::fs::write(&file, page(robot)).expect("written");
        let driver = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/view.py");
        let mut command = Command::new("python3");
        command
            .arg(driver)
            .arg(chromium)
            .arg(&file)
            .args(["--flags", flags]);
        let out = command.output().expect("python3 runs");
        let text = String::from_utf8_lossy(&out.stdout);
        let said = String::from_utf8_lossy(&out.stderr);
        let seen: Value =
            serde_json::from_str(&text).unwrap_or_else(|e| panic!("{robot}: {e}: {text}{said}"));
        assert_eq!(seen["errors"], serde_json::json!([]), "{robot}");
        assert_eq!(seen["renderer"], renderer, "{robot}");
        assert_eq!(seen["unnamed"], 0, "{robot}: controls without a name");
        for fact in [
            "plays", "rests", "moves", "scrubbed", "turns", "zooms", "steps", "resets",
        ] {
            assert_eq!(seen[fact], true, "{robot}: {fact}: {seen}");
        }
        let named = list(&seen, "names").iter().filter_map(Value::as_str);
        assert!(
            named.clone().any(|n| n.ends_with(" %")),
            "{robot}: {named:?}"
        );
        for (key, value) in seen.as_object().expect("facts") {
            assert!(!key.starts_with("box ") || value == true, "{robot}: {key}");
        }
    }
}
