//! Two arms that hold the same thing: the loop that closes through both.
//!
//! With the poses `T_a` and `T_b` of the two frames in the base,
//!
//! ```text
//! rigid   p_b − (p_a + R_a p_z),   log(R_a R_z R_bᵀ)        grip T_z, the second frame in the first, unknown or stated
//! ball    p_b + R_b c − (p_a + R_a p_z)                     place of the ball in either frame, p_z and c, unknown
//! ```
//!
//! in base axes. Nothing tells where the base of both stands, nor, of an unknown grip, how large all lengths are.

use super::file::Calibration;
use super::frame::{Frame, left_jacobian_inverse, log, middle, nearest_rotation, right_jacobian};
use super::kin::Kin;
use super::kind::Kind;
use super::model::{Block, Model};
use super::serial::Posed;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// Rounds of leaving out the closures that fit least.
const ROUNDS: usize = 3;

fn at(j: &DMatrix<f64>, k: usize) -> (Vector3<f64>, Vector3<f64>) {
    let c = j.column(k);
    (
        Vector3::new(c[0], c[1], c[2]),
        Vector3::new(c[3], c[4], c[5]),
    )
}

impl Model<'_> {
    /// Grip of a measurement, and of a ball joint its place in the second frame.
    pub fn grip(&self, m: usize, x: &[f64]) -> (Frame, Vector3<f64>) {
        let (grip, ball) = (self.start.grip[m], self.start.ball[m]);
        let Some(c) = self.layout.contact[m] else {
            return (grip, ball);
        };
        let shift = |k: usize| Vector3::new(x[k], x[k + 1], x[k + 2]);
        match self.input.measurements[m].kind {
            Kind::Loop => (grip.then(&Frame::small(&x[c..c + 6])), ball),
            Kind::Ball => {
                let p = grip.p + shift(c);
                (Frame { p, ..grip }, ball + shift(c + 3))
            }
            _ => (grip, ball),
        }
    }

    /// What is missing between the two arms in a row: of position (m), and of orientation (rad) where they hold it.
    pub fn misclosure(&self, row: usize, x: &[f64]) -> Option<(f64, Option<f64>)> {
        let m = self.input.rows[row].measurement;
        let (a, b) = self.both(row, x)?;
        let (grip, ball) = self.grip(m, x);
        let held = a.frame.then(&grip);
        let gap = b.frame.p + b.frame.r * ball - held.p;
        let turn = log(&(held.r * b.frame.r.transpose())).norm();
        let rigid = self.input.measurements[m].kind == Kind::Loop;
        Some((gap.norm(), rigid.then_some(turn)))
    }

    fn both(&self, row: usize, x: &[f64]) -> Option<(Posed, Posed)> {
        let a = self.posed(row, x).ok()?;
        let q = &self.input.rows[row].q;
        let robot = &x[..self.of_robot];
        let b = (self.kin).other(q, robot, &self.features, &self.rates[row])?;
        Some((a, b))
    }

    /// Whitened residuals of a row.
    pub fn loop_block(&self, row: usize, x: &[f64]) -> Option<Block> {
        let m = self.input.rows[row].measurement;
        let measured = &self.input.measurements[m];
        let (a, b) = self.both(row, x)?;
        let c = self.layout.contact[m]?;
        let n = self.of_robot;
        let (grip, ball) = self.grip(m, x);
        let (ra, rb) = (a.frame.r, b.frame.r);
        let (arm, other) = (ra * grip.p, rb * ball);
        let gap = b.frame.p + other - a.frame.p - arm;
        let held = ra * grip.r;
        let off = held * rb.transpose();
        let e = log(&off);
        let rigid = measured.kind == Kind::Loop;
        let mut j = DMatrix::zeros(if rigid { 6 } else { 3 }, n + 6);
        let back = left_jacobian_inverse(&e);
        let mut put = |column: usize, shift: Vector3<f64>, turn: Vector3<f64>| {
            j.fixed_view_mut::<3, 1>(0, column).copy_from(&shift);
            if rigid {
                j.fixed_view_mut::<3, 1>(3, column)
                    .copy_from(&(back * turn));
            }
        };
        for k in 0..n {
            let ((pa, wa), (pb, wb)) = (at(&a.jacobian, k), at(&b.jacobian, k));
            let shift = pb + wb.cross(&other) - pa - wa.cross(&arm);
            put(k, shift, wa - off * wb);
        }
        let start = ra * self.start.grip[m].r;
        let turns = match rigid {
            true => held * right_jacobian(&Vector3::new(x[c + 3], x[c + 4], x[c + 5])),
            false => Matrix3::zeros(),
        };
        for k in 0..3 {
            put(n + k, -start.column(k).into_owned(), Vector3::zeros());
            match rigid {
                true => put(n + 3 + k, Vector3::zeros(), turns.column(k).into_owned()),
                false => put(n + 3 + k, rb.column(k).into_owned(), Vector3::zeros()),
            }
        }
        let [s, t] = measured.std;
        let weights = [s, s, s, t, t, t].map(|v| 1.0 / (v * self.noise));
        let r = [gap.x, gap.y, gap.z, e.x, e.y, e.z];
        for (mut row, weight) in j.row_iter_mut().zip(weights) {
            row.scale_mut(weight);
        }
        Some(Block {
            r: DVector::from_fn(j.nrows(), |i, _| r[i] * weights[i]),
            columns: (0..n).chain(c..c + 6).collect(),
            j,
        })
    }
}

