//! Logs with everything that goes wrong with them.

use excite::Plant;
use excite::log::parts::{Payload, Purpose};
use excite::log::{Experiment, Record, Table};
use std::fmt::Write as _;
use std::path::PathBuf;

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// A log of `planar2` with `edit` applied to each line's cells.
fn log(
    name: &str,
    dir: &tempfile::TempDir,
    n: usize,
    edit: impl Fn(usize, &mut Vec<String>),
) -> PathBuf {
    let mut text = String::from("t,q1,q2,tau1,tau2\n");
    for i in 0..n {
        let t = 0.002 * i as f64;
        let mut cells: Vec<String> = [
            t,
            0.5 * (2.0 * t).sin(),
            0.4 * (3.0 * t).cos(),
            3.0 * (2.0 * t + 0.3).sin() + 0.01 * (977.0 * t).sin(),
            2.0 * (3.0 * t).sin() + 0.01 * (877.0 * t).sin(),
        ]
        .iter()
        .map(|x| x.to_string())
        .collect();
        edit(i, &mut cells);
        if !cells.is_empty() {
            let _ = writeln!(text, "{}", cells.join(","));
        }
    }
    let path = dir.path().join(name);
    std::fs::write(&path, text).unwrap();
    path
}

fn read(path: &PathBuf) -> excite::Result<Record> {
    read_periodic(path, None)
}

fn read_periodic(path: &PathBuf, period: Option<f64>) -> excite::Result<Record> {
    Record::read(path, &Plant::load("planar2").unwrap(), Purpose::Fit, period)
}

fn says(record: &Record, words: &[&str]) {
    let all: Vec<String> = record.warnings.iter().map(ToString::to_string).collect();
    for w in words {
        assert!(all.iter().any(|t| t.contains(w)), "`{w}` in {all:#?}");
    }
}

#[test]
fn a_clean_log_is_taken_as_it_is() {
    let dir = folder();
    let r = read(&log("clean.csv", &dir, 1000, |_, _| {})).unwrap();
    assert!(r.warnings.is_empty(), "{:?}", r.warnings);
    assert!(!r.resampled && r.len() == 1000 && (r.step - 0.002).abs() < 1e-12);
    assert!(r.valid.iter().all(|v| *v));
    assert_eq!(r.q[1][0], 0.4);
    assert_eq!(r.name, "clean");
}

#[test]
fn time_stamps_are_repaired_and_said() {
    let dir = folder();
    // jitter of a fifth of a step
    let r = read(&log("jitter.csv", &dir, 2000, |i, c| {
        let t = 0.002 * i as f64 + 0.0004 * ((i * 7919 % 101) as f64 / 50.0 - 1.0);
        c[0] = t.to_string();
        c[1] = (0.5 * (2.0 * t).sin()).to_string();
    }))
    .unwrap();
    says(&r, &["jitter", "even grid"]);
    assert!(r.resampled);
    for (t, q) in r.t.iter().zip(&r.q[0]) {
        assert!((q - 0.5 * (2.0 * t).sin()).abs() < 1e-8, "{t}");
    }
    // a gap of 40 samples
    let r = read(&log("gap.csv", &dir, 2000, |i, c| {
        if (500..540).contains(&i) {
            c.clear();
        }
    }))
    .unwrap();
    says(&r, &["1 gap in the time", "40 samples"]);
    assert_eq!(r.len(), 2000);
    assert!(!r.valid[520] && r.valid[400] && r.valid[600]);
    // duplicates
    let r = read(&log("twice.csv", &dir, 2000, |i, c| {
        if i % 100 == 50 {
            c[0] = (0.002 * (i - 1) as f64).to_string();
        }
    }))
    .unwrap();
    says(&r, &["20 time stamps repeat"]);
    assert_eq!(r.len(), 2000);
    assert!((r.step - 0.002).abs() < 1e-9);
    // a counter of 32 bit of microseconds that wraps
    let r = read(&log("wrap.csv", &dir, 2000, |i, c| {
        let t = 4294.0 + 0.002 * i as f64;
        c[0] = (t % 4294.967296).to_string();
    }))
    .unwrap();
    says(&r, &["32 bit of microseconds", "wrapped"]);
    assert!((r.t[1999] - r.t[0] - 0.002 * 1999.0).abs() < 0.003);
    // a clock of milliseconds at 500 Hz would do; one of 10 ms is too coarse
    let r = read(&log("coarse.csv", &dir, 2000, |i, c| {
        c[0] = (0.01 * (i / 5) as f64).to_string()
    }))
    .unwrap();
    says(&r, &["coarser than the sampling"]);
    assert!((r.step - 0.002).abs() < 1e-5);
    let r = read(&log("ms.csv", &dir, 2000, |i, c| {
        c[0] = (2 * i).to_string()
    }))
    .unwrap();
    says(&r, &["milliseconds"]);
}

