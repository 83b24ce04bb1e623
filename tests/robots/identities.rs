//! Identities that must hold on any robot: `Y φ = RNEA`, power balance, derivatives, and the same
//! bits from every instruction set.

use crate::common;

use excite::dynamics::parts::Derivatives;
use excite::dynamics::parts::Workspace;
use excite::dynamics::{Isa, Samples, Tree};
use excite::robot::Robot;
use nalgebra::Vector3;
use rand::Rng;

fn torque(tree: &Tree, phi: &[f64], q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<f64> {
    let mut tau = vec![0.0; tree.dof()];
    let motion = Samples::from_rows(tree.dof(), &[q], &[qd], &[qdd]);
    tree.inverse_dynamics(&mut Workspace::default(), phi, &motion, &mut tau);
    tau
}

#[test]
fn regressor_times_parameters_is_inverse_dynamics() {
    for seed in 0..60 {
        let n = 1 + seed as usize % 9;
        let robot = common::robot(seed, n, seed % 3 == 0);
        let (tree, count) = (Tree::new(&robot), 37);
        let motion = common::samples(seed + 1000, robot.dof(), count);
        let (rows, phi) = (robot.dof() * count, robot.parameters());
        let mut w = vec![0.0; rows * 10 * n];
        let mut tau = vec![0.0; rows];
        let ws = &mut Workspace::default();
        tree.regressor(ws, &motion, &mut w, rows);
        tree.inverse_dynamics(ws, &phi, &motion, &mut tau);
        for row in 0..rows {
            let sum: f64 = (0..10 * n).map(|c| w[c * rows + row] * phi[c]).sum();
            let size: f64 = (0..10 * n)
                .map(|c| (w[c * rows + row] * phi[c]).abs())
                .sum();
            assert!(
                (sum - tau[row]).abs() <= 4e-15 * (1.0 + size),
                "seed {seed} row {row}"
            );
        }
        for j in 0..robot.dof() {
            for b in 0..n {
                let block = (0..10).flat_map(|k| {
                    let c = (10 * b + k) * rows + j * count;
                    w[c..c + count].iter()
                });
                let any = block.clone().any(|x| *x != 0.0);
                assert_eq!(
                    any,
                    tree.moves(j, b),
                    "structure of block {j},{b}, seed {seed}"
                );
            }
        }
    }
}

/// Kinetic and potential energy from poses and difference quotients: nothing shared with the
/// kernels.
fn energy(robot: &Robot, q: &[f64], qd: &[f64]) -> f64 {
    let h = 1e-6;
    let at = |s: f64| -> Vec<_> {
        let q: Vec<f64> = q.iter().zip(qd).map(|(q, v)| q + s * v).collect();
        common::poses(robot, &q)
    };
    let (minus, here, plus) = (at(-h), at(0.0), at(h));
    let mut total = 0.0;
    for (i, body) in robot.bodies.iter().enumerate() {
        let (r, p) = here[i];
        let dr = (plus[i].0 - minus[i].0) / (2.0 * h);
        let v = (plus[i].1 - minus[i].1) / (2.0 * h);
        let s = r.transpose() * dr;
        let w = Vector3::new(s.m32, s.m13, s.m21);
        let v = r.transpose() * v;
        let (m, mc, tensor) = (
            body.inertia.mass(),
            body.inertia.first_moment(),
            body.inertia.tensor(),
        );
        total += 0.5 * m * v.norm_squared() + v.dot(&w.cross(&mc)) + 0.5 * w.dot(&(tensor * w));
        total -= robot.gravity.dot(&(p * m + r * mc));
    }
    total
}

#[test]
fn power_balance() {
    for seed in 0..30 {
        let robot = common::robot(seed, 1 + seed as usize % 7, seed % 4 == 1);
        let tree = Tree::new(&robot);
        let m = common::samples(seed + 50, robot.dof(), 1);
        let tau = torque(&tree, &robot.parameters(), &m.q, &m.qd, &m.qdd);
        let power: f64 = tau.iter().zip(&m.qd).map(|(t, v)| t * v).sum();
        let h = 1e-4;
        let e = |s: f64| {
            let at = |x: &[f64], y: &[f64], z: &[f64]| -> Vec<f64> {
                (0..x.len())
                    .map(|j| x[j] + s * y[j] + 0.5 * s * s * z[j])
                    .collect()
            };
            let q = at(&m.q, &m.qd, &m.qdd);
            let qd = at(&m.qd, &m.qdd, &vec![0.0; m.q.len()]);
            energy(&robot, &q, &qd)
        };
        let rate = (e(h) - e(-h)) / (2.0 * h);
        assert!(
            (rate - power).abs() < 1e-4 * (1.0 + power.abs()),
            "{seed}: {rate} {power}"
        );
    }
}

#[test]
fn gradients_match_differences() {
    for seed in 0..30 {
        let robot = common::robot(seed, 1 + seed as usize % 8, seed % 3 == 2);
        let (tree, n, vectors) = (Tree::new(&robot), robot.dof(), 2);
        let m = common::samples(seed + 7, n, 11);
        let mut r = common::rng(seed + 8);
        let parameters: Vec<f64> = (0..vectors * 10 * robot.bodies.len())
            .map(|_| r.random_range(-1.0..1.0))
            .collect();
        let step = n * m.count;
        let rates: Vec<f64> = (0..vectors * step)
            .map(|_| r.random_range(-1.0..1.0))
            .collect();
        let mut out = Derivatives::default();
        tree.gradients(&mut Workspace::default(), &parameters, &m, &rates, &mut out);
        for k in 0..vectors {
            let phi = &parameters[k * 10 * robot.bodies.len()..];
            for i in 0..m.count {
                let column =
                    |x: &[f64]| -> Vec<f64> { (0..n).map(|j| x[j * m.count + i]).collect() };
                let state = [column(&m.q), column(&m.qd), column(&m.qdd)];
                let f = |s: &[Vec<f64>; 3]| -> f64 {
                    let tau = torque(&tree, phi, &s[0], &s[1], &s[2]);
                    (0..n)
                        .map(|j| rates[k * step + j * m.count + i] * tau[j])
                        .sum()
                };
                let scale = 1.0 + f(&state).abs();
                for j in 0..n {
                    for (d, g) in [&out.q, &out.qd, &out.qdd].into_iter().enumerate() {
                        let h = 1e-5;
                        let mut up = state.clone();
                        up[d][j] += h;
                        let mut down = state.clone();
                        down[d][j] -= h;
                        let difference = (f(&up) - f(&down)) / (2.0 * h);
                        let exact = g[k * step + j * m.count + i];
                        assert!(
                            (difference - exact).abs() < 1e-6 * (scale + exact.abs()),
                            "seed {seed} joint {j} order {d}: {difference} {exact}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn every_instruction_set_returns_the_same_bits() {
    for seed in 0..8 {
        let robot = common::robot(seed, 6, seed % 2 == 0);
        let tree = Tree::new(&robot);
        let m = common::samples(seed, robot.dof(), 29);
        let (rows, columns) = (robot.dof() * m.count, 60);
        let results: Vec<_> = Isa::available()
            .into_iter()
            .map(|isa| {
                let ws = &mut Workspace::with_isa(isa);
                let mut w = vec![0.0; rows * columns];
                let mut tau = vec![0.0; rows];
                let mut out = Derivatives::default();
                tree.regressor(ws, &m, &mut w, rows);
                tree.inverse_dynamics(ws, &robot.parameters(), &m, &mut tau);
                tree.gradients(ws, &robot.parameters(), &m, &tau, &mut out);
                (w, tau, out.q, out.qd, out.qdd)
            })
            .collect();
        for other in &results[1..] {
            assert!(*other == results[0], "seed {seed}");
        }
    }
}
