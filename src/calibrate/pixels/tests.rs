//! Cameras that are found from the pixels of points.

use super::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn optics() -> Optics {
    Optics {
        camera: Camera {
            fx: 1400.0,
            fy: 1380.0,
            cx: 960.0,
            cy: 540.0,
            k1: -0.12,
            k2: 0.05,
            p1: 8e-4,
            p2: -5e-4,
            k3: -0.01,
        },
        points: (0..48)
            .map(|k| Vector3::new(0.03 * f64::from(k % 8), 0.03 * f64::from(k / 8), 0.0))
            .collect(),
        std: 0.1,
    }
}

fn pose(r: &mut ChaCha8Rng) -> Frame {
    let mut any = |s: f64| r.random_range(-s..s);
    // a target that looks at the camera, tilted by 0.2 rad or more
    let tilt = Vector3::new(0.2 + any(0.1).abs() * 4.0, any(0.4), any(3.0));
    Frame {
        p: Vector3::new(any(0.15), any(0.1), 0.9 + any(0.3)),
        r: exp(&Vector3::new(tilt.x, tilt.y, 0.0)) * exp(&Vector3::new(0.0, 0.0, tilt.z)),
    }
}

#[test]
fn what_a_camera_sees_moves_as_differences_say() {
    let c = optics().camera;
    let p = Vector3::new(0.21, -0.13, 0.8);
    let (_, by) = c.project(&p).unwrap();
    for k in 0..3 {
        let mut d = Vector3::zeros();
        d[k] = 1e-6;
        let slope = (c.project(&(p + d)).unwrap().0 - c.project(&(p - d)).unwrap().0) / 2e-6;
        assert!((slope - by.column(k)).norm() < 1e-4, "{k}");
    }
    assert!(c.project(&Vector3::new(0.0, 0.0, -1.0)).is_none());
}

#[test]
fn poses_come_back_from_pictures_and_their_covariance_is_that_of_the_errors() {
    let (o, r) = (optics(), &mut ChaCha8Rng::seed_from_u64(5));
    let (mut sum, mut count) = (0.0, 0);
    for k in 0..120 {
        let truth = pose(r);
        let mut seen: Vec<f64> = Vec::new();
        for x in &o.points {
            let (u, _) = o.camera.project(&(truth.r * x + truth.p)).unwrap();
            // near enough to a normal distribution of this standard deviation
            let mut noise = || o.std * (0..12).map(|_| r.random_range(-0.5..0.5)).sum::<f64>();
            seen.extend([u.x + noise(), u.y + noise()]);
        }
        // points that were not found, and one that was mistaken for another
        seen[10] = f64::NAN;
        if k % 2 == 0 {
            seen[20] += 40.0;
        }
        let found = o.solve(&seen).unwrap();
        assert_eq!(found.left_out, usize::from(k % 2 == 0), "{k}");
        let d = found.pose.p - truth.p;
        let w = super::super::frame::log(&(found.pose.r * truth.r.transpose()));
        let e = Vector6::new(d.x, d.y, d.z, w.x, w.y, w.z);
        sum += e.dot(&(found.covariance.try_inverse().unwrap() * e));
        count += 6;
        assert!(d.norm() < 2e-3 && w.norm() < 1e-2, "{k}: {d} {w}");
    }
    let chi = sum / f64::from(count);
    assert!((0.8..1.25).contains(&chi), "{chi}");
}

#[test]
fn pictures_that_tell_no_pose_are_refused() {
    let o = optics();
    let none = vec![f64::NAN; 96];
    assert!(o.solve(&none).unwrap_err().contains("at least 4"));
    // far away and straight ahead: the mirror pose fits as well
    let far = Frame {
        p: Vector3::new(0.0, 0.0, 60.0),
        r: exp(&Vector3::new(0.25, 0.0, 0.0)),
    };
    let seen: Vec<f64> = o
        .points
        .iter()
        .flat_map(|x| {
            let u = o.camera.project(&(far.r * x + far.p)).unwrap().0;
            [u.x, u.y]
        })
        .collect();
    assert!(o.solve(&seen).unwrap_err().contains("two poses"));
}