/// A number in a file must not decide how much is stored, and one bad row must not lose the others.
#[test]
fn wrong_time_stamps_are_named_and_left_out() {
    let dir = folder();
    for stamp in ["1e9", "-1e9", "1e5", "-250", "1e300", "NaN", "inf"] {
        for row in [0, 1, 700, 998, 999] {
            let r = read(&log("stamp.csv", &dir, 1000, |i, c| {
                if i == row {
                    c[0] = stamp.into();
                }
            }))
            .unwrap();
            says(&r, &[&format!("row {}", row + 1), "left out"]);
            let kept = if row == 0 || row == 999 { 999 } else { 1000 };
            assert_eq!(r.len(), kept, "{stamp} in row {row}");
            let last = r.t[r.len() - 1];
            assert!((0.0..2.0).contains(&last), "{stamp} in row {row}: {last}");
            let lost = r.valid.iter().filter(|v| !**v).count();
            assert!(lost <= 2, "{stamp} in row {row}: {lost}");
        }
    }
    // several in a row
    let r = read(&log("some.csv", &dir, 1000, |i, c| {
        if (300..305).contains(&i) {
            c[0] = format!("{}", 1e9 + i as f64);
        }
    }))
    .unwrap();
    says(&r, &["5 time stamps", "row 301"]);
    assert_eq!(r.len(), 1000);
    // a clock that is set in the middle
    let r = read(&log("set.csv", &dir, 1000, |i, c| {
        if i >= 500 {
            c[0] = format!("{}", 1.7e9 + 0.002 * i as f64);
        }
    }))
    .unwrap();
    says(&r, &["jumps ahead", "row 501", "1 gap"]);
    assert!((1000..1020).contains(&r.len()), "{}", r.len());
    // jumps everywhere
    for size in [1e9, 1e200] {
        let jumps = log("jumps.csv", &dir, 1000, |i, c| {
            c[0] = format!("{:e}", 0.002 * i as f64 + size * (i / 4) as f64);
        });
        if let Ok(r) = read(&jumps) {
            assert!(r.len() < 100_000, "{}", r.len());
        }
    }
    let still = log("still.csv", &dir, 1000, |_, c| c[0] = "3".into());
    let message = read(&still).unwrap_err().to_string();
    assert!(message.contains("must increase"), "{message}");
}

#[test]
fn a_period_of_less_than_four_samples_is_none() {
    let dir = folder();
    let path = log("clean.csv", &dir, 1000, |_, _| {});
    for period in [1e-9, 1e-4, 0.002, 0.0079] {
        let r = read_periodic(&path, Some(period)).unwrap();
        says(&r, &["shorter than 4 samples"]);
        assert_eq!((r.period, r.len()), (None, 1000));
    }
}

#[test]
fn a_period_longer_than_any_record_is_none() {
    let dir = folder();
    let path = log("clean.csv", &dir, 1000, |_, _| {});
    for period in [1e6, 1e300, 1e308] {
        let r = read_periodic(&path, Some(period)).unwrap();
        says(&r, &["times as long as the record"]);
        assert_eq!((r.period, r.len()), (None, 1000), "{period}");
    }
}