/// Grip and place of the ball of a measurement, from the nominal robot.
pub fn start(
    input: &Calibration,
    kin: &Kin,
    m: usize,
    poses: &[Option<Frame>],
) -> (Frame, Vector3<f64>) {
    let rows = input.rows.iter().zip(poses);
    let pairs: Vec<(Frame, Frame)> = rows
        .filter(|(r, _)| r.measurement == m)
        .filter_map(|(r, a)| Some(((*a)?, kin.nominal_other(&r.q)?)))
        .collect();
    if input.measurements[m].kind == Kind::Ball {
        return ball(&pairs).unwrap_or((Frame::identity(), Vector3::zeros()));
    }
    if let Some((grip, _)) = input.measurements[m].grip {
        return (grip, Vector3::zeros());
    }
    let relative: Vec<Frame> = pairs.iter().map(|(a, b)| a.inverse().then(b)).collect();
    let shifts: Vec<Vector3<f64>> = relative.iter().map(|f| f.p).collect();
    let centre = middle(&shifts);
    // turns of the half that is nearest to the middle
    let mut near: Vec<&Frame> = relative.iter().collect();
    near.sort_by(|f, g| (f.p - centre).norm().total_cmp(&(g.p - centre).norm()));
    near.truncate(near.len().div_ceil(2));
    let sum: Matrix3<f64> = near.iter().map(|f| f.r).sum();
    let r = nearest_rotation(&sum).map_or(Matrix3::identity(), |r| r.0);
    (Frame { r, p: centre }, Vector3::zeros())
}

/// `p_a + R_a z = p_b + R_b c` by least squares, the worst third left out in turn.
fn ball(pairs: &[(Frame, Frame)]) -> Option<(Frame, Vector3<f64>)> {
    let mut kept: Vec<usize> = (0..pairs.len()).collect();
    let mut found = None;
    for _ in 0..ROUNDS {
        let mut a = DMatrix::zeros(3 * kept.len().max(2), 6);
        let mut d = DVector::zeros(a.nrows());
        for (k, &i) in kept.iter().enumerate() {
            let (one, two) = &pairs[i];
            a.fixed_view_mut::<3, 3>(3 * k, 0).copy_from(&one.r);
            a.fixed_view_mut::<3, 3>(3 * k, 3).copy_from(&(-two.r));
            d.fixed_rows_mut::<3>(3 * k).copy_from(&(two.p - one.p));
        }
        let x = a.svd(true, true).solve(&d, 1e-6).ok()?;
        let (z, c) = (
            Vector3::new(x[0], x[1], x[2]),
            Vector3::new(x[3], x[4], x[5]),
        );
        let gap = |i: &usize| {
            let (one, two) = &pairs[*i];
            (one.p + one.r * z - two.p - two.r * c).norm()
        };
        kept = (0..pairs.len()).collect();
        kept.sort_by(|i, k| gap(i).total_cmp(&gap(k)));
        kept.truncate((2 * pairs.len()).div_ceil(3).max(4).min(pairs.len()));
        let frame = Frame {
            p: z,
            ..Frame::identity()
        };
        found = Some((frame, c));
    }
    found
}
