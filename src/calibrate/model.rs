//! Residuals of a calibration, whitened, and their exact Jacobians.
//!
//! With the pose `T_be(q; x)` of the frame in the base, camera `T_cb` and target `T_et`:
//!
//! | kind | residual |
//! |---|---|
//! | pose | `p(T_cb T_be T_et) − p_meas`, `log(R(T_cb T_be T_et) R_measᵀ)`, whitened by the covariance |
//! | position | `p(T_cb T_be T_et) − p_meas` |
//! | point | `p_be − c`, `c` unknown |
//! | plane, gauge | `nᵀ p_be − d − reading`, `n, d` unknown |
//! | loop | `p_b − (p_a + R_a p_z)`, `log(R_a R_z R_bᵀ)` (`closed`) |
//! | distance | `|c_1 − c_2| − value` |

use super::effects;
use super::feature::{Feature, Rate};
use super::file::Calibration;
use super::frame::{Frame, left_jacobian_inverse, log, right_jacobian};
use super::kin::Kin;
use super::kind::Kind;
use super::layout::{Layout, Start};
use super::parallel::Parallel;
use super::row::{Row, Value};
use super::serial::Posed;
use super::unknown::Unknown;
use crate::error::Result;
use nalgebra::{DMatrix, DVector, Matrix6, Vector3};

/// How poses of a parallel robot enter the fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Algorithm {
    /// measured readings against those of the inverse model at the measured pose
    #[default]
    Inverse,
    /// closure of the chains at measured readings and pose
    Implicit,
    /// measured pose against that of the forward model
    Forward,
}

/// What a fit is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Settings {
    /// for parallel robots
    pub algorithm: Algorithm,
    /// whether the measured orientation of a parallel robot must be one that it can take
    pub orientation: bool,
}

crate::settings::changeable!(Settings);

impl Default for Settings {
    fn default() -> Self {
        Settings {
            algorithm: Algorithm::Inverse,
            orientation: true,
        }
    }
}

/// Residuals with the columns they depend on.
#[derive(Debug, Clone)]
pub struct Block {
    /// whitened
    pub r: DVector<f64>,
    /// indices of the columns of `j`
    pub columns: Vec<usize>,
    /// whitened
    pub j: DMatrix<f64>,
}

/// A robot, its measurements and all unknowns.
#[derive(Debug, Clone)]
pub struct Model<'a> {
    /// what was measured
    pub input: &'a Calibration,
    /// the robot
    pub kin: &'a Kin,
    /// what joints do beside turning
    pub features: Vec<Feature>,
    /// value of each feature, by row
    pub rates: Vec<Vec<Rate>>,
    /// all unknowns: of the robot first
    pub unknowns: Vec<Unknown>,
    /// number of unknowns of the robot
    pub of_robot: usize,
    /// where the others begin
    pub layout: Layout,
    /// where they start
    pub start: Start,
    /// factor on the stated noise
    pub noise: f64,
    /// poses with nominal geometry, by row
    pub nominal: &'a [Option<Frame>],
    /// how poses enter
    pub settings: Settings,
    /// whether poses are taken to be measured where the unknowns put them: what can be told does not hang on noise
    pub consistent: bool,
    /// whether a row's own covariance counts by its size alone, the same in all directions
    pub even: bool,
}

impl<'a> Model<'a> {
    /// Puts the unknowns together.
    pub fn new(
        input: &'a Calibration,
        kin: &'a Kin,
        features: Vec<Feature>,
        torques: Option<&[Vec<f64>]>,
        start: Start,
        nominal: &'a [Option<Frame>],
        settings: Settings,
    ) -> Self {
        let mut unknowns = kin.unknowns([input.prior.length, input.prior.angle]);
        unknowns.extend(features.iter().map(|f| f.unknown.clone()));
        let of_robot = unknowns.len();
        let layout = Layout::new(input, &mut unknowns);
        let row = |(i, r): (usize, &Row)| {
            effects::rates(&features, &r.q, torques.map(|t| t[i].as_slice()))
        };
        let rates = input.rows.iter().enumerate().map(row).collect();
        Model {
            input,
            kin,
            features,
            rates,
            unknowns,
            of_robot,
            layout,
            start,
            noise: 1.0,
            nominal,
            settings,
            consistent: false,
            even: false,
        }
    }

    /// The model that tells what can be identified at all: that hangs on geometry and postures, not on noise, and the
    /// algorithms of the paper see no orientation.
    pub fn exact(&self) -> Self {
        let mut exact = self.clone();
        exact.consistent = true;
        exact.settings.orientation = false;
        exact
    }

    /// The parallel robot, where its poses enter by its actuators.
    fn by_actuators(&self) -> Option<&Parallel> {
        match self.kin {
            Kin::Parallel(p) if self.settings.algorithm != Algorithm::Forward => Some(p),
            _ => None,
        }
    }

    /// Number of unknowns.
    pub fn count(&self) -> usize {
        self.unknowns.len()
    }