#[test]
fn channels_that_cannot_be_are_named() {
    let dir = folder();
    let r = read(&log("holes.csv", &dir, 2000, |i, c| {
        if i % 200 == 7 {
            c[3] = if i % 400 == 7 {
                String::new()
            } else {
                "nan".into()
            };
        }
    }))
    .unwrap();
    says(&r, &["tau1: of 2000 values 10 were dropped"]);
    assert!(!r.valid[7] && r.valid[8] && r.tau[0].iter().all(|x| x.is_finite()));
    let r = read(&log("clipped.csv", &dir, 3000, |i, c| {
        let t = 0.002 * i as f64;
        c[4] = ((2.0 * (3.0 * t).sin() + 0.01 * (877.0 * t).sin()).clamp(-1.5, 1.5)).to_string();
    }))
    .unwrap();
    says(&r, &["tau2", "saturated"]);
    assert!(r.valid.iter().filter(|v| !**v).count() > 300);
    let r = read(&log("stuck.csv", &dir, 3000, |i, c| {
        if (1000..1100).contains(&i) {
            c[3] = "1.25".into();
        }
    }))
    .unwrap();
    says(&r, &["tau1", "stands still 1 time,", "100 samples"]);
    assert!(!r.valid[1050] && r.valid[900]);
    let r = read(&log("still.csv", &dir, 1000, |_, c| c[2] = "0.3".into())).unwrap();
    says(&r, &["q2", "does not move"]);
    let r = read(&log("degrees.csv", &dir, 1000, |i, c| {
        c[1] = (57.29578 * 0.5 * (0.004 * i as f64).sin()).to_string();
    }))
    .unwrap();
    says(&r, &["degrees"]);
}

#[test]
fn what_is_no_log_is_an_error_with_its_place() {
    let dir = folder();
    let error = |path: PathBuf| read(&path).unwrap_err().to_string();
    let e = error(log("rest.csv", &dir, 100, |_, c| {
        c[1] = "0.1".into();
        c[2] = "0.2".into();
    }));
    assert!(e.contains("nothing moves"), "{e}");
    let e = error(log("none.csv", &dir, 100, |_, c| c[4] = "nan".into()));
    assert!(e.contains("tau2") && e.contains("not recorded"), "{e}");
    for (header, word) in [
        ("t,q1,q2,q3,tau1,tau2,tau3", "2 actuated joints"),
        ("t,q1,tau1,tau2", "not q2"),
        ("t,q1,q2", "no columns tau1"),
        ("t,q1,q1,tau1,tau2", "not q2"),
    ] {
        let path = dir.path().join("header.csv");
        let row = header
            .split([',', ';'])
            .map(|_| "1")
            .collect::<Vec<_>>()
            .join(",");
        std::fs::write(
            &path,
            format!("{header}\n{}", format!("{row}\n").repeat(10)),
        )
        .unwrap();
        let e = error(path);
        assert!(e.contains(word) && e.contains("line 1"), "{header}: {e}");
    }
    let path = dir.path().join("nameless.csv");
    std::fs::write(&path, "0.0,1.0,2.0,3.0,4.0\n".repeat(10)).unwrap();
    let e = error(path);
    assert!(e.contains("record.columns") && e.contains("time"), "{e}");
    let path = dir.path().join("empty.csv");
    std::fs::write(&path, "").unwrap();
    assert!(error(path).contains("empty"));
}

#[test]
fn a_recording_cut_in_its_last_line_is_read() {
    let dir = folder();
    let path = log("cut.csv", &dir, 500, |_, _| {});
    let mut text = std::fs::read_to_string(&path).unwrap();
    text.push_str("1.0,0.25");
    std::fs::write(&path, text).unwrap();
    let r = read(&path).unwrap();
    says(&r, &["breaks off"]);
    assert_eq!(r.len(), 500);
    // a bad line before it is no end of the recording
    let text = std::fs::read_to_string(&path).unwrap();
    let mut lines: Vec<&str> = text.lines().collect();
    lines[300] = "1.0,abc";
    std::fs::write(&path, lines.join("\n")).unwrap();
    let r = read(&path).unwrap();
    says(&r, &["line 301", "2 cells instead of 5", "breaks off"]);
}

/// Corrupt rows and impossible values are named with their place and left out.
#[test]
fn corrupt_rows_are_named_and_left_out() {
    let dir = folder();
    let r = read(&log("short.csv", &dir, 1000, |i, c| match i {
        41 => {
            c.pop();
        }
        99 => c[2] = "fault".into(),
        300 => c[0] = "2.7e157".into(),
        400 => c[1] = "1e33".into(),
        _ => {}
    }))
    .unwrap();
    says(
        &r,
        &[
            "2 lines are no rows",
            "line 43: it has 4 cells instead of 5",
            "line 101: column q2: `fault` is not a number",
            "q1: 1 value cannot have been measured, the first at row 399",
        ],
    );
    assert_eq!(r.warnings.len(), 5, "{:#?}", r.warnings);
    assert_eq!(r.len(), 1000, "rows that were left out are interpolated");
    assert!(r.q[0].iter().all(|x| x.abs() < 1.0));
    // hundreds of bad lines are one warning; a file of nothing else is an error
    let r = read(&log("often.csv", &dir, 2000, |i, c| {
        if i % 5 == 1 {
            c[3] = "ERR".into();
        }
    }))
    .unwrap();
    let about: Vec<_> = r
        .warnings
        .iter()
        .filter(|w| w.message.contains("no rows"))
        .collect();
    assert_eq!(about.len(), 1);
    assert!(
        about[0].message.starts_with("400 lines are no rows"),
        "{}",
        about[0]
    );
}

