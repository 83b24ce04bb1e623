//! Condensed records: the same estimate as from the records, in any order and grouping.

use crate::common::parts;
use crate::common::rehearse;
use crate::common::shared::shared;
use excite::Plant;
use excite::identify::parts::{Merged, Method};
use excite::identify::{
    Factor, Settings, condense, condense_parts, identify, identify_parts, merge,
};
use excite::log::parts::Purpose;
use excite::log::{Experiment, Outline, Record};
use excite::robot::parts::JointTerm;
use excite::simulate::parts::Sensors;
use excite::simulate::{Effects, measure, simulate, to_record};
use std::ops::ControlFlow;
use std::path::Path;

fn plant() -> Plant {
    let terms = [JointTerm::Viscous, JointTerm::Coulomb, JointTerm::Offset];
    Plant::load("planar2").unwrap().with_terms(&terms)
}

/// Three runs at different speeds, the last one only predicted.
fn records(plant: &Plant) -> Vec<Record> {
    let motion = rehearse::motion("planar2");
    let run = |(k, period): (usize, f64)| {
        let motion = rehearse::within(&motion, period);
        let settings = rehearse::simulation(Effects::default());
        let run = simulate(plant, &motion, 3, &settings, &|_| {}).unwrap();
        let sensors = Sensors::new(plant, 1.0).0;
        let measured = measure(&run, &sensors, &settings.effects, k as u64);
        let purpose = if k == 2 {
            Purpose::Holdout
        } else {
            Purpose::Fit
        };
        to_record(&run, &measured, purpose, period)
    };
    [5.0, 6.5, 5.7].into_iter().enumerate().map(run).collect()
}

fn settings(method: Method) -> Settings {
    let mut s = Settings::default().with(|set| set.method = method);
    s.signals.cutoff = Some(15.0);
    s
}

fn of(plant: &Plant, records: &[Record]) -> Factor {
    let settings = settings(Method::Wls);
    condense(plant, "planar2", None, records, &settings).unwrap()
}

/// Through the bytes of files.
fn merged(plant: &Plant, all: &[&Factor], settings: &Settings) -> Merged {
    let read = |f: &&Factor| {
        let bytes = f.to_bytes().unwrap();
        Factor::from_bytes(&bytes, Path::new("a.factor")).unwrap()
    };
    merge(plant, all.iter().map(read).collect(), settings).unwrap()
}

fn off(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let pairs = a.iter().zip(b);
    pairs.map(|(x, y)| (x - y).abs() / size).fold(0.0, f64::max)
}

/// Positions and torques of a run, with a column that is none of them.
fn write_csv(path: &Path, run: &Record) {
    let mut text = String::from("t,q1,q2,tau1,tau2,mode\n");
    for k in 0..run.len() {
        let [q, tau] = [&run.q, &run.tau];
        let numbers = [run.t[k], q[0][k], q[1][k], tau[0][k], tau[1][k]];
        text += &numbers.map(|x| format!("{x:?}")).join(",");
        text += ",auto\n";
    }
    std::fs::write(path, text).unwrap();
}

