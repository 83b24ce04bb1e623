//! Time per sample.
#[path = "../tests/common/mod.rs"]
mod common;
use excite::dynamics::*;
use std::time::Instant;
fn main() {
    let mut robot = common::robot(3, 7, false);
    for (i, b) in robot.bodies.iter_mut().enumerate() {
        b.parent = i.checked_sub(1);
        b.motion = excite::robot::Motion::Revolute;
        b.axis = nalgebra::Vector3::z();
    }
    let tree = Tree::new(&robot);
    let count = 256;
    let m = common::samples(1, 7, count);
    let rows = 7 * count;
    let mut w = vec![0.0; rows * 70];
    let mut tau = vec![0.0; rows];
    let phi = robot.parameters();
    let phis: Vec<f64> = (0..10).flat_map(|_| phi.clone()).collect();
    let rates = vec![0.5; 10 * rows];
    let mut out = Derivatives::default();
    for isa in Isa::available() {
        let ws = &mut Workspace::with_isa(isa);
        let mut best = [f64::MAX; 3];
        for _ in 0..300 {
            let t = Instant::now();
            tree.regressor(ws, &m, &mut w, rows);
            best[0] = best[0].min(t.elapsed().as_secs_f64());
            let t = Instant::now();
            tree.inverse_dynamics(ws, &phi, &m, &mut tau);
            best[1] = best[1].min(t.elapsed().as_secs_f64());
            let t = Instant::now();
            tree.gradients(ws, &phis, &m, &rates, &mut out);
            best[2] = best[2].min(t.elapsed().as_secs_f64());
        }
        println!("{isa:?}: regressor {:.3} rnea {:.3} gradient (each of 10) {:.3} us/sample", best[0] / count as f64 * 1e6, best[1] / count as f64 * 1e6, best[2] / count as f64 * 1e5);
    }
}
