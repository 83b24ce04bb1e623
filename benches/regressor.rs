//! Time per sample of the regressor, the inverse dynamics and the adjoint gradients.
//!
//! ```text
//! cargo bench --bench regressor            # 200 repeats
//! cargo bench --bench regressor -- 5000    # more, where other programs run at the same time
//! ```
//!
//! One thread and 128 samples a call, for each instruction set of this machine (the matrix stays in
//! the cache, as that of a program that evaluates one sample at a time does); then the stacked
//! regressor of 10 000 samples on all threads, memory included. Microseconds per sample, smallest
//! and median over the repeats.

use excite::Robot;
use excite::dynamics::parts::Derivatives;
use excite::dynamics::parts::Workspace;
use excite::dynamics::{Isa, Samples, Tree};
use excite::regressor::Regressor;
use rand::{Rng, SeedableRng};
use std::hint::black_box;
use std::time::Instant;

/// Positions, velocities and accelerations drawn from ±2.
fn motion(dof: usize, count: usize) -> Samples {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let mut s = Samples::zeros(dof, count);
    for x in s.q.iter_mut().chain(&mut s.qd).chain(&mut s.qdd) {
        *x = rng.random_range(-2.0..2.0);
    }
    s
}

/// Runs `f` and prints the smallest and the median time, in µs per sample.
fn time(label: &str, samples: usize, repeats: usize, mut f: impl FnMut()) {
    let mut times: Vec<f64> = (0..repeats)
        .map(|_| {
            let start = Instant::now();
            f();
            start.elapsed().as_secs_f64() * 1e6 / samples as f64
        })
        .collect();
    times.sort_by(f64::total_cmp);
    println!("{label:34} {:8.3} {:8.3}", times[0], times[repeats / 2]);
}

fn main() -> excite::Result<()> {
    // `cargo bench` hands over `--bench`; without it (`cargo test --benches`) one pass will do
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let repeats = match arguments.iter().find_map(|a| a.parse().ok()) {
        Some(repeats) => std::cmp::max(repeats, 1),
        None if arguments.iter().any(|a| a == "--bench") => 200,
        None => 1,
    };
    println!("{:34} {:>8} {:>8}   us per sample", "", "min", "median");
    for name in ["panda", "ur10"] {
        let robot = Robot::load(name)?;
        let (tree, phi) = (Tree::new(&robot), robot.parameters());
        let m = motion(robot.dof(), 128);
        let rows = robot.dof() * m.count;
        let mut w = vec![0.0; rows * 10 * tree.bodies()];
        let mut tau = vec![0.0; rows];
        let mut out = Derivatives::default();
        for isa in Isa::available() {
            let ws = &mut Workspace::with_isa(isa);
            time(
                &format!("{name} regressor {isa:?}"),
                m.count,
                repeats,
                || {
                    tree.regressor(ws, &m, black_box(&mut w), rows);
                },
            );
            let label = format!("{name} inverse dynamics {isa:?}");
            time(&label, m.count, repeats, || {
                tree.inverse_dynamics(ws, &phi, &m, black_box(&mut tau));
            });
            time(
                &format!("{name} gradients {isa:?}"),
                m.count,
                repeats,
                || {
                    tree.gradients(ws, &phi, &m, &tau, black_box(&mut out));
                },
            );
        }
        let m = motion(robot.dof(), 10_000);
        let label = format!("{name} stacked, all threads");
        time(&label, m.count, repeats.div_ceil(10), || {
            black_box(Regressor::with_tree(&robot, &tree, &m));
        });
    }
    Ok(())
}