#[test]
fn merged_factors_give_what_all_records_give() {
    let plant = plant();
    let records = records(&plant);
    let [a, b] = [0, 1].map(|k| of(&plant, &records[k..=k]));
    // a holdout record comes with one for the fit
    let c = of(&plant, &records[1..]);
    let all = of(&plant, &records);
    for method in [Method::Wls, Method::Ols] {
        let settings = settings(method);
        let whole = identify(&plant, &records, &settings).unwrap();
        let parts = merged(&plant, &[&a, &c], &settings);
        let one = merged(&plant, &[&all], &settings);
        let turned = merged(&plant, &[&b, &a], &settings);
        for m in [&parts, &one, &turned] {
            println!(
                "{method:?}: base parameters off by {:.1e}, standard ones by {:.1e}, inflation {} {}",
                off(&m.pi, &whole.pi),
                off(&m.phi, &whole.phi),
                m.inflation,
                whole.inflation
            );
            assert!(off(&m.pi, &whole.pi) < 1e-10);
            // what only the prior knows is as good as the solver of the bodies
            let sure = m.phi.iter().zip(&one.phi).zip(&one.phi_std);
            let sure = sure
                .map(|((x, y), s)| (x - y).abs() / s)
                .fold(0.0, f64::max);
            println!(
                "of one factor: {:.1e}, {sure:.1e} of their standard deviations",
                off(&m.phi, &one.phi)
            );
            assert!(off(&m.pi, &one.pi) < 1e-10 && sure < 1e-5);
            assert_eq!(m.prior_strength, one.prior_strength);
            // the variance through correlated residuals alone is estimated otherwise
            for ((x, y), s) in m.phi.iter().zip(&whole.phi).zip(&whole.phi_std) {
                assert!((x - y).abs() < 0.3 * s, "{x} {y} {s}");
            }
        }
        let covariance = |m: &faer::Mat<f64>| -> Vec<f64> { (0..2).map(|i| m[(i, i)]).collect() };
        let [x, y] = [&parts.residual_covariance, &whole.residual_covariance].map(covariance);
        assert!(off(&x, &y) < 1e-9);
        let [nominal, model] = [0, 1].map(|k| parts.errors[1][k].as_ref().unwrap().relative_error);
        assert!(model < nominal && model < 0.1, "{model} {nominal}");
        assert!(turned.errors[1][0].is_none());
    }
}

/// What a file rounds adds up over as many files as there are records, and stays far below the promise.
#[test]
fn many_files_are_as_good_as_one() {
    let plant = plant();
    let run = &records(&plant)[0];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("day.csv");
    write_csv(&path, run);
    let parts = parts::read(&path, &plant, run.len() / 12);
    assert!(parts.len() > 10);
    let wls = settings(Method::Wls);
    let whole = identify(&plant, &parts, &wls).unwrap();
    let factors: Vec<Factor> = parts
        .iter()
        .map(|p| of(&plant, std::slice::from_ref(p)))
        .collect();
    let found = merged(&plant, &factors.iter().collect::<Vec<_>>(), &wls);
    println!("base parameters off by {:.1e}", off(&found.pi, &whole.pi));
    assert!(off(&found.pi, &whole.pi) < 1e-10);
    // a sum that went through files itself
    let sum = factors.iter().cloned().reduce(|a, b| {
        let bytes = a.with(b).unwrap().to_bytes().unwrap();
        Factor::from_bytes(&bytes, Path::new("sum.factor")).unwrap()
    });
    let again = merged(&plant, &[&sum.unwrap()], &wls);
    assert!(off(&again.pi, &whole.pi) < 1e-10);
    assert_eq!(again.prior_strength, found.prior_strength);
}

/// A log that is read in parts is cut between rows, nowhere else, and its parts condensed one by one give what all of them
/// together give.
#[test]
fn a_log_in_parts_is_the_same_log() {
    let plant = plant();
    let run = &records(&plant)[0];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("day.csv");
    write_csv(&path, run);
    let whole = Record::read(&path, &plant, Purpose::Fit, None).unwrap();
    let rows = run.len() / 4 + 7;
    let parts = parts::read(&path, &plant, rows);
    let sizes: Vec<usize> = parts.iter().map(Record::len).collect();
    let last = *sizes.last().unwrap();
    assert!(sizes.len() >= 3 && sizes[..sizes.len() - 1].iter().all(|n| *n == rows));
    assert!(2 * last >= rows && 2 * last < 3 * rows, "{sizes:?}");
    parts::hold(&parts, &whole, "in parts");

    let mut factors = parts.iter().map(|p| of(&plant, std::slice::from_ref(p)));
    let first = factors.next().unwrap();
    let sum = factors.fold(first, |a, b| a.and_then(b).unwrap());
    assert_eq!(sum.header.parts[0].records.len(), 1);
    let wls = settings(Method::Wls);
    let found = merged(&plant, &[&sum], &wls);
    let together = identify(&plant, &parts, &wls).unwrap();
    println!(
        "base parameters off by {:.1e}",
        off(&found.pi, &together.pi)
    );
    assert!(off(&found.pi, &together.pi) < 1e-10);
    // what a cut costs are the samples beside it: an estimate from fewer samples
    let at_once = identify(&plant, &[whole], &wls).unwrap();
    for (k, pi) in found.pi.iter().enumerate() {
        let apart = (pi - at_once.pi[k]).abs() / at_once.std[k];
        assert!(apart < 3.0, "{k}: {apart} standard deviations");
    }
}

