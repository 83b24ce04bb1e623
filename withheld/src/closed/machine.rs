//! Hexapods as built and as their robot files say.

use super::drives::Drive;
use super::hexapod::{Body, Leg, Rubbing};
use crate::random::Random;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::TAU;

type V = Vector3<f64>;

/// A hexapod as built, and the numbers of its robot file.
#[derive(Clone, Debug)]
pub struct Machine {
    pub legs: [Leg; 6],
    /// Lengths at which the actuators read zero.
    pub zero: [f64; 6],
    pub platform: Body,
    pub drives: [Drive; 6],
    pub rubs: Rubbing,
    pub home: [f64; 6],
    /// Noise of the forces, N: white, slow.
    pub noise: [f64; 2],
    /// Encoder step, m.
    pub step: f64,
    /// Whether the file knows the machine within some tenths of a percent.
    pub identified: bool,
    /// Whether the file has a constant force of every drive.
    pub offsets: bool,
}

/// A body of revolution about its third axis.
fn tube(mass: f64, length: f64, radius: f64, centre: f64) -> Body {
    let side = mass * length * length / 12.0;
    Body {
        mass,
        centre: V::new(0.0, 0.0, centre),
        tensor: Matrix3::from_diagonal(&V::new(side, side, 0.5 * mass * radius * radius)),
    }
}

/// Another machine of the same kind.
pub fn machine(identified: bool, rng: &mut Random) -> Machine {
    let (base, top, height) = (
        rng.range(0.5, 0.75),
        rng.range(0.28, 0.4),
        rng.range(0.75, 0.95),
    );
    let (near, far) = (rng.range(0.15, 0.3), rng.range(0.75, 0.9));
    let shift = |rng: &mut Random| V::new(rng.normal(), rng.normal(), rng.normal()) * 0.004;
    let home = V::new(0.0, 0.0, height);
    let legs: [Leg; 6] = std::array::from_fn(|i| {
        let (at, sign) = (TAU * (i / 2) as f64 / 3.0, 2.0 * (i % 2) as f64 - 1.0);
        let ring = |radius: f64, half: f64| {
            let (s, c) = (at + sign * half).sin_cos();
            V::new(radius * c, radius * s, 0.0)
        };
        let a = ring(base, near) + shift(rng);
        let b = ring(top, far) + shift(rng);
        let z = (home + b - a).normalize();
        let x = V::z().cross(&z).normalize();
        Leg {
            base: a,
            platform: b,
            frame: Matrix3::from_columns(&[x, z.cross(&x), z]),
            cylinder: tube(rng.range(3.5, 7.0), 0.5, 0.035, 0.25),
            rod: tube(rng.range(1.5, 3.0), 0.5, 0.015, -0.24),
        }
    });
    let zero = std::array::from_fn(|i| (home + legs[i].platform - legs[i].base).norm() - 0.2);
    let mass = rng.range(20.0, 35.0);
    let platform = Body {
        mass,
        centre: V::new(
            0.01 * rng.normal(),
            0.01 * rng.normal(),
            rng.range(0.0, 0.04),
        ),
        tensor: Matrix3::from_diagonal(&(V::new(1.0, 1.08, 1.9) * mass * top * top * 0.28)),
    };
    let offsets = rng.chance(0.5);
    let drives = std::array::from_fn(|_| Drive {
        dry: rng.range(12.0, 30.0),
        viscous: rng.range(50.0, 120.0),
        offset: if offsets { 3.0 * rng.normal() } else { 0.0 },
        ..Drive::default()
    });
    Machine {
        legs,
        zero,
        platform,
        drives,
        rubs: Rubbing::default(),
        home: [0.0, 0.0, height, 0.0, 0.0, 0.0],
        noise: [1.0, 2.0],
        step: 5e-6,
        identified,
        offsets,
    }
}
