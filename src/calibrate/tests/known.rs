//! What the file states beside the readings: places of base and target, covariances of poses.

use super::*;
use crate::calibrate::entry::KnownPlace;
use crate::calibrate::frame::{Frame, exp};
use nalgebra::{Matrix6, UnitQuaternion, Vector3};

fn exact(frame: Frame) -> Option<KnownPlace> {
    Some(KnownPlace { frame, std: None })
}

fn seen(name: &str, kind: Kind, std: [f64; 2]) -> (Opened, Calibration) {
    let opened = open(name, None).unwrap();
    let c = made(&opened, kind, std, [0.001, 0.001], [60, 60], 8, 0);
    (opened, c)
}

#[test]
fn known_places_leave_the_unknowns_of_the_robot_alone() {
    let [base, target] = places();
    // of an arm two errors of each joint but the last pass through its turn into the next joint
    for (name, robot) in [("hexapod", [42, 42]), ("ur5e", [36 - 2 * 5, 36])] {
        let (opened, mut c) = seen(name, Kind::Pose, [3e-5, 3e-5]);
        let counted = |c: &Calibration| {
            let (errors, found) = after(&opened, c, Settings::default());
            let known = &found.identifiability;
            ([known.rank, known.total], errors.rms)
        };
        let (free, without) = counted(&c);
        c.measurements[0].base_at = exact(base);
        assert_eq!(counted(&c).0[1], free[1] - 6, "{name}");
        c.measurements[0].target_at = exact(target);
        let (both, with) = counted(&c);
        assert_eq!(both, robot, "{name}");
        // nothing but numbers that are known is stated: held out, the robot is known no worse
        assert!(with < 1.1 * without && with < 1e-4, "{with} {without}");
        // with a standard deviation they are unknowns as before, held by it
        let std = Some([1e-5; 2]);
        c.measurements[0].base_at = Some(KnownPlace { frame: base, std });
        let (held, close) = counted(&c);
        assert_eq!(held[1], robot[1] + 6, "{name}");
        assert!(close < 1.1 * without, "{close} {without}");
        // and the diagnosis of the poses finds the errors that there are
        c.measurements[0].base_at = exact(base);
        let ask = gap::Ask {
            next: false,
            seed: 1,
        };
        let found = gap::diagnose(&c, &opened, ask).unwrap();
        assert!(!found.found.findings.is_empty(), "{name}");
    }
}

#[test]
fn a_place_that_the_rows_contradict_is_an_error() {
    let [base, target] = places();
    let (opened, c) = seen("ur5e", Kind::Position, [5e-5, 1e-3]);
    // a tracker does not see how the target is turned
    let known = |base_at, target_at| {
        let mut c = c.clone();
        c.measurements[0].base_at = base_at;
        c.measurements[0].target_at = target_at;
        c
    };
    let right = known(exact(base), exact(target));
    assert!(after(&opened, &right, Settings::default()).0.rms < 3e-4);
    let off = Frame {
        p: base.p + Vector3::new(0.0, 0.0, 0.3),
        ..base
    };
    let turned = Frame {
        r: base.r * exp(&Vector3::new(0.0, 0.0, 0.5)),
        ..base
    };
    for (at, what) in [
        (known(exact(off), None), "base_at do not fit"),
        (known(exact(base.inverse()), None), "base_at do not fit"),
        (known(exact(turned), exact(target)), "base_at and target_at"),
        (known(None, exact(off)), "target_at do not fit"),
    ] {
        let error = calibrate(&at, &opened, Settings::default()).map(|_| ());
        let error = error.unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    }
}

#[test]
fn known_places_are_read_from_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("calibration.toml");
    let rows = "q1,q2,q3,q4,q5,q6,x,y,z,qw,qx,qy,qz\n".to_string()
        + &"0,0,0,0,0,0,0,0,1,1,0,0,0\n".repeat(4);
    std::fs::write(folder.path().join("rows.csv"), rows).unwrap();
    let read = |kind: &str, keys: &str| {
        let text = format!(
            "robot = \"ur5e\"\n[[measurement]]\nkind = \"{kind}\"\nfile = \"rows.csv\"\n{keys}\n"
        );
        std::fs::write(&path, text).unwrap();
        super::read(&path).map(|r| r.0)
    };
    let c = read(
        "pose",
        "base_at = [1, 2, 3, 0, 0, 0, 1]\ntarget_at = [0, 0, 0.1, 1, 0, 0, 0]\ntarget_at_std = [1e-4, 1e-3]",
    );
    let m = &c.unwrap().measurements[0];
    let base = m.base_at.unwrap();
    assert_eq!(base.frame.p, Vector3::new(1.0, 2.0, 3.0));
    let half = UnitQuaternion::from_euler_angles(0.0, 0.0, std::f64::consts::PI);
    assert!((base.frame.r - half.to_rotation_matrix().matrix()).norm() < 1e-12);
    assert!(base.std.is_none());
    assert_eq!(m.target_at.unwrap().std, Some([1e-4, 1e-3]));
    for (kind, keys, what) in [
        ("pose", "base_at = [0, 0, 0, 1, 1, 0, 0]", "of length 1"),
        ("pose", "base_at = [0, 0, 0, 1, 0, 0]", "7"),
        ("pose", "target_at_std = [1, 1]", "there is none"),
        (
            "pose",
            "base_at = [0, 0, 0, 1, 0, 0, 0]\nbase_at_std = [0, 1]",
            "two positive numbers",
        ),
        (
            "point",
            "base_at = [0, 0, 0, 1, 0, 0, 0]",
            "a camera or a tracker",
        ),
    ] {
        let error = read(kind, keys).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    }
}

#[test]
fn a_dull_direction_of_the_camera_is_not_held_against_the_robot_of_the_file() {
    let (opened, mut c) = seen("ur5e", Kind::Pose, [1e-5, 1e-4]);
    let before = |c: &Calibration| {
        let found = calibrate(c, &opened, Settings::default()).unwrap();
        Stats::of(&found.errors(false, true)[0]).unwrap().mean
    };
    let even = before(&c);
    // depth is two hundred times worse than what is seen across
    let square = [1e-5, 1e-5, 2e-3, 1e-4, 1e-4, 1e-4].map(|s: f64| s * s);
    for row in &mut c.rows {
        row.covariance = Some(Matrix6::from_diagonal(&square.into()));
    }
    let dull = before(&c);
    assert!(dull < 1.2 * even, "{dull} {even}");
}