/// An experiment that is read in parts gives what its parts give as records of their own: parameters, spread and errors,
/// on motion that was fitted and on motion that was not.
#[test]
fn an_experiment_in_parts_is_identified_from_all_of_its_rows() {
    let plant = plant();
    let folder = tempfile::tempdir().unwrap();
    let mut toml = String::from("robot = \"planar2\"\n");
    for (k, run) in records(&plant).iter().enumerate() {
        write_csv(&folder.path().join(format!("{k}.csv")), run);
        let purpose = if k == 2 { "holdout" } else { "fit" };
        toml += &format!("[[record]]\nlog = \"{k}.csv\"\nuse = \"{purpose}\"\n");
    }
    // a record with a load is left out, and said to be
    toml += "[[record]]\nlog = \"0.csv\"\nuse = \"fit\"\npayload = \"unknown\"\n";
    let file = folder.path().join("experiment.toml");
    std::fs::write(&file, toml).unwrap();
    let outline = Outline::read(&file).unwrap();
    let rows = 1700;
    let mut settings = settings(Method::Wls);
    let none = |_: &Record| Ok(Vec::new());
    let condensed =
        |settings: &Settings| condense_parts(&outline, &plant, None, rows, settings, &none);
    let identified = |settings: &Settings| identify_parts(&plant, condensed(settings).unwrap());
    let found = identified(&settings).unwrap();
    let mut parts = Vec::new();
    for k in 0..3 {
        outline
            .parts(k, rows, &mut |part| {
                parts.push(part);
                Ok(ControlFlow::Continue(()))
            })
            .unwrap();
    }
    assert!(parts.len() > 5, "{}", parts.len());
    let mut thin = settings.clone();
    thin.signals.thin = true;
    let whole = identify(&plant, &parts, &thin).unwrap();
    println!("base parameters off by {:.1e}", off(&found.pi, &whole.pi));
    assert!(off(&found.pi, &whole.pi) < 1e-10);
    assert!(off(&found.predicted_std, &whole.predicted_std) < 1e-9);
    // the variance through correlated residuals is a mean over the parts
    for (a, b) in found.std.iter().zip(&whole.std) {
        assert!((a / b - 1.0).abs() < 0.25, "{a} {b}");
    }
    let [a, b] = [&found.validation, &whole.validation];
    let pairs = [(a.plain, b.plain), (a.nominal, b.nominal)];
    for (x, y) in pairs {
        assert!((x.0 / y.0 - 1.0).abs() < 1e-6, "{x:?} {y:?}");
        assert!(
            (x.1.unwrap() / y.1.unwrap() - 1.0).abs() < 1e-6,
            "{x:?} {y:?}"
        );
    }
    // the rows of a record are counted, and the loaded one is named
    let lengths: Vec<usize> = found.in_parts.iter().map(|s| s.rows).collect();
    assert_eq!(
        lengths,
        records(&plant).iter().map(Record::len).collect::<Vec<_>>()
    );
    let said = |kind| found.warnings.iter().filter(|w| w.kind == kind).count();
    assert_eq!(said(excite::WarningKind::ReadInParts), 3);
    assert_eq!(said(excite::WarningKind::RecordLeftOut), 1);

    // without a cut-off, that of the fastest fit record counts
    settings.signals.cutoff = None;
    let chosen = identified(&settings).unwrap();
    let fit: Vec<&Record> = parts.iter().filter(|p| p.purpose == Purpose::Fit).collect();
    let cutoff = excite::signals::common_cutoff([fit[0]]);
    assert!(chosen.prepared[0].filter.cutoff >= cutoff);
    settings.method = Method::Robust;
    let error = condensed(&settings).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("--rows 0"), "{error}");
}

