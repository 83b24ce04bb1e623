//! Starting poses in closed form, and what they tell of mistaken files.
//!
//! From nominal poses `T_be` and measured poses `T_ct = T_cb T_be T_et`: `R_cb` turns relative rotation vectors and
//! differences of positions of the base into those of the camera (Kabsch 1976), `R_et` is the mean of
//! `R_beᵀ R_cbᵀ R_ct`, and `p_ct = p_cb + R_cb p_be + R_cb R_be p_et` is linear in what is left. Two rounds leave out
//! the worst third of the rows.

use super::file::Calibration;
use super::frame::{Frame, log, middle, nearest_rotation};
use super::kin::Kin;
use super::kind::Kind;
use super::layout::Start;
use super::row::Value;
use crate::error::{Error, Result};
use nalgebra::{DMatrix, DVector, Matrix3, Quaternion, UnitQuaternion, Vector3};

/// One posture: the frame in the base, and the target as the instrument sees it.
#[derive(Debug, Clone, Copy)]
struct Pair {
    base: Frame,
    seen: Vector3<f64>,
    turned: Option<Matrix3<f64>>,
}

/// Camera, target, and how well they fit.
#[derive(Debug, Clone, Copy)]
struct Aligned {
    camera: Frame,
    target: Frame,
    /// median distance of what is seen from what is predicted, m; a rotation of 1 rad counts as the spread of the
    /// positions
    error: f64,
    /// spread of the positions in the base, m
    spread: f64,
}

/// Residual beyond this fraction of the spread makes a file suspicious.
const SUSPICIOUS: f64 = 0.08;
/// Share of the target in what postures do not tell of camera against target: a target is near its platform, the camera
/// is not. Half of each would put a tilt of the target on the camera's distance as a lever.
const NEAR: f64 = 0.01;
/// Weight of turns about an axis that is exact against that of positions, m²/rad²: 2 mm by which the robot is off at a
/// position against 1 mrad of a camera.
const EXACT: f64 = 4.0;
/// Positions and orientations are those of a mirror image.
const MIRRORED: &str =
    "the target is mirrored, or the camera's axes are left-handed; turn one axis about";
/// An explanation must lower the residual to this fraction.
const EXPLAINED: f64 = 0.25;

fn spread(points: impl Iterator<Item = Vector3<f64>> + Clone) -> (Vector3<f64>, f64) {
    let n = points.clone().count().max(1) as f64;
    let mean = points.clone().sum::<Vector3<f64>>() / n;
    let square: f64 = points.map(|p| (p - mean).norm_squared()).sum();
    (mean, (square / n).sqrt())
}

/// Camera and target of some pairs. `exact`: the axis that the frame turns about is the robot's and no matter of
/// tolerances, so that turns tell the tilt of the camera better than positions do.
fn align(pairs: &[Pair], exact: bool) -> Option<Aligned> {
    let mut kept: Vec<Pair> = pairs.to_vec();
    let mut result = None;
    for _ in 0..3 {
        let found = once(&kept, pairs, exact)?;
        let mut errors: Vec<(f64, Pair)> =
            pairs.iter().map(|p| (distance(&found, p), *p)).collect();
        errors.sort_by(|a, b| a.0.total_cmp(&b.0));
        let most = (2 * errors.len()).div_ceil(3).max(4).min(errors.len());
        kept = errors[..most].iter().map(|e| e.1).collect();
        result = Some(found);
    }
    result
}

fn distance(a: &Aligned, p: &Pair) -> f64 {
    let seen = a.camera.then(&p.base).then(&a.target);
    let turn = p
        .turned
        .map_or(0.0, |r| log(&(seen.r * r.transpose())).norm());
    (seen.p - p.seen).norm() + a.spread * turn
}

