//! What the dependencies ask for: their licences and their Rust, of all platforms (`cargo metadata`).

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

/// Licences under which a program may be passed on with no more than their text (SPDX).
const ALLOWED: [&str; 10] = [
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "ISC",
    "MIT",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

/// Whether an SPDX expression can be met by allowed licences: one of `OR`, all of `AND`, which binds tighter. The old
/// `/` is an `OR`.
fn allowed(expression: &str) -> bool {
    let spaced = expression.replace('/', " OR ");
    let spaced = spaced.replace('(', " ( ").replace(')', " ) ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut at = 0;
    any(&words, &mut at) && at == words.len()
}

fn any(words: &[&str], at: &mut usize) -> bool {
    let mut met = all(words, at);
    while words.get(*at) == Some(&"OR") {
        *at += 1;
        met |= all(words, at);
    }
    met
}

fn all(words: &[&str], at: &mut usize) -> bool {
    let mut met = one(words, at);
    while words.get(*at) == Some(&"AND") {
        *at += 1;
        met &= one(words, at);
    }
    met
}

fn one(words: &[&str], at: &mut usize) -> bool {
    let Some(word) = words.get(*at) else {
        return false;
    };
    *at += 1;
    if *word == "(" {
        let met = any(words, at);
        let closed = words.get(*at) == Some(&")");
        *at += 1;
        return met && closed;
    }
    if let [first, "WITH", exception, ..] = words[*at - 1..] {
        *at += 2;
        return ALLOWED.contains(&format!("{first} WITH {exception}").as_str());
    }
    ALLOWED.contains(word)
}

#[test]
fn licence_expressions_are_read() {
    for good in [
        "MIT",
        "MIT/Apache-2.0",
        "GPL-3.0-only OR MIT",
        "(MIT OR GPL-3.0-only) AND Unicode-3.0",
        "Apache-2.0 WITH LLVM-exception",
    ] {
        assert!(allowed(good), "{good}");
    }
    for bad in [
        "",
        "GPL-3.0-only",
        "MIT AND GPL-3.0-only",
        "GPL-3.0-only AND MIT OR GPL-2.0-only",
        "(MIT",
        "MIT Apache-2.0",
        "GPL-3.0-only WITH LLVM-exception",
    ] {
        assert!(!allowed(bad), "{bad}");
    }
}

/// What cargo says of this project.
fn cargo(args: &[&str]) -> String {
    let cargo = std::env::var("CARGO").unwrap_or("cargo".into());
    let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
    let out = Command::new(cargo)
        .args(args)
        .args(["--locked", "--manifest-path", manifest])
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{message}");
    String::from_utf8(out.stdout).unwrap()
}

fn packages() -> Vec<Value> {
    let out = cargo(&["metadata", "--format-version", "1"]);
    let all: Value = serde_json::from_str(&out).unwrap();
    all["packages"].as_array().unwrap().clone()
}

fn name(package: &Value) -> String {
    let text = |key: &str| package[key].as_str().unwrap().to_string();
    format!("{} {}", text("name"), text("version"))
}

#[test]
#[ignore = "asks the registry for the packages of all platforms; .ci/run does"]
fn every_dependency_has_a_known_licence() {
    let packages = packages();
    assert!(packages.len() > 100, "{}", packages.len());
    let unknown: Vec<String> = (packages.iter())
        .filter(|p| !p["license"].as_str().is_some_and(allowed))
        .map(|p| format!("{}: {}", name(p), p["license"]))
        .collect();
    assert!(unknown.is_empty(), "{unknown:#?}");
}

/// Major and minor version, 1.0 where none is stated.
fn rust(package: &Value) -> (u32, u32) {
    let text = package["rust_version"].as_str().unwrap_or("1.0");
    let mut parts = text.split('.').map(|p| p.parse().unwrap());
    (parts.next().unwrap(), parts.next().unwrap_or(0))
}

#[test]
#[ignore = "asks the registry for the packages of all platforms; .ci/run does"]
fn no_dependency_needs_a_newer_rust_than_stated() {
    let packages = packages();
    let own = packages.iter().find(|p| p["name"] == "excite").unwrap();
    let newer: Vec<String> = (packages.iter())
        .filter(|p| rust(p) > rust(own))
        .map(|p| format!("{}: {}", name(p), p["rust_version"]))
        .collect();
    assert!(newer.is_empty(), "{newer:#?}");
}

/// Features of every package that is built for a member, by name and version.
fn features(member: &str, edges: &str) -> BTreeMap<String, BTreeSet<String>> {
    let of = [
        "tree",
        "--prefix",
        "none",
        "--no-dedupe",
        "--package",
        member,
    ];
    let format = ["--format", "{p}\t{f}", "--edges", edges];
    let out = cargo(&[&of[..], &format[..]].concat());
    let mut all: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for line in out.lines() {
        if let Some((package, features)) = line.split_once('\t') {
            let of = all.entry(package.to_owned()).or_default();
            of.insert(features.to_owned());
        }
    }
    all
}

/// Otherwise `cargo run` after `cargo test`, or the Python package after either, compiles the library once more, for
/// minutes.
#[test]
#[ignore = "asks the registry for the packages of all platforms; .ci/run does"]
fn tests_and_python_ask_for_no_other_features_than_the_program() {
    let program = features("excite", "normal,build");
    assert!(program.len() > 100, "{}", program.len());
    for (member, edges) in [
        ("excite", "normal,build,dev"),
        ("excite-python", "normal,build"),
    ] {
        let other = features(member, edges);
        for (package, of) in &program {
            assert_eq!(of, &other[package], "{member}: {package}");
        }
    }
}
