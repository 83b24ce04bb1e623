//! Files that are not what they say: sockets exchanged, distances that are wrong, another assembly mode, rows that tell
//! nothing.

use super::*;
use crate::calibrate::frame::{Frame, exp};
use crate::calibrate::kin::Kin;
use crate::calibrate::row::Value;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A posture of an arm with errors `x` whose frame's origin sits in a point.
fn contact(opened: &Opened, x: &[f64], at: Vector3<f64>, r: &mut ChaCha8Rng) -> Vec<f64> {
    let place = |q: &[f64]| opened.kin.pose(q, x, &[], &[], None).unwrap().frame.p;
    loop {
        let n = opened.joints.len();
        let mut q: Vec<f64> = (0..n).map(|_| r.random_range(-2.0..2.0)).collect();
        for _ in 0..60 {
            let off = at - place(&q);
            if off.norm() < 1e-9 {
                return q;
            }
            let h = 1e-6;
            let j = DMatrix::from_fn(3, n, |i, k| {
                let mut step = q.clone();
                step[k] += h;
                (place(&step)[i] - place(&q)[i]) / h
            });
            let rhs = DVector::from_column_slice(off.as_slice());
            let d = j.svd(true, true).solve(&rhs, 1e-3).unwrap();
            let cut = (0.3 / d.amax().max(1e-12)).min(1.0);
            q.iter_mut().zip(d.iter()).for_each(|(q, d)| *q += cut * d);
        }
    }
}

/// Three plates with two sockets each, 50 mm apart: a real arm's errors, 0.1 mm of noise.
fn sockets(opened: &Opened) -> Calibration {
    let r = &mut ChaCha8Rng::seed_from_u64(11);
    let tolerance = [0.001, 0.003];
    let unknowns = opened.kin.unknowns(tolerance);
    let x: Vec<f64> = unknowns.iter().map(|u| u.prior * normal(r)).collect();
    let plates = [[0.4, 0.0, 0.1], [0.1, 0.5, 0.2], [-0.4, 0.2, 0.3]];
    let (mut files, mut rows) = (Vec::new(), Vec::new());
    for (k, plate) in plates.iter().enumerate() {
        for hole in 0..2 {
            let centre = Vector3::from(*plate) + Vector3::new(0.0, 0.05 * f64::from(hole), 0.0);
            for _ in 0..15 {
                let off = Vector3::from_fn(|_, _| 1e-4 * normal(r));
                let q = contact(opened, &x, centre + off, r);
                rows.push(row(files.len(), q, Value::Contact, true));
            }
            let name = format!("plate{k}/hole{hole}.csv");
            let group = format!("plate{k}");
            files.push(measurement(Kind::Point, &name, &group, [1e-4, 1e-3]));
        }
    }
    let mut c = input(files, rows, tolerance);
    c.effects = Some(Vec::new());
    c.distances = (0..3)
        .map(|k| Distance {
            between: [2 * k, 2 * k + 1],
            value: 0.05,
            std: 1e-4,
        })
        .collect();
    c
}

fn said(c: &Calibration, opened: &Opened) -> String {
    let found = calibrate(c, opened, Settings::default());
    found.map(|_| ()).unwrap_err().to_string()
}

#[test]
fn exchanged_sockets_and_wrong_distances_are_named() {
    let opened = open("ur5e", None).unwrap();
    let good = sockets(&opened);
    let found = calibrate(&good, &opened, Settings::default()).unwrap();
    let about = |w: &&crate::error::Warning| w.subject.contains("distance");
    assert!(!found.warnings.iter().any(|w| about(&w)));
    let [_, errors] = found.errors(true, true);
    assert!(Stats::of(&errors).unwrap().mean < 2e-4);
    // the files of two sockets are exchanged
    let mut c = good.clone();
    for row in &mut c.rows {
        row.measurement = [2, 1, 0, 3, 4, 5][row.measurement];
    }
    let error = said(&c, &opened);
    for part in [
        "distance between plate0/hole0.csv and plate0/hole1.csv: 50 mm are stated",
        "plate0/hole0.csv and plate1/hole0.csv",
        "exchanged",
    ] {
        assert!(error.contains(part), "{error}");
    }
    // all distances are wrong, by little and by a factor
    for value in [0.06, 50.0] {
        let mut c = good.clone();
        c.distances.iter_mut().for_each(|d| d.value = value);
        let error = said(&c, &opened);
        assert!(error.contains("is the number in m"), "{error}");
        let ask = gap::Ask {
            next: false,
            seed: 1,
        };
        assert!(gap::diagnose(&c, &opened, ask).is_err());
    }
    // one of three is: named, left out, and the robot as good as before
    let mut c = good.clone();
    c.distances[1].value = 0.06;
    let survived = calibrate(&c, &opened, Settings::default()).unwrap();
    let named: Vec<_> = survived.warnings.iter().filter(about).collect();
    assert!(
        matches!(named[..], [w] if w.subject.contains("plate1") && w.message.contains("left out")),
        "{named:?}"
    );
    assert_eq!(survived.distances.len(), 2);
    let [_, again] = survived.errors(true, true);
    assert!(Stats::of(&again).unwrap().mean < 2e-4);
}