/// Smooth columns of the regressor at fewer samples, and friction at all: the estimate stays where it is, to a small part of
/// its standard deviation.
#[test]
fn fewer_samples_of_the_regressor_say_the_same() {
    let terms = [JointTerm::Viscous, JointTerm::Coulomb, JointTerm::Offset];
    for (robot, cutoff) in [("planar2", 4.0), ("scara", 3.0), ("ur5e", 3.0)] {
        let plant = Plant::load(robot).unwrap().with_terms(&terms);
        let motion = rehearse::within(&rehearse::motion(robot), 8.0);
        let simulation = rehearse::simulation(Effects::default());
        let run = simulate(&plant, &motion, 3, &simulation, &|_| {}).unwrap();
        let sensors = Sensors::new(&plant, 1.0).0;
        let measured = measure(&run, &sensors, &simulation.effects, 1);
        let mut record = to_record(&run, &measured, Purpose::Fit, 8.0);
        record.period = None;
        let mut settings = settings(Method::Wls);
        settings.signals.cutoff = Some(cutoff);
        let all = identify(&plant, std::slice::from_ref(&record), &settings).unwrap();
        settings.signals.thin = true;
        let few = identify(&plant, &[record], &settings).unwrap();
        let stride = few.prepared[0].thin.as_ref().unwrap().stride;
        let apart = (few.pi.iter().zip(&all.pi).zip(&all.std))
            .map(|((x, y), s)| (x - y).abs() / s)
            .fold(0.0, f64::max);
        let errors = [&few, &all].map(|id| id.validation.plain.0);
        println!(
            "{robot}: one sample of {stride}, {apart:.3} standard deviations apart, {errors:?}"
        );
        assert!(stride > 1 && apart < 0.3, "{robot}: {stride} {apart}");
        assert!((errors[0] / errors[1] - 1.0).abs() < 0.02, "{errors:?}");
    }
}

/// The answer does not depend on how many parts are worked on at a time.
#[test]
fn parts_side_by_side_are_parts_one_by_one() {
    let plant = plant();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("day.csv");
    write_csv(&path, &records(&plant)[0]);
    let outline = Outline::of_log(&path, "planar2", None).unwrap();
    let wls = settings(Method::Wls);
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let none = |_: &Record| Ok(Vec::new());
        let condensed = || condense_parts(&outline, &plant, None, 700, &wls, &none).unwrap();
        let found = pool.build().unwrap().install(condensed);
        assert!(found.shares[0].parts > 3, "{}", found.shares[0].parts);
        found.factor.to_bytes().unwrap()
    };
    assert!(of(1) == of(4));
}