fn once(pairs: &[Pair], all: &[Pair], exact: bool) -> Option<Aligned> {
    let n = pairs.len();
    if n < 3 {
        return None;
    }
    let (mean_seen, _) = spread(pairs.iter().map(|p| p.seen));
    let (_, size) = spread(pairs.iter().map(|p| p.base.p));
    let mut target = Frame::identity();
    let mut camera = Frame::identity();
    for _ in 0..30 {
        let tip = |p: &Pair| p.base.p + p.base.r * target.p;
        let (mean_base, _) = spread(pairs.iter().map(tip));
        let mut m = Matrix3::zeros();
        for (k, p) in pairs.iter().enumerate() {
            m += (p.seen - mean_seen) * (tip(p) - mean_base).transpose();
            for other in [&pairs[(k + 1) % n], &pairs[(k + n / 2) % n]] {
                if let (Some(a), Some(b)) = (p.turned, other.turned) {
                    let seen = log(&(a * b.transpose()));
                    let base = log(&(p.base.r * other.base.r.transpose()));
                    m += seen
                        * base.transpose()
                        * if exact {
                            EXACT
                        } else {
                            (size * size).max(1e-6)
                        };
                }
            }
        }
        let (r, _) = nearest_rotation(&m)?;
        camera.r = r;
        if pairs.iter().all(|p| p.turned.is_some()) {
            let sum = pairs
                .iter()
                .filter_map(|p| Some(p.base.r.transpose() * r.transpose() * p.turned?));
            target.r = nearest_rotation(&sum.sum())?.0;
        }
        let mut a = DMatrix::zeros(3 * n, 6);
        let mut b = DVector::zeros(3 * n);
        for (k, p) in pairs.iter().enumerate() {
            let turned = r * p.base.r;
            let rest = p.seen - r * p.base.p;
            for i in 0..3 {
                a[(3 * k + i, i)] = 1.0;
                for j in 0..3 {
                    a[(3 * k + i, 3 + j)] = NEAR * turned[(i, j)];
                }
                b[3 * k + i] = rest[i];
            }
        }
        let x = a
            .svd(true, true)
            .solve(&b, 1e-6 * NEAR * (n as f64).sqrt())
            .ok()?;
        let next = Vector3::new(x[3], x[4], x[5]) * NEAR;
        let change = (next - target.p).norm();
        camera.p = Vector3::new(x[0], x[1], x[2]);
        target.p = next;
        if change < 1e-7 {
            break;
        }
    }
    let mut found = Aligned {
        camera,
        target,
        error: 0.0,
        spread: size,
    };
    let mut errors: Vec<f64> = all.iter().map(|p| distance(&found, p)).collect();
    errors.sort_by(f64::total_cmp);
    found.error = errors[errors.len() / 2];
    Some(found)
}

/// Camera and target where one or both of them are stated; the other one as the rows have it then.
fn stated(found: &Aligned, pairs: &[Pair], at: [Option<Frame>; 2]) -> Aligned {
    let mut placed = *found;
    if let [None, None] = at {
        return placed;
    }
    placed.camera = at[0].unwrap_or(placed.camera);
    placed.target = at[1].unwrap_or(placed.target);
    let n = pairs.len().max(1) as f64;
    if at[1].is_none() {
        let back = placed.camera.r.transpose();
        let turns = (pairs.iter()).filter_map(|p| Some(p.base.r.transpose() * back * p.turned?));
        placed.target.r = nearest_rotation(&turns.sum()).map_or(placed.target.r, |r| r.0);
        let shift =
            |p: &Pair| p.base.r.transpose() * (back * (p.seen - placed.camera.p) - p.base.p);
        placed.target.p = pairs.iter().map(shift).sum::<Vector3<f64>>() / n;
    }
    if at[0].is_none() {
        let turns = (pairs.iter())
            .filter_map(|p| Some(p.turned? * (p.base.r * placed.target.r).transpose()));
        placed.camera.r = nearest_rotation(&turns.sum()).map_or(placed.camera.r, |r| r.0);
        let shift = |p: &Pair| p.seen - placed.camera.r * p.base.then(&placed.target).p;
        placed.camera.p = pairs.iter().map(shift).sum::<Vector3<f64>>() / n;
    }
    let mut errors: Vec<f64> = pairs.iter().map(|p| distance(&placed, p)).collect();
    errors.sort_by(f64::total_cmp);
    placed.error = errors.get(errors.len() / 2).copied().unwrap_or(0.0);
    placed
}