/// Poses of a hexapod with errors, seen by a camera; `branch` puts the platform elsewhere.
fn seen(
    opened: &Opened,
    rows: usize,
    size: f64,
    branch: &dyn Fn(Frame) -> Frame,
    from: usize,
) -> Calibration {
    let r = &mut ChaCha8Rng::seed_from_u64(12);
    let Kin::Parallel(p) = &opened.kin else {
        panic!("a parallel robot")
    };
    let x: Vec<f64> = (opened.kin.unknowns([0.001, 0.001]).iter())
        .map(|u| size * u.prior * normal(r))
        .collect();
    let camera = Frame {
        r: exp(&Vector3::new(2.8, 0.3, -0.4)),
        p: Vector3::new(0.3, -0.4, 1.8),
    };
    let list = (0..rows).map(|i| {
        let w = &p.mechanism.workspace;
        let task: Vec<f64> = (w.iter())
            .map(|w| r.random_range(w.position[0]..w.position[1]))
            .collect();
        let mut frame = p.frame_of(&task);
        if i >= from {
            frame = branch(frame);
        }
        let zeros = vec![0.0; p.actuators()];
        let q = p.actuators_at(&frame, &zeros, &x, false).value;
        let mut pose = camera.then(&frame);
        pose.p += Vector3::from_fn(|_, _| 3e-4 * normal(r));
        pose.r = exp(&Vector3::from_fn(|_, _| 3e-4 * normal(r))) * pose.r;
        row(
            0,
            q.iter().copied().collect(),
            Value::Pose(pose),
            i < rows - rows / 4,
        )
    });
    let poses = measurement(Kind::Pose, "poses", "poses", [3e-4, 3e-4]);
    input(vec![poses], list.collect(), [0.001, 0.001])
}

/// The mirror image below the base: legs of the same length where both ends lie in planes.
fn below(f: Frame) -> Frame {
    let s = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0));
    Frame {
        r: s * f.r * s,
        p: s * f.p,
    }
}

#[test]
fn another_assembly_mode_is_said_to_be_one() {
    let opened = open("hexapod", None).unwrap();
    let error = said(&seen(&opened, 80, 1.0, &below, 0), &opened);
    assert!(error.contains("mirrored assembly mode"), "{error}");
    // the last fifth only, which is fitted in part: named, and survived
    let c = seen(&opened, 80, 1.0, &below, 50);
    let found = calibrate(&c, &opened, Settings::default()).unwrap();
    let named: Vec<usize> = found.outliers.iter().map(|o| o.row).collect();
    assert!((50..80).all(|k| named.contains(&k)), "{named:?}");
    let [_, sound] = found.errors(true, false);
    assert!(Stats::of(&sound).unwrap().mean < 1e-3);
}

#[test]
fn a_robot_that_is_no_better_than_that_of_the_file_is_not_recommended() {
    let opened = open("hexapod", None).unwrap();
    // a dozen noisy rows of a robot that is as drawn, or not
    let warned = |size: f64, rows: usize| {
        let mut c = seen(&opened, 80, size, &|f| f, 80);
        for (i, row) in c.rows.iter_mut().enumerate() {
            row.fit = i < rows;
        }
        let found = calibrate(&c, &opened, Settings::default()).unwrap();
        let [before, after] = found.errors(false, false).map(|e| Stats::of(&e).unwrap());
        let warned = |w: &crate::error::Warning| {
            w.subject == "rows held out" && w.message.contains("no better")
        };
        let warned = found.warnings.iter().any(warned);
        assert_eq!(warned, after.median > before.median, "{before:?} {after:?}");
        warned
    };
    assert!(warned(0.0, 12) && !warned(1.0, 60));
}
