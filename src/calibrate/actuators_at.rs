//! Residuals of a parallel robot at a measured pose, with the noise of the pose and of the readings carried through.

use super::frame::{Frame, right_jacobian};
use super::model::{Algorithm, Block, Model};
use super::parallel::Parallel;
use nalgebra::{DMatrix, DVector, Matrix6, Vector3};

/// Standard deviation of the reading of an actuator, rad or m.
const ENCODER: f64 = 1e-5;

impl Model<'_> {
    /// Whitened residuals of the actuators (and of the orientation) of a parallel robot at a measured pose.
    pub(super) fn actuator_block(
        &self,
        p: &Parallel,
        row: usize,
        x: &[f64],
        measured: &Frame,
    ) -> Option<Block> {
        let data = &self.input.rows[row];
        let m = data.measurement;
        let n = self.of_robot;
        let (camera, target) = (self.camera(m, x), self.target(m, x));
        let seen = match self.consistent {
            true => camera.then(&self.posed(row, x).ok()?.frame).then(&target),
            false => *measured,
        };
        let at_target = camera.inverse().then(&seen);
        let base = at_target.then(&target.inverse());
        let implicit = self.settings.algorithm == Algorithm::Implicit;
        let readings = p.readings(&data.q, &x[..n], &self.features, &self.rates[row]);
        let a = p.actuators_at(&base, &readings, &x[..n], implicit);
        let held = match self.settings.orientation {
            true => p.held().len(),
            false => 0,
        };
        let actuators = a.value.len();
        let lines = actuators + held;
        let mut r = DVector::zeros(lines);
        let mut by_pose = DMatrix::zeros(lines, 6);
        let c = self.layout.camera[m].unwrap_or(0);
        let t = self.layout.target[m].unwrap_or(0);
        let columns: Vec<usize> = (0..n).chain(c..c + 6).chain(t..t + 6).collect();
        let mut j = DMatrix::zeros(lines, columns.len());
        r.rows_mut(0, actuators).copy_from(&a.value);
        by_pose.rows_mut(0, actuators).copy_from(&a.by_pose);
        let errors = p.errors();
        j.view_mut((0, 0), (actuators, errors))
            .copy_from(&a.by_errors);
        for (k, f) in self.features.iter().enumerate() {
            j[(f.joint, errors + k)] = a.by_reading[f.joint] * self.rates[row][k].turn;
        }
        if held > 0 {
            let (value, by) = p.orientation(&base.r);
            r.rows_mut(actuators, held).copy_from(&value);
            by_pose.view_mut((actuators, 3), (held, 3)).copy_from(&by);
        }
        // how the pose in the base follows camera and target, and the noise of what is seen
        let mut moves = DMatrix::zeros(6, 12);
        let mut noise = Matrix6::zeros();
        let put = |m: &mut DMatrix<f64>, col: usize, shift: Vector3<f64>, turn: Vector3<f64>| {
            for k in 0..3 {
                m[(k, col)] = shift[k];
                m[(3 + k, col)] = turn[k];
            }
        };
        let cw = Vector3::new(x[c + 3], x[c + 4], x[c + 5]);
        let tw = Vector3::new(x[t + 3], x[t + 4], x[t + 5]);
        let (camera_turns, target_turns) = (right_jacobian(&cw), at_target.r * right_jacobian(&tw));
        let camera_shifts = camera.r.transpose() * self.start.camera[m].r;
        let target_shifts = base.r * self.start.target[m].r;
        let arm = base.p - at_target.p;
        for k in 0..3 {
            let w = -camera_turns.column(k).into_owned();
            put(
                &mut moves,
                k,
                -camera_shifts.column(k).into_owned(),
                Vector3::zeros(),
            );
            put(&mut moves, 3 + k, w.cross(&base.p), w);
            let w = -target_turns.column(k).into_owned();
            put(
                &mut moves,
                6 + k,
                -target_shifts.column(k).into_owned(),
                Vector3::zeros(),
            );
            put(&mut moves, 9 + k, w.cross(&arm), w);
            let back = camera.r.transpose();
            let (shift, turn) = (back.column(k).into_owned(), back.column(k).into_owned());
            let swing = turn.cross(&arm);
            for i in 0..3 {
                noise[(i, k)] = shift[i];
                noise[(i, 3 + k)] = swing[i];
                noise[(3 + i, 3 + k)] = turn[i];
            }
        }
        j.view_mut((0, n), (lines, 12))
            .copy_from(&(&by_pose * &moves));
        let spread = match self.spread(data) {
            Some(c) => c,
            None => {
                let [s, a] = self.input.measurements[m].std;
                Matrix6::from_diagonal(&[s * s, s * s, s * s, a * a, a * a, a * a].into())
            }
        };
        let carried = &by_pose * noise;
        let mut covariance = &carried * spread * carried.transpose() * (self.noise * self.noise);
        for i in 0..actuators {
            covariance[(i, i)] += (a.by_reading[i] * ENCODER).powi(2);
        }
        if r.iter().chain(j.iter()).any(|v| !v.is_finite()) {
            return None;
        }
        let l = covariance.cholesky()?.l();
        Some(Block {
            r: l.solve_lower_triangular(&r)?,
            columns,
            j: l.solve_lower_triangular(&j)?,
        })
    }
}
