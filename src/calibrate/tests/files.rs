//! Files that are written and read, and files with mistakes.

use super::*;

#[test]
fn a_calibrated_file_is_read_back_with_the_calibrated_geometry() {
    for name in ["h4", "hexapod", "ur5e"] {
        let opened = open(name, None).unwrap();
        let r = &mut ChaCha8Rng::seed_from_u64(9);
        let x: Vec<f64> = opened
            .kin
            .unknowns([0.003, 0.01])
            .iter()
            .map(|u| u.prior * normal(r))
            .collect();
        let files = write::robot(&opened, &x).unwrap();
        let dir = tempfile::tempdir().unwrap();
        for (file, text) in &files {
            std::fs::write(dir.path().join(file), text).unwrap();
        }
        let last = dir.path().join(files[files.len() - 1].0);
        let again = open(last.to_str().unwrap(), None).unwrap();
        for q in postures(&opened, r, 10) {
            let Ok(want) = opened.kin.pose(&q, &x, &[], &[], None) else {
                continue;
            };
            let zeros = vec![0.0; again.kin.errors()];
            let got = again.kin.pose(&q, &zeros, &[], &[], None).unwrap();
            assert!((want.frame.p - got.frame.p).norm() < 1e-9, "{name}");
            assert!((want.frame.r - got.frame.r).norm() < 1e-9, "{name}");
        }
    }
}

#[test]
fn mistaken_files_are_said_to_be_what_they_are() {
    let opened = open("ur5e", None).unwrap();
    let poses = || {
        made(
            &opened,
            Kind::Pose,
            [3e-4, 3.5e-4],
            [0.001, 0.002],
            [30, 5],
            10,
            0,
        )
    };
    let good = poses();
    let change = |f: &dyn Fn(&mut Row)| {
        let mut c = poses();
        c.rows.iter_mut().for_each(f);
        calibrate(&c, &opened, Settings::default())
            .map(|_| ())
            .unwrap_err()
            .to_string()
    };
    assert!(calibrate(&good, &opened, Settings::default()).is_ok());
    let pose = |r: &mut Row, f: &dyn Fn(Frame) -> Frame| {
        if let Value::Pose(p) = r.value {
            r.value = Value::Pose(f(p));
        }
    };
    let said = change(&|r| pose(r, &|p| Frame { p: p.p * 1e3, ..p }));
    assert!(said.contains("millimetres"), "{said}");
    let said = change(&|r| r.q.iter_mut().for_each(|q| *q = q.to_degrees()));
    assert!(said.contains("degrees"), "{said}");
    let said = change(&|r| pose(r, &|p| p.inverse()));
    assert!(said.contains("camera in the frame of the target"), "{said}");
    let said = change(&|r| {
        pose(r, &|p| {
            let q = nalgebra::UnitQuaternion::from_matrix(&p.r);
            let q = nalgebra::Quaternion::new(q.i, q.j, q.k, q.w);
            Frame {
                r: *nalgebra::UnitQuaternion::from_quaternion(q)
                    .to_rotation_matrix()
                    .matrix(),
                ..p
            }
        })
    });
    assert!(said.contains("qw, qx, qy, qz"), "{said}");
    let mirror = nalgebra::Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0));
    let said = change(&|r| {
        pose(r, &|p| Frame {
            p: mirror * p.p,
            ..p
        })
    });
    assert!(said.contains("the positions are mirrored"), "{said}");
    let said = change(&|r| {
        pose(r, &|p| Frame {
            r: mirror * p.r * mirror,
            ..p
        })
    });
    assert!(said.contains("the orientations are mirrored"), "{said}");
    let said = change(&|r| r.q.swap(1, 2));
    assert!(said.contains("no geometry near"), "{said}");
    let first = good.rows[0].q.clone();
    let mut same = poses();
    same.rows.iter_mut().for_each(|r| r.q.clone_from(&first));
    let said = calibrate(&same, &opened, Settings::default())
        .map(|_| ())
        .unwrap_err()
        .to_string();
    assert!(said.contains("the same"), "{said}");
}
