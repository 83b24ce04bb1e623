//! `excite diagnose CALIBRATION`.

use super::Args;
use crate::cli::{Folder, pretty, print, warn};
use excite::calibrate::gap::{Ask, diagnose, json, page};
use excite::calibrate::read;
use excite::report::format::{percent, significant};
use excite::{Error, Result};
use std::fmt::Write as _;
use std::time::Instant;

/// Which kinematic effect is missing.
pub fn run(args: Args) -> Result<()> {
    let begin = Instant::now();
    let only = [
        ("also", !args.also.is_empty()),
        ("into", args.into.is_some()),
        ("next-tries", args.next_tries.is_some()),
        ("samples", args.samples.is_some()),
        ("atmosphere", args.atmosphere.is_some()),
    ];
    if let Some((name, _)) = only.iter().find(|o| o.1) {
        return Err(Error::Argument(format!(
            "--{name} is for an experiment.toml; {} is a calibration",
            args.experiment.display()
        )));
    }
    let (input, opened) = read(&args.experiment)?;
    let names = ["diagnosis.json", "report.html", "next.csv"];
    let folder = Folder::new(&args.output, &names, args.force)?;
    let ask = Ask {
        next: !args.no_next,
        seed: args.seed,
    };
    let d = diagnose(&input, &opened, ask)?;
    warn(&d.warnings);
    let value = json::json(&d, begin.elapsed().as_secs_f64());
    folder.write(names[0], &pretty(&value))?;
    let report = folder.write(names[1], &page::html(&d))?;
    match &d.next {
        Some(n) => {
            folder.write(names[2], &n.csv())?;
        }
        None => folder.remove(names[2])?,
    }
    if args.json {
        return print(&pretty(&value));
    }
    let mut out = format!("{}\n", page::sentence(&d).1);
    for f in &d.found.findings {
        let _ = writeln!(
            out,
            "\n{} ({}): confidence {}, explains {}, {}",
            f.effect,
            f.places.join(" or "),
            percent(f.confidence),
            page::share(f.explains),
            match f.holdout {
                Some(h) => format!("{} on rows held out", page::share(h)),
                None => "not judged by rows held out".into(),
            }
        );
        for v in &f.values {
            let _ = writeln!(
                out,
                "  {:<20} {} ± {} {}",
                v.name,
                significant(v.value, 4),
                significant(1.96 * v.std, 2),
                v.unit
            );
        }
        if !f.rivals.is_empty() {
            let all: Vec<String> = f.rivals.iter().map(|(e, p)| format!("{e} ({p})")).collect();
            let _ = writeln!(out, "  not told from {}", all.join(", "));
        }
    }
    if let Some(n) = &d.next {
        let _ = writeln!(
            out,
            "\nnext: {} separates {} (overlap {} now, {} predicted)",
            folder.path("next.csv").display(),
            n.separates.join(" from "),
            percent(n.overlap[0]),
            percent(n.overlap[1])
        );
    }
    let _ = writeln!(
        out,
        "\n{} in {:.1} s",
        report.display(),
        begin.elapsed().as_secs_f64()
    );
    print(&out)
}
