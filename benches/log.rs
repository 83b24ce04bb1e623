//! Time to read a log of seven joints: `cargo bench --bench log`. Lines per millisecond and megabytes per
//! second, the best of several passes, on one thread and on all; the file is in the cache of the system.

use excite::log::Table;
use std::fmt::Write as _;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // `cargo bench` hands over `--bench`; without it (`cargo test --benches`) a short file will do
    let lines = match std::env::args().any(|a| a == "--bench") {
        true => 300_000,
        false => 1000,
    };
    let names: Vec<String> = ["q", "tau"]
        .iter()
        .flat_map(|g| (1..=7).map(move |j| format!("{g}{j}")))
        .collect();
    let mut text = format!("t,{}\n", names.join(","));
    for i in 0..lines {
        let t = 1e-3 * f64::from(i);
        let _ = write!(text, "{t:.3}");
        for k in 0..names.len() {
            let x = (0.3 * t * (1 + k) as f64).sin() * if k < 7 { 1.5 } else { 30.0 };
            let _ = write!(text, ",{x:.6}");
        }
        text.push('\n');
    }
    let path = std::env::temp_dir().join(format!("excite_bench_{}.csv", std::process::id()));
    std::fs::write(&path, &text)?;
    println!(
        "{lines} lines of {} columns, {:.1} MB",
        1 + names.len(),
        1e-6 * text.len() as f64
    );
    for threads in [1, 0] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()?;
        let mut best = f64::INFINITY;
        for _ in 0..7 {
            let start = Instant::now();
            let table = pool.install(|| Table::read(&path, &|_| true))?;
            best = best.min(start.elapsed().as_secs_f64());
            assert_eq!(table.rows(), lines as usize);
        }
        println!(
            "{} threads: {:.0} lines a ms, {:.0} MB/s",
            pool.current_num_threads(),
            1e-3 * f64::from(lines) / best,
            1e-6 * text.len() as f64 / best
        );
    }
    std::fs::remove_file(&path)?;
    Ok(())
}