/// What a mistaken file may mean, in words, and how it would be read then.
fn explanations(pairs: &[Pair], degrees: Option<Vec<Frame>>) -> Vec<(&'static str, Vec<Pair>)> {
    let map = |f: &dyn Fn(&Pair) -> Pair| pairs.iter().map(f).collect::<Vec<_>>();
    let reordered = |r: Matrix3<f64>| {
        let q = UnitQuaternion::from_matrix(&r);
        let q = Quaternion::new(q.k, q.w, q.i, q.j);
        *UnitQuaternion::from_quaternion(q)
            .to_rotation_matrix()
            .matrix()
    };
    let flip = |k: usize| {
        let mut s = Matrix3::identity();
        s[(k, k)] = -1.0;
        s
    };
    let mut all = vec![
        (
            "the measured positions are millimetres; write metres",
            map(&|p| Pair {
                seen: p.seen * 1e-3,
                ..*p
            }),
        ),
        (
            "the quaternions are written x, y, z, w; write qw, qx, qy, qz",
            map(&|p| Pair {
                turned: p.turned.map(reordered),
                ..*p
            }),
        ),
        (
            "positions are millimetres and quaternions are written x, y, z, w; write metres and qw, qx, qy, qz",
            map(&|p| Pair {
                seen: p.seen * 1e-3,
                turned: p.turned.map(reordered),
                ..*p
            }),
        ),
        (
            "the poses are those of the camera in the frame of the target; write those of the target in the frame \
             of the camera",
            map(&|p| match p.turned {
                Some(r) => Pair {
                    seen: -(r.transpose() * p.seen),
                    turned: Some(r.transpose()),
                    ..*p
                },
                None => *p,
            }),
        ),
    ];
    for k in 0..3 {
        let s = flip(k);
        all.push((
            MIRRORED,
            map(&|p| Pair {
                seen: s * p.seen,
                turned: p.turned.map(|r| s * r * s),
                ..*p
            }),
        ));
        all.push((
            "the positions are mirrored; turn one of the camera's axes about",
            map(&|p| Pair {
                seen: s * p.seen,
                ..*p
            }),
        ));
        all.push((
            "the orientations are mirrored: a target, or its points, that is the mirror image of the real one",
            map(&|p| Pair {
                turned: p.turned.map(|r| s * r * s),
                ..*p
            }),
        ));
        all.push((
            "the axes of the target are mirrored; print it again, or turn one of its axes about",
            map(&|p| Pair {
                turned: p.turned.map(|r| r * s),
                ..*p
            }),
        ));
    }
    if let Some(frames) = degrees {
        let again = pairs.iter().zip(frames);
        all.push((
            "the joint readings are degrees; write radians",
            again.map(|(p, base)| Pair { base, ..*p }).collect(),
        ));
    }
    all
}