    /// Number of residuals of a row.
    pub fn residuals(&self, row: usize) -> usize {
        match self.input.measurements[self.input.rows[row].measurement].kind {
            Kind::Pose => match self.by_actuators() {
                Some(p) if self.settings.orientation => p.actuators() + p.held().len(),
                Some(p) => p.actuators(),
                None => 6,
            },
            Kind::Loop => 6,
            Kind::Position | Kind::Point | Kind::Ball => 3,
            Kind::Plane | Kind::Gauge => 1,
        }
    }

    /// Pose of the frame in the base, by the unknowns of the robot.
    ///
    /// # Errors
    /// As [`Kin::pose`].
    pub fn posed(&self, row: usize, x: &[f64]) -> Result<Posed> {
        let r = &self.input.rows[row];
        let near = self.nominal[row].as_ref();
        self.kin.pose(
            &r.q,
            &x[..self.of_robot],
            &self.features,
            &self.rates[row],
            near,
        )
    }

    /// Camera (base in the camera's frame) of a measurement.
    pub fn camera(&self, m: usize, x: &[f64]) -> Frame {
        match self.layout.camera[m] {
            Some(c) => self.start.camera[m].then(&Frame::small(&x[c..c + 6])),
            None => Frame::identity(),
        }
    }

    /// Target on the frame of a measurement.
    pub fn target(&self, m: usize, x: &[f64]) -> Frame {
        let Some(t) = self.layout.target[m] else {
            return Frame::identity();
        };
        let small = match self.input.measurements[m].kind {
            Kind::Pose => Frame::small(&x[t..t + 6]),
            _ => Frame {
                p: Vector3::new(x[t], x[t + 1], x[t + 2]),
                ..Frame::identity()
            },
        };
        self.start.target[m].then(&small)
    }

    /// Fixed point of a measurement, base axes.
    pub fn socket(&self, m: usize, x: &[f64]) -> Vector3<f64> {
        let shift = match self.layout.contact[m] {
            Some(c) => Vector3::new(x[c], x[c + 1], x[c + 2]),
            None => Vector3::zeros(),
        };
        self.start.socket[m] + shift
    }

    /// The target in the instrument's frame, and its derivatives: position and rotation in the instrument's axes.
    fn seen(&self, m: usize, posed: &Posed, x: &[f64]) -> (Frame, Vec<usize>, DMatrix<f64>) {
        let n = self.of_robot;
        let (camera, target) = (self.camera(m, x), self.target(m, x));
        let tool = camera.then(&posed.frame);
        let seen = tool.then(&target);
        let c = self.layout.camera[m].unwrap_or(0);
        let t = self.layout.target[m].unwrap_or(0);
        let own = if self.input.measurements[m].kind == Kind::Pose {
            6
        } else {
            3
        };
        let columns: Vec<usize> = (0..n).chain(c..c + 6).chain(t..t + own).collect();
        let mut j = DMatrix::zeros(6, columns.len());
        let arm = posed.frame.r * target.p;
        for k in 0..n {
            let col = posed.jacobian.column(k);
            let shift = Vector3::new(col[0], col[1], col[2]);
            let turn = Vector3::new(col[3], col[4], col[5]);
            let p = camera.r * (shift + turn.cross(&arm));
            let w = camera.r * turn;
            for i in 0..3 {
                j[(i, k)] = p[i];
                j[(3 + i, k)] = w[i];
            }
        }
        let start = &self.start.camera[m];
        let turns = camera.r * right_jacobian(&Vector3::new(x[c + 3], x[c + 4], x[c + 5]));
        for k in 0..3 {
            let w = turns.column(k).into_owned();
            let p = w.cross(&(seen.p - camera.p));
            for i in 0..3 {
                j[(i, n + k)] = start.r[(i, k)];
                j[(i, n + 3 + k)] = p[i];
                j[(3 + i, n + 3 + k)] = w[i];
            }
        }
        let before = tool.r * self.start.target[m].r;
        for k in 0..3 {
            for i in 0..3 {
                j[(i, n + 6 + k)] = before[(i, k)];
            }
        }
        if own == 6 {
            let turns = seen.r * right_jacobian(&Vector3::new(x[t + 3], x[t + 4], x[t + 5]));
            for k in 0..3 {
                for i in 0..3 {
                    j[(3 + i, n + 9 + k)] = turns[(i, k)];
                }
            }
        }
        (seen, columns, j)
    }

    /// Position of the target as a row sees it, with its columns and Jacobian.
    pub fn seen_at(
        &self,
        row: usize,
        posed: &Posed,
        x: &[f64],
    ) -> (Vector3<f64>, Vec<usize>, DMatrix<f64>) {
        let (seen, columns, j) = self.seen(self.input.rows[row].measurement, posed, x);
        (seen.p, columns, j)
    }

