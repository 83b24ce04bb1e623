//! Long logs, and a diagnosis of five: time, and the most memory that was held (Linux).
//!
//! ```sh
//! cargo bench --bench long -- log 10        # millions of rows of seven joints: read, and identified in parts
//! cargo bench --bench long -- digits 10     # the same with all digits of the numbers, in place of six decimals
//! cargo bench --bench long -- exponents 10  # as `numpy.savetxt` writes them, `-1.234567890123456789e-01`
//! cargo bench --bench long -- diagnose 5    # records of 20 s at 1 kHz of a clean Panda
//! ```
//!
//! Each in a process of its own, because the memory is the most of the process.

use excite::diagnose::{Settings as Diagnosis, diagnose};
use excite::identify::{Settings, condense_parts, identify_parts};
use excite::log::parts::Purpose;
use excite::log::{Experiment, Outline, Record, Table};
use excite::robot::parts::JointTerm;
use excite::simulate::parts::Sensors;
use excite::simulate::{Settings as Simulation, measure, simulate, to_record};
use excite::trajectory::Fourier;
use excite::trajectory::parts::Series;
use excite::{Plant, Result, survey};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::time::Instant;

/// Rows of a part.
const PART: usize = 240_000;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // as the program does
    excite::heap::share();
    let words: Vec<String> = std::env::args().skip(1).collect();
    // `cargo bench` hands over `--bench`; without it (`cargo test --benches`) little will do
    let whole = words.iter().any(|a| a == "--bench");
    let number = words.iter().find_map(|a| a.parse::<usize>().ok());
    match words.iter().any(|a| a == "diagnose") {
        true => diagnosis(number.unwrap_or(5), whole),
        false => {
            let rows = number.unwrap_or(1) * if whole { 1_000_000 } else { 4000 };
            let asked = |form: &&Form| words.iter().any(|a| a == form.0);
            log(rows, FORMS.iter().find(asked).unwrap_or(&FORMS[0]))
        }
    }
}

/// A way to write a number, and its name.
struct Form(&'static str, fn(f64) -> String);

const FORMS: [Form; 3] = [
    Form("decimals", |x| format!("{x:.6}")),
    Form("digits", |x| format!("{x}")),
    Form("exponents", |x| {
        let text = format!("{x:.18e}");
        // two digits and a sign, as C writes an exponent
        let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        format!("{digits}e{:+03}", exponent.parse::<i32>().unwrap_or(0))
    }),
];

/// A motion of the Panda that visits a good part of its joints' ranges.
fn motion() -> Fourier {
    let middle = [0.0, -0.3, 0.0, -2.0, 0.0, 1.8, 0.4];
    let joint = |j: usize| Series {
        constant: middle[j],
        sin: (1..=4)
            .map(|k| 0.4 * ((j + 2 * k) as f64).sin() / k as f64)
            .collect(),
        cos: (1..=4)
            .map(|k| 0.3 * ((3 * j + k) as f64).cos() / k as f64)
            .collect(),
    };
    Fourier {
        period: 10.0,
        harmonics: vec![1, 2, 3, 4],
        joints: (0..7).map(joint).collect(),
    }
}

fn run(plant: &Plant, periods: u32, seed: u64, purpose: Purpose) -> Result<Record> {
    let (motion, settings) = (motion(), Simulation::default());
    let run = simulate(plant, &motion, periods, &settings, &|_| {})?;
    let measured = measure(&run, &Sensors::new(plant, 1.0).0, &settings.effects, seed);
    Ok(to_record(&run, &measured, purpose, motion.period))
}

/// Most memory held so far, MB.
fn peak() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    line.split_whitespace()
        .nth(1)?
        .parse()
        .ok()
        .map(|kb: f64| 1e-3 * kb)
}

fn said(what: &str, since: Instant, megabytes: f64) {
    let seconds = since.elapsed().as_secs_f64();
    let rate = match megabytes > 0.0 {
        true => format!(", {:.0} MB/s", megabytes / seconds),
        false => String::new(),
    };
    let most = peak().map_or(String::new(), |p| {
        format!(", at most {p:.0} MB held so far")
    });
    println!("{what}: {seconds:.1} s{rate}{most}");
}

