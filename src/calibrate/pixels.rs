//! Pictures: the pose of a target from the points of it that a camera sees.
//!
//! A point `X` of the target is at `P = R X + p` in the camera's frame (z ahead, x right, y down). With `x = P_x/P_z`,
//! `y = P_y/P_z`, `ρ = x² + y²`, the camera sees it at (Brown 1966; the order of the coefficients is that of OpenCV)
//!
//! ```text
//! g = 1 + k_1 ρ + k_2 ρ² + k_3 ρ³
//! u = c_x + f_x (x g + 2 p_1 x y + p_2 (ρ + 2 x²))
//! v = c_y + f_y (y g + p_1 (ρ + 2 y²) + 2 p_2 x y)          pixels
//! ```
//!
//! The pose minimises the squares of the deviations, from 24 orientations, so that the mirror pose of a plane target is
//! found too and refused where it fits as well. With the noise `σ` of a coordinate its covariance is `σ² (JᵀJ)⁻¹`.

use super::cells::{lines, split};
use super::frame::{Frame, exp};
use crate::error::{Error, Result};
use nalgebra::{Matrix2x3, Matrix3, Matrix6, Vector2, Vector3, Vector6};
use serde::Deserialize;
use std::path::Path;

/// A camera's intrinsic parameters, pixels; distortion without unit.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// focal length times pixels a metre, along `u`
    pub fx: f64,
    /// the same along `v`
    pub fy: f64,
    /// principal point
    pub cx: f64,
    /// principal point
    pub cy: f64,
    /// radial distortion, square
    #[serde(default)]
    pub k1: f64,
    /// radial distortion, fourth power
    #[serde(default)]
    pub k2: f64,
    /// tangential distortion
    #[serde(default)]
    pub p1: f64,
    /// tangential distortion
    #[serde(default)]
    pub p2: f64,
    /// radial distortion, sixth power
    #[serde(default)]
    pub k3: f64,
}

/// A camera and the target that it looks at.
#[derive(Debug, Clone)]
pub struct Optics {
    /// intrinsic parameters
    pub camera: Camera,
    /// points of the target in its own frame, m
    pub points: Vec<Vector3<f64>>,
    /// standard deviation of a coordinate in a picture, pixels
    pub std: f64,
}

/// A pose that was solved.
#[derive(Debug, Clone, Copy)]
pub struct Solved {
    /// target in the camera's frame
    pub pose: Frame,
    /// of position (m) and rotation vector (rad) in the camera's axes
    pub covariance: Matrix6<f64>,
    /// root mean square of the deviations of the points that were used, pixels
    pub rms: f64,
    /// points that were seen where the target has none
    pub left_out: usize,
}

/// Steps of one fit.
const STEPS: usize = 40;
/// Least number of points that tell a pose without a second one nearby.
pub const LEAST: usize = 4;
/// Sum of squares, in variances, by which the second best pose must be worse than the best.
const APART: f64 = 16.0;
/// Angle beyond which two poses are two, rad.
const OTHER: f64 = 0.02;
/// Deviation of a point, in standard deviations, beyond which it was not seen but mistaken.
const MISTAKEN: f64 = 5.0;
/// Part of the points that may be mistaken.
const FEW: f64 = 0.3;

/// A point of the target, and where it is seen.
type Pair = (Vector3<f64>, Vector2<f64>);

impl Camera {
    /// Where a point of the camera's frame is seen, and by how much that moves with it. `None` behind the camera.
    pub fn project(&self, p: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        if p.z <= 1e-9 {
            return None;
        }
        let (x, y, w) = (p.x / p.z, p.y / p.z, 1.0 / p.z);
        let rho = x * x + y * y;
        let g = 1.0 + rho * (self.k1 + rho * (self.k2 + rho * self.k3));
        let dg = self.k1 + rho * (2.0 * self.k2 + 3.0 * rho * self.k3);
        let seen = Vector2::new(
            self.cx + self.fx * (x * g + 2.0 * self.p1 * x * y + self.p2 * (rho + 2.0 * x * x)),
            self.cy + self.fy * (y * g + self.p1 * (rho + 2.0 * y * y) + 2.0 * self.p2 * x * y),
        );
        let ux = self.fx * (g + 2.0 * x * x * dg + 2.0 * self.p1 * y + 6.0 * self.p2 * x);
        let uy = self.fx * (2.0 * x * y * dg + 2.0 * self.p1 * x + 2.0 * self.p2 * y);
        let vx = self.fy * (2.0 * x * y * dg + 2.0 * self.p1 * x + 2.0 * self.p2 * y);
        let vy = self.fy * (g + 2.0 * y * y * dg + 6.0 * self.p1 * y + 2.0 * self.p2 * x);
        let by = Matrix2x3::new(
            ux * w,
            uy * w,
            -w * (ux * x + uy * y),
            vx * w,
            vy * w,
            -w * (vx * x + vy * y),
        );
        Some((seen, by))
    }
}