    /// Whitened residuals of a row. `None` where the posture cannot be taken.
    pub fn block(&self, row: usize, x: &[f64]) -> Option<Block> {
        if let (Some(p), Value::Pose(pose)) = (self.by_actuators(), &self.input.rows[row].value) {
            return self.actuator_block(p, row, x, pose);
        }
        if self.input.measurements[self.input.rows[row].measurement]
            .kind
            .is_loop()
        {
            return self.loop_block(row, x);
        }
        let posed = self.posed(row, x).ok()?;
        let data = &self.input.rows[row];
        let m = data.measurement;
        let measured = &self.input.measurements[m];
        let weight = 1.0 / (measured.std[0] * self.noise);
        let n = self.of_robot;
        let plain = |r: Vec<f64>, columns: Vec<usize>, j: DMatrix<f64>| Block {
            r: DVector::from_vec(r) * weight,
            columns,
            j: j * weight,
        };
        match &data.value {
            Value::Pose(pose) => {
                let (seen, columns, mut j) = self.seen(m, &posed, x);
                let e = log(&(seen.r * pose.r.transpose()));
                let d = seen.p - pose.p;
                let back = left_jacobian_inverse(&e) * j.rows(3, 3);
                j.rows_mut(3, 3).copy_from(&back);
                let r = DVector::from_vec(vec![d.x, d.y, d.z, e.x, e.y, e.z]);
                let w = self.whitener(data);
                Some(Block {
                    r: &w * r,
                    columns,
                    j: &w * j,
                })
            }
            Value::Position(at) => {
                let (seen, columns, j) = self.seen(m, &posed, x);
                let d = seen.p - at;
                Some(plain(
                    vec![d.x, d.y, d.z],
                    columns,
                    j.rows(0, 3).into_owned(),
                ))
            }
            Value::Contact | Value::Reading(_) => {
                let c = self.layout.contact[m].unwrap_or(0);
                let columns: Vec<usize> = (0..n).chain(c..c + 3).collect();
                let p = posed.frame.p;
                let shifts = posed.jacobian.rows(0, 3);
                if measured.kind == Kind::Point {
                    let d = p - self.socket(m, x);
                    let mut j = DMatrix::zeros(3, n + 3);
                    j.view_mut((0, 0), (3, n)).copy_from(&shifts);
                    for k in 0..3 {
                        j[(k, n + k)] = -1.0;
                    }
                    return Some(plain(vec![d.x, d.y, d.z], columns, j));
                }
                let (normal, offset) = self.start.plane[m];
                let (u, v) = across(&normal);
                let tilted = normal + u * x[c] + v * x[c + 1];
                let size = tilted.norm();
                let reading = match data.value {
                    Value::Reading(s) => s,
                    _ => 0.0,
                };
                let r = tilted.dot(&p) / size - offset - x[c + 2] - reading;
                let mut j = DMatrix::zeros(1, n + 3);
                j.view_mut((0, 0), (1, n))
                    .copy_from(&((tilted / size).transpose() * shifts));
                for (k, e) in [u, v].iter().enumerate() {
                    j[(0, n + k)] =
                        e.dot(&p) / size - tilted.dot(&p) * tilted.dot(e) / size.powi(3);
                }
                j[(0, n + 2)] = -1.0;
                Some(plain(vec![r], columns, j))
            }
        }
    }

    /// Covariance of a pose where its row states one.
    pub fn spread(&self, row: &Row) -> Option<Matrix6<f64>> {
        let own = row.covariance?;
        if !self.even {
            return Some(own);
        }
        let mean = |from: usize| (from..from + 3).map(|k| own[(k, k)]).sum::<f64>() / 3.0;
        let [p, r] = [mean(0), mean(3)];
        Some(Matrix6::from_diagonal(&[p, p, p, r, r, r].into()))
    }

    /// `W` with `Wᵀ W` the inverse covariance of a pose.
    pub fn whitener(&self, row: &Row) -> DMatrix<f64> {
        let [s, a] = self.input.measurements[row.measurement].std;
        let plain = || {
            let d = [s, s, s, a, a, a].map(|v| 1.0 / v);
            Matrix6::from_diagonal(&d.into())
        };
        let w = match self.spread(row) {
            Some(c) => match c.cholesky().and_then(|l| l.l().try_inverse()) {
                Some(inverse) => inverse,
                None => plain(),
            },
            None => plain(),
        };
        DMatrix::from_fn(6, 6, |i, k| w[(i, k)] / self.noise)
    }

    /// Residuals of the known distances.
    pub fn distances(&self, x: &[f64]) -> Vec<Block> {
        let each = self.input.distances.iter().filter_map(|d| {
            let [a, b] = d.between;
            let (ca, cb) = (self.layout.contact[a]?, self.layout.contact[b]?);
            let apart = self.socket(a, x) - self.socket(b, x);
            let length = apart.norm();
            let u = apart / length.max(1e-12);
            let mut j = DMatrix::zeros(1, 6);
            for k in 0..3 {
                j[(0, k)] = u[k] / d.std;
                j[(0, 3 + k)] = -u[k] / d.std;
            }
            Some(Block {
                r: DVector::from_vec(vec![(length - d.value) / d.std]),
                columns: (ca..ca + 3).chain(cb..cb + 3).collect(),
                j,
            })
        });
        each.collect()
    }
}

/// Two unit vectors at right angles to a unit vector.
pub fn across(n: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let mut e = Vector3::zeros();
    e[n.iamin()] = 1.0;
    let u = n.cross(&e).normalize();
    (u, n.cross(&u))
}