fn log(rows: usize, form: &Form) -> Result<(), Box<dyn std::error::Error>> {
    let terms = [JointTerm::Viscous, JointTerm::Coulomb, JointTerm::Offset];
    let plant = Plant::load("panda")?.with_terms(&terms);
    let path = std::env::temp_dir().join(format!("excite_long_{}.csv", std::process::id()));
    let done = generate(&plant, &path, rows, form).and_then(|()| long(&plant, &path, rows));
    std::fs::remove_file(&path)?;
    done
}

/// Ten periods, again and again.
fn generate(
    plant: &Plant,
    path: &Path,
    rows: usize,
    form: &Form,
) -> Result<(), Box<dyn std::error::Error>> {
    let record = run(plant, if rows > 50_000 { 10 } else { 1 }, 1, Purpose::Fit)?;
    let lines: Vec<String> = (0..record.len())
        .map(|i| {
            let mut line = String::new();
            for column in record.q.iter().chain(&record.tau) {
                let _ = write!(line, ",{}", form.1(column[i]));
            }
            line
        })
        .collect();
    let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let names = ["q", "tau"].map(|g| (1..=7).map(|j| format!("{g}{j}")).collect::<Vec<_>>());
    writeln!(file, "t,{}", names.concat().join(","))?;
    for i in 0..rows {
        writeln!(file, "{:.3}{}", 1e-3 * i as f64, lines[i % lines.len()])?;
    }
    file.flush()?;
    Ok(())
}

fn long(plant: &Plant, path: &Path, rows: usize) -> Result<(), Box<dyn std::error::Error>> {
    let size = 1e-6 * std::fs::metadata(path)?.len() as f64;
    println!("{rows} rows of 15 columns, {size:.0} MB");
    let each = PART.min(rows / 2);
    let start = Instant::now();
    let mut count = 0;
    Record::read_parts(path, plant, Purpose::Fit, None, each, &mut |part| {
        count += part.len();
        Ok(())
    })?;
    assert_eq!(count, rows);
    said("read and checked in parts", start, size);

    let start = Instant::now();
    let outline = Outline::of_log(path, "panda", None)?;
    let check = |part: &Record| survey::check(plant, std::slice::from_ref(part));
    let settings = Settings::default();
    let condensed = condense_parts(&outline, plant, None, each, &settings, &check)?;
    said("read, checked and condensed in parts", start, size);
    let model = identify_parts(plant, condensed)?;
    said("the same with the model", start, size);
    println!(
        "{} base parameters, condition {:.0}",
        model.pi.len(),
        model.condition
    );

    let start = Instant::now();
    let found = survey::survey(&[path.to_path_buf()], Some(plant))?;
    assert_eq!(found.frames[0].rows, rows);
    said("its columns told, as `excite log` does", start, size);

    // columns as they stand, and all of them: last, because it holds what the others need not
    let start = Instant::now();
    let table = Table::read(path, &|_| true)?;
    assert_eq!(table.rows(), rows);
    said("columns read at once", start, size);
    Ok(())
}

fn diagnosis(count: usize, whole: bool) -> Result<(), Box<dyn std::error::Error>> {
    let plant = Plant::load("panda")?;
    let periods = if whole { 2 } else { 1 };
    let records = (0..count.max(2))
        .map(|k| {
            let last = k + 1 == count.max(2);
            let purpose = if last { Purpose::Holdout } else { Purpose::Fit };
            run(&plant, periods, k as u64, purpose)
        })
        .collect::<Result<Vec<_>>>()?;
    let experiment = Experiment {
        path: "bench".into(),
        spec: "panda".into(),
        plant,
        records,
    };
    let start = Instant::now();
    let mut settings = Diagnosis::default();
    settings.next = whole;
    let found = diagnose(&experiment, &settings, &|_| {})?;
    said(&format!("diagnosis of {count} records"), start, 0.0);
    println!("{:?}, {} findings", found.verdict, found.findings.len());
    Ok(())
}
