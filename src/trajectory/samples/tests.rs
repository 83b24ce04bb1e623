use super::*;
use crate::trajectory::Series;

fn motion() -> Fourier {
    let a = Series {
        constant: 0.3,
        sin: vec![0.5, -1e-7],
        cos: vec![0.2, 0.4],
    };
    let b = Series {
        constant: -1.0,
        sin: vec![0.0, 0.7],
        cos: vec![0.1, 0.0],
    };
    Fourier::new(1.5, vec![1, 4], vec![a, b]).unwrap()
}

/// Writes so many periods of [`motion`] at `rate` hertz; how many samples these are.
fn write(path: &Path, periods: u32, rate: f64, torque: &TorqueFn) -> Result<usize> {
    let f = motion();
    let times = times(f.period * f64::from(periods), rate)?;
    let at = |t: f64, out: [&mut [f64]; 3]| f.evaluate(t, out);
    write_along(path, false, f.dof(), &times, &at, Some(torque))?;
    Ok(times.len())
}

#[test]
fn written_samples_read_back_exactly() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("samples.csv");
    let f = motion();
    let torque = |q: &[f64], qd: &[f64], qdd: &[f64], tau: &mut [f64]| {
        tau.iter_mut()
            .enumerate()
            .for_each(|(j, v)| *v = q[j] + 1e-20 * qd[j] * qdd[j]);
    };
    let count = write(&path, 2, 100.0, &torque).unwrap();
    assert_eq!(count, 301);
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.starts_with("t,q1,q2,dq1,dq2,ddq1,ddq2,tau1,tau2\n0,"));
    assert_eq!(text.lines().count(), 302);
    let read = read_samples(&path, 2).unwrap();
    assert_eq!((read.len(), read.dof(), read.t[300]), (301, 2, 3.0));
    let [mut q, mut qd, mut qdd] = [[0.0; 2]; 3];
    let [mut rq, mut rqd, mut rqdd] = [[0.0; 2]; 3];
    for i in 0..301 {
        assert_eq!(read.t[i], i as f64 / 100.0);
        f.evaluate(read.t[i], [&mut q, &mut qd, &mut qdd]);
        read.row(i, &mut rq, &mut rqd, &mut rqdd);
        assert_eq!((q, qd, qdd), (rq, rqd, rqdd));
    }
    // and once more through the column store
    let again = dir.path().join("again.csv");
    read.write(&again, false).unwrap();
    assert_eq!(read_samples(&again, 2).unwrap(), read);
}

#[test]
fn the_end_point_is_there_at_any_rate() {
    let t = times(1.0, 3.7).unwrap();
    assert_eq!(t.len(), 5);
    assert_eq!((t[3], t[4]), (3.0 / 3.7, 1.0));
    assert_eq!(times(0.1 * 3.0, 10.0).unwrap().len(), 4);
    assert_eq!(times(0.0, 10.0).unwrap(), [0.0]);
    for (duration, rate) in [(1.0, 0.0), (1.0, f64::NAN), (1.0, 1e9), (f64::NAN, 1.0)] {
        assert!(times(duration, rate).unwrap_err().is_argument());
    }
}

#[test]
fn columns_in_any_order_spaces_and_extras() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("in.csv");
    let text = "\u{feff}note, dq1 ,q1,ddq1, t\r\nhello,  2,1 ,3,0\r\n\r\n,5,4,6e0, 0.5\r\n";
    std::fs::write(&path, text).unwrap();
    let read = read_samples(&path, 1).unwrap();
    assert_eq!(read.t, [0.0, 0.5]);
    assert_eq!(
        (&read.q[0][..], &read.qd[0][..]),
        (&[1.0, 4.0][..], &[2.0, 5.0][..])
    );
    assert_eq!(read.qdd[0], [3.0, 6.0]);
}

#[test]
fn faults_name_file_line_and_column() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("in.csv");
    let cases = [
        ("", "is empty"),
        ("t,q1,dq1,ddq1\n", "no samples"),
        (
            "t,q1,dq1\n0,1,2\n",
            "column ddq1: is missing; the columns are t, q1, dq1",
        ),
        ("t,q1,dq1,ddq1,q1\n0,1,2,3,4\n", "column q1: is there twice"),
        (
            "t,q1,dq1,ddq1\n0,1,2,3\n0,1,2\n",
            "line 3: 3 fields, but the header has 4",
        ),
        (
            "t,q1,dq1,ddq1\n0,1,2,3\n1,x,2,3\n",
            "line 3, column q1: \"x\" is not a finite",
        ),
        ("t,q1,dq1,ddq1\n0,1,NaN,3\n", "line 2, column dq1: \"NaN\""),
        ("t,q1,dq1,ddq1\n0,1,,3\n", "line 2, column dq1: \"\""),
        ("t,q1,dq1,ddq1\ninf,1,2,3\n", "line 2, column t"),
    ];
    for (text, want) in cases {
        std::fs::write(&path, text).unwrap();
        let message = read_samples(&path, 1).unwrap_err().to_string();
        assert!(
            message.contains("in.csv") && message.contains(want),
            "{message}"
        );
    }
    std::fs::write(&path, b"t,q1,dq1,ddq1\n0,\xff\xfe,2,3\n").unwrap();
    assert!(
        read_samples(&path, 1)
            .unwrap_err()
            .to_string()
            .contains("line 2, column q1")
    );
    assert!(matches!(
        read_samples(dir.path().join("none"), 1),
        Err(Error::Io { .. })
    ));
}

#[test]
fn torques_that_are_not_finite_are_not_written() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("samples.csv");
    let torque = |_: &[f64], _: &[f64], _: &[f64], tau: &mut [f64]| tau.fill(f64::NAN);
    let result = write(&path, 1, 10.0, &torque);
    assert!(result.unwrap_err().to_string().contains("not finite"));
    assert!(!path.exists());
}