/// Where only a part of a record counts, a log in parts has the rows of the log as a whole, whatever its clock: seconds,
/// nanoseconds since 1970, or a rate alone. The rows before are passed over in blocks. What is wrong is named with its
/// row in the file.
#[test]
fn a_part_of_a_long_record_comes_in_parts() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("day.csv");
    let ends = [310.0, 520.5];
    for (clock, time) in [
        ("t", ""),
        ("stamp", "time = { column = \"stamp\", unit = \"ns\" }"),
        ("number", "time = { rate = 500.0 }"),
    ] {
        let mut text = format!("{clock},q1,q2,tau1,tau2\n");
        for k in 0..300_000 {
            let t = 0.002 * k as f64;
            let stamp = match clock {
                "t" => format!("{t:.3}"),
                "stamp" => format!("{}", 1_700_000_000_000_000_000_u64 + 2_000_000 * k),
                _ => format!("{k}"),
            };
            let [q, v] = [(0.9 * t).sin(), (0.9 * t).cos()];
            let last = if k == 220_122 {
                1_000_000_000_000_000
            } else {
                k
            };
            text += &format!("{stamp},{q:.9},{v:.9},{:.9},{last}\n", 2.0 * q + v);
            if k % 50_000 == 77 {
                text += "# a remark is no row\n";
            }
        }
        assert!(text.len() > 12_000_000, "several blocks of the reader");
        std::fs::write(&path, text).unwrap();
        let columns = match time {
            "" => String::new(),
            time => format!(
                "[record.columns]\n{time}\nq = [\"q1\", \"q2\"]\ntau = [\"tau1\", \"tau2\"]\n"
            ),
        };
        let [from, to] = ends;
        let toml = format!(
            "robot = \"planar2\"\n[[record]]\nlog = \"day.csv\"\nuse = \"fit\"\nto = 300.0\n{columns}\
             [[record]]\nlog = \"day.csv\"\nuse = \"holdout\"\nfrom = {from}\nto = {to}\n{columns}"
        );
        let file = folder.path().join("experiment.toml");
        std::fs::write(&file, toml).unwrap();
        let whole = Experiment::read(&file).unwrap();
        let outline = Outline::read(&file).unwrap();
        for (k, whole) in whole.records.iter().enumerate() {
            let mut parts = Vec::new();
            let mut take = |part| {
                parts.push(part);
                Ok(ControlFlow::Continue(()))
            };
            outline.parts(k, 40_000, &mut take).unwrap();
            assert!(parts.len() >= 3, "{clock}: {}", parts.len());
            parts::hold(&parts, whole, clock);
            let named = |records: &[Record]| -> Vec<String> {
                let all = records.iter().flat_map(|r| &r.warnings);
                let rows = all.filter(|w| w.message.contains("at row"));
                rows.map(|w| w.message.clone()).collect()
            };
            let found = named(&parts);
            assert_eq!(found, named(std::slice::from_ref(whole)), "{clock}");
            assert!(found.len() == k && found.iter().all(|w| w.contains("at row 220123 ")));
            let times: Vec<f64> = parts.iter().flat_map(|p| p.t.clone()).collect();
            assert!(
                times
                    .iter()
                    .zip(&whole.t)
                    .all(|(a, b)| (a - b).abs() < 1e-6)
                    || clock == "number"
            );
        }
        // beyond the end of the log there is nothing
        let toml = format!(
            "robot = \"planar2\"\n[[record]]\nlog = \"day.csv\"\nuse = \"fit\"\nfrom = 9000\n{columns}"
        );
        std::fs::write(&file, toml).unwrap();
        let outline = Outline::read(&file).unwrap();
        let none = outline.parts(0, 40_000, &mut |_| Ok(ControlFlow::Continue(())));
        let message = none.unwrap_err().to_string();
        assert!(
            message.contains("lie between 9000 s of the record and its end"),
            "{message}"
        );
    }
}

/// Parts of a log with names that say nothing, parts of a few rows, and a log in which nothing moves are refused; a part that stands is
/// left out.
#[test]
fn what_cannot_be_read_in_parts_is_refused() {
    let plant = plant();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("day.csv");
    let write = |header: &str, moving: &dyn Fn(usize) -> bool| {
        let row = |k: usize| {
            let q = if moving(k) {
                (0.01 * k as f64).sin()
            } else {
                0.5
            };
            format!("{:?},{q:?},{q:?},{:?},{q:?}\n", 0.005 * k as f64, 2.0 * q)
        };
        let rows: String = (0..900).map(row).collect();
        std::fs::write(&path, format!("{header}\n{rows}")).unwrap();
    };
    let read = |rows: usize| {
        let mut count = 0;
        let done = Record::read_parts(&path, &plant, Purpose::Fit, None, rows, &mut |_| {
            count += 1;
            Ok(())
        });
        done.map(|()| count).map_err(|e| e.to_string())
    };
    let ours = "t,q1,q2,tau1,tau2";
    write(ours, &|k| !(300..600).contains(&k));
    assert_eq!(read(300), Ok(2));
    assert!(read(10).unwrap_err().contains("64 or more"));
    write(ours, &|_| false);
    assert!(read(300).unwrap_err().contains("nothing moves"));
    write("time,p1,p2,f1,f2", &|_| true);
    assert!(read(300).unwrap_err().contains("day.csv"));
}