impl Optics {
    /// Reads the points of a target: CSV with the columns `x`, `y` and, for one that is not plane, `z`, in m.
    ///
    /// # Errors
    /// No such file, cells that are no numbers, fewer than [`LEAST`] points, points on a line: with file and line.
    pub fn points(path: &Path) -> Result<Vec<Vector3<f64>>> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
        let mut points = Vec::new();
        for (number, line) in lines(&text) {
            let cells = split(line);
            let numbers: Vec<f64> = cells.iter().filter_map(|c| c.parse().ok()).collect();
            if numbers.is_empty() && points.is_empty() {
                continue; // header
            }
            let finite = numbers.len() == cells.len() && numbers.iter().all(|x| x.is_finite());
            if !finite || !(2..=3).contains(&numbers.len()) {
                return Err(Error::file(
                    path,
                    format!("line {number}"),
                    "a point of the target is x, y or x, y, z in m",
                ));
            }
            points.push(Vector3::new(
                numbers[0],
                numbers[1],
                numbers.get(2).copied().unwrap_or(0.0),
            ));
        }
        let spread = spread(&points);
        if points.len() < LEAST || spread[1] < 1e-3 * spread[0] {
            return Err(Error::file(
                path,
                "",
                format!(
                    "{} points; a pose needs at least {LEAST}, not all on a line",
                    points.len()
                ),
            ));
        }
        if spread[0] > 5.0 {
            return Err(Error::file(
                path,
                "",
                "the target is larger than 5 m: its points are in m; are these millimetres?",
            ));
        }
        Ok(points)
    }

    /// Names of the columns of a picture: `u1, v1, u2, v2 …` in the order of the points.
    pub fn columns(&self) -> Vec<String> {
        (1..=self.points.len())
            .flat_map(|k| [format!("u{k}"), format!("v{k}")])
            .collect()
    }

    /// The pose of the target. `seen` holds `u, v` of each point; NaN where it was not found.
    ///
    /// # Errors
    /// In words: too few points, none that fits, two poses that fit.
    pub fn solve(&self, seen: &[f64]) -> std::result::Result<Solved, String> {
        let mut pairs: Vec<Pair> = self
            .points
            .iter()
            .zip(seen.chunks_exact(2))
            .filter(|(_, s)| s[0].is_finite() && s[1].is_finite())
            .map(|(p, s)| (*p, Vector2::new(s[0], s[1])))
            .collect();
        let points: Vec<Vector3<f64>> = pairs.iter().map(|p| p.0).collect();
        let shape = spread(&points);
        if pairs.len() < LEAST || shape[1] < 1e-3 * shape[0] {
            return Err(format!(
                "{} points of the target are seen; a pose needs at least {LEAST}, not all on a line",
                pairs.len()
            ));
        }
        let all = pairs.len();
        let mut found = self.poses(&pairs);
        while let Some(&(_, pose, _)) = found.first() {
            let off: Vec<f64> = pairs.iter().map(|p| self.deviation(p, &pose)).collect();
            // of a Rayleigh distribution the median is 1.18 standard deviations
            let noise = (crate::median::median(off.iter().copied()) / 1.18).max(self.std);
            let (worst, far) = (off.iter().enumerate())
                .map(|(i, d)| (i, *d))
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap_or((0, 0.0));
            let left_out = all - pairs.len();
            if far < MISTAKEN * noise
                || pairs.len() <= LEAST + 1
                || (left_out + 1) as f64 > FEW * all as f64
            {
                break;
            }
            pairs.remove(worst);
            found = self.poses(&pairs);
        }
        let Some(&(cost, pose, normal)) = found.first() else {
            return Err("no pose of the target in front of the camera has this picture".into());
        };
        let free = (2 * pairs.len()).saturating_sub(6).max(1) as f64;
        // what the pictures are like, if that is worse than stated
        let variance = (self.std * self.std).max(cost / free);
        let other = |f: &Frame| super::frame::log(&(f.r * pose.r.transpose())).norm() > OTHER;
        if let Some((second, ..)) = found.iter().find(|f| other(&f.1))
            && second - cost < APART * variance
        {
            return Err(
                "two poses of the target fit this picture alike: it is seen from too far or too straight ahead".into(),
            );
        }
        let Some(inverse) = normal.try_inverse() else {
            return Err("the points that are seen do not tell the pose".into());
        };
        Ok(Solved {
            pose,
            covariance: inverse * (self.std * self.std),
            rms: (cost / (2 * pairs.len()) as f64).sqrt(),
            left_out: all - pairs.len(),
        })
    }

    /// Poses that the descents end in, best first.
    fn poses(&self, pairs: &[Pair]) -> Vec<(f64, Frame, Matrix6<f64>)> {
        let mut found: Vec<(f64, Frame, Matrix6<f64>)> = orientations()
            .iter()
            .filter_map(|r| self.descend(pairs, self.start(pairs, r)?))
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
    }

    /// How far from where it is seen a point of the target should be, pixels.
    fn deviation(&self, (x, seen): &Pair, at: &Frame) -> f64 {
        let seen_at = self.camera.project(&(at.r * x + at.p));
        seen_at.map_or(f64::INFINITY, |(u, _)| (u - seen).norm())
    }

    /// A start with this orientation: the depth by the size of the picture, the place by its middle.
    fn start(&self, pairs: &[Pair], r: &Matrix3<f64>) -> Option<Frame> {
        let n = pairs.len() as f64;
        let c = &self.camera;
        let plain = |s: &Vector2<f64>| Vector2::new((s.x - c.cx) / c.fx, (s.y - c.cy) / c.fy);
        let middle = pairs.iter().map(|p| plain(&p.1)).sum::<Vector2<f64>>() / n;
        let centre = pairs.iter().map(|p| p.0).sum::<Vector3<f64>>() / n;
        let size =
            |of: &dyn Fn(&Pair) -> f64| -> f64 { (pairs.iter().map(of).sum::<f64>() / n).sqrt() };
        let image = size(&|p| (plain(&p.1) - middle).norm_squared());
        let body = size(&|p| (r * (p.0 - centre)).xy().norm_squared());
        let depth = body / image;
        if !(depth.is_finite() && depth > 0.0) {
            return None;
        }
        let p = Vector3::new(middle.x, middle.y, 1.0) * depth - r * centre;
        Some(Frame { p, r: *r })
    }

    /// Squares, their half gradient and Gauss-Newton matrix for a pose.
    fn squares(&self, pairs: &[Pair], at: &Frame) -> Option<(f64, Vector6<f64>, Matrix6<f64>)> {
        let (mut cost, mut g, mut h) = (0.0, Vector6::zeros(), Matrix6::zeros());
        for (x, seen) in pairs {
            let turned = at.r * x;
            let (u, by) = self.camera.project(&(turned + at.p))?;
            let e = u - seen;
            cost += e.norm_squared();
            // shift, then a turn about the camera's axes
            let turn = by * -super::frame::skew(&turned);
            for row in 0..2 {
                let j = Vector6::new(
                    by[(row, 0)],
                    by[(row, 1)],
                    by[(row, 2)],
                    turn[(row, 0)],
                    turn[(row, 1)],
                    turn[(row, 2)],
                );
                g += j * e[row];
                h += j * j.transpose();
            }
        }
        cost.is_finite().then_some((cost, g, h))
    }

    /// Levenberg-Marquardt from a start; the sum of squares in pixels², the pose, and `JᵀJ`.
    fn descend(&self, pairs: &[Pair], start: Frame) -> Option<(f64, Frame, Matrix6<f64>)> {
        let mut at = start;
        let (mut cost, mut g, mut h) = self.squares(pairs, &at)?;
        let mut damping = 1e-3;
        for _ in 0..STEPS {
            let mut damped = h;
            for i in 0..6 {
                damped[(i, i)] *= 1.0 + damping;
            }
            let step = -damped.cholesky()?.solve(&g);
            let turn = Vector3::new(step[3], step[4], step[5]);
            let next = Frame {
                p: at.p + Vector3::new(step[0], step[1], step[2]),
                r: exp(&turn) * at.r,
            };
            match self.squares(pairs, &next) {
                Some((c, gn, hn)) if c <= cost => {
                    let still = cost - c <= 1e-12 * cost && turn.norm() < 1e-9;
                    (at, cost, g, h) = (next, c, gn, hn);
                    damping = f64::max(0.1 * damping, 1e-12);
                    if still {
                        break;
                    }
                }
                _ => {
                    damping *= 10.0;
                    if damping > 1e12 {
                        break;
                    }
                }
            }
        }
        Some((cost, at, h))
    }
}

/// Root mean square extents of points along their principal axes, largest first.
fn spread(points: &[Vector3<f64>]) -> [f64; 3] {
    let n = points.len().max(1) as f64;
    let centre = points.iter().sum::<Vector3<f64>>() / n;
    let second: Matrix3<f64> = points
        .iter()
        .map(|p| (p - centre) * (p - centre).transpose())
        .sum();
    let mut e: Vec<f64> = (second / n)
        .symmetric_eigenvalues()
        .iter()
        .map(|x| x.max(0.0).sqrt())
        .collect();
    e.sort_by(|a, b| b.total_cmp(a));
    [e[0], e[1], e[2]]
}

/// The 24 turns of a cube, tilted a little so that none looks at a plane target edge on.
fn orientations() -> Vec<Matrix3<f64>> {
    let tilt = exp(&Vector3::new(0.35, 0.25, 0.1));
    let mut out = Vec::with_capacity(24);
    for front in 0..3 {
        for right in (0..3).filter(|r| *r != front) {
            for (a, b) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
                let (mut x, mut z) = (Vector3::zeros(), Vector3::zeros());
                x[right] = a;
                z[front] = b;
                let y = z.cross(&x);
                out.push(Matrix3::from_columns(&[x, y, z]) * tilt);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests;