#[test]
fn large_files_are_read_in_blocks() {
    let dir = folder();
    let path = dir.path().join("large.csv");
    let mut text = String::from("\u{feff}t,a,b\r\n# comment\r\n");
    let n = 600_000;
    for i in 0..n {
        let _ = write!(text, "{},{}.5,-{}e-3\r\n", i, i, i);
    }
    std::fs::write(&path, &text).unwrap();
    let table = Table::read(&path, &|name| name != "a").unwrap();
    assert_eq!(table.rows(), n);
    assert!(table.columns[1].is_empty());
    for i in [0, 1, 77_777, n - 1] {
        assert_eq!(table.columns[0][i], i as f64);
        assert_eq!(table.columns[2][i], -(i as f64) / 1000.0);
    }
    // the line of an error is right in any block
    let broken = text.replacen("500000,500000.5", "500000,x", 1);
    std::fs::write(&path, broken).unwrap();
    let table = Table::read(&path, &|_| true).unwrap();
    assert_eq!(table.rows(), n - 1);
    assert!(
        table.warnings[0].message.contains("line 500003"),
        "{:?}",
        table.warnings
    );
}

#[test]
fn an_experiment_is_read_with_its_records() {
    let dir = folder();
    log("one.csv", &dir, 4000, |_, _| {});
    log("two.csv", &dir, 1000, |_, _| {});
    let path = dir.path().join("experiment.toml");
    let write = |text: &str| std::fs::write(&path, text).unwrap();
    write(
        "robot = \"planar2\"\n[[record]]\nlog = \"one.csv\"\nuse = \"fit\"\nperiod = 6.283185307179586\n\
         [[record]]\nlog = \"two.csv\"\nuse = \"holdout\"\npayload = { mass = 2.0, com = [0, 0, 0.05] }\n",
    );
    let e = Experiment::read(&path).unwrap();
    assert_eq!(e.records.len(), 2);
    assert_eq!(e.records(Purpose::Holdout).count(), 1);
    assert!(matches!(
        e.records[1].payload,
        Payload::Known { mass: 2.0, .. }
    ));
    // 6.283 s are 3141.59 steps of 2 ms: the grid is made to divide the period
    let r = &e.records[0];
    assert!((r.step * 3142.0 - std::f64::consts::TAU).abs() < 1e-12);
    assert_eq!(r.periods(), Some((3142, 1)));
    for (text, word) in [
        (
            "robot = \"planar2\"\n[[record]]\nlog = \"one.csv\"\nuse = \"train\"\n",
            "train",
        ),
        (
            "robot = \"planar2\"\n[[record]]\nlog = \"one.csv\"\nuse = \"fit\"\nperiods = 3\n",
            "periods",
        ),
        (
            "robot = \"planar2\"\n[[record]]\nlog = \"one.csv\"\nuse = \"fit\"\nperiod = -1.0\n",
            "positive",
        ),
        (
            "robot = \"planar2\"\n[[record]]\nlog = \"one.csv\"\nuse = \"fit\"\npayload = \"heavy\"\n",
            "heavy",
        ),
        (
            "robot = \"planar2\"\n[[record]]\nlog = \"gone.csv\"\nuse = \"fit\"\n",
            "gone.csv",
        ),
        (
            "robot = \"nosuch\"\n[[record]]\nlog = \"one.csv\"\nuse = \"fit\"\n",
            "nosuch",
        ),
        (
            "robot = \"ur5e\"\n[[record]]\nlog = \"one.csv\"\nuse = \"fit\"\n",
            "6 actuated joints",
        ),
    ] {
        write(text);
        let e = Experiment::read(&path).unwrap_err().to_string();
        assert!(e.contains(word), "{word}: {e}");
    }
}