/// Breakaway friction is asked for, and no factor can hold it: it is said, and `merge` says it again.
#[test]
fn breakaway_friction_is_not_condensed_in_silence() {
    let plain = plant();
    // one record is enough: the friction is searched for in all that there are
    let records = &records(&plain)[..1];
    let mut robot = plain.robot().clone();
    robot.joints[0].stribeck.fit = true;
    let factor = of(&Plant::from(&robot), records);
    let said = |all: &[excite::Warning]| all.iter().any(|w| w.subject == "breakaway friction");
    assert!(said(&factor.header.warnings));
    assert!(!said(&of(&plain, records).header.warnings));
    let found = merged(&plain, &[&factor], &settings(Method::Wls));
    assert!(said(&found.warnings));
}

/// A real arm whose wrist is coupled: what goes with another joint is fitted aside.
#[test]
fn a_real_experiment_as_a_whole() {
    let Some(file) = shared("data/tx40/experiment.toml") else {
        return;
    };
    let e = Experiment::read(file).unwrap();
    let settings = settings(Method::Wls);
    let whole = identify(&e.plant, &e.records, &settings).unwrap();
    let factor = condense(&e.plant, &e.spec, None, &e.records, &settings).unwrap();
    let m = merged(&e.plant, &[&factor], &settings);
    // six joints, fit and holdout
    let size = factor.to_bytes().unwrap().len();
    assert!(size < 160_000, "{size} bytes");
    println!("base parameters off by {:.1e}", off(&m.pi, &whole.pi));
    assert!(off(&m.pi, &whole.pi) < 1e-10);
    let kinds = m.warnings.iter().map(|w| w.kind);
    assert!(
        kinds
            .clone()
            .any(|k| k == excite::WarningKind::JointsCoupled)
    );
    let [holdout, theirs] =
        [&m.errors[1][1], &whole.validation.holdout].map(|e| e.as_ref().unwrap().relative_error);
    assert!(
        (holdout - theirs).abs() < 0.01 * theirs,
        "{holdout} {theirs}"
    );
}

#[test]
fn what_does_not_add_or_is_damaged_is_refused() {
    let plant = plant();
    let records = records(&plant);
    let a = of(&plant, &records[..1]);
    let mut other = settings(Method::Wls);
    other.signals.cutoff = Some(20.0);
    let b = condense(&plant, "planar2", None, &records[1..2], &other).unwrap();
    let error = a.clone().with(b).unwrap_err().to_string();
    assert!(error.contains("--cutoff"), "{error}");
    let scara = Plant::load("scara").unwrap();
    let error = merge(&scara, vec![a.clone()], &other)
        .unwrap_err()
        .to_string();
    assert!(error.contains("another robot"), "{error}");
    let error = merge(&plant, vec![a.clone()], &settings(Method::Robust)).unwrap_err();
    assert!(error.to_string().contains("ols and wls"));
    assert!(merge(&plant, Vec::new(), &other).is_err());
    let bytes = a.to_bytes().unwrap();
    let file = Path::new("x");
    for cut in [0, 5, 40, bytes.len() / 2, bytes.len() - 1] {
        assert!(Factor::from_bytes(&bytes[..cut], file).is_err());
    }
    let read = |bytes: &[u8]| Factor::from_bytes(bytes, file).unwrap_err().to_string();
    let error = read(b"excite factor 1\n{}\n");
    assert!(error.contains("another version"), "{error}");
    assert!(error.contains("excite condense"), "{error}");
    assert!(read(b"t,q1,tau1\n").contains("no factor"));
    // the numbers have a checksum
    let last = bytes.len() - 30;
    let mut wrong = bytes.clone();
    wrong[last] ^= 4;
    assert!(read(&wrong).contains("damaged"));
    // whatever stands in the header, nothing panics
    for k in (16..bytes.len().min(1500)).step_by(5) {
        let mut wrong = bytes.clone();
        wrong[k] ^= 1 << (k % 7);
        if let Ok(f) = Factor::from_bytes(&wrong, file) {
            let _ = merge(&plant, vec![f], &settings(Method::Wls));
        }
    }
}