/// Starts of all set-ups, at the nominal geometry.
///
/// # Errors
/// Too few rows, and poses that no camera and target can explain: with what the file seems to mean.
pub fn start(input: &Calibration, kin: &Kin, poses: &[Option<Frame>]) -> Result<Start> {
    let count = input.measurements.len();
    let mut start = Start::none(count);
    for m in 0..count {
        let measured = &input.measurements[m];
        let same = |o: usize| {
            let other = &input.measurements[o];
            other.kind.has_instrument() && other.instrument == measured.instrument
        };
        if measured.kind.has_instrument() {
            if let Some(first) = (0..m).find(|&o| same(o)) {
                start.camera[m] = start.camera[first];
                start.target[m] = start.target[first];
                continue;
            }
            let fits = |r: &super::row::Row| same(r.measurement);
            let any_fit = input.rows.iter().any(|r| fits(r) && r.fit);
            let mut pairs = Vec::new();
            let mut degrees = Some(Vec::new());
            for (r, base) in input.rows.iter().zip(poses) {
                let Some(base) = base.filter(|_| fits(r) && (r.fit || !any_fit)) else {
                    continue;
                };
                let (seen, turned) = match r.value {
                    Value::Pose(f) => (f.p, Some(f.r)),
                    Value::Position(p) => (p, None),
                    _ => continue,
                };
                pairs.push(Pair { base, seen, turned });
                let turned: Vec<f64> = r.q.iter().map(|q| q.to_radians()).collect();
                degrees = match (degrees, kin.nominal(&turned)) {
                    (Some(mut list), Ok(p)) => {
                        list.push(p);
                        Some(list)
                    }
                    _ => None,
                };
            }
            let about = |why: String| Error::file(&input.path, measured.file.clone(), why);
            let exact = matches!(kin, Kin::Parallel(p) if p.held().len() == 2);
            let Some(found) = align(&pairs, exact) else {
                return Err(about(format!(
                    "{} usable rows for the {}; at least 3 different ones are needed to find where it stands",
                    pairs.len(),
                    measured.instrument
                )));
            };
            if found.spread < 1e-4 {
                return Err(about(format!(
                    "all postures are the same: the frame moves by {} mm; record postures that differ",
                    crate::error::number(1e3 * found.spread)
                )));
            }
            if found.error > SUSPICIOUS * found.spread {
                let best = explanations(&pairs, degrees)
                    .into_iter()
                    .filter_map(|(why, pairs)| Some((align(&pairs, exact)?, why)))
                    .min_by(|a, b| (a.0.error / a.0.spread).total_cmp(&(b.0.error / b.0.spread)));
                if let Some((other, why)) = best
                    && other.error / other.spread < EXPLAINED * found.error / found.spread
                    && other.error < SUSPICIOUS * other.spread
                {
                    // legs between two planes hold a platform on either side of the base
                    let branch = match kin {
                        Kin::Parallel(_) if why == MIRRORED => {
                            "; or the platform stands in the mirrored assembly mode, on the other side of its base"
                        }
                        _ => "",
                    };
                    return Err(about(format!(
                        "no place of the {} explains what it saw (off by {} mm), but it looks as if {why}{branch} (then \
                         {} mm)",
                        measured.instrument,
                        crate::error::number((1e3 * found.error).round()),
                        crate::error::number((1e4 * other.error).round() / 10.0),
                    )));
                }
            }
            let at = [measured.base_at, measured.target_at].map(|k| k.map(|k| k.frame));
            let placed = stated(&found, &pairs, at);
            if placed.error > (SUSPICIOUS * found.spread).max(found.error) {
                return Err(about(format!(
                    "{} do not fit what was seen: with them the target is off by {} mm in the middle of the rows, and by {} mm \
                     with places found from the rows. base_at is the base in the frame of the {}, target_at the target in \
                     the frame that is measured",
                    match at {
                        [Some(_), Some(_)] => "base_at and target_at",
                        [Some(_), None] => "the numbers of base_at",
                        _ => "the numbers of target_at",
                    },
                    crate::error::number((1e3 * placed.error).round()),
                    crate::error::number((1e4 * found.error).round() / 10.0),
                    measured.instrument,
                )));
            }
            start.camera[m] = placed.camera;
            start.target[m] = placed.target;
            continue;
        }
        if measured.kind.is_loop() {
            (start.grip[m], start.ball[m]) = super::closed::start(input, kin, m, poses);
            continue;
        }
        let own: Vec<(Vector3<f64>, f64)> = input
            .rows
            .iter()
            .zip(poses)
            .filter(|(r, _)| r.measurement == m)
            .filter_map(|(r, p)| {
                let reading = match r.value {
                    Value::Reading(s) => s,
                    _ => 0.0,
                };
                Some(((*p)?.p, reading))
            })
            .collect();
        let points: Vec<Vector3<f64>> = own.iter().map(|p| p.0).collect();
        if measured.kind == Kind::Point {
            start.socket[m] = middle(&points);
            continue;
        }
        let (mean, _) = spread(points.iter().copied());
        let scatter: Matrix3<f64> = points
            .iter()
            .map(|p| (p - mean) * (p - mean).transpose())
            .sum();
        let eigen = scatter.symmetric_eigen();
        let mut normal = eigen
            .eigenvectors
            .column(eigen.eigenvalues.imin())
            .into_owned();
        // the gauge reads upwards along the normal
        let along: f64 = own.iter().map(|(p, s)| s * normal.dot(&(p - mean))).sum();
        if along < 0.0 {
            normal = -normal;
        }
        let offset =
            own.iter().map(|(p, s)| normal.dot(p) - s).sum::<f64>() / own.len().max(1) as f64;
        start.plane[m] = (normal, offset);
    }
    Ok(start)
}
